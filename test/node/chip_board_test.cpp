// SPDX-License-Identifier: Apache-2.0
// The Arduino sketch of docs/howto/own_chip.md, run on the host: it is the node that any other board makes, also when
// the chip's clock begins anew.
#include "bench.hpp"
#include "queued_can.hpp"

#include <gtest/gtest.h>
#include "sketch/sketch.ino"

namespace {

using namespace tetap;
using test::all, test::in;

struct PlainBoard {
  test::QueuedCan can;
  base::Micros time;
  [[nodiscard]] base::Micros now() const { return time; }
};

base::CanFrame frame_of(const CanMsg& message) {
  base::CanFrame frame{.id = message.getStandardId(), .size = message.data_length};
  std::copy_n(message.data, message.data_length, frame.data.begin());
  return frame;
}

TEST(ChipBoard, TheSketchIsTheNodeOfAnyBoardAcrossTheWrapOfItsClock) {
  constexpr std::uint32_t kBegin = 0xFFFFFFFFU - 2'000'000;
  clock_us = kBegin;
  firmware::ChipBoard own(my_chip);
  firmware::Firmware<firmware::ChipBoard<MyChip>, MyEstimators> sketched(own, kMyRobot, bus::Version{});
  PlainBoard plain;
  plain.time = base::Micros{kBegin};
  firmware::Firmware<PlainBoard, MyEstimators> other(plain, kMyRobot, bus::Version{});
  setup();
  EXPECT_EQ(CAN.bit_rate, 500'000);
  for (int k = 0; k < 16'000; ++k) {  // 4 s
    if (k % 40 == 0) {
      const int n = k / 40;
      const auto counts = static_cast<std::uint16_t>(32 * n);
      const base::CanFrame frame =
          in(bus::InWheelCounts{.stamp_us = static_cast<std::uint32_t>(plain.time.us) & 0xFFFFFU,
                                .seq = static_cast<std::uint8_t>(n & 0xF),
                                .left = counts,
                                .right = counts});
      CAN.received.emplace_back(frame.id, frame.size, frame.data.data());
      plain.can.to_node.push_back(frame);
    }
    sketched.poll();
    other.poll();
    clock_us += 250;
    plain.time += base::Micros{250};
  }
  ASSERT_LT(clock_us, kBegin) << "the clock began anew";
  ASSERT_EQ(CAN.sent.size(), plain.can.sent.size());
  for (std::size_t i = 0; i < CAN.sent.size(); ++i) ASSERT_EQ(frame_of(CAN.sent[i]), plain.can.sent[i]) << i;
  EXPECT_EQ(all<bus::EstEpoch>(plain.can.sent).size(), 400U) << "100 a second";
}

TEST(ChipBoard, FramesThatTheChipDoesNotTakeAreCounted) {
  firmware::ChipBoard own(my_chip);
  const std::uint32_t before = own.can.faults().tx_full;
  CAN.room = CAN.sent.size();
  EXPECT_FALSE(own.can.send({.id = 0x320, .size = 8}));
  EXPECT_EQ(own.can.faults().tx_full, before + 1);
  CAN.room = ~std::size_t{0};
}

}  // namespace
