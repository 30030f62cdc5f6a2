// SPDX-License-Identifier: Apache-2.0
// The node of an image's robot on a board with sensors of its own: what main() of such a board calls.
#pragma once

#include "hal/can_bus.hpp"
#include "hal/chip/arm/stored_fault.hpp"
#include "hal/chip/support/boot_line.hpp"
#include "robot.hpp"
#include "tetap/firmware/accepted_frames.hpp"
#include "tetap/firmware/firmware.hpp"
#include "version.hpp"

namespace tetap::hal {

/// Inlined, as a frame of its own would be on the stack of every robot.
template <class Board>
[[noreturn, gnu::always_inline]] inline void run_wired_node() {
  namespace robot = tetap::robot::chosen;
  constexpr auto kParts = firmware::WiredParts::of(robot::parameters);
  static_assert(node::has_protection_for<robot::Estimators>(robot::parameters), "name WithBusProtection");
  static Board board{stored_fault, firmware::accepted_by<robot::Estimators>(robot::parameters)};
  static firmware::Firmware<Board, robot::Estimators, kParts> firmware{board, robot::parameters, version()};
  print_version_line(board, version());
  print_boot_line(board, tetap::robot::kName, firmware);
  print_stack_line(board);
  for (;;) firmware.poll();
}

}  // namespace tetap::hal
