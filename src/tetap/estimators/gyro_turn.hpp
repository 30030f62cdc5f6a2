// SPDX-License-Identifier: Apache-2.0
// The turn that a gyroscope has shown since its first sample, carried on sample by sample. The turn between two times
// is the quotient of two of these: no sample is walked over twice.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/base/multiply_add.hpp"
#include "tetap/filter/quaternion.hpp"
#include "tetap/sensor/samples.hpp"

#include <cstdint>

namespace tetap::estimators {

/// The bits of a * b.
[[nodiscard, gnu::always_inline]] inline filter::Quaternion product(const filter::Quaternion& a,
                                                                    const filter::Quaternion& b) {
  using base::add_product, base::subtract_product;
  return {subtract_product(subtract_product(subtract_product(a.w * b.w, a.x, b.x), a.y, b.y), a.z, b.z),
          subtract_product(add_product(add_product(a.w * b.x, a.x, b.w), a.y, b.z), a.z, b.y),
          add_product(add_product(subtract_product(a.w * b.y, a.x, b.z), a.y, b.w), a.z, b.x),
          add_product(subtract_product(add_product(a.w * b.z, a.x, b.y), a.y, b.x), a.z, b.w)};
}

/// In the sensor's axes, with the gyroscope's bias in it.
class GyroTurn {
 public:
  /// False: the sample shows no turn that a robot makes, and is left out.
  [[gnu::always_inline]] bool add(const sensor::ImuSample& imu) {
    const filter::Vector3 angle{imu.dangle_b_rad[0], imu.dangle_b_rad[1], imu.dangle_b_rad[2]};
    const float fastest_rad = kFastest_radps * 1e-6F * static_cast<float>(std::int32_t{imu.interval_us});
    const float most_rad = fastest_rad < kMost_rad ? fastest_rad : kMost_rad;
    if (!(filter::dot(angle, angle) < most_rad * most_rad)) return false;
    angle_s_rad_ = gathered_us_ == 0 ? angle : filter::Vector3(angle_s_rad_ + angle);
    gathered_us_ += imu.interval_us;
    span_us_ += imu.interval_us;
    if (gathered_us_ >= kLeast_us) {
      q_ = turned();
      gathered_us_ = 0;
    }
    return true;
  }
  [[nodiscard]] filter::Quaternion turn() const { return gathered_us_ == 0 ? q_ : turned(); }
  /// Sum of the samples' intervals since `earlier`, which is this turn some samples ago.
  [[nodiscard]] std::int32_t span_us(const GyroTurn& earlier) const {
    return static_cast<std::int32_t>(span_us_ - earlier.span_us_);
  }
  static constexpr auto members(auto& self) {
    return base::members(self.q_, self.angle_s_rad_, self.gathered_us_, self.span_us_);
  }

 private:
  /// Samples of a fast IMU are summed to turns of a tick's length. The coning within one is left out.
  static constexpr std::int32_t kLeast_us = 9'000;
  static constexpr float kFastest_radps = 100;  ///< beyond is no turn but nonsense, as in the filter
  static constexpr float kMost_rad = 3;         ///< the series below holds for two thirds of a turn

  [[nodiscard, gnu::always_inline]] filter::Quaternion turned() const {
    const filter::Vector3 half = 0.5F * angle_s_rad_;
    const float h2 = filter::dot(half, half);
    const float sinc = 1.0F - h2 * (1.0F / 6.0F - h2 * (1.0F / 120.0F));
    const float cosine = 1.0F - h2 * (0.5F - h2 * (1.0F / 24.0F - h2 * (1.0F / 720.0F)));
    return product(q_, {cosine, sinc * half(0), sinc * half(1), sinc * half(2)}).renormalised();
  }

  filter::Quaternion q_;
  filter::Vector3 angle_s_rad_ = filter::Vector3::Zero();  ///< not in q_ yet
  std::int32_t gathered_us_ = 0;                           ///< the span of that angle
  std::uint32_t span_us_ = 0;                              ///< modulo 2^32
};

}  // namespace tetap::estimators
