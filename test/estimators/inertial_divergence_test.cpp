// SPDX-License-Identifier: Apache-2.0
// An inertial estimator that is wrong about where it looks or how fast it goes. The tests hold how far off it gets, how
// long it takes to notice, and what it publishes.
#include "inertial_drive.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace tetap::estimators {
namespace {

/// A pose given with a wrong heading and a sigma of 0.02 rad. Less than a right angle is pulled round. Beyond, the
/// wheels seem to spin: the estimator has to notice that it looks the wrong way. It has to begin anew, and to publish
/// that. It does so with a speedometer as well as with counts of two wheels.
TEST(InertialDivergence, AWrongHeadingIsNotFlownAwayWith) {
  for (int k = 0; k < 22; ++k) {
    constexpr std::array kOff_rad{-3.1, -1.5, -1.1, -1.0, -0.9, 0.8, 0.9, 1.1, 1.8, 2.5, 3.14};
    const double off_rad = kOff_rad[static_cast<std::size_t>(k % 11)];
    Drive d(rover_like());
    d.speedometer = k >= 11;
    d.wheels = !d.speedometer;
    d.yaw_rad -= off_rad;
    d.place();
    d.yaw_rad += off_rad;
    d.run(60);
    EXPECT_LE(d.estimator.jump().count, 1) << off_rad;
    if (std::abs(off_rad) > 1.2) {
      EXPECT_EQ(d.estimator.jump().count, 1) << off_rad;
      EXPECT_EQ(d.estimator.jump().cause, sensor::ResetCause::kHeadingWrong);
      const auto turned_rad = static_cast<double>(d.estimator.jump().yaw_rad);
      EXPECT_GT(std::abs(turned_rad), 0.5) << off_rad << ": by how much it stepped is said";
      EXPECT_TRUE(std::isfinite(d.estimator.jump().east_m) && std::isfinite(d.estimator.jump().up_m));
    }
    EXPECT_EQ(d.estimator.mode(d.ctx()), sensor::Mode::kNominal) << off_rad;
    d.clear();
    d.run(60);
    EXPECT_TRUE(d.tracking());
    EXPECT_LT(d.worst_m, 4.0) << off_rad;
    EXPECT_LT(d.worst_sigmas, 4.5) << off_rad;
    EXPECT_NEAR(
        std::remainder(static_cast<double>(d.estimator.estimate(d.ctx()).pose.yaw_rad) - d.yaw_rad, 6.283185307), 0,
        0.1)
        << off_rad;
  }
}

/// No sensor for five seconds, and a turn meanwhile: the heading is uncertain by more than half a radian. The first
/// velocity that goes elsewhere begins the estimator anew. Fused, it would turn the heading by a part and make it sure.
TEST(InertialDivergence, ATurnThatNoSensorSawBeginsAnewAtOnce) {
  for (const double turned_rad : {-2.6, -1.8, 1.8, 2.2, 3.1}) {
    Drive d(rover_like());
    d.speed_mps = 2;
    d.place();
    d.run(30);
    d.turn_radps = turned_rad / 5;
    d.silent = true;
    d.run(5);
    d.turn_radps = 0.05;
    d.silent = false;
    d.clear();
    d.run(0.5);
    EXPECT_EQ(d.estimator.jump().count, 1) << turned_rad;
    EXPECT_EQ(d.estimator.jump().cause, sensor::ResetCause::kHeadingWrong) << turned_rad;
    d.run(2.5);
    EXPECT_EQ(d.estimator.mode(d.ctx()), sensor::Mode::kNominal) << turned_rad;
    EXPECT_LT(d.yaw_error_rad(), 0.1) << turned_rad;
    EXPECT_LT(d.worst_sigmas, 4.0) << turned_rad;
    d.run(27);
    EXPECT_EQ(d.estimator.jump().count, 1) << turned_rad << ": once";
  }
}

/// A pose with a heading that is known roughly, and as far off as stated: the estimator finds it, anew or not.
TEST(InertialDivergence, AGivenHeadingThatIsKnownRoughlyIsFoundWithinSeconds) {
  for (const double off_rad : {-0.9, -0.6, 0.0, 0.6, 0.9}) {
    Drive d(rover_like());
    d.speed_mps = 2;
    d.yaw_rad += off_rad;
    d.place(0, 0.1F, 0.8F);
    d.yaw_rad -= off_rad;
    d.run(10);
    EXPECT_EQ(d.estimator.mode(d.ctx()), sensor::Mode::kNominal) << off_rad;
    EXPECT_LT(d.yaw_error_rad(), 0.1) << off_rad;
    EXPECT_LT(d.error_m(), 2.0) << off_rad;
    EXPECT_LE(d.estimator.jump().count, 1) << off_rad;
  }
}

/// Both wheels turn otherwise than the gyroscope shows. The heading is as uncertain as the two are apart.
TEST(InertialDivergence, AGyroscopeThatBothWheelsContradictMakesTheHeadingUncertain) {
  for (const double bias_radps : {0.5, -0.5, -1.0}) {
    Drive d(rover_like());
    d.place();
    d.run(25);
    d.gyro_bias_radps = bias_radps;
    int out = 0;
    for (int k = 0; k < 60; ++k) {
      d.run(0.1);
      out += d.tracking() && d.yaw_error_rad() > 9 * d.sigma_yaw_rad();
    }
    EXPECT_LT(0.1 * out, 0.5) << bias_radps;
  }
}

/// The robot stands, and the gyroscope alone turns for a while. The filter is unsure by the turn, and by some twice of
/// it at most.
TEST(InertialDivergence, ATurnAtRestThatBothWheelsDenyLeavesTheHeadingUncertain) {
  for (const float antenna_m : {0.0F, 0.6F}) {
    for (const double bias_radps : {0.05, -0.1, 0.3, -0.5, 1.0}) {
      param::Parameters n = rover_like();
      n.gnss.antenna_x_b_m = antenna_m;
      Drive d = settled(n, 3);
      d.white_m = 0.3;
      d.speed_mps = d.turn_radps = 0;
      d.run(20);
      d.gyro_bias_radps = bias_radps;
      double beyond_s = 0;
      for (int k = 0; k < 1400; ++k) {
        if (k == 400) d.gyro_bias_radps = 0;
        d.run(0.01);
        beyond_s += d.yaw_error_rad() > 3 * d.sigma_yaw_rad() ? 0.01 : 0;
      }
      EXPECT_LT(beyond_s, 0.3) << bias_radps << " rad/s, antenna at " << antenna_m << " m";
      EXPECT_LT(d.sigma_yaw_rad(), 0.2 + 2.2 * 4 * std::abs(bias_radps)) << bias_radps;
    }
  }
}

/// Speeds of wheels are no counts: a driving robot never counts as one that rests, and its wheels may err a little.
TEST(InertialDivergence, WheelsThatSendSpeedsDoNotDenyACurve) {
  Drive d(rover_like());
  d.place();
  d.wheels = false;
  d.speed_mps = 2;
  d.turn_radps = 0.1;
  for (int i = 0; i < 3000; ++i) {
    d.run(0.01);
    const sensor::WheelSpeeds speeds{.left_mps = static_cast<float>(1.01 * (d.speed_mps - 0.25 * d.turn_radps)),
                                     .right_mps = static_cast<float>(d.speed_mps + 0.25 * d.turn_radps)};
    d.estimator.fuse(speeds, {d.us}, d.ctx());
    ASSERT_NE(d.estimator.sources(d.ctx()).of(sensor::Sensor::kWheelSpeed).state, SourceState::kRejecting) << i;
    ASSERT_NE(d.estimator.sources(d.ctx()).of(sensor::Sensor::kWheelCounts).state, SourceState::kRejecting) << i;
  }
  EXPECT_LT(d.sigma_yaw_rad(), 0.1);
}

/// On a slope the bias about the plumb line is of all three axes. The heading keeps its share beside it.
TEST(InertialDivergence, ADeniedTurnOnASlopeLeavesTheHeadingItsOwnShare) {
  for (const double lean_rad : {0.0, 0.3, 0.6}) {
    nav::Ins ins;
    nav::InsState x;
    x.q_nb = nav::exp_quaternion(nav::Vector3(static_cast<float>(lean_rad), 0, 0));
    constexpr int kYaw = nav::InsState::kYaw, kBias = nav::InsState::kGyroBias;
    ASSERT_TRUE(ins.start(x, {1, 1, 1, 1, 1, 1, 0.01F, 0.01F, 2, 0.01F, 0.01F, 0.01F, 0.25F, 0.25F, 0.25F}));
    const nav::Vector3 up_b = ins.x.q_nb.conjugate().rotate(ins.earth.up_n);
    for (int i = 0; i < 3; ++i) ins.p(kYaw, kBias + i) = 0.6F * up_b(i);
    Recovery::widen_turn(ins, 1.0F, true);
    double shared = 0, bias = 0;
    for (int i = 0; i < 3; ++i) {
      shared += static_cast<double>(ins.p(kYaw, kBias + i) * up_b(i));
      for (int j = 0; j < 3; ++j) bias += static_cast<double>(ins.p(kBias + i, kBias + j) * up_b(i) * up_b(j));
    }
    const double own = static_cast<double>(ins.p(kYaw, kYaw)) - shared * shared / bias;
    EXPECT_GE(own, 1.0) << lean_rad;
    EXPECT_LT(own, 2.0) << lean_rad;
  }
}

TEST(InertialDivergence, AWheelThatSpinsAloneLeavesTheHeadingAsItIs) {
  for (const double slip_mps : {0.5, 2.0, -1.0}) {
    Drive d(rover_like()), spins(rover_like());
    for (Drive* one : {&d, &spins}) {
      one->place();
      one->run(20);
    }
    spins.left_slip_mps = slip_mps;
    d.run(3);
    spins.run(3);
    EXPECT_LT(spins.sigma_yaw_rad(), 1.2 * d.sigma_yaw_rad()) << slip_mps;
    EXPECT_LT(spins.yaw_error_rad(), 0.05) << slip_mps;
  }
}

/// The heading was told wrong, and wheels show it; the magnetometer was right all the time. The robot stops where it is
/// noticed, so nothing but the magnetometer can say the heading it begins anew with.
TEST(InertialDivergence, WhereWheelsShowAWrongHeadingAMagnetometerThatIsRightIsBelieved) {
  param::Parameters n = rover_like();
  n.magnetic.use = 1;
  Drive d(n);
  d.yaw_rad -= 2.6;
  d.place();
  d.yaw_rad += 2.6;
  const auto run = [&d](double duration_s) {
    for (int k = 0; k < duration_s * 50; ++k) {
      d.run(0.02);
      const auto yaw_rad = static_cast<float>(d.yaw_rad);
      static_cast<void>(d.estimator.fuse(
          sensor::MagneticFlux{.flux_b_uT = {20 * base::sin(yaw_rad), 20 * base::cos(yaw_rad), -44}}, {d.us}, d.ctx()));
    }
  };
  for (int k = 0; k < 600 && d.estimator.jump().count == 0; ++k) run(0.1);
  ASSERT_EQ(d.estimator.jump().cause, sensor::ResetCause::kHeadingWrong);
  d.speed_mps = d.turn_radps = 0;
  run(10);
  ASSERT_TRUE(d.tracking());
  EXPECT_NEAR(std::remainder(static_cast<double>(d.estimator.estimate(d.ctx()).pose.yaw_rad) - d.yaw_rad, 6.283185307),
              0, 0.1);
}

/// IMU and GNSS, no wheels. Stands, starts, drives straight, stops, starts again, turns; the heading is given wrong.
struct Alone {
  double worst_m = 0, worst_sigmas = 0;  ///< largest error of the position, all the way
  double wrong_until_s = 0;              ///< last that the heading was off by more than 0.15 rad
  double without_s = 0;                  ///< time without navigation, after the first start
  int said = 0;                          ///< resets
  sensor::ResetCause last = sensor::ResetCause::kPowerOn;
  double end_m = 0, end_sigmas = 0;  ///< worst in the last minute
  sensor::Mode mode = sensor::Mode::kNominal;
};
Alone drive_alone(Drive& d, double off_rad, double speed_mps) {
  d.wheels = false;
  d.speed_mps = d.turn_radps = 0;
  d.yaw_rad -= off_rad;
  d.place();
  d.yaw_rad += off_rad;
  Alone all;
  bool began = false;
  const double step_mps = 0.5 * speed_mps * 0.1;
  for (int k = 0; k < 2000; ++k) {
    const double t_s = 0.1 * k;
    const bool goes = (t_s >= 2 && t_s < 60) || t_s >= 80;
    d.speed_mps = std::clamp(d.speed_mps + (goes ? step_mps : -step_mps), 0.0, speed_mps);
    d.turn_radps = t_s >= 82 && t_s < 140 ? 0.3 : 0;
    d.run(0.1);
    if (d.estimator.jump().count != all.said) {
      EXPECT_EQ(d.estimator.jump().count, all.said + 1) << t_s;
      all.said = d.estimator.jump().count;
      all.last = d.estimator.jump().cause;
    }
    began = began || d.tracking();
    if (!d.tracking()) {
      if (began) all.without_s += 0.1;
      continue;
    }
    const auto yaw_rad = static_cast<double>(d.estimator.estimate(d.ctx()).pose.yaw_rad);
    if (std::abs(std::remainder(yaw_rad - d.yaw_rad, 6.283185307)) > 0.15) all.wrong_until_s = t_s;
    if (k == 1400) d.clear();
    all.worst_m = std::max(all.worst_m, d.worst_m);
    all.worst_sigmas = std::max(all.worst_sigmas, d.worst_sigmas);
  }
  all.end_m = d.worst_m;
  all.end_sigmas = d.worst_sigmas;
  all.mode = d.estimator.mode(d.ctx());
  return all;
}

/// Only the robot's motion can show that the heading is wrong. The error is noticed while the robot speeds up, or at
/// the latest while it stops or turns. GNSS shows there the direction of the acceleration that the IMU felt.
TEST(InertialDivergence, WithoutWheelsAWrongHeadingIsFoundByHowItMoves) {
  for (const unsigned seed : {1U, 2U, 3U, 74U})
    for (const bool constrained : {false, true})
      for (const double speed_mps : {1.0, 2.0})
        for (const double off_rad : {0.0, 1.05, -1.57, 1.57, 2.62, 3.14}) {
          SCOPED_TRACE(testing::Message() << "seed " << seed << ", off " << off_rad << " rad, " << speed_mps << " m/s"
                                          << (constrained ? ", constrained" : ""));
          param::Parameters n = rover_like();
          n.inertial.constrain_every_us = constrained ? 100'000 : 0;
          Drive d(n, seed);
          const Alone all = drive_alone(d, off_rad, speed_mps);
          EXPECT_EQ(all.mode, sensor::Mode::kNominal);
          if (std::abs(off_rad) < 0.1) {
            EXPECT_EQ(all.said, 0);
            EXPECT_LT(all.worst_m, 1.0);
            EXPECT_LT(all.worst_sigmas, 4.5);
            continue;
          }
          const bool seen = constrained || speed_mps > 1.5;
          EXPECT_LT(all.worst_m, 30.0);
          EXPECT_LT(all.wrong_until_s, seen ? 85.0 : 155.0) << "by its first stop; by a turn where that shows little";
          EXPECT_LT(all.without_s, 1.5) << "how it moved was watched all the time";
          EXPECT_LT(all.end_m, 5.0);
          EXPECT_LT(all.end_sigmas, 7.0);
          if (seen && std::abs(off_rad) > 1.5) {
            EXPECT_LE(all.said, 1) << "velocities may pull it round";
            EXPECT_TRUE(all.said == 0 || all.last == sensor::ResetCause::kHeadingWrong);
            EXPECT_LT(all.end_sigmas, 4.5);
          }
        }
}

/// Positions alone, and an IMU that is believed a little too much: where its velocity is lost, nothing else can tell.
TEST(InertialDivergence, APositionReceiverAloneIsNotFlownAwayFrom) {
  for (const unsigned seed : {15U, 17U})
    for (const double off_rad : {0.0, 1.05, 2.62}) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << ", off " << off_rad);
      Drive d(parameters(), seed);
      d.gnss_velocity = false;
      const Alone all = drive_alone(d, off_rad, 2.0);
      EXPECT_LT(all.worst_m, 300.0) << "kilometres, where it waits four minutes";
      if (off_rad > 0 || all.worst_m > 30.0) {
        EXPECT_GE(all.said, 1);
      }
      EXPECT_LT(all.end_m, 12.0);
      EXPECT_EQ(all.mode, sensor::Mode::kNominal);
    }
}

