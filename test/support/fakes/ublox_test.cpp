// SPDX-License-Identifier: Apache-2.0
// The fake receiver against facts of the manuals: see ublox.hpp for their numbers.
#include "support/fakes/ublox.hpp"
#include "hal/byte_stream.hpp"

#include <gtest/gtest.h>

#include <cstring>

namespace tetap::fakes {
namespace {

static_assert(hal::SerialPort<Ublox>);
using base::Micros;
using ublox::Bytes;
using ublox::key;

constexpr std::uint8_t kRam = 1, kBbr = 2, kFlash = 4;

template <class T>
T at(const Bytes& bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}
Bytes read_all(Ublox& u) {
  Bytes in(100'000);
  in.resize(u.read(in));
  return in;
}
/// Payloads of this class and id in a stream of whole frames and sentences.
std::vector<Bytes> payloads(const Bytes& stream, std::uint8_t message_class, std::uint8_t id) {
  std::vector<Bytes> found;
  for (std::size_t i = 0; i + 8 <= stream.size(); ++i) {
    if (stream[i] != 0xB5 || stream[i + 1] != 0x62) continue;
    const std::size_t n = at<std::uint16_t>(stream, i + 4);
    if (stream[i + 2] == message_class && stream[i + 3] == id) {
      const auto from = stream.begin() + static_cast<std::ptrdiff_t>(i + 6);
      found.emplace_back(from, from + static_cast<std::ptrdiff_t>(n));
    }
    i += n + 7;
  }
  return found;
}
Bytes valset(std::uint8_t layers, std::initializer_list<std::pair<std::uint32_t, std::uint32_t>> items,
             std::uint8_t version = 0, std::uint8_t action = 0) {
  ublox::Payload p;
  p.u1(version).u1(layers).u1(action).u1(0);
  for (const auto& [id, value] : items) {
    p.u4(id);
    for (std::size_t i = 0; i < ublox::value_bytes(id); ++i) p.u1(value >> 8 * i & 0xFF);
  }
  return ublox::frame(0x06, 0x8A, p.bytes());
}
const Bytes kAcked{1}, kRefused{0}, kNothing{};

struct UbloxTest : testing::Test {
  Ublox u{Generation::kKeys, 38400};
  Micros now{};

  void step(std::int64_t us) { u.advance(now += Micros{us}); }
  /// The ids of what class ACK said of the request.
  Bytes send(const Bytes& request) {
    EXPECT_EQ(u.write(request), request.size());
    step(20'000);
    last = read_all(u);
    Bytes verdicts;
    for (const std::uint8_t id : Bytes{0, 1}) {
      for (const Bytes& p : payloads(last, 0x05, id)) {
        EXPECT_EQ(p, (Bytes{request[2], request[3]}));
        verdicts.push_back(id);
      }
    }
    return verdicts;
  }
  Bytes last;
};
struct OlderTest : UbloxTest {
  OlderTest() { u = Ublox(Generation::kM8, 9600); }
};

// ---- sec. 5.2 to 5.4

TEST(UbloxFrame, IsThatOfTheManuals) {
  EXPECT_EQ(ublox::frame(0x06, 0x08, {0xC8, 0, 1, 0, 1, 0}),
            (Bytes{0xB5, 0x62, 0x06, 0x08, 0x06, 0x00, 0xC8, 0x00, 0x01, 0x00, 0x01, 0x00, 0xDE, 0x6A}));
  EXPECT_EQ(ublox::frame(0x0A, 0x04, {}), (Bytes{0xB5, 0x62, 0x0A, 0x04, 0x00, 0x00, 0x0E, 0x34}));
}

TEST(UbloxItems, HaveTheKeysOfTheManuals) {
  EXPECT_EQ(key("CFG-UART1-BAUDRATE"), 0x40520001U);
  EXPECT_EQ(key("CFG-RATE-MEAS"), 0x30210001U);
  EXPECT_EQ(key("CFG-MSGOUT-UBX_NAV_PVT_UART1"), 0x20910007U);
  for (const ublox::Item& item : ublox::kItems) {
    using enum ublox::Type;
    const std::size_t size = item.type == kU4 ? 4 : item.type == kU2 ? 2 : 1;
    EXPECT_EQ(ublox::value_bytes(item.id), size) << item.name;
    EXPECT_EQ(item.id >> 28 == 1, item.type == kL) << item.name;
    EXPECT_TRUE(ublox::in_range(item, item.standard)) << item.name;
    EXPECT_EQ(ublox::find(item.id), &item);
  }
}

// ---- UBX-18010802, UTC representation

TEST(UbloxInstant, RoundsAsInTheExampleOfTheManual) {
  // 2011-12-31 23:59:59.9993 UTC; 15 leap seconds ahead, GPS time was in week 1669 already.
  const ublox::Instant::Utc u = ublox::Instant{1669, 14'999, 300'000, 15}.utc();
  EXPECT_EQ((std::array{u.year, u.month, u.day, u.hour, u.minute, u.second}), (std::array{2012, 1, 1, 0, 0, 0}));
  EXPECT_EQ(u.nano, -700'000);
}

TEST(UbloxInstant, CountsFromTheBeginningOfGpsTime) {
  const ublox::Instant::Utc u = ublox::Instant{0, 521, 0, 0}.utc();
  EXPECT_EQ((std::array{u.year, u.month, u.day, u.hour, u.minute, u.second}), (std::array{1980, 1, 6, 0, 0, 0}));
  EXPECT_EQ(u.nano, 521'000'000);
}

TEST(UbloxInstant, NanoStaysInItsRange) {
  EXPECT_EQ((ublox::Instant{2306, 18'995, -1, 18}.utc().nano), 994'999'999);
  const auto up = ublox::Instant{2306, 18'995, 0, 18}.utc();
  EXPECT_EQ(up.nano, -5'000'000);
  EXPECT_EQ(up.second, 1);
}

// ---- layouts

TEST(UbloxOutput, NavPvtByOffset) {
  ublox::Solution s;
  s.v_mps = {3, 4, 1};
  s.fix = ublox::Fix::kRtkFloat;
  const Bytes p = ublox::nav_pvt({2306, 123'000, 0, 18}, s);
  ASSERT_EQ(p.size(), 92U);
  EXPECT_EQ(at<std::uint32_t>(p, 0), 123'000U);
  EXPECT_EQ(p[10], 45);  // 123 s less 18
  EXPECT_EQ(p[11] & 7, 7);
  EXPECT_EQ(p[20], 3);
  EXPECT_EQ(p[21], 1 | 2 | 1 << 6);
  EXPECT_EQ(p[23], 17);
  EXPECT_EQ(at<std::int32_t>(p, 24), 85'652'650);
  EXPECT_EQ(at<std::int32_t>(p, 28), 472'852'330);
  EXPECT_EQ(at<std::int32_t>(p, 32), 546'600);
  EXPECT_EQ(at<std::int32_t>(p, 36), 499'600);
  EXPECT_EQ(at<std::uint32_t>(p, 40), 1234U);
  EXPECT_EQ(at<std::uint32_t>(p, 44), 2345U);
  EXPECT_EQ(at<std::int32_t>(p, 48), 4000);
  EXPECT_EQ(at<std::int32_t>(p, 52), 3000);
  EXPECT_EQ(at<std::int32_t>(p, 56), -1000);
  EXPECT_EQ(at<std::int32_t>(p, 60), 5000);
  EXPECT_EQ(at<std::int32_t>(p, 64), 3'686'990);
  EXPECT_EQ(at<std::uint32_t>(p, 68), 321U);
  EXPECT_EQ(at<std::uint32_t>(p, 72), 45'000U);
  EXPECT_EQ(at<std::uint16_t>(p, 76), 194);
}

TEST(UbloxOutput, BeyondTheMasksIsAFixThatIsNotValid) {
  ublox::Solution s;
  s.fix = ublox::Fix::kLimits;
  EXPECT_EQ(ublox::nav_pvt({}, s)[20], 3);
  EXPECT_EQ(ublox::nav_pvt({}, s)[21], 0);
  EXPECT_NE(ublox::nmea::gga({}, s).find(",,,,0,12,1.18,,,,,,*"), std::string::npos);
  EXPECT_NE(ublox::nmea::rmc({}, s).find(",V,,,,,,,"), std::string::npos);
}

TEST(UbloxOutput, NavCovIsNorthEastDown) {
  const Bytes p = ublox::nav_cov({}, {});
  ASSERT_EQ(p.size(), 64U);
  EXPECT_EQ(p[5], 1);
  EXPECT_EQ(p[6], 1);
  const std::array expected{2.25F, 0.05F, -0.03F, 0.25F, 0.02F, 1.21F, 0.0225F, 0.002F, -0.003F, 0.01F, 0.001F, 0.04F};
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_FLOAT_EQ(at<float>(p, 16 + 4 * i), expected[i]) << i;
}

TEST(UbloxOutput, OlderMessagesByOffset) {
  ublox::Solution s;
  s.v_mps = {3, 4, 12};
  const Bytes sol = ublox::nav_sol({2306, 500, -300, 18}, s);
  ASSERT_EQ(sol.size(), 52U);
  EXPECT_EQ(at<std::int32_t>(sol, 4), -300);
  EXPECT_EQ(at<std::int16_t>(sol, 8), 2306);
  EXPECT_EQ(sol[10], 3);
  EXPECT_EQ(sol[11], 0x0D);
  const double r_cm = std::hypot(at<std::int32_t>(sol, 12), at<std::int32_t>(sol, 16), at<std::int32_t>(sol, 20));
  EXPECT_NEAR(r_cm, 6366.6e5 + 54660, 2e5);  // the earth's radius at 47 degrees
  EXPECT_NEAR(std::hypot(at<std::int32_t>(sol, 28), at<std::int32_t>(sol, 32), at<std::int32_t>(sol, 36)), 1300, 2);
  EXPECT_EQ(sol[47], 17);
  const Bytes velned = ublox::nav_velned({}, s);
  ASSERT_EQ(velned.size(), 36U);
  EXPECT_EQ(at<std::int32_t>(velned, 12), -1200);
  EXPECT_EQ(at<std::uint32_t>(velned, 16), 1300U);
  EXPECT_EQ(at<std::uint32_t>(velned, 20), 500U);
  const Bytes time = ublox::nav_timeutc({2306, 18'000, 0, 18});
  ASSERT_EQ(time.size(), 20U);
  EXPECT_EQ(at<std::uint16_t>(time, 12), 2024);  // week 2306 begins on 17 March 2024
  EXPECT_EQ(time[14], 3);
  EXPECT_EQ(time[15], 17);
  EXPECT_EQ(time[19], 7);
  const Bytes dop = ublox::nav_dop({}, s);
  ASSERT_EQ(dop.size(), 18U);
  EXPECT_EQ(at<std::uint16_t>(dop, 6), 194);
  EXPECT_EQ(at<std::uint16_t>(dop, 10), 154);
  EXPECT_EQ(at<std::uint16_t>(dop, 12), 118);
  EXPECT_EQ(ublox::nav_posllh({}, s).size(), 28U);
}

TEST(UbloxNmea, HasTheChecksumsOfTheManual) {
  // With talker GP the manual's example has *6E; N for P changes it by 0x1E.
  EXPECT_EQ(ublox::nmea::sentence("GLL,4717.11634,N,00833.91297,E,124923.00,A,A"),
            "$GNGLL,4717.11634,N,00833.91297,E,124923.00,A,A*70\r\n");
}

TEST(UbloxNmea, Sentences) {
  ublox::Solution s;
  s.v_mps = {3, 4, 0};
  const ublox::Instant t{2306, 3'618'000 + 995, 0, 18};
  EXPECT_TRUE(
      ublox::nmea::rmc(t, s).starts_with("$GNRMC,010001.00,A,4717.11398,N,00833.91590,E,9.719,36.87,170324,,,A,V*"));
  EXPECT_TRUE(ublox::nmea::vtg(t, s).starts_with("$GNVTG,36.87,T,,M,9.719,N,18.000,K,A*"));
  EXPECT_TRUE(
      ublox::nmea::gga(t, s).starts_with("$GNGGA,010001.00,4717.11398,N,00833.91590,E,1,12,1.18,499.6,M,47.0,M,,*"));
  EXPECT_TRUE(ublox::nmea::gll(t, s).starts_with("$GNGLL,4717.11398,N,00833.91590,E,010001.00,A,A*"));
  EXPECT_TRUE(ublox::nmea::gst(t, s).starts_with("$GNGST,010001.00,1.8,,,,1.5,0.5,1.1*"));
  EXPECT_TRUE(ublox::nmea::gsa(t, s).starts_with("$GNGSA,A,3,01,03,05,07,09,,,,,,,,1.94,1.18,1.54,1*"));
  s.fix = ublox::Fix::kRtkFixed;
  EXPECT_NE(ublox::nmea::rmc(t, s).find(",R,V*"), std::string::npos);
  EXPECT_NE(ublox::nmea::gll(t, s).find(",A,D*"), std::string::npos);
  EXPECT_NE(ublox::nmea::gga(t, s).find(",E,4,12,"), std::string::npos);
  s.fix = ublox::Fix::kNone;
  EXPECT_TRUE(ublox::nmea::gll(t, s).starts_with("$GNGLL,,,,,010001.00,V,N*"));
  EXPECT_TRUE(ublox::nmea::rmc(t, s).starts_with("$GNRMC,010001.00,V,,,,,,,170324,,,N,V*"));
  EXPECT_TRUE(ublox::nmea::gga(t, s).starts_with("$GNGGA,010001.00,,,,,0,00,99.99,,,,,,*"));
  EXPECT_EQ(ublox::nmea::vtg(t, s), "$GNVTG,,,,,,,,,N*2E\r\n");
}

TEST(UbloxNmea, AnglesCarryAndTakeTheLetterOfTheirHalf) {
  EXPECT_EQ(ublox::nmea::angle(-9.99999999999, 2, 'N', 'S'), "1000.00000,S");
  EXPECT_EQ(ublox::nmea::angle(-0.5, 3, 'E', 'W'), "00030.00000,W");
}

// ---- sec. 5.9.27

TEST_F(UbloxTest, SetsWhatIsAsked) {
  EXPECT_EQ(send(valset(kRam, {{key("CFG-RATE-MEAS"), 200}, {key("CFG-UART1OUTPROT-NMEA"), 0}})), kAcked);
  EXPECT_EQ(u.ram(key("CFG-RATE-MEAS")), 200U);
  EXPECT_EQ(u.ram(key("CFG-UART1OUTPROT-NMEA")), 0U);
  EXPECT_EQ(u.stored(), 0U);
  EXPECT_EQ(send(valset(kRam, {{key("CFG-RATE-MEAS"), 100}}, 1)), kAcked);
  EXPECT_EQ(u.requests(), 2);
  EXPECT_EQ(u.broken_rules(), 0);
}

TEST_F(UbloxTest, RefusesTheWholeOfIt) {
  const std::pair good{key("CFG-RATE-MEAS"), 200U};
  EXPECT_EQ(send(valset(kRam, {good, {0x20919999, 1}})), kRefused);
  EXPECT_EQ(send(valset(kRam, {good, {key("CFG-NAVSPG-FIXMODE"), 4}})), kRefused);
  EXPECT_EQ(send(valset(kRam, {good, {key("CFG-RATE-NAV"), 128}})), kRefused);
  EXPECT_EQ(send(valset(kRam, {good, {key("CFG-UART1-BAUDRATE"), 38401}})), kRefused);
  EXPECT_EQ(send(valset(0, {good})), kRefused);
  EXPECT_EQ(send(valset(kRam | kFlash, {good})), kRefused);
  EXPECT_EQ(send(valset(kRam, {good}, 2)), kRefused);
  EXPECT_EQ(send(valset(kRam, {good}, 1, 1)), kRefused);
  Bytes cut{0, kRam, 0, 0, 0x01, 0x00, 0x21, 0x30, 0xC8};
  EXPECT_EQ(send(ublox::frame(0x06, 0x8A, cut)), kRefused);
  u.injected.unknown_keys = {good.first};
  EXPECT_EQ(send(valset(kRam, {good})), kRefused);
  EXPECT_EQ(u.ram(good.first), 1000U);
  EXPECT_EQ(u.broken_rules(), 0);
}

TEST_F(UbloxTest, Takes64ItemsAndNotOneMore) {
  ublox::Payload p;
  p.u1(0).u1(kRam).u2(0);
  for (int i = 0; i < 64; ++i) p.u4(key("CFG-RATE-NAV")).u2(static_cast<std::uint32_t>(i + 1));
  EXPECT_EQ(send(ublox::frame(0x06, 0x8A, p.bytes())), kAcked);
  EXPECT_EQ(u.ram(key("CFG-RATE-NAV")), 64U);  // the last one stays
  p.u4(key("CFG-RATE-NAV")).u2(1);
  EXPECT_EQ(send(ublox::frame(0x06, 0x8A, p.bytes())), kRefused);
}

TEST_F(UbloxTest, ChecksRangesForRamOnly) {
  EXPECT_EQ(send(valset(kBbr, {{key("CFG-RATE-MEAS"), 1}, {key("CFG-RATE-NAV"), 5}})), kAcked);
  EXPECT_EQ(u.ram(key("CFG-RATE-NAV")), 1U);
  EXPECT_EQ(u.stored(), 2U);
  u.power_cycle(38400);
  EXPECT_EQ(u.ram(key("CFG-RATE-NAV")), 5U);
  EXPECT_EQ(u.ram(key("CFG-RATE-MEAS")), 1000U);
}

TEST_F(UbloxTest, CountsReservedBytes) {
  EXPECT_EQ(send(valset(kRam, {}, 0, 1)), kAcked);
  EXPECT_EQ(u.broken_rules(), 1);
}

// ---- sec. 5.9.26

TEST_F(UbloxTest, ReadsBackBeforeTheAcknowledgement) {
  ublox::Payload p;
  p.u1(0).u1(0).u2(0).u4(key("CFG-RATE-MEAS")).u4(key("CFG-NAVSPG-FIXMODE"));
  EXPECT_EQ(send(ublox::frame(0x06, 0x8B, p.bytes())), kAcked);
  ublox::Payload expected;
  expected.u1(1).u1(0).u2(0).u4(0x30210001).u2(1000).u4(0x20110011).u1(3);
  const Bytes answer = ublox::frame(0x06, 0x8B, expected.bytes());
  ASSERT_GT(last.size(), answer.size());
  EXPECT_TRUE(std::equal(answer.begin(), answer.end(), last.begin()));
}

TEST_F(UbloxTest, HasNothingInBbrAtFirst) {
  ublox::Payload p;
  p.u1(0).u1(1).u2(0).u4(key("CFG-RATE-MEAS"));
  EXPECT_EQ(send(ublox::frame(0x06, 0x8B, p.bytes())), kRefused);
}

// ---- frames and faults

TEST_F(UbloxTest, FindsAFrameBehindADamagedOne) {
  Bytes bad = valset(kRam, {{key("CFG-RATE-MEAS"), 200}});
  bad.back() ^= 1;
  const Bytes good = valset(kRam, {{key("CFG-RATE-MEAS"), 500}});
  Bytes both{0xB5, 0xB5, '$'};
  both.insert(both.end(), bad.begin(), bad.end());
  both.insert(both.end(), good.begin(), good.end());
  u.write(both);
  EXPECT_EQ(u.ram(key("CFG-RATE-MEAS")), 500U);
  EXPECT_EQ(u.requests(), 1);
  EXPECT_EQ(u.broken_rules(), 1);
}

TEST_F(UbloxTest, UnderstandsNothingAtAnotherRate) {
  u.set_baud(9600);
  EXPECT_EQ(send(valset(kRam, {{key("CFG-RATE-MEAS"), 200}})), kNothing);
  EXPECT_EQ(u.requests(), 0);
  EXPECT_EQ(u.broken_rules(), 0);
  step(1'000'000);
  const Bytes noise = read_all(u);
  ASSERT_FALSE(noise.empty());
  EXPECT_NE(noise[0], '$');
}

TEST_F(UbloxTest, AcknowledgesANewRateAtTheNewRate) {
  const Bytes request = valset(kRam, {{key("CFG-UART1-BAUDRATE"), 115200}});
  u.write(request);
  u.set_baud(115200);
  step(20'000);
  EXPECT_EQ(read_all(u), ublox::frame(0x05, 0x01, {0x06, 0x8A}));
  u.power_cycle(38400);
  EXPECT_EQ(u.baud(), 38400U);
}

TEST_F(UbloxTest, FaultsDoWhatTheySay) {
  u.injected.swallow_acks = 1;
  EXPECT_EQ(send(valset(kRam, {{key("CFG-RATE-NAV"), 2}})), kNothing);
  EXPECT_EQ(u.ram(key("CFG-RATE-NAV")), 2U);
  EXPECT_EQ(send(valset(kRam, {})), kAcked);
  u.injected.mute = true;
  EXPECT_EQ(send(valset(kRam, {})), kNothing);
  u.injected.mute = false;
  EXPECT_EQ(send(ublox::frame(0x06, 0x08, {})), kRefused);  // an older message
  u.injected.ignores_unknown = true;
  EXPECT_EQ(send(ublox::frame(0x06, 0x08, {})), kNothing);
  u.injected.write_at_most = 3;
  EXPECT_EQ(u.write(Bytes(10)), 3U);
  u.injected.write_at_most = 1000;
  u.injected.deaf_after_baud_change = true;
  u.write(valset(kRam, {{key("CFG-UART1-BAUDRATE"), 9600}}));
  u.set_baud(9600);
  step(3'000'000);
  EXPECT_TRUE(read_all(u).empty());
}

TEST_F(UbloxTest, AnswersAfterTheDelay) {
  u.injected.delay = Micros{900'000};
  u.write(valset(kRam, {}));
  step(899'999);
  EXPECT_TRUE(read_all(u).empty());
  step(1);
  EXPECT_EQ(read_all(u), ublox::frame(0x05, 0x01, {0x06, 0x8A}));
}

TEST_F(UbloxTest, TellsItsVersionWithoutAcknowledgement) {
  EXPECT_EQ(send(ublox::frame(0x0A, 0x04, {})), kNothing);
  const auto found = payloads(last, 0x0A, 0x04);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].size() % 30, 10U);
}

// ---- epochs

TEST_F(UbloxTest, SpeaksNmeaByItself) {
  step(999'999);
  EXPECT_TRUE(read_all(u).empty());
  step(1);
  const Bytes first = read_all(u);
  const std::string text(first.begin(), first.end());
  EXPECT_TRUE(text.starts_with("$GNRMC,"));
  EXPECT_EQ(text.find("GST"), std::string::npos);
}

TEST_F(UbloxTest, SendsEveryNthOfTheSolutionsAndCrossesTheWeek) {
  u.set_instant({2306, 604'799'500, 0, 18});
  send(valset(kRam, {{key("CFG-RATE-MEAS"), 100},
                     {key("CFG-RATE-NAV"), 5},
                     {key("CFG-UART1OUTPROT-NMEA"), 0},
                     {key("CFG-MSGOUT-UBX_NAV_PVT_UART1"), 1},
                     {key("CFG-MSGOUT-UBX_NAV_COV_UART1"), 2}}));
  u.advance(Micros{2'500'000});
  ASSERT_EQ(u.epochs().size(), 4U);
  EXPECT_EQ(u.epochs()[1].at, Micros{1'500'000});
  EXPECT_EQ(u.epochs()[1].instant.week, 2307);
  EXPECT_EQ(u.epochs()[1].instant.itow_ms, 0U);
  const Bytes all = read_all(u);
  EXPECT_EQ(payloads(all, ublox::kNav, ublox::kNavPvt).size(), 4U);
  EXPECT_EQ(payloads(all, ublox::kNav, ublox::kNavCov).size(), 2U);
  EXPECT_TRUE(u.enabled(ublox::kNavPvt));
  EXPECT_FALSE(u.enabled(ublox::kNavCov));
}

TEST_F(UbloxTest, ComputesForAWhile) {
  u.injected.compute = Micros{70'000};
  u.injected.jitter = Micros{10'000};
  step(1'069'999);
  EXPECT_TRUE(u.epochs().empty());
  step(10'001);
  ASSERT_EQ(u.epochs().size(), 1U);
  EXPECT_EQ(u.epochs()[0].at, Micros{1'000'000});
}

// ---- older messages

TEST_F(OlderTest, SetsItsPort) {
  u.set_baud(9600);
  // 115200, 8N1, UBX in and out: what hosts send to port 1.
  u.write(ublox::frame(0x06, 0x00, {1, 0, 0, 0, 0xD0, 0x08, 0, 0, 0x00, 0xC2, 0x01, 0x00, 7, 0, 1, 0, 0, 0, 0, 0}));
  EXPECT_EQ(u.baud(), 115200U);
  EXPECT_EQ(u.ram(key("CFG-UART1OUTPROT-NMEA")), 0U);
  u.set_baud(115200);
  step(20'000);
  EXPECT_EQ(read_all(u), ublox::frame(0x05, 0x01, {0x06, 0x00}));
  EXPECT_EQ(u.broken_rules(), 0);
}

TEST_F(OlderTest, SetsRatesAndModels) {
  EXPECT_EQ(send(ublox::frame(0x06, 0x08, {0xC8, 0, 2, 0, 1, 0})), kAcked);
  EXPECT_EQ(u.ram(key("CFG-RATE-MEAS")), 200U);
  EXPECT_EQ(u.ram(key("CFG-RATE-NAV")), 2U);
  EXPECT_EQ(send(ublox::frame(0x06, 0x08, {0, 0, 1, 0, 1, 0})), kRefused);
  Bytes nav5(36);
  nav5[0] = 1;  // the model only
  nav5[2] = 8;
  nav5[3] = 2;
  EXPECT_EQ(send(ublox::frame(0x06, 0x24, nav5)), kAcked);
  EXPECT_EQ(u.ram(key("CFG-NAVSPG-DYNMODEL")), 8U);
  EXPECT_EQ(u.ram(key("CFG-NAVSPG-FIXMODE")), 3U);
  EXPECT_EQ(send(valset(kRam, {})), kRefused);
}

TEST_F(OlderTest, SetsMessagesWithAndWithoutItems) {
  EXPECT_EQ(send(ublox::frame(0x06, 0x01, {0x01, 0x07, 1})), kAcked);
  EXPECT_EQ(u.ram(key("CFG-MSGOUT-UBX_NAV_PVT_UART1")), 1U);
  EXPECT_EQ(send(ublox::frame(0x06, 0x01, {0x01, 0x12, 0, 1, 0, 0, 0, 0})), kAcked);
  EXPECT_TRUE(u.enabled(ublox::kNavVelNed));
  EXPECT_EQ(send(ublox::frame(0x06, 0x01, {0xF0, 0x03, 0})), kAcked);
  EXPECT_EQ(send(ublox::frame(0x06, 0x01, {0x01, 0x77, 1})), kRefused);
  step(1'000'000);
  EXPECT_EQ(payloads(read_all(u), ublox::kNav, ublox::kNavVelNed).size(), 1U);
  u.power_cycle(9600);
  EXPECT_FALSE(u.enabled(ublox::kNavVelNed));
}

TEST_F(OlderTest, TheOldestHasNoNavPvt) {
  u = Ublox(Generation::kM6, 9600);
  EXPECT_EQ(send(ublox::frame(0x06, 0x01, {0x01, 0x07, 1})), kRefused);
  EXPECT_EQ(send(ublox::frame(0x06, 0x01, {0x01, 0x36, 1})), kRefused);
  EXPECT_EQ(send(ublox::frame(0x06, 0x01, {0x01, 0x06, 1})), kAcked);
  EXPECT_EQ(send(ublox::frame(0x06, 0x08, {0xC8, 0, 5, 0, 1, 0})), kAcked);
  EXPECT_EQ(u.ram(key("CFG-RATE-NAV")), 1U);
}

}  // namespace
}  // namespace tetap::fakes
