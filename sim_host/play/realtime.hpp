// SPDX-License-Identifier: Apache-2.0
// Playing at the speed of the log: every frame at its time. The node ticks on Tick frames, or on its own timer after
// one Clock frame. With its own timer the node's output depends on real time. The record of such a run is what can be
// repeated (as_recorded).
#pragma once

#include "sim_host/replay/log.hpp"
#include "sim_host/replay/node_link.hpp"

#include <algorithm>
#include <span>

namespace tetap::sim {

enum class Sync : std::uint8_t { kTick, kClock };

struct RealtimeOptions {
  std::uint32_t base = 0x300;
  Sync sync = Sync::kTick;
  base::Micros period{10'000};
  bool begin = true;  ///< start the node with a Begin frame; else it is taken as it is
  Patience patience;
  Interrupted interrupted = nullptr;
};

/// Frames in the order of sending. Fails when the node does not answer.
template <Link L, Sink K>
Result<> play_realtime(L& link, std::span<const TimedFrame> frames, K& sink, const RealtimeOptions& options,
                       Counts& counts) {
  if (frames.empty()) return {};
  NodeLink<L, K> node(link, sink, options.base, counts, options.interrupted);
  RealtimeFrameAccounting accounting(counts);
  const base::Micros period = options.period;
  base::Micros tick{std::max((frames.front().time.us + period.us - 1) / period.us, std::int64_t{1}) * period.us};
  const base::Micros end = std::max(frames.back().time + period, tick);
  base::Micros last_answer = hal::monotonic_clock();
  const auto receive = [&](base::Micros reference) {
    node.drain([&](const NodeEpoch& epoch) {
      accounting.answered(epoch);
      last_answer = hal::monotonic_clock();
      sink.epoch(epoch, epoch.head ? extend_bus_time(epoch.head->time_us, reference) : reference);
    });
  };

  accounting.begin(options.begin);
  if (options.begin) {
    if (auto begun = node.begin(tick - period, options.patience); !begun) return begun;
  } else {
    while (!accounting.known()) {
      if (auto on = not_interrupted(options.interrupted, counts); !on) return on;
      if (hal::monotonic_clock() - last_answer > options.patience.begin)
        return Failure{"no node is ticking on this bus"};
      link.wait({20'000});
      receive(tick);
    }
  }

  const base::Micros began = hal::monotonic_clock();
  const base::Micros first = std::min(frames.front().time, tick) - period;
  const auto log_time = [&] { return first + (hal::monotonic_clock() - began); };
  if (options.sync == Sync::kClock) {
    if (auto taken = node.sync(bus::SyncKind::kClock, first); !taken) return taken;
    ++counts.syncs;
    link.flush();
  }
  last_answer = began;
  std::size_t next = 0;
  base::Micros quiet_end = end + base::Micros{std::max<std::int64_t>(period.us * 5, 1'000'000)};
  for (base::Micros now = log_time(); now < quiet_end; now = log_time()) {
    if (auto on = not_interrupted(options.interrupted, counts); !on) return on;
    for (bool due = true; due;) {
      const bool frame_due = next < frames.size() && frames[next].time <= now;
      const bool tick_due = options.sync == Sync::kTick && tick <= end && tick <= now;
      due = frame_due || tick_due;
      if (frame_due && (!tick_due || frames[next].time <= tick)) {
        if (auto taken = node.send(frames[next++].frame); !taken) return taken;
        ++counts.inputs;
      } else if (tick_due) {
        if (auto taken = node.sync(bus::SyncKind::kTick, tick); !taken) return taken;
        ++counts.syncs;
        tick += period;
      }
    }
    link.flush();
    receive(now);
    const bool all_sent = next == frames.size() && (options.sync == Sync::kClock || tick > end);
    if (all_sent && now > end + period && accounting.consumed() == counts.inputs) break;
    if (hal::monotonic_clock() - last_answer > options.patience.epoch + period)
      return Failure{"the node has not ticked for " + in_seconds(options.patience.epoch) + ", at " + in_seconds(now) +
                     " of the log"};
    base::Micros until{20'000};
    if (next < frames.size()) until = std::min(until, frames[next].time - log_time());
    if (options.sync == Sync::kTick && tick <= end) until = std::min(until, tick - log_time());
    if (until.us > 0) link.wait(until);
    receive(now);
  }
  accounting.close();
  counts.overflows = link.faults().rx_overflow;
  return {};
}

}  // namespace tetap::sim
