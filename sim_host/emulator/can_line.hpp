// SPDX-License-Identifier: Apache-2.0
// A classic CAN bus as one controller sees it: other nodes' frames, arbitration, frame durations with stuff bits,
// acknowledgement, disturbances. ISO 11898-1 (arbitration, error signalling, fault confinement).
#pragma once

#include "sim_host/emulator/virtual_time.hpp"
#include "tetap/base/can_frame.hpp"

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>

namespace tetap::board {

/// Bits of a data or remote frame on the wire, stuff bits included, end of frame and 3 bits of intermission not.
[[nodiscard]] int frame_bits(const base::CanFrame& frame, bool remote);

/// Value that arbitration compares: the lower one wins. Standard before extended with the same first 11 bits.
[[nodiscard]] std::uint64_t arbitration_key(const base::CanFrame& frame, bool remote);

/// Relative difference to the bus's rate that a bit timing takes, all in time quanta. ISO 11898-1, oscillator
/// tolerance: df <= SJW / (20 NBT) and df <= min(PS1, PS2) / (2 (13 NBT - PS2)) for each of two nodes that differ in
/// opposite directions; the other nodes here are exact.
[[nodiscard]] double rate_tolerance_of(double segment1, double segment2, double jump);

struct CanOffer {
  base::CanFrame frame{};
  bool remote = false;
};

enum class CanError : std::uint8_t { kStuff = 1, kForm = 2, kAck = 3, kBitRecessive = 4, kBitDominant = 5, kCrc = 6 };

/// The controller's side of the bus.
class CanController {
 public:
  virtual ~CanController() = default;
  /// Takes part in the bus: not in initialisation, not in bus-off.
  [[nodiscard]] virtual bool on_bus() const = 0;
  /// Frame that it wants to send now.
  [[nodiscard]] virtual std::optional<CanOffer> offer() = 0;
  virtual void sent() = 0;
  virtual void lost_arbitration() = 0;
  virtual void failed(CanError error) = 0;
  virtual void received(const CanOffer& frame) = 0;
  virtual void receive_error(CanError error) = 0;
  [[nodiscard]] virtual std::int64_t bit_rate() const = 0;
  /// Largest relative difference to the bus's rate that its bit timing allows.
  [[nodiscard]] virtual double rate_tolerance() const = 0;
  [[nodiscard]] virtual bool error_passive() const = 0;
  /// The receive pin, which was held dominant, follows the bus again.
  virtual void released() = 0;
};

class CanLine {
 public:
  CanLine(Scheduler& scheduler, CanController& controller);

  /// Another node wants to send `frame` from time `at` on; frames of other nodes compete by their ids.
  void send(const base::CanFrame& frame, Picoseconds at);
  /// The controller has something to send, or has come on the bus.
  void poke();

  bool partner = true;                   ///< another node acknowledges
  std::int64_t bit_rate = 500'000;       ///< rate of the other nodes
  bool stuck_dominant = false;           ///< the receive pin stays low: transceiver without supply; release() ends it
  std::function<bool()> transceiver_on;  ///< empty: always on
  void release();
  /// Every frame is destroyed until then (a short circuit, a node with another bit rate).
  void disturb(Picoseconds until) { disturbed_until_ = until; }
  [[nodiscard]] bool disturbed() const { return scheduler_.now() < disturbed_until_; }
  [[nodiscard]] Picoseconds disturbed_until() const { return disturbed_until_; }
  [[nodiscard]] bool busy() const { return end_.pending(); }

  /// Frames that came through, at the end of each.
  std::function<void(Picoseconds time, const CanOffer& frame, bool own)> on_frame;
  std::uint64_t destroyed = 0;  ///< frames of other nodes that did not come through

 private:
  struct Foreign {
    CanOffer frame;
    Picoseconds at;
  };
  void arbitrate();
  void finish();
  void finish_own();
  void finish_foreign();
  [[nodiscard]] bool rates_match() const;
  [[nodiscard]] std::deque<Foreign>::iterator best_foreign();
  void pause(int bits);

  Scheduler& scheduler_;
  CanController& controller_;
  Alarm end_, start_;
  std::deque<Foreign> foreign_;
  CanOffer current_{};
  bool own_ = false;
  Picoseconds free_at_ = 0, disturbed_until_ = 0;
};

}  // namespace tetap::board
