// SPDX-License-Identifier: Apache-2.0
// External interrupts of pins (EXTI lines 0 to 15) and their port selection in SYSCFG. RM0402 chapters "Interrupts and
// events" (EXTI) and "System configuration controller"; RM0440 chapters EXTI and SYSCFG, whose IMR1 to PR1 and EXTICR1
// to EXTICR4 lie at the same offsets.
#pragma once

#include "sim_host/emulator/gpio.hpp"
#include "sim_host/emulator/peripheral.hpp"

#include <array>
#include <cstdint>

namespace tetap::board {

class Syscfg final : public Peripheral {
 public:
  Syscfg(Surroundings around, std::uint32_t base);
  std::uint32_t read(std::uint32_t offset) override;
  void write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) override;
  void reset() override { exticr_ = {}; }
  /// Letter of the port that feeds `line`.
  [[nodiscard]] char port_of(int line) const;

 private:
  std::array<std::uint32_t, 4> exticr_{};
};

class Exti final : public Peripheral {
 public:
  struct Layout {
    std::uint32_t base;
    std::uint32_t lines;      ///< lines of the first 32 that are there
    std::uint32_t imr_reset;  ///< IMR after reset
  };
  Exti(Surroundings around, Pins& pins, const Syscfg& syscfg, const Layout& layout);
  std::uint32_t read(std::uint32_t offset) override;
  void write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) override;
  void reset() override;

 private:
  void edge(Pin pin, bool level);
  void update();

  const Syscfg& syscfg_;
  Layout layout_;
  std::uint32_t imr_ = 0, emr_ = 0, rtsr_ = 0, ftsr_ = 0, swier_ = 0, pr_ = 0;
};

}  // namespace tetap::board
