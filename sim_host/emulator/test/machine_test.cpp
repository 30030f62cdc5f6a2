// SPDX-License-Identifier: Apache-2.0
// The core as a program sees it: exceptions, masks, sleep, floating point, faults, reset, time. Expectations are those
// of the ARMv7-M manual; the floating-point sums are computed here once more.
#include "hal/chip/arm/cortex_m4.hpp"
#include "hal/chip/stm32/registers_stm32f412.hpp"
#include "sim_host/emulator/test/emulated.hpp"
#include "sim_host/emulator/test/programs/choices.hpp"

#include <bit>

namespace tetap::board {
namespace {

namespace m4 = hal::cortex_m4;
namespace reg = hal::stm32f412;

TEST(Machine, FloatingPointInHandlersLeavesThreadModeItsRegisters) {
  Emulated run("core", kFloatInHandler);
  run.run_ms(40);
  float a = 1.0F, b = 0.5F;
  for (int i = 0; i < 20'000; ++i) {
    a = a * 1.0001F + b;
    b = b * 0.9999F - a * 0.25F;
  }
  EXPECT_EQ(run.result(0), std::bit_cast<std::uint32_t>(a));
  EXPECT_EQ(run.result(1), std::bit_cast<std::uint32_t>(b));
  const std::uint32_t ticks = run.result(3);
  EXPECT_GT(ticks, 100U);
  float sum = 1.0F;
  for (std::uint32_t i = 0; i < ticks; ++i) sum = sum * 1.5F + 0.25F > 100.0F ? 1.0F : sum * 1.5F + 0.25F;
  EXPECT_EQ(run.result(2), std::bit_cast<std::uint32_t>(sum));
  EXPECT_TRUE(run.complaints().empty()) << run.complaints().text();
}

TEST(Machine, MasksHoldInterruptsBack) {
  Emulated run("core", kMasks);
  run.run_ms(1);
  const std::uint32_t expected[] = {100, 5, 101, 102, 5, 103};
  ASSERT_EQ(run.result(0), 6U);
  for (std::uint32_t i = 0; i < 6; ++i) EXPECT_EQ(run.result(1 + i), expected[i]) << i;
}

TEST(Machine, UrgentInterruptsPreEmptAndEqualOnesFollow) {
  Emulated run("core", kPriorities);
  run.run_ms(1);
  const std::uint32_t expected[] = {12, 10, 1000, 11, 200};
  ASSERT_EQ(run.result(0), 5U);
  for (std::uint32_t i = 0; i < 5; ++i) EXPECT_EQ(run.result(1 + i), expected[i]) << i;
}

TEST(Machine, SleepJumpsToTheNextTick) {
  Emulated run("core", kSleep);
  run.machine.run(9'500 * kMicrosecond);
  EXPECT_EQ(run.result(0), 9U);
  run.run_ms(2);
  EXPECT_EQ(run.result(0), 11U);
  EXPECT_EQ(run.result(11), 300U);
  EXPECT_LT(run.machine.instructions(), 2'000U) << "sleep executes nothing";
}

struct Fault {
  Choice choice;
  std::uint32_t cfsr;
  bool forced;
  const char* complaint;
};

TEST(Machine, FaultsComeAsOnSilicon) {
  const Fault faults[] = {
      {kUndefined, m4::scb::kUndefinstr.mask(), true, "undefined instruction"},
      {kUnmapped, m4::scb::kPreciserr.mask() | m4::scb::kBfarvalid.mask(), true, "access to 0x60000004"},
      {kFloatingPointOff, m4::scb::kNocp.mask(), true, "CPACR off"},
      {kUnalignedDouble, m4::scb::kUnaligned.mask(), true, "unaligned access of several words"},
      {kUnalignedFloat, m4::scb::kUnaligned.mask(), true, "unaligned access of several words"},
      {kArmState, m4::scb::kInvstate.mask(), true, "undefined instruction"},
  };
  for (const Fault& fault : faults) {
    Emulated run("core", fault.choice, {}, {.check_alignment = true});
    run.run_ms(1);
    EXPECT_EQ(run.result(30), 3U) << fault.choice;
    EXPECT_EQ(run.result(31), fault.cfsr) << fault.choice;
    EXPECT_EQ(run.result(32), m4::scb::kForced.mask()) << fault.choice;
    EXPECT_TRUE(run.complaints().has("core", fault.complaint)) << fault.choice << "\n" << run.complaints().text();
    EXPECT_EQ(run.result(60), 0U) << fault.choice;
    const std::uint32_t pc = run.result(36);
    if (fault.choice != kArmState) {
      EXPECT_GE(pc, 0x0800'01C0U) << fault.choice;
    }
    if (fault.choice == kUnmapped) {
      EXPECT_EQ(run.result(33), 0x6000'0004U);
    }
  }
}

TEST(Machine, UnalignedWordsAreAllowed) {
  Emulated run("core", kUnalignedWord, {}, {.check_alignment = true});
  run.run_ms(1);
  EXPECT_EQ(run.result(60), 0x600DU);
  EXPECT_TRUE(run.complaints().empty()) << run.complaints().text();
}

// The handler of the program pushes to the same stack, so its own fault goes on to HardFault, where the MPU is off.
TEST(Machine, StackThatReachesTheGuardIsAFault) {
  Emulated run("core", kStackGuard);
  run.run_ms(5);
  EXPECT_TRUE(run.result(30) == 4 || run.result(30) == 3) << run.result(30);
  EXPECT_FALSE(run.machine.locked_up()) << run.complaints().text();
  EXPECT_NE(run.result(31) & m4::scb::kDaccviol.mask(), 0U);
  EXPECT_GE(run.result(34), 0x2001'F000U);
  EXPECT_LE(run.result(34), 0x2001'F0FFU);
  EXPECT_EQ(run.result(10), 0xCDCD'CDCDU) << "the word beside the guard can be read";
}

TEST(Machine, SoftwareResetKeepsMemoryAndNamesItsCause) {
  Emulated run("core", kReset);
  run.run_ms(1);
  EXPECT_EQ(run.result(0), 3U);
  EXPECT_EQ(run.machine.resets(), 2);
  EXPECT_NE(run.result(1) & reg::rcc::csr::kPorrstf.mask(), 0U);
  EXPECT_EQ(run.result(2) & 0xFE00'0000, reg::rcc::csr::kSftrstf.mask() | reg::rcc::csr::kPadrstf.mask());
}

TEST(Machine, InterruptThatIsNeverClearedIsNoticed) {
  Emulated run("core", kInterruptNotCleared);
  run.run_ms(50);
  EXPECT_TRUE(run.complaints().has("core", "never cleared")) << run.complaints().text();
  EXPECT_EQ(run.result(60), 0U);
}

TEST(Machine, CyclesAreInstructionsTimesCpi) {
  for (const int percent : {100, 150, 200}) {
    Emulated run("core", kCycles, {}, {.cpi_percent = percent});
    run.run_ms(2);
    const auto expected = static_cast<std::uint32_t>(2000 * percent / 100);
    EXPECT_GE(run.result(0), expected);
    EXPECT_LE(run.result(0), expected + 20);
  }
}

TEST(Machine, FaultInsideHardFaultLocksUp) {
  Emulated run("core", kLockup);
  run.run_ms(1);
  EXPECT_TRUE(run.machine.locked_up());
  EXPECT_TRUE(run.complaints().has("core", "lock-up"));
}

TEST(Machine, SupervisorCallReturnsBehindItself) {
  Emulated run("core", kSupervisor);
  run.run_ms(1);
  EXPECT_EQ(run.result(1), 11U);
  EXPECT_EQ(run.result(2), 400U);
  EXPECT_TRUE(run.complaints().empty()) << run.complaints().text();
}

TEST(Machine, StalledCoreExecutesNothingWhileTimeGoesOn) {
  Emulated run("core", kSleep);
  run.run_ms(3);
  const std::uint64_t before = run.machine.instructions();
  const std::uint32_t ticks = run.result(0);
  run.machine.stall(run.board.chip.scheduler.now() + 20 * kMillisecond);
  run.run_ms(15);
  EXPECT_EQ(run.machine.instructions(), before);
  EXPECT_EQ(run.board.chip.scheduler.now(), 18 * kMillisecond);
  run.run_ms(10);
  EXPECT_GT(run.machine.instructions(), before);
  // SysTick goes on, and one pending tick is all that is left of those of the stall.
  EXPECT_GE(run.result(0), ticks + 5);
  EXPECT_LE(run.result(0), ticks + 7);
}

TEST(Hello, RunsFromTheCrystalAtNinetySixMegahertz) {
  Emulated run("hello", 0);
  run.run_ms(20);
  EXPECT_EQ(run.board.console, "hello from 96 MHz\n");
  EXPECT_EQ(run.board.chip.rcc.hclk_hz(), 96'000'000);
  EXPECT_EQ(run.board.chip.rcc.apb1_hz(), 48'000'000);
  EXPECT_EQ(run.result(0), 1U);
  EXPECT_TRUE(run.complaints().empty()) << run.complaints().text();
}

TEST(Hello, RunsFromTheHsiWhereTheCrystalIsDead) {
  Emulated run("hello", 0, {.oscillators = {.crystal = false}});
  run.run_ms(100);
  EXPECT_EQ(run.board.console, "hello from 96 MHz\n");
  EXPECT_EQ(run.result(0), 0U);
  EXPECT_TRUE(run.complaints().empty()) << run.complaints().text();
}

TEST(Hello, TwoRunsAreEqualToTheInstruction) {
  Emulated one("hello", 0), two("hello", 0);
  one.run_ms(20);
  two.run_ms(3);
  two.run_ms(17);
  EXPECT_EQ(one.machine.instructions(), two.machine.instructions());
  EXPECT_EQ(one.machine.cycles(), two.machine.cycles());
  EXPECT_EQ(one.board.console, two.board.console);
}

TEST(Hello, EveryMistakeIsNoticed) {
  const struct {
    std::uint32_t choice;
    const char *model, *complaint;
  } mistakes[] = {{1, "USART2", "PA2 is alternate function 8"},
                  {2, "USART2", "without clock"},
                  {3, "RCC", "too few flash wait states"},
                  {4, "RCC", "before its source HSE is ready"},
                  {5, "USART2", "PA2 is an input"},
                  {6, "USART2", "DR written before TXE"},
                  {7, "RCC", "APB1 at 96000 kHz"},
                  {8, "RCC", "too fast for PWR_CR.VOS"},
                  {9, "RCC", "selects a clock that is not ready"},
                  {10, "EXTI", "do not take this width"}};
  for (const auto& mistake : mistakes) {
    Emulated run("hello", mistake.choice);
    run.run_ms(100);
    EXPECT_TRUE(run.complaints().has(mistake.model, mistake.complaint)) << mistake.choice << "\n"
                                                                        << run.complaints().text();
  }
}

}  // namespace
}  // namespace tetap::board
