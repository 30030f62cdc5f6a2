// SPDX-License-Identifier: Apache-2.0
// A Kalman filter over N points of the plane, each one complex number (real = x, imaginary = y). It is for errors
// without a preferred direction: the covariance E[x x^H] is Hermitian, and turning the whole plane changes nothing.
// They are proper complex variables (Schreier & Scharf 2010, "Statistical Signal Processing of Complex-Valued Data",
// sec. 2.2 and 5.3). Loops stay loops: the filter runs ten times a second, and code is what is short.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/base/members.hpp"

#include <array>

namespace tetap::nav {

struct Complex {
  float re = 0, im = 0;

  friend constexpr Complex operator+(Complex a, Complex b) { return {a.re + b.re, a.im + b.im}; }
  friend constexpr Complex operator-(Complex a, Complex b) { return {a.re - b.re, a.im - b.im}; }
  friend constexpr Complex operator*(Complex a, Complex b) {
    return {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
  }
  friend constexpr Complex operator*(Complex a, float s) { return {a.re * s, a.im * s}; }
  [[nodiscard]] constexpr Complex conjugate() const { return {re, -im}; }
  [[nodiscard]] constexpr float norm2() const { return re * re + im * im; }
};

template <int N>
class ComplexKalman {
 public:
  enum class Verdict : std::uint8_t { kAccepted, kRefused, kSingular };

  [[nodiscard]] Complex value(int i) const { return x_[at(i)]; }
  /// E|error|^2: both axes together.
  [[nodiscard]] float variance(int i) const { return own_[at(i)]; }
  [[nodiscard, gnu::noinline]] Complex covariance(int r, int c) const {
    if (r == c) return {own_[at(r)], 0.0F};
    return r < c ? pair_[packed(r, c)] : pair_[packed(c, r)].conjugate();
  }

  /// All zero, and known to be.
  void clear() {
    x_.fill({});
    own_.fill(0.0F);
    pair_.fill({});
  }
  /// x_i begins anew, uncorrelated.
  [[gnu::noinline]] void set(int i, Complex value, float variance) {
    x_[at(i)] = value;
    for (int k = 0; k < N; ++k)
      if (k != i) put(i, k, {});
    own_[at(i)] = variance;
  }
  /// x_i += c x_j, i != j: any F is a few of these.
  [[gnu::noinline]] void add(int i, Complex c, int j) {
    const Row of_j = row(j);
    x_[at(i)] = x_[at(i)] + c * x_[at(j)];
    own_[at(i)] += 2.0F * (c * of_j[at(i)]).re + c.norm2() * own_[at(j)];
    Complex* pair = &pair_[packed(0, i)];
    for (int k = 0; k < i; ++k, ++pair) *pair = *pair + (c * of_j[at(k)]).conjugate();
    for (int k = i + 1; k < N; pair += k, ++k) pair[i] = pair[i] + c * of_j[at(k)];
  }
  /// x_i *= c.
  [[gnu::noinline]] void scale(int i, float c) {
    x_[at(i)] = x_[at(i)] * c;
    own_[at(i)] *= c * c;
    Complex* pair = &pair_[packed(0, i)];
    for (int k = 0; k < i; ++k, ++pair) *pair = *pair * c;
    for (int k = i + 1; k < N; pair += k, ++k) pair[i] = pair[i] * c;
  }
  void add_noise(int i, float variance) { own_[at(i)] += variance; }
  /// Noise of this variance along a direction: x += n direction.
  [[gnu::noinline]] void spread(const std::array<Complex, N>& direction, float variance) {
    auto pair = pair_.begin();
    for (int c = 0; c < N; ++c) {
      const Complex much = (direction[at(c)] * variance).conjugate();
      for (int r = 0; r < c; ++r, ++pair) *pair = *pair + direction[at(r)] * much;
      own_[at(c)] += variance * direction[at(c)].norm2();
    }
  }
  void shift(int i, Complex by) { x_[at(i)] = x_[at(i)] + by; }

  /// A measurement z = x_i + c x_j + noise (i != j), E|noise|^2 = r. Refused above the gate on 2 |nu|^2 / S, a
  /// chi-square of two degrees.
  [[nodiscard, gnu::noinline]] Verdict update(int i, Complex c, int j, Complex z, float r, float gate) {
    Row hp = row(i);  // H P
    const Row of_j = row(j);
    for (int k = 0; k < N; ++k) hp[at(k)] = hp[at(k)] + c * of_j[at(k)];
    const float s = hp[at(i)].re + (c.conjugate() * hp[at(j)]).re + r;
    if (!(s > 0.0F && s < 1e12F)) return Verdict::kSingular;
    const Complex nu = z - x_[at(i)] - c * x_[at(j)];
    if (!(2.0F * nu.norm2() <= gate * s)) return Verdict::kRefused;
    const float inverse = 1.0F / s;
    bool positive = true;
    auto pair = pair_.begin();
    for (int k = 0; k < N; ++k) {
      const Complex gain = hp[at(k)].conjugate() * inverse;
      x_[at(k)] = x_[at(k)] + gain * nu;
      own_[at(k)] -= gain.re * hp[at(k)].re - gain.im * hp[at(k)].im;
      positive = positive && own_[at(k)] >= 0.0F;
      const Complex column = hp[at(k)] * inverse;
      for (int l = 0; l < k; ++l, ++pair) *pair = *pair - hp[at(l)].conjugate() * column;
    }
    return positive ? Verdict::kAccepted : Verdict::kSingular;
  }

  static constexpr auto members(auto& self) {
    return base::members(base::in_turns(self.x_), base::in_turns(self.own_), base::in_turns(self.pair_));
  }

 private:
  using Row = std::array<Complex, N>;

  /// E[x_j x_k^*] for every k.
  [[nodiscard, gnu::noinline]] Row row(int j) const {
    Row result;
    const Complex* pair = &pair_[packed(0, j)];
    for (int k = 0; k < j; ++k, ++pair) result[at(k)] = pair->conjugate();
    result[at(j)] = {own_[at(j)], 0.0F};
    for (int k = j + 1; k < N; pair += k, ++k) result[at(k)] = pair[j];
    return result;
  }
  static constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }
  static constexpr std::size_t packed(int r, int c) { return at(c * (c - 1) / 2 + r); }
  [[gnu::noinline]] void put(int r, int c, Complex value) {
    if (r < c) {
      pair_[packed(r, c)] = value;
    } else {
      pair_[packed(c, r)] = value.conjugate();
    }
  }

  std::array<Complex, N> x_{};
  std::array<float, N> own_{};                     ///< the diagonal, real
  std::array<Complex, (N * (N - 1)) / 2> pair_{};  ///< above it
};

}  // namespace tetap::nav
