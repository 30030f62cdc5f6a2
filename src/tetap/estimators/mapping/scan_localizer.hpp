// SPDX-License-Identifier: Apache-2.0
// The pose of a robot with a scanner on a map that it is given (Context::field). Odometry by scans moves particles, and
// scans weigh them on the map's likelihood field. The robot may begin anywhere on the map, and finds itself again.
// docs/explanation/scan_matching.md, "Localisation on a given map".
//
// Delayed, as the odometry by scans is.
#pragma once

#include "tetap/estimators/mapping/on_scan_odometry.hpp"
#include "tetap/slam/field_localisation.hpp"

namespace tetap::estimators {

template <int kBeams, int kFrames, std::size_t kParticles>
class ScanLocalizer : public OnScanOdometry<kBeams, kFrames> {
  using Odometer = ScanOdometry<kBeams, kFrames>;
  using Localisation = slam::FieldLocalisation<kParticles>;

 public:
  static constexpr sensor::EstimatorKind kKind = sensor::EstimatorKind::kParticle;

  /// Without a start pose the robot looks for itself on the whole map.
  void restart(base::Micros t, const Context& ctx);
  /// Without a heading the robot looks for itself on the whole map.
  void set_pose(base::Micros t, const SetPose& given, const Context& ctx);
  void advance(base::Micros t, const Context& ctx, const sensor::Window& window);
  /// A scan's match first, then the particles, then the search of the map.
  void work(std::uint32_t units, const Context& ctx);
  void abort_job();

  using OnScanOdometry<kBeams, kFrames>::fuse;
  Innovation fuse(const sensor::PlanarScan& scan, base::Micros stamp, std::uint8_t instance, const Context& ctx) {
    return odometer_.fuse(scan, stamp, instance, ctx);
  }

  /// Not valid: the odometry since the start, or since the pose was lost.
  [[nodiscard]] Estimate estimate(const Context& ctx) const;
  /// Aligning: the robot looks for itself. Waiting: there is no map.
  [[nodiscard]] sensor::Mode mode(const Context& ctx) const {
    if (ctx.field == nullptr) return sensor::Mode::kWaitingForPose;
    return localisation_.valid() ? odometer_.mode(ctx) : sensor::Mode::kAligning;
  }
  [[nodiscard]] const Localisation& localisation() const { return localisation_; }

  /// The particles and the search are not hashed: the digest stands for what each scan made of them.
  static constexpr auto members(auto& self) {
    return base::members(self.odometer_, base::unhashed(self.localisation_), base::in_turns(self.last_),
                         base::in_turns(self.weighed_), base::in_turns(self.seen_), base::in_turns(self.pose_),
                         base::in_turns(self.p_), self.digest_);
  }
  /// Every particle, for a comparison of whole states.
  template <class Sink>
  void hash_memory(Sink&& sink) const {
    for (std::size_t i = 0; i < localisation_.particles().size(); ++i) hash_particle(i, sink);
  }

 private:
  static constexpr std::size_t kScanned = 16;  ///< particles whose bits enter the digest in a tick
  static constexpr std::uint32_t kKey = 0x5CA7;

  template <class Sink>
  void hash_particle(std::size_t i, Sink& sink) const {
    const filter::ParticlePose& p = localisation_.particles()[i];
    for (const float v : {p.x_m, p.y_m, p.cos_yaw, p.sin_yaw, localisation_.particles().log_weight(i)}) sink(v);
  }
  void start(const SetPose& given);
  void adopt(const Context& ctx);

  using OnScanOdometry<kBeams, kFrames>::odometer_;
  Localisation localisation_;
  typename Odometer::Pose last_;     ///< pose of the odometry at the latest scan
  typename Odometer::Pose weighed_;  ///< pose of the odometry at the scan that is being weighed
  typename Odometer::Pose seen_;     ///< pose of the odometry at the scan that pose_ is of
  typename Odometer::Pose pose_;     ///< on the map
  filter::Symmetric<float, 3> p_;
  base::StateDigest digest_;
};

/// On a node of 64 kB.
using ScanLocalizer361 = ScanLocalizer<361, 4, 500>;

}  // namespace tetap::estimators
