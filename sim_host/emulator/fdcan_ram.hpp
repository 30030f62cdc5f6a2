// SPDX-License-Identifier: Apache-2.0
// Message RAM of one FDCAN of the STM32G4: fixed places of filters, FIFOs and transmit buffers, and the acceptance
// filters that lie in it. RM0440 chapter "FD controller area network (FDCAN)", sections "Message RAM" to "FDCAN
// extended message ID filter element".
#pragma once

#include "sim_host/emulator/can_line.hpp"
#include "sim_host/emulator/peripheral.hpp"

#include <array>
#include <cstdint>
#include <functional>
#include <optional>

namespace tetap::board {

/// Word numbers inside the RAM of an instance.
namespace fdcan_ram {
inline constexpr std::uint32_t kStandardFilters = 28, kExtendedFilters = 8, kDepth = 3, kElement = 18, kEvent = 2;
inline constexpr std::uint32_t kStandard = 0, kExtended = kStandard + kStandardFilters,
                               kRx0 = kExtended + 2 * kExtendedFilters, kRx1 = kRx0 + kDepth * kElement,
                               kEvents = kRx1 + kDepth * kElement, kTx = kEvents + kDepth * kEvent,
                               kWords = kTx + kDepth * kElement;
static_assert(4 * kExtended == 0x070 && 4 * kRx0 == 0x0B0 && 4 * kRx1 == 0x188 && 4 * kEvents == 0x260 &&
              4 * kTx == 0x278 && 4 * kWords == 0x350);
}  // namespace fdcan_ram

class FdcanRam final : public Peripheral {
 public:
  FdcanRam(Surroundings around, std::uint32_t base);

  // The program's side; any access that is not a word is a complaint of the bus.
  std::uint32_t read(std::uint32_t offset) override;
  void write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) override;
  /// No reset reaches the RAM.
  void reset() override {}
  /// Fault of an access of the program, or null; set by the controller.
  std::function<const char*(std::uint32_t word, bool write)> guard;

  // The controller's side.
  [[nodiscard]] std::uint32_t at(std::uint32_t word) const { return words_[word]; }
  void put(std::uint32_t word, std::uint32_t value) { words_[word] = value; }
  /// Whether the program wrote the word since power-on.
  [[nodiscard]] bool written(std::uint32_t word) const { return written_[word]; }

 private:
  std::array<std::uint32_t, fdcan_ram::kWords> words_{};
  std::array<bool, fdcan_ram::kWords> written_{};
};

/// Global filter settings: RXGFC and XIDAM.
struct FdcanFilterSettings {
  std::uint32_t rxgfc = 0, xidam = 0x1FFF'FFFF;
};

/// Where a frame goes.
struct FdcanMatch {
  int fifo = -1;  ///< 0, 1; -1: nowhere
  int index = 0;  ///< FIDX
  bool matched = false, priority = false;
};

/// Acceptance of a frame by the filter lists, in the order of their elements. RM0440, "Acceptance filtering".
[[nodiscard]] FdcanMatch match_filters(const FdcanRam& ram, const FdcanFilterSettings& settings, const CanOffer& frame);
/// Elements of each list in use.
[[nodiscard]] std::uint32_t standard_filters(std::uint32_t rxgfc);
[[nodiscard]] std::uint32_t extended_filters(std::uint32_t rxgfc);

}  // namespace tetap::board
