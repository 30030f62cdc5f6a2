// SPDX-License-Identifier: Apache-2.0
// How an IMU fares: stuck (the same samples again and again), stale (none), clipped, shaken. A gyroscope or an
// accelerometer whose noise spans quanta does not show three equal axes twice by chance, let alone ten times. Equal is
// what differs by less than half a step of the bus: calibration moves a stuck one by less (jitter of the interval,
// noise of the thermometer).
#pragma once

#include "base/math.hpp"
#include "param/parameters.hpp"
#include "sensor/samples.hpp"

#include <array>
#include <cstdint>

namespace tetap::checks {

/// How the IMU fares.
struct ImuHealthReport {
  float vibration_mps2 = base::kNan;   ///< RMS of what is too fast to be motion
  float vibration_radps = base::kNan;  ///< likewise
  std::uint16_t clipped = 0;           ///< samples with a clipped axis
};

/// Counts samples whose gyroscope, or whose accelerometer, shows what it showed before.
class Repeats {
 public:
  /// True when this one is the n-th repetition or beyond; 0: never.
  bool hear(const sensor::ImuSample& s, std::int32_t n) {
    const auto count = [](std::uint8_t& same, std::array<float, 3>& last, const std::array<float, 3>& now, float step) {
      same = alike(last, now, step) ? static_cast<std::uint8_t>(same < 255 ? same + 1 : 255) : std::uint8_t{0};
      last = now;
    };
    count(gyro_, last_gyro_, s.dangle_b_rad, kStep_rad);
    count(accel_, last_accel_, s.dvelocity_b_mps, kStep_mps);
    return n > 0 && (gyro_ >= n || accel_ >= n);
  }
  /// After a sample that repeats nothing.
  [[nodiscard]] static Repeats after(const sensor::ImuSample& s) {
    Repeats r;
    r.last_gyro_ = s.dangle_b_rad;
    r.last_accel_ = s.dvelocity_b_mps;
    return r;
  }
  /// The gyroscope or the accelerometer shows what it showed in the sample before.
  [[nodiscard]] static bool repeats(const sensor::ImuSample& s, const sensor::ImuSample& before) {
    return alike(s.dangle_b_rad, before.dangle_b_rad, kStep_rad) ||
           alike(s.dvelocity_b_mps, before.dvelocity_b_mps, kStep_mps);
  }
  template <class Sink>
  void hash_state(Sink&& sink) const {
    for (const float v : last_gyro_) sink(v);
    for (const float v : last_accel_) sink(v);
    sink(static_cast<std::uint32_t>(gyro_ | accel_ << 8));
  }

 private:
  static constexpr float kStep_rad = 4e-7F, kStep_mps = 4e-6F;  ///< steps of the bus: 1e-6 rad, 1e-5 m/s
  static bool alike(const std::array<float, 3>& a, const std::array<float, 3>& b, float step) {
    for (std::size_t i = 0; i < 3; ++i)
      if (a[i] - b[i] > step || b[i] - a[i] > step) return false;
    return true;
  }
  std::array<float, 3> last_gyro_{}, last_accel_{};
  std::uint8_t gyro_ = 0, accel_ = 0;
};

class ImuHealth {
 public:
  /// A sample with finite increments and an interval. False: the sensor is stuck, this one says nothing.
  bool hear(const sensor::ImuSample& s, base::Micros stamp, const param::InertialParameters& n) {
    stuck_ = repeats_.hear(s, n.stuck_samples);
    if (stuck_) {
      stuck_at_ = stamp;
      return false;
    }
    heard_ = stamp;
    if (s.clipped_gyro > 0 || s.clipped_accel > 0) {
      clipped_at_ = stamp;
      clipped_ = static_cast<std::uint16_t>(clipped_ < 0xFFFF ? clipped_ + 1 : 0xFFFF);
    }
    shake(s, n);
    return true;
  }
  [[nodiscard]] bool stuck() const { return stuck_; }
  [[nodiscard]] base::Micros heard() const { return heard_; }
  /// The last sample that said something is that old.
  [[nodiscard]] bool stale(base::Micros at, const param::InertialParameters& n) const {
    return begun() && at - heard_ > base::Micros{n.stale_us};
  }
  [[nodiscard]] bool clipped_lately(base::Micros at) const { return clipped_ > 0 && at - clipped_at_ < kLately; }
  [[nodiscard]] bool stuck_lately(base::Micros at) const { return stuck_at_.us > 0 && at - stuck_at_ < kLately; }
  [[nodiscard]] bool shaken() const { return shaken_; }
  [[nodiscard]] const Repeats& repeats() const { return repeats_; }

