// SPDX-License-Identifier: Apache-2.0
// Parameters with which the node of a log began, where they are not as compiled: its board kept them, or the bus had
// changed them before. The log names them behind the begin (Est_Param); a replay makes them active before its own.
#pragma once

#include "sim_host/replay/log.hpp"
#include "sim_host/replay/memory_node.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace tetap::sim {

struct KeptWord {
  std::uint16_t row = 0;  ///< index in the table
  std::uint8_t word = 0;
  std::uint32_t value = 0;
};

struct KeptWords {
  std::vector<KeptWord> words;
  std::uint32_t config = 0;  ///< CRC of the set that the node began with

  /// `compiled` with these words; rows of access stay.
  [[nodiscard]] param::Parameters over(param::Parameters compiled) const;
};

/// Nothing: the node began as compiled, or the log does not name its set. Reads the first minute of epochs, then
/// rewinds the log.
[[nodiscard]] std::optional<KeptWords> kept_words_of(Frames& log, std::uint32_t log_base);

/// Begin of a log whose node had other parameters than its robot is built with.
struct Begun {
  param::Parameters from, to;       ///< parameters of the node in this process, and those that repeat the log
  param::Parameters built, active;  ///< parameters of the robot, and those of the log's node
  bool exact = false;               ///< the log names all of them

  /// Behind the settings that the log names.
  [[nodiscard]] const char* rest() const { return exact ? "" : " and more, which the log does not name"; }
};

/// Nothing where the log's node began as its robot is built, or takes no parameters. `of_node` are those of the node
/// in this process; what they set over the robot's own stays.
[[nodiscard]] std::optional<Begun> begun_of(Frames& log, std::uint32_t log_base, const Robot& robot,
                                            const param::Parameters& of_node);

/// Makes `to` active on the node at the other end of the link, which is as `from`. Rows that need a restart wait for
/// the next begin. Fails where the node refuses, or gives no answer for two seconds.
[[nodiscard]] Result<> make_active(InProcessLink& link, const param::Parameters& from, const param::Parameters& to);

}  // namespace tetap::sim
