// SPDX-License-Identifier: Apache-2.0
// A channel of the G4's DMA controller with the request that DMAMUX routes to it, in the shape of DmaStream. RM0440
// chapters "Direct memory access controller (DMA)", "DMA request multiplexer (DMAMUX)".
#pragma once

#include "hal/chip/stm32/registers_stm32g474.hpp"
#include "hal/chip/stm32/serial_port.hpp"

#include <cstdint>

namespace tetap::hal::stm32 {

namespace channel = stm32g474::dma;
namespace dmamux = stm32g474::dmamux;

template <class Registers>
class DmaChannel {
 public:
  /// `number`: of DMA1, 0 for channel 1, which is also DMAMUX's number. `request`: RM0440, table "DMAMUX: assignment of
  /// multiplexer inputs to resources".
  constexpr DmaChannel(Registers registers, Registers multiplexer, std::uint32_t number, std::uint32_t request)
      : registers_{registers}, multiplexer_{multiplexer}, number_{number}, request_{request} {}

  /// Bytes between the peripheral's data register and memory, `count` of them, again and again when `circular`.
  void start(DmaDirection direction, std::uint32_t peripheral, std::uint32_t memory, std::uint32_t count,
             bool circular) const {
    stop();
    multiplexer_.write(dmamux::cxcr::kOffset + number_ * dmamux::cxcr::kStride, dmamux::cxcr::kDmareqId(request_));
    write(channel::cparx::kOffset, peripheral);
    write(channel::cmarx::kOffset, memory);
    write(channel::cndtrx::kOffset, count);
    constexpr std::uint32_t kHighPriority = 2;
    const std::uint32_t setup = channel::ccrx::kPl(kHighPriority) | channel::ccrx::kMinc.mask() |
                                channel::ccrx::kDir(static_cast<std::uint32_t>(direction)) |
                                (circular ? channel::ccrx::kCirc.mask() | channel::ccrx::kTcie.mask() : 0);
    write(channel::ccrx::kOffset, setup);
    write(channel::ccrx::kOffset, setup | channel::ccrx::kEn.mask());
  }

  /// The flags of the last transfer go, too.
  void stop() const {
    write(channel::ccrx::kOffset, 0);
    clear_flags(channel::ifcr::kGif1.mask() | channel::ifcr::kTcif1.mask() | channel::ifcr::kHtif1.mask() |
                channel::ifcr::kTeif1.mask());
  }

  [[nodiscard]] std::uint32_t left() const {
    return channel::cndtrx::kNdt.of(registers_.read(channel::cndtrx::kOffset + number_ * channel::cndtrx::kStride));
  }
  [[nodiscard]] bool completed() const {
    return channel::isr::kTcif1.of(registers_.read(channel::isr::kOffset) >> shift()) != 0;
  }
  void clear_completed() const { clear_flags(channel::ifcr::kTcif1.mask()); }

 private:
  /// Flags of a channel from those of channel 1.
  [[nodiscard]] constexpr std::uint32_t shift() const {
    return number_ * (channel::ifcr::kGif2.lsb - channel::ifcr::kGif1.lsb);
  }
  void clear_flags(std::uint32_t flags) const { registers_.write(channel::ifcr::kOffset, flags << shift()); }
  void write(std::uint32_t offset, std::uint32_t value) const {
    registers_.write(offset + number_ * channel::ccrx::kStride, value);
  }

  Registers registers_, multiplexer_;
  std::uint32_t number_;
  std::uint32_t request_;
};

}  // namespace tetap::hal::stm32
