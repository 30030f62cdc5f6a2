// SPDX-License-Identifier: Apache-2.0
// Lines of `candump -L`: "(seconds.micros) interface id#data", standard and extended ids, remote frames "#R", CAN FD
// "##<flags>data", CAN XL "###", optional direction " R" or " T". Format as in can-utils lib.c (parse_canframe,
// sprint_canframe). Also lines of `candump -t` ("interface id [length] bytes"; -t A with a date) and of Vector's .asc.
#pragma once

#include "sim_host/replay/line.hpp"
#include "tetap/base/can_frame.hpp"
#include "tetap/base/time.hpp"

#include <cstdint>
#include <optional>
#include <string_view>
#include <variant>

namespace tetap::sim {

struct LogLine {
  enum class Kind : std::uint8_t {
    kData,
    kRemote,
    kError,
    kFd,
    kXl,
    kHeading
  };  ///< kHeading: no frame, but of an .asc
  /// Begin of `time`: that of a calendar, or of the log. In the second case it may be a difference (candump -t d).
  enum class Clock : std::uint8_t { kCalendar, kRelative };

  base::Micros time;
  std::string_view interface;  ///< points into the text that was parsed
  Kind kind = Kind::kData;
  Clock clock = Clock::kCalendar;
  base::BasicCanFrame<64> frame;  ///< data frames have at most 8 bytes
  std::uint8_t fd_flags = 0;
  /// Form of the lines behind an .asc's line "base ...".
  struct Base {
    bool decimal = false;      ///< numbers are decimal, not hexadecimal
    bool differences = false;  ///< times count from the line before
  };
  std::optional<Base> base;

  /// For a data frame only.
  [[nodiscard]] base::CanFrame classic() const {
    base::CanFrame f{.id = frame.id, .extended = frame.extended, .size = frame.size};
    for (std::size_t i = 0; i < f.data.size(); ++i) f.data[i] = frame.data[i];
    return f;
  }
};

/// Why a line is no log line; the text lives for ever.
struct BadLine {
  std::string_view reason;
};

/// One line without its newline (a carriage return before it is allowed). No globals, no allocation: fit for a fuzzer.
/// `decimal`: after an .asc's line "base dec".
[[nodiscard]] std::variant<LogLine, BadLine> parse_log_line(std::string_view line, bool decimal = false);

/// Appends a data frame as one line, newline included.
void append_log_line(Line& out, base::Micros time, std::string_view interface, const base::CanFrame& frame);

}  // namespace tetap::sim
