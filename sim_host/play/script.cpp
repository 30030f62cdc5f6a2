// SPDX-License-Identifier: Apache-2.0
#include "sim_host/play/script.hpp"

#include "sim_host/play/protocol.hpp"

#include <algorithm>

namespace tetap::sim {

namespace {

constexpr base::Micros kLongestPause{60'000'000};

std::optional<bus::InSync> sync_of(const base::CanFrame& frame, std::uint32_t base) {
  if (offset_in_block(frame, base) != bus::InSync::kOffset) return std::nullopt;
  return bus::decode<bus::InSync>(bus::payload(frame));
}
bool is_tick(const std::optional<bus::InSync>& sync) {
  return sync && (sync->kind == bus::SyncKind::kTick || sync->kind == bus::SyncKind::kStep);
}

base::CanFrame moved(base::CanFrame frame, const ScriptOptions& options) {
  frame.id = frame.id - options.log_base + options.base;
  return frame;
}

Script on_its_own_ticks(std::span<const TimedFrame> log, const ScriptOptions& options) {
  Script script;
  std::optional<base::Micros> last;  // as the bus has it: the log's own clock may be another one
  for (const TimedFrame& entry : log) {
    if (is_counted_input(entry.frame, options.log_base)) script.add_input(moved(entry.frame, options));
    const auto sync = sync_of(entry.frame, options.log_base);
    if (sync && sync->kind == bus::SyncKind::kBegin) last = base::Micros{static_cast<std::int64_t>(sync->time_us)};
    if (!is_tick(sync)) continue;
    last = extend_bus_time(sync->time_us, last.value_or(entry.time));
    script.add_tick(*last, script.ticks() == 0 ? std::optional(*last - options.period) : std::nullopt);
  }
  return script;
}

Script on_a_grid(std::span<const TimedFrame> log, const ScriptOptions& options) {
  Script script;
  const auto at_or_after = [&](base::Micros t) {
    return base::Micros{(t.us + options.period.us - 1) / options.period.us * options.period.us};
  };
  std::optional<base::Micros> tick;
  const auto add_tick = [&] {
    script.add_tick(*tick, script.ticks() == 0 ? std::optional(*tick - options.period) : std::nullopt);
  };
  for (const TimedFrame& entry : log) {
    if (!is_counted_input(entry.frame, options.log_base)) continue;
    if (!tick) tick = std::max(at_or_after(entry.time), options.period);
    while (*tick < entry.time) {
      add_tick();
      tick = entry.time - *tick > kLongestPause ? at_or_after(entry.time) : *tick + options.period;
    }
    script.add_input(moved(entry.frame, options));
  }
  if (tick) add_tick();
  return script;
}

}  // namespace

std::vector<TimedFrame> inputs_of(std::span<const TimedFrame> log, const ScriptOptions& options) {
  std::vector<TimedFrame> inputs;
  for (const TimedFrame& entry : log)
    if (is_counted_input(entry.frame, options.log_base)) inputs.push_back({entry.time, moved(entry.frame, options)});
  return inputs;
}

Script script_of(std::span<const TimedFrame> log, const ScriptOptions& options) {
  const bool has_ticks = std::any_of(log.begin(), log.end(),
                                     [&](const TimedFrame& e) { return is_tick(sync_of(e.frame, options.log_base)); });
  return has_ticks ? on_its_own_ticks(log, options) : on_a_grid(log, options);
}

}  // namespace tetap::sim
