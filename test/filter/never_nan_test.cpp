// SPDX-License-Identifier: Apache-2.0
// Whatever a sensor says, the Kalman filters stay finite, their covariance stays positive definite (judge: eigenvalues
// in double), and the refusal is told.
#include "support/never_nan.hpp"
#include "tetap/estimators/planar/planar_ekf.hpp"
#include "tetap/filter/kalman.hpp"
#include "tetap/model/bearing.hpp"
#include "tetap/model/constant_velocity.hpp"
#include "tetap/model/gnss_position.hpp"
#include "tetap/model/range.hpp"
#include "tetap/model/range_bearing.hpp"
#include "tetap/model/unicycle.hpp"

#include <gtest/gtest.h>
#include <cmath>
#include <random>

namespace tetap {
namespace {

using filter::Verdict;
using test::Fields;
using test::kHostile;
using test::least_eigenvalue;

void add(Fields& f, model::Landmark& l, model::PlanarMounting& m) {
  f.insert(f.end(), {&l.x.offset_m, &l.y.offset_m, &m.x_b_m, &m.y_b_m, &m.yaw_rad});
}
Fields fields_of(model::RangeBearing& m) {
  Fields f{&m.range_m, &m.bearing_rad, &m.sigma_range_m, &m.sigma_bearing_rad};
  return add(f, m.landmark, m.mounting), f;
}
Fields fields_of(model::Range& m) {
  Fields f{&m.range_m, &m.sigma_range_m};
  add(f, m.landmark, m.mounting);
  return f.pop_back(), f;  // a range does not know how the sensor is turned
}
Fields fields_of(model::Bearing& m) {
  Fields f{&m.bearing_rad, &m.sigma_bearing_rad};
  return add(f, m.landmark, m.mounting), f;
}
Fields fields_of(model::GnssPosition& m) {
  return {&m.x.offset_m, &m.y.offset_m, &m.sigma_m, &m.antenna_x_b_m, &m.antenna_y_b_m};
}
Fields fields_of(model::PlanarIncrement& m) { return {&m.ds_m, &m.dyaw_rad, &m.var_ds, &m.cov_ds_dyaw, &m.var_dyaw}; }

bool same(const model::PlanarPose& a, const model::PlanarPose& b) {
  return a.x.um() == b.x.um() && a.y.um() == b.y.um() && base::bits(a.yaw_rad) == base::bits(b.yaw_rad);
}

class Normal {
 public:
  explicit Normal(unsigned seed) : random_(seed) {}
  double operator()() { return normal_(random_); }

