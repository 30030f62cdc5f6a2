// SPDX-License-Identifier: Apache-2.0
// Against the example of the paper (Aumasson and Bernstein 2012, appendix A) and against OpenSSL 3.0.19:
// openssl mac -macopt hexkey:000102..0f -macopt size:8 SIPHASH, messages of the bytes 0, 1, 2, ...
#include "tetap/base/siphash.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>

#include <gtest/gtest.h>

namespace tetap::base {
namespace {

constexpr SipKey kKey{0x03020100U, 0x07060504U, 0x0B0A0908U, 0x0F0E0D0CU};

constexpr std::uint64_t hash_of_first(std::size_t bytes) {
  SipHash hash(kKey);
  for (std::size_t i = 0; i < bytes; ++i) hash.add(static_cast<std::uint8_t>(i));
  return hash.finish();
}

static_assert(hash_of_first(15) == 0xA129CA6149BE45E5U, "the paper's");

/// As OpenSSL prints it: the least significant byte first.
std::uint64_t printed(std::uint64_t hash) { return __builtin_bswap64(hash); }

TEST(SipHash, IsThatOfOpenssl) {
  for (const auto& [bytes, expected] : {std::pair<std::size_t, std::uint64_t>{0, 0x310E0EDD47DB6F72U},
                                        {1, 0xFD67DC93C539F874U},
                                        {7, 0x37D1018BF50002ABU},
                                        {8, 0x6224939A79F5F593U},
                                        {15, 0xE545BE4961CA29A1U},
                                        {24, 0x94AF49F6C650ADB8U}})
    EXPECT_EQ(printed(hash_of_first(bytes)), expected) << bytes;
}

TEST(SipHash, AWordIsItsBytesFromTheLeastSignificantOn) {
  SipHash words(kKey), bytes(kKey);
  words.add_word(0x03020100U);
  words.add_word(0x07060504U);
  for (std::uint8_t i = 0; i < 8; ++i) bytes.add(i);
  EXPECT_EQ(words.finish(), bytes.finish());
}

}  // namespace
}  // namespace tetap::base
