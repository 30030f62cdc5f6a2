// SPDX-License-Identifier: Apache-2.0
// The inertial estimator, compiled once for the tests that drive it by itself (not in a node): it is headers alone, and
// each file that calls it would spend a quarter of a minute on it.
#pragma once

#include "app/estimators/inertial.hpp"

#include <vector>

namespace tetap::app {

class CompiledInertial : public Inertial {
 public:
  void restart(base::Micros t, const Context& with);
  void set_pose(base::Micros t, const SetPose& given, const Context& with);
  Innovation fuse(const ImuSample& sample, base::Micros stamp, const Context& with);
  Innovation fuse(const WheelCounts& counts, base::Micros stamp, const Context& with);
  Innovation fuse(const WheelSpeeds& speeds, base::Micros stamp, const Context& with);
  Innovation fuse(const BodySpeed& speed, base::Micros stamp, const Context& with);
  Innovation fuse(const GnssPosition& fix, base::Micros stamp, const Context& with);
  Innovation fuse(const GnssVelocity& velocity, base::Micros stamp, const Context& with);
  Innovation fuse(const OutsideHeading& heading, base::Micros stamp, const Context& with);
  Innovation fuse(const MagneticFlux& flux, base::Micros stamp, const Context& with);
  Innovation fuse(const AirPressure& air, base::Micros stamp, const Context& with);
  /// To t, with nothing in the window.
  void advance(base::Micros t, const Context& with);
  [[nodiscard]] Estimate estimate(const Context& with) const;
  [[nodiscard]] InertialEstimate inertial(const Context& with) const;
  [[nodiscard]] can::Mode mode(const Context& with) const;
};

}  // namespace tetap::app
