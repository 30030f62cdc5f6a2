// SPDX-License-Identifier: Apache-2.0
// A log that holds a node's own frames is the record of a run. From it follows what the node consumed before each tick
// (DESIGN.md 4.2), so the run can be played again exactly, and what it answered can be compared byte for byte.
#pragma once

#include "sim_host/play/protocol.hpp"
#include "sim_host/play/script.hpp"

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace tetap::sim {

struct RecordedEpoch {
  base::Micros time;
  std::size_t first = 0;  ///< of its frames in Recording::outputs
  std::size_t count = 0;
};

struct Recording {
  Script script;
  std::vector<base::CanFrame> outputs;  ///< the node's deterministic frames
  std::vector<RecordedEpoch> epochs;
  std::uint32_t base = 0;             ///< of the recorded node
  std::uint64_t skipped_epochs = 0;   ///< of a node that was running already and was restarted later in the log
  std::uint64_t missing_outputs = 0;  ///< frames the node said it sent and the log does not hold
  /// Where the inputs in the log first differ from what the node says it consumed (Est_Epoch.InCrc): a frame was lost
  /// between them.
  std::optional<base::Micros> inputs_differ_at;
  std::uint16_t rx_overflow = 0;        ///< frames that the recorded node's receiver lost, as it said last
  std::optional<std::uint32_t> config;  ///< hash of the numbers it ran with, as it said last
};

/// True if a node with this base speaks in the log.
[[nodiscard]] bool is_recording(std::span<const TimedFrame> log, std::uint32_t log_base);

/// Throws std::runtime_error when the run cannot be repeated: the node's start is not in the log, or epochs are
/// missing.
[[nodiscard]] Recording recording_of(const Log& log, const ScriptOptions& options);

/// A sink's part: holds each epoch against the recorded one.
class Comparison {
 public:
  Comparison(const Recording& recording, std::uint32_t base) : recording_(recording), base_(base) {}

  void epoch(const NodeEpoch& epoch, base::Micros time);

  [[nodiscard]] std::uint64_t compared() const { return compared_; }
  [[nodiscard]] std::uint64_t different() const { return different_; }
  [[nodiscard]] std::uint64_t missing() const { return recording_.epochs.size() - compared_; }
  [[nodiscard]] const std::string& first_difference() const { return first_difference_; }
  /// Whether this node says it runs with other numbers than the recorded one did.
  [[nodiscard]] bool other_numbers() const { return config_ && recording_.config && *config_ != *recording_.config; }

 private:
  const Recording& recording_;
  std::uint32_t base_;
  std::size_t next_ = 0;
  std::uint64_t compared_ = 0;
  std::uint64_t different_ = 0;
  std::string first_difference_;
  std::optional<std::uint32_t> config_;
};

}  // namespace tetap::sim
