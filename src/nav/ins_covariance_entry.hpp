// SPDX-License-Identifier: Apache-2.0
// Single entries of F P F^T + Q (ins_covariance.hpp): what is asked of the covariance some time later, where P has to
// stay that of its own time.
#pragma once

#include "nav/ins_covariance.hpp"

#include <array>
#include <cstddef>

namespace tetap::nav {

namespace detail {

/// Row kI of F: the errors that make up error kI after the step, and by how much each.
template <int kI>
struct InsRow {
  static constexpr int kAxis = kI % 3, kGroup = kI - kAxis;
  static constexpr int kNext = (kAxis + 1) % 3, kLast = (kAxis + 2) % 3;
  static constexpr auto kOf = [] {
    constexpr int kV = InsState::kVelocity, kT = InsState::kAttitude, kA = InsState::kAccelBias,
                  kG = InsState::kGyroBias;
    if constexpr (kGroup == InsState::kPosition) {
      return std::array<int, 2>{kI, kV + kAxis};
    } else if constexpr (kGroup == kV) {
      return std::array<int, 6>{kI, kT + kNext, kT + kLast, kA, kA + 1, kA + 2};
    } else if constexpr (kGroup == kT) {
      return std::array<int, 4>{kI, kG, kG + 1, kG + 2};
    } else {
      return std::array<int, 1>{kI};
    }
  }();
  using By = std::array<float, kOf.size()>;

  [[gnu::always_inline]] static By by(const InsCovarianceStep<float>& step) {
    const auto& r = step.r_dt;
    if constexpr (kGroup == InsState::kPosition) {
      return {1.0F, step.dt_s};
    } else if constexpr (kGroup == InsState::kVelocity) {
      return {1.0F, step.dv_n_mps(kLast), -step.dv_n_mps(kNext), -r(kAxis, 0), -r(kAxis, 1), -r(kAxis, 2)};
    } else if constexpr (kGroup == InsState::kAttitude) {
      return {1.0F, -r(kAxis, 0), -r(kAxis, 1), -r(kAxis, 2)};
    } else {
      return {kGroup == InsState::kAccelBias ? step.keep_b_a : step.keep_b_g};
    }
  }
};

}  // namespace detail

/// Entry (kI, kJ) of what predict_covariance() would make of p.
template <int kI, int kJ>
[[nodiscard]] inline float predicted_covariance(const filter::Symmetric<float, InsState::kErrors>& p,
                                                const InsCovarianceStep<float>& step) {
  using I = detail::InsRow<kI>;
  using J = detail::InsRow<kJ>;
  constexpr int kSize = static_cast<int>(J::kOf.size());
  const typename I::By by_i = I::by(step);
  const typename J::By by_j = J::by(step);
  float sum = 0;
  filter::unroll<0, static_cast<int>(I::kOf.size())>([&](auto i) __attribute__((always_inline)) {
    constexpr int kFrom = kI == kJ ? int{i} + 1 : 0;  // what is symmetric is added up once
    float row = 0;
    filter::unroll<kFrom, kSize>([&](auto j)
                                     __attribute__((always_inline)) { row += by_j[j] * p(I::kOf[i], J::kOf[j]); });
    if constexpr (kI == kJ) row = by_i[i] * p(I::kOf[i], I::kOf[i]) + 2.0F * row;
    sum += by_i[i] * row;
  });
  if constexpr (kI == kJ) {
    const std::array<float, 5> noise{step.var_p, step.var_v, step.var_theta, step.var_b_a, step.var_b_g};
    sum += noise[static_cast<std::size_t>(kI / 3)];
    if constexpr (kI == InsState::kAttitude + 2) sum += step.var_yaw;
  }
  return sum;
}

}  // namespace tetap::nav
