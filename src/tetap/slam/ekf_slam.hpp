// SPDX-License-Identifier: Apache-2.0
// EKF-SLAM of fixed capacity: a planar pose and the landmarks that it sees, with one covariance (Smith, Self &
// Cheeseman 1990; Thrun, Burgard, Fox 2005, ch. 10). Errors are those of the right-invariant filter (Barrau & Bonnabel
// 2015, arXiv 1510.06263). They are kept as an additive covariance that moves with each correction. The heading never
// gains from landmarks that nothing but the robot itself has placed. docs/explanation/ekf_slam.md has the equations.
#pragma once

#include "tetap/filter/big_covariance.hpp"
#include "tetap/model/planar_increment.hpp"
#include "tetap/slam/landmark_map.hpp"
#include "tetap/slam/sighting.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

namespace tetap::slam {

/// Fate of a new landmark when all are in use and none of them is unconfirmed.
enum class WhenFull : std::uint8_t { kRefuse, kReplaceOldest };

struct EkfSlamOptions {
  SightingNoise noise;
  model::PlanarMounting mounting;
  float gate = 13.816F;               ///< NIS of a sighting with two components: chi-square, 99.9 %
  float gate_of_one = 10.828F;        ///< NIS of a single component: chi-square, 99.9 %
  float correlation_m = 0;            ///< path over which errors of one landmark's sightings stay alike; 0: none
  std::uint16_t confirming_hits = 3;  ///< a landmark of fewer sightings gives way when there is no room
  WhenFull when_full = WhenFull::kRefuse;
};

struct EkfSlamCounts {
  std::uint32_t fused = 0, rejected = 0, outliers = 0;
  std::uint32_t landmarks_added = 0, landmarks_removed = 0, no_room = 0;
};

template <int kLandmarks_, int kBatch_ = 5>
class EkfSlam {
 public:
  static constexpr int kLandmarks = kLandmarks_, kBatch = kBatch_;
  static constexpr int kStates = 3 + 2 * kLandmarks;
  static_assert(kLandmarks >= 1 && kBatch >= 1);
  using Covariance = filter::BigCovariance<float, kStates>;
  using Map = LandmarkMap<kLandmarks>;

  EkfSlamOptions options;

  [[nodiscard]] const model::PlanarPose& pose() const { return pose_; }
  [[nodiscard]] const Map& map() const { return map_; }
  [[nodiscard]] const Covariance& covariance() const { return p_; }
  [[nodiscard]] const EkfSlamCounts& counts() const { return counts_; }
  [[nodiscard]] filter::Symmetric<float, 3> pose_covariance() const {
    filter::Symmetric<float, 3> p;
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r <= c; ++r) p(r, c) = p_(r, c);
    return p;
  }
  /// Covariance of landmark k: x, y in n.
  [[nodiscard]] Covariance2 landmark_covariance(int k) const {
    const int s = state_of(k);
    return {p_(s, s), p_(s, s + 1), p_(s + 1, s + 1)};
  }

  /// Begins anew at a pose, without landmarks.
  void start(const model::PlanarPose& pose, const filter::Symmetric<float, 3>& p) {
    pose_ = pose;
    p_.clear();
    map_.clear();
    typename Covariance::States column{};
    for (int c = 0; c < 3; ++c) {
      for (int r = 0; r < c; ++r) column[at(r)] = p(r, c);
      static_cast<void>(p_.add(column, p(c, c)));
    }
  }
  /// Forgets the landmarks; the pose and its covariance stay.
  void reset_map() {
    while (map_.size() > 0) remove(map_.size() - 1);
  }
  /// Moves robot and map rigidly so that the robot is at `pose`. Covariances beside the robot stay; `p` is the new
  /// uncertainty of the whole.
  void set_pose(const model::PlanarPose& pose, const filter::Symmetric<float, 3>& p);

