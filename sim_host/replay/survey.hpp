// SPDX-License-Identifier: Apache-2.0
// One reading of a log before it is played: what each way of playing has to know, and whether the log is the record of
// a run.
#pragma once

#include "sim_host/replay/recording.hpp"
#include "sim_host/replay/script.hpp"

#include <cstdint>
#include <optional>
#include <string>

namespace tetap::sim {

enum class PlayMode : std::uint8_t { kAutomatic, kLockstep, kRealtime, kAsRecorded };

struct LogSurvey {
  bool has_ticks = false;        ///< Tick or Step frames
  bool has_node_frames = false;  ///< a node speaks in the log
  std::uint64_t inputs = 0;      ///< frames
  std::uint64_t ticks = 0;       ///< to be played, when it is no recording
  std::optional<Recording> recording;
  std::string refusal;  ///< why it is a recording that cannot be repeated

  /// A log with the node's own frames in it is a record to be repeated, where nothing else is asked for.
  [[nodiscard]] PlayMode settled(PlayMode asked) const {
    if (asked != PlayMode::kAutomatic) return asked;
    return has_node_frames ? PlayMode::kAsRecorded : PlayMode::kLockstep;
  }
};

/// Reads the whole log; `name` is what messages call it. Fails as the log does.
Result<LogSurvey> survey_of(Frames& log, const std::string& name, PlayMode mode, const ScriptOptions& options);

}  // namespace tetap::sim
