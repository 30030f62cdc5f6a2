// SPDX-License-Identifier: Apache-2.0
// What the default robot's node says on the bus of its inertial filter: modes, faults, jumps and how far the two
// attitudes are apart. Samples in, frames out.
#include "app/estimators/attitude.hpp"
#include "app/estimators/inertial.hpp"
#include "bench.hpp"
#include "config/rover.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace tetap::test {
namespace {

using app::GnssPosition, app::GnssVelocity, app::ImuSample, app::MagneticFlux, app::WheelCounts;
using can::Fault, can::Mode, can::ResetCause;

constexpr std::size_t kAttitude = 1, kInertial = 2;

app::Numbers rover() {
  app::Numbers n = robot::rover::numbers;
  n.recovery.persist_us = 5'000'000;
  n.recovery.persist_fixes = 20;
  n.gnss.correlation_s = 0;
  return n;
}

/// Stands for two seconds, then drives east at 1 m/s and turns as it is told.
class Rover {
 public:
  explicit Rover(const app::Numbers& numbers = rover()) : n_(numbers), node_(n_, {}) { node_.power_on({now_us_}); }

  double turn_radps = 0, vibration_mps2 = 0, field_uT = 50, off_east_m = 0;
  bool gnss = true, wheels = true;
  double east_m = 0, north_m = 0, yaw_rad = 0, wish_mps = 0;

  /// All frames of so many seconds.
  Frames run(double seconds) {
    Frames out;
    for (int k = 0; k < std::lround(100 * seconds); ++k) step(out);
    return out;
  }
  /// Until it drives and knows where it looks.
  Frames drive() {
    Frames out = run(2);
    wish_mps = 1;
    for (const auto& frame : run(18)) out.push_back(frame);
    EXPECT_EQ(last<can::EstStatus>(out)->mode, Mode::kNominal);
    return out;
  }

