// SPDX-License-Identifier: Apache-2.0
// End-to-end protection of commands and status. Byte 0 is a CRC-8 over the id offset and bytes 1 to 7. The low nibble
// of byte 1 is a counter. Layout and polynomial are those of AUTOSAR E2E profile 2, with the id offset as the data id.
// It finds damage and mixed-up ids, not malice.
#pragma once

#include "tetap/base/crc.hpp"
#include "tetap/bus/codec.hpp"

#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::bus {

template <class M>
concept Protected = requires(M m) {
  requires M::kProtected;
  m.crc;
  m.ctr;
};

[[nodiscard]] constexpr std::uint8_t e2e_crc(std::uint8_t offset, std::span<const std::uint8_t> payload) {
  base::Crc8H2f crc;
  crc.add(offset);
  for (std::size_t i = 1; i < payload.size(); ++i) crc.add(payload[i]);
  return crc.value();
}

/// False for any wrong length, too.
[[nodiscard]] constexpr bool e2e_valid(std::uint8_t offset, std::span<const std::uint8_t> payload) {
  return payload.size() == 8 && e2e_crc(offset, payload) == payload[0];
}

/// The message with its CRC. The counter is the sender's: one more for each frame of this message.
template <Protected M>
[[nodiscard]] constexpr M protect(M message) {
  message.crc = e2e_crc(M::kOffset, encode(message));
  return message;
}

}  // namespace tetap::bus
