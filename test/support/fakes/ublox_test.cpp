// SPDX-License-Identifier: Apache-2.0
// The fake u-blox receiver held to the manuals (ZED-F9P interface description, UBX-18010854 R04: numbers in the
// comments are its sections): what must be true of a receiver whatever the driver.
#include "support/fakes/ublox.hpp"
#include "hal/byte_stream.hpp"

#include <gtest/gtest.h>

#include <set>

namespace tetap::fakes {
namespace {

using namespace ublox;

static_assert(hal::SerialPort<Ublox>);

struct Frame {
  std::uint8_t message_class = 0, id = 0;
  Bytes payload;
};

/// Somebody on the line who only sends and listens.
struct Host {
  explicit Host(Generation generation = Generation::kKeys) : receiver(generation, 38'400) { receiver.set_baud(38'400); }

  void wait(int ms) { receiver.advance(now += base::Micros{ms * 1000}); }
  Bytes bytes() {
    Bytes in(100'000, 0);
    in.resize(receiver.read(in));
    return in;
  }
  /// What came, frame by frame; sentences are skipped.
  std::vector<Frame> frames() {
    const Bytes in = bytes();
    std::vector<Frame> out;
    for (std::size_t i = 0; i + 8 <= in.size();) {
      if (in[i] != 0xB5 || in[i + 1] != 0x62) {
        ++i;
        continue;
      }
      const std::size_t size = in[i + 4] + 256U * in[i + 5];
      const auto at = in.begin() + static_cast<std::ptrdiff_t>(i + 6);
      out.push_back({in[i + 2], in[i + 3], Bytes(at, at + static_cast<std::ptrdiff_t>(size))});
      i += size + 8;
    }
    return out;
  }
  /// Sends a message of class CFG; the answer's ID of class ACK, or -1.
  int cfg(std::uint8_t id, const Bytes& payload) {
    receiver.write(frame(0x06, id, payload));
    wait(30);
    for (const Frame& f : frames())
      if (f.message_class == 0x05 && f.payload == Bytes{0x06, id}) return f.id;
    return -1;
  }
  int valset(std::uint8_t layers, const Bytes& items, std::uint8_t version = 0) {
    Bytes p{version, layers, 0, 0};
    p.insert(p.end(), items.begin(), items.end());
    return cfg(0x8A, p);
  }

  Ublox receiver;
  base::Micros now{};
};

Bytes item(std::uint32_t id, std::uint64_t value, std::size_t size) {
  Bytes out;
  for (int i = 0; i < 4; ++i) out.push_back(static_cast<std::uint8_t>(id >> (8 * i)));
  for (std::size_t i = 0; i < size; ++i) out.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
  return out;
}
Bytes operator+(Bytes a, const Bytes& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}
std::string as_text(const Bytes& bytes) { return {bytes.begin(), bytes.end()}; }

constexpr int kAckAck = 1, kAckNak = 0, kNothing = -1;
constexpr std::uint8_t kRam = 1, kBbr = 2, kFlash = 4;
const Bytes kTenHertz = item(key("CFG-RATE-MEAS"), 100, 2);

// ---- 6.2: items and keys

TEST(UbloxItems, EveryKeyHasTheSizeOfItsTypeAndNoReservedBit) {
  std::set<std::uint32_t> ids;
  for (const Item& i : kItems) {
    EXPECT_TRUE(ids.insert(i.id).second) << i.name;
    EXPECT_EQ(value_bytes(i.id), i.type == "L" ? 1U : static_cast<std::size_t>(i.type[1] - '0')) << i.name;
    EXPECT_EQ((i.id >> 28 & 7) == 1, i.type == "L") << i.name;
    EXPECT_EQ(i.id & 0x8F00'F000U, 0U) << i.name;
    EXPECT_TRUE(in_range(i, i.standard)) << i.name;
  }
}

// ---- 5.2, 5.4, 5.5, 5.8: frames and acknowledgements

TEST(UbloxFrames, APollOfTheVersionIsAnsweredAndNotAcknowledged) {
  const Bytes poll{0xB5, 0x62, 0x0A, 0x04, 0x00, 0x00, 0x0E, 0x34};
  EXPECT_EQ(frame(0x0A, 0x04, {}), poll);
  Host host;
  host.receiver.write(poll);
  host.wait(30);
  const auto frames = host.frames();
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(frames[0].message_class, 0x0A);
  EXPECT_EQ((frames[0].payload.size() - 40) % 30, 0U);
}

TEST(UbloxFrames, ADamagedFrameIsNotHeardAndCounted) {
  const Bytes good = frame(0x06, 0x8A, Bytes{0, kRam, 0, 0} + kTenHertz);
  for (std::size_t at = 0; at < good.size(); ++at) {
    if (at == 4 || at == 5) continue;  // another length
    Host host;
    Bytes bad = good;
    bad[at] = static_cast<std::uint8_t>(bad[at] ^ 0x10);
    host.receiver.write(bad);
    host.wait(30);
    EXPECT_EQ(host.receiver.ram(key("CFG-RATE-MEAS")), 1'000U) << at;
    EXPECT_TRUE(host.frames().empty()) << at;
    EXPECT_EQ(host.receiver.broken_rules(), at < 2 ? 0 : 1) << at;
  }
}

TEST(UbloxFrames, MessagesOfClassCfgThatAreUnknownAreRefusedOthersNotAnswered) {
  Host host;
  EXPECT_EQ(host.cfg(0x7B, {}), kAckNak);
  host.receiver.write(frame(0x02, 0x59, {}));
  host.wait(30);
  EXPECT_TRUE(host.frames().empty());
}

TEST(UbloxFrames, AtAnotherBaudRateNothingIsUnderstoodOnEitherSide) {
  Host host;
  host.receiver.set_baud(9'600);
  EXPECT_EQ(host.valset(kRam, kTenHertz), kNothing);
  EXPECT_EQ(host.receiver.requests(), 0);
}

// ---- 5.9.27: CFG-VALSET

TEST(UbloxValset, IsAppliedToRamAtOnceAndForgottenWithThePower) {
  Host host;
  EXPECT_EQ(host.valset(kRam, kTenHertz), kAckAck);
  EXPECT_EQ(host.receiver.ram(key("CFG-RATE-MEAS")), 100U);
  EXPECT_EQ(host.receiver.stored(), 0U);
  host.receiver.power_cycle(38'400);
  EXPECT_EQ(host.receiver.ram(key("CFG-RATE-MEAS")), 1'000U);
}

TEST(UbloxValset, InBbrItWaitsForTheNextStart) {
  Host host;
  EXPECT_EQ(host.valset(kBbr, kTenHertz), kAckAck);
  EXPECT_EQ(host.receiver.ram(key("CFG-RATE-MEAS")), 1'000U);
  EXPECT_EQ(host.receiver.stored(), 1U);
  host.receiver.power_cycle(38'400);
  EXPECT_EQ(host.receiver.ram(key("CFG-RATE-MEAS")), 100U);
}

TEST(UbloxValset, WithoutALayerOrToAFlashThatIsNotThereItIsRefused) {
  for (const int layers : {0, int{kFlash}, kRam | kFlash, 7}) {
    Host host;
    EXPECT_EQ(host.valset(static_cast<std::uint8_t>(layers), kTenHertz), kAckNak) << layers;
    EXPECT_EQ(host.receiver.ram(key("CFG-RATE-MEAS")), 1'000U);
  }
}

TEST(UbloxValset, OneUnknownKeyRefusesAllOfThem) {
  for (const bool first : {false, true}) {
    Host host;
    const Bytes unknown = item(0x2091'00FE, 1, 1);
    EXPECT_EQ(host.valset(kRam, first ? unknown + kTenHertz : kTenHertz + unknown), kAckNak);
    EXPECT_EQ(host.receiver.ram(key("CFG-RATE-MEAS")), 1'000U);
  }
  Host older;
  older.receiver.faults.unknown_keys = {key("CFG-RATE-MEAS")};
  EXPECT_EQ(older.valset(kRam, kTenHertz), kAckNak);
}

TEST(UbloxValset, AValueOfAnotherSizeThanItsKeysIsRefused) {
  for (const std::size_t size : {0U, 1U, 3U, 4U}) {
    Host host;
    EXPECT_EQ(host.valset(kRam, item(key("CFG-RATE-MEAS"), 100, size)), kAckNak) << size;
    EXPECT_EQ(host.receiver.ram(key("CFG-RATE-MEAS")), 1'000U) << size;
  }
}

TEST(UbloxValset, TakesSixtyFourItemsAndNotOneMore) {
  for (const int count : {64, 65}) {
    Bytes items;
    for (int i = 0; i < count; ++i) items = items + item(key("CFG-RATE-MEAS"), 100U + static_cast<unsigned>(i), 2);
    Host host;
    EXPECT_EQ(host.valset(kRam, items), count == 64 ? kAckAck : kAckNak);
    EXPECT_EQ(host.receiver.ram(key("CFG-RATE-MEAS")), count == 64 ? 163U : 1'000U) << "the last of the same counts";
  }
}

TEST(UbloxValset, AValueThatCannotBeIsRefused) {
  const Bytes wrong[] = {item(key("CFG-RATE-MEAS"), 24, 2), item(key("CFG-RATE-NAV"), 0, 2),
                         item(key("CFG-RATE-NAV"), 128, 2), item(key("CFG-UART1-BAUDRATE"), 100'000, 4),
                         item(key("CFG-NAVSPG-DYNMODEL"), 1, 1)};
  for (const Bytes& one : wrong) EXPECT_EQ(Host().valset(kRam, one), kAckNak);
}

TEST(UbloxValset, OfABitOnlyTheLowestIsUsed) {
  Host host;
  EXPECT_EQ(host.valset(kRam, item(key("CFG-UART1OUTPROT-NMEA"), 0xFE, 1)), kAckAck);
  EXPECT_EQ(host.receiver.ram(key("CFG-UART1OUTPROT-NMEA")), 0U);
}

TEST(UbloxValset, ReservedBytesAreZero) {
  Host host;
  EXPECT_EQ(host.cfg(0x8A, Bytes{0, kRam, 0, 7} + kTenHertz), kAckAck);
  EXPECT_EQ(host.receiver.broken_rules(), 1);
}

TEST(UbloxValset, WhatIsAnsweredAfterAChangeOfTheBaudRateComesAtTheNewOne) {
  Host host;
  EXPECT_EQ(host.valset(kRam, item(key("CFG-UART1-BAUDRATE"), 115'200, 4)), kNothing);
  host.receiver.set_baud(115'200);
  EXPECT_EQ(host.valset(kRam, kTenHertz), kAckAck);
}

// ---- 5.9.26: CFG-VALGET

TEST(UbloxValget, SaysWhatEachLayerHolds) {
  const auto value = [](Host& host, std::uint8_t layer) -> std::int64_t {
    host.receiver.write(frame(0x06, 0x8B, Bytes{0, layer, 0, 0} + item(key("CFG-RATE-MEAS"), 0, 0)));
    host.wait(30);
    const auto frames = host.frames();
    if (frames.size() == 1 && frames[0].message_class == 0x05 && frames[0].id == kAckNak) return -1;
    EXPECT_EQ(frames.size(), 2U);
    EXPECT_EQ(frames.at(0).payload.size(), 10U);
    EXPECT_EQ(frames.at(0).payload[0], 1) << "version of the answer";
    EXPECT_EQ(frames.at(1).id, kAckAck);
    return frames[0].payload[8] + 256 * frames[0].payload[9];
  };
  Host host;
  EXPECT_EQ(host.valset(kRam, kTenHertz), kAckAck);
  EXPECT_EQ(value(host, 0), 100);
  EXPECT_EQ(value(host, 1), -1);
  EXPECT_EQ(value(host, 7), 1'000);
  EXPECT_EQ(host.valset(kBbr, item(key("CFG-RATE-MEAS"), 250, 2)), kAckAck);
  EXPECT_EQ(value(host, 0), 100);
  EXPECT_EQ(value(host, 1), 250);
  EXPECT_EQ(host.cfg(0x8B, Bytes{0, 0, 0, 0} + item(0x2091'00FE, 0, 0)), kAckNak);
}

// ---- 5.9.12, 5.9.13, 5.9.17, 5.9.19: the older messages

TEST(UbloxOlder, AReceiverWithKeysKnowsNoneOfThemAndOneWithoutRefusesKeys) {
  const Bytes rate{100, 0, 1, 0, 1, 0};
  EXPECT_EQ(Host(Generation::kKeys).cfg(0x08, rate), kAckNak);
  EXPECT_EQ(Host(Generation::kM8).cfg(0x08, rate), kAckAck);
  EXPECT_EQ(Host(Generation::kM8).valset(kRam, kTenHertz), kAckNak);
  EXPECT_EQ(Host(Generation::kM8).cfg(0x08, {100, 0, 0, 0, 1, 0}), kAckNak) << "navRate 0";
  EXPECT_EQ(Host(Generation::kM8).cfg(0x08, {100, 0, 1, 0, 1}), kAckNak) << "a byte is missing";
}

TEST(UbloxOlder, ThePortTakesFramingBaudRateAndProtocols) {
  Bytes port{1, 0, 0, 0, 0xC0, 0x08, 0, 0, 0x00, 0x96, 0, 0, 3, 0, 1, 0, 0, 0, 0, 0};  // 8N1, 38400, UBX out
  Host host(Generation::kM8);
  EXPECT_EQ(host.cfg(0x00, port), kAckAck);
  EXPECT_EQ(host.receiver.ram(key("CFG-UART1OUTPROT-NMEA")), 0U);
  EXPECT_EQ(host.receiver.broken_rules(), 0);
  port[5] = 0x00;  // even parity: this host does not speak that
  EXPECT_EQ(host.cfg(0x00, port), kNothing);
  Host mute(Generation::kM8);
  port[5] = 0x08, port[14] = 2;  // NMEA out only
  EXPECT_EQ(mute.cfg(0x00, port), kNothing);
  Host deaf(Generation::kM8);
  port[14] = 3, port[12] = 2;  // NMEA in only
  EXPECT_EQ(deaf.cfg(0x00, port), kAckAck);
  EXPECT_EQ(deaf.cfg(0x08, {100, 0, 1, 0, 1, 0}), kNothing);
}

TEST(UbloxOlder, OfTheNavigationEngineOnlyWhatTheMaskNamesIsApplied) {
  Host host(Generation::kM8);
  Bytes nav5(36, 0);
  nav5[0] = 1, nav5[2] = 4, nav5[3] = 2;
  EXPECT_EQ(host.cfg(0x24, nav5), kAckAck);
  EXPECT_EQ(host.receiver.ram(key("CFG-NAVSPG-DYNMODEL")), 4U);
  EXPECT_EQ(host.receiver.ram(key("CFG-NAVSPG-FIXMODE")), 3U);
  nav5[0] = 0, nav5[2] = 8;
  EXPECT_EQ(host.cfg(0x24, nav5), kAckAck);
  EXPECT_EQ(host.receiver.ram(key("CFG-NAVSPG-DYNMODEL")), 4U);
}

TEST(UbloxOlder, AMessageIsSwitchedOnByClassAndIdAndAnUnknownOneRefused) {
  Host host(Generation::kM8);
  EXPECT_EQ(host.cfg(0x01, {0x01, 0x12, 1}), kAckAck);
  EXPECT_TRUE(host.receiver.enabled(kNavVelNed));
  EXPECT_EQ(host.cfg(0x01, {0x01, 0x07, 1}), kAckAck);
  EXPECT_EQ(host.cfg(0x01, {0x01, 0x77, 1}), kAckNak);
  EXPECT_EQ(Host(Generation::kM6).cfg(0x01, {0x01, 0x07, 1}), kAckNak);
}

// ---- what goes out

TEST(UbloxOutput, SentencesAreThoseOfTheManualsExamples) {
  const Instant at{.week = 2306, .itow_ms = (9 * 3600 + 27 * 60 + 25 + 18) * 1000};
  Solution s;
  s.latitude_deg = 47 + 17.11399 / 60, s.longitude_deg = 8 + 33.91590 / 60;
  s.satellites = 8, s.hdop = 1.01, s.height_m = 547.6, s.msl_m = 499.6;
  EXPECT_EQ(as_text(gga(s, at, "GP")), "$GPGGA,092725.00,4717.11399,N,00833.91590,E,1,08,1.01,499.6,M,48.0,M,,*5B\r\n");
  s.v_mps = {0.0021 * std::sin(77.52 * M_PI / 180), 0.0021 * std::cos(77.52 * M_PI / 180), 0};
  EXPECT_EQ(as_text(vtg(s, at, "GP")), "$GPVTG,77.52,T,,M,0.004,N,0.008,K,A*06\r\n");
  Solution gll_solution;
  gll_solution.latitude_deg = 47 + 17.11364 / 60, gll_solution.longitude_deg = 8 + 33.91565 / 60;
  const Instant gll_at{.week = 2306, .itow_ms = (9 * 3600 + 23 * 60 + 21 + 18) * 1000};
  EXPECT_EQ(as_text(gll(gll_solution, gll_at, "GP")), "$GPGLL,4717.11364,N,00833.91565,E,092321.00,A,A*60\r\n");
  Solution gst_solution;
  gst_solution.position_cov_m2 = {1.3 * 1.3, 0, 0, 1.7 * 1.7, 0, 2.2 * 2.2};
  const Instant gst_at{.week = 2306, .itow_ms = (8 * 3600 + 23 * 60 + 56 + 18) * 1000};
  EXPECT_EQ(as_text(gst(gst_solution, gst_at, "GP")), "$GPGST,082356.00,1.8,,,,1.7,1.3,2.2*7E\r\n");
}

TEST(UbloxOutput, AnglesCarryTheirSideAndMinutesCarryIntoDegrees) {
  EXPECT_EQ(angle(true, -33.5, 2, "NS"), "3330.00000,S");
  EXPECT_EQ(angle(true, 8.56524738, 3, "EW"), "00833.91484,E");  // 4.1.5
  EXPECT_EQ(angle(true, -0.9999999999, 3, "EW"), "00100.00000,W");
  EXPECT_EQ(angle(false, 8.5, 3, "EW"), ",");
}

TEST(UbloxOutput, TimeIsRoundedSoTheRestMayBeNegative) {
  const Instant before{.week = 2086, .itow_ms = 18'000, .beside_ns = -3'000'000};  // 29 December 2019, 00:00 UTC
  const auto utc = before.utc(10'000'000);
  EXPECT_EQ(utc.year * 10'000 + utc.month * 100 + utc.day, 20'191'229);
  EXPECT_EQ(utc.hour * 3600 + utc.minute * 60 + utc.second, 0);
  EXPECT_EQ(utc.nano, -3'000'000);
  const Instant earlier{.week = 2086, .itow_ms = 17'200};
  EXPECT_EQ(earlier.utc(10'000'000).second, 59);
  EXPECT_EQ(earlier.utc(10'000'000).nano, 200'000'000);
  EXPECT_EQ(earlier.utc(10'000'000).day, 28);
  EXPECT_NE(as_text(gll({}, before)).find(",000000.00,"), std::string::npos);
}

TEST(UbloxOutput, NothingButSentencesUntilAMessageIsAskedForThenAtItsRate) {
  Host host;
  host.wait(5'000);
  EXPECT_TRUE(host.frames().empty());
  host.wait(5'000);
  EXPECT_NE(as_text(host.bytes()).find("$GNRMC,"), std::string::npos);
  const Bytes every_other =
      item(key("CFG-MSGOUT-UBX_NAV_PVT_UART1"), 2, 1) + item(key("CFG-UART1OUTPROT-NMEA"), 0, 1) + kTenHertz;
  EXPECT_EQ(host.valset(kRam, every_other), kAckAck);
  host.wait(1'000);
  host.bytes();
  host.wait(2'000);
  const auto frames = host.frames();
  EXPECT_EQ(frames.size(), 10U);
  for (const Frame& f : frames) EXPECT_EQ(f.id, kNavPvt);
  Host other_port;
  EXPECT_EQ(other_port.valset(kRam, item(key("CFG-MSGOUT-UBX_NAV_PVT_UART2"), 1, 1)), kAckAck);
  other_port.wait(5'000);
  EXPECT_TRUE(other_port.frames().empty());
}

}  // namespace
}  // namespace tetap::fakes
