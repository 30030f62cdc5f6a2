// SPDX-License-Identifier: Apache-2.0
// P = F P F^T + Q of inertial navigation, and a last digit, by the structure of F. It is three shears in place on the
// packed upper half. Each adds a multiple of one group of errors to another. With dv = R (f - b_a) dt and B = -R dt:
//   p += dt v;  v += -[dv]x theta + B b_a;  theta += B b_g     (Sola 2017, sec. 7.3, global angular error)
// Terms in dt^2 are left out. Over T they are dt/T of what the same errors do through the velocity.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/base/multiply_add.hpp"
#include "tetap/filter/unroll.hpp"
#include "tetap/nav/ins_state.hpp"

#include <limits>

namespace tetap::nav {

/// One step or several added up; Q per axis and isotropic, so it needs no rotation.
template <class Scalar>
struct InsCovarianceStep {
  Scalar dt_s = 0;
  filter::Vector<Scalar, 3> dv_n_mps = filter::Vector<Scalar, 3>::Zero();
  filter::Matrix<Scalar, 3, 3> r_dt = filter::Matrix<Scalar, 3, 3>::Zero();  ///< sum of R_nb dt
  Scalar var_p = 0, var_v = 0, var_theta = 0, var_b_a = 0, var_b_g = 0;      ///< added per axis over the step
  Scalar var_yaw = 0;                                                        ///< about the vertical, besides
  Scalar keep_b_a = 1, keep_b_g = 1;  ///< rest of a bias after the step (Gauss-Markov); 1: random walk
};

namespace detail {

template <class Scalar>
using InsP = filter::Symmetric<Scalar, InsState::kErrors>;

/// The group at kTo gains a multiple of others. The function gain(to, r, j) adds its row r against error j, and reads
/// only rows of other groups.
template <int kTo, class Scalar, class Gain>
[[gnu::always_inline]] inline void shear(InsP<Scalar>& p, const Gain& gain) {
  using filter::unroll;
  unroll<0, 3>([&](auto c) __attribute__((always_inline)) {
    unroll<0, c + 1>([&](auto r) __attribute__((always_inline)) { gain(p(kTo + r, kTo + c), r, kTo + c); });
  });
  unroll<0, InsState::kErrors>([&](auto j) __attribute__((always_inline)) {
    if constexpr (j < kTo || j >= kTo + 3)
      unroll<0, 3>([&](auto r) __attribute__((always_inline)) { gain(p(kTo + r, j), r, j); });
  });
  unroll<0, 3>([&](auto c) __attribute__((always_inline)) {
    unroll<0, c + 1>([&](auto r) __attribute__((always_inline)) { gain(p(kTo + r, kTo + c), c, kTo + r); });
  });
}

}  // namespace detail

/// P = F P F^T + Q: docs/explanation/equations.md (8) to (11).
template <class Scalar>
inline void predict_covariance(filter::Symmetric<Scalar, InsState::kErrors>& p, const InsCovarianceStep<Scalar>& step) {
  constexpr int kV = InsState::kVelocity, kT = InsState::kAttitude, kA = InsState::kAccelBias, kG = InsState::kGyroBias;
  const filter::Matrix<Scalar, 3, 3> r_dt = step.r_dt;
  const filter::Vector<Scalar, 3> dv = step.dv_n_mps;
  const Scalar dt_s = step.dt_s;
  const auto turned = [&](int r, int from, int j) __attribute__((always_inline)) {  // row r of R dt times a group
    const Scalar two = base::add_product(Scalar{r_dt(r, 0) * p(from, j)}, Scalar{r_dt(r, 1)}, p(from + 1, j));
    return base::add_product(two, Scalar{r_dt(r, 2)}, p(from + 2, j));
  };
  detail::shear<InsState::kPosition>(
      p, [&](Scalar & to, int r, int j)
             __attribute__((always_inline)) { to = base::add_product(to, dt_s, p(kV + r, j)); });
  detail::shear<kV>(
      p, [&](Scalar & to, int r, int j) __attribute__((always_inline)) {
        const int a = r == 2 ? 0 : r + 1, b = r == 0 ? 2 : r - 1;  // theta x dv
        to += base::subtract_product(Scalar{p(kT + a, j) * dv(b)}, p(kT + b, j), Scalar{dv(a)}) - turned(r, kA, j);
      });
  detail::shear<kT>(
      p, [&](Scalar & to, int r, int j) __attribute__((always_inline)) { to -= turned(r, kG, j); });
  if (step.keep_b_a < Scalar{1} || step.keep_b_g < Scalar{1}) {
    for (int i = 0; i < 6; ++i) {
      const Scalar keep = i < 3 ? step.keep_b_a : step.keep_b_g;
      for (int j = 0; j < InsState::kErrors; ++j) p(kA + i, j) *= j == kA + i ? keep * keep : keep;
    }
  }
  // Rounding takes a part of a last digit from any direction at every step; a digit of every variance makes up for it.
  // At 100 steps a second what nothing observes gains 4 % of its variance in an hour, 2 % of its sigma.
  constexpr Scalar kDigit = Scalar{1} + std::numeric_limits<Scalar>::epsilon();
  filter::unroll<0, 3>([&](auto i) __attribute__((always_inline)) {
    const auto grow = [&p](int k, Scalar by) __attribute__((always_inline)) { p(k, k) = p(k, k) * kDigit + by; };
    grow(i, step.var_p);
    grow(kV + i, step.var_v);
    grow(kT + i, step.var_theta);
    grow(kA + i, step.var_b_a);
    grow(kG + i, step.var_b_g);
  });
  p(kT + 2, kT + 2) += step.var_yaw;
}

/// The largest standard deviations the filter keeps: beyond them it knows nothing, and float would overflow in the end.
inline constexpr std::array<float, 5> kInsMostSigma{1e6F, 1e4F, 4.0F, 10.0F, 1.0F};

/// The factor of P less a share of its diagonal, made element by element. It exists when no eigenvalue of the
/// correlations is below that share, the least that float separates from zero. No variance may be above its limit. A
/// copy is factored in place, so that the work can be spread over many steps.
class InsFactor {
 public:
  static constexpr float kShare = 4e-5F;
  enum class Progress : std::uint8_t { kBusy, kGood, kBad };

