// SPDX-License-Identifier: Apache-2.0
// A scanner LD06, LD19 or STL-19P on a serial line: reads its bytes, hands on each whole turn with the time of its
// first beam. It sends on its own and takes no commands. Beam k is at k degrees clockwise, so in the robot's axes (x
// forward, y left) at -k degrees: the order of the beams is that of time.
#pragma once

#include "drivers/lidar/ld19/framer.hpp"
#include "drivers/lidar/line.hpp"
#include "drivers/lidar/turn_assembly.hpp"
#include "hal/byte_stream.hpp"
#include "tetap/base/time.hpp"

#include <cstddef>
#include <cstdint>

namespace tetap::drivers::ld19 {

template <hal::ByteStream Port>
class Driver {
 public:
  explicit constexpr Driver(Port& port) : port_(&port) {}

  /// Calls `handler(ranges, first)` for every whole turn: 360 ranges, and the time of the beam at 0 degrees. Reads a
  /// bounded number of bytes. The time is that of the bytes' arrival less what they took on the line.
  template <class Handler>
  constexpr void poll(base::Micros now, Handler&& handler) {
    read_line(*port_, [&](std::uint8_t byte, std::size_t after) {
      const auto packet = framer_.on_byte(byte, health_);
      if (packet) on_packet(*packet, now - line_time(kPacketBytes + after, kBaud), handler);
    });
  }

  [[nodiscard]] constexpr const Health& health() const { return health_; }

 private:
  /// Without a packet for so long: a third of a turn and more is missing, and the next packet may be of another turn.
  static constexpr base::Micros kGap{30'000};

  /// `sent`: when the packet's first byte was sent; its last point is taken to be of that time.
  template <class Handler>
  constexpr void on_packet(const Packet& packet, base::Micros sent, Handler& handler) {
    constexpr auto kSteps = static_cast<std::int64_t>(kPoints) - 1;
    for (std::size_t i = 0; i < kPoints; ++i) {
      const std::int64_t left_cdeg = (kSteps - static_cast<std::int64_t>(i)) * packet.span_cdeg / kSteps;
      const base::Micros at = sent - base::Micros{left_cdeg * 10'000 / packet.speed_degps};
      turns_.add({.angle_cdeg = packet.angle_cdeg(i), .distance_mm = packet.distance_mm[i], .at = at}, handler);
    }
    health_.turns_cut = turns_.cut();
  }

  Port* port_;
  Framer framer_{};
  Health health_{};
  TurnAssembly turns_{kGap};
};

}  // namespace tetap::drivers::ld19
