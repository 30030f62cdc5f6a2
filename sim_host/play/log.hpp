// SPDX-License-Identifier: Apache-2.0
// A candump log: its data frames with their times, and how many lines were something else. A log of hours is read
// frame by frame and never held whole.
#pragma once

#include "tetap/base/can_frame.hpp"
#include "tetap/base/time.hpp"

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <span>
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
  std::uint32_t base = 0x300;  ///< id base of the node; its inputs have eight bytes
};

struct LogReport {
  std::string name;
  std::uint64_t data = 0;       ///< classic data frames
  std::uint64_t malformed = 0;  ///< lines, only with keep_going
  std::string first_malformed;  ///< "file:line: reason: 'text'"
  std::uint64_t not_data = 0;   ///< remote, error and CAN FD frames
  std::uint64_t other_interface = 0;
  std::uint64_t back_in_time = 0;  ///< frames earlier than the one before
  std::uint64_t wrong_length = 0;  ///< input frames that have not eight bytes: the node will count them as malformed
  std::string first_wrong_length;  ///< "file:line"
  std::uint64_t gaps = 0;          ///< pauses of more than a minute between frames
  std::string first_gap;           ///< "file:line"
  std::string cut_off;             ///< "file:line: reason: 'text'": the last line, which ends within a frame
};

/// Classic data frames in the order of a log, as often as asked for.
class Frames {
 public:
  Frames() = default;
  Frames(const Frames&) = delete;
  Frames& operator=(const Frames&) = delete;
  Frames(Frames&&) = default;
  Frames& operator=(Frames&&) = default;
  virtual ~Frames() = default;
  /// Fills in the next frame; false: no more.
  virtual bool next(TimedFrame& frame) = 0;
  /// The next frame is the first one again.
  virtual void rewind() = 0;
};

class FramesInMemory : public Frames {
 public:
  explicit FramesInMemory(std::span<const TimedFrame> frames) : frames_(frames) {}
  bool next(TimedFrame& frame) override {
    if (next_ == frames_.size()) return false;
    frame = frames_[next_++];
    return true;
  }
  void rewind() override { next_ = 0; }

 private:
  std::span<const TimedFrame> frames_;
  std::size_t next_ = 0;
};

/// Makes frames of lines and counts what is none.
class LogParser {
 public:
  LogParser(const std::string& name, const LogOptions& options) : options_(options) { report_.name = name; }

  /// The line's frame; nothing for a blank line and for what is counted instead. Throws
  /// std::runtime_error("name:line: reason: 'text'") for a malformed line unless set to keep going. `ended`: a newline
  /// follows. A last line without one is a frame where it is whole, else it is reported as cut off.
  std::optional<TimedFrame> add(std::string_view line, bool ended = true);
  [[nodiscard]] const LogReport& report() const { return report_; }

 private:
  LogOptions options_;
  LogReport report_;
  base::Micros latest_;
  std::uint64_t number_ = 0;  ///< number of the line
};

/// A log file, read in blocks. A source that cannot be read twice (a pipe) is copied into a temporary file first.
class LogFile : public Frames {
 public:
  /// Throws std::runtime_error when the file cannot be opened.
  LogFile(const std::string& path, const LogOptions& options);

  /// Throws as LogParser does, when the file cannot be read, and when a second reading does not give the frames of the
  /// first.
  bool next(TimedFrame& frame) override;
  void rewind() override;
  /// Report of the lines read up to now; after a second reading still that of the first.
  [[nodiscard]] const LogReport& report() const { return report_ ? *report_ : parser_.report(); }

 private:
  struct TextLine {
    std::string_view text;
    bool ended = true;  ///< by a newline
  };
  bool next_line(TextLine& line);
  bool read_block();
  [[noreturn]] void refuse(const std::string& reason) const;

  std::string path_;
  LogOptions options_;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
  LogParser parser_;
  std::optional<LogReport> report_;  ///< report of a reading to the end
  std::vector<char> block_;
  std::size_t begin_ = 0, end_ = 0;  ///< unread part of block_
  std::uint64_t bytes_ = 0;          ///< bytes of the file, read up to now
  std::uint64_t length_ = 0;         ///< length at the first reading: a log that grows meanwhile ends there
};

/// A log in memory.
struct Log : LogReport {
  std::vector<TimedFrame> frames;
};

/// Throws as LogParser does.
[[nodiscard]] Log parse_log(std::string_view text, const std::string& name, const LogOptions& options = {});

}  // namespace tetap::sim
