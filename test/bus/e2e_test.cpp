// SPDX-License-Identifier: Apache-2.0
// Faults that the protection must notice: every damaged bit, a payload under another id, a frame sent twice or lost.
#include "tetap/bus/e2e.hpp"
#include "tetap/bus/messages.hpp"

#include <array>
#include <cstdint>

#include <gtest/gtest.h>

namespace tetap::bus {
namespace {

static_assert(Protected<CmdReset> && Protected<CmdSetPos> && Protected<CmdSetYaw> && Protected<EstStatus>);
static_assert(!Protected<EstStateCrc> && !Protected<InSync>);
static_assert(e2e_valid(CmdReset::kOffset, encode(protect(CmdReset{.ctr = 3, .what = ResetWhat::kCounters}))));

template <class M>
class ProtectedMessage : public testing::Test {};
using ProtectedMessages = testing::Types<CmdReset, CmdSetPos, CmdSetYaw, EstStatus>;
TYPED_TEST_SUITE(ProtectedMessage, ProtectedMessages);

TYPED_TEST(ProtectedMessage, IsRefusedWhenAnyOneOrTwoBitsAreFlipped) {
  const Payload good = encode(protect(TypeParam{.ctr = 9}));
  ASSERT_TRUE(e2e_valid(TypeParam::kOffset, good));
  for (std::size_t a = 0; a < 64; ++a) {
    for (std::size_t b = a; b < 64; ++b) {
      Payload bad = good;
      bad[a / 8] = static_cast<std::uint8_t>(bad[a / 8] ^ (1U << (a % 8)));
      if (b != a) bad[b / 8] = static_cast<std::uint8_t>(bad[b / 8] ^ (1U << (b % 8)));
      ASSERT_FALSE(e2e_valid(TypeParam::kOffset, bad)) << "bits " << a << ' ' << b;
    }
  }
}

TYPED_TEST(ProtectedMessage, IsRefusedUnderAnyOtherIdOfTheBlock) {
  const Payload good = encode(protect(TypeParam{.ctr = 9}));
  for (std::uint8_t offset = 0; offset < kBlock; ++offset)
    EXPECT_EQ(e2e_valid(offset, good), offset == TypeParam::kOffset);
}

TYPED_TEST(ProtectedMessage, IsRefusedWhenShorter) {
  const Payload good = encode(protect(TypeParam{}));
  for (std::size_t size = 0; size < good.size(); ++size)
    EXPECT_FALSE(e2e_valid(TypeParam::kOffset, std::span(good).first(size)));
}

TEST(Protection, CoversTheOffsetThenBytesOneToSeven) {
  // The check value's input "123456789" is eight bytes and an offset: '1' as the offset, '2'..'8' as bytes 1 to 7, and
  // one more to come.
  const Payload digits{0, '2', '3', '4', '5', '6', '7', '8'};
  base::Crc8H2f crc;
  for (const char digit : {'1', '2', '3', '4', '5', '6', '7', '8'}) crc.add(static_cast<std::uint8_t>(digit));
  EXPECT_EQ(e2e_crc('1', digits), crc.value());
  crc.add('9');
  EXPECT_EQ(crc.value(), 0xDF);
}

}  // namespace
}  // namespace tetap::bus
