// SPDX-License-Identifier: Apache-2.0
// The receiver on its UART against u-blox's interface description: whole frames as published, fields by their offsets.
#include "sim_host/emulator/ublox_receiver.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace tetap::board {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr GnssSolution kMunich{.epoch_ms = 0,
                               .fix = true,
                               .differential = true,
                               .satellites = 14,
                               .latitude_1e7deg = 482'627'000,
                               .longitude_1e7deg = 116'683'000,
                               .height_m = 520.25,
                               .velocity_ned_mps = {1.5, -2.25, 0.125},
                               .horizontal_sigma_m = 3,
                               .vertical_sigma_m = 5,
                               .velocity_sigma_mps = 0.05};

/// A receiver with its line: what it sent, and at what rates.
class Line {
 public:
  explicit Line(const UbloxOptions& options = {}) : receiver(options) {}

  void send(const Bytes& bytes, std::int64_t baud) {
    for (const std::uint8_t byte : bytes) receiver.on_byte(now, byte, baud);
  }
  void solve_for(std::int64_t ms) {
    for (const std::int64_t end = epoch_ms + ms; epoch_ms < end; epoch_ms += 200, now += 200 * kMillisecond) {
      GnssSolution solution = kMunich;
      solution.epoch_ms = epoch_ms;
      receiver.on_solution(now, solution);
    }
  }
  Bytes take() {
    Bytes all;
    for (auto byte = receiver.next_byte(now); byte.begin != kNever; byte = receiver.next_byte(now)) {
      all.push_back(byte.byte);
      last_baud = byte.baud;
    }
    return all;
  }

  UbloxReceiver receiver;
  Picoseconds now = kSecond;
  std::int64_t epoch_ms = 0, last_baud = 0;
};

Bytes framed(std::uint8_t message_class, std::uint8_t id, const Bytes& payload) {
  Bytes frame{0xB5, 0x62, message_class, id, static_cast<std::uint8_t>(payload.size()), 0};
  frame.insert(frame.end(), payload.begin(), payload.end());
  unsigned a = 0, b = 0;
  for (std::size_t i = 2; i < frame.size(); ++i) a = (a + frame[i]) & 0xFF, b = (b + a) & 0xFF;
  frame.push_back(static_cast<std::uint8_t>(a));
  frame.push_back(static_cast<std::uint8_t>(b));
  return frame;
}

Bytes valset(const std::vector<std::pair<std::uint32_t, Bytes>>& items) {
  Bytes payload{0, 1, 0, 0};
  for (const auto& [key, value] : items) {
    for (int i = 0; i < 4; ++i) payload.push_back(static_cast<std::uint8_t>(key >> 8 * i));
    payload.insert(payload.end(), value.begin(), value.end());
  }
  return framed(0x06, 0x8A, payload);
}

template <class T>
T field(const Bytes& bytes, std::size_t offset) {
  T value{};
  std::memcpy(&value, bytes.data() + 6 + offset, sizeof value);
  return value;
}

/// Payload and frame of the first message of that class and identifier; empty: there is none.
Bytes find(const Bytes& all, std::uint8_t message_class, std::uint8_t id) {
  for (std::size_t i = 0; i + 8 <= all.size(); ++i) {
    if (all[i] != 0xB5 || all[i + 1] != 0x62 || all[i + 2] != message_class || all[i + 3] != id) continue;
    const std::size_t size = 8U + static_cast<std::size_t>(all[i + 4] | all[i + 5] << 8);
    return {all.begin() + static_cast<std::ptrdiff_t>(i), all.begin() + static_cast<std::ptrdiff_t>(i + size)};
  }
  return {};
}

// Frames as published in u-blox's documents and by u-center: UBX-MON-VER's poll, UBX-ACK-ACK and -NAK of CFG-VALSET.
const Bytes kPollVersion{0xB5, 0x62, 0x0A, 0x04, 0x00, 0x00, 0x0E, 0x34};
const Bytes kAcknowledged{0xB5, 0x62, 0x05, 0x01, 0x02, 0x00, 0x06, 0x8A, 0x98, 0xC1};
const Bytes kRefused{0xB5, 0x62, 0x05, 0x00, 0x02, 0x00, 0x06, 0x8A, 0x97, 0xBC};

