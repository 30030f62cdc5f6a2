// SPDX-License-Identifier: Apache-2.0
// The front of EKF-SLAM: the sightings of one stamp in an order of their own, their landmarks, and new landmarks. A
// sighting finds its landmark by identity or by association, or it is ambiguous.
#pragma once

#include "tetap/slam/association.hpp"
#include "tetap/slam/ekf_slam.hpp"
#include "tetap/slam/joint_compatibility.hpp"
#include "tetap/slam/partial_sightings.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::slam {

/// Method by which sightings without identity find their landmarks.
enum class AssociationMethod : std::uint8_t { kNearest, kAssignment, kJoint };

struct EkfMapperOptions {
  AssociationMethod method = AssociationMethod::kNearest;
  float gate = 9.21F;         ///< NIS of a pair: chi-square with two degrees of freedom, 99 %
  float new_gate = 13.816F;   ///< NIS beside every landmark of a new one; between the two gates: ambiguous
  float margin = 3.0F;        ///< a second landmark whose NIS is no more than this larger makes a pair ambiguous
  float separation_m = 0.8F;  ///< no new landmark nearer than this to another one
  std::int64_t expiry_us = 30'000'000;  ///< an unconfirmed landmark without identity unseen for this long is removed
};

template <int kLandmarks_, int kSightings_ = 16, int kBatch_ = 5>
class EkfMapper {
 public:
  static constexpr int kSightings = kSightings_;
  using Core = EkfSlam<kLandmarks_, kBatch_>;
  static constexpr int kNone = Core::Map::kNone;

  Core core;
  EkfMapperOptions options;

  struct Counts {
    std::uint32_t surplus = 0;  ///< sightings of a stamp beyond kSightings
    std::uint32_t invalid = 0;  ///< no numbers, or none that a sensor gives
    std::uint32_t ambiguous = 0;
    std::uint32_t pending = 0;
    std::uint32_t forgotten = 0;  ///< unconfirmed landmarks
  };
  [[nodiscard]] const Counts& counts() const { return counts_; }

  void start(const model::PlanarPose& pose, const filter::Symmetric<float, 3>& p) {
    core.start(pose, p);
    partial_.clear();
  }
  void reset_map() {
    core.reset_map();
    partial_.clear();
  }
  void set_pose(const model::PlanarPose& pose, const filter::Symmetric<float, 3>& p) {
    core.set_pose(pose, p);
    partial_.clear();
  }
  bool predict(const model::PlanarIncrement& increment) {
    if (!core.predict(increment)) return false;
    partial_.move(increment);
    return true;
  }

  /// All sightings of one stamp. Their records, in the order of `seen`; valid until the next call.
  std::span<const SightingRecord> update(std::span<const Sighting> seen, std::int64_t stamp_us) {
    if (seen.size() > kMost) counts_.surplus += static_cast<std::uint32_t>(seen.size() - kMost);
    const std::span<const Sighting> all = seen.first(seen.size() < kMost ? seen.size() : kMost);
    put_in_order(all);
    drop_expired(stamp_us);
    find_landmarks(all);
    std::array<typename Core::Pair, kMost> pairs;
    std::size_t count = 0;
    for (std::size_t i = 0; i < ordered_; ++i)
      if (landmark_[order_[i]] != kNone)
        pairs[count++] = {.sighting = static_cast<int>(order_[i]), .landmark = landmark_[order_[i]]};
    core.fuse(all, {pairs.data(), count}, stamp_us, records_);
    for (std::size_t i = 0; i < ordered_; ++i)
      if (is_new_[order_[i]]) begin_landmark(all[order_[i]], stamp_us, records_[order_[i]]);
    return {records_.data(), all.size()};
  }

