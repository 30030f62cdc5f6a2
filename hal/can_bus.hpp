// SPDX-License-Identifier: Apache-2.0
// Demands of the firmware on a CAN controller. Frames are copied; the port owns filters, bit timing and bus-off
// recovery.
#pragma once

#include "tetap/base/can_faults.hpp"
#include "tetap/base/can_frame.hpp"

#include <concepts>
#include <cstdint>
#include <optional>

namespace tetap::hal {

/// Standard data frames whose identifier equals `id` in every bit of `mask`: all that a node asks a port to receive.
struct Acceptance {
  std::uint32_t id = 0;
  std::uint32_t mask = 0;

  [[nodiscard]] constexpr bool takes(const base::CanFrame& frame) const {
    return !frame.extended && (frame.id & mask) == (id & mask);
  }
};

template <class B>
concept CanBus = requires(B& bus, const B& view, const base::CanFrame& frame) {
  /// Takes the frame for transmission; false: no room, the frame is not taken. Frames leave in the order of these
  /// calls, whatever their identifiers. A log then shows an input of the node's own before the epoch that consumed it.
  { bus.send(frame) } -> std::same_as<bool>;
  /// The next received frame, in order of arrival; empty: none now. Never waits.
  { bus.receive() } -> std::same_as<std::optional<base::CanFrame>>;
  /// Called once at the end of each poll: hands on what send() collected (batched system calls, transmit FIFO).
  { bus.flush() } -> std::same_as<void>;
  { view.faults() } -> std::same_as<base::CanFaults>;
};

}  // namespace tetap::hal
