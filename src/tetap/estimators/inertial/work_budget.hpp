// SPDX-License-Identifier: Apache-2.0
// Work budget of a tick at the horizon, in units of one IMU sample. It is enough to keep pace with the IMU and to take
// one measurement, or to rebuild the prediction. The farther the horizon is behind, the larger it is.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/base/time.hpp"

#include <cstdint>

namespace tetap::estimators {

class WorkBudget {
 public:
  static constexpr std::int32_t kImuSample = 1, kMeasurement = 5;
  static constexpr std::int32_t kConditioning = 2 * kMeasurement;  ///< the covariance, factored from end to end
  static constexpr std::int32_t kShare = 4 * kMeasurement;         ///< share of each tick while a window ends
  static constexpr std::int32_t kFixChecks = 2;                    ///< a fix's conversion to local axes and its checks

  /// An IMU sample is new in the window.
  void note_arrival() { ++arrived_; }
  void begin_tick() {
    left_ = arrived_;
    arrived_ = 0;
  }
  void grant(std::int32_t units) { left_ += units; }
  void spend(std::int32_t units) { left_ -= units; }
  /// Nothing else in this tick.
  void exhaust() { left_ = 0; }
  [[nodiscard]] std::int32_t left() const { return left_; }
  [[nodiscard]] bool allows(std::int32_t units) const { return left_ >= units; }
  /// A pseudo-measurement that is due every `every` fits into this tick, or has waited for twice as long.
  [[nodiscard]] bool allows_due(base::Micros since, base::Micros every) const {
    return left_ >= kMeasurement || since.us >= 2 * every.us;
  }
  /// Something due is left for the next tick.
  void defer() { deferred_ = true; }
  [[nodiscard]] bool deferred() const { return deferred_; }
  void clear_deferred() { deferred_ = false; }

  static constexpr auto members(auto& self) { return base::members(self.left_, self.arrived_, self.deferred_); }

 private:
  std::int32_t left_ = 0;     ///< units left in this tick
  std::int32_t arrived_ = 0;  ///< IMU samples since the last tick
  bool deferred_ = false;     ///< something due waits for the next tick
};

}  // namespace tetap::estimators
