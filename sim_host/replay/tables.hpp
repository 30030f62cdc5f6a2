// SPDX-License-Identifier: Apache-2.0
// A node's output as text. Frames that are the same in every run of the same input go to estimates.log (candump format,
// stamped with the epoch's time). Tables are estimates.csv, states.csv (output of an inertial or attitude estimator
// beyond a pose) and innovations.csv. Further tables are sensors.csv (statistics by sensor), status.csv and sources.csv
// (state and failed check of each source). Landmarks of the map that the node makes go to map.csv.
#pragma once

#include "sim_host/replay/line.hpp"
#include "sim_host/replay/protocol.hpp"
#include "sim_host/replay/sha256.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace tetap::sim {

enum class Table : std::uint8_t {
  kEstimatesLog,
  kEstimates,
  kStates,
  kInnovations,
  kSensors,
  kStatus,
  kSources,
  kMap,
  kKeyframes,
  kGraph
};
/// Names of their files, in the order of the codes.
inline constexpr std::array<std::string_view, 10> kTableNames{
    "estimates.log", "estimates.csv", "states.csv", "innovations.csv", "sensors.csv",
    "status.csv",    "sources.csv",   "map.csv",    "keyframes.csv",   "graph.csv"};

/// Takes whole lines.
class TableSink {
 public:
  TableSink() = default;
  TableSink(const TableSink&) = delete;
  TableSink& operator=(const TableSink&) = delete;
  virtual ~TableSink() = default;
  virtual void write(Table table, std::string_view lines) = 0;
};

/// Bits of a classic frame on the wire with worst-case stuffing and interframe space (ISO 11898-1; Davis et al.,
/// Real-Time Systems 35, 2007, eq. 1 and its extended form).
[[nodiscard]] constexpr std::uint64_t worst_case_bits(const base::CanFrame& frame) {
  const std::uint64_t data = 8U * frame.size, stuffed = (frame.extended ? 54U : 34U) + data;
  return stuffed + (stuffed - 1) / 4 + 13;
}

/// Decodes the frames of a node, epoch by epoch, and writes them as rows.
class Tables {
 public:
  struct Totals {
    std::uint64_t epochs = 0;
    std::uint64_t estimates = 0;        ///< Est<k>_Pos frames
    std::uint64_t frames_sent = 0;      ///< by us
    std::uint64_t frames_received = 0;  ///< anything on the bus
    std::uint64_t bits_sent = 0;
    std::uint64_t bits_received = 0;
    std::uint32_t state_crc = 0;               ///< the last
    base::Micros first, last;                  ///< epochs
    std::optional<bus::EstOriginFault> fault;  ///< the likeliest of all
    base::Micros fault_time;                   ///< first time that it was
    std::string estimates_sha256;              ///< in so_far(), and behind end()
  };

  /// `base`: first id of the node's block. Writes the heading of every table; the sink outlives it.
  Tables(std::uint32_t base, TableSink& sink);

  void restarted() { restarted_ = true; }
  void sent(const base::CanFrame& frame) {
    ++totals_.frames_sent;
    totals_.bits_sent += worst_case_bits(frame);
  }
  void received(const base::CanFrame& frame) {
    ++totals_.frames_received;
    totals_.bits_received += worst_case_bits(frame);
  }
  void epoch(const NodeEpoch& epoch, base::Micros time);
  /// With the hash of the estimates up to now.
  [[nodiscard]] Totals so_far() const {
    Totals totals = totals_;
    totals.estimates_sha256 = Sha256(estimates_).hex();
    return totals;
  }
  /// The same, kept in totals().
  const Totals& end() { return totals_ = so_far(); }
  [[nodiscard]] const Totals& totals() const { return totals_; }

 private:
  struct Instance {
    std::optional<bus::EstPos> position;
    std::optional<bus::EstMotion> motion;
    std::optional<bus::EstStdPose> deviation;
    std::optional<bus::EstStdMore> correlation;
  };
  /// A row of states.csv: cells that this epoch does not carry are empty.
  struct State {
    static constexpr std::size_t kColumns = 49;
    std::array<double, kColumns> values{};
    bool reported = false;
  };
  void frame(const base::CanFrame& frame);
  void estimate_row(std::size_t k, const Instance& instance);
  void state(State& state, std::uint32_t offset, std::span<const std::uint8_t> payload);
  void state_row(std::size_t k, const State& state);
  void landmark_row(const bus::EstLandmarkStd& std);
  void keyframe_row(const bus::EstKeyframePose& k);
  void graph_row(const bus::EstGraph& g);
  void sensor_row(const bus::EstSensorStat& statistics);
  void innovation_row(const bus::EstInnov& innovation);
  void status_row(const bus::EstStatus& status);
  void source_row(std::size_t k, std::string_view source, sensor::SourceState state, sensor::Check failed);
  void source_rows(std::size_t k, const bus::EstStateSources& sources);
  Line& row(base::Micros time);
  void write(Table table) { sink_.write(table, line_.view()); }

  std::uint32_t base_;
  TableSink& sink_;
  Sha256 estimates_;
  Line line_;
  std::array<Instance, bus::EstPos::kCount> instances_{};
  std::array<State, bus::EstPos::kCount> states_now_{};
  bus::EstDiagMapper mapper_;                 ///< last page about the map
  std::optional<bus::EstLandmark> landmark_;  ///< the last, until its sigmas come
  std::uint64_t number_ = 0;                  ///< number of the epoch
  std::uint8_t last_epoch_ = 0;
  bool restarted_ = true;
  base::Micros time_;
  Totals totals_;
};

}  // namespace tetap::sim
