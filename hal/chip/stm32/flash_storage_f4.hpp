// SPDX-License-Identifier: Apache-2.0
// Sectors 10 and 11 of an STM32F4 with 1 MB of flash as hal::Storage: the last two of 128 kB each. RM0402 3.3 (table
// of the sectors), 3.5.2 to 3.5.4 (erase, program). A page is the first 16 kB of its sector, as a start reads all of
// it.
#pragma once

#include "hal/chip/stm32/flash_controller.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::hal::stm32 {

/// `Cells`: the words of both sectors.
template <class Registers, class Cells>
class FlashStorageF4 {
 public:
  static constexpr std::size_t kPageBytes = 16 * 1024;
  static constexpr std::size_t kGranuleBytes = 8;
  static constexpr std::uint32_t kFirstSector = 10, kSectorBytes = 128 * 1024;
  /// Longest erase of such a sector, 32 bits at a time: DS11139, table "Flash memory programming".
  static constexpr std::uint32_t kLongestErase_us = 2'000'000;
  /// More than the watchdog waits, where a read of the status takes ten cycles.
  static constexpr int kPatience = 300'000'000;

  constexpr FlashStorageF4(Registers controller, Cells cells, int patience = kPatience)
      : controller_{controller, patience}, cells_{cells} {}

  [[nodiscard]] bool read(std::size_t page, std::size_t granule, std::span<std::uint8_t> in) const {
    for (std::uint32_t word = 0; word < kGranuleBytes; word += 4)
      store_word(cells_.read(place(page, granule) + word), in.subspan(word, 4));
    return true;
  }
  bool program(std::size_t page, std::size_t granule, std::span<const std::uint8_t> out) {
    const std::uint32_t at = place(page, granule);
    if ((cells_.read(at) & cells_.read(at + 4)) != kBlank || !controller_.open()) return false;
    controller_.control(kWords | stm32f412::flash::cr::kPg.mask());
    for (std::uint32_t word = 0; word < kGranuleBytes && controller_.ends() && !controller_.failed(); word += 4)
      cells_.write(at + word, load_word(out.subspan(word, 4)));
    return controller_.shut();
  }
  bool erase(std::size_t page) {
    namespace cr = stm32f412::flash::cr;
    if (!controller_.open()) return false;
    const std::uint32_t sector = kWords | cr::kSer.mask() | cr::kSnb(kFirstSector + static_cast<std::uint32_t>(page));
    controller_.control(sector);
    controller_.control(sector | cr::kStrt.mask());
    const bool good = controller_.shut();
    controller_.forget_data();
    return good;
  }

 private:
  static constexpr std::uint32_t kBlank = 0xFFFFFFFF;
  /// PSIZE: 32 bits at a time, which takes 2.7 V or more.
  static constexpr std::uint32_t kWords = stm32f412::flash::cr::kPsize(2);

  [[nodiscard]] static constexpr std::uint32_t place(std::size_t page, std::size_t granule) {
    return static_cast<std::uint32_t>(page * kSectorBytes + granule * kGranuleBytes);
  }

  FlashController<Registers, FlashMapF4> controller_;
  Cells cells_;
};

}  // namespace tetap::hal::stm32
