// SPDX-License-Identifier: Apache-2.0
// The horizontal direction in which a vector of the body points: what a magnetometer, a pair of antennas and a course
// over ground measure. With u = R vector along the level axes of the place: atan2(u_y, u_x), and an error dtheta moves
// u by dtheta x u.
#pragma once

#include "tetap/filter/state.hpp"
#include "tetap/nav/ins_state.hpp"

#include <array>

namespace tetap::model {

struct Direction {
  static constexpr std::array<int, 3> kTouches{6, 7, 8};
  float angle_rad;  ///< from east, counter-clockwise; NaN when the vector is vertical to 0.6 degrees
  filter::Matrix<float, 1, 3> h;

  /// q_nl: rotates the level axes of the place into the map's.
  Direction(const nav::InsState& at, const nav::Vector3& vector_b, const nav::Quaternion& q_nl) {
    const nav::Vector3 u = q_nl.conjugate().rotate(at.q_nb.rotate(vector_b));
    const float horizontal2 = u(0) * u(0) + u(1) * u(1);
    const bool defined = horizontal2 > 1e-4F * u(2) * u(2) && horizontal2 > 1e-20F;
    angle_rad = defined ? base::atan2(u(1), u(0)) : base::kNan;
    const float slope = defined ? u(2) / horizontal2 : 0.0F;
    const nav::Vector3 by_turn = q_nl.rotate({-u(0) * slope, -u(1) * slope, 1.0F});
    h << by_turn(0), by_turn(1), by_turn(2);
  }
};

/// The part these models share: one angle, residual the short way round.
struct DirectionMeasurement {
  static constexpr int kDimension = 1;
  static constexpr std::array<int, 3> kTouches = Direction::kTouches;

  nav::Vector3 vector_b{1.0F, 0.0F, 0.0F};  ///< any length
  float angle_rad = 0;                      ///< where it was seen to point, from east, counter-clockwise
  float sigma_rad = 0;
  nav::Quaternion q_nl;  ///< level axes of the place: the angle is from their east

  [[nodiscard]] filter::Vector<float, 1> predict(const nav::InsState& at) const { return linearised(at).z_hat; }
  [[nodiscard]] filter::Vector<float, 1> residual(const filter::Vector<float, 1>& z_hat) const {
    return filter::Vector<float, 1>{base::wrap_angle(angle_rad - z_hat(0))};
  }
  [[nodiscard]] filter::Vector<float, 1> noise() const { return filter::Vector<float, 1>{sigma_rad * sigma_rad}; }
  [[nodiscard]] filter::Matrix<float, 1, 3> jacobian(const nav::InsState& at) const { return linearised(at).h; }
  [[nodiscard]] filter::Linearised<float, 1, 3> linearised(const nav::InsState& at) const {
    const Direction direction(at, vector_b, q_nl);
    return {.z_hat = filter::Vector<float, 1>{direction.angle_rad}, .h = direction.h};
  }
};

}  // namespace tetap::model
