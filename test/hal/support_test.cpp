// SPDX-License-Identifier: Apache-2.0
#include "hal/board/mps2/candump_line.hpp"
#include "hal/chip/support/text.hpp"

#include <gtest/gtest.h>

#include <string_view>

namespace tetap::hal {
namespace {

std::optional<base::CanFrame> parse(std::string_view line) { return mps2::parse_candump(line.data(), line.size()); }

TEST(CandumpLine, AStandardAndAnExtendedFrame) {
  EXPECT_EQ(parse("(1795230476.709112) vcan0 123#EFBEADDE"),
            (base::CanFrame{.id = 0x123, .size = 4, .data = {0xEF, 0xBE, 0xAD, 0xDE}}));
  EXPECT_EQ(parse("(0.0) can1 1ABCDEF0#0102030405060708\r"),
            (base::CanFrame{.id = 0x1ABC'DEF0, .extended = true, .size = 8, .data = {1, 2, 3, 4, 5, 6, 7, 8}}));
  EXPECT_EQ(parse("(0.0) can1 7ff# T"), (base::CanFrame{.id = 0x7FF}));
}

TEST(CandumpLine, WhatIsNotADataFrameIsRefused) {
  for (const char* line :
       {"", " ", "(1.0)", "(1.0) vcan0", "(1.0) vcan0 ", "(1.0) vcan0 123", "(1.0) vcan0 123#R", "(1.0) vcan0 123#R4",
        "(1.0) vcan0 123##1AABB", "(1.0) vcan0 12#00", "(1.0) vcan0 1234#00", "(1.0) vcan0 800#00",
        "(1.0) vcan0 20000000#00", "(1.0) vcan0 123#0", "(1.0) vcan0 123#001", "(1.0) vcan0 123#GG",
        "(1.0) vcan0 123#001122334455667788", "123#0011", "# a comment line here"}) {
    EXPECT_EQ(parse(line), std::nullopt) << line;
  }
}

TEST(CandumpLine, EveryCutOfALineIsSafe) {
  const std::string_view line = "(1795230476.709112) vcan0 12345678#EFBEADDE01020304";
  for (std::size_t size = 0; size < line.size(); ++size) static_cast<void>(mps2::parse_candump(line.data(), size));
  EXPECT_TRUE(parse(line).has_value());
}

TEST(Text, NumbersAsPeopleWriteThem) {
  EXPECT_STREQ(Text<>{}.add("a ").dec(0).add(' ').dec(4'294'967'295U).add(' ').hex(0xBEEF).c_str(),
               "a 0 4294967295 0000beef");
}

TEST(Text, WhatDoesNotFitIsCut) {
  EXPECT_STREQ(Text<8>{}.add("12345").hex(0xFFFF'FFFF).add("more").c_str(), "12345fff");
}

}  // namespace
}  // namespace tetap::hal
