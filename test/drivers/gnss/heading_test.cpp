// SPDX-License-Identifier: Apache-2.0
// Headings of two antennas in HDT, THS and UBX-NAV-DAHEADING: manuals' lines, layouts written apart from the driver,
// one heading where several sentences carry it, and bytes at random.
#include "drivers/gnss/driver.hpp"
#include "gnss_bytes.hpp"

#include <cmath>
#include <numbers>
#include <random>

namespace tetap::drivers::gnss {
namespace {

constexpr double kDeg = std::numbers::pi / 180;

/// Field by field in the order of the manual's table, whose offsets follow from the sizes.
struct DualAntenna {
  std::uint32_t itow_ms = 100'000;
  std::int32_t north_mm = 600, east_mm = -800, down_mm = 25, length_mm = 1'000;
  double heading_deg = 306.86990;
  std::uint32_t acc_length_mm = 4;
  double acc_heading_deg = 0.21;
  bool fix = true, valid = true, heading_valid = true;
  unsigned carrier = 2;
  std::uint8_t version = 2;

  [[nodiscard]] Bytes payload() const {
    Bytes p;
    const auto four = [&p](std::int64_t v) {
      for (int i = 0; i < 4; ++i) p.push_back(static_cast<std::uint8_t>(v >> (8 * i)));
    };
    p.assign({version, 0, 0, 0});
    four(itow_ms), four(north_mm), four(east_mm), four(down_mm), four(length_mm);
    four(std::llround(heading_deg * 1e5)), four(0), four(3), four(3), four(5), four(acc_length_mm);
    four(std::llround(acc_heading_deg * 1e5)), four(0);
    four((fix ? 1 : 0) + (valid ? 4 : 0) + 8 * static_cast<int>(carrier) + (heading_valid ? 64 : 0));
    return p;
  }
  [[nodiscard]] Bytes frame() const { return ubx_frame(0x01, 0x45, payload()); }
};

TEST(NmeaHeading, LinesOfManualsAreRead) {
  // Navis NavDP 4000, Simrad HS80 and JRC JLR-30 print the forms; the checksum of the first is the manual's.
  const std::string estimated = "$HETHS,316.70,E*1A\r\n";
  const Received dead_reckoning = receive({estimated.begin(), estimated.end()});
  ASSERT_EQ(dead_reckoning.baselines.size(), 1U);
  EXPECT_FALSE(heading_of(dead_reckoning.baselines[0]).has_value()) << "dead reckoning measures nothing";
  EXPECT_EQ(dead_reckoning.health.of(Reason::kBaseline), 1U);
  for (const char* text : {"GPHDT,316.70,T", "GNTHS,316.70,A", "HEHDT,316.7000,T", "INHDT,316.7,T"}) {
    const Received received = receive(sentence(text));
    ASSERT_EQ(received.baselines.size(), 1U) << text;
    const auto heading = heading_of(received.baselines[0]);
    ASSERT_TRUE(heading.has_value()) << text;
    EXPECT_NEAR(std::remainder(static_cast<double>(heading->yaw_rad) - (90 - 316.7) * kDeg, 2 * std::numbers::pi), 0,
                1e-6);
    EXPECT_TRUE(base::is_nan(heading->acc_rad));
    EXPECT_FALSE(received.baselines[0].itow_ms.has_value());
    EXPECT_TRUE(received.reports.empty());
  }
}

TEST(NmeaHeading, WhatIsNoHeadingIsCountedAndNotUsed) {
  for (const char* text : {"GPHDT,,T", "GPHDT,,", "GPTHS,,V", "GPTHS,12.0,V", "GPTHS,12.0,S", "GPTHS,12.0,M"}) {
    const Received received = receive(sentence(text));
    EXPECT_EQ(received.health.of(Reason::kBaseline), 1U) << text;
    for (const Baseline& b : received.baselines) EXPECT_FALSE(b.valid) << text;
  }
  for (const char* text :
       {"GPHDT,360.001,T", "GPHDT,-1.0,T", "GPHDT,12.0,M", "GPHDT,1x,T", "GPTHS,12.0,B", "GPTHS,1"}) {
    const Received received = receive(sentence(text));
    EXPECT_EQ(received.health.of(Reason::kNmeaField), 1U) << text;
    EXPECT_TRUE(received.baselines.empty()) << text;
  }
  EXPECT_EQ(receive(sentence("PAHDT,12.0,T")).health.of(Reason::kUnread), 1U);
}

TEST(NmeaHeading, OneOfSeveralSentencesCounts) {
  Bytes both, with_ubx;
  for (int i = 0; i < 20; ++i) {
    both = both + sentence("GNTHS,45.0,A") + sentence("GNHDT,45.0,T");
    with_ubx = with_ubx + DualAntenna{}.frame() + sentence("GNTHS,45.0,A") + sentence("GNHDT,45.0,T");
  }
  const Received nmea = receive(both), all = receive(with_ubx);
  EXPECT_EQ(nmea.baselines.size(), 20U);
  EXPECT_EQ(nmea.health.of(Reason::kSecondProtocol), 20U);
  EXPECT_EQ(all.baselines.size(), 20U);
  EXPECT_EQ(all.health.of(Reason::kSecondProtocol), 40U);
  // A receiver that stops sending one of them: the other takes over after three.
  Bytes hdt_alone = sentence("GNTHS,45.0,A");
  for (int i = 0; i < 10; ++i) hdt_alone = hdt_alone + sentence("GNHDT,45.0,T");
  EXPECT_EQ(receive(hdt_alone).baselines.size(), 1U + 7U);
}

TEST(UbxDualAntenna, FieldsBecomeALineAndAHeading) {
  const Received received = receive(DualAntenna{}.frame());
  ASSERT_EQ(received.baselines.size(), 1U);
  const Baseline& b = received.baselines[0];
  EXPECT_EQ(b.itow_ms, 100'000U);
  EXPECT_FLOAT_EQ(b.n_m[0], -0.8F);
  EXPECT_FLOAT_EQ(b.n_m[1], 0.6F);
  EXPECT_FLOAT_EQ(b.n_m[2], -0.025F);
  EXPECT_FLOAT_EQ(b.length_m, 1.0F);
  EXPECT_FLOAT_EQ(b.length_acc_m, 0.004F);
  const auto heading = heading_of(b);
  ASSERT_TRUE(heading.has_value());
  // The line and the heading are one: the receiver's own fields agree.
  EXPECT_NEAR(static_cast<double>(heading->yaw_rad), std::atan2(0.6, -0.8), 1e-6);
  EXPECT_NEAR(static_cast<double>(heading->acc_rad), 0.21 * kDeg, 1e-7);
}

TEST(UbxDualAntenna, OnlyAFixedLineOfTheRightLengthIsAHeading) {
  const auto valid = [](const DualAntenna& m, float mounted_m = 0) {
    Health health;
    const auto b = ubx::dual_antenna(m.payload(), mounted_m, health);
    EXPECT_TRUE(b.has_value());
    EXPECT_EQ(health.of(Reason::kBaseline), b && b->valid ? 0U : 1U);
    return b && b->valid;
  };
  EXPECT_TRUE(valid({}));
  EXPECT_FALSE(valid({.fix = false}));
  EXPECT_FALSE(valid({.valid = false}));
  EXPECT_FALSE(valid({.heading_valid = false}));
  EXPECT_FALSE(valid({.carrier = 1}));
  EXPECT_FALSE(valid({.carrier = 3}));
  EXPECT_TRUE(valid({}, 1.04F));
  EXPECT_FALSE(valid({}, 1.10F));
}

TEST(UbxDualAntenna, OtherVersionsLengthsAndAnglesAreRefused) {
  EXPECT_EQ(receive(DualAntenna{.version = 1}.frame()).health.of(Reason::kUbxVersion), 1U);
  Bytes longer = DualAntenna{}.payload();
  longer.push_back(0);
  EXPECT_EQ(receive(ubx_frame(0x01, 0x45, longer)).health.of(Reason::kUbxLength), 1U);
  EXPECT_EQ(receive(ubx_frame(0x01, 0x45, {})).health.of(Reason::kUbxVersion), 1U);
  EXPECT_EQ(receive(DualAntenna{.heading_deg = 360.00001}.frame()).health.of(Reason::kOutOfRange), 1U);
}

TEST(Headings, BytesAtRandomMakeNoneThatCannotBe) {
  std::mt19937 random(56);
  Bytes good;
  for (int i = 0; i < 50; ++i)
    good = good + DualAntenna{}.frame() + sentence("GNTHS,45.0,A") + sentence("GNHDT,45.0,T");
  for (int run = 0; run < 200; ++run) {
    Bytes bytes = good;
    for (int hit = 0; hit < 40; ++hit) bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
    for (const Baseline& b : receive(bytes).baselines) {
      if (!b.valid) continue;
      EXPECT_LE(std::abs(b.course_rad), 6.2832F);
      EXPECT_FALSE(base::is_nan(b.course_rad));
    }
  }
}

}  // namespace
}  // namespace tetap::drivers::gnss
