// SPDX-License-Identifier: Apache-2.0
// Heading from motion: while the heading is unknown, dead reckoning runs in a frame of its own. The directions of
// travel by GNSS and in that frame give the turn between the frames. GNSS has to have seen the robot travel far enough.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/base/members.hpp"
#include "tetap/estimators/context.hpp"
#include "tetap/model/gnss_position.hpp"

#include <optional>

namespace tetap::estimators {

class GnssAlignment {
 public:
  /// A fix and the dead-reckoned pose at its time. A pose comes once |travel by GNSS| >= distance_m and dead reckoning
  /// agrees on the length. The lengths may differ by a quarter plus three sigma. A larger difference begins the walk
  /// anew.
  [[nodiscard]] std::optional<SetPose> add(const model::GnssPosition& fix, const model::PlanarPose& reckoned,
                                           float distance_m) {
    if (!begun_) return begin(fix, reckoned), std::nullopt;
    const float east_m = fix.x.minus(first_x_);
    const float north_m = fix.y.minus(first_y_);
    const float forward_m = reckoned.x.minus(reckoned_.x);
    const float left_m = reckoned.y.minus(reckoned_.y);
    const float by_gnss_m = base::sqrt(east_m * east_m + north_m * north_m);
    const float by_wheels_m = base::sqrt(forward_m * forward_m + left_m * left_m);
    const float sigma_m = base::sqrt(fix.sigma_m * fix.sigma_m + first_sigma_m_ * first_sigma_m_);
    if (by_gnss_m < distance_m || by_gnss_m < 4.0F * sigma_m) return std::nullopt;
    const float mismatch_m = by_gnss_m - by_wheels_m;
    const float allowed_m = 0.25F * by_gnss_m + 3.0F * sigma_m;
    if (mismatch_m > allowed_m || -mismatch_m > allowed_m) return begin(fix, reckoned), std::nullopt;
    const float turn_rad = base::atan2(north_m, east_m) - base::atan2(left_m, forward_m);
    // The cross-track error of both ends over the distance, and a tenth of a radian for what wheels drift on the way.
    const float cross = sigma_m / by_gnss_m;
    return SetPose{.pose = {.x = fix.x, .y = fix.y, .yaw_rad = base::wrap_angle(reckoned.yaw_rad + turn_rad)},
                   .sigma_position_m = fix.sigma_m,
                   .sigma_yaw_rad = base::sqrt(cross * cross + 0.01F)};
  }

  static constexpr auto members(auto& self) {
    return base::members(self.begun_, self.first_x_, self.first_y_, self.reckoned_, self.first_sigma_m_);
  }

 private:
  void begin(const model::GnssPosition& fix, const model::PlanarPose& reckoned) {
    begun_ = true;
    first_x_ = fix.x;
    first_y_ = fix.y;
    first_sigma_m_ = fix.sigma_m;
    reckoned_ = reckoned;
  }
  bool begun_ = false;
  base::Anchored first_x_;
  base::Anchored first_y_;
  model::PlanarPose reckoned_;
  float first_sigma_m_ = 0;
};

}  // namespace tetap::estimators
