// SPDX-License-Identifier: Apache-2.0
// Frames of the default robot's node about its inertial filter: modes, faults, jumps and how far the two attitudes are
// apart. Samples in, frames out.
#include "config/rover.hpp"
#include "node/bench.hpp"
#include "tetap/estimators/attitude.hpp"
#include "tetap/estimators/inertial/inertial.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace tetap::test {
namespace {

using sensor::Fault, sensor::Mode, sensor::ResetCause;
using sensor::GnssPosition, sensor::GnssVelocity, sensor::ImuSample, sensor::MagneticFlux, sensor::WheelCounts;

constexpr std::size_t kAttitude = 1, kInertial = 2;

param::Parameters rover() {
  param::Parameters n = robot::rover::parameters;
  n.recovery.persist_us = 5'000'000;
  n.recovery.persist_fixes = 20;
  n.gnss.correlation_s = 0;
  return n;
}

/// Stands for two seconds, then drives east at 1 m/s and turns as it is told.
class Rover {
 public:
  explicit Rover(const param::Parameters& parameters = rover()) : n_(parameters), node_(n_, {}) {
    node_.power_on({now_us_});
  }

  double turn_radps = 0, vibration_mps2 = 0, field_uT = 50, off_east_m = 0;
  bool gnss = true, wheels = true;
  double east_m = 0, north_m = 0, yaw_rad = 0, wish_mps = 0;

  /// All frames of so many seconds.
  Frames run(double seconds) {
    Frames out;
    for (int k = 0; k < std::lround(100 * seconds); ++k) step(out);
    return out;
  }
  void hear(const Frames& frames) {
    for (const auto& frame : frames) node_.on_frame(frame);
  }
  /// Until it drives and knows where it looks.
  Frames drive() {
    Frames out = run(2);
    wish_mps = 1;
    for (const auto& frame : run(18)) out.push_back(frame);
    EXPECT_EQ(last<bus::EstStatus>(out)->mode, sensor::Mode::kNominal);
    return out;
  }

