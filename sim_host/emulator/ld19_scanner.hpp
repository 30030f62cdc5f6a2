// SPDX-License-Identifier: Apache-2.0
// A scanner LD19 as its serial line shows it: packets of 12 points, sent unasked from power-on. LDROBOT, LD19
// development manual V2.3, secs. 3 and 4. The scanner turns clockwise, seen from above.
#pragma once

#include "sim_host/emulator/sensor_world.hpp"

#include <array>
#include <cstdint>
#include <deque>
#include <span>
#include <vector>

namespace tetap::board {

/// Values of a packet as the manual's table has them.
struct Ld19Packet {
  struct Point {
    std::uint16_t distance_mm = 0;  ///< 0: no return
    std::uint8_t intensity = 0;
  };
  std::uint16_t speed_degps = 0;
  std::uint16_t start_cdeg = 0, end_cdeg = 0;  ///< angles of the first and the last point
  std::array<Point, 12> points{};
  std::uint16_t stamp_ms = 0;  ///< below 30 000

  [[nodiscard]] std::vector<std::uint8_t> bytes() const;
};

/// Remainder of the message, eight zero bits behind it, divided by x^8 + x^6 + x^3 + x^2 + 1.
[[nodiscard]] std::uint8_t ld19_remainder(std::span<const std::uint8_t> message);

class Ld19Scanner {
 public:
  static constexpr std::int64_t kBaud = 230'400;
  static constexpr int kPoints_per_s = 4'500, kTurns_per_s = 10;

  /// When the next point is measured, after the scanner's start.
  [[nodiscard]] Picoseconds next_point() const { return periods(point_, kPoints_per_s); }
  /// Clockwise angle of the next point from the front [0.01 deg].
  [[nodiscard]] std::int64_t next_angle_cdeg() const { return (point_ * kStep_cdeg + kFirst_cdeg) % 36'000; }
  /// The next point; range [m], 0: no return. `start`: of the scanner. A packet goes out after its last point.
  void measure(double range_m, Picoseconds start);
  [[nodiscard]] SensorWorld::GnssByte next_byte(Picoseconds now);
  [[nodiscard]] std::uint32_t packets() const { return packets_; }

 private:
  static constexpr std::int64_t kStep_cdeg = std::int64_t{36'000} * kTurns_per_s / kPoints_per_s;
  static constexpr std::int64_t kFirst_cdeg = 12'345;  ///< where the head stands when the scanner starts

  struct Waiting {
    Picoseconds ready;
    std::uint8_t byte;
  };
  std::int64_t point_ = 0;
  Ld19Packet packet_{};
  std::deque<Waiting> line_;
  std::uint32_t packets_ = 0;
};

}  // namespace tetap::board
