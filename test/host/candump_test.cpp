// SPDX-License-Identifier: Apache-2.0
#include "sim_host/play/candump.hpp"

#include "sim_host/play/log.hpp"

#include <gtest/gtest.h>

#include <random>
#include <stdexcept>
#include <string>
#include <variant>

namespace tetap::sim {
namespace {

LogLine good(std::string_view text) {
  const auto parsed = parse_log_line(text);
  if (const auto* bad = std::get_if<BadLine>(&parsed)) {
    ADD_FAILURE() << text << ": " << bad->reason;
    return {};
  }
  return std::get<LogLine>(parsed);
}

std::string reason(std::string_view text) {
  const auto parsed = parse_log_line(text);
  const auto* bad = std::get_if<BadLine>(&parsed);
  return bad ? std::string(bad->reason) : std::string{};
}

TEST(LogLine, WhatIsWrittenIsReadBackForRandomFrames) {
  std::mt19937_64 draw(1);
  for (int i = 0; i < 20'000; ++i) {
    base::CanFrame frame{.extended = draw() % 2 == 0, .size = static_cast<std::uint8_t>(draw() % 9)};
    frame.id = static_cast<std::uint32_t>(draw()) & (frame.extended ? 0x1FFFFFFFU : 0x7FFU);
    for (std::size_t b = 0; b < frame.size; ++b) frame.data[b] = static_cast<std::uint8_t>(draw());
    const base::Micros time{static_cast<std::int64_t>(draw() % 4'000'000'000'000'000)};
    Line line;
    append_log_line(line, time, "can7", frame);
    ASSERT_EQ(line.view().back(), '\n');
    const LogLine back = good(line.view().substr(0, line.view().size() - 1));
    EXPECT_EQ(back.time, time);
    EXPECT_EQ(back.interface, "can7");
    EXPECT_EQ(back.classic(), frame);
    EXPECT_EQ(back.kind, LogLine::Kind::kData);
  }
}

TEST(LogLine, TheWriterWritesWhatCandumpWrites) {
  Line line;
  append_log_line(line, {1'795'230'476'709'112}, "vcan0", {.id = 0x123, .size = 4, .data = {0xEF, 0xBE, 0xAD, 0xDE}});
  EXPECT_EQ(line.view(), "(1795230476.709112) vcan0 123#EFBEADDE\n");
  line.clear();
  append_log_line(line, {1}, "vcan0", {.id = 0x12, .extended = true, .size = 0});
  EXPECT_EQ(line.view(), "(0000000000.000001) vcan0 00000012#\n");
}

TEST(LogLine, EveryFormOfCandumpIsUnderstood) {
  EXPECT_EQ(good("(1.5) can0 1FFFFFFF#00").frame.id, 0x1FFFFFFFU);
  EXPECT_EQ(good("(1.5) can0 1FFFFFFF#00").time.us, 1'500'000);
  EXPECT_EQ(good("(0000000001.500000999) can0 123#").time.us, 1'500'000) << "nanoseconds are cut";
  EXPECT_EQ(good("(1.5)  slcan0-x  7ff#aAbB").frame.data[0], 0xAA);
  EXPECT_EQ(good("(1.5) can0 123#R").kind, LogLine::Kind::kRemote);
  EXPECT_EQ(good("(1.5) can0 123#R8").frame.size, 8);
  EXPECT_EQ(good("(1.5) can0 123##1" + std::string(128, '5')).frame.size, 64);
  EXPECT_EQ(good("(1.5) can0 123##0").kind, LogLine::Kind::kFd);
  EXPECT_EQ(good("(1.5) can0 20000088#0000000000000000").kind, LogLine::Kind::kError);
  EXPECT_EQ(good("(1.5) can0 123#1122334455667788_F").frame.size, 8);
  EXPECT_EQ(good("(1.5) can0 123#11 R").frame.size, 1);
  EXPECT_EQ(good("(1.5) can0 123#11 T\r").frame.size, 1);
}

TEST(LogLine, EveryOtherLineIsRefusedWithItsReason) {
  EXPECT_NE(reason("garbage").find("expected"), std::string::npos);
  EXPECT_NE(reason("(1,5) can0 123#11").find("time"), std::string::npos);
  EXPECT_NE(reason("(.5) can0 123#11").find("time"), std::string::npos);
  EXPECT_NE(reason("(1234567890123.5) can0 123#11").find("time"), std::string::npos);
  EXPECT_NE(reason("(-1.5) can0 123#11").find("time"), std::string::npos);
  EXPECT_NE(reason("(1.5)can0 123#11").find("space"), std::string::npos);
  EXPECT_NE(reason("(1.5) 123#11").find("space after the interface"), std::string::npos);
  EXPECT_NE(reason("(1.5) can0 12#11").find("3 or 8"), std::string::npos);
  EXPECT_NE(reason("(1.5) can0 800#11").find("7FF"), std::string::npos);
  EXPECT_NE(reason("(1.5) can0 FFFFFFFF#11").find("1FFFFFFF"), std::string::npos);
  EXPECT_NE(reason("(1.5) can0 123 11").find("#"), std::string::npos);
  EXPECT_NE(reason("(1.5) can0 123#1").find("odd"), std::string::npos);
  EXPECT_NE(reason("(1.5) can0 123#112233445566778899").find("more than 8"), std::string::npos);
  EXPECT_NE(reason("(1.5) can0 123##1112233445566778899").find("no CAN FD"), std::string::npos);
  EXPECT_NE(reason("(1.5) can0 123##").find("flags"), std::string::npos);
  EXPECT_NE(reason("(1.5) can0 123#R9").find("0 to 8"), std::string::npos);
  EXPECT_NE(reason("(1.5) can0 123#11 X").find("unexpected"), std::string::npos);
  EXPECT_NE(reason("(1.5) can0 123#11 R more").find("unexpected"), std::string::npos);
  EXPECT_NE(reason("(1.5) can0 123#GG").find("unexpected"), std::string::npos);
  EXPECT_NE(reason("(1.5) can0 123#11_9").find("length code"), std::string::npos);
}

TEST(LogLine, AnyBytesAreEitherALineOrRefused) {
  std::mt19937_64 draw(2);
  const std::string alphabet = "()0123456789.# RTcan_FX\t";
  for (int i = 0; i < 200'000; ++i) {
    std::string text = i % 2 == 0 ? "(1.5) can0 123#1122" : "";
    for (std::uint64_t n = draw() % 24; n > 0; --n)
      text.insert(draw() % (text.size() + 1), 1,
                  i % 3 == 0 ? static_cast<char>(draw()) : alphabet[draw() % alphabet.size()]);
    const auto parsed = parse_log_line(text);
    if (const auto* line = std::get_if<LogLine>(&parsed))
      EXPECT_LE(line->frame.size, 64);
    else
      EXPECT_FALSE(std::get<BadLine>(parsed).reason.empty());
  }
}

TEST(Log, AMalformedLineStopsWithFileLineReasonAndText) {
  const std::string text = "(1.0) can0 301#11\n\n(1.1) can0 301#1\n(1.2) can0 302#22\n";
  try {
    static_cast<void>(parse_log(text, "some.log"));
    FAIL() << "no error";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "some.log:3: an odd number of data digits: '(1.1) can0 301#1'");
  }
  const Log log = parse_log(text, "some.log", {.interface = {}, .keep_going = true});
  EXPECT_EQ(log.frames.size(), 2U);
  EXPECT_EQ(log.malformed, 1U);
  EXPECT_NE(log.first_malformed.find("some.log:3:"), std::string::npos);
}

TEST(Log, FramesThatAreNoneOfOursAreCountedNotPlayed) {
  const Log log =
      parse_log("(2.0) a 301#11\n(1.0) a 301#11\n(3.0) b 301#11\n(3.0) a 301#R\n(4.0) a 301##1\n(5.0) a 20000001#00",
                "x", {.interface = "a", .keep_going = false});
  EXPECT_EQ(log.frames.size(), 2U);
  EXPECT_EQ(log.back_in_time, 1U);
  EXPECT_EQ(log.other_interface, 1U);
  EXPECT_EQ(log.not_data, 3U);
}

TEST(Log, AFileThatIsNotThereOrEmptyIsNamed) {
  try {
    static_cast<void>(read_log("/nowhere/at/all.log"));
    FAIL() << "no error";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "/nowhere/at/all.log: cannot be read: No such file or directory");
  }
  EXPECT_THROW(static_cast<void>(read_log("/dev/null")), std::runtime_error);
  EXPECT_THROW(static_cast<void>(read_log("/")), std::runtime_error) << "a folder";
}

}  // namespace
}  // namespace tetap::sim
