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

/// Counts that the driver adds when the counter is set to 0 once, at this pace; readings are plain numbers.
template <class C>
std::int64_t added_by_reset(C standing_at, double counts_per_s, std::int64_t every_us,
                            const QuadratureSettings& settings, EncoderHealth* health = nullptr) {
  Quadrature<C> driver(settings);
  const double sense = settings.inverted ? -1 : 1;
  std::int64_t t = 0;
  const auto moved = [&](std::int64_t at) {
    return std::llround(sense * counts_per_s * 1e-6 * static_cast<double>(at));
  };
  const auto reading = [&](std::int64_t base_count) { return static_cast<C>(base_count + moved(t)); };
  driver.update({reading(standing_at), {}}, {t});
  std::int64_t offset = standing_at;
  for (int i = 0; i < 200; ++i) {
    t += every_us;
    if (i == 100) offset = -moved(t);  // the counter reads 0 here and goes on from there
    driver.update({reading(offset), {}}, {t});
  }
  if (health != nullptr) *health = driver.health();
  const std::int64_t truth = std::llround(counts_per_s * 1e-6 * static_cast<double>(t));
  return driver.counts() - truth;
}

TEST(QuadratureFault, ARefusedResetIsNeverCountedAsMotionAtAnyPaceSpeedOrDistance) {
  for (const std::int64_t every_us : {1'000, 5'000, 10'000, 20'000}) {
    const double most_per_update = 200'000.0 * 1e-6 * static_cast<double>(every_us);
    for (int standing_at = 250; standing_at <= 32'000; standing_at += 250) {
      for (const double speed : {0.0, 3'000.0, -3'000.0}) {
        for (const bool inverted : {false, true}) {
          // A jump that one update can pass cannot be told from motion, and half a turn of the counter has no sign.
          const double sense = inverted ? -1.0 : 1.0, way = 1e-6 * speed * static_cast<double>(every_us);
          const double jump = standing_at + sense * way * 100;
          if (jump < most_per_update + std::abs(way) + 10 || jump > 32'000) continue;
          EncoderHealth health;
          const auto added = added_by_reset<std::uint16_t>(static_cast<std::uint16_t>(standing_at), speed, every_us,
                                                           {.inverted = inverted}, &health);
          // The motion of the readings until the new count is confirmed is lost.
          const double lost = std::abs(speed) * 1e-6 * 7 * static_cast<double>(every_us) + 2;
          EXPECT_LE(std::abs(static_cast<double>(added)), lost)
              << "at " << standing_at << ", " << speed << "/s, every " << every_us << (inverted ? " inverted" : "");
          EXPECT_GE(health.of(EncoderReason::kJump), 1);
          EXPECT_EQ(health.of(EncoderReason::kRebased), 1);
        }
      }
    }
  }
}

TEST(QuadratureFault, AWrongReadingCostsNothingWhetherTheWheelStandsOrTurns) {
  for (const int bit : {12, 13, 14, 15}) {
    for (const double speed : {0.0, 20'000.0, -20'000.0, 120'000.0, -120'000.0}) {
      for (const int wrong : {1, 2}) {
        Quadrature<std::uint16_t> driver;
        std::int64_t t = 0;
        const auto truth = [&] { return std::llround(speed * 1e-6 * static_cast<double>(t)); };
        driver.update({0, {}}, {t});
        for (int i = 0; i < 100; ++i) {
          t += 5'000;
          auto count = static_cast<std::uint16_t>(truth());
          // Each wrong reading is wrong in another bit.
          if (i >= 50 && i < 50 + wrong) count = static_cast<std::uint16_t>(count ^ 1U << (bit - (i - 50)));
          driver.update({count, {}}, {t});
        }
        EXPECT_EQ(driver.counts(), truth()) << bit << ' ' << speed << ' ' << wrong;
        EXPECT_EQ(driver.health().of(EncoderReason::kRebased), 0);
      }
    }
  }
}

TEST(QuadratureFault, ARefusedResetStaysRefusedWhenTheNextUpdatesComeLater) {
  for (const std::int64_t later_us : {11'000, 15'000, 25'000, 50'000}) {
    Quadrature<std::uint16_t> driver;
    std::int64_t t = 0;
    driver.update({2'100, {}}, {t});
    for (int i = 0; i < 20; ++i) driver.update({2'100, {}}, {t += 10'000});
    driver.update({0, {}}, {t += 10'000});  // beyond what 10 ms allow, within what the next pause allows
    for (int i = 0; i < 20; ++i) driver.update({0, {}}, {t += later_us});
    EXPECT_EQ(driver.counts(), 0) << later_us;
    EXPECT_GE(driver.health().of(EncoderReason::kJump), 1);
  }
}

TEST(QuadratureFault, AWrongReadingBeforeALongPauseIsForgotten) {
  Quadrature<std::uint16_t> driver;
  std::int64_t t = 0;
  driver.update({5'000, {}}, {t});
  for (int i = 0; i < 20; ++i) driver.update({5'000, {}}, {t += 10'000});
  driver.update({1'000, {}}, {t += 10'000});  // refused
  for (int i = 0; i < 20; ++i) driver.update({5'000, {}}, {t += 60'000});
  EXPECT_EQ(driver.counts(), 0);
  EXPECT_EQ(driver.health().of(EncoderReason::kJump), 1);
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
