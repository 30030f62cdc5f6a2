// SPDX-License-Identifier: Apache-2.0
// Quality of an estimator as numbers with intervals, over independent runs in a world that is its model. Bias, NEES,
// NIS, whiteness of the innovations, efficiency (Bar-Shalom, Li, Kirubarajan 2001, sec. 5.4 and 2.7). Each check is a
// set of tests at once; its interval is that of 99 % for the whole set (Bonferroni).
#pragma once

#include "support/consistency.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <ostream>
#include <vector>

namespace tetap::test {

/// x with a share p of the standard normal below.
[[nodiscard]] inline double normal_quantile(double p) {
  double low = -40, high = 40;
  for (int i = 0; i < 200; ++i) {
    const double middle = 0.5 * (low + high);
    (0.5 * std::erfc(-middle / std::sqrt(2.0)) < p ? low : high) = middle;
  }
  return low;
}

/// The normal quantile of a two-sided test, one of `tests` that fail together in 1 % of all cases.
[[nodiscard]] inline double corrected_quantile(double tests) { return -normal_quantile(0.005 / tests); }

/// The mean of `samples` chi-square variables, one of `tests` means.
[[nodiscard]] inline Interval corrected_mean_interval(int degrees, double samples, double tests) {
  const double q = corrected_quantile(tests), n = degrees * samples;
  return {chi_square_quantile(-q, n) / samples, chi_square_quantile(q, n) / samples};
}

/// Collects errors and innovations of `steps` steps in each of several runs.
template <int N, int M>
class Quality {
 public:
  using Error = Eigen::Matrix<double, N, 1>;
  using Covariance = Eigen::Matrix<double, N, N>;
  using Measured = Eigen::Matrix<double, M, 1>;
  using Innovations = Eigen::Matrix<double, M, M>;

  explicit Quality(int steps) : nees_(Eigen::VectorXd::Zero(steps)), nis_(Eigen::VectorXd::Zero(steps)) {}

  void begin_run() {
    ++runs_;
    mean_error_.push_back(Error::Zero());
    white_.clear();
  }
  void add(int step, const Error& error, const Covariance& p, const Measured& nu, const Innovations& s) {
    nees_(step) += error.dot(p.llt().solve(error));
    const Measured w = s.llt().matrixL().solve(nu);
    nis_(step) += w.squaredNorm();
    mean_error_.back() += error / static_cast<double>(nees_.size());
    for (int lag = 1; lag <= kLags && lag <= static_cast<int>(white_.size()); ++lag) {
      lagged_(lag - 1) += w.dot(white_[white_.size() - static_cast<std::size_t>(lag)]);
      ++pairs_(lag - 1);
    }
    white_.push_back(w);
    if (step == static_cast<int>(nees_.size()) - 1) final_error_.push_back(error);
  }

  /// Every component's mean over the runs of its mean over time.
  [[nodiscard]] bool unbiased() const {
    Error sum = Error::Zero(), squares = Error::Zero();
    for (const Error& e : mean_error_) sum += e, squares += e.cwiseProduct(e);
    const double n = runs_;
    for (int i = 0; i < N; ++i) {
      const double mean = sum(i) / n, deviation = std::sqrt((squares(i) / n - mean * mean) / (n - 1));
      if (!(std::abs(mean) <= corrected_quantile(N) * deviation)) return false;
    }
    return true;
  }
  [[nodiscard]] bool nees_consistent() const { return all_inside(nees_, N, static_cast<double>(nees_.size())); }
  [[nodiscard]] bool nis_consistent() const {
    // Innovations are independent over time too, so that the mean of all is a test far sharper than that of a step.
    const auto tests = static_cast<double>(nis_.size()) + 1;
    return all_inside(nis_, M, tests) &&
           corrected_mean_interval(M, runs_ * static_cast<double>(nis_.size()), tests).has(nis_.mean() / runs_);
  }
  /// Correlation of whitened innovations 1 to kLags steps apart.
  [[nodiscard]] bool white() const {
    for (int lag = 0; lag < kLags; ++lag) {
      const double correlation = lagged_(lag) / (M * pairs_(lag));
      if (!(std::abs(correlation) <= corrected_quantile(kLags) / std::sqrt(M * pairs_(lag)))) return false;
    }
    return true;
  }
  /// Mean square of the final error in units of a bound, the Cramer-Rao bound for one: 1 is efficient.
  [[nodiscard]] double final_error_over(const Covariance& bound) const {
    double sum = 0;
    for (const Error& e : final_error_) sum += e.dot(bound.llt().solve(e)) / N;
    return sum / static_cast<double>(final_error_.size());
  }
  [[nodiscard]] bool efficient(const Covariance& bound) const {
    return corrected_mean_interval(N, runs_, 1).has(N * final_error_over(bound));
  }
  [[nodiscard]] bool consistent() const { return unbiased() && nees_consistent() && nis_consistent() && white(); }

  friend std::ostream& operator<<(std::ostream& out, const Quality& q) {
    return out << "unbiased " << q.unbiased() << ", NEES " << q.nees_.mean() / q.runs_ << " of " << N << " ("
               << q.nees_consistent() << "), NIS " << q.nis_.mean() / q.runs_ << " of " << M << " ("
               << q.nis_consistent() << "), white " << q.white();
  }

 private:
  static constexpr int kLags = 5;

  [[nodiscard]] bool all_inside(const Eigen::VectorXd& sums, int degrees, double tests) const {
    const Interval interval = corrected_mean_interval(degrees, runs_, tests);
    for (const double sum : sums)
      if (!interval.has(sum / runs_)) return false;
    return true;
  }

  int runs_ = 0;
  Eigen::VectorXd nees_, nis_;
  std::vector<Error> mean_error_, final_error_;
  std::vector<Measured> white_;
  Eigen::Matrix<double, kLags, 1> lagged_ = Eigen::Matrix<double, kLags, 1>::Zero();
  Eigen::Matrix<double, kLags, 1> pairs_ = Eigen::Matrix<double, kLags, 1>::Zero();
};

}  // namespace tetap::test
