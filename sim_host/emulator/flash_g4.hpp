// SPDX-License-Identifier: Apache-2.0
// Flash of the STM32G474xE: two banks of 128 pages, programmed by double words with check bits. RM0440 chapter
// "Embedded flash memory (FLASH) for category 3 devices"; durations: DS12288, table "Flash memory characteristics".
#pragma once

#include "sim_host/emulator/flash_controller.hpp"

#include <array>
#include <functional>
#include <optional>

namespace tetap::board {

class PwrG4;

class FlashG4 final : public FlashController {
 public:
  FlashG4(Surroundings around, Memory& memory, const PwrG4& pwr);
  std::uint32_t read(std::uint32_t offset) override;
  void write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) override;
  void store(std::uint32_t address, unsigned size, std::uint32_t value) override;
  [[nodiscard]] std::uint64_t load(std::uint32_t address, unsigned size) override;
  /// Fastest HCLK with the wait states and the voltage range that are set.
  [[nodiscard]] std::int64_t limit_hz() const;
  std::function<void()> on_nmi;  ///< a double error of the check code

  /// FLASH_WRP1AR and FLASH_WRP2AR as the option bytes load them: first and last protected page of each bank.
  std::array<std::uint32_t, 2> protected_pages{0x0000'007F, 0x0000'007F};

 private:
  void reset_registers() override;
  void complete(const Operation& operation) override;
  void tear(const Operation& operation, base::Random& random) override;
  void write_acr(std::uint32_t value, std::uint32_t mask);
  void write_cr(std::uint32_t value, std::uint32_t mask);
  void start_erase();
  void program(std::uint32_t offset, std::uint64_t value);
  [[nodiscard]] bool is_protected(std::uint32_t offset, std::uint32_t size) const;
  [[nodiscard]] std::uint8_t check_of(std::uint32_t offset) const;
  void set_cells(std::uint32_t offset, std::uint64_t data, std::uint8_t check);
  [[nodiscard]] std::uint64_t checked(std::uint32_t offset);
  void fail(std::uint32_t flag, const std::string& why);
  void set_flags(std::uint32_t flags);

  struct FirstWord {
    std::uint32_t offset, value;
  };

  const PwrG4& pwr_;
  std::uint32_t acr_ = 0, sr_ = 0, cr_ = 0, eccr_ = 0;
  std::optional<FirstWord> first_word_;
};

}  // namespace tetap::board
