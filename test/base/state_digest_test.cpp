// SPDX-License-Identifier: Apache-2.0
// A digest shows a differing bit of an update at once, of the memory within one round, and never forgets it.
#include "tetap/base/state_digest.hpp"
#include "tetap/base/float_bits.hpp"

#include <gtest/gtest.h>
#include <array>

namespace tetap::base {
namespace {

constexpr std::size_t kSize = 101, kPart = 16, kRound = (kSize + kPart - 1) / kPart;

struct Memory {
  std::array<float, kSize> words{};
  StateDigest digest;

  void tick() {
    digest.scan(kSize, kPart, [&](std::size_t i, auto& sink) { sink(words[i]); });
  }
};

TEST(StateDigest, EachBitOfTheMemoryShowsWithinOneRoundAndStays) {
  for (std::size_t at = 0; at < kSize; ++at)
    for (const std::uint32_t bit : {0U, 13U, 31U}) {
      Memory a, b;
      for (std::size_t k = 0; k < at % kRound; ++k) a.tick(), b.tick();
      ASSERT_EQ(a.digest.value(), b.digest.value());
      b.words[at] = from_bits(bits(b.words[at]) ^ (1U << bit));
      std::size_t ticks = 0;
      do {
        a.tick(), b.tick();
        ++ticks;
      } while (a.digest.value() == b.digest.value() && ticks <= 2 * kRound);
      EXPECT_LE(ticks, kRound) << "word " << at << " bit " << bit;
      b.words[at] = a.words[at];
      for (int k = 0; k < 3; ++k) a.tick(), b.tick();
      EXPECT_NE(a.digest.value(), b.digest.value()) << "word " << at << " bit " << bit;
    }
}

TEST(StateDigest, AnUpdateShowsAtOnce) {
  Memory a, b;
  a.digest.update(1.0F, std::uint32_t{7});
  b.digest.update(1.0F, std::uint32_t{7});
  EXPECT_EQ(a.digest.value(), b.digest.value());
  a.digest.update(2.0F);
  b.digest.update(-2.0F);
  EXPECT_NE(a.digest.value(), b.digest.value());
}

TEST(StateDigest, AMemoryThatShrinksIsScannedFromItsBeginning) {
  StateDigest digest;
  std::array<int, 8> seen{};
  const auto count = [&](std::size_t i, auto&) { ++seen[i]; };
  digest.scan(8, 6, count);
  digest.scan(4, 6, count);  // fewer elements than a part: each once
  for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(seen[i], i < 4 ? 2 : i < 6 ? 1 : 0) << i;
  digest.scan(0, 6, count);
  EXPECT_LT(digest.next(), 8U);
}

}  // namespace
}  // namespace tetap::base
