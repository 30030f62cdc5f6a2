// SPDX-License-Identifier: Apache-2.0
// Health of an IMU: stuck, stale, clipped, vibrating. A gyroscope or an accelerometer whose noise spans quanta does not
// show three equal axes twice by chance, let alone ten times.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/base/members.hpp"
#include "tetap/checks/imu_classifier.hpp"
#include "tetap/checks/vibration.hpp"
#include "tetap/param/parameters.hpp"

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
  [[nodiscard]] const Vibration& vibration() const { return vibration_; }
  /// Stamp of the last sample that was neither invalid nor stuck; 0: none.
  [[nodiscard]] base::Micros last_valid() const { return valid_; }
  /// The last sample that was neither invalid nor stuck is older than the time-out.
  [[nodiscard]] bool stale(base::Micros at, const param::InertialParameters& n) const {
    return begun() && older(valid_, at, base::Micros{n.stale_us});
  }
  [[nodiscard]] bool clipped_lately(base::Micros at) const { return clipped_ > 0 && recent(clipped_at_, at, kLately); }
  [[nodiscard]] bool stuck_lately(base::Micros at) const { return recent(stuck_at_, at, kLately); }
  [[nodiscard]] const ImuClassifier& classifier() const { return classifier_; }

  [[nodiscard]] ImuHealthReport report() const {
    if (!begun()) return {};
    return {.vibration_mps2 = base::sqrt(vibration_.force2()),
            .vibration_radps = base::sqrt(vibration_.rate2()),
            .clipped = clipped_};
  }
  /// Vibration is below what is left at rest, where only the sensor's own noise shows.
  [[nodiscard]] bool calm(const param::InertialParameters& n) const { return begun() && vibration_.calm(n); }
  static constexpr auto members(auto& self) {
    return base::members(self.classifier_, self.gyro_axis_, self.accel_axis_, self.vibration_, self.valid_,
                         base::in_turns(self.clipped_at_), base::in_turns(self.stuck_at_), self.clipped_, self.stuck_,
                         self.axis_stuck_, self.accel_turn_);
  }

 private:
  static constexpr base::Micros kLately{1'000'000};

  void note(const sensor::ImuSample& s, bool stuck, base::Micros stamp, const param::InertialParameters& n) {
    vibration_.clear_leap();
    axis_stuck_ = n.stuck_samples > 0 && any_axis_stuck(s);
    stuck_ = stuck || axis_stuck_;
    if (stuck_) {
      stuck_at_ = stamp;
      return;
    }
    valid_ = stamp;
    if (s.clipped_gyro > 0 || s.clipped_accel > 0) note_clipped(stamp);
    vibration_.update(s, n);
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

  ImuClassifier classifier_;
  StuckAxis gyro_axis_, accel_axis_;
  Vibration vibration_;
  base::Micros valid_, clipped_at_, stuck_at_;  ///< stamps of the last such sample; 0: none
  std::uint16_t clipped_ = 0;
  bool stuck_ = false, axis_stuck_ = false, accel_turn_ = false;
};

}  // namespace tetap::checks
