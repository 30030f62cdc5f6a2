// SPDX-License-Identifier: Apache-2.0
// The world behind the pins, by physics: gravity at rest, the turn that the gyroscope integrates, the way that edges
// measure. The chip's axes are tested, too. The truth is that of the world, from the path's closed forms.
#include "sim_host/emulator/simulated_sensors.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tetap::board {
namespace {

param::Parameters wired() {
  param::Parameters p;
  p.wired.imu = p.wired.encoders = 1;
  p.wired.gnss = 2;
  return p;
}

/// A world with the default rover's own errors switched off where a law is asserted to a part in a thousand.
sim::World world(bool ideal) {
  sim::World::Options options;
  options.mismatched = !ideal;
  return sim::World(options, 3);
}

constexpr Picoseconds kStart = kSecond;

TEST(SimulatedSensors, StandsAndWeighsBeforeTheWorldStarts) {
  SimulatedSensors sensors(world(false), wired(), {}, 1);
  const SensorWorld door = sensors.door();
  const std::int64_t left = door.left_edges(0);
  for (Picoseconds t = 0; t < kStart; t += kMillisecond) {
    const ImuTruth imu = door.imu(t);
    const auto& f = imu.force_mps2;
    EXPECT_NEAR(std::sqrt(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]), 9.81, 0.2);
    EXPECT_EQ(door.left_edges(t), left);
  }
  EXPECT_EQ(sensors.truth().front().time.us, 0);
  EXPECT_EQ(sensors.truth().back().time.us, 1'000'000);
}

TEST(SimulatedSensors, IntegralOfTheRateIsTheTurn) {
  SimulatedSensors sensors(world(true), wired(), {}, 1);
  const SensorWorld door = sensors.door();
  // A chip whose clock is 0.7 % fast asks at no whole step of the world.
  constexpr Picoseconds kPeriod = kMillisecond * 993 / 1000;
  double turn_rad = 0;
  Picoseconds t = kStart;
  for (; t < kStart + 60 * kSecond; t += kPeriod)
    turn_rad += door.imu(t).rate_radps[2] * static_cast<double>(kPeriod) / static_cast<double>(kSecond);
  double truth_rad = 0;
  const auto& rows = sensors.truth();
  for (std::size_t i = 1; i < rows.size() && rows[i].time.us <= t / kMicrosecond; ++i)
    truth_rad += std::remainder(rows[i].yaw_rad - rows[i - 1].yaw_rad, 2 * 3.14159265358979);
  EXPECT_GT(std::fabs(truth_rad), 3.0) << "the course turns";
  EXPECT_NEAR(turn_rad, truth_rad, 0.01);
}

TEST(SimulatedSensors, EdgesMeasureTheWay) {
  SimulatedSensors sensors(world(true), wired(), {}, 1);
  const SensorWorld door = sensors.door();
  const std::int64_t left = door.left_edges(kStart), right = door.right_edges(kStart);
  const Picoseconds end = kStart + 60 * kSecond;
  std::int64_t last = left;
  for (Picoseconds t = kStart; t < end; t += 10 * kMillisecond) {
    EXPECT_GE(door.left_edges(t), last - 1) << "it drives forward";
    last = door.left_edges(t);
  }
  double way_m = 0;
  const auto& rows = sensors.truth();
  for (std::size_t i = 1; i < rows.size() && rows[i].time.us <= end / kMicrosecond; ++i)
    way_m += std::hypot(rows[i].x_m - rows[i - 1].x_m, rows[i].y_m - rows[i - 1].y_m);
  const double per_edge_m = 2 * 3.14159265358979 * 0.10 / sensors.world().parameters().wheels.counts_per_turn;
  const double measured_m =
      0.5 * per_edge_m * static_cast<double>(door.left_edges(end) - left + door.right_edges(end) - right);
  EXPECT_GT(way_m, 30.0);
  EXPECT_NEAR(measured_m, way_m, 0.002 * way_m);
}

TEST(SimulatedSensors, AxesOfTheChipFollowItsMounting) {
  param::Parameters turned = wired();
  // The chip lies with its y axis forward, its x axis to the right and its z axis up.
  turned.wired.imu_x = param::ChipAxis::kY;
  turned.wired.imu_y = param::ChipAxis::kMinusX;
  turned.wired.imu_z = param::ChipAxis::kZ;
  SimulatedSensors plain(world(true), wired(), {}, 1), other(world(true), turned, {}, 1);
  const SensorWorld a = plain.door(), b = other.door();
  for (Picoseconds t = kStart; t < kStart + 20 * kSecond; t += 7 * kMillisecond) {
    const ImuTruth s = a.imu(t), c = b.imu(t);
    ASSERT_EQ(c.force_mps2[1], s.force_mps2[0]);
    ASSERT_EQ(c.force_mps2[0], -s.force_mps2[1]);
    ASSERT_EQ(c.force_mps2[2], s.force_mps2[2]);
    ASSERT_EQ(c.rate_radps[1], s.rate_radps[0]);
  }
}

TEST(SimulatedSensors, InvertedCounterRunsBackwards) {
  param::Parameters inverted = wired();
  inverted.wired.right_inverted = 1;
  SimulatedSensors plain(world(true), wired(), {}, 1), other(world(true), inverted, {}, 1);
  const SensorWorld a = plain.door(), b = other.door();
  const Picoseconds end = kStart + 20 * kSecond;
  EXPECT_EQ(b.left_edges(end), a.left_edges(end));
  EXPECT_EQ(b.right_edges(end), -a.right_edges(end));
}

TEST(SimulatedSensors, QuestionsOfOneSensorDoNotChangeAnother) {
  SimulatedSensors one(world(false), wired(), {}, 5), two(world(false), wired(), {}, 5);
  const SensorWorld a = one.door(), b = two.door();
  for (Picoseconds t = kStart; t < kStart + 20 * kSecond; t += kMillisecond) (void)b.imu(t);
  EXPECT_EQ(a.left_edges(kStart + 20 * kSecond), b.left_edges(kStart + 20 * kSecond));
}

TEST(SimulatedSensors, SensorsThatAreNotWiredSpeakOnTheBus) {
  param::Parameters p = wired();
  p.wired.encoders = 0;
  SimulatedSensors sensors(world(false), p, {}, 1);
  EXPECT_FALSE(sensors.door().left_edges);
  std::vector<sim::Measurement> arrived;
  sensors.take_unwired(kStart + kSecond, arrived);
  std::size_t wheels = 0, wired_ones = 0;
  for (const sim::Measurement& one : arrived) {
    wheels += std::holds_alternative<sensor::WheelCounts>(one.value) ? 1 : 0;
    wired_ones +=
        std::holds_alternative<sensor::ImuSample>(one.value) || std::holds_alternative<sensor::GnssPosition>(one.value)
            ? 1
            : 0;
    EXPECT_LE(one.arrival.us, 2'000'000);
  }
  EXPECT_NEAR(static_cast<double>(wheels), 100, 2);
  EXPECT_EQ(wired_ones, 0U);
}

}  // namespace
}  // namespace tetap::board
