// SPDX-License-Identifier: Apache-2.0
// An IMU that is wrong below every gate: other devices contradict it for seconds. The estimate stays within its own
// uncertainty, and a word comes. A sound IMU that is driven hard brings none.
#include "inertial_drive.hpp"

namespace tetap::estimators {
namespace {

struct Seen {
  double tilt_s = 0, tilt_ratio = 0;  ///< time beyond 1.5 times 3 sigma, and worst error in 3 sigma
  bool word = false;                  ///< the IMU was contradicted, or a source refused
};

/// Runs the drive and judges attitude and velocity against the estimator's own uncertainty. The robot stays level.
void watch(Drive& d, double for_s, Seen& seen) {
  for (int i = 0; i < std::lround(100 * for_s); ++i) {
    d.run(0.01);
    const InertialEstimate now = d.estimator.inertial(d.ctx());
    const auto p = [&now](int k) { return 3 * std::sqrt(static_cast<double>(now.p(k, k))); };
    const nav::Vector3 up_b = now.state.q_nb.z_seen();
    const double tilt = std::hypot(static_cast<double>(up_b(0)), static_cast<double>(up_b(1)));
    const double tilt_ratio = tilt / std::hypot(p(6), p(7));
    seen.tilt_ratio = std::max(seen.tilt_ratio, tilt_ratio);
    seen.tilt_s += tilt_ratio > 1.5 ? 0.01 : 0;
    for (const auto of :
         {sensor::Sensor::kImu, sensor::Sensor::kGnssVelocity, sensor::Sensor::kWheelSpeed, sensor::Sensor::kBodySpeed})
      seen.word = seen.word || d.estimator.sources(d.ctx()).of(of).state >= SourceState::kRejecting;
  }
}

/// A fault of `off` per second on an axis of the IMU (gyroscope 0 to 2, accelerometer 3 to 5), for a while.
Seen with_fault(std::size_t axis, float off, double for_s, double speed_mps, bool velocity) {
  Drive d = settled(rover_like());
  d.white_m = 0.3;
  d.gnss_velocity = velocity;
  d.speed_mps = speed_mps;
  d.turn_radps = speed_mps > 0 ? d.turn_radps : 0;
  d.run(20);
  d.tamper_imu = [axis, off](sensor::ImuSample& s) {
    (axis < 3 ? s.dangle_b_rad[axis] : s.dvelocity_b_mps[axis - 3]) += 0.01F * off;
  };
  Seen seen;
  watch(d, for_s, seen);
  d.tamper_imu = [](sensor::ImuSample&) {};
  watch(d, 10, seen);
  return seen;
}

TEST(ImuDrift, ATiltByTheGyroscopeIsNoticedAndTheTiltStaysHonest) {
  for (const double speed : {0.0, 1.0, 3.0})
    for (const std::size_t axis : {0U, 1U})
      for (const float off : {0.02F, -0.05F}) {
        const Seen seen = with_fault(axis, off, 3, speed, true);
        EXPECT_LT(seen.tilt_s, 2.6) << axis << ' ' << off << " at " << speed << ": " << seen.tilt_ratio;
        EXPECT_TRUE(seen.word || seen.tilt_ratio < 1) << axis << ' ' << off << " at " << speed;
      }
}

TEST(ImuDrift, AnAccelerationThatIsNotThereIsNoticed) {
  for (const double speed : {0.0, 1.0})
    for (const std::size_t axis : {3U, 4U})
      for (const float off : {0.2F, -0.3F}) {
        const Seen seen = with_fault(axis, off, 5, speed, true);
        EXPECT_LT(seen.tilt_s, 2.6) << axis << ' ' << off << " at " << speed << ": " << seen.tilt_ratio;
        EXPECT_TRUE(seen.word || seen.tilt_ratio < 1) << axis << ' ' << off << " at " << speed;
      }
}

TEST(ImuDrift, NothingIsSaidOfASoundImuThatIsDrivenHard) {
  for (const unsigned seed : {1U, 3U, 4U}) {
    Drive d = settled(rover_like(), seed);
    d.white_m = 0.3;
    Seen seen;
    for (const double speed : {1.0, 4.0, 0.0, 2.0, -1.0}) {
      for (const double turn : {0.0, 0.6, -0.4}) {
        d.turn_radps = turn;
        for (int k = 0; k < 200; ++k) {  // 2 s from one speed to the next
          d.speed_mps += (speed - d.speed_mps) / (200 - k);
          watch(d, 0.01, seen);
        }
        watch(d, 5, seen);
      }
    }
    EXPECT_FALSE(seen.word) << seed;
    EXPECT_LT(seen.tilt_ratio, 1.5) << seed;
  }
}

}  // namespace
}  // namespace tetap::estimators
