// SPDX-License-Identifier: Apache-2.0
// The world behind the board's pins, as the models ask for it. Every question carries the board's time; times of one
// kind of question never decrease. An empty function: that sensor is not there.
#pragma once

#include "sim_host/emulator/virtual_time.hpp"

#include <array>
#include <cstdint>
#include <functional>

namespace tetap::board {

/// At the IMU, in the axes printed on the chip.
struct ImuTruth {
  std::array<double, 3> rate_radps{};
  std::array<double, 3> force_mps2{};  ///< specific force: +9.81 on the axis that points up at rest
  double temperature_c = 25;
  bool stuck = false;  ///< the chip repeats its last sample
};

struct SensorWorld {
  std::function<ImuTruth(Picoseconds time)> imu;
  /// Position of both wheels' shafts in edges of both lines, forward counts up (EncoderTimer::position).
  std::function<std::int64_t(Picoseconds time)> left_edges, right_edges;
  /// A byte of the GNSS receiver: when its start bit begins, and at what rate it is sent. Asked for once the byte
  /// before has been sent; `begin` = kNever: nothing for now, ask again at `again`.
  struct GnssByte {
    Picoseconds begin = kNever;
    std::uint8_t byte = 0;
    std::int64_t baud = 115'200;
    Picoseconds again = kNever;
  };
  std::function<GnssByte(Picoseconds time)> next_gnss_byte;
  /// A byte that the board sent to the receiver, with the rate it had on the line.
  std::function<void(Picoseconds time, std::uint8_t byte, std::int64_t baud)> to_gnss;
};

}  // namespace tetap::board
