// SPDX-License-Identifier: Apache-2.0
// Flash memory with its controller: what stores, fetches and reads of the core meet while it is busy, and what a reset
// or a lost supply leaves of an operation.
#pragma once

#include "sim_host/emulator/memory.hpp"
#include "sim_host/emulator/peripheral.hpp"
#include "tetap/base/random.hpp"

#include <cstdint>
#include <functional>
#include <map>
#include <string>

namespace tetap::board {

/// A lock that two keys in a row open. Anything else closes it until a reset.
class KeyLock {
 public:
  constexpr KeyLock(std::uint32_t first, std::uint32_t second) : first_(first), second_(second) {}
  [[nodiscard]] bool locked() const { return state_ != State::kOpen; }
  /// False: a wrong key.
  [[nodiscard]] bool write(std::uint32_t key);
  void lock() { state_ = state_ == State::kOpen ? State::kLocked : state_; }
  void reset() { state_ = State::kLocked; }

 private:
  enum class State : std::uint8_t { kLocked, kHalf, kOpen, kStuck };
  std::uint32_t first_, second_;
  State state_ = State::kLocked;
};

class FlashController : public Peripheral {
 public:
  /// Durations: the data sheet's typical or maximum ones, or the maximum for programming and four times the typical
  /// one for an erase.
  enum class Pace : std::uint8_t { kTypical, kMaximum, kFourfold };
  struct Duration {
    Picoseconds typical, maximum;
  };

  /// A store of 1, 2 or 4 bytes by the core: programs where the registers ask for it. It stalls while busy.
  virtual void store(std::uint32_t address, unsigned size, std::uint32_t value) = 0;
  /// A read of up to 8 bytes, little-endian. It stalls while `address` is busy.
  [[nodiscard]] virtual std::uint64_t load(std::uint32_t address, unsigned size);
  /// Until when a fetch or a read of `address` stalls; 0: not at all.
  [[nodiscard]] Picoseconds busy_until(std::uint32_t address) const;
  [[nodiscard]] bool busy() const { return done_.pending(); }
  /// First offset and size of what a running operation keeps from being read; size 0: nothing.
  [[nodiscard]] std::pair<std::uint32_t, std::uint32_t> busy_range() const;

  /// A system reset: a running operation stays half-done.
  void reset() final;
  /// The supply is lost: a running operation stays half-done, and nothing is taken until power_on().
  void cut();
  void power_on() { off_ = false; }
  [[nodiscard]] bool off() const { return off_; }

  /// Check bits of double words (by offset / 8) that are not those of their content.
  [[nodiscard]] const std::map<std::uint32_t, std::uint8_t>& damaged() const { return damaged_; }
  /// A programmer wrote these bytes from outside.
  void written(std::uint32_t offset, std::uint32_t size);

  /// Content and damage as a file: the bytes of the flash, then five bytes a damaged double word: index, check bits.
  /// Empty, or what is wrong.
  [[nodiscard]] std::string save(const std::string& path) const;
  [[nodiscard]] std::string restore(const std::string& path);

  Pace pace = Pace::kFourfold;
  std::uint64_t seed = 1;           ///< draws what half-done operations leave
  std::function<void()> on_range;   ///< busy_range() or damaged() has changed
  std::function<void()> on_change;  ///< FLASH_ACR

 protected:
  struct Operation {
    bool erase = false;
    std::uint32_t offset = 0, size = 0;
    std::uint64_t value = 0;  ///< to be programmed
  };

  /// `bank_size`: what one operation keeps from being read, as a unit.
  FlashController(Surroundings around, std::uint32_t base, Memory& memory, std::uint32_t bank_size);
  /// Registers as after a reset.
  virtual void reset_registers() = 0;
  /// Content after a completed operation, and flags.
  virtual void complete(const Operation& operation) = 0;
  /// Content after one that was interrupted.
  virtual void tear(const Operation& operation, base::Random& random) = 0;

  void begin(const Operation& operation, const Duration& duration);
  void await_idle();
  [[nodiscard]] const Operation& operation() const { return operation_; }
  [[nodiscard]] std::uint64_t content(std::uint32_t offset, unsigned size) const;
  void set_content(std::uint32_t offset, unsigned size, std::uint64_t value);
  void fill_ones(const Operation& operation);
  [[nodiscard]] std::uint32_t offset_of(std::uint32_t address) const;
  void take_key(KeyLock& lock, std::uint32_t key);
  /// Whether a store of `set` ones into FLASH_CR counts; one that a lock refuses is a complaint but for bits of
  /// `locks`.
  [[nodiscard]] bool opens_cr(std::uint32_t set, std::uint32_t locks);

  KeyLock lock_{0x4567'0123, 0xCDEF'89AB}, option_lock_{0x0819'2A3B, 0x4C5D'6E7F};  ///< RM0402 and RM0440: equal keys
  std::map<std::uint32_t, std::uint8_t> damaged_;

 private:
  void interrupt();
  void finish();

  Memory& memory_;
  std::uint32_t bank_size_;
  Operation operation_;
  Alarm done_;
  std::uint64_t interrupted_ = 0;  ///< operations so far, each with draws of its own
  bool off_ = false;
};

}  // namespace tetap::board