 private:
  template <class Payload>
  void offer(sensor::Sensor sensor, const Payload& payload) {
    sensor::Sample sample;
    sample.stamp = {now_us_ - 5'000};
    sample.sensor = sensor;
    sensor::visit(sample, [&payload]<class T>(const T& there) {
      if constexpr (std::is_same_v<T, Payload>) const_cast<T&>(there) = payload;  // NOLINT: the sample is not const
    });
    node_.sample(sample);
  }
  float noise(double sigma) { return static_cast<float>(sigma * normal_(engine_)); }

  void step(Frames& out) {
    constexpr double dt = 0.01;
    now_us_ += 10'000;
    ++k_;
    yaw_rad += turn_radps * dt;
    const double before_mps = speed_mps_;
    speed_mps_ += std::clamp(wish_mps - speed_mps_, -0.02, 0.02);
    east_m += speed_mps_ * std::cos(yaw_rad) * dt;
    north_m += speed_mps_ * std::sin(yaw_rad) * dt;
    const double pushed = speed_mps_ - before_mps, shaken = (k_ % 2 == 0 ? 1 : -1) * vibration_mps2 * dt;
    offer(
        sensor::Sensor::kImu,
        sensor::ImuSample{.dangle_b_rad = {noise(2e-5), noise(2e-5), static_cast<float>(turn_radps * dt) + noise(2e-5)},
                          .dvelocity_b_mps = {static_cast<float>(pushed + shaken) + noise(5e-4),
                                              static_cast<float>(speed_mps_ * turn_radps * dt) + noise(5e-4),
                                              0.098089F + noise(5e-4)},
                          .interval_us = 10'000});
    if (wheels) {
      const double per_m = 2'000 / (2 * 3.14159265358979 * 0.1);
      left_ += (speed_mps_ - 0.25 * turn_radps) * dt * per_m;
      right_ += (speed_mps_ + 0.25 * turn_radps) * dt * per_m;
      offer(sensor::Sensor::kWheelCounts, sensor::WheelCounts{static_cast<std::uint16_t>(std::llround(left_)),
                                                              static_cast<std::uint16_t>(std::llround(right_))});
    }
    if (n_.magnetic.use != 0) {
      const double north_uT = 0.4 * field_uT;
      offer(sensor::Sensor::kMagnetometer,
            sensor::MagneticFlux{.flux_b_uT = {static_cast<float>(north_uT * std::sin(yaw_rad)) + noise(0.1),
                                               static_cast<float>(north_uT * std::cos(yaw_rad)) + noise(0.1),
                                               static_cast<float>(-0.9 * field_uT) + noise(0.1)}});
    }
    if (gnss && k_ % 20 == 0) {
      const param::GnssParameters& g = n_.gnss;
      constexpr double kMetre_2ndeg = 1 / (2e-9 * 111'200);
      const double cosine = std::cos(2e-9 * static_cast<double>(g.origin_latitude_2ndeg) * 3.14159265358979 / 180);
      const auto raw = [](double value) { return std::llround(value); };
      offer(sensor::Sensor::kGnssPosition,
            sensor::GnssPosition{
                .latitude_2ndeg =
                    g.origin_latitude_2ndeg + raw((north_m + static_cast<double>(noise(0.3))) * kMetre_2ndeg),
                .longitude_2ndeg = g.origin_longitude_2ndeg +
                                   raw((east_m + off_east_m + static_cast<double>(noise(0.3))) * kMetre_2ndeg / cosine),
                .height_m = 520 + noise(0.5),
                .horizontal_acc_m = 0.3F,
                .vertical_acc_m = 0.5F,
                .fix = sensor::GnssFix::k3d});
      offer(sensor::Sensor::kGnssVelocity,
            sensor::GnssVelocity{
                .v_n_mps = {static_cast<float>(speed_mps_ * std::cos(yaw_rad)) + noise(0.05),
                            static_cast<float>(speed_mps_ * std::sin(yaw_rad)) + noise(0.05), noise(0.05)},
                .acc_mps = 0.05F});
    }
    node_.tick({now_us_}, {}, [&out](const base::CanFrame& frame) { out.push_back(frame); });
  }

  param::Parameters n_;
  node::Node<node::Estimators<estimators::Odometry, estimators::Attitude, estimators::Inertial>> node_;
  std::int64_t now_us_ = 5'000'000, k_ = 0;
  double left_ = 0, right_ = 0, speed_mps_ = 0;
  std::mt19937 engine_{7};
  std::normal_distribution<double> normal_;
};

bool reports(const bus::EstStatus& status, sensor::Fault fault) {
  return (status.faults >> static_cast<unsigned>(fault) & 1) != 0;
}
/// Whether any status of these frames has this fault.
bool reported(const Frames& frames, sensor::Fault fault) {
  const auto all_of_them = all<bus::EstStatus>(frames);
  return std::any_of(all_of_them.begin(), all_of_them.end(), [&](const auto& one) { return reports(one, fault); });
}
/// Modes in the order in which they are said.
std::vector<sensor::Mode> modes(const Frames& frames) {
  std::vector<sensor::Mode> found;
  for (const auto& status : all<bus::EstStatus>(frames))
    if (found.empty() || found.back() != status.mode) found.push_back(status.mode);
  return found;
}

/// A command ends the window, which holds more samples than a tick may work on: they are used in a few ticks before it.
TEST(InertialBus, AGivenPoseHoldsAFewTicksAfterTheCommand) {
  Rover rover;
  rover.drive();
  rover.gnss = false;
  const auto mm = [](double m) { return static_cast<int>(std::lround(1000 * m)); };
  const double x_m = rover.east_m, y_m = rover.north_m + 4;
  rover.hear(set_pose(1, mm(x_m), mm(y_m), 0.0F, 0.1F, 0.05F));
  int ticks = 0;
  for (bool moved = false; !moved && ticks < 30; ++ticks)
    moved = 1e-3 * last<bus::EstPos>(rover.run(0.01), kInertial)->y_raw > rover.north_m + 2;
  EXPECT_GE(ticks, 2) << "the whole window in one tick";
  EXPECT_LE(ticks, 10);
  const Frames out = rover.run(1);
  EXPECT_EQ(last<bus::EstStatus>(out)->reset_cause, ResetCause::kSetPose);
  for (const std::size_t instance : {std::size_t{0}, kInertial}) {
    EXPECT_NEAR(1e-3 * last<bus::EstPos>(out, instance)->x_raw, rover.east_m, 0.15) << instance;
    EXPECT_NEAR(1e-3 * last<bus::EstPos>(out, instance)->y_raw, y_m, 0.15) << instance;
  }
  EXPECT_FALSE(reported(out, Fault::kTooLate));
}

TEST(InertialBus, ItSaysWhatItWaitsForAndThenThatItNavigates) {
  Rover rover;
  const Frames out = rover.drive();
  EXPECT_EQ(modes(out), (std::vector{sensor::Mode::kWaitingForImu, sensor::Mode::kLevelling,
                                     sensor::Mode::kFindingHeading, sensor::Mode::kNominal}));
  EXPECT_FALSE(reported(rover.run(5), sensor::Fault::kInputStale));
}

TEST(InertialBus, WhatItDoesNotKnowYetIsNeitherValidNorConfident) {
  Rover rover;
  const Frames out = rover.run(2);
  const auto sigma = last<bus::EstStdPose>(out, kInertial);
  const auto motion = last<bus::EstMotion>(out, kInertial);
  ASSERT_TRUE(sigma && motion);
  EXPECT_FALSE(motion->pos_valid || motion->hdg_valid);
  EXPECT_GT(sigma->std_x_m, 30);  // the most that the frame can say is 32.767
  EXPECT_GT(sigma->std_y_m, 30);
  EXPECT_GT(sigma->std_yaw_rad, 1.8F);
}

TEST(InertialBus, AnOutageIsDeadReckoningUntilFixesComeAgain) {
  Rover rover;
  rover.drive();
  rover.gnss = false;
  EXPECT_EQ(modes(rover.run(10)), (std::vector{sensor::Mode::kNominal, sensor::Mode::kDeadReckoning}));
  rover.gnss = true;
  EXPECT_EQ(modes(rover.run(5)).back(), sensor::Mode::kNominal);
}

TEST(InertialBus, AJumpThatPersistsIsRefusedAndThenTakenWithItsSize) {
  Rover rover;
  const auto before = last<bus::EstStatus>(rover.drive());
  rover.off_east_m = 30;
  const Frames refused = rover.run(4);
  EXPECT_TRUE(reports(*last<bus::EstStatus>(refused), sensor::Fault::kRejecting));
  EXPECT_EQ(last<bus::EstStatus>(refused)->mode, sensor::Mode::kDegraded);
  EXPECT_EQ(last<bus::EstStatus>(refused)->reset_ctr, before->reset_ctr);
  const Frames taken = rover.run(6);
  const auto status = last<bus::EstStatus>(taken);
  EXPECT_EQ(status->reset_ctr, before->reset_ctr + 1);
  EXPECT_EQ(status->reset_cause, sensor::ResetCause::kPositionJump);
  EXPECT_TRUE(reported(taken, sensor::Fault::kRestarted));
  EXPECT_EQ(status->mode, sensor::Mode::kNominal);
  const auto jump = last<bus::EstStateJump>(taken, kInertial);
  ASSERT_TRUE(jump.has_value());
  EXPECT_NEAR(jump->jump_x_m, 30, 1);
  EXPECT_NEAR(jump->jump_y_m, 0, 1);
  EXPECT_NEAR(jump->jump_yaw_rad, 0, 0.01);
  EXPECT_NEAR(last<bus::EstPos>(taken, kInertial)->x_raw, 1000 * (rover.east_m + 30), 1000);
  EXPECT_FALSE(reported(rover.run(3), sensor::Fault::kRestarted)) << "of the last second only";
}

TEST(InertialBus, VibrationIsAFaultAndHasItsSize) {
  Rover rover;
  EXPECT_FALSE(reported(rover.drive(), sensor::Fault::kVibration));
  rover.vibration_mps2 = 15;
  const Frames out = rover.run(5);
  EXPECT_TRUE(reports(*last<bus::EstStatus>(out), sensor::Fault::kVibration));
  EXPECT_NEAR(last<bus::EstStateImuHealth>(out, kInertial)->vib_accel_mps2, 15, 3);
}

TEST(InertialBus, TwoAttitudesThatAreApartAreSaidWithTheirAngle) {
  param::Parameters n = rover();
  n.disagreement = {.tilt_rad = 0.02F, .heading_rad = 3, .after_us = 1'000'000};
  Rover rover(n);
  const Frames straight = rover.drive();
  EXPECT_FALSE(reports(*last<bus::EstStatus>(straight), sensor::Fault::kAttitudeDisagrees));
  EXPECT_NEAR(last<bus::EstStateDisagreement>(straight, kAttitude)->disagree_tilt_rad, 0, 0.02);
  rover.wish_mps = 4;
  rover.turn_radps = 0.5;  // 2 m/s^2 to the side, for long: what knows an accelerometer alone tilts
  const Frames curve = rover.run(20);
  EXPECT_TRUE(reported(curve, sensor::Fault::kAttitudeDisagrees));
  EXPECT_GT(last<bus::EstStateDisagreement>(curve, kAttitude)->disagree_tilt_rad, 0.02F);
}

TEST(InertialBus, AFieldThatIsNotTheEarthsIsAFaultAsLongAsItIsThere) {
  param::Parameters n = rover();
  n.magnetic.use = 1;
  Rover rover(n);
  EXPECT_FALSE(reports(*last<bus::EstStatus>(rover.drive()), sensor::Fault::kMagneticDisturbance));
  rover.field_uT = 80;
  EXPECT_TRUE(reports(*last<bus::EstStatus>(rover.run(3)), sensor::Fault::kMagneticDisturbance));
  rover.field_uT = 50;
  EXPECT_FALSE(reports(*last<bus::EstStatus>(rover.run(10)), sensor::Fault::kMagneticDisturbance));
}

}  // namespace
}  // namespace tetap::test
