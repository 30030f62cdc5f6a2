// SPDX-License-Identifier: Apache-2.0
// The attitude filters' part of the common scenario: a body that rolls to and fro while it turns, with jolts, at
// 100 Hz. It has a gyroscope with a bias, accelerometer and magnetometer with noise.
#pragma once

#include "tetap/base/random.hpp"
#include "tetap/filter/quaternion.hpp"

namespace tetap::costs {

inline constexpr float kSwayStep_s = 0.01F;

struct SwayInput {
  filter::Vector3 rate_b_radps, force_b_mps2, field_b_ut;
};

class Sway {
 public:
  using Input = SwayInput;

  explicit Sway(std::uint32_t seed, int /*landmarks*/) : random_(seed) {}

  [[nodiscard]] float roll_rad() const { return roll_rad_; }
  [[nodiscard]] float yaw_rad() const { return yaw_rad_; }
  Input next() {
    t_s_ += kSwayStep_s;
    const float roll_rate = 0.78F * base::cos(1.3F * t_s_), yaw_rate = 0.3F * base::sin(0.2F * t_s_);
    roll_rad_ = 0.6F * base::sin(1.3F * t_s_);
    yaw_rad_ = base::wrap_angle(1.5F * (1.0F - base::cos(0.2F * t_s_)));
    const base::SinCos roll = base::sincos(roll_rad_), yaw = base::sincos(yaw_rad_), jolt = base::sincos(9.0F * t_s_);
    const auto into_b = [&](const filter::Vector3& n) -> filter::Vector3 {
      const float x = yaw.cos * n(0) + yaw.sin * n(1), y = yaw.cos * n(1) - yaw.sin * n(0);
      return {x, roll.cos * y + roll.sin * n(2), roll.cos * n(2) - roll.sin * y};
    };
    return {.rate_b_radps = noisy({roll_rate, roll.sin * yaw_rate, roll.cos * yaw_rate}, 0.01F) +
                            filter::Vector3{0.005F, -0.005F, 0.005F},
            .force_b_mps2 = noisy(into_b({jolt.sin, jolt.cos, 9.81F}), 0.1F),
            .field_b_ut = noisy(into_b({0.0F, 17.0F, -46.0F}), 0.5F)};
  }

 private:
  filter::Vector3 noisy(const filter::Vector3& v, float sigma) {
    const float x = random_.normal(), y = random_.normal(), z = random_.normal();
    return v + sigma * filter::Vector3{x, y, z};
  }
  base::Random random_;
  float t_s_ = 0, roll_rad_ = 0, yaw_rad_ = 0;
};

}  // namespace tetap::costs
