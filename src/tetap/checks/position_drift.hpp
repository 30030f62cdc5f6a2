// SPDX-License-Identifier: Apache-2.0
// Drift of fixes away from the filter while the receiver's own velocity agrees with it. Drift is the mean innovation of
// the last ten or so, less that of the last thirty. Each alone may be inside its gate (a ramp, spoofing). A constant
// offset, as a filter's own error, leaves both means alike. Exponentially weighted means: Roberts 1959 (control
// charts). Innovations averaged against a slow fault: Diesel & Luu 1995.
#pragma once

#include "tetap/base/members.hpp"

#include <array>
#include <cstdint>

namespace tetap::checks {

class PositionDrift {
 public:
  void update(float east_m, float north_m) {
    follow(fast_m_, kFast, east_m, north_m);
    follow(slow_m_, kSlow, east_m, north_m);
  }
  /// Test statistic: the difference of both means, squared and normalised (2 degrees of freedom), of fixes whose errors
  /// are new with each. The filter's variance of where the antenna is, to east and north, counts in full.
  [[nodiscard]] float statistic(float fix_m2, float east_m2, float north_m2) const {
    const float d_east_m = fast_m_[0] - slow_m_[0], d_north_m = fast_m_[1] - slow_m_[1];
    const float of_fixes_m2 = kShare * fix_m2;
    return d_east_m * d_east_m / (of_fixes_m2 + east_m2) + d_north_m * d_north_m / (of_fixes_m2 + north_m2);
  }
  /// The receiver's velocity agreed with the filter: it vouches for the filter at the next few fixes, for fixes may
  /// come more often than velocities. Each call takes one of them.
  [[nodiscard]] bool consume_velocity_agreement() {
    if (agreements_left_ == 0) return false;
    --agreements_left_;
    return true;
  }
  void velocity(bool agrees) { agreements_left_ = agrees ? kFixesOfAVelocity : std::uint8_t{0}; }
  void reset() { *this = {}; }

  static constexpr auto members(auto& self) { return base::members(self.fast_m_, self.slow_m_, self.agreements_left_); }

 private:
  using Mean = std::array<float, 2>;
  static constexpr std::uint8_t kFixesOfAVelocity = 10;  ///< velocities may come once a second
  static constexpr float kFast = 0.1F, kSlow = 0.03F;    ///< weights of the newest fix
  /// Variance of the difference over that of one fix. The variance of a mean is w / (2 - w). The covariance of two
  /// means is v w / (v + w - v w).
  static constexpr float kShare =
      kFast / (2 - kFast) + kSlow / (2 - kSlow) - 2 * kFast * kSlow / (kFast + kSlow - kFast * kSlow);
  static void follow(Mean& mean_m, float weight, float east_m, float north_m) {
    mean_m = {mean_m[0] + weight * (east_m - mean_m[0]), mean_m[1] + weight * (north_m - mean_m[1])};
  }

  Mean fast_m_{}, slow_m_{};
  std::uint8_t agreements_left_ = 0;  ///< fixes for which a velocity still vouches
};

}  // namespace tetap::checks