  /// What the noise densities have to be multiplied with: the numbers hold up to the vibration they were found in, and
  /// grow in proportion beyond it. Never below 1.
  [[nodiscard]] float noise_factor(const param::InertialParameters& n) const {
    const float share = more(n);
    return share > 1.0F ? base::sqrt(share) : 1.0F;
  }
  /// RMS over the last second and a half, in all axes together.
  [[nodiscard]] ImuHealthReport health() const {
    if (!begun()) return {};
    return {.vibration_mps2 = base::sqrt(accel2_), .vibration_radps = base::sqrt(gyro2_), .clipped = clipped_};
  }
  /// It stands as if on a table: less than this at rest, where only the sensor's own noise is left.
  [[nodiscard]] bool calm(const param::InertialParameters& n) const {
    return begun() && accel2_ < n.calm_mps2 * n.calm_mps2 && gyro2_ < n.calm_radps * n.calm_radps;
  }
  template <class Sink>
  void hash_state(Sink&& sink) const {
    repeats_.hash_state(sink);
    for (std::size_t i = 0; i < 3; ++i) {
      sink(slow_gyro_[i]);
      sink(slow_accel_[i]);
    }
    sink(gyro2_);
    sink(accel2_);
    sink(heard_.us);
    sink(clipped_at_.us);
    sink(stuck_at_.us);
    sink(static_cast<std::uint32_t>(clipped_ | (stuck_ ? 0x10000U : 0U) | (shaken_ ? 0x20000U : 0U)));
  }

 private:
  static constexpr base::Micros kLately{1'000'000};
  static constexpr float kSlow_s = 0.05F, kMean_s = 0.5F;  // motion is below 3 Hz; and what RMS is taken over

  [[nodiscard]] bool begun() const { return heard_.us != 0; }
  [[nodiscard]] float more(const param::InertialParameters& n) const {
    const float accel = accel2_ / (n.vibration_mps2 * n.vibration_mps2);
    const float gyro = gyro2_ / (n.vibration_radps * n.vibration_radps);
    return accel > gyro ? accel : gyro;
  }
  /// One-pole high-pass of what the increments are per second, then the mean of its square.
  void shake(const sensor::ImuSample& s, const param::InertialParameters& n) {
    const float dt_s = base::seconds(base::Micros{s.interval_us});
    const float per_s = 1.0F / dt_s;
    const bool first = !shake_begun_;
    shake_begun_ = true;
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
    gyro2_ += mean * (fast2(slow_gyro_, s.dangle_b_rad) - gyro2_);
    accel2_ += mean * (fast2(slow_accel_, s.dvelocity_b_mps) - accel2_);
    const float share = more(n);
    shaken_ = share > (shaken_ ? 1.0F : 4.0F);
  }

  Repeats repeats_;
  std::array<float, 3> slow_gyro_{}, slow_accel_{};
  float gyro2_ = 0, accel2_ = 0;
  base::Micros heard_, clipped_at_, stuck_at_;
  std::uint16_t clipped_ = 0;
  bool stuck_ = false, shaken_ = false, shake_begun_ = false;
};

}  // namespace tetap::checks