/// The estimator held to the line along which it believes to look: unknown is how far, not where to.
TEST(InertialDivergence, NorWhereItIsHeldToAWrongLine) {
  for (const unsigned seed : {1U, 2U, 3U})
    for (const double speed_mps : {1.0, 2.0, 5.0})
      for (const double off_rad : {1.05, -1.57, 2.62}) {
        SCOPED_TRACE(testing::Message() << "seed " << seed << ", off " << off_rad << ", " << speed_mps << " m/s");
        param::Parameters n = rover_like();
        n.inertial.constrain_every_us = 100'000;
        Drive d(n, seed);
        d.gnss_velocity = false;
        const Alone all = drive_alone(d, off_rad, speed_mps);
        EXPECT_LT(all.worst_m, speed_mps > 1.5 ? 250.0 : 60.0) << "to the first stop: 640 m and 370 m";
        EXPECT_LT(all.worst_sigmas, 40.0) << "and 300 sigma";
        EXPECT_LT(all.end_m, 16.0);
        EXPECT_LT(all.end_sigmas, 4.5);
      }
}

/// Fixes that agree on another place are a jump, and have to last a minute.
TEST(InertialDivergence, AJumpOfAPositionReceiverAloneIsRefused) {
  Drive d(parameters(), 1);
  d.wheels = d.gnss_velocity = false;
  d.turn_radps = 0.3;
  d.place();
  d.run(60);
  d.clear();
  d.tamper = [&](Drive::Fix& fix) {
    fix.east_m += 100;
    return true;
  };
  d.run(40);
  EXPECT_EQ(d.counted('a'), 0) << d.verdicts;
  EXPECT_EQ(d.estimator.jump().count, 0);
  EXPECT_LT(d.worst_m, 40.0);
  d.tamper = [](Drive::Fix&) { return true; };
  d.run(30);
  EXPECT_LT(d.error_m(), 3.0);
}

