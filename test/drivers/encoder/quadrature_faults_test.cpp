// SPDX-License-Identifier: Apache-2.0
// The encoder's driver against two wires and a timer that fail in named ways.
#include <gtest/gtest.h>

#include <cmath>

#include "drivers/encoder/quadrature_pair.hpp"
#include "support/fakes/encoder.hpp"

namespace tetap::drivers {
namespace {

using fakes::EncoderFault;

template <class C>
struct Bench {
  explicit Bench(const QuadratureSettings& settings = {}) : driver(settings) { driver.update(encoder.read(), now); }

  void run(std::int64_t for_us, std::int64_t every_us = 5000) {
    for (std::int64_t t = 0; t < for_us; t += every_us) {
      now += base::Micros{every_us};
      encoder.advance(now);
      driver.update(encoder.read(), now);
      const double speed = std::abs(static_cast<double>(driver.counts_per_s()));
      fastest = std::max(fastest, speed);
    }
  }
  [[nodiscard]] double behind() const { return static_cast<double>(driver.counts() - encoder.line()); }

  fakes::Encoder<C> encoder;
  Quadrature<C> driver;
  base::Micros now{};
  double fastest = 0;
};

TEST(QuadratureFault, NothingBrokenNoCountIsLostInAnyMotion) {
  Bench<std::uint16_t> narrow;
  Bench<std::uint32_t> wide;
  const auto motion = [](double s) { return 60'000.0 * std::sin(1.3 * s) + 5'000.0 * std::sin(11.0 * s); };
  narrow.encoder.set_motion(motion);
  wide.encoder.set_motion(motion);
  narrow.run(10'000'000);
  wide.run(10'000'000);
  EXPECT_EQ(narrow.behind(), 0);
  EXPECT_EQ(wide.behind(), 0);
  EXPECT_LT(narrow.fastest, 134'000);
}

TEST(QuadratureFault, SpeedFollowsAWheelThatSwingsThroughZero) {
  Bench<std::uint16_t> bench;
  bench.encoder.set_motion([](double s) { return 300.0 * std::sin(2.0 * s); });
  bench.run(50'000);  // the first edges have no edge before them
  double worst = 0;
  for (int i = 0; i < 2000; ++i) {
    bench.run(5000);
    const double speed = 600.0 * std::cos(2e-6 * static_cast<double>(bench.now.us));
    worst = std::max(worst, std::abs(static_cast<double>(bench.driver.counts_per_s()) - speed));
  }
  // After turning, the first edge says nothing of speed; the second comes two counts on, at sqrt(2 * 1200 * 2) = 69.
  EXPECT_LT(worst, 72.0);
  EXPECT_EQ(bench.behind(), 0);
}

TEST(QuadratureFault, TheTotalGoesOnWhereTheCounterTurnsRound) {
  for (const double speed : {60'000.0, -60'000.0}) {
    Bench<std::uint16_t> bench;
    bench.encoder.set_speed(speed);
    bench.run(3'000'000);
    EXPECT_GT(std::abs(bench.driver.counts()), 2 * 65'536);
    EXPECT_EQ(bench.behind(), 0);
  }
}

TEST(QuadratureFault, RockingOnOneEdgeIsNoSpeed) {
  Bench<std::uint16_t> bench;
  bench.encoder.set_motion([](double s) { return 1.0 + 0.3 * std::sin(45.0 * s); });
  bench.run(500'000);  // the first edges have no edge before them
  const std::int64_t before = bench.driver.counts();
  bench.fastest = 0;
  bench.run(3'000'000);
  EXPECT_EQ(bench.fastest, 0);
  EXPECT_LE(std::abs(bench.driver.counts() - before), 1);
}

TEST(QuadratureFault, ExchangedWiresAreTurnedRoundByTheSettingInDistanceAndSpeed) {
  Bench<std::uint16_t> bench({.inverted = true});
  bench.encoder.inject(EncoderFault::kSwapped);
  bench.encoder.set_speed(2000);
  bench.run(1'000'000);
  EXPECT_EQ(bench.behind(), 0);
  EXPECT_NEAR(bench.driver.counts_per_s(), 2000, 10);
}

TEST(QuadratureFault, ACaptureThatStandsStillIsSaidAndSpeedComesFromTheTick) {
  Bench<std::uint16_t> bench;
  bench.encoder.set_speed(1000);
  bench.run(500'000);
  bench.encoder.inject(EncoderFault::kCaptureStuck);
  bench.run(500'000);
  EXPECT_GT(bench.driver.health().of(EncoderReason::kBadEdge), 50);
  EXPECT_NEAR(bench.driver.counts_per_s(), 1000, 201);
  EXPECT_LT(bench.fastest, 1201);
  EXPECT_EQ(bench.behind(), 0);
}

TEST(QuadratureFault, AJumpIsRefusedThenFollowedAndOnlyTheJumpIsMissing) {
  for (const std::int32_t counts : {30'000, -30'000, 20'000}) {
    Bench<std::uint16_t> bench;
    bench.encoder.set_speed(2000);
    bench.run(1'000'000);
    bench.encoder.inject(EncoderFault::kJump, {.counts = counts});
    bench.run(1'000'000);
    EXPECT_GT(bench.driver.health().of(EncoderReason::kJump), 0);
    EXPECT_EQ(bench.driver.health().of(EncoderReason::kRebased), 1);
    EXPECT_NEAR(bench.behind(), 0, 2000 * 0.03) << counts;  // the five readings until it was believed
    EXPECT_LT(bench.fastest, 2100);
  }
}

TEST(QuadratureFault, ACounterThatIsResetIsFollowed) {
  Bench<std::uint32_t> bench;
  bench.encoder.set_count(3'000'000'000U);
  bench.driver = Quadrature<std::uint32_t>{};
  bench.driver.update(bench.encoder.read(), bench.now);
  bench.encoder.set_speed(-2000);
  bench.run(1'000'000);
  bench.encoder.inject(EncoderFault::kReset);
  bench.run(1'000'000);
  EXPECT_EQ(bench.driver.health().of(EncoderReason::kRebased), 1);
  EXPECT_NEAR(bench.behind(), 0, 2000 * 0.03);
  EXPECT_NEAR(bench.driver.counts_per_s(), -2000, 30);
}

TEST(QuadratureFault, WithoutCaptureSpeedComesFromTheTickAlone) {
  Bench<std::uint16_t> bench;
  bench.encoder.inject(EncoderFault::kNoCapture);
  bench.encoder.set_speed(1000);
  bench.run(1'000'000);
  EXPECT_NEAR(bench.driver.counts_per_s(), 1000, 201);
  bench.encoder.set_speed(0);
  bench.run(600'000);
  EXPECT_EQ(bench.driver.counts_per_s(), 0.0F);
}

TEST(QuadratureFault, SpikesOnAWireMakeNoDistanceAndNoFalseSpeedAtRest) {
  Bench<std::uint16_t> bench;
  bench.encoder.inject(EncoderFault::kGlitches, {.rate_Hz = 400});
  bench.run(2'000'000);
  EXPECT_GT(bench.encoder.disturbances(), 500);
  EXPECT_EQ(bench.driver.counts(), 0);
  EXPECT_EQ(bench.fastest, 0);
}

TEST(QuadratureFault, ADeadWireDithersAndIsNeverTakenForRolling) {
  for (const int channel : {0, 1}) {
    Bench<std::uint16_t> bench;
    bench.encoder.set_speed(500);
    bench.run(500'000);
    bench.encoder.inject(EncoderFault::kChannelDead, {.channel = channel});
    bench.run(100'000);
    const std::int64_t before = bench.driver.counts();
    bench.fastest = 0;
    bench.run(2'000'000);
    EXPECT_LE(std::abs(bench.driver.counts() - before), 1);
    EXPECT_LT(bench.fastest, 510);
  }
}

TEST(QuadratureFault, AStuckWheelIsStandingStill) {
  Bench<std::uint16_t> bench;
  bench.encoder.set_speed(500);
  bench.run(500'000);
  bench.encoder.inject(EncoderFault::kStuck);
  bench.run(600'000);
  EXPECT_EQ(bench.driver.counts_per_s(), 0.0F);
}

TEST(QuadratureFault, MissedPulsesAreMissingFourByFourAndNothingElse) {
  Bench<std::uint16_t> bench;
  bench.encoder.set_speed(2000);
  bench.encoder.inject(EncoderFault::kMissedPulses, {.every = 10});
  bench.run(2'000'000);
  EXPECT_NEAR(bench.behind(), -4.0 * bench.encoder.pulses_missed(), 4);
  EXPECT_EQ(bench.driver.health().of(EncoderReason::kJump), 0);
}

}  // namespace
}  // namespace tetap::drivers
