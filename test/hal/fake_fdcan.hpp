// SPDX-License-Identifier: Apache-2.0
// A model of FDCAN for the driver's test, from RM0440 chapter "FD controller area network (FDCAN)". It has the two
// steps into the configuration, the message RAM of one FDCAN, the transmit FIFO or queue of three, FIFO 0 of three,
// standard filters, bus-off that stays. Offsets and bits are written down here once more.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <vector>

namespace tetap::hal::stm32 {

class FakeFdcan {
 public:
  struct Frame {
    std::uint32_t identifier = 0, control = 0, low = 0, high = 0;
    friend bool operator==(const Frame&, const Frame&) = default;
  };

  bool deaf = false;    ///< has no clock: INIT never reads 1
  bool silent = false;  ///< no 11 recessive bits in a row are seen: it never joins
  std::vector<Frame> wire;
  std::uint32_t accesses = 0;
  int recoveries = 0;
  std::uint32_t foreign_words = 0;  ///< accesses outside of the message RAM of this FDCAN, or not to a word

  [[nodiscard]] bool line(std::uint32_t number) const {
    constexpr std::uint32_t kTransmission = 1U << 7;  // SMSG: TC
    const std::uint32_t active = ir_ & ie_;
    const bool moved = (ils_ >> 2 & 1U) == 1;
    const std::uint32_t mine = number == (moved ? 1U : 0U) ? active & kTransmission : 0;
    return (ile_ >> number & 1U) != 0 && (mine | (number == 0 ? active & 7U : 0U)) != 0;
  }
  [[nodiscard]] bool on_the_bus() const { return (cccr_ & 1U) == 0 && !off_ && !silent; }
  [[nodiscard]] std::uint32_t bit_timing() const { return nbtp_; }

  void go_off() {
    off_ = true;
    cccr_ |= 1U;
  }
  /// 129 times 11 recessive bits went by: they count for a controller whose INIT was cleared.
  void idle_bus() {
    if (!off_ || (cccr_ & 1U) != 0) return;
    off_ = false;
    ++recoveries;
  }
  /// The bus takes one frame: the oldest of the FIFO, or the lowest identifier of a queue.
  void transmit() {
    if (!on_the_bus() || order_.empty()) return;
    std::size_t chosen = 0;
    for (std::size_t i = 1; i < order_.size() && (txbc_ >> 24 & 1U) != 0; ++i) {
      if (buffer(order_[i]).identifier < buffer(order_[chosen]).identifier) chosen = i;
    }
    const std::uint32_t index = order_[chosen];
    wire.push_back(buffer(index));
    order_.erase(order_.begin() + static_cast<std::ptrdiff_t>(chosen));
    if ((txbtie_ >> index & 1U) != 0) ir_ |= 1U << 7;
  }
  void arrive(const Frame& frame) {
    if (!on_the_bus() || !passes(frame)) return;
    if (fill_ == 3) {
      ir_ |= 1U << 2;  // RF0L; F0OM = 0 keeps the old ones
      return;
    }
    const std::uint32_t put = (get_ + fill_++) % 3;
    const std::uint32_t at = (0xB0 + 72 * put) / 4;
    ram_[at] = frame.identifier;
    ram_[at + 1] = frame.control;
    ram_[at + 2] = frame.low;
    ram_[at + 3] = frame.high;
    ir_ |= 1U;
  }

  std::uint32_t read(bool memory, std::uint32_t offset) {
    ++accesses;
    if (memory) return word(offset);
    switch (offset) {
      case 0x18:
        return deaf ? cccr_ & ~1U : cccr_;
      case 0x44:
        return (off_ ? 0x80U : 0U) | ((cccr_ & 1U) == 0 && !off_ && !silent ? 1U << 3 : 0U);
      case 0x50:
        return ir_;
      case 0x90:
        return fill_ | get_ << 8;
      case 0xC4:
        return (3 - static_cast<std::uint32_t>(order_.size())) | next_ << 16;
      default:
        return 0;
    }
  }

