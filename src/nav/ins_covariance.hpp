// SPDX-License-Identifier: Apache-2.0
// P = F P F^T + Q of inertial navigation, by the structure of F: four shears in place, each adding a multiple of one
// group of errors to another, on the packed upper half. With dv = R (f - b_a) dt and B = -R dt:
//   p += dt/2 v;  v += -[dv]x theta + B b_a;  p += dt/2 v;  theta += B b_g     (Sola 2017, sec. 7.3, global angular
//   error)
// The two halves of the position step carry the second-order terms dp <- dtheta, db_a.
#pragma once

#include "nav/ins_state.hpp"

namespace tetap::nav {

/// One step or several added up; Q per axis and isotropic, so it needs no rotation.
template <class Scalar>
struct InsCovarianceStep {
  Scalar dt_s = 0;
  filter::Vector<Scalar, 3> dv_n_mps = filter::Vector<Scalar, 3>::Zero();
  filter::Matrix<Scalar, 3, 3> r_dt = filter::Matrix<Scalar, 3, 3>::Zero();  ///< sum of R_nb dt
  Scalar var_v = 0, var_theta = 0, var_b_a = 0, var_b_g = 0;                 ///< added per axis over the step
  Scalar keep_b_a = 1, keep_b_g = 1;  ///< what is left of a bias after it (Gauss-Markov); 1: random walk
};

namespace detail {

template <class Scalar>
using InsP = filter::Symmetric<Scalar, InsState::kErrors>;

/// The group at kTo gains gain(r, j): row r of the multiple, against error j. gain reads only rows of other groups.
template <int kTo, class Scalar, class Gain>
[[gnu::always_inline]] inline void shear(InsP<Scalar>& p, const Gain& gain) {
#pragma GCC unroll 16
  for (int c = 0; c < 3; ++c)
#pragma GCC unroll 16
    for (int r = 0; r <= c; ++r) p(kTo + r, kTo + c) += gain(r, kTo + c);
#pragma GCC unroll 16
  for (int j = 0; j < InsState::kErrors; ++j) {
    if (j >= kTo && j < kTo + 3) continue;
    const Scalar g0 = gain(0, j), g1 = gain(1, j), g2 = gain(2, j);
    p(kTo, j) += g0;
    p(kTo + 1, j) += g1;
    p(kTo + 2, j) += g2;
  }
#pragma GCC unroll 16
  for (int c = 0; c < 3; ++c)
#pragma GCC unroll 16
    for (int r = 0; r <= c; ++r) p(kTo + r, kTo + c) += gain(c, kTo + r);
}

}  // namespace detail

template <class Scalar>
inline void predict_covariance(filter::Symmetric<Scalar, InsState::kErrors>& p, const InsCovarianceStep<Scalar>& step) {
  constexpr int kV = InsState::kVelocity, kT = InsState::kAttitude, kA = InsState::kAccelBias, kG = InsState::kGyroBias;
  const auto turned = [&](int r, int from, int j) {  // row r of R dt times the group at `from`
    return step.r_dt(r, 0) * p(from, j) + step.r_dt(r, 1) * p(from + 1, j) + step.r_dt(r, 2) * p(from + 2, j);
  };
  const Scalar half_s = Scalar(0.5F) * step.dt_s;
  const auto moved = [&](int r, int j) { return half_s * p(kV + r, j); };
  detail::shear<InsState::kPosition>(p, moved);
  detail::shear<kV>(p, [&](int r, int j) {
    const int a = r == 2 ? 0 : r + 1, b = r == 0 ? 2 : r - 1;  // theta x dv
    return (p(kT + a, j) * step.dv_n_mps(b) - p(kT + b, j) * step.dv_n_mps(a)) - turned(r, kA, j);
  });
  detail::shear<InsState::kPosition>(p, moved);
  detail::shear<kT>(p, [&](int r, int j) { return -turned(r, kG, j); });
  if (step.keep_b_a < Scalar{1} || step.keep_b_g < Scalar{1}) {
    for (int i = 0; i < 6; ++i) {
      const Scalar keep = i < 3 ? step.keep_b_a : step.keep_b_g;
      for (int j = 0; j < InsState::kErrors; ++j) p(kA + i, j) *= j == kA + i ? keep * keep : keep;
    }
  }
#pragma GCC unroll 16
  for (int i = 0; i < 3; ++i) {
    p(kV + i, kV + i) += step.var_v;
    p(kT + i, kT + i) += step.var_theta;
    p(kA + i, kA + i) += step.var_b_a;
    p(kG + i, kG + i) += step.var_b_g;
  }
}

/// The largest standard deviations the filter keeps: beyond them it knows nothing, and float would overflow in the end.
inline constexpr std::array<float, 5> kInsMostSigma{1e6F, 1e4F, 4.0F, 100.0F, 10.0F};

namespace detail {

/// Whether no eigenvalue of the correlations is below kShare, which is what float can tell from nothing: P less that
/// share of its diagonal still has a factor L D L^T with D above zero.
[[nodiscard]] inline bool well_conditioned(const InsP<float>& p) {
  constexpr float kShare = 1e-5F, kRounding = 1e-7F;
  InsP<float> l;  // l(i, j), i < j: L_ji; the diagonal holds D
  for (int j = 0; j < InsState::kErrors; ++j) {
    for (int i = 0; i < j; ++i) {
      float sum = p(i, j);  // L_ji D_i until the row is done
      for (int k = 0; k < i; ++k) sum -= l(k, i) * l(k, j);
      l(i, j) = sum;
    }
    float pivot = p(j, j) * (1.0F - kShare);
    for (int i = 0; i < j; ++i) {
      const float scaled = l(i, j) / l(i, i);
      pivot -= scaled * l(i, j);
      l(i, j) = scaled;
    }
    if (!(pivot > p(j, j) * kRounding)) return false;
    l(j, j) = pivot;
  }
  return true;
}

}  // namespace detail

/// Puts P back among the matrices that float can hold as positive definite, whatever it was: all correlations are made
/// smaller by a little (which adds that share to every conditional variance), by more if that is not enough, and in the
/// end by all. Variances above kInsMostSigma are scaled back with their rows, which keeps every correlation.
/// True when P was fine as it was.
inline bool condition(filter::Symmetric<float, InsState::kErrors>& p) {
  constexpr int kN = InsState::kErrors;
  constexpr float kLeast = 1e-20F;  // below, products of variances leave the normal numbers
  bool fine = true;
  for (int i = 0; i < kN; ++i) {
    const float most = kInsMostSigma[static_cast<std::size_t>(i / 3)];
    if (p(i, i) >= kLeast && p(i, i) <= most * most) continue;
    fine = false;
    const bool small = p(i, i) < kLeast;
    const float scale = !small && p(i, i) < 1e36F ? most / base::sqrt(p(i, i)) : 0.0F;  // neither for NaN
    for (int j = 0; j < kN; ++j) p(i, j) = scale > 0.0F ? p(i, j) * scale : 0.0F;
    p(i, i) = small ? kLeast : most * most;
  }
  for (const float share : {2e-5F, 2e-5F, 2e-4F, 2e-3F, 0.02F, 0.2F, 1.0F}) {
    if (detail::well_conditioned(p)) return fine;
    fine = false;
    for (int c = 0; c < kN; ++c)
      for (int r = 0; r < c; ++r) p(r, c) = share < 1.0F ? p(r, c) * (1.0F - share) : 0.0F;
  }
  return fine;
}

}  // namespace tetap::nav
