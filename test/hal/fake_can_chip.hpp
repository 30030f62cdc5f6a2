// SPDX-License-Identifier: Apache-2.0
// A model of the ZynqMP CAN controller as UG1085 and UG1087 describe it, and of QEMU's where that differs, register by
// register. Its faults have names. Words that leave the transmit FIFO for the bus are kept in `wire`; `arrive` puts
// words into the receive FIFO.
#pragma once

#include "hal/chip/zynqmp/can_encoding.hpp"

#include <cstdint>
#include <deque>
#include <map>
#include <vector>

namespace tetap::hal::zynqmp_r5 {

enum class Fault {
  kNone,
  kBusStuck /* nothing leaves the transmit FIFO */,
  kNoModeChange /* the status register never follows */
};

class FakeCanChip {
 public:
  static constexpr std::size_t kDepth = 64;

  Fault fault = Fault::kNone;
  std::vector<CanWords> wire;
  std::uint32_t accesses = 0;
  int restarts = 0;  ///< software resets

  [[nodiscard]] bool on_the_bus() { return (registers_[kSrr] & 2U) != 0; }
  [[nodiscard]] std::uint32_t peek(std::uint32_t offset) { return registers_[offset]; }

  void arrive(const CanWords& words) {
    if (!on_the_bus() || !accepted(words.id)) return;
    if (rx_.size() == kDepth) {
      interrupts_ |= kRxOverflow;
      return;
    }
    rx_.push_back(words);
    interrupts_ |= kRxNotEmpty;
  }
  void go_bus_off() { interrupts_ |= kBusOff; }
  /// The bus takes up to `count` frames from the transmit FIFO.
  void transmit(std::size_t count) {
    if (fault == Fault::kBusStuck || !on_the_bus()) return;
    for (; count > 0 && !tx_.empty(); --count, tx_.pop_front()) wire.push_back(tx_.front());
  }

  std::uint32_t read(std::uint32_t offset) {
    ++accesses;
    switch (offset) {
      case kSr:
        return (on_the_bus() || fault == Fault::kNoModeChange ? 0U : 1U) | (tx_.size() == kDepth ? 1U << 10 : 0U) |
               (fault == Fault::kNoModeChange ? 1U << 11 : 0U);
      case kIsr:
        return interrupts_;
      case 0x50:
        return rx_.empty() ? 0 : rx_.front().id;
      case 0x54:
        return rx_.empty() ? 0 : rx_.front().dlc;
      case 0x58:
        return rx_.empty() ? 0 : rx_.front().data1;
      case 0x5C: {
        if (rx_.empty()) return 0;
        const std::uint32_t word = rx_.front().data2;
        rx_.pop_front();
        return word;
      }
      default:
        return registers_[offset];
    }
  }

  void write(std::uint32_t offset, std::uint32_t value) {
    ++accesses;
    switch (offset) {
      case kSrr:
        if ((value & 1U) != 0) {
          ++restarts;
          tx_.clear();
          rx_.clear();
          interrupts_ = 0;
          registers_.clear();
        }
        registers_[kSrr] = value & 2U;
        return;
      case 0x08:
      case 0x0C:
        if (!on_the_bus()) registers_[offset] = value;  // only in configuration mode
        return;
      case kIcr:
        interrupts_ &= ~value;
        if (!rx_.empty()) interrupts_ |= kRxNotEmpty;
        return;
      case 0x30:
        pending_.id = value;
        return;
      case 0x34:
        pending_.dlc = value;
        return;
      case 0x38:
        pending_.data1 = value;
        return;
      case 0x3C:
        pending_.data2 = value;
        if (tx_.size() < kDepth) tx_.push_back(pending_);
        return;
      default:
        registers_[offset] = value;
        return;
    }
  }

 private:
  static constexpr std::uint32_t kSrr = 0x00, kSr = 0x18, kIsr = 0x1C, kIcr = 0x24;
  static constexpr std::uint32_t kBusOff = 1U << 9, kRxNotEmpty = 1U << 7, kRxOverflow = 1U << 6;

  [[nodiscard]] bool accepted(std::uint32_t id) {
    const std::uint32_t enabled = registers_[0x60];
    if (enabled == 0) return true;
    for (std::uint32_t i = 0; i < 4; ++i) {
      if ((enabled >> i & 1U) != 0 && ((id ^ registers_[0x68 + 8 * i]) & registers_[0x64 + 8 * i]) == 0) return true;
    }
    return false;
  }

  std::map<std::uint32_t, std::uint32_t> registers_;
  std::uint32_t interrupts_ = 0;
  CanWords pending_;
  std::deque<CanWords> tx_;
  std::deque<CanWords> rx_;
};

/// Stand-in for Mmio in the driver.
struct FakeRegisters {
  FakeCanChip* chip;
  [[nodiscard]] std::uint32_t read(std::uint32_t offset) const { return chip->read(offset); }
  void write(std::uint32_t offset, std::uint32_t value) const { chip->write(offset, value); }
};

struct FakeClock {
  base::Micros time{};
  [[nodiscard]] base::Micros now() const { return time; }
};

}  // namespace tetap::hal::zynqmp_r5
