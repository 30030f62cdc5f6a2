// SPDX-License-Identifier: Apache-2.0
// A candump log on disk. A log of hours is read frame by frame and never held whole.
#pragma once

#include "sim_host/replay/line_blocks.hpp"
#include "sim_host/replay/log.hpp"

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>

namespace tetap::sim {

/// A log file, read in blocks. A source that cannot be read twice (a pipe) is copied into a temporary file first.
class LogFile : public Frames {
 public:
  /// Throws std::runtime_error when the file cannot be opened.
  LogFile(const std::string& path, const LogOptions& options);

  /// Throws std::runtime_error for a malformed line, when the file cannot be read, and when a second reading does not
  /// give the frames of the first.
  bool next(TimedFrame& frame) override;
  void rewind() override;
  /// Report of the lines read up to now; after a second reading still that of the first.
  [[nodiscard]] const LogReport& report() const { return report_ ? *report_ : parser_.report(); }

 private:
  /// Bytes of the file, at most `size`; 0 at its end.
  std::size_t read(char* to, std::size_t size);
  [[noreturn]] void refuse(const std::string& reason) const;

  std::string path_;
  LogOptions options_;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
  LogParser parser_;
  std::optional<LogReport> report_;  ///< report of a reading to the end
  LineBlocks lines_;
  std::uint64_t bytes_ = 0;   ///< bytes of the file, read up to now
  std::uint64_t length_ = 0;  ///< length at the first reading: a log that grows meanwhile ends there
};

}  // namespace tetap::sim
