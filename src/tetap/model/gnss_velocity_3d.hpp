// SPDX-License-Identifier: Apache-2.0
// GNSS velocity for inertial navigation: that of the antenna, which a turning body swings round (Groves 2013,
// eq. 14.104).
#pragma once

#include "tetap/filter/state.hpp"
#include "tetap/nav/ins_state.hpp"

#include <array>

namespace tetap::model {

struct GnssVelocity3d {
  static constexpr int kDimension = 3;
  static constexpr bool kDirect = true;
  static constexpr std::array<int, 9> kTouches{3, 4, 5, 6, 7, 8, 12, 13, 14};

  nav::Vector3 v_n_mps = nav::Vector3::Zero();  ///< east, north, up
  float sigma_horizontal_mps = 0;               ///< 1 sigma per axis
  float sigma_vertical_mps = 0;
  nav::Vector3 antenna_b_m = nav::Vector3::Zero();
  nav::Vector3 gyro_b_radps = nav::Vector3::Zero();  ///< as the sensor shows it: the filter takes its bias off

  [[nodiscard]] filter::Vector<float, 3> predict(const nav::InsState& at) const {
    if (!has_rest()) return at.v_n_mps;
    return linearised(at).z_hat;
  }
  [[nodiscard]] filter::Vector<float, 3> residual(const filter::Vector<float, 3>& z_hat) const {
    return v_n_mps - z_hat;
  }
  /// Whether there is a lever arm, or something that is no number and has to show.
  [[nodiscard]] bool has_rest() const {
    return !(antenna_b_m.squaredNorm() <= 0.0F) || !(gyro_b_radps.squaredNorm() < 1e30F);
  }
  [[nodiscard]] filter::Vector<float, 3> noise() const {
    const float horizontal = sigma_horizontal_mps * sigma_horizontal_mps;
    return {horizontal, horizontal, sigma_vertical_mps * sigma_vertical_mps};
  }
  [[nodiscard]] filter::Matrix<float, 3, 9> jacobian(const nav::InsState& at) const { return linearised(at).h; }
  [[nodiscard]] filter::Linearised<float, 3, 9> linearised(const nav::InsState& at) const {
    const nav::Matrix3 r_nb = at.q_nb.matrix();
    const nav::Vector3 swing_n_mps = r_nb * nav::cross(gyro_b_radps - at.b_g_radps, antenna_b_m);
    filter::Linearised<float, 3, 9> result;
    result.z_hat = at.v_n_mps + swing_n_mps;
    result.h << nav::Matrix3::Identity(), -nav::skew(swing_n_mps), r_nb.lazyProduct(nav::skew(antenna_b_m));
    return result;
  }
};

}  // namespace tetap::model
