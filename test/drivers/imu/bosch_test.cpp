// SPDX-License-Identifier: Apache-2.0
// BMI088 and BMI270 through their drivers, against fakes from the data sheets: the start, units, times, saturation, and
// what a wrong chip, a stuck line, a lost supply and a wrong configuration file come to.
#include "bosch_fakes.hpp"
#include "drivers/imu/bmi088/chip.hpp"
#include "drivers/imu/bmi270/chip.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

namespace tetap::drivers::bosch {
namespace {

using fakes::bosch::Line;
using fakes::bosch::Motion;

constexpr double kG = 9.80665, kDeg = std::numbers::pi / 180;

Motion living(double t) {
  Motion m;
  for (std::size_t i = 0; i < 3; ++i) {
    const double phase = static_cast<double>(i);
    m.rate_dps[i] = 40 * std::sin(23 * t + phase) + 20 * std::sin(37 * t - phase);
    m.force_g[i] = (i == 2 ? 1 : 0) + 0.1 * std::sin(31 * t + phase) + 0.03 * std::sin(47 * t);
  }
  m.temperature_degC = 31.5;
  return m;
}

struct Case {
  bool is_270;
  int rate_hz;
  int delay_us;
};

/// Either chip with its driver, and a clock that the test moves.
struct Rig {
  explicit Rig(const Case& which, const Mounting& mounting = {}) : c(which), file(file_of(8'192)) {
    single.wanted_file = file;
    const auto code = [&](auto first) {
      int step = 0;
      while (100 << step < c.rate_hz) ++step;
      return static_cast<decltype(first)>(static_cast<int>(first) + step);
    };
    if (c.is_270) {
      small.emplace(bmi270::Chip<fakes::bosch::Bmi270>(
          single, file, {.rate = code(bmi270::Rate::k100Hz), .delay_us = c.delay_us, .mounting = mounting}));
    } else {
      big.emplace(bmi088::Chip<fakes::bosch::Bmi088Accel, fakes::bosch::Bmi088Gyro>(
          accel, gyro, {.rate = code(bmi088::Rate::k100Hz), .delay_us = c.delay_us, .mounting = mounting}));
    }
    each([](auto& device) { device.motion = living; });
  }

  static std::vector<std::uint8_t> file_of(std::size_t size) {
    std::vector<std::uint8_t> bytes(size);
    std::mt19937 random(270);
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random());
    return bytes;
  }
  template <class Do>
  void each(Do&& what) {
    what(static_cast<fakes::bosch::Device&>(accel));
    what(static_cast<fakes::bosch::Device&>(gyro));
    what(static_cast<fakes::bosch::Device&>(single));
  }
  void run(double seconds, double every_us) {
    for (const double end = now_us + seconds * 1e6; now_us < end;) {
      now_us += every_us;
      each([this](auto& device) { device.now_us = now_us; });
      const base::Micros now{static_cast<std::int64_t>(now_us)};
      const auto keep = [this](const ImuReading& reading) { readings.push_back(reading); };
      small ? small->poll(now, keep) : big->poll(now, keep);
    }
  }
  bool start() {
    run(1, 200);
    readings.clear();
    return health().state == State::kRunning;
  }
  [[nodiscard]] const Health& health() const { return small ? small->health() : big->health(); }
  [[nodiscard]] int troubles() const {
    int sum = 0;
    for (const int count : health().counts) sum += count;
    return sum;
  }