 private:
  template <class Payload>
  void offer(can::Sensor sensor, const Payload& payload) {
    app::Sample sample;
    sample.stamp = {now_us_ - 5'000};
    sample.sensor = sensor;
    app::visit(sample, [&payload]<class T>(const T& there) {
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
    offer(can::Sensor::kImu,
          ImuSample{.dangle_b_rad = {noise(2e-5), noise(2e-5), static_cast<float>(turn_radps * dt) + noise(2e-5)},
                    .dvelocity_b_mps = {static_cast<float>(pushed + shaken) + noise(5e-4),
                                        static_cast<float>(speed_mps_ * turn_radps * dt) + noise(5e-4),
                                        0.098089F + noise(5e-4)},
                    .interval_us = 10'000});
    if (wheels) {
      const double per_m = 2'000 / (2 * 3.14159265358979 * 0.1);
      left_ += (speed_mps_ - 0.25 * turn_radps) * dt * per_m;
      right_ += (speed_mps_ + 0.25 * turn_radps) * dt * per_m;
      offer(can::Sensor::kWheelCounts, WheelCounts{static_cast<std::uint16_t>(std::llround(left_)),
                                                   static_cast<std::uint16_t>(std::llround(right_))});
    }
    if (n_.magnetic.use != 0) {
      const double north_uT = 0.4 * field_uT;
      offer(can::Sensor::kMagnetometer,
            MagneticFlux{.flux_b_uT = {static_cast<float>(north_uT * std::sin(yaw_rad)) + noise(0.1),
                                       static_cast<float>(north_uT * std::cos(yaw_rad)) + noise(0.1),
                                       static_cast<float>(-0.9 * field_uT) + noise(0.1)}});
    }
    if (gnss && k_ % 20 == 0) {
      const app::GnssNumbers& g = n_.gnss;
      constexpr double kMetre_2ndeg = 1 / (2e-9 * 111'200);
      const double cosine = std::cos(2e-9 * static_cast<double>(g.origin_latitude_2ndeg) * 3.14159265358979 / 180);
      const auto raw = [](double value) { return std::llround(value); };
      offer(can::Sensor::kGnssPosition,
            GnssPosition{
                .latitude_2ndeg =
                    g.origin_latitude_2ndeg + raw((north_m + static_cast<double>(noise(0.3))) * kMetre_2ndeg),
                .longitude_2ndeg = g.origin_longitude_2ndeg +
                                   raw((east_m + off_east_m + static_cast<double>(noise(0.3))) * kMetre_2ndeg / cosine),
                .height_m = 520 + noise(0.5),
                .horizontal_acc_m = 0.3F,
                .vertical_acc_m = 0.5F,
                .fix = app::GnssFix::k3d});
      offer(can::Sensor::kGnssVelocity,
            GnssVelocity{.v_n_mps = {static_cast<float>(speed_mps_ * std::cos(yaw_rad)) + noise(0.05),
                                     static_cast<float>(speed_mps_ * std::sin(yaw_rad)) + noise(0.05), noise(0.05)},
                         .acc_mps = 0.05F});
    }
    node_.tick({now_us_}, {}, [&out](const base::CanFrame& frame) { out.push_back(frame); });
  }

  app::Numbers n_;
  app::Node<app::Estimators<app::Odometry, app::Attitude, app::Inertial>> node_;
  std::int64_t now_us_ = 5'000'000, k_ = 0;
  double left_ = 0, right_ = 0, speed_mps_ = 0;
  std::mt19937 engine_{7};
  std::normal_distribution<double> normal_;
};

bool says(const can::EstStatus& status, Fault fault) {
  return (status.faults >> static_cast<unsigned>(fault) & 1) != 0;
}
/// Whether any status of these frames has this fault.
bool said(const Frames& frames, Fault fault) {
  const auto all_of_them = all<can::EstStatus>(frames);
  return std::any_of(all_of_them.begin(), all_of_them.end(), [&](const auto& one) { return says(one, fault); });
}
/// Modes in the order in which they are said.
std::vector<Mode> modes(const Frames& frames) {
  std::vector<Mode> found;
  for (const auto& status : all<can::EstStatus>(frames))
    if (found.empty() || found.back() != status.mode) found.push_back(status.mode);
  return found;
}

TEST(InertialBus, ItSaysWhatItWaitsForAndThenThatItNavigates) {
  Rover rover;
  const Frames out = rover.drive();
  EXPECT_EQ(modes(out), (std::vector{Mode::kWaitingForImu, Mode::kLevelling, Mode::kFindingHeading, Mode::kNominal}));
  EXPECT_FALSE(said(rover.run(5), Fault::kInputStale));
}

TEST(InertialBus, WhatItDoesNotKnowYetIsNeitherValidNorConfident) {
  Rover rover;
  const Frames out = rover.run(2);
  const auto sigma = last<can::EstStdPose>(out, kInertial);
  const auto motion = last<can::EstMotion>(out, kInertial);
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
  EXPECT_EQ(modes(rover.run(10)), (std::vector{Mode::kNominal, Mode::kDeadReckoning}));
  rover.gnss = true;
  EXPECT_EQ(modes(rover.run(5)).back(), Mode::kNominal);
}

TEST(InertialBus, AJumpThatPersistsIsRefusedAndThenTakenWithItsSize) {
  Rover rover;
  const auto before = last<can::EstStatus>(rover.drive());
  rover.off_east_m = 30;
  const Frames refused = rover.run(4);
  EXPECT_TRUE(says(*last<can::EstStatus>(refused), Fault::kRejecting));
  EXPECT_EQ(last<can::EstStatus>(refused)->mode, Mode::kDegraded);
  EXPECT_EQ(last<can::EstStatus>(refused)->reset_ctr, before->reset_ctr);
  const Frames taken = rover.run(6);
  const auto status = last<can::EstStatus>(taken);
  EXPECT_EQ(status->reset_ctr, before->reset_ctr + 1);
  EXPECT_EQ(status->reset_cause, ResetCause::kPositionJump);
  EXPECT_TRUE(said(taken, Fault::kRestarted));
  EXPECT_EQ(status->mode, Mode::kNominal);
  const auto jump = last<can::EstStateJump>(taken, kInertial);
  ASSERT_TRUE(jump.has_value());
  EXPECT_NEAR(jump->jump_x_m, 30, 1);
  EXPECT_NEAR(jump->jump_y_m, 0, 1);
  EXPECT_NEAR(jump->jump_yaw_rad, 0, 0.01);
  EXPECT_NEAR(last<can::EstPos>(taken, kInertial)->x_raw, 1000 * (rover.east_m + 30), 1000);
  EXPECT_FALSE(said(rover.run(3), Fault::kRestarted)) << "of the last second only";
}

TEST(InertialBus, VibrationIsAFaultAndHasItsSize) {
  Rover rover;
  EXPECT_FALSE(said(rover.drive(), Fault::kVibration));
  rover.vibration_mps2 = 15;
  const Frames out = rover.run(5);
  EXPECT_TRUE(says(*last<can::EstStatus>(out), Fault::kVibration));
  EXPECT_NEAR(last<can::EstStateImuHealth>(out, kInertial)->vib_accel_mps2, 15, 3);
}

TEST(InertialBus, TwoAttitudesThatAreApartAreSaidWithTheirAngle) {
  app::Numbers n = rover();
  n.disagreement = {.tilt_rad = 0.02F, .heading_rad = 3, .after_us = 1'000'000};
  Rover rover(n);
  const Frames straight = rover.drive();
  EXPECT_FALSE(says(*last<can::EstStatus>(straight), Fault::kAttitudeDisagrees));
  EXPECT_NEAR(last<can::EstStateDisagreement>(straight, kAttitude)->disagree_tilt_rad, 0, 0.02);
  rover.wish_mps = 4;
  rover.turn_radps = 0.5;  // 2 m/s^2 to the side, for long: what knows an accelerometer alone tilts
  const Frames curve = rover.run(20);
  EXPECT_TRUE(said(curve, Fault::kAttitudeDisagrees));
  EXPECT_GT(last<can::EstStateDisagreement>(curve, kAttitude)->disagree_tilt_rad, 0.02F);
}

TEST(InertialBus, AFieldThatIsNotTheEarthsIsAFaultAsLongAsItIsThere) {
  app::Numbers n = rover();
  n.magnetic.use = 1;
  Rover rover(n);
  EXPECT_FALSE(says(*last<can::EstStatus>(rover.drive()), Fault::kMagneticDisturbance));
  rover.field_uT = 80;
  EXPECT_TRUE(says(*last<can::EstStatus>(rover.run(3)), Fault::kMagneticDisturbance));
  rover.field_uT = 50;
  EXPECT_FALSE(says(*last<can::EstStatus>(rover.run(10)), Fault::kMagneticDisturbance));
}

}  // namespace
}  // namespace tetap::test
