// SPDX-License-Identifier: Apache-2.0
// Several estimates of one quantity made into one, without any motion between them.
//   * Inverse variance: the best linear estimate when errors are independent (Bar-Shalom, Li, Kirubarajan 2001, ch. 3).
//   * Covariance intersection: never too sure, whatever the correlation (Julier & Uhlmann 1997).
//   * Split covariance intersection: errors have a part known to be independent (Julier & Uhlmann 2001, Handbook of
//     Multisensor Data Fusion, ch. 12).
#pragma once

#include "tetap/filter/inverse.hpp"

#include <limits>
#include <span>

namespace tetap::filter {

template <class Scalar_, int N>
struct Estimate {
  using Scalar = Scalar_;
  Vector<Scalar, N> x = Vector<Scalar, N>::Zero();
  Symmetric<Scalar, N> p;
};

/// The error is the sum of one part that may be correlated with anything and one that is correlated with nothing.
template <class Scalar_, int N>
struct SplitEstimate {
  using Scalar = Scalar_;
  Vector<Scalar, N> x = Vector<Scalar, N>::Zero();
  Symmetric<Scalar, N> correlated;
  Symmetric<Scalar, N> independent;

  [[nodiscard]] Symmetric<Scalar, N> total() const { return sum(correlated, independent); }

 private:
  static Symmetric<Scalar, N> sum(Symmetric<Scalar, N> a, const Symmetric<Scalar, N>& b) {
    for (int c = 0; c < N; ++c)
      for (int r = 0; r <= c; ++r) a(r, c) += b(r, c);
    return a;
  }
};

/// `valid` is false, and `estimate` means nothing, when a covariance was not positive definite, a value no number, or
/// there was none.
template <class Estimate_>
struct Fusion {
  Estimate_ estimate;
  typename Estimate_::Scalar omega{};  ///< weight of the first estimate's information; 0 where none is chosen
  bool valid = false;
};

/// Information P^-1 and P^-1 x, summed up.
template <class Scalar, int N>
class InformationSum {
 public:
  void add(const Estimate<Scalar, N>& e, Scalar weight) {
    const Inverse<Scalar, N> inverse = inverse_of(e.p);
    positive_ = positive_ && inverse.positive;
    for (int c = 0; c < N; ++c)
      for (int r = 0; r <= c; ++r) information_(r, c) += weight * inverse.value(r, c);
    vector_ += weight * inverse.value.dense().lazyProduct(e.x);
  }
  [[nodiscard]] Fusion<Estimate<Scalar, N>> fused(Scalar omega = 0) const {
    const Inverse<Scalar, N> p = inverse_of(information_);
    const Vector<Scalar, N> x = p.value.dense().lazyProduct(vector_);
    bool finite = true;  // the difference of infinity or NaN from itself is no number
    for (int n = 0; n < N; ++n) finite = finite && x(n) - x(n) <= Scalar{0};
    return {.estimate = {.x = x, .p = p.value}, .omega = omega, .valid = positive_ && p.positive && finite};
  }

