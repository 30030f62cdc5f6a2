// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/ld19_scanner.hpp"

#include <algorithm>
#include <cmath>

namespace tetap::board {

std::uint8_t ld19_remainder(std::span<const std::uint8_t> message) {
  constexpr unsigned kDivisor = 0x14D;
  unsigned remainder = 0;
  const auto divide = [&remainder](unsigned byte) {
    for (unsigned mask = 0x80; mask != 0; mask /= 2) {
      remainder = 2 * remainder + ((byte & mask) != 0 ? 1 : 0);
      if (remainder >= 0x100) remainder ^= kDivisor;
    }
  };
  for (const std::uint8_t byte : message) divide(byte);
  divide(0);
  return static_cast<std::uint8_t>(remainder);
}

std::vector<std::uint8_t> Ld19Packet::bytes() const {
  std::vector<std::uint8_t> all{0x54, 0x2C};
  const auto word = [&all](unsigned value) {
    all.push_back(static_cast<std::uint8_t>(value % 256));
    all.push_back(static_cast<std::uint8_t>(value / 256));
  };
  word(speed_degps);
  word(start_cdeg);
  for (const Point& point : points) {
    word(point.distance_mm);
    all.push_back(point.intensity);
  }
  word(end_cdeg);
  word(stamp_ms);
  all.push_back(ld19_remainder(all));
  return all;
}

void Ld19Scanner::measure(double range_m, Picoseconds start) {
  const auto place = static_cast<std::size_t>(point_) % packet_.points.size();
  const auto angle_cdeg = static_cast<std::uint16_t>(next_angle_cdeg());
  if (place == 0) packet_.start_cdeg = angle_cdeg;
  constexpr std::uint8_t kIntensity = 200;
  const auto distance_mm = static_cast<std::uint16_t>(std::clamp(std::lround(1'000 * range_m), 0L, 65'535L));
  packet_.points[place] = {distance_mm, distance_mm > 0 ? kIntensity : std::uint8_t{0}};
  const Picoseconds measured = next_point();
  ++point_;
  if (place + 1 < packet_.points.size()) return;
  packet_.speed_degps = 360 * kTurns_per_s;
  packet_.end_cdeg = angle_cdeg;
  packet_.stamp_ms = static_cast<std::uint16_t>(measured / kMillisecond % 30'000);
  for (const std::uint8_t byte : packet_.bytes()) line_.push_back({start + measured, byte});
  ++packets_;
}

SensorWorld::GnssByte Ld19Scanner::next_byte(Picoseconds now) {
  if (line_.empty()) return {.again = now + kMillisecond / 2};
  const Waiting next = line_.front();
  line_.pop_front();
  return {.begin = std::max(next.ready, now), .byte = next.byte, .baud = kBaud};
}

}  // namespace tetap::board
