// SPDX-License-Identifier: Apache-2.0
// Effects that GNSS may have on the inertial estimator, and those it must not have. Cases: jumps, ramps, silence,
// frozen and half wrong fixes, glitches at the start.
#include "inertial_drive.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>

namespace tetap::estimators {
namespace {

/// Between two times of the drive.
auto between(const Drive& d, double from_s, double to_s, std::function<void(Drive::Fix&, double)> what) {
  return [&d, from_s, to_s, what = std::move(what)](Drive::Fix& fix) {
    if (d.time_s() >= from_s && d.time_s() < to_s) what(fix, d.time_s() - from_s);
    return true;
  };
}
constexpr double kHonest = 4.5;  ///< sigmas of a horizontal error that a run may reach once

TEST(Glitch, AJumpIsRefusedAndTheFixesAfterItAreRightAtOnce) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    Drive d = settled(parameters(), seed);
    d.tamper = between(d, 60, 80, [](Drive::Fix& fix, double) { fix.east_m += 100; });
    d.run(19.9);
    EXPECT_EQ(d.counted('a'), 0) << d.verdicts;
    EXPECT_EQ(d.estimator.mode(d.ctx()), sensor::Mode::kDegraded);
    d.verdicts.clear();
    d.run(10);
    EXPECT_EQ(d.verdicts.substr(1, 3), "aaa");
    EXPECT_EQ(d.estimator.jump().count, 0);
    EXPECT_LT(d.worst_m, 0.6);
    EXPECT_LT(d.worst_sigmas, kHonest);
  }
}

TEST(Glitch, AVelocityThatIsOffIsRefusedAndMovesNothing) {
  for (const bool wheels : {true, false}) {
    Drive d = settled();
    d.wheels = wheels;
    d.tamper = between(d, 60, 63, [](Drive::Fix& fix, double) { fix.east_off_mps = 5; });
    while (d.time_s() < 62.7) {
      d.run(0.2);
      if (d.time_s() < 60.3) continue;
      EXPECT_EQ(d.last_velocity.verdict, sensor::Verdict::kRejected) << d.time_s();
      EXPECT_GT(d.last_velocity.nis, 5 * d.last_velocity.gate);
    }
    EXPECT_EQ(d.counted('R'), 0) << "its places are right: " << d.verdicts;
    d.run(5);
    EXPECT_EQ(d.last_velocity.verdict, sensor::Verdict::kAccepted);
    EXPECT_EQ(d.estimator.jump().count, 0);
    EXPECT_LT(d.worst_m, 0.6) << (wheels ? "wheels" : "no wheels");
    EXPECT_LT(d.worst_sigmas, kHonest);
  }
}

TEST(Glitch, AJumpThatPersistsIsTakenWithItsSizeAndCount) {
  Drive d = settled();
  d.tamper = between(d, 60, 1e9, [](Drive::Fix& fix, double) { fix.east_m += 100, fix.north_m -= 40; });
  d.run(59.5);
  EXPECT_EQ(d.estimator.jump().count, 0) << "not before the stated time";
  EXPECT_LT(d.error_m(), 1.0);
  const double heading_rad = d.sigma_yaw_rad();
  for (int i = 0; i < 15 && d.estimator.jump().count == 0; ++i) d.run(0.1);
  ASSERT_EQ(d.estimator.jump().count, 1);
  EXPECT_GT(d.sigma_yaw_rad(), 5 * heading_rad) << "it may have turned, too";
  EXPECT_NEAR(d.estimator.jump().east_m, 100.0F, 1.0F);
  EXPECT_NEAR(d.estimator.jump().north_m, -40.0F, 1.0F);
  EXPECT_EQ(d.estimator.jump().cause, sensor::ResetCause::kPositionJump);
  EXPECT_NEAR(d.error_m(), std::hypot(100, 40), 2.0) << "it is where the fixes are";
  d.verdicts.clear();
  d.run(30);
  EXPECT_LE(d.counted('R'), 6) << "and but for the gate's hundredth they are followed: " << d.verdicts;
}

