// SPDX-License-Identifier: Apache-2.0
// What the IMU samples of the window add up to, in cells on a grid of time, so that the present is reached over a
// handful of cells and not over every sample anew in every tick. A pure cache: cells that grew sample by sample are,
// bit for bit, those made at once of what the window holds.
#pragma once

#include "checks/imu_health.hpp"
#include "nav/imu_gather.hpp"
#include "param/parameters.hpp"
#include "sensor/sample.hpp"

#include <array>
#include <cstdint>
#include <limits>

namespace tetap::estimators {

/// In the axes of the sensor.
inline nav::ImuIncrement shown_by(const sensor::ImuSample& sample) {
  const auto& a = sample.dangle_b_rad;
  const auto& v = sample.dvelocity_b_mps;
  return {.dtheta_b_rad = {a[0], a[1], a[2]}, .dv_b_mps = {v[0], v[1], v[2]}, .dt = base::Micros{sample.interval_us}};
}
constexpr bool is_of(const sensor::Sample& sample, const param::InertialParameters& n) { return is_imu(sample, n.imu); }
/// From the end of a sample to the begin of the next, longer is a gap: drivers' clocks jitter.
inline constexpr base::Micros kImuJitter{1'500};
/// A sample that begins before the last has ended by more than half of itself tells again what was told.
constexpr bool overlaps(base::Micros gap, base::Micros dt) { return 2 * gap.us < -dt.us; }

/// Samples of one place on the grid that follow each other.
struct ImuCell {
  base::Micros begin;        ///< of the first
  std::int32_t span_us = 0;  ///< from there to the stamp of the last
  /// By how much one begins later than those before reach, at most; and twice that and its interval, at least.
  std::int32_t late_us = 0, early_us = std::numeric_limits<std::int32_t>::max();
  nav::ImuGather gather;

  [[nodiscard]] base::Micros last() const { return {begin.us + span_us}; }
  /// Where what is before it reaches until `reached`, none of its samples follows a gap, and none is refused.
  [[nodiscard]] bool follows(base::Micros reached) const {
    const std::int64_t gap_us = begin.us - reached.us;
    return gap_us + late_us <= kImuJitter.us && 2 * gap_us + early_us >= 0;
  }
  [[nodiscard]] bool plain() const { return late_us != kEach; }
  void add(const nav::ImuIncrement& next, base::Micros stamp) {
    const auto dt_us = static_cast<std::int32_t>(next.dt.us);
    const auto late = static_cast<std::int32_t>((stamp - next.dt - begin - gather.sum().dt).us);
    if (late > late_us) late_us = late;
    if (2 * late + dt_us < early_us) early_us = 2 * late + dt_us;
    gather.add(next);
    span_us = static_cast<std::int32_t>((stamp - begin).us);
  }
  /// One of its samples has to be looked at by itself, so all have.
  void look_at_each(base::Micros stamp) {
    late_us = kEach;
    span_us = static_cast<std::int32_t>((stamp - begin).us);
  }

 private:
  static constexpr std::int32_t kEach = std::numeric_limits<std::int32_t>::max();
};

class ImuCells {
 public:
  /// A sample has come that may belong before others.
  void arrived(base::Micros stamp) {
    while (size_ > 0 && (*this)[size_ - 1].last() >= stamp) --size_;
  }
  void clear() { size_ = 0; }

  /// Adds what is new in the window and lets go what begins to leave it: the place on the grid where the window's first
  /// sample is has no cell, and samples beyond the last have none where there was no room for more.
  template <class Window>
  void follow(const Window& window, const param::InertialParameters& n) {
    std::size_t first = 0;
    while (first < window.size() && !is_of(window[first], n)) ++first;
    if (first == window.size()) return clear();
    const std::int64_t leaving = grid(window[first].stamp);
    leaving_until_ = {((leaving + 1) << kGrid) - 1};
    while (size_ > 0 && (*this)[0].last() <= leaving_until_) {
      begin_ = (begin_ + 1) % kMost;
      --size_;
    }
    const auto has = [&](base::Micros stamp) {
      return size_ > 0 ? stamp <= (*this)[size_ - 1].last() : grid(stamp) <= leaving;
    };
    std::size_t i = window.size();
    while (!has(window[i - 1].stamp)) --i;
    std::size_t before = i - 1;
    while (!is_of(window[before], n)) --before;
    for (; i < window.size(); ++i) {
      if (!is_of(window[i], n)) continue;
      if (!add(window[i], window[before].payload.imu)) return;
      before = i;
    }
  }
  /// The end of the place on the grid that has no cell.
  [[nodiscard]] base::Micros leaving_until() const { return leaving_until_; }

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] const ImuCell& operator[](std::size_t i) const { return cells_[(begin_ + i) % kMost]; }

 private:
  static constexpr std::size_t kMost = 6;
  static constexpr int kGrid = 16;  ///< places of 2^16 us

  [[nodiscard]] static constexpr std::int64_t grid(base::Micros t) { return t.us >> kGrid; }
  /// False when there is no room.
  bool add(const sensor::Sample& sample, const sensor::ImuSample& before) {
    const sensor::ImuSample& imu = sample.payload.imu;
    const nav::ImuIncrement increment = shown_by(imu);
    constexpr auto kAccepted = nav::ImuVerdict::kAccepted;
    const bool plain = imu.clipped_gyro == 0 && imu.clipped_accel == 0 && increment.check() == kAccepted &&
                       !checks::Repeats::repeats(imu, before) && shown_by(before).check() == kAccepted;
    const ImuCell* open = size_ > 0 ? &(*this)[size_ - 1] : nullptr;
    if (open == nullptr || grid(open->last()) != grid(sample.stamp) || (open->plain() && open->gather.full())) {
      if (size_ == kMost) return false;
      ++size_;
      cells_[(begin_ + size_ - 1) % kMost] = {.begin = plain ? sample.stamp - increment.dt : sample.stamp};
    }
    ImuCell& cell = cells_[(begin_ + size_ - 1) % kMost];
    if (plain && cell.plain()) {
      cell.add(increment, sample.stamp);
    } else {
      cell.look_at_each(sample.stamp);
    }
    return true;
  }

  std::array<ImuCell, kMost> cells_;
  base::Micros leaving_until_;
  std::size_t begin_ = 0, size_ = 0;
};

}  // namespace tetap::estimators
