// SPDX-License-Identifier: Apache-2.0
// The position of several GNSS receivers by static fusion, without a motion model. Receivers with independent errors
// are weighted by inverse variance. Covariance intersection joins those whose errors share a cause (satellites,
// atmosphere, multipath of one place). Receivers fix at fractions of the GPS second, so fixes of one epoch have one
// stamp.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/estimators/context.hpp"
#include "tetap/estimators/estimate.hpp"
#include "tetap/filter/static_fusion.hpp"
#include "tetap/sensor/samples.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::estimators {

enum class FusionRule : std::uint8_t { kInverseVariance, kIntersection };

/// Receivers are distinguished by their instance, 0 to 3. A fix that disagrees with those of its epoch beyond the gate
/// is refused. The first of the order stands when two contradict each other. There is no state beyond the latest epoch:
/// a pose from outside has no effect. Heading and speed are never valid.
template <FusionRule kRule>
class PositionFusion {
 public:
  static constexpr sensor::EstimatorKind kKind = sensor::EstimatorKind::kFusion;

  void restart(base::Micros t, const Context&) {
    *this = {};
    now_ = epoch_ = t;
  }
  void set_pose(base::Micros, const SetPose&, const Context&) {}
  void advance(base::Micros t, const Context&) { now_ = t; }

  Innovation fuse(const sensor::GnssPosition& fix, base::Micros stamp, std::uint8_t instance, const Context& ctx);

  [[nodiscard]] Estimate estimate(const Context& ctx) const {
    Estimate estimate{.time = now_, .pose = {.x = x_, .y = y_}};
    estimate.p = filter::Symmetric<float, 3>::diagonal({1, 1, kUnknown_rad * kUnknown_rad});
    for (int c = 0; c < 2; ++c)
      for (int r = 0; r <= c; ++r)
        estimate.p(r, c) = receivers_ == 0 ? (r == c ? kUnknown_m * kUnknown_m : 0) : p_(r, c);
    estimate.position_valid = fresh(ctx);
    return estimate;
  }
  [[nodiscard]] sensor::Mode mode(const Context& ctx) const {
    return fresh(ctx) ? sensor::Mode::kNominal : sensor::Mode::kWaitingForPose;
  }
  /// Receivers whose fix is in the latest epoch, one bit each.
  [[nodiscard]] std::uint8_t receivers() const { return receivers_; }

  static constexpr auto members(auto& self) {
    return base::members(self.x_, self.y_, self.p_, self.epoch_, base::unhashed(self.now_), self.receivers_);
  }

 private:
  static constexpr base::Micros kLongest{2'000'000};  ///< a fix stands for the present so long

  [[nodiscard]] bool fresh(const Context&) const { return receivers_ != 0 && now_ - epoch_ <= kLongest; }

  base::Anchored x_, y_;
  filter::Symmetric<float, 2> p_;
  base::Micros epoch_;  ///< stamp of the fixes
  base::Micros now_;    ///< unhashed: of the last tick, set anew by the next
  std::uint8_t receivers_ = 0;
};

}  // namespace tetap::estimators
