// SPDX-License-Identifier: Apache-2.0
// The filter as a whole: what it refuses, that it stays finite and positive definite, that the anchor does not matter.
#include "tetap/nav/ins.hpp"

#include "support/least_eigenvalue.hpp"
#include "tetap/model/dual_heading.hpp"
#include "tetap/model/gnss_fix_3d.hpp"
#include "tetap/model/gnss_velocity_3d.hpp"
#include "tetap/model/height.hpp"
#include "tetap/model/wheel_speed.hpp"
#include "tetap/model/zero_rate.hpp"
#include "tetap/model/zero_velocity.hpp"
#include "tetap/nav/ins_covariance_entry.hpp"
#include "true_body.hpp"

#include <gtest/gtest.h>
#include <utility>

namespace tetap {
namespace {

using nav::ImuIncrement;
using nav::ImuVerdict;
using nav::Ins;
using nav::InsState;
using nav::Vector3;

Ins::Covariance start_covariance() {
  return Ins::Covariance::diagonal(
      {4, 4, 9, 0.1F, 0.1F, 0.1F, 3e-4F, 3e-4F, 0.01F, 2e-3F, 2e-3F, 2e-3F, 1e-6F, 1e-6F, 1e-6F});
}
ImuIncrement at_rest() { return ImuIncrement::constant({0, 0, 0}, {0, 0, 9.80665F}, {5'000}); }

using test::same;

TEST(Ins, RefusesEveryBadIncrementByNameAndKeepsItsState) {
  Ins ins;
  ins.start({}, start_covariance());
  static_cast<void>(ins.predict(at_rest()));
  ins.predict_covariance();
  const InsState x = ins.x;
  const auto p = ins.p.packed();
  const auto refused = [&](const ImuIncrement& imu, ImuVerdict why) {
    EXPECT_EQ(ins.predict(imu), why);
    EXPECT_TRUE(same(ins.x, x));
    ins.predict_covariance();
    EXPECT_EQ(ins.p.packed(), p);
  };
  for (int i = 0; i < 6; ++i)
    for (const float bad : {base::kNan, base::kInfinity, -base::kInfinity, 3.4e38F, -3.4e38F, 6.0F}) {
      ImuIncrement imu = at_rest();
      (i < 3 ? imu.dtheta_b_rad(i) : imu.dv_b_mps(i - 3)) = bad;
      refused(imu, base::is_finite(bad) ? ImuVerdict::kTooFast : ImuVerdict::kNotFinite);
    }
  for (const std::int64_t dt_us : {std::int64_t{0}, std::int64_t{-5000}, std::int64_t{200'001}, INT64_MAX, INT64_MIN}) {
    ImuIncrement imu = at_rest();
    imu.dt = {dt_us};
    refused(imu, ImuVerdict::kBadInterval);
  }
  ImuIncrement smallest = at_rest();
  smallest.dtheta_b_rad = Vector3::Constant(1e-45F);
  EXPECT_EQ(ins.predict(smallest), ImuVerdict::kAccepted);
}

TEST(Ins, AMillionStepsWithoutAMeasurementStayFiniteAndPositiveDefinite) {
  for (const bool thrust : {false, true}) {
    Ins ins;
    ins.start({}, start_covariance());
    int refused = 0;
    const auto imu = thrust ? ImuIncrement::constant({0.1F, -0.2F, 3.0F}, {20, 5, 30}, {5'000}) : at_rest();
    for (int i = 0; i < 1'000'000; ++i) {
      if (ins.predict(imu) == ImuVerdict::kDiverged) ++refused;
      ins.predict_covariance();
      if (i % 100 == 0) {
        ASSERT_GT(test::least_eigenvalue(ins.p), 0.0) << i;
        ASSERT_TRUE(ins.x.finite());
      }
    }
    EXPECT_EQ(refused > 0, thrust);
    for (int i = 0; i < 15; ++i) {
      const float most = nav::kInsMostSigma[static_cast<std::size_t>(i / 3)];
      EXPECT_LT(ins.p(i, i), most * most * 1.2F) << i;
    }
    if (!thrust) {
      EXPECT_GT(ins.p(0, 0), 1e11F) << "after 5000 s it knows nothing, and says so";
    }
  }
}

/// A circle to the left, a compass, a circle to the right. A compass in between is no measurement of the heading on the
/// way there.
TEST(Ins, AHeadingThatIsToldDoesNotPayForTheWayBack) {
  Ins ins;
  ins.noise.gyro_scale = 0.003F;
  auto p = start_covariance();
  p(8, 8) = 1e-6F, p(14, 14) = 1e-12F;
  ins.start({}, p);
  const auto circle = [&ins](float radps) {
    for (int i = 0; i < 3142; ++i) {
      EXPECT_EQ(ins.predict(ImuIncrement::constant({0, 0, radps}, {0, 0, 9.80665F}, {5'000})), ImuVerdict::kAccepted);
      ins.predict_covariance();
    }
  };
  constexpr float kCircle_rad = 0.003F * 6.2832F;
  circle(0.4F);
  EXPECT_NEAR(std::sqrt(ins.p(8, 8)), kCircle_rad, 0.1F * kCircle_rad);
  for (int i = 0; i < 10; ++i)
    static_cast<void>(ins.update(model::DualHeading({1, 0, 0}, nav::euler(ins.x.q_nb).yaw_rad, 0.001F), 1e6F));
  EXPECT_LT(std::sqrt(ins.p(8, 8)), 0.05F * kCircle_rad);
  circle(-0.4F);
  EXPECT_NEAR(std::sqrt(ins.p(8, 8)), kCircle_rad, 0.1F * kCircle_rad);
}

/// A measurement of the bias corrects the heading by the effect of the bias, and not by that of the scale.
TEST(Ins, ABiasThatIsToldLeavesTheScaleToTheHeading) {
  Ins ins;
  ins.noise.gyro_scale = 0.003F;
  auto p = start_covariance();
  p(8, 8) = 1e-6F, p(12, 12) = p(13, 13) = p(14, 14) = 1e-6F;
  ins.start({}, p);
  const auto circle = [&ins] {
    for (int i = 0; i < 3142; ++i) {
      EXPECT_EQ(ins.predict(ImuIncrement::constant({0, 0, 0.4F}, {0, 0, 9.80665F}, {5'000})), ImuVerdict::kAccepted);
      ins.predict_covariance();
    }
  };
  constexpr float kCircle_rad = 0.003F * 6.2832F;
  circle();
  EXPECT_GT(std::sqrt(ins.p(8, 8)), 1.2F * kCircle_rad) << "by the bias as well";
  for (int i = 0; i < 10; ++i)
    static_cast<void>(ins.update(model::ZeroRate{.gyro_b_radps = ins.x.b_g_radps, .sigma_radps = 1e-5F}, 1e6F));
  EXPECT_NEAR(std::sqrt(ins.p(8, 8)), kCircle_rad, 0.1F * kCircle_rad);
  circle();
  EXPECT_NEAR(std::sqrt(ins.p(8, 8)), 2.0F * kCircle_rad, 0.1F * kCircle_rad);
}

/// A way that is turned as a whole is the same to wheels and IMU. They measure no heading, straight on or in curves,
/// however gentle, with a sensor however noisy.
TEST(Ins, WhatIsMeasuredInTheBodyTellsNoHeading) {
  for (const float accel_mps2_rthz : {2e-3F, 2e-2F, 1e-1F})
    for (const float turn_radps : {0.0F, 0.02F, 0.1F, 0.3F, 1.0F}) {
      Ins ins;
      ins.noise.accel_mps2_rthz = accel_mps2_rthz;
      ins.noise.gyro_radps_rthz = 1e-4F;
      constexpr float kSpeed_mps = 1.5F, kSigma_rad = 0.1F, kFirst_rad = 0.3F;
      InsState x;
      x.q_nb = nav::exp_quaternion({0, 0, kFirst_rad});
      x.v_n_mps = x.q_nb.rotate({kSpeed_mps, 0, 0});
      auto p = start_covariance();
      p(8, 8) = kSigma_rad * kSigma_rad;
      for (int i = 12; i < 15; ++i) p(i, i) = 1e-10F;  // so that turning does not hide what is told
      for (int i = 3; i < 6; ++i) p(i, i) = 9;
      ASSERT_TRUE(ins.start(x, p));
      for (int i = 0; i < 6000; ++i) {
        const float way = i / 1000 % 2 == 0 ? turn_radps : -turn_radps;
        // Alternating pushes stand for the noise: those a noisy sensor shows are taken back by the wheels.
        const float noise_mps2 = (i % 2 == 0 ? 3.0F : -3.0F) * accel_mps2_rthz;
        const Vector3 turn{0, 0, way}, push{noise_mps2, kSpeed_mps * way - noise_mps2, ins.earth.gravity_mps2};
        ASSERT_EQ(ins.predict(ImuIncrement::constant(turn, push, {10'000})), ImuVerdict::kAccepted);
        static_cast<void>(ins.update(model::WheelSpeed{.forward_mps = kSpeed_mps,
                                                       .sigma_forward_mps = 0.02F,
                                                       .sigma_lateral_mps = 0.02F,
                                                       .sigma_vertical_mps = 0.02F,
                                                       .gyro_b_radps = turn},
                                     1e6F));
      }
      EXPECT_GT(std::sqrt(ins.p(8, 8)), 0.95F * kSigma_rad) << turn_radps << " rad/s, " << accel_mps2_rthz;
      EXPECT_LT(std::sqrt(ins.p(8, 8)), 1.1F * kSigma_rad) << turn_radps << " rad/s, " << accel_mps2_rthz;
    }
}

/// Tilt and bias of what was levelled at rest are one error, in the body: so they stay when it is told its heading.
TEST(Ins, TiltAndBiasStayTogetherWhenTheHeadingIsTold) {
  for (const float wrong_rad : {-1.0F, -0.3F, -0.01F, 0.01F, 0.3F, 1.0F}) {
    Ins ins;
    auto p = start_covariance();
    p(6, 6) = p(7, 7) = 2.5e-5F, p(8, 8) = 1, p(9, 9) = p(10, 10) = 2.5e-3F, p(9, 9) *= 4;
    for (int i = 3; i < 6; ++i) p(i, i) = 1e-4F;
    ASSERT_TRUE(ins.start({}, p));
    // Acceleration that tilt and bias make together, in the body: theta x g - b.
    const auto variance = [&ins] {
      const Eigen::Matrix3d r = ins.x.q_nb.matrix().cast<double>();
      Eigen::Matrix<double, 2, 15> h = Eigen::Matrix<double, 2, 15>::Zero();
      Eigen::Matrix3d swing;
      swing << 0, 9.80665, 0, -9.80665, 0, 0, 0, 0, 0;
      h.block<2, 3>(0, 6) = (r.transpose() * swing).topRows<2>();
      h(0, 9) = h(1, 10) = -1;
      return Eigen::Matrix2d(h * ins.p.dense().cast<double>() * h.transpose());
    };
    for (int i = 0; i < 400; ++i) {
      ASSERT_EQ(ins.predict(ImuIncrement::constant({0, 0, 0}, {0, 0, 9.80665F}, {10'000})), ImuVerdict::kAccepted);
      static_cast<void>(ins.update(model::ZeroVelocity{.sigma_mps = 0.01F}, 1e6F));
    }
    const Eigen::Matrix2d before = variance();
    EXPECT_LT(before.trace(), 1e-4) << "one error: alone each of them makes 0.05 m/s^2";
    static_cast<void>(ins.update(model::DualHeading({1, 0, 0}, wrong_rad, 0.01F), 1e6F));
    EXPECT_NEAR(nav::euler(ins.x.q_nb).yaw_rad, wrong_rad, 0.01F * base::abs(wrong_rad));
    EXPECT_NEAR(variance().trace() / before.trace(), 1.0, 0.1) << wrong_rad;
    EXPECT_TRUE(ins.p.positive_definite());
  }
}

/// A body that stands and is shaken up and down: what shakes it is no motion that would tell tilt from a bias.
TEST(Ins, WhatTremblesAtRestTellsNoTilt) {
  Ins ins;
  ins.noise.motion_sigma = 3;
  ins.start({}, start_covariance());
  ins.stands = true;
  float up = 0;
  for (int i = 0; i < 60'000; ++i) {
    const float was = std::exchange(up, i % 3 == 0 ? 0.005F : i % 3 == 1 ? -0.004F : -0.001F);
    ImuIncrement imu = at_rest();
    imu.dv_b_mps(2) += up - was;
    EXPECT_EQ(ins.predict(imu), ImuVerdict::kAccepted);
    if (i % 4 == 3) static_cast<void>(ins.update(model::ZeroVelocity{.sigma_mps = 0.005F}, 1e6F));
  }
  const float as_the_bias = start_covariance()(9, 9) / (9.80665F * 9.80665F);
  EXPECT_NEAR(ins.p(6, 6), as_the_bias, 0.1F * as_the_bias);
  EXPECT_NEAR(ins.p(7, 7), as_the_bias, 0.1F * as_the_bias);
}

/// Published covariance while the filter itself is behind: as if it had been carried sample by sample.
TEST(Ins, TheStepToThePresentIsThatOfEverySampleOnTheWay) {
  Ins far;
  far.noise.motion_sigma = 0;  // between samples there is motion here
  far.noise.gyro_scale = 0.003F;
  auto p = start_covariance();
  p(8, 8) = 1e-6F, p(14, 14) = 1e-10F;
  far.start({}, p);
  const auto go = [](Ins& ins) {
    const auto imu = ImuIncrement::constant({0.02F, -0.01F, 0.4F}, {1.5F, -0.7F, 9.9F}, {5'000});
    EXPECT_EQ(ins.predict(imu), ImuVerdict::kAccepted);
  };
  for (int i = 0; i < 400; ++i) {
    go(far);
    if (i % 2 == 1) far.predict_covariance();
    if (i % 20 == 19) {
      static_cast<void>(far.update(
          model::GnssVelocity3d{.v_n_mps = far.x.v_n_mps, .sigma_horizontal_mps = 0.1F, .sigma_vertical_mps = 0.1F},
          1e6F));
    }
  }
  for (int i = 0; i < 3; ++i) go(far);  // what the covariance does not have yet is part of the way
  Ins near = far;
  for (int i = 0; i < 60; ++i) {
    near.predict_covariance();
    go(near);
  }
  near.predict_covariance();
  const auto step = far.step_to(near.x, 0.3F);
  filter::unroll<0, 15>([&](auto i) {
    const float published = nav::predicted_covariance<i, i>(far.p, step);
    EXPECT_NEAR(published, near.p(i, i), 0.02F * near.p(i, i)) << int{i};
  });
  EXPECT_GT(near.p(3, 3), 1.1F * far.p(3, 3)) << "or nothing was shown";
  EXPECT_GT(step.var_yaw, 0.05F * near.p(8, 8));
}

/// A gyroscope that is wrong by 0.3 % is wrong by 19 mrad after a circle, however fast; at rest it is by nothing.
TEST(Ins, AWrongScaleCostsTheHeadingAShareOfItsTurns) {
  for (const float rate_radps : {-1.0F, 0.2F, 0.0F}) {
    Ins ins;
    ins.noise.gyro_radps_rthz = 1e-4F;
    ins.start({}, Ins::Covariance::diagonal({1, 1, 1, 1, 1, 1, 1e-6F, 1e-6F, 1e-6F, 1, 1, 1, 1e-12F, 1e-12F, 1e-12F}));
    Ins exact = ins;
    ins.noise.gyro_scale = 0.003F;
    const float turn_s = base::abs(rate_radps) > 0 ? 6.2832F / base::abs(rate_radps) : 10.0F;
    for (int i = 0; static_cast<float>(i) < 200 * turn_s; ++i)
      for (Ins* one : {&ins, &exact}) {
        const float noise_radps = i % 2 == 0 ? 1e-3F : -1e-3F;
        static_cast<void>(
            one->predict(ImuIncrement::constant({0, 0, rate_radps + noise_radps}, {0, 0, 9.80665F}, {5'000})));
        one->predict_covariance();
      }
    const float turned = base::sqrt(ins.p(8, 8) - exact.p(8, 8));
    EXPECT_NEAR(turned, base::abs(rate_radps) > 0 ? 0.0188F : 0.0F, 0.001F) << rate_radps;
    EXPECT_FLOAT_EQ(ins.p(6, 6), exact.p(6, 6)) << "gravity corrects it";
  }
}

/// The densities hold up to a vibration; beyond it both sensors' noise is that much larger, and no number is believed.
TEST(Ins, WhatShakesItMakesBothSensorsNoisier) {
  const auto grown = [](float vibration) {
    Ins ins;
    ins.start({}, start_covariance());
    ins.noise = {.gyro_radps_rthz = 1e-2F, .accel_mps2_rthz = 0.3F};
    ins.vibration = vibration;
    const Ins::Covariance was = ins.p;
    static_cast<void>(ins.predict(at_rest()));
    ins.predict_covariance();
    return std::pair{ins.p(4, 4) - was(4, 4), ins.p(6, 6) - was(6, 6)};
  };
  const auto [velocity, attitude] = grown(1.0F);
  ASSERT_GT(velocity, 0.0F);
  ASSERT_GT(attitude, 0.0F);
  const auto [shaken_velocity, shaken_attitude] = grown(4.0F);
  EXPECT_NEAR(shaken_velocity / velocity, 16.0F, 1.0F);
  EXPECT_NEAR(shaken_attitude / attitude, 16.0F, 1.0F);
  for (const float none : {0.0F, 0.5F, -4.0F, 1e9F, base::kNan, base::kInfinity}) {
    EXPECT_EQ(grown(none).first, velocity) << none;
    EXPECT_EQ(grown(none).second, attitude) << none;
  }
}

TEST(Ins, AGapWithoutIncrementsWidensWhatTheGapMayHaveChanged) {
  Ins ins;
  ins.start({}, start_covariance());
  ins.x.v_n_mps = {2, 0, 0};
  ins.predict_without_imu({1'000'000}, 1.0F, 0.2F);
  EXPECT_NEAR(test::metres(ins.x.x), 2.0, 1e-5);
  // A force of 1 m/s^2 that changes every 0.1 s.
  EXPECT_NEAR(ins.p(3, 3), 0.1F + 0.1F, 0.01F);
  EXPECT_NEAR(ins.p(8, 8), 0.01F + 0.04F * 0.1F, 1e-4F);
  EXPECT_TRUE(ins.p.positive_definite());
  ins.predict_without_imu({INT64_MAX}, 1.0F, 0.2F);
  EXPECT_TRUE(ins.p.positive_definite());
  EXPECT_TRUE(ins.x.finite());
}

TEST(Ins, AnOutlierIsRejectedAndChangesNothing) {
  Ins ins;
  ins.start({}, start_covariance());
  const auto p = ins.p.packed();
  const auto far =
      ins.update(model::GnssFix3d{.x = test::anchored(100), .sigma_horizontal_m = 1, .sigma_vertical_m = 1},
                 filter::chi_square_99(3));
  EXPECT_EQ(far.verdict, filter::Verdict::kRejected);
  EXPECT_NEAR(far.nis, 100 * 100 / 5.0F, 1);
  EXPECT_EQ(ins.p.packed(), p);
  EXPECT_TRUE(same(ins.x, {}));
}

TEST(Ins, ACorrectionOfKilometresArrivesWhole) {
  Ins ins;
  auto p = start_covariance();
  p(0, 0) = p(1, 1) = 1e10F;
  ins.start({}, p);
  const auto fix = model::GnssFix3d{.x = test::anchored(31'234.567),
                                    .y = test::anchored(-4'321.5),
                                    .sigma_horizontal_m = 0.01F,
                                    .sigma_vertical_m = 1};
  static_cast<void>(ins.update(fix, 1e9F));
  EXPECT_NEAR(test::metres(ins.x.x), 31'234.567, 0.05);
  EXPECT_NEAR(test::metres(ins.x.y), -4'321.5, 0.05);
}

/// The same drive at the origin and 50 km away: the same bits in everything but the anchor.
TEST(Ins, TheAnchorDoesNotMatterToTheBit) {
  Ins near, far;
  InsState away{.x = {.anchor_um = 50'000'000'000}, .y = {.anchor_um = -30'000'000'000}};
  near.start({}, start_covariance());
  far.start(away, start_covariance());
  test::Normal normal(12);
  for (int i = 0; i < 20'000; ++i) {
    const auto imu = ImuIncrement::constant((0.3 * normal.vector()).cast<float>(),
                                            (Eigen::Vector3d(0, 0, 9.8) + 2 * normal.vector()).cast<float>(), {5'000});
    static_cast<void>(near.predict(imu));
    static_cast<void>(far.predict(imu));
    if (i % 40 == 0) {
      model::GnssFix3d fix{.sigma_horizontal_m = 1, .sigma_vertical_m = 2, .antenna_b_m = {0.3F, 0, 1}};
      const double e = normal(), n = normal();
      fix.x = test::anchored(e), fix.y = test::anchored(n);
      static_cast<void>(near.update(fix, 1e9F));
      fix.x.anchor_um += away.x.anchor_um, fix.y.anchor_um += away.y.anchor_um;
      static_cast<void>(far.update(fix, 1e9F));
    }
  }
  far.x.x.anchor_um -= away.x.anchor_um;
  far.x.y.anchor_um -= away.y.anchor_um;
  EXPECT_TRUE(same(near.x, far.x));
  EXPECT_EQ(near.x.x.anchor_um, far.x.x.anchor_um);
  EXPECT_EQ(near.p.packed(), far.p.packed());
}

TEST(Ins, ZeroAndHugeCovariancesAndPerfectSensorsLeaveItFinite) {
  for (const float size : {0.0F, 1e-30F, 1e-12F, 1.0F, 1e12F, 1e30F})
    for (const float sigma : {0.0F, 1e-20F, 1e-6F, 1.0F, 1e10F, 1e20F}) {
      Ins ins;
      Ins::Covariance p;
      for (int i = 0; i < 15; ++i) p(i, i) = size;
      ins.start({}, p);
      for (int i = 0; i < 200; ++i) {
        ASSERT_EQ(ins.predict(at_rest()), ImuVerdict::kAccepted);
        const model::GnssFix3d fix{.x = test::anchored(0.01 * (i % 7)),
                                   .sigma_horizontal_m = sigma,
                                   .sigma_vertical_m = sigma,
                                   .antenna_b_m = {1, 0, 1}};
        static_cast<void>(ins.update(fix, 1e12F));
        static_cast<void>(
            ins.update(model::GnssVelocity3d{.sigma_horizontal_mps = sigma, .sigma_vertical_mps = sigma}, 1e12F));
        ASSERT_TRUE(ins.x.finite()) << size << ' ' << sigma << ' ' << i;
      }
      EXPECT_TRUE(ins.p.positive_definite()) << size << ' ' << sigma;
    }
}

TEST(Ins, TheFilterIsSmall) {
  EXPECT_LE(sizeof(Ins), 1280U);
  EXPECT_LE(sizeof(InsState), 104U);
}

}  // namespace
}  // namespace tetap
