// SPDX-License-Identifier: Apache-2.0
// Flash of the STM32G474 by its registers: each rule of RM0440, "Embedded flash memory (FLASH) for category 3 devices",
// and the durations of DS12288.
#include "sim_host/emulator/flash_ecc.hpp"
#include "sim_host/emulator/test/driven_g474.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <string>

namespace tetap::board {
namespace {

// The manual's registers once more, by hand.
constexpr std::uint32_t kKeyr = 0x4002'2008, kOptkeyr = 0x4002'200C, kSr = 0x4002'2010, kCr = 0x4002'2014,
                        kEccr = 0x4002'2018, kOptr = 0x4002'2020;
constexpr std::uint32_t kEop = 1, kOperr = 2, kProgerr = 8, kWrperr = 0x10, kPgaerr = 0x20, kSizerr = 0x40,
                        kPgserr = 0x80, kBusy = 0x1'0000;
constexpr std::uint32_t kPg = 1, kPer = 2, kMer1 = 4, kBank2 = 0x800, kMer2 = 0x8000, kStart = 0x1'0000,
                        kEopie = 0x0100'0000, kErrie = 0x0200'0000, kOptlock = 0x4000'0000, kLock = 0x8000'0000;
constexpr std::uint32_t kBase = 0x0800'0000, kSecond = 0x0804'0000, kPage = 2'048;
constexpr std::uint64_t kData = 0x0123'4567'89AB'CDEF, kBlank = ~std::uint64_t{0};

class FlashG4Test : public testing::Test {
 protected:
  DrivenG474 board;
  FlashG4& flash = board.chip.flash;

