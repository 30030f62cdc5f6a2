// SPDX-License-Identifier: Apache-2.0
// Way and turn of the robot by one device over the last seconds, to be read between any two times.
#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <optional>

namespace tetap::doctor {

class Moved {
 public:
  struct Step {
    double way_m = 0, turn_rad = 0;
  };
  /// An increment up to a time. A time that goes back, or a pause, begins anew.
  void add(double time_s, const Step& step) {
    constexpr double kLongestPause_s = 0.5;
    if (!sums_.empty() && (time_s <= sums_.back().time_s || time_s > sums_.back().time_s + kLongestPause_s))
      sums_.clear();
    const Sum before = sums_.empty() ? Sum{} : sums_.back();
    sums_.push_back({time_s, before.way_m + step.way_m, before.turn_rad + step.turn_rad});
    while (sums_.front().time_s < time_s - kHistory_s || sums_.size() > kMost) sums_.pop_front();
  }
  /// Nothing where one of the times is not covered.
  [[nodiscard]] std::optional<Step> between(double from_s, double to_s) const {
    const auto a = at(from_s), b = at(to_s);
    if (!a || !b) return std::nullopt;
    return Step{b->way_m - a->way_m, b->turn_rad - a->turn_rad};
  }

 private:
  static constexpr double kHistory_s = 4;
  static constexpr std::size_t kMost = 8192;
  struct Sum {
    double time_s = 0, way_m = 0, turn_rad = 0;
  };
  [[nodiscard]] std::optional<Sum> at(double time_s) const {
    const auto after =
        std::lower_bound(sums_.begin(), sums_.end(), time_s, [](const Sum& one, double t) { return one.time_s < t; });
    if (after == sums_.begin() || after == sums_.end()) return std::nullopt;
    const Sum &a = *(after - 1), &b = *after;
    const double share = (time_s - a.time_s) / (b.time_s - a.time_s);
    return Sum{time_s, a.way_m + share * (b.way_m - a.way_m), a.turn_rad + share * (b.turn_rad - a.turn_rad)};
  }

  std::deque<Sum> sums_;
};

}  // namespace tetap::doctor
