// SPDX-License-Identifier: Apache-2.0
// The Linux machine as a board: its monotonic clock and one SocketCAN interface.
#pragma once

#include "hal/board.hpp"
#include "hal/board/linux/clock.hpp"
#include "hal/board/linux/socket_can.hpp"

#include <string>

namespace tetap::hal {

struct LinuxBoard {
  explicit LinuxBoard(const std::string& interface, SocketCanOptions options = {}) : can(interface, options) {}

  [[nodiscard]] base::Micros now() const { return monotonic_clock() - began; }

  SocketCan can;
  base::Micros began = monotonic_clock();
};

static_assert(Board<LinuxBoard>);

}  // namespace tetap::hal
