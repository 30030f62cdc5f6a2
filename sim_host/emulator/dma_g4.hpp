// SPDX-License-Identifier: Apache-2.0
// DMA controllers with eight channels and the multiplexer of their requests. RM0440 chapters "Direct memory access
// controller (DMA)" and "DMA request multiplexer (DMAMUX)" with its table of inputs to resources.
#pragma once

#include "sim_host/emulator/dma.hpp"
#include "sim_host/emulator/memory.hpp"
#include "sim_host/emulator/peripheral.hpp"

#include <array>
#include <cstdint>
#include <functional>

namespace tetap::board {

/// DMAMUX1: output channels 0 to 7 feed DMA1, 8 to 15 DMA2. Synchronisation and request generators are not modelled.
class Dmamux final : public Peripheral {
 public:
  static constexpr std::size_t kChannels = 16;
  explicit Dmamux(Surroundings around);
  std::uint32_t read(std::uint32_t offset) override;
  void write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) override;
  void reset() override { channels_ = {}; }
  /// DMAREQ_ID of an output channel.
  [[nodiscard]] std::uint32_t request_of(std::size_t channel) const;

 private:
  std::array<std::uint32_t, kChannels> channels_{};
};

class DmaG4 final : public Peripheral {
 public:
  /// `controller`: 1 or 2.
  DmaG4(Surroundings around, int controller, std::uint32_t base, Memory& memory, const Dmamux& mux);

  std::uint32_t read(std::uint32_t offset) override;
  void write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) override;
  void reset() override;

  /// A peripheral raises `request`: one item is moved at once where a channel listens; false: none does.
  bool serve(DmaRequest request);
  /// Access to the peripherals' registers, set by the chip.
  std::function<std::uint32_t(std::uint32_t address, int size)> bus_read;
  std::function<void(std::uint32_t address, std::uint32_t value, int size)> bus_write;
  /// Whether controller and multiplexer have their clocks, set by the chip.
  std::function<bool()> clocked;
  /// A channel was switched on: peripherals with a waiting request raise it again.
  std::function<void()> on_enable;

 private:
  static constexpr std::size_t kChannels = 8;
  struct Channel {
    std::uint32_t ccr = 0, cndtr = 0, cpar = 0, cmar = 0;
    std::uint32_t flags = 0;                   ///< bits of ISR for channel 1
    std::uint32_t reload = 0;                  ///< CNDTR when the channel was switched on
    std::uint32_t memory = 0, peripheral = 0;  ///< next addresses
  };
  void enable(std::size_t number);
  void check_route(std::size_t number);
  void write_ccr(std::size_t number, std::uint32_t value);
  void transfer(std::size_t number);
  void fail(std::size_t number, const std::string& why);
  void raise(std::size_t number, std::uint32_t flag);
  void update(std::size_t number);
  [[nodiscard]] bool move(std::size_t number);
  [[nodiscard]] std::uint32_t request_of(std::size_t number) const {
    return mux_.request_of(number + (controller_ == 1 ? 0 : kChannels));
  }
  [[nodiscard]] static std::string label(std::size_t number) { return "channel " + std::to_string(number + 1); }

  int controller_;
  Memory& memory_;
  const Dmamux& mux_;
  std::array<Channel, kChannels> channels_{};
};

}  // namespace tetap::board
