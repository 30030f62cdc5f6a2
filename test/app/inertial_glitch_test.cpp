// SPDX-License-Identifier: Apache-2.0
// What GNSS may do to the inertial estimator, and what it must not: jumps, ramps, silence, frozen and half wrong fixes,
// glitches at the start. A rover drives on a flat plane; its IMU is as noisy as the estimator is told, its wheels are
// exact, its receiver errs as stated. Errors are judged against what the estimator says of itself.
#include "app/estimators/inertial.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace tetap::app {
namespace {

constexpr double kMetre_2ndeg = 1 / (2e-9 * 111'320);  ///< of latitude, near enough for a few hundred metres

Numbers numbers() {
  Numbers n;
  n.wheels.drive = {.left_radius_m = 0.1F, .right_radius_m = 0.1F, .track_m = 0.5F, .counts_per_turn = 20'000};
  n.inertial.gyro_radps_rthz = 2e-4F;
  n.inertial.accel_mps2_rthz = 5e-3F;
  n.inertial.slip_share = 0.05F;
  n.gnss.sigma_floor_m = 0.01F;
  return n;
}

class Drive {
 public:
  explicit Drive(const Numbers& of = numbers(), unsigned seed = 1) : n(of), engine_(seed) {
    site.frame = nav::LocalFrame(24'131'350'000, 5'834'150'000, 500.0F);
    site.origin = can::OriginSource::kConfigured;
    gravity_mps2_ = nav::Earth::at(site.frame, false).gravity_mps2;
    estimator.restart({us}, with());
  }
  /// Somebody says where it is.
  void place(double off_m = 0, float sigma_m = 0.1F) {
    estimator.set_pose({us},
                       {.pose = {.x = base::Anchored{}.plus(static_cast<float>(east_m + off_m)),
                                 .y = base::Anchored{}.plus(static_cast<float>(north_m)),
                                 .yaw_rad = static_cast<float>(yaw_rad)},
                        .sigma_position_m = sigma_m,
                        .sigma_yaw_rad = 0.02F},
                       with());
  }

  Numbers n;
  Site site;
  Inertial estimator;
  double east_m = 0, north_m = 0, up_m = 0, yaw_rad = 0.3, speed_mps = 1, turn_radps = 0.05;
  double unseen_east_m = 0;  ///< it is carried, and no sensor of motion shows it
  double white_m = 1, lasting_m = 0, lasting_s = 60;
  std::int64_t gnss_every_us = 200'000;
  bool wheels = true, speedometer = false, gnss_velocity = true;
  /// What the world does to a fix; false: it does not come.
  struct Fix {
    double east_m = 0, north_m = 0, up_m = 0;
    bool repeated = false;  ///< the last one again
  };
  std::function<bool(Fix&)> tamper = [](Fix&) { return true; };

  std::string verdicts;  ///< of positions, one letter each
  Innovation last_fix, last_velocity;
  double worst_m = 0;       ///< error since clear()
  double worst_sigmas = 0;  ///< and in the estimator's own sigma
  double nees = 0;          ///< sum of the horizontal ones, and how many
  int judged = 0;

  [[nodiscard]] Context with() const { return {n, site}; }
  [[nodiscard]] double time_s() const { return 1e-6 * static_cast<double>(us - kBegin_us); }
  [[nodiscard]] double error_m() const {
    const auto& x = now_.state;
    return std::hypot(off(x.x, east_m), off(x.y, north_m));
  }
  [[nodiscard]] double apart_m(const Drive& other) const {
    return std::hypot(static_cast<double>(now_.state.x.minus(other.now_.state.x)),
                      static_cast<double>(now_.state.y.minus(other.now_.state.y)));
  }
  [[nodiscard]] double height_error_m() const { return std::abs(off(now_.state.z, up_m)); }
  [[nodiscard]] double sigma_m() const { return std::sqrt(static_cast<double>(now_.p(0, 0) + now_.p(1, 1)) / 2); }
  [[nodiscard]] bool tracking() const { return now_.valid; }
  [[nodiscard]] long counted(char verdict) const { return std::count(verdicts.begin(), verdicts.end(), verdict); }
  void clear() {
    worst_m = worst_sigmas = nees = 0;
    judged = 0;
    verdicts.clear();
  }
  void run(double duration_s) {
    for (const std::int64_t end = us + std::llround(duration_s * 1e6); us < end;) step();
  }
  static constexpr std::int64_t kBegin_us = 1'000'000, kStep_us = 10'000;
  std::int64_t us = kBegin_us;

 private:
  static double off(const base::Anchored& of, double truth_m) { return 1e-6 * static_cast<double>(of.um()) - truth_m; }
  double normal() { return normal_(engine_); }

  void step() {
    constexpr double dt = 1e-6 * kStep_us;
    us += kStep_us;
    yaw_rad += turn_radps * dt;
    const double middle = yaw_rad - 0.5 * turn_radps * dt;
    east_m += speed_mps * std::cos(middle) * dt + std::exchange(unseen_east_m, 0);
    north_m += speed_mps * std::sin(middle) * dt;
    const auto shake = [this](double sigma) { return static_cast<float>(sigma * normal_imu_(engine_imu_)); };
    const double pushed = time_s() < 0.015 ? 0 : speed_mps - last_mps_;
    last_mps_ = speed_mps;
    estimator.fuse(
        ImuSample{.dangle_b_rad = {shake(2e-5), shake(2e-5), static_cast<float>(turn_radps * dt) + shake(2e-5)},
                  .dvelocity_b_mps = {static_cast<float>(pushed) + shake(5e-4),
                                      static_cast<float>(speed_mps * turn_radps * dt) + shake(5e-4),
                                      gravity_mps2_ * static_cast<float>(dt) + shake(5e-4)},
                  .interval_us = kStep_us},
        {us}, with());
    if (wheels) {
      const double per_m = 20'000 / (2 * 3.14159265358979 * 0.1);
      left_ += (speed_mps - 0.25 * turn_radps) * dt * per_m;
      right_ += (speed_mps + 0.25 * turn_radps) * dt * per_m;
      estimator.fuse(WheelCounts{static_cast<std::uint16_t>(std::llround(left_)),
                                 static_cast<std::uint16_t>(std::llround(right_))},
                     {us}, with());
    }
    if (speedometer) estimator.fuse(BodySpeed{.forward_mps = static_cast<float>(speed_mps)}, {us}, with());
    if ((us - kBegin_us) % gnss_every_us == 0) receive();
    estimator.advance({us}, with(), std::vector<Sample>{});
    const InertialEstimate now = estimator.inertial(with());
    now_ = {.state = now.state, .p = now.p, .valid = now.valid};
    if (!now_.valid) return;
    worst_m = std::max(worst_m, error_m());
    worst_sigmas = std::max(worst_sigmas, error_m() / sigma_m());
    const double e = off(now_.state.x, east_m), m = off(now_.state.y, north_m);
    const auto p = [this](int r, int c) { return static_cast<double>(now_.p(r, c)); };
    const double determinant = p(0, 0) * p(1, 1) - p(0, 1) * p(0, 1);
    nees += (e * e * p(1, 1) - 2 * e * m * p(0, 1) + m * m * p(0, 0)) / determinant;
    ++judged;
  }
  void receive() {
    const double keep = std::exp(-1e-6 * static_cast<double>(gnss_every_us) / lasting_s);
    const double ahead_m = static_cast<double>(n.gnss.antenna_x_b_m), sideways_mps = turn_radps * ahead_m;
    Fix fix{
        .east_m = east_m + ahead_m * std::cos(yaw_rad), .north_m = north_m + ahead_m * std::sin(yaw_rad), .up_m = up_m};
    const std::array<double*, 3> axes{&fix.east_m, &fix.north_m, &fix.up_m};
    for (std::size_t i = 0; i < 3; ++i) {
      double& lasts = lasting_[i];
      lasts = begun_ ? keep * lasts + std::sqrt(1 - keep * keep) * normal() : normal();
      *axes[i] += (i == 2 ? 1.5 : 1.0) * (white_m * normal() + lasting_m * lasts);
    }
    begun_ = true;
    const auto noise = [this] { return static_cast<float>(0.05 * normal()); };
    const double east_mps = speed_mps * std::cos(yaw_rad) - sideways_mps * std::sin(yaw_rad);
    const double north_mps = speed_mps * std::sin(yaw_rad) + sideways_mps * std::cos(yaw_rad);
    GnssVelocity velocity{
        .v_n_mps = {static_cast<float>(east_mps) + noise(), static_cast<float>(north_mps) + noise(), noise()},
        .acc_mps = 0.05F};
    if (!tamper(fix)) return;
    const double cosine = std::cos(24'131'350'000 * 2e-9 * 3.14159265358979 / 180);
    const auto sigma = static_cast<float>(std::hypot(white_m, lasting_m));
    if (!fix.repeated) {
      said_ = {.latitude_2ndeg = 24'131'350'000 + std::llround(fix.north_m * kMetre_2ndeg),
               .longitude_2ndeg = 5'834'150'000 + std::llround(fix.east_m * kMetre_2ndeg / cosine),
               .height_m = static_cast<float>(500 + fix.up_m),
               .horizontal_acc_m = sigma,
               .vertical_acc_m = 1.5F * sigma,
               .fix = GnssFix::k3d};
      said_velocity_ = velocity;
    }
    last_fix = estimator.fuse(said_, {us}, with());
    verdicts += "aRnTUSFs"[static_cast<std::size_t>(last_fix.verdict)];
    if (gnss_velocity) last_velocity = estimator.fuse(said_velocity_, {us}, with());
  }

  std::mt19937 engine_;
  std::normal_distribution<double> normal_;
  std::mt19937 engine_imu_{99};  ///< of the IMU: an exact one would be a stuck one
  std::normal_distribution<double> normal_imu_;
  float gravity_mps2_ = 0;
  double left_ = 0, right_ = 0, last_mps_ = 1;
  std::array<double, 3> lasting_{};
  bool begun_ = false;
  GnssPosition said_;
  GnssVelocity said_velocity_;
  struct {
    nav::InsState state;
    nav::Ins::Covariance p;
    bool valid = false;
  } now_;
};

/// A drive that has found itself.
Drive settled(const Numbers& of = numbers(), unsigned seed = 1) {
  Drive d(of, seed);
  d.place();
  d.run(60);
  EXPECT_TRUE(d.tracking());
  EXPECT_LT(d.error_m(), 1.0);
  d.clear();
  return d;
}
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
    Drive d = settled(numbers(), seed);
    d.tamper = between(d, 60, 80, [](Drive::Fix& fix, double) { fix.east_m += 100; });
    d.run(19.9);
    EXPECT_EQ(d.counted('a'), 0) << d.verdicts;
    EXPECT_EQ(d.estimator.mode(d.with()), can::Mode::kDegraded);
    d.verdicts.clear();
    d.run(10);
    EXPECT_EQ(d.verdicts.substr(1, 3), "aaa");
    EXPECT_EQ(d.estimator.jump().count, 0);
    EXPECT_LT(d.worst_m, 0.6);
    EXPECT_LT(d.worst_sigmas, kHonest);
  }
}

TEST(Glitch, AJumpThatPersistsIsTakenWithItsSizeAndCount) {
  Drive d = settled();
  d.tamper = between(d, 60, 1e9, [](Drive::Fix& fix, double) { fix.east_m += 100, fix.north_m -= 40; });
  d.run(59.5);
  EXPECT_EQ(d.estimator.jump().count, 0) << "not before the stated time";
  EXPECT_LT(d.error_m(), 1.0);
  d.run(1.5);
  EXPECT_EQ(d.estimator.jump().count, 1);
  EXPECT_NEAR(d.estimator.jump().east_m, 100.0F, 1.0F);
  EXPECT_NEAR(d.estimator.jump().north_m, -40.0F, 1.0F);
  EXPECT_EQ(d.estimator.jump().cause, can::ResetCause::kPositionJump);
  EXPECT_NEAR(d.error_m(), std::hypot(100, 40), 2.0) << "it is where the fixes are";
  d.verdicts.clear();
  d.run(30);
  EXPECT_LE(d.counted('R'), 6) << "and but for the gate's hundredth they are followed: " << d.verdicts;
}

TEST(Glitch, OneThatWasTakenIsTakenBackWithoutWaiting) {
  Drive d = settled();
  d.tamper = between(d, 60, 140, [](Drive::Fix& fix, double) { fix.east_m += 100; });
  d.run(80);
  ASSERT_EQ(d.estimator.jump().count, 1);
  d.run(3);
  EXPECT_EQ(d.estimator.jump().count, 2) << "dead reckoning from before says the same as the fixes now";
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

TEST(Glitch, WhereNothingAgreesForFourTimesAsLongItGoesToTheFixesAndSaysSo) {
  Drive d = settled();
  d.tamper = between(d, 60, 1e9, [](Drive::Fix& fix, double t) { fix.east_m += 60 * (1 + std::floor(t / 7)); });
  d.run(239);
  EXPECT_EQ(d.estimator.jump().count, 0);
  EXPECT_LT(d.error_m(), 2.0);
  d.run(4);
  EXPECT_EQ(d.estimator.jump().count, 1);
  EXPECT_NEAR(d.estimator.jump().east_m, 60 * 35, 5);
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
      Numbers n = numbers();
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

TEST(Glitch, WhatTheFixesLedItAwayByIsDoubted) {
  // Weak dead reckoning, so that the first seconds of a ramp move the position by more than its sigma.
  Numbers n = numbers();
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
    Drive d = settled(numbers(), seed);
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
  Numbers n = numbers();
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
  EXPECT_EQ(d.last_velocity.verdict, can::Verdict::kStale) << "its velocity is as old";
  EXPECT_LT(d.worst_m, 0.6);
  d.verdicts.clear();
  d.run(10);
  EXPECT_EQ(d.counted('s'), 0);
  EXPECT_GE(d.counted('a'), 48) << d.verdicts;
  EXPECT_EQ(d.last_velocity.verdict, can::Verdict::kAccepted);
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
  EXPECT_EQ(d.estimator.mode(d.with()), can::Mode::kDegraded);
  EXPECT_LT(d.height_error_m(), 2.0);
  d.run(10);
  EXPECT_EQ(d.last_fix.dof, 3);
  EXPECT_EQ(d.estimator.mode(d.with()), can::Mode::kNominal);
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
    d.run(12);
    ASSERT_TRUE(d.tracking());
    EXPECT_LT(d.error_m(), 3.0);
    d.clear();
    d.run(60);
    EXPECT_LT(d.worst_sigmas, kHonest) << bad;
    EXPECT_EQ(d.estimator.jump().count, 0);
  }
}

/// NEES of the horizontal position over 30 drives of 200 s, with errors that last.
double mean_nees(float told_s, double* rmse_m = nullptr) {
  double nees = 0, squares = 0;
  constexpr unsigned kSeeds = 30;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    Numbers n = numbers();
    n.gnss.correlation_s = told_s;
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
  double told_m = 0, not_told_m = 0;
  const double told = mean_nees(60, &told_m), not_told = mean_nees(0, &not_told_m);
  EXPECT_GT(told, 1.0);
  EXPECT_LT(told, 3.0) << "two degrees of freedom, 30 seeds of some three independent errors each";
  EXPECT_GT(not_told, 10 * told);
  EXPECT_LE(told_m, not_told_m);
}

TEST(Lasting, ItIsTheReceiversOwnSigmaThatTheGateIsMadeOf) {
  Numbers n = numbers();
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
        GnssPosition fix{.latitude_2ndeg = latitude,
                         .longitude_2ndeg = 5'834'150'000,
                         .height_m = height,
                         .horizontal_acc_m = acc,
                         .vertical_acc_m = acc,
                         .fix = GnssFix::k3d};
        for (int i = 0; i < 7; ++i) static_cast<void>(d.estimator.fuse(fix, {d.us + i}, d.with()));
        const InertialEstimate now = d.estimator.inertial(d.with());
        ASSERT_TRUE(now.state.finite()) << acc << ' ' << height << ' ' << latitude;
        ASSERT_TRUE(now.p.positive_definite()) << acc << ' ' << height << ' ' << latitude;
      }
}

Numbers rover_like() {
  Numbers n = numbers();
  n.inertial.gyro_radps_rthz = 2e-3F;
  n.inertial.accel_mps2_rthz = 2e-2F;
  n.inertial.slip_share = 0.02F;
  n.inertial.constrain_every_us = 20'000;
  n.gnss.sigma_floor_m = 0.3F;
  n.gnss.correlation_s = 60;
  return n;
}

/// A pose given with a wrong heading and a sigma of 0.02 rad. Less than a right angle is pulled round; beyond, the
/// wheels seem to spin: the estimator has to notice that it looks the wrong way, begin anew, and say so. With a
/// speedometer as well as with counts of two wheels.
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
      EXPECT_EQ(d.estimator.jump().cause, can::ResetCause::kHeadingWrong);
      const auto turned_rad = static_cast<double>(d.estimator.jump().yaw_rad);
      EXPECT_GT(std::abs(turned_rad), 0.5) << off_rad << ": by how much it stepped is said";
      EXPECT_TRUE(std::isfinite(d.estimator.jump().east_m) && std::isfinite(d.estimator.jump().up_m));
    }
    EXPECT_EQ(d.estimator.mode(d.with()), can::Mode::kNominal) << off_rad;
    d.clear();
    d.run(60);
    EXPECT_TRUE(d.tracking());
    EXPECT_LT(d.worst_m, 4.0) << off_rad;
    EXPECT_LT(d.worst_sigmas, 4.5) << off_rad;
    EXPECT_NEAR(
        std::remainder(static_cast<double>(d.estimator.estimate(d.with()).pose.yaw_rad) - d.yaw_rad, 6.283185307), 0,
        0.1)
        << off_rad;
  }
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
      d.estimator.fuse(GnssVelocity{.v_n_mps = {6, -6, 0}, .acc_mps = 0.05F}, {d.us}, d.with());
      d.run(0.2);
    }
    for (int i = 0; i < 100; ++i) {
      d.estimator.fuse(GnssVelocity{.v_n_mps = {static_cast<float>(d.speed_mps * std::cos(d.yaw_rad)),
                                                static_cast<float>(d.speed_mps * std::sin(d.yaw_rad)), 0},
                                    .acc_mps = 0.05F},
                       {d.us}, d.with());
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
  Numbers n = rover_like();
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
  EXPECT_EQ(d.estimator.mode(d.with()), can::Mode::kNominal);
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
      if (heard) d.estimator.fuse(GnssVelocity{.v_n_mps = {10, 0, 0}, .acc_mps = 0.05F}, {d.us}, d.with());
    }
  };
  go(10, false);
  go(290, true);
  EXPECT_LT(d.error_m(), 40.0);  // 3 km if it believed its wheels
}

/// A receiver that is wrong in place and speed for half a minute (after a whole one its fixes are believed): the wheels
/// say that the filter is right.
TEST(InertialDivergence, AReceiverThatLiesInAllItSaysStartsNothingAnew) {
  Drive d = settled();
  d.tamper = [](Drive::Fix& fix) {
    fix.east_m += 300;
    return true;
  };
  d.gnss_velocity = false;
  for (int i = 0; i < 150; ++i) {
    d.run(0.2);
    d.estimator.fuse(GnssVelocity{.v_n_mps = {25, -10, 0}, .acc_mps = 0.05F}, {d.us}, d.with());
  }
  EXPECT_TRUE(d.tracking());
  EXPECT_EQ(d.estimator.jump().count, 0);
  EXPECT_LT(d.worst_m, 3.0);
}

}  // namespace
}  // namespace tetap::app
