// SPDX-License-Identifier: Apache-2.0
// What the RCC of every chip does: it drives the core, lets clocks reach the blocks, resets them, keeps reset flags.
#pragma once

#include "sim_host/emulator/peripheral.hpp"

#include <cstdint>
#include <functional>
#include <vector>

namespace tetap::board {

/// Oscillators as they are on one board.
struct Oscillators {
  bool crystal = true;               ///< false: HSE never becomes ready
  std::int64_t hse_hz = 8'000'000;   ///< crystal of the board
  std::int64_t hsi_hz = 16'000'000;  ///< 16 MHz +- 1 % at 25 degrees
  std::int64_t lsi_hz = 32'000;      ///< STM32F412: 17 to 47 kHz
  Picoseconds hse_start = 2 * kMillisecond;
};

/// Why a reset came.
enum class ResetCause : std::uint8_t { kPowerOn, kPin, kSoftware, kWatchdog };

/// Divider of HPRE as a shift: 0xxx is 1, 1000 is 2 ... 1011 is 16, 1100 is 64 ... 1111 is 512.
[[nodiscard]] constexpr int ahb_shift(std::uint32_t code) {
  if (code < 8) return 0;
  return static_cast<int>(code < 12 ? code - 7 : code - 6);
}

/// Divider of PPRE as a shift: 0xx is 1, 100 is 2 ... 111 is 16.
[[nodiscard]] constexpr int apb_shift(std::uint32_t code) { return code < 4 ? 0 : static_cast<int>(code - 3); }

class ClockController : public Peripheral {
 public:
  [[nodiscard]] virtual std::int64_t hclk_hz() const = 0;
  virtual void add_reset_flags(ResetCause cause) = 0;

  /// Clock and reset pulse of a block, by its bits in an ENR and RSTR register.
  void add_block(Peripheral& block, std::uint32_t enable_offset, std::uint32_t enable_mask, std::uint32_t reset_offset,
                 std::uint32_t reset_mask) {
    blocks_.push_back({&block, enable_offset, enable_mask, reset_offset, reset_mask});
  }
  [[nodiscard]] bool clocked(const Peripheral& block) const;
  std::function<void()> on_change;

 protected:
  ClockController(Surroundings around, std::uint32_t base, std::size_t words)
      : Peripheral(around, "RCC", base, kBytes), words_(words, 0) {}
  /// Writes an enable or reset register; a rising reset bit resets its block.
  void write_gate(std::uint32_t offset, std::uint32_t value);
  [[nodiscard]] std::uint32_t& word(std::uint32_t offset) { return words_[offset / 4]; }
  [[nodiscard]] std::uint32_t word(std::uint32_t offset) const { return words_[offset / 4]; }
  [[nodiscard]] static std::string khz(std::int64_t hz) { return std::to_string(hz / 1'000) + " kHz"; }

  std::vector<std::uint32_t> words_;

 private:
  struct Block {
    Peripheral* peripheral;
    std::uint32_t enable_offset, enable_mask, reset_offset, reset_mask;
  };
  std::vector<Block> blocks_;
  mutable std::size_t last_asked_ = 0;  ///< index of the block that clocked() found last
};

}  // namespace tetap::board
