// SPDX-License-Identifier: Apache-2.0
// Whatever a sensor says, inertial navigation stays finite, its covariance stays positive definite (judge: eigenvalues
// in double), and the refusal is told.
#include "support/never_nan.hpp"
#include "tetap/model/dual_heading.hpp"
#include "tetap/model/gnss_course.hpp"
#include "tetap/model/gnss_fix_3d.hpp"
#include "tetap/model/gnss_velocity_3d.hpp"
#include "tetap/model/height.hpp"
#include "tetap/model/magnetic_heading.hpp"
#include "tetap/model/wheel_speed.hpp"
#include "tetap/model/zero_rate.hpp"
#include "tetap/model/zero_velocity.hpp"
#include "tetap/nav/strapdown.hpp"
#include "true_body.hpp"

#include <gtest/gtest.h>
#include <cmath>

namespace tetap {
namespace {

using filter::Verdict;
using test::Fields;
using test::kHostile;
using test::least_eigenvalue;
using test::same;

void add(Fields& fields, nav::Vector3& v) {
  for (int i = 0; i < 3; ++i) fields.push_back(&v(i));
}
Fields fields_of(model::GnssFix3d& m) {
  Fields f{&m.x.offset_m, &m.y.offset_m, &m.z.offset_m, &m.sigma_horizontal_m, &m.sigma_vertical_m};
  return add(f, m.antenna_b_m), f;
}
Fields fields_of(model::GnssVelocity3d& m) {
  Fields f{&m.sigma_horizontal_mps, &m.sigma_vertical_mps};
  return add(f, m.v_n_mps), add(f, m.antenna_b_m), add(f, m.gyro_b_radps), f;
}
Fields fields_of(model::WheelSpeed& m) {
  Fields f{&m.forward_mps, &m.sigma_forward_mps, &m.sigma_lateral_mps, &m.sigma_vertical_mps};
  return add(f, m.axle_b_m), add(f, m.gyro_b_radps), f;
}
Fields fields_of(model::NonHolonomic& m) {
  Fields f{&m.sigma_lateral_mps, &m.sigma_vertical_mps};
  return add(f, m.axle_b_m), add(f, m.gyro_b_radps), f;
}
Fields fields_of(model::Height& m) { return {&m.z.offset_m, &m.sigma_m}; }
Fields fields_of(model::ZeroVelocity& m) { return {&m.sigma_mps}; }
Fields fields_of(model::ZeroRate& m) {
  Fields f{&m.sigma_radps};
  return add(f, m.gyro_b_radps), add(f, m.earth_rate_n_radps), f;
}
Fields fields_of(model::DirectionMeasurement& m) {
  Fields f{&m.angle_rad, &m.sigma_rad};
  return add(f, m.vector_b), f;
}

nav::ImuIncrement driving() { return nav::ImuIncrement::constant({0.01F, -0.02F, 0.3F}, {0.2F, 0.6F, 9.8F}, {5'000}); }

nav::Ins navigating() {
  nav::Ins ins;
  ins.start({.v_n_mps = {2.0F, 0.1F, 0.0F}, .q_nb = nav::from_euler({.yaw_rad = 0.3F, .pitch_rad = 0.05F})},
            nav::Ins::Covariance::diagonal(
                {4, 4, 9, 0.1F, 0.1F, 0.1F, 3e-4F, 3e-4F, 0.01F, 2e-3F, 2e-3F, 2e-3F, 1e-6F, 1e-6F, 1e-6F}));
  for (int i = 0; i < 200; ++i) {
    EXPECT_EQ(ins.predict(driving()), nav::ImuVerdict::kAccepted);
    ins.predict_covariance();
  }
  return ins;
}

template <class Model>
void break_every_field(const nav::Ins& well, const Model& good) {
  test::break_every_field(
      well, good, [](Model& m) { return fields_of(m); }, [](const auto& a, const auto& b) { return same(a, b); });
}

TEST(NeverNan, EveryFieldOfEveryInertialMeasurement) {
  const nav::Ins ins = navigating();
  const nav::Vector3 lever{0.3F, -0.2F, 1.0F}, rate{0.01F, -0.02F, 0.3F};
  break_every_field(ins, model::GnssFix3d{.x = ins.x.x,
                                          .y = ins.x.y,
                                          .z = ins.x.z,
                                          .sigma_horizontal_m = 1,
                                          .sigma_vertical_m = 2,
                                          .antenna_b_m = lever});
  break_every_field(
      ins, model::GnssFix3d{.x = ins.x.x, .y = ins.x.y, .z = ins.x.z, .sigma_horizontal_m = 1, .sigma_vertical_m = 2});
  break_every_field(ins, model::GnssVelocity3d{.v_n_mps = ins.x.v_n_mps,
                                               .sigma_horizontal_mps = 0.1F,
                                               .sigma_vertical_mps = 0.1F,
                                               .antenna_b_m = lever,
                                               .gyro_b_radps = rate});
  break_every_field(
      ins,
      model::GnssVelocity3d{
          .v_n_mps = ins.x.v_n_mps, .sigma_horizontal_mps = 0.1F, .sigma_vertical_mps = 0.1F, .gyro_b_radps = rate});
  break_every_field(ins, model::WheelSpeed{.forward_mps = 2,
                                           .sigma_forward_mps = 0.05F,
                                           .sigma_lateral_mps = 0.1F,
                                           .sigma_vertical_mps = 0.1F,
                                           .axle_b_m = lever,
                                           .gyro_b_radps = rate});
  break_every_field(
      ins, model::NonHolonomic{
               .sigma_lateral_mps = 0.1F, .sigma_vertical_mps = 0.1F, .axle_b_m = lever, .gyro_b_radps = rate});
  break_every_field(ins, model::Height{.z = ins.x.z, .sigma_m = 1});
  break_every_field(ins, model::ZeroVelocity{.sigma_mps = 0.01F});
  break_every_field(ins, model::ZeroRate{.gyro_b_radps = rate, .sigma_radps = 0.01F});
  break_every_field(ins, model::DirectionMeasurement(model::DualHeading(lever, 0.1F, 0.05F)));
  break_every_field(ins, model::DirectionMeasurement(model::MagneticHeading({17.0F, 3.0F, -46.0F}, 0.05F, 0.1F)));
}

TEST(NeverNan, ACourseOfAVelocityThatIsNoneIsRefused) {
  const nav::Ins well = navigating();
  const std::array<float, 4> good{2.0F, 0.5F, 0.1F, 0.05F};
  const auto fuse = [&](const std::array<float, 4>& v) {
    nav::Ins ins = well;
    const auto record = ins.update(model::GnssCourse(v[0], v[1], v[2], v[3]), 1e9F);
    EXPECT_TRUE(ins.x.finite());
    EXPECT_GT(least_eigenvalue(ins.p), 0);
    return record.verdict;
  };
  ASSERT_EQ(fuse(good), Verdict::kAccepted);
  for (std::size_t field = 0; field < good.size(); ++field)
    for (const float value : kHostile) {
      auto bad = good;
      bad[field] = value;
      SCOPED_TRACE(testing::Message() << "field " << field << " = " << value);
      const Verdict verdict = fuse(bad);
      if (!base::is_finite(value)) {
        EXPECT_EQ(verdict, Verdict::kNotFinite);
      }
    }
}

/// A number that is not comparable is no gate.
TEST(NeverNan, AGateThatIsNoNumberLetsNothingThrough) {
  nav::Ins ins = navigating();
  const auto p = ins.p.packed();
  EXPECT_EQ(ins.update(model::Height{.z = ins.x.z, .sigma_m = 1}, base::kNan).verdict, Verdict::kRejected);
  EXPECT_EQ(ins.update(model::ZeroVelocity{.sigma_mps = 1}, base::kNan).verdict, Verdict::kRejected);
  EXPECT_EQ(ins.p.packed(), p);
}

TEST(NeverNan, ASingularInnovationIsCalledThatAndChangesNothing) {
  nav::Ins ins = navigating();
  ins.p = {};
  const nav::InsState x = ins.x;
  EXPECT_EQ(ins.update(model::GnssFix3d{}, 1e9F).verdict, Verdict::kSingular);
  EXPECT_EQ(ins.update(model::ZeroVelocity{}, 1e9F).verdict, Verdict::kSingular);
  EXPECT_TRUE(same(ins.x, x));
  EXPECT_EQ(ins.p.packed(), nav::Ins::Covariance{}.packed());
}

TEST(NeverNan, AnInertialStartFromNoNumbersIsRefused) {
  const nav::Ins well = navigating();
  const nav::InsState place = well.x;
  for (int field = 0; field < 10; ++field)
    for (const float value : {base::kNan, base::kInfinity, -base::kInfinity}) {
      nav::InsState bad = place;
      if (field == 0) bad.x.offset_m = value;
      if (field == 1) bad.z.offset_m = value;
      if (field == 2) bad.q_nb.w = value;
      if (field == 3) bad.q_nb.z = value;
      if (field >= 4 && field < 7) bad.v_n_mps(field - 4) = value;
      if (field >= 7) bad.b_g_radps(field - 7) = value;
      nav::Ins ins = well;
      EXPECT_FALSE(ins.start(bad, well.p)) << field;
      EXPECT_TRUE(same(ins.x, place));
      EXPECT_EQ(ins.p.packed(), well.p.packed());
      EXPECT_EQ(ins.predict(driving()), nav::ImuVerdict::kAccepted);
    }
  for (int k = 0; k < 15; ++k)
    for (const float value : kHostile) {
      auto p = well.p;
      p(k, k) = value;
      if (k > 0) p(k - 1, k) = value;
      nav::Ins ins = well;
      EXPECT_TRUE(ins.start(place, p)) << "what a covariance cannot be is put right";
      EXPECT_GT(least_eigenvalue(ins.p), 0) << k << ' ' << value;
    }
}

/// P and R of every size, all sensors in any order: what follows stays a covariance, and the state a number.
TEST(NeverNan, MeasurementsOfEverySizeInEveryOrder) {
  test::Normal normal(0);
  const auto size = [&normal](double decades) {
    return static_cast<float>(std::pow(10.0, decades * std::tanh(normal())));
  };
  const auto vector = [&](double decades) {
    const float scale = size(decades);
    return nav::Vector3(scale * normal.vector().cast<float>());
  };
  constexpr float kGate = 100.0F;  // the widest that makes sense: a state that obeys every outlier is no state
  int accepted = 0;
  const auto count = [&accepted](const auto& record) { accepted += record.verdict == Verdict::kAccepted ? 1 : 0; };
  for (int run = 0; run < 1000; ++run) {
    // 4817 is where a measurement that is sharp takes what the digit of a step has not given yet.
    normal = test::Normal(run == 0 ? 4817U : static_cast<unsigned>(run));
    nav::Ins ins;
    nav::Ins::Covariance p;
    for (int i = 0; i < 15; ++i) p(i, i) = size(8);
    ASSERT_TRUE(ins.start({}, p));
    for (int i = 0; i < 300; ++i) {
      for (int k = i % 3; k > 0; --k) {
        static_cast<void>(ins.predict(driving()));
        ins.predict_covariance();
      }
      const nav::Vector3 lever = i % 2 == 0 ? nav::Vector3(nav::Vector3::Zero()) : vector(2), rate = vector(1);
      switch (static_cast<int>(1e6 * std::abs(normal())) % 7) {
        case 0:
          count(ins.update(model::GnssFix3d{.x = ins.x.x,
                                            .y = ins.x.y,
                                            .z = ins.x.z,
                                            .sigma_horizontal_m = size(7),
                                            .sigma_vertical_m = size(7),
                                            .antenna_b_m = lever},
                           kGate));
          break;
        case 1:
          count(ins.update(model::GnssVelocity3d{.v_n_mps = vector(2),
                                                 .sigma_horizontal_mps = size(7),
                                                 .sigma_vertical_mps = size(7),
                                                 .antenna_b_m = lever,
                                                 .gyro_b_radps = rate},
                           kGate));
          break;
        case 2:
          count(ins.update(model::WheelSpeed{.forward_mps = size(2),
                                             .sigma_forward_mps = size(7),
                                             .sigma_lateral_mps = size(7),
                                             .sigma_vertical_mps = size(7),
                                             .axle_b_m = lever,
                                             .gyro_b_radps = rate},
                           kGate));
          break;
        case 3:
          count(ins.update(model::ZeroVelocity{.sigma_mps = size(7)}, kGate));
          break;
        case 4:
          count(ins.update(model::ZeroRate{.gyro_b_radps = rate, .sigma_radps = size(7)}, kGate));
          break;
        case 5:
          count(ins.update(model::DualHeading(vector(3), size(1), size(7)), kGate));
          break;
        default:
          count(ins.update(model::Height{.z = ins.x.z.plus(size(3)), .sigma_m = size(7)}, kGate));
      }
      ASSERT_TRUE(ins.x.finite()) << run << ' ' << i;
      ASSERT_NEAR(ins.x.q_nb.norm2(), 1.0F, 1e-4F) << run << ' ' << i;
      ASSERT_GT(least_eigenvalue(ins.p), 0) << run << ' ' << i;
    }
  }
  EXPECT_GT(accepted, 40'000);
}

TEST(NeverNan, AGapOfAnyKindLeavesTheFilterFiniteAndPositiveDefinite) {
  const nav::Ins well = navigating();
  for (const std::int64_t gap_us :
       {INT64_MIN, std::int64_t{-1}, std::int64_t{0}, std::int64_t{1}, std::int64_t{2'000'000}, INT64_MAX})
    for (const float value : kHostile)
      for (const bool first : {true, false}) {
        nav::Ins ins = well;
        ins.predict_without_imu({gap_us}, first ? value : 1.0F, first ? 1.0F : value);
        EXPECT_TRUE(ins.x.finite());
        EXPECT_GT(least_eigenvalue(ins.p), 0) << gap_us << ' ' << value;
      }
}

TEST(NeverNan, VibrationOfAnySizeLeavesTheCovariancePositiveDefinite) {
  for (const float value : kHostile) {
    nav::Ins ins = navigating();
    for (int i = 0; i < 300; ++i) {
      ASSERT_EQ(ins.predict(driving()), nav::ImuVerdict::kAccepted);
      ins.vibration = value;
      ins.predict_covariance();
      ASSERT_GT(least_eigenvalue(ins.p), 0) << value << ' ' << i;
    }
    EXPECT_TRUE(ins.x.finite());
  }
}

TEST(NeverNan, TheCarriedStateIsFiniteForEveryAcceptedIncrement) {
  const nav::Ins ins = navigating();
  nav::Earth earth;
  earth.rate_n_radps = {0, 5e-5F, 5e-5F};
  const auto most = [](float per_s, std::int64_t us) { return per_s * base::seconds({us}) * 0.577F; };  // by the norm
  for (const std::int64_t dt_us : {std::int64_t{1}, std::int64_t{5'000}, std::int64_t{200'000}})
    for (const float sign : {1.0F, -1.0F}) {
      nav::InsState x = ins.x;
      const nav::ImuIncrement hardest{.dtheta_b_rad = nav::Vector3::Constant(sign * most(100.0F, dt_us)),
                                      .dv_b_mps = nav::Vector3::Constant(sign * most(1000.0F, dt_us)),
                                      .dt = {dt_us}};
      ASSERT_EQ(hardest.check(), nav::ImuVerdict::kAccepted);
      for (int i = 0; i < 100'000; ++i) {
        nav::strapdown(x, hardest, earth);
        if (i % 1000 == 0) {
          ASSERT_TRUE(x.finite()) << dt_us << ' ' << i;
        }
      }
      EXPECT_NEAR(x.q_nb.norm2(), 1.0F, 1e-4F);
    }
}

}  // namespace
}  // namespace tetap
