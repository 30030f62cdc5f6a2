// SPDX-License-Identifier: Apache-2.0
// The inertial estimator, compiled once for the tests that drive it by itself (not in a node): it is headers alone, and
// each file that calls it would spend a quarter of a minute on it.
#pragma once

#include "estimators/inertial/inertial.hpp"

#include <vector>

namespace tetap::estimators {

class CompiledInertial : public Inertial {
 public:
  void restart(base::Micros t, const Context& ctx);
  void set_pose(base::Micros t, const SetPose& given, const Context& ctx);
  Innovation fuse(const sensor::ImuSample& sample, base::Micros stamp, const Context& ctx);
  Innovation fuse(const sensor::WheelCounts& counts, base::Micros stamp, const Context& ctx);
  Innovation fuse(const sensor::WheelSpeeds& speeds, base::Micros stamp, const Context& ctx);
  Innovation fuse(const sensor::BodySpeed& speed, base::Micros stamp, const Context& ctx);
  Innovation fuse(const sensor::GnssPosition& fix, base::Micros stamp, const Context& ctx);
  Innovation fuse(const sensor::GnssVelocity& velocity, base::Micros stamp, const Context& ctx);
  Innovation fuse(const sensor::OutsideHeading& heading, base::Micros stamp, const Context& ctx);
  Innovation fuse(const sensor::MagneticFlux& flux, base::Micros stamp, const Context& ctx);
  Innovation fuse(const sensor::AirPressure& air, base::Micros stamp, const Context& ctx);
  /// To t, with nothing in the window.
  void advance(base::Micros t, const Context& ctx);
  [[nodiscard]] Estimate estimate(const Context& ctx) const;
  [[nodiscard]] InertialEstimate inertial(const Context& ctx) const;
  [[nodiscard]] sensor::Mode mode(const Context& ctx) const;
};

}  // namespace tetap::estimators
