// SPDX-License-Identifier: Apache-2.0
// Parts that lockstep and real-time playing share: sending without loss, and sync frames with their counter. Starting a
// node is shared, too (Begin until it answers with its version).
#pragma once

#include "hal/board/linux/clock.hpp"
#include "sim_host/replay/frame_accounting.hpp"
#include "sim_host/replay/line.hpp"
#include "sim_host/replay/link.hpp"
#include "sim_host/replay/result.hpp"
#include "sim_host/replay/snapshot.hpp"

#include <cstddef>
#include <optional>
#include <span>
#include <string>

namespace tetap::sim {

/// Why a run has to end at once; empty: it goes on.
using Interrupted = std::string (*)();

/// A run ends when it is asked to.
[[nodiscard]] inline Result<> not_interrupted(Interrupted interrupted, const Counts& counts) {
  const std::string why = interrupted != nullptr ? interrupted() : std::string();
  if (why.empty()) return {};
  return Failure{why + " after " + std::to_string(counts.epochs) + " epochs"};
}

struct Patience {
  base::Micros epoch{2'000'000};   ///< for the answer to a tick
  base::Micros begin{15'000'000};  ///< for the answer to Begin: a node may be booting
  base::Micros repeat{200'000};    ///< Begin is sent again after so long
};
/// An emulated core boots in its own time.
inline constexpr Patience kEmulatedPatience{.epoch = {20'000'000}, .begin = {120'000'000}, .repeat = {1'000'000}};

template <Link L, Sink K>
class NodeLink {
 public:
  NodeLink(L& link, K& sink, std::uint32_t base, Counts& counts, Interrupted interrupted = nullptr)
      : link_(link), sink_(sink), collector_(base), counts_(counts), interrupted_(interrupted), base_(base) {}

  /// Fails when the bus takes nothing for two seconds.
  Result<> send(const base::CanFrame& frame) {
    if (!link_.send(frame))
      if (auto sent = send_later(frame); !sent) return sent;
    sink_.sent(frame);
    return {};
  }
  Result<> sync(bus::SyncKind kind, base::Micros time) {
    const bus::InSync message = sync_message(kind, time, sync_counter_++);
    // A node takes its power-on state, and leaps in time, only at the request of a guarded frame.
    if (kind == bus::SyncKind::kBegin || kind == bus::SyncKind::kClock)
      if (auto sent = send(bus::frame(base_, bus::guard_of_sync(message))); !sent) return sent;
    return send(bus::frame(base_, message));
  }

  /// Takes every frame that is there; on_epoch(epoch) for each epoch that is complete.
  template <class OnEpoch>
  void drain(OnEpoch&& on_epoch) {
    while (const auto frame = link_.receive()) {
      sink_.received(*frame);
      if (const auto epoch = collector_.add(*frame)) on_epoch(*epoch);
    }
  }

  /// Sends Begin until the node answers; fails when it does not.
  Result<> begin(base::Micros time, const Patience& patience) {
    const base::Micros began = hal::monotonic_clock();
    for (base::Micros now = began; now - began < patience.begin; now = hal::monotonic_clock()) {
      if (auto sent = sync(bus::SyncKind::kBegin, time); !sent) return sent;
      ++counts_.syncs;
      while (hal::monotonic_clock() - now < patience.repeat) {
        if (auto on = not_interrupted(interrupted_, counts_); !on) return on;
        link_.wait({20'000});
        if (answered()) {
          collector_.reset();
          sink_.restarted();
          return {};
        }
      }
    }
    Line id;
    id.hex(base_, 3);
    return Failure{"no node with id base 0x" + std::string(id.view()) + " answers on this bus: sent Begin for " +
                   in_seconds(hal::monotonic_clock() - began)};
  }

  /// Hands the node a state to go on from; fails when it cannot take it.
  Result<> resume(const Snapshot& snapshot) {
    if constexpr (requires { link_.resume(std::span<const std::byte>(snapshot.state)); }) {
      if (link_.resume(snapshot.state)) return {};
      return Failure{"the snapshot in the log is of another robot or of a program with another layout: " +
                     std::to_string(snapshot.state.size()) + " bytes"};
    }
    return Failure{"the log begins with a snapshot, which only a node in this process takes up: --memory --robot NAME"};
  }

  [[nodiscard]] const EpochCollector& collector() const { return collector_; }

 private:
  Result<> send_later(const base::CanFrame& frame) {
    const base::Micros began = hal::monotonic_clock();
    do {
      if (auto on = not_interrupted(interrupted_, counts_); !on) return on;
      if (hal::monotonic_clock() - began > base::Micros{2'000'000})
        return Failure{"the bus takes no frames: is the interface up?"};
      link_.wait({1000});
    } while (!link_.send(frame));
    return {};
  }
  bool answered() {
    bool is = false;
    while (const auto frame = link_.receive()) {
      sink_.received(*frame);
      is = is || collector_.is_begin_response(*frame);
      static_cast<void>(collector_.add(*frame));
    }
    return is;
  }

  L& link_;
  K& sink_;
  EpochCollector collector_;
  Counts& counts_;
  Interrupted interrupted_;
  std::uint32_t base_;
  std::uint8_t sync_counter_ = 0;
};

}  // namespace tetap::sim
