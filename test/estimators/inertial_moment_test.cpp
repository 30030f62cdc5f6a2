// SPDX-License-Identifier: Apache-2.0
// Every measurement is true at its own microsecond: between two IMU samples, too. The body moves on a plane, speeds up
// and turns. Its sensors are exact but for what keeps an IMU from looking stuck. Each measurement comes 9 ms after an
// IMU sample.
#include "tetap/estimators/inertial/inertial.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tetap::estimators {
namespace {

class Body {
 public:
  Body(double accel_mps2, double turn_radps, double begin_yaw_rad = 0, double climb_mps2 = 0)
      : accel_(accel_mps2), turn_(turn_radps), begin_yaw_rad_(begin_yaw_rad), climb_(climb_mps2) {
    n_.gnss.sigma_floor_m = 0.02F;
    n_.baro = {.use = 1, .sigma_m = 0.01F, .drift_m_rts = 1e-3F, .scale_share = 0};
    n_.inertial.gyro_radps_rthz = 1e-3F;
    n_.inertial.accel_mps2_rthz = 2e-2F;
    n_.inertial.axle_x_b_m = 0;
    map_frame_.frame = nav::LocalFrame(24'131'350'000, 5'834'150'000, 500.0F);
    map_frame_.origin = sensor::OriginSource::kConfigured;
    gravity_mps2_ = nav::Earth::at(map_frame_.frame, false).gravity_mps2;
    estimator.restart({us_}, ctx());
    estimator.set_pose(
        {us_},
        {.pose = {.yaw_rad = static_cast<float>(begin_yaw_rad)}, .sigma_position_m = 0.1F, .sigma_yaw_rad = 0.02F},
        ctx());
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
    estimator.advance({us_}, ctx(), {});
  }
  [[nodiscard]] double speed(std::int64_t at_us) const { return accel_ * driven_s(at_us); }
  [[nodiscard]] double yaw(std::int64_t at_us) const { return begin_yaw_rad_ + turn_ * driven_s(at_us); }
  /// Place of a body that only drives straight on.
  [[nodiscard]] nav::Local place(std::int64_t at_us) const {
    const double half_um_per_mps2 = 0.5e6 * driven_s(at_us) * driven_s(at_us);
    return {.east_um = std::llround(accel_ * std::cos(begin_yaw_rad_) * half_um_per_mps2),
            .north_um = std::llround(accel_ * std::sin(begin_yaw_rad_) * half_um_per_mps2),
            .up_um = std::llround(climb_ * half_um_per_mps2),
            .valid = true};
  }
  [[nodiscard]] double speed_error_mps() const {
    return static_cast<double>(estimator.estimate(ctx()).forward_mps) - speed(us_);
  }
  [[nodiscard]] std::array<float, 2> place_error_m() const {
    const auto pose = estimator.estimate(ctx()).pose;
    const nav::Local true_place = place(us_);
    return {nav::difference(pose.x, base::Anchored::from_um(true_place.east_um)),
            nav::difference(pose.y, base::Anchored::from_um(true_place.north_um))};
  }
  [[nodiscard]] float height_error_m() const {
    return nav::difference(estimator.inertial(ctx()).state.z, base::Anchored::from_um(place(us_).up_um));
  }
  [[nodiscard]] double yaw_error_rad() const {
    return std::remainder(static_cast<double>(estimator.estimate(ctx()).pose.yaw_rad) - yaw(us_), 2 * 3.14159265358979);
  }
  [[nodiscard]] Context ctx() const { return {n_, map_frame_}; }

 private:
  static constexpr std::int64_t kStep_us = 10'000, kBegin_us = 1'000'000;

  [[nodiscard]] double driven_s(std::int64_t at_us) const {
    return still_ ? 0.0 : 1e-6 * static_cast<double>(at_us - begun_us_);
  }
  void step() {
    us_ += kStep_us;
    odd_ = !odd_;
    const double dt = 1e-6 * kStep_us, turn = still_ ? 0 : turn_;
    const float alive = odd_ ? 1e-5F : -1e-5F;
    estimator.fuse(
        sensor::ImuSample{
            .dangle_b_rad = {alive, -alive, static_cast<float>(turn * dt) + alive},
            .dvelocity_b_mps = {static_cast<float>(still_ ? 0 : accel_ * dt) + alive,
                                static_cast<float>(turn * speed(us_ - kStep_us / 2) * dt) - alive,
                                (gravity_mps2_ + static_cast<float>(still_ ? 0 : climb_)) * static_cast<float>(dt) +
                                    alive},
            .interval_us = kStep_us},
        {us_}, ctx());
    estimator.advance({us_}, ctx(), {});
  }