 private:
  static constexpr auto kMost = static_cast<std::size_t>(kSightings);
  static constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }

  /// The valid sightings, sorted.
  void put_in_order(std::span<const Sighting> seen) {
    ordered_ = 0;
    for (std::size_t s = 0; s < seen.size(); ++s) {
      records_[s] = {};
      landmark_[s] = kNone;
      is_new_[s] = false;
      if (!seen[s].valid()) {
        records_[s].verdict = SightingVerdict::kNotFinite;
        ++counts_.invalid;
        continue;
      }
      std::size_t i = ordered_++;
      for (; i > 0 && seen[s].before(seen[order_[i - 1]]); --i) order_[i] = order_[i - 1];
      order_[i] = s;
    }
  }
  /// Removes landmarks that were seen too seldom and too long ago. Those with an identity stay.
  void drop_expired(std::int64_t stamp_us) {
    for (int k = core.map().size() - 1; k >= 0; --k) {
      const MapLandmark& landmark = core.map()[k];
      if (landmark.hits >= core.options.confirming_hits || named(landmark.id) ||
          stamp_us - landmark.seen_us < options.expiry_us)
        continue;
      core.remove(k);
      ++counts_.forgotten;
    }
  }
  void find_landmarks(std::span<const Sighting> seen) {
    nameless_ = 0;
    for (std::size_t i = 0; i < ordered_; ++i) {
      const std::size_t s = order_[i];
      if (seen[s].id == Sighting::kNoId) {
        rows_[nameless_++] = s;
      } else {
        landmark_[s] = core.map().find(seen[s].id);
        is_new_[s] = landmark_[s] == kNone;
      }
    }
    if (nameless_ > 0) associate(seen);
  }
  void associate(std::span<const Sighting> seen);
  [[nodiscard]] bool separated(const Sighting& seen) const;
  void begin_landmark(const Sighting& seen, std::int64_t stamp_us, SightingRecord& record);

  /// Identities from kFirstNameless on are of landmarks that were seen without one.
  static constexpr std::uint16_t kFirstNameless = 0x4000;
  [[nodiscard]] static constexpr bool named(std::uint16_t id) { return id < kFirstNameless; }
  [[nodiscard]] std::uint16_t next_nameless() const {
    std::uint16_t id = kFirstNameless;
    while (core.map().find(id) != kNone) ++id;
    return id;
  }

  /// The sightings of one stamp as JointCompatibility asks for them.
  struct JointModel {
    const EkfMapper& mapper;
    std::span<const Sighting> seen;
    [[nodiscard]] const Sighting& sighting(int row) const { return seen[mapper.rows_[at(row)]]; }
    [[nodiscard]] bool allowed(int row, int column) const {
      return mapper.cost_[at(row)][at(column)] < association_cost(mapper.options.gate);
    }
    [[nodiscard]] SightLine line(int row, int column) const { return mapper.core.line(sighting(row), column); }
    [[nodiscard]] Covariance2 innovation(int row, int column) const {
      return mapper.core.compare(sighting(row), column).s;
    }
    [[nodiscard]] Block2 cross(int row, int column, int other_row, int other_column) const {
      return mapper.core.cross(line(row, column), column, line(other_row, other_column), other_column);
    }
  };

  Counts counts_;
  PartialSightings partial_;
  std::array<SightingRecord, kMost> records_{};
  std::array<std::size_t, kMost> order_{}, rows_{};
  std::size_t ordered_ = 0, nameless_ = 0;
  std::array<int, kMost> landmark_{};  ///< landmark that a sighting belongs to, or kNone
  std::array<bool, kMost> is_new_{};
  std::array<std::array<std::int32_t, static_cast<std::size_t>(kLandmarks_)>, kMost> cost_{};
  Association<kSightings_, kLandmarks_> association_;
  JointCompatibility<kSightings_, kLandmarks_> joint_;
};

