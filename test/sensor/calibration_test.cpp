// SPDX-License-Identifier: Apache-2.0
// A sensor's known errors are taken out of its samples. The judge is Eigen in double, which makes the raw samples from
// the truth; the second test goes through a whole node.
#include "tetap/sensor/calibration.hpp"

#include "node/bench.hpp"
#include "tetap/checks/imu_health.hpp"

#include <gtest/gtest.h>
#include <Eigen/LU>

#include <bit>
#include <random>

namespace tetap::sensor {
namespace {

constexpr param::ImuParameters kImu{.accel_bias_mps2 = {0.12F, -0.08F, 0.2F},
                                    .accel_matrix = {1.02F, 0.01F, -0.02F, 0, 0.97F, 0.015F, 0, 0, 1.01F},
                                    .gyro_bias_radps = {0.01F, -0.02F, 0.005F},
                                    .gyro_bias_slope_radps_per_degC = {1e-4F, -5e-5F, 2e-4F},
                                    .gyro_bias_at_degC = 30};

TEST(Calibrate, TakesOutWhatWasPutIn) {
  std::mt19937 engine{1};
  std::normal_distribution<double> normal;
  Eigen::Matrix3d t;
  for (int i = 0; i < 9; ++i) t(i / 3, i % 3) = static_cast<double>(kImu.accel_matrix[static_cast<std::size_t>(i)]);
  for (int k = 0; k < 1000; ++k) {
    const double dt_s = 0.005;
    const double warmer = 0.25 * static_cast<double>(k % 160 - 80);
    const Eigen::Vector3d f(normal(engine), normal(engine), 9.8 + normal(engine));
    const Eigen::Vector3d w(normal(engine), normal(engine), normal(engine));
    const Eigen::Vector3d raw = t.inverse() * f;
    ImuSample s{.temperature_degC = 30 + static_cast<float>(warmer), .interval_us = 5000};
    for (std::size_t i = 0; i < 3; ++i) {
      const auto at = static_cast<Eigen::Index>(i);
      s.dvelocity_b_mps[i] = static_cast<float>((raw(at) + static_cast<double>(kImu.accel_bias_mps2[i])) * dt_s);
      const double bias = static_cast<double>(kImu.gyro_bias_radps[i]) +
                          static_cast<double>(kImu.gyro_bias_slope_radps_per_degC[i]) * warmer;
      s.dangle_b_rad[i] = static_cast<float>((w(at) + bias) * dt_s);
    }
    calibrate(s, kImu);
    for (std::size_t i = 0; i < 3; ++i) {
      const auto at = static_cast<Eigen::Index>(i);
      EXPECT_NEAR(static_cast<double>(s.dvelocity_b_mps[i]) / dt_s, f(at), 1e-5) << k;
      EXPECT_NEAR(static_cast<double>(s.dangle_b_rad[i]) / dt_s, w(at), 1e-6) << k;
    }
  }
}

TEST(Calibrate, WithoutNumbersChangesNoBit) {
  std::mt19937 engine{2};
  std::normal_distribution<float> normal;
  for (int k = 0; k < 1000; ++k) {
    ImuSample s{.temperature_degC = 40, .interval_us = 10'000};
    for (std::size_t i = 0; i < 3; ++i) s.dvelocity_b_mps[i] = normal(engine), s.dangle_b_rad[i] = normal(engine);
    const ImuSample before = s;
    calibrate(s, {});
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(base::bits(s.dvelocity_b_mps[i]), base::bits(before.dvelocity_b_mps[i]));
      EXPECT_EQ(base::bits(s.dangle_b_rad[i]), base::bits(before.dangle_b_rad[i]));
    }
  }
}

TEST(Calibrate, WithoutATemperatureTheBiasIsTheOneItHoldsAt) {
  for (const float temperature : {base::kNan, base::kInfinity, -base::kInfinity, 1e30F, 30.0F}) {
    ImuSample s{.temperature_degC = temperature, .interval_us = 10'000};
    calibrate(s, kImu);
    EXPECT_FLOAT_EQ(s.dangle_b_rad[1], 2e-4F) << temperature;
  }
}

// The correction differs from sample to sample, by the noise of the thermometer and the jitter of the interval.
TEST(Calibrate, DoesNotMakeAStuckSensorLookAlive) {
  for (const bool gyro : {true, false}) {
    checks::ImuClassifier repeats;
    std::mt19937 engine{3};
    std::normal_distribution<float> normal;
    bool stuck = false;
    for (int k = 0; k < 20; ++k) {
      ImuSample s{.dangle_b_rad = {1e-3F, 2e-3F, 3e-3F},
                  .dvelocity_b_mps = {1e-3F, 2e-3F, 0.05F},
                  .temperature_degC = 44.125F + 0.05F * normal(engine),
                  .interval_us = static_cast<std::uint16_t>(5000 + k % 3)};
      (gyro ? s.dvelocity_b_mps : s.dangle_b_rad)[2] += 2e-5F * normal(engine);
      calibrate(s, kImu);
      stuck = repeats.repeated(s, 10);
    }
    EXPECT_TRUE(stuck) << (gyro ? "gyroscope" : "accelerometer");
  }
}

// One step of the bus is a difference.
TEST(Calibrate, ASensorThatMovesByOneStepIsNotStuck) {
  checks::ImuClassifier repeats;
  for (std::size_t k = 0; k < 50; ++k) {
    ImuSample s{.temperature_degC = 40, .interval_us = 5000};
    s.dangle_b_rad[k % 3] = k % 2 == 0 ? 1e-6F : 0.0F;
    s.dvelocity_b_mps[k % 3] = k % 2 == 0 ? 1e-5F : 0.0F;
    calibrate(s, kImu);
    EXPECT_FALSE(repeats.repeated(s, 2)) << k;
  }
}

TEST(Calibrate, OnlyTheImuInUseIsMeant) {
  param::Parameters n;
  n.imu = kImu;
  n.inertial.imu = 1;
  Sample s;
  s.sensor = sensor::Sensor::kImu;
  s.payload.imu = {.interval_us = 10'000};
  calibrate(s, n);
  EXPECT_FLOAT_EQ(s.payload.imu.dangle_b_rad[0], 0);
  s.instance = 1;
  calibrate(s, n);
  EXPECT_LT(s.payload.imu.dangle_b_rad[0], -5e-5F);
}

TEST(Calibrate, WheelsThatTellTooMuchAndTooLittleGoStraightThroughTheNode) {
  param::Parameters n = test::kNumbers;
  n.start = {.known = 1};
  n.wheels.left_speed_scale = 1 / 1.1F;
  n.wheels.right_speed_scale = 1 / 0.9F;
  test::Bench bench(n);
  test::Frames out;
  for (int k = 0; k < 200; ++k)
    out = bench.epoch({test::in(bus::InWheelSpeed{.stamp_us = test::stamp(bench.now_us + 5000),
                                                  .seq = static_cast<std::uint8_t>(k & 15),
                                                  .left_mps = 1.1F,
                                                  .right_mps = 0.9F})});
  const auto position = test::last<bus::EstPos>(out, 1);
  const auto motion = test::last<bus::EstMotion>(out, 1);
  ASSERT_TRUE(position && motion);
  EXPECT_NEAR(position->x_raw, 2000, 30);
  EXPECT_NEAR(motion->yaw_rad, 0.0F, 2e-3F);
}

TEST(Calibrate, AGyroscopesBiasDoesNotTurnTheNodesHeading) {
  param::Parameters n = test::kNumbers;
  n.start = {.known = 1};
  n.gyro = {.use = 1};
  n.imu.gyro_bias_radps = {0, 0, 0.05F};
  test::Bench bench(n);
  test::Frames out;
  for (int k = 0; k < 300; ++k) {
    const auto seq = static_cast<std::uint8_t>(k & 15);
    const std::int64_t at_us = bench.now_us + 10'000;
    out = bench.epoch(
        {test::in(bus::ImuGyro{.ang_z_rad = 0.05F * 0.01F, .seq = seq}),
         test::in(bus::ImuAccel{.vel_z_mps = 0.0981F, .seq = seq}),
         test::in(bus::ImuTime{.stamp_us = test::stamp(at_us), .interval_us = 10'000, .seq = seq}),
         test::in(bus::InWheelSpeed{.stamp_us = test::stamp(at_us), .seq = seq, .left_mps = 1.0F, .right_mps = 1.0F})});
  }
  const auto position = test::last<bus::EstPos>(out, 1);
  const auto motion = test::last<bus::EstMotion>(out, 1);
  ASSERT_TRUE(position && motion);
  EXPECT_NEAR(position->x_raw, 3000, 50);
  EXPECT_NEAR(motion->yaw_rad, 0.0F, 1e-3F);
}

/// A camera's depth of a landmark, with offset and scale, becomes its range again.
TEST(Calibrate, ADepthBecomesARange) {
  const param::LandmarkParameters n{.depth = 1, .range_offset_m = 0.05F, .range_scale = 0.97F};
  for (const double range_m : {0.4, 1.0, 5.0, 60.0})
    for (double bearing_rad = -1.35; bearing_rad < 1.36; bearing_rad += 0.15) {
      const double stated_m = range_m * std::cos(bearing_rad) / 0.97 + 0.05;
      LandmarkSighting s{.range_m = static_cast<float>(stated_m), .bearing_rad = static_cast<float>(bearing_rad)};
      calibrate(s, n);
      EXPECT_NEAR(s.range_m, range_m, 2e-6 * range_m + 1e-6) << range_m << ' ' << bearing_rad;
      EXPECT_EQ(s.bearing_rad, static_cast<float>(bearing_rad));
    }
}

TEST(Calibrate, ARangeWithoutABearingHasNoDepth) {
  LandmarkSighting s{.range_m = 3, .bearing_rad = base::kNan};
  calibrate(s, param::LandmarkParameters{.depth = 1});
  EXPECT_EQ(s.range_m, 3);
  s = {.range_m = base::kNan, .bearing_rad = 0.3F};
  calibrate(s, param::LandmarkParameters{.depth = 1});
  EXPECT_TRUE(base::is_nan(s.range_m));
  EXPECT_EQ(s.bearing_rad, 0.3F);
}

}  // namespace
}  // namespace tetap::sensor
