// SPDX-License-Identifier: Apache-2.0
// An IMU at the end of its range shows less motion than there is. The estimate is as uncertain as what it lacks.
#include "inertial_drive.hpp"

namespace tetap::estimators {
namespace {

/// Errors of velocity and heading in 3 sigma, the worst of a span.
struct Worst {
  double velocity = 0, heading = 0;
};

Worst watch(Drive& d, double for_s) {
  Worst worst;
  for (int i = 0; i < std::lround(100 * for_s); ++i) {
    d.run(0.01);
    const InertialEstimate now = d.estimator.inertial(d.ctx());
    const double east = d.speed_mps * std::cos(d.yaw_rad), north = d.speed_mps * std::sin(d.yaw_rad);
    const double off =
        std::hypot(static_cast<double>(now.state.v_n_mps(0)) - east, static_cast<double>(now.state.v_n_mps(1)) - north);
    worst.velocity = std::max(worst.velocity, off / three_sigma(now, {3, 4}));
    worst.heading = std::max(worst.heading, d.yaw_error_rad() / three_sigma(now, {8}));
  }
  return worst;
}

/// A robot that runs into a wall loses its speed in 10 ms, and the accelerometer shows its range.
TEST(ImuClipping, ACollisionLeavesTheVelocityAsUncertainAsWhatItLacks) {
  for (const double range_mps2 : {80.0, 157.0})
    for (const double speed_mps : {2.0, 3.0, 4.0}) {
      SCOPED_TRACE(testing::Message() << range_mps2 << " m/s2, " << speed_mps << " m/s");
      Drive d = settled(rover_like());
      d.wheels = false;
      d.speed_mps = speed_mps;
      d.turn_radps = 0;
      d.run(20);
      d.tamper_imu = [range_mps2](sensor::ImuSample& s) {
        const auto most = static_cast<float>(0.01 * range_mps2);
        if (!(s.dvelocity_b_mps[0] < -most)) return;
        s.dvelocity_b_mps[0] = -most;
        s.clipped_accel = 10;
      };
      d.speed_mps = 0;
      EXPECT_LT(watch(d, 3).velocity, 1.0);
    }
}

/// A robot that is hit turns faster than its gyroscope shows.
TEST(ImuClipping, ATurnBeyondTheRangeLeavesTheHeadingAsUncertainAsWhatItLacks) {
  for (const double range_radps : {4.36, 8.73})
    for (const double beyond : {1.2, 1.5, 1.7})
      for (const double for_s : {0.1, 0.3}) {
        SCOPED_TRACE(testing::Message() << range_radps << " rad/s times " << beyond << " for " << for_s << " s");
        Drive d = settled(rover_like());
        d.wheels = false;
        d.turn_radps = 0;
        d.run(20);
        d.tamper_imu = [range_radps](sensor::ImuSample& s) {
          const auto most = static_cast<float>(0.01 * range_radps);
          if (!(s.dangle_b_rad[2] > most)) return;
          s.dangle_b_rad[2] = most;
          s.clipped_gyro = 10;
        };
        d.turn_radps = beyond * range_radps;
        EXPECT_LT(watch(d, for_s).heading, 1.0);
        d.turn_radps = 0;
        EXPECT_LT(watch(d, 1).heading, 1.0);
      }
}

}  // namespace
}  // namespace tetap::estimators
