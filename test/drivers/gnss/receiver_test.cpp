// SPDX-License-Identifier: Apache-2.0
// Laws of the byte-fed receiver: whatever the division of the bytes, the damage and the bytes in between, whole frames
// are decoded and nothing else. Then each message against its description, field by field.
#include "drivers/gnss/gnss_bytes.hpp"

#include <gtest/gtest.h>

#include <cctype>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

namespace tetap::drivers::gnss {
namespace {

using sensor::GnssFix;

Bytes rtcm_frame(const Bytes& payload) {
  Bytes out{0xD3, static_cast<std::uint8_t>(payload.size() >> 8), static_cast<std::uint8_t>(payload.size() & 0xFF)};
  for (const std::uint8_t byte : payload) out.push_back(byte);
  const std::uint32_t crc = crc24q(out);
  for (const int shift : {16, 8, 0}) out.push_back(static_cast<std::uint8_t>(crc >> shift));
  return out;
}

Bytes cov(std::uint32_t itow) {
  Bytes p(64, 0);
  put(p, 0, itow, 4);
  put(p, 5, 1, 1), put(p, 6, 1, 1);
  for (int i = 0; i < 12; ++i) put_float(p, static_cast<std::size_t>(16 + 4 * i), static_cast<float>(i + 1));
  return p;
}

const Bytes kPvt = ubx_frame(0x01, 0x07, pvt());
const std::string kGga = "GNGGA,235959.20,4404.14063,N,12118.85478,W,1,12,0.91,1147.2,M,-21.3,M,,";
const std::string kRmc = "GPRMC,235959.20,A,4404.14063,N,12118.85478,W,1.5,90.0,280224,,,A";

// ---- framing

TEST(GnssFraming, ADamagedByteCostsItsOwnFrameAndNoOther) {
  const Bytes middle = ubx_frame(0x01, 0x07, pvt(200'000));
  const Bytes last = ubx_frame(0x01, 0x07, pvt(300'000));
  const Bytes more = ubx_frame(0x01, 0x07, pvt(400'000));
  for (std::size_t at = 0; at < middle.size(); ++at) {
    for (const int bit : {0, 3, 7}) {
      Bytes damaged = middle;
      damaged[at] = static_cast<std::uint8_t>(damaged[at] ^ 1 << bit);
      // A length that grew by kilobytes is refused at once, one that grew by less is waited for.
      Bytes stream = kPvt + damaged + last;
      for (int i = 0; i < 10; ++i) stream = stream + more;
      const Received received = receive(stream);
      ASSERT_EQ(received.reports.size(), 3U) << at << " bit " << bit;
      EXPECT_EQ(received.reports[1].itow_ms, 300'000U);
      EXPECT_GE(received.health.of(Reason::kNoise), 1U);
    }
  }
}

TEST(GnssFraming, EveryCutOfTheStreamLosesAtMostWhatItCutsThrough) {
  const Bytes stream = kPvt + sentence("GPTXT,hello") + ubx_frame(0x01, 0x07, pvt(200'000));
  for (std::size_t cut = 0; cut <= stream.size(); ++cut) {
    const Received received = receive(Bytes(stream.begin() + static_cast<std::ptrdiff_t>(cut), stream.end()));
    EXPECT_EQ(received.reports.size(), cut == 0 ? 2U : cut <= stream.size() - 100 ? 1U : 0U) << cut;
  }
}

TEST(GnssFraming, WhatIsInsideAFrameOfAnotherProtocolIsNotHeard) {
  const Received received = receive(rtcm_frame(kPvt + sentence(kGga)) + ubx_frame(0x02, 0x15, sentence(kGga)));
  EXPECT_TRUE(received.reports.empty());
  EXPECT_EQ(received.health.rtcm_frames, 1U);
  EXPECT_EQ(received.health.ubx_frames, 1U);
  EXPECT_EQ(received.health.nmea_frames, 0U);
}

TEST(GnssFraming, AnRtcmFrameOfTheGreatestLengthIsSkippedAndALongerUbxFrameRefused) {
  const Received received = receive(rtcm_frame(Bytes(1023, 0x42)) + ubx_frame(0x02, 0x15, Bytes(1022, 0x42)) + kPvt);
  EXPECT_EQ(received.health.rtcm_frames, 1U);
  EXPECT_EQ(received.health.of(Reason::kTooLong), 1U);
  EXPECT_EQ(received.reports.size(), 1U);
}

TEST(GnssFraming, ADamagedRtcmFrameGivesBackWhatWasBehindItsStart) {
  Bytes rtcm = rtcm_frame(Bytes(30, 0x42));
  rtcm[2] = 200;  // its length
  const Received received = receive(rtcm + kPvt + kPvt + kPvt);
  EXPECT_EQ(received.health.of(Reason::kRtcmCrc), 1U);
  EXPECT_EQ(received.health.ubx_frames, 3U);
}

TEST(GnssFraming, Crc24qHasItsPublishedCheckValue) {
  const std::string digits = "123456789";
  EXPECT_EQ(crc24q(Bytes(digits.begin(), digits.end())), 0xCDE703U);  // CRC-24/LTE-A, as catalogued
}

TEST(GnssFraming, ChecksumsOfSentencesAreRequiredUnlessSaidOtherwise) {
  const std::string bare = "$" + kGga + "\r\n";
  const Bytes without(bare.begin(), bare.end());
  EXPECT_EQ(receive(without).health.of(Reason::kNmeaNoChecksum), 1U);
  EXPECT_TRUE(receive(without).reports.empty());
  EXPECT_EQ(receive(without, false).reports.size(), 1U);
  for (std::size_t at = 1; at + 5 < sentence(kGga).size(); ++at) {
    Bytes wrong = sentence(kGga);
    wrong[at] = wrong[at] == '5' ? '6' : '5';
    EXPECT_TRUE(receive(wrong, false).reports.empty()) << at;
  }
  Bytes small = sentence(kGga);
  for (std::size_t i = small.size() - 4; i < small.size(); ++i)
    small[i] = static_cast<std::uint8_t>(std::tolower(small[i]));
  EXPECT_EQ(receive(small).reports.size(), 1U);
}

TEST(GnssFraming, SentencesThatAreCutShortTooLongOrNoTextAreNamed) {
  const Bytes whole = sentence(kGga);
  EXPECT_EQ(receive(Bytes(whole.begin(), whole.begin() + 20) + whole).health.of(Reason::kNmeaCutShort), 1U);
  EXPECT_EQ(receive(sentence("GPGGA," + std::string(200, '1'))).health.of(Reason::kTooLong), 1U);
  EXPECT_EQ(receive(sentence("GPGGA,\x01")).health.of(Reason::kNmeaBadCharacter), 1U);
  EXPECT_EQ(receive(Bytes(whole.begin(), whole.begin() + 20)).health.of(Reason::kGap), 1U);
}

TEST(GnssFraming, AGapGivesUpTheFrameAndFindsTheOneWithinIt) {
  GnssReceiver<> receiver;
  int reports = 0;
  const auto count = [&](const Report&) { ++reports; };
  receiver.on_bytes(Bytes{0xB5, 0x62, 0x01, 0x07, 0x00, 0x03} + kPvt, count);  // the start of a frame of 776 bytes
  EXPECT_EQ(receiver.health().ubx_frames, 0U);
  receiver.on_gap(count);
  EXPECT_EQ(receiver.health().ubx_frames, 1U);
  EXPECT_FALSE(receiver.within_frame());
}

TEST(GnssFraming, AnswersToConfigurationAreHandedOn) {
  const Received received = receive(ubx_frame(0x05, 1, {0x06, 0x8A}) + ubx_frame(0x05, 0, {0x06, 0x01}) +
                                    ubx_frame(0x0A, 0x04, Bytes(100, 0)) + ubx_frame(0x05, 1, {0x06}));
  ASSERT_EQ(received.acknowledgements.size(), 2U);
  EXPECT_TRUE(received.acknowledgements[0].accepted);
  EXPECT_EQ(received.acknowledgements[0].message_id, 0x8A);
  EXPECT_FALSE(received.acknowledgements[1].accepted);
  EXPECT_EQ(received.identified, 1);
  EXPECT_EQ(received.health.of(Reason::kUbxLength), 1U);
}

// ---- UBX

TEST(Ubx, EveryFieldOfNavPvtArrivesInItsUnit) {
  for (const std::size_t length : {std::size_t{92}, std::size_t{84}}) {
    const Report r = only(ubx_frame(0x01, 0x07, pvt(100'000, length)));
    EXPECT_EQ(r.itow_ms, 100'000U);
    EXPECT_EQ(r.utc, (Utc{2024, 2, 29, 23, 59, 60, -123'456, true, true}));
    EXPECT_EQ(r.fix, GnssFix::k3d);
    EXPECT_EQ(r.satellites, 17);
    EXPECT_EQ(r.latitude_2ndeg, 440'690'105LL * 50);
    EXPECT_EQ(r.longitude_2ndeg, -1'213'142'468LL * 50);
    EXPECT_FLOAT_EQ(r.height_m, 1125.9F);
    EXPECT_FLOAT_EQ(r.height_msl_m, 1147.2F);
    EXPECT_FLOAT_EQ(r.horizontal_acc_m, 1.234F);
    EXPECT_FLOAT_EQ(r.vertical_acc_m, 2.345F);
    EXPECT_FLOAT_EQ(r.v_n_mps[0], 2.0F);
    EXPECT_FLOAT_EQ(r.v_n_mps[1], -1.5F);
    EXPECT_FLOAT_EQ(r.v_n_mps[2], -0.25F) << "up, not down";
    EXPECT_FLOAT_EQ(r.speed_mps, 2.5F);
    EXPECT_NEAR(static_cast<double>(r.course_rad), 126.87 * M_PI / 180, 1e-6);
    EXPECT_FLOAT_EQ(r.speed_acc_mps, 0.321F);
    EXPECT_NEAR(static_cast<double>(r.course_acc_rad), 0.45 * M_PI / 180, 1e-8);
    EXPECT_FLOAT_EQ(r.pdop, 1.56F);
  }
}

TEST(Ubx, FixTypesFollowFlagsAndCarrierSolution) {
  const auto fix = [](int type, int flags) {
    Bytes p = pvt();
    put(p, 20, type, 1), put(p, 21, flags, 1);
    return only(ubx_frame(0x01, 0x07, p)).fix;
  };
  EXPECT_EQ(fix(0, 0x01), GnssFix::kNone);
  EXPECT_EQ(fix(1, 0x01), GnssFix::kNone);
  EXPECT_EQ(fix(2, 0x01), GnssFix::k2d);
  EXPECT_EQ(fix(3, 0x00), GnssFix::kNone);
  EXPECT_EQ(fix(3, 0x03), GnssFix::kDifferential);
  EXPECT_EQ(fix(3, 0x43), GnssFix::kRtkFloat);
  EXPECT_EQ(fix(4, 0x83), GnssFix::kRtkFixed);
  EXPECT_EQ(fix(5, 0x01), GnssFix::kTimeOnly);
  EXPECT_EQ(fix(9, 0x01), GnssFix::kNone);
}

TEST(Ubx, APlaceThatIsNotOnEarthAndATimeThatIsNoneAreRefused) {
  const auto ctx = [](std::size_t at, std::int64_t value, std::size_t size) {
    Bytes p = pvt();
    put(p, at, value, size);
    return receive(ubx_frame(0x01, 0x07, p));
  };
  for (const std::int64_t lat : {900'000'001LL, -900'000'001LL, -2'147'483'648LL}) {
    const Received received = ctx(28, lat, 4);
    EXPECT_FALSE(received.reports.at(0).usable());
    EXPECT_EQ(received.health.of(Reason::kOutOfRange), 1U);
    EXPECT_FALSE(position_of(received.reports[0]).has_value());
  }
  EXPECT_FALSE(ctx(24, 1'800'000'001, 4).reports.at(0).usable());
  EXPECT_TRUE(ctx(24, 1'800'000'000, 4).reports.at(0).usable());
  EXPECT_FALSE(ctx(78, 1, 1).reports.at(0).usable()) << "flags3.invalidLlh";
  const Received fast = ctx(48, 2'000'000, 4);
  EXPECT_FALSE(velocity_of(fast.reports.at(0)).has_value());
  EXPECT_EQ(fast.health.of(Reason::kOutOfRange), 1U);
  const Received date = ctx(7, 31, 1);
  EXPECT_FALSE(date.reports.at(0).utc.date_valid);
  EXPECT_EQ(date.health.of(Reason::kBadTime), 1U);
  EXPECT_FALSE(ctx(11, 0, 1).reports.at(0).utc.time_valid);
}

TEST(Ubx, MessagesOfAWrongLengthAreRefused) {
  for (const std::size_t length : {0U, 4U, 83U, 85U, 91U, 93U, 100U}) {
    const Received received = receive(ubx_frame(0x01, 0x07, Bytes(length, 0)));
    EXPECT_TRUE(received.reports.empty());
    EXPECT_EQ(received.health.of(Reason::kUbxLength), 1U) << length;
  }
}

TEST(Ubx, NavCovOfTheSameEpochBecomesEastNorthUp) {
  const Report r = only(kPvt + ubx_frame(0x01, 0x36, cov(100'000)));
  // nn ne nd ee ed dd = 1 2 3 4 5 6
  ASSERT_TRUE(r.position_cov_m2.has_value());
  EXPECT_EQ(*r.position_cov_m2, (Covariance{4, 2, -5, 1, -3, 6}));
  EXPECT_EQ(*r.velocity_cov_m2ps2, (Covariance{10, 8, -11, 7, -9, 12}));
  EXPECT_FLOAT_EQ(position_of(r)->horizontal_acc_m, std::sqrt(2.5F));
  EXPECT_FLOAT_EQ(position_of(r)->vertical_acc_m, std::sqrt(6.0F));
  EXPECT_FLOAT_EQ(velocity_of(r)->acc_mps, std::sqrt(29.0F / 3));
}

TEST(Ubx, NavCovOfAnotherEpochOrVersionOrWithoutSenseIsNotUsed) {
  const Received other = receive(kPvt + ubx_frame(0x01, 0x36, cov(100'200)));
  ASSERT_EQ(other.reports.size(), 1U);
  EXPECT_FALSE(other.reports[0].position_cov_m2.has_value());
  Bytes version = cov(100'000);
  version[4] = 1;
  const Received refused = receive(kPvt + ubx_frame(0x01, 0x36, version));
  EXPECT_FALSE(refused.reports.at(0).position_cov_m2.has_value());
  EXPECT_EQ(refused.health.of(Reason::kUbxVersion), 1U);
  for (const float bad :
       {-1.0F, 0.0F, std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    Bytes p = cov(100'000);
    put_float(p, 16, bad);
    EXPECT_FALSE(only(kPvt + ubx_frame(0x01, 0x36, p)).position_cov_m2.has_value());
  }
}

TEST(Ubx, AnEpochIsHandedOnWithItsLastMessageOnceThatIsKnown) {
  GnssReceiver<> receiver;
  std::vector<std::uint32_t> itows;
  const auto keep = [&](const Report& r) {
    itows.push_back(*r.itow_ms);
    EXPECT_TRUE(r.position_cov_m2.has_value());
  };
  for (std::uint32_t epoch = 1; epoch <= 4; ++epoch) {
    receiver.on_bytes(ubx_frame(0x01, 0x07, pvt(epoch * 200)), keep);
    const std::size_t before = itows.size();
    receiver.on_bytes(ubx_frame(0x01, 0x36, cov(epoch * 200)), keep);
    EXPECT_EQ(itows.size() - before, epoch == 1 ? 0U : 1U) << "the first when the second begins, then at once";
  }
  EXPECT_EQ(itows, (std::vector<std::uint32_t>{200, 400, 600, 800}));
}

TEST(Ubx, TheOlderMessagesOfAnEpochMakeOneReport) {
  Bytes llh(28, 0), ned(36, 0), sol(52, 0), dop(18, 0), utc(20, 0);
  for (Bytes* p : {&llh, &ned, &sol, &dop, &utc}) put(*p, 0, 5'000, 4);
  put(llh, 4, 85'000'000, 4), put(llh, 8, 470'000'000, 4), put(llh, 12, 450'000, 4), put(llh, 16, 400'000, 4);
  put(llh, 20, 3'000, 4), put(llh, 24, 5'000, 4);
  put(ned, 4, 300, 4), put(ned, 8, -400, 4), put(ned, 12, 20, 4), put(ned, 20, 500, 4), put(ned, 24, 30'687'000, 4);
  put(ned, 28, 40, 4);
  put(sol, 10, 3, 1), put(sol, 11, 3, 1), put(sol, 44, 210, 2), put(sol, 47, 9, 1);
  put(dop, 6, 199, 2), put(dop, 10, 150, 2), put(dop, 12, 120, 2);
  put(utc, 8, 5, 4), put(utc, 12, 2011, 2), put(utc, 14, 10, 1), put(utc, 15, 24, 1), put(utc, 16, 12, 1);
  put(utc, 17, 51, 1), put(utc, 18, 8, 1), put(utc, 19, 7, 1);
  const Report r = only(ubx_frame(1, 2, llh) + ubx_frame(1, 4, dop) + ubx_frame(1, 6, sol) + ubx_frame(1, 0x12, ned) +
                        ubx_frame(1, 0x21, utc));
  EXPECT_EQ(r.fix, GnssFix::kDifferential);
  EXPECT_EQ(r.satellites, 9);
  EXPECT_EQ(r.latitude_2ndeg, 23'500'000'000LL);
  EXPECT_EQ(r.longitude_2ndeg, 4'250'000'000LL);
  EXPECT_FLOAT_EQ(r.height_m, 450);
  EXPECT_FLOAT_EQ(r.height_msl_m, 400);
  EXPECT_FLOAT_EQ(r.v_n_mps[0], -4);
  EXPECT_FLOAT_EQ(r.v_n_mps[1], 3);
  EXPECT_FLOAT_EQ(r.v_n_mps[2], -0.2F);
  EXPECT_FLOAT_EQ(r.speed_mps, 5);
  EXPECT_FLOAT_EQ(r.speed_acc_mps, 0.4F);
  EXPECT_FLOAT_EQ(r.hdop, 1.2F);
  EXPECT_EQ(r.utc, (Utc{2011, 10, 24, 12, 51, 8, 5, true, true}));
}

TEST(Calendar, GpsWeeksBecomeUtc) {
  EXPECT_EQ(utc_of_gps(0, 0, 0), (Utc{1980, 1, 6, 0, 0, 0, 0, true, true}));
  EXPECT_EQ(utc_of_gps(2024, 420'964'000, 18), (Utc{2018, 10, 25, 20, 55, 46, 0, true, true}));
  EXPECT_EQ(utc_of_gps(2048, 0, 18), (Utc{2019, 4, 6, 23, 59, 42, 0, true, true}));
  EXPECT_FALSE(utc_of_gps(-1, 0, 18).time_valid);
  EXPECT_FALSE(utc_of_gps(0, 0, 18).time_valid);
}

// ---- NMEA

std::optional<std::int64_t> number(const std::string& text, int decimals) {
  return nmea::scaled(Bytes(text.begin(), text.end()), decimals);
}

TEST(NmeaNumbers, AreExactAndRoundHalfAway) {
  EXPECT_EQ(number("0", 3), 0);
  EXPECT_EQ(number("-21.3", 3), -21'300);
  EXPECT_EQ(number("+1.2345", 3), 1'235);
  EXPECT_EQ(number("1.23449999", 3), 1'234);
  EXPECT_EQ(number("-0.0005", 3), -1);
  EXPECT_EQ(number(".5", 0), 1);
  EXPECT_EQ(number("00012.", 2), 1'200);
  EXPECT_EQ(number("999999999999999", 0), 999'999'999'999'999);
  for (const char* bad : {"", "-", ".", "1.2.3", "1e3", " 1", "1 ", "--1", "0x1", "nan", "9999999999999999", "1-"})
    EXPECT_FALSE(number(bad, 0).has_value()) << bad;
  EXPECT_FALSE(number("9999999999", 9).has_value());
}

TEST(Nmea, GgaAndRmcOfAnyTalkerMakeOneReport) {
  for (const char* talker : {"GP", "GN", "GL", "GA", "BD", "IN", "XX"}) {
    const Report r = only(sentence(talker + kGga.substr(2)) + sentence(talker + kRmc.substr(2)));
    EXPECT_EQ(r.protocol, Protocol::kNmea);
    EXPECT_EQ(r.fix, GnssFix::k3d);
    EXPECT_EQ(r.satellites, 12);
    // 44 deg 4.14063 min is 44.0690105 deg; 121 deg 18.85478 min is 121.314246333... deg.
    EXPECT_EQ(r.latitude_2ndeg, 22'034'505'250LL);
    EXPECT_EQ(r.longitude_2ndeg, -60'657'123'167LL);
    EXPECT_FLOAT_EQ(r.height_msl_m, 1147.2F);
    EXPECT_FLOAT_EQ(r.height_m, 1125.9F);
    EXPECT_FLOAT_EQ(r.hdop, 0.91F);
    EXPECT_FLOAT_EQ(r.speed_mps, 1.5F * 1852 / 3600);
    EXPECT_FLOAT_EQ(r.v_n_mps[0], 1.5F * 1852 / 3600);
    EXPECT_NEAR(static_cast<double>(r.v_n_mps[1]), 0, 1e-6);
    EXPECT_TRUE(std::isnan(r.v_n_mps[2]));
    EXPECT_TRUE(std::isnan(r.horizontal_acc_m));
    EXPECT_EQ(r.utc, (Utc{2024, 2, 28, 23, 59, 59, 200'000'000, true, true}));
  }
  EXPECT_TRUE(receive(sentence("PUBX" + kGga.substr(4))).reports.empty());
}

TEST(Nmea, DilutionAndAccuracyComeFromGsaAndGst) {
  const Report r = only(sentence(kGga) + sentence("GNGSA,A,3,01,02,,,,,,,,,,,1.71,1.01,1.38") +
                        sentence("GNGST,235959.20,1.3,2.0,1.0,40.0,3.0,4.0,6.5"));
  EXPECT_FLOAT_EQ(r.pdop, 1.71F);
  EXPECT_FLOAT_EQ(r.hdop, 1.01F);
  EXPECT_FLOAT_EQ(r.vdop, 1.38F);
  EXPECT_FLOAT_EQ(r.horizontal_acc_m, std::sqrt(12.5F));
  EXPECT_FLOAT_EQ(r.vertical_acc_m, 6.5F);
}

TEST(Nmea, VtgGivesSpeedAndCourseOnlyWhereRmcDoesNot) {
  const std::string vtg = "GPVTG,180.0,T,,M,10.0,N,18.5,K,A";
  EXPECT_FLOAT_EQ(only(sentence(kGga) + sentence(vtg)).v_n_mps[1], -10.0F * 1852 / 3600);
  EXPECT_FLOAT_EQ(only(sentence(kGga) + sentence(kRmc) + sentence(vtg)).speed_mps, 1.5F * 1852 / 3600);
  const Report still = only(sentence(kGga) + sentence("GPVTG,,T,,M,0.0,N,0.0,K,A"));
  EXPECT_EQ(still.v_n_mps[0], 0);
  const Report slow = only(sentence(kGga) + sentence("GPVTG,,T,,M,0.1,N,0.2,K,A"));
  EXPECT_FALSE(velocity_of(slow).has_value()) << "a speed without a course is no velocity";
}

TEST(Nmea, QualityStatusAndModeDecideTheFix) {
  const auto fix = [](const std::string& quality, const std::string& status, const std::string& mode,
                      const std::string& dimension) {
    std::string gga = kGga, rmc = kRmc;
    gga.replace(gga.find(",W,1,") + 3, 1, quality);
    rmc.replace(rmc.find(",A,"), 3, "," + status + ",");
    rmc.replace(rmc.size() - 1, 1, mode);
    return only(sentence(gga) + sentence(rmc) + sentence("GNGSA,A," + dimension + ",01,,,,,,,,,,,,1,1,1")).fix;
  };
  EXPECT_EQ(fix("1", "A", "A", "3"), GnssFix::k3d);
  EXPECT_EQ(fix("2", "A", "D", "3"), GnssFix::kDifferential);
  EXPECT_EQ(fix("4", "A", "R", "3"), GnssFix::kRtkFixed);
  EXPECT_EQ(fix("5", "A", "F", "3"), GnssFix::kRtkFloat);
  EXPECT_EQ(fix("1", "A", "A", "2"), GnssFix::k2d);
  EXPECT_EQ(fix("1", "A", "A", "1"), GnssFix::kNone);
  for (const char* quality : {"0", "6", "7", "8"}) EXPECT_EQ(fix(quality, "A", "A", "3"), GnssFix::kNone) << quality;
  EXPECT_EQ(fix("1", "V", "A", "3"), GnssFix::kNone);
  for (const char* mode : {"N", "E", "M", "S"}) EXPECT_EQ(fix("1", "A", mode, "3"), GnssFix::kNone) << mode;
}

TEST(Nmea, AFixWithoutSatellitesIsNone) {
  std::string gga = kGga;
  gga.replace(gga.find(",12,"), 4, ",00,");
  EXPECT_EQ(only(sentence(gga)).fix, GnssFix::kNone);
  gga.replace(gga.find(",00,"), 4, ",,");
  EXPECT_EQ(only(sentence(gga)).fix, GnssFix::k3d) << "not said";
}

TEST(Nmea, EmptyFieldsAreNoErrorAndNoFix) {
  const Received received =
      receive(sentence("GNRMC,,V,,,,,,,,,,N") + sentence("GNVTG,,,,,,,,,N") + sentence("GNGGA,,,,,,0,00,99.99,,,,,,") +
              sentence("GNGSA,A,1,,,,,,,,,,,,,99.99,99.99,99.99") + sentence("GNRMC,,V,,,,,,,,,,N"));
  EXPECT_EQ(received.reports.size(), 2U) << "the same sentence again is the next epoch";
  for (const Report& r : received.reports) {
    EXPECT_EQ(r.fix, GnssFix::kNone);
    EXPECT_FALSE(r.has_position);
    EXPECT_FALSE(r.utc.time_valid);
    EXPECT_TRUE(std::isnan(r.speed_mps));
  }
  EXPECT_EQ(received.health.of(Reason::kNmeaField), 0U);
  const Report part = only(sentence("GPGGA,235959.20,,,,,1,08,,,M,,M,,"));
  EXPECT_FALSE(part.usable());
}

TEST(Nmea, OneWrongFieldRefusesTheSentence) {
  for (const char* bad : {"GPGGA,236000.00,4404.1,N,12118.8,W,1,12,0.9,1.0,M,1.0,M,,",
                          "GPGGA,235959.00,4460.1,N,12118.8,W,1,12,0.9,1.0,M,1.0,M,,",
                          "GPGGA,235959.00,9000.1,N,12118.8,W,1,12,0.9,1.0,M,1.0,M,,",
                          "GPGGA,235959.00,4404.1,N,18000.1,W,1,12,0.9,1.0,M,1.0,M,,",
                          "GPGGA,235959.00,4404.1,E,12118.8,W,1,12,0.9,1.0,M,1.0,M,,",
                          "GPGGA,235959.00,4404.1,,12118.8,W,1,12,0.9,1.0,M,1.0,M,,",
                          "GPGGA,235959.00,-404.1,N,12118.8,W,1,12,0.9,1.0,M,1.0,M,,",
                          "GPGGA,235959.00,4404.1,N,12118.8,W,A,12,0.9,1.0,M,1.0,M,,",
                          "GPGGA,235959.00,4404.1,N,12118.8,W,1,999,0.9,1.0,M,1.0,M,,",
                          "GPGGA,235959.00,4404.1,N,12118.8,W,1,12,0.9,1..0,M,1.0,M,,",
                          "GPGGA,2359,4404.1,N,12118.8,W,1,12,0.9,1.0,M,1.0,M,,",
                          "GPGGA,235961.00,4404.1,N,12118.8,W,1,12,0.9,1.0,M,1.0,M,,",
                          "GPRMC,235959.00,A,4404.1,N,12118.8,W,1.5,90.0,300224,,,A",
                          "GPRMC,235959.00,A,4404.1,N,12118.8,W,x,90.0,280224,,,A"}) {
    const Received received = receive(sentence(bad));
    EXPECT_TRUE(received.reports.empty()) << bad;
    EXPECT_EQ(received.health.of(Reason::kNmeaField), 1U) << bad;
  }
}

TEST(Nmea, TheDateGoesOnOverMidnightALeapDayAndALeapSecond) {
  const auto gga = [](const std::string& time) { return sentence("GPGGA," + time + kGga.substr(kGga.find(",4404"))); };
  const Received received =
      receive(sentence(kRmc) + gga("235959.20") + gga("235960.00") + gga("000000.00") + gga("000001.00"));
  ASSERT_EQ(received.reports.size(), 4U);
  EXPECT_EQ(received.reports[1].utc.second, 60);
  EXPECT_EQ(received.reports[1].utc.day, 28);
  EXPECT_EQ(received.reports[2].utc.day, 29) << "2024 has one";
  EXPECT_EQ(received.reports[3].utc.day, 29);
  EXPECT_EQ(received.reports[3].utc.month, 2);
}

TEST(Nmea, SentencesBeforeTheFirstEpochAreCounted) {
  EXPECT_EQ(receive(sentence("GPVTG,1.0,T,,M,1.0,N,1.0,K,A")).health.of(Reason::kNoEpoch), 1U);
}

TEST(Nmea, BesideUbxItIsHeldBackAndComesBackWhenUbxStops) {
  const auto gga = [](int second) {
    char time[16];
    std::snprintf(time, sizeof time, "2359%02d.00", second);
    return sentence("GPGGA," + std::string(time) + kGga.substr(kGga.find(",4404")));
  };
  Bytes stream;
  for (int i = 0; i < 5; ++i)
    stream = stream + ubx_frame(0x01, 0x07, pvt(static_cast<std::uint32_t>(i) * 1000)) + gga(i);
  for (int i = 5; i < 15; ++i) stream = stream + gga(i);
  const Received received = receive(stream);
  int nmea = 0;
  for (const Report& r : received.reports) nmea += r.protocol == Protocol::kNmea ? 1 : 0;
  EXPECT_EQ(received.reports.size() - static_cast<std::size_t>(nmea), 5U);
  EXPECT_GE(nmea, 6);
  EXPECT_LE(nmea, 8);
  EXPECT_EQ(received.reports.back().protocol, Protocol::kNmea);
  EXPECT_EQ(received.health.of(Reason::kSecondProtocol), static_cast<unsigned>(15 - nmea));
}

TEST(GnssHealth, EveryReasonHasAName) {
  for (std::size_t i = 0; i < kReasonNames.size(); ++i) EXPECT_GT(name(static_cast<Reason>(i)).size(), 3U);
  Health h;
  h.add(Reason::kNoise, 0xFFFF'FFF0U);
  h.add(Reason::kNoise, 100);
  EXPECT_EQ(h.of(Reason::kNoise), 0xFFFF'FFFFU);
}

}  // namespace
}  // namespace tetap::drivers::gnss
