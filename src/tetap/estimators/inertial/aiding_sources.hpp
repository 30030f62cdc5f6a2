// SPDX-License-Identifier: Apache-2.0
// All aiding sources of the inertial filter.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/estimators/inertial/sources/barometer.hpp"
#include "tetap/estimators/inertial/sources/forward_speed.hpp"
#include "tetap/estimators/inertial/sources/gnss_height.hpp"
#include "tetap/estimators/inertial/sources/gnss_position.hpp"
#include "tetap/estimators/inertial/sources/gnss_velocity.hpp"
#include "tetap/estimators/inertial/sources/magnetometer.hpp"
#include "tetap/estimators/inertial/sources/outside_heading.hpp"
#include "tetap/estimators/inertial/sources/wheels.hpp"

namespace tetap::estimators {

class AidingSources {
 public:
  GnssPositionSource position;
  GnssHeightSource height;
  GnssVelocitySource velocity;
  Wheels wheels;
  ForwardSpeedSource forward;
  OutsideHeadingSource heading;
  Magnetometer magnetometer;
  Barometer barometer;

  /// Some source was refused at least so often in a row.
  [[nodiscard]] bool any_refused(std::int32_t at_least) const {
    const auto refused = [at_least](const auto& source) { return source.refused().count() >= at_least; };
    return refused(position) || refused(height) || refused(velocity) || refused(forward) || refused(heading);
  }
  [[nodiscard]] bool any_stuck(base::Micros at) const {
    return magnetometer.stuck(at) || barometer.stuck(at) || heading.stuck(at);
  }
  /// The filter begins, at a speed that was measured or given, or not.
  void begin(bool speed_known) {
    position.begin();
    height.relocated();
    velocity.begin();
    wheels.encoders().invalidate_gain();
    forward.begin(speed_known);
    heading.begin();
  }
  static constexpr auto members(auto& self) {
    return base::members(base::in_turns(self.position), base::in_turns(self.height), base::in_turns(self.velocity),
                         base::in_turns(self.wheels), base::in_turns(self.forward), base::in_turns(self.heading),
                         base::in_turns(self.magnetometer), base::in_turns(self.barometer));
  }
};

static_assert(AidingSource<GnssPositionSource> && AidingSource<GnssHeightSource> && AidingSource<GnssVelocitySource>);
static_assert(AidingSource<Wheels> && AidingSource<ForwardSpeedSource> && AidingSource<OutsideHeadingSource>);
static_assert(AidingSource<Magnetometer> && AidingSource<Barometer>);

}  // namespace tetap::estimators
