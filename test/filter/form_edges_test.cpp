// SPDX-License-Identifier: Apache-2.0
// What each form of the Kalman filter does at its edge, in float: sharp sensors, R = 0, values that are no number. The
// judge of P is the textbook in double. docs/explanation/kalman_forms.md holds the table that this test makes.
#include "filter/kalman_forms.hpp"
#include "support/filter_covariance.hpp"
#include "support/least_eigenvalue.hpp"
#include "tetap/filter/linear_models.hpp"

#include <gtest/gtest.h>
#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <string>

namespace tetap {
namespace {

using filter::Symmetric;
using filter::Vector;
using filter::VectorState;
using filter::Verdict;
using Place = filter::DirectMeasurement<float, 4, 0, 1>;  // x and y of x, y, vx, vy

/// Constant velocity: 0.1 s, white acceleration of 0.5 m/s2.
filter::LinearMotion<float, 4> motion() {
  constexpr float kT = 0.1F, kQ = 0.25F;
  filter::LinearMotion<float, 4> m;
  m.f(0, 2) = m.f(1, 3) = kT;
  for (int i = 0; i < 2; ++i) {
    m.q(i, i) = kQ * kT * kT * kT / 3;
    m.q(i, i + 2) = kQ * kT * kT / 2;
    m.q(i + 2, i + 2) = kQ * kT;
  }
  return m;
}

/// One step of (I - K H) P (I - K H)^T + K R K^T in double.
void textbook(Eigen::Matrix4d& p, double r) {
  const Eigen::Matrix4d f = motion().f.cast<double>(), q = motion().q.dense().cast<double>();
  Eigen::Matrix<double, 2, 4> h = Eigen::Matrix<double, 2, 4>::Identity();
  p = (f * p * f.transpose() + q).eval();
  const Eigen::Matrix2d s = h * p * h.transpose() + r * Eigen::Matrix2d::Identity();
  const Eigen::Matrix<double, 4, 2> k = p * h.transpose() * s.inverse();
  const Eigen::Matrix4d left = Eigen::Matrix4d::Identity() - k * h;
  p = (left * p * left.transpose() + r * k * k.transpose()).eval();
}

struct Sharpness {
  int positive = 0, honest = 0;  ///< decades of P/R up to which P is positive definite, sigmas above half of double's
  double after = 0;              ///< largest sigma over double's after the first 50 of 2000 steps
};

/// From rest with P = 1e6 m2 down to R = 1e-6 m2, 2000 steps each.
template <class Filter>
Sharpness sharpness() {
  Sharpness found{.positive = 12, .honest = 12};
  for (int decade = 2; decade <= 12; decade += 2) {
    const float p0 = decade < 8 ? 1e2F : 1e6F, r = p0 * std::pow(10.0F, -static_cast<float>(decade));
    Filter kf;
    const auto start = Symmetric<float, 4>::diagonal({p0, p0, p0 / 25, p0 / 25});
    set_covariance<Filter, 4>(kf, start);
    Eigen::Matrix4d reference = start.dense().template cast<double>();
    bool positive = true, honest = true;
    for (int k = 0; k < 2000; ++k) {
      static_cast<void>(kf.predict(motion()));
      static_cast<void>(kf.update(Place{.z = {0.0F, 0.0F}, .variance = {r, r}}, 1e9F));
      textbook(reference, static_cast<double>(r));
      const auto p = covariance(kf);
      positive = positive && test::least_eigenvalue(p) > 0;
      for (int i = 0; i < 4; ++i) {
        const double ratio = std::sqrt(static_cast<double>(p(i, i)) / reference(i, i));
        honest = honest && ratio > 0.5;
        if (k >= 50) found.after = std::max(found.after, ratio);
      }
    }
    if (!positive) found.positive = std::min(found.positive, decade - 2);
    if (!honest) found.honest = std::min(found.honest, decade - 2);
  }
  return found;
}

const char* word(Verdict verdict) {
  switch (verdict) {
    case Verdict::kAccepted:
      return "accepted";
    case Verdict::kRejected:
      return "rejected";
    case Verdict::kSingular:
      return "singular";
    case Verdict::kNotFinite:
      break;
  }
  return "not finite";
}

template <class Filter>
Filter at_rest() {
  Filter kf;
  set_covariance<Filter, 4>(kf, Symmetric<float, 4>::diagonal({4, 4, 1, 1}));
  static_cast<void>(kf.predict(motion()));
  return kf;
}
template <class Filter>
std::string word_of(Filter kf, const Place& z) {
  return word(kf.update(z, 1e9F).verdict);
}
/// The word, and whether P is positive definite after it.
template <class Filter, class Measurement>
std::string fate(Filter& kf, const Measurement& z) {
  const std::string said = word(kf.update(z, 1e9F).verdict);
  return said + (test::least_eigenvalue(covariance(kf)) > 0 ? "" : ", P singular");
}

template <class Form>
std::string row() {
  using Filter = typename Form::template Of<VectorState<float, 4>>;
  const Sharpness sharp = sharpness<Filter>();
  Filter exact = at_rest<Filter>(), twice = at_rest<Filter>();
  const std::string first = fate(exact, Place{.z = {0.1F, 0.2F}, .variance = {0, 0}});
  const std::string again = fate(exact, Place{.z = {0.1F, 0.2F}, .variance = {0, 0}});
  // Two sensors of one state in one measurement, a millionth of a millionth of its variance.
  filter::LinearMeasurement<float, 4, 2> both{.z = {0.1F, 0.1F}, .variance = {4e-12F, 4e-12F}};
  both.h.setZero();
  both.h(0, 0) = both.h(1, 0) = 1;
  const std::string equal = fate(twice, both);
  const Filter kf = at_rest<Filter>();
  const std::string nan = word_of(kf, Place{.z = {base::kNan, 0}, .variance = {1, 1}});
  const std::string infinite = word_of(kf, Place{.z = {base::kInfinity, 0}, .variance = {1, 1}});
  const std::string nan_r = word_of(kf, Place{.z = {0, 0}, .variance = {base::kNan, 1}});
  const std::string infinite_r = word_of(kf, Place{.z = {0, 0}, .variance = {base::kInfinity, 1}});
  std::printf("%s: largest sigma after 50 steps %.3f of double's\n", Form::kName, sharp.after);
  const auto decades = [](int n) { return n == 0 ? std::string("below 1e2") : "1e" + std::to_string(n); };
  const auto& all_said = std::array{nan, infinite, nan_r, infinite_r};
  for (const std::string& said : all_said) EXPECT_EQ(said, "not finite") << Form::kName;
  return std::string("| `") + Form::kName + "` | " + decades(sharp.positive) + " | " + decades(sharp.honest) + " | " +
         first + " | " + again + " | " + equal + " | " + nan + " |";
}

template <class... Form>
std::string table(testing::Types<Form...>) {
  return (... + (row<Form>() + "\n"));
}

TEST(FormEdges, AreThoseOfTheTableInTheDocs) {
  const std::string made = table(test::Forms{});
  std::ifstream file(TETAP_SOURCE "/docs/explanation/kalman_forms.md");
  const std::string page{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  EXPECT_NE(page.find(made), std::string::npos) << "docs/explanation/kalman_forms.md lacks these rows:\n" << made;
}

template <class Form>
class FactoredForm : public testing::Test {};
using Factored =
    testing::Types<test::JosephForm, test::SequentialForm, test::UdForm, test::SquareRootForm, test::UnscentedRootForm>;
TYPED_TEST_SUITE(FactoredForm, Factored);

TYPED_TEST(FactoredForm, StaysPositiveAndIsNeverTooSureUpToAMillionMillion) {
  const Sharpness sharp = sharpness<typename TypeParam::template Of<VectorState<float, 4>>>();
  EXPECT_EQ(sharp.positive, 12);
  EXPECT_EQ(sharp.honest, 12);
  EXPECT_LT(sharp.after, 1.1);
}

}  // namespace
}  // namespace tetap
