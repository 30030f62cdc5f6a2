// SPDX-License-Identifier: Apache-2.0
// Turn of the body by its wheels against that by its gyroscope: wheels that are swapped, or of which one runs
// backwards, turn otherwise. Wheels that skid turn by another amount, and are no worse than none.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/base/members.hpp"
#include "tetap/base/time.hpp"
#include "tetap/param/parameters.hpp"

#include <cstdint>

namespace tetap::checks {

class WheelTurn {
 public:
  /// Turn rates at a wheel sample, each the mean since the sample before. Over DisagreementParameters::after_us the
  /// wheels are refuted when they are off by heading_rad more than no turn at all would be.
  void update(float wheels_radps, float gyro_radps, base::Micros stamp, const param::DisagreementParameters& n) {
    const base::Micros since = stamp - last_;
    last_ = stamp;
    if (since.us <= 0 || since.us > n.after_us) return begin(stamp);
    const float dt_s = base::seconds(since);
    wheels_rad_ += wheels_radps * dt_s;
    gyro_rad_ += gyro_radps * dt_s;
    const float off_rad = base::abs(wheels_rad_ - gyro_rad_), turn_rad = base::abs(gyro_rad_);
    if (off_rad > turn_rad + n.heading_rad) {
      refuted_ = true;
      begin(stamp);
    } else if ((stamp - begun_).us >= n.after_us) {
      if (turn_rad > n.heading_rad) refuted_ = false;
      begin(stamp);
    }
  }
  /// The last turn that showed anything contradicted the wheels.
  [[nodiscard]] bool refuted() const { return refuted_; }

  static constexpr auto members(auto& self) {
    return base::members(self.last_, self.begun_, self.wheels_rad_, self.gyro_rad_, self.refuted_);
  }

 private:
  void begin(base::Micros stamp) {
    begun_ = stamp;
    wheels_rad_ = gyro_rad_ = 0;
  }

  base::Micros last_;                    ///< stamp of the last wheel sample
  base::Micros begun_;                   ///< begin of the turns
  float wheels_rad_ = 0, gyro_rad_ = 0;  ///< turns since then
  bool refuted_ = false;
};

}  // namespace tetap::checks
