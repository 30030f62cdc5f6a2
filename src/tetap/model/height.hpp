// SPDX-License-Identifier: Apache-2.0
// A height above the origin, of a barometer or whatever else knows only that.
#pragma once

#include "tetap/filter/state.hpp"
#include "tetap/nav/ins_state.hpp"

#include <array>

namespace tetap::model {

struct Height {
  static constexpr int kDimension = 1;
  static constexpr bool kDirect = true;
  static constexpr std::array<int, 1> kTouches{2};

  base::Anchored z;  ///< up, of the body's origin
  float sigma_m = 0;

  [[nodiscard]] filter::Vector<float, 1> predict(const nav::InsState& at) const {
    return filter::Vector<float, 1>{nav::difference(at.z, z)};
  }
  [[nodiscard]] filter::Vector<float, 1> residual(const filter::Vector<float, 1>& z_hat) const { return -z_hat; }
  [[nodiscard]] filter::Vector<float, 1> noise() const { return filter::Vector<float, 1>{sigma_m * sigma_m}; }
  [[nodiscard]] filter::Matrix<float, 1, 1> jacobian(const nav::InsState&) const {
    return filter::Matrix<float, 1, 1>{1.0F};
  }
};

}  // namespace tetap::model
