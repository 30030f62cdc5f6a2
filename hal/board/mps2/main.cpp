// SPDX-License-Identifier: Apache-2.0
// The firmware on an emulated Cortex-M, fed from a candump log through semihosting: arguments IN.log OUT.log (either
// may be missing). For on-target proofs: same bytes as the host, stack high-water mark, instructions per tick.
#include "hal/board/mps2/board.hpp"
#include "hal/chip/support/boot_line.hpp"
#include "robot.hpp"
#include "tetap/firmware/accepted_frames.hpp"
#include "tetap/firmware/firmware.hpp"
#include "version.hpp"

int main() {
  using Board = tetap::hal::mps2::Board;
  static Board board;
  static tetap::hal::mps2::semihosting::CommandLine<512> arguments;
  const auto words = arguments.template words<3>();
  if (!board.can.open(words[1], words[2])) {
    board.print("tetap: cannot open the files\n");
    return 1;
  }
  namespace robot = tetap::robot::chosen;
  static_assert(tetap::node::has_protection_for<robot::Estimators>(robot::parameters), "name WithBusProtection");
  board.can.accept(tetap::firmware::accepted_by<robot::Estimators>(robot::parameters));
  static tetap::firmware::Firmware<Board, robot::Estimators> firmware{board, robot::parameters, tetap::version()};
  tetap::hal::print_version_line(board, tetap::version());
  tetap::hal::print_boot_line(board, tetap::robot::kName, firmware);
  while (!board.can.at_end()) firmware.poll();
  tetap::hal::print_stack_line(board);
  return board.can.close() ? 0 : 1;
}
