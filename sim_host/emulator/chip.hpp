// SPDX-License-Identifier: Apache-2.0
// What all chips with a Cortex-M4 have: memory, bus, interrupts, time. A test drives a chip by read(), write() and
// advance(); the machine executes an image on it.
#pragma once

#include "sim_host/emulator/can_line.hpp"
#include "sim_host/emulator/clock_controller.hpp"
#include "sim_host/emulator/memory.hpp"
#include "sim_host/emulator/nvic.hpp"
#include "sim_host/emulator/system_control.hpp"

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace tetap::board {

/// Addresses of the bus at which blocks lie.
struct BusWindow {
  std::uint32_t base, size;
};

class FlashController;
class Iwdg;
class Spi;

class Chip {
 public:
  virtual ~Chip() = default;
  Chip(const Chip&) = delete;
  Chip& operator=(const Chip&) = delete;

  // In the order in which they are made.
  Scheduler scheduler;
  Complaints complaints{scheduler};
  CoreClock clock;
  Nvic nvic;
  Memory memory;

 protected:
  Surroundings around_{scheduler, complaints, nvic};

 public:
  SystemControl core;

  [[nodiscard]] virtual ClockController& clocks() = 0;
  /// The bus at the first CAN controller.
  [[nodiscard]] virtual CanLine& can_line() = 0;
  /// The first SPI master.
  [[nodiscard]] virtual Spi& spi() = 0;
  [[nodiscard]] virtual Iwdg& watchdog() = 0;
  [[nodiscard]] virtual FlashController& flash_controller() = 0;

  /// Register access of the core or of a test; `size` 1, 2 or 4 bytes. A place without a block reads 0 and is a
  /// complaint; the result is false.
  bool read(std::uint32_t address, int size, std::uint32_t& value);
  bool write(std::uint32_t address, int size, std::uint32_t value);
  [[nodiscard]] std::span<const BusWindow> windows() const { return windows_; }

  /// Register words, for tests.
  [[nodiscard]] std::uint32_t word(std::uint32_t address) {
    std::uint32_t value = 0;
    (void)read(address, 4, value);
    return value;
  }
  void set_word(std::uint32_t address, std::uint32_t value) { (void)write(address, 4, value); }
  /// The supply is lost now: a running operation of the flash stays half-done. pending_reset becomes a power-on.
  void lose_power();
  void advance_us(std::int64_t us) { scheduler.advance(scheduler.now() + us * kMicrosecond); }

  /// All blocks as after a system reset; SRAM keeps what it holds, but not over a power-on.
  void system_reset(ResetCause cause);
  /// A reset was asked for by software or watchdog and waits for the machine.
  std::optional<ResetCause> pending_reset;

 protected:
  Chip(const MemoryLayout& layout, std::span<const BusWindow> windows);
  /// `block` answers from its base on, for `size` bytes of whole kilobytes.
  void place(Peripheral& block, std::uint32_t size = 0x400);
  /// The core follows the clocks; called once all blocks are made.
  void start();

 private:
  [[nodiscard]] Peripheral* find(std::uint32_t address) const;
  bool check(const Peripheral& block, std::uint32_t address, int size, const char* verb);

  std::vector<BusWindow> windows_;
  std::vector<std::vector<Peripheral*>> map_;  ///< per window, 1 KiB each
  std::vector<Peripheral*> blocks_;
};

}  // namespace tetap::board
