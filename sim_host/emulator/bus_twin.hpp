// SPDX-License-Identifier: Apache-2.0
// The board's sensors as nodes of the bus would send them: the same world and the same noise, without the chip's
// machine code, drivers, clocks and lines. A node that gets these frames is the board's fair judge.
#pragma once

#include "sim_host/emulator/board.hpp"
#include "sim_host/emulator/simulated_sensors.hpp"
#include "sim_host/replay/script.hpp"
#include "tetap/param/parameters.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace tetap::board {

class BusTwin {
 public:
  /// All three must live longer. The first tick is 10 ms after the world's start.
  BusTwin(Board& node, SimulatedSensors& sensors, const param::Parameters& parameters);

  /// Frames of nodes that are not the board: they arrive here, too.
  void take(std::span<const base::CanFrame> frames) { waiting_.insert(waiting_.end(), frames.begin(), frames.end()); }

  [[nodiscard]] sim::Script& script() { return script_; }
  /// Index of the row of SimulatedSensors::truth() that belongs to the first tick.
  [[nodiscard]] std::size_t first_row() const {
    return static_cast<std::size_t>(sensors_.world().start().us / kTick_us) + 1;
  }

 private:
  static constexpr std::int64_t kTick_us = 10'000;

  void integrate(const Icm42688::Reading& reading);
  void send_imu();
  void tick();

  SimulatedSensors& sensors_;
  const param::Parameters& parameters_;
  Alarm tick_;
  sim::Script script_;
  std::int64_t next_tick_us_;
  std::vector<base::CanFrame> waiting_;
  std::vector<sim::Measurement> measured_;  ///< counts and fixes of wired sensors, in the order of the world
  std::array<double, 3> angle_rad_{}, velocity_mps_{};
  Picoseconds last_reading_ = kNever;
  std::int64_t stamp_us_ = -1;  ///< stamp of the last IMU sample; -1: none yet
  Picoseconds delay_ = 0;
  float temperature_degC_ = 0;
  std::uint8_t imu_sequence_ = 0;
};

}  // namespace tetap::board
