// SPDX-License-Identifier: Apache-2.0
#include "hal/chip/stm32/fdcan_controller.hpp"

#include "fake_fdcan.hpp"

#include <gtest/gtest.h>

#include <random>

namespace tetap::hal::stm32 {
namespace {

// Decoded as RM0440 has NBTP, apart from the header that the driver uses.
constexpr std::uint32_t quanta(std::uint32_t word) { return 1 + ((word >> 8 & 255U) + 1) + ((word & 127U) + 1); }
constexpr std::uint32_t bit_rate(std::uint32_t word, std::uint32_t clock_hz) {
  return clock_hz / (((word >> 16 & 511U) + 1) * quanta(word));
}
constexpr bool samples_at_875(std::uint32_t word, std::uint32_t clock_hz, std::uint32_t rate) {
  const bool point = 8 * (2 + (word >> 8 & 255U)) == 7 * quanta(word);
  const std::uint32_t prescaled = ((word >> 16 & 511U) + 1) * quanta(word);
  return bit_rate(word, clock_hz) == rate && clock_hz % prescaled == 0 && point && (word >> 25) <= (word & 127U);
}
constexpr std::uint32_t kApb_hz = 160'000'000, kInternal_hz = 16'000'000;
consteval std::uint32_t word(std::uint32_t clock_hz, std::uint32_t rate) {
  return nbtp(can_bit_timing(clock_hz, rate, kFdcanTimingLimits));
}
static_assert(samples_at_875(word(kApb_hz, 125'000), kApb_hz, 125'000));
static_assert(samples_at_875(word(kApb_hz, 250'000), kApb_hz, 250'000));
static_assert(samples_at_875(word(kApb_hz, 500'000), kApb_hz, 500'000));
static_assert(samples_at_875(word(kApb_hz, 1'000'000), kApb_hz, 1'000'000));
static_assert(samples_at_875(word(kInternal_hz, 500'000), kInternal_hz, 500'000));

TEST(FdcanTiming, HalfAMegabitHasManyQuantaAndResynchronisesByTheWholeSecondSegment) {
  constexpr CanBitTiming kTiming = can_bit_timing(kApb_hz, 500'000, kFdcanTimingLimits);
  EXPECT_EQ(kTiming, (CanBitTiming{.prescaler = 2, .segment1 = 139, .segment2 = 20, .jump = 20}));
  EXPECT_EQ(nbtp(kTiming), 19U << 25 | 1U << 16 | 138U << 8 | 19U);
}

TEST(FdcanEncoding, WordsAreThoseOfTheManual) {
  const FdcanElement standard = to_element({.id = 0x123, .size = 3, .data = {0x11, 0x22, 0x33}});
  EXPECT_EQ(standard, (FdcanElement{.identifier = 0x123U << 18, .control = 3U << 16, .low = 0x0033'2211, .high = 0}));
  const base::CanFrame long_frame{.id = 0x1ABC'DEF0, .extended = true, .size = 8, .data = {1, 2, 3, 4, 5, 6, 7, 8}};
  const FdcanElement extended = to_element(long_frame);
  EXPECT_EQ(extended.identifier, 0x1ABC'DEF0U | 1U << 30);
  EXPECT_EQ(extended.low, 0x0403'0201U);
  EXPECT_EQ(extended.high, 0x0807'0605U);
  EXPECT_EQ(to_frame(extended), long_frame);
  // A classic filter that stores in FIFO 0.
  EXPECT_EQ(fdcan_filter_word({.id = 0x300, .mask = 0x7E0}), 2U << 30 | 1U << 27 | 0x300U << 16 | 0x7E0U);
}

TEST(FdcanEncoding, EveryFrameComesBack) {
  std::mt19937 random{11};
  for (int i = 0; i < 10'000; ++i) {
    base::CanFrame frame{.extended = random() % 2 == 0, .size = static_cast<std::uint8_t>(random() % 9)};
    frame.id = static_cast<std::uint32_t>(random()) & (frame.extended ? 0x1FFF'FFFFU : 0x7FFU);
    for (std::size_t k = 0; k < frame.size; ++k) frame.data[k] = static_cast<std::uint8_t>(random());
    ASSERT_EQ(to_frame(to_element(frame)), frame);
  }
  EXPECT_EQ(to_frame(FdcanElement{.identifier = 1U << 29}), std::nullopt);             // remote
  EXPECT_EQ(to_frame(FdcanElement{.identifier = 0, .control = 15U << 16})->size, 8U);  // a length of 9 to 15 is 8
  // The error state of the sender, the time stamp and the filter's number are no part of the frame.
  EXPECT_EQ(to_frame(FdcanElement{.identifier = 1U << 31 | 5U << 18, .control = 0xFF01'1234})->id, 5U);
}

struct Clock {
  base::Micros time{};
  [[nodiscard]] base::Micros now() const { return time; }
};
struct NoLock {
  NoLock() {}
  ~NoLock() {}
};

constexpr FdcanConfig kConfig{.timing = can_bit_timing(kApb_hz, 500'000, kFdcanTimingLimits),
                              .filter = {.id = 0x300, .mask = 0x7E0}};

base::CanFrame numbered(std::uint32_t id, std::uint32_t number) {
  base::CanFrame frame{.id = id, .size = 4};
  for (unsigned i = 0; i < 4; ++i) frame.data[i] = static_cast<std::uint8_t>(number >> 8 * i);
  return frame;
}

class FdcanTest : public testing::Test {
 protected:
  using Controller = FdcanController<FdcanRegisters, Clock, NoLock>;

  FdcanTest() { can.start(kConfig); }
  ~FdcanTest() override { EXPECT_EQ(chip.foreign_words, 0U); }
  void interrupts() {
    for (int i = 0; i < 10; ++i) {
      if (chip.line(1)) can.on_transmit_interrupt();
      if (chip.line(0)) can.on_receive_interrupt();
    }
  }
  void on_bus() {
    can.flush();
    ASSERT_EQ(can.state(), CanState::kOnBus);
  }
  static FakeFdcan::Frame words(const base::CanFrame& frame) {
    const FdcanElement element = to_element(frame);
    return {element.identifier, element.control, element.low, element.high};
  }

  Clock clock;
  FakeFdcan chip;
  Controller can{FdcanRegisters{&chip, false}, FdcanRegisters{&chip, true}, clock};
};

TEST_F(FdcanTest, FramesLeaveInTheOrderOfSendWhateverTheirIdentifiers) {
  on_bus();
  EXPECT_EQ(bit_rate(chip.bit_timing(), kApb_hz), 500'000U);
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

TEST_F(FdcanTest, TheInterruptAloneEmptiesTheRing) {
  on_bus();
  for (std::uint32_t i = 0; i < 100; ++i) ASSERT_TRUE(can.send(numbered(0x320, i)));
  can.flush();
  for (int i = 0; i < 100; ++i) {
    chip.transmit();
    interrupts();
  }
  EXPECT_EQ(chip.wire.size(), 100U);
  EXPECT_FALSE(chip.line(1)) << "a request that stays keeps the core in the handler";
  EXPECT_EQ(can.faults().tx_high, 100U);
}

TEST_F(FdcanTest, NobodyAcknowledges) {
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

TEST_F(FdcanTest, ReceivesInOrderStampsAndCountsWhatTheFifoLost) {
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

TEST_F(FdcanTest, TheFilterPassesTheNodesInputsAndNothingElse) {
  on_bus();
  chip.arrive(words({.id = 0x31F, .size = 1}));
  chip.arrive(words({.id = 0x320, .size = 1}));
  chip.arrive(words({.id = 0x2FF, .size = 1}));
  chip.arrive(words({.id = 0x300, .extended = true, .size = 1}));
  chip.arrive(words({.id = 0x300U << 18, .extended = true, .size = 1}));
  chip.arrive({.identifier = 0x301U << 18 | 1U << 29});  // remote
  interrupts();
  EXPECT_EQ(can.receive()->id, 0x31FU);
  EXPECT_EQ(can.receive(), std::nullopt);
}

TEST_F(FdcanTest, AShortBusOffLosesNothing) {
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
  EXPECT_EQ(chip.recoveries, 0) << "INIT stays until the program clears it";
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

TEST_F(FdcanTest, AfterALongBusOffTheFirstFrameIsNewAndTheRestFollowsOn) {
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

TEST_F(FdcanTest, WhatIsGivenUpWhileInitStandsIsNotSentLater) {
  on_bus();
  for (std::uint32_t i = 0; i < 3; ++i) ASSERT_TRUE(can.send(numbered(0x320, i)));
  can.flush();  // they lie in the buffers
  chip.go_off();
  can.flush();
  while (can.send(numbered(0x320, 100))) {
  }
  EXPECT_EQ(can.state(), CanState::kAway);
  ASSERT_TRUE(can.send(numbered(0x320, 200)));
  clock.time = Controller::kBusOffHold;
  can.flush();
  chip.idle_bus();
  for (int i = 0; i < 10; ++i) {
    can.flush();
    chip.transmit();
    interrupts();
  }
  ASSERT_EQ(chip.wire.size(), 1U);
  EXPECT_EQ(chip.wire[0].low, 200U);
}

TEST_F(FdcanTest, AStuckBusIsOneFaultAndIsJoinedWhenItIsFree) {
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

TEST_F(FdcanTest, AControllerThatDoesNotFollowCannotHoldTheStart) {
  FakeFdcan dead;
  dead.deaf = true;
  Controller other{FdcanRegisters{&dead, false}, FdcanRegisters{&dead, true}, clock};
  other.start(kConfig);
  EXPECT_EQ(other.state(), CanState::kStopped);
  EXPECT_EQ(other.faults().bus_off, 1U);
  EXPECT_LT(dead.accesses, 5'000U);
  for (int i = 0; i < 10; ++i) other.flush();
}

}  // namespace
}  // namespace tetap::hal::stm32
