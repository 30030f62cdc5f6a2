// SPDX-License-Identifier: Apache-2.0
#include "hal/chip/zynqmp/can_timing.hpp"

#include <gtest/gtest.h>

namespace tetap::hal::zynqmp_r5 {
namespace {

struct Case {
  std::uint32_t reference_hz;
  std::uint32_t bit_rate;
  CanBitTiming timing;
};
constexpr Case kCases[] = {{100'000'000, 1'000'000, can_bit_timing(100'000'000, 1'000'000)},
                           {100'000'000, 500'000, can_bit_timing(100'000'000, 500'000)},
                           {100'000'000, 250'000, can_bit_timing(100'000'000, 250'000)},
                           {100'000'000, 125'000, can_bit_timing(100'000'000, 125'000)},
                           {24'000'000, 500'000, can_bit_timing(24'000'000, 500'000)},
                           {80'000'000, 1'000'000, can_bit_timing(80'000'000, 1'000'000)},
                           {8'000'000, 1'000'000, can_bit_timing(8'000'000, 1'000'000)},
                           {40'000'000, 10'000, can_bit_timing(40'000'000, 10'000)}};

TEST(CanTiming, GivesTheBitRateExactlyWithinTheWidthsOfTheFields) {
  for (const auto& [reference_hz, bit_rate, timing] : kCases) {
    EXPECT_EQ(reference_hz, bit_rate * timing.prescaler * timing.quanta());
    EXPECT_GE(timing.prescaler, 1U);
    EXPECT_LE(timing.prescaler, 256U);
    EXPECT_LE(timing.segment1, 16U);
    EXPECT_GE(timing.segment2, 2U);
    EXPECT_LE(timing.segment2, 8U);
    EXPECT_GE(timing.jump, 1U);
    EXPECT_LE(timing.jump, timing.segment2);
    EXPECT_LE(timing.jump, 4U);
  }
}

TEST(CanTiming, SamplesLateInTheBit) {
  for (const auto& [reference_hz, bit_rate, timing] : kCases) {
    const double sample_point = static_cast<double>(1 + timing.segment1) / timing.quanta();
    EXPECT_GE(sample_point, 0.68) << reference_hz << " at " << bit_rate;
    EXPECT_LE(sample_point, 0.875) << reference_hz << " at " << bit_rate;
  }
}

TEST(CanTiming, RegistersHoldOneLessThanEachValue) {
  // UG1087: BRPR[7:0] = BRP; BTR[8:7] = SJW, [6:4] = TS2, [3:0] = TS1.
  static constexpr CanBitTiming kTiming{.prescaler = 10, .segment1 = 16, .segment2 = 3, .jump = 3};
  static_assert(kTiming.brpr() == 9 && kTiming.btr() == (2U << 7 | 2U << 4 | 15U));
  EXPECT_EQ(kTiming.quanta(), 20U);
}

}  // namespace
}  // namespace tetap::hal::zynqmp_r5
