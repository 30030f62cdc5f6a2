// SPDX-License-Identifier: Apache-2.0
// Zephyr's example of docs/howto/own_chip.md, run on the host until its sleep ends it: the frames of the Arduino
// sketch's node, across the wrap of its clock.
#include "bench.hpp"
#include "queued_can.hpp"

#include <gtest/gtest.h>

#define main zephyr_main
#include "zephyr/src/main.cpp"
#undef main

namespace {

using namespace tetap;
using test::all, test::in;

struct EndOfZephyr {};
constexpr int kZephyrPolls = 8000;  // 4 s of 500 us
int zephyr_polls = 0;
std::vector<base::CanFrame> zephyr_sent;

base::CanFrame zephyr_wheels(std::uint32_t n, std::int64_t time_us) {
  const auto counts = static_cast<std::uint16_t>(32 * n);
  return in(bus::InWheelCounts{.stamp_us = static_cast<std::uint32_t>(time_us) & 0xFFFFFU,
                               .seq = static_cast<std::uint8_t>(n & 0xF),
                               .left = counts,
                               .right = counts});
}

void arrives(const base::CanFrame& frame) {
  can_frame out{};
  out.id = frame.id & CAN_STD_ID_MASK;
  out.dlc = frame.size;
  std::copy_n(frame.data.begin(), frame.size, out.data);
  fake_arrives(out);
}

struct ZephyrTwin {
  test::QueuedCan can;
  base::Micros time;
  [[nodiscard]] base::Micros now() const { return time; }
};

TEST(ZephyrApplication, IsTheNodeOfAnyBoardAcrossTheWrapOfItsClock) {
  constexpr std::int64_t kBegin = 0xFFFFFFFFLL - 2'000'000;
  fake_uptime_us = kBegin;
  fake_bus.take = [](const can_frame& frame) {
    base::CanFrame sent{.id = frame.id, .size = frame.dlc};
    std::copy_n(frame.data, frame.dlc, sent.data.begin());
    zephyr_sent.push_back(sent);
    return true;
  };
  fake_slept = [] {
    if (++zephyr_polls == kZephyrPolls) throw EndOfZephyr{};
    if (zephyr_polls % 20 == 0) arrives(zephyr_wheels(static_cast<std::uint32_t>(zephyr_polls / 20), fake_uptime_us));
    arrives({.id = 0x123, .size = 1});  // of another node: the filter holds it back
  };
  EXPECT_THROW(zephyr_main(), EndOfZephyr);
  EXPECT_EQ(fake_bus.bit_rate, 500'000U);
  EXPECT_EQ(fake_bus.queue->put, static_cast<std::size_t>(kZephyrPolls / 20 - 1));

  ZephyrTwin twin;
  twin.time = base::Micros{static_cast<std::uint32_t>(kBegin)};
  firmware::Firmware<ZephyrTwin, MyEstimators> other(twin, kMyRobot, bus::Version{});
  for (int poll = 0; poll < kZephyrPolls; ++poll) {
    if (poll != 0 && poll % 20 == 0)
      twin.can.to_node.push_back(zephyr_wheels(static_cast<std::uint32_t>(poll / 20), twin.time.us));
    other.poll();
    twin.time += base::Micros{500};
  }
  ASSERT_EQ(zephyr_sent.size(), twin.can.sent.size());
  for (std::size_t i = 0; i < zephyr_sent.size(); ++i) ASSERT_EQ(zephyr_sent[i], twin.can.sent[i]) << i;
  EXPECT_EQ(all<bus::EstEpoch>(zephyr_sent).size(), 400U) << "100 a second";
}

}  // namespace
