// SPDX-License-Identifier: Apache-2.0
// East and north of a measurement along a level plane that leans in the map, where the third axis is not known. A
// measurement along the plane shows no step across it. Each row i is row i minus slope_i times row up.
#pragma once

#include "filter/state.hpp"
#include "nav/local_level.hpp"

#include <array>
#include <cstddef>

namespace tetap::model {

/// A measurement of three axes (GnssFix3d, GnssVelocity3d) whose third has no weight.
template <class Measurement>
struct OnLevelPlane : Measurement {
  static constexpr bool kDirect = false;
  static constexpr int kDimension = Measurement::kDimension, kTouched = static_cast<int>(Measurement::kTouches.size());

  std::array<float, 2> slope{};  ///< the plane's in the map, east and north

  OnLevelPlane(const Measurement& of, const nav::LocalLevel& place)
      : Measurement(of), slope{place.up_n(0) / place.up_n(2), place.up_n(1) / place.up_n(2)} {}

  [[nodiscard]] static bool has_rest() { return true; }
  /// The innovation's negative.
  [[nodiscard]] filter::Vector<float, kDimension> predict(const nav::InsState& at) const {
    return linearised(at).z_hat;
  }
  [[nodiscard]] filter::Vector<float, kDimension> residual(const filter::Vector<float, kDimension>& z_hat) const {
    return -z_hat;
  }
  [[nodiscard]] filter::Matrix<float, kDimension, kTouched> jacobian(const nav::InsState& at) const {
    return linearised(at).h;
  }
  [[nodiscard]] filter::Linearised<float, kDimension, kTouched> linearised(const nav::InsState& at) const {
    auto result = Measurement::linearised(at);
    result.z_hat = -Measurement::residual(result.z_hat);
    for (int i = 0; i < 2; ++i) {
      const float by = slope[static_cast<std::size_t>(i)];
      result.z_hat(i) -= by * result.z_hat(2);
      for (int c = 0; c < kTouched; ++c) result.h(i, c) -= by * result.h(2, c);
    }
    return result;
  }
};

}  // namespace tetap::model
