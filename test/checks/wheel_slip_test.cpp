// SPDX-License-Identifier: Apache-2.0
// Wheels that spin, one or both, and wheels that do not: what is taken for slip, when, and how it ends.
#include "tetap/checks/wheel_slip.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <random>

namespace tetap::checks {
namespace {

using Slip = WheelSlip::Slip;
constexpr float kTrack_m = 0.5F;

/// A robot of its own speed and turn; what the wheels show on top of it.
class Drive {
 public:
  param::InertialParameters n;
  WheelSlip watch;
  float forward_mps = 2, turn_radps = 0, sigma_mps = 0.03F;
  float left_slip_mps = 0, right_slip_mps = 0;
  float noise_mps = 0.03F;  ///< one count of 0.3 mm in 10 ms
  bool filter_follows = false;

  /// Until the watch says this, or for that long; how long it took.
  std::optional<double> until(Slip wanted, double longest_s) {
    for (int i = 1; i <= std::lround(longest_s * 100); ++i)
      if (step() == wanted) return i * 0.01;
    return std::nullopt;
  }
  Slip step() {
    us_ += 10'000;
    const auto noise = [&] { return noise_mps * (unit_(engine_) - 0.5F); };
    const float turn = 0.5F * kTrack_m * turn_radps;
    const float left = forward_mps - turn + left_slip_mps, right = forward_mps + turn + right_slip_mps;
    const float follow = filter_follows ? 0.5F * (left_slip_mps + right_slip_mps) : 0.0F;
    return watch.update(
        {.left_mps = left + noise(), .right_mps = right + noise()},
        {.forward_mps = forward_mps + follow, .sigma_mps = sigma_mps, .turn_mps = kTrack_m * turn_radps}, {us_}, n);
  }
  bool gnss(float sigma = 0.05F) {
    return watch.update_ground(forward_mps, forward_mps + 0.5F * (left_slip_mps + right_slip_mps), sigma, {us_}, n);
  }

