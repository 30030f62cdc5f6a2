// SPDX-License-Identifier: Apache-2.0
// Drift of the IMU: velocity that measurements took out of what the IMU made of late. Innovations of one sign for
// seconds pass every gate, and add up here. A sound IMU's corrections are independent of each other (Kailath 1968, IEEE
// TAC 13(6)), so their sum is as large as its variance. An error that began makes it grow: Willsky and Jones 1976, IEEE
// TAC 21(1).
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/nav/ins.hpp"

#include <cstdint>

namespace tetap::checks {

class ImuDrift {
 public:
  /// Axes along which measurements contradict the IMU.
  struct Drift {
    bool level = false, up = false;
  };
  /// Tests the corrections of late. Each variance [m2/s2] is the filter's, of both level axes and along up: errors that
  /// measurements have in common are in no correction's variance. `scale` is that of the innovation gates, level alone.
  [[nodiscard]] Drift test(const nav::VelocityCorrection& sum, float level_m2ps2, float up_m2ps2, float scale) {
    const bool level = contradicts(sum, level_m2ps2, scale);
    const bool up = sum.up_mps * sum.up_mps > kGate * (sum.up_m2ps2 + up_m2ps2);
    const Drift drift{.level = level && level_, .up = up && up_};  // a leap is gone by the second test
    level_ = level && !drift.level;
    up_ = up && !drift.up;
    if (shown_ > 0) --shown_;
    if (drift.level || drift.up) shown_ = kShown;
    return drift;
  }
  /// Whether the corrections in the level plane are larger than their variance and the filter's allow.
  [[nodiscard]] static bool contradicts(const nav::VelocityCorrection& sum, float level_m2ps2, float scale) {
    return sum.level2() > kGate * scale * (sum.level_m2ps2 + level_m2ps2);
  }
  /// Share of the corrections that a span leaves: they fade with a time constant of a second.
  [[nodiscard]] static float keep(float since_s) { return since_s < kFade_s ? 1.0F - since_s / kFade_s : 0.0F; }
  /// Measurements contradicted the IMU in one of the last tests.
  [[nodiscard]] bool shown() const { return shown_ > 0; }

  static constexpr auto members(auto& self) { return base::members(self.shown_, self.level_, self.up_); }

 private:
  static constexpr float kFade_s = 1;        ///< time constant of what corrections leave in the sum
  static constexpr float kGate = 3;          ///< squared sum in its variance
  static constexpr std::uint8_t kShown = 5;  ///< tests, one to two seconds

  std::uint8_t shown_ = 0;           ///< tests for which the last drift is still shown
  bool level_ = false, up_ = false;  ///< the last test's sum was too large
};

}  // namespace tetap::checks
