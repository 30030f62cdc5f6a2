// SPDX-License-Identifier: Apache-2.0
// The size of a fault in units of the gate that stands before it, so that one list of sizes serves every sensor.
#pragma once

#include "sim_host/matrix/frame_fault.hpp"
#include "tetap/param/parameters.hpp"

namespace tetap::sim {

/// One sigma of a filter and the motion, at the begin of a fault.
struct Uncertainty {
  double position_m = 1;
  double height_m = 1;
  double velocity_mps = 0.1;
  double heading_rad = 0.1;
  double speed_mps = 0;        ///< speed of the robot
  double gnss_position_m = 1;  ///< accuracy that the receiver states
  double gnss_velocity_mps = 0.1;
};

/// The smallest change of a sensor's value that its gate refuses, from the published sigma and the robot's noise. It is
/// the root of (gate of one to three degrees of freedom times innovation variance).
///
/// An IMU and the wheels of a planar filter have no gate. Their fault is measured by what it does to the velocity,
/// position or heading that another device tests. A turn rate tilts the body, and the tilt leads the velocity astray by
/// g times its time. A rate about the vertical turns the heading of the course.
/// Unit: that of FrameFault::size. 0 where a size in gates has no meaning (accuracies, whole frames).
[[nodiscard]] double gate_of(const FrameFault& fault, double interval_s, const Uncertainty& u,
                             const param::Parameters& n, bool planar);

/// The second gate of gnss_both: that of the velocity beside that of the position.
[[nodiscard]] double velocity_gate(const Uncertainty& u, const param::Parameters& n);

}  // namespace tetap::sim
