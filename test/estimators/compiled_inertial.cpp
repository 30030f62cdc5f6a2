// SPDX-License-Identifier: Apache-2.0
#include "compiled_inertial.hpp"

namespace tetap::estimators {

void CompiledInertial::restart(base::Micros t, const Context& ctx) { Inertial::restart(t, ctx); }
void CompiledInertial::set_pose(base::Micros t, const SetPose& given, const Context& ctx) {
  Inertial::set_pose(t, given, ctx);
}
Innovation CompiledInertial::fuse(const sensor::ImuSample& sample, base::Micros stamp, const Context& ctx) {
  return Inertial::fuse(sample, stamp, ctx);
}
Innovation CompiledInertial::fuse(const sensor::WheelCounts& counts, base::Micros stamp, const Context& ctx) {
  return Inertial::fuse(counts, stamp, ctx);
}
Innovation CompiledInertial::fuse(const sensor::WheelSpeeds& speeds, base::Micros stamp, const Context& ctx) {
  return Inertial::fuse(speeds, stamp, ctx);
}
Innovation CompiledInertial::fuse(const sensor::BodySpeed& speed, base::Micros stamp, const Context& ctx) {
  return Inertial::fuse(speed, stamp, ctx);
}
Innovation CompiledInertial::fuse(const sensor::GnssPosition& fix, base::Micros stamp, const Context& ctx) {
  return Inertial::fuse(fix, stamp, ctx);
}
Innovation CompiledInertial::fuse(const sensor::GnssVelocity& velocity, base::Micros stamp, const Context& ctx) {
  return Inertial::fuse(velocity, stamp, ctx);
}
Innovation CompiledInertial::fuse(const sensor::OutsideHeading& heading, base::Micros stamp, const Context& ctx) {
  return Inertial::fuse(heading, stamp, ctx);
}
Innovation CompiledInertial::fuse(const sensor::MagneticFlux& flux, base::Micros stamp, const Context& ctx) {
  return Inertial::fuse(flux, stamp, ctx);
}
Innovation CompiledInertial::fuse(const sensor::AirPressure& air, base::Micros stamp, const Context& ctx) {
  return Inertial::fuse(air, stamp, ctx);
}
void CompiledInertial::advance(base::Micros t, const Context& ctx) {
  Inertial::advance(t, ctx, std::vector<sensor::Sample>{});
}
Estimate CompiledInertial::estimate(const Context& ctx) const { return Inertial::estimate(ctx); }
InertialEstimate CompiledInertial::inertial(const Context& ctx) const { return Inertial::inertial(ctx); }
sensor::Mode CompiledInertial::mode(const Context& ctx) const { return Inertial::mode(ctx); }

}  // namespace tetap::estimators
