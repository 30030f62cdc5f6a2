// SPDX-License-Identifier: Apache-2.0
// Sums, means and covariances of a few quantities over a log of any length.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace tetap::doctor {

template <std::size_t N>
class Moments {
 public:
  void add(const std::array<double, N>& x, double weight = 1) {
    count_ += weight;
    for (std::size_t i = 0; i < N; ++i) {
      sum_[i] += weight * x[i];
      for (std::size_t j = 0; j < N; ++j) products_[i][j] += weight * x[i] * x[j];
    }
  }
  [[nodiscard]] double count() const { return count_; }
  [[nodiscard]] double mean(std::size_t i) const { return count_ > 0 ? sum_[i] / count_ : 0; }
  /// Mean product about zero.
  [[nodiscard]] double product(std::size_t i, std::size_t j) const { return count_ > 0 ? products_[i][j] / count_ : 0; }
  /// Mean product of the combinations a and b of the quantities.
  [[nodiscard]] double product(const std::array<double, N>& a, const std::array<double, N>& b) const {
    double sum = 0;
    for (std::size_t i = 0; i < N; ++i)
      for (std::size_t j = 0; j < N; ++j) sum += a[i] * b[j] * product(i, j);
    return sum;
  }
  [[nodiscard]] double covariance(std::size_t i, std::size_t j) const { return product(i, j) - mean(i) * mean(j); }
  /// Covariance of the combinations a and b of the quantities.
  [[nodiscard]] double covariance(const std::array<double, N>& a, const std::array<double, N>& b) const {
    double sum = 0;
    for (std::size_t i = 0; i < N; ++i)
      for (std::size_t j = 0; j < N; ++j) sum += a[i] * b[j] * covariance(i, j);
    return sum;
  }

 private:
  double count_ = 0;
  std::array<double, N> sum_{};
  std::array<std::array<double, N>, N> products_{};
};

/// Correlation from a covariance and two variances; 0 where one does not vary.
[[nodiscard]] inline double correlation(double covariance, double one, double other) {
  return one > 0 && other > 0 ? covariance / std::sqrt(one * other) : 0;
}

}  // namespace tetap::doctor
