// SPDX-License-Identifier: Apache-2.0
// Flash of the STM32F412 by its registers: each rule of RM0402, "Embedded flash memory interface", and the durations of
// DS11139.
#include "sim_host/emulator/test/driven_chip.hpp"

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

namespace tetap::board {
namespace {

// The manual's table of sectors and its registers once more, by hand.
constexpr std::uint32_t kKeyr = 0x4002'3C04, kOptkeyr = 0x4002'3C08, kSr = 0x4002'3C0C, kCr = 0x4002'3C10,
                        kOptcr = 0x4002'3C14;
constexpr std::uint32_t kEop = 1, kOperr = 2, kWrperr = 0x10, kPgaerr = 0x20, kPgperr = 0x40, kPgserr = 0x80,
                        kBusy = 0x1'0000;
constexpr std::uint32_t kPg = 1, kSer = 2, kMer = 4, kWordSize = 0x200, kStart = 0x1'0000, kEopie = 0x0100'0000,
                        kErrie = 0x0200'0000, kLock = 0x8000'0000;
constexpr std::uint32_t kSectors[] = {0x0800'0000, 0x0800'4000, 0x0800'8000, 0x0800'C000, 0x0801'0000,
                                      0x0802'0000, 0x0804'0000, 0x0806'0000, 0x0808'0000, 0x080A'0000,
                                      0x080C'0000, 0x080E'0000, 0x0810'0000};

class FlashF4Test : public testing::Test {
 protected:
  DrivenChip board;

  [[nodiscard]] std::uint32_t sr() { return board.chip.word(kSr); }
  [[nodiscard]] std::uint32_t cr() { return board.chip.word(kCr); }
  void put(std::uint32_t address, std::uint32_t value) { board.chip.set_word(address, value); }
  void unlock() {
    put(kKeyr, 0x4567'0123);
    put(kKeyr, 0xCDEF'89AB);
  }
  void store(std::uint32_t address, std::uint32_t value, unsigned size = 4) {
    board.chip.flash.store(address, size, value);
  }
  void wait() {
    for (int ms = 0; ms < 40'000 && (sr() & kBusy) != 0; ++ms) board.chip.advance_us(1'000);
    EXPECT_EQ(sr() & kBusy, 0U);
  }
  void program(std::uint32_t address, std::uint32_t value) {
    put(kCr, kPg | kWordSize);
    store(address, value);
    wait();
  }
  void erase(std::uint32_t sector, std::uint32_t more = kWordSize) { put(kCr, kSer | sector << 3 | more | kStart); }
  [[nodiscard]] std::uint32_t word(std::uint32_t address) {
    std::uint32_t value = 0;
    EXPECT_TRUE(board.chip.memory.read_word(address, value));
    return value;
  }
  /// Microseconds that an operation takes which is asked for now.
  [[nodiscard]] std::int64_t duration_us() {
    return (board.chip.flash.busy_until(0x0800'0000) - board.chip.scheduler.now()) / kMicrosecond;
  }
};

TEST_F(FlashF4Test, TwoKeysUnlockAndLockCloses) {
  EXPECT_EQ(cr(), kLock);
  put(kCr, kSer);
  EXPECT_EQ(cr(), kLock);
  EXPECT_TRUE(board.complained("FLASH", "LOCK = 1"));
  unlock();
  EXPECT_EQ(cr(), 0U);
  put(kCr, kPg | kWordSize);
  EXPECT_EQ(cr(), kPg | kWordSize);
  put(kCr, kLock);
  EXPECT_EQ(cr(), kLock);
  unlock();
  EXPECT_EQ(cr(), 0U);
}

TEST_F(FlashF4Test, AWrongKeyIsABusErrorAndLocksUntilTheNextReset) {
  for (const std::vector<std::uint32_t>& keys :
       {std::vector<std::uint32_t>{0x4567'0124}, {0xCDEF'89AB}, {0x4567'0123, 0x4567'0123}, {0x4567'0123, 0}}) {
    bool taken = true;
    for (const std::uint32_t key : keys) taken = board.chip.write(kKeyr, 4, key);
    EXPECT_FALSE(taken);
    EXPECT_FALSE(board.chip.write(kKeyr, 4, 0x4567'0123));
    EXPECT_FALSE(board.chip.write(kKeyr, 4, 0xCDEF'89AB));
    EXPECT_EQ(cr(), kLock);
    board.chip.system_reset(ResetCause::kSoftware);
    unlock();
    EXPECT_EQ(cr(), 0U);
    board.chip.system_reset(ResetCause::kSoftware);
  }
}

TEST_F(FlashF4Test, ProgrammingTurnsOnesIntoZerosOnly) {
  unlock();
  program(kSectors[5], 0xFFFF'00F0);
  EXPECT_EQ(word(kSectors[5]), 0xFFFF'00F0U);
  program(kSectors[5], 0x1234'FFFF);
  EXPECT_EQ(word(kSectors[5]), 0x1234'00F0U);
  EXPECT_NO_COMPLAINTS(board);
}

TEST_F(FlashF4Test, BusyLastsAsLongAsTheDataSheetSays) {
  using Pace = FlashController::Pace;
  struct Case {
    std::uint32_t psize, sector;
    std::int64_t typical_ms;
  };
  unlock();
  for (const Case& one : {Case{0, 0, 400}, Case{1, 3, 300}, Case{2, 1, 250}, Case{0, 4, 1'200}, Case{1, 4, 700},
                          Case{2, 4, 550}, Case{0, 11, 2'000}, Case{1, 5, 1'300}, Case{2, 9, 1'000}}) {
    for (const auto& [pace, times] : {std::pair{Pace::kTypical, 1}, {Pace::kMaximum, 2}, {Pace::kFourfold, 4}}) {
      board.chip.flash.pace = pace;
      erase(one.sector, one.psize << 8);
      EXPECT_EQ(duration_us(), 1'000 * one.typical_ms * times) << one.psize << " " << one.sector;
      board.chip.advance_us(duration_us() - 1);
      EXPECT_EQ(sr() & kBusy, kBusy);
      board.chip.advance_us(1);
      EXPECT_EQ(sr() & kBusy, 0U);
    }
  }
  for (const auto& [pace, us] : {std::pair{Pace::kTypical, 16}, {Pace::kMaximum, 100}, {Pace::kFourfold, 100}}) {
    board.chip.flash.pace = pace;
    put(kCr, kPg | kWordSize);
    store(kSectors[5], 0);
    EXPECT_EQ(duration_us(), us);
    wait();
  }
}

TEST_F(FlashF4Test, ASectorsEraseReachesItsFirstAndLastByteAndNoOther) {
  unlock();
  for (std::uint32_t sector = 0; sector < 12; ++sector) {
    for (const std::uint32_t at : {kSectors[sector], kSectors[sector + 1] - 4}) program(at, 0x5555'5555);
    if (sector > 0) program(kSectors[sector] - 4, 0x3333'3333);
    if (sector < 11) program(kSectors[sector + 1], 0x3333'3333);
    erase(sector);
    EXPECT_EQ(cr() & kStart, kStart);
    wait();
    EXPECT_EQ(cr() & kStart, 0U);
    EXPECT_EQ(word(kSectors[sector]), 0xFFFF'FFFFU);
    EXPECT_EQ(word(kSectors[sector + 1] - 4), 0xFFFF'FFFFU);
    if (sector > 0) {
      EXPECT_EQ(word(kSectors[sector] - 4), 0x3333'3333U);
    }
    if (sector < 11) {
      EXPECT_EQ(word(kSectors[sector + 1]), 0x3333'3333U);
    }
    put(kCr, kMer | kWordSize | kStart);
    wait();
    EXPECT_EQ(word(kSectors[0]), 0xFFFF'FFFFU);
    EXPECT_EQ(word(kSectors[12] - 4), 0xFFFF'FFFFU);
  }
  EXPECT_NO_COMPLAINTS(board);
}

TEST_F(FlashF4Test, SectorAndMassEraseTogetherOrASectorThatIsNotThereEraseNothing) {
  unlock();
  program(kSectors[5], 0);
  put(kCr, kSer | kMer | 5U << 3 | kWordSize | kStart);
  EXPECT_EQ(sr() & kBusy, 0U);
  put(kCr, kWordSize | kStart);
  EXPECT_EQ(sr() & kBusy, 0U);
  EXPECT_TRUE(board.complained("FLASH", "both set, or none"));
  erase(12);
  EXPECT_EQ(sr() & kBusy, 0U);
  EXPECT_TRUE(board.complained("FLASH", "no such sector"));
  erase(5, 0x300);
  EXPECT_EQ(sr() & kBusy, 0U);
  EXPECT_TRUE(board.complained("FLASH", "Vpp"));
  EXPECT_EQ(word(kSectors[5]), 0U);
}

TEST_F(FlashF4Test, ErrorsAbortAndAreClearedByWritingOne) {
  struct Case {
    std::uint32_t control, address, size, flag;
  };
  unlock();
  for (const Case& one : {Case{0, kSectors[5], 4, kPgserr}, Case{kPg, kSectors[5], 4, kPgperr},
                          Case{kPg | kWordSize, kSectors[5], 1, kPgperr}, Case{kPg | 0x100, kSectors[5], 4, kPgperr},
                          Case{kPg | kWordSize, kSectors[5] + 14, 4, kPgaerr}}) {
    put(kCr, one.control);
    store(one.address, 0, one.size);
    EXPECT_EQ(sr(), one.flag) << "OPERR needs ERRIE";
    EXPECT_EQ(word(kSectors[5]), 0xFFFF'FFFFU);
    put(kCr, one.control | kErrie);
    store(one.address, 0, one.size);
    EXPECT_EQ(sr(), one.flag | kOperr);
    EXPECT_TRUE(board.pending(4));
    put(kSr, one.flag);
    EXPECT_EQ(sr(), kOperr);
    put(kSr, kOperr);
    EXPECT_EQ(sr(), 0U);
    board.chip.nvic.unpend(exception::kInterrupt0 + 4);
  }
  EXPECT_TRUE(board.complained("FLASH", "PG = 0"));
}

TEST_F(FlashF4Test, BytesAndHalfWordsGoWithTheirParallelism) {
  unlock();
  put(kCr, kPg);
  store(kSectors[6] + 1, 0xAB, 1);
  wait();
  put(kCr, kPg | 0x100);
  store(kSectors[6] + 2, 0x1234, 2);
  wait();
  EXPECT_EQ(word(kSectors[6]), 0x1234'ABFFU);
  EXPECT_NO_COMPLAINTS(board);
}

TEST_F(FlashF4Test, EndOfOperationIsSetWithItsInterruptOnly) {
  unlock();
  program(kSectors[5], 0);
  EXPECT_EQ(sr(), 0U);
  put(kCr, kPg | kWordSize | kEopie);
  store(kSectors[5] + 4, 0);
  wait();
  EXPECT_EQ(sr(), kEop);
  EXPECT_TRUE(board.pending(4));
  put(kSr, kEop);
  EXPECT_EQ(sr(), 0U);
}

TEST_F(FlashF4Test, WhatComesWhileBusyStallsTheBusUntilItIsDone) {
  unlock();
  erase(0);
  const Picoseconds begin = board.chip.scheduler.now();
  put(kCr, kPg | kWordSize);
  EXPECT_EQ(board.chip.scheduler.now() - begin, 1'000 * kMillisecond) << "a write of FLASH_CR";
  store(kSectors[0], 0x11);
  const Picoseconds second = board.chip.scheduler.now();
  store(kSectors[0] + 4, 0x22);
  EXPECT_EQ(board.chip.scheduler.now() - second, 100 * kMicrosecond) << "a store";
  const Picoseconds third = board.chip.scheduler.now();
  EXPECT_EQ(board.chip.flash.load(kSectors[11], 4), 0xFFFF'FFFFU);
  EXPECT_EQ(board.chip.scheduler.now() - third, 100 * kMicrosecond) << "a read anywhere: there is one bank";
  EXPECT_EQ(board.chip.flash.load(0, 8), 0x0000'0022'0000'0011U) << "the flash's other address";
}

TEST_F(FlashF4Test, ProtectedSectorsAreNeitherErasedNorProgrammed) {
  put(kOptcr, 0);
  EXPECT_TRUE(board.complained("FLASH", "OPTLOCK = 1"));
  unlock();
  put(kOptkeyr, 0x0819'2A3B);
  put(kOptkeyr, 0x4C5D'6E7F);
  EXPECT_EQ(board.chip.word(kOptcr) & 1, 0U);
  EXPECT_EQ(board.chip.word(kOptcr) >> 16 & 0xFFF, 0xFFFU);
  put(kOptcr, board.chip.word(kOptcr) & ~(1U << (16 + 7)));
  program(kSectors[7], 0x77);
  EXPECT_EQ(word(kSectors[7]), 0x77U) << "not before OPTSTRT";
  put(kOptcr, board.chip.word(kOptcr) | 2);
  wait();
  program(kSectors[7], 0);
  EXPECT_EQ(sr(), kWrperr);
  put(kSr, kWrperr);
  erase(7);
  EXPECT_EQ(sr(), kWrperr);
  put(kSr, kWrperr);
  put(kCr, kMer | kWordSize | kStart);
  EXPECT_EQ(sr(), kWrperr);
  EXPECT_EQ(word(kSectors[7]), 0x77U);
  put(kSr, kWrperr);
  program(kSectors[8] - 4, 0);
  EXPECT_EQ(sr(), kWrperr) << "its last word";
  put(kSr, kWrperr);
  program(kSectors[8], 0);
  EXPECT_EQ(sr(), 0U) << "the next sector";
  EXPECT_FALSE(board.chip.write(kOptkeyr, 4, 1));
}

TEST_F(FlashF4Test, ACutLeavesAWordBetweenOldAndNewAndTheSameSeedTheSame) {
  std::set<std::uint32_t> seen;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    for (const int again : {0, 1}) {
      DrivenChip other;
      other.chip.flash.seed = seed;
      other.chip.set_word(kKeyr, 0x4567'0123);
      other.chip.set_word(kKeyr, 0xCDEF'89AB);
      other.chip.set_word(kCr, kPg | kWordSize);
      other.chip.flash.store(kSectors[5], 4, 0x0F0F'0F0F);
      other.chip.advance_us(50);
      other.chip.lose_power();
      const auto left = static_cast<std::uint32_t>(other.chip.flash.load(kSectors[5], 4));
      EXPECT_EQ(left & 0x0F0F'0F0F, 0x0F0F'0F0FU) << "ones that were to stay";
      if (again == 0) seen.insert(left);
      EXPECT_TRUE(seen.contains(left)) << "seed " << seed;
      other.chip.flash.store(kSectors[5] + 8, 4, 0);
      EXPECT_EQ(other.chip.flash.load(kSectors[5] + 8, 4), 0xFFFF'FFFFU) << "nothing is taken without a supply";
    }
  }
  EXPECT_GT(seen.size(), 30U);
}

TEST_F(FlashF4Test, ACutOrAResetLeavesASectorUndefinedAndItsNeighboursWhole) {
  for (const bool cut : {true, false}) {
    for (std::uint32_t at = kSectors[1] - 4; at < kSectors[2] + 4; at += 4)
      (void)std::fill_n(board.chip.memory.flash().begin() + (at - kSectors[0]), 4, std::byte{0x5A});
    unlock();
    erase(1);
    board.chip.advance_us(900'000);
    if (cut) board.chip.lose_power();
    board.chip.system_reset(cut ? ResetCause::kPowerOn : ResetCause::kSoftware);
    EXPECT_EQ(sr(), 0U);
    EXPECT_EQ(cr(), kLock);
    const std::uint32_t first = word(kSectors[1]);
    int old = 0, blank = 0, other = 0;
    for (std::uint32_t at = kSectors[1]; at < kSectors[2]; at += 4)
      ++(word(at) == 0x5A5A'5A5A ? old : word(at) == 0xFFFF'FFFF ? blank : other);
    EXPECT_GT(old, 500);
    EXPECT_GT(blank, 500);
    EXPECT_GT(other, 1'000);
    EXPECT_EQ(word(kSectors[1] - 4), 0x5A5A'5A5AU);
    EXPECT_EQ(word(kSectors[2]), 0x5A5A'5A5AU);
    board.chip.advance_us(200'000);
    EXPECT_EQ(word(kSectors[1]), first) << "nothing goes on";
  }
}

TEST_F(FlashF4Test, ACutWhenTheOperationIsDoneChangesNothing) {
  unlock();
  put(kCr, kPg | kWordSize);
  store(kSectors[5], 0xA5);
  board.chip.advance_us(100);
  board.chip.lose_power();
  EXPECT_EQ(word(kSectors[5]), 0xA5U);
}

TEST_F(FlashF4Test, PowerLosesTheRamAndKeepsTheFlash) {
  unlock();
  program(kSectors[5], 0xCAFE);
  ASSERT_TRUE(board.chip.memory.write_word(0x2000'1000, 42));
  board.chip.lose_power();
  board.chip.system_reset(*board.chip.pending_reset);
  EXPECT_EQ(word(0x2000'1000), 0xCDCD'CDCDU);
  EXPECT_EQ(word(kSectors[5]), 0xCAFEU);
  EXPECT_EQ(board.get(reg::rcc::kRcc, reg::rcc::csr::kOffset) >> 24, 0x0EU) << "reset flags of a power-on alone";
  unlock();
  program(kSectors[5] + 4, 1);
  EXPECT_EQ(word(kSectors[5] + 4), 1U);
}

TEST_F(FlashF4Test, AFileKeepsTheContent) {
  unlock();
  program(kSectors[5], 0xCAFE);
  const std::string path = testing::TempDir() + "flash_f4_test.bin";
  EXPECT_EQ(board.chip.flash.save(path), "");
  DrivenChip other;
  EXPECT_EQ(other.chip.flash.restore(path), "");
  EXPECT_EQ(other.chip.flash.load(kSectors[5], 4), 0xCAFEU);
  std::FILE* const file = std::fopen(path.c_str(), "ab");
  std::fputc(0, file);
  std::fclose(file);
  EXPECT_NE(other.chip.flash.restore(path).find("1048577 bytes are no flash of 1048576 bytes"), std::string::npos);
  EXPECT_NE(other.chip.flash.restore("/nowhere/flash").find("cannot be opened"), std::string::npos);
  EXPECT_NE(other.chip.flash.save("/nowhere/flash").find("cannot be written"), std::string::npos);
  const std::string elsewhere = path + ".elsewhere";
  std::filesystem::create_symlink(elsewhere, path + ".new");
  EXPECT_EQ(other.chip.flash.save(path), "");
  EXPECT_FALSE(std::filesystem::exists(elsewhere)) << "written through a link";
  std::remove(path.c_str());
}

}  // namespace
}  // namespace tetap::board
