// SPDX-License-Identifier: Apache-2.0
// Turn rate of the gyroscope against that of the wheels. When their means over a second contradict each other, either
// may be wrong. The heading is then uncertain by all that they differ from that time on.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/base/time.hpp"

#include <cstdint>

namespace tetap::checks {

class TurnResidual {
 public:
  /// Gyroscope minus wheels at a wheel sample, its variance, and the limit in squared sigmas. Returns the variance by
  /// which the heading becomes less certain.
  float update(float off_radps, float variance_rad2ps2, float limit, base::Micros stamp) {
    const auto now_us = static_cast<std::uint32_t>(stamp.us);
    const std::uint32_t since_us = now_us - last_us_;
    last_us_ = now_us;
    if (since_us == 0 || since_us > kGap_us) return reset();
    const float dt_s = base::seconds({since_us}), share = dt_s / (kMean_s + dt_s);
    mean_radps_ += share * (off_radps - mean_radps_);
    const bool before = contradicts_;
    contradicts_ = mean_radps_ * mean_radps_ > limit * variance_rad2ps2;
    if (!contradicts_) return 0;
    const float before2 = before ? turned_rad_ * turned_rad_ : 0.0F;
    turned_rad_ = before ? turned_rad_ + off_radps * dt_s : kMean_s * mean_radps_;
    const float now2 = turned_rad_ * turned_rad_;
    return now2 > before2 ? now2 - before2 : 0.0F;
  }
  /// A measurement has corrected what the difference did so far.
  void corrected() { turned_rad_ = 0; }
  [[nodiscard]] bool contradicts() const { return contradicts_; }
  /// No wheels roll, or no gyroscope: nothing is compared.
  float reset() {
    mean_radps_ = 0;
    contradicts_ = false;
    return 0;
  }

  static constexpr auto members(auto& self) {
    return base::members(self.mean_radps_, self.turned_rad_, self.last_us_, self.contradicts_);
  }

 private:
  static constexpr std::uint32_t kGap_us = 500'000;
  static constexpr float kMean_s = 1;

  float mean_radps_ = 0;       ///< mean difference of the turn rates
  float turned_rad_ = 0;       ///< difference of the turns since the contradiction began
  std::uint32_t last_us_ = 0;  ///< stamp of the last wheels, modulo 2^32
  bool contradicts_ = false;
};

}  // namespace tetap::checks
