// SPDX-License-Identifier: Apache-2.0
// Faults of the IMU that leave the rest of the robot whole: a wild sample, a dead axis, no interval. The other devices
// hold the estimate, on whatever axis and of whatever size.
#include "inertial_drive.hpp"

#include <vector>

namespace tetap::estimators {
namespace {

float& axis_of(sensor::ImuSample& s, std::size_t axis) {
  return axis < 3 ? s.dangle_b_rad[axis] : s.dvelocity_b_mps[axis - 3];
}

/// A drive in which the IMU is `spoilt` at `begin_s`, for `for_s`.
Drive spoilt(double begin_s, double for_s, const std::function<void(sensor::ImuSample&)>& how) {
  Drive d = settled(rover_like());
  const double from_s = d.time_s() + begin_s;
  d.white_m = 0.3;
  d.tamper_imu = [&d, from_s, for_s, how](sensor::ImuSample& s) {
    if (d.time_s() > from_s && d.time_s() < from_s + for_s + 1e-4) how(s);
  };
  d.run(begin_s + for_s + 15);
  d.tamper_imu = [](sensor::ImuSample&) {};
  return d;
}

TEST(InertialImuFault, SamplesBeyondTheRangeOfTheSensorAreNotUsed) {
  for (std::size_t axis = 0; axis < 6; ++axis)
    for (const float times : {1.1F, -1.5F, 2.5F}) {
      const float most = axis < 3 ? 35.0F : 160.0F;
      const Drive d = spoilt(5, 0.02, [&](sensor::ImuSample& s) { axis_of(s, axis) = 0.01F * times * most; });
      EXPECT_LT(d.worst_sigmas, 4.5) << axis << ' ' << times;
      EXPECT_LT(d.worst_m, 1.0) << axis << ' ' << times;
      EXPECT_LT(d.yaw_error_rad(), 0.05) << axis << ' ' << times;
    }
}

TEST(InertialImuFault, SamplesWithinTheRangeThatLeapAreDoubted) {
  for (std::size_t axis = 0; axis < 6; ++axis)
    for (const float size : {0.25F, -0.5F, 0.95F}) {
      const float most = axis < 3 ? 35.0F : 160.0F;
      const Drive d = spoilt(7, 0.02, [&](sensor::ImuSample& s) { axis_of(s, axis) += 0.01F * size * most; });
      EXPECT_LT(d.worst_sigmas, 4.5) << axis << ' ' << size;
      EXPECT_LT(d.worst_m, 3.0) << axis << ' ' << size;
    }
}

TEST(InertialImuFault, ASampleThatLeapsIsSaidForASecond) {
  for (const std::size_t axis : {std::size_t{0}, std::size_t{5}}) {
    Drive d = settled(rover_like());
    d.run(1);
    const auto said = [&d] {
      return (d.estimator.faults() >> static_cast<unsigned>(sensor::Fault::kVibration) & 1U) != 0;
    };
    EXPECT_FALSE(said()) << axis;
    const double from_s = d.time_s();
    d.tamper_imu = [&](sensor::ImuSample& s) {
      if (d.time_s() > from_s + 0.1 && d.time_s() < from_s + 0.115) axis_of(s, axis) += axis < 3 ? 0.05F : 0.6F;
    };
    d.run(0.9);
    EXPECT_TRUE(said()) << axis;
    d.run(1.2);
    EXPECT_FALSE(said()) << axis;
  }
}

TEST(InertialImuFault, ADeadAxisIsALostImuAndWheelsCarryOn) {
  for (std::size_t axis = 0; axis < 6; ++axis) {
    Drive d = settled(rover_like());
    d.white_m = 0.3;
    d.tamper_imu = [&](sensor::ImuSample& s) { axis_of(s, axis) = 0.0F; };
    d.turn_radps = 0.3;
    d.run(1);
    EXPECT_EQ(d.last_imu.failed, Check::kStuck) << axis;
    EXPECT_TRUE((d.estimator.faults() >> static_cast<unsigned>(sensor::Fault::kSensorStuck) & 1U) != 0) << axis;
    d.run(30);
    EXPECT_LT(d.worst_sigmas, 4.5) << axis;
    EXPECT_LT(d.yaw_error_rad(), 0.35) << axis;
    d.tamper_imu = [](sensor::ImuSample&) {};
    d.run(30);
    EXPECT_EQ(d.last_imu.verdict, sensor::Verdict::kAccepted) << axis;
    EXPECT_LT(d.yaw_error_rad(), 0.1) << axis;
  }
}

/// The accelerometer's sign, of all axes and of the one along up: the IMU is named, and no wheels are.
TEST(InertialImuFault, AReversedAccelerometerIsNamed) {
  for (const bool all : {true, false}) {
    Drive d(rover_like());
    d.white_m = 0.3;
    d.tamper_imu = [all](sensor::ImuSample& s) {
      for (std::size_t axis = all ? 3 : 5; axis < 6; ++axis) axis_of(s, axis) *= -1.0F;
    };
    d.place();
    int named = 0, wheels = 0;
    for (int k = 0; k < 600; ++k) {
      d.run(0.1);
      const SourceState imu = d.estimator.sources(d.ctx()).of(sensor::Sensor::kImu).state;
      named += imu == SourceState::kDistrusted ? 1 : 0;
      wheels += static_cast<int>(d.estimator.faults() >> static_cast<unsigned>(sensor::Fault::kWheelSlip) & 1U);
    }
    EXPECT_GT(named, 570) << all;
    EXPECT_LT(wheels, 30) << all;
  }
}

/// Upside down in a flip the force is still the rotors'.
TEST(InertialImuFault, AFlipIsNoReversedAccelerometer) {
  Drive d = settled(rover_like());
  d.wheels = false;
  constexpr float kHalfTurn_rad = 3.1415927F;
  d.tamper_imu = [](sensor::ImuSample& s) { s.dangle_b_rad[0] += 0.02F * kHalfTurn_rad; };
  bool over = false;
  for (int k = 0; k < 100; ++k) {
    d.run(0.01);
    over = over || d.estimator.inertial(d.ctx()).state.q_nb.z_seen()(2) < -0.9F;
    EXPECT_NE(d.estimator.sources(d.ctx()).of(sensor::Sensor::kImu).failed, Check::kValue) << k;
  }
  EXPECT_TRUE(over);
}

TEST(InertialImuFault, AnIntervalOfNothingIsNamed) {
  Drive d = settled();
  d.tamper_imu = [](sensor::ImuSample& s) { s.interval_us = 0; };
  d.run(0.05);
  EXPECT_EQ(d.last_imu.verdict, sensor::Verdict::kNotFinite);
  EXPECT_EQ(d.last_imu.failed, Check::kTime);
  d.tamper_imu = [](sensor::ImuSample& s) { s.dangle_b_rad[0] = std::nanf(""); };
  d.run(0.05);
  EXPECT_EQ(d.last_imu.failed, Check::kValue);
}

}  // namespace
}  // namespace tetap::estimators