TEST(Glitch, OneThatWasTakenIsTakenBackWithoutWaiting) {
  Drive d = settled();
  d.tamper = between(d, 60, 140, [](Drive::Fix& fix, double) { fix.east_m += 100; });
  d.run(79.9);
  ASSERT_EQ(d.estimator.jump().count, 1);
  for (int fixes = 1; fixes <= 5; ++fixes) {
    ASSERT_EQ(d.estimator.jump().count, 1) << fixes;
    d.run(0.2);
  }
  EXPECT_EQ(d.estimator.jump().count, 2) << "dead reckoning from before says the same as five fixes now";
  EXPECT_EQ(d.estimator.jump().cause, sensor::ResetCause::kPositionJump);
  EXPECT_NEAR(d.estimator.jump().east_m, -100.0F, 3.0F);
  EXPECT_NEAR(d.estimator.jump().north_m, 0.0F, 3.0F);
  EXPECT_LT(d.error_m(), 2.0);
  d.tamper = between(d, 143, 1e9, [](Drive::Fix& fix, double) { fix.east_m += 100; });
  d.run(30);
  EXPECT_EQ(d.estimator.jump().count, 2) << "but there it stays";
}

TEST(Glitch, CarriedAwayUnseenItFindsItselfAgain) {
  Drive d = settled();
  d.unseen_east_m = 25;
  d.run(62);
  EXPECT_EQ(d.estimator.jump().count, 1);
  EXPECT_LT(d.error_m(), 2.0);
  d.clear();
  d.run(60);
  EXPECT_LT(d.worst_sigmas, kHonest);
}

TEST(Glitch, APoseFromOutsideEndsWhatFixesClaimed) {
  Drive d = settled();
  d.tamper = between(d, 60, 1e9, [](Drive::Fix& fix, double) { fix.east_m += 100; });
  d.run(50);
  d.place();
  d.run(30);
  EXPECT_EQ(d.estimator.jump().count, 0) << "80 s of them, but only 30 s since somebody knew better";
  d.run(32);
  EXPECT_EQ(d.estimator.jump().count, 1);
}

// Fixes that agree with nothing, not even with the velocity of their own receiver, are never followed.
TEST(Glitch, FixesThatWanderWhileEverythingElseAgreesAreNeverFollowed) {
  Drive d = settled();
  d.tamper = between(d, 60, 1e9, [](Drive::Fix& fix, double t) { fix.east_m += 60 * (1 + std::floor(t / 7)); });
  d.run(400);
  EXPECT_EQ(d.estimator.jump().count, 0);
  EXPECT_LT(d.error_m(), 4.0);
}

TEST(Glitch, FixesThatComeRarelyHaveToBeManyToPersist) {
  Drive d = settled();
  d.gnss_every_us = 1'000'000;
  d.tamper = between(d, 60, 165, [](Drive::Fix& fix, double) { fix.north_m += 300; });
  d.run(115);
  EXPECT_EQ(d.estimator.jump().count, 0) << "105 fixes in 105 s";
  EXPECT_LT(d.error_m(), 1.0);
}

TEST(Glitch, ARampHasHardlyAnyEffectWhereErrorsLastAndLittleWhereTheyAreNew) {
  for (unsigned seed = 1; seed <= 5; ++seed)
    for (const bool lasts : {true, false}) {
      param::Parameters n = parameters();
      n.gnss.correlation_s = lasts ? 60 : 0;
      Drive d(n, seed);
      d.white_m = lasts ? 0.3 : 1.0;
      d.lasting_m = lasts ? 0.8 : 0.0;
      d.place();
      d.run(60);
      d.clear();
      Drive without = d;
      d.tamper = between(d, 60, 90, [](Drive::Fix& fix, double t) { fix.north_m += t; });
      d.run(30);
      without.run(30);
      EXPECT_GE(d.counted('R'), 120) << "refused after 6 s at most: " << d.verdicts;
      EXPECT_LT(d.apart_m(without), lasts ? 0.25 : 0.6) << seed;
      d.run(1);
      d.verdicts.clear();
      d.run(40);
      EXPECT_LE(d.counted('R'), 4) << d.verdicts;
      EXPECT_EQ(d.estimator.jump().count, 0);
      EXPECT_LT(d.worst_sigmas, kHonest) << seed << ' ' << lasts;
    }
}

