// SPDX-License-Identifier: Apache-2.0
// The simulated world behind the board's pins: rates and forces at the IMU, edges of the encoders, solutions for the
// receiver. Sensors that are not wired send frames, as on any bus. The board's time since power-on is that of the bus.
#pragma once

#include "sim_host/emulator/ld19_scanner.hpp"
#include "sim_host/emulator/sensor_world.hpp"
#include "sim_host/emulator/ublox_receiver.hpp"
#include "sim_host/world/world.hpp"
#include "tetap/base/random.hpp"
#include "tetap/param/parameters.hpp"

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

namespace tetap::board {

class SimulatedSensors {
 public:
  /// `world` starts at World::start() of the bus; until then the robot stands where it begins.
  SimulatedSensors(sim::World world, const param::Parameters& parameters, const UbloxOptions& options,
                   std::uint64_t seed);
  SimulatedSensors(const SimulatedSensors&) = delete;
  SimulatedSensors& operator=(const SimulatedSensors&) = delete;

  /// Packets of the LD19 on the receiver's line, which a robot with wired.lidar has where its world has walls.
  [[nodiscard]] std::uint32_t lidar_packets() const { return lidar_ ? lidar_->scanner.packets() : 0; }
  /// For a board; this object must live longer.
  [[nodiscard]] SensorWorld door();
  /// Measurements of sensors that are not wired, as they arrive by `now`.
  void take_unwired(Picoseconds now, std::vector<sim::Measurement>& arrived);
  /// Lets the world run to the end of what a judge compares.
  void advance(Picoseconds now);

  [[nodiscard]] const sim::World& world() const { return world_; }
  /// One row each 10 ms of the bus's time, from 0 on.
  [[nodiscard]] const std::vector<sim::Truth>& truth() const { return truth_; }
  /// A vector at the chip's axes by those of the robot's samples.
  [[nodiscard]] std::array<double, 3> from_chip(const std::array<double, 3>& v_c) const;
  /// Counts, fixes and scans of wired sensors as the world measures them, before they become edges and bytes.
  std::function<void(const sim::Measurement&)> on_wired;
  UbloxReceiver receiver;
  /// Edges that disturbance adds to the right encoder's count.
  std::int64_t extra_edges = 0;

 private:
  static constexpr std::int64_t kStep_us = 500, kTruth_us = 10'000;
  struct Step {
    Picoseconds end = 0;
    sim::Imu::Signals imu;
    std::array<double, 2> shafts{};
  };
  struct WiredScanner {
    param::LidarParameters mounting;
    base::Random noise;
    Ld19Scanner scanner;
  };
  void step();
  void turn_lidar(const sim::Truth& from, const sim::Truth& to);
  void sort(std::vector<sim::Measurement>& arrived);
  void solve(const sim::Measurement& measurement);
  [[nodiscard]] ImuTruth imu(Picoseconds now);
  [[nodiscard]] std::int64_t edges(Picoseconds now, std::size_t wheel);
  [[nodiscard]] std::array<double, 3> to_chip(const sim::Vector3& v_s) const;

  sim::World world_;
  param::WiredParameters wired_;
  std::array<Step, 4> steps_{};  ///< the newest is the last
  std::vector<sim::Truth> truth_;
  std::vector<sim::Measurement> arrived_, unwired_;
  GnssSolution solution_;
  base::Random vibration_;
  std::optional<WiredScanner> lidar_;
  Picoseconds last_imu_ = -1;
};

}  // namespace tetap::board
