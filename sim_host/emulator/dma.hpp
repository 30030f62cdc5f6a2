// SPDX-License-Identifier: Apache-2.0
// DMA controllers with eight streams, direct mode and FIFO mode treated alike. RM0402 chapter "DMA controller", tables
// of the request mapping of DMA1 and DMA2.
#pragma once

#include "sim_host/emulator/memory.hpp"
#include "sim_host/emulator/peripheral.hpp"

#include <array>
#include <cstdint>
#include <functional>
#include <optional>

namespace tetap::board {

/// Request lines of the peripherals that are modelled.
enum class DmaRequest : std::uint8_t {
  kSpi1Rx,
  kSpi1Tx,
  kSpi2Rx,
  kSpi2Tx,
  kUsart1Rx,
  kUsart1Tx,
  kUsart2Rx,
  kUsart2Tx,
};

class Dma final : public Peripheral {
 public:
  /// `controller`: 1 or 2.
  Dma(Surroundings around, int controller, std::uint32_t base, Memory& memory);

  std::uint32_t read(std::uint32_t offset) override;
  void write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) override;
  void reset() override;

  /// A peripheral raises `request`: one item is moved at once where a stream listens; false: none does.
  bool serve(DmaRequest request);
  /// Access to the peripherals' registers, set by the chip.
  std::function<std::uint32_t(std::uint32_t address, int size)> bus_read;
  std::function<void(std::uint32_t address, std::uint32_t value, int size)> bus_write;
  /// Whether the controller has its clock, set by the chip.
  std::function<bool()> clocked;
  /// A stream was switched on: peripherals with a waiting request raise it again.
  std::function<void()> on_enable;

 private:
  struct Stream {
    std::uint32_t cr = 0, ndtr = 0, par = 0, m0ar = 0, fcr = 0x21;
    std::uint32_t flags = 0;                   ///< bits of LISR for stream 0
    std::uint32_t reload = 0;                  ///< NDTR when the stream was switched on
    std::uint32_t memory = 0, peripheral = 0;  ///< next addresses
  };
  void enable(int number);
  void write_cr(int number, std::uint32_t value);
  void transfer(int number);
  void fail(int number, const std::string& why);
  void update(int number);
  [[nodiscard]] bool move(int number, int peripheral_size, int memory_size);
  [[nodiscard]] std::string label(int number) const { return "stream " + std::to_string(number); }

  int controller_;
  Memory& memory_;
  std::array<Stream, 8> streams_{};
};

}  // namespace tetap::board
