// SPDX-License-Identifier: Apache-2.0
// A program that erases and programs the flash it runs from: where the core stalls, what it reads, what a lost supply
// leaves.
#include "sim_host/emulator/test/emulated.hpp"
#include "sim_host/emulator/test/programs/choices.hpp"

#include <cstring>

namespace tetap::board {
namespace {

constexpr std::uint32_t kSector5 = 0x0802'0000, kBusy = 0x1'0000;
constexpr std::int64_t kErase_ms = 4'000;  // 128 kB at four times the typical second

class FlashProgram : public Emulated {
 public:
  explicit FlashProgram(std::uint32_t choice) : Emulated("flash", choice) {
    for (std::uint32_t at = 0; at < 128 * 1024; at += 4) put(kSector5 + at, 0x5A5A'5A5A);
  }
  void put(std::uint32_t address, std::uint32_t value) {
    std::memcpy(board.chip.memory.flash().data() + (address - Memory::kFlash), &value, 4);
  }
  [[nodiscard]] std::uint32_t word(std::uint32_t address) {
    std::uint32_t value = 0;
    EXPECT_TRUE(board.chip.memory.read_word(address, value));
    return value;
  }
};

TEST(FlashMachine, CodeInTheFlashStallsUntilTheEraseIsDone) {
  FlashProgram run(kEraseFromFlash);
  run.run_ms(kErase_ms - 1);
  EXPECT_EQ(run.result(2), 0U);
  const std::uint64_t before = run.machine.instructions();
  EXPECT_LT(before, 1'000U);
  run.run_ms(2);
  EXPECT_EQ(run.result(2), 1U) << "BSY = 0";
  EXPECT_EQ(run.word(kSector5), 0xFFFF'FFFFU);
  EXPECT_TRUE(run.complaints().empty()) << run.complaints().text();
}

TEST(FlashMachine, CodeInTheSramRunsOnWhileItKeepsAway) {
  FlashProgram run(kPollFromRam);
  run.run_ms(kErase_ms - 1);
  EXPECT_EQ(run.result(2), 0U);
  EXPECT_GT(run.result(1), 1'000'000U);
  run.run_ms(2);
  EXPECT_EQ(run.result(2), 1U);
  EXPECT_TRUE(run.complaints().empty()) << run.complaints().text();
}

TEST(FlashMachine, ReadingOrReturningToTheBusyFlashStalls) {
  for (const std::uint32_t choice : {kReadFromRam, kReturnToFlash}) {
    FlashProgram run(choice);
    run.run_ms(kErase_ms - 1);
    EXPECT_EQ(run.result(2), 0U) << choice;
    EXPECT_LT(run.machine.instructions(), 1'000U) << choice;
    run.run_ms(2);
    EXPECT_EQ(run.result(2), 1U) << choice;
    if (choice == kReadFromRam) {
      EXPECT_EQ(run.result(1) & kBusy, 0U);
      EXPECT_EQ(run.result(3), 0xFFFF'FFFFU);
    }
    EXPECT_EQ(run.result(60), 0U) << choice;
    EXPECT_TRUE(run.complaints().empty()) << run.complaints().text();
  }
}

TEST(FlashMachine, StoresProgramAndOnlyThoseThatMayDo) {
  FlashProgram run(kProgramWords);
  for (std::uint32_t at = 0; at < 32; at += 4) run.put(kSector5 + at, 0xFFFF'FFFF);
  run.run_ms(5);
  EXPECT_EQ(run.word(kSector5 + 4), 0x2222'2222U);
  EXPECT_EQ(run.word(kSector5 + 8), 0x3333'3333U);
  EXPECT_EQ(run.word(kSector5 + 12), 0x4444'4444U);
  EXPECT_EQ(run.result(3), 0x0101'0101U) << "ones become zeros";
  EXPECT_EQ(run.result(4), 0x0101'0101U) << "PG = 0";
  EXPECT_EQ(run.result(5), 0x80U) << "PGSERR";
  EXPECT_EQ(run.word(kSector5), 0x0101'0101U);
  EXPECT_TRUE(run.complaints().has("FLASH", "PG = 0"));
}

TEST(FlashMachine, AStoreIntoTheLockedFlashIsAComplaintAndNoChange) {
  FlashProgram run(kLockedStore);
  run.run_ms(1);
  EXPECT_EQ(run.result(1), 0x80U);
  EXPECT_EQ(run.result(60), 0U);
  EXPECT_EQ(run.word(kSector5), 0x5A5A'5A5AU);
  EXPECT_TRUE(run.complaints().has("FLASH", "PG = 0"));
}

TEST(FlashMachine, ALostSupplyEndsTheEraseAndTheProgramStartsAnew) {
  FlashProgram run(kEraseFromFlash);
  Alarm cut(run.board.chip.scheduler, [&] { run.board.chip.lose_power(); });
  cut.set(1'000 * kMillisecond);
  run.run_ms(1'001);
  EXPECT_EQ(run.machine.resets(), 1);
  EXPECT_EQ(run.result(0), 0xCDCD'CDCDU) << "the SRAM is lost, the core does not run yet";
  EXPECT_EQ(run.board.chip.word(0x4002'3C10) >> 31, 1U);
  int whole = 0, blank = 0;
  for (std::uint32_t at = 0; at < 128 * 1024; at += 4) {
    whole += run.word(kSector5 + at) == 0x5A5A'5A5A ? 1 : 0;
    blank += run.word(kSector5 + at) == 0xFFFF'FFFF ? 1 : 0;
  }
  EXPECT_GT(whole, 5'000);
  EXPECT_GT(blank, 5'000);
  EXPECT_LT(whole + blank, 25'000);
  run.run_ms(100);
  EXPECT_EQ(run.result(0), 1U) << "the program runs again";
}

}  // namespace
}  // namespace tetap::board