TEST(Glitch, AnOffsetThatStaysInsideItsGateIsFollowedAfterAWhile) {
  Drive d = settled();
  d.tamper = between(d, 60, 1e9, [](Drive::Fix& fix, double t) { fix.north_m += std::min(t, 2.5); });
  d.run(30);
  d.verdicts.clear();
  d.run(30);
  EXPECT_LE(d.counted('R'), 6) << "but for the gate's hundredth: " << d.verdicts;
  EXPECT_EQ(d.estimator.jump().count, 0);
}

TEST(Glitch, WhatTheFixesLedItAwayByIsDoubted) {
  // Weak dead reckoning, so that the first seconds of a ramp move the position by more than its sigma.
  param::Parameters n = parameters();
  n.inertial.slip_share = 1.0F;
  double nees = 0;
  int judged = 0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    Drive d = settled(n, seed);
    d.tamper = between(d, 60, 90, [](Drive::Fix& fix, double t) { fix.north_m += t; });
    d.run(10);
    d.clear();
    d.run(20);
    nees += d.nees / d.judged;
    ++judged;
  }
  EXPECT_LT(nees / judged, 4.0) << "two degrees of freedom";
}

TEST(Glitch, AfterALongOutageFixesFarOffAreNeverTakenAndRightOnesAre) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    Drive d = settled(parameters(), seed);
    int fixes = 0;
    d.tamper = [&](Drive::Fix& fix) {
      if (d.time_s() < 60 + 211) return false;
      if (++fixes <= 105) fix.east_m -= 800;
      return true;
    };
    d.run(211);
    const double lost_m = d.error_m();
    d.run(104 * 0.2);
    ASSERT_EQ(d.verdicts.size(), 105U);
    EXPECT_EQ(d.counted('a'), 0) << d.verdicts;
    EXPECT_LT(d.error_m(), lost_m + 3);
    EXPECT_LT(d.worst_sigmas, kHonest);
    d.verdicts.clear();
    d.run(20);
    EXPECT_GE(d.counted('a'), 90) << d.verdicts;
    EXPECT_LT(d.error_m(), 1.5);
    EXPECT_EQ(d.estimator.jump().count, 0);
  }
}

TEST(Glitch, AfterAnOutageOneBadFixDoesNotDecide) {
  param::Parameters n = parameters();
  n.inertial.slip_share = 1.0F;  // lost enough that a fix metres off is inside the gate
  for (const int bad : {1, 3}) {
    Drive d = settled(n);
    d.gnss_velocity = false;
    d.white_m = 0.1;
    int fixes = 0;
    d.tamper = [&](Drive::Fix& fix) {
      if (d.time_s() < 60 + 100) return false;
      if (++fixes <= bad) fix.east_m += 2 * d.sigma_m();
      return true;
    };
    d.run(100);
    ASSERT_GT(d.sigma_m(), 0.4);
    const double lost_m = d.error_m();
    d.run(0.2 * (bad - 1));
    EXPECT_EQ(d.verdicts, std::string(static_cast<std::size_t>(bad), 'n'));
    EXPECT_LT(d.error_m(), lost_m + 0.1);
    d.run(5);
    EXPECT_LT(d.error_m(), 0.5) << d.verdicts;
  }
}

TEST(Glitch, AFrozenReceiverIsStaleAndBelievedAgainWhenItMoves) {
  Drive d = settled();
  d.tamper = between(d, 60, 75, [](Drive::Fix& fix, double) { fix.repeated = true; });
  d.run(14.9);
  EXPECT_GE(d.counted('s'), 70) << d.verdicts;
  EXPECT_EQ(d.last_velocity.verdict, sensor::Verdict::kStale) << "its velocity is as old";
  EXPECT_LT(d.worst_m, 0.6);
  d.verdicts.clear();
  d.run(10);
  EXPECT_EQ(d.counted('s'), 0);
  EXPECT_GE(d.counted('a'), 48) << d.verdicts;
  EXPECT_EQ(d.last_velocity.verdict, sensor::Verdict::kAccepted);
  EXPECT_LT(d.worst_sigmas, kHonest);
}

TEST(Glitch, StandingStillARepeatedFixIsNotStale) {
  Drive d = settled();
  d.speed_mps = d.turn_radps = 0;
  d.tamper = between(d, 62, 1e9, [](Drive::Fix& fix, double) { fix.repeated = true; });
  d.run(30);
  EXPECT_EQ(d.counted('s'), 0);
}

