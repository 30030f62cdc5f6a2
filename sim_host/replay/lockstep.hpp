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

/// A node in lockstep, tick by tick: ask() as far ahead of its answers as it can take.
template <Link L, Sink K>
class Lockstep {
 public:
  /// All of them outlive it.
  Lockstep(L& link, K& sink, const LockstepOptions& options, Counts& counts)
      : link_(link),
        sink_(sink),
        options_(options),
        counts_(counts),
        node_(link, sink, options.base, counts, options.interrupted),
        accounting_(counts) {}

  /// Sends the tick's frames and a Step. A tick with `begin` comes when nothing is in flight.
  Result<> ask(const Tick& tick) {
    if (tick.begin) {
      if (auto begun = node_.begin(*tick.begin, options_.patience); !begun) return begun;
      if (tick.snapshot != nullptr) {
        if (auto resumed = node_.resume(*tick.snapshot); !resumed) return resumed;
        accounting_.begin(tick.snapshot->header.in_count, tick.snapshot->header.epoch);
      } else {
        accounting_.begin();
      }
    }
    std::size_t sent = 0;
    for (const base::CanFrame& frame : tick.inputs) {
      if (auto taken = node_.send(frame); !taken) return taken;
      if (options_.burst == 0 || ++sent % options_.burst != 0) continue;
      link_.flush();
      hal::sleep_for(options_.burst_gap);
    }
    if (auto taken = node_.sync(bus::SyncKind::kStep, tick.time); !taken) return taken;
    accounting_.asked(tick.inputs.size(), tick.time);
    return {};
  }
  [[nodiscard]] std::size_t in_flight() const { return accounting_.in_flight(); }

  /// Hands on the epochs that are there, and waits once where there are none. Fails when none has come for too long.
  Result<> answers() {
    const std::uint64_t before = counts_.epochs;
    receive();
    if (counts_.epochs == before) {
      link_.wait({50'000});
      receive();
    }
    if (counts_.epochs != before) {
      quiet_since_ = kNever;
      return {};
    }
    const base::Micros now = hal::monotonic_clock();
    if (quiet_since_ == kNever) quiet_since_ = now;
    if (now - quiet_since_ < options_.patience.epoch) return {};
    const bool begun = node_.collector().head().has_value() || !node_.collector().idle();
    return Failure{"no answer to the tick at " + in_seconds(accounting_.oldest()) + " within " +
                   in_seconds(options_.patience.epoch) + ": " +
                   (begun ? "the epoch's last frame (Est_StateCrc) is missing, " +
                                std::to_string(node_.collector().received()) + " of its frames came"
                          : std::string("no frame of the epoch came")) +
                   "; " + std::to_string(counts_.epochs) + " epochs before it, " + std::to_string(counts_.lost()) +
                   " frames lost so far"};
  }

 private:
  static constexpr base::Micros kNever{-1};

  void receive() {
    node_.drain([&](const NodeEpoch& epoch) {
      if (const auto time = accounting_.answered(epoch)) sink_.epoch(epoch, *time);
    });
  }

  L& link_;
  K& sink_;
  const LockstepOptions& options_;
  Counts& counts_;
  NodeLink<L, K> node_;
  LockstepFrameAccounting accounting_;
  base::Micros quiet_since_ = kNever;
};

/// Fails when the node stops answering; `counts` then holds what was so far.
template <Link L, Source S, Sink K>
Result<> play_lockstep(L& link, S& source, K& sink, const LockstepOptions& options, Counts& counts) {
  Lockstep<L, K> node(link, sink, options, counts);
  Tick tick;
  bool more = source.next(tick);
  while (more || node.in_flight() > 0) {
    if (auto on = not_interrupted(options.interrupted, counts); !on) return on;
    if (node.in_flight() <= options.window / 2) {  // refill in groups: fewer wake-ups on both sides
      while (more && node.in_flight() < options.window && (!tick.begin || node.in_flight() == 0)) {
        if (auto asked = node.ask(tick); !asked) return asked;
        more = source.next(tick);
      }
      link.flush();
    }
    if (auto answered = node.answers(); !answered) return answered;
  }
  counts.overflows = link.faults().rx_overflow;
  return {};
}

}  // namespace tetap::sim
