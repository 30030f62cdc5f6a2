// SPDX-License-Identifier: Apache-2.0
// The model's bytes are those of the manual's printed packet, and points leave as the manual times them.
#include "sim_host/emulator/ld19_scanner.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace tetap::board {
namespace {

// LD19 development manual, sec. 3.3: the bytes and the values that the manual reads from them.
const std::vector<std::uint8_t> kPrinted{0x54, 0x2C, 0x68, 0x08, 0xAB, 0x7E, 0xE0, 0x00, 0xE4, 0xDC, 0x00, 0xE2,
                                         0xD9, 0x00, 0xE5, 0xD5, 0x00, 0xE3, 0xD3, 0x00, 0xE4, 0xD0, 0x00, 0xE9,
                                         0xCD, 0x00, 0xE4, 0xCA, 0x00, 0xE2, 0xC7, 0x00, 0xE9, 0xC5, 0x00, 0xE5,
                                         0xC2, 0x00, 0xE5, 0xC0, 0x00, 0xE5, 0xBE, 0x82, 0x3A, 0x1A, 0x50};

TEST(Ld19Scanner, PacketIsThatOfTheManual) {
  const Ld19Packet packet{.speed_degps = 2152,
                          .start_cdeg = 32427,
                          .end_cdeg = 33470,
                          .points = {{{224, 228},
                                      {220, 226},
                                      {217, 229},
                                      {213, 227},
                                      {211, 228},
                                      {208, 233},
                                      {205, 228},
                                      {202, 226},
                                      {199, 233},
                                      {197, 229},
                                      {194, 229},
                                      {192, 229}}},
                          .stamp_ms = 6714};
  EXPECT_EQ(packet.bytes(), kPrinted);
}

TEST(Ld19Scanner, PacketLeavesAfterItsLastPointAtTheManualsRate) {
  Ld19Scanner scanner;
  std::int64_t first_cdeg = scanner.next_angle_cdeg(), last_cdeg = 0;
  for (int point = 0; point < 12; ++point) {
    EXPECT_EQ(scanner.next_byte(0).begin, kNever);
    last_cdeg = scanner.next_angle_cdeg();
    scanner.measure(2.5, kSecond);
  }
  // 4 500 points and 10 turns a second: 0.8 deg between two, 11 / 4 500 s from the first to the last.
  EXPECT_EQ(last_cdeg - first_cdeg, 11 * 80);
  Picoseconds now = 0;
  std::vector<std::uint8_t> sent;
  for (auto byte = scanner.next_byte(now); byte.begin != kNever; byte = scanner.next_byte(now)) {
    EXPECT_EQ(byte.baud, 230'400);
    EXPECT_GE(byte.begin, kSecond + 2'444 * kMicrosecond);
    now = byte.begin + periods(10, byte.baud);
    sent.push_back(byte.byte);
  }
  ASSERT_EQ(sent.size(), 47U);
  EXPECT_EQ(sent[6] + 256 * sent[7], 2500);
  EXPECT_NEAR(static_cast<double>(now) / kMicrosecond, 1'002'444 + 47 * 43.4, 2);
}

}  // namespace
}  // namespace tetap::board