TEST(Glitch, AWrongHeightCostsTheHeightAlone) {
  Drive d = settled();
  d.tamper = between(d, 60, 90, [](Drive::Fix& fix, double) { fix.up_m += 47; });
  d.run(29.9);
  EXPECT_GE(d.counted('a'), 145) << d.verdicts;
  EXPECT_EQ(d.last_fix.dof, 2) << "the record says that it is half a fix";
  EXPECT_EQ(d.estimator.mode(d.ctx()), sensor::Mode::kDegraded);
  EXPECT_LT(d.height_error_m(), 2.0);
  d.run(10);
  EXPECT_EQ(d.last_fix.dof, 3);
  EXPECT_EQ(d.estimator.mode(d.ctx()), sensor::Mode::kNominal);
  EXPECT_LT(d.height_error_m(), 2.0);
  EXPECT_LT(d.worst_sigmas, kHonest);
}

TEST(Glitch, AHeightThatPersistsIsTaken) {
  Drive d = settled();
  d.tamper = between(d, 60, 1e9, [](Drive::Fix& fix, double) { fix.up_m += 47; });
  d.run(62);
  EXPECT_EQ(d.estimator.jump().count, 1);
  EXPECT_EQ(d.estimator.jump().east_m, 0.0F);
  EXPECT_NEAR(d.estimator.jump().up_m, 47.0F, 3.0F);
  EXPECT_NEAR(d.height_error_m(), 47, 3);
}

TEST(Glitch, AFixWithoutAHeightPlacesItInThePlane) {
  Drive d = settled();
  d.place(5, 10);
  d.tamper = between(d, 60, 1e9, [](Drive::Fix& fix, double) { fix.up_m = std::nan(""); });
  const double height_m = d.height_error_m();
  d.run(20);
  EXPECT_LT(d.error_m(), 1.5);
  EXPECT_LT(d.height_error_m(), height_m + 2);
}

TEST(Glitch, AFirstFixThatIsOneDoesNotBecomeTheStart) {
  for (const int bad : {1, 3, 4, 5}) {  // levelled after a second, it would begin with the fourth
    Drive d;
    d.speed_mps = 2;
    int fixes = 0;
    d.tamper = [&](Drive::Fix& fix) {
      if (++fixes == bad) fix.east_m += 100;
      return true;
    };
    double worst_heading_rad = 0;  // of those it said to be valid
    const auto run = [&](double duration_s) {
      for (int i = 0; i < std::lround(duration_s * 100); ++i) {
        d.run(0.01);
        if (d.estimator.estimate(d.ctx()).heading_valid)
          worst_heading_rad = std::max(worst_heading_rad, d.yaw_error_rad());
      }
    };
    run(12);
    ASSERT_TRUE(d.tracking());
    EXPECT_LT(d.error_m(), 3.0);
    d.clear();
    run(60);
    EXPECT_LT(d.worst_sigmas, kHonest) << bad;
    EXPECT_EQ(d.estimator.jump().count, 0);
    EXPECT_TRUE(d.estimator.estimate(d.ctx()).heading_valid) << bad;
    EXPECT_LT(d.yaw_error_rad(), 3 * d.sigma_yaw_rad()) << bad;
    EXPECT_LT(worst_heading_rad, 10 * 3.14159265358979 / 180) << bad;
  }
}

/// NEES of the horizontal position over 30 drives of 200 s, with errors that last.
double mean_nees(float modelled_s, double* rmse_m = nullptr) {
  double nees = 0, squares = 0;
  constexpr unsigned kSeeds = 30;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    param::Parameters n = parameters();
    n.gnss.correlation_s = modelled_s;
    Drive d(n, seed);
    d.white_m = 0.3;
    d.lasting_m = 0.8;
    d.place(0, 0.5F);
    d.run(30);
    d.clear();
    for (int i = 0; i < 10; ++i) {
      d.run(17);
      squares += d.error_m() * d.error_m() / (10 * kSeeds);
    }
    nees += d.nees / d.judged / kSeeds;
  }
  if (rmse_m != nullptr) *rmse_m = std::sqrt(squares);
  return nees;
}

