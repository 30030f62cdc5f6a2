// SPDX-License-Identifier: Apache-2.0
// One cell of the fault matrix: a fault in a situation, as a line of text names it, and what became of it.
#pragma once

#include "sim_host/matrix/clean_log.hpp"
#include "sim_host/matrix/frame_fault.hpp"
#include "sim_host/matrix/gates.hpp"
#include "sim_host/matrix/published.hpp"

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace tetap::sim {

/// "SITUATION SENSOR AXIS KIND SIZE". Kinds are those of frame_fault.hpp, a spike with its number of samples (spike2).
/// Sizes: 0.5g (gates), max (the largest that the frame carries), x0.1 (factor), s0.9 (seconds), or -.
struct CellRequest {
  std::string situation;
  FrameFault fault;  ///< without start and size
  std::string size;

  /// Throws std::runtime_error with the line.
  explicit CellRequest(const std::string& line);
};

/// Kind and usual duration of a fault whose sensor is known; a spike has its number of samples behind it (spike2).
/// Throws std::runtime_error.
void set_kind(FrameFault& fault, const std::string& kind);

/// Device whose fault it is, by its name in kFaultDevices.
[[nodiscard]] std::string device_of(const FrameFault& fault);

/// State of the robot and its devices when a fault begins.
struct CellFacts {
  Uncertainty uncertainty;
  Moving moving;
  std::map<std::string, double> period_s;  ///< sample period by device: imu wheels gnss gnss_velocity ...
  /// From the fault's begin to a device's first sample that a filter can use; none in the longest fault: not there.
  std::map<std::string, double> usable_after_s;
  bool wheels_turn = false;  ///< wheels or speeds that show a turn
  bool planar = false;
};

/// Facts from the frames after the fault's begin and from the clean run's first state with all its sigma.
[[nodiscard]] CellFacts facts_of(const CleanLog& log, std::size_t tick, const PublishedState& clean,
                                 const BusDatabase& dbc);

[[nodiscard]] FrameGeometry geometry_of(const CleanLog& log);

/// The request's fault at its full size: gates and the largest value are worked out. `gate`: see gate_of().
[[nodiscard]] FrameFault sized(const CellRequest& request, const CleanLog& log, std::size_t tick,
                               const CellFacts& facts, const BusDatabase& dbc, double& gate);

struct CellResult {
  std::array<Figures, kQuantities> figures;
  /// Floor of the cell: the oracle is not sent what the faulty device sends while the fault lasts.
  std::optional<std::array<Figures, kQuantities>> oracle;
  std::vector<std::pair<std::string, double>> said;  ///< word, and seconds after the fault's begin
  double at_s = 0;
  double largest = 0;  ///< change of a value, in the unit of the size
  double gate = 0;
  std::uint64_t changed = 0;  ///< frames
};

/// One row of JSON, with its newline.
[[nodiscard]] std::string row_of(const std::string& robot, std::uint64_t seed, const CellRequest& request,
                                 const FrameFault& fault, const CellFacts& facts, const CellResult& result);

}  // namespace tetap::sim
