// SPDX-License-Identifier: Apache-2.0
// Flash of the STM32F412xG: 12 sectors in one bank, programmed by bytes to words. RM0402 chapter "Embedded flash memory
// interface"; durations: DS11139, table "Flash memory programming".
#pragma once

#include "sim_host/emulator/flash_controller.hpp"

namespace tetap::board {

class FlashF4 final : public FlashController {
 public:
  FlashF4(Surroundings around, Memory& memory);
  std::uint32_t read(std::uint32_t offset) override;
  void write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) override;
  void store(std::uint32_t address, unsigned size, std::uint32_t value) override;
  /// Fastest HCLK with the wait states that are set, at 2.7 to 3.6 V.
  [[nodiscard]] std::int64_t limit_hz() const;

 private:
  void reset_registers() override;
  void complete(const Operation& operation) override;
  void tear(const Operation& operation, base::Random& random) override;
  void write_acr(std::uint32_t value, std::uint32_t mask);
  void write_cr(std::uint32_t value, std::uint32_t mask);
  void write_optcr(std::uint32_t value, std::uint32_t mask);
  void start_erase();
  void fail(std::uint32_t flag, const std::string& why);
  void set_flags(std::uint32_t flags);

  std::uint32_t acr_ = 0, sr_ = 0, cr_ = 0, optcr_, protection_;
  Alarm options_done_;
};

}  // namespace tetap::board
