// SPDX-License-Identifier: Apache-2.0
// The receiver's solution arrives: places in all quadrants, speeds in all directions, every kind of fix, dates and
// times. It comes through UBX of each generation and through NMEA, each field within its protocol's resolution.
#include "drivers/gnss/gnss_bench.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace tetap::drivers::gnss {
namespace {

using fakes::ublox::Fix;
using fakes::ublox::Instant;
using fakes::ublox::Solution;
using sensor::GnssFix;

enum class Protocol { kKeys, kM8, kM6, kNmea };
constexpr Protocol kAll[] = {Protocol::kKeys, Protocol::kM8, Protocol::kM6, Protocol::kNmea};

/// A receiver that runs and a driver that hears it; NMEA is what it says of itself, with nothing configured.
Bench speaking(Protocol how) {
  DriverSettings settings;
  settings.configure = how != Protocol::kNmea;
  const Generation generation = how == Protocol::kM8   ? Generation::kM8
                                : how == Protocol::kM6 ? Generation::kM6
                                                       : Generation::kKeys;
  return Bench(generation, 38'400, settings);
}
/// The report of the solution, once the driver knows which message ends an epoch.
Report received(Protocol how, const Solution& solution, const Instant& instant = {.itow_ms = 100'000'000}) {
  Bench bench = speaking(how);
  bench.receiver.set(key("CFG-MSGOUT-NMEA_ID_GST_UART1"), 1);
  bench.receiver.set_instant(instant);
  bench.receiver.set_solution(solution);
  if (how == Protocol::kNmea) {
    bench.driver.poll(bench.now, [](const Report&, base::Micros) {});
  } else {
    EXPECT_TRUE(bench.until(ConfigState::kRunning, 30));
  }
  bench.run(4);
  EXPECT_FALSE(bench.reports.empty());
  return bench.reports.empty() ? Report{} : bench.reports.back();
}

std::vector<Solution> solutions() {
  std::vector<Solution> all;
  const double places[][2] = {{47.285233, 8.565265},     {-33.9123457, 18.4234567},  {-33.4378231, -70.6504512},
                              {44.0690105, -121.314248}, {0.0000123, -0.0000456},    {-0.5, 0.99999},
                              {-89.9999, 179.9999999},   {89.123456, -179.99999991}, {9.0 + 59.999997 / 60, 100.0}};
  double turn = 0.2;
  for (const auto& place : places) {
    Solution s;
    s.latitude_deg = place[0];
    s.longitude_deg = place[1];
    s.v_mps = {3.0 * std::sin(turn), 3.0 * std::cos(turn), 0.4 - turn / 8};
    turn += 0.7;
    all.push_back(s);
  }
  all.back().height_m = -12.5;
  all.back().msl_m = 31.0;
  return all;
}

void expect_angle(std::int64_t units, double deg, double within_deg) {
  EXPECT_NEAR(static_cast<double>(units) * 2e-9, deg, within_deg);
}

TEST(GnssSolution, PlaceHeightAndVelocityArriveInAllQuadrantsWhateverIsSpoken) {
  for (const Protocol how : kAll) {
    for (const Solution& s : solutions()) {
      SCOPED_TRACE(testing::Message() << static_cast<int>(how) << ": " << s.latitude_deg << ' ' << s.longitude_deg);
      const Report r = received(how, s);
      ASSERT_TRUE(r.usable());
      const bool nmea = how == Protocol::kNmea;
      const double angle = nmea ? 0.6e-5 / 60 : 0.6e-7;
      expect_angle(r.latitude_2ndeg, s.latitude_deg, angle);
      expect_angle(r.longitude_2ndeg, s.longitude_deg, angle);
      EXPECT_NEAR(r.height_m, s.height_m, nmea ? 0.11 : 0.001);
      EXPECT_NEAR(r.height_msl_m, s.msl_m, nmea ? 0.051 : 0.001);
      const double fine = how == Protocol::kKeys || how == Protocol::kM8 ? 0.00051 : 0.0051;
      EXPECT_NEAR(r.v_n_mps[0], s.v_mps[0], fine);
      EXPECT_NEAR(r.v_n_mps[1], s.v_mps[1], fine);
      if (nmea) {
        EXPECT_TRUE(std::isnan(r.v_n_mps[2]));
      } else {
        EXPECT_NEAR(r.v_n_mps[2], s.v_mps[2], fine);
      }
      EXPECT_NEAR(r.speed_mps, s.speed_mps(), fine);
      EXPECT_NEAR(r.course_rad, s.course_deg() * M_PI / 180, nmea ? 1e-4 : 5e-7);
    }
  }
}

TEST(GnssSolution, AccuraciesCovariancesAndDilutionArrive) {
  const Solution s = solutions()[2];
  for (const Protocol how : kAll) {
    SCOPED_TRACE(static_cast<int>(how));
    const Report r = received(how, s);
    EXPECT_NEAR(r.pdop, s.pdop, 0.0051);
    EXPECT_EQ(r.satellites, how == Protocol::kNmea ? 12 : s.satellites) << "GGA counts no further";
    if (how == Protocol::kM6 || how == Protocol::kNmea) {
      EXPECT_NEAR(r.hdop, s.hdop, 0.0051);
      EXPECT_NEAR(r.vdop, s.vdop, 0.0051);
    }
    if (how == Protocol::kNmea) {
      const auto& c = s.position_cov_m2;
      EXPECT_NEAR(r.horizontal_acc_m, std::sqrt((c[0] + c[3]) / 2), 0.051);
      EXPECT_NEAR(r.vertical_acc_m, std::sqrt(c[5]), 0.051);
      continue;
    }
    EXPECT_NEAR(r.horizontal_acc_m, s.horizontal_acc_m, 0.00051);
    EXPECT_NEAR(r.vertical_acc_m, s.vertical_acc_m, 0.00051);
    EXPECT_NEAR(r.speed_acc_mps, s.speed_acc_mps, how == Protocol::kM6 ? 0.0051 : 0.00051);
    EXPECT_NEAR(r.course_acc_rad, s.course_acc_deg * M_PI / 180, 1e-6);
    ASSERT_EQ(r.position_cov_m2.has_value(), how == Protocol::kKeys);
    if (how != Protocol::kKeys) continue;
    for (std::size_t i = 0; i < 6; ++i) {
      EXPECT_FLOAT_EQ((*r.position_cov_m2)[i], static_cast<float>(s.position_cov_m2[i])) << i;
      EXPECT_FLOAT_EQ((*r.velocity_cov_m2ps2)[i], static_cast<float>(s.velocity_cov_m2ps2[i])) << i;
    }
  }
}

TEST(GnssSolution, EveryKindOfFixIsThatKindAndNoFixIsNone) {
  const struct {
    Fix fix;
    GnssFix expected, of_old;  ///< NAV-SOL does not know the carrier's phase
  } kinds[] = {{Fix::kNone, GnssFix::kNone, GnssFix::kNone},
               {Fix::kLimits, GnssFix::kNone, GnssFix::kNone},
               {Fix::k2d, GnssFix::k2d, GnssFix::k2d},
               {Fix::k3d, GnssFix::k3d, GnssFix::k3d},
               {Fix::kDifferential, GnssFix::kDifferential, GnssFix::kDifferential},
               {Fix::kRtkFloat, GnssFix::kRtkFloat, GnssFix::kDifferential},
               {Fix::kRtkFixed, GnssFix::kRtkFixed, GnssFix::kDifferential}};
  for (const Protocol how : kAll) {
    for (const auto& kind : kinds) {
      Solution s = solutions()[1];
      s.fix = kind.fix;
      SCOPED_TRACE(testing::Message() << static_cast<int>(how) << ": " << static_cast<int>(kind.fix));
      const Report r = received(how, s);
      EXPECT_EQ(r.fix, how == Protocol::kM6 ? kind.of_old : kind.expected);
      EXPECT_EQ(position_of(r).has_value(), kind.expected != GnssFix::kNone);
      EXPECT_EQ(velocity_of(r).has_value(), kind.expected != GnssFix::kNone);
    }
  }
}

TEST(GnssSolution, StandstillIsAVelocityOfZero) {
  for (const Protocol how : kAll) {
    const auto v = velocity_of(received(how, Solution{}));
    ASSERT_TRUE(v.has_value()) << static_cast<int>(how);
    EXPECT_EQ(v->v_n_mps[0], 0.0F);
    EXPECT_EQ(v->v_n_mps[1], 0.0F);
  }
}

// The epochs lie a few nanoseconds to milliseconds beside whole ones. The date passes midnight, the end of a year, of a
// week, of a leap February.
TEST(GnssSolution, DateAndTimeAreThoseOfTheEpoch) {
  constexpr std::uint32_t kWeek_ms = 604'800'000;
  for (const Protocol how : kAll) {
    for (const std::int32_t beside_ns : {0, 123'456, -123'456, -3'900'000}) {
      for (const Instant& start :
           {Instant{.week = 2306, .itow_ms = 1'000}, Instant{.week = 2306, .itow_ms = kWeek_ms - 2'000},
            Instant{.week = 2347, .itow_ms = 259'214'000}, Instant{.week = 2303, .itow_ms = 432'015'000}}) {
        Instant instant = start;
        instant.beside_ns = beside_ns;
        SCOPED_TRACE(testing::Message() << static_cast<int>(how) << ": week " << start.week << ' ' << start.itow_ms
                                        << " ms " << beside_ns << " ns");
        Bench bench = speaking(how);
        bench.receiver.set_instant(instant);
        bench.run(9);
        ASSERT_GT(bench.reports.size(), 3U);
        for (std::size_t back = 1; back <= 3; ++back) {
          const Report& r = bench.reports[bench.reports.size() - back];
          const auto& epochs = bench.receiver.epochs();
          const Instant& truth = epochs[epochs.size() - back].instant;
          auto utc = truth.utc();
          if (how != Protocol::kNmea) {
            ASSERT_EQ(r.itow_ms, truth.itow_ms);
          }
          if (how == Protocol::kNmea) {
            EXPECT_TRUE(r.utc.date_valid && r.utc.time_valid);
            EXPECT_EQ(r.utc.nano % 10'000'000, 0);
            utc.nano = (utc.nano + 5'000'000) / 10'000'000 * 10'000'000;
          }
          EXPECT_EQ(r.utc, (Utc{static_cast<std::uint16_t>(utc.year), static_cast<std::uint8_t>(utc.month),
                                static_cast<std::uint8_t>(utc.day), static_cast<std::uint8_t>(utc.hour),
                                static_cast<std::uint8_t>(utc.minute), static_cast<std::uint8_t>(utc.second),
                                static_cast<std::int32_t>(utc.nano), true, true}));
        }
      }
    }
  }
}

TEST(GnssSolution, TheStampIsWhenItWasMeasuredHoweverLateItIsSaid) {
  for (const Protocol how : kAll) {
    Bench bench = speaking(how);
    bench.receiver.injected.compute = base::Micros{60'000};  // the driver's setting
    bench.receiver.injected.jitter = base::Micros{40'000};
    bench.run(60);
    ASSERT_GT(bench.stamps.size(), 40U);
    const auto& epochs = bench.receiver.epochs();
    for (std::size_t i = bench.stamps.size() - 20; i < bench.stamps.size(); ++i) {
      double nearest = 1e9;
      for (const auto& epoch : epochs)
        nearest = std::min(nearest, std::abs(static_cast<double>((bench.stamps[i] - epoch.at).us)));
      EXPECT_LT(nearest, 4'500) << static_cast<int>(how);
      const double apart_us = static_cast<double>((bench.stamps[i] - bench.stamps[i - 1]).us);
      EXPECT_NEAR(apart_us, how == Protocol::kNmea ? 1'000'000 : 200'000, 2'500);
    }
  }
}

}  // namespace
}  // namespace tetap::drivers::gnss
