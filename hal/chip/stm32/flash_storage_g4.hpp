// SPDX-License-Identifier: Apache-2.0
// The last 8 kB of an STM32G474's 512 kB as hal::Storage, two pages of 4 kB. RM0440 3.3.1 (pages of 2 kB in two banks,
// or of 4 kB in one, by the option DBANK), 3.3.3 (check code), 3.3.6 and 3.3.7 (erase, program). A double word with two
// wrong bits is an NMI when it is read.
#pragma once

#include "hal/chip/stm32/flash_controller.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::hal::stm32 {

/// `Cells`: the words of both pages. `Trap`: while one lives, an NMI by the check code returns, and damage() gives the
/// flags that it came with.
template <class Registers, class Cells, class Trap>
class FlashStorageG4 {
 public:
  static constexpr std::size_t kPageBytes = 4096;
  static constexpr std::size_t kGranuleBytes = 8;
  static constexpr std::uint32_t kFlashBytes = 512 * 1024, kBankBytes = kFlashBytes / 2, kBankPage = 2048;
  static constexpr std::uint32_t kFirst = kFlashBytes - 2 * kPageBytes;  ///< from the begin of the flash
  /// Both halves of a page: DS12288, table "Flash memory characteristics", 24.5 ms each.
  static constexpr std::uint32_t kLongestErase_us = 49'000;
  static constexpr int kPatience = 30'000'000;

  constexpr FlashStorageG4(Registers registers, Cells cells, int patience = kPatience)
      : registers_{registers}, controller_{registers, patience}, cells_{cells} {}

  /// Past the data cache: what it holds shows no damage, and it fetches neighbours.
  [[nodiscard]] bool read(std::size_t page, std::size_t granule, std::span<std::uint8_t> in) const {
    namespace acr = stm32g474::flash::acr;
    namespace eccr = stm32g474::flash::eccr;
    const std::uint32_t at = place(page, granule);
    const Trap trap{registers_};
    const std::uint32_t before = registers_.read(acr::kOffset);
    registers_.write(acr::kOffset, before & ~acr::kDcen.mask());
    for (std::uint32_t word = 0; word < kGranuleBytes; word += 4)
      store_word(cells_.read(at + word), in.subspan(word, 4));
    registers_.write(acr::kOffset, before);
    // One bank is read by two double words at a time, each with a flag.
    const bool upper = !two_banks() && granule % 2 == 1;
    return (trap.damage() & (upper ? eccr::kEccd2.mask() : eccr::kEccd.mask())) == 0;
  }
  bool program(std::size_t page, std::size_t granule, std::span<const std::uint8_t> out) {
    const std::uint32_t at = place(page, granule);
    std::array<std::uint8_t, kGranuleBytes> there{};
    const auto blank = [](std::uint8_t byte) { return byte == 0xFF; };
    if (!read(page, granule, there) || !std::all_of(there.begin(), there.end(), blank) || !controller_.open())
      return false;
    controller_.control(stm32g474::flash::cr::kPg.mask());
    for (std::uint32_t word = 0; word < kGranuleBytes; word += 4)
      cells_.write(at + word, load_word(out.subspan(word, 4)));
    return finish();
  }
  bool erase(std::size_t page) {
    if (!two_banks()) return erase_page(0, (kFirst + place(page, 0)) / kPageBytes);
    const std::uint32_t first = (kFirst - kBankBytes + place(page, 0)) / kBankPage;
    return erase_page(1, first) && erase_page(1, first + 1);
  }

 private:
  [[nodiscard]] static constexpr std::uint32_t place(std::size_t page, std::size_t granule) {
    return static_cast<std::uint32_t>(page * kPageBytes + granule * kGranuleBytes);
  }
  [[nodiscard]] bool two_banks() const {
    namespace optr = stm32g474::flash::optr;
    return optr::kDbank.of(registers_.read(optr::kOffset)) != 0;
  }
  bool erase_page(std::uint32_t bank, std::size_t number) {
    namespace cr = stm32g474::flash::cr;
    if (!controller_.open()) return false;
    const std::uint32_t page = cr::kPer.mask() | cr::kPnb(static_cast<std::uint32_t>(number)) | cr::kBker(bank);
    controller_.control(page);
    controller_.control(page | cr::kStart.mask());
    return finish();
  }
  /// Old words of the place do not stay in the cache: neither an erase nor a program renews it.
  bool finish() {
    const bool good = controller_.shut();
    controller_.forget_data();
    return good;
  }

  Registers registers_;
  FlashController<Registers, FlashMapG4> controller_;
  Cells cells_;
};

}  // namespace tetap::hal::stm32
