// SPDX-License-Identifier: Apache-2.0
// A Kalman filter over N points of the plane, each one complex number (real = x, imaginary = y), for errors without a
// preferred direction: the covariance E[x x^H] is Hermitian, and turning the whole plane changes nothing (proper
// complex variables: Schreier & Scharf 2010, "Statistical Signal Processing of Complex-Valued Data", sec. 2.2 and 5.3).
// Loops stay loops: it runs ten times a second, and code is what is short.
#pragma once

#include "base/math.hpp"

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
class PhasorFilter {
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
    x_[at(i)] = x_[at(i)] + c * x_[at(j)];
    const Complex ij = covariance(i, j);
    const float jj = own_[at(j)];
    own_[at(i)] += 2.0F * (c * ij.conjugate()).re + c.norm2() * jj;
    for (int k = 0; k < N; ++k)
      if (k != i) put(i, k, covariance(i, k) + c * covariance(j, k));
  }
  /// x_i *= c.
  [[gnu::noinline]] void scale(int i, float c) {
    x_[at(i)] = x_[at(i)] * c;
    own_[at(i)] *= c * c;
    for (int k = 0; k < N; ++k)
      if (k != i) put(i, k, covariance(i, k) * c);
  }
  void add_noise(int i, float variance) { own_[at(i)] += variance; }
  /// Noise of this variance along a direction: x += n direction.
  [[gnu::noinline]] void spread(const std::array<Complex, N>& direction, float variance) {
    for (int c = 0; c < N; ++c) {
      const Complex much = direction[at(c)] * variance;
      for (int r = 0; r < c; ++r) put(r, c, covariance(r, c) + direction[at(r)] * much.conjugate());
      own_[at(c)] += variance * direction[at(c)].norm2();
    }
  }
  void shift(int i, Complex by) { x_[at(i)] = x_[at(i)] + by; }

  /// A measurement z = x_i + c x_j + noise (i != j), E|noise|^2 = r. Refused above the gate on 2 |nu|^2 / S, a
  /// chi-square of two degrees.
  [[nodiscard, gnu::noinline]] Verdict update(int i, Complex c, int j, Complex z, float r, float gate) {
    std::array<Complex, N> ph{};  // P H^H
    for (int k = 0; k < N; ++k) ph[at(k)] = covariance(k, i) + covariance(k, j) * c.conjugate();
    const float s = ph[at(i)].re + (c * ph[at(j)]).re + r;
    if (!(s > 0.0F && s < 1e12F)) return Verdict::kSingular;
    const Complex nu = z - x_[at(i)] - c * x_[at(j)];
    if (!(2.0F * nu.norm2() <= gate * s)) return Verdict::kRefused;
    const float inverse = 1.0F / s;
    bool positive = true;
    for (int k = 0; k < N; ++k) {
      const Complex gain = ph[at(k)] * inverse;
      x_[at(k)] = x_[at(k)] + gain * nu;
      for (int l = k + 1; l < N; ++l) put(k, l, covariance(k, l) - gain * ph[at(l)].conjugate());
      own_[at(k)] -= gain.re * ph[at(k)].re + gain.im * ph[at(k)].im;
      positive = positive && own_[at(k)] >= 0.0F;
    }
    return positive ? Verdict::kAccepted : Verdict::kSingular;
  }

  template <class Sink>
  void each_bit(Sink&& sink) const {
    for (const Complex& value : x_) sink(value.re), sink(value.im);
    for (const float variance : own_) sink(variance);
    for (const Complex& value : pair_) sink(value.re), sink(value.im);
  }

 private:
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
