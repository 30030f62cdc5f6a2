// SPDX-License-Identifier: Apache-2.0
// A candump log: its data frames with their times, and how many lines were something else.
#pragma once

#include "sim_host/replay/result.hpp"
#include "tetap/base/can_frame.hpp"
#include "tetap/base/time.hpp"

#include <cstddef>
#include <cstdint>
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
  std::uint64_t not_data = 0;   ///< remote, error, CAN FD and CAN XL frames
  std::uint64_t xl = 0;         ///< CAN XL frames among these
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
  /// Fills in the next frame; false: no more, or a failure.
  virtual bool next(TimedFrame& frame) = 0;
  /// The next frame is the first one again.
  virtual void rewind() = 0;
  /// Why the frames end before the log does.
  [[nodiscard]] virtual const std::optional<Failure>& failure() const {
    static const std::optional<Failure> none;
    return none;
  }
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

/// The longest line of a log [bytes]: 4096 digits of CAN XL's data, and what stands before them. A longer one is no
/// log, whatever follows.
inline constexpr std::size_t kLongestLine = 4096 + 256;

/// Makes frames of lines and counts what is none.
class LogParser {
 public:
  LogParser(const std::string& name, const LogOptions& options) : options_(options) { report_.name = name; }

  /// The line's frame; nothing for a blank line and for what is counted instead. A malformed line is a failure,
  /// "name:line: reason: 'text'", unless set to keep going; a line that is too long always is one. `ended`: a newline
  /// follows. A last line without one is a frame where it is whole, else it is reported as cut off.
  Result<std::optional<TimedFrame>> add(std::string_view line, bool ended = true);
  [[nodiscard]] const LogReport& report() const { return report_; }

 private:
  [[nodiscard]] base::Micros since_start(base::Micros relative);

  LogOptions options_;
  LogReport report_;
  base::Micros latest_;
  base::Micros relative_, sum_;          ///< last time of a relative clock, and the sum of all
  std::uint64_t steps_ = 0, falls_ = 0;  ///< relative times, and those not above the one before
  bool differences_ = false;             ///< they are differences
  bool decimal_ = false;                 ///< an .asc with base dec
  std::uint64_t number_ = 0;             ///< number of the line
};

/// The text of a log in memory, read line by line.
class LogText : public Frames {
 public:
  /// The text outlives it.
  LogText(std::string_view text, const std::string& name, const LogOptions& options = {})
      : text_(text), left_(text), name_(name), options_(options), parser_(name, options) {}

  bool next(TimedFrame& frame) override;
  void rewind() override;
  [[nodiscard]] const std::optional<Failure>& failure() const override { return failure_; }
  /// Report of the lines read since the last rewind.
  [[nodiscard]] const LogReport& report() const { return parser_.report(); }

 private:
  std::string_view text_, left_;
  std::string name_;
  LogOptions options_;
  LogParser parser_;
  std::optional<Failure> failure_;
};

/// A log in memory.
struct Log : LogReport {
  std::vector<TimedFrame> frames;
  std::optional<Failure> failure;  ///< a malformed line, which ended the reading
};

[[nodiscard]] Log parse_log(std::string_view text, const std::string& name, const LogOptions& options = {});

}  // namespace tetap::sim
