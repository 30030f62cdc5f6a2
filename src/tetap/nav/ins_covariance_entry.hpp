// SPDX-License-Identifier: Apache-2.0
// Single entries of F P F^T + Q (ins_covariance.hpp). They answer for the covariance some time later, while P has to
// stay that of its own time.
#pragma once

#include "tetap/nav/ins_covariance.hpp"

#include <array>
#include <cstddef>

namespace tetap::nav {

namespace detail {

/// Errors that make up error i after the step: those of row i of F.
struct InsTerms {
  std::array<int, 6> of{};
  int count = 0;
};
constexpr InsTerms ins_terms(int i) {
  constexpr int kV = InsState::kVelocity, kT = InsState::kAttitude, kA = InsState::kAccelBias, kG = InsState::kGyroBias;
  const int axis = i % 3, next = (axis + 1) % 3, last = (axis + 2) % 3;
  if (i < kV) return {.of = {i, kV + axis}, .count = 2};
  if (i < kT) return {.of = {i, kT + next, kT + last, kA, kA + 1, kA + 2}, .count = 6};
  if (i < kA) return {.of = {i, kG, kG + 1, kG + 2}, .count = 4};
  return {.of = {i}, .count = 1};
}
/// Factor of the k-th error in error i: an entry of F.
[[gnu::always_inline]] inline float ins_gain(int i, int k, const InsCovarianceStep<float>& step) {
  const int axis = i % 3, next = (axis + 1) % 3, last = (axis + 2) % 3;
  if (k == 0) {
    if (i < InsState::kAccelBias) return 1.0F;
    return i < InsState::kGyroBias ? step.keep_b_a : step.keep_b_g;
  }
  if (i < InsState::kVelocity) return step.dt_s;
  if (i >= InsState::kAttitude) return -step.r_dt(axis, k - 1);
  if (k == 1) return step.dv_n_mps(last);
  return k == 2 ? -step.dv_n_mps(next) : -step.r_dt(axis, k - 3);
}
[[gnu::always_inline]] inline float ins_noise(int i, const InsCovarianceStep<float>& step) {
  const std::array<float, 5> noise{step.var_p, step.var_v, step.var_theta, step.var_b_a, step.var_b_g};
  const float own = noise[static_cast<std::size_t>(i / 3)];
  return i == InsState::kAttitude + 2 ? own + step.var_yaw : own;
}

}  // namespace detail

/// Entry (kI, kJ) of what predict_covariance() would make of p.
template <int kI, int kJ>
[[nodiscard]] inline float predicted_covariance(const filter::Symmetric<float, InsState::kErrors>& p,
                                                const InsCovarianceStep<float>& step) {
  constexpr detail::InsTerms kOfI = detail::ins_terms(kI), kOfJ = detail::ins_terms(kJ);
  float sum = 0;
  filter::unroll<0, kOfI.count>([&](auto i) __attribute__((always_inline)) {
    constexpr int kFrom = kI == kJ ? int{i} + 1 : 0;  // what is symmetric is added up once
    const float by_i = detail::ins_gain(kI, i, step);
    float row = 0;
    filter::unroll<kFrom, kOfJ.count>([&](auto j) __attribute__((always_inline)) {
      row = base::add_product(row, detail::ins_gain(kJ, j, step), p(kOfI.of[i], kOfJ.of[j]));
    });
    if constexpr (kI == kJ) row = by_i * p(kOfI.of[i], kOfI.of[i]) + 2.0F * row;
    sum = base::add_product(sum, by_i, row);
  });
  if constexpr (kI == kJ) sum += detail::ins_noise(kI, step);
  return sum;
}

namespace detail {

/// Sum of what error kFrom has with the terms of error kOf: an entry of P F^T.
template <int kFrom, int kOf>
[[nodiscard, gnu::always_inline]] inline float predicted_row(const filter::Symmetric<float, InsState::kErrors>& p,
                                                             const InsCovarianceStep<float>& step) {
  constexpr InsTerms kTerms = ins_terms(kOf);
  float row = kOf < InsState::kAccelBias ? p(kFrom, kOf) : ins_gain(kOf, 0, step) * p(kFrom, kOf);
  filter::unroll<1, kTerms.count>([&](auto j) __attribute__((always_inline)) {
    row = base::add_product(row, ins_gain(kOf, j, step), p(kFrom, kTerms.of[static_cast<std::size_t>(int{j})]));
  });
  return row;
}

template <int kFirst>
[[gnu::noinline]] void predict_block(const filter::Symmetric<float, InsState::kErrors>& p,
                                     const InsCovarianceStep<float>& step, filter::Symmetric<float, 3>& block) {
  filter::unroll<0, 3>([&](auto c) __attribute__((always_inline)) {
    filter::unroll<0, c + 1>([&](auto r) __attribute__((always_inline)) {
      constexpr InsTerms kTerms = ins_terms(kFirst + r);
      float sum = r == c ? ins_noise(kFirst + c, step) : 0.0F;
      filter::unroll<0, kTerms.count>([&](auto i) __attribute__((always_inline)) {
        constexpr int kFrom = kTerms.of[static_cast<std::size_t>(int{i})];
        const float row = predicted_row<kFrom, kFirst + c>(p, step);
        sum = i == 0 && kFirst < InsState::kAccelBias ? sum + row
                                                      : base::add_product(sum, ins_gain(kFirst + r, i, step), row);
      });
      block(r, c) = sum;
    });
  });
}

}  // namespace detail

/// The same of errors first, first + 1 and first + 2: position, velocity, attitude or one of the biases.
[[nodiscard]] inline filter::Symmetric<float, 3> predicted_block(const filter::Symmetric<float, InsState::kErrors>& p,
                                                                 const InsCovarianceStep<float>& step, int first) {
  filter::Symmetric<float, 3> block;
  switch (first) {
    case InsState::kPosition:
      detail::predict_block<InsState::kPosition>(p, step, block);
      break;
    case InsState::kVelocity:
      detail::predict_block<InsState::kVelocity>(p, step, block);
      break;
    case InsState::kAttitude:
      detail::predict_block<InsState::kAttitude>(p, step, block);
      break;
    case InsState::kAccelBias:
      detail::predict_block<InsState::kAccelBias>(p, step, block);
      break;
    default:
      detail::predict_block<InsState::kGyroBias>(p, step, block);
  }
  return block;
}

}  // namespace tetap::nav
