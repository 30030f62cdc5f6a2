// SPDX-License-Identifier: Apache-2.0
// An IMU away from the body's origin against one that sits there: two robots on one path, without noise. The path is
// closed forms of attitude and speed, and increments are differences of the IMU's own place and velocity. No formula
// of a swinging arm is in them.
#include "tetap/estimators/attitude.hpp"
#include "tetap/estimators/inertial/inertial.hpp"
#include "tetap/sensor/sample_of.hpp"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace tetap::estimators {
namespace {

using Vector = Eigen::Vector3d;
using Rotation = Eigen::Matrix3d;

constexpr std::int64_t kImu_us = 5'000, kTick_us = 10'000, kWindow_us = 200'000;
constexpr double kRest_s = 3, kGentle_s = 1;

/// Yaw rate up to 2 rad/s with up to 5 rad/s2; it rolls and pitches, and drives along its own x axis.
struct Path {
  [[nodiscard]] static double share(double t) {
    const double s = std::clamp((t - kRest_s) / kGentle_s, 0.0, 1.0);
    return s * s * s * (10 - 15 * s + 6 * s * s);
  }
  [[nodiscard]] static Rotation attitude(double t) {
    const double yaw = -0.8 * share(t) * std::cos(2.5 * t), tilt = 0.1 * share(t);
    return (Eigen::AngleAxisd(yaw, Vector::UnitZ()) * Eigen::AngleAxisd(tilt * std::sin(1.3 * t), Vector::UnitY()) *
            Eigen::AngleAxisd(tilt * std::cos(1.7 * t), Vector::UnitX()))
        .toRotationMatrix();
  }
  [[nodiscard]] static Vector velocity(double t) {
    return share(t) * (1 + 0.3 * std::sin(0.7 * t)) * attitude(t).col(0);
  }
};

float single(double x) { return static_cast<float>(x); }

class Robot {
 public:
  explicit Robot(const Vector& position_b_m) : position_b_m_(position_b_m) {
    n.wheels.drive = {.left_radius_m = 0.1F, .right_radius_m = 0.1F, .track_m = 0.5F, .counts_per_turn = 20'000};
    n.inertial.position_b_m = {single(position_b_m(0)), single(position_b_m(1)), single(position_b_m(2))};
    n.inertial.stuck_samples = 0;  // without noise, every standing IMU is stuck
    map_frame.frame = nav::LocalFrame(24'131'350'000, 5'834'150'000, 500.0F);
    map_frame.origin = sensor::OriginSource::kConfigured;
    gravity_mps2_ = static_cast<double>(nav::Earth::at(map_frame.frame, false).gravity_mps2);
    inertial.restart({us}, ctx());
    attitude.restart({us}, ctx());
    const double yaw = std::atan2(Path::attitude(0)(1, 0), Path::attitude(0)(0, 0));
    inertial.set_pose({us}, {.pose = {.yaw_rad = single(yaw)}, .sigma_position_m = 0.01F, .sigma_yaw_rad = 0.01F},
                      ctx());
  }
  /// Samples come by `lost(step)`: none of the IMU where it says so.
  template <class Lost>
  void run(double duration_s, const Lost& lost) {
    for (const std::int64_t end = us + std::llround(1e6 * duration_s); us < end;) {
      us += kImu_us;
      const double t = 1e-6 * static_cast<double>(us), before = t - 1e-6 * kImu_us;
      const Vector gained = velocity_of_imu(t) - velocity_of_imu(before) + Vector(0, 0, gravity_mps2_ * 1e-6 * kImu_us);
      const Vector dv = Path::attitude(before).transpose() * gained;
      const Eigen::AngleAxisd turn(Rotation(Path::attitude(before).transpose() * Path::attitude(t)));
      const Vector dtheta = turn.angle() * turn.axis();
      constexpr int kParts = 10;
      for (int i = 0; i < kParts; ++i) {
        const double part = (t - before) / kParts, from = before + i * part;
        place_m +=
            part / 6 * (Path::velocity(from) + 4 * Path::velocity(from + part / 2) + Path::velocity(from + part));
      }
      if (!lost(us / kImu_us))
        put(sensor::ImuSample{.dangle_b_rad = {single(dtheta(0)), single(dtheta(1)), single(dtheta(2))},
                              .dvelocity_b_mps = {single(dv(0)), single(dv(1)), single(dv(2))},
                              .interval_us = kImu_us});
      const double speed = Path::velocity(t).norm();
      if (us % 20'000 == 0)
        put(sensor::WheelSpeeds{.left_mps = single(speed - 0.25 * yaw_rate(t)),
                                .right_mps = single(speed + 0.25 * yaw_rate(t))});
      if (us % kTick_us == 0) tick();
    }
  }
  [[nodiscard]] Context ctx() const { return {n, map_frame}; }
  [[nodiscard]] static Vector place(const nav::InsState& x) {
    return 1e-6 * Vector(static_cast<double>(x.x.um()), static_cast<double>(x.y.um()), static_cast<double>(x.z.um()));
  }
  [[nodiscard]] double off_m() const { return (place(inertial.inertial(ctx()).state) - place_m).norm(); }
  [[nodiscard]] double off_mps() const {
    const nav::Vector3& v = inertial.inertial(ctx()).state.v_n_mps;
    return (Vector(static_cast<double>(v(0)), static_cast<double>(v(1)), static_cast<double>(v(2))) -
            Path::velocity(1e-6 * static_cast<double>(us)))
        .norm();
  }
  template <class Quaternion>
  [[nodiscard]] static double degrees(const Quaternion& q, const Quaternion& from) {
    const Eigen::Quaternionf a(q.w, q.x, q.y, q.z), b(from.w, from.x, from.y, from.z);
    return a.cast<double>().angularDistance(b.cast<double>()) * 180 / std::numbers::pi;
  }

  param::Parameters n;
  MapFrame map_frame;
  Inertial inertial;
  Attitude attitude;
  std::int64_t us = 0;
  Vector place_m = Vector::Zero();

 private:
  /// Derivatives by the central difference: right to 1e-8.
  [[nodiscard]] Vector velocity_of_imu(double t) const {
    constexpr double h = 1e-4;
    return Path::velocity(t) + (Path::attitude(t + h) - Path::attitude(t - h)) * position_b_m_ / (2 * h);
  }
  [[nodiscard]] static double yaw_rate(double t) {
    constexpr double h = 1e-4;
    const Rotation turned = Path::attitude(t).transpose() * (Path::attitude(t + h) - Path::attitude(t - h)) / (2 * h);
    return turned(1, 0);
  }
  template <class Payload>
  void put(const Payload& payload) {
    window_.push_back(sensor::sample_of(payload, {us}));
    inertial.arrived(window_.back(), ctx());
    attitude.arrived(window_.back(), ctx());
  }
  void tick() {
    std::size_t gone = 0;
    for (; gone < window_.size() && window_[gone].stamp.us <= us - kWindow_us; ++gone) {
      const sensor::Sample& s = window_[gone];
      if (s.sensor == sensor::Sensor::kImu) {
        inertial.fuse(s.payload.imu, s.stamp, ctx());
        attitude.fuse(s.payload.imu, s.stamp, ctx());
      } else {
        inertial.fuse(s.payload.wheel_speeds, s.stamp, ctx());
      }
    }
    window_.erase(window_.begin(), window_.begin() + static_cast<std::ptrdiff_t>(gone));
    inertial.advance({us}, ctx(), window_);
    attitude.advance({us}, ctx(), window_);
  }

  Vector position_b_m_;
  double gravity_mps2_ = 0;
  std::vector<sensor::Sample> window_;
};

/// The greatest differences of two robots, metres and degrees.
struct Apart {
  double m = 0, degrees = 0, attitude_degrees = 0, off_m = 0, off_mps = 0;
};
template <class Lost>
Apart apart(Robot& here, Robot& there, const Lost& lost) {
  Apart worst;
  for (int i = 0; i < 600; ++i) {
    here.run(0.1, lost);
    there.run(0.1, lost);
    const auto a = here.inertial.inertial(here.ctx()), b = there.inertial.inertial(there.ctx());
    worst.m = std::max(worst.m, (Robot::place(a.state) - Robot::place(b.state)).norm());
    worst.degrees = std::max(worst.degrees, Robot::degrees(b.state.q_nb, a.state.q_nb));
    worst.attitude_degrees = std::max(worst.attitude_degrees, Robot::degrees(there.attitude.attitude(there.ctx()).q_nb,
                                                                             here.attitude.attitude(here.ctx()).q_nb));
    worst.off_m = std::max(worst.off_m, there.off_m());
    worst.off_mps = std::max(worst.off_mps, there.off_mps());
    EXPECT_TRUE(i < 20 || b.valid) << i;
  }
  return worst;
}

TEST(ImuPlace, HalfAMetreOffIsTheRobotWhoseImuSitsAtItsOrigin) {
  const auto none = [](std::int64_t) { return false; };
  for (const Vector& arm : {Vector(0.5, 0, 0), Vector(0, -0.5, 0), Vector(0, 0, 0.5), Vector(-0.3, 0.3, 0.26)}) {
    Robot here(Vector::Zero()), there(arm);
    const Apart worst = apart(here, there, none);
    EXPECT_LT(worst.m, 0.01) << arm;
    EXPECT_LT(worst.degrees, 0.05) << arm;
    EXPECT_LT(worst.attitude_degrees, 0.05) << arm;
    EXPECT_LT(worst.off_m, 0.01) << arm;
    EXPECT_LT(worst.off_mps, 0.02) << arm;
  }
}

// Every twentieth sample is lost, and every ten seconds 50 ms of them: what the arm did meanwhile is no motion.
TEST(ImuPlace, SamplesThatAreLostCostNoMoreThanAtTheOrigin) {
  const auto some = [](std::int64_t step) { return step % 20 == 0 || step % 2'000 < 10; };
  Robot here(Vector::Zero()), there(Vector(-0.3, 0.3, 0.26));
  const Apart worst = apart(here, there, some);
  EXPECT_GT(here.off_m(), 0.3);  // without fixes, either robot is lost by this
  EXPECT_LT(worst.m, 0.2);
  EXPECT_LT(worst.degrees, 0.3);
  EXPECT_LT(worst.off_mps, 0.15);
}

}  // namespace
}  // namespace tetap::estimators
