// SPDX-License-Identifier: Apache-2.0
// Values that repeat: by the chip's own change of range, by little noise behind narrow filters, by a dead axis.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "drivers/imu/icm42688_bench.hpp"

namespace tetap::drivers::icm42688 {
namespace {

using fakes::Fault;

/// Passes 100 deg/s on every axis, some 8 times a second.
fakes::icm42688::Motion fast_turns(double t) {
  fakes::icm42688::Motion m = Bench::living()(t);
  for (std::size_t i = 0; i < 3; ++i) m.rate_radps[i] = 8.0 * std::sin(25.0 * t + static_cast<double>(i));
  return m;
}

TEST(Icm42688Repeats, TheGyroscopeRepeatsNothingAt100DegreesPerSecondAndIfItDoesItIsCounted) {
  for (const Rate rate : {Rate::k1kHz, Rate::k8kHz}) {
    const bool fast = rate == Rate::k8kHz;
    Bench bench{{.rate = rate, .watermark_packets = fast ? std::uint8_t{8} : std::uint8_t{1}}};
    bench.chip.set_filters(false);
    bench.chip.set_motion(fast_turns);
    ASSERT_TRUE(bench.start());
    EXPECT_EQ(bench.chip.peek(0, 0x4D), 0x51) << "01 in bits 7 and 6, the rest as after a reset";
    bench.run(1'000'000);
    EXPECT_EQ(bench.of(Reason::kRepeatedGyro), 0);
    int repeated = 0;
    for (std::size_t i = 1; i < bench.readings.size(); ++i)
      repeated += bench.readings[i].rate_b_radps == bench.readings[i - 1].rate_b_radps ? 1 : 0;
    EXPECT_EQ(repeated, 0);
    // The bits fall back; the driver reads them back and sets them again.
    bench.readings.clear();
    bench.chip.inject(Fault::kRegisterChanges, {.address = 0x4D, .value = 0x91});
    bench.run(fast ? 600'000 : 400'000);
    for (std::size_t i = 1; i < bench.readings.size(); ++i)
      repeated += bench.readings[i].rate_b_radps == bench.readings[i - 1].rate_b_radps ? 1 : 0;
    EXPECT_GT(repeated, 0) << "some, until then";
    EXPECT_NEAR(bench.of(Reason::kRepeatedGyro), repeated, 1 + repeated / 4);
    EXPECT_EQ(bench.of(Reason::kConfigChanged), 1);
    EXPECT_EQ(bench.chip.peek(0, 0x4D), 0x51);
  }
}

/// White noise of the sheet's densities (tables 1 and 2) behind a second order of this bandwidth, at rest and in the
/// middle of a count. The filter is discretised by the bilinear transform (Oppenheim and Schafer, sec. 7.1).
class Rest {
 public:
  Rest(double bandwidth_Hz, double rate_Hz, double quieter, unsigned seed) : random_(seed) {
    const double k = std::tan(M_PI * bandwidth_Hz / rate_Hz), d = 1 + std::sqrt(2.0) * k + k * k;
    b0_ = k * k / d, a1_ = 2 * (k * k - 1) / d, a2_ = (1 - std::sqrt(2.0) * k + k * k) / d;
    accel_ = quieter * 70e-6 * 9.80665 * std::sqrt(rate_Hz / 2);
    gyro_ = quieter * 0.0028 * M_PI / 180 * std::sqrt(rate_Hz / 2);
  }
  fakes::icm42688::Motion at(double t) {
    if (t > last_) step();
    last_ = t;
    fakes::icm42688::Motion m{.specific_force_mps2 = {}};
    for (std::size_t i = 0; i < 3; ++i) {
      m.specific_force_mps2[i] = (i == 2 ? 9.80665 : 0) + axes_[i].y1;
      m.rate_radps[i] = axes_[i + 3].y1;
    }
    m.temperature_degC = 30;
    return m;
  }

 private:
  struct Axis {
    double x1 = 0, x2 = 0, y1 = 0, y2 = 0;
  };
  void step() {
    for (std::size_t i = 0; i < 6; ++i) {
      Axis& f = axes_[i];
      const double x = (i < 3 ? accel_ : gyro_) * normal_(random_);
      const double y = b0_ * (x + 2 * f.x1 + f.x2) - a1_ * f.y1 - a2_ * f.y2;
      f = {x, f.x1, y, f.y1};
    }
  }
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  std::array<Axis, 6> axes_{};
  double b0_ = 0, a1_ = 0, a2_ = 0, accel_ = 0, gyro_ = 0, last_ = -1;
};

TEST(Icm42688Repeats, AHealthySensorAtRestIsNeverCalledStuckBehindAnyFilterAndADeadAxisIsFound) {
  const struct {
    Rate rate;
    Bandwidth bandwidth;
    AntiAlias anti_alias;
    double bandwidth_Hz, rate_Hz;
    double found_s;  ///< time to find a dead gyroscope axis; 0: longer than this test
  } cases[] = {{Rate::k8kHz, Bandwidth::kBy4, kAntiAlias42Hz, 42, 8000, 8},
               {Rate::k4kHz, Bandwidth::kBy4, kAntiAlias84Hz, 84, 4000, 2},
               {Rate::k2kHz, Bandwidth::kBy4, kAntiAlias42Hz, 42, 2000, 8},
               {Rate::k1kHz, Bandwidth::kBy4, kAntiAlias258Hz, 250, 1000, 2.1},
               {Rate::k1kHz, Bandwidth::kBy20, kAntiAlias258Hz, 50, 1000, 6},
               {Rate::k1kHz, Bandwidth::kBy40, kAntiAlias258Hz, 25, 1000, 0},
               {Rate::k200Hz, Bandwidth::kBy40, kAntiAlias42Hz, 10, 200, 0}};
  for (const auto& c : cases) {
    for (const double quieter : {1.0, 0.85}) {
      const auto packets = static_cast<std::uint8_t>(c.rate_Hz > 1000 ? c.rate_Hz / 500 : 1);
      Bench bench{{.rate = c.rate, .bandwidth = c.bandwidth, .anti_alias = c.anti_alias, .watermark_packets = packets}};
      bench.chip.set_filters(false);
      Rest rest(c.bandwidth_Hz, c.rate_Hz, quieter, 7);
      bench.chip.set_motion([&rest](double t) { return rest.at(t); });
      ASSERT_TRUE(bench.start());
      bench.run(12'000'000, c.rate_Hz >= 1000 ? 2'000 : 5'000);
      SCOPED_TRACE(testing::Message() << c.rate_Hz << " Hz, filter " << c.bandwidth_Hz << " Hz, noise x " << quieter);
      EXPECT_EQ(bench.of(Reason::kStuckAccel), 0);
      EXPECT_EQ(bench.of(Reason::kStuckGyro), 0);
      EXPECT_EQ(bench.of(Reason::kRepeatedGyro), 0);
      EXPECT_NEAR(static_cast<double>(bench.readings.size()), 12.0 * c.rate_Hz, 0.01 * c.rate_Hz);
      if (!(c.found_s > 0) || quieter < 1) continue;
      bench.chip.inject(Fault::kAxisStuck, {.axis = 1});
      bench.run(static_cast<std::int64_t>(c.found_s * 1e6), 2'000);
      EXPECT_GT(bench.of(Reason::kStuckGyro), 0);
    }
  }
}

}  // namespace
}  // namespace tetap::drivers::icm42688
