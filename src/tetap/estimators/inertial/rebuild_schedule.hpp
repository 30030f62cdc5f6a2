// SPDX-License-Identifier: Apache-2.0
// New starts of the output predictor from the horizon: after a correction there, once the tick has work left for it.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/base/time.hpp"

#include <cstdint>

namespace tetap::estimators {

class RebuildSchedule {
 public:
  /// The state at the horizon is not what the present was predicted from.
  void note_correction() {
    if (ticks_ == 0) ticks_ = 1;
  }
  /// The present has to follow a correction in the next tick, whatever else is due.
  void force_rebuild() { ticks_ = 0xFF; }
  /// Begins a tick at t. True: rebuild now. `deferred`: other work waits for this tick. Intervals need not add up to
  /// the stamps, so even an uncorrected prediction is rebuilt twice a second.
  bool begin_tick(base::Micros t, bool deferred) {
    constexpr base::Micros kLongest{500'000};
    constexpr std::uint8_t kPatience = 3;
    if (t - rebuilt_at_ >= kLongest) note_correction();
    rebuilt_ = ticks_ > kPatience || (ticks_ > 0 && !deferred);
    one_by_one_ = false;
    if (rebuilt_) {
      ticks_ = 0;
      rebuilt_at_ = t;
    } else if (ticks_ > 0) {
      ++ticks_;
    }
    return rebuilt_;
  }
  /// The rebuild had to classify samples one by one.
  void note_samplewise(bool is) { one_by_one_ = is; }
  /// Span over which the covariance may wait for its prediction in this tick. A measurement brings it up to date. A
  /// tick that may take one leaves the prediction to it.
  [[nodiscard]] float covariance_every_s() const { return !rebuilt_ ? 20e-3F : one_by_one_ ? 30e-3F : 7.5e-3F; }

  static constexpr auto members(auto& self) {
    return base::members(self.rebuilt_at_, self.ticks_, self.rebuilt_, self.one_by_one_);
  }

 private:
  base::Micros rebuilt_at_;  ///< tick of the last rebuild
  std::uint8_t ticks_ = 0;   ///< ticks since a correction that the present does not have; 0: none
  bool rebuilt_ = false;     ///< this tick rebuilds
  bool one_by_one_ = false;  ///< the rebuild classified samples one by one
};

}  // namespace tetap::estimators
