// SPDX-License-Identifier: Apache-2.0
// Sensors that a robot may have and the rover has not: antennas that do not point ahead, and a gyroscope that feels the
// Earth turn. Sensors that show the same for ever are tested, too.
#include "tetap/estimators/inertial/inertial.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <random>

namespace tetap::estimators {
namespace {

constexpr double kPi = 3.14159265358979;

/// Stands at 48 degrees north, level, and looks to yaw_rad; its place is given, its heading comes from elsewhere.
class Stand {
 public:
  explicit Stand(const param::Parameters& of) : n(of) {
    map_frame.frame = nav::LocalFrame(24'000'000'000, 5'500'000'000, 500.0F);
    map_frame.origin = sensor::OriginSource::kConfigured;
    gravity_mps2_ = nav::Earth::at(map_frame.frame, false).gravity_mps2;
    estimator.restart({us}, ctx());
    estimator.set_pose({us}, {.pose = {}, .sigma_position_m = 0.1F, .sigma_yaw_rad = 4.0F}, ctx());
  }
  param::Parameters n;
  MapFrame map_frame;
  Inertial estimator;
  double yaw_rad = 0;
  nav::Vector3 shown_radps = nav::Vector3::Zero();  ///< by a gyroscope without bias
  bool wheels = true;
  std::int64_t us = 1'000'000;

