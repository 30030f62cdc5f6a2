// SPDX-License-Identifier: Apache-2.0
// A timer in quadrature mode as a driver needs it: its free-running count. On a timer that can capture it, the time of
// the last counted edge comes too.
#pragma once

#include "tetap/base/time.hpp"

#include <concepts>
#include <cstdint>
#include <optional>

namespace tetap::hal {

/// One consistent pair: if an edge may fall between reading the two, the port reads again.
template <class Counter>
struct EncoderReading {
  Counter count = 0;                        ///< wraps at its own width
  std::optional<base::Micros> last_edge{};  ///< on the clock of Board::now(); empty: not captured
};

template <class E>
concept EncoderCounter = (std::same_as<typename E::Counter, std::uint16_t> ||
                          std::same_as<typename E::Counter, std::uint32_t>)&&requires(E& encoder) {
  { encoder.read() } -> std::same_as<EncoderReading<typename E::Counter>>;
};

}  // namespace tetap::hal
