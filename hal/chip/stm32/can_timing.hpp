// SPDX-License-Identifier: Apache-2.0
// Bit timing of bxCAN and FDCAN, worked out by the compiler. RM0402 chapter "Controller area network (bxCAN)", section
// "Bit timing": one quantum is (BRP + 1) clocks of APB1; the bit is 1 + (TS1 + 1) + (TS2 + 1) quanta.
#pragma once

#include "hal/chip/stm32/registers_stm32f412.hpp"

#include <cstdint>

namespace tetap::hal::stm32 {

struct CanBitTiming {
  std::uint32_t prescaler = 0;  ///< clocks of APB1 per time quantum
  std::uint32_t segment1 = 0;   ///< quanta before the sample point, without the synchronisation quantum
  std::uint32_t segment2 = 0;   ///< quanta after it
  std::uint32_t jump = 0;       ///< resynchronisation jump width, quanta

  [[nodiscard]] constexpr std::uint32_t quanta() const { return 1 + segment1 + segment2; }
  /// Sample point, in thousandths of the bit.
  [[nodiscard]] constexpr std::uint32_t sample_point_permille() const { return 1000 * (1 + segment1) / quanta(); }
  [[nodiscard]] constexpr std::uint32_t btr() const {
    namespace btr = stm32f412::can::btr;
    return btr::kBrp(prescaler - 1) | btr::kTs1(segment1 - 1) | btr::kTs2(segment2 - 1) | btr::kSjw(jump - 1);
  }

  friend constexpr bool operator==(const CanBitTiming&, const CanBitTiming&) = default;
};

/// The longest that the fields of a controller hold.
struct CanTimingLimits {
  std::uint32_t prescaler = 1U << stm32f412::can::btr::kBrp.width;
  std::uint32_t segment1 = 1U << stm32f412::can::btr::kTs1.width;
  std::uint32_t segment2 = 1U << stm32f412::can::btr::kTs2.width;
  std::uint32_t jump = 1U << stm32f412::can::btr::kSjw.width;
};

namespace detail {
// Not constexpr on purpose: the compiler names this function when no timing samples the bit at 87.5 % exactly.
inline void no_bit_timing_with_the_sample_point_of_cia_301() {}
}  // namespace detail

/// The timing that gives the bit rate exactly and samples at 87.5 % (CiA 301), with as many quanta as possible; none is
/// a compile error.
[[nodiscard]] consteval CanBitTiming can_bit_timing(std::uint32_t clock_hz, std::uint32_t bit_rate,
                                                    CanTimingLimits most = {}) {
  for (std::uint32_t quanta = 1 + most.segment1 + most.segment2; quanta >= 8; --quanta) {
    if (quanta % 8 != 0 || clock_hz % (bit_rate * quanta) != 0) continue;
    const std::uint32_t prescaler = clock_hz / (bit_rate * quanta);
    const std::uint32_t segment2 = quanta / 8;
    const std::uint32_t segment1 = quanta - 1 - segment2;
    if (prescaler > most.prescaler || segment1 > most.segment1 || segment2 > most.segment2) continue;
    return {.prescaler = prescaler,
            .segment1 = segment1,
            .segment2 = segment2,
            .jump = segment2 < most.jump ? segment2 : most.jump};
  }
  detail::no_bit_timing_with_the_sample_point_of_cia_301();
  return {};
}

}  // namespace tetap::hal::stm32
