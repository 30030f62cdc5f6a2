// SPDX-License-Identifier: Apache-2.0
// The fake quadrature encoder: what holds for any motion, and what each fault does to it.
#include "support/fakes/encoder.hpp"

#include <gtest/gtest.h>

#include <set>
#include <vector>

namespace tetap::fakes {
namespace {

template <class Counter>
class EncoderLaws : public ::testing::Test {};
using Widths = ::testing::Types<std::uint16_t, std::uint32_t>;
TYPED_TEST_SUITE(EncoderLaws, Widths);

std::vector<std::function<double(double)>> motions() {
  return {[](double s) { return 5'000.0 * s + 0.37; },
          [](double s) { return -300'000.0 * s + 0.37; },
          [](double s) { return 800.0 * std::sin(7.0 * s) + 0.37; },
          [](double s) { return 0.3 * std::sin(200.0 * s) + 0.01; },  // shaking on one edge
          [](double s) { return 20'000.0 * s * s - 3'000.0 * s + 0.37; },
          [](double) { return 0.0; }};
}

TYPED_TEST(EncoderLaws, TheCountIsTheNumberOfEdgesPassedModuloItsWidth) {
  static_assert(hal::EncoderCounter<Encoder<TypeParam>>);
  for (const auto& motion : motions()) {
    for (const std::uint32_t start : {0U, 65'530U, 4'294'967'290U}) {
      Encoder<TypeParam> encoder;
      encoder.set_count(static_cast<TypeParam>(start));
      encoder.set_motion(motion);
      for (int ms = 1; ms <= 700; ++ms) {
        encoder.advance({1'000 * ms});
        const auto expected = static_cast<TypeParam>(start + static_cast<std::uint64_t>(encoder.line()));
        ASSERT_EQ(encoder.read().count, expected);
        ASSERT_EQ(encoder.line(), static_cast<std::int64_t>(std::floor(motion(1e-3 * ms))));
      }
    }
  }
}

TYPED_TEST(EncoderLaws, TheEdgeTimeIsWhenTheCountLastChanged) {
  for (const auto& motion : motions()) {
    Encoder<TypeParam> encoder;
    encoder.set_motion(motion);
    auto before = encoder.read();
    for (int us = 5; us <= 200'000; us += 5) {
      encoder.advance({us});
      const auto now = encoder.read();
      if (now.count != before.count) {
        ASSERT_TRUE(now.last_edge.has_value());
        EXPECT_LE(now.last_edge->us, us);
        EXPECT_GE(now.last_edge->us, us - 5);
      } else {
        EXPECT_EQ(now.last_edge, before.last_edge);
      }
      before = now;
    }
  }
}

TYPED_TEST(EncoderLaws, ThereAndBackIsWhereItBegan) {
  Encoder<TypeParam> encoder;
  encoder.set_edge_errors({0.1, -0.2, 0.3, 0.05});
  encoder.set_motion([](double s) { return 5'000.5 * std::sin(3.14159265358979 * s) + 0.5; });
  encoder.advance({500'000});
  EXPECT_EQ(encoder.read().count, 5001);
  encoder.advance({1'000'000});
  EXPECT_EQ(encoder.read().count, 0);
}

TYPED_TEST(EncoderLaws, AtConstantSpeedEdgesAreEvenlySpacedUnlessTheDiscIsNot) {
  for (const double error : {0.0, 0.2}) {
    Encoder<TypeParam> encoder;
    encoder.set_edge_errors({0.0, error, 0.0, 0.0});
    encoder.set_speed(1'000.0);
    std::set<std::int64_t> spacings_us;
    std::optional<base::Micros> previous;
    for (int us = 100; us <= 100'000; us += 100) {
      encoder.advance({us});
      const auto at = encoder.read().last_edge;
      if (at && previous && *at != *previous) spacings_us.insert((at->us - previous->us + 5) / 10 * 10);
      previous = at;
    }
    EXPECT_EQ(spacings_us, error > 0.0 ? (std::set<std::int64_t>{800, 1'000, 1'200}) : (std::set<std::int64_t>{1'000}));
  }
}

TEST(EncoderFaults, ADeadChannelDithersByOneHoweverFarTheWheelTurns) {
  for (const int channel : {0, 1}) {
    Encoder<std::uint16_t> encoder;
    encoder.inject(EncoderFault::kChannelDead, {.channel = channel});
    encoder.set_speed(3'000.0);
    std::set<std::int16_t> counts;
    for (int ms = 1; ms < 500; ++ms) {
      encoder.advance({1'000 * ms});
      counts.insert(static_cast<std::int16_t>(encoder.read().count));
    }
    EXPECT_EQ(counts.size(), 2U);
    EXPECT_GT(encoder.line(), 1'000);
    EXPECT_GT(encoder.read().last_edge->us, 490'000);
  }
}

TEST(EncoderFaults, GlitchesMoveTheEdgeTimeAndNotTheCount) {
  Encoder<std::uint32_t> encoder;
  encoder.inject(EncoderFault::kGlitches, {.rate_Hz = 500.0});
  encoder.advance({1'000'000});
  EXPECT_EQ(encoder.read().count, 0U);
  EXPECT_GT(encoder.read().last_edge->us, 900'000);
  EXPECT_NEAR(encoder.disturbances(), 500, 120);
}

TEST(EncoderFaults, AStuckCaptureLeavesTheEdgeTimeWhereItWasAndTheCountGoesOn) {
  Encoder<std::uint32_t> encoder;
  encoder.set_speed(1'000.0);
  encoder.advance({100'500});
  const auto before = encoder.read();
  encoder.inject(EncoderFault::kCaptureStuck);
  encoder.advance({200'500});
  EXPECT_EQ(encoder.read().count, before.count + 100);
  EXPECT_EQ(encoder.read().last_edge, before.last_edge);
}

TEST(EncoderFaults, SpuriousCountsWanderFromTheTruth) {
  Encoder<std::uint32_t> encoder;
  encoder.inject(EncoderFault::kSpurious, {.rate_Hz = 1'000.0, .seed = 3});
  encoder.advance({2'000'000});
  const auto off = static_cast<std::int32_t>(encoder.read().count);
  EXPECT_NE(off, 0);
  EXPECT_LT(std::abs(off), 5 * 45);
}

TEST(EncoderFaults, EveryMissedPulseIsFourEdgesLess) {
  for (const double speed : {2'000.0, -2'000.0}) {
    Encoder<std::uint32_t> encoder;
    encoder.inject(EncoderFault::kMissedPulses, {.every = 10});
    encoder.set_speed(speed);
    encoder.advance({1'000'700});
    const auto counted = static_cast<std::int32_t>(encoder.read().count);
    EXPECT_NEAR(encoder.pulses_missed(), 2'000 / 4 / 10, 6);
    EXPECT_NEAR(static_cast<double>(std::abs(encoder.line()) - std::abs(counted)), 4 * encoder.pulses_missed(), 4);
  }
}

TEST(EncoderFaults, StuckSwappedJumpResetAndNoCaptureAreWhatTheirNamesSay) {
  const auto after = [](EncoderFault fault, const EncoderFaultDetail& detail = {}) {
    Encoder<std::uint16_t> encoder;
    encoder.set_speed(1'000.0);
    encoder.advance({500'400});
    encoder.inject(fault, detail);
    encoder.advance({1'000'400});
    return encoder.read();
  };
  EXPECT_EQ(after(EncoderFault::kStuck).count, 500);
  EXPECT_EQ(after(EncoderFault::kStuck).last_edge->us, 500'000);
  EXPECT_EQ(after(EncoderFault::kSwapped).count, 0);
  EXPECT_EQ(after(EncoderFault::kJump, {.counts = -3'000}).count, static_cast<std::uint16_t>(1'000 - 3'000));
  EXPECT_EQ(after(EncoderFault::kReset).count, 500);
  EXPECT_EQ(after(EncoderFault::kNoCapture).count, 1'000);
  EXPECT_FALSE(after(EncoderFault::kNoCapture).last_edge.has_value());
}

TEST(EncoderFaults, HaveANameEach) {
  std::set<std::string_view> names;
  for (int i = 0; i < static_cast<int>(EncoderFault::kCount); ++i) names.insert(name(static_cast<EncoderFault>(i)));
  EXPECT_EQ(names.size(), static_cast<std::size_t>(EncoderFault::kCount));
}

}  // namespace
}  // namespace tetap::fakes
