// SPDX-License-Identifier: Apache-2.0
// The flash image of a robot whose estimator and sensors are an ARK CANnode.
#include "hal/board/ark_cannode/board.hpp"
#include "hal/board/ark_cannode/startup.hpp"
#include "hal/chip/support/boot_line.hpp"
#include "node/firmware.hpp"
#include "robot.hpp"
#include "version.hpp"

int main() {
  namespace ark = tetap::hal::ark_cannode;
  namespace robot = tetap::robot::chosen;
  constexpr auto kParts = tetap::node::WiredParts::of(robot::parameters);
  // A node has a range of 64 identifiers.
  static ark::Board board{ark::stored_fault, {.id = robot::parameters.can_base, .mask = 0x7C0}};
  static tetap::node::Firmware<ark::Board, robot::Estimators, kParts> firmware{board, robot::parameters,
                                                                               tetap::version()};
  tetap::hal::print_boot_line(board, tetap::robot::kName, firmware);
  tetap::hal::print_stack_line(board);
  for (;;) firmware.poll();
}
