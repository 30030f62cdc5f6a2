// SPDX-License-Identifier: Apache-2.0
// The parts of the STM32 port that are values: clock plan, watchdog's time, boot cause, pins, the fault's record.
#include "hal/chip/arm/stored_fault.hpp"
#include "hal/chip/stm32/boot_cause.hpp"
#include "hal/chip/stm32/clock_tree.hpp"
#include "hal/chip/stm32/encoder_timer.hpp"
#include "hal/chip/stm32/gpio.hpp"
#include "hal/chip/stm32/pll_plan_f4.hpp"
#include "hal/chip/stm32/spi_master.hpp"
#include "hal/chip/stm32/watchdog.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <map>
#include <vector>

namespace tetap::hal {
namespace {

using namespace stm32;

// Blocks of registers that keep what is written; some bits follow others, as the chip's do.
struct Block {
  std::map<std::uint32_t, std::uint32_t> words;
  bool is_rcc = false, is_power = false;
  bool crystal = true, locks = true;
  std::vector<std::uint32_t> latency_at_switch;
  Block* flash = nullptr;

  std::uint32_t read(std::uint32_t offset) {
    if (is_power && offset == 4) return 1U << 14;
    std::uint32_t value = words[offset];
    if (!is_rcc) return value;
    if (offset == 0x00) {
      const bool from_crystal = (words[0x04] >> 22 & 1U) != 0;
      value &= ~(1U << 1 | 1U << 17 | 1U << 25);
      value |= (value & 1U) << 1;
      if (crystal) value |= (value & 1U << 16) << 1;
      if (locks && (!from_crystal || crystal)) value |= (value & 1U << 24) << 1;
    }
    if (offset == 0x08) value |= (value & 3U) << 2;
    return value;
  }
  void write(std::uint32_t offset, std::uint32_t value) {
    if (is_rcc && offset == 0x08 && (value & 3U) != (words[offset] & 3U))
      latency_at_switch.push_back(flash->words[0] & 7U);
    words[offset] = value;
  }
};
struct BlockRegisters {
  Block* block;
  [[nodiscard]] std::uint32_t read(std::uint32_t offset) const { return block->read(offset); }
  void write(std::uint32_t offset, std::uint32_t value) const { block->write(offset, value); }
};

struct Chip {
  Block flash{}, pwr{.is_power = true}, rcc{.is_rcc = true, .flash = &flash};
  Clocks start() {
    return ClockTree<BlockRegisters>{{&rcc}, {&pwr}, {&flash}}.start(
        F4PllPlan{.crystal_hz = 8'000'000, .core_hz = 96'000'000});
  }
  /// From PLLCFGR, as RM0402 has it.
  [[nodiscard]] std::uint32_t pll_hz() {
    const std::uint32_t word = rcc.words[0x04];
    const std::uint32_t input_hz = (word >> 22 & 1U) != 0 ? 8'000'000 : 16'000'000;
    return input_hz / (word & 63U) * (word >> 6 & 511U) / (((word >> 16 & 3U) + 1) * 2);
  }
};

TEST(ClockTree, TheCrystalThroughThePllWithWaitStatesBeforeTheSwitch) {
  Chip chip;
  const Clocks clocks = chip.start();
  EXPECT_EQ(clocks.source, ClockSource::kCrystal);
  EXPECT_EQ(chip.pll_hz(), 96'000'000U);
  EXPECT_EQ(clocks.core_hz, 96'000'000U);
  EXPECT_EQ(clocks.apb1_hz, 48'000'000U);
  EXPECT_EQ(chip.rcc.words[0x08], 2U | 4U << 10);  // PLL, APB1 halved
  EXPECT_EQ(chip.rcc.latency_at_switch, std::vector<std::uint32_t>{3});
  EXPECT_EQ(chip.pwr.words[0] >> 14 & 3U, 3U);
  EXPECT_NE(chip.rcc.words[0x00] & 1U << 19, 0U);  // the crystal is watched
}

TEST(ClockTree, WithoutACrystalTheInternalOscillatorGivesTheSameClock) {
  Chip chip;
  chip.rcc.crystal = false;
  const Clocks clocks = chip.start();
  EXPECT_EQ(clocks.source, ClockSource::kInternal);
  EXPECT_EQ(chip.pll_hz(), 96'000'000U);
  EXPECT_EQ(clocks.core_hz, 96'000'000U);
  EXPECT_EQ(chip.rcc.words[0x00] & (1U << 16 | 1U << 19), 0U);
}

TEST(ClockTree, APllThatNeverLocksLeavesTheInternalOscillator) {
  Chip chip;
  chip.rcc.locks = false;
  const Clocks clocks = chip.start();
  EXPECT_EQ(clocks.source, ClockSource::kInternalDirect);
  EXPECT_EQ(clocks.core_hz, 16'000'000U);
  EXPECT_EQ(chip.rcc.words[0x08] & 3U, 0U);
}

TEST(ClockTree, PlansOutsideOfTheDataSheetAreInvalid) {
  EXPECT_TRUE((F4PllPlan{.crystal_hz = 24'000'000, .core_hz = 100'000'000}).valid());
  EXPECT_FALSE((F4PllPlan{.crystal_hz = 8'000'000, .core_hz = 102'000'000}).valid());
  EXPECT_FALSE((F4PllPlan{.crystal_hz = 3'000'000, .core_hz = 96'000'000}).valid());
  EXPECT_FALSE((F4PllPlan{.crystal_hz = 8'000'000, .core_hz = 96'000'000, .p = 8}).valid());  // VCO at 768 MHz
  EXPECT_FALSE((F4PllPlan{.crystal_hz = 25'000'000, .core_hz = 96'000'000}).valid());         // no whole steps of 2 MHz
  EXPECT_TRUE((F4PllPlan{.crystal_hz = 25'000'000, .core_hz = 80'000'000, .limits = kStm32f405Clocks}).valid());
  // APB1 of the STM32F405 ends at 42 MHz.
  EXPECT_FALSE((F4PllPlan{.crystal_hz = 25'000'000, .core_hz = 88'000'000, .limits = kStm32f405Clocks}).valid());
}

TEST(Watchdog, ItsTimeHoldsAtEveryFrequencyOfItsOscillator) {
  constexpr WatchdogTime kTime = watchdog_time(200'000);
  EXPECT_NEAR(kTime.us_at(32'000), 200'000, 200);
  EXPECT_NEAR(kTime.shortest_us(), 136'170, 200);
  EXPECT_NEAR(kTime.longest_us(), 376'470, 400);
  for (const std::uint32_t us : {1'000U, 100'000U, 511'000U, 513'000U, 2'000'000U, 32'000'000U}) {
    const WatchdogTime time = watchdog_time(us);
    EXPECT_NEAR(time.us_at(32'000), us, us / 500 + 125) << us;
    EXPECT_LE(time.reload, 0xFFFU);
    EXPECT_LE(time.prescaler, 6U);
  }
  Block block;
  EXPECT_TRUE(stm32::Watchdog<BlockRegisters>{{&block}}.start(kTime));
  EXPECT_EQ(block.words[0x00], 0xAAAAU);
  EXPECT_EQ((block.words[0x08] + 1) * (4U << block.words[0x04]), 6'400U);
}

TEST(BootCause, TheMostParticularFlagDecides) {
  EXPECT_EQ(boot_cause(0x0E00'0000), BootCause::kPowerOn);   // reset value: POR, PIN, BOR
  EXPECT_EQ(boot_cause(0x2400'0000), BootCause::kWatchdog);  // IWDG drives the pin, too
  EXPECT_EQ(boot_cause(0x4400'0000), BootCause::kWatchdog);
  EXPECT_EQ(boot_cause(0x1400'0000), BootCause::kSoftware);
  EXPECT_EQ(boot_cause(0x8400'0000), BootCause::kLowPower);
  EXPECT_EQ(boot_cause(0x0600'0000), BootCause::kBrownOut);
  EXPECT_EQ(boot_cause(0x0400'0000), BootCause::kPin);
  EXPECT_EQ(boot_cause(0), BootCause::kUnknown);
  Block block;
  block.words[0x74] = 0x2400'0001;
  EXPECT_EQ(take_boot_cause(BlockRegisters{&block}), BootCause::kWatchdog);
  EXPECT_EQ(block.words[0x74], 0x2500'0001U);  // RMVF set, the oscillator as it was
}

TEST(Pins, ATableWithAPinTwiceIsRefused) {
  std::array pins{PinSetup{.pin = {0x4002'0000, 4}}, PinSetup{.pin = {0x4002'0400, 4}},
                  PinSetup{.pin = {0x4002'0000, 5}}};
  EXPECT_TRUE(pins_distinct(pins));
  pins[2].pin.number = 4;
  EXPECT_FALSE(pins_distinct(pins));
  pins[2].pin.number = 16;
  EXPECT_FALSE(pins_distinct(pins));
}

TEST(Pins, APinIsSetUpAndItsNeighboursStay) {
  Block port;
  port.words[0x00] = 0xA800'0000;  // reset value of port A: PA13 to PA15 are the debugger's
  port.words[0x0C] = 0x6400'0000;
  set_up(BlockRegisters{&port},
         {.pin = {0, 15}, .mode = PinMode::kAlternate, .alternate = 7, .speed = PinSpeed::kMedium});
  EXPECT_EQ(port.words[0x00], 0xA800'0000U);
  EXPECT_EQ(port.words[0x0C], 0x2400'0000U);
  EXPECT_EQ(port.words[0x24], 0x7000'0000U);
  EXPECT_EQ(port.words[0x08], 1U << 30);
  set_up(BlockRegisters{&port}, {.pin = {0, 3}, .mode = PinMode::kOutput, .drive = PinDrive::kOpenDrain, .high = true});
  EXPECT_EQ(port.words[0x00], 0xA800'0040U);
  EXPECT_EQ(port.words[0x04], 8U);
  EXPECT_EQ(port.words[0x18], 8U);
  EXPECT_EQ(port.words[0x20], 0U);
}

TEST(Encoder, ARoundOfTheCounterIsItsWholeWidth) {
  Block narrow, wide;
  EncoderTimer<BlockRegisters, std::uint16_t> timer3{{&narrow}};
  EncoderTimer<BlockRegisters, std::uint32_t> timer2{{&wide}};
  timer3.start();
  timer2.start();
  EXPECT_EQ(narrow.words[0x2C], 0xFFFFU);
  EXPECT_EQ(wide.words[0x2C], 0xFFFF'FFFFU);
  EXPECT_EQ(narrow.words[0x08] & 7U, 3U);            // both edges of both inputs
  EXPECT_EQ(narrow.words[0x18] & 0x0303U, 0x0101U);  // TI1 and TI2
  EXPECT_EQ(narrow.words[0x28], 0U);
  EXPECT_EQ(narrow.words[0x00] & 1U, 1U);
  narrow.words[0x24] = 0xFFFF;
  EXPECT_EQ(timer3.read().count, 0xFFFFU);
}

// An SPI slave that answers each byte with its complement, a register at a time; it may stop.
struct FakeSpi {
  std::map<std::uint32_t, std::uint32_t> words;
  std::vector<std::uint8_t> received;
  std::uint32_t last = 0;
  bool full = false, stuck = false, overrun = false, selected = false;
  int accesses = 0, selects = 0, until_full = 0;

  std::uint32_t read(std::uint32_t offset) {
    ++accesses;
    if (until_full > 0 && --until_full == 0) full = true;
    if (offset == 0x08) return (full ? 1U : 0U) | 2U | (overrun ? 64U : 0U) | (stuck ? 128U : 0U);
    if (offset != 0x0C) return words[offset];
    full = overrun = false;
    return ~last & 0xFFU;
  }
  void write(std::uint32_t offset, std::uint32_t value) {
    if (offset == 0x0C) {
      EXPECT_TRUE(selected);
      EXPECT_FALSE(full) << "a second byte before the first was read overruns";
      received.push_back(static_cast<std::uint8_t>(value));
      last = value;
      EXPECT_EQ(until_full, 0) << "a second byte before the first was over";
      until_full = stuck ? 0 : 5;
    }
    words[offset] = value;
  }
};
struct SpiRegisters {
  FakeSpi* chip;
  [[nodiscard]] std::uint32_t read(std::uint32_t offset) const { return chip->read(offset); }
  void write(std::uint32_t offset, std::uint32_t value) const { chip->write(offset, value); }
};
struct Select {
  FakeSpi* chip;
  void clear() const { chip->selected = true, ++chip->selects; }
  void set() const { chip->selected = false; }
};

TEST(Spi, AByteForAByteInMode3BelowTheLimitOfTheClock) {
  FakeSpi chip;
  SpiMaster<SpiRegisters, Select> spi_device{{&chip}, {&chip}};
  spi_device.start(96'000'000, 8'000'000);
  const std::uint32_t cr1 = chip.words[0x00];
  EXPECT_EQ(cr1 & 3U, 3U);
  EXPECT_EQ(96'000'000U >> ((cr1 >> 3 & 7U) + 1), 6'000'000U);
  const std::array<std::uint8_t, 2> out{0x75, 0x12};
  std::array<std::uint8_t, 3> in{};
  EXPECT_TRUE(spi_device.transfer(out, in));
  EXPECT_EQ(chip.received, (std::vector<std::uint8_t>{0x75, 0x12, 0xFF, 0xFF, 0xFF}));
  EXPECT_EQ(in, (std::array<std::uint8_t, 3>{0, 0, 0}));
  EXPECT_FALSE(chip.selected);
}

TEST(Spi, ABusThatStopsIsAFaultInABoundedTimeAndTheNextTransferIsClean) {
  FakeSpi chip;
  SpiMaster<SpiRegisters, Select> spi_device{{&chip}, {&chip}};
  spi_device.start(96'000'000, 8'000'000);
  chip.stuck = true;
  std::array<std::uint8_t, 4> in{};
  EXPECT_FALSE(spi_device.transfer({}, in));
  EXPECT_LT(chip.accesses, 5'000);
  EXPECT_FALSE(chip.selected);
  chip.stuck = false;
  chip.full = chip.overrun = true;
  EXPECT_TRUE(spi_device.transfer({}, in));
  EXPECT_EQ(chip.selects, 2);
}

TEST(StoredFault, IsTakenOnceAndChanceIsNone) {
  alignas(StoredFault) std::array<unsigned char, sizeof(StoredFault)> memory{};
  StoredFault stored;
  for (const int byte : {0x00, 0xFF, 0xA5}) {
    memory.fill(static_cast<unsigned char>(byte));
    std::memcpy(&stored, memory.data(), sizeof stored);
    EXPECT_EQ(stored.take(), std::nullopt) << byte;
  }
  const FaultRecord record{
      .fault = CpuFault::kBus, .program_counter = 0x0800'1234, .link_register = 3, .address = 4, .status = 5};
  stored.store(record);
  const auto taken = stored.take();
  ASSERT_TRUE(taken.has_value());
  EXPECT_EQ(taken->fault, CpuFault::kBus);
  EXPECT_EQ(taken->program_counter, 0x0800'1234U);
  EXPECT_EQ(taken->status, 5U);
  EXPECT_EQ(stored.take(), std::nullopt);
}

TEST(StoredFault, KindsAreThoseOfTheExceptionAndItsStatus) {
  const FaultState base{.exception = 4, .guard = 0x2000'0000, .stacked_pc = 0x0800'0100};
  FaultState state = base;
  state.cfsr = 0x82;  // DACCVIOL, MMARVALID
  state.mmfar = 0x2000'001C;
  EXPECT_EQ(describe(state).fault, CpuFault::kStack);
  EXPECT_EQ(describe(state).address, 0x2000'001CU);
  state.mmfar = 0x2000'0020;
  EXPECT_EQ(describe(state).fault, CpuFault::kMemory);
  state.cfsr = 0x10;  // the frame itself did not fit
  EXPECT_EQ(describe(state).fault, CpuFault::kStack);
  state = base;
  state.exception = 5;
  state.cfsr = 0x8200;  // PRECISERR, BFARVALID
  state.bfar = 0x6000'0000;
  EXPECT_EQ(describe(state).fault, CpuFault::kBus);
  EXPECT_EQ(describe(state).address, 0x6000'0000U);
  state.stack_left = true;
  EXPECT_EQ(describe(state).fault, CpuFault::kStack);
  state = base;
  state.exception = 6;
  EXPECT_EQ(describe(state).fault, CpuFault::kUsage);
  state.exception = 3;
  EXPECT_EQ(describe(state).fault, CpuFault::kHard);
  state.exception = 2;
  EXPECT_EQ(describe(state).fault, CpuFault::kUnexpected);
  EXPECT_EQ(describe(state).status, 2U);
}

}  // namespace
}  // namespace tetap::hal
