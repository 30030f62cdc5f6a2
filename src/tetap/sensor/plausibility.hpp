// SPDX-License-Identifier: Apache-2.0
// Plausibility of a sample, before anything computes with it. A sample needs numbers in the fields that must have them,
// of a size that a sensor on a robot can mean. The limits are far beyond every robot; inside them no filter leaves the
// floats.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/sensor/sample.hpp"

namespace tetap::sensor {

namespace detail {
[[nodiscard]] constexpr bool within(float limit, auto... values) {  // false for NaN
  return ((values <= limit && values >= -limit) && ...);
}
/// A 1 sigma that may be not available.
[[nodiscard]] constexpr bool sigma_or_none(float sigma, float limit) {
  return base::is_nan(sigma) || (sigma >= 0.0F && sigma <= limit);
}
[[nodiscard]] constexpr bool number_or_none(float x, float limit) { return base::is_nan(x) || within(limit, x); }

struct Plausible {
  float most_mps;  ///< fastest wheel, and fastest body

  bool operator()(const ImuSample& s) const {
    const auto& a = s.dangle_b_rad;
    const auto& v = s.dvelocity_b_mps;
    return within(20.0F, a[0], a[1], a[2]) && within(200.0F, v[0], v[1], v[2]);
  }
  bool operator()(const WheelCounts&) const { return true; }
  bool operator()(const WheelSpeeds& s) const { return within(most_mps, s.left_mps, s.right_mps); }
  bool operator()(const BodySpeed& s) const {
    return within(most_mps, s.forward_mps) && number_or_none(s.yaw_rate_radps, 100.0F);
  }
  bool operator()(const GnssPosition& s) const {
    constexpr std::int64_t kQuarterTurn = 45'000'000'000;
    return s.latitude_2ndeg <= kQuarterTurn && s.latitude_2ndeg >= -kQuarterTurn &&
           s.longitude_2ndeg <= 4 * kQuarterTurn && s.longitude_2ndeg >= -4 * kQuarterTurn &&
           number_or_none(s.height_m, 1e5F) && sigma_or_none(s.horizontal_acc_m, 1e6F) &&
           sigma_or_none(s.vertical_acc_m, 1e6F);
  }
  bool operator()(const GnssVelocity& s) const {
    return within(500.0F, s.v_n_mps[0], s.v_n_mps[1]) && number_or_none(s.v_n_mps[2], 500.0F) &&
           sigma_or_none(s.acc_mps, 1e4F);
  }
  /// The decoder has refused what is no covariance by itself; three correlations together are the estimator's matter.
  bool operator()(const LoopClosure& s) const {
    return s.from != s.to && LoopClosure::unpack(s.sigmas, 0) > 0 && LoopClosure::unpack(s.sigmas, 1) > 0 &&
           LoopClosure::unpack(s.sigmas, 2) > 0;
  }
  /// A way that the robot can go in the interval, and a covariance: of an axis without a sigma nothing counts.
  bool operator()(const RelativePose& s) const {
    if (s.interval_us == 0 || !within(3.2F, s.yaw_rad)) return false;
    const float most_m = most_mps * base::seconds(base::Micros{s.interval_us});
    if (!within(s.unknown(0) ? 1e4F : most_m, s.x_m) || !within(s.unknown(1) ? 1e4F : most_m, s.y_m)) return false;
    if (s.sigma[0] == 0 || s.sigma[1] == 0 || s.sigma[2] == 0) return false;
    const float a = s.correlation_of(0), b = s.correlation_of(1), c = s.correlation_of(2);
    constexpr float kLeast = 1e-3F;  // determinant of the correlations
    return a * a < 1.0F && b * b < 1.0F && c * c < 1.0F && 1.0F + 2.0F * a * b * c - a * a - b * b - c * c > kLeast;
  }
  /// Finer steps than 0.1 mrad, and more than a turn in all, are no scanner's.
  bool operator()(const PlanarScan& s) const {
    const float step_rad = base::abs(s.step_rad);
    return s.beams >= 3 && within(4.0F, s.first_rad) && step_rad > 1e-4F &&
           step_rad * static_cast<float>(s.beams - 1) < 6.3F;
  }
  bool operator()(const CameraImage&) const { return true; }
  bool operator()(const LandmarkSighting& s) const {
    const bool any = !base::is_nan(s.range_m) || !base::is_nan(s.bearing_rad);
    return any && sigma_or_none(s.range_m, 1e5F) && number_or_none(s.bearing_rad, 10.0F) &&
           number_or_none(s.range_rate_mps, 1e4F);
  }
  bool operator()(const MagneticFlux& s) const { return within(1e6F, s.flux_b_uT[0], s.flux_b_uT[1], s.flux_b_uT[2]); }
  bool operator()(const AirPressure& s) const { return s.pressure_Pa > 0.0F && s.pressure_Pa < 1e6F; }
  bool operator()(const OutsideHeading& s) const { return within(10.0F, s.yaw_rad) && sigma_or_none(s.acc_rad, 10.0F); }
};
}  // namespace detail

/// Faster than every robot, in m/s.
inline constexpr float kFastest_mps = 1e3F;

/// False: the sample is to be refused and counted (Counters::out_of_range). `most_mps`: fastest wheel of the robot.
[[nodiscard]] inline bool plausible(const Sample& sample, float most_mps = kFastest_mps) {
  bool good = false;
  visit(sample, [&](const auto& payload) { good = detail::Plausible{most_mps}(payload); });
  return good;
}

}  // namespace tetap::sensor
