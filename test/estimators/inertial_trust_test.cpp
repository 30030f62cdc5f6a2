// SPDX-License-Identifier: Apache-2.0
// Trust. A device that lies is held by the others. A filter that is wrong gives way to devices that agree. A receiver
// alone wins after the stated time. Directions, sizes and times are drawn, so that no one of them is the rule's.
#include "inertial_drive.hpp"
#include "tetap/estimators/inertial/vote.hpp"

namespace tetap::estimators {
namespace {

const nav::Vector3 kEast2{2.0F, 0.0F, 0.0F};

TEST(Vote, AFixVotesOnlyWhereItTellsBothApart) {
  const auto vote = [](float off_m, float sigma_m, float t_s, bool refused = false) {
    return vote_of_fix({.east_m = off_m, .north_m = 0, .variance_m2 = sigma_m * sigma_m}, refused, kEast2, t_s);
  };
  EXPECT_EQ(vote(0, 1, 0.1F), Vote::kAbstains) << "too early";
  EXPECT_EQ(vote(0, 1, 5), Vote::kFor);
  EXPECT_EQ(vote(7, 1, 5), Vote::kAgainst);
  EXPECT_EQ(vote(0, 1, 5, true), Vote::kAbstains) << "refused, whatever for";
  EXPECT_EQ(vote(0, 10, 5), Vote::kAbstains) << "no better than the question";
}

TEST(Vote, ADeviceVotesByWhatItShowedSince) {
  DeviceRecord w;
  EXPECT_EQ(w.of_velocity({5'000'000}, {5'500'000}), Vote::kAbsent);
  w.update(false, {4'900'000});
  EXPECT_EQ(w.of_velocity({5'000'000}, {5'500'000}), Vote::kWaits);
  w.update(false, {5'200'000});
  EXPECT_EQ(w.of_velocity({5'000'000}, {5'500'000}), Vote::kFor);
  w.update(true, {5'400'000});
  EXPECT_EQ(w.of_velocity({5'000'000}, {5'500'000}), Vote::kAgainst);
  EXPECT_EQ(w.of_velocity({5'000'000}, {8'400'000}), Vote::kAbsent) << "silent for three seconds";
}

TEST(Vote, TheFilterGivesWayToTwoDevicesSoonToOneLateAndNeverAgainstAVoucher) {
  const param::RecoveryParameters n;
  const auto filter_yields_after = [&n](const Votes& votes) {
    checks::Persistence refused;
    for (std::int64_t us = 1'000'000; us < 20'000'000; us += 100'000) {
      refused.update(true, {us});
      if (filter_yields(refused, votes, {us}, n)) return us - 1'000'000;
    }
    return std::int64_t{-1};
  };
  EXPECT_EQ(filter_yields_after({.speed = Vote::kAgainst, .speeds_agree = true}), 200'000);
  EXPECT_EQ(filter_yields_after({.fixes = Vote::kAgainst}), 200'000);
  EXPECT_EQ(filter_yields_after({}), n.after_us);
  EXPECT_EQ(filter_yields_after({.speed = Vote::kAbstains, .fixes = Vote::kAbstains}), n.after_us);
  EXPECT_EQ(filter_yields_after({.speed = Vote::kAgainst}), -1) << "three that say three things";
  for (const Vote vote : {Vote::kFor, Vote::kWaits}) {
    EXPECT_EQ(filter_yields_after({.speed = vote, .fixes = Vote::kAgainst}), -1);
    EXPECT_EQ(filter_yields_after({.speed = Vote::kAgainst, .fixes = vote, .speeds_agree = true}), -1);
  }
}

/// A drive whose receiver lies about its velocity.
Drive lied_to(float speed_mps, float lie_mps, double for_s, double begin_s) {
  Drive d(rover_like());
  d.speed_mps = static_cast<double>(speed_mps);
  if (!(speed_mps > 0)) d.turn_radps = 0;
  d.white_m = 0.3;
  d.place();
  d.run(40);
  d.clear();
  const double from_s = d.time_s() + begin_s;
  d.tamper = [&d, from_s, for_s, lie_mps](Drive::Fix& fix) {
    if (d.time_s() > from_s && d.time_s() < from_s + for_s) fix.east_off_mps = lie_mps;
    return true;
  };
  d.run(begin_s + for_s + 20);
  d.tamper = [](Drive::Fix&) { return true; };
  return d;
}

TEST(InertialTrust, AReceiverThatLiesAboutItsVelocityIsHeldByWheelsAndFixes) {
  for (const float speed : {0.0F, 1.0F, 3.0F})
    for (const float lie : {1.5F, -2.5F, 8.0F})
      for (const double for_s : {0.5, 4.0, 9.0}) {
        const Drive d = lied_to(speed, lie, for_s, 3 + for_s / 7);
        EXPECT_LT(d.worst_m, 1.2) << speed << ' ' << lie << ' ' << for_s;
        EXPECT_LT(d.worst_sigmas, 4.5) << speed << ' ' << lie << ' ' << for_s;
        EXPECT_LT(d.yaw_error_rad(), 0.1) << speed << ' ' << lie << ' ' << for_s;
      }
}

/// A gyroscope below the leaps, for long enough that gravity is taken for motion.
TEST(InertialTrust, AFilterWhoseTiltIsWrongGivesWayToGoodFixesAndAGoodSpeed) {
  for (const bool wheels : {true, false})
    for (const std::size_t axis : {std::size_t{0}, std::size_t{1}})
      for (const float rate : {0.6F, -1.1F}) {
        Drive d = settled(rover_like());
        d.wheels = wheels, d.speedometer = !wheels;
        d.white_m = 0.5;
        d.run(10);
        const double from_s = d.time_s();
        d.tamper_imu = [&](sensor::ImuSample& s) {
          if (d.time_s() < from_s + 0.35) s.dangle_b_rad[axis] += 0.01F * rate;
        };
        d.run(15);
        d.clear();
        d.run(30);
        EXPECT_LT(d.worst_m, 2.0) << wheels << axis << ' ' << rate;
        EXPECT_LT(d.worst_sigmas, 4.5) << wheels << axis << ' ' << rate;
        EXPECT_LT(d.yaw_error_rad(), 0.2) << wheels << axis << ' ' << rate;
      }
}

// A receiver that is led away to the side, in position and velocity alike. The speed fits the wheels at first.
TEST(InertialTrust, AReceiverThatIsLedAsideIsOneDeviceAgainstWheelsAndImu) {
  param::Parameters n = rover_like();
  n.gnss.sigma_floor_m = 0.05F;
  for (const double speed : {1.5, 2.0})
    for (const double aside_mps2 : {0.6, -1.0}) {
      Drive d(n);
      d.speed_mps = speed, d.turn_radps = 0, d.yaw_rad = 1.57;
      d.white_m = 0.05;
      d.place();
      d.run(40);
      d.clear();
      const double from_s = d.time_s();
      d.tamper = [&d, from_s, aside_mps2](Drive::Fix& fix) {
        const double t_s = d.time_s() - from_s;
        fix.east_m += 0.5 * aside_mps2 * t_s * t_s;
        fix.east_off_mps = static_cast<float>(aside_mps2 * t_s);
        return true;
      };
      d.run(10);
      EXPECT_LT(d.worst_m, 2.5) << speed << ' ' << aside_mps2;
      EXPECT_LT(d.yaw_error_rad(), 0.15) << speed << ' ' << aside_mps2;
      d.tamper = [](Drive::Fix&) { return true; };
      d.run(10);
      EXPECT_LT(d.error_m(), 1.0) << speed << ' ' << aside_mps2;
      EXPECT_LT(d.yaw_error_rad(), 0.1) << speed << ' ' << aside_mps2;
    }
}

/// Without wheels the receiver has one device against it, the IMU. Its position and its velocity are one device.
Drive without_wheels(const std::function<bool(Drive&, Drive::Fix&, double)>& tamper) {
  Drive d = settled(rover_like());
  d.wheels = false;
  d.white_m = 0.3;
  d.run(10);
  d.clear();
  const double from_s = d.time_s();
  d.tamper = [&d, from_s, tamper](Drive::Fix& fix) { return tamper(d, fix, d.time_s() - from_s); };
  d.run(8);
  d.tamper = [](Drive::Fix&) { return true; };
  d.run(10);
  return d;
}

TEST(InertialTrust, AReceiverThatLeapsInPositionAndVelocityIsOneDevice) {
  for (const double leap_m : {12.0, -40.0, 300.0})
    for (const double share : {0.1, 0.5}) {
      const Drive d = without_wheels([&](Drive&, Drive::Fix& fix, double) {
        fix.east_m += leap_m;
        fix.east_off_mps = static_cast<float>(share * leap_m);
        return true;
      });
      EXPECT_LT(d.worst_m, 4.0) << leap_m << ' ' << share;
      EXPECT_LT(d.worst_sigmas, 4.5) << leap_m << ' ' << share;
      EXPECT_LT(d.error_m(), 1.5) << leap_m << ' ' << share;
    }
}

// The receiver led the filter away before: its leap is the way back.
TEST(InertialTrust, AReceiverThatLedTheFilterAwayIsFollowedBack) {
  for (const double aside_mps2 : {0.6, -1.5}) {
    const Drive d = without_wheels([&](Drive&, Drive::Fix& fix, double t_s) {
      fix.east_m += 0.5 * aside_mps2 * t_s * t_s;
      fix.east_off_mps = static_cast<float>(aside_mps2 * t_s);
      return true;
    });
    EXPECT_LT(d.error_m(), 2.0) << aside_mps2;
  }
}

// The velocity leaps, and the position goes along with it: the accelerometer erred.
TEST(InertialTrust, AnAccelerometerThatErrsForATenthOfASecondGivesWayToTheReceiver) {
  for (const float off_mps2 : {15.0F, -25.0F}) {
    Drive d = settled(rover_like());
    d.wheels = false;
    d.white_m = 0.3;
    d.run(10);
    const double from_s = d.time_s();
    d.tamper_imu = [&d, from_s, off_mps2](sensor::ImuSample& s) {
      if (d.time_s() < from_s + 0.1) s.dvelocity_b_mps[0] += 0.01F * off_mps2;
    };
    d.run(5);
    d.clear();
    d.run(10);
    EXPECT_LT(d.worst_m, 2.0) << off_mps2;
    EXPECT_LT(d.worst_sigmas, 4.5) << off_mps2;
  }
}

// A ferry: wheels and IMU stand, the receiver alone moves. It wins after RecoveryParameters::persist_us, not before.
TEST(InertialTrust, AReceiverAloneWinsAfterTheStatedTime) {
  for (const double speed : {1.2, 3.0}) {
    Drive d(rover_like());
    d.speed_mps = d.turn_radps = 0;
    d.white_m = 0.3;
    d.place();
    d.run(40);
    double carried_m = 0;
    const double from_s = d.time_s();
    d.tamper = [&](Drive::Fix& fix) {
      carried_m = speed * (d.time_s() - from_s);
      fix.east_m += carried_m;
      fix.east_off_mps = static_cast<float>(speed);
      return true;
    };
    const auto behind_m = [&] {
      const float east_m = d.estimator.inertial(d.ctx()).state.x.minus(base::Anchored{});
      return std::abs(static_cast<double>(east_m) - d.east_m - carried_m);
    };
    d.run(40);
    EXPECT_GT(behind_m(), 20.0) << speed;
    d.run(60);
    EXPECT_LT(behind_m(), 10.0) << speed;
  }
}

}  // namespace
}  // namespace tetap::estimators