 private:
  std::int64_t us_ = 1'000'000;
  std::mt19937 engine_{7};
  std::uniform_real_distribution<float> unit_{0.0F, 1.0F};
};

TEST(WheelSlip, FindsEitherWheelThatSpinsWithinATenthOfASecondAndNamesIt) {
  for (const float speed : {0.0F, 0.5F, 2.0F, -1.0F}) {
    for (const float turn : {-0.8F, 0.0F, 0.8F}) {
      Drive left, right;
      left.forward_mps = right.forward_mps = speed;
      left.turn_radps = right.turn_radps = turn;
      EXPECT_EQ(left.until(Slip::kLeft, 1), std::nullopt);
      EXPECT_EQ(right.until(Slip::kRight, 1), std::nullopt);
      left.left_slip_mps = 1;
      right.right_slip_mps = 2;
      EXPECT_LE(left.until(Slip::kLeft, 1).value_or(9), 0.1);
      EXPECT_LE(right.until(Slip::kRight, 1).value_or(9), 0.1);
    }
  }
}

TEST(WheelSlip, AddsUpTheTurnOfBothWheelsThatTheGyroscopeDoesNotShow) {
  for (const float off_mps : {0.4F, -0.8F}) {
    Drive d;
    d.until(Slip::kBoth, 1);
    EXPECT_EQ(d.watch.turned_m(), 0.0F);
    d.left_slip_mps = -off_mps;
    d.right_slip_mps = off_mps;
    d.until(Slip::kNone, 0.01);
    for (int i = 0; i < 200; ++i) d.step();
    EXPECT_NEAR(d.watch.turned_m(), 4.0F * off_mps, 0.4F * std::abs(off_mps));  // 2 s of twice the difference
    d.left_slip_mps = d.right_slip_mps = 0;
    d.until(Slip::kNone, 1);
    EXPECT_EQ(d.watch.turned_m(), 0.0F);
    d.left_slip_mps = off_mps;
    for (int i = 0; i < 200; ++i) d.step();
    EXPECT_LT(std::abs(d.watch.turned_m()), 0.2F * std::abs(off_mps)) << "one wheel alone";
  }
}

/// A robot that is carried off turns and moves. Its wheels rest, and the receiver shows that both are wrong.
TEST(WheelSlip, WheelsThatRestAreBothWrongWhereTheReceiverMoves) {
  WheelSlip watch;
  const param::InertialParameters n;
  const WheelSlip::Motion motion{.turn_mps = kTrack_m * 0.1F, .still_mps = kTrack_m * n.still_radps};
  bool contradicted = false;
  for (int i = 1; i <= 200; ++i) {
    watch.update({}, motion, {10'000 * i}, n);
    if (i % 20 == 0) contradicted = watch.update_ground(2.0F, 0.0F, 0.05F, {10'000 * i}, n) || contradicted;
  }
  EXPECT_TRUE(contradicted);
  EXPECT_EQ(watch.slip(), Slip::kBoth);
}

TEST(WheelSlip, WheelsThatRestDenyATurnThatRollingOnesLeaveOpen) {
  const float still_radps = param::InertialParameters{}.still_radps;
  for (const float turn_radps : {1.2F * still_radps, 0.1F, -0.5F, 1.0F}) {
    for (const bool rest : {false, true}) {
      WheelSlip watch;
      const param::InertialParameters n;
      WheelSlip::Motion motion{.turn_mps = kTrack_m * turn_radps};
      if (rest) motion.still_mps = kTrack_m * n.still_radps;
      for (int i = 1; i <= 100; ++i) watch.update({}, motion, {10'000 * i}, n);
      EXPECT_EQ(watch.slip() == Slip::kTurn, rest) << turn_radps;
      if (rest) {
        EXPECT_NEAR(watch.turned_m(), -kTrack_m * turn_radps, 0.2F * kTrack_m * base::abs(turn_radps));
      }
      motion.turn_mps = 0.8F * kTrack_m * n.still_radps;
      for (int i = 101; i <= 200; ++i) watch.update({}, motion, {10'000 * i}, n);
      EXPECT_EQ(watch.slip(), Slip::kNone) << turn_radps;
    }
  }
}

TEST(WheelSlip, FindsAWheelThatIsDragged) {
  Drive d;
  d.until(Slip::kBoth, 1);
  d.right_slip_mps = -d.forward_mps;
  EXPECT_LE(d.until(Slip::kRight, 1).value_or(9), 0.1);
}

TEST(WheelSlip, FindsBothWheelsThatSpinAlikeByTheFiltersVelocity) {
  Drive d;
  d.until(Slip::kBoth, 1);
  d.left_slip_mps = d.right_slip_mps = 1;
  EXPECT_LE(d.until(Slip::kBoth, 1).value_or(9), 0.1);
}

TEST(WheelSlip, FindsBothByGnssWhenTheFilterHasFollowedThem) {
  Drive d;
  d.filter_follows = true;
  d.until(Slip::kBoth, 1);
  d.left_slip_mps = d.right_slip_mps = 1;
  EXPECT_EQ(d.until(Slip::kBoth, 2), std::nullopt) << "nothing contradicts them";
  EXPECT_FALSE(d.gnss()) << "once may be an outlier";
  EXPECT_EQ(d.until(Slip::kBoth, 0.2), std::nullopt);
  EXPECT_TRUE(d.gnss());
  EXPECT_EQ(d.step(), Slip::kBoth);
  EXPECT_FALSE(d.gnss()) << "is said once";
  d.left_slip_mps = d.right_slip_mps = 0;
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(d.step(), Slip::kBoth);
  }
  d.gnss();
  EXPECT_LE(d.until(Slip::kNone, 1).value_or(9), 0.5);
}

TEST(WheelSlip, GnssThatIsUncertainContradictsNothing) {
  Drive d;
  d.filter_follows = true;
  d.left_slip_mps = d.right_slip_mps = 1;
  for (int i = 0; i < 10; ++i) {
    d.until(Slip::kBoth, 0.2);
    EXPECT_FALSE(d.gnss(0.5F));
  }
  EXPECT_EQ(d.watch.slip(), Slip::kNone);
}

TEST(WheelSlip, IsOverOnlyAfterAWhileOfRolling) {
  Drive d;
  d.right_slip_mps = 1;
  ASSERT_TRUE(d.until(Slip::kRight, 1));
  d.until(Slip::kNone, 2);
  d.right_slip_mps = 0;
  const double over_s = d.until(Slip::kNone, 2).value_or(9);
  EXPECT_GE(over_s, 0.3);
  EXPECT_LE(over_s, 0.8);
}

TEST(WheelSlip, AWheelThatSpinsAndRollsByTurnsOfATenthOfASecondStaysSpinning) {
  Drive d;
  d.until(Slip::kBoth, 1);
  d.right_slip_mps = 1;
  ASSERT_TRUE(d.until(Slip::kRight, 1));
  for (int i = 0; i < 300; ++i) {
    d.right_slip_mps = (i / 10) % 2 == 0 ? 0.0F : 1.0F;
    ASSERT_EQ(d.step(), Slip::kRight) << i;
  }
}

TEST(WheelSlip, TheSlipThatWheelsAlwaysHaveIsNone) {
  for (const float sign : {-1.0F, 1.0F}) {
    Drive d;
    d.turn_radps = 0.7F;
    d.left_slip_mps = sign * d.n.slip_share * d.forward_mps;
    d.right_slip_mps = -sign * d.n.slip_share * d.forward_mps;
    for (int i = 0; i < 3000; ++i) {
      ASSERT_EQ(d.step(), Slip::kNone);
      if (i % 20 == 0) {
        ASSERT_FALSE(d.gnss());
      }
    }
  }
}

/// A fast robot: the slip that wheels always have is larger than the fixed part.
TEST(WheelSlip, AllowsThreeSigmaOfTheUsualSlipAndNotFive) {
  for (const float sigmas : {3.0F, 5.0F}) {
    Drive d;
    d.forward_mps = 10;
    const float apart_mps = d.n.slip_mps + sigmas * d.n.slip_share * d.forward_mps;
    d.left_slip_mps = -0.5F * apart_mps;
    d.right_slip_mps = 0.5F * apart_mps;
    for (int i = 0; i < 100; ++i) d.step();
    EXPECT_EQ(d.watch.slip() != Slip::kNone, sigmas > 4) << sigmas;
  }
}

TEST(WheelSlip, AllowsTwoSigmaOfTheVelocityOverGroundAndNotFour) {
  for (const float sigmas : {2.0F, 4.0F}) {
    Drive d;
    d.filter_follows = true;
    constexpr float kSigma_mps = 0.3F;
    d.left_slip_mps = d.right_slip_mps = d.n.slip_mps + 4 * d.n.slip_share * d.forward_mps + sigmas * kSigma_mps;
    d.step();
    EXPECT_FALSE(d.gnss(kSigma_mps));
    d.until(Slip::kBoth, 0.2);
    EXPECT_EQ(d.gnss(kSigma_mps), sigmas > 3) << sigmas;
  }
}

TEST(WheelSlip, AVelocityThatIsNotKnownJudgesOneWheelByTheOtherOnly) {
  Drive d;
  d.sigma_mps = 1;
  d.left_slip_mps = d.right_slip_mps = 1;
  EXPECT_EQ(d.until(Slip::kBoth, 2), std::nullopt);
  d.left_slip_mps = 0;
  EXPECT_LE(d.until(Slip::kRight, 1).value_or(9), 0.2);
}

TEST(WheelSlip, IsNotWhereItIsNotWanted) {
  Drive d;
  d.n.slip_mps = 0;
  d.left_slip_mps = 5;
  EXPECT_EQ(d.until(Slip::kLeft, 2), std::nullopt);
  EXPECT_FALSE(d.gnss() || d.gnss());
}

}  // namespace
}  // namespace tetap::checks
