// SPDX-License-Identifier: Apache-2.0
#include "tetap/estimators/attitude.hpp"

#include "tetap/base/multiply_add.hpp"

namespace tetap::estimators {

namespace {

/// base::seconds() without its 64 bits.
[[gnu::always_inline]] inline float seconds_of(std::int32_t span_us) { return static_cast<float>(span_us) * 1e-6F; }

/// The bits of a * b.
[[gnu::always_inline]] inline filter::Quaternion product(const filter::Quaternion& a, const filter::Quaternion& b) {
  using base::add_product, base::subtract_product;
  return {subtract_product(subtract_product(subtract_product(a.w * b.w, a.x, b.x), a.y, b.y), a.z, b.z),
          subtract_product(add_product(add_product(a.w * b.x, a.x, b.w), a.y, b.z), a.z, b.y),
          add_product(add_product(subtract_product(a.w * b.y, a.x, b.z), a.y, b.w), a.z, b.x),
          add_product(subtract_product(add_product(a.w * b.z, a.x, b.y), a.y, b.x), a.z, b.w)};
}

}  // namespace

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
  const std::int32_t instance = ctx.parameters.inertial.imu;
  // Samples of a fast IMU are summed to turns of a tick's length. The coning within one is left out here: the filter at
  // the far end takes every sample.
  constexpr std::int32_t kLeast_us = 9'000;
  filter::Quaternion q;
  filter::Vector3 angle_s_rad = filter::Vector3::Zero();
  std::int32_t span_us = 0;
  const sensor::Sample *newest = nullptr, *last_summed = nullptr;
  const auto turn = [&]() __attribute__((always_inline)) {
    const float half_s = 0.5F * seconds_of(span_us);
    const filter::Vector3 h{base::subtract_product(0.5F * angle_s_rad(0), half_s, bias_s_radps(0)),
                            base::subtract_product(0.5F * angle_s_rad(1), half_s, bias_s_radps(1)),
                            base::subtract_product(0.5F * angle_s_rad(2), half_s, bias_s_radps(2))};
    span_us = 0;
    const float h2 = filter::dot(h, h);
    if (!(h2 < (kFastest_radps * kFastest_radps) * half_s * half_s)) return;
    q = product(q, {base::subtract_product(1.0F, h2, 1.0F / 3.0F), h(0), h(1), h(2)});
    newest = last_summed;
  };
  window.each([&](const sensor::Sample& sample) __attribute__((always_inline)) {
    if (!is_imu(sample, instance)) return;
    const sensor::ImuSample& imu = sample.payload.imu;
    const filter::Vector3 angle{imu.dangle_b_rad[0], imu.dangle_b_rad[1], imu.dangle_b_rad[2]};
    const std::int32_t interval_us = imu.interval_us;
    if (interval_us < kLeast_us) {
      const float most_rad = kFastest_radps * seconds_of(interval_us);
      if (!(filter::dot(angle, angle) < most_rad * most_rad)) return;
    }
    last_summed = &sample;
    angle_s_rad = span_us == 0 ? angle : filter::Vector3(angle_s_rad + angle);
    span_us += interval_us;
    if (span_us >= kLeast_us) turn();
  });
  if (span_us > 0) turn();
  if (newest == nullptr) return;
  last_imu_ = newest->stamp;
  const sensor::ImuSample& last = newest->payload.imu;
  const filter::Vector3 v = sensor::times(mounting, {q.x, q.y, q.z});
  ahead_ = filter::Quaternion{q.w, v(0), v(1), v(2)}.normalised();
  last_rate_b_radps_ = (1.0F / seconds_of(last.interval_us)) *
                       sensor::times(mounting, {last.dangle_b_rad[0], last.dangle_b_rad[1], last.dangle_b_rad[2]});
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
