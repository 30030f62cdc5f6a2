// SPDX-License-Identifier: Apache-2.0
#include "sim_host/replay/script.hpp"

#include "sim_host/replay/protocol.hpp"

#include <algorithm>

namespace tetap::sim {

namespace {

constexpr base::Micros kLongestPause{60'000'000};

std::optional<bus::InSync> sync_of(const base::CanFrame& frame, std::uint32_t base) {
  if (offset_in_block(frame, base) != bus::InSync::kOffset) return std::nullopt;
  return bus::decode<bus::InSync>(bus::payload(frame));
}
bool tick_in(const std::optional<bus::InSync>& sync) {
  return sync && (sync->kind == bus::SyncKind::kTick || sync->kind == bus::SyncKind::kStep);
}

base::CanFrame moved(base::CanFrame frame, const ScriptOptions& options) {
  frame.id = frame.id - options.log_base + options.base;
  return frame;
}

}  // namespace

std::vector<TimedFrame> inputs_of(Frames& log, const ScriptOptions& options) {
  std::vector<TimedFrame> inputs;
  log.rewind();
  for (TimedFrame entry; log.next(entry);)
    if (is_counted_input(entry.frame, options.log_base, options.map_inputs))
      inputs.push_back({entry.time, moved(entry.frame, options)});
  return inputs;
}

bool is_tick(const base::CanFrame& frame, std::uint32_t log_base) { return tick_in(sync_of(frame, log_base)); }

std::optional<base::Micros> TickGrid::due_before(base::Micros time) {
  if (!next_) next_ = std::max(at_or_after(time), period_);
  const base::Micros tick = *next_;
  if (time <= tick) return std::nullopt;
  next_ = time - tick > kLongestPause ? at_or_after(time) : tick + period_;
  return tick;
}

void LogTicks::add_input(base::CanFrame frame) {
  inputs_.push_back(moved(frame, options_));
  ++count_;
}

bool LogTicks::next(Tick& tick) {
  inputs_.clear();
  const auto time = has_ticks_ ? own_tick() : grid_tick();
  if (!time) return false;
  tick = {.time = *time, .inputs = inputs_, .begin = {}};
  if (!begun_) tick.begin = *time - options_.period;
  begun_ = true;
  return true;
}

std::optional<base::Micros> LogTicks::own_tick() {
  for (TimedFrame entry; log_.next(entry);) {
    if (is_counted_input(entry.frame, options_.log_base, options_.map_inputs)) add_input(entry.frame);
    const auto sync = sync_of(entry.frame, options_.log_base);
    if (sync && sync->kind == bus::SyncKind::kBegin) own_last_ = base::Micros{static_cast<std::int64_t>(sync->time_us)};
    if (!tick_in(sync)) continue;
    own_last_ = own_last_ ? extend_bus_time(sync->time_us, *own_last_) : first_bus_time(sync->time_us, entry.time);
    return own_last_;
  }
  return std::nullopt;
}

std::optional<base::Micros> LogTicks::grid_tick() {
  for (;;) {
    for (TimedFrame entry; !ahead_ && log_.next(entry);)
      if (is_counted_input(entry.frame, options_.log_base, options_.map_inputs)) ahead_ = entry;
    if (!ahead_) return grid_.last();
    if (const auto due = grid_.due_before(ahead_->time)) return due;
    add_input(ahead_->frame);
    ahead_.reset();
  }
}

}  // namespace tetap::sim
