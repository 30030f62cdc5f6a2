// SPDX-License-Identifier: Apache-2.0
// Health of an IMU: stuck, stale, clipped, vibrating. A gyroscope or an accelerometer whose noise spans quanta does not
// show three equal axes twice by chance, let alone ten times.
#pragma once

#include "base/math.hpp"
#include "checks/imu_classifier.hpp"
#include "param/parameters.hpp"

#include <array>
#include <cstdint>

namespace tetap::checks {

/// Published health: RMS over the last second and a half, of all axes together; NaN before the first sample.
struct ImuHealthReport {
  float vibration_mps2 = base::kNan;   ///< specific force too fast to be motion
  float vibration_radps = base::kNan;  ///< likewise the turn rate
  std::uint16_t clipped = 0;           ///< samples with a clipped axis; stays at 65 535
};

class ImuHealth {
 public:
  /// Classifies a sample and takes note of it; arguments as of ImuClassifier::classify().
  ImuClass update(const sensor::ImuSample& s, const nav::ImuIncrement& increment, base::Micros stamp,
                  base::Micros pause, bool turn_known, const param::InertialParameters& n) {
    const ImuClass found = classifier_.classify(s, increment, pause, turn_known, n);
    if (found < ImuClass::kStuck) {
      if (found == ImuClass::kBeyondRange) note_clipped(stamp);
      return found;
    }
    note(s, found == ImuClass::kStuck, stamp, n);
    return stuck_ ? ImuClass::kStuck : found;
  }
  /// The same for a valid sample whose place in time does not matter. False: the sensor is stuck.
  bool update(const sensor::ImuSample& s, base::Micros stamp, const param::InertialParameters& n) {
    note(s, classifier_.repeated(s, n.stuck_samples), stamp, n);
    return !stuck_;
  }
  [[nodiscard]] bool stuck() const { return stuck_; }
  /// One axis alone is stuck. The output predictor does not test that.
  [[nodiscard]] bool axis_stuck() const { return axis_stuck_; }
  /// Samples that showed a false motion until an axis or the whole sensor was found stuck.
  [[nodiscard]] std::int32_t stuck_after(const param::InertialParameters& n) const {
    return axis_stuck_ ? 2 * StuckAxis::kReadings : n.stuck_samples;
  }
  /// Distance of the last sample from the ones before it, where that is more than motion and vibration make: a wild
  /// sample, or an impact.
  struct Leap {
    float rate_radps = 0, force_mps2 = 0;
  };
  [[nodiscard]] bool leaps() const { return leaps_; }
  [[nodiscard]] const Leap& leap() const { return leap_; }
  /// Stamp of the last sample that was neither invalid nor stuck; 0: none.
  [[nodiscard]] base::Micros last_valid() const { return valid_; }
  /// The last sample that was neither invalid nor stuck is older than the time-out.
  [[nodiscard]] bool stale(base::Micros at, const param::InertialParameters& n) const {
    return begun() && older(valid_, at, base::Micros{n.stale_us});
  }
  [[nodiscard]] bool clipped_lately(base::Micros at) const { return clipped_ > 0 && recent(clipped_at_, at, kLately); }
  [[nodiscard]] bool stuck_lately(base::Micros at) const { return recent(stuck_at_, at, kLately); }
  [[nodiscard]] bool shaken() const { return shaken_; }
  [[nodiscard]] const ImuClassifier& classifier() const { return classifier_; }

  /// Factor of the noise densities: the parameters hold up to the vibration they were found in; beyond it the noise
  /// grows in proportion. At least 1.
  [[nodiscard]] float noise_factor(const param::InertialParameters& n) const {
    const float share = excess(n);
    return share > 1.0F ? base::sqrt(share) : 1.0F;
  }
  [[nodiscard]] ImuHealthReport report() const {
    if (!begun()) return {};
    return {.vibration_mps2 = base::sqrt(accel2_), .vibration_radps = base::sqrt(gyro2_), .clipped = clipped_};
  }
  /// Vibration is below what is left at rest, where only the sensor's own noise shows.
  [[nodiscard]] bool calm(const param::InertialParameters& n) const {
    return begun() && accel2_ < n.calm_mps2 * n.calm_mps2 && gyro2_ < n.calm_radps * n.calm_radps;
  }
  template <class Sink>
  void hash_state(Sink&& sink) const {
    classifier_.hash_state(sink);
    gyro_axis_.hash_state(sink);
    accel_axis_.hash_state(sink);
    for (std::size_t i = 0; i < 3; ++i) {
      sink(slow_gyro_[i]);
      sink(slow_accel_[i]);
    }
    sink(gyro2_);
    sink(accel2_);
    for (const base::Micros at : {valid_, clipped_at_, stuck_at_}) sink(at.us);
    sink(static_cast<std::uint32_t>(clipped_ | (stuck_ ? 0x10000U : 0U) | (shaken_ ? 0x20000U : 0U) |
                                    (accel_turn_ ? 0x40000U : 0U)));
  }

 private:
  static constexpr base::Micros kLately{1'000'000};
  static constexpr float kLeap_radps = 2.0F, kLeap_mps2 = 30.0F;
  static constexpr float kSlow_s = 0.05F, kMean_s = 0.5F;  // motion is below 3 Hz; averaging time of the RMS

  void note(const sensor::ImuSample& s, bool stuck, base::Micros stamp, const param::InertialParameters& n) {
    leaps_ = false;
    axis_stuck_ = n.stuck_samples > 0 && any_axis_stuck(s);
    stuck_ = stuck || axis_stuck_;
    if (stuck_) {
      stuck_at_ = stamp;
      return;
    }
    valid_ = stamp;
    if (s.clipped_gyro > 0 || s.clipped_accel > 0) note_clipped(stamp);
    measure_vibration(s, n);
  }
  void note_clipped(base::Micros stamp) {
    clipped_at_ = stamp;
    clipped_ = static_cast<std::uint16_t>(clipped_ < 0xFFFF ? clipped_ + 1 : 0xFFFF);
  }
  /// Gyroscope and accelerometer take turns, for the sake of the tick's work.
  bool any_axis_stuck(const sensor::ImuSample& s) {
    accel_turn_ = !accel_turn_;
    if (accel_turn_) return accel_axis_.update(s.dvelocity_b_mps) || gyro_axis_.stuck();
    return gyro_axis_.update(s.dangle_b_rad) || accel_axis_.stuck();
  }
  [[nodiscard]] bool begun() const { return valid_.us != 0; }
  [[nodiscard]] float excess(const param::InertialParameters& n) const {
    const float accel = accel2_ / (n.vibration_mps2 * n.vibration_mps2);
    const float gyro = gyro2_ / (n.vibration_radps * n.vibration_radps);
    return accel > gyro ? accel : gyro;
  }
  /// One-pole high-pass of the increments per second, then the mean of its square.
  void measure_vibration(const sensor::ImuSample& s, const param::InertialParameters& n) {
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

  ImuClassifier classifier_;
  StuckAxis gyro_axis_, accel_axis_;
  std::array<float, 3> slow_gyro_{}, slow_accel_{};  ///< low-passed rate and specific force
  float gyro2_ = 0, accel2_ = 0;                     ///< mean squares of the rest
  base::Micros valid_, clipped_at_, stuck_at_;       ///< stamps of the last such sample; 0: none
  std::uint16_t clipped_ = 0;
  Leap leap_;  ///< leap of the last sample; valid while leaps_
  bool stuck_ = false, shaken_ = false, filtered_ = false, axis_stuck_ = false, accel_turn_ = false, leaps_ = false;
};

}  // namespace tetap::checks
