// SPDX-License-Identifier: Apache-2.0
// The newer SPI master: frames of 8 or 16 bits by CR2.DS, FIFOs of four bytes, a threshold for RXNE, packing of two
// bytes by 16-bit accesses. RM0440 chapter "Serial peripheral interface / integrated interchip sound (SPI/I2S)".
#pragma once

#include "sim_host/emulator/spi.hpp"

#include <deque>

namespace tetap::board {

class SpiG4 final : public Spi {
 public:
  using Spi::Spi;

  std::uint32_t read(std::uint32_t offset) override;
  std::uint32_t read_part(std::uint32_t offset, std::uint32_t mask) override;
  void write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) override;
  void reset() override;
  void raise_requests() override;

 private:
  static constexpr std::size_t kFifo = 4;  ///< bytes
  void start() override;
  void finished() override;
  void update() override;
  void check_shape() override;
  [[nodiscard]] int bits() const override;
  [[nodiscard]] bool busy() const override { return finished_.pending() || !to_send_.empty(); }
  [[nodiscard]] std::size_t frame_bytes() const { return bits() > 8 ? 2 : 1; }
  [[nodiscard]] std::uint32_t flags() const;
  [[nodiscard]] std::uint32_t take(std::size_t bytes);
  void put(std::uint32_t value, std::size_t bytes);

  std::deque<std::uint8_t> to_send_, arrived_;
};

}  // namespace tetap::board
