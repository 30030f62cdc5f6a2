// SPDX-License-Identifier: Apache-2.0
// Points of a scanner, in the order of their measurement, as whole turns. A turn begins at the front, between two
// points whose angles date it: points that were lost there do not make it late.
#pragma once

#include "drivers/lidar/turn.hpp"
#include "tetap/base/time.hpp"

#include <cstddef>
#include <cstdint>

namespace tetap::drivers {

/// A point of [0, 36 000) hundredths of a degree, clockwise from the front; distance 0: no return.
struct ScanPoint {
  std::int32_t angle_cdeg = 0;
  std::int32_t distance_mm = 0;
  base::Micros at{};  ///< time of its measurement
};

class TurnAssembly {
 public:
  /// Without a point for longer than `gap` a turn is given up: the next point may be of another one.
  explicit constexpr TurnAssembly(base::Micros gap) : gap_(gap) {}

  /// Calls `handler(ranges, first)` when the point before this one ended a whole turn: 360 ranges, and the time of the
  /// beam at 0 degrees.
  template <class Handler>
  constexpr void add(const ScanPoint& point, Handler& handler) {
    if (point.at - last_.at > gap_) give_up();
    const std::size_t bin = Turn::bin(point.angle_cdeg);
    if (bin + kHalf < bin_) {  // past the front: the next turn
      if (begun_) handler(turn_.ranges(), first_);
      turn_.clear();
      begun_ = true;
      first_ = front(last_, point);
    } else if (begun_ && bin > bin_ + kHalf) {
      return;  // a point of the turn that is done
    }
    bin_ = bin;
    last_ = point;
    turn_.add(bin, point.distance_mm);
  }
  /// The turn that was begun is none.
  constexpr void give_up() {
    if (begun_) ++cut_;
    begun_ = false;
    bin_ = 0;
  }
  /// Turns given up.
  [[nodiscard]] constexpr std::uint32_t cut() const { return cut_; }

 private:
  static constexpr std::size_t kHalf = Turn::kBins / 2;
  static constexpr std::int64_t kFullTurn_cdeg = 36'000;

  /// When the scanner looked to the front, at even speed from one point to the other.
  [[nodiscard]] static constexpr base::Micros front(const ScanPoint& before, const ScanPoint& after) {
    // The bin of 0 degrees begins half a bin before the front.
    const std::int64_t to_cdeg =
        after.angle_cdeg < kFullTurn_cdeg / 2 ? after.angle_cdeg : after.angle_cdeg - kFullTurn_cdeg;
    const std::int64_t left_cdeg = kFullTurn_cdeg - before.angle_cdeg, turned_cdeg = left_cdeg + to_cdeg;
    if (turned_cdeg <= 0) return after.at;
    return before.at + base::Micros{(after.at - before.at).us * left_cdeg / turned_cdeg};
  }

  base::Micros gap_;
  Turn turn_{};
  ScanPoint last_{};
  std::size_t bin_ = 0;   ///< bin of the last point
  base::Micros first_{};  ///< time of the beam at 0 degrees
  std::uint32_t cut_ = 0;
  bool begun_ = false;  ///< turn_ began at 0 degrees
};

}  // namespace tetap::drivers
