// SPDX-License-Identifier: Apache-2.0
// Inertial navigation, part: GNSS position and velocity.
#pragma once

#include "app/estimators/inertial.hpp"
#include "app/estimators/inertial_measure.hpp"
#include "model/gnss_fix_3d.hpp"
#include "model/gnss_velocity_3d.hpp"

namespace tetap::app {

inline Innovation Inertial::fuse(const GnssPosition& fix, base::Micros stamp, const Context& with) {
  const GnssNumbers& n = with.numbers.gnss;
  if (fix.fix < GnssFix::k2d || with.site.origin == can::OriginSource::kNone) return {};
  const nav::Local local = with.site.frame.to_local(fix.latitude_2ndeg, fix.longitude_2ndeg, fix.height_m);
  if (!local.valid) return {.verdict = can::Verdict::kNotFinite};
  const auto sigma = [&n](float own, float otherwise) {
    const float scaled = base::is_finite(own) ? n.sigma_scale * own : otherwise;
    return scaled > n.sigma_floor_m ? scaled : n.sigma_floor_m;
  };
  model::GnssFix3d model{.x = base::Anchored::from_um(local.east_um),
                         .y = base::Anchored::from_um(local.north_um),
                         .z = base::Anchored::from_um(local.up_um),
                         .sigma_horizontal_m = sigma(fix.horizontal_acc_m, 10.0F),
                         .sigma_vertical_m = sigma(fix.vertical_acc_m, 20.0F),
                         .antenna_b_m = {n.antenna_x_b_m, n.antenna_y_b_m, n.antenna_z_b_m}};
  if (phase_ != Phase::kTracking) {
    start_.fix(model, stamp, n.align_distance_m);
    return {.verdict = can::Verdict::kAccepted};
  }
  // The fix is true at its own time, the state at that of the last IMU sample: moved by the velocity in between.
  const float later_s = base::seconds(stamp - time_);
  nav::move(model.x, -ins_.x.v_n_mps(0) * later_s);
  nav::move(model.y, -ins_.x.v_n_mps(1) * later_s);
  nav::move(model.z, -ins_.x.v_n_mps(2) * later_s);
  return measure(model, kPosition, n.gate_scale, stamp, with);
}

inline Innovation Inertial::fuse(const GnssVelocity& velocity, base::Micros stamp, const Context& with) {
  const GnssNumbers& n = with.numbers.gnss;
  const nav::Vector3 v_n{velocity.v_n_mps[0], velocity.v_n_mps[1],
                         base::is_finite(velocity.v_n_mps[2]) ? velocity.v_n_mps[2] : 0.0F};
  const float own = base::is_finite(velocity.acc_mps) ? velocity.acc_mps : 0.5F;
  const float sigma = own > n.sigma_velocity_floor_mps ? own : n.sigma_velocity_floor_mps;
  if (phase_ != Phase::kTracking) {
    start_.velocity(v_n, sigma);
    return {.verdict = can::Verdict::kAccepted};
  }
  return measure(model::GnssVelocity3d{.v_n_mps = v_n,
                                       .sigma_horizontal_mps = sigma,
                                       .sigma_vertical_mps = 1.5F * sigma,
                                       .antenna_b_m = {n.antenna_x_b_m, n.antenna_y_b_m, n.antenna_z_b_m},
                                       .gyro_b_radps = rate_b_radps_},
                 kVelocity, n.gate_scale, stamp, with);
}

}  // namespace tetap::app
