// SPDX-License-Identifier: Apache-2.0
// The fix of an NMEA epoch, where its sentences differ. One GSA for each constellation, every figure of GGA's quality,
// GNS in place of GGA, times without a fraction. Sentences follow NMEA 0183 v4.1, sec. 6.3, and the manuals of
// docs/reference/receivers.md.
#include "drivers/gnss/gnss_bench.hpp"
#include "drivers/gnss/gnss_bytes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace tetap::drivers::gnss {
namespace {

using sensor::GnssFix;

std::string gga(const std::string& time, const std::string& quality = "1",
                const std::string& longitude = "01131.00000") {
  return "GNGGA," + time + ",4807.03800,N," + longitude + ",E," + quality + ",09,1.1,545.4,M,46.9,M,,";
}
std::string rmc(const std::string& time, const std::string& mode = "A", const std::string& longitude = "01131.00000") {
  return "GNRMC," + time + ",A,4807.03800,N," + longitude + ",E,1.200,84.4,101022,,," + mode;
}
std::string gsa(int mode, const std::string& dop = "7.5,5.5,5.1") {
  return "GNGSA,A," + std::to_string(mode) + ",06,11,,,,,,,,,,," + dop;
}

// ---- GSA

TEST(NmeaGsa, TheBestModeOfAnEpochIsItsFixInEveryOrderAndTheOthersAreCounted) {
  std::vector<int> modes{1, 1, 2, 3};
  do {
    Bytes stream;
    for (const char* time : {"101010.00", "101011.00", "101012.00"}) {
      stream = stream + sentence(rmc(time)) + sentence(gga(time));
      for (const int mode : modes) stream = stream + sentence(gsa(mode, mode == 3 ? "1.5,1.1,1.0" : "99.9,99.9,99.9"));
    }
    const Received received = receive(stream);
    ASSERT_EQ(received.reports.size(), 3U);
    for (const Report& r : received.reports) {
      EXPECT_EQ(r.fix, GnssFix::k3d);
      EXPECT_FLOAT_EQ(r.pdop, 1.5F) << "of the constellation that is used";
      EXPECT_FLOAT_EQ(r.vdop, 1.0F);
    }
    EXPECT_EQ(received.health.of(Reason::kGsaMode), 9U) << "three of each epoch";
  } while (std::next_permutation(modes.begin(), modes.end()));
}

TEST(NmeaGsa, ModeTwoAtBestIsATwoDimensionalFixAndModeOneThroughoutNone) {
  EXPECT_EQ(only(sentence(gga("101010.00")) + sentence(gsa(1)) + sentence(gsa(2)) + sentence(gsa(1))).fix,
            GnssFix::k2d);
  const Received none = receive(sentence(gga("101010.00")) + sentence(gsa(1)) + sentence(gsa(1)));
  ASSERT_EQ(none.reports.size(), 1U);
  EXPECT_EQ(none.reports[0].fix, GnssFix::kNone);
  EXPECT_EQ(none.health.of(Reason::kNoFix), 1U) << "a place that is no fix is counted";
  EXPECT_EQ(none.health.of(Reason::kGsaMode), 0U);
}

TEST(NmeaGsa, AConstellationMoreThanInTheEpochBeforeIsWaitedForWhileTheOthersDenyTheFix) {
  Bytes stream;
  for (const char* time : {"101010.00", "101011.00"}) stream = stream + sentence(gga(time)) + sentence(gsa(3));
  for (const char* time : {"101012.00", "101013.00"})
    stream = stream + sentence(gga(time)) + sentence(gsa(1)) + sentence(gsa(3));
  const Received received = receive(stream);
  ASSERT_EQ(received.reports.size(), 4U);
  for (const Report& r : received.reports) EXPECT_EQ(r.fix, GnssFix::k3d);
}

TEST(NmeaGsa, AModeThatDoesNotExistRefusesTheSentence) {
  for (const char* mode : {"0", "4", "-1", "x"}) {
    const Received received =
        receive(sentence(gga("101010.00")) + sentence("GNGSA,A," + std::string(mode) + ",,,,,,,,,,,,,1,1,1"));
    EXPECT_EQ(received.health.of(Reason::kNmeaField), 1U) << mode;
    EXPECT_EQ(received.reports.at(0).fix, GnssFix::k3d) << mode;
  }
}

TEST(NmeaGsa, ASentenceAfterItsEpochIsCountedAndMovesTheEndOfTheNext) {
  Bytes stream;
  for (const char* time : {"101010.00", "101011.00"}) stream = stream + sentence(rmc(time)) + sentence(gga(time));
  for (const char* time : {"101012.00", "101013.00"})
    stream = stream + sentence(rmc(time)) + sentence(gga(time)) + sentence(gsa(2));
  const Received received = receive(stream);
  ASSERT_EQ(received.reports.size(), 4U);
  EXPECT_EQ(received.health.of(Reason::kLate), 1U);
  EXPECT_EQ(received.reports[2].fix, GnssFix::k3d);
  EXPECT_EQ(received.reports[3].fix, GnssFix::k2d);
}

// ---- quality

TEST(NmeaQuality, EveryFigureIsDecidedAndWhatIsNoFixIsCounted) {
  const struct {
    const char* quality;
    GnssFix fix;
  } table[] = {{"1", GnssFix::k3d},       {"2", GnssFix::kDifferential}, {"3", GnssFix::k3d},
               {"4", GnssFix::kRtkFixed}, {"5", GnssFix::kRtkFloat},     {"6", GnssFix::kNone},
               {"7", GnssFix::kNone},     {"8", GnssFix::kNone},         {"9", GnssFix::kDifferential}};
  for (const auto& row : table) {
    const Received received = receive(sentence(gga("101010.00", row.quality)));
    ASSERT_EQ(received.reports.size(), 1U) << row.quality;
    EXPECT_EQ(received.reports[0].fix, row.fix) << row.quality;
    EXPECT_EQ(position_of(received.reports[0]).has_value(), row.fix != GnssFix::kNone) << row.quality;
    EXPECT_EQ(received.health.of(Reason::kNoFix), row.fix == GnssFix::kNone ? 1U : 0U) << row.quality;
  }
  const Received without = receive(sentence(gga("101010.00", "0")));
  EXPECT_EQ(without.reports.at(0).fix, GnssFix::kNone);
  EXPECT_EQ(without.health.of(Reason::kNoFix), 0U) << "no place, nothing refused";
  for (const char* unknown : {"10", "-1", "A"}) {
    const Received refused = receive(sentence(gga("101010.00", unknown)));
    EXPECT_TRUE(refused.reports.empty()) << unknown;
    EXPECT_EQ(refused.health.of(Reason::kNmeaField), 1U) << unknown;
  }
}

TEST(NmeaQuality, TheModeOfRmcDeniesTheFixOfGgaButNeverMakesOne) {
  const auto fix = [](const char* quality, const char* mode) {
    return only(sentence(gga("101010.00", quality)) + sentence(rmc("101010.00", mode))).fix;
  };
  for (const char* mode : {"N", "E", "M", "S"}) EXPECT_EQ(fix("4", mode), GnssFix::kNone) << mode;
  for (const char* mode : {"A", "D", "P", "R", "F"}) {
    EXPECT_EQ(fix("9", mode), GnssFix::kDifferential) << mode;
    EXPECT_EQ(fix("6", mode), GnssFix::kNone) << mode;
    EXPECT_EQ(fix("0", mode), GnssFix::kNone) << mode;
  }
}

// ---- GNS

std::string gns(const std::string& time, const std::string& modes) {
  return "GNGNS," + time + ",4332.69262,S,17235.48549,E," + modes + ",13,0.9,25.63,11.24,,";
}

TEST(NmeaGns, StandsInPlaceOfGga) {
  const Report r = only(sentence(gns("014035.00", "RR")));
  EXPECT_EQ(r.fix, GnssFix::kRtkFixed);
  // 43 deg 32.69262 min is 43.544877 deg, 172 deg 35.48549 min is 172.591424833... deg.
  EXPECT_EQ(r.latitude_2ndeg, -21'772'438'500LL);
  EXPECT_EQ(r.longitude_2ndeg, 86'295'712'417LL);
  EXPECT_FLOAT_EQ(r.height_msl_m, 25.63F);
  EXPECT_FLOAT_EQ(r.height_m, 36.87F);
  EXPECT_EQ(r.satellites, 13);
  EXPECT_FLOAT_EQ(r.hdop, 0.9F);
  EXPECT_TRUE(position_of(r).has_value());
}

TEST(NmeaGns, TheBestLetterOfAllConstellationsIsTheFix) {
  const struct {
    const char* modes;
    GnssFix fix;
  } table[] = {
      {"A", GnssFix::k3d},          {"AN", GnssFix::k3d},       {"NA", GnssFix::k3d},  {"DAAA", GnssFix::kDifferential},
      {"NNFN", GnssFix::kRtkFloat}, {"FR", GnssFix::kRtkFixed}, {"P", GnssFix::k3d},   {"NN", GnssFix::kNone},
      {"E", GnssFix::kNone},        {"MN", GnssFix::kNone},     {"S", GnssFix::kNone}, {"EANN", GnssFix::k3d}};
  for (const auto& row : table) EXPECT_EQ(only(sentence(gns("014035.00", row.modes))).fix, row.fix) << row.modes;
  const Received unknown = receive(sentence(gns("014035.00", "AX")));
  EXPECT_TRUE(unknown.reports.empty());
  EXPECT_EQ(unknown.health.of(Reason::kNmeaField), 1U);
}

TEST(NmeaGns, SentencesOfSingleConstellationsWithoutAPlaceChangeNothing) {
  const Report r = only(sentence(gns("014035.00", "RR")) + sentence("GPGNS,014035.00,,,,,,8,,,,1.0,23") +
                        sentence("GLGNS,014035.00,,,,,,5,,,,1.0,23"));
  EXPECT_EQ(r.fix, GnssFix::kRtkFixed);
  EXPECT_EQ(r.satellites, 13);
  EXPECT_EQ(r.latitude_2ndeg, -21'772'438'500LL);
}

TEST(NmeaGns, BesideGgaTheBetterOfBothIsTheFix) {
  const auto both = [](const char* quality, const char* modes) {
    std::string own = gga("014035.00", quality);
    own.replace(own.find(",09,"), 4, quality[0] == '0' ? ",00," : ",09,");
    return only(sentence(own) + sentence(gns("014035.00", modes)));
  };
  EXPECT_EQ(both("0", "NA").fix, GnssFix::k3d) << "GGA is of GPS alone in older receivers";
  EXPECT_EQ(both("0", "NA").satellites, 13);
  EXPECT_EQ(both("1", "RR").fix, GnssFix::kRtkFixed);
  EXPECT_EQ(both("4", "AA").fix, GnssFix::kRtkFixed);
  EXPECT_EQ(both("0", "NN").fix, GnssFix::kNone);
  EXPECT_EQ(both("1", "AA").latitude_2ndeg, only(sentence(gga("014035.00"))).latitude_2ndeg);
}

// ---- times

std::string minute(int ten_thousandths) {
  char text[16];
  std::snprintf(text, sizeof text, "01131.%05d", ten_thousandths);
  return text;
}

/// Five fixes a second whose times have no fraction; the longitude tells the fixes apart.
Bytes whole_seconds(int fixes) {
  Bytes out;
  for (int i = 0; i < fixes; ++i) {
    char time[8];
    std::snprintf(time, sizeof time, "1010%02d", 10 + i / 5);
    out = out + sentence(rmc(time, "A", minute(i))) + sentence(gga(time, "1", minute(i)));
  }
  return out;
}

TEST(NmeaTime, EveryFixOfASecondIsReportedAndItsTimeIsMarkedAsDoubtful) {
  const Received received = receive(whole_seconds(50));
  ASSERT_EQ(received.reports.size(), 50U);
  for (std::size_t i = 0; i < 50; ++i) {
    EXPECT_TRUE(received.reports[i].time_uncertain) << i;
    EXPECT_EQ(received.reports[i].utc.second, 10 + i / 5);
    EXPECT_FALSE(std::isnan(received.reports[i].speed_mps)) << "the speed of its own RMC";
    if (i > 0) {
      EXPECT_GT(received.reports[i].longitude_2ndeg, received.reports[i - 1].longitude_2ndeg);
    }
  }
  EXPECT_EQ(received.health.of(Reason::kUncertainTime), 50U);
}

TEST(NmeaTime, TimesThatGoOnAreTrustedAgain) {
  Bytes stream = whole_seconds(10);
  for (int i = 0; i < 30; ++i) {
    char time[16];
    std::snprintf(time, sizeof time, "1011%02d.00", i);
    stream = stream + sentence(gga(time, "1", minute(100 + i)));
  }
  const Received received = receive(stream);
  ASSERT_EQ(received.reports.size(), 40U);
  EXPECT_TRUE(received.reports[12].time_uncertain);
  EXPECT_FALSE(received.reports[39].time_uncertain);
}

TEST(NmeaTime, TwoTalkersOfOneTimeAreOneFix) {
  Bytes stream;
  for (const char* time : {"101010.00", "101011.00", "101012.00"})
    stream = stream + sentence(gga(time)) + sentence("GP" + gga(time, "1", minute(1)).substr(2)) + sentence(rmc(time));
  const Received received = receive(stream);
  EXPECT_EQ(received.reports.size(), 3U);
  EXPECT_EQ(received.health.of(Reason::kUncertainTime), 0U);
}

TEST(NmeaTime, ASentenceOrAnEpochThatComesTwiceIsOneFixAndCounted) {
  const Bytes a = sentence(rmc("101010.00")) + sentence(gga("101010.00"));
  const Bytes b = sentence(rmc("101011.00")) + sentence(gga("101011.00"));
  const Received epochs = receive(a + a + b + b);
  EXPECT_EQ(epochs.reports.size(), 2U);
  EXPECT_EQ(epochs.health.of(Reason::kRepeated), 2U);
  EXPECT_EQ(epochs.health.of(Reason::kUncertainTime), 0U);
  Bytes sentences;
  for (const char* time : {"101010.00", "101011.00"})
    for (const std::string& text : {rmc(time), gga(time)}) sentences = sentences + sentence(text) + sentence(text);
  const Received doubled = receive(sentences);
  EXPECT_EQ(doubled.reports.size(), 2U);
  EXPECT_EQ(doubled.health.of(Reason::kRepeated), 4U);
  EXPECT_EQ(doubled.reports[0].fix, GnssFix::k3d);
}

TEST(NmeaTime, ADoubtfulTimeIsStampedByItsArrival) {
  Line line;
  for (int i = 0; i < 40; ++i) {
    char time[8];
    std::snprintf(time, sizeof time, "1010%02d", 10 + i / 5);
    line.say(1'060'000 + i * 200'000, sentence("GP" + gga(time, "1", minute(i)).substr(2, 40) + ",,,,,,,"));
  }
  GnssDriver<Line> driver(line, {.configure = false, .latency = base::Micros{60'000}});
  std::vector<base::Micros> stamps;
  for (; line.now_us < 9'500'000; line.now_us += 1'000)
    driver.poll({line.now_us}, [&](const Report& r, base::Micros stamp) {
      EXPECT_TRUE(r.time_uncertain);
      stamps.push_back(stamp);
    });
  ASSERT_GE(stamps.size(), 39U);
  for (std::size_t i = 1; i < stamps.size(); ++i)
    EXPECT_NEAR(static_cast<double>(stamps[i].us), 1'000'000.0 + 200'000.0 * static_cast<double>(i), 2'000.0) << i;
}

}  // namespace
}  // namespace tetap::drivers::gnss
