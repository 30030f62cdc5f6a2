// SPDX-License-Identifier: Apache-2.0
// Bit timing of the ZynqMP CAN controller, worked out by the compiler. UG1085 chapter "CAN Controller", section "Time
// Quanta Clock": bit rate = reference clock / ((BRP + 1) (3 + TS1 + TS2)); UG1087 CAN registers BRPR and BTR give the
// widths of the fields.
#pragma once

#include <cstdint>

namespace tetap::hal::zynqmp_r5 {

struct CanBitTiming {
  std::uint32_t prescaler = 0;  ///< reference clocks per time quantum
  std::uint32_t segment1 = 0;   ///< quanta before the sample point, without the synchronisation quantum
  std::uint32_t segment2 = 0;   ///< quanta after it
  std::uint32_t jump = 0;       ///< synchronisation jump width, quanta

  [[nodiscard]] constexpr std::uint32_t quanta() const { return 1 + segment1 + segment2; }
  [[nodiscard]] constexpr std::uint32_t brpr() const { return prescaler - 1; }
  [[nodiscard]] constexpr std::uint32_t btr() const { return (jump - 1) << 7 | (segment2 - 1) << 4 | (segment1 - 1); }

  friend constexpr bool operator==(const CanBitTiming&, const CanBitTiming&) = default;
};

namespace detail {
// Not constexpr on purpose: the compiler names this function when a bit rate cannot be had exactly from the clock.
inline void no_exact_bit_timing_for_this_clock() {}
}  // namespace detail

/// The exact timing with the sample point nearest to, and not above, 87.5 % (CiA 301). It has at least two quanta after
/// that point and as many quanta as possible. No exact timing is a compile error.
[[nodiscard]] consteval CanBitTiming can_bit_timing(std::uint32_t reference_hz, std::uint32_t bit_rate) {
  constexpr std::uint32_t kMaxSegment1 = 16, kMaxSegment2 = 8, kMaxJump = 4, kMaxPrescaler = 256, kMinQuanta = 8;
  for (std::uint32_t quanta = 1 + kMaxSegment1 + kMaxSegment2; quanta >= kMinQuanta; --quanta) {
    if (reference_hz % (bit_rate * quanta) != 0) continue;
    const std::uint32_t prescaler = reference_hz / (bit_rate * quanta);
    if (prescaler > kMaxPrescaler) continue;
    std::uint32_t segment1 = quanta * 7 / 8 - 1;
    if (segment1 > kMaxSegment1) segment1 = kMaxSegment1;
    if (quanta - 1 - segment1 < 2) segment1 = quanta - 3;
    const std::uint32_t segment2 = quanta - 1 - segment1;
    if (segment2 > kMaxSegment2) continue;
    return {.prescaler = prescaler,
            .segment1 = segment1,
            .segment2 = segment2,
            .jump = segment2 < kMaxJump ? segment2 : kMaxJump};
  }
  detail::no_exact_bit_timing_for_this_clock();
  return {};
}

}  // namespace tetap::hal::zynqmp_r5
