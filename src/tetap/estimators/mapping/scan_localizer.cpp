// SPDX-License-Identifier: Apache-2.0
#include "tetap/estimators/mapping/scan_localizer.hpp"

#include "tetap/base/reinitialise.hpp"
#include "tetap/estimators/mapping/map_pose.hpp"
#include "tetap/estimators/scanner.hpp"

namespace tetap::estimators {

template <int kBeams, int kFrames, std::size_t kParticles>
void ScanLocalizer<kBeams, kFrames, kParticles>::restart(base::Micros t, const Context& ctx) {
  odometer_.restart(t, ctx);
  base::reinitialise(localisation_);
  localisation_.set_key({kKey, static_cast<std::uint32_t>(ctx.parameters.mapping.seed)});
  digest_.restart();
  last_ = weighed_ = seen_ = pose_ = odometer_.scan_pose();
  p_ = filter::Symmetric<float, 3>::diagonal(
      {kUnknown_m * kUnknown_m, kUnknown_m * kUnknown_m, kUnknown_rad * kUnknown_rad});
  if (ctx.parameters.start.known != 0)
    start(start_pose(ctx.parameters.start));
  else
    localisation_.start_anywhere();
}

template <int kBeams, int kFrames, std::size_t kParticles>
void ScanLocalizer<kBeams, kFrames, kParticles>::set_pose(base::Micros t, const SetPose& given, const Context& ctx) {
  odometer_.set_pose(t, given, ctx);
  last_ = weighed_ = seen_ = pose_ = odometer_.scan_pose();
  start(given);
}

template <int kBeams, int kFrames, std::size_t kParticles>
void ScanLocalizer<kBeams, kFrames, kParticles>::start(const SetPose& given) {
  if (!(given.sigma_yaw_rad < 3.14F)) return localisation_.start_anywhere();
  localisation_.start(filter::ParticlePose::at(pose_.x.metres(), pose_.y.metres(), pose_.yaw.radians()),
                      given.sigma_position_m, given.sigma_yaw_rad);
  const float place_m2 = given.sigma_position_m * given.sigma_position_m;
  p_ = filter::Symmetric<float, 3>::diagonal(
      {place_m2 + 1e-4F, place_m2 + 1e-4F, given.sigma_yaw_rad * given.sigma_yaw_rad + 1e-5F});
}

template <int kBeams, int kFrames, std::size_t kParticles>
void ScanLocalizer<kBeams, kFrames, kParticles>::advance(base::Micros t, const Context& ctx,
                                                         const sensor::Window& window) {
  odometer_.advance(t, ctx, window);
  digest_.scan(localisation_.particles().size(), kScanned,
               [this](std::size_t i, auto& sink) { this->hash_particle(i, sink); });
}

template <int kBeams, int kFrames, std::size_t kParticles>
void ScanLocalizer<kBeams, kFrames, kParticles>::work(std::uint32_t units, const Context& ctx) {
  if (ctx.field == nullptr) return odometer_.work(units, ctx);
  if (!odometer_.busy()) {
    if (localisation_.work(static_cast<int>(units), *ctx.field)) adopt(ctx);
    return;
  }
  odometer_.work(units, ctx);
  if (odometer_.busy()) return;
  const auto now = odometer_.scan_pose();
  localisation_.move(now.minus(last_));
  last_ = now;
  if (localisation_.see(slam::ScanBeams::of(odometer_.keyframe_scan(), scanner_mounting(ctx.parameters.lidar).mean),
                        *ctx.field))
    weighed_ = now;
}

template <int kBeams, int kFrames, std::size_t kParticles>
void ScanLocalizer<kBeams, kFrames, kParticles>::abort_job() {
  odometer_.abort_job();
  localisation_.cancel();
}

/// The map's walls, its cells and what all beams have in common make an error that no number of particles shows.
template <int kBeams, int kFrames, std::size_t kParticles>
void ScanLocalizer<kBeams, kFrames, kParticles>::adopt(const Context& ctx) {
  constexpr float kMap_m = 0.05F, kCells = 0.25F, kLeast_rad = 0.01F;
  const auto& e = localisation_.estimate();
  const float least_m = kMap_m + kCells * ctx.field->cell_m;
  seen_ = weighed_;
  pose_ = {slam::Coordinate<float>{}.plus(e.pose.x_m), slam::Coordinate<float>{}.plus(e.pose.y_m),
           slam::Heading<float>::from_radians(e.pose.yaw_rad())};
  p_ = e.p;
  p_.add_diagonal({least_m * least_m, least_m * least_m, kLeast_rad * kLeast_rad});
  digest_.update(e.pose.x_m, e.pose.y_m, e.pose.yaw_rad(), p_(0, 0), p_(1, 1), p_(2, 2), e.share, localisation_.fit(),
                 localisation_.particles().epoch());
}

template <int kBeams, int kFrames, std::size_t kParticles>
Estimate ScanLocalizer<kBeams, kFrames, kParticles>::estimate(const Context& ctx) const {
  constexpr float kPlace_m = 0.01F, kPerWay = 0.03F, kTurn_rad = 0.003F;
  Estimate estimate = odometer_.estimate(ctx);
  const slam::Displacement<float> since = graph_pose<float>(estimate.pose).minus(seen_);
  const float place_m = kPlace_m + kPerWay * (base::abs(since.x_m) + base::abs(since.y_m));
  const float turn_rad = kTurn_rad + kPerWay * base::abs(since.yaw.radians());
  const slam::UncertainDisplacement<float> here{.mean = {0.0F, 0.0F, pose_.yaw}, .covariance = p_};
  const slam::UncertainDisplacement<float> way{
      .mean = since,
      .covariance = filter::Symmetric<float, 3>::diagonal({place_m * place_m, place_m * place_m, turn_rad * turn_rad})};
  estimate.p = compose(here, way).covariance;
  estimate.pose = planar_pose(pose_.plus(since));
  estimate.position_valid = estimate.heading_valid = ctx.field != nullptr && localisation_.valid();
  return estimate;
}

template class ScanLocalizer<361, 4, 500>;

}  // namespace tetap::estimators
