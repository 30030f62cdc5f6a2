// SPDX-License-Identifier: Apache-2.0
// Clock tree, pins after reset, external interrupts, watchdog, reset flags. Numbers: RM0402 and data sheet DS11139.
#include "sim_host/emulator/test/driven_chip.hpp"

namespace tetap::board {
namespace {

TEST(Clock, StartsFromTheHsiAndReachesNinetySix) {
  DrivenChip board;
  EXPECT_EQ(board.chip.rcc.hclk_hz(), 16'000'000);
  board.start_clocks();
  EXPECT_EQ(board.chip.rcc.hclk_hz(), 96'000'000);
  EXPECT_EQ(board.chip.rcc.apb2_hz(), 96'000'000);
  EXPECT_EQ(board.chip.rcc.apb1_timer_hz(), 96'000'000);
  EXPECT_NO_COMPLAINTS(board);
}

TEST(Clock, DeadCrystalNeverBecomesReady) {
  DrivenChip board({.oscillators = {.crystal = false}});
  board.set(reg::rcc::kRcc, reg::rcc::cr::kOffset, reg::rcc::cr::kHseon.mask());
  board.chip.advance_us(1'000'000);
  EXPECT_EQ(board.get(reg::rcc::kRcc, reg::rcc::cr::kOffset) & reg::rcc::cr::kHserdy.mask(), 0U);
  EXPECT_NO_COMPLAINTS(board);
}

TEST(Clock, CountedCyclesSurviveAChangeOfFrequency) {
  DrivenChip board;
  const std::int64_t before = board.chip.clock.cycle_at(board.chip.scheduler.now());
  EXPECT_EQ(before, 0);
  board.start_clocks();  // 3 300 us of 16 MHz
  EXPECT_EQ(board.chip.clock.cycle_at(board.chip.scheduler.now()), 3'300 * 16);
  board.chip.advance_us(1'000);
  EXPECT_EQ(board.chip.clock.cycle_at(board.chip.scheduler.now()), 3'300 * 16 + 96'000);
}

TEST(Clock, PllOutOfRangeIsNoticed) {
  DrivenChip board;
  board.put(reg::rcc::kRcc, reg::rcc::pllcfgr::kOffset, reg::rcc::pllcfgr::kPllm(4) | reg::rcc::pllcfgr::kPlln(192));
  board.set(reg::rcc::kRcc, reg::rcc::cr::kOffset, reg::rcc::cr::kPllon.mask());
  EXPECT_TRUE(board.complained("RCC", "PLL input of 4000 kHz"));
  EXPECT_TRUE(board.complained("RCC", "PLL oscillator at 768000 kHz"));
  board.put(reg::rcc::kRcc, reg::rcc::pllcfgr::kOffset, 0);
  EXPECT_TRUE(board.complained("RCC", "while the PLL is on"));
}

TEST(Clock, RegisterOfAnUnclockedBlockReadsZero) {
  DrivenChip board;
  board.put(reg::usart::kUsart1, reg::usart::brr::kOffset, 833);
  EXPECT_EQ(board.get(reg::usart::kUsart1, reg::usart::brr::kOffset), 0U);
  EXPECT_TRUE(board.complained("USART1", "without clock"));
  std::uint32_t value = 1;
  EXPECT_FALSE(board.chip.read(0x4000'7800, 4, value)) << "no block is there";
  EXPECT_TRUE(board.complained("bus", "no modelled block"));
}

TEST(Clock, ResetPulseOfTheRccResetsTheBlock) {
  DrivenChip board;
  board.start_clocks();
  board.put(reg::usart::kUsart1, reg::usart::brr::kOffset, 833);
  board.set(reg::rcc::kRcc, reg::rcc::apb2rstr::kOffset, reg::rcc::apb2rstr::kUsart1rst.mask());
  board.clear(reg::rcc::kRcc, reg::rcc::apb2rstr::kOffset, reg::rcc::apb2rstr::kUsart1rst.mask());
  EXPECT_EQ(board.get(reg::usart::kUsart1, reg::usart::brr::kOffset), 0U);
  EXPECT_NO_COMPLAINTS(board);
}

TEST(Pins, DebugPinsBelongToTheDebugPortAfterReset) {
  DrivenChip board;
  for (const Pin pin : {Pin{'A', 13}, Pin{'A', 14}, Pin{'A', 15}, Pin{'B', 3}, Pin{'B', 4}}) {
    EXPECT_EQ(board.chip.pins.port(pin.port).mode(pin.number), GpioPort::Mode::kAlternate) << pin.name();
    EXPECT_EQ(board.chip.pins.port(pin.port).alternate(pin.number), 0) << pin.name();
  }
  EXPECT_FALSE(board.chip.pins.carries({'B', 3}, Signal::kUsart1Rx));
  board.start_clocks();
  board.alternate({'B', 3}, 7);
  EXPECT_TRUE(board.chip.pins.carries({'B', 3}, Signal::kUsart1Rx));
  EXPECT_FALSE(board.chip.pins.carries({'B', 3}, Signal::kTim2Ch2)) << "AF1 is another function";
}

TEST(Pins, SetAndResetRegisterIsAtomicAndSetWins) {
  DrivenChip board;
  board.start_clocks();
  board.mode({'A', 8}, 1);
  board.put(reg::gpio::kGpioa, reg::gpio::bsrr::kOffset, 1U << 8 | 1U << 24);
  EXPECT_TRUE(board.chip.pins.level({'A', 8}));
  board.put(reg::gpio::kGpioa, reg::gpio::bsrr::kOffset, 1U << 24);
  EXPECT_FALSE(board.chip.pins.level({'A', 8}));
}

TEST(Pins, TwoDriversOnOnePinAreNoticed) {
  DrivenChip board;
  board.start_clocks();
  board.chip.pins.drive({'B', 2}, true);
  board.mode({'B', 2}, 1);
  EXPECT_TRUE(board.complained("GPIOB", "PB2 is an output"));
}

TEST(ExternalInterrupt, RisingEdgeOfTheSelectedPortPends) {
  DrivenChip board;
  board.start_clocks();
  board.mode({'B', 2}, 0);
  board.set(reg::exti::kExti, reg::exti::imr::kOffset, 4);
  board.set(reg::exti::kExti, reg::exti::rtsr::kOffset, 4);
  board.chip.pins.drive({'B', 2}, true);
  EXPECT_FALSE(board.pending(reg::interrupt::kExti2)) << "SYSCFG still selects port A";
  board.chip.pins.drive({'B', 2}, false);
  board.put(reg::syscfg::kSyscfg, reg::syscfg::exticrx::kOffset, 1U << 8);
  EXPECT_FALSE(board.pending(reg::interrupt::kExti2)) << "falling edges were not asked for";
  board.chip.pins.drive({'B', 2}, true);
  EXPECT_TRUE(board.pending(reg::interrupt::kExti2));
  board.put(reg::exti::kExti, reg::exti::pr::kOffset, 4);
  EXPECT_EQ(board.get(reg::exti::kExti, reg::exti::pr::kOffset), 0U);
  EXPECT_NO_COMPLAINTS(board);
}

struct Lsi {
  std::int64_t hz, expected_us;
};

// 200 ms nominal: PR = 2 (16), RLR = 399: 400 * 16 / 32 kHz. RM0402: (RL + 1) * 4 * 2^PR / f.
TEST(Watchdog, ExpiresAtTheTimeThatItsOscillatorSets) {
  for (const Lsi& lsi : {Lsi{17'000, 376'470}, Lsi{32'000, 200'000}, Lsi{47'000, 136'170}}) {
    DrivenChip board({.oscillators = {.lsi_hz = lsi.hz}});
    board.put(reg::iwdg::kIwdg, reg::iwdg::kr::kOffset, 0x5555);
    board.put(reg::iwdg::kIwdg, reg::iwdg::pr::kOffset, 2);
    board.put(reg::iwdg::kIwdg, reg::iwdg::rlr::kOffset, 399);
    EXPECT_EQ(board.get(reg::iwdg::kIwdg, reg::iwdg::sr::kOffset), 3U) << "updates take time";
    board.chip.advance_us(1'000);
    EXPECT_EQ(board.get(reg::iwdg::kIwdg, reg::iwdg::sr::kOffset), 0U);
    board.put(reg::iwdg::kIwdg, reg::iwdg::kr::kOffset, 0xCCCC);
    board.chip.advance_us(100'000);
    board.put(reg::iwdg::kIwdg, reg::iwdg::kr::kOffset, 0xAAAA);
    board.chip.advance_us(lsi.expected_us - 5);
    EXPECT_FALSE(board.chip.pending_reset.has_value()) << lsi.hz;
    board.chip.advance_us(10);
    ASSERT_TRUE(board.chip.pending_reset.has_value()) << lsi.hz;
    board.chip.system_reset(*board.chip.pending_reset);
    EXPECT_NE(board.get(reg::rcc::kRcc, reg::rcc::csr::kOffset) & reg::rcc::csr::kWdgrstf.mask(), 0U);
    EXPECT_NO_COMPLAINTS(board);
  }
}

TEST(Watchdog, RegistersNeedTheKey) {
  DrivenChip board;
  board.put(reg::iwdg::kIwdg, reg::iwdg::rlr::kOffset, 100);
  EXPECT_TRUE(board.complained("IWDG", "without the key"));
  EXPECT_EQ(board.get(reg::iwdg::kIwdg, reg::iwdg::rlr::kOffset), 0xFFFU);
}

TEST(ResetFlags, StayUntilTheyAreRemoved) {
  DrivenChip board;
  EXPECT_NE(board.get(reg::rcc::kRcc, reg::rcc::csr::kOffset) & reg::rcc::csr::kPorrstf.mask(), 0U);
  board.chip.system_reset(ResetCause::kWatchdog);
  const std::uint32_t both = reg::rcc::csr::kPorrstf.mask() | reg::rcc::csr::kWdgrstf.mask();
  EXPECT_EQ(board.get(reg::rcc::kRcc, reg::rcc::csr::kOffset) & both, both);
  board.set(reg::rcc::kRcc, reg::rcc::csr::kOffset, reg::rcc::csr::kRmvf.mask());
  EXPECT_EQ(board.get(reg::rcc::kRcc, reg::rcc::csr::kOffset) & 0xFE00'0000, 0U);
}

}  // namespace
}  // namespace tetap::board