 private:
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

estimators::PlanarEkf rolling() {
  estimators::PlanarEkf ekf;
  ekf.p = filter::Symmetric<float, 3>::diagonal({0.1F, 0.1F, 0.05F});
  EXPECT_TRUE(ekf.predict(model::PlanarIncrement{.ds_m = 1, .dyaw_rad = 0.1F, .var_ds = 1e-3F, .var_dyaw = 1e-3F}));
  return ekf;
}
template <class Model>
void break_every_field(const estimators::PlanarEkf& well, const Model& good) {
  test::break_every_field(
      well, good, [](Model& m) { return fields_of(m); }, [](const auto& a, const auto& b) { return same(a, b); });
}

TEST(NeverNan, EveryFieldOfEveryPlanarMeasurement) {
  const auto ekf = rolling();
  const model::Landmark landmark{.x = base::Anchored{}.plus(5), .y = base::Anchored{}.plus(2)};
  const model::PlanarMounting mounting{.x_b_m = 0.2F, .y_b_m = -0.1F, .yaw_rad = 0.3F};
  const model::Sight sight(ekf.x, landmark, mounting);
  const float range_m = sight.range_m(), bearing_rad = sight.bearing_rad(ekf.x, mounting);
  break_every_field(ekf, model::RangeBearing{.range_m = range_m,
                                             .bearing_rad = bearing_rad,
                                             .sigma_range_m = 0.1F,
                                             .sigma_bearing_rad = 0.02F,
                                             .landmark = landmark,
                                             .mounting = mounting});
  break_every_field(
      ekf, model::Range{.range_m = range_m, .sigma_range_m = 0.1F, .landmark = landmark, .mounting = mounting});
  break_every_field(
      ekf, model::Bearing{
               .bearing_rad = bearing_rad, .sigma_bearing_rad = 0.02F, .landmark = landmark, .mounting = mounting});
  break_every_field(
      ekf, model::GnssPosition{.x = ekf.x.x, .y = ekf.x.y, .sigma_m = 1, .antenna_x_b_m = 0.3F, .antenna_y_b_m = 0.1F});
}

TEST(NeverNan, AMotionThatIsNoneIsRefusedAndChangesNothing) {
  const auto well = rolling();
  const model::PlanarIncrement good{
      .ds_m = 0.1F, .dyaw_rad = 0.02F, .var_ds = 1e-3F, .cov_ds_dyaw = 1e-5F, .var_dyaw = 1e-3F};
  for (const model::Arc arc : {model::Arc::kExact, model::Arc::kMidpoint})
    for (std::size_t field = 0; field < 5; ++field)
      for (const float value : kHostile) {
        model::PlanarIncrement bad = good;
        bad.arc = arc;
        *fields_of(bad)[field] = value;
        auto ekf = well;
        SCOPED_TRACE(testing::Message() << "field " << field << " = " << value);
        const bool taken = ekf.predict(bad);
        const bool variance_below_zero = (field == 2 || field == 4) && value < -1.0F;
        if (!base::is_finite(value) || variance_below_zero) {
          EXPECT_FALSE(taken);
        }
        if (!taken) {
          EXPECT_TRUE(same(ekf.x, well.x));
          EXPECT_EQ(ekf.p.packed(), well.p.packed());
        }
        EXPECT_TRUE(ekf.x.finite());
        EXPECT_GT(least_eigenvalue(ekf.p), 0);
        EXPECT_TRUE(ekf.predict(good));
      }
}

TEST(NeverNan, EveryNumberOfALinearKalmanFilter) {
  using Motion = filter::LinearMotion<float, 2>;
  using Position = filter::DirectMeasurement<float, 2, 0>;
  filter::Kalman<float, 2> well;
  well.p = filter::Symmetric<float, 2>::diagonal({10, 10});
  Motion motion;
  motion.f << 1.0F, 0.1F, 0.0F, 1.0F;
  motion.q = filter::Symmetric<float, 2>::diagonal({1e-3F, 1e-3F});
  ASSERT_TRUE(well.predict(motion));
  const auto judged = [&](filter::Kalman<float, 2>& kf, bool taken, float value) {
    SCOPED_TRACE(value);
    if (!base::is_finite(value)) {
      EXPECT_FALSE(taken);
    }
    if (!taken) {
      EXPECT_EQ(kf.x.value, well.x.value);
      EXPECT_EQ(kf.p.packed(), well.p.packed());
    }
    EXPECT_TRUE(kf.x.value.allFinite());
    EXPECT_GT(least_eigenvalue(kf.p), 0);
  };
  for (const float value : kHostile) {
    for (int i = 0; i < 4; ++i) {
      Motion bad = motion;
      bad.f(i / 2, i % 2) = value;
      auto kf = well;
      judged(kf, kf.predict(bad), value);
    }
    for (const bool of_z : {true, false}) {
      Position bad{.z = Position{}.z.Constant(0.5F), .variance = Position{}.z.Constant(0.5F)};
      (of_z ? bad.z : bad.variance)(0) = value;
      if (!of_z && value < 0) continue;  // the variances of models are squares
      auto kf = well;
      judged(kf, kf.update(bad, 1e9F).verdict == Verdict::kAccepted, value);
    }
  }
}

/// A number that is not comparable is no gate.
TEST(NeverNan, AGateThatIsNoNumberLetsNothingThrough) {
  auto ekf = rolling();
  const auto p = ekf.p.packed();
  EXPECT_EQ(ekf.update(model::GnssPosition{.x = ekf.x.x, .y = ekf.x.y, .sigma_m = 1}, base::kNan).verdict,
            Verdict::kRejected);
  EXPECT_EQ(ekf.p.packed(), p);
}

TEST(NeverNan, ASingularInnovationIsCalledThatAndChangesNothing) {
  estimators::PlanarEkf ekf;  // knows everything
  EXPECT_EQ(ekf.update(model::GnssPosition{}, 1e9F).verdict, Verdict::kSingular);
  EXPECT_EQ(ekf.update(model::Bearing{.landmark = {.x = base::Anchored{}.plus(3)}}, 1e9F).verdict, Verdict::kSingular);
  EXPECT_EQ(ekf.p.packed(), (filter::Symmetric<float, 3>{}.packed()));
  EXPECT_TRUE(same(ekf.x, {}));
  EXPECT_TRUE(ekf.predict(model::PlanarIncrement{}));
  EXPECT_GT(least_eigenvalue(ekf.p), 0) << "nothing is known to zero";
}

struct Twice {
  static constexpr int kDimension = 2;
  static constexpr std::array<int, 3> kTouches{0, 1, 2};
  float z = 0, apart = 0;
  [[nodiscard]] filter::Vector<float, 2> predict(const model::PlanarPose& at) const {
    const float sum = at.x.offset_m + 0.3F * at.y.offset_m + 0.7F * at.yaw_rad;
    return {sum, sum};
  }
  [[nodiscard]] filter::Vector<float, 2> residual(const filter::Vector<float, 2>& z_hat) const {
    return {z - z_hat(0), z + apart - z_hat(1)};
  }
  [[nodiscard]] filter::Vector<float, 2> noise() const { return filter::Vector<float, 2>::Zero(); }
  [[nodiscard]] filter::Matrix<float, 2, 3> jacobian(const model::PlanarPose&) const {
    filter::Matrix<float, 2, 3> h;
    h << 1.0F, 0.3F, 0.7F, 1.0F, 0.3F, 0.7F;
    return h;
  }
};

TEST(NeverNan, OneStateMeasuredTwiceWithoutNoise) {
  Normal normal(5);
  int accepted = 0;
  for (int i = 0; i < 20'000; ++i) {
    auto ekf = rolling();
    const filter::Vector<float, 3> size{static_cast<float>(std::exp(3 * normal())),
                                        static_cast<float>(std::exp(3 * normal())), 1.0F};
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r <= c; ++r) ekf.p(r, c) *= size(r) * size(c);
    const auto before = ekf.p.packed();
    const Twice twice{.z = static_cast<float>(normal()),
                      .apart = i % 2 == 0 ? 0.0F : static_cast<float>(1e-3 * normal())};
    const Verdict verdict = ekf.update(twice, filter::chi_square_99(2)).verdict;
    ASSERT_TRUE(ekf.x.finite());
    ASSERT_GT(least_eigenvalue(ekf.p), 0) << i;
    if (verdict == Verdict::kAccepted) {
      ++accepted;
    } else {
      ASSERT_EQ(ekf.p.packed(), before);
    }
  }
  EXPECT_LT(accepted, 20'000);
}

TEST(NeverNan, CovariancesOfEverySizeStayPositiveDefinite) {
  Normal normal(6);
  const auto size = [&normal](double decades) {
    return static_cast<float>(std::pow(10.0, decades * std::tanh(normal())));
  };
  int accepted = 0;
  for (int run = 0; run < 2000; ++run) {
    estimators::PlanarEkf ekf;
    for (int k = 0; k < 3; ++k) ekf.p(k, k) = size(k == 2 ? 2 : 12);
    for (int i = 0; i < 100; ++i) {
      static_cast<void>(ekf.predict(model::PlanarIncrement{
          .ds_m = size(3), .dyaw_rad = static_cast<float>(normal()), .var_ds = size(10), .var_dyaw = size(8)}));
      const model::Landmark landmark{.x = ekf.x.x.plus(size(2)), .y = ekf.x.y.plus(-size(2))};
      const model::Sight sight(ekf.x, landmark, {});
      const float sigma = size(6);
      Verdict verdict = Verdict::kRejected;
      if (i % 3 == 0)
        verdict =
            ekf.update(model::GnssPosition{.x = ekf.x.x, .y = ekf.x.y, .sigma_m = sigma, .antenna_x_b_m = 0.5F}, 1e9F)
                .verdict;
      if (i % 3 == 1)
        verdict = ekf.update(model::RangeBearing{.range_m = sight.range_m(),
                                                 .bearing_rad = sight.bearing_rad(ekf.x, {}),
                                                 .sigma_range_m = sigma,
                                                 .sigma_bearing_rad = size(6),
                                                 .landmark = landmark},
                             1e9F)
                      .verdict;
      if (i % 3 == 2)
        verdict = ekf.update(model::Bearing{.bearing_rad = sight.bearing_rad(ekf.x, {}),
                                            .sigma_bearing_rad = size(6),
                                            .landmark = landmark},
                             1e9F)
                      .verdict;
      if (verdict == Verdict::kAccepted) ++accepted;
      ASSERT_TRUE(ekf.x.finite()) << run << ' ' << i;
      ASSERT_GT(least_eigenvalue(ekf.p), 0) << run << ' ' << i;
    }
  }
  EXPECT_GT(accepted, 150'000);
}

TEST(NeverNan, AMillionStepsOfThePlanarFilterWithoutAMeasurement) {
  estimators::PlanarEkf ekf;
  ekf.p = filter::Symmetric<float, 3>::diagonal({1e-6F, 1e-6F, 1e-6F});
  const model::UnicycleNoise noise{.speed = 1e-3F, .yaw_rate = 1e-4F};
  for (int i = 0; i < 1'000'000; ++i) {
    const float turn = i / 5000 % 2 == 0 ? 0.3F : 0.0F;
    ASSERT_TRUE(
        ekf.predict(model::Unicycle{.forward_mps = 3, .yaw_rate_radps = turn, .noise = noise}.increment(0.01F)));
    if (i % 500 == 0) {
      ASSERT_TRUE(ekf.x.finite());
      ASSERT_GT(least_eigenvalue(ekf.p), 0) << i;
    }
  }
  EXPECT_GT(ekf.p(2, 2), 0.9F) << "1e-4 rad^2/s over 10 000 s";
}

TEST(NeverNan, AMillionStepsOfTheLinearFilterWithoutAMeasurement) {
  filter::Kalman<float, 4> kf;
  kf.p = filter::Symmetric<float, 4>::diagonal({1, 1, 1, 1});
  for (int i = 0; i < 1'000'000; ++i) {
    const bool taken = kf.predict(model::ConstantVelocity<float>{.dt_s = 0.1F, .acceleration_variance = 0.1F});
    ASSERT_TRUE(taken) << i;
    if (i % 500 == 0) {
      ASSERT_GT(least_eigenvalue(kf.p), 0) << i;
    }
  }
  EXPECT_TRUE(kf.x.value.allFinite());
}

}  // namespace
}  // namespace tetap
