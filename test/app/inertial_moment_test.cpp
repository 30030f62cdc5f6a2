// SPDX-License-Identifier: Apache-2.0
// Every measurement is true at its own microsecond: between two IMU samples, too. A body on a plane that speeds up and
// turns, exact sensors but for what keeps an IMU from looking stuck; each measurement 9 ms after an IMU sample.
#include "app/estimators/inertial.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace tetap::app {
namespace {

class Body {
 public:
  Body(double accel_mps2, double turn_radps) : accel_(accel_mps2), turn_(turn_radps) {
    n_.inertial.gyro_radps_rthz = 1e-3F;
    n_.inertial.accel_mps2_rthz = 2e-2F;
    n_.inertial.axle_x_b_m = 0;
    site_.frame = nav::LocalFrame(24'131'350'000, 5'834'150'000, 500.0F);
    site_.origin = can::OriginSource::kConfigured;
    gravity_mps2_ = nav::Earth::at(site_.frame, false).gravity_mps2;
    estimator.restart({us_}, with());
    estimator.set_pose({us_}, {.pose = {}, .sigma_position_m = 0.1F, .sigma_yaw_rad = 0.02F}, with());
    still_ = true;
    while (us_ < kBegin_us + 3'000'000) step();
    still_ = false;
    begun_us_ = us_;
  }
  Inertial estimator;

  /// measure(stamp) 9 ms after every tenth IMU sample.
  template <class Measure>
  void run(double duration_s, Measure&& measure) {
    const std::int64_t end = us_ + std::llround(duration_s * 1e6);
    for (int k = 0; us_ < end; ++k) {
      step();
      if (k % 10 == 0) measure(base::Micros{us_ + 9'000});
    }
    estimator.advance({us_}, with(), std::vector<Sample>{});
  }
  [[nodiscard]] double speed(std::int64_t at_us) const {
    return still_ ? 0.0 : accel_ * 1e-6 * static_cast<double>(at_us - begun_us_);
  }
  [[nodiscard]] double yaw(std::int64_t at_us) const {
    return still_ ? 0.0 : turn_ * 1e-6 * static_cast<double>(at_us - begun_us_);
  }
  [[nodiscard]] double speed_error_mps() const {
    return static_cast<double>(estimator.estimate(with()).forward_mps) - speed(us_);
  }
  [[nodiscard]] double yaw_error_rad() const {
    return std::remainder(static_cast<double>(estimator.estimate(with()).pose.yaw_rad) - yaw(us_),
                          2 * 3.14159265358979);
  }
  [[nodiscard]] Context with() const { return {n_, site_}; }

 private:
  static constexpr std::int64_t kStep_us = 10'000, kBegin_us = 1'000'000;

  void step() {
    us_ += kStep_us;
    odd_ = !odd_;
    const double dt = 1e-6 * kStep_us, turn = still_ ? 0 : turn_;
    const float alive = odd_ ? 1e-5F : -1e-5F;
    estimator.fuse(ImuSample{.dangle_b_rad = {alive, -alive, static_cast<float>(turn * dt) + alive},
                             .dvelocity_b_mps = {static_cast<float>(still_ ? 0 : accel_ * dt) + alive,
                                                 static_cast<float>(turn * speed(us_ - kStep_us / 2) * dt) - alive,
                                                 gravity_mps2_ * static_cast<float>(dt) + alive},
                             .interval_us = kStep_us},
                   {us_}, with());
    estimator.advance({us_}, with(), std::vector<Sample>{});
  }

  double accel_, turn_;
  Numbers n_;
  Site site_;
  float gravity_mps2_ = 0;
  std::int64_t us_ = kBegin_us, begun_us_ = 0;
  bool still_ = true, odd_ = false;
};

float single(double x) { return static_cast<float>(x); }

// 2 m/s^2 for 9 ms are 18 mm/s.
TEST(OwnMicrosecond, OfAGnssVelocity) {
  Body body(2.0, 0.0);
  body.run(8, [&](base::Micros at) {
    const auto mps = single(body.speed(at.us));
    static_cast<void>(body.estimator.fuse(GnssVelocity{.v_n_mps = {mps, 0, 0}, .acc_mps = 0.02F}, at, body.with()));
  });
  EXPECT_NEAR(body.speed_error_mps(), 0.0, 0.002);
  EXPECT_NEAR(body.estimator.inertial(body.with()).state.v_n_mps(2), 0.0F, 0.002F) << "it does not fall meanwhile";
}

TEST(OwnMicrosecond, OfASpeedometer) {
  Body body(2.0, 0.0);
  body.run(8, [&](base::Micros at) {
    static_cast<void>(body.estimator.fuse(BodySpeed{.forward_mps = single(body.speed(at.us))}, at, body.with()));
  });
  EXPECT_NEAR(body.speed_error_mps(), 0.0, 0.002);
}

// 1 rad/s for 9 ms are 9 mrad.
TEST(OwnMicrosecond, OfAHeading) {
  Body body(0.0, 1.0);
  body.run(20, [&](base::Micros at) {
    static_cast<void>(body.estimator.fuse(
        OutsideHeading{.yaw_rad = single(std::remainder(body.yaw(at.us), 2 * 3.14159265358979)), .acc_rad = 0.005F}, at,
        body.with()));
  });
  EXPECT_NEAR(body.yaw_error_rad(), 0.0, 0.001);
}

}  // namespace
}  // namespace tetap::app
