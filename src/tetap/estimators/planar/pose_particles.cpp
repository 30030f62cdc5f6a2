// SPDX-License-Identifier: Apache-2.0
#include "tetap/estimators/planar/pose_particles.hpp"

#include "tetap/base/reinitialise.hpp"
#include "tetap/estimators/planar/window_motion.hpp"

namespace tetap::estimators {

namespace {

/// The nearest multiple of a metre.
float whole_metres(float m) {
  const float bounded = base::clamp(m, -1e6F, 1e6F);
  return static_cast<float>(static_cast<std::int32_t>(bounded < 0.0F ? bounded - 0.5F : bounded + 0.5F));
}

}  // namespace

template <std::size_t kMost>
void PoseParticles<kMost>::restart(base::Micros t, const Context& ctx) {
  base::reinitialise(*this);
  cloud_.cloud.set_key({kKey, kFirstSeed + static_cast<std::uint32_t>(ctx.parameters.mapping.seed)});
  moved_ = last_absolute_ = now_ = t;
  if (ctx.parameters.start.known != 0) return set_pose(t, start_pose(ctx.parameters.start), ctx);
  motion_.start(t, model::PlanarPose{}, kUnknown_m, kUnknown_rad);
  present_ = motion_;
}

template <std::size_t kMost>
void PoseParticles<kMost>::set_pose(base::Micros t, const SetPose& given, const Context& ctx) {
  batch_size_ = 0;  // seen from where the robot was
  motion_.propagate(t, ctx.parameters);
  move_cloud(t, ctx);
  const bool heading = given.sigma_yaw_rad < 3.14F;  // false for NaN too
  const float sigma_m = given.sigma_position_m > kFinest_m ? given.sigma_position_m : kFinest_m;
  const float sigma_rad = !heading ? base::kPi : given.sigma_yaw_rad > kFinest_rad ? given.sigma_yaw_rad : kFinest_rad;
  motion_.start(t, given.pose, sigma_m, heading ? sigma_rad : kUnknown_rad);
  origin_x_ = given.pose.x;
  origin_y_ = given.pose.y;
  const float yaw_rad = heading ? given.pose.yaw_rad : 0.0F;
  cloud_.start(kMost, filter::ParticlePose::at(0.0F, 0.0F, yaw_rad), sigma_m, sigma_rad);
  digest_.update(given.sigma_position_m, given.sigma_yaw_rad, given.pose.yaw_rad);
  present_ = motion_;
  last_absolute_ = t;
  started_ = true;
}

template <std::size_t kMost>
void PoseParticles<kMost>::advance(base::Micros t, const Context& ctx, const sensor::Window& window) {
  if (batch_size_ > 0) weigh_batch(ctx);  // what left the window together was seen together
  now_ = t;
  motion_.advance(t);
  present_ = motion_;
  move_through(window, present_, ctx.parameters);
  digest_.scan(cloud_.cloud.size(), kScanned, [this](std::size_t i, auto& sink) { this->hash_particle(i, sink); });
}

template <std::size_t kMost>
Innovation PoseParticles<kMost>::fuse(const sensor::LandmarkSighting& sighting, base::Micros stamp,
                                      const Context& ctx) {
  const LandmarkMap<kMapCapacity>* map = ctx.map_frame.map;
  const std::optional<Innovation> refused = refusal_of(sighting, map);
  if (refused) return *refused;
  Innovation record{.landmark = sighting.landmark};
  close_batch(stamp, ctx);
  if (batch_size_ == kBatch) return record;
  motion_.propagate(stamp, ctx.parameters);
  move_cloud(stamp, ctx);
  batch_stamp_ = stamp;
  batch_[batch_size_++] = sighting;
  record.verdict = sensor::Verdict::kAccepted;
  if (sighting.landmark == kAnyLandmark || !started_ || cloud_.lost()) return record;
  return distance_from(motion_.filter.x, motion_.filter.p, sighting, *map->find(sighting.landmark),
                       ctx.parameters.landmark, cloud_.options.cap);
}

template <std::size_t kMost>
void PoseParticles<kMost>::move_cloud(base::Micros t, const Context& ctx) {
  model::PlanarIncrement& travel = motion_.filter.travel;
  const bool any =
      base::abs(travel.ds_m) + base::abs(travel.dyaw_rad) > 0.0F || travel.var_ds > 0.0F || travel.var_dyaw > 0.0F;
  if (started_ && any)
    static_cast<void>(cloud_.predict({.ds_m = travel.ds_m,
                                      .dyaw_rad = travel.dyaw_rad,
                                      .sigma_ds_m = base::sqrt(travel.var_ds),
                                      .sigma_dyaw_rad = base::sqrt(travel.var_dyaw)}));
  travel = {};
  const float jitter_m2 = t > moved_ ? ctx.parameters.particles.jitter * base::seconds(t - moved_) : 0.0F;
  if (started_ && jitter_m2 > 0.0F) {
    const float jitter_m = base::sqrt(jitter_m2);
    static_cast<void>(cloud_.cloud.predict(filter::ParticleKernel{{jitter_m, 0, jitter_m, 0, 0, 0}}));
  }
  moved_ = t;
}

template <std::size_t kMost>
void PoseParticles<kMost>::weigh_batch(const Context& ctx) {
  const param::LandmarkParameters& n = ctx.parameters.landmark;
  const LandmarkMap<kMapCapacity>& map = *ctx.map_frame.map;
  if (!started_ && map.size() > 0) {
    origin_x_ = map.entry(0).x;
    origin_y_ = map.entry(0).y;
  }
  for (std::size_t i = 0; i < map.size(); ++i)
    landmarks_[i] = {.x_m = map.entry(i).x.minus(origin_x_), .y_m = map.entry(i).y.minus(origin_y_)};
  const std::span<const filter::ParticleLandmark> landmarks{landmarks_.data(), map.size()};
  std::array<filter::LandmarkSeen, kBatch> seen;
  std::size_t size = 0;
  float longest_m = 0;
  for (std::size_t i = 0; i < batch_size_; ++i) {
    const sensor::LandmarkSighting& one = batch_[i];
    const RangeAndBearing at = from_body(one.range_m, one.bearing_rad, n.mounting);
    const filter::LandmarkSeen candidate{
        .landmark = one.landmark == kAnyLandmark ? filter::LandmarkSeen::kAny : map.index(one.landmark),
        .range_m = at.range_m,
        .bearing_rad = at.bearing_rad,
        .sigma_range_m = n.sigma_range_m + n.sigma_range_per_m * one.range_m,
        .sigma_bearing_rad = n.sigma_bearing_rad};
    const bool known = one.landmark == kAnyLandmark || candidate.landmark != filter::LandmarkSeen::kAny;
    if (!known || !candidate.valid(landmarks.size())) continue;  // the map has changed since, or the range is none
    seen[size++] = candidate;
    longest_m = at.range_m > longest_m ? at.range_m : longest_m;
    digest_.update(static_cast<std::uint32_t>(one.landmark), one.range_m, one.bearing_rad);
  }
  batch_size_ = 0;
  if (size == 0) return;
  if (!started_) start_within(landmarks, longest_m);
  cloud_.options.temper = ctx.parameters.particles.temper;
  if (!cloud_.update({seen.data(), size}, landmarks)) return;
  if (!cloud_.lost()) last_absolute_ = batch_stamp_;
  adopt_estimate();
  follow_origin();
}

/// From no pose at all: the robot is no farther from the landmarks than it sees.
template <std::size_t kMost>
void PoseParticles<kMost>::start_within(std::span<const filter::ParticleLandmark> landmarks, float margin_m) {
  filter::ParticleLandmark low = landmarks[0], high = landmarks[0];
  for (const filter::ParticleLandmark& one : landmarks) {
    low = {.x_m = base::min(low.x_m, one.x_m), .y_m = base::min(low.y_m, one.y_m)};
    high = {.x_m = base::max(high.x_m, one.x_m), .y_m = base::max(high.y_m, one.y_m)};
  }
  cloud_.start_anywhere(kMost, {low.x_m - margin_m, low.y_m - margin_m}, {high.x_m + margin_m, high.y_m + margin_m});
  started_ = true;
}

/// Mean and covariance of the mode's neighbourhood become dead reckoning's.
template <std::size_t kMost>
void PoseParticles<kMost>::adopt_estimate() {
  const typename Cloud::Estimate estimate = cloud_.estimate();
  motion_.filter.x = {.x = origin_x_.plus(estimate.pose.x_m),
                      .y = origin_y_.plus(estimate.pose.y_m),
                      .yaw_rad = estimate.pose.yaw_rad()};
  motion_.filter.p = estimate.p;
  motion_.filter.p.add_diagonal({kFinest_m * kFinest_m, kFinest_m * kFinest_m, kFinest_rad * kFinest_rad});
  digest_.update(estimate.pose.x_m, estimate.pose.y_m, estimate.pose.yaw_rad(), estimate.p(0, 0), estimate.p(1, 1),
                 estimate.p(2, 2), estimate.share, cloud_.likelihood(), cloud_.cloud.epoch());
}

/// Far from its origin a float loses digits: the origin follows the robot by whole metres.
template <std::size_t kMost>
void PoseParticles<kMost>::follow_origin() {
  const float x_m = motion_.filter.x.x.minus(origin_x_), y_m = motion_.filter.x.y.minus(origin_y_);
  if (base::abs(x_m) < kFarFromOrigin_m && base::abs(y_m) < kFarFromOrigin_m) return;
  const float east_m = whole_metres(x_m), north_m = whole_metres(y_m);
  origin_x_ = origin_x_.plus(east_m);
  origin_y_ = origin_y_.plus(north_m);
  cloud_.cloud.transform([=](const filter::ParticlePose& p) {
    return filter::ParticlePose{
        .x_m = p.x_m - east_m, .y_m = p.y_m - north_m, .cos_yaw = p.cos_yaw, .sin_yaw = p.sin_yaw};
  });
}

template class PoseParticles<100>;
template class PoseParticles<1000>;

}  // namespace tetap::estimators
