// SPDX-License-Identifier: Apache-2.0
// The planar pose by a grid: Markov localisation among the landmarks of a map. The estimator finds the robot from no
// start at all, and again after a wrong one. Source: Fox, Burgard, Thrun, "Markov localization for mobile robots in
// dynamic environments", JAIR 11, 1999. Thrun, Burgard, Fox 2005, sec. 8.2.
//
// Delayed, and in jobs: a step of the grid, motion and update, takes many ticks. Sightings that come meanwhile wait for
// the next step, moved to its time by dead reckoning. After each step the mode's neighbourhood gives the mean pose and
// its covariance, and dead reckoning carries both to the present.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/base/state_digest.hpp"
#include "tetap/estimators/paced_job.hpp"
#include "tetap/estimators/planar/dead_reckoning.hpp"
#include "tetap/estimators/planar/grid_likelihood.hpp"
#include "tetap/estimators/planar/landmark_sighting.hpp"
#include "tetap/estimators/planar/summing_ekf.hpp"
#include "tetap/sensor/window.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::estimators {

/// kX times kY places over the landmarks' rectangle and kMargin_m around it, and kYaw headings. The rectangle is that
/// of the map at the first sighting after a start; a robot beyond it is taken to be at its edge.
template <int kX, int kY, int kYaw>
class PoseGrid {
  using Motion = PlanarDeadReckoning<SummingEkf>;
  using Grid = filter::Grid<kX, kY, kYaw>;

 public:
  static constexpr sensor::EstimatorKind kKind = sensor::EstimatorKind::kGrid;
  static constexpr bool kDelayed = true;
  static constexpr bool kUsesMap = true;
  /// Sightings of one step; those beyond are counted as not used.
  static constexpr std::size_t kBatch = 16;
  /// Cells whose bits enter the digest in one tick.
  static constexpr std::size_t kScanned = 64;
  static constexpr float kMargin_m = 2;

  void restart(base::Micros t, const Context& ctx);
  void set_pose(base::Micros t, const SetPose& given, const Context& ctx);
  void advance(base::Micros t, const Context& ctx, const sensor::Window& window);
  /// Begins a step when sightings wait or the robot has moved by a cell, and does the tick's share of the one under
  /// way.
  void work(std::uint32_t units, const Context& ctx);
  /// A closed window changes nothing for a grid at its far end: the step goes on.
  void abort_job() {}

  template <class Input>
  requires requires(Motion& motion, const Input& input, const param::Parameters& n) {
    motion.fuse(input, base::Micros{}, n);
  }
  Innovation fuse(const Input& input, base::Micros stamp, const Context& ctx) {
    return input_record(motion_.fuse(input, stamp, ctx.parameters));
  }
  /// Range and bearing together, of a landmark with identity. A sighting whose distance from the estimate exceeds the
  /// cap of the likelihood counts as rejected: it weighs no more than the cap.
  Innovation fuse(const sensor::LandmarkSighting& sighting, base::Micros stamp, const Context& ctx);

  [[nodiscard]] Estimate estimate(const Context& ctx) const {
    Estimate estimate = present_.estimate(ctx.parameters);
    estimate.position_valid = estimate.heading_valid = phase_ == Phase::kTracking;
    return estimate;
  }
  [[nodiscard]] MotionVariance motion_variance(const Context& ctx) const {
    return present_.motion_variance(ctx.parameters);
  }
  [[nodiscard]] sensor::Mode mode(const Context&) const {
    if (phase_ == Phase::kWaiting) return sensor::Mode::kWaitingForPose;
    if (phase_ == Phase::kSearching) return sensor::Mode::kAligning;
    return now_ - last_absolute_ > base::Micros{5'000'000} ? sensor::Mode::kDeadReckoning : sensor::Mode::kNominal;
  }
  /// Share of the mass in the mode's neighbourhood after the last update.
  [[nodiscard]] float share() const { return share_; }
  [[nodiscard]] const PacedJob& job() const { return job_; }
  [[nodiscard]] const Grid& grid() const { return grid_; }

  /// All but the cells, which digest() stands for.
  static constexpr auto members(auto& self) {
    return base::members(base::unhashed(self.grid_), self.motion_, base::unhashed(self.present_), self.origin_x_,
                         self.origin_y_, self.mark_, base::first(self.waiting_, self.waiting_count_),
                         base::first(self.rays_, self.ray_count_), base::in_turns(self.start_), self.job_,
                         base::count(self.waiting_count_), base::count(self.ray_count_), self.waiting_stamp_,
                         self.step_stamp_, self.last_absolute_, base::unhashed(self.now_), self.digest_, self.share_,
                         self.phase_, self.laid_out_, self.has_start_);
  }
  [[nodiscard]] std::uint32_t digest() const { return digest_.value(); }
  /// Every cell, for a comparison of whole states.
  template <class Sink>
  void hash_memory(Sink&& sink) const {
    for (const float cell : grid_.cells()) sink(cell);
  }

 private:
  enum class Phase : std::uint8_t { kWaiting, kSearching, kTracking };
  /// A pose is found when so much of the mass lies about the mode, and lost when less than half does.
  static constexpr float kFoundShare = 0.9F, kLostShare = 0.5F;
  static constexpr float kNeighbourhood_m = 0.75F, kNeighbourhood_rad = 0.6F;
  /// Probability, at each update, that somebody has carried the robot to anywhere on the grid.
  static constexpr float kCarriedShare = 1e-4F;
  static constexpr float kFinest_m = 1e-3F, kFinest_rad = 1e-3F;
  static constexpr float kLeastStep_m = 0.05F;

  struct Relative {
    float x_m = 0, y_m = 0, yaw_rad = 0;
  };
  /// A sighting that waits: in the body at its stamp, and the body's pose from the mark.
  struct Waiting {
    LandmarkRay ray;
    Relative body;
  };

  [[nodiscard]] Relative from_mark() const;
  [[nodiscard]] bool moved_by_a_cell() const;
  void lay_out(const LandmarkMap<kMapCapacity>& map);
  void begin_step(const Context& ctx);
  void adopt();
  [[nodiscard]] GridLikelihood<kBatch> likelihood() const {
    return {{rays_.data(), ray_count_}, start_, grid_.step_m(), Grid::turn_step_rad()};
  }

  Grid grid_;
  Motion motion_;                       ///< at the far end of the window; its travel is counted from the mark
  Motion present_;                      ///< the same carried over the window
  base::Anchored origin_x_, origin_y_;  ///< zero of the grid's coordinates
  model::PlanarPose mark_;              ///< pose of dead reckoning at the time of the last step of the grid
  std::array<Waiting, kBatch> waiting_{};
  std::array<LandmarkRay, kBatch> rays_{};  ///< sightings of the step under way
  StartDensity start_;                      ///< without an effect in all steps but the first after a start
  PacedJob job_;
  std::size_t waiting_count_ = 0, ray_count_ = 0;
  base::Micros waiting_stamp_;  ///< stamp of the last sighting that waits
  base::Micros step_stamp_;     ///< stamp of the last sighting in the step under way
  base::Micros last_absolute_;
  base::Micros now_;  ///< unhashed: of the last tick, set anew by the next
  base::StateDigest digest_;
  float share_ = 0;
  Phase phase_ = Phase::kWaiting;
  bool laid_out_ = false;   ///< the grid has its place
  bool has_start_ = false;  ///< the first step takes dead reckoning's pose for a start
};

}  // namespace tetap::estimators
