// SPDX-License-Identifier: Apache-2.0
// What every board here carries: a chip, an IMU with its select line, two encoders, a connector for a GNSS receiver, a
// console, a CAN bus.
#pragma once

#include "sim_host/emulator/chip.hpp"
#include "sim_host/emulator/encoder_timer.hpp"
#include "sim_host/emulator/icm42688.hpp"
#include "sim_host/emulator/sensor_world.hpp"
#include "sim_host/emulator/usart.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

namespace tetap::board {

struct BoardOptions {
  Oscillators oscillators;
  Icm42688Options imu;
  bool imu_present = true;
};

class Board {
 public:
  virtual ~Board() = default;
  Board(const Board&) = delete;
  Board& operator=(const Board&) = delete;

 private:
  std::unique_ptr<Chip> owned_;

 public:
  Chip& processor;
  Icm42688 imu;
  /// Text that the console's port sent.
  std::string console;
  /// Every byte that went to the GNSS connector, world or not.
  std::string to_gnss;
  /// Connectors. Edges while the encoders' one is out are lost.
  void plug_encoders(bool in);
  void plug_gnss(bool in) { gnss_plugged_ = in; }

 protected:
  Board(std::unique_ptr<Chip> chip, const BoardOptions& options, SensorWorld world);
  void wire_console(Usart& port);
  void wire_gnss(Usart& port);
  void wire_encoders(EncoderTimer& left, EncoderTimer& right);

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
  Usart* gnss_port_ = nullptr;
  SensorWorld::GnssByte next_{};
  bool gnss_plugged_ = true;
};

}  // namespace tetap::board
