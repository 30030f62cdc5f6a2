// SPDX-License-Identifier: Apache-2.0
// The flash image of a robot whose estimator is a Cortex-R5F of a Zynq UltraScale+.
#include "hal/board/zynqmp_r5/board.hpp"
#include "hal/chip/support/boot_line.hpp"
#include "robot.hpp"
#include "tetap/firmware/accepted_frames.hpp"
#include "tetap/firmware/firmware.hpp"
#include "version.hpp"

int main() {
  using Board = tetap::hal::zynqmp_r5::Board;
  namespace robot = tetap::robot::chosen;
  static_assert(tetap::node::has_protection_for<robot::Estimators>(robot::parameters), "name WithBusProtection");
  static Board board{tetap::hal::zynqmp_r5::receiving(
      tetap::hal::zynqmp_r5::kCanDefault, tetap::firmware::accepted_by<robot::Estimators>(robot::parameters))};
  static tetap::firmware::Firmware<Board, robot::Estimators> firmware{board, robot::parameters, tetap::version()};
  tetap::hal::print_version_line(board, tetap::version());
  tetap::hal::print_boot_line(board, tetap::robot::kName, firmware);
  tetap::hal::print_stack_line(board);
  for (std::uint32_t polls = 0;; ++polls) {
    firmware.poll();
    if ((polls & 0xFFFF) == 0xFFFF) tetap::hal::print_stack_line(board);
  }
}
