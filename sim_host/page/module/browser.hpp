// SPDX-License-Identifier: Apache-2.0
// The two functions that the module asks of the page around it: bytes of the log in, text out. web/engine.js has them.
#pragma once

#include "sim_host/replay/tables.hpp"

#include <cstdint>
#include <string_view>

extern "C" {
/// Bytes of the log from `offset` on into `to`, at most `length`; their number, 0 behind its end.
[[clang::import_module("tetap"), clang::import_name("read")]] std::uint32_t tetap_read(double offset, char* to,
                                                                                       std::uint32_t length);
[[clang::import_module("tetap"), clang::import_name("write")]] void tetap_write(std::uint32_t channel, const char* text,
                                                                                std::uint32_t length);
}

namespace tetap::page {

/// Where text goes: a table of a run (its number is sim::Table), or an object in JSON.
enum class Channel : std::uint8_t {
  kDescription = 16,  ///< robots, parameters, codes of the doctor, faults
  kRefusal,           ///< a sentence: why a value or a rule does not hold
  kBegun,             ///< beginning of a replay, before its tables
  kResult,            ///< result of a replay, behind its tables
  kDiagnosis,
  kFixes,   ///< a table: positions of GNSS receivers in the log
  kLog,     ///< node whose log it is
  kStage,   ///< stage of a play: robot, length, faults that act, landmarks
  kTruth,   ///< a table, in the frame of the node's map: cells are empty while that has no origin
  kFrames,  ///< lines of a log: all that is on the bus
  kPlayed,  ///< time of the play
  kInjected,
  kScript,    ///< a text that repeats the run, and its hash
  kColumns,   ///< columns of tables, with quantity and unit as far as their names show
  kImported,  ///< report of an import of tables
  kUpdates,   ///< updates of the node's filters
  kTalk,      ///< words between a node at a cable and its user
};

inline void write(std::uint32_t channel, std::string_view text) {
  tetap_write(channel, text.data(), static_cast<std::uint32_t>(text.size()));
}
inline void write(Channel channel, std::string_view text) { write(static_cast<std::uint32_t>(channel), text); }

}  // namespace tetap::page
