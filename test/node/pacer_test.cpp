// SPDX-License-Identifier: Apache-2.0
#include "tetap/firmware/pacer.hpp"

#include <gtest/gtest.h>
#include <vector>

namespace tetap {
namespace {

using base::Micros;
using bus::LoopHealth;
using bus::SyncKind;
using bus::SyncState;
using firmware::Pacer;

constexpr Micros kPeriod{10'000};

TEST(Pacer, OnItsOwnTicksAtWholePeriods) {
  Pacer pacer(kPeriod);
  bus::LoopHealth health;
  std::vector<std::int64_t> ticks;
  for (std::int64_t now = 3'000; now < 100'000; now += 700)
    if (const auto t = pacer.on_poll({now}, health)) ticks.push_back(t->us);
  EXPECT_EQ(ticks, (std::vector<std::int64_t>{10'000, 20'000, 30'000, 40'000, 50'000, 60'000, 70'000, 80'000, 90'000}));
  EXPECT_EQ(health.ticks_late, 0);
}

TEST(Pacer, ATickThatOverrunsIsCountedAndSkipped) {
  Pacer pacer(kPeriod);
  bus::LoopHealth health;
  EXPECT_EQ(pacer.on_poll({5'000}, health), std::nullopt);
  EXPECT_EQ(pacer.on_poll({47'000}, health)->us, 40'000);
  EXPECT_EQ(health.ticks_late, 3);
  EXPECT_EQ(pacer.on_poll({49'000}, health), std::nullopt);
  EXPECT_EQ(pacer.on_poll({50'000}, health)->us, 50'000);
}

TEST(Pacer, InLockstepOnlyStepsTick) {
  Pacer pacer(kPeriod);
  bus::LoopHealth health;
  EXPECT_EQ(pacer.on_sync(bus::SyncKind::kBegin, {1'000'000}, {0}, health), std::nullopt);
  EXPECT_EQ(pacer.on_poll({2'000'000}, health), std::nullopt);
  EXPECT_EQ(pacer.on_sync(bus::SyncKind::kStep, {1'010'000}, {2'000'000}, health)->us, 1'010'000);
  EXPECT_EQ(pacer.on_sync(bus::SyncKind::kStep, {1'007'000}, {2'000'001}, health)->us, 1'007'000)
      << "whatever the time: the node judges";
}

TEST(Pacer, TwoSecondsAfterTheLastStepItTicksByItself) {
  Pacer pacer(kPeriod);
  bus::LoopHealth health;
  EXPECT_EQ(pacer.on_sync(bus::SyncKind::kStep, {700'003}, {5'000'000}, health)->us, 700'003);
  for (std::int64_t now = 5'000'000; now <= 7'000'000; now += 500)
    ASSERT_EQ(pacer.on_poll({now}, health), std::nullopt) << now;
  std::vector<std::int64_t> ticks;
  for (std::int64_t now = 7'000'500; now < 7'030'000; now += 500)
    if (const auto t = pacer.on_poll({now}, health)) ticks.push_back(t->us);
  EXPECT_EQ(ticks, (std::vector<std::int64_t>{2'710'000, 2'720'000})) << "the bus's time went on as the board's did";
  EXPECT_EQ(pacer.state(), SyncState::kOwnTimer);
  EXPECT_EQ(health.sync_lost, 1);
}

TEST(Pacer, AStormOfTicksDoesNotLetTimeRunAway) {
  for (const std::int64_t apart_us : {1, 4'999, 5'000, 10'000, 400'000}) {
    Pacer pacer(kPeriod);
    bus::LoopHealth health;
    std::int64_t now = 0, time = 1'000'000;
    for (int k = 0; k < 100; ++k, now += 10'000, time += 10'000)
      ASSERT_TRUE(pacer.on_sync(SyncKind::kTick, {time}, {now}, health));
    int ticks = 0;
    for (int k = 0; k < 10'000; ++k, now += 100) {  // a second of ten frames a millisecond
      time += apart_us;
      ticks += pacer.on_sync(SyncKind::kTick, {time}, {now}, health) ? 1 : 0;
    }
    EXPECT_LE(ticks, 50 + 125) << apart_us
                               << ": what a loop that stood still may make up for, and the time that went by";
    EXPECT_EQ(health.sync_back + health.sync_jump + ticks, 10'000) << apart_us;
  }
}

TEST(Pacer, ATickOnANodeThatTicksByItselfIsRefusedUntilThreeAgree) {
  Pacer pacer(kPeriod);
  bus::LoopHealth health;
  std::int64_t now = 0;
  for (; now < 1'000'000; now += 500) static_cast<void>(pacer.on_poll({now}, health));
  EXPECT_FALSE(pacer.on_sync(SyncKind::kTick, {900'000'000}, {now}, health));
  EXPECT_EQ(health.sync_jump, 1);
  EXPECT_FALSE(pacer.on_sync(SyncKind::kTick, {900'010'000}, {now + 10'000}, health));
  EXPECT_TRUE(pacer.on_sync(SyncKind::kTick, {900'020'000}, {now + 20'000}, health));
}

TEST(Pacer, AClockThatLeapsIsRefusedUntilThreeAgree) {
  Pacer pacer(kPeriod);
  bus::LoopHealth health;
  std::int64_t now = 0, last = 0;
  const auto poll_for = [&](std::int64_t us) {
    for (const std::int64_t end = now + us; now < end; now += 500)
      if (const auto t = pacer.on_poll({now}, health)) last = t->us;
  };
  static_cast<void>(pacer.on_sync(SyncKind::kClock, {50'000'000}, {now}, health));
  poll_for(1'000'000);
  EXPECT_NEAR(static_cast<double>(last), 51e6, 2e4);
  static_cast<void>(pacer.on_sync(SyncKind::kClock, {77'000'000}, {now}, health));
  static_cast<void>(pacer.on_sync(SyncKind::kClock, {3'000'000}, {now}, health));
  poll_for(1'000'000);
  EXPECT_NEAR(static_cast<double>(last), 52e6, 2e4) << "two that agree with nothing";
  EXPECT_EQ(health.sync_jump, 1);
  EXPECT_EQ(health.sync_back, 1);
  for (int k = 0; k < 3; ++k) {
    static_cast<void>(pacer.on_sync(SyncKind::kClock, {99'000'000 + k * 1'000'000}, {now}, health));
    poll_for(1'000'000);
  }
  EXPECT_NEAR(static_cast<double>(last), 102e6, 2e4);
}

TEST(Pacer, FollowsHoldsOverAfterThreePeriodsAndComesBack) {
  Pacer pacer(kPeriod);
  bus::LoopHealth health;
  const std::int64_t ahead = 7'000'000;  // the bus's clock against the board's
  std::int64_t now = 1'000'000;
  std::int64_t last = 0;
  const auto poll_until = [&](std::int64_t end) {
    int ticks = 0;
    for (; now < end; now += 500)
      if (const auto t = pacer.on_poll({now}, health)) {
        EXPECT_GT(t->us, last);
        last = t->us, ++ticks;
      }
    return ticks;
  };
  for (int k = 0; k < 20; ++k) {
    EXPECT_EQ(poll_until(now + 10'000), 0);
    const auto t = pacer.on_sync(bus::SyncKind::kTick, {now + ahead}, {now}, health);
    ASSERT_TRUE(t.has_value());
    last = t->us;
  }
  EXPECT_EQ(pacer.state(), bus::SyncState::kFollowing);
  const int own = poll_until(now + 100'000);
  EXPECT_EQ(pacer.state(), bus::SyncState::kHoldover);
  EXPECT_EQ(health.sync_lost, 1);
  EXPECT_GE(own, 7 - 1);
  EXPECT_EQ(health.ticks_late, 0);
  int refused = 0;
  for (int k = 0; k < 6; ++k) {
    poll_until(now + 10'000);
    const auto t = pacer.on_sync(bus::SyncKind::kTick, {now + ahead}, {now}, health);
    if (t) last = t->us;
    refused += t ? 0 : 1;
  }
  EXPECT_EQ(pacer.state(), bus::SyncState::kFollowing);
  EXPECT_GE(refused, 2) << "two regular ones before it is believed";
  EXPECT_LE(refused, 3);
}

TEST(Pacer, SyncThatGoesBackOrJumpsIsRefusedUntilThreeAgree) {
  Pacer pacer(kPeriod);
  bus::LoopHealth health;
  for (int k = 1; k <= 10; ++k) ASSERT_TRUE(pacer.on_sync(bus::SyncKind::kTick, {k * 10'000}, {k * 10'000}, health));
  EXPECT_FALSE(pacer.on_sync(bus::SyncKind::kTick, {50'000}, {105'000}, health));
  EXPECT_EQ(health.sync_back, 1);
  EXPECT_FALSE(pacer.on_sync(bus::SyncKind::kTick, {90'000'000}, {106'000}, health));
  EXPECT_EQ(health.sync_jump, 1);
  EXPECT_FALSE(pacer.on_sync(bus::SyncKind::kTick, {90'010'000}, {107'000}, health));
  EXPECT_TRUE(pacer.on_sync(bus::SyncKind::kTick, {90'020'000}, {108'000}, health)) << "the third in a row";
}

TEST(Pacer, TheClockFrameMovesTheTicksToTheBussTimeAndSmallCorrectionsKeepThem) {
  Pacer pacer(kPeriod);
  bus::LoopHealth health;
  std::vector<std::int64_t> ticks;
  std::int64_t now = 0;
  const auto poll_until = [&](std::int64_t end) {
    for (; now < end; now += 500)
      if (const auto t = pacer.on_poll({now}, health)) ticks.push_back(t->us);
  };
  EXPECT_FALSE(pacer.on_sync(bus::SyncKind::kClock, {500'123}, {0}, health));
  poll_until(50'000);
  EXPECT_EQ(ticks, (std::vector<std::int64_t>{510'000, 520'000, 530'000, 540'000}));
  EXPECT_FALSE(pacer.on_sync(bus::SyncKind::kClock, {547'000}, {50'000}, health));  // 3 ms back
  poll_until(80'000);
  for (std::size_t i = 1; i < ticks.size(); ++i)
    EXPECT_EQ(ticks[i] - ticks[i - 1], 10'000) << "no tick twice, none missing";
  EXPECT_EQ(health.ticks_late, 0);
}

}  // namespace
}  // namespace tetap
