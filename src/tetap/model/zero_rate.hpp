// SPDX-License-Identifier: Apache-2.0
// A gyroscope on a body that does not turn shows its bias, and the Earth's rotation.
#pragma once

#include "tetap/filter/state.hpp"
#include "tetap/nav/ins_state.hpp"

#include <array>

namespace tetap::model {

struct ZeroRate {
  static constexpr int kDimension = 3;
  static constexpr bool kDirect = true;
  static constexpr std::array<int, 3> kTouches{12, 13, 14};

  nav::Vector3 gyro_b_radps = nav::Vector3::Zero();     ///< mean over the standstill
  float sigma_radps = 0;                                ///< 1 sigma of that mean, per axis
  nav::Vector3 variance_factor = nav::Vector3::Ones();  ///< times its variance, per axis
  nav::Vector3 earth_rate_n_radps = nav::Vector3::Zero();

  [[nodiscard]] filter::Vector<float, 3> predict(const nav::InsState& at) const {
    return at.b_g_radps + at.q_nb.conjugate().rotate(earth_rate_n_radps);
  }
  [[nodiscard]] filter::Vector<float, 3> residual(const filter::Vector<float, 3>& z_hat) const {
    return gyro_b_radps - z_hat;
  }
  [[nodiscard]] filter::Vector<float, 3> noise() const { return (sigma_radps * sigma_radps) * variance_factor; }
  /// A wrong heading turns the Earth's rate, by 0.07 mrad/s per radian: this is left out.
  [[nodiscard]] filter::Matrix<float, 3, 3> jacobian(const nav::InsState&) const { return nav::Matrix3::Identity(); }
};

}  // namespace tetap::model
