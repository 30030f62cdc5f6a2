// SPDX-License-Identifier: Apache-2.0
// The player's end of a bus: a CAN controller that can also wait. SocketCan is one; a bus inside the process waits by
// letting the other side run.
#pragma once

#include "hal/board/linux/memory_can.hpp"
#include "hal/can_bus.hpp"
#include "sim_host/replay/protocol.hpp"

#include <concepts>
#include <cstddef>
#include <functional>
#include <span>
#include <utility>

namespace tetap::sim {

template <class L>
concept Link = hal::CanBus<L> && requires(L& link, base::Micros timeout) {
  /// Hands on what was sent, then waits until a frame may be there, at most so long.
  { link.wait(timeout) } -> std::same_as<void>;
};

/// The player's end of a bus in memory; `pump` lets the node poll once.
template <class Pump>
class MemoryLink {
 public:
  MemoryLink(hal::MemoryBus& bus, Pump pump) : can_(bus.player_end()), pump_(std::move(pump)) {}

  bool send(const base::CanFrame& frame) { return can_.send(frame); }
  std::optional<base::CanFrame> receive() { return can_.receive(); }
  void flush() {}
  [[nodiscard]] base::CanFaults faults() const {
    return {.rx_overflow = 0, .tx_full = 0, .bus_off = 0};
  }  // a full queue is waited for
  void wait(base::Micros) { pump_(); }

  /// How the node at the other end takes up a snapshot's state.
  using Resume = std::function<bool(std::span<const std::byte>)>;
  void on_resume(Resume resume) { resume_ = std::move(resume); }
  bool resume(std::span<const std::byte> state) { return resume_ && resume_(state); }

 private:
  hal::MemoryCan can_;
  Pump pump_;
  Resume resume_;
};

/// Observers: recorder, comparison, progress.
template <class K>
concept Sink = requires(K& sink, const base::CanFrame& frame, const NodeEpoch& epoch, base::Micros time) {
  { sink.restarted() } -> std::same_as<void>;         ///< the node begins at its power-on state
  { sink.sent(frame) } -> std::same_as<void>;         ///< by us
  { sink.received(frame) } -> std::same_as<void>;     ///< anything on the bus
  { sink.epoch(epoch, time) } -> std::same_as<void>;  ///< epoch of the node, at this time
};

}  // namespace tetap::sim
