// SPDX-License-Identifier: Apache-2.0
// A magnetometer's sample as the field in body axes: calibrated, then turned as the sensor is mounted.
#pragma once

#include "app/numbers.hpp"
#include "app/samples.hpp"
#include "filter/quaternion.hpp"

namespace tetap::app {

/// A matrix of a robot's numbers, row by row, times a vector.
[[nodiscard]] inline filter::Vector3 times(const std::array<float, 9>& m, const filter::Vector3& v) {
  return {m[0] * v(0) + m[1] * v(1) + m[2] * v(2), m[3] * v(0) + m[4] * v(1) + m[5] * v(2),
          m[6] * v(0) + m[7] * v(1) + m[8] * v(2)};
}
/// The same with the matrix transposed: of a rotation, the way back.
[[nodiscard]] inline filter::Vector3 transposed_times(const std::array<float, 9>& m, const filter::Vector3& v) {
  return {m[0] * v(0) + m[3] * v(1) + m[6] * v(2), m[1] * v(0) + m[4] * v(1) + m[7] * v(2),
          m[2] * v(0) + m[5] * v(1) + m[8] * v(2)};
}

[[nodiscard]] [[gnu::noinline]] inline filter::Vector3 field_b_uT(const MagneticFlux& sample,
                                                                  const MagneticNumbers& n) {
  const filter::Vector3 free{sample.flux_b_uT[0] - n.hard_iron_uT[0], sample.flux_b_uT[1] - n.hard_iron_uT[1],
                             sample.flux_b_uT[2] - n.hard_iron_uT[2]};
  return times(n.mounting_bs, times(n.soft_iron, free));
}

}  // namespace tetap::app
