// SPDX-License-Identifier: Apache-2.0
// The one rule of what an IMU sample is good for. The filter, the output predictor, its cells and the attitude filter
// must agree on it. Otherwise the present would be carried over samples that the filter later refuses.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/base/members.hpp"
#include "tetap/checks/stuck_value.hpp"
#include "tetap/nav/imu_increment.hpp"
#include "tetap/param/parameters.hpp"
#include "tetap/sensor/samples.hpp"

#include <cstdint>

namespace tetap::checks {

/// Increments of a sample, along the sensor's axes.
[[nodiscard]] inline nav::ImuIncrement increment_of(const sensor::ImuSample& sample) {
  const auto& a = sample.dangle_b_rad;
  const auto& v = sample.dvelocity_b_mps;
  return {.dtheta_b_rad = {a[0], a[1], a[2]}, .dv_b_mps = {v[0], v[1], v[2]}, .dt = base::Micros{sample.interval_us}};
}

enum class ImuClass : std::uint8_t {
  kInvalid,      ///< not finite, too fast, or its interval is none
  kBeyondRange,  ///< more than the sensor can show on an axis: a garbled transfer, used as if it were missing
  kStuck,        ///< gyroscope or accelerometer repeats itself
  kSaturated,    ///< gyroscope at full scale while wheels show the turn: used as if it were missing
  kOverlapping,  ///< begins before the last one ended by more than half of itself
  kAfterGap,     ///< samples are missing before it
  kContiguous,   ///< begins where the last one ended
};

class ImuClassifier {
 public:
  /// Jitter of drivers' clocks: a longer pause between two samples is a gap.
  static constexpr base::Micros kJitter{1'500};
  /// `pause`: from the end of the last sample to the begin of this one; negative where they overlap.
  [[nodiscard]] static constexpr bool is_gap(base::Micros pause) { return pause > kJitter; }
  [[nodiscard]] static constexpr bool overlaps(base::Micros pause, base::Micros dt) { return 2 * pause.us < -dt.us; }

  /// `increment`: of the sample, in any axes. Repetitions are counted of valid samples alone.
  ImuClass classify(const sensor::ImuSample& sample, const nav::ImuIncrement& increment, base::Micros pause,
                    bool turn_known, const param::InertialParameters& n) {
    if (!within_range(increment, n)) {
      const ImuClass found = judge_size(sample, increment, n);
      if (found != ImuClass::kContiguous) return found;
    }
    if (repeated(sample, n.stuck_samples)) return ImuClass::kStuck;
    if (sample.clipped_gyro > 0 && turn_known) return ImuClass::kSaturated;
    if (overlaps(pause, increment.dt)) return ImuClass::kOverlapping;
    return is_gap(pause) ? ImuClass::kAfterGap : ImuClass::kContiguous;
  }
  /// Counts a valid sample. True when this one is the n-th repetition or beyond; 0: never.
  bool repeated(const sensor::ImuSample& s, std::int32_t n) {
    const bool gyro = gyro_.update(s.dangle_b_rad, kStep_rad, n);
    return accel_.update(s.dvelocity_b_mps, kStep_mps, n) || gyro;
  }
  /// Nothing but the time can make such a sample anything but contiguous: valid, not clipped, no repetition of
  /// `before`.
  [[nodiscard]] static bool plain(const sensor::ImuSample& s, const sensor::ImuSample& before,
                                  const param::InertialParameters& n) {
    return s.clipped_gyro == 0 && s.clipped_accel == 0 && valid(s, n) && !repeats(s, before) && valid(before, n);
  }
  /// The classifier's state after a sample that repeats nothing.
  [[nodiscard]] static ImuClassifier after(const sensor::ImuSample& s) {
    ImuClassifier classifier;
    classifier.gyro_.restart(s.dangle_b_rad);
    classifier.accel_.restart(s.dvelocity_b_mps);
    return classifier;
  }
  /// The gyroscope or the accelerometer shows what it showed in the sample before.
  [[nodiscard]] static bool repeats(const sensor::ImuSample& s, const sensor::ImuSample& before) {
    return Repeats::alike(s.dangle_b_rad, before.dangle_b_rad, kStep_rad) ||
           Repeats::alike(s.dvelocity_b_mps, before.dvelocity_b_mps, kStep_mps);
  }

  static constexpr auto members(auto& self) { return base::members(self.gyro_, self.accel_); }

 private:
  using Repeats = RepeatCounter<3>;
  static constexpr float kStep_rad = 4e-7F, kStep_mps = 4e-6F;  ///< below half a step of the bus: 1e-6 rad, 1e-5 m/s

  [[nodiscard]] static bool valid(const sensor::ImuSample& s, const param::InertialParameters& n) {
    const nav::ImuIncrement increment = increment_of(s);
    return within_range(increment, n) || judge_size(s, increment, n) == ImuClass::kContiguous;
  }
  /// A norm within the range of one axis: no axis is beyond it. False for NaN.
  [[nodiscard]] static bool within_range(const nav::ImuIncrement& increment, const param::InertialParameters& n) {
    const float dt_s = base::seconds(increment.dt);
    const float angle = n.gyro_range_radps * dt_s, speed = n.accel_range_mps2 * dt_s;
    return increment.dt.us > 0 && increment.dt <= nav::ImuIncrement::kLongest &&
           increment.dtheta_b_rad.squaredNorm() < angle * angle && increment.dv_b_mps.squaredNorm() < speed * speed;
  }
  /// Judges the size axis by axis, along the sensor's own. kContiguous: nothing is wrong with the sample's size.
  [[nodiscard, gnu::noinline]] static ImuClass judge_size(const sensor::ImuSample& s,
                                                          const nav::ImuIncrement& increment,
                                                          const param::InertialParameters& n) {
    if (increment.check() != nav::ImuVerdict::kAccepted) return ImuClass::kInvalid;
    const float dt_s = base::seconds(increment.dt);
    for (std::size_t i = 0; i < 3; ++i)
      if (base::abs(s.dangle_b_rad[i]) > n.gyro_range_radps * dt_s ||
          base::abs(s.dvelocity_b_mps[i]) > n.accel_range_mps2 * dt_s)
        return ImuClass::kBeyondRange;
    return ImuClass::kContiguous;
  }

  Repeats gyro_, accel_;
};

}  // namespace tetap::checks
