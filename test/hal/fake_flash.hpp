// SPDX-License-Identifier: Apache-2.0
// Flash controllers of the STM32F412 (RM0402 chapter 3) and the STM32G474 (RM0440 chapter 3) as their manuals have
// them, for the drivers of hal/chip/stm32. Offsets, bits and keys are written down once more. What a manual forbids is
// an entry of `wrong`.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace tetap::test {

struct FakeFlash {
  explicit FakeFlash(bool g4, bool two_banks = true)
      : is_g4(g4), dual(two_banks), words((g4 ? 0x2000U : 0x40000U) / 4, 0xFFFFFFFFU) {
    control = g4 ? 0xC0000000U : 0x80000000U;
  }
  bool is_g4, dual;
  std::vector<std::uint32_t> words;  ///< from 0x0807E000 or 0x080C0000 on
  std::uint32_t control = 0, status = 0, access = 1U << 10 | 1U << 9 | 3U;
  std::uint32_t errors_of_next = 0;  ///< end of the next operation
  int busy = 0;                      ///< reads of the status until the operation has ended
  int lasts = 3;
  bool hangs = false, shut_for_good = false;
  std::set<std::uint32_t> damaged;  ///< double words whose check code refuses them
  std::uint32_t seen_damage = 0;    ///< ECCD, ECCD2
  bool traps = false;
  std::vector<std::string> wrong;
  std::vector<std::string> done;
  std::map<std::uint32_t, std::uint32_t> cache;  ///< by address, while it is on

  [[nodiscard]] std::uint32_t read(std::uint32_t offset) {
    if (offset == 0x00) return access;
    if (offset == (is_g4 ? 0x10U : 0x0CU)) return status_now();
    if (offset == (is_g4 ? 0x14U : 0x10U)) return control;
    if (is_g4 && offset == 0x20) return dual ? 1U << 22 : 0U;
    return wrong.push_back("a read of " + std::to_string(offset)), 0;
  }
  void write(std::uint32_t offset, std::uint32_t value) {
    if (offset == 0x00) {
      if ((value & 1U << 12) != 0 && (access & 1U << 10) != 0) wrong.emplace_back("the cache was reset while on");
      if ((value & 1U << 12) != 0) cache.clear();
      access = value;
    } else if (offset == (is_g4 ? 0x08U : 0x04U)) {
      key(value);
    } else if (offset == (is_g4 ? 0x10U : 0x0CU)) {
      status &= ~value;
    } else if (offset == (is_g4 ? 0x14U : 0x10U)) {
      set_control(value);
    } else {
      wrong.push_back("a write of " + std::to_string(offset));
    }
  }
  [[nodiscard]] std::uint32_t read_cell(std::uint32_t offset) {
    if (damaged.contains(offset / 8)) {
      if (!traps) wrong.emplace_back("an NMI that nobody takes");
      seen_damage |= !dual && (offset / 8) % 2 == 1 ? 1U << 29 : 1U << 31;
    }
    if ((access & 1U << 10) == 0) return words[offset / 4];
    return cache.try_emplace(offset, words[offset / 4]).first->second;
  }
  void write_cell(std::uint32_t offset, std::uint32_t value) {
    if (busy > 0) wrong.emplace_back("a cell while busy");
    if ((control & 1U) == 0 || (control & 1U << 31) != 0) return void(status |= 1U << 7);
    if (!is_g4 && (control >> 8 & 3U) != 2) return void(status |= 1U << 6);  // PGPERR
    if (is_g4) {
      if (offset % 8 == 0) return void(first_word = value);
      if (words[offset / 4] != 0xFFFFFFFF || words[offset / 4 - 1] != 0xFFFFFFFF) return void(status |= 1U << 3);
      begin("program");
      if (status_error) return;
      words[offset / 4 - 1] = first_word;
      words[offset / 4] = value;
      return;
    }
    begin("program");
    if (status_error) return;
    words[offset / 4] &= value;
    cache[offset] = words[offset / 4];
  }

 private:
  std::uint32_t first_word = 0, last_key = 0;
  bool status_error = false;

  void key(std::uint32_t value) {
    if (shut_for_good) return;
    if (value == 0xCDEF89AB && last_key == 0x45670123)
      control &= ~(1U << 31);
    else if (value != 0x45670123)
      shut_for_good = true;
    last_key = value;
  }
  void begin(const std::string& what) {
    if ((status & 0xC3FAU) != 0) wrong.push_back(what + " with an old error");
    status_error = errors_of_next != 0;
    status |= errors_of_next;
    errors_of_next = 0;
    busy = lasts;
    if (!status_error) done.push_back(what);
  }
  std::uint32_t status_now() {
    if (!hangs && busy > 0) --busy;
    return status | (busy > 0 || hangs ? 1U << 16 : 0U);
  }
  void set_control(std::uint32_t value) {
    if (busy > 0) wrong.emplace_back("the control register while busy");
    if ((control & 1U << 31) != 0) {
      if (value != control) wrong.emplace_back("the control register while shut");
      return;
    }
    const bool erases = (value & 2U) != 0;
    if ((value & 1U << 16) != 0) {
      if (!erases || (value & 5U) != 0) wrong.emplace_back("a start of no erase");
      is_g4 ? erase_page(value) : erase_sector(value);
    }
    control = value & ~(1U << 16);
  }
  void erase_sector(std::uint32_t value) {
    const std::uint32_t sector = value >> 3 & 15U;
    if (sector < 10 || sector > 11) return void(wrong.push_back("an erase of sector " + std::to_string(sector)));
    begin("erase " + std::to_string(sector));
    if (!status_error) std::fill_n(words.begin() + (sector - 10) * 0x8000, 0x8000, 0xFFFFFFFF);
  }
  void erase_page(std::uint32_t value) {
    const std::uint32_t bank = value >> 11 & 1U, page = value >> 3 & 127U;
    const std::uint32_t bytes = dual ? 2048 : 4096, address = page * bytes + (dual ? bank * 0x40000U : 0U);
    if (address < 0x7E000 || (!dual && bank != 0))
      return void(wrong.push_back("an erase of page " + std::to_string(page)));
    begin("erase " + std::to_string(bank) + ":" + std::to_string(page));
    if (status_error) return;
    std::fill_n(words.begin() + (address - 0x7E000) / 4, bytes / 4, 0xFFFFFFFF);
    std::erase_if(damaged,
                  [&](std::uint32_t d) { return d * 8 >= address - 0x7E000 && d * 8 < address - 0x7E000 + bytes; });
  }
};

struct FlashRegisters {
  FakeFlash* flash;
  [[nodiscard]] std::uint32_t read(std::uint32_t offset) const { return flash->read(offset); }
  void write(std::uint32_t offset, std::uint32_t value) const { flash->write(offset, value); }
};
struct FlashWords {
  FakeFlash* flash;
  [[nodiscard]] std::uint32_t read(std::uint32_t offset) const { return flash->read_cell(offset); }
  void write(std::uint32_t offset, std::uint32_t value) const { flash->write_cell(offset, value); }
};
struct FlashTrap {
  explicit FlashTrap(FlashRegisters of) : flash(of.flash) { flash->traps = true, flash->seen_damage = 0; }
  ~FlashTrap() { flash->traps = false; }
  FlashTrap(const FlashTrap&) = delete;
  FlashTrap& operator=(const FlashTrap&) = delete;
  [[nodiscard]] std::uint32_t damage() const { return flash->seen_damage; }
  FakeFlash* flash;
};

}  // namespace tetap::test
