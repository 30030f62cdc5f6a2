// SPDX-License-Identifier: Apache-2.0
#include "sim_host/play/script.hpp"

#include "sim_host/play/protocol.hpp"

#include <algorithm>

namespace tetap::sim {

namespace {

constexpr base::Micros kLongestPause{60'000'000};

std::optional<can::InSync> tick_of(const base::CanFrame& frame, std::uint32_t base) {
  if (offset_in_block(frame, base) != can::InSync::kOffset) return std::nullopt;
  const auto sync = can::decode<can::InSync>(can::payload(frame));
  if (!sync || (sync->kind != can::SyncKind::kTick && sync->kind != can::SyncKind::kStep)) return std::nullopt;
  return sync;
}

base::CanFrame moved(base::CanFrame frame, const ScriptOptions& options) {
  frame.id = frame.id - options.log_base + options.base;
  return frame;
}

Script on_its_own_ticks(std::span<const TimedFrame> log, const ScriptOptions& options) {
  Script script;
  for (const TimedFrame& entry : log) {
    if (is_counted_input(entry.frame, options.log_base)) script.add_input(moved(entry.frame, options));
    if (const auto tick = tick_of(entry.frame, options.log_base)) {
      const auto time = extend_bus_time(tick->time_us, entry.time);
      script.add_tick(time, script.ticks() == 0 ? std::optional(time - options.period) : std::nullopt);
    }
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
  const bool has_ticks = std::any_of(
      log.begin(), log.end(), [&](const TimedFrame& e) { return tick_of(e.frame, options.log_base).has_value(); });
  return has_ticks ? on_its_own_ticks(log, options) : on_a_grid(log, options);
}

}  // namespace tetap::sim
