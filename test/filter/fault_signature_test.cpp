// SPDX-License-Identifier: Apache-2.0
// A filter with a fault's signature against one least-squares problem over the whole record in double, which has the
// start, every noise and the fault as unknowns. Then the laws of size and evidence over many records.
#include "tetap/filter/fault_signature.hpp"
#include "tetap/filter/sparse_update.hpp"

#include <gtest/gtest.h>
#include <Eigen/Dense>
#include <cmath>
#include <random>
#include <vector>

namespace tetap {
namespace {

constexpr int kN = 4, kM = 2, kSteps = 30;
using Signature = filter::FaultSignature<float, kN>;
using Big = Eigen::MatrixXd;

/// All four states are seen; only its list of touched states is needed.
struct Seen {
  static constexpr int kDimension = kM;
  static constexpr std::array<int, kN> kTouches{0, 1, 2, 3};
};

struct Fault {
  int onset = 0, jumps = -1;
  bool grows = false, direct = false;
};

struct System {
  std::vector<Big> f, h, gamma, d;
  std::mt19937 random;
  explicit System(unsigned seed) : random(seed) {
    for (int k = 0; k < kSteps; ++k) {
      f.push_back(Big::Identity(kN, kN) + 0.15 * drawn(kN, kN));
      h.push_back(drawn(kM, kN));
      gamma.push_back(0.2 * drawn(kN, 1));
      d.push_back(drawn(kM, 1));
    }
  }
  Big drawn(int rows, int columns) {
    std::normal_distribution<double> normal;
    return Big::NullaryExpr(rows, columns, [&] { return normal(random); });
  }
};
constexpr double kStart = 0.5, kNoise = 0.015625, kMeasured = 0.125, kLargest = 3;  // variances; 1 sigma of the size

/// Measurements of a record with a fault of this size.
std::vector<Big> record(System& system, const Fault& fault, double size) {
  std::vector<Big> z;
  Big x = std::sqrt(kStart) * system.drawn(kN, 1);
  for (int k = 0; k < kSteps; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const bool lasts = k >= fault.onset;
    x = system.f[i] * x + std::sqrt(kNoise) * system.drawn(kN, 1);
    if (lasts && fault.grows) x += system.gamma[i] * size;
    if (k == fault.onset && fault.jumps >= 0) x(fault.jumps) += size;
    z.push_back(system.h[i] * x + std::sqrt(kMeasured) * system.drawn(kM, 1));
    if (lasts && fault.direct) z.back() += system.d[i] * size;
  }
  return z;
}

/// Mean and covariance of the last state and the fault's size.
struct Posterior {
  Big mean, covariance;
};
Posterior least_squares(const System& system, const Fault& fault, const std::vector<Big>& z) {
  const int own = kN * (kSteps + 1), count = own + 1;  // start, noises; size
  Big state = Big::Zero(kN, count), size = Big::Zero(1, count), information = Big::Zero(count, count);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(count);
  state.leftCols(kN).setIdentity();
  for (int i = 0; i < own; ++i) information(i, i) = 1 / (i < kN ? kStart : kNoise);
  information(own, own) = 1 / (kLargest * kLargest);
  for (int k = 0; k < kSteps; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const bool lasts = k >= fault.onset;
    if (k == fault.onset) size(0, own) = 1;
    state = (system.f[i] * state).eval();
    state.block(0, kN * (k + 1), kN, kN).setIdentity();
    if (lasts && fault.grows) state += system.gamma[i] * size;
    if (k == fault.onset && fault.jumps >= 0) state.row(fault.jumps) += size;
    Big row = system.h[i] * state;
    if (lasts && fault.direct) row += system.d[i] * size;
    information += row.transpose() * row / kMeasured;
    right += row.transpose() * z[i] / kMeasured;
  }
  Big wanted(kN + 1, count);
  wanted << state, size;
  const Eigen::LDLT<Big> factor(information);
  return {wanted * factor.solve(right), wanted * factor.solve(wanted.transpose())};
}

struct Filtered {
  filter::Vector<float, kN> x = filter::Vector<float, kN>::Zero();
  filter::Symmetric<float, kN> p;
  Signature signature;
};
struct Watch {
  Signature* signature;
  std::array<float, kM> w;
  void innovation(const auto& l, const auto& y, const auto&) {
    filter::whiten(l, w);
    signature->score(w, std::array<float, kM>{y(0), y(1)});
  }
  void gains(const auto& g) { filter::correct(signature, std::array<std::array<float, kM>, 1>{w}, g); }
};

/// The filter knows nothing of the fault.
Filtered filtered(const System& system, const Fault& fault, const std::vector<Big>& z) {
  Filtered it;
  it.p = filter::Symmetric<float, kN>::diagonal({float{kStart}, float{kStart}, float{kStart}, float{kStart}});
  it.signature.begin(-1, float{kLargest});
  const auto q = filter::Symmetric<float, kN>::diagonal({float{kNoise}, float{kNoise}, float{kNoise}, float{kNoise}});
  for (int k = 0; k < kSteps; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const Eigen::Matrix4f f = system.f[i].cast<float>();
    const filter::Matrix<float, kM, kN> h = system.h[i].cast<float>();
    const bool lasts = k >= fault.onset;
    it.x = (f * it.x).eval();
    it.p = filter::propagate(it.p, filter::Matrix<float, kN, kN>(f), q);
    Eigen::Map<Eigen::Vector4f> phi(it.signature.phi.data());
    phi = (f * phi).eval();
    if (lasts && fault.grows) phi += system.gamma[i].cast<float>();
    if (k == fault.onset) {
      if (fault.jumps >= 0)
        it.signature.begin(fault.jumps, float{kLargest});
      else if (fault.grows)
        it.signature.information = 1.0F / float{kLargest * kLargest};
    }
    Watch watch{&it.signature, {}};
    const filter::Vector<float, kM> nu = z[i].cast<float>() - h * it.x;
    for (int m = 0; m < kM; ++m) {
      const float direct = lasts && fault.direct ? static_cast<float>(system.d[i](m)) : 0.0F;
      watch.w[static_cast<std::size_t>(m)] = h.row(m).dot(phi) + direct;
    }
    filter::SparseUpdate<float, kN, kM> result;
    const filter::Vector<float, kM> noise{float{kMeasured}, float{kMeasured}};
    filter::sparse_update<Seen>(it.p, h, nu, noise, 1e9F, result, watch);
    it.x += result.dx;
  }
  return it;
}

void expect_same(const Filtered& it, const Posterior& judge, double share) {
  const Eigen::Map<const Eigen::Vector4f> phi(it.signature.phi.data());
  const Eigen::VectorXd phi_d = phi.cast<double>();
  const double variance = static_cast<double>(it.signature.variance()), size = static_cast<double>(it.signature.size());
  const Eigen::VectorXd x = it.x.cast<double>() + phi_d * size;
  const Big p = it.p.dense().cast<double>() + phi_d * phi_d.transpose() * variance;
  Eigen::VectorXd sigma = judge.covariance.diagonal().cwiseSqrt();
  for (int i = 0; i < kN; ++i) {
    EXPECT_NEAR(x(i), judge.mean(i), share * sigma(i));
    EXPECT_NEAR(phi_d(i) * variance, judge.covariance(i, kN), share * sigma(i) * sigma(kN));
    for (int j = 0; j < kN; ++j) EXPECT_NEAR(p(i, j), judge.covariance(i, j), share * sigma(i) * sigma(j));
  }
  EXPECT_NEAR(size, judge.mean(kN), share * sigma(kN));
  EXPECT_NEAR(variance, judge.covariance(kN, kN), share * sigma(kN) * sigma(kN));
}

const std::array<Fault, 4> kFaults{Fault{.onset = 9, .jumps = 2}, Fault{.onset = 0, .direct = true},
                                   Fault{.onset = 0, .grows = true}, Fault{.onset = 0, .grows = true, .direct = true}};

TEST(fault_signature, is_the_filter_that_has_the_fault_as_a_state) {
  for (const Fault& fault : kFaults)
    for (unsigned seed = 1; seed <= 5; ++seed) {
      System system(seed);
      const std::vector<Big> z = record(system, fault, 1.5);
      expect_same(filtered(system, fault, z), least_squares(system, fault, z), 1e-4);
    }
}

/// 200 records of one fault, read at one fixed time, whatever the signature says.
TEST(fault_signature, its_size_is_right_in_the_mean_and_its_evidence_chi_square) {
  constexpr int kSeeds = 200;
  for (const Fault& fault : kFaults) {
    double sum = 0, sum2 = 0, square = 0, nees = 0, variance = 0;
    for (unsigned seed = 1; seed <= kSeeds; ++seed) {
      System system(1);
      system.random.seed(1000 + seed);
      const Signature faulty = filtered(system, fault, record(system, fault, 1.5)).signature;
      const Signature clean = filtered(system, fault, record(system, fault, 0)).signature;
      // Without the prior's share, which draws a size towards 0.
      const double prior = 1 / (kLargest * kLargest), own = static_cast<double>(faulty.information) - prior;
      const double size = static_cast<double>(faulty.weighted) / own;
      sum += size;
      sum2 += size * size;
      variance = 1 / own;
      nees += (size - 1.5) * (size - 1.5) * own;
      square += static_cast<double>(clean.weighted * clean.weighted) / own;
    }
    EXPECT_NEAR(sum / kSeeds, 1.5, 3 * std::sqrt(variance / kSeeds));
    EXPECT_NEAR(sum2 / kSeeds - sum * sum / kSeeds / kSeeds, variance, 0.4 * variance);
    // Chi-square of 200 degrees of freedom: 99.9 % lie between these.
    EXPECT_GT(square, 137.0);
    EXPECT_LT(square, 275.0);
    EXPECT_GT(nees, 137.0);
    EXPECT_LT(nees, 275.0);
  }
}

TEST(fault_signature, its_evidence_is_the_ratio_of_two_densities) {
  // One measurement y ~ N(0, 1) or N(w f, 1) with f ~ N(0, 4): y ~ N(0, 1 + 4 w^2).
  for (const float y : {0.0F, 1.3F, -4.0F})
    for (const float w : {0.2F, 1.0F, 3.0F}) {
      filter::FaultSignature<float, 1> one;
      one.begin(-1, 2);
      one.score(std::array{w}, std::array{y});
      const double s = 1 + 4.0 * static_cast<double>(w) * static_cast<double>(w),
                   y2 = static_cast<double>(y) * static_cast<double>(y);
      EXPECT_NEAR(static_cast<double>(one.evidence(2)), y2 - y2 / s - std::log(s), 2e-5);
    }
}

}  // namespace
}  // namespace tetap
