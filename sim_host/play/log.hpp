// SPDX-License-Identifier: Apache-2.0
// A candump log in memory: its data frames with their times, and how many lines were something else.
#pragma once

#include "base/can_frame.hpp"
#include "base/time.hpp"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace tetap::sim {

struct TimedFrame {
  base::Micros time;
  base::CanFrame frame;
};

struct LogOptions {
  std::string interface;       ///< only frames of this interface; empty: of all
  bool keep_going = false;     ///< count malformed lines instead of stopping at the first
  std::uint32_t base = 0x300;  ///< of the node; its inputs have eight bytes
};

struct Log {
  std::string name;
  std::vector<TimedFrame> frames;  ///< classic data frames in the order of the file
  std::uint64_t malformed = 0;     ///< lines, only with keep_going
  std::string first_malformed;     ///< "file:line: reason: 'text'"
  std::uint64_t not_data = 0;      ///< remote, error and CAN FD frames
  std::uint64_t other_interface = 0;
  std::uint64_t back_in_time = 0;  ///< frames earlier than the one before
  std::uint64_t wrong_length = 0;  ///< input frames that have not eight bytes: the node will count them as malformed
  std::string first_wrong_length;  ///< "file:line"
  std::uint64_t gaps = 0;          ///< of more than a minute between frames
  std::string first_gap;           ///< "file:line"
};

/// Throws std::runtime_error("name:line: reason: 'text'") at the first malformed line unless told to keep going. Blank
/// lines are skipped.
[[nodiscard]] Log parse_log(std::string_view text, const std::string& name, const LogOptions& options = {});

/// Reads the file; throws when it cannot be read or has no data frame.
[[nodiscard]] Log read_log(const std::string& path, const LogOptions& options = {});

}  // namespace tetap::sim
