// SPDX-License-Identifier: Apache-2.0
// What both flash controllers have in common: the keys, errors that stay until they are cleared, an operation that is
// waited for, the data cache. RM0402 3.5 and 3.8, RM0440 3.3.6 to 3.3.8 and 3.7. On the F4 the core stands still while
// it fetches code from a flash that is busy.
#pragma once

#include "hal/chip/stm32/registers_stm32f412.hpp"
#include "hal/chip/stm32/registers_stm32g474.hpp"
#include "hal/chip/support/register_steps.hpp"

#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::hal::stm32 {

/// Four bytes as the flash's word has them, the first one lowest.
[[nodiscard]] inline std::uint32_t load_word(std::span<const std::uint8_t> bytes) {
  std::uint32_t word = 0;
  for (std::size_t i = 0; i < 4; ++i) word |= std::uint32_t{bytes[i]} << (8 * i);
  return word;
}
inline void store_word(std::uint32_t word, std::span<std::uint8_t> bytes) {
  for (std::size_t i = 0; i < 4; ++i) bytes[i] = static_cast<std::uint8_t>(word >> (8 * i));
}

/// Places and bits of the STM32F4's registers.
struct FlashMapF4 {
  static constexpr std::uint32_t kKeys = stm32f412::flash::keyr::kOffset, kStatus = stm32f412::flash::sr::kOffset,
                                 kControl = stm32f412::flash::cr::kOffset;
  static constexpr Field kBusy = stm32f412::flash::sr::kBsy, kLock = stm32f412::flash::cr::kLock;
  /// RDERR of the F412 (RM0402 3.8.4), which the vendor's register file lacks; reserved in the F405.
  static constexpr Field kReadError{8, 1};
  static constexpr std::uint32_t kErrors = stm32f412::flash::sr::kOperr.mask() | stm32f412::flash::sr::kWrperr.mask() |
                                           stm32f412::flash::sr::kPgaerr.mask() | stm32f412::flash::sr::kPgperr.mask() |
                                           stm32f412::flash::sr::kPgserr.mask() | kReadError.mask();
  static constexpr std::uint32_t kEnd = stm32f412::flash::sr::kEop.mask();
};

/// Places and bits of the STM32G4's registers.
struct FlashMapG4 {
  static constexpr std::uint32_t kKeys = stm32g474::flash::keyr::kOffset, kStatus = stm32g474::flash::sr::kOffset,
                                 kControl = stm32g474::flash::cr::kOffset;
  static constexpr Field kBusy = stm32g474::flash::sr::kBsy, kLock = stm32g474::flash::cr::kLock;
  static constexpr std::uint32_t kErrors = stm32g474::flash::sr::kOperr.mask() | stm32g474::flash::sr::kProgerr.mask() |
                                           stm32g474::flash::sr::kWrperr.mask() | stm32g474::flash::sr::kPgaerr.mask() |
                                           stm32g474::flash::sr::kSizerr.mask() | stm32g474::flash::sr::kPgserr.mask() |
                                           stm32g474::flash::sr::kMisserr.mask() |
                                           stm32g474::flash::sr::kFasterr.mask() | stm32g474::flash::sr::kRderr.mask() |
                                           stm32g474::flash::sr::kOptverr.mask();
  static constexpr std::uint32_t kEnd = stm32g474::flash::sr::kEop.mask();
};

template <class Registers, class Map>
class FlashController {
 public:
  /// `patience`: reads of the status until an operation counts as failed.
  constexpr FlashController(Registers registers, int patience) : registers_{registers}, patience_{patience} {}

  /// Opens the control register, without a mark of an earlier operation; false: it stays shut until the next reset.
  [[nodiscard]] bool open() const {
    if (!ends()) return false;
    if (locked()) {
      registers_.write(Map::kKeys, kFirstKey);
      registers_.write(Map::kKeys, kSecondKey);
    }
    registers_.write(Map::kStatus, Map::kErrors | Map::kEnd);
    return !locked();
  }
  void control(std::uint32_t bits) const { registers_.write(Map::kControl, bits); }
  /// Waits for the operation; false: an error, or no end.
  [[nodiscard]] bool ends() const { return waits_for(registers_, Map::kStatus, Map::kBusy, 0, patience_); }
  [[nodiscard]] bool failed() const { return (registers_.read(Map::kStatus) & Map::kErrors) != 0; }
  /// Shuts the control register; true: no error since open().
  [[nodiscard]] bool shut() const {
    const bool good = ends() && !failed();
    registers_.write(Map::kStatus, Map::kErrors | Map::kEnd);
    registers_.write(Map::kControl, Map::kLock.mask());
    return good;
  }
  /// After an erase the data cache may hold what was there before. A cache is reset while both are off.
  void forget_data() const {
    namespace acr = stm32f412::flash::acr;
    static_assert(stm32g474::flash::acr::kOffset == acr::kOffset &&
                  stm32g474::flash::acr::kDcen.mask() == acr::kDcen.mask() &&
                  stm32g474::flash::acr::kIcen.mask() == acr::kIcen.mask() &&
                  stm32g474::flash::acr::kDcrst.mask() == acr::kDcrst.mask());
    const std::uint32_t before = registers_.read(acr::kOffset), off = before & ~(acr::kDcen.mask() | acr::kIcen.mask());
    registers_.write(acr::kOffset, off);
    registers_.write(acr::kOffset, off | acr::kDcrst.mask());
    registers_.write(acr::kOffset, off);
    registers_.write(acr::kOffset, before);
  }

 private:
  static constexpr std::uint32_t kFirstKey = 0x45670123, kSecondKey = 0xCDEF89AB;

  [[nodiscard]] bool locked() const { return Map::kLock.of(registers_.read(Map::kControl)) != 0; }

  Registers registers_;
  int patience_;
};

}  // namespace tetap::hal::stm32
