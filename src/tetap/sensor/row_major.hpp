// SPDX-License-Identifier: Apache-2.0
// Matrices as a robot's numbers have them, row by row, times a vector.
#pragma once

#include "tetap/filter/quaternion.hpp"

#include <array>

namespace tetap::sensor {

[[nodiscard]] inline filter::Vector3 times(const std::array<float, 9>& m, const filter::Vector3& v) {
  return {m[0] * v(0) + m[1] * v(1) + m[2] * v(2), m[3] * v(0) + m[4] * v(1) + m[5] * v(2),
          m[6] * v(0) + m[7] * v(1) + m[8] * v(2)};
}
/// The same with the matrix transposed: of a rotation, the way back.
[[nodiscard]] inline filter::Vector3 transposed_times(const std::array<float, 9>& m, const filter::Vector3& v) {
  return {m[0] * v(0) + m[3] * v(1) + m[6] * v(2), m[1] * v(0) + m[4] * v(1) + m[7] * v(2),
          m[2] * v(0) + m[5] * v(1) + m[8] * v(2)};
}

}  // namespace tetap::sensor