  double accel_, turn_, begin_yaw_rad_, climb_;
  param::Parameters n_;
  MapFrame map_frame_;
  float gravity_mps2_ = 0;
  std::int64_t us_ = kBegin_us, begun_us_ = 0;
  bool still_ = true, odd_ = false;
};

float single(double x) { return static_cast<float>(x); }

// 16 m/s for 9 ms are 14 cm, 8 m/s upwards 7 cm.
TEST(OwnMicrosecond, OfAFix) {
  Body body(2.0, 0.0, 0.9, 1.0);
  body.run(8, [&](base::Micros at) {
    const auto coordinates = body.ctx().map_frame.frame.to_geodetic(body.place(at.us));
    ASSERT_TRUE(coordinates);
    static_cast<void>(body.estimator.fuse(sensor::GnssPosition{.latitude_2ndeg = coordinates->latitude_2ndeg,
                                                               .longitude_2ndeg = coordinates->longitude_2ndeg,
                                                               .height_m = single(coordinates->height_m),
                                                               .horizontal_acc_m = 0.02F,
                                                               .vertical_acc_m = 0.02F,
                                                               .fix = sensor::GnssFix::k3d},
                                          at, body.ctx()));
  });
  const auto [east_m, north_m] = body.place_error_m();
  EXPECT_NEAR(east_m, 0.0F, 0.01F);
  EXPECT_NEAR(north_m, 0.0F, 0.01F);
  EXPECT_NEAR(body.height_error_m(), 0.0F, 0.01F);
}

// Model: U.S. Standard Atmosphere 1976.
TEST(OwnMicrosecond, OfAPressure) {
  Body body(0.0, 0.0, 0.0, 1.0);
  body.run(8, [&](base::Micros at) {
    const double height_m = 1e-6 * static_cast<double>(body.place(at.us).up_um);
    const double pressure_Pa = 101325 * std::pow(1 - height_m / 44330.77, 1 / 0.1902632);
    static_cast<void>(body.estimator.fuse(sensor::AirPressure{.pressure_Pa = single(pressure_Pa)}, at, body.ctx()));
  });
  EXPECT_NEAR(body.height_error_m(), 0.0F, 0.02F);
}

// 2 m/s^2 for 9 ms are 18 mm/s.
TEST(OwnMicrosecond, OfAGnssVelocity) {
  Body body(2.0, 0.0);
  body.run(8, [&](base::Micros at) {
    const auto mps = single(body.speed(at.us));
    static_cast<void>(
        body.estimator.fuse(sensor::GnssVelocity{.v_n_mps = {mps, 0, 0}, .acc_mps = 0.02F}, at, body.ctx()));
  });
  EXPECT_NEAR(body.speed_error_mps(), 0.0, 0.002);
  EXPECT_NEAR(body.estimator.inertial(body.ctx()).state.v_n_mps(2), 0.0F, 0.002F) << "it does not fall meanwhile";
}

TEST(OwnMicrosecond, OfASpeedometer) {
  Body body(2.0, 0.0);
  body.run(8, [&](base::Micros at) {
    static_cast<void>(body.estimator.fuse(sensor::BodySpeed{.forward_mps = single(body.speed(at.us))}, at, body.ctx()));
  });
  EXPECT_NEAR(body.speed_error_mps(), 0.0, 0.002);
}

// 1 rad/s for 9 ms are 9 mrad.
TEST(OwnMicrosecond, OfAHeading) {
  Body body(0.0, 1.0);
  body.run(20, [&](base::Micros at) {
    static_cast<void>(body.estimator.fuse(
        sensor::OutsideHeading{.yaw_rad = single(std::remainder(body.yaw(at.us), 2 * 3.14159265358979)),
                               .acc_rad = 0.005F},
        at, body.ctx()));
  });
  EXPECT_NEAR(body.yaw_error_rad(), 0.0, 0.001);
}

}  // namespace
}  // namespace tetap::estimators