TEST(Lasting, ErrorsThatLastLeaveAnHonestCovarianceWhenTheyAreKnownToLast) {
  double modelled_m = 0, unmodelled_m = 0;
  const double modelled = mean_nees(60, &modelled_m), unmodelled = mean_nees(0, &unmodelled_m);
  EXPECT_GT(modelled, 1.0);
  EXPECT_LT(modelled, 3.0) << "two degrees of freedom, 30 seeds of some three independent errors each";
  EXPECT_GT(unmodelled, 10 * modelled);
  EXPECT_LE(modelled_m, unmodelled_m);
}

TEST(Lasting, AStartWithoutAPlaceIsAsUncertainAsItsFirstFixes) {
  // The fixes' common error stays, and the accuracy figure of that moment is off by a fifth. For minutes nothing is
  // known but what the start made of both.
  double nees = 0;
  constexpr unsigned kSeeds = 200;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    param::Parameters n = parameters();
    n.gnss.correlation_s = 60;
    Drive d(n, seed);
    d.white_m = 0.3;
    d.lasting_m = 0.8;
    std::mt19937 figure(1000 + seed);
    d.stated_ratio = std::clamp(std::normal_distribution{1.0, 0.2}(figure), 0.5, 2.0);
    d.run(20);
    ASSERT_TRUE(d.tracking()) << seed;
    d.clear();
    d.run(Drive::kStep_us * 1e-6);
    const double up = d.height_error_m() / d.height_sigma_m();
    nees += (d.nees + up * up) / kSeeds;
  }
  // Three degrees of freedom, times 1.14 (the mean of the figure's inverse square), over kStartPositionInflation
  // squared.
  EXPECT_NEAR(nees, 2.27, 0.55) << "3 sigma of the mean; with the receiver's own figure it is 3.2";
}

TEST(Lasting, WhereItBeginsCountsAsTheFigureThatMayBeOffAndOtherwiseAsTheReceiverSays) {
  for (const float lasts_s : {0.0F, 60.0F})
    for (const bool given : {false, true}) {
      param::Parameters n = parameters();
      n.gnss.correlation_s = lasts_s;
      Drive d(n);
      if (given) {
        d.speed_mps = d.turn_radps = 0;
        d.place();
      }
      while (!d.tracking() && d.time_s() < 30) d.run(Drive::kStep_us * 1e-6);
      ASSERT_TRUE(d.tracking());
      const double modelled = lasts_s > 0 ? static_cast<double>(checks::kStartPositionInflation) : 1;
      EXPECT_NEAR(d.height_sigma_m(), 1.5 * modelled, 0.03) << lasts_s << ' ' << given;
      EXPECT_NEAR(d.sigma_m(), given ? 0.1 : modelled, 0.1) << lasts_s << ' ' << given;
    }
}

TEST(Lasting, ItIsTheReceiversOwnSigmaThatTheGateIsMadeOf) {
  param::Parameters n = parameters();
  n.gnss.correlation_s = 60;
  Drive d = settled(n);
  d.white_m = 0.3;
  d.tamper = between(d, 65, 66, [](Drive::Fix& fix, double) { fix.east_m += 8; });
  d.run(7);
  EXPECT_GE(d.counted('R'), 4) << "8 m at a sigma of 0.3 m, though a fix is worth 7 m: " << d.verdicts;
}

TEST(NeverNan, NoAccuracyAndNoCoordinateBreaksIt) {
  Drive d = settled();
  for (const float acc : {base::kNan, base::kInfinity, 0.0F, -1.0F, 3e38F, 1e-38F})
    for (const float height : {500.0F, base::kNan, 3e38F, -3e38F})
      for (const std::int64_t latitude : {24'131'350'000LL, 0LL, 45'000'000'000LL, -60'000'000'000LL}) {
        sensor::GnssPosition fix{.latitude_2ndeg = latitude,
                                 .longitude_2ndeg = 5'834'150'000,
                                 .height_m = height,
                                 .horizontal_acc_m = acc,
                                 .vertical_acc_m = acc,
                                 .fix = sensor::GnssFix::k3d};
        for (int i = 0; i < 7; ++i) static_cast<void>(d.estimator.fuse(fix, {d.us + i}, d.ctx()));
        const InertialEstimate now = d.estimator.inertial(d.ctx());
        ASSERT_TRUE(now.state.finite()) << acc << ' ' << height << ' ' << latitude;
        ASSERT_TRUE(now.p.positive_definite()) << acc << ' ' << height << ' ' << latitude;
      }
}

}  // namespace
}  // namespace tetap::estimators
