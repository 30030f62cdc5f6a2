// SPDX-License-Identifier: Apache-2.0
// The wiring of an ARK CANnode: which pin goes where. Pins: ArduPilot hwdef/ARK_CANNODE and PX4 boards/ark/cannode,
// which agree.
#pragma once

#include "sim_host/board/chip.hpp"
#include "sim_host/board/icm42688.hpp"
#include "sim_host/board/sensor_world.hpp"

#include <cstdint>
#include <functional>
#include <string>

namespace tetap::board {

struct BoardOptions {
  Oscillators oscillators;
  Icm42688Options imu;
  bool imu_present = true;
};

class ArkCannode {
 public:
  explicit ArkCannode(const BoardOptions& options = {}, SensorWorld world = {});
  ArkCannode(const ArkCannode&) = delete;
  ArkCannode& operator=(const ArkCannode&) = delete;

  static constexpr Pin kImuSelect{'A', 4}, kImuReady{'B', 2}, kCanSilent{'C', 14}, kCanTerminator{'C', 15},
      kLedRed{'A', 8}, kLedGreen{'A', 9}, kLedBlue{'A', 10};

  Chip chip;
  Icm42688 imu;
  /// Text that USART2 sent (console, PA2).
  std::string console;
  /// Every byte that USART1 sent to the GNSS connector, world or not.
  std::string to_gnss;
  /// Connectors. Edges while the encoders' one is out are lost.
  void plug_encoders(bool in);
  void plug_gnss(bool in) { gnss_plugged_ = in; }

 private:
  using Edges = std::function<std::int64_t(Picoseconds)>;
  /// One encoder's lines.
  struct Shaft {
    Edges world;
    bool plugged = true;
    std::int64_t held = 0, lost = 0;
    [[nodiscard]] std::int64_t at(Picoseconds time) const { return plugged ? world(time) - lost : held; }
    void plug(bool in, Picoseconds time);
  };
  void poll_gnss();
  SensorWorld world_;
  Shaft left_, right_;
  Alarm gnss_;
  SensorWorld::GnssByte next_{};
  bool gnss_plugged_ = true;
};

}  // namespace tetap::board
