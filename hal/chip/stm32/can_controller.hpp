// SPDX-License-Identifier: Apache-2.0
// Driver of bxCAN. Frames leave in the order of send(): one ring, emptied into the three mailboxes by the transmit
// interrupt, and TXFP makes the mailboxes chronological. The receive interrupt stamps and copies; nothing else. RM0402
// chapter "Controller area network (bxCAN)"; sections at the places. Registers, Clock and Lock are template parameters,
// so that a model stands in on the host.
#pragma once

#include "hal/can_bus.hpp"
#include "hal/chip/stm32/can_encoding.hpp"
#include "hal/chip/stm32/can_state.hpp"
#include "hal/chip/stm32/can_timing.hpp"
#include "tetap/base/time.hpp"

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace tetap::hal::stm32 {

namespace can_register = stm32f412::can;

struct CanConfig {
  CanBitTiming timing;
  CanFilter filter{};  ///< a mask of 0 passes every data frame of its kind
};

template <class Registers, class Clock, class Lock>
class CanController {
 public:
  static constexpr std::uint32_t kTransmitCapacity = 128;  ///< frames in the ring, on top of the three mailboxes
  static constexpr std::uint32_t kReceiveCapacity = 128;
  /// Time off the bus before the recovery: a fault that comes back at once must not keep the bus from everybody else.
  static constexpr base::Micros kBusOffHold{50'000};
  /// Time that joining the bus may take before it counts as a fault: more than the longest frame at 125 kbit/s.
  static constexpr base::Micros kJoinTime{10'000};

  constexpr CanController(Registers registers, const Clock& clock) : registers_{registers}, clock_{&clock} {}

  /// Sets the controller up and asks to join the bus; flush() sees when it has. A controller without a clock or a
  /// transceiver cannot hold the start.
  void start(const CanConfig& config) {
    config_ = config;
    state_ = CanState::kStopped;
    // "Initialization mode": from sleep, where a reset leaves the controller.
    registers_.write(can_register::mcr::kOffset, kMode | can_register::mcr::kInrq.mask());
    if (!follows(true)) return void(++faults_.bus_off);
    registers_.write(can_register::btr::kOffset, config_.timing.btr());
    set_filter();
    registers_.write(can_register::ier::kOffset, can_register::ier::kTmeie.mask() | can_register::ier::kFmpie0.mask() |
                                                     can_register::ier::kFovie0.mask());
    join(CanState::kJoining);
  }

  [[nodiscard]] bool send(const base::CanFrame& frame) {
    const std::uint32_t waiting = sent_.load(std::memory_order_relaxed) - taken_.load(std::memory_order_acquire);
    if (waiting == kTransmitCapacity) {
      if (state_ == CanState::kAway || state_ == CanState::kRecovering) give_up();
      ++faults_.tx_full;
      return false;
    }
    transmit_[sent_.load(std::memory_order_relaxed) % kTransmitCapacity] = frame;
    sent_.store(sent_.load(std::memory_order_relaxed) + 1, std::memory_order_release);
    if (waiting + 1 > faults_.tx_high) faults_.tx_high = waiting + 1;
    return true;
  }

  void flush() {
    follow_bus();
    if (state_ != CanState::kOnBus || sent_.load(std::memory_order_relaxed) == taken_.load(std::memory_order_relaxed))
      return;
    const Lock lock;
    fill_mailboxes();
  }

  [[nodiscard]] std::optional<base::CanFrame> receive() {
    for (;;) {  // ends with the ring: remote frames are passed over
      const std::uint32_t next = read_.load(std::memory_order_relaxed);
      if (next == received_.load(std::memory_order_acquire)) return std::nullopt;
      const Arrival arrival = receive_[next % kReceiveCapacity];
      read_.store(next + 1, std::memory_order_release);
      const auto frame = to_frame(arrival.words);
      arrived_ = arrival.time;
      if (frame) return frame;
      ++unsupported_;
    }
  }

  /// Time at which the frame that receive() gave last had arrived.
  [[nodiscard]] base::Micros arrived() const { return arrived_; }
  /// For a board that is about to sleep.
  [[nodiscard]] bool has_received() const {
    return read_.load(std::memory_order_relaxed) != received_.load(std::memory_order_acquire);
  }

  [[nodiscard]] base::CanFaults faults() const {
    base::CanFaults all = faults_;
    all.rx_overflow += overruns_.load(std::memory_order_relaxed);
    return all;
  }
  [[nodiscard]] CanState state() const { return state_; }
  /// Nobody acknowledges, or the bus is disturbed: 128 errors and more. RM0402, "CAN error status register (CAN_ESR)".
  [[nodiscard]] bool error_passive() const {
    return can_register::esr::kEpvf.of(registers_.read(can_register::esr::kOffset)) != 0;
  }
  [[nodiscard]] std::uint32_t rx_unsupported() const { return unsupported_; }  ///< remote frames, counted and dropped

  /// "Transmission handling": a mailbox became empty.
  void on_transmit_interrupt() {
    registers_.write(can_register::tsr::kOffset,
                     registers_.read(can_register::tsr::kOffset) & kCompleted);  // write 1 to clear
    if (state_ == CanState::kOnBus) fill_mailboxes();
  }

  /// "Reception handling": FIFO 0 holds a frame, or lost one.
  void on_receive_interrupt() {
    // The FIFO holds 3; a bus that never rests cannot keep the handler.
    for (std::uint32_t i = 0; i < 2 * kFifoDepth; ++i) {
      const std::uint32_t fifo = registers_.read(can_register::rf0r::kOffset);
      if (can_register::rf0r::kFovr0.of(fifo) != 0) {
        registers_.write(can_register::rf0r::kOffset, can_register::rf0r::kFovr0.mask());
        count_overrun();
      }
      if (can_register::rf0r::kFmp0.of(fifo) == 0) return;
      take();
    }
  }

 private:
  /// The words as they were in the FIFO: the loop makes a frame of them.
  struct Arrival {
    CanMailbox words{};
    base::Micros time{};
  };

  static constexpr std::uint32_t kFifoDepth = 3;
  static constexpr std::uint32_t kMailboxes = can_register::tixr::kCount;
  static constexpr int kPatience = 1000;  ///< reads until a change of mode must have happened, a bit time or two
  /// Chronological mailboxes (TXFP); retransmission as ISO 11898-1 has it (NART = 0); no recovery from bus-off by the
  /// hardware (ABOM = 0), which would come back at once for ever.
  static constexpr std::uint32_t kMode = can_register::mcr::kTxfp.mask();
  static constexpr std::uint32_t kCompleted =
      can_register::tsr::kRqcp0.mask() | can_register::tsr::kRqcp1.mask() | can_register::tsr::kRqcp2.mask();
  static constexpr std::uint32_t kAbort =
      can_register::tsr::kAbrq0.mask() | can_register::tsr::kAbrq1.mask() | can_register::tsr::kAbrq2.mask();

  /// Waits, bounded, until the initialisation mode is on or off.
  [[nodiscard]] bool follows(bool initialisation) const {
    for (int i = 0; i < kPatience; ++i) {
      if ((can_register::msr::kInak.of(registers_.read(can_register::msr::kOffset)) != 0) == initialisation)
        return true;
    }
    return false;
  }

  /// "Filter initialization": bank 0 alone, one 32-bit mask, into FIFO 0.
  void set_filter() const {
    constexpr std::uint32_t kBank0 = 1;
    const std::uint32_t master = registers_.read(can_register::fmr::kOffset);
    registers_.write(can_register::fmr::kOffset, master | can_register::fmr::kFinit.mask());
    registers_.write(can_register::fa1r::kOffset, 0);
    registers_.write(can_register::fm1r::kOffset, 0);       // mask, not list
    registers_.write(can_register::fs1r::kOffset, kBank0);  // 32 bits
    registers_.write(can_register::ffa1r::kOffset, 0);
    registers_.write(can_register::fxr1::kOffset, config_.filter.identifier_word());
    registers_.write(can_register::fxr2::kOffset, config_.filter.mask_word());
    registers_.write(can_register::fa1r::kOffset, kBank0);
    registers_.write(can_register::fmr::kOffset, master & ~can_register::fmr::kFinit.mask());
  }

  void join(CanState state) {
    registers_.write(can_register::mcr::kOffset, kMode);
    state_ = state;
    since_ = clock_->now();
    counted_ = false;
  }

  /// Called at each poll: joins, leaves and comes back. Bus-off stays until the program asks for the recovery, so a
  /// poll cannot miss it.
  void follow_bus() {
    if (state_ == CanState::kStopped) return;
    const bool off = can_register::esr::kBoff.of(registers_.read(can_register::esr::kOffset)) != 0;
    switch (state_) {
      case CanState::kOnBus:
        if (!off) return;
        ++faults_.bus_off;
        registers_.write(can_register::mcr::kOffset, kMode | can_register::mcr::kInrq.mask());
        since_ = clock_->now();
        state_ = CanState::kAway;
        return;
      case CanState::kAway:
        // "Bus-off management": the recovery begins when the program leaves the initialisation mode.
        if (clock_->now() - since_ >= kBusOffHold) join(CanState::kRecovering);
        return;
      case CanState::kJoining:
      case CanState::kRecovering:
        if (!off && can_register::msr::kInak.of(registers_.read(can_register::msr::kOffset)) == 0) {
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
    registers_.write(can_register::tsr::kOffset, kAbort);
    taken_.store(sent_.load(std::memory_order_relaxed), std::memory_order_release);
  }

  /// Under the lock or in the interrupt.
  void fill_mailboxes() {
    constexpr std::uint32_t kEmpty = can_register::tsr::kTme0.mask();
    for (std::uint32_t box = 0; box < kMailboxes; ++box) {
      if ((registers_.read(can_register::tsr::kOffset) & kEmpty << box) == 0) continue;
      const std::uint32_t next = taken_.load(std::memory_order_relaxed);
      if (next == sent_.load(std::memory_order_acquire)) return;
      const CanMailbox words = to_mailbox(transmit_[next % kTransmitCapacity]);
      const std::uint32_t at = box * can_register::tixr::kStride;
      registers_.write(can_register::tdtxr::kOffset + at, words.length);
      registers_.write(can_register::tdlxr::kOffset + at, words.low);
      registers_.write(can_register::tdhxr::kOffset + at, words.high);
      registers_.write(can_register::tixr::kOffset + at, words.identifier | can_register::tixr::kTxrq.mask());
      taken_.store(next + 1, std::memory_order_release);
    }
  }

  /// One frame out of FIFO 0 into the ring, or into nothing when the ring is full.
  void take() {
    const std::uint32_t last = received_.load(std::memory_order_relaxed);
    if (last - read_.load(std::memory_order_acquire) < kReceiveCapacity) {
      Arrival& arrival = receive_[last % kReceiveCapacity];
      arrival.words.identifier = registers_.read(can_register::rixr::kOffset);
      arrival.words.length = registers_.read(can_register::rdtxr::kOffset);
      arrival.words.low = registers_.read(can_register::rdlxr::kOffset);
      arrival.words.high = registers_.read(can_register::rdhxr::kOffset);
      arrival.time = clock_->now();
      received_.store(last + 1, std::memory_order_release);
    } else {
      count_overrun();
    }
    registers_.write(can_register::rf0r::kOffset, can_register::rf0r::kRfom0.mask());
    // The next frame is at the output when RFOM0 reads 0 again, a few clocks later.
    for (int i = 0; i < kPatience; ++i) {
      if (can_register::rf0r::kRfom0.of(registers_.read(can_register::rf0r::kOffset)) == 0) return;
    }
  }

  void count_overrun() { overruns_.store(overruns_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed); }

  Registers registers_;
  const Clock* clock_;
  CanConfig config_{};
  volatile CanState state_ = CanState::kStopped;  ///< the loop writes, the transmit interrupt reads
  bool counted_ = false;                          ///< this wait for the bus is in the faults
  base::Micros since_{};                          ///< begin of the wait for the bus or of the hold after bus-off
  base::Micros arrived_{};
  base::CanFaults faults_{};                ///< counts of the loop; rx_overflow is overruns_
  std::atomic<std::uint32_t> overruns_{0};  ///< frames that FIFO 0 or the ring had no room for
  std::uint32_t unsupported_ = 0;
  // Positions in the rings count on for ever; each has one writer.
  std::atomic<std::uint32_t> sent_{0};      ///< loop: frames put into the ring
  std::atomic<std::uint32_t> taken_{0};     ///< interrupt, or loop under the lock: frames put into mailboxes
  std::atomic<std::uint32_t> received_{0};  ///< interrupt: frames put into the ring
  std::atomic<std::uint32_t> read_{0};      ///< loop: frames taken out of it
  std::array<base::CanFrame, kTransmitCapacity> transmit_{};
  std::array<Arrival, kReceiveCapacity> receive_{};
};

}  // namespace tetap::hal::stm32
