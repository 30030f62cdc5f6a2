// SPDX-License-Identifier: Apache-2.0
// A GNSS fix for inertial navigation: the antenna's place, at a lever arm from the body's origin, with the receiver's
// own accuracy (Groves 2013, eq. 14.103).
#pragma once

#include "tetap/filter/state.hpp"
#include "tetap/nav/ins_state.hpp"

#include <array>

namespace tetap::model {

struct GnssFix3d {
  static constexpr int kDimension = 3;
  static constexpr bool kDirect = true;
  static constexpr std::array<int, 6> kTouches{0, 1, 2, 6, 7, 8};

  base::Anchored x, y, z;        ///< the fix: east, north, up
  float sigma_horizontal_m = 0;  ///< 1 sigma per axis
  float sigma_vertical_m = 0;    ///< 1 sigma
  nav::Vector3 antenna_b_m = nav::Vector3::Zero();

  /// The antenna's place minus the fix: anchored numbers are differenced, so no digit is lost far from the origin.
  [[nodiscard]] filter::Vector<float, 3> predict(const nav::InsState& at) const {
    nav::Vector3 apart_m{nav::difference(at.x, x), nav::difference(at.y, y), nav::difference(at.z, z)};
    if (!has_rest()) return apart_m;
    return at.q_nb.rotate(antenna_b_m) + apart_m;
  }
  [[nodiscard]] filter::Vector<float, 3> residual(const filter::Vector<float, 3>& z_hat) const { return -z_hat; }
  /// Whether there is a lever arm.
  [[nodiscard]] bool has_rest() const { return !(antenna_b_m.squaredNorm() <= 0.0F); }
  [[nodiscard]] filter::Vector<float, 3> noise() const {
    const float horizontal = sigma_horizontal_m * sigma_horizontal_m;
    return {horizontal, horizontal, sigma_vertical_m * sigma_vertical_m};
  }
  [[nodiscard]] filter::Matrix<float, 3, 6> jacobian(const nav::InsState& at) const { return linearised(at).h; }
  [[nodiscard]] filter::Linearised<float, 3, 6> linearised(const nav::InsState& at) const {
    const nav::Vector3 lever_n_m = at.q_nb.rotate(antenna_b_m);
    filter::Linearised<float, 3, 6> result;
    result.z_hat =
        lever_n_m + nav::Vector3{nav::difference(at.x, x), nav::difference(at.y, y), nav::difference(at.z, z)};
    result.h << nav::Matrix3::Identity(), -nav::skew(lever_n_m);
    return result;
  }
};

}  // namespace tetap::model
