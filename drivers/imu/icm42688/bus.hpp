// SPDX-License-Identifier: Apache-2.0
// Registers of the ICM-42688-P over SPI (DS-000347, 9.6). The bank of each is part of its name and is selected when it
// is another than the last. The selection is read back, because a lost one would write a right value to a wrong place.
#pragma once

#include "drivers/imu/icm42688/registers.hpp"
#include "hal/spi_device.hpp"

#include <array>
#include <cstdint>
#include <span>

namespace tetap::drivers::icm42688 {

enum class BusResult : std::uint8_t { kDone, kFault, kWrongBank };

template <hal::SpiDevice Spi>
class Bus {
 public:
  explicit constexpr Bus(Spi& spi) : spi_(&spi) {}

  /// Reads from consecutive registers, or again and again from the FIFO's port.
  [[nodiscard]] constexpr BusResult read(Register where, std::span<std::uint8_t> in) {
    const BusResult result = select(where.bank);
    if (result != BusResult::kDone) return result;
    return read_here(where.address, in) ? BusResult::kDone : fault();
  }

  [[nodiscard]] constexpr BusResult read(Register where, std::uint8_t& value) {
    return read(where, std::span<std::uint8_t>(&value, 1));
  }

  [[nodiscard]] constexpr BusResult write(Register where, std::uint8_t value) {
    const BusResult result = select(where.bank);
    if (result != BusResult::kDone) return result;
    return write_here(where.address, value) ? BusResult::kDone : fault();
  }

  /// The field only; the bits around it keep what the chip has.
  [[nodiscard]] constexpr BusResult modify(Register where, std::uint8_t mask, std::uint8_t value) {
    std::uint8_t old = 0;
    const BusResult result = read(where, old);
    if (result != BusResult::kDone) return result;
    return write(where, static_cast<std::uint8_t>((old & ~mask) | (value & mask)));
  }

  /// Asks the chip for its bank; one that is not the selected one is forgotten, so the next access selects again.
  [[nodiscard]] constexpr BusResult confirm_bank() {
    std::uint8_t bank = 0;
    if (!read_here(kBankSelect, std::span<std::uint8_t>(&bank, 1))) return fault();
    if (bank_ == kUnknown || (bank & kBankMask) == bank_) return BusResult::kDone;
    bank_ = kUnknown;
    return BusResult::kWrongBank;
  }

  /// After a reset, or when what is read makes no sense.
  constexpr void invalidate_bank() { bank_ = kUnknown; }

 private:
  static constexpr std::uint8_t kUnknown = 0xFF;

  constexpr BusResult select(std::uint8_t bank) {
    if (bank_ == bank) return BusResult::kDone;
    bank_ = kUnknown;
    if (!write_here(kBankSelect, bank)) return fault();
    std::uint8_t selected = 0;
    if (!read_here(kBankSelect, std::span<std::uint8_t>(&selected, 1))) return fault();
    if ((selected & kBankMask) != bank) return BusResult::kWrongBank;
    bank_ = bank;
    return BusResult::kDone;
  }

  constexpr bool read_here(std::uint8_t address, std::span<std::uint8_t> in) {
    const std::array<std::uint8_t, 1> out{static_cast<std::uint8_t>(address | kReadBit)};
    return spi_->transfer(std::span<const std::uint8_t>(out), in);
  }

  constexpr bool write_here(std::uint8_t address, std::uint8_t value) {
    const std::array<std::uint8_t, 2> out{address, value};
    return spi_->transfer(std::span<const std::uint8_t>(out), std::span<std::uint8_t>());
  }

  constexpr BusResult fault() {
    bank_ = kUnknown;  // the selection itself may be what was lost
    return BusResult::kFault;
  }

  Spi* spi_;
  std::uint8_t bank_ = kUnknown;
};

}  // namespace tetap::drivers::icm42688
