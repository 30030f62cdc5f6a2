// SPDX-License-Identifier: Apache-2.0
// Heading error by a gyroscope's scale error in turns about the vertical, where nothing levels the gyroscope.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/base/members.hpp"

namespace tetap::nav {

/// The heading is wrong by the scale's error times the angle turned. Turns back and forth cancel, turns round and round
/// add up. Measurements of the heading on the way take off their part. The scale is considered, not estimated (Schmidt
/// 1966; Simon 2006, sec. 10.3): kept is only its covariance with the heading. A way back makes the heading better
/// known again. P is not made smaller for that: its other correlations would not fit. The next turns are free until
/// that is used up.
class GyroScaleConsider {
 public:
  /// Implements docs/explanation/equations.md (13).
  /// A turn of so much, in rad, since the last call: what it adds to the heading's variance, rad^2. `scale` is 1 sigma
  /// of the scale's error, as a share. Less than a degree waits until there is more: noise and vibration are no turn.
  [[nodiscard]] float turn(float by_rad, float scale) {
    waits_rad_ += by_rad;
    if (!(base::abs(waits_rad_) >= kLeast_rad)) return 0.0F;
    const float more_rad2 = net_rad2(waits_rad_);
    with_heading_rad_ += waits_rad_;
    credit_rad2_ = more_rad2 < 0.0F ? -more_rad2 : 0.0F;
    waits_rad_ = 0;
    return more_rad2 > 0.0F ? scale * scale * more_rad2 : 0.0F;
  }
  /// The same for a turn that is not added yet, with the turn that waits.
  [[nodiscard]] float would_add(float by_rad, float scale) const {
    const float more_rad2 = net_rad2(waits_rad_ + by_rad);
    return more_rad2 > 0.0F ? scale * scale * more_rad2 : 0.0F;
  }
  /// A measurement has left so much of the heading's variance.
  void heading_measured(float left) {
    if (!(left >= 0.0F && left < 1.0F)) return;
    with_heading_rad_ *= left;
    credit_rad2_ *= left * left;
  }
  static constexpr auto members(auto& self) {
    return base::members(self.with_heading_rad_, self.credit_rad2_, self.waits_rad_);
  }

 private:
  static constexpr float kLeast_rad = 0.02F;

  /// With scale s and heading psi, of errors: psi += s d.
  [[nodiscard]] float net_rad2(float d_rad) const { return d_rad * (2.0F * with_heading_rad_ + d_rad) - credit_rad2_; }

  float with_heading_rad_ = 0;  ///< covariance of scale and heading, over the scale's variance; counter-clockwise
  float credit_rad2_ = 0;       ///< by how much P has too large a variance of the heading, over the same
  float waits_rad_ = 0;         ///< not in them yet
};

}  // namespace tetap::nav
