// SPDX-License-Identifier: Apache-2.0
// Driver of the ZynqMP CAN controller, polled: FIFOs of 64 frames each way, a software ring in front of the transmit
// FIFO. UG1085 chapter "CAN Controller", UG1087 module "CAN". Registers and Clock are template parameters so that a
// model stands in on the host.
#pragma once

#include "hal/can_bus.hpp"
#include "hal/chip/zynqmp/can_encoding.hpp"
#include "hal/chip/zynqmp/can_timing.hpp"
#include "tetap/base/time.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace tetap::hal::zynqmp_r5 {

struct CanConfig {
  CanBitTiming timing;
  std::array<AcceptanceFilter, 4> filters{};
  std::size_t filter_count = 0;  ///< 0: every frame is received
};

template <class Registers, class Clock>
class CanController {
 public:
  static constexpr std::size_t kTransmitCapacity = 128;  ///< frames in the ring, on top of the 64 in the controller
  static constexpr int kFifoDepth = 64;
  /// How long the node stays away after bus-off. ISO 11898-1 asks for 128 times 11 recessive bits (2.8 ms at 500 kbit/s
  /// idle); a fault that comes back at once must not keep the bus from everybody else.
  static constexpr base::Micros kBusOffHold{100'000};

  constexpr CanController(Registers registers, Clock& clock) : registers_{registers}, clock_{&clock} {}

  void start(Machine machine, const CanConfig& config) {
    machine_ = machine;
    config_ = config;
    configure();
  }

  [[nodiscard]] bool send(const base::CanFrame& frame) {
    if (count_ == kTransmitCapacity) {
      ++faults_.tx_full;
      return false;
    }
    ring_[(first_ + count_) % kTransmitCapacity] = frame;
    ++count_;
    if (count_ > faults_.tx_high) faults_.tx_high = static_cast<std::uint32_t>(count_);
    return true;
  }

  void flush() {
    if (away_) {
      if (clock_->now() < back_at_) return;
      configure();
    }
    if (count_ == 0 && !received_) rest(machine_);
    received_ = false;
    // Bounded by the ring, so a controller that never fills cannot hold the loop.
    while (count_ > 0 && (registers_.read(kStatus) & kStatusTxFull) == 0) {
      const CanWords words = to_words(machine_, ring_[first_]);
      registers_.write(kTxId, words.id);
      registers_.write(kTxDlc, words.dlc);
      registers_.write(kTxData1, words.data1);
      registers_.write(kTxData2, words.data2);
      first_ = (first_ + 1) % kTransmitCapacity;
      --count_;
    }
  }

  [[nodiscard]] std::optional<base::CanFrame> receive() {
    // Frames of a kind the node does not use are passed over; no more of them than the FIFO holds in one call.
    for (int i = 0; i < kFifoDepth; ++i) {
      const std::uint32_t interrupts = registers_.read(kInterrupts);
      if ((interrupts & (kBusOff | kRxOverflow)) != 0) note_faults(interrupts);
      if ((interrupts & kRxNotEmpty) == 0) return std::nullopt;
      received_ = true;
      // All four words are read whatever the size; the last one takes the message out of the FIFO.
      CanWords words;
      words.id = registers_.read(kRxId);
      words.dlc = registers_.read(kRxDlc);
      words.data1 = registers_.read(kRxData1);
      words.data2 = registers_.read(kRxData2);
      registers_.write(kInterruptClear, kRxNotEmpty);  // comes back at once when there is another one
      if (const auto frame = to_frame(machine_, words)) return frame;
      ++unsupported_;
    }
    return std::nullopt;
  }

  [[nodiscard]] base::CanFaults faults() const { return faults_; }
  [[nodiscard]] std::uint32_t rx_unsupported() const { return unsupported_; }  ///< remote frames, counted and dropped

 private:
  // UG1087, module CAN: offsets and bits used here.
  static constexpr std::uint32_t kReset = 0x00, kMode = 0x04, kPrescaler = 0x08, kBitTiming = 0x0C, kStatus = 0x18;
  static constexpr std::uint32_t kInterrupts = 0x1C, kInterruptEnable = 0x20, kInterruptClear = 0x24;
  static constexpr std::uint32_t kTxId = 0x30, kTxDlc = 0x34, kTxData1 = 0x38, kTxData2 = 0x3C;
  static constexpr std::uint32_t kRxId = 0x50, kRxDlc = 0x54, kRxData1 = 0x58, kRxData2 = 0x5C;
  static constexpr std::uint32_t kFilterEnable = 0x60, kFilterMask1 = 0x64, kFilterId1 = 0x68, kFilterStride = 8;
  static constexpr std::uint32_t kResetSrst = 1U << 0, kResetCen = 1U << 1;
  static constexpr std::uint32_t kStatusFilterBusy = 1U << 11, kStatusTxFull = 1U << 10, kStatusConfig = 1U << 0;
  static constexpr std::uint32_t kBusOff = 1U << 9, kRxNotEmpty = 1U << 7, kRxOverflow = 1U << 6;
  static constexpr int kPatience =
      1000;  // reads until a mode change must have happened (a few reference clocks on silicon)

  void configure() {
    registers_.write(kReset, kResetSrst);  // FIFOs empty, configuration mode, CEN = 0
    for (int i = 0; i < kPatience && (registers_.read(kStatus) & kStatusConfig) == 0; ++i) {
    }
    registers_.write(kMode, 0);
    registers_.write(kPrescaler, config_.timing.brpr());
    registers_.write(kBitTiming, config_.timing.btr());
    registers_.write(kInterruptEnable, 0);
    registers_.write(kInterruptClear, ~0U);
    registers_.write(kFilterEnable, 0);
    for (int i = 0; i < kPatience && (registers_.read(kStatus) & kStatusFilterBusy) != 0; ++i) {
    }
    std::uint32_t enabled = 0;
    for (std::uint32_t i = 0; i < config_.filter_count && i < config_.filters.size(); ++i) {
      const AcceptanceWords words = to_words(machine_, config_.filters[i]);
      registers_.write(kFilterMask1 + i * kFilterStride, words.mask);
      registers_.write(kFilterId1 + i * kFilterStride, words.id);
      enabled |= 1U << i;
    }
    registers_.write(kFilterEnable, enabled);
    registers_.write(kReset, kResetCen);
    away_ = false;
  }

  void note_faults(std::uint32_t interrupts) {
    if ((interrupts & kRxOverflow) != 0) {
      ++faults_.rx_overflow;  // one event; the controller does not count the frames lost
      registers_.write(kInterruptClear, kRxOverflow);
    }
    if ((interrupts & kBusOff) != 0) {
      ++faults_.bus_off;
      registers_.write(
          kReset,
          0);  // leaves the bus; received frames stay readable, those in the transmit FIFO are given up at restart
      registers_.write(kInterruptClear, kBusOff);
      away_ = true;
      back_at_ = clock_->now() + kBusOffHold;
    }
  }

  Registers registers_;
  Clock* clock_;
  CanConfig config_{};
  Machine machine_ = Machine::kSilicon;
  bool received_ = false;  // since the last flush()
  bool away_ = false;      // between bus-off and the restart
  base::Micros back_at_{};
  std::array<base::CanFrame, kTransmitCapacity> ring_{};
  std::size_t first_ = 0;
  std::size_t count_ = 0;
  base::CanFaults faults_{};
  std::uint32_t unsupported_ = 0;
};

}  // namespace tetap::hal::zynqmp_r5
