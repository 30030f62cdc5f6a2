// SPDX-License-Identifier: Apache-2.0
// A block of registers on the chip's bus, and the interrupt lines that blocks hold.
#pragma once

#include "sim_host/emulator/complaints.hpp"
#include "sim_host/emulator/virtual_time.hpp"

#include <cstdint>
#include <string>
#include <utility>

namespace tetap::board {

/// Interrupt inputs of the NVIC, held at a level by the blocks.
class InterruptLines {
 public:
  virtual ~InterruptLines() = default;
  virtual void set_level(int interrupt, bool level) = 0;
};

/// Every model's surroundings.
struct Surroundings {
  Scheduler& scheduler;
  Complaints& complaints;
  InterruptLines& lines;
};

class Peripheral {
 public:
  /// Widths of access that the reference manual allows, as a sum of 1, 2 and 4 bytes.
  static constexpr int kWords = 4, kHalfWords = 2 + 4, kBytes = 1 + 2 + 4;

  Peripheral(Surroundings around, std::string name, std::uint32_t base, int widths)
      : around_(around), name_(std::move(name)), base_(base), widths_(widths) {}
  virtual ~Peripheral() = default;
  Peripheral(const Peripheral&) = delete;
  Peripheral& operator=(const Peripheral&) = delete;

  /// The word at `offset`, a multiple of 4.
  virtual std::uint32_t read(std::uint32_t offset) = 0;
  /// The bits of `mask` of that word, where the width of a read has an effect.
  virtual std::uint32_t read_part(std::uint32_t offset, std::uint32_t /*mask*/) { return read(offset); }
  /// Writes the bits of `mask` of the word at `offset`.
  virtual void write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) = 0;
  /// As after power-on or a reset pulse of the RCC.
  virtual void reset() = 0;

  /// Whether the last write ended in a bus error; asked once.
  [[nodiscard]] bool take_bus_error() { return std::exchange(bus_error_, false); }

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] std::uint32_t base() const { return base_; }
  [[nodiscard]] int widths() const { return widths_; }

 protected:
  void complain(const std::string& text) const { around_.complaints.add(name_, text); }
  void bus_error() { bus_error_ = true; }
  [[nodiscard]] Picoseconds now() const { return around_.scheduler.now(); }
  [[nodiscard]] Scheduler& scheduler() const { return around_.scheduler; }
  void set_interrupt(int interrupt, bool level) const { around_.lines.set_level(interrupt, level); }
  static void merge(std::uint32_t& word, std::uint32_t value, std::uint32_t mask) {
    word = (word & ~mask) | (value & mask);
  }

 private:
  Surroundings around_;
  std::string name_;
  std::uint32_t base_;
  int widths_;
  bool bus_error_ = false;
};

}  // namespace tetap::board
