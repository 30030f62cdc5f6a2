// SPDX-License-Identifier: Apache-2.0
// The parts of the doctor that a log cannot reach one by one: ranking, counters of two senders, the time of the bus.
// Whole logs with mistakes: test/tools/doctor_test.py.
#include "sim_host/doctor/bus_time.hpp"
#include "sim_host/doctor/diagnosis.hpp"
#include "sim_host/doctor/moments.hpp"
#include "sim_host/doctor/sequence.hpp"
#include "sim_host/doctor/turn_ratio.hpp"
#include "sim_host/doctor/vector_turn.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

namespace tetap::doctor {
namespace {

base::CanFrame wheels(std::uint8_t sequence, std::uint16_t left) {
  return bus::frame(0x300, bus::InWheelCounts{.stamp_us = 0, .seq = sequence, .inst = 0, .left = left, .right = 0});
}

Findings of_sequence(const std::vector<base::CanFrame>& frames) {
  SequenceDetector detector;
  std::int64_t us = 0;
  for (const base::CanFrame& frame : frames) detector.frame({base::Micros{us += 10'000}, frame.id - 0x300, frame});
  Findings findings;
  detector.finish(findings);
  return findings;
}

std::vector<Code> codes(const Findings& findings) {
  std::vector<Code> found;
  for (const Finding& one : findings) found.push_back(one.code);
  return found;
}

TEST(Sequence, OneSenderWithLossesAndRepeatsIsOne) {
  std::vector<base::CanFrame> frames;
  for (unsigned i = 0; i < 4000; ++i) {
    if (i * 2654435761U % 100 < 20) continue;  // a fifth is lost
    frames.push_back(wheels(i % 16, static_cast<std::uint16_t>(i)));
    if (i % 3 == 0) frames.push_back(frames.back());
  }
  EXPECT_TRUE(of_sequence(frames).empty());
}

TEST(KeptWindows, AreAllOfAShortLogAndEvenlySpacedOnesOfALongLog) {
  for (const int count : {1, 4095, 4096, 100'000}) {
    KeptWindows kept;
    for (int second = 0; second < count; ++second) kept.add({.start_s = static_cast<double>(second)});
    const std::vector<Window>& all = kept.all();
    ASSERT_LT(all.size(), KeptWindows::kMost) << count;
    const double spacing = all.size() > 1 ? all[1].start_s : 1;
    for (std::size_t i = 0; i < all.size(); ++i) ASSERT_EQ(all[i].start_s, static_cast<double>(i) * spacing) << count;
    EXPECT_GE(all.back().start_s, count - spacing) << count;
    if (count < 4096) {
      EXPECT_EQ(all.size(), static_cast<std::size_t>(count));
    } else {
      EXPECT_GE(all.size(), KeptWindows::kMost / 2) << count;
    }
  }
}

TEST(Sequence, TwoSendersAreFoundAtEveryOffsetOfTheirCounters) {
  for (unsigned offset = 0; offset < 16; ++offset) {
    std::vector<base::CanFrame> frames;
    for (unsigned i = 0; i < 200; ++i) {
      frames.push_back(wheels(i % 16, static_cast<std::uint16_t>(i)));
      frames.push_back(wheels((i + offset) % 16, static_cast<std::uint16_t>(30'000 + i)));
    }
    EXPECT_EQ(codes(of_sequence(frames)), std::vector{Code::kTwoSenders}) << offset;
  }
}

TEST(Sequence, ASecondSenderOfATenthOfTheRateIsFound) {
  std::vector<base::CanFrame> frames;
  for (unsigned i = 0; i < 2000; ++i) {
    frames.push_back(wheels(i % 16, static_cast<std::uint16_t>(i)));
    if (i % 10 == 0) frames.push_back(wheels(i / 10 % 16, static_cast<std::uint16_t>(30'000 + i)));
  }
  EXPECT_EQ(codes(of_sequence(frames)), std::vector{Code::kTwoSenders});
}

Finding finding(Code code, Devices uses, double certainty = 1) {
  return {.code = code, .uses = uses, .certainty = certainty, .evidence = "e", .change = {}};
}

TEST(Ranking, WhatRestsOnASpoiltDeviceIsNoSecondCause) {
  const Findings found = ranked({finding(Code::kWheelScale, kWheels | kGnssVelocity),
                                 finding(Code::kWheelReversed, kWheels | kGyroscope), finding(Code::kOriginFar, 0)});
  EXPECT_EQ(codes(found), (std::vector{Code::kWheelReversed, Code::kOriginFar}));
}

TEST(Ranking, AxesOfGnssThatOneComparisonCannotPartAreBothNamedAndTheOriginDecides) {
  Findings mirrored{finding(Code::kLongitudeSign, kFixes, 0.7), finding(Code::kLatitudeSign, kFixes, 0.8),
                    finding(Code::kWheelScale, kFixes)};
  EXPECT_EQ(codes(ranked(mirrored)), (std::vector{Code::kLatitudeSign, Code::kLongitudeSign}));
  mirrored.push_back(finding(Code::kLongitudeSign, kNoDevice));
  EXPECT_EQ(codes(ranked(mirrored)), std::vector{Code::kLongitudeSign});
}

TEST(Ranking, OneFindingACodeWithTheEvidenceOfAllAndAChange) {
  const Findings found = ranked({finding(Code::kTwoClocks, 0, 0.5), finding(Code::kTwoClocks, 0)});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].evidence, "e e");
  EXPECT_EQ(found[0].change, row(Code::kTwoClocks).change);
}

Finding beside(Code code, Devices uses, Code other) {
  Finding one = finding(code, uses);
  one.beside = other;
  return one;
}

TEST(Ranking, TwoCausesOfOneComparisonAreNamedOneAfterTheOther) {
  const Findings both = ranked({beside(Code::kGyroSign, kGyroscope | kWheels, Code::kWheelsSwapped),
                                finding(Code::kWheelsSwapped, kGyroscope | kWheels), finding(Code::kOriginFar, 0)});
  EXPECT_EQ(codes(both), (std::vector{Code::kWheelsSwapped, Code::kGyroSign, Code::kOriginFar}));
  // An earlier cause that explains the one explains the other.
  const Findings spoilt = ranked({beside(Code::kGyroSign, kGyroscope | kWheels, Code::kWheelsSwapped),
                                  finding(Code::kWheelsSwapped, kGyroscope | kWheels), finding(Code::kDegForRad, 0)});
  EXPECT_EQ(codes(spoilt), std::vector{Code::kDegForRad});
}

TEST(Ranking, AVelocityWhoseAxesTheFixesShowSaysNothingOfTheGyroscope) {
  const Findings found = ranked({beside(Code::kGyroSign, kGyroscope | kGnssVelocity, Code::kVelocityAxes),
                                 finding(Code::kVelocityAxes, kFixes | kGnssVelocity)});
  EXPECT_EQ(codes(found), std::vector{Code::kVelocityAxes});
}

/// Gravity or a field that a body sees while it turns about all axes, a gyroscope with these factors beside it.
std::array<AxisFactor, 3> seen_factors(const Vector3& world, const Vector3& gyro_factors) {
  VectorTurn turns;
  Vector3 seen = world;
  for (int i = 0; i < 200; ++i) {
    const double t = 0.1 * i;
    const Vector3 turn{0.05 * std::sin(t), 0.04 * std::cos(1.3 * t), 0.06 * std::sin(0.7 * t + 1)};
    const Vector3 after = turned(scaled(-1, turn), seen);
    turns.add(seen, after, {gyro_factors[0] * turn[0], gyro_factors[1] * turn[1], gyro_factors[2] * turn[2]});
    seen = after;
  }
  std::array<AxisFactor, 3> factors;
  for (std::size_t i = 0; i < 3; ++i) factors[i] = turns.factor(i).value_or(AxisFactor{.value = -9});
  return factors;
}

TEST(VectorTurn, GivesEachAxisItsFactor) {
  const auto right = seen_factors({20, 3, -40}, {1, 1, 1});
  for (const AxisFactor& one : right) EXPECT_NEAR(one.value, 1, 0.01);
  const auto wrong = seen_factors({20, 3, -40}, {1, -1, 2});
  EXPECT_NEAR(wrong[0].value, 1, 0.01);
  EXPECT_NEAR(wrong[1].value, -1, 0.01);
  EXPECT_NEAR(wrong[2].value, 0.5, 0.01);
  for (const AxisFactor& one : wrong) EXPECT_LT(one.sigma, 0.02);
}

TEST(TurnRatio, NoiseOfEitherDeviceLeavesTheFactorBetweenTheTwoRegressions) {
  for (const bool of_gyro : {true, false}) {
    Moments<2> moments;  // a gyroscope that measures 1.5 times the turn, and the other device
    for (int i = 0; i < 1000; ++i) {
      const double turn = std::sin(0.1 * i), noise = 0.5 * std::cos(2.3 * i);
      moments.add({1.5 * turn + (of_gyro ? noise : 0), turn + (of_gyro ? 0 : noise)});
    }
    const auto ratio =
        turn_ratio(moments.covariance(0, 0), moments.covariance(0, 1), moments.covariance(1, 1), moments.count(), 0.6);
    ASSERT_TRUE(ratio);
    EXPECT_LE(ratio->low, 1.501);
    EXPECT_GE(ratio->high, 1.499);
    EXPECT_GT(ratio->low, 0.9);
    EXPECT_LT(ratio->high, 2.5);
  }
}

TEST(TurnRatio, FewNoisyPairsOfEqualDevicesHoldAFactorOfOne) {
  std::mt19937 draws(5);
  std::normal_distribution<double> normal;
  for (const bool of_gyro : {true, false}) {
    int too_high = 0, too_low = 0;
    double width = 0;
    constexpr int kLogs = 500;
    for (int log = 0; log < kLogs; ++log) {
      Moments<2> moments;
      for (int i = 0; i < 22; ++i) {
        const double turn = normal(draws), noise = 0.4 * normal(draws);
        moments.add({turn + (of_gyro ? noise : 0), turn + (of_gyro ? 0 : noise)});
      }
      const auto ratio = turn_ratio(moments.covariance(0, 0), moments.covariance(0, 1), moments.covariance(1, 1),
                                    moments.count(), 0.6);
      ASSERT_TRUE(ratio);
      too_high += ratio->low > 1 ? 1 : 0;
      too_low += ratio->high < 1 ? 1 : 0;
      width += ratio->high / ratio->low / kLogs;
    }
    EXPECT_LT(too_high, kLogs / 12) << of_gyro;
    EXPECT_LT(too_low, kLogs / 12) << of_gyro;
    EXPECT_LT(width, 1.95) << of_gyro;
  }
}

TEST(TurnRatio, PairsWithoutNoiseHaveNoWidthAndTwoHaveNoFactor) {
  const auto exact = turn_ratio(4, 2, 1, 10, 0.6);
  ASSERT_TRUE(exact);
  EXPECT_NEAR(exact->low, 2, 1e-12);
  EXPECT_NEAR(exact->high, 2, 1e-12);
  EXPECT_TRUE(turn_ratio(4, 2.0000001, 1, 10, 0.6)) << "a correlation of one, rounded up";
  EXPECT_FALSE(turn_ratio(4, 2, 1, 2, 0.6));
}

TEST(BusClock, GoesOnBetweenSyncFramesButInLockstepByATickAtMost) {
  const base::CanFrame sync =
      bus::frame(0x300, bus::InSync{.time_us = 5'000'000, .ctr = 0, .kind = bus::SyncKind::kTick});
  const base::CanFrame other = wheels(0, 0);
  for (const bool lockstep : {false, true}) {
    BusTime time(ClockSource::kSync, 0x300, lockstep);
    time.add(base::Micros{99}, other);
    EXPECT_FALSE(time.known());
    time.add(base::Micros{1'000'000}, sync);
    time.add(base::Micros{1'250'000}, other);
    EXPECT_TRUE(time.known());
    EXPECT_EQ(time.now().us, lockstep ? 5'010'000 : 5'250'000);
  }
}

TEST(Moments, OfALineAreItsSlopeAndACorrelationOfOne) {
  Moments<2> moments;
  for (const double x : {-3.0, 1.0, 2.0, 8.0}) moments.add({x, 5 - 2 * x});
  EXPECT_DOUBLE_EQ(moments.mean(0), 2);
  EXPECT_DOUBLE_EQ(moments.covariance(0, 1) / moments.covariance(0, 0), -2);
  EXPECT_DOUBLE_EQ(correlation(moments.covariance(0, 1), moments.covariance(0, 0), moments.covariance(1, 1)), -1);
}

}  // namespace
}  // namespace tetap::doctor