/// Glitches of the velocity that are long over, and one fix that is far off: no reason to forget where it is.
TEST(InertialDivergence, AFilterThatRecoveredIsNotErasedByOneFix) {
  Drive d;
  d.wheels = false;
  d.place();
  d.run(30);
  bool fixes = false;
  double off_m = 0;
  d.tamper = [&](Drive::Fix& fix) {
    fix.east_m += off_m;
    return fixes;
  };
  for (int glitch = 0; glitch < 3; ++glitch) {
    for (int i = 0; i < 20; ++i) {
      d.estimator.fuse(sensor::GnssVelocity{.v_n_mps = {6, -6, 0}, .acc_mps = 0.05F}, {d.us}, d.ctx());
      d.run(0.2);
    }
    for (int i = 0; i < 100; ++i) {
      d.estimator.fuse(sensor::GnssVelocity{.v_n_mps = {static_cast<float>(d.speed_mps * std::cos(d.yaw_rad)),
                                                        static_cast<float>(d.speed_mps * std::sin(d.yaw_rad)), 0},
                                            .acc_mps = 0.05F},
                       {d.us}, d.ctx());
      d.run(0.2);
    }
  }
  fixes = true;
  off_m = 200;
  d.run(0.2);
  fixes = false;
  d.run(5);
  EXPECT_TRUE(d.tracking());
  EXPECT_EQ(d.estimator.jump().count, 0);
}

