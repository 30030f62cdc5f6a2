// SPDX-License-Identifier: Apache-2.0
// Parameters with which the node of a log began, where they are not as compiled: its board kept them, or the bus had
// changed them before. The log names them behind the begin (Est_Param); a replay makes them active before its own.
#pragma once

#include "sim_host/parameter_settings.hpp"
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

/// `PATH=VALUE` of each row that differs, with blanks between, as SET= takes them.
[[nodiscard]] std::string settings_between(const param::Parameters& from, const param::Parameters& to);

/// Makes `to` active on the node at the other end of the link, which is as `from`. Rows that need a restart wait for
/// the next begin. Fails where the node refuses, or gives no answer for two seconds.
[[nodiscard]] Result<> make_active(InProcessLink& link, const param::Parameters& from, const param::Parameters& to);

}  // namespace tetap::sim
