// SPDX-License-Identifier: Apache-2.0
#include "hal/chip/stm32/can_controller.hpp"

#include "fake_bxcan.hpp"

#include <gtest/gtest.h>

#include <random>

namespace tetap::hal::stm32 {
namespace {

// Decoded as RM0402 has the register, apart from the header that the driver uses.
constexpr std::uint32_t bit_rate(std::uint32_t btr, std::uint32_t clock_hz) {
  const std::uint32_t quanta = 1 + ((btr >> 16 & 15U) + 1) + ((btr >> 20 & 7U) + 1);
  return clock_hz / (((btr & 1023U) + 1) * quanta);
}
/// The sample point is 7/8 of the bit.
constexpr bool is_at_875(std::uint32_t btr) {
  const std::uint32_t before = 1 + (btr >> 16 & 15U) + 1, segment2 = (btr >> 20 & 7U) + 1;
  return before == 7 * segment2;
}

constexpr bool samples_at_875(CanBitTiming timing, std::uint32_t clock_hz, std::uint32_t rate) {
  const std::uint32_t btr = timing.btr();
  return bit_rate(btr, clock_hz) == rate && clock_hz % rate == 0 && is_at_875(btr) && btr >> 30 == 0;
}
constexpr std::uint32_t kApb_hz = 48'000'000, kInternal_hz = 16'000'000;
static_assert(samples_at_875(can_bit_timing(kApb_hz, 125'000), kApb_hz, 125'000));
static_assert(samples_at_875(can_bit_timing(kApb_hz, 250'000), kApb_hz, 250'000));
static_assert(samples_at_875(can_bit_timing(kApb_hz, 500'000), kApb_hz, 500'000));
static_assert(samples_at_875(can_bit_timing(kApb_hz, 1'000'000), kApb_hz, 1'000'000));
static_assert(samples_at_875(can_bit_timing(kInternal_hz, 500'000), kInternal_hz, 500'000));

TEST(BxcanTiming, ResynchronisesByTheWholeSecondSegment) {
  constexpr CanBitTiming kTiming = can_bit_timing(48'000'000, 500'000);
  EXPECT_EQ(kTiming, (CanBitTiming{.prescaler = 6, .segment1 = 13, .segment2 = 2, .jump = 2}));
  EXPECT_EQ(kTiming.sample_point_permille(), 875U);
}

TEST(BxcanEncoding, WordsAreThoseOfTheManual) {
  const CanMailbox standard = to_mailbox({.id = 0x123, .size = 3, .data = {0x11, 0x22, 0x33}});
  EXPECT_EQ(standard, (CanMailbox{.identifier = 0x123U << 21, .length = 3, .low = 0x0033'2211, .high = 0}));
  const base::CanFrame long_frame{.id = 0x1ABC'DEF0, .extended = true, .size = 8, .data = {1, 2, 3, 4, 5, 6, 7, 8}};
  const CanMailbox extended = to_mailbox(long_frame);
  EXPECT_EQ(extended.identifier, 0x1ABC'DEF0U << 3 | 4U);
  EXPECT_EQ(extended.low, 0x0403'0201U);
  EXPECT_EQ(extended.high, 0x0807'0605U);
  EXPECT_EQ(to_frame(extended), long_frame);
}

TEST(BxcanEncoding, EveryFrameComesBack) {
  std::mt19937 random{11};
  for (int i = 0; i < 10'000; ++i) {
    base::CanFrame frame{.extended = random() % 2 == 0, .size = static_cast<std::uint8_t>(random() % 9)};
    frame.id = static_cast<std::uint32_t>(random()) & (frame.extended ? 0x1FFF'FFFFU : 0x7FFU);
    for (std::size_t k = 0; k < frame.size; ++k) frame.data[k] = static_cast<std::uint8_t>(random());
    ASSERT_EQ(to_frame(to_mailbox(frame)), frame);
  }
  EXPECT_EQ(to_frame({.identifier = 2}), std::nullopt);            // remote
  EXPECT_EQ(to_frame({.identifier = 0, .length = 15})->size, 8U);  // a length of 9 to 15 is 8
}

struct Clock {
  base::Micros time{};
  [[nodiscard]] base::Micros now() const { return time; }
};
struct NoLock {
  NoLock() {}
  ~NoLock() {}
};

constexpr CanConfig kConfig{.timing = can_bit_timing(48'000'000, 500'000), .filter = {.id = 0x300, .mask = 0x7E0}};

base::CanFrame numbered(std::uint32_t id, std::uint32_t number) {
  base::CanFrame frame{.id = id, .size = 4};
  for (unsigned i = 0; i < 4; ++i) frame.data[i] = static_cast<std::uint8_t>(number >> 8 * i);
  return frame;
}

class BxcanTest : public testing::Test {
 protected:
  using Controller = CanController<BxcanRegisters, Clock, NoLock>;

  BxcanTest() { can.start(kConfig); }
  void interrupts() {
    for (int i = 0; i < 10; ++i) {
      if (chip.transmit_interrupt()) can.on_transmit_interrupt();
      if (chip.receive_interrupt()) can.on_receive_interrupt();
    }
  }
  void on_bus() {
    can.flush();
    ASSERT_EQ(can.state(), CanState::kOnBus);
  }
  static FakeBxcan::Frame words(const base::CanFrame& frame) {
    const CanMailbox box = to_mailbox(frame);
    return {box.identifier, box.length, box.low, box.high};
  }

  Clock clock;
  FakeBxcan chip;
  Controller can{BxcanRegisters{&chip}, clock};
};

TEST_F(BxcanTest, FramesLeaveInTheOrderOfSendWhateverTheirIdentifiers) {
  on_bus();
  EXPECT_EQ(bit_rate(chip.bit_timing(), 48'000'000), 500'000U);
  std::mt19937 random{3};
  std::vector<base::CanFrame> sent;
  for (std::uint32_t i = 0; i < 500; ++i) {
    const std::uint32_t ids[] = {0x7FF - i, 0x300, static_cast<std::uint32_t>(random()) & 0x7FFU};
    const base::CanFrame frame = numbered(ids[random() % 3], i);
    if (can.send(frame)) sent.push_back(frame);
    if (random() % 3 != 0) can.flush();
    for (auto k = random() % 3; k > 0; --k) {
      chip.transmit();
      if (random() % 2 == 0) interrupts();
    }
  }
  for (int i = 0; i < 600; ++i) {
    chip.transmit();
    interrupts();
  }
  ASSERT_EQ(chip.wire.size(), sent.size());
  for (std::size_t i = 0; i < sent.size(); ++i) ASSERT_EQ(chip.wire[i], words(sent[i])) << i;
  EXPECT_EQ(sent.size() + can.faults().tx_full, 500U);
}

TEST_F(BxcanTest, TheInterruptAloneEmptiesTheRing) {
  on_bus();
  for (std::uint32_t i = 0; i < 100; ++i) ASSERT_TRUE(can.send(numbered(0x320, i)));
  can.flush();
  for (int i = 0; i < 100; ++i) {
    chip.transmit();
    interrupts();
  }
  EXPECT_EQ(chip.wire.size(), 100U);
  EXPECT_FALSE(chip.transmit_interrupt()) << "a request that stays keeps the core in the handler";
  EXPECT_EQ(can.faults().tx_high, 100U);
}

TEST_F(BxcanTest, NobodyAcknowledges) {
  on_bus();
  std::uint32_t refused = 0;
  for (std::uint32_t i = 0; i < 1000; ++i) {
    refused += can.send(numbered(0x320, i)) ? 0 : 1;
    can.flush();
    interrupts();
  }
  EXPECT_EQ(refused, 1000 - Controller::kTransmitCapacity - 3);
  EXPECT_EQ(can.faults().tx_full, refused);
  // A partner appears: what was taken goes out without a gap.
  for (int i = 0; i < 1000; ++i) {
    chip.transmit();
    interrupts();
  }
  ASSERT_EQ(chip.wire.size(), Controller::kTransmitCapacity + 3);
  for (std::uint32_t i = 0; i < chip.wire.size(); ++i) EXPECT_EQ(chip.wire[i].low, i);
}

TEST_F(BxcanTest, ReceivesInOrderStampsAndCountsWhatTheFifoLost) {
  on_bus();
  for (std::uint32_t i = 0; i < 3; ++i) {
    clock.time = base::Micros{1000 + i};
    chip.arrive(words(numbered(0x300 + i, i)));
    interrupts();
  }
  for (std::uint32_t i = 0; i < 5; ++i) chip.arrive(words(numbered(0x310, 10 + i)));  // the handler is late: 2 lost
  EXPECT_FALSE(can.receive()->extended);
  EXPECT_EQ(can.arrived().us, 1000);
  interrupts();
  EXPECT_EQ(can.receive(), numbered(0x301, 1));
  EXPECT_EQ(can.arrived().us, 1001);
  EXPECT_EQ(can.receive(), numbered(0x302, 2));
  for (std::uint32_t i = 0; i < 3; ++i) EXPECT_EQ(can.receive(), numbered(0x310, 10 + i));
  EXPECT_EQ(can.receive(), std::nullopt);
  EXPECT_EQ(can.faults().rx_overflow, 1U);  // one event
  for (std::uint32_t i = 0; i < Controller::kReceiveCapacity + 5; ++i) {
    chip.arrive(words(numbered(0x310, i)));
    interrupts();
  }
  EXPECT_EQ(can.faults().rx_overflow, 6U);
  for (std::uint32_t i = 0; i < Controller::kReceiveCapacity; ++i) ASSERT_EQ(can.receive(), numbered(0x310, i));
  EXPECT_EQ(can.receive(), std::nullopt);
}

TEST_F(BxcanTest, TheFilterPassesTheNodesInputsAndNothingElse) {
  on_bus();
  chip.arrive(words({.id = 0x31F, .size = 1}));
  chip.arrive(words({.id = 0x320, .size = 1}));
  chip.arrive(words({.id = 0x2FF, .size = 1}));
  chip.arrive(words({.id = 0x300, .extended = true, .size = 1}));
  chip.arrive(words({.id = 0x300U << 18, .extended = true, .size = 1}));
  chip.arrive({.identifier = 0x301U << 21 | 2U});  // remote
  interrupts();
  EXPECT_EQ(can.receive()->id, 0x31FU);
  EXPECT_EQ(can.receive(), std::nullopt);
}

TEST_F(BxcanTest, AShortBusOffLosesNothing) {
  on_bus();
  for (std::uint32_t i = 0; i < 10; ++i) ASSERT_TRUE(can.send(numbered(0x320, i)));
  can.flush();
  chip.go_off();
  can.flush();
  EXPECT_EQ(can.state(), CanState::kAway);
  EXPECT_EQ(can.faults().bus_off, 1U);
  clock.time = Controller::kBusOffHold - base::Micros{1};
  can.flush();
  chip.idle_bus();
  EXPECT_EQ(chip.recoveries, 0);
  clock.time = Controller::kBusOffHold;
  can.flush();
  EXPECT_EQ(can.state(), CanState::kRecovering);
  can.flush();
  EXPECT_EQ(can.state(), CanState::kRecovering);  // the bus has not been idle yet
  chip.idle_bus();
  for (int i = 0; i < 20; ++i) {
    can.flush();
    chip.transmit();
    interrupts();
  }
  EXPECT_EQ(can.faults().bus_off, 1U);
  ASSERT_EQ(chip.wire.size(), 10U);
  for (std::uint32_t i = 0; i < 10; ++i) EXPECT_EQ(chip.wire[i].low, i);
}

TEST_F(BxcanTest, AfterALongBusOffTheFirstFrameIsNewAndTheRestFollowsOn) {
  on_bus();
  for (std::uint32_t i = 0; i < 5; ++i) ASSERT_TRUE(can.send(numbered(0x320, 5'000 + i)));
  can.flush();  // three of them lie in the mailboxes
  chip.go_off();
  std::uint32_t last_refused = 0;
  for (std::uint32_t i = 0; i < 1'000; ++i) {
    clock.time = base::Micros{1'000 * i};
    if (!can.send(numbered(0x320, i))) last_refused = i;
    can.flush();
    interrupts();
  }
  EXPECT_GE(last_refused, 1'000 - Controller::kTransmitCapacity - 1);
  EXPECT_GE(can.faults().tx_full, 7U);
  chip.idle_bus();
  for (int i = 0; i < 300; ++i) {
    can.flush();
    chip.transmit();
    interrupts();
  }
  ASSERT_FALSE(chip.wire.empty());
  for (std::uint32_t i = 0; i < chip.wire.size(); ++i) EXPECT_EQ(chip.wire[i].low, last_refused + 1 + i);
  EXPECT_EQ(chip.wire.back().low, 999U);
}

TEST_F(BxcanTest, AStuckBusIsOneFaultAndIsJoinedWhenItIsFree) {
  chip.silent = true;
  can.start(kConfig);
  for (int i = 0; i < 50; ++i) {
    clock.time += base::Micros{1'000};
    can.flush();
  }
  EXPECT_EQ(can.state(), CanState::kJoining);
  EXPECT_EQ(can.faults().bus_off, 1U);
  chip.silent = false;
  on_bus();
}

TEST_F(BxcanTest, AControllerThatDoesNotFollowCannotHoldTheStart) {
  FakeBxcan dead;
  dead.deaf = true;
  Controller other{BxcanRegisters{&dead}, clock};
  other.start(kConfig);
  EXPECT_EQ(other.state(), CanState::kStopped);
  EXPECT_EQ(other.faults().bus_off, 1U);
  EXPECT_LT(dead.accesses, 5'000U);
  for (int i = 0; i < 10; ++i) other.flush();
}

}  // namespace
}  // namespace tetap::hal::stm32
