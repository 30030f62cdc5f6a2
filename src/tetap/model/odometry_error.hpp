// SPDX-License-Identifier: Apache-2.0
// Error sources of a differential drive on a straight way: slip, unlike wheels, encoder steps and the initial heading.
// Borenstein & Feng, IEEE Trans. Robotics and Automation 12(6), 1996; Siegwart, Nourbakhsh, Scaramuzza 2011, sec.
// 5.2.4.
#pragma once

#include "tetap/filter/symmetric.hpp"

namespace tetap::model {

/// Path of one encoder count, 2 pi r / N; a reading is off by at most half of it.
[[nodiscard]] constexpr float encoder_step_m(float radius_m, float counts_per_turn) {
  return 6.28318531F * radius_m / counts_per_turn;
}

struct OdometryErrorSources {
  float track_m = 1;
  float slip_m = 0;             ///< variance of a wheel's path per metre, each wheel alone
  float wheel_difference = 0;   ///< sigma of (right radius - left radius) / mean radius
  float encoder_step_m = 0;     ///< path of a count
  float sigma_heading_rad = 0;  ///< at the start

  /// Sigma of the heading from unlike wheels alone: linear in the distance.
  [[nodiscard]] constexpr float wheel_difference_heading_rad(float distance_m) const {
    return wheel_difference * size_of(distance_m) / track_m;
  }

  /// Covariance of (along, beside, heading) at the end of a straight drive, to first order in the heading.
  [[nodiscard]] filter::Symmetric<float, 3> after_straight(float distance_m) const {
    const float d = size_of(distance_m);
    const float per_track2 = 1.0F / (track_m * track_m);
    filter::Symmetric<float, 3> p;
    const auto persistent_heading_variance = sigma_heading_rad * sigma_heading_rad;  // beside = d * heading
    p(1, 1) += persistent_heading_variance * d * d;
    p(1, 2) += persistent_heading_variance * d;
    p(2, 2) += persistent_heading_variance;
    const float curvature = wheel_difference * wheel_difference * per_track2;  // beside = curvature d^2 / 2
    p(1, 1) += curvature * d * d * d * d * 0.25F;
    p(1, 2) += curvature * d * d * d * 0.5F;
    p(2, 2) += curvature * d * d;
    const float walk = 2.0F * slip_m * per_track2;  // the heading walks at random, its integral goes with d^3 / 3
    p(0, 0) += 0.5F * slip_m * d;
    p(1, 1) += walk * d * d * d * (1.0F / 3.0F);
    p(1, 2) += walk * d * d * 0.5F;
    p(2, 2) += walk * d;
    // A wheel's path lies between two readings, each uniform over a step: step^2 / 6, whatever the distance.
    const float reading = encoder_step_m * encoder_step_m * (1.0F / 6.0F);
    p(0, 0) += 0.5F * reading;
    p(2, 2) += 2.0F * reading * per_track2;
    return p;
  }

 private:
  [[nodiscard]] static constexpr float size_of(float v) { return v < 0.0F ? -v : v; }
};

}  // namespace tetap::model
