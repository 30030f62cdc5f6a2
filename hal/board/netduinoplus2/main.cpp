// SPDX-License-Identifier: Apache-2.0
// The flash image of a robot whose estimator and sensors are a Netduino Plus 2, which QEMU knows.
#include "hal/board/netduinoplus2/board.hpp"
#include "hal/chip/support/boot_line.hpp"
#include "node/accepted_frames.hpp"
#include "node/firmware.hpp"
#include "robot.hpp"
#include "version.hpp"

int main() {
  namespace port = tetap::hal::netduinoplus2;
  namespace robot = tetap::robot::chosen;
  constexpr auto kParts = tetap::node::WiredParts::of(robot::parameters);
  constexpr auto kAccepted = tetap::node::accepted_by<robot::Estimators>(robot::parameters);
  static_assert(tetap::node::has_protection_for<robot::Estimators>(robot::parameters), "name WithBusProtection");
  static port::Board board{tetap::hal::stored_fault, {.id = kAccepted.id, .mask = kAccepted.mask}};
  static tetap::node::Firmware<port::Board, robot::Estimators, kParts> firmware{board, robot::parameters,
                                                                                tetap::version()};
  tetap::hal::print_version_line(board, tetap::version());
  tetap::hal::print_boot_line(board, tetap::robot::kName, firmware);
  tetap::hal::print_stack_line(board);
  for (;;) firmware.poll();
}
