// SPDX-License-Identifier: Apache-2.0
// A wheel that knows its true position, a timer that counts its edges and wraps, and what the driver makes of it.
#include "drivers/encoder/quadrature_pair.hpp"

#include <gtest/gtest.h>

#include "tetap/base/random.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace tetap::drivers {
namespace {

using base::Micros;

/// Edges lie at whole counts; moving by `counts_per_s`, microsecond by microsecond so that each edge has its time.
template <class C>
struct Wheel {
  using Counter = C;

  void turn(double counts_per_s, std::int64_t for_us) {
    for (std::int64_t i = 0; i < for_us; ++i) {
      const auto before = static_cast<std::int64_t>(std::floor(position));
      position += counts_per_s * 1e-6;
      ++now.us;
      const auto after = static_cast<std::int64_t>(std::floor(position));
      if (after != before) last_edge = now;
    }
  }
  [[nodiscard]] hal::EncoderReading<C> read() const {
    const auto count = static_cast<std::int64_t>(std::floor(position)) + offset;
    return {static_cast<C>(count), captures ? std::optional(last_edge) : std::nullopt};
  }

  double position = 0.5;
  std::int64_t offset = 0;  ///< where the timer's zero is
  bool captures = true;
  Micros now{};
  Micros last_edge{};
};
static_assert(hal::EncoderCounter<Wheel<std::uint16_t>> && hal::EncoderCounter<Wheel<std::uint32_t>>);

template <class C>
class QuadratureOf : public ::testing::Test {
 protected:
  void run(double counts_per_s, std::int64_t for_us, std::int64_t every_us = 5000) {
    for (std::int64_t t = 0; t < for_us; t += every_us) {
      wheel.turn(counts_per_s, every_us);
      encoder.update(wheel.read(), wheel.now);
    }
  }
  Wheel<C> wheel;
  Quadrature<C> encoder;
};
using Widths = ::testing::Types<std::uint16_t, std::uint32_t>;
TYPED_TEST_SUITE(QuadratureOf, Widths);

TYPED_TEST(QuadratureOf, TotalsGoThroughTheCountersEndsInBothDirections) {
  for (const std::int64_t offset :
       {std::int64_t{0}, std::int64_t{65'530}, std::int64_t{4'294'967'290}, std::int64_t{-3}}) {
    this->wheel = {};
    this->wheel.offset = offset;
    this->encoder = Quadrature<TypeParam>{};
    this->encoder.update(this->wheel.read(), this->wheel.now);
    this->run(2000, 50'000);
    EXPECT_EQ(this->encoder.counts(), 100);
    this->run(-4000, 100'000);
    EXPECT_EQ(this->encoder.counts(), -300);
  }
}

TYPED_TEST(QuadratureOf, TotalsGrowBeyondAnyCounter) {
  this->encoder.update({0}, {0});
  TypeParam count = 0;
  for (int i = 1; i <= 10'000; ++i) {
    count = static_cast<TypeParam>(count + 900);
    this->encoder.update({count}, {i * 5000});
  }
  EXPECT_EQ(this->encoder.counts(), 9'000'000);
  EXPECT_EQ(this->encoder.health().of(EncoderReason::kJump), 0);
}

TYPED_TEST(QuadratureOf, SpeedIsRightFromOneCountASecondToAHundredThousand) {
  for (const double speed : {4.0, 17.0, 130.0, 900.0, 6'000.0, 100'000.0, -4.0, -130.0, -6'000.0, -100'000.0}) {
    this->wheel = {};
    this->encoder = Quadrature<TypeParam>{};
    this->run(speed, 2'000'000);
    EXPECT_NEAR(static_cast<double>(this->encoder.counts_per_s()) / speed, 1.0, 0.005) << speed;
  }
}

TYPED_TEST(QuadratureOf, WithoutEdgeTimesSpeedIsCountsPerTick) {
  this->wheel.captures = false;
  this->run(10'000, 100'000);
  EXPECT_NEAR(this->encoder.counts_per_s(), 10'000, 200);
}

TYPED_TEST(QuadratureOf, AWheelThatStopsIsNeverFasterThanOneCountInTheTimeSinceItsLastEdge) {
  this->run(333, 500'000);
  ASSERT_NEAR(this->encoder.counts_per_s(), 333, 2);
  float before = this->encoder.counts_per_s();
  for (int i = 1; i <= 120; ++i) {
    this->wheel.turn(0, 5000);
    this->encoder.update(this->wheel.read(), this->wheel.now);
    const double quiet_s = 1e-6 * static_cast<double>((this->wheel.now - this->wheel.last_edge).us);
    EXPECT_LE(this->encoder.counts_per_s(), 1.0 / quiet_s * 1.00001);
    EXPECT_LE(this->encoder.counts_per_s(), before);
    before = this->encoder.counts_per_s();
  }
  EXPECT_EQ(this->encoder.counts_per_s(), 0.0F);
}

TYPED_TEST(QuadratureOf, RockingOnOneEdgeIsNoSpeedAndNoDistance) {
  this->run(100, 200'000);
  const std::int64_t before = this->encoder.counts();
  double edge = std::ceil(this->wheel.position);
  for (int i = 0; i < 200; ++i) {
    this->wheel.position = edge - 0.01;
    this->run(4, 5000);  // over the edge
    this->wheel.position = edge + 0.01;
    this->run(-4, 5000);  // and back
    if (i > 10) {
      ASSERT_EQ(this->encoder.counts_per_s(), 0.0F);
    }
  }
  EXPECT_LE(std::abs(this->encoder.counts() - before), 1);
}

TYPED_TEST(QuadratureOf, TurningBackNeverShowsMoreSpeedThanThereIs) {
  this->run(50, 500'000);
  double most = 0;
  for (int i = 0; i < 100; ++i) {
    this->run(-50, 5000);
    most = std::max(most, std::abs(static_cast<double>(this->encoder.counts_per_s())));
  }
  EXPECT_LT(most, 51.0);
  EXPECT_NEAR(this->encoder.counts_per_s(), -50, 0.5);
}

TYPED_TEST(QuadratureOf, AJumpOfOneReadingIsRefusedAndForgotten) {
  this->run(1000, 500'000);
  for (int k = 0; k < 50; ++k) {
    this->wheel.turn(1000, 5000);
    auto reading = this->wheel.read();
    const bool broken = k % 5 == 2;
    if (broken) reading.count = static_cast<TypeParam>(reading.count ^ 0x4000);
    this->encoder.update(reading, this->wheel.now);
    EXPECT_NEAR(this->encoder.counts_per_s(), 1000, 30);
  }
  this->run(1000, 100'000);
  EXPECT_EQ(this->encoder.health().of(EncoderReason::kJump), 10);
  EXPECT_EQ(this->encoder.health().of(EncoderReason::kRebased), 0);
  EXPECT_NEAR(static_cast<double>(this->encoder.counts()), this->wheel.position, 7);
}

TYPED_TEST(QuadratureOf, ACounterThatWasSetToSomethingElseIsFollowedFromThere) {
  this->run(1000, 500'000);
  const std::int64_t before = this->encoder.counts();
  this->wheel.offset += 0x5000;
  this->run(1000, 500'000);
  EXPECT_EQ(this->encoder.health().of(EncoderReason::kRebased), 1);
  EXPECT_NEAR(static_cast<double>(this->encoder.counts() - before), 500, 30);
  EXPECT_NEAR(this->encoder.counts_per_s(), 1000, 20);
}

TYPED_TEST(QuadratureOf, EdgeTimesThatCannotBeAreNotUsed) {
  this->run(200, 500'000);
  for (const std::int64_t wrong_us : {std::int64_t{1'000'000}, std::int64_t{-1'000'000}}) {
    this->wheel.turn(200, 5000);
    auto reading = this->wheel.read();
    reading.last_edge = this->wheel.now + Micros{wrong_us};
    this->encoder.update(reading, this->wheel.now);
    EXPECT_NEAR(this->encoder.counts_per_s(), 200, 1.0);
    this->run(200, 50'000);
    EXPECT_NEAR(this->encoder.counts_per_s(), 200, 1.0);
  }
  EXPECT_EQ(this->encoder.health().of(EncoderReason::kBadEdge), 2);
}

TEST(Quadrature, AnEdgeWithoutATimeIsNoStartForTheNext) {
  Wheel<std::uint16_t> wheel;
  Quadrature<std::uint16_t> encoder;
  float most = 0;
  for (int i = 0; i < 500; ++i) {
    wheel.turn(130, 5000);
    wheel.captures = i % 3 != 0;
    encoder.update(wheel.read(), wheel.now);
    most = std::max(most, encoder.counts_per_s());
  }
  EXPECT_LE(most, 200.01F);  // one count a tick: all that can be said without a time
}

TEST(Quadrature, APauseInWhichSixteenBitsMayHaveTurnedIsSaid) {
  Quadrature<std::uint16_t> narrow;
  Quadrature<std::uint32_t> wide;
  narrow.update({0}, {0});
  wide.update({0}, {0});
  narrow.update({5000}, {1'000'000});  // 200 000 counts/s allow any number of turns
  wide.update({5000}, {1'000'000});
  EXPECT_EQ(narrow.health().of(EncoderReason::kAmbiguous), 1);
  EXPECT_EQ(narrow.counts(), 0);
  EXPECT_EQ(wide.health().of(EncoderReason::kAmbiguous), 0);
  EXPECT_EQ(wide.counts(), 5000);
}

TEST(Quadrature, AnInvertedEncoderCountsTheOtherWay) {
  Quadrature<std::uint16_t> encoder({.inverted = true});
  encoder.update({10}, {0});
  encoder.update({0}, {5000});
  EXPECT_EQ(encoder.counts(), 10);
  EXPECT_GT(encoder.counts_per_s(), 0);
}

TEST(Quadrature, RandomWalksKeepEveryCount) {
  base::Random random(3);
  Wheel<std::uint16_t> wheel;
  Quadrature<std::uint16_t> encoder;
  wheel.offset = 65'000;
  encoder.update(wheel.read(), wheel.now);
  for (int i = 0; i < 2000; ++i) {
    const double speed = (static_cast<double>(random.next() % 20'001) - 10'000) * 5;
    wheel.turn(speed, 1000 + random.next() % 4000);
    encoder.update(wheel.read(), wheel.now);
    ASSERT_EQ(encoder.counts(), static_cast<std::int64_t>(std::floor(wheel.position)));
    ASSERT_TRUE(std::isfinite(encoder.counts_per_s()));
    ASSERT_LE(std::abs(encoder.counts_per_s()), 52'000.0F);
  }
}

TEST(QuadraturePair, GivesEachSideItsOwnInTheFormEstimatorsTake) {
  Wheel<std::uint16_t> left;
  Wheel<std::uint32_t> right;
  QuadraturePair<Wheel<std::uint16_t>, Wheel<std::uint32_t>> pair(left, {}, right, {.inverted = true});
  pair.poll({0});
  for (int i = 0; i < 200; ++i) {
    left.turn(1000, 5000);
    right.turn(-500, 5000);
    pair.poll(left.now);
  }
  EXPECT_EQ(pair.counts().left, 1000);
  EXPECT_EQ(pair.counts().right, 500);
  EXPECT_NEAR(pair.speeds(0.001F, 0.002F).left_mps, 1.0F, 0.01F);
  EXPECT_NEAR(pair.speeds(0.001F, 0.002F).right_mps, 1.0F, 0.01F);
}

}  // namespace
}  // namespace tetap::drivers
