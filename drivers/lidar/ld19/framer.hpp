// SPDX-License-Identifier: Apache-2.0
// Finds packets in a stream of bytes. A packet counts only when its CRC fits. Otherwise the search goes on one byte
// after its start, within the buffered bytes, so damage costs only the damaged packet.
#pragma once

#include "drivers/lidar/ld19/packet.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace tetap::drivers::ld19 {

/// Counts of what was read and refused: noise in bytes, the rest in packets or turns.
struct Health {
  std::uint32_t packets = 0;       ///< whole, whatever was made of them
  std::uint32_t noise = 0;         ///< bytes that belong to no packet
  std::uint32_t crc = 0;           ///< damaged, or bytes that looked like a packet
  std::uint32_t out_of_range = 0;  ///< an angle that does not exist, or a motor that is not at its speed
  std::uint32_t turns_cut = 0;     ///< turns given up: the line was quiet within them
};

class Framer {
 public:
  /// The packet that ends with this byte.
  constexpr std::optional<Packet> on_byte(std::uint8_t byte, Health& health) {
    buffer_[size_] = byte;
    ++size_;
    // Each turn but the last makes the buffer shorter.
    while (size_ > 0) {
      const bool starts = buffer_[0] == kHeader && (size_ < 2 || buffer_[1] == kForm);
      if (starts && size_ < kPacketBytes) return {};
      if (starts && crc8(std::span(buffer_).first<kPacketBytes - 1>()) == buffer_[kPacketBytes - 1]) break;
      if (starts) ++health.crc;
      drop_first(health);
    }
    if (size_ == 0) return {};
    size_ = 0;
    ++health.packets;
    Packet packet;
    if (decode(buffer_, packet)) return packet;
    ++health.out_of_range;
    return {};
  }

 private:
  /// To the next byte that may start a packet.
  constexpr void drop_first(Health& health) {
    const auto end = buffer_.begin() + static_cast<std::ptrdiff_t>(size_);
    const auto next = std::find(buffer_.begin() + 1, end, kHeader);
    health.noise += static_cast<std::uint32_t>(next - buffer_.begin());
    std::copy(next, end, buffer_.begin());
    size_ = static_cast<std::size_t>(end - next);
  }

  std::array<std::uint8_t, kPacketBytes> buffer_{};
  std::size_t size_ = 0;
};

}  // namespace tetap::drivers::ld19
