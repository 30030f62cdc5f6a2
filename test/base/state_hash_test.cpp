// SPDX-License-Identifier: Apache-2.0
// Changes that the hash of a state has to notice: one bit, an exchange, a word more. Its value is the same everywhere.
#include "tetap/base/state_hash.hpp"

#include <array>
#include <bit>
#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace tetap::base {
namespace {

std::uint32_t hash_of(const std::vector<std::uint32_t>& words) {
  StateHash hash;
  for (const std::uint32_t word : words) hash(word);
  return hash.value();
}
/// Numbers of a state: many zeros, small integers and floats near each other.
std::vector<std::uint32_t> state() {
  std::vector<std::uint32_t> words;
  for (std::uint32_t i = 0; i < 120; ++i)
    words.push_back(i % 3 == 0   ? 0U
                    : i % 3 == 1 ? i
                                 : std::bit_cast<std::uint32_t>(1.0F + 1e-6F * static_cast<float>(i)));
  return words;
}

TEST(StateHash, EveryFlippedBitChangesTheValueAndNoTwoFlipsAreAlike) {
  const std::vector<std::uint32_t> given = state();
  std::set<std::uint32_t> seen{hash_of(given)};
  for (std::size_t at = 0; at < given.size(); ++at)
    for (unsigned bit = 0; bit < 32; ++bit) {
      std::vector<std::uint32_t> other = given;
      other[at] ^= std::uint32_t{1} << bit;
      ASSERT_TRUE(seen.insert(hash_of(other)).second) << "word " << at << ", bit " << bit;
    }
}

TEST(StateHash, AFlippedBitChangesHalfOfTheValueInTheMean) {
  const std::vector<std::uint32_t> given = state();
  const std::uint32_t before = hash_of(given);
  double changed = 0;
  int flips = 0;
  for (std::size_t at = 0; at < given.size(); ++at)
    for (unsigned bit = 0; bit < 32; ++bit, ++flips) {
      std::vector<std::uint32_t> other = given;
      other[at] ^= std::uint32_t{1} << bit;
      changed += std::popcount(before ^ hash_of(other));
    }
  EXPECT_NEAR(changed / flips, 16.0, 0.5);
}

TEST(StateHash, ARunIsItsWordsOneByOne) {
  const std::vector<std::uint32_t> given = state();
  StateHash hash;
  hash.run(given.data(), given.size());
  EXPECT_EQ(hash.value(), hash_of(given));
}

TEST(StateHash, ExchangedWordsAndLeadingOrTrailingZerosCount) {
  const std::vector<std::uint32_t> given = state();
  std::set<std::uint32_t> seen{hash_of(given)};
  for (std::size_t at = 0; at + 1 < given.size(); ++at) {
    std::vector<std::uint32_t> other = given;
    std::swap(other[at], other[at + 1]);
    ASSERT_TRUE(seen.insert(hash_of(other)).second) << at;
  }
  std::vector<std::uint32_t> zeros;
  for (int count = 0; count < 50; ++count) {
    ASSERT_TRUE(seen.insert(hash_of(zeros)).second) << count;
    zeros.push_back(0);
  }
}

TEST(StateHash, NumbersAreTheirBitsLeastSignificantWordFirst) {
  StateHash numbers, words;
  numbers(-0.0F);
  numbers(std::int32_t{-2});
  numbers(std::int64_t{0x0123'4567'89AB'CDEF});
  for (const std::uint32_t word : {0x8000'0000U, 0xFFFF'FFFEU, 0x89AB'CDEFU, 0x0123'4567U}) words(word);
  EXPECT_EQ(numbers.value(), words.value());
}

// A recording that was made by one version is compared with a replay by another: the value may not change unseen.
TEST(StateHash, KeepsItsValue) { EXPECT_EQ(hash_of({1, 2, 3}), 0x49764487U); }

}  // namespace
}  // namespace tetap::base