/// Landmarks of the sightings without identity: a pair, a new landmark, or ambiguous. Implements
/// docs/explanation/ekf_slam.md (10) to (11).
template <int kLandmarks_, int kSightings_, int kBatch_>
void EkfMapper<kLandmarks_, kSightings_, kBatch_>::associate(std::span<const Sighting> seen) {
  const int columns = core.map().size(), rows = static_cast<int>(nameless_);
  const std::int32_t gate = association_cost(options.gate);
  association_.begin(rows, columns, gate);
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      const SightingRecord record = core.compare(seen[rows_[at(r)]], c);
      const bool none = record.verdict == SightingVerdict::kSingular;
      cost_[at(r)][at(c)] = none ? kForbidden : association_cost(record.nis);
      association_.set(r, c, cost_[at(r)][at(c)]);
    }
  std::array<int, kMost> found;
  switch (options.method) {
    case AssociationMethod::kNearest:
      found = association_.nearest();
      break;
    case AssociationMethod::kAssignment:
      found = association_.assign();
      break;
    case AssociationMethod::kJoint:
      found = joint_.search(JointModel{*this, seen}, rows, columns).landmark;
      break;
  }
  for (int r = 0; r < rows; ++r) {
    const std::size_t s = rows_[at(r)];
    const int mine = found[at(r)];
    std::int32_t others = kForbidden;
    int next = kNone;
    for (int c = 0; c < columns; ++c)
      if (c != mine && cost_[at(r)][at(c)] < others) others = cost_[at(r)][at(c)], next = c;
    const bool clear = mine == kNone ? others >= association_cost(options.new_gate) && separated(seen[s])
                                     : others >= cost_[at(r)][at(mine)] + association_cost(options.margin);
    if (!clear) {
      if (mine != kNone || next != kNone) records_[s] = core.compare(seen[s], mine != kNone ? mine : next);
      records_[s].verdict = SightingVerdict::kAmbiguous;
      ++counts_.ambiguous;
    } else {
      landmark_[s] = mine;
      is_new_[s] = mine == kNone;
    }
  }
}

template <int kLandmarks_, int kSightings_, int kBatch_>
bool EkfMapper<kLandmarks_, kSightings_, kBatch_>::separated(const Sighting& seen) const {
  if (seen.components() < 2) return true;
  const base::SinCos look = base::sincos(core.pose().yaw_rad + core.options.mounting.yaw_rad + seen.bearing_rad);
  const float least = options.separation_m * options.separation_m;
  for (int k = 0; k < core.map().size(); ++k) {
    const float dx = core.map()[k].place.x.minus(core.pose().x) - seen.range_m * look.cos;
    const float dy = core.map()[k].place.y.minus(core.pose().y) - seen.range_m * look.sin;
    if (dx * dx + dy * dy < least) return false;
  }
  return true;
}

/// A landmark at once from range and bearing; from one of them when more sightings have come.
template <int kLandmarks_, int kSightings_, int kBatch_>
void EkfMapper<kLandmarks_, kSightings_, kBatch_>::begin_landmark(const Sighting& seen, std::int64_t stamp_us,
                                                                  SightingRecord& record) {
  record.components = static_cast<std::uint8_t>(seen.components());
  record.id = seen.id == Sighting::kNoId ? next_nameless() : seen.id;
  const int twin = core.map().find(seen.id);
  if (twin != kNone) {  // the second sighting of a landmark that this stamp began
    record.verdict = SightingVerdict::kPending;
    ++counts_.pending;
    return;
  }
  if (seen.id == Sighting::kNoId && !separated(seen)) {  // beside a landmark that this stamp began
    record.verdict = SightingVerdict::kAmbiguous;
    ++counts_.ambiguous;
    return;
  }
  int added = kNone;
  if (seen.components() == 2) {
    added = core.add(seen, record.id, stamp_us);
  } else {
    if (seen.id == Sighting::kNoId) {
      record.verdict = SightingVerdict::kNotUsed;
      return;
    }
    const auto place = partial_.add(seen, core.options.noise, core.options.mounting);
    if (!place.known) {
      record.verdict = SightingVerdict::kPending;
      ++counts_.pending;
      return;
    }
    const base::SinCos heading = base::sincos(core.pose().yaw_rad);
    const float c = heading.cos, s = heading.sin;
    const Covariance2& b = place.covariance;
    added = core.add(c * place.x_b_m - s * place.y_b_m, s * place.x_b_m + c * place.y_b_m,
                     {.xx = c * c * b.xx - 2.0F * c * s * b.xy + s * s * b.yy,
                      .xy = c * s * (b.xx - b.yy) + (c * c - s * s) * b.xy,
                      .yy = s * s * b.xx + 2.0F * c * s * b.xy + c * c * b.yy},
                     record.id, stamp_us);
  }
  record.verdict = added == kNone ? SightingVerdict::kNoRoom : SightingVerdict::kNewLandmark;
}

}  // namespace tetap::slam
