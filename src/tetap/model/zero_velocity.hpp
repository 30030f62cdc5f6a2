// SPDX-License-Identifier: Apache-2.0
// A body that was found to stand still has no velocity (Skog et al. 2010, IEEE T-BME 57(11)).
#pragma once

#include "tetap/filter/state.hpp"
#include "tetap/nav/ins_state.hpp"

#include <array>

namespace tetap::model {

struct ZeroVelocity {
  static constexpr int kDimension = 3;
  static constexpr bool kDirect = true;
  static constexpr std::array<int, 3> kTouches{3, 4, 5};

  float sigma_mps = 0;  ///< 1 sigma of motion that is unnoticed at standstill, per axis

  [[nodiscard]] filter::Vector<float, 3> predict(const nav::InsState& at) const { return at.v_n_mps; }
  [[nodiscard]] filter::Vector<float, 3> residual(const filter::Vector<float, 3>& z_hat) const { return -z_hat; }
  [[nodiscard]] filter::Vector<float, 3> noise() const {
    return filter::Vector<float, 3>::Constant(sigma_mps * sigma_mps);
  }
  [[nodiscard]] filter::Matrix<float, 3, 3> jacobian(const nav::InsState&) const { return nav::Matrix3::Identity(); }
};

}  // namespace tetap::model
