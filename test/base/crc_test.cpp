// SPDX-License-Identifier: Apache-2.0
// Check values over "123456789": CRC-32/ISO-HDLC and AUTOSAR CP SWS_CRCLibrary (CRC-16, CRC-8 H2F).
#include "tetap/base/crc.hpp"

#include <array>
#include <cstdint>
#include <span>

#include <gtest/gtest.h>

namespace tetap::base {
namespace {

constexpr std::array<std::uint8_t, 9> kDigits{'1', '2', '3', '4', '5', '6', '7', '8', '9'};

template <class Crc>
constexpr auto crc_of(std::span<const std::uint8_t> bytes) {
  Crc crc;
  crc.add(bytes);
  return crc.value();
}

static_assert(crc_of<Crc32>(kDigits) == 0xCBF43926U);
static_assert(crc_of<Crc16>(kDigits) == 0x29B1);
static_assert(crc_of<Crc8H2f>(kDigits) == 0xDF);

/// Bit by bit, most significant first, on mirrored data: another way to the same numbers than the nibble tables.
std::uint32_t crc32_by_bits(std::span<const std::uint8_t> bytes) {
  std::uint32_t crc = 0xFFFFFFFFU;
  for (const unsigned byte : bytes) {
    for (int bit = 0; bit < 8; ++bit) {
      const std::uint32_t in = (byte >> bit) & 1U;
      crc = (crc << 1) ^ (((crc >> 31) ^ in) != 0 ? 0x04C11DB7U : 0U);
    }
  }
  std::uint32_t mirrored = 0;
  for (int bit = 0; bit < 32; ++bit) mirrored |= ((crc >> bit) & 1U) << (31 - bit);
  return ~mirrored;
}

TEST(Crc, HasThePublishedCheckValuesAtRunTimeToo) {
  EXPECT_EQ(crc_of<Crc32>(kDigits), 0xCBF43926U);
  EXPECT_EQ(crc_of<Crc8H2f>(kDigits), 0xDF);
}

TEST(Crc, OfNothingIsZero) {
  EXPECT_EQ(Crc32{}.value(), 0U);
  EXPECT_EQ(Crc8H2f{}.value(), 0U);
}

TEST(Crc, EqualsTheBitwiseDefinitionForEveryByteInTwoPlaces) {
  for (unsigned byte = 0; byte < 256; ++byte) {
    const std::array<std::uint8_t, 3> data{static_cast<std::uint8_t>(byte), 0x5A,
                                           static_cast<std::uint8_t>(~byte & 0xFFU)};
    ASSERT_EQ(crc_of<Crc32>(data), crc32_by_bits(data)) << byte;
  }
}

TEST(Crc, GoesOnFromAnEarlierValue) {
  for (std::size_t cut = 0; cut <= kDigits.size(); ++cut) {
    Crc32 first;
    first.add(std::span(kDigits).first(cut));
    Crc32 rest(first.value());
    rest.add(std::span(kDigits).subspan(cut));
    EXPECT_EQ(rest.value(), 0xCBF43926U) << cut;
  }
}

}  // namespace
}  // namespace tetap::base
