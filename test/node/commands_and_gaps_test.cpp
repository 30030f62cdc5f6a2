// SPDX-License-Identifier: Apache-2.0
// Lateness, commands and silence together: the cases in which a node once gave wrong answers.

#include "node/bench.hpp"
#include "tetap/firmware/pacer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <optional>

namespace tetap::test {
namespace {

base::CanFrame counts(std::int64_t t, int both, int seq) {
  return in(bus::InWheelCounts{.stamp_us = stamp(t),
                               .seq = static_cast<std::uint8_t>(seq & 15),
                               .left = static_cast<std::uint16_t>(both),
                               .right = static_cast<std::uint16_t>(both)});
}

TEST(Commands, AMapEntryInTheEpochOfALateSampleLetsNothingCountTwice) {
  const auto way = [](bool late, bool map) {
    Bench bench;
    bench.epoch(set_pose(1, 0, 0, 0));
    int n = 0;
    Frames held;
    for (int k = 0; k < 100; ++k) {
      n += 100;
      Frames frames;
      const auto wheels = counts(bench.now_us + 9000, n, k);
      (late && k == 50 ? held : frames).push_back(wheels);
      if (k == 55) frames.insert(frames.end(), held.begin(), held.end());
      if (map && k == 55) frames.push_back(map_entry(40, 1000, 1000));
      bench.epoch(frames);
    }
    const Frames out = bench.idle(40);
    return std::pair{last<bus::EstPos>(out, 0)->x_raw, last<bus::EstPos>(out, 1)->x_raw};
  };
  const auto expected = way(false, false);
  EXPECT_EQ(way(true, false), expected);
  EXPECT_EQ(way(false, true), expected);
  EXPECT_EQ(way(true, true), expected);
}

TEST(Commands, APoseWithoutHeadingWaitsForOneInsteadOfTakingZero) {
  constexpr std::int64_t kLatitude = 24'131'000'000, kLongitude = 5'834'000'000;
  constexpr double kNorth_2ndeg_per_m = 1 / (111'200.0 * 2e-9);
  Bench bench;
  int n = 0;
  Frames out;
  const auto drive_north = [&](int seconds) {
    for (int k = 0; k < seconds * 100; ++k) {
      n += 32;
      const std::int64_t t = bench.now_us + 9000;
      Frames frames{counts(t, n, k)};
      if (k % 20 == 7) {
        const auto s = stamp(t);
        const auto seq = static_cast<std::uint8_t>(k / 20 & 15);
        const auto north = static_cast<std::int64_t>(n * 0.1 * 6.283185307 / 2000 * kNorth_2ndeg_per_m);
        frames.push_back(in(bus::InGnssLat{.stamp_us = s, .seq = seq, .lat_raw = kLatitude + north}));
        frames.push_back(in(bus::InGnssLon{.stamp_us = s, .seq = seq, .lon_raw = kLongitude}));
        frames.push_back(
            in(bus::InGnssAlt{.stamp_us = s, .seq = seq, .height_m = 100, .fix = bus::GnssFix::kFix3D, .num_sv = 9}));
        frames.push_back(in(bus::InGnssAcc{.stamp_us = s, .seq = seq, .hor_m = 0.5F, .ver_m = 1}));
      }
      out = bench.epoch(frames);
    }
  };
  drive_north(60);
  ASSERT_NEAR(last<bus::EstMotion>(out, 1)->yaw_rad, 1.571, 0.05);
  bench.epoch(set_pose(1, 0, n / 32 * 10, 0.0F, 0.5F, 4.0F));
  drive_north(1);
  EXPECT_FALSE(last<bus::EstMotion>(out, 1)->hdg_valid);
  drive_north(30);
  EXPECT_TRUE(last<bus::EstMotion>(out, 1)->hdg_valid);
  EXPECT_NEAR(last<bus::EstMotion>(out, 1)->yaw_rad, 1.571, 0.1);
}

TEST(Commands, CloseTheTimeBeforeThem) {
  Bench bench;
  bench.epoch({map_entry(7, 5000, 0)});
  bench.epoch(set_pose(1, 0, 0, 0));
  for (int k = 0; k < 20; ++k) bench.epoch({body_speed(bench.now_us + 9000, 1.0F, 0, k)});
  bench.idle(5);
  bench.epoch(set_pose(2, 1000, 0, 0, 0.5F));
  bench.epoch({sighting(bench.now_us - 30'000, 7, 4.5F, 0)});
  const Frames out = bench.idle(130);
  EXPECT_EQ(last<bus::EstDiagOrder>(out)->too_late, 1);
}

TEST(Commands, AResetOfNothingThatExistsIsRefused) {
  for (int what = 6; what < 16; ++what) {
    Bench bench;
    bench.epoch(set_pose(1, 0, 0, 0));
    bench.idle(5);
    const bus::CmdReset reset{.ctr = 2, .what = static_cast<bus::ResetWhat>(what)};
    bench.epoch({in(bus::protect(reset))});
    const Frames out = bench.idle(130);
    EXPECT_EQ(last<bus::EstStatus>(out)->reset_ctr, 1) << what;  // that of the pose
    EXPECT_EQ(last<bus::EstDiagFrames>(out)->out_of_range, 1) << what;
  }
}

TEST(Commands, TheOrderOfContradictionsHasNoEffect) {
  const auto crc = [](const Frames& frames) {
    Bench bench;
    bench.idle(3);
    bench.epoch(frames);
    return last<bus::EstStateCrc>(bench.idle(3))->crc;
  };
  const Frames one = set_pose(1, 1000, 0, 0), two = set_pose(2, 2000, 0, 0);
  const std::uint32_t expected = crc({one[0], one[1], two[0], two[1]});
  EXPECT_NE(crc({one[0], one[1]}), expected);
  EXPECT_EQ(crc({two[0], two[1], one[0], one[1]}), expected);
  EXPECT_EQ(crc({two[1], one[0], one[1], two[0]}), expected);
  EXPECT_EQ(crc({one[0], two[0], one[1], two[1]}), expected);
  EXPECT_EQ(crc({map_entry(3, 1, 1), map_entry(3, 2, 2)}), crc({map_entry(3, 2, 2), map_entry(3, 1, 1)}));
  const std::int64_t t = Bench::kStart_us + 30'000;
  EXPECT_EQ(crc({body_speed(t, 1, 0, 1), body_speed(t, 2, 0, 1)}),
            crc({body_speed(t, 2, 0, 1), body_speed(t, 1, 0, 1)}));
}

TEST(Commands, AYawBeyondHalfATurnIsPublishedWrapped) {
  Bench bench;
  bench.epoch(set_pose(1, 0, 0, 3.25F));
  EXPECT_NEAR(last<bus::EstMotion>(bench.idle(2), 1)->yaw_rad, 3.25 - 6.2831853, 1e-3);
}

// More samples than there is room for: none is lost, the window is shorter, and that is said.
TEST(Gaps, AWindowThatIsTooSmallForItsSamplesIsSaidToBeShort) {
  const auto node = std::make_unique<node::Node<node::Estimators<estimators::Odometry, estimators::PoseEkf>, 16>>(
      kNumbers, bus::Version{});
  std::int64_t now_us = Bench::kStart_us;
  node->power_on({now_us});
  std::optional<bus::EstDiagCapacity> capacity;
  std::optional<bus::EstDiagOrder> order;
  const auto tick = [&] {
    now_us += 10'000;
    node->tick({now_us}, {}, [&](const base::CanFrame& frame) {
      if (const auto found = last<bus::EstDiagCapacity>({frame})) capacity = found;
      if (const auto found = last<bus::EstDiagOrder>({frame})) order = found;
    });
  };
  tick();
  for (int i = 0; i < 18; ++i) {  // 180 ms of a window of 200
    node->on_frame(body_speed(now_us + 5'000, 1.0F, 0.0F, i));
    tick();
  }
  node->on_frame(body_speed(Bench::kStart_us + 16'000, 1.0F, 0.0F, 7));  // in the window, but for the room
  for (int i = 0; i < 2'000; ++i) tick();
  EXPECT_EQ(capacity->window_short, 2);
  EXPECT_EQ(capacity->timeline_full, 0);
  EXPECT_EQ(order->too_late, 1);
}

TEST(Gaps, SilentWheelsMoveNothingBackAndTheirDoubtStays) {
  auto parameters = kNumbers;
  parameters.publish.side_every = 1;
  for (const bool by_counts : {true, false}) {
    Bench bench(parameters);
    int n = 0;
    Frames out;
    const auto one = [&](bool send, int k) {
      n += 32;
      Frames frames;
      if (send) {
        frames.push_back(by_counts ? counts(bench.now_us + 9000, n, k) : body_speed(bench.now_us + 9000, 1.0F, 0, k));
      }
      out = bench.epoch(frames);
      return last<bus::EstPos>(out, 0)->x_raw;
    };
    int x_mm = 0;
    for (int k = 0; k < 100; ++k) x_mm = one(true, k);
    for (int k = 0; k < 80; ++k) {
      const int now_mm = one(false, k);
      EXPECT_GE(now_mm, x_mm) << k;
      x_mm = now_mm;
    }
    one(true, 1);
    const double missing_m = n * 0.1 * 6.283185307 / 2000 - x_mm * 1e-3;
    EXPECT_GT(missing_m, 0.2);
    EXPECT_GT(3 * last<bus::EstStdPose>(out, 0)->std_x_m, missing_m);
  }
}

TEST(Gaps, TheStateCrcTellsNodesApartThatWillGoOnDifferently) {
  const auto end = [](int first) {
    Bench bench;
    bench.epoch({counts(bench.now_us + 9000, first, 0)});
    return last<bus::EstStateCrc>(bench.idle(40))->crc;
  };
  EXPECT_NE(end(0), end(500));
}

TEST(Gaps, WhatIsIgnoredIsNotCalledUsed) {
  Bench bench;  // no gyroscope: an IMU and a speed without turn say nothing to it
  bench.epoch(set_pose(1, 0, 0, 0));
  for (int k = 0; k < 130; ++k) {
    const auto seq = static_cast<std::uint8_t>(k & 15);
    const auto s = stamp(bench.now_us + 5000);
    bench.epoch({in(bus::ImuGyro{.seq = seq}), in(bus::ImuAccel{.seq = seq}),
                 in(bus::ImuTime{.stamp_us = s, .interval_us = 10'000, .seq = seq}),
                 body_speed(bench.now_us + 5000, 1.0F, std::numeric_limits<float>::quiet_NaN(), k)});
  }
  EXPECT_EQ(last<bus::EstStatus>(bench.idle(20))->used, 0);
}

TEST(PacerLateness, IsCountedWhileFollowingAndNotForTheBusesSilence) {
  bus::LoopHealth stalled;
  firmware::Pacer pacer({10'000});
  std::int64_t now = 0;
  for (int k = 0; k < 50; ++k, now += 10'000)
    static_cast<void>(pacer.on_sync(bus::SyncKind::kTick, {1'000'000 + k * 10'000}, {now}, stalled));
  EXPECT_EQ(stalled.ticks_late, 0);
  now += 100'000;
  for (int k = 50; k < 60; ++k)
    static_cast<void>(pacer.on_sync(bus::SyncKind::kTick, {1'000'000 + k * 10'000}, {now}, stalled));
  EXPECT_EQ(stalled.ticks_late, 9);

  bus::LoopHealth silent;
  firmware::Pacer lone({10'000});
  now = 0;
  for (int k = 0; k < 50; ++k, now += 10'000)
    static_cast<void>(lone.on_sync(bus::SyncKind::kTick, {1'000'000 + k * 10'000}, {now}, silent));
  for (int i = 0; i < 2000; ++i, now += 500) static_cast<void>(lone.on_poll({now}, silent));
  EXPECT_EQ(silent.sync_lost, 1);
  EXPECT_EQ(silent.ticks_late, 0);

  bus::LoopHealth back;
  firmware::Pacer stepped({10'000});
  ASSERT_TRUE(stepped.on_sync(bus::SyncKind::kStep, {50'000'000}, {0}, back).has_value());
  EXPECT_FALSE(stepped.on_sync(bus::SyncKind::kTick, {1'000}, {0}, back).has_value());
  EXPECT_EQ(back.sync_back, 1);
}

}  // namespace
}  // namespace tetap::test
