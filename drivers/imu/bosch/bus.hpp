// SPDX-License-Identifier: Apache-2.0
// Registers of Bosch's sensors over SPI: bit 7 of the address reads, and some chips send a byte of nothing before the
// first register. BST-BMI088-DS001 rev. 1.4 sec. 6.1; BST-BMI270-DS000 rev. 1.3 sec. 6.
#pragma once

#include "hal/spi_device.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::drivers::bosch {

/// `Idle`: bytes between the address and the first register read.
template <hal::SpiDevice Spi, std::size_t Idle>
class Bus {
 public:
  explicit constexpr Bus(Spi& spi) : spi_(&spi) {}

  /// Consecutive registers; false: bus fault.
  [[nodiscard]] constexpr bool read(std::uint8_t address, std::span<std::uint8_t> in) {
    std::array<std::uint8_t, 1 + Idle> out{};
    out[0] = static_cast<std::uint8_t>(address | 0x80);
    return spi_->transfer(std::span<const std::uint8_t>(out), in);
  }
  /// The address, then its value or values.
  [[nodiscard]] constexpr bool write(std::span<const std::uint8_t> out) {
    return spi_->transfer(out, std::span<std::uint8_t>());
  }

 private:
  Spi* spi_;
};

}  // namespace tetap::drivers::bosch