  /// Implements docs/explanation/ekf_slam.md (5). False, and nothing has changed, when the increment is no number.
  bool predict(const model::PlanarIncrement& increment) {
    if (!(base::abs(increment.ds_m) < 1e4F && base::abs(increment.dyaw_rad) < 1e3F && increment.var_ds >= 0.0F &&
          increment.var_ds < 1e6F && increment.var_dyaw >= 0.0F && increment.var_dyaw < 1e4F &&
          base::abs(increment.cov_ds_dyaw) < 1e5F))
      return false;
    const auto step = increment.step(pose_);
    std::array<std::array<float, 3>, 3> q;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) q[at(r)][at(c)] = step.q(r, c);
    p_.template predict_head<3>({step.f(0, 2), step.f(1, 2)}, q);
    pose_ = step.x;
    path_.move(increment.ds_m, increment.dyaw_rad);
    return true;
  }

  struct Pair {
    int sighting, landmark;
  };
  /// Fuses sightings of one stamp with the landmarks they belong to, kBatch at a time, in the order of `pairs`.
  void fuse(std::span<const Sighting> seen, std::span<const Pair> pairs, std::int64_t stamp_us,
            std::span<SightingRecord> records) {
    for (std::size_t first = 0; first < pairs.size(); first += kBatch)
      fuse_batch(seen, pairs.subspan(first, std::min<std::size_t>(kBatch, pairs.size() - first)), stamp_us, records);
  }

  [[nodiscard]] SightLine line(const Sighting& seen, int k) const {
    return {pose_, map_[k].place, options.mounting, seen, options.noise};
  }
  /// H P H'^T of two sightings against landmarks k and l.
  [[nodiscard]] std::array<std::array<float, 2>, 2> cross(const SightLine& a, int k, const SightLine& b, int l) const {
    std::array<std::array<float, 2>, 2> product{};
    for (int t = 0; t < 5; ++t)
      for (int j = 0; j < 5; ++j) {
        const float p = p_(touched(k, t), touched(l, j));
        for (std::size_t r = 0; r < 2; ++r)
          for (std::size_t c = 0; c < 2; ++c) product[r][c] += a.h[r][at(t)] * p * b.h[c][at(j)];
      }
    return product;
  }
  /// Innovation, its covariance and NIS of a sighting against landmark k, by itself.
  [[nodiscard]] SightingRecord compare(const Sighting& seen, int k) const {
    const SightLine line = this->line(seen, k);
    std::array<std::array<float, 5>, 2> ph{};
    for (int t = 0; t < 5; ++t)
      for (std::size_t r = 0; r < 2; ++r)
        for (int j = 0; j < 5; ++j) ph[r][at(t)] += p_(touched(k, t), touched(k, j)) * line.h[r][at(j)];
    return record_of(seen, k, line, [&](std::size_t r, int t) { return ph[r][at(t)]; });
  }

  /// A landmark from range and bearing, at once. Implements docs/explanation/ekf_slam.md (9). Its number, or kNone.
  int add(const Sighting& seen, std::uint16_t id, std::int64_t stamp_us) {
    const base::SinCos heading = base::sincos(pose_.yaw_rad);
    const base::SinCos look = base::sincos(pose_.yaw_rad + options.mounting.yaw_rad + seen.bearing_rad);
    const model::PlanarMounting& m = options.mounting;
    const float dx = heading.cos * m.x_b_m - heading.sin * m.y_b_m + seen.range_m * look.cos;
    const float dy = heading.sin * m.x_b_m + heading.cos * m.y_b_m + seen.range_m * look.sin;
    const float along = options.noise.range_variance(seen.range_m);
    const float across = seen.range_m * seen.range_m * options.noise.bearing_variance();
    return add(dx, dy,
               {.xx = look.cos * look.cos * along + look.sin * look.sin * across,
                .xy = look.cos * look.sin * (along - across),
                .yy = look.sin * look.sin * along + look.cos * look.cos * across},
               id, stamp_us);
  }
  /// A landmark at (dx, dy) from the robot, axes of n, where that displacement has an error of its own.
  int add(float dx_m, float dy_m, const Covariance2& own, std::uint16_t id, std::int64_t stamp_us) {
    if (!make_room()) return Map::kNone;
    static_cast<void>(map_.add({.place = {.x = pose_.x.plus(dx_m), .y = pose_.y.plus(dy_m)},
                                .seen_us = stamp_us,
                                .seen_path_um = path_.um(),
                                .id = id,
                                .hits = 1}));
    typename Covariance::States x{}, y{};
    const int n = p_.size();
    for (int i = 0; i < n; ++i) {
      x[at(i)] = p_(i, 0) - dy_m * p_(i, 2);
      y[at(i)] = p_(i, 1) + dx_m * p_(i, 2);
    }
    const float xx = x[0] - dy_m * x[2] + own.xx, yx = x[1] + dx_m * x[2] + own.xy, yy = y[1] + dx_m * y[2] + own.yy;
    static_cast<void>(p_.add(x, xx));
    y[at(n)] = yx;
    static_cast<void>(p_.add(y, yy));
    ++counts_.landmarks_added;
    return map_.size() - 1;
  }
  void remove(int k) {
    p_.remove(state_of(k), 2);
    map_.remove(k);
    ++counts_.landmarks_removed;
  }

 private:
  static constexpr int kRank = 2 * kBatch;
  static constexpr float kRounding = 0x1p-24F;  ///< share of a variance that an update may lose to rounding
  static constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }
  static constexpr int state_of(int k) { return 3 + 2 * k; }
  /// State of element t of a SightLine's row.
  static constexpr int touched(int k, int t) { return t < 3 ? t : state_of(k) + t - 3; }

  /// From two columns of P H^T, by row and element of the row, S = H P H^T + R and the NIS. Implements
  /// docs/explanation/ekf_slam.md (2) to (3).
  template <class Product>
  [[nodiscard]] SightingRecord record_of(const Sighting& seen, int k, const SightLine& line, const Product& ph) const {
    SightingRecord record;
    record.components = static_cast<std::uint8_t>(seen.components());
    record.id = map_[k].id;
    record.nu = line.nu;
    record.s = {.xx = line.r[0], .xy = 0, .yy = line.r[1]};
    for (int t = 0; t < 5; ++t) {
      record.s.xx += line.h[0][at(t)] * ph(0, t);
      record.s.xy += line.h[0][at(t)] * ph(1, t);
      record.s.yy += line.h[1][at(t)] * ph(1, t);
    }
    const Root2 root(record.s);
    record.verdict = root.valid ? SightingVerdict::kAccepted : SightingVerdict::kSingular;
    if (!root.valid) return record;
    record.nis = root.squared(record.nu);
    if (!(record.nis <= gate_of(record.components))) record.verdict = SightingVerdict::kRejected;
    return record;
  }
  [[nodiscard]] float gate_of(int components) const { return components == 2 ? options.gate : options.gate_of_one; }

  void fuse_batch(std::span<const Sighting> seen, std::span<const Pair> pairs, std::int64_t stamp_us,
                  std::span<SightingRecord> records);
  bool gain(const SightLine& line, int k, int rank, const SightingRecord& record, float repeated);
  template <int kBefore>
  void condition(const std::array<std::array<float, 2>, kRank>& rows, const Root2& root);
  template <int kColumns>
  void corrections();
  void apply(int rank);
  /// x.plus(d), quick where the anchor stays.
  static void add_to(base::Anchored& x, float d_m) {
    const float sum = x.offset_m + d_m;
    if (sum <= 128.0F && sum >= -128.0F) [[likely]] {
      x.offset_m = sum;
    } else {
      x = x.plus(d_m);
    }
  }
  /// use(columns) with the rank as a constant, 2 kLeast to 2 kMost.
  template <int kLeast, int kMost, class Use>
  static void with_rank(int rank, const Use& use) {
    if constexpr (kMost > kLeast) {
      if (rank < 2 * kMost) return with_rank<kLeast, kMost - 1>(rank, use);
    }
    use(std::integral_constant<int, 2 * kMost>{});
  }
  [[nodiscard]] bool make_room();

  model::PlanarPose pose_;
  ViewPath path_;
  Map map_;
  Covariance p_;
  EkfSlamCounts counts_;
  /// Scratch of an update: columns u and b of (8), then G; y of each column of G.
  typename Covariance::template Rows<static_cast<std::size_t>(kRank) + 2> w_{};
  std::array<float, static_cast<std::size_t>(kRank)> y_{};
};

}  // namespace tetap::slam

#include "tetap/slam/ekf_slam_update.hpp"
