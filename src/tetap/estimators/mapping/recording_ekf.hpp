// SPDX-License-Identifier: Apache-2.0
// An extended Kalman filter of the planar pose that also keeps its last increments, for a mapper that makes the same
// motion.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/filter/ekf.hpp"
#include "tetap/model/planar_increment.hpp"

#include <array>
#include <cstddef>
#include <span>

namespace tetap::estimators {

struct RecordingEkf : filter::Ekf<model::PlanarPose> {
  /// Increments that one sample makes at the most: held speeds, the gap after them, the sample, and by CheckedMotion
  /// the uncertainty of way and heading.
  static constexpr std::size_t kMost = 5;

  bool predict(const model::PlanarIncrement& increment) {
    if (count_ < kMost) steps_[count_++] = increment;
    return filter::Ekf<model::PlanarPose>::predict(increment);
  }
  /// Increments since the last call.
  [[nodiscard]] std::span<const model::PlanarIncrement> take_steps() {
    const std::span<const model::PlanarIncrement> steps{steps_.data(), count_};
    count_ = 0;
    return steps;
  }
  static constexpr auto members(auto& self) {
    return base::members(base::base_of<filter::Ekf<model::PlanarPose>>(self), base::first(self.steps_, self.count_),
                         base::count(self.count_));
  }

 private:
  std::array<model::PlanarIncrement, kMost> steps_{};
  std::size_t count_ = 0;
};

}  // namespace tetap::estimators
