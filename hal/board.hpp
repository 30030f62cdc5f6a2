// SPDX-License-Identifier: Apache-2.0
// All that the firmware asks of a board. A port is a struct that satisfies this; the compiler names what is missing.
#pragma once

#include "base/time.hpp"
#include "hal/can_bus.hpp"

#include <concepts>

namespace tetap::hal {

template <class B>
concept Board = requires(B& board) {
  /// Microseconds since start: monotonic, at least 100 us resolution. Only the loop reads it, and only to decide when
  /// to tick.
  { board.now() } -> std::same_as<base::Micros>;
  requires CanBus<decltype(B::can)>;
};

}  // namespace tetap::hal
