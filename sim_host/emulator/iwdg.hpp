// SPDX-License-Identifier: Apache-2.0
// Independent watchdog on the LSI, which lies between 17 and 47 kHz on the STM32F412. RM0402 and RM0440 chapters
// "Independent watchdog"; the window register of the latter is not modelled.
#pragma once

#include "sim_host/emulator/peripheral.hpp"

#include <cstdint>
#include <functional>

namespace tetap::board {

class Iwdg final : public Peripheral {
 public:
  Iwdg(Surroundings around, std::uint32_t base, std::function<std::int64_t()> lsi_hz);
  std::uint32_t read(std::uint32_t offset) override;
  void write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) override;
  /// System reset stops it; a started watchdog cannot be stopped otherwise.
  void reset() override;

  std::function<void()> on_expired;
  [[nodiscard]] bool started() const { return started_; }
  [[nodiscard]] Picoseconds deadline() const { return expires_.at(); }
  /// Longest time between two reloads since power-on.
  [[nodiscard]] Picoseconds longest_gap() const { return longest_gap_; }

 private:
  void reload();

  std::function<std::int64_t()> lsi_hz_;
  Alarm expires_, prescaler_set_, reload_set_;
  std::uint32_t pr_ = 0, rlr_ = 0xFFF;            ///< values in use
  std::uint32_t next_pr_ = 0, next_rlr_ = 0xFFF;  ///< values written, in use after five cycles of the LSI
  bool unlocked_ = false, started_ = false;
  Picoseconds last_reload_ = 0, longest_gap_ = 0;
};

}  // namespace tetap::board
