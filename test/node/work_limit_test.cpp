// SPDX-License-Identifier: Apache-2.0
// A bus that is full of valid samples: what an honest bus does is never refused, what exceeds it is, and is counted.
#include "node/bench.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <random>
#include <vector>

namespace tetap::test {
namespace {

base::CanFrame wheels(std::int64_t at_us, int both, int seq) {
  return in(bus::InWheelCounts{.stamp_us = stamp(at_us),
                               .seq = static_cast<std::uint8_t>(seq & 15),
                               .left = static_cast<std::uint16_t>(both),
                               .right = static_cast<std::uint16_t>(both)});
}

struct Ran {
  int overload = 0, way_mm = 0, too_late = 0;
};
/// A run of `epochs` in which frames(k, now_us) arrive before tick k.
template <class MakeFrames>
Ran run(int epochs, MakeFrames&& frames) {
  Bench bench;
  bench.epoch(set_pose(1, 0, 0, 0));
  for (int k = 0; k < epochs; ++k) bench.epoch(frames(k, bench.now_us));
  const Frames out = bench.idle(200);
  return {.overload = last<bus::EstDiagLimits>(out)->overload,
          .way_mm = last<bus::EstPos>(out, 0)->x_raw,
          .too_late = last<bus::EstDiagOrder>(out)->too_late};
}

TEST(WorkLimit, SamplesThatAGatewayHeldBackAreAllUsed) {
  constexpr int kEpochs = 2'000;
  const Ran expected =
      run(kEpochs, [](int k, std::int64_t now_us) { return Frames{wheels(now_us + 5'000, 50 * k, k)}; });
  Frames held;
  // Wheels of 160 ms in one tick, again and again, while headings come in time: each wheel sample has to go before
  // these.
  const Ran ran = run(kEpochs, [&](int k, std::int64_t now_us) {
    Frames frames{in(bus::InHeading{.stamp_us = stamp(now_us + 6'000), .seq = static_cast<std::uint8_t>(k & 15)})};
    held.push_back(wheels(now_us + 5'000, 50 * k, k));
    if (k % 100 >= 83 && k % 100 != 99) return frames;
    frames.insert(frames.end(), held.begin(), held.end());
    held.clear();
    return frames;
  });
  EXPECT_EQ(ran.overload, 0);
  EXPECT_NEAR(ran.way_mm, expected.way_mm, 1);
}

TEST(WorkLimit, AFullBusOfLateSamplesIsRefusedAndTheRestGoesOn) {
  std::mt19937 random(7);
  std::uint32_t number = 0;
  const Ran ran = run(400, [&](int k, std::int64_t now_us) {
    Frames frames{wheels(now_us + 5'000, 50 * k, k)};
    for (int i = 0; i < 37; ++i)
      frames.push_back(
          body_speed(now_us - static_cast<int>(random() % 190'000), 1.0F, 0.0F, static_cast<int>(++number)));
    return frames;
  });
  EXPECT_GT(ran.overload, 11'000);
  EXPECT_LT(ran.overload, 400 * 37);
}

TEST(WorkLimit, ASecondAfterTheFloodNothingIsRefusedAnyMore) {
  std::mt19937 random(7);
  Bench bench;
  bench.epoch(set_pose(1, 0, 0, 0));
  for (int k = 0; k < 200; ++k) {
    Frames frames;
    for (int i = 0; i < 37; ++i)
      frames.push_back(body_speed(bench.now_us - static_cast<int>(random() % 190'000), 1, 0, i));
    bench.epoch(frames);
  }
  bench.idle(120);
  const int before = last<bus::EstDiagLimits>(bench.idle(200))->overload;
  for (int k = 0; k < 300; ++k)
    bench.epoch({wheels(bench.now_us + 5'000, 50 * k, k), body_speed(bench.now_us - 60'000, 1, 0, k)});
  EXPECT_EQ(last<bus::EstDiagLimits>(bench.idle(200))->overload, before);
}

}  // namespace
}  // namespace tetap::test