/// An antenna ahead of the axle moves sideways in every curve: nothing is wrong with the heading.
TEST(InertialDivergence, AnAntennaThatSwingsIsNoWrongHeading) {
  param::Parameters n = rover_like();
  n.gnss.antenna_x_b_m = 0.6F;
  Drive d(n);
  d.speed_mps = 0.6;
  d.place();
  d.run(5);
  d.turn_radps = 1;
  d.clear();
  d.run(30);
  EXPECT_EQ(d.estimator.jump().count, 0);
  EXPECT_LT(d.worst_sigmas, 4.5);
  EXPECT_EQ(d.estimator.mode(d.ctx()), sensor::Mode::kNominal);
}

/// Wheels that stand on a ferry: fixes that are refused for long are right all the same.
TEST(InertialDivergence, WheelsThatAgreeDoNotHoldItForEver) {
  Drive d = settled();
  d.speed_mps = d.turn_radps = 0;
  d.run(20);
  d.gnss_velocity = false;
  const auto go = [&](double seconds, bool heard) {
    d.tamper = [heard](Drive::Fix&) { return heard; };
    for (int i = 0; i < static_cast<int>(seconds / 0.2); ++i) {
      d.unseen_east_m = 2;
      d.run(0.2);
      if (heard) d.estimator.fuse(sensor::GnssVelocity{.v_n_mps = {10, 0, 0}, .acc_mps = 0.05F}, {d.us}, d.ctx());
    }
  };
  go(10, false);
  go(290, true);
  EXPECT_LT(d.error_m(), 40.0);  // 3 km if it believed its wheels
}

/// A receiver that is wrong in place and speed for half a minute. After a whole minute its fixes are believed. The
/// wheels show that the filter is right.
TEST(InertialDivergence, AReceiverThatLiesInAllItSaysStartsNothingAnew) {
  Drive d = settled();
  d.tamper = [](Drive::Fix& fix) {
    fix.east_m += 300;
    return true;
  };
  d.gnss_velocity = false;
  for (int i = 0; i < 150; ++i) {
    d.run(0.2);
    d.estimator.fuse(sensor::GnssVelocity{.v_n_mps = {25, -10, 0}, .acc_mps = 0.05F}, {d.us}, d.ctx());
  }
  EXPECT_TRUE(d.tracking());
  EXPECT_EQ(d.estimator.jump().count, 0);
  EXPECT_LT(d.worst_m, 3.0);
}

}  // namespace
}  // namespace tetap::estimators
