// SPDX-License-Identifier: Apache-2.0
// Inertial navigation without wheel speeds: that there are wheels is all that is known (the non-holonomic constraint).
// A robot drives level curves; its accelerometer errs sideways.
#include "tetap/estimators/inertial/inertial.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>

namespace tetap::estimators {
namespace {

constexpr std::int64_t kSample_us = 10'000;
constexpr float kStep_s = 0.01F;

class Drive {
 public:
  explicit Drive(std::int32_t constrain_every_us, std::int64_t wheels_every_us = 0) {
    n.inertial.lateral_mps = n.inertial.vertical_mps = 0.1F;
    n.inertial.stuck_samples = 0;  // an IMU without noise repeats itself
    map_frame.frame = nav::LocalFrame(24'131'350'000, 5'834'150'000, 500.0F);
    map_frame.origin = sensor::OriginSource::kConfigured;
    gravity_mps2_ = nav::Earth::at(map_frame.frame, false).gravity_mps2;
    estimator.restart({us}, ctx());
    estimator.set_pose({us}, {.pose = {.yaw_rad = 0}, .sigma_position_m = 0.1F, .sigma_yaw_rad = 0.02F}, ctx());
    run(1.5F, 0, 0, wheels_every_us);  // levels at rest, from an accelerometer without error
    n.inertial.constrain_every_us = constrain_every_us;
  }
  void run(float duration_s, float acceleration_mps2, float turn_radps, std::int64_t wheels_every_us = 0) {
    for (int i = 0; i < static_cast<int>(std::lround(duration_s / kStep_s)); ++i) {
      us += kSample_us;
      speed_mps += acceleration_mps2 * kStep_s;
      const float sideways = speed_mps * turn_radps + sideways_error_mps2;
      static_cast<void>(estimator.fuse(
          sensor::ImuSample{
              .dangle_b_rad = {0, 0, turn_radps * kStep_s},
              .dvelocity_b_mps = {acceleration_mps2 * kStep_s, sideways * kStep_s, gravity_mps2_ * kStep_s},
              .interval_us = kSample_us},
          {us}, ctx()));
      if (wheels_every_us > 0 && us % wheels_every_us == 0)
        static_cast<void>(
            estimator.fuse(sensor::WheelSpeeds{.left_mps = speed_mps, .right_mps = speed_mps}, {us}, ctx()));
    }
    estimator.advance({us}, ctx(), {});
  }
  [[nodiscard]] Context ctx() const { return {n, map_frame}; }
  [[nodiscard]] nav::Vector3 velocity_b_mps() const {
    const InertialEstimate now = estimator.inertial(ctx());
    EXPECT_TRUE(now.valid);
    return now.state.q_nb.conjugate().rotate(now.state.v_n_mps);
  }

  param::Parameters n;
  MapFrame map_frame;
  Inertial estimator;
  std::int64_t us = 1'000'000;
  float speed_mps = 0, sideways_error_mps2 = 0;

 private:
  float gravity_mps2_ = 0;
};

TEST(NonHolonomicConstraint, HoldsSidewaysSpeedWhereTheAccelerometerAloneRunsAway) {
  for (const std::int32_t every_us : {0, 100'000}) {
    Drive drive(every_us);
    drive.run(5, 1, 0);
    drive.sideways_error_mps2 = 0.05F;
    drive.run(30, 0, 0);
    const float sideways_mps = std::fabs(drive.velocity_b_mps()(1));
    if (every_us == 0) {
      EXPECT_GT(sideways_mps, 1.0F);
    } else {
      EXPECT_LT(sideways_mps, 0.1F);
    }
  }
}

TEST(NonHolonomicConstraint, SaysNothingOfTheForwardSpeed) {
  Drive ctx(100'000), without(0);
  for (Drive* drive : {&ctx, &without}) drive->run(10, 0, 0);
  const auto variance = [](const Drive& drive) { return drive.estimator.inertial(drive.ctx()).p(3, 3); };  // yaw is 0
  EXPECT_NEAR(variance(ctx), variance(without), 0.1F * variance(without));
  EXPECT_LT(ctx.estimator.inertial(ctx.ctx()).p(4, 4), 0.1F * without.estimator.inertial(without.ctx()).p(4, 4));
}

TEST(NonHolonomicConstraint, IsNotSaidTwiceWhereWheelSpeedsCome) {
  Drive constrained(200'000, 100'000), plain(0, 100'000);
  for (Drive* drive : {&constrained, &plain}) {
    drive->run(5, 1, 0.1F, 100'000);
    drive->run(5, 0, -0.2F, 100'000);
  }
  const auto a = constrained.estimator.inertial(constrained.ctx()), b = plain.estimator.inertial(plain.ctx());
  for (int i = 0; i < nav::Ins::kErrors; ++i) EXPECT_EQ(a.p(i, i), b.p(i, i)) << i;
  EXPECT_EQ(a.state.x.um(), b.state.x.um());
  EXPECT_EQ(a.state.y.um(), b.state.y.um());
}

}  // namespace
}  // namespace tetap::estimators