  void begin(const filter::Symmetric<float, InsState::kErrors>& p) {
    l_.copy_from(p);
    row_ = column_ = 0;
    pivot_ = p(0, 0) * (1.0F - kShare);
  }
  /// Some `terms` products of the sum (at most 13 more): some 100 instructions for 8.
  Progress advance(int terms) {
    while (terms > 0 && row_ < InsState::kErrors) {
      terms -= column_ + 3;
      if (column_ < row_) {
        float sum = l_(column_, row_);
        for (int k = 0; k < column_; ++k) sum = base::subtract_product(sum, l_(k, column_), l_(k, row_));
        sum *= l_(column_, column_);
        l_(column_, row_) = sum;
        pivot_ -= sum * sum;
        ++column_;
        continue;
      }
      const float most = kInsMostSigma[static_cast<std::size_t>(row_ / 3)];
      // Variances at their limit grow by a digit until the next round.
      if (!(pivot_ > 1e-7F * l_(row_, row_)) || l_(row_, row_) > 1.001F * most * most) return Progress::kBad;
      l_(row_, row_) = 1.0F / base::sqrt(pivot_);
      column_ = 0;
      if (++row_ < InsState::kErrors) pivot_ = l_(row_, row_) * (1.0F - kShare);
    }
    return row_ < InsState::kErrors ? Progress::kBusy : Progress::kGood;
  }
  [[nodiscard]] bool idle() const { return row_ >= InsState::kErrors; }
  void stop() { row_ = InsState::kErrors; }
  static constexpr auto members(auto& self) {
    return base::members(base::in_turns(self.l_), self.pivot_, self.row_, self.column_);
  }

 private:
  filter::Symmetric<float, InsState::kErrors> l_;  ///< the diagonal holds 1 / L_jj where it is done
  float pivot_ = 0;
  std::int32_t row_ = InsState::kErrors, column_ = 0;
};

/// Puts P back among the matrices that float can hold as positive definite, whatever it was. All correlations are made
/// smaller by a little, which adds that share to every conditional variance. The share grows if that is not enough, and
/// in the end takes all. Variances above kInsMostSigma are scaled back with their rows, which keeps every correlation.
/// True when P was fine as it was. `factor` is room to work in.
inline bool condition(filter::Symmetric<float, InsState::kErrors>& p, InsFactor& factor) {
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
  // Up to a second may pass until the watch has seen all of P. Each group takes on variance of the one that feeds it in
  // that time. With much less of its own it would end with none that float separates from rounding.
  constexpr float kOwn = 1e-6F, kGravity2 = 100.0F;
  for (int i = 0; i < 3; ++i) {
    const auto at_least = [&p](int of, float variance) {
      if (p(of, of) < variance) p(of, of) = variance;
    };
    at_least(InsState::kAttitude + i, kOwn * p(InsState::kGyroBias + i, InsState::kGyroBias + i));
    at_least(InsState::kVelocity + i, kOwn * p(InsState::kAccelBias + i, InsState::kAccelBias + i));
    for (int k = 0; k < 3; ++k)
      at_least(InsState::kVelocity + i, kOwn * kGravity2 * p(InsState::kAttitude + k, InsState::kAttitude + k));
    at_least(InsState::kPosition + i, kOwn * p(InsState::kVelocity + i, InsState::kVelocity + i));
  }
  for (const float share : {8e-5F, 8e-4F, 8e-3F, 0.08F, 0.2F, 1.0F}) {
    factor.begin(p);
    const bool good = factor.advance(1'000'000) == InsFactor::Progress::kGood;
    factor.stop();
    if (good) return fine;
    fine = false;
    for (int c = 0; c < kN; ++c)
      for (int r = 0; r < c; ++r) p(r, c) = share < 1.0F ? p(r, c) * (1.0F - share) : 0.0F;
  }
  return fine;
}

}  // namespace tetap::nav
