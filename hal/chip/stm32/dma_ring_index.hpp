// SPDX-License-Identifier: Apache-2.0
// How many bytes a circular DMA stream has written since its start, from its counter and the transfers it completed.
// RM0402 chapter "DMA controller", section "Circular mode": NDTR counts down from the ring's size, reloads after 0, and
// TCIF is set there.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tetap::hal::stm32 {

template <std::size_t Size>
class DmaRingIndex {
 public:
  static_assert(Size > 1 && Size <= 0xFFFF, "NDTR has 16 bits");

  constexpr void restart() { rounds_ = position_ = 0; }

  /// Bytes since restart(), modulo 2^32. `rounds`: transfers completed, as the interrupt counted them; `left`: NDTR,
  /// read after `rounds`. The interrupt may lag behind the counter by less than a round.
  [[nodiscard]] constexpr std::uint32_t update(std::uint32_t rounds, std::uint32_t left) {
    const auto size = static_cast<std::uint32_t>(Size);
    const std::uint32_t position = left == 0 || left >= size ? 0 : size - left;
    // The counter went back although no round is counted: the interrupt of that round is still to come.
    std::uint32_t whole = rounds;
    if (whole == rounds_ && position < position_) ++whole;
    if (static_cast<std::int32_t>(whole - rounds_) < 0) whole = rounds_;
    rounds_ = whole;
    position_ = position;
    return whole * size + position;
  }

 private:
  std::uint32_t rounds_ = 0;
  std::uint32_t position_ = 0;
};

}  // namespace tetap::hal::stm32