  void write(bool memory, std::uint32_t offset, std::uint32_t value) {
    ++accesses;
    if (memory) {
      word(offset) = value;
      return;
    }
    const bool open = (cccr_ & 3U) == 3U;
    switch (offset) {
      case 0x18:
        if ((cccr_ & 1U) == 0 || deaf) value &= ~2U;  // CCE only after INIT
        cccr_ = (value & 1U) == 0 ? value & ~2U : value;
        return;
      case 0x1C:
        if (open) nbtp_ = value;
        return;
      case 0x50:
        ir_ &= ~value;
        return;
      case 0x54:
        ie_ = value;
        return;
      case 0x58:
        ils_ = value;
        return;
      case 0x5C:
        ile_ = value;
        return;
      case 0x80:
        if (open) rxgfc_ = value;
        return;
      case 0x94:
        for (; fill_ > 0; --fill_) {  // acknowledges all up to this one
          const bool last = get_ == (value & 7U);
          get_ = (get_ + 1) % 3;
          if (last) {
            --fill_;
            return;
          }
        }
        return;
      case 0xC0:
        if (open) txbc_ = value;
        return;
      case 0xCC:
        for (std::uint32_t i = 0; i < 3; ++i) {
          if ((value >> i & 1U) == 0) continue;
          order_.push_back(i);
          next_ = (i + 1) % 3;
        }
        return;
      case 0xD0:
        if ((cccr_ & 1U) == 0) order_.clear();  // the transmit handler stands still while INIT is 1
        return;
      case 0xDC:
        txbtie_ = value;
        return;
      default:
        return;
    }
  }

 private:
  [[nodiscard]] std::uint32_t& word(std::uint32_t offset) {
    if (offset % 4 != 0 || offset / 4 >= ram_.size()) {
      ++foreign_words;
      offset = 0;
    }
    return ram_[offset / 4];
  }
  [[nodiscard]] Frame buffer(std::uint32_t index) const {
    const std::uint32_t at = (0x278 + 72 * index) / 4;
    return {ram_[at], ram_[at + 1], ram_[at + 2], ram_[at + 3]};
  }
  /// RXGFC, then the standard filters of the kind "identifier and mask".
  [[nodiscard]] bool passes(const Frame& frame) const {
    const bool extended = (frame.identifier >> 30 & 1U) != 0, remote = (frame.identifier >> 29 & 1U) != 0;
    if (remote && (rxgfc_ >> (extended ? 0 : 1) & 1U) != 0) return false;
    const std::uint32_t others = rxgfc_ >> (extended ? 2 : 4) & 3U;
    if (!extended) {
      const std::uint32_t id = frame.identifier >> 18 & 0x7FFU;
      for (std::uint32_t i = 0; i < (rxgfc_ >> 16 & 31U); ++i) {
        const std::uint32_t filter = ram_[i];
        const bool matches = filter >> 30 == 2 && ((id ^ (filter >> 16 & 0x7FFU)) & filter & 0x7FFU) == 0;
        if (matches) return (filter >> 27 & 7U) == 1;
      }
    }
    return others == 0;
  }

  std::uint32_t cccr_ = 1, nbtp_ = 0x0600'0A03, ir_ = 0, ie_ = 0, ils_ = 0, ile_ = 0, rxgfc_ = 0, txbc_ = 0,
                txbtie_ = 0;
  bool off_ = false;
  std::uint32_t get_ = 0, fill_ = 0, next_ = 0;
  std::deque<std::uint32_t> order_;  ///< buffers that are pending, the oldest first
  std::array<std::uint32_t, 212> ram_{};
};

struct FdcanRegisters {
  FakeFdcan* chip;
  bool memory;
  [[nodiscard]] std::uint32_t read(std::uint32_t offset) const { return chip->read(memory, offset); }
  void write(std::uint32_t offset, std::uint32_t value) const { chip->write(memory, offset, value); }
};

}  // namespace tetap::hal::stm32
