// SPDX-License-Identifier: Apache-2.0
// Course from a way, for a robot that starts forwards for sure. The chord between two fixes far apart is its heading at
// the middle of the way.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/model/gnss_fix_3d.hpp"
#include "tetap/nav/so3.hpp"
#include "tetap/param/parameters.hpp"

namespace tetap::estimators {

class WayCourse {
 public:
  /// The way as measured up to a fix.
  struct Way {
    float east_m = 0, north_m = 0;  ///< the chord
    float turned_rad = 0;           ///< by the gyroscope, from begin to end
    float bias_rad = 0;             ///< 1 sigma of that, by the gyroscope's bias
    bool arc_ends = false;          ///< the way turned too far for a chord
    bool far = false;               ///< far enough for a course
    bool near = true;               ///< still where it began
    bool is_course = false;         ///< the second fix in a row that is far enough
  };

  /// Turned since the way began, by an attitude that levelling carries on.
  [[nodiscard]] Way turned(float yaw_rad) const {
    const float turned_rad = base::wrap_angle(yaw_rad - first_yaw_rad_);
    return {.turned_rad = turned_rad, .arc_ends = base::abs(turned_rad) > kArc_rad};
  }
  /// Measures the way to a fix. Two fixes of a robot that stands are never as far apart. A course takes two in a row,
  /// for it is asked at every fix. At the end of an arc a shorter way is enough, too.
  void measure(Way& way, const model::GnssFix3d& fix, float dt_s, const param::Parameters& n) {
    way.east_m = fix.x.minus(first_x_), way.north_m = fix.y.minus(first_y_);
    const float gone2 = way.east_m * way.east_m + way.north_m * way.north_m;
    const float share = way.arc_ends ? 0.25F : 1.0F;
    const float distance = share * n.gnss.align_distance_m, noise = 6.0F * fix.sigma_horizontal_m;
    const float needed = distance > noise ? distance : noise;
    way.far = gone2 > needed * needed && base::abs(way.turned_rad) < 2.0F * kArc_rad;
    way.near = gone2 < 0.1F * noise * noise;
    way_s_ += dt_s;
    way.is_course = way.far && far_;
    way.bias_rad = 0.5F * n.inertial.gyro_turn_on_radps * way_s_;
  }
  /// Goes on from a fix, or begins anew there. Turning before the robot has gone anywhere is the gyroscope's bias or a
  /// turn on the spot, and no arc.
  void extend_or_restart(const Way& way, const model::GnssFix3d& fix, float yaw_rad, bool first) {
    const bool anew = first || (way.arc_ends && way.far == far_);
    if (anew) first_x_ = fix.x, first_y_ = fix.y;
    if (anew || way.near) first_yaw_rad_ = yaw_rad, way_s_ = 0;
    far_ = way.far && !anew;
  }

  static constexpr auto members(auto& self) {
    return base::members(self.first_x_, self.first_y_, self.first_yaw_rad_, self.way_s_, self.far_);
  }

 private:
  static constexpr float kArc_rad = 0.5F;  ///< largest turn of a way whose chord is a course

  base::Anchored first_x_, first_y_;  ///< place where the way began
  float first_yaw_rad_ = 0;           ///< how the robot was turned there
  float way_s_ = 0;                   ///< time since
  bool far_ = false;                  ///< the last fix was far enough for a course
};

}  // namespace tetap::estimators
