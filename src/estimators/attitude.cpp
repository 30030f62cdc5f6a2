// SPDX-License-Identifier: Apache-2.0
#include "estimators/attitude.hpp"

namespace tetap::estimators {

Innovation Attitude::fuse(const sensor::ImuSample& sample, base::Micros stamp, const Context& ctx) {
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
  const auto verdict =
      filter_.step(rate, per_s * body(sample.dvelocity_b_mps), base::seconds(gap && !lost ? span : interval),
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

/// The turns of the window in the sensor's axes, one after the other, and into the body's at the end. (1 - h^2/3, h)
/// is the quaternion of a turn 2h to h^5/45, but for its length.
void Attitude::advance(base::Micros t, const Context& ctx, const sensor::Window& window) {
  now_ = t;
  last_imu_ = time_;
  last_rate_b_radps_ = rate_b_radps_;
  ahead_ = {};
  if (!filter_.started()) return;
  const auto& mounting = ctx.parameters.inertial.mounting_bs;
  const filter::Vector3 bias_s_radps = sensor::transposed_times(mounting, filter_.bias_b_radps());
  filter::Quaternion q;
  const sensor::ImuSample* last = nullptr;
  for (std::size_t i = 0; i < window.size(); ++i) {
    const sensor::Sample& sample = window[i];
    if (!is_imu(sample, ctx.parameters.inertial.imu)) continue;
    const sensor::ImuSample& imu = sample.payload.imu;
    const float half_s = 0.5F * base::seconds(base::Micros{imu.interval_us});
    const filter::Vector3 h{0.5F * imu.dangle_b_rad[0] - half_s * bias_s_radps(0),
                            0.5F * imu.dangle_b_rad[1] - half_s * bias_s_radps(1),
                            0.5F * imu.dangle_b_rad[2] - half_s * bias_s_radps(2)};
    const float h2 = filter::dot(h, h);
    if (!(h2 < (kFastest_radps * kFastest_radps) * half_s * half_s)) continue;
    q = q * filter::Quaternion{1.0F - h2 * (1.0F / 3.0F), h(0), h(1), h(2)};
    last_imu_ = sample.stamp;
    last = &imu;
  }
  if (last == nullptr) return;
  const filter::Vector3 v = sensor::times(mounting, {q.x, q.y, q.z});
  ahead_ = filter::Quaternion{q.w, v(0), v(1), v(2)}.normalised();
  last_rate_b_radps_ = (1.0F / base::seconds(base::Micros{last->interval_us})) *
                       sensor::times(mounting, {last->dangle_b_rad[0], last->dangle_b_rad[1], last->dangle_b_rad[2]});
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
