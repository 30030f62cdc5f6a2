// SPDX-License-Identifier: Apache-2.0
// A robot of config/ as host programs see it: its parameters, what its estimators take, and its node behind an
// interface. A program knows no robot when it is compiled; each robot is a module of its own (robots.hpp).
#pragma once

#include "sim_host/replay/protocol.hpp"
#include "sim_host/robot_firmware.hpp"
#include "tetap/param/parameters.hpp"
#include "tetap/sensor/vocabulary.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

namespace tetap::sim {

/// Samples that the estimators of a robot take and maps that they make, whatever its parameters.
struct EstimatorFacts {
  std::uint32_t sensors = 0;  ///< a bit for each sensor::Sensor of which one takes samples
  bool inertial = false;      ///< an inertial filter is among them
  bool needs_imu = false;     ///< one of them is nothing without an IMU
  bool imu = false;           ///< one of them takes such samples, as the next six
  bool sightings = false;     ///< landmarks
  bool magnetic = false;
  bool pressure = false;
  bool closures = false;
  bool images = false;  ///< a camera's
  bool scans = false;
  bool relatives = false;   ///< displacements between stamps
  bool heading = false;     ///< outside headings
  bool own_map = false;     ///< one of them makes its map
  bool given_map = false;   ///< a scanner's map is among its data: that of the laboratory
  bool nameless = false;    ///< needs no identities for its map
  bool parameters = false;  ///< its parameters can be changed over the bus

  /// Some of the robot's frames have identifiers of the map's block.
  [[nodiscard]] constexpr bool needs_map_ids() const { return own_map || images || scans || relatives || parameters; }
  /// Inputs that the robot takes of those behind the map's outputs.
  [[nodiscard]] constexpr MapInputs map_inputs() const {
    return {.closures = closures, .images = images, .scans = scans, .parameters = parameters, .relatives = relatives};
  }
};

/// One of a robot's estimators.
struct EstimatorInfo {
  sensor::EstimatorKind kind;
  std::size_t bytes;  ///< size of its state in the node, with that at the far end of the window
};

struct Robot {
  const char* name = "";
  const param::Parameters* parameters = nullptr;
  EstimatorFacts takes;
  std::span<const EstimatorInfo> estimators;
  std::unique_ptr<RobotFirmware> (*make_firmware)(HostBoard&, const param::Parameters&, const bus::Version&) = nullptr;
};

}  // namespace tetap::sim