  FlashG4Test() { board.open_gates(), board.set(g4::rcc::kRcc, g4::rcc::ahb1enr::kOffset, 0x100); }
  [[nodiscard]] std::uint32_t sr() { return board.chip.word(kSr); }
  [[nodiscard]] std::uint32_t cr() { return board.chip.word(kCr) & ~kOptlock; }
  void put(std::uint32_t address, std::uint32_t value) { board.chip.set_word(address, value); }
  void unlock() {
    put(kKeyr, 0x4567'0123);
    put(kKeyr, 0xCDEF'89AB);
  }
  void wait() {
    for (int us = 0; us < 200'000 && (sr() & kBusy) != 0; us += 10) board.chip.advance_us(10);
    EXPECT_EQ(sr() & kBusy, 0U);
  }
  void store(std::uint32_t address, std::uint64_t value) {
    flash.store(address, 4, static_cast<std::uint32_t>(value));
    flash.store(address + 4, 4, static_cast<std::uint32_t>(value >> 32));
  }
  void program(std::uint32_t address, std::uint64_t value) {
    put(kCr, kPg);
    store(address, value);
    wait();
  }
  void erase(std::uint32_t bank, std::uint32_t page) { put(kCr, kPer | page << 3 | bank * kBank2 | kStart); }
  /// Cells as a cut may leave them.
  void damage(std::uint32_t address, std::uint64_t flipped) {
    const std::string path = testing::TempDir() + "flash_g4_test_damage.bin";
    ASSERT_EQ(flash.save(path), "");
    std::FILE* const file = std::fopen(path.c_str(), "rb+");
    std::uint64_t data = 0;
    std::fseek(file, address - kBase, SEEK_SET);
    ASSERT_EQ(std::fread(&data, 8, 1, file), 1U);
    const std::uint8_t check = ecc::check_bits(data);
    data ^= flipped;
    std::fseek(file, address - kBase, SEEK_SET);
    std::fwrite(&data, 8, 1, file);
    const std::uint32_t index = (address - kBase) / 8;
    std::fseek(file, 0, SEEK_END);
    std::fwrite(&index, 4, 1, file);
    std::fwrite(&check, 1, 1, file);
    std::fclose(file);
    ASSERT_EQ(flash.restore(path), "");
    std::remove(path.c_str());
  }
  [[nodiscard]] bool nmi() const { return board.chip.nvic.pending(exception::kNmi); }
};

TEST(FlashEcc, CorrectsOneWrongBitOf72AndFindsTwo) {
  for (const std::uint64_t data : {kData, kBlank, std::uint64_t{0}, std::uint64_t{1} << 63}) {
    const std::uint8_t check = ecc::check_bits(data);
    const auto read = [&](int a, int b) {
      std::uint64_t wrong = data;
      auto bits = check;
      for (const int at : {a, b}) {
        if (at >= 0 && at < 64) wrong ^= std::uint64_t{1} << at;
        if (at >= 64) bits = static_cast<std::uint8_t>(bits ^ 1U << (at - 64));
      }
      return ecc::read(wrong, bits);
    };
    EXPECT_EQ(read(-1, -1).verdict, ecc::Verdict::kFine);
    for (int a = 0; a < 72; ++a) {
      EXPECT_EQ(read(a, -1).verdict, ecc::Verdict::kCorrected) << a;
      EXPECT_EQ(read(a, -1).data, data) << a;
      for (int b = 0; b < a; ++b) EXPECT_EQ(read(a, b).verdict, ecc::Verdict::kWrong) << a << " " << b;
    }
  }
}

TEST_F(FlashG4Test, TwoKeysUnlockAndAWrongOneLocksUntilTheNextReset) {
  EXPECT_EQ(board.chip.word(kCr), kLock | kOptlock);
  EXPECT_EQ(board.chip.word(kOptr) >> 22 & 1, 1U) << "two banks";
  put(kCr, kPg);
  EXPECT_TRUE(board.complained("FLASH", "LOCK = 1"));
  unlock();
  put(kCr, kPg);
  EXPECT_EQ(cr(), kPg);
  put(kOptkeyr, 0x0819'2A3B);
  put(kOptkeyr, 0x4C5D'6E7F);
  EXPECT_EQ(board.chip.word(kCr), kPg);
  put(kCr, kLock);
  EXPECT_EQ(board.chip.word(kCr), kLock | kOptlock) << "LOCK closes both; CR takes the other bits of the same write";
  EXPECT_FALSE(board.chip.write(kKeyr, 4, 0xCDEF'89AB));
  EXPECT_FALSE(board.chip.write(kKeyr, 4, 0x4567'0123));
  EXPECT_EQ(board.chip.word(kCr) & kLock, kLock);
  board.chip.system_reset(ResetCause::kSoftware);
  board.set(g4::rcc::kRcc, g4::rcc::ahb1enr::kOffset, 0x100);
  unlock();
  EXPECT_EQ(cr(), 0U);
}

TEST_F(FlashG4Test, ADoubleWordIsProgrammedOnceOrSetToZero) {
  unlock();
  program(kBase, kData);
  EXPECT_EQ(flash.load(kBase, 8), kData);
  EXPECT_NO_COMPLAINTS(board);
  program(kBase, kData & ~std::uint64_t{0xF});
  EXPECT_EQ(sr(), kProgerr);
  EXPECT_EQ(flash.load(kBase, 8), kData);
  put(kSr, kProgerr);
  program(kBase, kData);
  EXPECT_EQ(sr(), kProgerr) << "the same content";
  put(kSr, kProgerr);
  program(kBase, 0);
  EXPECT_EQ(sr(), 0U);
  EXPECT_EQ(flash.load(kBase, 8), 0U);
  program(kBase + 8, kBlank);
  program(kBase + 8, kData);
  EXPECT_EQ(sr(), 0U) << "ones are blank";
  EXPECT_FALSE(nmi());
}

TEST_F(FlashG4Test, NothingIsProgrammedBeforeTheSecondWord) {
  unlock();
  put(kCr, kPg);
  flash.store(kBase, 4, 1);
  EXPECT_EQ(sr(), 0U);
  flash.store(kBase + 4, 4, 2);
  EXPECT_EQ(sr(), kBusy);
  wait();
  EXPECT_EQ(flash.load(kBase, 8), 0x2'0000'0001U);
  put(kCr, kPg);
  flash.store(kBase + 8, 4, 1);
  put(kCr, 0);
  put(kCr, kPg);
  flash.store(kBase + 12, 4, 2);
  EXPECT_EQ(sr(), kPgaerr) << "PG = 0 forgets the first word";
}

TEST_F(FlashG4Test, ErrorsAbortAndHoldEverythingUntilTheyAreCleared) {
  unlock();
  flash.store(kBase, 4, 0);
  EXPECT_EQ(sr(), kPgserr) << "PG = 0";
  put(kCr, kPg);
  store(kBase, 0);
  EXPECT_EQ(sr(), kPgserr) << "an old error";
  put(kCr, 0);
  erase(0, 0);
  EXPECT_EQ(sr(), kPgserr) << "an old error before an erase";
  put(kSr, kPgserr);
  put(kCr, kPg | kErrie);
  for (const unsigned size : {1U, 2U}) {
    flash.store(kBase, size, 0);
    EXPECT_EQ(sr(), kSizerr | kOperr);
    put(kSr, kSizerr | kOperr);
  }
  EXPECT_TRUE(board.pending(4));
  flash.store(kBase + 4, 4, 0);
  EXPECT_EQ(sr(), kPgaerr | kOperr) << "the second word first";
  put(kSr, kPgaerr | kOperr);
  flash.store(kBase, 4, 0);
  flash.store(kBase + 12, 4, 0);
  EXPECT_EQ(sr(), kPgaerr | kOperr) << "the second word of another double word";
  put(kSr, kPgaerr | kOperr);
  put(kCr, kPg | kPer | kStart);
  EXPECT_EQ(sr(), kPgserr) << "an erase with PG";
  put(kSr, kPgserr);
  put(kCr, kPer | kMer1 | kStart);
  EXPECT_EQ(sr(), kPgserr) << "page and bank";
  put(kSr, kPgserr);
  put(kCr, kStart);
  EXPECT_TRUE(board.complained("FLASH", "STRT without"));
  EXPECT_EQ(flash.load(kBase, 8), kBlank);
}

TEST_F(FlashG4Test, PagesAndBanksAreErasedAndNothingElse) {
  unlock();
  for (const std::uint32_t bank : {0U, 1U}) {
    for (const std::uint32_t page : {1U, 63U, 126U}) {
      const std::uint32_t at = kBase + bank * 0x4'0000 + page * kPage;
      for (const std::uint32_t one : {at - 8, at, at + kPage - 8, at + kPage}) {
        if (flash.load(one, 8) == kBlank) program(one, kData);
      }
      erase(bank, page);
      EXPECT_EQ(cr() & kStart, kStart);
      wait();
      EXPECT_EQ(cr() & kStart, 0U);
      EXPECT_EQ(flash.load(at - 8, 8), kData);
      EXPECT_EQ(flash.load(at, 8), kBlank);
      EXPECT_EQ(flash.load(at + kPage - 8, 8), kBlank);
      EXPECT_EQ(flash.load(at + kPage, 8), kData);
    }
  }
  program(kSecond - 8, 1);
  program(kSecond, 2);
  put(kCr, kMer2 | kStart);
  wait();
  EXPECT_EQ(flash.load(kSecond - 8, 8), 1U);
  EXPECT_EQ(flash.load(kSecond, 8), kBlank);
  program(kSecond, 2);
  put(kCr, kMer1 | kStart);
  wait();
  EXPECT_EQ(flash.load(kBase + kPage - 8, 8), kBlank);
  EXPECT_EQ(flash.load(kSecond - 8, 8), kBlank);
  EXPECT_EQ(flash.load(kSecond, 8), 2U);
  put(kCr, kMer1 | kMer2 | kStart);
  wait();
  EXPECT_EQ(flash.load(kSecond, 8), kBlank);
  EXPECT_NO_COMPLAINTS(board);
}

TEST_F(FlashG4Test, BusyLastsAsLongAsTheDataSheetSays) {
  using Pace = FlashController::Pace;
  unlock();
  const auto nanoseconds = [&](std::uint32_t address) {
    const Picoseconds left = flash.busy_until(address) - board.chip.scheduler.now();
    wait();
    return left / 1'000;
  };
  struct Case {
    Pace pace;
    std::int64_t program_ns, page_us, bank_us;
  };
  std::uint32_t at = kBase;
  for (const Case& one : {Case{Pace::kTypical, 81'700, 22'020, 22'130}, Case{Pace::kMaximum, 83'350, 24'470, 24'600},
                          Case{Pace::kFourfold, 83'350, 88'080, 88'520}}) {
    flash.pace = one.pace;
    put(kCr, kPg);
    store(at, kData);
    EXPECT_EQ(nanoseconds(at), one.program_ns);
    erase(0, 0);
    EXPECT_EQ(nanoseconds(at), 1'000 * one.page_us);
    put(kCr, kMer1 | kStart);
    EXPECT_EQ(nanoseconds(at), 1'000 * one.bank_us);
  }
}

TEST_F(FlashG4Test, AnotherBankIsReadWhileOneIsBusy) {
  unlock();
  erase(1, 5);
  const Picoseconds begin = board.chip.scheduler.now();
  EXPECT_EQ(flash.busy_until(kBase), 0);
  EXPECT_EQ(flash.load(kSecond - 8, 8), kBlank);
  EXPECT_EQ(board.chip.scheduler.now(), begin);
  EXPECT_NE(flash.busy_until(kSecond), 0);
  EXPECT_EQ(flash.load(0x0807'FFF8, 8), kBlank);
  EXPECT_EQ(board.chip.scheduler.now() - begin, 88'080 * kMicrosecond) << "the same bank stalls";
  erase(0, 5);
  EXPECT_NE(flash.busy_until(0), 0) << "the flash's other address";
  EXPECT_EQ(flash.busy_until(kSecond), 0);
  const Picoseconds second = board.chip.scheduler.now();
  put(kCr, kPg);
  EXPECT_EQ(board.chip.scheduler.now() - second, 88'080 * kMicrosecond) << "a write of FLASH_CR";
}

TEST_F(FlashG4Test, EndOfOperationIsSetWithItsInterruptOnly) {
  unlock();
  program(kBase, kData);
  EXPECT_EQ(sr(), 0U);
  put(kCr, kPg | kEopie);
  store(kBase + 8, kData);
  wait();
  EXPECT_EQ(sr(), kEop);
  EXPECT_TRUE(board.pending(4));
}

TEST_F(FlashG4Test, ProtectedPagesAreNeitherErasedNorProgrammed) {
  flash.protected_pages[1] = 0x0006'0005;  // pages 5 and 6
  unlock();
  for (const std::uint32_t page : {4U, 5U, 6U, 7U}) {
    const bool kept = page == 5 || page == 6;
    program(kSecond + page * kPage, kData);
    EXPECT_EQ(sr(), kept ? kWrperr : 0U) << page;
    put(kSr, kWrperr);
    erase(1, page);
    EXPECT_EQ((sr() & kWrperr) != 0, kept) << page;
    wait();
    put(kSr, kWrperr);
  }
  put(kCr, kMer2 | kStart);
  EXPECT_EQ(sr(), kWrperr);
  put(kSr, kWrperr);
  erase(0, 5);
  EXPECT_EQ(sr(), kBusy) << "the other bank";
}

TEST_F(FlashG4Test, OneWrongBitIsCorrectedAndNoted) {
  unlock();
  program(kSecond + 0x128, kData);
  damage(kSecond + 0x128, 1U << 20);
  EXPECT_EQ(flash.load(kSecond + 0x12C, 4), kData >> 32);
  EXPECT_EQ(flash.load(kSecond + 0x128, 4), kData & 0xFFFF'FFFF);
  EXPECT_EQ(board.chip.word(kEccr), 0x4000'0000U | 1U << 21 | 0x128);
  EXPECT_FALSE(nmi());
  EXPECT_FALSE(board.pending(4));
  put(kEccr, 1U << 24);
  EXPECT_TRUE(board.pending(4));
  put(kEccr, 0x4000'0000);
  EXPECT_EQ(board.chip.word(kEccr) >> 30, 0U);
}

TEST_F(FlashG4Test, TwoWrongBitsAreAnNmiWithTheFirstAddress) {
  unlock();
  program(kBase + 0x40, kData);
  program(kSecond + 0x80, kData);
  damage(kBase + 0x40, 3);
  EXPECT_EQ(flash.load(kBase + 0x48, 8), kBlank);
  EXPECT_EQ(board.chip.word(kEccr), 0U) << "its neighbour";
  EXPECT_EQ(flash.load(kBase + 0x44, 2), (kData >> 32) & 0xFFFF);
  EXPECT_EQ(board.chip.word(kEccr), 0x8000'0040U);
  EXPECT_TRUE(nmi());
  EXPECT_EQ(flash.load(kBase + 0x40, 8), kData ^ 3) << "nothing is corrected";
  damage(kSecond + 0x80, 3);
  (void)flash.load(kSecond + 0x80, 8);
  EXPECT_EQ(board.chip.word(kEccr), 0x8000'0040U) << "the address stays until the flag is cleared";
  put(kSr, 0);
  put(kEccr, 0x8000'0000);
  erase(0, 0);
  wait();
  board.chip.nvic.unpend(exception::kNmi);
  EXPECT_EQ(flash.load(kBase + 0x40, 8), kBlank);
  EXPECT_FALSE(nmi()) << "an erase repairs";
}

TEST_F(FlashG4Test, ACutProgramLeavesWhatTheCheckBitsJudge) {
  int old = 0, fresh = 0, corrected = 0, wrong = 0;
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    board.chip.system_reset(ResetCause::kPowerOn);
    board.set(g4::rcc::kRcc, g4::rcc::ahb1enr::kOffset, 0x100);
    flash.seed = seed;
    unlock();
    const std::uint32_t at = kBase + static_cast<std::uint32_t>(seed) * 8;
    const std::uint64_t value = seed % 2 == 0 ? kBlank << 1 : kData;  // one cell, or many
    put(kCr, kPg);
    store(at, value);
    board.chip.advance_us(40);
    board.chip.lose_power();
    const std::uint64_t left = flash.load(at, 8);
    const std::uint32_t flags = board.chip.word(kEccr) >> 30;
    ++(flags == 2 ? wrong : flags == 1 ? corrected : left == kBlank ? old : fresh);
    EXPECT_EQ(flags == 2, nmi());
    board.chip.nvic.unpend(exception::kNmi);
    if (flags == 0 && seed % 2 == 0) {
      EXPECT_TRUE(left == kBlank || left == value);
    }
  }
  EXPECT_GT(wrong, 100);
  EXPECT_GT(corrected, 20);
  EXPECT_GT(old + fresh, 20);
  board.chip.system_reset(ResetCause::kPowerOn);
  board.set(g4::rcc::kRcc, g4::rcc::ahb1enr::kOffset, 0x100);
  unlock();
  erase(0, 0);
  wait();
  EXPECT_TRUE(flash.damaged().empty() || flash.damaged().begin()->first >= kPage / 8);
}

TEST_F(FlashG4Test, ACutEraseLeavesAPageUndefinedAndItsNeighboursWhole) {
  unlock();
  for (std::uint32_t at = kSecond + kPage - 8; at <= kSecond + 2 * kPage; at += 8) program(at, kData);
  erase(1, 1);
  board.chip.advance_us(88'000);
  board.chip.lose_power();
  board.chip.system_reset(ResetCause::kPowerOn);
  board.set(g4::rcc::kRcc, g4::rcc::ahb1enr::kOffset, 0x100);
  int old = 0, blank = 0;
  for (std::uint32_t at = kSecond + kPage; at < kSecond + 2 * kPage; at += 8) {
    const std::uint64_t left = flash.load(at, 8);
    old += left == kData ? 1 : 0;
    blank += left == kBlank ? 1 : 0;
  }
  EXPECT_GT(old, 30);
  EXPECT_GT(blank, 30);
  EXPECT_GT(flash.damaged().size(), 60U);
  EXPECT_EQ(flash.load(kSecond + kPage - 8, 8), kData);
  EXPECT_EQ(flash.load(kSecond + 2 * kPage, 8), kData);
  EXPECT_EQ(board.chip.word(kEccr) >> 31, 1U);
}

TEST_F(FlashG4Test, ACellThatLooksBlankAndIsNotIsRefused) {
  damage(kBase + 0x100, 1);  // one data bit reads 0
  unlock();
  program(kBase + 0x100, kData);
  EXPECT_EQ(sr(), kProgerr);
  put(kSr, kProgerr);
  program(kBase + 0x100, 0);
  EXPECT_EQ(sr(), 0U);
  EXPECT_EQ(flash.load(kBase + 0x100, 8), 0U);
  EXPECT_EQ(board.chip.word(kEccr), 0U);
}

}  // namespace
}  // namespace tetap::board
