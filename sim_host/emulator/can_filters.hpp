// SPDX-License-Identifier: Apache-2.0
// Acceptance filters of bxCAN: 28 banks, mask or list, 16 or 32 bits. RM0402 chapter bxCAN, section "Identifier
// filtering" with its numbering of filters.
#pragma once

#include "sim_host/emulator/can_line.hpp"

#include <array>
#include <cstdint>
#include <optional>

namespace tetap::board {

class CanFilters {
 public:
  static constexpr std::uint32_t kBanks = 28, kOwnBanks = 14;  // CAN2SB = 14 after reset

  void reset() { *this = {}; }
  /// Registers from FMR on, by their offset in the block. The result of a write is a complaint, or null.
  [[nodiscard]] std::uint32_t read(std::uint32_t offset) const;
  [[nodiscard]] const char* write(std::uint32_t offset, std::uint32_t value);

  struct Match {
    int fifo, index;
  };
  /// FIFO and number of the filter that takes the frame; empty: none does.
  [[nodiscard]] std::optional<Match> match(const CanOffer& frame) const;

 private:
  struct Bank {
    std::uint32_t r1 = 0, r2 = 0;
  };
  [[nodiscard]] int match_bank(std::uint32_t bank, const CanOffer& frame) const;
  [[nodiscard]] int size_of(std::uint32_t bank) const;

  bool initialisation_ = true;
  std::uint32_t list_ = 0, wide_ = 0, second_fifo_ = 0, active_ = 0;
  std::array<Bank, kBanks> banks_{};
};

}  // namespace tetap::board
