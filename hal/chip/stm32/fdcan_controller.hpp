// SPDX-License-Identifier: Apache-2.0
// Driver of FDCAN for classic frames. Frames leave in the order of send(): one ring, emptied by the transmit interrupt
// into the transmit FIFO of three (TFQM = 0). The receive interrupt stamps and copies; nothing else. RM0440 chapter "FD
// controller area network (FDCAN)"; sections at the places. Registers, Clock and Lock are template parameters, so that
// a model stands in on the host.
#pragma once

#include "hal/can_bus.hpp"
#include "hal/chip/stm32/can_state.hpp"
#include "hal/chip/stm32/fdcan_encoding.hpp"
#include "hal/chip/support/frame_ring.hpp"
#include "tetap/base/time.hpp"

#include <atomic>
#include <cstdint>
#include <optional>

namespace tetap::hal::stm32 {

namespace fdcan = stm32g474::fdcan;

struct FdcanConfig {
  CanBitTiming timing;
  Acceptance filter{};  ///< a mask of 0 passes every standard data frame
};

/// `Registers`: the controller, and the message RAM, which takes words only.
template <class Registers, class Clock, class Lock>
class FdcanController {
 public:
  static constexpr std::uint32_t kTransmitCapacity = 128;  ///< frames in the ring, on top of the three buffers
  static constexpr std::uint32_t kReceiveCapacity = 128;
  /// Time off the bus before the recovery: a fault that comes back at once must not keep the bus from everybody else.
  static constexpr base::Micros kBusOffHold{50'000};
  /// Time that joining the bus may take before it counts as a fault: more than the longest frame at 125 kbit/s.
  static constexpr base::Micros kJoinTime{10'000};

  constexpr FdcanController(Registers registers, Registers memory, const Clock& clock)
      : registers_{registers}, memory_{memory}, clock_{&clock} {}

  /// Sets the controller up and asks to join the bus; flush() sees when it has. A controller without a clock or a
  /// transceiver cannot hold the start.
  void start(const FdcanConfig& config) {
    state_ = CanState::kStopped;
    if (!begin_initialisation()) return void(++faults_.bus_off);
    registers_.write(fdcan::ckdiv::kOffset, 0);
    registers_.write(fdcan::nbtp::kOffset, nbtp(config.timing));
    registers_.write(fdcan::txbc::kOffset, 0);  // TFQM = 0: a FIFO, the frames' identifiers do not matter
    set_filter(config.filter);
    registers_.write(fdcan::txbtie::kOffset, kAllBuffers);
    registers_.write(fdcan::ils::kOffset, fdcan::ils::kSmsg.mask());  // transmission on line 1, FIFO 0 on line 0
    registers_.write(fdcan::ie::kOffset, fdcan::ie::kRf0ne.mask() | fdcan::ie::kTce.mask());
    registers_.write(fdcan::ile::kOffset, fdcan::ile::kEint0.mask() | fdcan::ile::kEint1.mask());
    join(CanState::kJoining);
  }

  [[nodiscard]] bool send(const base::CanFrame& frame) {
    base::CanFrame* const place = transmit_.vacant();
    if (place == nullptr) {
      if (state_ == CanState::kAway || state_ == CanState::kRecovering) give_up();
      ++faults_.tx_full;
      return false;
    }
    *place = frame;
    transmit_.publish();
    const std::uint32_t waiting = transmit_.size();
    if (waiting > faults_.tx_high) faults_.tx_high = waiting;
    return true;
  }

  void flush() {
    follow_bus();
    if (state_ != CanState::kOnBus || transmit_.size() == 0) return;
    const Lock lock;
    fill_buffers();
  }

  [[nodiscard]] std::optional<base::CanFrame> receive() {
    while (receive_.size() != 0) {  // ends with the ring: remote frames are passed over
      const auto frame = to_frame(receive_.oldest().element);
      arrived_ = receive_.oldest().time;
      receive_.drop_oldest();
      if (frame) return frame;
      ++unsupported_;
    }
    return std::nullopt;
  }

  /// Time at which the frame that receive() gave last had arrived.
  [[nodiscard]] base::Micros arrived() const { return arrived_; }
  /// For a board that is about to sleep.
  [[nodiscard]] bool has_received() const { return receive_.size() != 0; }

  [[nodiscard]] base::CanFaults faults() const {
    base::CanFaults all = faults_;
    all.rx_overflow += overruns_.load(std::memory_order_relaxed);
    return all;
  }
  [[nodiscard]] CanState state() const { return state_; }
  /// Nobody acknowledges, or the bus is disturbed: 128 errors and more. Frames are repeated for ever, without bus-off.
  [[nodiscard]] bool error_passive() const { return fdcan::psr::kEp.of(registers_.read(fdcan::psr::kOffset)) != 0; }
  [[nodiscard]] std::uint32_t rx_unsupported() const { return unsupported_; }  ///< remote frames, counted and dropped

  /// Interrupt line 1: a buffer became empty.
  void on_transmit_interrupt() {
    registers_.write(fdcan::ir::kOffset, fdcan::ir::kTc.mask());  // write 1 to clear
    if (state_ == CanState::kOnBus) fill_buffers();
  }

  /// Interrupt line 0: FIFO 0 holds a frame, and may have lost one. The flags are cleared before their cause is served:
  /// what comes later sets them again.
  void on_receive_interrupt() {
    const std::uint32_t flags = registers_.read(fdcan::ir::kOffset) & kReceiveFlags;
    registers_.write(fdcan::ir::kOffset, flags);
    if (fdcan::ir::kRf0l.of(flags) != 0) count_overrun();
    // The FIFO holds 3; a bus that never rests cannot keep the handler.
    for (std::uint32_t i = 0; i < 2 * message_ram::kReceiveElements; ++i) {
      const std::uint32_t fifo = registers_.read(fdcan::rxf0s::kOffset);
      if (fdcan::rxf0s::kF0fl.of(fifo) == 0) return;
      take(fdcan::rxf0s::kF0gi.of(fifo));
    }
  }

 private:
  /// The words as they were in the FIFO: the loop makes a frame of them.
  struct Arrival {
    FdcanElement element{};
    base::Micros time{};
  };

  static constexpr int kPatience = 1000;  ///< reads until a change of mode must have happened, a few clocks of the two
  static constexpr std::uint32_t kAllBuffers = (1U << message_ram::kTransmitElements) - 1;
  static constexpr std::uint32_t kReceiveFlags = fdcan::ir::kRf0n.mask() | fdcan::ir::kRf0l.mask();
  static constexpr std::uint32_t kInit = fdcan::cccr::kInit.mask();

  /// "Software initialization": INIT crosses into the other clock's domain, and CCE opens the configuration after it.
  [[nodiscard]] bool begin_initialisation() const {
    registers_.write(fdcan::cccr::kOffset, kInit);
    for (int i = 0; i < kPatience; ++i) {
      if ((registers_.read(fdcan::cccr::kOffset) & kInit) == 0) continue;
      registers_.write(fdcan::cccr::kOffset, kInit | fdcan::cccr::kCce.mask());
      return fdcan::cccr::kCce.of(registers_.read(fdcan::cccr::kOffset)) != 0;
    }
    return false;
  }

  /// "Acceptance filter": one standard filter; what it does not pass, extended and remote frames are rejected. The
  /// FIFO keeps its old frames when it is full (F0OM = 0).
  void set_filter(const Acceptance& filter) const {
    constexpr std::uint32_t kReject = 2;
    memory_.write(message_ram::kStandardFilters, fdcan_filter_word(filter));
    registers_.write(fdcan::rxgfc::kOffset, fdcan::rxgfc::kLss(1) | fdcan::rxgfc::kLse(0) |
                                                fdcan::rxgfc::kAnfs(kReject) | fdcan::rxgfc::kAnfe(kReject) |
                                                fdcan::rxgfc::kRrfs.mask() | fdcan::rxgfc::kRrfe.mask());
  }

  /// Retransmission as ISO 11898-1 has it (DAR = 0), classic frames alone (FDOE = 0).
  void join(CanState state) {
    registers_.write(fdcan::cccr::kOffset, 0);
    // Frames given up while INIT stood may still be pending: a controller that runs cancels them again.
    if (gave_up_) registers_.write(fdcan::txbcr::kOffset, kAllBuffers);
    gave_up_ = false;
    state_ = state;
    since_ = clock_->now();
    counted_ = false;
  }

  [[nodiscard]] bool joined() const {
    constexpr std::uint32_t kSynchronising = 0;
    return (registers_.read(fdcan::cccr::kOffset) & kInit) == 0 &&
           fdcan::psr::kAct.of(registers_.read(fdcan::psr::kOffset)) != kSynchronising;
  }

  /// Called at each poll: joins, leaves and comes back. "Bus_Off": the controller sets INIT and stays off until the
  /// program clears it, so a poll cannot miss it.
  void follow_bus() {
    if (state_ == CanState::kStopped) return;
    const bool off = fdcan::psr::kBo.of(registers_.read(fdcan::psr::kOffset)) != 0;
    switch (state_) {
      case CanState::kOnBus:
        if (!off) return;
        ++faults_.bus_off;
        since_ = clock_->now();
        state_ = CanState::kAway;
        return;
      case CanState::kAway:
        if (clock_->now() - since_ >= kBusOffHold) join(CanState::kRecovering);
        return;
      case CanState::kJoining:
      case CanState::kRecovering:
        if (!off && joined()) {
          state_ = CanState::kOnBus;
        } else if (state_ == CanState::kJoining && !counted_ && clock_->now() - since_ >= kJoinTime) {
          counted_ = true;
          ++faults_.bus_off;
        }
        return;
      case CanState::kStopped:
        return;
    }
  }

  /// Frames that waited for the bus have become old: they go, all of it, so that a log has one hole and then follows
  /// on.
  void give_up() {
    const Lock lock;
    registers_.write(fdcan::txbcr::kOffset, kAllBuffers);
    transmit_.clear();
    gave_up_ = true;
  }

  /// Under the lock or in the interrupt. TFFL falls with each request.
  void fill_buffers() {
    for (std::uint32_t i = 0; i < message_ram::kTransmitElements && transmit_.size() != 0; ++i) {
      const std::uint32_t queue = registers_.read(fdcan::txfqs::kOffset);
      if (fdcan::txfqs::kTffl.of(queue) == 0) return;
      const std::uint32_t index = fdcan::txfqs::kTfqpi.of(queue);
      const std::uint32_t at = message_ram::kTransmitBuffers + index * message_ram::kElementBytes;
      const FdcanElement element = to_element(transmit_.oldest());
      memory_.write(at + message_ram::kIdentifier, element.identifier);
      memory_.write(at + message_ram::kControl, element.control);
      memory_.write(at + message_ram::kData, element.low);
      memory_.write(at + message_ram::kData + 4, element.high);
      registers_.write(fdcan::txbar::kOffset, 1U << index);
      transmit_.drop_oldest();
    }
  }

  /// One frame out of FIFO 0 into the ring, or into nothing when the ring is full.
  void take(std::uint32_t index) {
    const std::uint32_t at = message_ram::kReceiveFifo0 + index * message_ram::kElementBytes;
    if (Arrival* const arrival = receive_.vacant()) {
      arrival->element.identifier = memory_.read(at + message_ram::kIdentifier);
      arrival->element.control = memory_.read(at + message_ram::kControl);
      arrival->element.low = memory_.read(at + message_ram::kData);
      arrival->element.high = memory_.read(at + message_ram::kData + 4);
      arrival->time = clock_->now();
      receive_.publish();
    } else {
      count_overrun();
    }
    registers_.write(fdcan::rxf0a::kOffset, index);
  }

  void count_overrun() { overruns_.store(overruns_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed); }

  Registers registers_;
  Registers memory_;
  const Clock* clock_;
  volatile CanState state_ = CanState::kStopped;  ///< the loop writes, the interrupt reads
  bool counted_ = false;                          ///< this wait for the bus is in the faults
  bool gave_up_ = false;                          ///< frames were given up since the controller joined last
  base::Micros since_{};                          ///< begin of the wait for the bus or of the hold after bus-off
  base::Micros arrived_{};
  base::CanFaults faults_{};                ///< counts of the loop; rx_overflow is overruns_
  std::atomic<std::uint32_t> overruns_{0};  ///< frames that FIFO 0 or the ring had no room for
  std::uint32_t unsupported_ = 0;
  FrameRing<base::CanFrame, kTransmitCapacity> transmit_{};  ///< taken by the interrupt, or by the loop under the lock
  FrameRing<Arrival, kReceiveCapacity> receive_{};
};

}  // namespace tetap::hal::stm32
