// SPDX-License-Identifier: Apache-2.0
// How a sensor sits on the robot: the rotation from its own axes s into the body b (x forward, y left, z up).
#pragma once

#include <array>
#include <cstdint>

namespace tetap::drivers {

using Vector3 = std::array<float, 3>;

enum class Axis : std::uint8_t { kPlusX, kPlusY, kPlusZ, kMinusX, kMinusY, kMinusZ };

struct Mounting {
  std::array<Vector3, 3> R_bs{Vector3{1, 0, 0}, Vector3{0, 1, 0}, Vector3{0, 0, 1}};  ///< rows

  /// Axes only: which of the sensor's axes points forward, left and up.
  [[nodiscard]] static constexpr Mounting of(Axis forward, Axis left, Axis up) {
    Mounting mounting{};
    mounting.R_bs = {row(forward), row(left), row(up)};
    return mounting;
  }

  [[nodiscard]] constexpr Vector3 to_body(const Vector3& v_s) const {
    Vector3 v_b{};
    for (std::size_t i = 0; i < 3; ++i) {
      v_b[i] = R_bs[i][0] * v_s[0] + R_bs[i][1] * v_s[1] + R_bs[i][2] * v_s[2];
    }
    return v_b;
  }

  /// A rotation: orthonormal rows and no mirror. A mirrored sensor would be a left-handed robot.
  [[nodiscard]] constexpr bool valid() const {
    constexpr float kTolerance = 1e-5F;
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = i; j < 3; ++j) {
        const float error = dot(R_bs[i], R_bs[j]) - (i == j ? 1.0F : 0.0F);
        if (!(error < kTolerance && error > -kTolerance)) return false;
      }
    }
    const Vector3 cross{R_bs[0][1] * R_bs[1][2] - R_bs[0][2] * R_bs[1][1],
                        R_bs[0][2] * R_bs[1][0] - R_bs[0][0] * R_bs[1][2],
                        R_bs[0][0] * R_bs[1][1] - R_bs[0][1] * R_bs[1][0]};
    return dot(cross, R_bs[2]) > 0;
  }

 private:
  [[nodiscard]] static constexpr float dot(const Vector3& a, const Vector3& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  }
  [[nodiscard]] static constexpr Vector3 row(Axis axis) {
    Vector3 unit{};
    const auto index = static_cast<std::size_t>(axis);
    unit[index % 3] = index < 3 ? 1.0F : -1.0F;
    return unit;
  }
};

}  // namespace tetap::drivers
