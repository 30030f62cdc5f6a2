// SPDX-License-Identifier: Apache-2.0
// Samples of rate and specific force to increments over a longer interval, with coning and sculling. Savage, "Strapdown
// Inertial Navigation Integration Algorithm Design", J. Guidance 21(1), 1998: part 1 eqs. (31)-(38) coning, part 2
// (2), (29)-(38) sculling; Titterton & Weston, Strapdown Inertial Navigation Technology, 2nd ed., ch. 11.
//
// The velocity increment is in the body's axes at the *start* of the interval: v_n += R_nb(start) dvelocity_b plus
// gravity. The angle increment is the rotation vector from start to end. Between samples both are straight lines.
#pragma once

#include "drivers/imu/reading.hpp"
#include "tetap/base/math.hpp"
#include "tetap/sensor/samples.hpp"

#include <optional>

namespace tetap::drivers {

/// An increment and the time it ends at.
struct StampedImu {
  base::Micros stamp{};
  sensor::ImuSample sample{};
};

class ImuIntegrator {
 public:
  /// `readings` make one increment, or as many as fit into the 65 ms that a sample's interval can hold.
  explicit constexpr ImuIntegrator(std::uint8_t readings) : readings_(readings > 0 ? readings : std::uint8_t{1}) {}

  /// An increment, when this reading completes one. A gap ends the one begun, without the missing part. The next then
  /// does not begin where the last one ended, which shows to every later integrator.
  constexpr std::optional<StampedImu> add(const ImuReading& reading) {
    std::optional<StampedImu> out{};
    if (reading.after_gap) {
      if (count_ > 0) out = finish();
      // Nothing is known of the start of the interval: as at its end.
      before_ = reading;
      last_dalpha_ = last_dv_ = Vector3{};
    }
    step(reading);
    // A gap and a full interval at once happen only with one reading each; the gap's remainder is empty then.
    const bool full = (interval_ + reading.interval).us > kMost_us;
    if (count_ >= readings_ || full) out = finish();
    return out;
  }

 private:
  static constexpr std::int64_t kMost_us = 0xFFFF;

  constexpr void step(const ImuReading& reading) {
    const float dt_s = base::seconds(reading.interval);
    const Vector3 dalpha = scaled_sum(before_.rate_b_radps, reading.rate_b_radps, 0.5F * dt_s);
    const Vector3 dv = scaled_sum(before_.force_b_mps2, reading.force_b_mps2, 0.5F * dt_s);
    // Part 1 (37), part 2 (37): what turned and what pushed so far, with a sixth of the last step for the curvature.
    const Vector3 alpha = plus_sixth(alpha_, last_dalpha_);
    const Vector3 velocity = plus_sixth(velocity_, last_dv_);
    add_half(coning_, cross(alpha, dalpha));
    add_half(sculling_, cross(alpha, dv));
    add_half(sculling_, cross(velocity, dalpha));
    for (std::size_t i = 0; i < 3; ++i) {
      alpha_[i] += dalpha[i];
      velocity_[i] += dv[i];
    }
    last_dalpha_ = dalpha;
    last_dv_ = dv;
    before_ = reading;
    interval_ += reading.interval;
    clipped_gyro_ = static_cast<std::uint8_t>(clipped_gyro_ + (reading.clipped_gyro ? 1 : 0));
    clipped_accel_ = static_cast<std::uint8_t>(clipped_accel_ + (reading.clipped_accel ? 1 : 0));
    ++count_;
  }

  constexpr StampedImu finish() {
    StampedImu out{.stamp = before_.stamp};
    out.sample.interval_us = static_cast<std::uint16_t>(interval_.us);
    const Vector3 turned = cross(alpha_, velocity_);  // part 2 (2): the rotation of the axes while pushed
    for (std::size_t i = 0; i < 3; ++i) {
      out.sample.dangle_b_rad[i] = alpha_[i] + coning_[i];
      out.sample.dvelocity_b_mps[i] = velocity_[i] + 0.5F * turned[i] + sculling_[i];
    }
    out.sample.temperature_degC = before_.temperature_degC;
    out.sample.clipped_gyro = clipped_gyro_;
    out.sample.clipped_accel = clipped_accel_;
    interval_ = {};
    // The last steps stay: the curvature does not end with the interval.
    alpha_ = velocity_ = coning_ = sculling_ = Vector3{};
    clipped_gyro_ = clipped_accel_ = count_ = 0;
    return out;
  }

  [[nodiscard]] static constexpr Vector3 cross(const Vector3& a, const Vector3& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  }
  [[nodiscard]] static constexpr Vector3 scaled_sum(const Vector3& a, const Vector3& b, float scale) {
    return {(a[0] + b[0]) * scale, (a[1] + b[1]) * scale, (a[2] + b[2]) * scale};
  }
  [[nodiscard]] static constexpr Vector3 plus_sixth(const Vector3& a, const Vector3& b) {
    constexpr float kSixth = 1.0F / 6.0F;
    return {a[0] + kSixth * b[0], a[1] + kSixth * b[1], a[2] + kSixth * b[2]};
  }
  static constexpr void add_half(Vector3& sum, const Vector3& v) {
    for (std::size_t i = 0; i < 3; ++i) sum[i] += 0.5F * v[i];
  }

  std::uint8_t readings_;
  std::uint8_t count_ = 0;
  std::uint8_t clipped_gyro_ = 0, clipped_accel_ = 0;
  base::Micros interval_{};
  ImuReading before_{};
  Vector3 alpha_{}, velocity_{}, coning_{}, sculling_{};
  Vector3 last_dalpha_{}, last_dv_{};
};

}  // namespace tetap::drivers
