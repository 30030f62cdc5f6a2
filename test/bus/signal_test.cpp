// SPDX-License-Identifier: Apache-2.0
// Bits of one signal against a bit-by-bit reference; values against the range of the signal.
#include "tetap/bus/signal.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace tetap::bus {
namespace {

constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kHuge = std::numeric_limits<float>::max();
constexpr Signal kSpeed{.start = 26, .length = 19, .is_signed = true, .has_gap = true, .per_unit = 10000};
constexpr Signal kSigma{.start = 34, .length = 16, .has_gap = true, .per_unit = 500};

// Everything works in constant expressions, with the values that overflow a float product too.
static_assert(to_steps<kSpeed>(1.5F) == 15000 && to_steps<kSpeed>(-1.5F) == -15000);
static_assert(to_steps<kSpeed>(kHuge) == 262143 && to_steps<kSpeed>(-kHuge) == -262143);
static_assert(to_steps<kSpeed>(kInf) == 262143 && to_steps<kSpeed>(-kInf) == -262143);
static_assert(to_steps<kSpeed>(kNan) == -262144);
static_assert(to_steps<kSigma>(kInf) == 65534 && to_steps<kSigma>(-1.0F) == 0 && to_steps<kSigma>(kNan) == 65535);
static_assert(kSpeed.get(kSpeed.put(-262144)) == -262144);

std::int64_t bit_by_bit(std::uint64_t word, unsigned start, unsigned length, bool is_signed) {
  std::int64_t value = 0;
  for (unsigned i = 0; i < length; ++i) {
    const auto bit = static_cast<std::int64_t>((word >> (start + i)) & 1U);
    const bool sign = is_signed && i == length - 1;
    value += sign ? -bit * (std::int64_t{1} << i) : bit * (std::int64_t{1} << i);
  }
  return value;
}

TEST(SignalBits, EqualABitByBitReadingWhereverTheSignalIs) {
  std::mt19937_64 random(1);
  for (std::uint8_t start = 0; start < 64; ++start) {
    for (std::uint8_t length = 1; length <= 63 && start + length <= 64; ++length) {
      for (const bool is_signed : {false, true}) {
        const Signal signal{.start = start, .length = length, .is_signed = is_signed};
        const std::uint64_t word = random();
        ASSERT_EQ(signal.get(word), bit_by_bit(word, start, length, is_signed)) << int{start} << '|' << int{length};
        ASSERT_EQ(signal.put(signal.get(word)), word & (signal.mask() << start));
      }
    }
  }
}

TEST(SignalRange, EndsOneStepBeforeTheCodeForNotAvailable) {
  EXPECT_EQ((Signal{.length = 8, .has_gap = true}.highest()), 254);
  EXPECT_EQ((Signal{.length = 8, .has_gap = true}.gap()), 255);
  EXPECT_EQ((Signal{.length = 8}.highest()), 255);
  EXPECT_EQ((Signal{.length = 8, .is_signed = true, .has_gap = true}.lowest()), -127);
  EXPECT_EQ((Signal{.length = 8, .is_signed = true, .has_gap = true}.gap()), -128);
  EXPECT_EQ((Signal{.length = 8, .is_signed = true}.lowest()), -128);
}

TEST(SignalRounding, IsToNearestWithHalvesAwayFromZero) {
  EXPECT_EQ(nearest(0.49999997F), 0);  // adding 0.5 first would give 1
  EXPECT_EQ(nearest(0.5F), 1);
  EXPECT_EQ(nearest(-0.5F), -1);
  EXPECT_EQ(nearest(2.5F), 3);
  EXPECT_EQ(nearest(8388607.5F), 8388608);
  EXPECT_EQ(nearest(8388609.0F), 8388609);  // adding 0.5 first would give 8388610
  EXPECT_EQ(nearest(-16777215.0F), -16777215);
}

TEST(SignalValues, NeverWrapAndNeverLookLikeNotAvailableHoweverLarge) {
  std::mt19937_64 random(2);
  for (int i = 0; i < 1'000'000; ++i) {
    const float value = std::bit_cast<float>(static_cast<std::uint32_t>(random()));
    const std::int64_t speed = to_steps<kSpeed>(value);
    const std::int64_t sigma = to_steps<kSigma>(value);
    if (std::isnan(value)) {
      ASSERT_EQ(speed, kSpeed.gap());
      ASSERT_EQ(sigma, kSigma.gap());
      continue;
    }
    // Half a step, and half a unit in the last place of the float product.
    ASSERT_NEAR(static_cast<double>(speed), std::clamp(static_cast<double>(value) * 1e4, -262143.0, 262143.0),
                0.5 + 1.0 / 64)
        << value;
    ASSERT_NEAR(static_cast<double>(sigma), std::clamp(static_cast<double>(value) * 500.0, 0.0, 65534.0),
                0.5 + 1.0 / 256)
        << value;
  }
}

TEST(SignalValues, DecodeToTheFloatNearestToTheDecimalValue) {
  for (std::int64_t steps = kSpeed.lowest(); steps <= kSpeed.highest(); ++steps) {
    const auto value = from_steps<kSpeed, float>(steps);
    ASSERT_EQ(std::bit_cast<std::uint32_t>(value),
              std::bit_cast<std::uint32_t>(static_cast<float>(static_cast<double>(steps) / 1e4)));
  }
}

TEST(SignalValues, NotAvailableIsOneCanonicalNaN) {
  EXPECT_EQ(std::bit_cast<std::uint32_t>(from_steps<kSpeed, float>(kSpeed.gap())), 0x7FC00000U);
}

TEST(SignalIntegers, SaturateUnlessTheirLowBitsAreTheirMeaning) {
  constexpr Signal kClips{.start = 36, .length = 4};
  constexpr Signal kSequence{.start = 20, .length = 4, .wraps = true};
  constexpr Signal kSatellites{.start = 54, .length = 6, .has_gap = true};
  EXPECT_EQ(to_steps<kClips>(std::uint8_t{15}), 15);
  EXPECT_EQ(to_steps<kClips>(std::uint8_t{200}), 15);
  EXPECT_EQ(kSequence.get(kSequence.put(to_steps<kSequence>(std::uint8_t{18}))), 2);
  EXPECT_EQ(to_steps<kSatellites>(std::uint8_t{62}), 62);
  EXPECT_EQ(to_steps<kSatellites>(std::uint8_t{63}), 62);
  EXPECT_EQ(to_steps<kSatellites>(std::uint8_t{255}), 63);
  EXPECT_EQ((from_steps<kSatellites, std::uint8_t>(63)), 255);
}

TEST(SignalIntegers, OfWideSignedSignalsHaveTheSmallestNumberForNotAvailable) {
  constexpr Signal kEast{.start = 0, .length = 28, .is_signed = true, .has_gap = true};
  constexpr std::int32_t kNone = std::numeric_limits<std::int32_t>::min();
  EXPECT_EQ(to_steps<kEast>(kNone), -(1 << 27));
  EXPECT_EQ(to_steps<kEast>(kNone + 1), -(1 << 27) + 1);
  EXPECT_EQ(to_steps<kEast>(std::numeric_limits<std::int32_t>::max()), (1 << 27) - 1);
  EXPECT_EQ((from_steps<kEast, std::int32_t>(-(1 << 27))), kNone);
}

TEST(SignalWords, AreLittleEndian) {
  const Payload payload = bytes(0x0807060504030201ULL);
  EXPECT_EQ(payload, (Payload{1, 2, 3, 4, 5, 6, 7, 8}));
  EXPECT_EQ(word(payload), 0x0807060504030201ULL);
  EXPECT_EQ(word(std::span(payload).first(3)), 0x030201ULL);
}

}  // namespace
}  // namespace tetap::bus
