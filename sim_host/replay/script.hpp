// SPDX-License-Identifier: Apache-2.0
// Frames that a player sends: for every tick its input frames, then the tick. They are read from a log, from a
// simulated world, or from the record of another run.
#pragma once

#include "sim_host/replay/log.hpp"
#include "sim_host/replay/protocol.hpp"
#include "sim_host/replay/snapshot.hpp"
#include "tetap/base/can_frame.hpp"
#include "tetap/base/time.hpp"

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace tetap::sim {

/// One tick to be played. The span is valid until the source is asked again.
struct Tick {
  base::Micros time;
  std::span<const base::CanFrame> inputs;  ///< sent before the tick, ids of the node that is played to
  std::optional<base::Micros> begin;       ///< before all: the node starts as after power-on, at this time
  const Snapshot* snapshot = nullptr;      ///< behind `begin`: the node takes up this state
};

template <class S>
concept Source = requires(S& source, Tick& tick) {
  /// Fills in the next tick; false: no more.
  { source.next(tick) } -> std::same_as<bool>;
};

/// A source that is all in memory.
class Script {
 public:
  void add_input(const base::CanFrame& frame) { inputs_.push_back(frame); }
  /// A tick after the inputs added so far.
  void add_tick(base::Micros time, std::optional<base::Micros> begin = std::nullopt) {
    ticks_.push_back({time, begin, inputs_.size()});
  }

  bool next(Tick& tick) {
    if (next_ == ticks_.size()) return false;
    const std::size_t first = next_ == 0 ? 0 : ticks_[next_ - 1].end;
    const Entry& entry = ticks_[next_++];
    tick = {.time = entry.time, .inputs = std::span(inputs_).subspan(first, entry.end - first), .begin = entry.begin};
    return true;
  }
  void rewind() { next_ = 0; }

  [[nodiscard]] std::size_t ticks() const { return ticks_.size(); }
  [[nodiscard]] std::size_t inputs() const { return inputs_.size(); }
  [[nodiscard]] base::Micros first() const { return ticks_.empty() ? base::Micros{} : ticks_.front().time; }
  [[nodiscard]] base::Micros last() const { return ticks_.empty() ? base::Micros{} : ticks_.back().time; }

 private:
  struct Entry {
    base::Micros time;
    std::optional<base::Micros> begin;
    std::size_t end;  ///< end of its inputs
  };
  std::vector<base::CanFrame> inputs_;
  std::vector<Entry> ticks_;
  std::size_t next_ = 0;
};

static_assert(Source<Script>);

struct ScriptOptions {
  std::uint32_t base = 0x300;      ///< id base of the node that is played to
  std::uint32_t log_base = 0x300;  ///< id base of the log
  MapInputs map_inputs;            ///< those of the robot
  base::Micros period{10'000};
};

/// The log's input frames with the ids of the node, sync frames left out.
[[nodiscard]] std::vector<TimedFrame> inputs_of(Frames& log, const ScriptOptions& options);

/// A frame that sets when the node ticks.
[[nodiscard]] bool is_tick(const base::CanFrame& frame, std::uint32_t log_base);

/// Whole periods from the first input frame on. A frame belongs to the first tick at or after its time; a frame earlier
/// than its predecessor belongs to that one's tick. A pause of more than a minute is skipped, so the node sees time
/// jump.
class TickGrid {
 public:
  explicit TickGrid(base::Micros period) : period_(period) {}

  /// The tick that is due before an input of this time; asked until there is none.
  std::optional<base::Micros> due_before(base::Micros time);
  /// The tick behind the last input, once.
  std::optional<base::Micros> last() { return std::exchange(next_, std::nullopt); }

 private:
  [[nodiscard]] base::Micros at_or_after(base::Micros t) const {
    return base::Micros{(t.us + period_.us - 1) / period_.us * period_.us};
  }
  base::Micros period_;
  std::optional<base::Micros> next_;
};

/// Ticks of a log without a node, read as they are played. When there are Tick or Step frames in the log, those are the
/// ticks; else it is TickGrid.
class LogTicks {
 public:
  LogTicks(Frames& log, const ScriptOptions& options, bool has_ticks)
      : log_(log), options_(options), has_ticks_(has_ticks), grid_(options.period) {
    log_.rewind();
  }

  bool next(Tick& tick);
  /// Read so far.
  [[nodiscard]] std::size_t inputs() const { return count_; }

 private:
  [[nodiscard]] std::optional<base::Micros> own_tick();
  [[nodiscard]] std::optional<base::Micros> grid_tick();
  void add_input(base::CanFrame frame);

  Frames& log_;
  ScriptOptions options_;
  bool has_ticks_;
  TickGrid grid_;
  std::vector<base::CanFrame> inputs_;    ///< inputs of the tick that is under way
  std::optional<TimedFrame> ahead_;       ///< an input of a later tick
  std::optional<base::Micros> own_last_;  ///< time of the bus: the log's own clock may be another one
  bool begun_ = false;
  std::size_t count_ = 0;
};

static_assert(Source<LogTicks>);

}  // namespace tetap::sim