  void run(double duration_s) {
    for (const std::int64_t end = us + std::llround(duration_s * 1e6); us < end;) {
      us += 10'000;
      const auto noise = [this](double sigma) { return static_cast<float>(sigma * normal_(engine_)); };
      estimator.fuse(
          sensor::ImuSample{.dangle_b_rad = {0.01F * shown_radps(0) + noise(1e-6), 0.01F * shown_radps(1) + noise(1e-6),
                                             0.01F * shown_radps(2) + noise(1e-6)},
                            .dvelocity_b_mps = {noise(1e-4), noise(1e-4), 0.01F * gravity_mps2_ + noise(1e-4)},
                            .interval_us = 10'000},
          {us}, ctx());
      if (wheels) estimator.fuse(sensor::WheelCounts{}, {us}, ctx());
      estimator.advance({us}, ctx(), {});
    }
  }
  Innovation heading(double line_rad) {
    return estimator.fuse(sensor::OutsideHeading{.yaw_rad = static_cast<float>(
                                                     std::remainder(line_rad + 1e-3 * normal_(engine_), 2 * kPi)),
                                                 .acc_rad = 0.01F},
                          {us}, ctx());
  }
  [[nodiscard]] Context ctx() const { return {n, map_frame}; }
  [[nodiscard]] double yaw_off_rad() const {
    return std::remainder(static_cast<double>(estimator.estimate(ctx()).pose.yaw_rad) - yaw_rad, 2 * kPi);
  }
  [[nodiscard]] bool says_stuck() const {
    return (estimator.faults() >> static_cast<unsigned>(sensor::Fault::kSensorStuck) & 1U) != 0;
  }

 private:
  float gravity_mps2_ = 0;
  std::mt19937 engine_{3};
  std::normal_distribution<double> normal_;
};

param::Parameters parameters() {
  param::Parameters n;
  n.wheels.drive = {.left_radius_m = 0.1F, .right_radius_m = 0.1F, .track_m = 0.5F, .counts_per_turn = 2000};
  n.magnetic.use = n.baro.use = 1;
  n.baro.stuck_samples = 50;
  return n;
}

// Antennas across the body, the second to the left: their line points 90 degrees to the left of where the robot looks.
TEST(InertialOptions, ABaselineAcrossTheBodyIsNoHeadingOfTheBody) {
  param::Parameters n = parameters();
  n.gnss.baseline_b_m = {0, 0.8F, 0};
  Stand stand(n);
  stand.yaw_rad = 2.8;
  for (int i = 0; i < 30; ++i) {
    stand.run(0.5);
    stand.heading(stand.yaw_rad + kPi / 2);
    if (i < 6) continue;
    ASSERT_TRUE(stand.estimator.estimate(stand.ctx()).heading_valid) << i;
    ASSERT_NEAR(stand.yaw_off_rad(), 0, 0.005) << i;
  }
}

// A gyroscope at rest shows the Earth: 4.9e-5 rad/s towards north, 5.4e-5 up at 48 degrees. Told of it, the filter
// finds no bias; told nothing, it takes it for one.
TEST(InertialOptions, AGyroscopeThatFeelsTheEarthHasNoBiasOfIt) {
  constexpr float kRate = 7.292115e-5F;
  const auto cosine = static_cast<float>(std::cos(48 * kPi / 180)), sine = static_cast<float>(std::sin(48 * kPi / 180));
  for (const bool modelled : {true, false}) {
    param::Parameters n = parameters();
    n.inertial.earth_rate = modelled ? 1 : 0;
    n.inertial.gyro_radps_rthz = 2e-6F;
    n.inertial.gyro_bias_radps2_rthz = 1e-8F;
    Stand stand(n);  // looks east, so north is to its left
    stand.shown_radps = {0, kRate * cosine, kRate * sine};
    for (int i = 0; i < 60; ++i) {
      stand.run(1);
      stand.heading(0);
    }
    const nav::Vector3 bias = stand.estimator.inertial(stand.ctx()).state.b_g_radps;
    EXPECT_NEAR(bias(1), modelled ? 0.0F : kRate * cosine, 5e-6F) << modelled;
    EXPECT_NEAR(bias(2), modelled ? 0.0F : kRate * sine, 5e-6F) << modelled;
  }
}

/// A filter that begins as aligned, without wheels, at the time of the last fix.
void begin(nav::Ins& ins, const Alignment& start, const HeadingMonitor& monitor, const param::Parameters& n,
           base::Micros now) {
  const Alignment::Start at = start.start(nullptr, nav::LocalLevel{}, monitor, n.inertial, base::kNan, now);
  Recovery::restart(ins, at.x, at.variances);
}

// The receiver's last known place first, then the true one, 150 km away: a way to the east is a course, however long.
TEST(InertialOptions, AFirstWayThatIsLongIsACourse) {
  param::Parameters n = parameters();
  n.inertial.starts_forward = 1;
  Alignment start;
  HeadingMonitor monitor;
  model::GnssFix3d fix{.sigma_horizontal_m = 1, .sigma_vertical_m = 2};
  start.fix(fix, {1'000'000}, monitor, n);
  fix.x = base::Anchored::from_um(150'000'000'000);
  start.fix(fix, {2'000'000'000}, monitor, n);
  EXPECT_FALSE(start.ready()) << "one fix may be an outlier";
  start.fix(fix, {2'000'200'000}, monitor, n);
  ASSERT_TRUE(start.ready());
  nav::Ins ins;
  begin(ins, start, monitor, n, {2'000'200'000});
  EXPECT_NEAR(nav::euler(ins.x.q_nb).yaw_rad, 0.0F, 1e-6F);
  EXPECT_NEAR(ins.x.x.minus({}), 150'000.0F, 0.1F);
  start.set_heading(base::kNan, 0.1F);
  begin(ins, start, monitor, n, {2'000'200'000});
  EXPECT_TRUE(ins.x.finite()) << "no heading is no reason to lose one";
}

// A fix of 1 s and a velocity of 2 m/s: the way since then is carried for seconds, and only its size is known later.
TEST(InertialOptions, TheVelocityOfAnOldFixIsNoWay) {
  param::Parameters n = parameters();
  n.inertial.starts_forward = 1;
  Alignment start;
  HeadingMonitor monitor;
  start.fix({.sigma_horizontal_m = 1, .sigma_vertical_m = 2}, {1'000'000}, monitor, n);
  start.velocity({2.0F, 0.0F, 0.0F}, 0.1F, true, monitor, n);
  ASSERT_TRUE(start.ready());
  nav::Ins ins;
  begin(ins, start, monitor, n, {3'000'000});
  EXPECT_NEAR(ins.x.x.minus({}), 4.0F, 1e-3F);
  EXPECT_LT(ins.p(0, 0), 4.0F);
  begin(ins, start, monitor, n, {101'000'000});
  EXPECT_NEAR(ins.x.x.minus({}), 0.0F, 1e-3F);
  EXPECT_GT(ins.p(0, 0), 200.0F * 200.0F);
}

/// A start at the map's origin that knows of one velocity over ground only; none: without a heading.
std::optional<nav::Ins> begun_by(const nav::Vector3& v_n_mps, float sigma_mps, bool forwards = true) {
  param::Parameters n = parameters();
  n.inertial.starts_forward = forwards ? 1 : 0;
  Alignment start;
  HeadingMonitor monitor;
  start.fix({.sigma_horizontal_m = 1, .sigma_vertical_m = 2}, {1'000'000}, monitor, n);
  start.velocity(v_n_mps, sigma_mps, true, monitor, n);
  if (!start.ready()) return std::nullopt;
  nav::Ins ins;
  begin(ins, start, monitor, n, {1'000'000});
  return ins;
}

TEST(InertialOptions, AFastVelocityIsTheCourseOfARobotThatStartsForwards) {
  for (const float yaw_rad : {-2.5F, 0.0F, 0.6F, 2.0F}) {
    const auto mps = [&](double speed) -> nav::Vector3 {
      const auto yaw = static_cast<double>(yaw_rad);
      return {static_cast<float>(speed * std::cos(yaw)), static_cast<float>(speed * std::sin(yaw)), 0.2F};
    };
    const auto sure = begun_by(mps(4), 1e-3F), rough = begun_by(mps(4), 0.39F);
    ASSERT_TRUE(sure && rough) << yaw_rad;
    EXPECT_NEAR(nav::euler(sure->x.q_nb).yaw_rad, yaw_rad, 1e-5F);
    EXPECT_NEAR(nav::euler(rough->x.q_nb).yaw_rad, yaw_rad, 1e-5F);
    // A robot looks a little beside its way; and what the velocity is wrong across, over the speed.
    EXPECT_GT(std::sqrt(sure->p(8, 8)), 0.05F);
    EXPECT_LT(std::sqrt(sure->p(8, 8)), 0.2F);
    EXPECT_NEAR(std::sqrt(rough->p(8, 8) - sure->p(8, 8)), 0.39F / 4, 1e-4F);
  }
}

TEST(InertialOptions, AVelocityTooSlowForItsAccuracyIsNoCourse) {
  EXPECT_FALSE(begun_by({0.7F, 0.6F, 0}, 1e-3F)) << "less than a metre a second";
  EXPECT_TRUE(begun_by({0.8F, 0.7F, 0}, 1e-3F));
  EXPECT_FALSE(begun_by({1.5F, 1.5F, 0}, 0.22F)) << "less than ten of its sigma";
  EXPECT_TRUE(begun_by({1.5F, 1.5F, 0}, 0.2F));
  EXPECT_FALSE(begun_by({0, 0, 4}, 1e-3F)) << "up is no way to look";
  EXPECT_FALSE(begun_by({3, 4, 0}, 1e-3F, false)) << "it may go in reverse";
}

TEST(InertialOptions, SensorsThatShowTheSameForEverAreStuckAndSaidToBe) {
  Stand stand(parameters());
  for (int i = 0; i < 6; ++i) {
    stand.run(0.5);
    stand.heading(0);
  }
  const auto until_stale = [&](auto&& fuse) {
    for (int i = 0; i < 200; ++i) {
      stand.run(0.02);
      if (fuse() == sensor::Verdict::kStale) return i;
    }
    return 200;
  };
  const auto at = [&] { return base::Micros{stand.us}; };
  EXPECT_FALSE(stand.says_stuck());
  const auto flux = [&] {
    return stand.estimator.fuse(sensor::MagneticFlux{.flux_b_uT = {0, -20, -40}}, at(), stand.ctx()).verdict;
  };
  EXPECT_EQ(until_stale(flux), 200) << "at rest a good one may";
  stand.shown_radps = {0, 0, 0.5F};
  EXPECT_EQ(until_stale(flux), 0) << "turning it may not";
  stand.shown_radps = {0, 0, 0};
  EXPECT_TRUE(stand.says_stuck());
  static_cast<void>(stand.estimator.fuse(sensor::MagneticFlux{.flux_b_uT = {0, -20.1F, -40}}, at(), stand.ctx()));
  EXPECT_FALSE(stand.says_stuck()) << "it moves again";
  EXPECT_EQ(until_stale([&] {
              return stand.estimator.fuse(sensor::AirPressure{.pressure_Pa = 95'000}, at(), stand.ctx()).verdict;
            }),
            50);
  EXPECT_TRUE(stand.says_stuck());
  static_cast<void>(stand.estimator.fuse(sensor::AirPressure{.pressure_Pa = 95'001}, at(), stand.ctx()));
  EXPECT_EQ(until_stale([&] {
              return stand.estimator.fuse(sensor::OutsideHeading{.yaw_rad = 0.01F, .acc_rad = 0.01F}, at(), stand.ctx())
                  .verdict;
            }),
            50);
  EXPECT_TRUE(stand.says_stuck());
}

}  // namespace
}  // namespace tetap::estimators
