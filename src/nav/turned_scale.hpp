// SPDX-License-Identifier: Apache-2.0
// What a gyroscope whose scale is not exact makes of turns about the vertical, where nothing levels it.
#pragma once

#include "base/math.hpp"

namespace tetap::nav {

/// The heading is wrong by the scale's error times the angle turned: back and forth that comes to nothing, round and
/// round it adds up. Kept is the angle the robot is turned by, up to one circle: what a receiver told of the heading
/// meanwhile is not known here, so further circles count as if half of what they cost had been corrected.
class TurnedScale {
 public:
  /// A turn of so much, in rad, since the last call: what it adds to the heading's variance, rad^2. `scale` is 1 sigma
  /// of the scale's error, as a share. Less than a degree waits until there is more: noise and vibration are no turn.
  [[nodiscard]] float turn(float by_rad, float scale) {
    waits_rad_ += by_rad;
    if (!(base::abs(waits_rad_) >= kLeast_rad)) return 0.0F;
    const float variance = would_add(0.0F, scale);
    const float at_rad = turned_rad_ + waits_rad_;
    turned_rad_ = at_rad > kCircle_rad ? kCircle_rad : at_rad < -kCircle_rad ? -kCircle_rad : at_rad;
    waits_rad_ = 0;
    return variance;
  }
  /// The same for a turn that has not been told yet, with what waits.
  [[nodiscard]] float would_add(float by_rad, float scale) const {
    const float at_rad = turned_rad_ + waits_rad_ + by_rad;
    const float more = at_rad * at_rad - turned_rad_ * turned_rad_;
    return more > 0.0F ? scale * scale * more : 0.0F;
  }
  template <class Sink>
  void each_bit(Sink&& sink) const {
    sink(turned_rad_);
    sink(waits_rad_);
  }

 private:
  static constexpr float kLeast_rad = 0.02F, kCircle_rad = 6.2831853F;

  float turned_rad_ = 0;  ///< counter-clockwise
  float waits_rad_ = 0;   ///< not in it yet
};

}  // namespace tetap::nav
