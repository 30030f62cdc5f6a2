// SPDX-License-Identifier: Apache-2.0
// The integer sum of doubles against the host's own adder.

#include "hal/chip/support/double_sum.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

namespace tetap::hal {
namespace {

constexpr std::uint64_t kSign = std::uint64_t{1} << 63;

void expect_as_the_host(std::uint64_t a, std::uint64_t b) {
  const double sum = std::bit_cast<double>(a) + std::bit_cast<double>(b);
  const double difference = std::bit_cast<double>(a) - std::bit_cast<double>(b);
  constexpr std::uint64_t kNan = 0x7FF8'0000'0000'0000;
  ASSERT_EQ(double_sum(a, b), std::isnan(sum) ? kNan : std::bit_cast<std::uint64_t>(sum)) << std::hex << a << " " << b;
  ASSERT_EQ(double_difference(a, b), std::isnan(difference) ? kNan : std::bit_cast<std::uint64_t>(difference))
      << std::hex << a << " " << b;
}

TEST(DoubleSum, IsTheHostsOnEveryPairOfCorners) {
  std::vector<std::uint64_t> corners;
  for (const std::uint64_t exponent :
       {0U, 1U, 2U, 52U, 53U, 54U, 1022U, 1023U, 1024U, 1075U, 1076U, 2045U, 2046U, 2047U})
    for (const std::uint64_t fraction : {0x0ULL, 0x1ULL, 0x2ULL, 0x3ULL, 0x8'0000'0000'0000ULL, 0x8'0000'0000'0001ULL,
                                         0x7'FFFF'FFFF'FFFFULL, 0xF'FFFF'FFFF'FFFEULL, 0xF'FFFF'FFFF'FFFFULL})
      for (const std::uint64_t sign : {std::uint64_t{0}, kSign}) corners.push_back(sign | exponent << 52 | fraction);
  for (const std::uint64_t a : corners)
    for (const std::uint64_t b : corners) expect_as_the_host(a, b);
}

TEST(DoubleSum, IsTheHostsAtEveryDistanceOfExponents) {
  std::mt19937_64 random(7);
  for (std::uint64_t apart = 0; apart <= 70; ++apart)
    for (int i = 0; i < 20'000; ++i) {
      const std::uint64_t exponent = 1 + random() % 1900;
      const std::uint64_t shape = random();  // often long runs of equal bits, where roundings meet ties
      const std::uint64_t a = (random() & random() & random()) << 12 >> 12;
      const std::uint64_t b =
          ((shape & 1) != 0 ? ~(random() & random() & random()) : random() << (shape % 52)) << 12 >> 12;
      expect_as_the_host((random() & kSign) | (exponent + apart) << 52 | a, (random() & kSign) | exponent << 52 | b);
    }
}

TEST(DoubleSum, IsTheHostsOnEveryKindOfEncoding) {
  std::mt19937_64 random(8);
  for (int i = 0; i < 1'000'000; ++i) expect_as_the_host(random(), random());
}

}  // namespace
}  // namespace tetap::hal
