// SPDX-License-Identifier: Apache-2.0
// Playing as fast as the node can: for every tick its input frames and a Step, and up to `window` ticks ahead of the
// answers. Nothing is sent that the node has not promised to keep up with, so nothing is lost silently, whatever the
// speed.
#pragma once

#include "sim_host/replay/node_link.hpp"
#include "sim_host/replay/script.hpp"

namespace tetap::sim {

struct LockstepOptions {
  std::uint32_t base = 0x300;
  std::size_t window = 8;  ///< ticks in flight; 1 for a controller with few receive buffers
  std::size_t burst = 0;   ///< frames sent at once before `burst_gap`; 0: all
  base::Micros burst_gap{0};
  Patience patience;
  Interrupted interrupted = nullptr;
};

/// Fails when the node stops answering; `counts` then holds what was so far.
template <Link L, Source S, Sink K>
Result<> play_lockstep(L& link, S& source, K& sink, const LockstepOptions& options, Counts& counts) {
  NodeLink<L, K> node(link, sink, options.base, counts, options.interrupted);
  LockstepFrameAccounting accounting(counts);

  const auto send = [&](const Tick& tick) -> Result<> {
    if (tick.begin) {
      if (auto begun = node.begin(*tick.begin, options.patience); !begun) return begun;
      if (tick.snapshot != nullptr) {
        if (auto resumed = node.resume(*tick.snapshot); !resumed) return resumed;
        accounting.begin(tick.snapshot->header.in_count, tick.snapshot->header.epoch);
      } else {
        accounting.begin();
      }
    }
    std::size_t sent = 0;
    for (const base::CanFrame& frame : tick.inputs) {
      if (auto taken = node.send(frame); !taken) return taken;
      if (options.burst == 0 || ++sent % options.burst != 0) continue;
      link.flush();
      hal::sleep_for(options.burst_gap);
    }
    if (auto taken = node.sync(bus::SyncKind::kStep, tick.time); !taken) return taken;
    accounting.asked(tick.inputs.size(), tick.time);
    return {};
  };
  const auto receive = [&] {
    node.drain([&](const NodeEpoch& epoch) {
      if (const auto time = accounting.answered(epoch)) sink.epoch(epoch, *time);
    });
  };

  Tick tick;
  bool more = source.next(tick);
  constexpr base::Micros kNever{-1};
  base::Micros quiet_since = kNever;
  while (more || accounting.in_flight() > 0) {
    if (auto on = not_interrupted(options.interrupted, counts); !on) return on;
    if (accounting.in_flight() <= options.window / 2) {  // refill in groups: fewer wake-ups on both sides
      while (more && accounting.in_flight() < options.window && (!tick.begin || accounting.in_flight() == 0)) {
        if (auto sent = send(tick); !sent) return sent;
        more = source.next(tick);
      }
      link.flush();
    }
    const std::uint64_t before = counts.epochs;
    receive();
    if (counts.epochs == before) {
      link.wait({50'000});
      receive();
    }
    if (counts.epochs != before) {
      quiet_since = kNever;
      continue;
    }
    const base::Micros now = hal::monotonic_clock();
    if (quiet_since == kNever) quiet_since = now;
    if (now - quiet_since < options.patience.epoch) continue;
    const bool begun = node.collector().head().has_value() || !node.collector().idle();
    return Failure{"no answer to the tick at " + in_seconds(accounting.oldest()) + " within " +
                   in_seconds(options.patience.epoch) + ": " +
                   (begun ? "the epoch's last frame (Est_StateCrc) is missing, " +
                                std::to_string(node.collector().received()) + " of its frames came"
                          : std::string("no frame of the epoch came")) +
                   "; " + std::to_string(counts.epochs) + " epochs before it, " + std::to_string(counts.lost()) +
                   " frames lost so far"};
  }
  counts.overflows = link.faults().rx_overflow;
  return {};
}

}  // namespace tetap::sim
