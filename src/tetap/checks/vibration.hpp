// SPDX-License-Identifier: Apache-2.0
// Vibration of an IMU: mean squares of what is too fast to be motion, and leaps from one sample to the next.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/base/members.hpp"
#include "tetap/param/parameters.hpp"
#include "tetap/sensor/samples.hpp"

#include <array>
#include <cstdint>

namespace tetap::checks {

class Vibration {
 public:
  /// Distance of the last sample from the ones before it, where that is more than motion and vibration make: a wild
  /// sample, or an impact.
  struct Leap {
    float rate_radps = 0, force_mps2 = 0;
  };

  /// One-pole high-pass of the increments per second, then the mean of its square.
  void update(const sensor::ImuSample& s, const param::InertialParameters& n) {
    const float dt_s = base::seconds(base::Micros{s.interval_us});
    const float per_s = 1.0F / dt_s;
    const bool first = !filtered_;
    filtered_ = true;
    const float slow = first ? 1.0F : dt_s / (kSlow_s + dt_s), mean = dt_s / (kMean_s + dt_s);
    const auto fast2 = [&](std::array<float, 3>& low, const std::array<float, 3>& increment) {
      float sum = 0;
#pragma GCC unroll 1
      for (std::size_t i = 0; i < 3; ++i) {
        const float off = increment[i] * per_s - low[i];
        low[i] += slow * off;
        const float fast = (1.0F - slow) * off;
        sum += fast * fast;
      }
      return sum;
    };
    float gyro2 = fast2(slow_gyro_, s.dangle_b_rad), accel2 = fast2(slow_accel_, s.dvelocity_b_mps);
    if (gyro2 > kLeap_radps * kLeap_radps || accel2 > kLeap_mps2 * kLeap_mps2) measure_leap(gyro2, accel2);
    gyro2_ += mean * (gyro2 - gyro2_);
    accel2_ += mean * (accel2 - accel2_);
    const float share = excess(n);
    shaken_ = share > (shaken_ ? 1.0F : 4.0F);
  }

  /// The next sample is compared with nothing before it that leaps.
  void clear_leap() { leaps_ = false; }
  [[nodiscard]] bool leaps() const { return leaps_; }
  [[nodiscard]] const Leap& leap() const { return leap_; }
  /// Vibration beyond what the parameters allow, with hysteresis.
  [[nodiscard]] bool shaken() const { return shaken_; }
  /// Factor of the noise densities: the parameters hold up to the vibration they were found in; beyond it the noise
  /// grows in proportion. At least 1.
  [[nodiscard]] float noise_factor(const param::InertialParameters& n) const {
    const float share = excess(n);
    return share > 1.0F ? base::sqrt(share) : 1.0F;
  }
  /// Below what is left at rest, where only the sensor's own noise shows.
  [[nodiscard]] bool calm(const param::InertialParameters& n) const {
    return accel2_ < n.calm_mps2 * n.calm_mps2 && gyro2_ < n.calm_radps * n.calm_radps;
  }
  /// Mean square of the specific force [m^2/s^4] and of the turn rate [rad^2/s^2], of all axes together.
  [[nodiscard]] float force2() const { return accel2_; }
  [[nodiscard]] float rate2() const { return gyro2_; }
  static constexpr auto members(auto& self) {
    return base::members(self.slow_gyro_, self.slow_accel_, self.gyro2_, self.accel2_, self.leap_, self.shaken_,
                         self.filtered_, self.leaps_);
  }

 private:
  static constexpr float kLeap_radps = 2.0F, kLeap_mps2 = 30.0F;
  static constexpr float kSlow_s = 0.05F, kMean_s = 0.5F;  // motion is below 3 Hz; averaging time of the RMS

  [[nodiscard]] float excess(const param::InertialParameters& n) const {
    const float accel = accel2_ / (n.vibration_mps2 * n.vibration_mps2);
    const float gyro = gyro2_ / (n.vibration_radps * n.vibration_radps);
    return accel > gyro ? accel : gyro;
  }
  /// Motion does less from one sample to the next, and vibration four times what was there before. A sample that leaps
  /// counts as vibration up to there only.
  [[gnu::noinline]] void measure_leap(float& gyro2, float& accel2) {
    constexpr float kVibrations = 4.0F;
    const auto excess_of = [](float& fast2, float most) {
      if (fast2 <= most * most) return 0.0F;
      const float leap = base::sqrt(fast2);
      fast2 = most * most;
      return leap;
    };
    leap_ = {.rate_radps = excess_of(gyro2, kLeap_radps + kVibrations * base::sqrt(gyro2_)),
             .force_mps2 = excess_of(accel2, kLeap_mps2 + kVibrations * base::sqrt(accel2_))};
    leaps_ = leap_.rate_radps > 0.0F || leap_.force_mps2 > 0.0F;
  }

  std::array<float, 3> slow_gyro_{}, slow_accel_{};  ///< low-passed rate and specific force
  float gyro2_ = 0, accel2_ = 0;                     ///< mean squares of the rest
  Leap leap_;                                        ///< leap of the last sample; valid while leaps_
  bool shaken_ = false, filtered_ = false, leaps_ = false;
};

}  // namespace tetap::checks
