// SPDX-License-Identifier: Apache-2.0
// The poses of a scan on a whole map, as a job cut in units of work: every cell of a coarse grid in every heading is
// scored in integers, and the best places are climbed from. Exhaustive, as in Olson 2009, "Real-time correlative scan
// matching", without its pyramid: that would take as much memory as the map.
#pragma once

#include "tetap/filter/particle_pose.hpp"
#include "tetap/slam/likelihood_field.hpp"
#include "tetap/slam/scan_beams.hpp"

#include <array>

namespace tetap::slam {

template <int kBest>
class FieldSearch {
 public:
  struct Found {
    filter::ParticlePose pose;
    int score = 0;  ///< as ScanBeams::score
  };

  /// Searches for where this scan was taken.
  void begin(const ScanBeams& beams, const LikelihoodField& field) {
    beams_ = beams;
    count_ = 0;
    heading_ = 0;
    step_cells_ = static_cast<int>(kGrid_m / field.cell_m);
    if (step_cells_ < 1) step_cells_ = 1;
    phase_ = beams.count < kLeastBeams || !field.valid() ? Phase::kIdle : Phase::kScore;
    if (phase_ == Phase::kScore) turn(field);
  }
  void cancel() { phase_ = Phase::kIdle; }
  [[nodiscard]] bool busy() const { return phase_ != Phase::kIdle; }
  /// A unit is ten points of a pose, or a pose where no robot can be; true when the search has ended with them.
  bool work(int units, const LikelihoodField& field) {
    while (units > 0 && phase_ == Phase::kScore) units -= score_next(field);
    for (; units > 0 && phase_ == Phase::kClimb; units -= ScanBeams::kMost / kStride) climb(field);
    return phase_ == Phase::kIdle;
  }
  /// Best places, each apart from the others, in no order.
  [[nodiscard]] std::span<const Found> found() const {
    return std::span(found_).first(static_cast<std::size_t>(count_));
  }

 private:
  enum class Phase : std::uint8_t { kIdle, kScore, kClimb };
  static constexpr float kGrid_m = 0.45F;
  static constexpr int kHeadings = 90, kLeastBeams = 8, kStride = 10;
  static constexpr float kTwoPi = 6.28318531F;
  static constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }

  /// The scan's points in 1/256 of a cell, as seen in the heading at hand.
  void turn(const LikelihoodField& field) {
    const base::SinCos d = base::sincos(kTwoPi / kHeadings * static_cast<float>(heading_));
    direction_ = d;
    const float scale = 256.0F / field.cell_m;
    for (int i = 0; i < beams_.count; ++i) {
      const auto& b = beams_.point[at(i)];
      east_[at(i)] = nearest(scale * (d.cos * b.x_m - d.sin * b.y_m));
      north_[at(i)] = nearest(scale * (d.sin * b.x_m + d.cos * b.y_m));
    }
    x_ = y_ = step_cells_ / 2;
  }
  /// Implements docs/explanation/scan_matching.md (9). Returns the units of work.
  int score_next(const LikelihoodField& field) {
    const int here = field.level(x_, y_);
    int units = 1;
    if (here > 0 && here != field.kUnknown) {
      const int x = 256 * x_ + 128, y = 256 * y_ + 128, least = count_ == kBest ? worst_ : 0;
      int sum = 0, i = 0;
      while (i < beams_.count && sum + field.kFar * (beams_.count - i) > least) {  // it can be among the best
        for (const int end = i + kStride < beams_.count ? i + kStride : beams_.count; i < end; ++i)
          sum += ScanBeams::worth(field.level((x + east_[at(i)]) >> 8, (y + north_[at(i)]) >> 8));
        ++units;
      }
      if (i == beams_.count) note(sum, field);
    }
    next_place(field);
    return units;
  }
  void next_place(const LikelihoodField& field) {
    x_ += step_cells_;
    if (x_ < field.columns * field.kTile) return;
    x_ = step_cells_ / 2;
    y_ += step_cells_;
    if (y_ < field.rows * field.kTile) return;
    if (++heading_ < kHeadings) return turn(field);
    phase_ = count_ > 0 ? Phase::kClimb : Phase::kIdle;
    climbed_ = 0;
    begin_climb(field);
  }
  /// Among the best ones, unless a better one is near.
  void note(int sum, const LikelihoodField& field) {
    if (count_ == kBest && sum <= worst_) return;
    const filter::ParticlePose pose{.x_m = field.low_x_m + (static_cast<float>(x_) + 0.5F) * field.cell_m,
                                    .y_m = field.low_y_m + (static_cast<float>(y_) + 0.5F) * field.cell_m,
                                    .cos_yaw = direction_.cos,
                                    .sin_yaw = direction_.sin};
    int place = -1;
    for (int k = 0; k < count_; ++k) {
      const filter::ParticlePose& p = found_[at(k)].pose;
      const float dx = p.x_m - pose.x_m, dy = p.y_m - pose.y_m;
      const bool near = dx * dx + dy * dy < 1.44F && p.cos_yaw * pose.cos_yaw + p.sin_yaw * pose.sin_yaw > 0.98F;
      if (!near) continue;
      if (found_[at(k)].score >= sum) return;
      place = k;
      break;
    }
    if (place < 0 && count_ < kBest) place = count_++;
    if (place < 0)
      for (int k = 0; k < kBest; ++k)
        if (found_[at(k)].score == worst_) place = k;
    found_[at(place)] = {.pose = pose, .score = sum};
    worst_ = found_[0].score;
    for (int k = 1; k < count_; ++k) worst_ = found_[at(k)].score < worst_ ? found_[at(k)].score : worst_;
  }

  void begin_climb(const LikelihoodField& field) {
    trial_ = 0;
    stride_ = 1.0F;
    if (phase_ == Phase::kClimb) found_[at(climbed_)].score = beams_.score(found_[at(climbed_)].pose, field);
  }
  /// One neighbour of the place at hand: along x, y or in heading, by strides that are halved.
  void climb(const LikelihoodField& field) {
    Found& best = found_[at(climbed_)];
    const int axis = trial_ % 6 / 2;
    const float way = (trial_ % 2 == 0 ? 0.5F : -0.5F) * stride_;
    filter::ParticlePose tried = best.pose;
    if (axis == 0) tried.x_m += way * kGrid_m;
    if (axis == 1) tried.y_m += way * kGrid_m;
    if (axis == 2) tried = filter::ParticlePose::at(tried.x_m, tried.y_m, tried.yaw_rad() + way * (kTwoPi / kHeadings));
    const int score = beams_.score(tried, field);
    if (score > best.score) best = {.pose = tried, .score = score};
    if (++trial_ % 12 == 0) stride_ *= 0.5F;
    if (trial_ < 48) return;
    if (++climbed_ == count_) return cancel();
    begin_climb(field);
  }

  ScanBeams beams_;
  std::array<std::int32_t, ScanBeams::kMost> east_{}, north_{};
  std::array<Found, static_cast<std::size_t>(kBest)> found_{};
  base::SinCos direction_{};
  float stride_ = 1;
  int count_ = 0, worst_ = 0, heading_ = 0, x_ = 0, y_ = 0, step_cells_ = 1, climbed_ = 0, trial_ = 0;
  Phase phase_ = Phase::kIdle;
};

}  // namespace tetap::slam
