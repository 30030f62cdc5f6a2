// SPDX-License-Identifier: Apache-2.0
#include "tetap/estimators/mapping/planar_mapper.hpp"

#include "tetap/base/reinitialise.hpp"
#include "tetap/estimators/mapping/pose_covariance.hpp"
#include "tetap/estimators/planar/window_motion.hpp"

namespace tetap::estimators {

template <class Engine>
void PlanarMapper<Engine>::restart(base::Micros t, const Context& ctx) {
  base::reinitialise(*this);
  last_absolute_ = now_ = t;
  const MapStart start(ctx.parameters.start);
  motion_.start(t, start.pose, 0.0F, 0.0F);
  adopt_pose(start.pose, start.p);
  engine_.configure(ctx.parameters);
  engine_.start(start.pose, start.p);
  present_ = motion_;
}

template <class Engine>
void PlanarMapper<Engine>::set_pose(base::Micros t, const SetPose& given, const Context& ctx) {
  close_batch(ctx);
  motion_.propagate(t, ctx.parameters);
  move_engine();
  model::PlanarPose pose = given.pose;
  if (!(given.sigma_yaw_rad < 3.14F)) pose.yaw_rad = motion_.filter.x.yaw_rad;
  pose.yaw_rad = base::wrap_angle(pose.yaw_rad);
  const filter::Symmetric<float, 3> p = covariance_of_pose(given.sigma_position_m, given.sigma_yaw_rad);
  motion_.start(t, pose, 0.0F, 0.0F);
  motion_.trust();
  adopt_pose(pose, p);
  engine_.set_pose(pose, p);
  digest_.update(pose.x.um(), pose.y.um(), pose.yaw_rad, p(0, 0), p(2, 2));
  last_absolute_ = t;
  present_ = motion_;
}

template <class Engine>
void PlanarMapper<Engine>::advance(base::Micros t, const Context& ctx, const sensor::Window& window) {
  close_batch(ctx);  // what left the window together was seen together
  now_ = t;
  motion_.advance(t);
  present_ = motion_;
  move_through(window, present_, ctx.parameters);
  digest_.scan(engine_.words(), kScanned, [this](std::size_t i, auto& sink) { engine_.hash_word(i, sink); });
}

template <class Engine>
Innovation PlanarMapper<Engine>::fuse(const sensor::LandmarkSighting& sighting, base::Micros stamp,
                                      std::uint8_t instance, const Context& ctx) {
  Innovation record{.landmark = sighting.landmark};
  if (base::is_finite(sighting.range_rate_mps)) return record;  // a radar sees no landmark
  if (stamp > batch_stamp_) close_batch(ctx);
  if (batch_size_ == kBatch) return record;
  motion_.propagate(stamp, ctx.parameters);
  move_engine();
  batch_stamp_ = stamp;
  batch_instance_[batch_size_] = instance;
  batch_[batch_size_++] = {
      .id = sighting.landmark == kAnyLandmark ? slam::Sighting::kNoId : std::uint16_t{sighting.landmark},
      .range_m = sighting.range_m,
      .bearing_rad = sighting.bearing_rad};
  record.verdict = sensor::Verdict::kPending;
  return record;
}

template <class Engine>
void PlanarMapper<Engine>::close_batch(const Context& ctx) {
  if (batch_size_ == 0) return;
  engine_.configure(ctx.parameters);
  const auto found = engine_.update({batch_.data(), batch_size_}, batch_stamp_);
  const float gate_scale = ctx.parameters.landmark.gate_scale;
  int accepted = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const slam::SightingRecord& one = found[i];
    const float gate = gate_scale * filter::chi_square_99(one.components == 2 ? 2 : 1);
    record_[i] = {.stamp = batch_stamp_,
                  .sensor = sensor::Sensor::kRangeBearing,
                  .instance = batch_instance_[i],
                  .innovation = record(one, gate)};
    if (one.verdict == slam::SightingVerdict::kAccepted) last_absolute_ = batch_stamp_, ++accepted;
    digest_.update(static_cast<std::uint32_t>(one.id) << 16 | static_cast<std::uint32_t>(one.verdict), one.nu[0],
                   one.nu[1], one.s.xx, one.s.xy, one.s.yy, one.nis);
  }
  records_ = found.size();
  const std::uint32_t refused = engine_.report().refused;
  if (refused != refused_) last_refused_ = now_;
  refused_ = refused;
  batch_size_ = 0;
  adopt_pose(engine_.pose(), engine_.covariance());
  const model::PlanarPose& pose = motion_.filter.x;
  digest_.update(pose.x.um(), pose.y.um(), pose.yaw_rad, motion_.filter.p(0, 0), motion_.filter.p(1, 1),
                 motion_.filter.p(2, 2));
  motion_.looked(accepted);
  move_engine();
}

template class PlanarMapper<EkfSlamEngine<30>>;           // EkfSlam30
template class PlanarMapper<FastSlamEngine<100, 15, 2>>;  // FastSlam100

}  // namespace tetap::estimators
