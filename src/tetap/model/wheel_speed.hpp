// SPDX-License-Identifier: Apache-2.0
// Forward speed of a wheeled robot from its encoders, with the constraint that wheels move neither sideways nor up. A
// robot without encoders has NonHolonomic alone.
#pragma once

#include "tetap/model/body_velocity.hpp"

#include <array>

namespace tetap::model {

struct WheelSpeed {
  static constexpr int kDimension = 3;
  static constexpr std::array<int, 9> kTouches{3, 4, 5, 6, 7, 8, 12, 13, 14};

  float forward_mps = 0;
  float sigma_forward_mps = 0;  ///< from the encoders' resolution and the slip they always have
  float sigma_lateral_mps = 0;  ///< how well the constraint holds
  float sigma_vertical_mps = 0;
  nav::Vector3 axle_b_m = nav::Vector3::Zero();      ///< the middle of the axle that does not steer
  nav::Vector3 gyro_b_radps = nav::Vector3::Zero();  ///< as the sensor shows it
  bool moves = true;                                 ///< certain motion: then its direction shows attitude

  [[nodiscard]] filter::Vector<float, 3> predict(const nav::InsState& at) const { return linearised(at).z_hat; }
  [[nodiscard]] filter::Vector<float, 3> residual(const filter::Vector<float, 3>& z_hat) const {
    return {forward_mps - z_hat(0), -z_hat(1), -z_hat(2)};
  }
  [[nodiscard]] filter::Vector<float, 3> noise() const {
    return {sigma_forward_mps * sigma_forward_mps, sigma_lateral_mps * sigma_lateral_mps,
            sigma_vertical_mps * sigma_vertical_mps};
  }
  [[nodiscard]] filter::Matrix<float, 3, 9> jacobian(const nav::InsState& at) const { return linearised(at).h; }
  [[nodiscard]] filter::Linearised<float, 3, 9> linearised(const nav::InsState& at) const {
    const BodyVelocity body(at, gyro_b_radps, axle_b_m, moves);
    return {.z_hat = body.v_b_mps, .h = body.h};
  }
};

struct NonHolonomic {
  static constexpr int kDimension = 2;
  static constexpr std::array<int, 9> kTouches = WheelSpeed::kTouches;

  float sigma_lateral_mps = 0;
  float sigma_vertical_mps = 0;
  nav::Vector3 axle_b_m = nav::Vector3::Zero();
  nav::Vector3 gyro_b_radps = nav::Vector3::Zero();  ///< as the sensor shows it
  bool moves = true;                                 ///< certain motion: then its direction shows attitude

  [[nodiscard]] filter::Vector<float, 2> predict(const nav::InsState& at) const { return linearised(at).z_hat; }
  [[nodiscard]] filter::Vector<float, 2> residual(const filter::Vector<float, 2>& z_hat) const { return -z_hat; }
  [[nodiscard]] filter::Vector<float, 2> noise() const {
    return {sigma_lateral_mps * sigma_lateral_mps, sigma_vertical_mps * sigma_vertical_mps};
  }
  [[nodiscard]] filter::Matrix<float, 2, 9> jacobian(const nav::InsState& at) const { return linearised(at).h; }
  [[nodiscard]] filter::Linearised<float, 2, 9> linearised(const nav::InsState& at) const {
    const BodyVelocity body(at, gyro_b_radps, axle_b_m, moves);
    return {.z_hat = body.v_b_mps.tail<2>(), .h = body.h.bottomRows<2>()};
  }
};

}  // namespace tetap::model