TEST(Ublox, SpeaksNmeaOnceASecondFromTheFactory) {
  Line line;
  line.solve_for(3000);
  const Bytes all = line.take();
  const std::string text(all.begin(), all.end());
  EXPECT_EQ(line.last_baud, 38'400);
  std::size_t sentences = 0, gga = 0;
  for (std::size_t at = 0; (at = text.find('$', at)) != std::string::npos; ++at) {
    const std::size_t star = text.find('*', at);
    ASSERT_NE(star, std::string::npos);
    unsigned sum = 0;
    for (std::size_t i = at + 1; i < star; ++i) sum ^= static_cast<unsigned char>(text[i]);
    EXPECT_EQ(std::stoul(text.substr(star + 1, 2), nullptr, 16), sum);
    ++sentences;
    if (text.compare(at, 6, "$GNGGA") == 0) ++gga;
  }
  EXPECT_EQ(gga, 3U);
  EXPECT_EQ(sentences, 15U);
  EXPECT_TRUE(find(all, 0x01, 0x07).empty());
  // 48.2627 deg are 48 degrees and 15.762 minutes.
  EXPECT_NE(text.find("4815.76200,N,01140.09800,E"), std::string::npos) << text;
}

TEST(Ublox, AnswersItsVersionAtItsOwnRateAlone) {
  Line line;
  line.send(kPollVersion, 115'200);
  EXPECT_TRUE(line.take().empty());
  line.send(kPollVersion, 38'400);
  const Bytes version = find(line.take(), 0x0A, 0x04);
  ASSERT_EQ(version.size(), 8U + 40 + 30);
  EXPECT_EQ(Bytes(version.begin(), version.end()), framed(0x0A, 0x04, {version.begin() + 6, version.end() - 2}));
}

TEST(Ublox, SilentWhileItStarts) {
  Line line;
  line.now = 100 * kMillisecond;
  line.send(kPollVersion, 38'400);
  EXPECT_TRUE(line.take().empty());
}

TEST(Ublox, ConfigurationIsTakenOrRefusedAsAWhole) {
  Line line;
  line.send(valset({{0x20910007, {1}}, {0x2091FFFF, {1}}}), 38'400);
  EXPECT_EQ(line.take(), kRefused);
  line.solve_for(2000);
  EXPECT_TRUE(find(line.take(), 0x01, 0x07).empty()) << "nothing of a refused message holds";
  line.send(framed(0x06, 0x8A, {0, 0, 0, 0, 0x07, 0x00, 0x91, 0x20, 1}), 38'400);
  EXPECT_EQ(line.take(), kRefused) << "no layer";
  line.send(valset({{0x30210001, {200}}}), 38'400);
  EXPECT_EQ(line.take(), kRefused) << "a value of two bytes that is cut off";
  line.send(valset({{0x20910007, {1}}, {0x30210001, {200, 0}}, {0x10740002, {0}}}), 38'400);
  EXPECT_EQ(line.take(), kAcknowledged);
  line.solve_for(1000);
  EXPECT_EQ(line.take().size(), 5U * 100) << "five of NAV-PVT, and no NMEA";
}

TEST(Ublox, BaudRateChangesAtOnce) {
  Line line;
  line.send(valset({{0x40520001, {0x00, 0xC2, 0x01, 0x00}}}), 38'400);
  EXPECT_EQ(line.take(), kAcknowledged);
  EXPECT_EQ(line.last_baud, 115'200);
  line.send(kPollVersion, 38'400);
  EXPECT_TRUE(line.take().empty());
  line.send(kPollVersion, 115'200);
  EXPECT_FALSE(line.take().empty());
  line.receiver.power_on(line.now);
  EXPECT_EQ(line.receiver.baud(), 38'400) << "only RAM was set";
}

TEST(Ublox, DamagedFramesAreNoMessages) {
  Line line;
  for (std::size_t bit = 16; bit < 8 * kPollVersion.size(); ++bit) {
    Bytes damaged = kPollVersion;
    damaged[bit / 8] = static_cast<std::uint8_t>(damaged[bit / 8] ^ 1U << bit % 8);
    line.send(damaged, 38'400);
    line.send(Bytes(80, 0), 38'400);  // ends what a damaged length began
    EXPECT_TRUE(line.take().empty()) << bit;
  }
}

TEST(Ublox, GenerationEightTakesTheOlderMessagesAlone) {
  Line line({.generation = 8, .baud = 9'600});
  line.send(valset({{0x20910007, {1}}}), 9'600);
  EXPECT_EQ(line.take(), kRefused);
  line.send(framed(0x06, 0x01, {0x01, 0x07, 1}), 9'600);
  // u-center shows this answer to CFG-MSG.
  EXPECT_EQ(line.take(), (Bytes{0xB5, 0x62, 0x05, 0x01, 0x02, 0x00, 0x06, 0x01, 0x0F, 0x38}));
  line.send(framed(0x06, 0x08, {200, 0, 1, 0, 1, 0}), 9'600);
  line.take();
  line.solve_for(1000);
  EXPECT_EQ(find(line.take(), 0x01, 0x07).size(), 100U);
  line.send(framed(0x06, 0x01, {0x01, 0x36, 1}), 9'600);
  EXPECT_EQ(find(line.take(), 0x05, 0x00).size(), 10U) << "no NAV-COV";
}

TEST(Ublox, PositionVelocityAndTimeLieWhereTheDescriptionHasThem) {
  Line line;
  line.send(valset({{0x20910007, {1}}, {0x20910084, {1}}, {0x10740002, {0}}}), 38'400);
  line.take();
  line.solve_for(1000);
  const Bytes all = line.take();
  const Bytes pvt = find(all, 0x01, 0x07);
  ASSERT_EQ(pvt.size(), 100U);
  // 2026-11-25 is a Wednesday: three days and a half, and 18 leap seconds.
  EXPECT_EQ(field<std::uint32_t>(pvt, 0), (3U * 86'400 + 43'200 + 18) * 1000);
  EXPECT_EQ(field<std::uint16_t>(pvt, 4), 2026U);
  EXPECT_EQ(pvt[6 + 6], 11);
  EXPECT_EQ(pvt[6 + 7], 25);
  EXPECT_EQ(pvt[6 + 8], 12);
  EXPECT_EQ(pvt[6 + 20], 3);
  EXPECT_EQ(pvt[6 + 21] & 3, 3);
  EXPECT_EQ(pvt[6 + 23], 14);
  EXPECT_EQ(field<std::int32_t>(pvt, 24), 116'683'000);
  EXPECT_EQ(field<std::int32_t>(pvt, 28), 482'627'000);
  EXPECT_EQ(field<std::int32_t>(pvt, 32), 520'250);
  EXPECT_EQ(field<std::uint32_t>(pvt, 40), 4243U) << "3 m an axis";
  EXPECT_EQ(field<std::uint32_t>(pvt, 44), 5000U);
  EXPECT_EQ(field<std::int32_t>(pvt, 48), 1500);
  EXPECT_EQ(field<std::int32_t>(pvt, 52), -2250);
  EXPECT_EQ(field<std::int32_t>(pvt, 56), 125);
  EXPECT_EQ(field<std::int32_t>(pvt, 60), 2704) << "ground speed";
  const Bytes cov = find(all, 0x01, 0x36);
  ASSERT_EQ(cov.size(), 72U);
  EXPECT_EQ(field<std::uint32_t>(cov, 0), field<std::uint32_t>(pvt, 0));
  EXPECT_EQ(cov[6 + 5], 1);
  EXPECT_FLOAT_EQ(field<float>(cov, 16), 9.0F);
  EXPECT_FLOAT_EQ(field<float>(cov, 28), 9.0F);
  EXPECT_FLOAT_EQ(field<float>(cov, 36), 25.0F);
  EXPECT_FLOAT_EQ(field<float>(cov, 60), 0.0025F);
}

TEST(Ublox, WithoutAFixTheMessageHasNone) {
  Line line;
  line.send(valset({{0x20910007, {1}}, {0x10740002, {0}}}), 38'400);
  line.take();
  GnssSolution none = kMunich;
  none.fix = false;
  line.receiver.on_solution(line.now, none);
  const Bytes pvt = find(line.take(), 0x01, 0x07);
  ASSERT_EQ(pvt.size(), 100U);
  EXPECT_EQ(pvt[6 + 20], 0);
  EXPECT_EQ(pvt[6 + 21] & 1, 0);
  EXPECT_EQ(field<std::uint32_t>(pvt, 40), 0xFFFF'FFFFU);
}

}  // namespace
}  // namespace tetap::board
