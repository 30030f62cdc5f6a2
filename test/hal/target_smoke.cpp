// SPDX-License-Identifier: Apache-2.0
// The smallest image that uses all of a board. It prints that it is up and answers every CAN frame with the same data
// under identifier + 1. On a frame with identifier 7F0 it reports the clock, the stack and the counters. Run by
// r5_echo_test.sh and mps2_smoke_test.sh.
#if defined(TETAP_BOARD_ZYNQMP_R5)
#include "hal/board/zynqmp_r5/board.hpp"
using tetap::hal::zynqmp_r5::Board;
#else
#include "hal/board/mps2/board.hpp"
using tetap::hal::mps2::Board;
#endif

namespace {

constexpr std::uint32_t kReport = 0x7F0;
constexpr std::uint32_t kFault = 0x7F1;
// Initialised data and zeroed data are looked at before anything else, so a broken section copy cannot pass.
volatile std::uint32_t initialised = 0x600DDA7A;
volatile std::uint32_t zeroed;

template <class Can>
std::uint32_t unsupported(const Can& can) {
  if constexpr (requires { can.rx_unsupported(); }) return can.rx_unsupported();
  return 0;
}

void report(Board& board, std::uint32_t echoed) {
  const auto faults = board.can.faults();
  const auto stack = Board::stack();
  const auto now_us = static_cast<std::uint64_t>(board.now().us);
  tetap::hal::Text<> line;
  line.add("smoke: ms ").dec(static_cast<std::uint32_t>(now_us / 1000)).add(" echoed ").dec(echoed);
  line.add(" rx_overflow ")
      .dec(faults.rx_overflow)
      .add(" tx_full ")
      .dec(faults.tx_full)
      .add(" bus_off ")
      .dec(faults.bus_off);
  line.add(" unsupported ").dec(unsupported(board.can));
  line.add(" stack ").dec(stack.used).add(" of ").dec(stack.reserved).add('\n');
  board.print(line.c_str());
}

}  // namespace

int main() {
  static Board board;
  if (initialised != 0x600DDA7A || zeroed != 0) board.print("smoke: sections are not loaded\n");
  std::uint32_t echoed = 0;
#if !defined(TETAP_BOARD_ZYNQMP_R5)
  static tetap::hal::mps2::semihosting::CommandLine<512> arguments;
  const auto words = arguments.words<3>();
  if (!board.can.open(words[1], words[2])) {
    board.print("smoke: cannot open the files\n");
    return 1;
  }
#endif
  board.print("smoke: ready\n");
  for (;;) {
    while (auto frame = board.can.receive()) {
      if (frame->id == kFault) asm volatile("udf #0");
      if (frame->id == kReport) {
        report(board, echoed);
        continue;
      }
      ++frame->id;
      if (board.can.send(*frame)) ++echoed;
    }
    board.can.flush();
#if !defined(TETAP_BOARD_ZYNQMP_R5)
    if (board.can.at_end()) {
      report(board, echoed);
      return board.can.close() ? 0 : 1;
    }
#endif
  }
}
