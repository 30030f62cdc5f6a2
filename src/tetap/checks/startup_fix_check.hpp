// SPDX-License-Identifier: Apache-2.0
// First fixes, before there is a filter: they count when so many in a row follow each other no faster than anything
// drives. A first fix that is a glitch starts nothing.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/base/members.hpp"
#include "tetap/base/trig.hpp"
#include "tetap/nav/geodesy.hpp"
#include "tetap/sensor/samples.hpp"

#include <cstdint>

namespace tetap::checks {

class StartupFixCheck {
 public:
  /// True when this fix is at least the `needed`-th in a row. Two receivers may have fixes of one stamp.
  [[gnu::noinline]] bool update(const sensor::GnssPosition& fix, base::Micros stamp, std::int32_t needed) {
    const float sigma_m = base::is_finite(fix.horizontal_acc_m) ? fix.horizontal_acc_m : 10.0F;
    const float far_m = 4.0F * sigma_m + kFastest_mps * base::seconds(stamp - last_);
    const float north_m = metres(fix.latitude_2ndeg - latitude_2ndeg_);
    const std::int64_t latitude_2udeg = fix.latitude_2ndeg / 1'000;
    const float latitude_rad = static_cast<float>(latitude_2udeg) * (2e-6F * 0.0174532925F);
    const float east_m =
        metres(nav::longitude_difference_2ndeg(fix.longitude_2ndeg, longitude_2ndeg_)) * base::cos(latitude_rad);
    const bool follows = fixes_ > 0 && stamp >= last_ && east_m * east_m + north_m * north_m <= far_m * far_m;
    fixes_ = follows ? (fixes_ < needed ? fixes_ + 1 : needed) : 1;
    latitude_2ndeg_ = fix.latitude_2ndeg;
    longitude_2ndeg_ = fix.longitude_2ndeg;
    last_ = stamp;
    return fixes_ >= needed;
  }
  /// Fixes in a row, up to the number needed.
  [[nodiscard]] std::int32_t fixes() const { return fixes_; }

  static constexpr auto members(auto& self) {
    return base::members(self.latitude_2ndeg_, self.longitude_2ndeg_, self.last_, self.fixes_);
  }

 private:
  static constexpr float kFastest_mps = 60;
  static float metres(std::int64_t d_2ndeg) { return static_cast<float>(d_2ndeg) * (2e-9F * 111'320.0F); }

  std::int64_t latitude_2ndeg_ = 0, longitude_2ndeg_ = 0;  ///< coordinates of the last fix
  base::Micros last_;                                      ///< stamp of the last fix; 0: none
  std::int32_t fixes_ = 0;                                 ///< in a row
};

}  // namespace tetap::checks
