// SPDX-License-Identifier: Apache-2.0
// Encoder counters that go farther than a wheel can, and those whose stamps only make them seem to.
#include "inertial_drive.hpp"

#include <utility>

namespace tetap::estimators {
namespace {

SourceStatus wheels_of(const Drive& d) {
  const auto row = d.estimator.sources(d.ctx()).of(sensor::Sensor::kWheelSpeed);
  return {row.state, row.failed};
}

/// Status of wheels whose counts, both alike, come at these times [us].
SourceStatus wheels_after(std::initializer_list<std::pair<std::int64_t, int>> counts) {
  Drive d;
  for (const auto& [at_us, count] : counts) {
    const auto step = static_cast<std::uint16_t>(count);
    d.estimator.fuse(sensor::WheelCounts{step, step}, {Drive::kBegin_us + at_us}, d.ctx());
  }
  return wheels_of(d);
}

// Limits of the test's rover: 50 m/s, 31 831 counts a metre; the filter takes every second sample of 100 a second.
TEST(EncoderInterval, AStepThatNoWheelCanDoIsFoundAlsoBetweenTheCountsThatAreFused) {
  EXPECT_EQ(wheels_after({{10'000, 0}, {30'000, 31'000}}).failed, Check::kNone);
  EXPECT_EQ(wheels_after({{10'000, 0}, {30'000, 32'500}}).failed, Check::kValue);
  EXPECT_EQ(wheels_after({{10'000, 0}, {20'000, 32'500}, {30'000, 640}}).failed, Check::kValue);
  EXPECT_EQ(wheels_after({{10'000, 0}, {20'000, -32'500}, {30'000, 640}}).failed, Check::kValue);
}

TEST(EncoderInterval, StampsThatAreBunchedAreNoStep) {
  EXPECT_EQ(wheels_after({{10'000, 0}, {10'500, 3'000}, {30'000, 6'000}}).failed, Check::kNone);
}

// Half of the counter's range a sample: two samples are its whole range, and the rest is of any speed.
TEST(EncoderInterval, ACounterThatLeapsIsLeftToTheImu) {
  Drive d = settled(rover_like());
  d.tamper = [](Drive::Fix&) { return false; };
  std::mt19937 engine(1);
  std::uniform_int_distribution<int> chance(-600, 600);
  int offset = 0;
  d.tamper_wheels = [&](sensor::WheelCounts& counts) {
    offset += 32'767 + chance(engine);
    counts.left = static_cast<std::uint16_t>(counts.left + offset);
    counts.right = static_cast<std::uint16_t>(counts.right + offset);
  };
  d.run(10);
  EXPECT_EQ(wheels_of(d).state, SourceState::kRejecting);
  EXPECT_EQ(wheels_of(d).failed, Check::kValue);
  EXPECT_LT(d.error_m(), 1.5);
  EXPECT_LT(d.worst_sigmas, 3.0);
  d.tamper_wheels = [&](sensor::WheelCounts& counts) {
    counts.left = static_cast<std::uint16_t>(counts.left + offset);
    counts.right = static_cast<std::uint16_t>(counts.right + offset);
  };
  d.run(1);
  EXPECT_EQ(wheels_of(d).state, SourceState::kFusing);
}

}  // namespace
}  // namespace tetap::estimators
