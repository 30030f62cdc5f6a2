// SPDX-License-Identifier: Apache-2.0
#include "tetap/estimators/attitude.hpp"
#include "tetap/estimators/imu_place.hpp"

namespace tetap::estimators {

Innovation Attitude::fuse(const sensor::ImuSample& sample, base::Micros stamp, const Context& ctx) {
  static_cast<void>(far_turn_.add(sample));
  far_ = stamp;
  const auto& mounting = ctx.parameters.inertial.mounting_bs;
  const auto body = [&mounting](const std::array<float, 3>& s) { return sensor::times(mounting, {s[0], s[1], s[2]}); };
  const base::Micros interval{sample.interval_us};
  const float per_s = 1.0F / base::seconds(interval);  // of no interval: infinite, and refused as that
  const filter::Vector3 rate = per_s * body(sample.dangle_b_rad);
  // Samples that were lost: while there are few, the turn was most likely this one's.
  const base::Micros span = stamp - time_;
  const bool gap = filter_.started() && checks::ImuClassifier::is_gap(span - interval);
  const bool lost = gap && span > kBridged;
  const param::InertialParameters& n = ctx.parameters.inertial;
  filter_.set_range({.gyroscope_radps = n.gyro_range_radps, .accelerometer_mps2 = n.accel_range_mps2});
  filter::Vector3 gained = body(sample.dvelocity_b_mps);
  if (const ImuPlace place(n); !place.is_origin()) {
    const filter::Vector3 now = rate - filter_.bias_b_radps();
    gained -= place.swing_mps(now * base::seconds(interval), gap ? now : rate_b_radps_ - filter_.bias_b_radps(), now);
  }
  const auto verdict = filter_.step(rate, per_s * gained, base::seconds(gap && !lost ? span : interval),
                                    {.gyroscope = sample.clipped_gyro > 0, .accelerometer = sample.clipped_accel > 0});
  if (verdict == filter::AttitudeVerdict::kRefused)
    return {.verdict = sensor::Verdict::kNotFinite, .failed = sensor::Check::kValue};
  // The turn in a gap is unknown by the rate before it and by the rate that the inertial filter assumes in gaps.
  if (lost) {
    const float unseen_radps = n.gap_radps + base::sqrt(filter::dot(rate_b_radps_, rate_b_radps_));
    filter_.lose(base::min(unseen_radps * base::seconds(span), base::kPi));
  }
  rate_b_radps_ = rate;
  time_ = stamp;
  return {.verdict = sensor::Verdict::kAccepted};
}

Innovation Attitude::fuse(const sensor::MagneticFlux& sample, base::Micros stamp, const Context& ctx) {
  const param::MagneticParameters& n = ctx.parameters.magnetic;
  if (n.use == 0 || !filter_.started()) return {};
  const filter::Vector3 field = field_b_uT(sample, n);
  // The body's axes at the last IMU sample are the filter's; what it turned since is taken back.
  const float later_s = base::seconds(stamp - time_ < kBridged ? stamp - time_ : base::Micros{0});
  const filter::Vector3 then = field + filter::cross(later_s * (rate_b_radps_ - filter_.bias_b_radps()), field);
  constexpr base::Micros kFirst{10'000};
  const base::Micros since = filter_.heading_known() ? stamp - field_time_ : kFirst;
  if (!filter_.magnetometer(then, base::seconds(since)))
    return {.verdict = sensor::Verdict::kNotFinite, .failed = sensor::Check::kValue};
  field_time_ = stamp;
  if (filter_.magnetometer_disturbed()) return {.verdict = sensor::Verdict::kRejected, .failed = sensor::Check::kField};
  return {.verdict = sensor::Verdict::kAccepted};
}

void Attitude::arrived(const sensor::Sample& sample, const Context& ctx) {
  if (is_imu(sample, ctx.parameters.inertial.imu) && sample.stamp <= seen_) anew_ = true;
}

/// Takes the window's samples that came since the last tick; all of them when one came late.
void Attitude::follow(const sensor::Window& window, const Context& ctx) {
  std::size_t i = 0;
  if (anew_ || far_ > seen_) {
    turn_ = far_turn_;
    seen_ = far_;
    last_imu_ = time_;
    last_rate_b_radps_ = rate_b_radps_;
    anew_ = false;
  } else {
    i = window.size();
    while (i > 0 && window[i - 1].stamp > seen_) --i;
  }
  const sensor::Sample* newest = nullptr;
  for (; i < window.size(); ++i) {
    const sensor::Sample& sample = window[i];
    if (!is_imu(sample, ctx.parameters.inertial.imu)) continue;
    if (turn_.add(sample.payload.imu)) newest = &sample;
    seen_ = sample.stamp;
  }
  if (newest == nullptr) return;
  last_imu_ = newest->stamp;
  const sensor::ImuSample& last = newest->payload.imu;
  last_rate_b_radps_ = (1.0F / base::seconds(base::Micros{last.interval_us})) *
                       sensor::times(ctx.parameters.inertial.mounting_bs,
                                     {last.dangle_b_rad[0], last.dangle_b_rad[1], last.dangle_b_rad[2]});
}

/// The window's turn, of which the bias' is taken off: one half before it, one behind. What that leaves is of the third
/// order: 1e-5 rad for a bias of 0.02 rad/s in a turn of 1 rad/s over 0.2 s.
void Attitude::advance(base::Micros t, const Context& ctx, const sensor::Window& window) {
  now_ = t;
  follow(window, ctx);
  ahead_ = {};
  const std::int32_t span_us = turn_.span_us(far_turn_);
  if (!filter_.started() || span_us == 0) return;
  const auto& mounting = ctx.parameters.inertial.mounting_bs;
  const filter::Vector3 h =
      (-0.25e-6F * static_cast<float>(span_us)) * sensor::transposed_times(mounting, filter_.bias_b_radps());
  const filter::Quaternion half_bias{1.0F, h(0), h(1), h(2)};
  const filter::Quaternion q =
      product(product(half_bias, product(far_turn_.turn().conjugate(), turn_.turn())), half_bias);
  const filter::Vector3 v = sensor::times(mounting, {q.x, q.y, q.z});
  ahead_ = filter::Quaternion{q.w, v(0), v(1), v(2)}.normalised();
}

Estimate Attitude::estimate(const Context& ctx) const {
  const AttitudeEstimate now = attitude(ctx);
  const filter::Rows r(now.q_nb);
  const float drift_rad = filter_.bias_sigma_radps() * filter_.magnetometer_disturbed_s();
  const float field_rad = ctx.parameters.magnetic.sigma_rad;
  const float known = field_rad * field_rad + drift_rad * drift_rad;
  constexpr float kUnknown = kUnknown_rad * kUnknown_rad;
  const float yaw = now.heading_valid && known < kUnknown ? known : kUnknown;
  return {.time = now_,
          .pose = {.yaw_rad = base::atan2(r.y(0), r.x(0))},
          .p = filter::Symmetric<float, 3>::diagonal({kUnknown_m * kUnknown_m, kUnknown_m * kUnknown_m, yaw}),
          .yaw_rate_radps = filter::dot(r.z, last_rate_b_radps_ - filter_.bias_b_radps()),
          .heading_valid = now.valid && now.heading_valid};
}

}  // namespace tetap::estimators
