// SPDX-License-Identifier: Apache-2.0
// A scanner LD06, LD19 or STL-19P on a serial line: reads its bytes, hands on each whole turn with the time of its
// first beam. It sends on its own and takes no commands. Beam k is at k degrees clockwise, so in the robot's axes (x
// forward, y left) at -k degrees: the order of the beams is that of time.
#pragma once

#include "drivers/lidar/ld19/framer.hpp"
#include "drivers/lidar/turn.hpp"
#include "hal/byte_stream.hpp"
#include "tetap/base/time.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::drivers::ld19 {

template <hal::ByteStream Port>
class Driver {
 public:
  explicit constexpr Driver(Port& port) : port_(&port) {}

  /// Calls `handler(ranges, first)` for every whole turn: 360 ranges, and the time of the beam at 0 degrees. Reads a
  /// bounded number of bytes. The time is that of the bytes' arrival less what they took on the line.
  template <class Handler>
  constexpr void poll(base::Micros now, Handler&& handler) {
    std::array<std::uint8_t, 64> bytes{};
    for (int reads = 0; reads < kReads; ++reads) {
      const std::size_t n = port_->read(bytes);
      if (n == 0 || n > bytes.size()) return;
      for (std::size_t i = 0; i < n; ++i) {
        const auto packet = framer_.on_byte(bytes[i], health_);
        if (packet) on_packet(*packet, now - line_time(kPacketBytes + n - 1 - i), handler);
      }
    }
  }

  [[nodiscard]] constexpr const Health& health() const { return health_; }

 private:
  static constexpr int kReads = 16;  ///< 1 kB: 44 ms of the line
  /// Without a packet for so long: a third of a turn and more is missing, and the next packet may be of another turn.
  static constexpr base::Micros kGap{30'000};

  /// Time of bytes of ten bits on the line.
  [[nodiscard]] static constexpr base::Micros line_time(std::size_t bytes) {
    return {static_cast<std::int64_t>(bytes) * 10'000'000 / static_cast<std::int64_t>(kBaud)};
  }

  /// From the front to the packet's last point; below zero when that point lies just before the front.
  [[nodiscard]] static constexpr base::Micros time_since_front(const Packet& packet) {
    const std::int64_t last_cdeg = packet.angle_cdeg(kPoints - 1);
    const std::int64_t past_cdeg = last_cdeg < kFullTurn_cdeg / 2 ? last_cdeg : last_cdeg - kFullTurn_cdeg;
    return {past_cdeg * 10'000 / packet.speed_degps};
  }

  /// `sent`: when the packet's first byte was sent; its last point is taken to be of that time.
  template <class Handler>
  constexpr void on_packet(const Packet& packet, base::Micros sent, Handler& handler) {
    if (begun_ && sent - last_ > kGap) {
      ++health_.turns_cut;
      begun_ = false;
    }
    last_ = sent;
    for (std::size_t i = 0; i < kPoints; ++i) {
      const std::size_t bin = Turn::bin(packet.angle_cdeg(i));
      if (bin + kHalf < bin_) {  // past the front: the next turn
        if (begun_) handler(turn_.ranges(), first_);
        turn_.clear();
        begun_ = true;
        first_ = sent - time_since_front(packet);
      } else if (begun_ && bin > bin_ + kHalf) {
        continue;  // a point of the turn that is done
      }
      bin_ = bin;
      turn_.add(bin, packet.distance_mm[i]);
    }
  }

  static constexpr std::size_t kHalf = Turn::kBins / 2;

  Port* port_;
  Framer framer_{};
  Health health_{};
  Turn turn_{};
  std::size_t bin_ = 0;   ///< bin of the last point
  base::Micros first_{};  ///< time of the beam at 0 degrees
  base::Micros last_{};   ///< time of the last packet
  bool begun_ = false;    ///< turn_ began at 0 degrees
};

}  // namespace tetap::drivers::ld19
