// SPDX-License-Identifier: Apache-2.0
// A model of bxCAN for the driver's test, from RM0402 chapter "Controller area network (bxCAN)". It has modes, three
// mailboxes in the order of TXFP, FIFO 0 of three, filter bank 0, bus-off. Offsets and bits are written down here once
// more.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

namespace tetap::hal::stm32 {

class FakeBxcan {
 public:
  struct Frame {
    std::uint32_t identifier = 0, length = 0, low = 0, high = 0;
    friend bool operator==(const Frame&, const Frame&) = default;
  };

  bool deaf = false;    ///< never follows a change of the mode
  bool silent = false;  ///< no 11 recessive bits in a row are seen: it never joins
  std::vector<Frame> wire;
  std::uint32_t accesses = 0;
  int recoveries = 0;

  [[nodiscard]] bool transmit_interrupt() const { return (ier_ & 1U) != 0 && (tsr_ & 0x0001'0101U) != 0; }
  [[nodiscard]] bool receive_interrupt() const {
    return ((ier_ & 2U) != 0 && !fifo_.empty()) || ((ier_ & 8U) != 0 && overrun_);
  }
  [[nodiscard]] bool on_the_bus() const { return !initialising_ && !off_ && !silent; }
  [[nodiscard]] std::uint32_t bit_timing() const { return btr_; }

  void go_off() { off_ = true; }
  /// 128 times 11 recessive bits went by: they count for a controller that asked for its recovery.
  void idle_bus() {
    if (off_ && asked_ && !initialising_) {
      off_ = asked_ = false;
      ++recoveries;
    }
  }
  /// The bus takes one frame: the oldest with TXFP, else the lowest identifier.
  void transmit() {
    if (!on_the_bus()) return;
    std::optional<std::size_t> chosen;
    for (std::size_t i = 0; i < 3; ++i) {
      if (!pending_[i]) continue;
      const bool sooner = !chosen || ((mcr_ & 4U) != 0 ? order_[i] < order_[*chosen]
                                                       : boxes_[i].identifier < boxes_[*chosen].identifier);
      if (sooner) chosen = i;
    }
    if (!chosen) return;
    wire.push_back(boxes_[*chosen]);
    pending_[*chosen] = false;
    tsr_ |= 3U << 8 * *chosen;  // RQCP, TXOK
  }
  void arrive(const Frame& frame) {
    if (!on_the_bus() || (fa1r_ & 1U) == 0 || ((frame.identifier ^ filter_[0]) & filter_[1] & ~1U) != 0) return;
    if (fifo_.size() == 3) {
      overrun_ = true;
      return;
    }
    fifo_.push_back(frame);
  }

  std::uint32_t read(std::uint32_t offset) {
    ++accesses;
    switch (offset) {
      case 0x004:
        return (deaf ? 0U : initialising_ || silent ? 1U : 0U);
      case 0x008: {
        std::uint32_t value = tsr_;
        for (std::uint32_t i = 0; i < 3; ++i) value |= pending_[i] ? 0U : 1U << (26 + i);
        return value;
      }
      case 0x00C:
        return static_cast<std::uint32_t>(fifo_.size()) | (overrun_ ? 16U : 0U);
      case 0x018:
        return off_ ? 4U : 0U;
      case 0x1B0:
        return fifo_.empty() ? 0 : fifo_.front().identifier;
      case 0x1B4:
        return fifo_.empty() ? 0 : fifo_.front().length;
      case 0x1B8:
        return fifo_.empty() ? 0 : fifo_.front().low;
      case 0x1BC:
        return fifo_.empty() ? 0 : fifo_.front().high;
      default:
        return 0;
    }
  }

  void write(std::uint32_t offset, std::uint32_t value) {
    ++accesses;
    if (offset >= 0x180 && offset < 0x1B0) return write_mailbox((offset - 0x180) / 16, offset % 16, value);
    switch (offset) {
      case 0x000:
        mcr_ = value;
        if (initialising_ && (value & 1U) == 0) asked_ = off_;
        initialising_ = (value & 1U) != 0;
        return;
      case 0x008:
        for (std::uint32_t i = 0; i < 3; ++i) {
          if ((value >> 8 * i & 1U) != 0) tsr_ &= ~(0xFU << 8 * i);
          if ((value >> 8 * i & 0x80U) != 0 && pending_[i]) {
            pending_[i] = false;
            tsr_ |= 1U << 8 * i;
          }
        }
        return;
      case 0x00C:
        if ((value & 16U) != 0) overrun_ = false;
        if ((value & 32U) != 0 && !fifo_.empty()) fifo_.pop_front();
        return;
      case 0x014:
        ier_ = value;
        return;
      case 0x01C:
        if (initialising_) btr_ = value;
        return;
      case 0x200:
        filter_open_ = (value & 1U) != 0;
        return;
      case 0x21C:
        fa1r_ = value;
        return;
      case 0x240:
      case 0x244:
        if (filter_open_) filter_[(offset - 0x240) / 4] = value;
        return;
      default:
        return;
    }
  }

 private:
  void write_mailbox(std::size_t box, std::uint32_t part, std::uint32_t value) {
    if (pending_[box]) return;  // a mailbox that is not empty is write-protected
    if (part == 4) boxes_[box].length = value;
    if (part == 8) boxes_[box].low = value;
    if (part == 12) boxes_[box].high = value;
    if (part != 0) return;
    boxes_[box].identifier = value & ~1U;
    if ((value & 1U) == 0) return;
    pending_[box] = true;
    order_[box] = ++requests_;
  }

  std::uint32_t mcr_ = 2, ier_ = 0, btr_ = 0, fa1r_ = 0, tsr_ = 0;
  bool initialising_ = false, off_ = false, asked_ = false, overrun_ = false, filter_open_ = false;
  std::array<std::uint32_t, 2> filter_{};
  std::array<Frame, 3> boxes_{};
  std::array<bool, 3> pending_{};
  std::array<std::uint64_t, 3> order_{};
  std::uint64_t requests_ = 0;
  std::deque<Frame> fifo_;
};

struct BxcanRegisters {
  FakeBxcan* chip;
  [[nodiscard]] std::uint32_t read(std::uint32_t offset) const { return chip->read(offset); }
  void write(std::uint32_t offset, std::uint32_t value) const { chip->write(offset, value); }
};

}  // namespace tetap::hal::stm32
