// SPDX-License-Identifier: Apache-2.0
// Sums of the window's IMU samples in cells on a grid of time. The present is reached over a handful of cells, not over
// every sample anew in every tick. The cells are a pure cache. Those that grew sample by sample are, bit for bit, those
// made at once of all samples in the window.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/checks/imu_classifier.hpp"
#include "tetap/nav/imu_gather.hpp"
#include "tetap/param/parameters.hpp"
#include "tetap/sensor/sample.hpp"
#include "tetap/sensor/window.hpp"

#include <array>
#include <cstdint>
#include <limits>

namespace tetap::estimators {

using sensor::ImuSample;
using sensor::Sample;

/// A sample of the IMU that the filter uses.
constexpr bool is_of(const Sample& sample, const param::InertialParameters& n) { return sensor::is_imu(sample, n.imu); }

/// Samples of one place on the grid that follow each other.
struct ImuCell {
  base::Micros begin;        ///< begin of the first sample
  std::int32_t span_us = 0;  ///< from there to the stamp of the last sample
  /// Largest pause before a sample of the cell; least sum of twice the pause and the sample's interval.
  std::int32_t late_us = 0, early_us = std::numeric_limits<std::int32_t>::max();
  nav::ImuGather gather;

  [[nodiscard]] base::Micros last() const { return {begin.us + span_us}; }
  /// After samples that end at `reached`, every sample of the cell is contiguous.
  [[nodiscard]] bool follows(base::Micros reached) const {
    const base::Micros pause = begin - reached;
    return !checks::ImuClassifier::is_gap(pause + base::Micros{late_us}) &&
           !checks::ImuClassifier::overlaps(pause, {early_us});
  }
  [[nodiscard]] bool plain() const { return late_us != kEach; }
  /// After samples that end at `reached`, samples are missing, and nothing else is wrong.
  [[nodiscard]] bool has_holes(base::Micros reached) const {
    return plain() && !checks::ImuClassifier::overlaps(begin - reached, {early_us});
  }
  void add(const nav::ImuIncrement& next, base::Micros stamp) {
    const auto dt_us = static_cast<std::int32_t>(next.dt.us);
    const auto late = static_cast<std::int32_t>((stamp - next.dt - begin - gather.sum().dt).us);
    if (late > late_us) late_us = late;
    if (2 * late + dt_us < early_us) early_us = 2 * late + dt_us;
    gather.add(next);
    span_us = static_cast<std::int32_t>((stamp - begin).us);
  }
  /// One sample has to be classified by itself, so all samples of the cell have.
  void classify_each(base::Micros stamp) {
    late_us = kEach;
    span_us = static_cast<std::int32_t>((stamp - begin).us);
  }

 private:
  static constexpr std::int32_t kEach = std::numeric_limits<std::int32_t>::max();
};

class ImuCells {
 public:
  /// A sample came that may belong before others.
  void arrived(base::Micros stamp) {
    while (size_ > 0 && (*this)[size_ - 1].last() >= stamp) --size_;
  }
  void clear() { size_ = 0; }

  /// Adds new samples of the window and drops those that begin to leave it. The grid place of the window's first sample
  /// has no cell. Samples beyond the last cell have none either when there was no more room.
  void follow(const sensor::Window& window, const param::InertialParameters& n) {
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
    while (i > first + 1 && !has(window[i - 1].stamp)) --i;
    std::size_t before = i - 1;
    while (!is_of(window[before], n)) --before;
    for (; i < window.size(); ++i) {
      if (!is_of(window[i], n)) continue;
      if (!add(window[i], window[before].payload.imu, n)) return;
      before = i;
    }
  }
  /// End of the grid place without a cell.
  [[nodiscard]] base::Micros leaving_until() const { return leaving_until_; }

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] const ImuCell& operator[](std::size_t i) const { return cells_[(begin_ + i) % kMost]; }
  static constexpr auto members(auto& self) {
    return base::members(base::ring(self.cells_, self.begin_, self.size_), base::in_turns(self.leaving_until_),
                         base::count(self.begin_), base::count(self.size_));
  }

 private:
  static constexpr std::size_t kMost = 9;  ///< half a second and the place that leaves
  static constexpr int kGrid = 16;         ///< places of 2^16 us

  [[nodiscard]] static constexpr std::int64_t grid(base::Micros t) { return t.us >> kGrid; }
  /// False when there is no room.
  bool add(const Sample& sample, const ImuSample& before, const param::InertialParameters& n) {
    const ImuSample& imu = sample.payload.imu;
    const nav::ImuIncrement increment = checks::increment_of(imu);
    const bool plain = checks::ImuClassifier::plain(imu, before, n);
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
      cell.classify_each(sample.stamp);
    }
    return true;
  }

  std::array<ImuCell, kMost> cells_;
  base::Micros leaving_until_;
  std::size_t begin_ = 0, size_ = 0;
};

}  // namespace tetap::estimators
