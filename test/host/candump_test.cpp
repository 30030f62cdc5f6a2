// SPDX-License-Identifier: Apache-2.0
#include "sim_host/replay/candump.hpp"

#include "sim_host/play/log_file.hpp"
#include "sim_host/play/play.hpp"
#include "sim_host/replay/log.hpp"

#include <gtest/gtest.h>

#include <sys/stat.h>

#include <array>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

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

TEST(LogLine, FormsOfOtherWritersAreReadOrCounted) {
  EXPECT_EQ(good("(1.5) /dev/ttyACM0@115200 301#11").interface, "/dev/ttyACM0@115200");
  EXPECT_EQ(good("(1.5) can0 123##1112233445566778899").kind, LogLine::Kind::kFd) << "nine bytes";
  EXPECT_EQ(good("(1.5) can0 123#R8_9").kind, LogLine::Kind::kRemote);
  EXPECT_EQ(good("(1.5) can0 00123###81:00:12345678#112233445566").kind, LogLine::Kind::kXl);
  EXPECT_EQ(good("(1.5) can0 7F7FF###81:00:12345678#" + std::string(4096, '5')).kind, LogLine::Kind::kXl);
  EXPECT_NE(reason("(1.5) can0 00123###81:00#11").find("CAN XL"), std::string::npos);
  EXPECT_NE(reason("(1.5) can0 00123#11").find("3 or 8"), std::string::npos);
  // candump -ta, -tz, -x; lists of bytes.
  const base::CanFrame frame{.id = 0x301, .size = 3, .data = {0x09, 0x00, 0xCD}};
  EXPECT_EQ(good(" (1795907698.303588)  vcan0  301   [3]  09 00 CD").classic(), frame);
  EXPECT_EQ(good(" (1795907698.303588)  vcan0  301   [3]  09 00 CD   '..'").time.us, 1'795'907'698'303'588);
  EXPECT_EQ(good(" (000.000023)  vcan0  RX - -  301   [3]  09 00 CD").classic(), frame);
  EXPECT_EQ(good(" (000.000023)  vcan0  301   [3]  09 00 CD").clock, LogLine::Clock::kRelative);
  const LogLine dated = good(" (2026-11-28 10:00:00.123456)  vcan0  301   [3]  09 00 CD");  // candump -t A
  EXPECT_EQ(dated.time.us, 1'795'860'000'123'456);
  EXPECT_EQ(dated.clock, LogLine::Clock::kCalendar);
  EXPECT_EQ(good(" (000.000023)  vcan0  18FEF100   [0]").frame.extended, true);
  EXPECT_EQ(good(" (000.000023)  vcan0  301   [8]  remote request").kind, LogLine::Kind::kRemote);
  EXPECT_EQ(good(" (000.000023)  vcan0  301  [09]  01 02 03 04 05 06 07 08 09").kind, LogLine::Kind::kFd);
  EXPECT_EQ(good(" (000.000023)  vcan0  20000004   [8]  00 00 00 00 00 00 00 00   ERRORFRAME").kind,
            LogLine::Kind::kError);
  EXPECT_NE(reason(" (000.000023)  vcan0  301   [4]  09 00 CD").find("fewer"), std::string::npos);
  EXPECT_NE(reason(" (000.000023)  vcan0  301   [3]  09 00 CD EF").find("unexpected"), std::string::npos);
  // Vector's .asc.
  EXPECT_EQ(good("   0.010000 1  301             Rx   d 3 09 00 CD  Length = 244000 BitCount = 126 ID = 769").classic(),
            frame);
  EXPECT_EQ(good("   0.010000 1  18FEF100x       Tx   d 0").frame.id, 0x18FEF100U);
  EXPECT_EQ(good("   0.010000 2  302             Rx   r 8").kind, LogLine::Kind::kRemote);
  EXPECT_EQ(good("   0.010000 2  ErrorFrame").kind, LogLine::Kind::kError);
  EXPECT_EQ(good("   0.010000 CANFD   1 Rx 303 1 0 9 12 00").kind, LogLine::Kind::kFd);
  EXPECT_NE(reason("   0.010000 1  18FEF100        Tx   d 0").find("end with x"), std::string::npos);
  EXPECT_NE(reason("   0.010000 1  301   Rx   d 8 09 00").find("fewer"), std::string::npos);
}

/// Verdict on a line in the words of log_lines.txt.
std::string verdict(std::string_view text) {
  const auto parsed = parse_log_line(text);
  if (std::holds_alternative<BadLine>(parsed)) return "bad";
  const auto& line = std::get<LogLine>(parsed);
  if (line.kind != LogLine::Kind::kData)
    return std::array{"data", "remote", "error", "fd", "xl", "heading"}[static_cast<std::size_t>(line.kind)];
  Line words;
  words.text("data ").hex(line.frame.id, line.frame.extended ? 8 : 3).put(' ');
  for (std::size_t i = 0; i < line.frame.size; ++i) words.hex(line.frame.data[i], 2);
  return std::string(words.view());
}

TEST(LogLine, TheTableOfLinesHolds) {
  const auto root = std::filesystem::path(TETAP_DBC).parent_path().parent_path();
  std::ifstream table(root / "test/host/log_lines.txt");
  std::size_t lines = 0;
  for (std::string text; std::getline(table, text);) {
    if (text.starts_with('#')) continue;
    const std::size_t tab = text.find('\t');
    ASSERT_NE(tab, std::string::npos) << text;
    EXPECT_EQ(verdict(text.substr(tab + 1)), text.substr(0, tab)) << text;
    ++lines;
  }
  EXPECT_GE(lines, 85U);
}

TEST(LogLine, AnAscWithDecimalNumbersIsReadAfterItsHeading) {
  const std::string frame = "   0.250000 1  769             Rx   d 3 9 0 205\n";
  const Log log = parse_log("base dec  timestamps absolute\n" + frame, "x");
  ASSERT_EQ(log.frames.size(), 1U);
  EXPECT_EQ(log.frames[0].frame, (base::CanFrame{.id = 0x301, .size = 3, .data = {0x09, 0x00, 0xCD}}));
  EXPECT_TRUE(parse_log(frame, "x").failure) << "205 is no byte in hexadecimal";
  EXPECT_TRUE(parse_log("base dec\n   0.25 1  2048  Rx   d 0\n", "x").failure);
}

/// Every line of an .asc with relative times counts from the one before it, frame or not.
TEST(Log, RelativeTimesOfAnAscAreAddedUp) {
  const Log log = parse_log(
      "base hex  timestamps relative\n   1.000000 1  301  Rx   d 0\n   0.500000 1  Statistic: D 0\n"
      "   1.500000 1  301  Rx   d 0\n   2.000000 1  301  Rx   d 0\n",
      "x");
  ASSERT_EQ(log.frames.size(), 3U);
  EXPECT_EQ((log.frames[1].time - log.frames[0].time).us, 2'000'000);
  EXPECT_EQ((log.frames[2].time - log.frames[1].time).us, 2'000'000);
}

/// candump -t d of a bus with one frame every 10 ms: its times hardly change.
TEST(Log, DifferencesOfASteadyBusAreAddedUp) {
  for (const int jitter_us : {0, 40}) {
    std::string text;
    for (int i = 0; i < 1000; ++i) {
      char line[80];
      std::snprintf(line, sizeof line, " (000.%06d)  can0  301   [1]  %02X\n",
                    i == 0 ? 0 : 10'000 + (i % 3 - 1) * jitter_us, static_cast<unsigned>(i % 256));
      text += line;
    }
    const Log log = parse_log(text, "x");
    ASSERT_EQ(log.frames.size(), 1000U);
    EXPECT_NEAR(static_cast<double>((log.frames[999].time - log.frames[10].time).us), 9'890'000, 100) << jitter_us;
    EXPECT_NEAR(static_cast<double>((log.frames[999].time - log.frames[0].time).us), 9'990'000, 100'000) << jitter_us;
  }
}

/// candump -t z of two interfaces: a few times go back by a little, and stay times since the start.
TEST(Log, ALittleDisorderIsNoDifference) {
  std::string text;
  for (int i = 0; i < 1000; ++i) {
    char line[80];
    const int us = i * 1000 - (i % 9 == 5 ? 1500 : 0);
    std::snprintf(line, sizeof line, " (%03d.%06d)  can%d  301   [0]\n", us / 1'000'000, us % 1'000'000, i % 2);
    text += line;
  }
  const Log log = parse_log(text, "x");
  ASSERT_EQ(log.frames.size(), 1000U);
  EXPECT_EQ((log.frames[999].time - log.frames[0].time).us, 999'000);
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
  const Log strict = parse_log(text, "some.log");
  ASSERT_TRUE(strict.failure);
  EXPECT_EQ(strict.failure->text, "some.log:3: an odd number of data digits: '(1.1) can0 301#1'");
  EXPECT_EQ(strict.failure->line, 3U);
  EXPECT_EQ(strict.frames.size(), 1U) << "those before it";
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

/// The same five frames as each writer has them; times within a millisecond, from the first frame on.
TEST(Log, OneDriveInEveryFormIsTheSameDrive) {
  const std::array<std::int64_t, 5> us{0, 23, 10'000, 10'040, 20'500};
  std::string log, zero, differences,
      asc =
          "date Sat Nov 28 10:00:00.000 2026\r\nbase hex  timestamps absolute\r\ninternal events logged\r\n"
          "// version 13.0.0\r\nBegin Triggerblock Sat Nov 28 10:00:00.000 2026\r\n   0.000000 Start of "
          "measurement\r\n";
  for (std::size_t i = 0; i < us.size(); ++i) {
    char text[120];
    const auto add = [&text](std::string& to) { to += text; };
    const auto n = static_cast<unsigned>(i);
    std::snprintf(text, sizeof text, "(1795907698.%06u) /dev/ttyACM0@115200 301#0900CDA60000000%u\n",
                  static_cast<unsigned>(us[i]), n);
    add(log);
    std::snprintf(text, sizeof text, " (000.%06u)  vcan0  301   [8]  09 00 CD A6 00 00 00 0%u\n",
                  static_cast<unsigned>(us[i]), n);
    add(zero);
    std::snprintf(text, sizeof text, " (000.%06u)  vcan0  301   [8]  09 00 CD A6 00 00 00 0%u\n",
                  static_cast<unsigned>(us[i] - us[i > 0 ? i - 1 : 0]), n);
    add(differences);
    std::snprintf(text, sizeof text, "   0.%06u 1  301             Rx   d 8 09 00 CD A6 00 00 00 0%u\r\n",
                  static_cast<unsigned>(us[i]), n);
    add(asc);
  }
  const Log expected = parse_log(log, "L");
  for (const std::string& text : {zero, differences, asc + "End TriggerBlock\r\n"}) {
    const Log read = parse_log(text, "x");
    ASSERT_FALSE(read.failure) << read.failure->text;
    ASSERT_EQ(read.frames.size(), us.size()) << text;
    EXPECT_EQ(read.back_in_time, 0U) << text;
    for (std::size_t i = 0; i < us.size(); ++i) {
      EXPECT_EQ(read.frames[i].frame, expected.frames[i].frame);
      const base::Micros since = read.frames[i].time - read.frames[0].time;
      EXPECT_NEAR(static_cast<double>(since.us), static_cast<double>(us[i]), 1'000) << text;
    }
  }
}

TEST(Log, ALastLineWithoutNewlineIsTakenWholeOrNamed) {
  const std::string first = "(1.0) can0 301#0011223344556677\n", last = "(1.1) can0 302#0011223344556677";
  EXPECT_EQ(parse_log(first + last, "x").frames.size(), 2U);
  EXPECT_EQ(parse_log(first + last, "x").cut_off, "");
  for (std::size_t kept = 1; kept < last.size(); ++kept) {
    const Log log = parse_log(first + last.substr(0, kept), "x");
    EXPECT_EQ(log.frames.size(), 1U) << kept;
    EXPECT_EQ(log.cut_off, "x:2: the last line is cut off and left out: '" + last.substr(0, kept) + "'");
    EXPECT_EQ(log.malformed + log.wrong_length, 0U);
  }
  // Frames of others may have fewer bytes.
  EXPECT_EQ(parse_log(first + "(1.1) can0 123#0011", "x").frames.size(), 2U);
  EXPECT_EQ(parse_log(first + "(1.1) can0 301#0011\n", "x").wrong_length, 1U);
}

/// A file that is gone with the test.
class LogOnDisk : public testing::Test {
 protected:
  std::string path_ = testing::TempDir() + "tetap_" + testing::UnitTest::GetInstance()->current_test_info()->name();
  void TearDown() override { std::filesystem::remove(path_); }
  void write(std::string_view text) const { std::ofstream(path_) << text; }

  static std::vector<TimedFrame> read(LogFile& file) {
    std::vector<TimedFrame> frames;
    for (TimedFrame frame; file.next(frame);) frames.push_back(frame);
    return frames;
  }
  static void expect_same(const std::vector<TimedFrame>& a, const std::vector<TimedFrame>& b) {
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
      ASSERT_EQ(a[i].time, b[i].time) << i;
      ASSERT_EQ(a[i].frame, b[i].frame) << i;
    }
  }
  static std::string refusal(const std::string& path) {
    try {
      PlayOptions options{.log = path};
      static_cast<void>(survey_for(options));
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  }
};

/// Some megabytes with everything that may be in a log, and lines as long as they may be.
std::string long_log() {
  std::mt19937_64 draw(11);
  std::string text;
  for (int i = 0; i < 60'000; ++i) {
    Line line;
    const base::CanFrame frame{.id = 0x2F0 + static_cast<std::uint32_t>(draw() % 0x50),
                               .size = static_cast<std::uint8_t>(draw() % 20 == 0 ? draw() % 9 : 8),
                               .data = {static_cast<std::uint8_t>(draw()), static_cast<std::uint8_t>(draw())}};
    append_log_line(line, {i * 1'000 - (draw() % 500 == 0 ? 5'000 : 0)}, i % 7 == 0 ? "can1" : "can0", frame);
    text += line.view();
    if (draw() % 300 == 0) text += "\n\r\n  \t\n";
    if (draw() % 400 == 0) text += "(1.0) can0 301#R\n";
    if (draw() % 500 == 0) text += "no line\n";
    if (i % 5'000 == 0) text.append(kLongestLine, 'x').append("\n");
  }
  return text + "(100.0) can0 301#0011223344556677";  // without an end of line
}

TEST_F(LogOnDisk, ReadInBlocksIsWhatTheWholeTextSays) {
  const std::string text = long_log();
  write(text);
  for (const char* interface : {"", "can1"}) {
    const LogOptions options{.interface = interface, .keep_going = true};
    const Log whole = parse_log(text, path_, options);
    LogFile file(path_, options);
    for (int reading = 0; reading < 2; ++reading) {
      expect_same(read(file), whole.frames);
      const LogReport& report = file.report();
      EXPECT_EQ(report.data, whole.frames.size());
      EXPECT_EQ(report.malformed, whole.malformed);
      EXPECT_EQ(report.first_malformed, whole.first_malformed);
      EXPECT_EQ(report.not_data, whole.not_data);
      EXPECT_EQ(report.other_interface, whole.other_interface);
      EXPECT_EQ(report.back_in_time, whole.back_in_time);
      EXPECT_EQ(report.wrong_length, whole.wrong_length);
      EXPECT_EQ(report.first_wrong_length, whole.first_wrong_length);
      EXPECT_EQ(report.gaps, whole.gaps);
      EXPECT_EQ(report.first_gap, whole.first_gap);
      file.rewind();
    }
  }
}

TEST_F(LogOnDisk, AMalformedLineDeepInTheFileIsNamedWithItsNumber) {
  std::string text;
  for (int i = 0; i < 100'000; ++i) text += "(1.0) can0 301#0011223344556677\n";
  write(text + "(1.1) can0 301#1\n");
  EXPECT_EQ(refusal(path_), path_ + ":100001: an odd number of data digits: '(1.1) can0 301#1'");
}

TEST_F(LogOnDisk, ALineWithoutEndIsRefusedWhenItIsSeen) {
  const std::string first = "(1.0) can0 301#0011223344556677\n";
  const std::string reason =
      ": a line above " + std::to_string(kLongestLine) + " bytes: '" + std::string(60, '?') + "...'";
  EXPECT_EQ(refusal("/dev/zero"), "/dev/zero:1" + reason);
  // Sparse: read whole it would be a gigabyte in memory.
  write(first);
  std::filesystem::resize_file(path_, 1 << 30);
  EXPECT_EQ(refusal(path_), path_ + ":2" + reason);
  EXPECT_EQ(parse_log(first + std::string(kLongestLine + 1, '\0'), "x", {.keep_going = true}).failure->text,
            "x:2" + reason);
  EXPECT_FALSE(parse_log(first + std::string(kLongestLine, '\0') + "\n", "x", {.keep_going = true}).failure);
}

TEST_F(LogOnDisk, APipeWithoutLineEndsIsRefused) {
  ASSERT_EQ(mkfifo(path_.c_str(), 0600), 0);
  std::thread writer([&] {
    std::signal(SIGPIPE, SIG_IGN);
    std::FILE* pipe = std::fopen(path_.c_str(), "wb");
    const std::string zeros(1 << 16, '\0');
    while (std::fwrite(zeros.data(), 1, zeros.size(), pipe) == zeros.size()) continue;
    std::fclose(pipe);
  });
  EXPECT_EQ(refusal(path_),
            path_ + ":1: a line above " + std::to_string(kLongestLine) + " bytes: '" + std::string(60, '?') + "...'");
  writer.join();
}

TEST_F(LogOnDisk, ALogThatGrowsIsReadAgainAsFarAsBefore) {
  std::string text;
  for (int i = 0; i < 20'000; ++i) text += "(1.0) can0 301#0011223344556677\n";
  write(text + "(2.0) can0 301#00");  // its writer is in the middle of a line
  LogFile file(path_, {});
  const auto first = read(file);
  std::ofstream(path_, std::ios::app) << "11223344556677\n(3.0) can0 301#0011223344556677\n";
  file.rewind();
  expect_same(read(file), first);
}

TEST_F(LogOnDisk, ALastLineThatIsCutOffIsNamedAfterEveryReading) {
  write("(1.0) can0 301#0011223344556677\n(2.0) can0 301#00");
  LogFile file(path_, {});
  for (int reading = 0; reading < 2; ++reading) {
    EXPECT_EQ(read(file).size(), 1U);
    EXPECT_EQ(file.report().cut_off, path_ + ":2: the last line is cut off and left out: '(2.0) can0 301#00'");
    file.rewind();
  }
}

TEST_F(LogOnDisk, ALogThatShrinksIsNamed) {
  std::string text;
  for (int i = 0; i < 20'000; ++i) text += "(1.0) can0 301#0011223344556677\n";
  write(text);
  LogFile file(path_, {});
  static_cast<void>(read(file));
  std::filesystem::resize_file(path_, text.size() / 2);
  file.rewind();
  try {
    static_cast<void>(read(file));
    FAIL() << "no error";
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(error.what(), path_ + ": has changed while it was played");
  }
}

TEST_F(LogOnDisk, APipeIsReadTwiceToo) {
  const std::string text = long_log();
  ASSERT_EQ(mkfifo(path_.c_str(), 0600), 0);
  std::thread writer([&] { write(text); });
  LogFile file(path_, {.keep_going = true});
  writer.join();
  const auto frames = parse_log(text, path_, {.keep_going = true}).frames;
  expect_same(read(file), frames);
  file.rewind();
  expect_same(read(file), frames);
}

TEST_F(LogOnDisk, AsManyTicksAreAnnouncedAsAreGiven) {
  const std::string grid =
      "(1.003) can0 301#0011223344556677\n(1.5) can0 301#0011223344556677\n"
      "(900.0) can0 301#0011223344556677\n";
  std::string own = grid;
  for (int i = 0; i < 3; ++i) {
    Line line;
    append_log_line(line, {2'000'000}, "can0", sync_frame(0x300, bus::SyncKind::kStep, {2'000'000 + i * 10'000}, 0));
    own += line.view();
  }
  for (const auto& [text, expected] : {std::pair{grid, 51U}, std::pair{own, 3U}}) {
    write(text);
    PlayOptions options{.log = path_};
    SurveyedLog log = survey_for(options);
    EXPECT_EQ(log.ticks, expected);
    EXPECT_EQ(log.inputs, 3U);
    LogTicks ticks(log.file, options.script, log.has_ticks);
    Tick tick;
    std::uint64_t given = 0;
    while (ticks.next(tick)) ++given;
    EXPECT_EQ(given, log.ticks);
    EXPECT_EQ(ticks.inputs(), 3U);
  }
}

TEST_F(LogOnDisk, FramesOfAnotherKindAloneAreCounted) {
  write(
      "date Mon Nov 30 08:00:00 2026\nbase hex timestamps absolute\n"
      "0.01 CANFD 1 Rx 301 a 0 0 8 8 00 11 22 33 44 55 66 77 0 0 0\n0.02 1 301 Rx r 8\n");
  EXPECT_EQ(refusal(path_), path_ + ": no CAN data frame in it, 2 remote, error or CAN FD frames");
}

TEST_F(LogOnDisk, AByteOrderMarkBeginsAFileAndNoOtherLine) {
  const std::string line = "(1.0) can0 301#0011223344556677\n", mark = "\xEF\xBB\xBF";
  for (const std::string& first :
       {line, std::string("(2026-11-30 08:00:00.000000) can0 301 [1] 00\n"), std::string("\n")}) {
    write(first + line);
    LogFile plain(path_, {});
    const auto expected = read(plain);
    write(mark + first + line);
    LogFile marked(path_, {});
    EXPECT_EQ(read(marked).size(), expected.size());
  }
  write(line + mark + line);
  LogFile inside(path_, {});
  EXPECT_THROW(read(inside), std::runtime_error);
}

TEST_F(LogOnDisk, AFileThatIsNotThereOrEmptyIsNamed) {
  EXPECT_EQ(refusal("/nowhere/at/all.log"), "/nowhere/at/all.log: cannot be read: No such file or directory");
  EXPECT_EQ(refusal("/dev/null"), "/dev/null: no CAN data frame in it");
  EXPECT_EQ(refusal("/"), "/: cannot be read: Is a directory");
}

}  // namespace
}  // namespace tetap::sim
