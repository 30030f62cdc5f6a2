// SPDX-License-Identifier: Apache-2.0
// Demands of a driver on a chip on an SPI bus: one transaction at a time. The port owns clock, mode and chip select.
#pragma once

#include <concepts>
#include <cstdint>
#include <span>

namespace tetap::hal {

template <class S>
concept SpiDevice = requires(S& s, std::span<const std::uint8_t> out, std::span<std::uint8_t> in) {
  /// With chip select held low: sends `out`, then clocks in in.size() bytes. The wait is bounded in the port; false:
  /// bus fault or time-out, and what is in `in` means nothing.
  { s.transfer(out, in) } -> std::same_as<bool>;
};

}  // namespace tetap::hal
