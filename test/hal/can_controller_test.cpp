// SPDX-License-Identifier: Apache-2.0
#include "hal/chip/zynqmp/can_controller.hpp"

#include "test/hal/fake_can_chip.hpp"

#include <gtest/gtest.h>

namespace tetap::hal::zynqmp_r5 {
namespace {

using Controller = CanController<FakeRegisters, FakeClock>;
static_assert(CanBus<Controller>);

constexpr CanConfig kConfig{.timing = can_bit_timing(100'000'000, 500'000)};

base::CanFrame numbered(std::uint32_t number) {
  return {.id = number & 0x7FFU,
          .size = 4,
          .data = {static_cast<std::uint8_t>(number), static_cast<std::uint8_t>(number >> 8), 0xA5, 0x5A}};
}

class CanControllerTest : public testing::TestWithParam<Machine> {
 protected:
  CanControllerTest() { can.start(GetParam(), kConfig); }
  void arrive(std::uint32_t number) { chip.arrive(to_words(GetParam(), numbered(number))); }

  FakeCanChip chip;
  FakeClock clock;
  Controller can{FakeRegisters{&chip}, clock};
};
INSTANTIATE_TEST_SUITE_P(Machines, CanControllerTest, testing::Values(Machine::kSilicon, Machine::kEmulated),
                         [](const auto& one) { return std::string{name(one.param)}; });

TEST_P(CanControllerTest, StartsOnTheBusWithItsBitTimingAndNoInterrupts) {
  EXPECT_TRUE(chip.on_the_bus());
  EXPECT_EQ(chip.peek(0x08), kConfig.timing.brpr());
  EXPECT_EQ(chip.peek(0x0C), kConfig.timing.btr());
  EXPECT_EQ(chip.peek(0x20), 0U);
  EXPECT_EQ(chip.peek(0x60), 0U);
}

TEST_P(CanControllerTest, EverythingSentReachesTheWireOnceAndInOrder) {
  std::uint32_t taken = 0;
  for (std::uint32_t step = 0; step < 3000; ++step) {
    if (can.send(numbered(taken))) ++taken;
    if (step % 3 == 0) can.flush();
    if (step % 7 == 0) chip.transmit(step % 11);
  }
  for (int i = 0; i < 100; ++i) {
    can.flush();
    chip.transmit(64);
  }
  ASSERT_EQ(chip.wire.size(), taken);
  for (std::uint32_t i = 0; i < taken; ++i) EXPECT_EQ(to_frame(GetParam(), chip.wire[i]), numbered(i));
  EXPECT_EQ(can.faults().tx_full, 3000 - taken);
  EXPECT_GT(taken, 1000U);
}

TEST_P(CanControllerTest, AStuckBusFillsTheRingAndIsSaidNotWaitedFor) {
  chip.fault = Fault::kBusStuck;
  const std::uint32_t before = chip.accesses;
  std::uint32_t taken = 0;
  for (std::uint32_t i = 0; i < 1000; ++i) {
    if (can.send(numbered(i))) ++taken;
    can.flush();
  }
  EXPECT_EQ(taken, FakeCanChip::kDepth + Controller::kTransmitCapacity);
  EXPECT_EQ(can.faults().tx_full, 1000 - taken);
  EXPECT_EQ(can.faults().tx_high, Controller::kTransmitCapacity);
  EXPECT_LT(chip.accesses - before, 10'000U);
}

TEST_P(CanControllerTest, ReceivesInOrderOfArrivalAndThenNothing) {
  for (std::uint32_t i = 0; i < 60; ++i) arrive(i);
  for (std::uint32_t i = 0; i < 60; ++i) EXPECT_EQ(can.receive(), numbered(i));
  EXPECT_EQ(can.receive(), std::nullopt);
  arrive(60);
  EXPECT_EQ(can.receive(), numbered(60));
  EXPECT_EQ(can.faults().rx_overflow, 0U);
}

TEST_P(CanControllerTest, AnOverflowIsCountedOnceAndWhatWasKeptIsDelivered) {
  for (std::uint32_t i = 0; i < FakeCanChip::kDepth + 5; ++i) arrive(i);
  std::uint32_t got = 0;
  while (const auto frame = can.receive()) EXPECT_EQ(*frame, numbered(got++));
  EXPECT_EQ(got, FakeCanChip::kDepth);
  EXPECT_EQ(can.faults().rx_overflow, 1U);
  for (std::uint32_t i = 0; i < FakeCanChip::kDepth + 1; ++i) arrive(i);
  EXPECT_TRUE(can.receive().has_value());
  EXPECT_EQ(can.faults().rx_overflow, 2U);
}

TEST_P(CanControllerTest, RemoteFramesAreCountedAndPassedOver) {
  chip.arrive({.id = id_word(GetParam(), {.id = 7, .remote = true})});
  chip.arrive({.id = id_word(GetParam(), {.id = 8, .extended = true, .remote = true})});
  arrive(9);
  EXPECT_EQ(can.receive(), numbered(9));
  EXPECT_EQ(can.rx_unsupported(), 2U);
}

TEST_P(CanControllerTest, AfterBusOffTheNodeStaysAwayThenComesBackAsItWas) {
  arrive(1);
  chip.go_bus_off();
  EXPECT_EQ(can.receive(), numbered(1));  // what was received before is not lost
  EXPECT_EQ(can.faults().bus_off, 1U);
  EXPECT_FALSE(chip.on_the_bus());
  const int restarts = chip.restarts;

  ASSERT_TRUE(can.send(numbered(2)));
  clock.time = Controller::kBusOffHold - base::Micros{1};
  for (int i = 0; i < 10; ++i) {
    can.flush();
    EXPECT_EQ(can.receive(), std::nullopt);
  }
  EXPECT_FALSE(chip.on_the_bus());
  EXPECT_EQ(chip.restarts, restarts);

  clock.time = Controller::kBusOffHold;
  can.flush();
  EXPECT_TRUE(chip.on_the_bus());
  EXPECT_EQ(chip.restarts, restarts + 1);
  EXPECT_EQ(chip.peek(0x08), kConfig.timing.brpr());
  EXPECT_EQ(chip.peek(0x0C), kConfig.timing.btr());
  chip.transmit(64);
  ASSERT_EQ(chip.wire.size(), 1U);
  EXPECT_EQ(to_frame(GetParam(), chip.wire[0]), numbered(2));
  EXPECT_EQ(can.faults().bus_off, 1U);

  chip.go_bus_off();
  EXPECT_EQ(can.receive(), std::nullopt);
  EXPECT_EQ(can.faults().bus_off, 2U);
}

TEST_P(CanControllerTest, AControllerThatDoesNotFollowCannotHoldTheStart) {
  chip.fault = Fault::kNoModeChange;
  chip.accesses = 0;
  can.start(GetParam(), kConfig);
  EXPECT_LT(chip.accesses, 5'000U);
}

TEST_P(CanControllerTest, FiltersLetThroughWhatTheyNameAndSurviveARestart) {
  CanConfig config = kConfig;
  config.filters[0] = {.id = 0x100, .mask = 0x7C0};
  config.filters[1] = {.id = 0x1234'0000, .mask = 0x1FFF'0000, .extended = true};
  config.filter_count = 2;
  can.start(GetParam(), config);
  for (int pass = 0; pass < 2; ++pass) {
    for (const base::CanFrame& frame : {base::CanFrame{.id = 0x13F, .size = 1}, base::CanFrame{.id = 0x140, .size = 1},
                                        base::CanFrame{.id = 0x100, .extended = true, .size = 1},
                                        base::CanFrame{.id = 0x1234'5678, .extended = true, .size = 1}}) {
      chip.arrive(to_words(GetParam(), frame));
    }
    EXPECT_EQ(can.receive()->id, 0x13FU);
    EXPECT_EQ(can.receive()->id, 0x1234'5678U);
    EXPECT_EQ(can.receive(), std::nullopt);
    chip.go_bus_off();
    EXPECT_EQ(can.receive(), std::nullopt);
    clock.time += Controller::kBusOffHold;
    can.flush();
  }
}

}  // namespace
}  // namespace tetap::hal::zynqmp_r5
