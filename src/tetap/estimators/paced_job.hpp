// SPDX-License-Identifier: Apache-2.0
// A job longer than a tick: its work is counted in units. The tick in which its result is adopted is fixed when the job
// begins. How long a unit takes has no effect on any bit.
#pragma once

#include "tetap/base/members.hpp"

#include <cstdint>

namespace tetap::estimators {

class PacedJob {
 public:
  /// `total` units, at most `units` in a tick, the next one first.
  void begin(std::uint32_t total, std::uint32_t units) {
    left_ = total;
    ticks_left_ = units > 0 ? (total + units - 1) / units : total;
    busy_ = true;
  }
  [[nodiscard]] bool busy() const { return busy_; }
  [[nodiscard]] std::uint32_t units_left() const { return busy_ ? left_ : 0; }
  [[nodiscard]] std::uint32_t aborted() const { return aborted_; }
  /// Once a tick, with the units of that tick: do_units(n) does the next n units, adopt() is called in the last tick.
  template <class DoUnits, class Adopt>
  void work(std::uint32_t units, const DoUnits& do_units, const Adopt& adopt) {
    if (!busy_) return;
    const std::uint32_t now = left_ < units ? left_ : units;
    if (now > 0) do_units(now);
    left_ -= now;
    if (ticks_left_ > 0) --ticks_left_;
    if (ticks_left_ > 0) return;
    if (left_ > 0) do_units(left_);  // units became fewer since the job began: the tick stands
    busy_ = false;
    adopt();
  }
  /// The job's result is not wanted any more: a restart, a set pose, a closed window.
  void cancel() {
    if (busy_) ++aborted_;
    busy_ = false;
  }
  static constexpr auto members(auto& self) {
    return base::members(self.left_, self.ticks_left_, self.aborted_, self.busy_);
  }

 private:
  std::uint32_t left_ = 0;
  std::uint32_t ticks_left_ = 0;  ///< until adoption, the next tick included
  std::uint32_t aborted_ = 0;
  bool busy_ = false;
};

}  // namespace tetap::estimators