  Case c;
  std::vector<std::uint8_t> file;
  fakes::bosch::Bmi088Accel accel;
  fakes::bosch::Bmi088Gyro gyro;
  fakes::bosch::Bmi270 single;
  std::optional<bmi088::Driver<fakes::bosch::Bmi088Accel, fakes::bosch::Bmi088Gyro>> big;
  std::optional<bmi270::Driver<fakes::bosch::Bmi270>> small;
  std::vector<ImuReading> readings;
  double now_us = 0;
};

class BoschImu : public testing::TestWithParam<Case> {};

TEST_P(BoschImu, SamplesAreTheMotionAtTheirStamps) {
  for (const double error : {-0.01, 0.0, 0.01}) {
    Rig rig(GetParam(), Mounting::of(Axis::kPlusY, Axis::kMinusX, Axis::kPlusZ));
    rig.each([error](auto& device) { device.clock_error = error, device.reading_us = 30; });
    ASSERT_TRUE(rig.start());
    rig.run(20, 137);
    rig.readings.clear();
    rig.run(5, 137);
    EXPECT_EQ(rig.troubles(), 0);
    EXPECT_NEAR(static_cast<double>(rig.readings.size()), 5 * GetParam().rate_hz * (1 + error), 2);
    double worst_dps = 0, worst_g = 0;
    base::Micros last{};
    for (const ImuReading& r : rig.readings) {
      EXPECT_FALSE(r.after_gap || r.clipped_accel || r.clipped_gyro);
      EXPECT_TRUE(last.us == 0 || r.stamp - r.interval == last);
      last = r.stamp;
      const Motion truth = living((static_cast<double>(r.stamp.us) + GetParam().delay_us) * 1e-6);
      const std::array<double, 3> axes{truth.rate_dps[1], -truth.rate_dps[0], truth.rate_dps[2]};
      const std::array<double, 3> forces{truth.force_g[1], -truth.force_g[0], truth.force_g[2]};
      for (std::size_t i = 0; i < 3; ++i) {
        worst_dps = std::max(worst_dps, std::abs(static_cast<double>(r.rate_b_radps[i]) / kDeg - axes[i]));
        worst_g = std::max(worst_g, std::abs(static_cast<double>(r.force_b_mps2[i]) / kG - forces[i]));
      }
      EXPECT_NEAR(static_cast<double>(r.temperature_degC), 31.5, 0.13);
    }
    // A poll of 137 us and half a bit; the BMI088's gyroscope is up to 0.5 ms older: 1 660 dps/s, 4.6 g/s.
    EXPECT_LT(worst_dps, (GetParam().is_270 ? 0.15e-3 : 0.7e-3) * 1'660 + 0.04);
    EXPECT_LT(worst_g, 0.2e-3 * 4.6 + 0.001);
    EXPECT_GT(worst_dps, 0.01) << "a reading that equals the truth to the last bit is not of a chip";
  }
}

TEST_P(BoschImu, TheEndOfTheRangeIsMarked) {
  Rig rig(GetParam());
  ASSERT_TRUE(rig.start());
  rig.each([](auto& device) {
    device.motion = [](double t) {
      Motion m = living(t);
      m.rate_dps[1] = 2'500, m.force_g[0] = -30;
      return m;
    };
  });
  rig.run(1, 200);
  EXPECT_NEAR(static_cast<double>(rig.readings.size()), GetParam().rate_hz, 2) << "a clipped axis is not stuck";
  EXPECT_EQ(rig.health().of(Reason::kStuckAccel) + rig.health().of(Reason::kStuckGyro), 0);
  const ImuReading& r = rig.readings.back();
  EXPECT_TRUE(r.clipped_gyro && r.clipped_accel);
  EXPECT_NEAR(static_cast<double>(r.rate_b_radps[1]), 2'000 * kDeg, 0.01);
  EXPECT_NEAR(static_cast<double>(r.force_b_mps2[0]), (GetParam().is_270 ? -16 : -24) * kG, 0.02);
  EXPECT_GT(rig.health().of(Reason::kClippedAccel), 0);
  EXPECT_GT(rig.health().of(Reason::kClippedGyro), 0);
}

TEST_P(BoschImu, AnotherChipIsRefusedForEver) {
  Rig rig(GetParam());
  rig.accel.identity = rig.single.identity = 0x1F;
  rig.run(2, 200);
  EXPECT_TRUE(rig.readings.empty());
  EXPECT_NE(rig.health().state, State::kRunning);
  EXPECT_GE(rig.health().of(Reason::kWrongIdentity), 10);
  EXPECT_LE(rig.health().of(Reason::kWrongIdentity), 20) << "a try each 100 ms";
  Rig other({false, 800, 0});
  other.gyro.identity = 0x24;
  other.run(1, 200);
  EXPECT_TRUE(other.readings.empty());
  EXPECT_GT(other.health().of(Reason::kWrongIdentity), 0);
}

TEST_P(BoschImu, AStuckOrFailingLineGivesNothingAndHeals) {
  for (const Line line : {Line::kStuckLow, Line::kStuckHigh, Line::kFails}) {
    Rig rig(GetParam());
    ASSERT_TRUE(rig.start());
    rig.each([line](auto& device) { device.line = line; });
    rig.run(1, 200);
    const std::size_t kept = rig.readings.size();
    EXPECT_EQ(kept, 0U);
    EXPECT_NE(rig.health().state, State::kRunning);
    EXPECT_GT(rig.troubles(), 0);
    rig.each([](auto& device) { device.line = Line::kWorks; });
    rig.run(1, 200);
    EXPECT_EQ(rig.health().state, State::kRunning);
    ASSERT_GT(rig.readings.size(), kept + 50U);
    EXPECT_TRUE(rig.readings[kept].after_gap);
    for (std::size_t i = 1; i < rig.readings.size(); ++i) EXPECT_LT(rig.readings[i - 1].stamp, rig.readings[i].stamp);
  }
}

TEST_P(BoschImu, ALostSupplyIsNoticedAndBegunAgain) {
  Rig rig(GetParam());
  ASSERT_TRUE(rig.start());
  rig.run(0.3, 200);
  rig.each([](auto& device) { device.brown_out(); });
  rig.run(1.2, 200);
  EXPECT_EQ(rig.health().state, State::kRunning);
  EXPECT_GT(rig.health().restarts, 0U);
  ASSERT_GT(rig.readings.size(), 100U);
  const ImuReading& r = rig.readings.back();
  const Motion truth = living((static_cast<double>(r.stamp.us) + GetParam().delay_us) * 1e-6);
  EXPECT_NEAR(static_cast<double>(r.force_b_mps2[2]) / kG, truth.force_g[2], 0.02);
  EXPECT_EQ(rig.accel.early + rig.gyro.early + rig.single.early, 0) << "the waits after resets are kept";
}

TEST_P(BoschImu, AChangedRegisterIsNoticedWhileSamplesCome) {
  Rig rig(GetParam());
  ASSERT_TRUE(rig.start());
  rig.each([](auto& device) { device.registers[0x41] = 0; });  // the accelerometer's smallest range
  rig.run(0.12, 200);
  EXPECT_EQ(rig.health().of(Reason::kConfigChanged), 1);
  rig.run(1, 200);
  EXPECT_EQ(rig.health().state, State::kRunning);
  EXPECT_EQ(rig.health().restarts, 1U);
}

TEST_P(BoschImu, LatePollsLoseSamplesAndSaySo) {
  Rig rig(GetParam());
  ASSERT_TRUE(rig.start());
  const double period_us = 1e6 / GetParam().rate_hz;
  rig.run(3, 200);
  rig.readings.clear();
  rig.run(1, 2.5 * period_us);
  const auto kept = static_cast<double>(rig.readings.size());
  EXPECT_NEAR(kept, GetParam().rate_hz / 2.5, 3);
  EXPECT_NEAR(rig.health().of(Reason::kLostSamples), GetParam().rate_hz - kept, 4);
  EXPECT_TRUE(rig.readings.back().after_gap);
}

TEST_P(BoschImu, AnAxisThatStandsIsWithheld) {
  Rig rig(GetParam());
  ASSERT_TRUE(rig.start());
  rig.each([](auto& device) {
    device.motion = [](double t) {
      Motion m = living(t);
      m.rate_dps[2] = 1;
      return m;
    };
  });
  rig.run(2, 200);
  EXPECT_GT(rig.health().of(Reason::kStuckGyro), GetParam().rate_hz);
  EXPECT_EQ(rig.health().of(Reason::kStuckAccel), 0);
  EXPECT_NEAR(static_cast<double>(rig.readings.size()), 200, 5);
}

INSTANTIATE_TEST_SUITE_P(Chips, BoschImu,
                         testing::Values(Case{false, 800, 980}, Case{false, 1600, 0}, Case{false, 400, 0},
                                         Case{true, 800, 800}, Case{true, 1600, 0}, Case{true, 400, 0}),
                         [](const auto& chosen) {
                           return (chosen.param.is_270 ? "Bmi270at" : "Bmi088at") +
                                  std::to_string(chosen.param.rate_hz);
                         });

TEST(Bmi088, TemperaturesAreTheSheetsTable) {
  const struct {
    std::uint8_t high, low;
    double degC;
  } rows[] = {{0x3E, 0x00, 85}, {0x00, 0x60, 23.375}, {0x00, 0x20, 23.125}, {0x00, 0x00, 23}, {0xC1, 0x00, -40}};
  for (const auto& row : rows) EXPECT_EQ(static_cast<double>(bmi088::temperature_degC(row.high, row.low)), row.degC);
  EXPECT_TRUE(base::is_nan(bmi088::temperature_degC(0x80, 0x00)));
  EXPECT_EQ(static_cast<double>(bmi270::temperature_degC(0x00, 0x02)), 24);
  EXPECT_EQ(static_cast<double>(bmi270::temperature_degC(0x00, 0xFE)), 22);
  EXPECT_TRUE(base::is_nan(bmi270::temperature_degC(0x00, 0x80)));
}

TEST(Bmi270, OnlyTheWholeFileStartsIt) {
  Rig damaged({true, 800, 0});
  damaged.single.wanted_file[5'000] ^= 1;
  damaged.run(3, 200);
  EXPECT_TRUE(damaged.readings.empty());
  EXPECT_GE(damaged.health().of(Reason::kFileRefused), 2);
  EXPECT_NE(damaged.health().state, State::kRunning);
  for (const std::size_t size : {0U, 3U, 8'194U}) {
    fakes::bosch::Bmi270 chip;
    const auto file = Rig::file_of(size);
    bmi270::Driver<fakes::bosch::Bmi270> driver(bmi270::Chip<fakes::bosch::Bmi270>(chip, file, {}));
    for (int i = 0; i < 1'000; ++i) driver.poll({i * 200}, [](const ImuReading&) {});
    EXPECT_EQ(driver.health().state, State::kMisconfigured) << size;
    EXPECT_EQ(chip.transfers, 0) << size;
  }
  // Bosch's short file for the FIFO alone, whose last part is no whole one.
  Rig brief({true, 800, 0});
  brief.file = Rig::file_of(328);
  brief.single.wanted_file = brief.file;
  brief.small.emplace(bmi270::Chip<fakes::bosch::Bmi270>(brief.single, brief.file, {}));
  EXPECT_TRUE(brief.start());
}

TEST(Bmi270, TheShareOfZIsTakenFromX) {
  for (const int cross : {-64, -3, 0, 63}) {
    Rig rig({true, 800, 0});
    rig.single.cross = cross;
    rig.single.motion = [](double t) {
      Motion m = living(t);
      m.rate_dps[2] += 500;
      return m;
    };
    ASSERT_TRUE(rig.start());
    rig.run(2, 137);
    const ImuReading& r = rig.readings.back();
    const Motion truth = living(static_cast<double>(r.stamp.us) * 1e-6);
    EXPECT_NEAR(static_cast<double>(r.rate_b_radps[0]) / kDeg, truth.rate_dps[0], 0.5) << cross;
  }
}

TEST(BoschDriver, ReadingsAtRandomCrashNothingAndKeepTimeGoingOn) {
  struct Noise {
    std::mt19937 random{56};
    bool transfer(std::span<const std::uint8_t>, std::span<std::uint8_t> in) {
      for (auto& byte : in) byte = static_cast<std::uint8_t>(random());
      return random() % 50 != 0;
    }
  } noise;
  // The start would end at the identity; the stream is driven by itself.
  Stream stream(bmi088::Chip<Noise, Noise>(noise, noise, {}).stream());
  bmi088::Chip<Noise, Noise> chip(noise, noise, {});
  Health health;
  base::Micros last{-1'000'000};
  for (std::int64_t i = 0; i < 200'000; ++i) {
    Raw raw{};
    if (!chip.sample(raw)) continue;
    stream.take(raw, {i * 200}, health, [&](const ImuReading& r) {
      EXPECT_GT(r.stamp, last);
      last = r.stamp;
      for (const float x : r.rate_b_radps) EXPECT_LT(std::abs(x), 35.0F);
    });
  }
  EXPECT_GT(health.of(Reason::kBadStamp), 0);
  const auto file = Rig::file_of(8'192);
  bmi270::Driver<Noise> driver(bmi270::Chip<Noise>(noise, file, {}));
  for (std::int64_t i = 0; i < 200'000; ++i) driver.poll({i * 200}, [](const ImuReading&) { FAIL(); });
  EXPECT_GT(driver.health().of(Reason::kWrongIdentity), 0);
}

}  // namespace
}  // namespace tetap::drivers::bosch
