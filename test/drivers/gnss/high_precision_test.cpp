// SPDX-License-Identifier: Apache-2.0
// The messages of receivers with RTK and with two antennas: NAV-HPPOSLLH, NAV-RELPOSNED; and messages without a place
// beside NMEA. Payloads by the u-blox F9 HPG 1.32 interface description (UBX-22008968), sec. 3.15, version 0 of
// NAV-RELPOSNED by UBX-13003221, sec. 32.17.
#include "drivers/gnss/gnss_bench.hpp"
#include "drivers/gnss/gnss_bytes.hpp"
#include "drivers/gnss/ubx/baseline.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>

namespace tetap::drivers::gnss {
namespace {

using sensor::GnssFix;

const Bytes kPvt = ubx_frame(0x01, 0x07, pvt());

/// The place of pvt(), 45e-9 deg north, 37e-9 deg west, 0.3 mm below it.
Bytes hp(std::uint32_t itow = 100'000) {
  Bytes p(36, 0);
  put(p, 4, itow, 4);
  put(p, 8, -1'213'142'468, 4), put(p, 12, 440'690'105, 4), put(p, 16, 1'125'900, 4), put(p, 20, 1'147'200, 4);
  put(p, 24, -37, 1), put(p, 25, 45, 1), put(p, 26, -3, 1), put(p, 27, 6, 1);
  put(p, 28, 142, 4), put(p, 32, 101, 4);
  return p;
}
Bytes hp_frame(const Bytes& payload) { return ubx_frame(0x01, 0x14, payload); }

void expect_fine(const Report& r) {
  EXPECT_NEAR(static_cast<double>(r.latitude_2ndeg), 44.069010545 / 2e-9, 0.6);
  EXPECT_NEAR(static_cast<double>(r.longitude_2ndeg), -121.314246837 / 2e-9, 0.6);
  EXPECT_NEAR(static_cast<double>(r.height_m), 1125.8997, 7e-5) << "a float's";
  EXPECT_NEAR(static_cast<double>(r.height_msl_m), 1147.2006, 7e-5);
  EXPECT_FLOAT_EQ(r.horizontal_acc_m, 0.0142F);
  EXPECT_FLOAT_EQ(r.vertical_acc_m, 0.0101F);
}

TEST(UbxHighPrecision, ThePlaceIsThatOfHpposllhInEitherOrderAndTheRestThatOfPvt) {
  for (const Bytes& stream : {kPvt + hp_frame(hp()), hp_frame(hp()) + kPvt}) {
    const Report r = only(stream);
    expect_fine(r);
    EXPECT_EQ(r.fix, GnssFix::k3d);
    EXPECT_FLOAT_EQ(r.v_n_mps[0], 2.0F);
    const auto p = position_of(r);
    ASSERT_TRUE(p.has_value());
    EXPECT_EQ(p->latitude_2ndeg, r.latitude_2ndeg);
    EXPECT_FLOAT_EQ(p->horizontal_acc_m, 0.0142F);
  }
}

TEST(UbxHighPrecision, EveryTenthOfAMillimetreIsAnotherHeightAndEveryOtherNanodegreeAnotherPlace) {
  Report before;
  for (int part = -9; part <= 9; ++part) {
    Bytes p = hp();
    put(p, 16, 100'000, 4), put(p, 26, part, 1), put(p, 25, 2 * part, 1), put(p, 24, -2 * part, 1);
    const Report r = only(kPvt + hp_frame(p));
    EXPECT_NEAR(static_cast<double>(r.height_m), 100.0 + 1e-4 * part, 1e-5);
    if (part > -9) {
      EXPECT_EQ(r.latitude_2ndeg - before.latitude_2ndeg, 1);
      EXPECT_EQ(r.longitude_2ndeg - before.longitude_2ndeg, -1);
    }
    before = r;
  }
}

TEST(UbxHighPrecision, WithoutPvtNavStatusSaysTheFix) {
  Bytes status(16, 0);
  put(status, 0, 100'000, 4), put(status, 4, 3, 1), put(status, 5, 0x03, 1);
  const Report differential = only(ubx_frame(1, 3, status) + hp_frame(hp()));
  expect_fine(differential);
  EXPECT_EQ(differential.fix, GnssFix::kDifferential);
  put(status, 6, 0x02, 1), put(status, 7, 0x80, 1);
  EXPECT_EQ(only(ubx_frame(1, 3, status) + hp_frame(hp())).fix, GnssFix::kRtkFixed);
  EXPECT_FALSE(only(hp_frame(hp())).usable()) << "nothing says that it is a fix";
}

TEST(UbxHighPrecision, WhatIsNotValidLeavesThePlaceOfPvtAndIsCounted) {
  const auto with = [](std::size_t at, std::int64_t value, std::size_t size) {
    Bytes p = hp();
    put(p, at, value, size);
    return receive(kPvt + hp_frame(p));
  };
  const struct {
    std::size_t at;
    std::int64_t value;
    std::size_t size;
    Reason reason;
  } bad[] = {{0, 1, 1, Reason::kUbxVersion},
             {3, 1, 1, Reason::kNoFix},
             {24, 100, 1, Reason::kOutOfRange},
             {25, -100, 1, Reason::kOutOfRange},
             {26, 10, 1, Reason::kOutOfRange},
             {27, -10, 1, Reason::kOutOfRange},
             {12, 900'000'001, 4, Reason::kOutOfRange},
             {8, -1'800'000'000, 4, Reason::kOutOfRange}};
  for (const auto& b : bad) {
    const Received received = with(b.at, b.value, b.size);
    ASSERT_EQ(received.reports.size(), 1U);
    EXPECT_EQ(received.health.of(b.reason), 1U) << b.at;
    EXPECT_EQ(received.reports[0].latitude_2ndeg, 440'690'105LL * 50) << b.at;
    EXPECT_EQ(received.reports[0].longitude_2ndeg, -1'213'142'468LL * 50) << b.at;
    EXPECT_TRUE(received.reports[0].usable());
  }
  EXPECT_EQ(receive(kPvt + hp_frame(Bytes(28, 0))).health.of(Reason::kUbxLength), 1U);
  const Report other = receive(kPvt + hp_frame(hp(100'200))).reports.at(0);
  EXPECT_EQ(other.latitude_2ndeg, 440'690'105LL * 50) << "of another epoch";
}

// ---- baseline

/// 0.5012 m north, 0.8734 m west, 1.05 cm down; 1.004 m at 299.85 deg, accurate to 0.45 deg.
Bytes rel(std::uint32_t flags = 0x137) {
  Bytes p(64, 0);
  put(p, 0, 1, 1), put(p, 4, 100'000, 4);
  put(p, 8, 50, 4), put(p, 12, -87, 4), put(p, 16, 1, 4), put(p, 20, 100, 4), put(p, 24, 29'985'000, 4);
  put(p, 32, 12, 1), put(p, 33, -34, 1), put(p, 34, 5, 1), put(p, 35, 40, 1);
  put(p, 36, 100, 4), put(p, 40, 110, 4), put(p, 44, 120, 4), put(p, 48, 130, 4), put(p, 52, 45'000, 4);
  put(p, 60, flags, 4);
  return p;
}
Bytes rel_frame(const Bytes& payload) { return ubx_frame(0x01, 0x3C, payload); }
Received received_baseline(const Bytes& payload, float mounted_m = 0) {
  return receive(rel_frame(payload), ReceiverSettings{.baseline_m = mounted_m});
}

TEST(UbxBaseline, ItsHeadingIsFromEastCounterClockwiseWithItsAccuracy) {
  const Received received = received_baseline(rel());
  ASSERT_EQ(received.baselines.size(), 1U);
  EXPECT_TRUE(received.reports.empty());
  const Baseline& b = received.baselines[0];
  EXPECT_EQ(b.itow_ms, 100'000U);
  EXPECT_NEAR(b.n_m[0], -0.8734F, 1e-6F);
  EXPECT_NEAR(b.n_m[1], 0.5012F, 1e-6F);
  EXPECT_NEAR(b.n_m[2], -0.0105F, 1e-7F);
  EXPECT_NEAR(b.length_m, 1.004F, 1e-6F);
  EXPECT_NEAR(b.length_acc_m, 0.013F, 1e-7F);
  const auto heading = heading_of(b);
  ASSERT_TRUE(heading.has_value());
  EXPECT_NEAR(static_cast<double>(heading->yaw_rad), (90.0 + 360.0 - 299.85) * M_PI / 180, 1e-6);
  EXPECT_NEAR(static_cast<double>(heading->acc_rad), 0.45 * M_PI / 180, 1e-8);
  EXPECT_NEAR(static_cast<double>(heading->yaw_rad), std::atan2(0.5012, -0.8734), 1e-3) << "as its own components";
}

TEST(UbxBaseline, EveryQuadrantKeepsItsSense) {
  for (int deg = 0; deg <= 360; deg += 15) {
    Bytes p = rel();
    put(p, 24, deg * 100'000, 4);
    const auto heading = heading_of(received_baseline(p).baselines.at(0));
    ASSERT_TRUE(heading.has_value());
    const double course = deg * M_PI / 180, yaw = static_cast<double>(heading->yaw_rad);
    EXPECT_NEAR(std::cos(yaw), std::sin(course), 1e-6) << deg;  // east
    EXPECT_NEAR(std::sin(yaw), std::cos(course), 1e-6) << deg;  // north
    EXPECT_LE(std::abs(yaw), M_PI + 1e-6);
  }
}

TEST(UbxBaseline, EachFlagThatDeniesAHeadingIsEnoughAndCounted) {
  // Fix, relative position, ambiguities fixed, moving reference, heading: each missing. Float, and both extrapolations.
  for (const std::uint32_t flags : {0x136U, 0x133U, 0x127U, 0x117U, 0x037U, 0x12FU, 0x13FU, 0x177U, 0x1B7U}) {
    const Received received = received_baseline(rel(flags));
    ASSERT_EQ(received.baselines.size(), 1U);
    EXPECT_FALSE(heading_of(received.baselines[0]).has_value()) << std::hex << flags;
    EXPECT_EQ(received.health.of(Reason::kBaseline), 1U) << std::hex << flags;
  }
  for (const std::uint32_t flags : {0x137U, 0x135U}) {
    EXPECT_TRUE(heading_of(received_baseline(rel(flags)).baselines.at(0)).has_value()) << std::hex << flags;
    EXPECT_EQ(received_baseline(rel(flags)).health.of(Reason::kBaseline), 0U);
  }
}

TEST(UbxBaseline, ALengthThatIsNotThatOfTheAntennasIsNoHeading) {
  for (const float mounted_m : {0.0F, 1.0F, 1.09F, 0.92F})
    EXPECT_TRUE(received_baseline(rel(), mounted_m).baselines.at(0).valid);
  for (const float mounted_m : {0.5F, 0.9F, 1.1F, 1.19F, 5.0F}) {
    const Received received = received_baseline(rel(), mounted_m);
    EXPECT_FALSE(received.baselines.at(0).valid) << mounted_m;
    EXPECT_EQ(received.health.of(Reason::kBaseline), 1U);
  }
  // Normalised: the components are those of a unit vector, so there is no length to compare.
  const Baseline b = received_baseline(rel(0x337), 5.0F).baselines.at(0);
  EXPECT_TRUE(b.valid);
  EXPECT_TRUE(std::isnan(b.length_m) && std::isnan(b.n_m[0]));
}

TEST(UbxBaseline, AnAccuracyOfZeroIsNone) {
  Bytes p = rel();
  put(p, 52, 0, 4);
  const auto heading = heading_of(received_baseline(p).baselines.at(0));
  ASSERT_TRUE(heading.has_value());
  EXPECT_TRUE(std::isnan(heading->acc_rad));
}

TEST(UbxBaseline, OtherVersionsLengthsAndPartsAreRefused) {
  const auto refused = [](std::size_t at, std::int64_t value, std::size_t size, Reason reason) {
    Bytes p = rel();
    put(p, at, value, size);
    const Received received = received_baseline(p);
    EXPECT_TRUE(received.baselines.empty()) << at;
    EXPECT_EQ(received.health.of(reason), 1U) << at;
  };
  refused(0, 0, 1, Reason::kUbxVersion);
  refused(0, 2, 1, Reason::kUbxVersion);
  for (const std::size_t at : {32U, 33U, 34U, 35U}) {
    refused(at, 100, 1, Reason::kOutOfRange);
    refused(at, -100, 1, Reason::kOutOfRange);
  }
  refused(24, 36'000'001, 4, Reason::kOutOfRange);
  refused(24, -36'000'001, 4, Reason::kOutOfRange);
  for (const std::size_t length : {0U, 39U, 41U, 63U, 65U}) {
    const Received received = received_baseline(Bytes(length, 0));
    EXPECT_TRUE(received.baselines.empty());
    EXPECT_EQ(received.health.of(Reason::kUbxLength), 1U) << length;
  }
}

TEST(UbxBaseline, TheHeadingOfVersionZeroFollowsFromTheEndsOfTheLine) {
  Bytes p(40, 0);
  put(p, 4, 100'000, 4), put(p, 8, -120, 4), put(p, 12, 90, 4), put(p, 16, 0, 4);
  put(p, 20, -50, 1), put(p, 21, 25, 1);
  put(p, 24, 200, 4), put(p, 28, 50, 4), put(p, 32, 300, 4), put(p, 36, 0x037, 4);
  const Received received = received_baseline(p);
  ASSERT_EQ(received.baselines.size(), 1U);
  const auto heading = heading_of(received.baselines[0]);
  ASSERT_TRUE(heading.has_value());
  const double north = -1.205, east = 0.9025;
  EXPECT_NEAR(static_cast<double>(heading->yaw_rad), std::atan2(north, east), 1e-6);
  // Derivatives of the angle atan2(n, e) by both ends, numerically.
  const double by_n = (std::atan2(north + 1e-6, east) - std::atan2(north - 1e-6, east)) / 2e-6;
  const double by_e = (std::atan2(north, east + 1e-6) - std::atan2(north, east - 1e-6)) / 2e-6;
  EXPECT_NEAR(static_cast<double>(heading->acc_rad), std::hypot(by_n * 0.02, by_e * 0.005), 1e-6);
  EXPECT_NEAR(static_cast<double>(received.baselines[0].length_m), std::hypot(north, east), 1e-6);
  put(p, 36, 0x017, 4);
  EXPECT_FALSE(received_baseline(p).baselines.at(0).valid) << "a base that stands on the ground";
  EXPECT_EQ(received_baseline(p).health.of(Reason::kUbxVersion), 0U);
}

TEST(UbxBaseline, ALateOneDoesNotTearTheEpochsOfThePlace) {
  Bytes stream;
  for (std::uint32_t k = 0; k < 5; ++k) {
    Bytes late = rel();
    put(late, 4, 100'000 + 200 * (k - 1), 4);
    stream = stream + ubx_frame(1, 7, pvt(100'000 + 200 * k)) + rel_frame(late) + hp_frame(hp(100'000 + 200 * k));
  }
  const Received received = receive(stream);
  EXPECT_EQ(received.reports.size(), 5U);
  EXPECT_EQ(received.baselines.size(), 5U);
  for (const Report& r : received.reports) expect_fine(r);
}

/// Stamps of the driver on a line, by time of week.
struct Stamps {
  std::map<std::uint32_t, std::int64_t> places, headings;
  void operator()(const Report& r, base::Micros stamp) { places[*r.itow_ms] = stamp.us; }
  void operator()(const Baseline& b, base::Micros stamp) { headings[b.itow_ms.value()] = stamp.us; }
};

Stamps stamps_of(Line& line, std::int64_t until_us) {
  Stamps out;
  GnssDriver<Line> driver(line, {.configure = false, .latency = base::Micros{60'000}});
  for (; line.now_us < until_us; line.now_us += 1'000) driver.poll({line.now_us}, out);
  return out;
}

TEST(UbxBaseline, ItsStampIsThatOfItsEpochHoweverLateItComesAndThePlacesKeepTheirs) {
  for (const std::int64_t late_us : {0, 150'000, 700'000, 1'500'000}) {
    Line line;
    for (std::uint32_t k = 0; k < 50; ++k) {
      const std::int64_t epoch_us = 1'000'000 + std::int64_t{k} * 200'000;
      Bytes heading = rel();
      put(heading, 4, 100'000 + 200 * k, 4);
      line.say(epoch_us + 60'000, ubx_frame(1, 7, pvt(100'000 + 200 * k)));
      line.say(epoch_us + 60'000 + late_us, rel_frame(heading));
    }
    const Stamps stamps = stamps_of(line, 12'500'000);
    ASSERT_GE(stamps.places.size(), 49U);
    ASSERT_EQ(stamps.headings.size(), 50U);
    for (std::uint32_t k = 2; k < 49; ++k) {
      const double truth_us = 1e6 + 2e5 * k;
      EXPECT_NEAR(static_cast<double>(stamps.places.at(100'000 + 200 * k)), truth_us, 1'500) << late_us << ' ' << k;
      EXPECT_NEAR(static_cast<double>(stamps.headings.at(100'000 + 200 * k)), truth_us, 1'500) << late_us << ' ' << k;
    }
  }
}

TEST(UbxBaseline, AReceiverThatSendsNothingElseIsStampedByItsOwnDelays) {
  Line line;
  for (std::uint32_t k = 0; k < 50; ++k) {
    Bytes heading = rel();
    put(heading, 4, 100'000 + 200 * k, 4);
    line.say(1'060'000 + std::int64_t{k} * 200'000 + (k % 5) * 3'000, rel_frame(heading));
  }
  const Stamps stamps = stamps_of(line, 12'000'000);
  ASSERT_EQ(stamps.headings.size(), 50U);
  for (std::uint32_t k = 0; k < 50; ++k)
    EXPECT_NEAR(static_cast<double>(stamps.headings.at(100'000 + 200 * k)), 1e6 + 2e5 * k, 1'500) << k;
}

// ---- through the driver, as the receiver is configured

TEST(UbxHighPrecision, WantedMessagesAreAskedForAndArrive) {
  DriverSettings settings;
  settings.ubx.high_precision = settings.ubx.baseline = true;
  Bench bench(Generation::kKeys, 38'400, settings);
  ASSERT_TRUE(bench.until(ConfigState::kRunning, 20));
  EXPECT_TRUE(bench.receiver.enabled(0x14));
  EXPECT_TRUE(bench.receiver.enabled(0x3C));
  fakes::ublox::Solution s;
  s.fix = fakes::ublox::Fix::kRtkFixed;
  s.latitude_deg = -33.9123456784;
  s.longitude_deg = 151.2012345678;
  s.height_m = 55.1234;
  s.horizontal_acc_m = 0.0113;
  s.baseline_m = {-0.61, -0.22, 0.015};
  bench.receiver.set_solution(s);
  bench.run(2);
  const auto baselines = bench.baselines.size();
  ASSERT_GT(baselines, 5U);
  const Report& r = bench.reports.back();
  EXPECT_EQ(r.fix, GnssFix::kRtkFixed);
  EXPECT_NEAR(static_cast<double>(r.latitude_2ndeg) * 2e-9, s.latitude_deg, 1.6e-9);
  EXPECT_NEAR(static_cast<double>(r.longitude_2ndeg) * 2e-9, s.longitude_deg, 1.6e-9);
  EXPECT_NEAR(static_cast<double>(r.height_m), s.height_m, 6e-5);
  const auto heading = heading_of(bench.baselines.back());
  ASSERT_TRUE(heading.has_value());
  EXPECT_NEAR(static_cast<double>(heading->yaw_rad), std::atan2(-0.22, -0.61), 1e-6);
  const base::Micros late = bench.baseline_stamps.back() - bench.receiver.epochs().back().at;
  EXPECT_NEAR(static_cast<double>(late.us), 0, 100'000.0);
}

TEST(UbxHighPrecision, UnwantedMessagesAreNotAskedForAndRefusedOnesAreSaid) {
  Bench plain(Generation::kKeys, 38'400);
  ASSERT_TRUE(plain.until(ConfigState::kRunning, 20));
  EXPECT_FALSE(plain.receiver.enabled(0x14));
  EXPECT_FALSE(plain.receiver.enabled(0x3C));
  DriverSettings settings;
  settings.ubx.high_precision = settings.ubx.baseline = true;
  Bench simple(Generation::kKeys, 38'400, settings);
  simple.receiver.injected.unknown_keys = {key("CFG-MSGOUT-UBX_NAV_HPPOSLLH_UART1"),
                                           key("CFG-MSGOUT-UBX_NAV_RELPOSNED_UART1")};
  ASSERT_TRUE(simple.until(ConfigState::kRunning, 20));
  EXPECT_TRUE(simple.driver.configurator().was_refused(ubx::Step::kHpPosLlh));
  EXPECT_TRUE(simple.driver.configurator().was_refused(ubx::Step::kRelPosNed));
  EXPECT_FALSE(simple.driver.configurator().was_refused(ubx::Step::kModel));
  EXPECT_TRUE(simple.receiver.enabled(0x07));
  settings.ubx.baud = 57'600;
  settings.ubx.period_ms = 90;
  EXPECT_FALSE(ubx::valid(settings.ubx)) << "288 bytes are more than half of what the line carries in 90 ms";
  settings.ubx.period_ms = 110;
  EXPECT_TRUE(ubx::valid(settings.ubx));
}

// ---- messages without a place

std::string gga(int second) {
  char text[96];
  std::snprintf(text, sizeof text, "GNGGA,1010%02d.00,4807.0380,N,01131.0000,E,1,09,0.9,545.4,M,46.9,M,,", second);
  return text;
}

TEST(UbxBesideNmea, MessagesWithoutAUsablePlaceSilenceNobody) {
  Bytes status(16, 0), llh(28, 0), velned(36, 0), dop(18, 0), time(16, 0), sol(52, 0), no_fix = pvt();
  put(status, 4, 3, 1), put(status, 5, 0xDD, 1);
  put(llh, 4, 115'166'666, 4), put(llh, 8, 481'173'000, 4);
  put(no_fix, 20, 0, 1), put(no_fix, 21, 0, 1), put(no_fix, 78, 1, 1);
  const struct {
    const char* name;
    std::uint8_t id;
    Bytes payload;
    std::size_t itow_at;
  } kinds[] = {{"STATUS", 0x03, status, 0},
               {"POSLLH without a fix", 0x02, llh, 0},
               {"VELNED", 0x12, velned, 0},
               {"DOP", 0x04, dop, 0},
               {"TIMEGPS", 0x20, time, 0},
               {"SOL without a fix", 0x06, sol, 0},
               {"PVT without a fix", 0x07, no_fix, 0},
               {"HPPOSLLH without a fix", 0x14, hp(), 4},
               {"RELPOSNED", 0x3C, rel(), 4},
               {"EOE", 0x61, Bytes(4, 0), 0},
               {"SAT", 0x35, Bytes(8, 0), 0}};
  for (const auto& kind : kinds) {
    Bytes stream;
    for (int i = 0; i < 20; ++i) {
      Bytes payload = kind.payload;
      put(payload, kind.itow_at, 10'000 + 1'000 * i, 4);
      stream = stream + ubx_frame(0x01, kind.id, payload) + sentence(gga(i));
    }
    const Received received = receive(stream);
    int fixes = 0;
    for (const Report& r : received.reports) fixes += r.protocol == Protocol::kNmea && r.usable() ? 1 : 0;
    EXPECT_EQ(fixes, 20) << kind.name;
    EXPECT_EQ(received.health.of(Reason::kSecondProtocol), 0U) << kind.name;
  }
}

TEST(UbxBesideNmea, StatusWithAPlaceStillHoldsNmeaBack) {
  Bytes status(16, 0), llh(28, 0), stream;
  put(status, 4, 3, 1), put(status, 5, 0x01, 1);
  put(llh, 4, 115'166'666, 4), put(llh, 8, 481'173'000, 4);
  for (int i = 0; i < 20; ++i) {
    put(status, 0, 10'000 + 1'000 * i, 4), put(llh, 0, 10'000 + 1'000 * i, 4);
    stream = stream + ubx_frame(1, 2, llh) + ubx_frame(1, 3, status) + sentence(gga(i));
  }
  const Received received = receive(stream);
  int nmea = 0, ubx = 0;
  for (const Report& r : received.reports) (r.protocol == Protocol::kNmea ? nmea : ubx) += 1;
  EXPECT_EQ(ubx, 20);
  EXPECT_LE(nmea, 1) << "the one before the first place";
  EXPECT_GE(received.health.of(Reason::kSecondProtocol), 19U);
}

TEST(UbxBesideNmea, MessagesAndSentencesThatAreNotReadAreCounted) {
  const Received received = receive(ubx_frame(0x01, 0x35, Bytes(8, 0)) + ubx_frame(0x0D, 0x01, Bytes(16, 0)) +
                                    sentence("GPGSV,1,1,00") + sentence("GPGLL,4807.0380,N,01131.0000,E,101010,A"));
  EXPECT_EQ(received.health.of(Reason::kUnread), 4U);
  EXPECT_EQ(receive(kPvt + sentence(gga(1))).health.of(Reason::kUnread), 0U);
}

}  // namespace
}  // namespace tetap::drivers::gnss