 private:
  Symmetric<Scalar, N> information_;
  Vector<Scalar, N> vector_ = Vector<Scalar, N>::Zero();
  bool positive_ = true;
};

/// Implements docs/explanation/static_fusion.md (1).
/// P^-1 = sum P_i^-1. Right only for independent errors; with any other it is too sure.
template <class Scalar, int N>
[[nodiscard]] Fusion<Estimate<Scalar, N>> inverse_variance(std::span<const Estimate<Scalar, N>> estimates) {
  InformationSum<Scalar, N> sum;
  for (const Estimate<Scalar, N>& e : estimates) sum.add(e, Scalar{1});
  return sum.fused();
}

/// Implements docs/explanation/static_fusion.md (3).
/// The least of a convex function on [0, 1]: golden section in 24 steps, to 1e-5 (Kiefer 1953). Where both probes are
/// equal to rounding the minimum lies between them, so both sides are cut, and a flat function gives its middle.
template <class Scalar, class Function>
[[nodiscard]] Scalar golden_section(const Function& cost) {
  constexpr auto kShare = static_cast<Scalar>(0.6180339887498949);
  constexpr auto kRounding = 8 * std::numeric_limits<Scalar>::epsilon();
  constexpr int kSteps = 24;
  Scalar low = 0, high = 1, left = 0, right = 0, at_left = 0, at_right = 0;
  const auto probe_left = [&] { left = high - kShare * (high - low), at_left = cost(left); };
  const auto probe_right = [&] { right = low + kShare * (high - low), at_right = cost(right); };
  probe_left();
  probe_right();
  for (int i = 0; i < kSteps; ++i) {
    const Scalar rise = at_right - at_left;
    const Scalar rounding = kRounding * (Scalar{1} + (at_left < Scalar{0} ? -at_left : at_left));
    if (rise <= rounding && rise >= -rounding) {
      low = left;
      high = right;
      i += 2;  // what is left is the cube of kShare
      probe_left();
      probe_right();
    } else if (rise > Scalar{0}) {
      high = right;
      right = left;
      at_right = at_left;
      probe_left();
    } else {
      low = left;
      left = right;
      at_left = at_right;
      probe_right();
    }
  }
  return Scalar(0.5F) * (low + high);
}

/// Implements docs/explanation/static_fusion.md (2).
/// P^-1 = omega A^-1 + (1 - omega) B^-1, omega for the least determinant of P; equal covariances give the mean.
template <class Scalar, int N>
[[nodiscard]] Fusion<Estimate<Scalar, N>> covariance_intersection(const Estimate<Scalar, N>& a,
                                                                  const Estimate<Scalar, N>& b) {
  const Inverse<Scalar, N> of_a = inverse_of(a.p), of_b = inverse_of(b.p);
  if (!of_a.positive || !of_b.positive) return {};
  const Scalar omega = golden_section<Scalar>([&](Scalar w) {
    Symmetric<Scalar, N> information;
    for (int c = 0; c < N; ++c)
      for (int r = 0; r <= c; ++r)  // the same for every w where both are equal, without rounding
        information(r, c) = of_b.value(r, c) + w * (of_a.value(r, c) - of_b.value(r, c));
    return -log_determinant(information);
  });
  InformationSum<Scalar, N> sum;
  sum.add(a, omega);
  sum.add(b, Scalar{1} - omega);
  return sum.fused(omega);
}

namespace detail {

/// Implements docs/explanation/static_fusion.md (4).
/// correlated / weight + independent.
template <class Scalar, int N>
[[nodiscard]] Symmetric<Scalar, N> widened(const SplitEstimate<Scalar, N>& e, Scalar weight) {
  Symmetric<Scalar, N> p;
  for (int c = 0; c < N; ++c)
    for (int r = 0; r <= c; ++r) p(r, c) = e.correlated(r, c) / weight + e.independent(r, c);
  return p;
}

/// K P K^T, added to `to`.
template <class Scalar, int N>
void add_turned(Symmetric<Scalar, N>& to, const Matrix<Scalar, N, N>& k, const Symmetric<Scalar, N>& p) {
  to = filter::propagate(p, k, to);
}

}  // namespace detail

/// Implements docs/explanation/static_fusion.md (5).
/// Correlated parts are widened by 1 / omega and 1 / (1 - omega), independent parts are not; omega for the least
/// determinant. With no independent parts this is covariance_intersection(), with no correlated ones
/// inverse_variance().
template <class Scalar, int N>
[[nodiscard]] Fusion<SplitEstimate<Scalar, N>> split_covariance_intersection(const SplitEstimate<Scalar, N>& a,
                                                                             const SplitEstimate<Scalar, N>& b) {
  // The ends divide by zero; beyond a share of 1e-4 the widened part counts for nothing.
  const auto inside = [](Scalar w) { return Scalar(1e-4F) + w * Scalar(0.9998F); };
  const auto fused_at = [&](Scalar w) {
    InformationSum<Scalar, N> sum;
    sum.add({.x = a.x, .p = detail::widened(a, w)}, Scalar{1});
    sum.add({.x = b.x, .p = detail::widened(b, Scalar{1} - w)}, Scalar{1});
    return sum.fused(w);
  };
  const Scalar omega =
      inside(golden_section<Scalar>([&](Scalar w) { return log_determinant(fused_at(inside(w)).estimate.p); }));
  const auto whole = fused_at(omega);
  Fusion<SplitEstimate<Scalar, N>> out{.estimate = {.x = whole.estimate.x}, .omega = omega, .valid = whole.valid};
  if (!out.valid) return out;
  // x = K a + L b; independent parts go through those gains, the rest of P is correlated.
  const Matrix<Scalar, N, N> p = whole.estimate.p.dense();
  const Matrix<Scalar, N, N> k = p.lazyProduct(inverse_of(detail::widened(a, omega)).value.dense());
  const Matrix<Scalar, N, N> l = p.lazyProduct(inverse_of(detail::widened(b, Scalar{1} - omega)).value.dense());
  detail::add_turned(out.estimate.independent, k, a.independent);
  detail::add_turned(out.estimate.independent, l, b.independent);
  for (int c = 0; c < N; ++c)
    for (int r = 0; r <= c; ++r)
      out.estimate.correlated(r, c) = whole.estimate.p(r, c) - out.estimate.independent(r, c);
  return out;
}

}  // namespace tetap::filter
