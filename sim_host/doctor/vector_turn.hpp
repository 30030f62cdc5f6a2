// SPDX-License-Identifier: Apache-2.0
// The gyroscope, axis by axis, against a vector that stands still in the world: the Earth's field, or gravity. A body
// that turns by w sees the vector change by -w x v. Least squares give the factor of each axis: 1 is right, -1 is a
// wrong sign, 0.5 a gyroscope that measures twice the turn.
#pragma once

#include "sim_host/doctor/vector.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <optional>

namespace tetap::doctor {

/// True turn over measured turn, of one axis of the gyroscope.
struct AxisFactor {
  double value = 0, sigma = 0;
};

class VectorTurn {
 public:
  /// The vector before and after a turn by the gyroscope [rad], all in the gyroscope's axes.
  void add(const Vector3& was, const Vector3& is, const Vector3& turn_rad) {
    const Vector3 middle = scaled(0.5, sum(was, is)), change = sum(is, scaled(-1, was));
    Matrix3 parts{};
    for (std::size_t i = 0; i < 3; ++i) {
      Vector3 axis{};
      axis[i] = turn_rad[i];
      parts[i] = cross(middle, axis);
    }
    for (std::size_t i = 0; i < 3; ++i) {
      right_[i] += dot(parts[i], change);
      for (std::size_t j = 0; j < 3; ++j) normal_[i][j] += dot(parts[i], parts[j]);
    }
    change2_ += dot(change, change);
    ++count_;
  }
  /// Nothing where the turns about that axis do not show.
  [[nodiscard]] std::optional<AxisFactor> factor(std::size_t axis) const {
    constexpr double kLeastChanges = 20;
    if (count_ < kLeastChanges) return std::nullopt;
    const Matrix3 rows{cross(normal_[1], normal_[2]), cross(normal_[2], normal_[0]), cross(normal_[0], normal_[1])};
    const double determinant = dot(normal_[0], rows[0]);
    if (!(determinant > 0)) return std::nullopt;
    const Vector3 factors = scaled(1 / determinant, rotated(rows, right_));  // the inverse is symmetric
    const double left2 = (change2_ - dot(factors, right_)) / (3 * count_ - 3);
    return AxisFactor{.value = factors[axis], .sigma = std::sqrt(std::fmax(0, left2 * rows[axis][axis] / determinant))};
  }

 private:
  Matrix3 normal_{};
  Vector3 right_{};
  double change2_ = 0, count_ = 0;
};

}  // namespace tetap::doctor
