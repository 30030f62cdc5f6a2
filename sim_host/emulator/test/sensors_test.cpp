// SPDX-License-Identifier: Apache-2.0
// A node in small on the emulated board (programs/sensors.cpp): all blocks at once, and one mistake after the other.
#include "hal/chip/stm32/registers_stm32f412.hpp"
#include "sim_host/emulator/test/emulated.hpp"
#include "sim_host/emulator/test/programs/choices.hpp"

#include <map>
#include <vector>

namespace tetap::board {
namespace {

/// 2 edges a millisecond forwards, backwards on the right; a byte each millisecond from the receiver.
SensorWorld moving() {
  SensorWorld world;
  world.left_edges = [](Picoseconds time) { return time / (500 * kMicrosecond); };
  world.right_edges = [](Picoseconds time) { return -time / (500 * kMicrosecond); };
  world.next_gnss_byte = [](Picoseconds time) {
    return SensorWorld::GnssByte{.begin = (time / kMillisecond + 1) * kMillisecond,
                                 .byte = static_cast<std::uint8_t>(time / kMillisecond)};
  };
  return world;
}

class Node : public Emulated {
 public:
  explicit Node(Mistake mistake, const BoardOptions& options = {}, const MachineOptions& machine_options = {})
      : Emulated("sensors", mistake, options, machine_options, moving()) {
    board.chip.can1.line.on_frame = [this](Picoseconds time, const CanOffer& frame, bool own) {
      if (own) frames.push_back({time, frame.frame.id});
    };
  }
  struct Sent {
    Picoseconds time;
    std::uint32_t id;
  };
  std::vector<Sent> frames;
};

TEST(Sensors, AllBlocksWorkTogether) {
  Node node(kNone);
  node.run_ms(500);
  EXPECT_TRUE(node.complaints().empty()) << node.complaints().text();
  EXPECT_EQ(node.result(0), 0x47U);
  const std::uint32_t ticks = node.result(4);
  EXPECT_GE(ticks, 25U);
  EXPECT_EQ(node.frames.size(), 3 * ticks);
  EXPECT_EQ(node.result(5), 3 * (ticks - 1));
  for (std::size_t i = 0; i + 2 < node.frames.size(); i += 3) {
    EXPECT_EQ(node.frames[i].id, 0x303U);
    EXPECT_EQ(node.frames[i + 1].id, 0x302U);
    EXPECT_EQ(node.frames[i + 2].id, 0x301U);
  }
  EXPECT_GT(node.result(1), 400U);
  EXPECT_EQ((node.result(1) + node.result(2)) & 0xFFFF, 0U) << "both wheels, opposite ways";
  EXPECT_LT(node.result(3), 64U) << "the ring has moved";
  EXPECT_EQ(node.machine.resets(), 0);
}

TEST(Sensors, CpiChangesTimeAndNothingElse) {
  for (const int percent : {100, 150, 200}) {
    Node node(kNone, {}, {.cpi_percent = percent});
    node.run_ms(500);
    EXPECT_TRUE(node.complaints().empty()) << node.complaints().text();
    EXPECT_EQ(node.result(0), 0x47U);
    EXPECT_GE(node.result(4), 15U);
  }
}

TEST(Sensors, OrderOnTheBusWithoutItsBitIsByIdentifier) {
  Node node(kPriorityById);
  node.run_ms(300);
  ASSERT_GT(node.frames.size(), 3U);
  EXPECT_EQ(node.frames[0].id, 0x303U) << "alone when it was asked for";
  EXPECT_EQ(node.frames[1].id, 0x301U);
  EXPECT_EQ(node.frames[2].id, 0x302U);
}

TEST(Sensors, WatchdogResetsAStalledLoopAtItsTime) {
  for (const std::int64_t lsi : {17'000, 32'000, 47'000}) {
    Node node(kLoopStalled, {.oscillators = {.lsi_hz = lsi}});
    node.machine.stop_at_reset = true;
    node.run_ms(1'500);
    ASSERT_EQ(node.machine.resets(), 1) << lsi;
    const Picoseconds last_frame = node.frames.back().time;
    const double expected_s = 400.0 * 8 / static_cast<double>(lsi);
    const double since_s =
        static_cast<double>(node.board.chip.scheduler.now() - last_frame) / static_cast<double>(kSecond);
    // The last reload was a tick before the one that stalled, and its frames followed within a millisecond.
    EXPECT_NEAR(since_s, expected_s, 0.0012) << lsi;
    EXPECT_NE(node.board.chip.word(hal::stm32f412::rcc::kRcc + hal::stm32f412::rcc::csr::kOffset) &
                  hal::stm32f412::rcc::csr::kWdgrstf.mask(),
              0U);
  }
}

TEST(Sensors, WatchdogBeforeALongExerciseResetsForEver) {
  Node node(kWatchdogBeforeExercise);
  node.run_ms(1'000);
  EXPECT_GE(node.machine.resets(), 8);
  EXPECT_TRUE(node.frames.empty());
}

TEST(Sensors, MistakesAreNoticed) {
  const struct {
    Mistake mistake;
    const char *model, *complaint;
  } mistakes[] = {{kRequestNotCleared, "core", "interrupt 19 is never cleared"},
                  {kReloadTooSmall, "TIM2", "ARR below full width"},
                  {kDataBeforeEmpty, "SPI1", "DR written before TXE"},
                  {kSelectEarly, "SPI1", "select line changed while BSY"}};
  for (const auto& one : mistakes) {
    Node node(one.mistake);
    node.run_ms(300);
    EXPECT_TRUE(node.complaints().has(one.model, one.complaint)) << one.mistake << "\n" << node.complaints().text();
  }
}

TEST(Sensors, FifoThatIsNotReleasedIsAStorm) {
  Node node(kFifoNotReleased);
  node.board.chip.can1.line.send({.id = 0x55, .size = 1}, 200 * kMillisecond);
  node.run_ms(300);
  EXPECT_TRUE(node.complaints().has("core", "interrupt 20 is never cleared")) << node.complaints().text();
}

TEST(Sensors, WrongStreamMovesNoByte) {
  Node node(kWrongStream);
  node.run_ms(300);
  EXPECT_EQ(node.result(3), 0U);
  EXPECT_NE(node.board.chip.word(hal::stm32f412::usart::kUsart1 + hal::stm32f412::usart::sr::kOffset) &
                hal::stm32f412::usart::sr::kOre.mask(),
            0U);
}

TEST(Sensors, ReceivedFramesInterrupt) {
  Node node(kNone);
  for (int i = 0; i < 10; ++i) {
    node.board.chip.can1.line.send({.id = 0x400U + static_cast<std::uint32_t>(i), .size = 8}, (200 + i) * kMillisecond);
  }
  node.run_ms(400);
  EXPECT_EQ(node.result(6), 10U);
  EXPECT_TRUE(node.complaints().empty()) << node.complaints().text();
}

TEST(Sensors, MissingImuReadsAsAllOnes) {
  Node node(kNone, {.imu_present = false});
  node.run_ms(200);
  EXPECT_EQ(node.result(0), 0xFFU);
  EXPECT_TRUE(node.complaints().empty()) << node.complaints().text();
}

}  // namespace
}  // namespace tetap::board
