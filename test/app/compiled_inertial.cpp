// SPDX-License-Identifier: Apache-2.0
#include "compiled_inertial.hpp"

namespace tetap::app {

void CompiledInertial::restart(base::Micros t, const Context& with) { Inertial::restart(t, with); }
void CompiledInertial::set_pose(base::Micros t, const SetPose& given, const Context& with) {
  Inertial::set_pose(t, given, with);
}
Innovation CompiledInertial::fuse(const ImuSample& sample, base::Micros stamp, const Context& with) {
  return Inertial::fuse(sample, stamp, with);
}
Innovation CompiledInertial::fuse(const WheelCounts& counts, base::Micros stamp, const Context& with) {
  return Inertial::fuse(counts, stamp, with);
}
Innovation CompiledInertial::fuse(const WheelSpeeds& speeds, base::Micros stamp, const Context& with) {
  return Inertial::fuse(speeds, stamp, with);
}
Innovation CompiledInertial::fuse(const BodySpeed& speed, base::Micros stamp, const Context& with) {
  return Inertial::fuse(speed, stamp, with);
}
Innovation CompiledInertial::fuse(const GnssPosition& fix, base::Micros stamp, const Context& with) {
  return Inertial::fuse(fix, stamp, with);
}
Innovation CompiledInertial::fuse(const GnssVelocity& velocity, base::Micros stamp, const Context& with) {
  return Inertial::fuse(velocity, stamp, with);
}
Innovation CompiledInertial::fuse(const OutsideHeading& heading, base::Micros stamp, const Context& with) {
  return Inertial::fuse(heading, stamp, with);
}
Innovation CompiledInertial::fuse(const MagneticFlux& flux, base::Micros stamp, const Context& with) {
  return Inertial::fuse(flux, stamp, with);
}
Innovation CompiledInertial::fuse(const AirPressure& air, base::Micros stamp, const Context& with) {
  return Inertial::fuse(air, stamp, with);
}
void CompiledInertial::advance(base::Micros t, const Context& with) {
  Inertial::advance(t, with, std::vector<Sample>{});
}
Estimate CompiledInertial::estimate(const Context& with) const { return Inertial::estimate(with); }
InertialEstimate CompiledInertial::inertial(const Context& with) const { return Inertial::inertial(with); }
can::Mode CompiledInertial::mode(const Context& with) const { return Inertial::mode(with); }

}  // namespace tetap::app
