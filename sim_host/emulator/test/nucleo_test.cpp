// SPDX-License-Identifier: Apache-2.0
// A program's machine code on the emulated Nucleo-G474RE: clocks, console, interrupts of FDCAN, code in the CCM SRAM,
// and what the models notice of its mistakes.
#include "sim_host/emulator/machine.hpp"
#include "sim_host/emulator/nucleo_g474re.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

namespace tetap::board {
namespace {

class Nucleo {
 public:
  explicit Nucleo(std::uint32_t choice) : machine(board.chip, {}) {
    EXPECT_EQ(machine.load_elf(TETAP_PROGRAMS "/nucleo.elf"), "");
    for (std::uint32_t i = 0; i < 16; ++i)
      EXPECT_TRUE(board.chip.memory.write_word(kShared + 4 * i, i == 0 ? choice : 0));
    board.chip.fdcan1.line.on_frame = [this](Picoseconds, const CanOffer& frame, bool own) {
      if (own) sent.push_back(frame.frame);
    };
  }
  void run_ms(std::int64_t ms) { machine.run(board.chip.scheduler.now() + ms * kMillisecond); }
  [[nodiscard]] std::uint32_t result(std::uint32_t i) const {
    std::uint32_t word = 0;
    EXPECT_TRUE(board.chip.memory.read_word(kShared + 4 + 4 * i, word));
    return word;
  }
  void feed(std::uint32_t id) {
    board.chip.fdcan1.line.send({.id = id, .size = 8, .data = {9, 8, 7, 6, 5, 4, 3, 2}}, board.chip.scheduler.now());
  }

  NucleoG474re board;
  Machine machine;
  std::vector<base::CanFrame> sent;

 private:
  static constexpr std::uint32_t kShared = 0x2001'6000;
};

TEST(Nucleo, RunsOnWhileItsOtherBankIsErased) {
  Nucleo run(4);
  run.run_ms(80);
  EXPECT_EQ(run.result(4), 0U) << "88 ms at four times the typical figure";
  EXPECT_GT(run.result(3), 100'000U);
  run.run_ms(15);
  EXPECT_EQ(run.result(4), 1U);
  EXPECT_TRUE(run.board.chip.complaints.empty()) << run.board.chip.complaints.text();
}

TEST(Nucleo, ReadsADamagedDoubleWordIntoAnNmi) {
  for (const bool damaged : {false, true}) {
    Nucleo run(5);
    if (damaged) {
      run.board.chip.set_word(0x4002'1048, 0x100);  // FLASHEN
      for (const std::uint32_t key : {0x4567'0123U, 0xCDEF'89ABU}) run.board.chip.set_word(0x4002'2008, key);
      run.board.chip.set_word(0x4002'2014, 0x1'0802);
      run.board.chip.advance_us(10);
      run.board.chip.flash.cut();
      run.board.chip.flash.power_on();
      EXPECT_FALSE(run.board.chip.flash.damaged().empty());
    }
    run.run_ms(10);
    EXPECT_EQ(run.result(2), damaged ? 2U : 0U) << "the exception's number";
    EXPECT_EQ(run.result(4) == 512U * 0xFFFF'FFFFU, !damaged);
  }
}

TEST(Nucleo, EchoesFramesAtOneHundredAndSixtyMegahertz) {
  Nucleo run(0);
  run.run_ms(10);
  EXPECT_EQ(run.board.console, "hello from 160 MHz\n");
  EXPECT_EQ(run.board.chip.rcc.hclk_hz(), 160'000'000);
  EXPECT_EQ(run.result(0), 3U * (3U * 13 + 1) + 1) << "computed by code in the CCM SRAM";
  for (const std::uint32_t id : {0x100U, 0x200U, 0x300U, 0x400U}) run.feed(id);
  run.run_ms(5);
  ASSERT_EQ(run.sent.size(), 4U);
  for (std::uint32_t i = 0; i < 4; ++i) EXPECT_EQ(run.sent[i].id, 0x101U + 0x100 * i);
  EXPECT_EQ(run.sent[0].data[0], 9);
  EXPECT_EQ(run.sent[0].data[7], 2);
  EXPECT_EQ(run.result(1), 4U) << "interrupts";
  EXPECT_EQ(run.result(2), 0U) << "no other exception";
  EXPECT_TRUE(run.board.chip.complaints.empty()) << run.board.chip.complaints.text();
}

TEST(Nucleo, EveryMistakeIsNoticed) {
  const struct {
    std::uint32_t choice;
    const char *model, *complaint;
  } mistakes[] = {{1, "core", "interrupt 21 is never cleared"},
                  {2, "FDCAN1", "which holds nothing"},
                  {3, "RCC", "too few flash wait states"}};
  for (const auto& mistake : mistakes) {
    Nucleo run(mistake.choice);
    run.run_ms(10);
    run.feed(0x100);
    run.run_ms(50);
    EXPECT_TRUE(run.board.chip.complaints.has(mistake.model, mistake.complaint)) << mistake.choice << "\n"
                                                                                 << run.board.chip.complaints.text();
  }
}

}  // namespace
}  // namespace tetap::board
