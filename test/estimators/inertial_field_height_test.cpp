// SPDX-License-Identifier: Apache-2.0
// Magnetometer and barometer in the inertial estimator: what they find at the start, and how far they are believed. A
// disturbance has limits and an end. The world is a small one of its own. Its robot stands or drives curves, with exact
// sensors but for what a test adds, each sample fused at its own time.
#include "tetap/base/state_words.hpp"
#include "tetap/estimators/inertial/inertial.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

namespace tetap::estimators {
namespace {

constexpr double kPi = 3.14159265358979323846, kDegree = kPi / 180;
constexpr double kField_uT = 48.6, kDip_rad = 64.2 * kDegree;  // WMM 2020, 48 N 11 E

/// The angle from b to a the short way round, in degrees.
double degrees_apart(double a_rad, double b_rad) { return std::remainder(a_rad - b_rad, 2 * kPi) / kDegree; }

param::Parameters robot_parameters() {
  param::Parameters n;
  n.inertial.gyro_radps_rthz = 2e-4F;
  n.inertial.accel_mps2_rthz = 5e-3F;
  n.magnetic.use = 1;
  n.baro.use = 1;
  return n;
}

/// Normal, in three axes; one for each sensor, so that another's absence changes nothing.
class Noise {
 public:
  explicit Noise(unsigned seed) : engine_(seed) {}
  nav::Vector3 operator()(double sigma) {
    const double x = normal_(engine_), y = normal_(engine_), z = normal_(engine_);
    return nav::Vector3(static_cast<float>(sigma * x), static_cast<float>(sigma * y), static_cast<float>(sigma * z));
  }

 private:
  std::mt19937 engine_;
  std::normal_distribution<double> normal_;
};

class Robot {
 public:
  explicit Robot(const param::Parameters& of = robot_parameters()) : n(of) {
    map_frame.frame = nav::LocalFrame(kLatitude_2ndeg, kLongitude_2ndeg, 500.0F);
    map_frame.origin = sensor::OriginSource::kConfigured;
    estimator.restart({us}, ctx());
  }

  param::Parameters n;
  MapFrame map_frame;
  Inertial estimator;

  // The truth, and what the sensors make of it.
  double yaw_rad = 0, east_m = 0, north_m = 0, up_m = 0, speed_mps = 0, climb_mps = 0;
  double roll_rad = 0, pitch_rad = 0;
  double yaw_rate_radps = 0, acceleration_mps2 = 0;
  double declination_rad = 0;
  bool gnss = true, baro = true, magnetometer = true;
  bool stuck_air = false;                         ///< the barometer repeats its last pressure
  bool gnss_places = true;                        ///< has positions beside velocities
  bool gnss_climbs = true;                        ///< says how fast it climbs; NMEA does not
  double receiver_climbs_mps = 0;                 ///< error of the receiver's climb rate
  double unseen_turn_radps = 0;                   ///< turn of the world that the gyroscope does not show
  double field_noise_uT = 0.3, flux_after_s = 0;  ///< how long after an IMU sample the magnetometer's is taken
  nav::Vector3 accel_bias_mps2 = nav::Vector3::Zero();
  std::function<nav::Vector3(const nav::Vector3&)> disturb = [](const nav::Vector3& m_b) { return m_b; };
  std::function<double(double)> weather_Pa = [](double) { return 0.0; };

  Innovation last_flux, last_air;
  int fluxes = 0, rejected = 0, airs = 0, refused_airs = 0;

  void run(double duration_s) {
    for (const std::int64_t end = us + std::llround(duration_s * 1e6); us < end;) step();
  }
  [[nodiscard]] Context ctx() const { return {n, map_frame}; }
  [[nodiscard]] InertialEstimate now() const { return estimator.inertial(ctx()); }
  [[nodiscard]] bool tracking() const { return now().valid; }
  [[nodiscard]] double heading_off_deg() const {
    return std::abs(degrees_apart(static_cast<double>(nav::euler(now().state.q_nb).yaw_rad), yaw_rad));
  }
  [[nodiscard]] double heading_sigma_rad() const { return std::sqrt(static_cast<double>(now().p(8, 8))); }
  [[nodiscard]] double height_off_m() const {
    return static_cast<double>(now().state.z.minus(base::Anchored{})) - up_m;
  }
  [[nodiscard]] double height_sigma_m() const { return std::sqrt(static_cast<double>(now().p(2, 2))); }
  [[nodiscard]] double time_s() const { return 1e-6 * static_cast<double>(us - kBegin_us); }
  void advance() { estimator.advance({us}, ctx(), {}); }

 private:
  static constexpr std::int64_t kBegin_us = 3'000'000, kImu_us = 10'000;
  static constexpr std::int64_t kLatitude_2ndeg = 24'000'000'000, kLongitude_2ndeg = 5'500'000'000;

  void step() {
    constexpr double kDt_s = 1e-6 * static_cast<double>(kImu_us);
    const double f_forward = acceleration_mps2, f_left = (speed_mps + 0.5 * kDt_s * acceleration_mps2) * yaw_rate_radps;
    yaw_rad += kDt_s * (yaw_rate_radps + unseen_turn_radps);
    const double middle_rad = yaw_rad - 0.5 * kDt_s * (yaw_rate_radps + unseen_turn_radps);
    const double way_m = kDt_s * (speed_mps + 0.5 * kDt_s * acceleration_mps2);
    east_m += way_m * std::cos(middle_rad);
    north_m += way_m * std::sin(middle_rad);
    up_m += kDt_s * climb_mps;
    speed_mps += kDt_s * acceleration_mps2;
    us += kImu_us;
    const nav::Quaternion q_nb = attitude();
    const nav::Quaternion lean = nav::from_euler({.pitch_rad = narrow(pitch_rad), .roll_rad = narrow(roll_rad)});
    const nav::Vector3 turn = lean.conjugate().rotate({0.0F, 0.0F, narrow(yaw_rate_radps)}) + noise_(1e-3);
    const nav::Vector3 force =
        lean.conjugate().rotate({narrow(f_forward), narrow(f_left),
                                 nav::Earth{}.gravity_mps2 + narrow((climb_mps - climbed_mps_) / kDt_s)}) +
        accel_bias_mps2 + noise_(0.02);
    climbed_mps_ = climb_mps;
    constexpr float kStep_s = static_cast<float>(kDt_s);
    const sensor::ImuSample imu{.dangle_b_rad = {turn(0) * kStep_s, turn(1) * kStep_s, turn(2) * kStep_s},
                                .dvelocity_b_mps = {force(0) * kStep_s, force(1) * kStep_s, force(2) * kStep_s},
                                .interval_us = kImu_us};
    static_cast<void>(estimator.fuse(imu, {us}, ctx()));
    if (magnetometer && us % 20'000 == 0) take_flux(q_nb);
    if (baro && us % 50'000 == 0) take_air();
    if (gnss && us % 200'000 == 0) take_fix();
    advance();
  }
  void take_flux(const nav::Quaternion& q_nb) {
    const nav::Quaternion seen = nav::exp_quaternion({0.0F, 0.0F, narrow(flux_after_s * yaw_rate_radps)}) * q_nb;
    const double h = kField_uT * std::cos(kDip_rad);
    const nav::Vector3 m_n{narrow(h * std::sin(declination_rad)), narrow(h * std::cos(declination_rad)),
                           narrow(-kField_uT * std::sin(kDip_rad))};
    const nav::Vector3 m = disturb(seen.conjugate().rotate(m_n)) + field_noise_(field_noise_uT);
    last_flux = estimator.fuse(sensor::MagneticFlux{.flux_b_uT = {m(0), m(1), m(2)}},
                               {us + std::llround(flux_after_s * 1e6)}, ctx());
    ++fluxes;
    rejected += last_flux.verdict == sensor::Verdict::kRejected;
  }
  void take_air() {
    const double altitude_m = 500 + up_m;
    const double pressure_Pa = 101325 * std::pow(1 - altitude_m / 44330.77, 1 / 0.1902632) + weather_Pa(time_s());
    if (!stuck_air) shown_Pa_ = narrow(pressure_Pa) + air_noise_(2)(0);
    last_air = estimator.fuse(sensor::AirPressure{.pressure_Pa = shown_Pa_}, {us}, ctx());
    ++airs;
    refused_airs += last_air.verdict == sensor::Verdict::kRejected;
  }
  void take_fix() {
    constexpr double kMetresPerDegree = 111'193.0;  // at 48 N to a thousandth: the robot stays near
    constexpr double kEast = 74'625.0;
    const nav::Vector3 e = noise_(1.0);
    const sensor::GnssPosition fix{
        .latitude_2ndeg =
            kLatitude_2ndeg + std::llround((north_m + static_cast<double>(e(0))) / kMetresPerDegree * 5e8),
        .longitude_2ndeg = kLongitude_2ndeg + std::llround((east_m + static_cast<double>(e(1))) / kEast * 5e8),
        .height_m = narrow(500 + up_m) + 2.0F * e(2),
        .horizontal_acc_m = 1.0F,
        .vertical_acc_m = 2.0F,
        .fix = sensor::GnssFix::k3d};
    if (gnss_places) static_cast<void>(estimator.fuse(fix, {us}, ctx()));
    const nav::Vector3 v = noise_(0.1);
    static_cast<void>(estimator.fuse(
        sensor::GnssVelocity{
            .v_n_mps = {narrow(speed_mps * std::cos(yaw_rad)) + v(0), narrow(speed_mps * std::sin(yaw_rad)) + v(1),
                        gnss_climbs ? narrow(climb_mps + receiver_climbs_mps) + v(2) : base::kNan},
            .acc_mps = 0.1F},
        {us}, ctx()));
  }
  [[nodiscard]] nav::Quaternion attitude() const {
    return nav::from_euler({.yaw_rad = narrow(yaw_rad), .pitch_rad = narrow(pitch_rad), .roll_rad = narrow(roll_rad)});
  }
  static float narrow(double x) { return static_cast<float>(x); }
  std::int64_t us = kBegin_us;
  double climbed_mps_ = 0;
  float shown_Pa_ = 0;
  Noise noise_{11}, field_noise_{12}, air_noise_{13};
};

/// Curves to both sides at a few metres per second.
void drive(Robot& robot, double duration_s) {
  for (const double end = robot.time_s() + duration_s; robot.time_s() < end;) {
    const double t = robot.time_s();
    robot.acceleration_mps2 = std::clamp(2.0 - robot.speed_mps, -1.0, 1.0) + 0.5 * std::cos(0.7 * t);
    robot.yaw_rate_radps = 0.4 * std::sin(0.3 * t);
    robot.run(0.02);
  }
}
void stop(Robot& robot) {
  robot.yaw_rate_radps = 0;
  robot.acceleration_mps2 = -0.5 * robot.speed_mps;
  robot.run(2);
  robot.acceleration_mps2 = robot.speed_mps = 0;
}
void climb(Robot& robot, double rate_mps) {
  for (const double step = 0.01 * (rate_mps - robot.climb_mps);
       std::abs(rate_mps - robot.climb_mps) > 0.5 * std::abs(step);) {
    robot.climb_mps += step;
    robot.run(0.01);
  }
}

/// Rotation that turns the horizontal field about the vertical of a level robot, and leaves strength and dip as they
/// are.
std::function<nav::Vector3(const nav::Vector3&)> turned_by(double angle_rad) {
  const nav::Quaternion turn = nav::exp_quaternion({0.0F, 0.0F, static_cast<float>(angle_rad)});
  return [turn](const nav::Vector3& m_b) { return nav::Vector3(turn.rotate(m_b)); };
}

// --- The magnetometer.

TEST(InertialMagnetometer, finds_each_of_36_headings_at_standstill_on_a_slope) {
  for (int k = 0; k < 36; ++k) {
    Robot robot;
    robot.yaw_rad = 10 * k * kDegree;
    robot.roll_rad = 0.15;
    robot.pitch_rad = -0.1;
    robot.run(3);
    ASSERT_TRUE(robot.tracking()) << k;
    EXPECT_LT(robot.heading_off_deg(), 3.0) << k;
    robot.run(10);
    EXPECT_LT(robot.heading_off_deg(), 2.5) << k;
    EXPECT_GT(robot.heading_sigma_rad(), 0.95 * static_cast<double>(robot.n.magnetic.sigma_rad)) << k;
    EXPECT_LT(robot.heading_sigma_rad(), 1.1 * static_cast<double>(robot.n.magnetic.sigma_rad)) << k;
  }
}

TEST(InertialMagnetometer, says_nothing_to_a_robot_that_does_not_use_it) {
  param::Parameters n = robot_parameters();
  n.magnetic.use = 0;
  Robot robot(n);
  robot.run(5);
  EXPECT_EQ(robot.last_flux.verdict, sensor::Verdict::kNotUsed);
  EXPECT_EQ(robot.estimator.mode(robot.ctx()), sensor::Mode::kFindingHeading);
}

TEST(InertialMagnetometer, points_to_true_north_by_the_declination_at_the_start_and_after) {
  param::Parameters n = robot_parameters();
  n.magnetic.declination_rad = 0.3F;
  Robot robot(n);
  robot.declination_rad = 0.3;
  robot.yaw_rad = 1;
  robot.run(5);
  ASSERT_TRUE(robot.tracking());
  EXPECT_LT(robot.heading_off_deg(), 3.0);
  EXPECT_LT(robot.last_flux.nis, 1.0F);
}

TEST(InertialMagnetometer, finds_the_heading_before_the_place_and_keeps_it_through_a_turn) {
  for (const bool seen_after_it : {false, true}) {
    Robot robot;
    robot.gnss = false;
    robot.magnetometer = !seen_after_it;
    robot.run(3);
    EXPECT_EQ(robot.estimator.mode(robot.ctx()), sensor::Mode::kWaitingForPose);
    robot.magnetometer = false;
    robot.yaw_rate_radps = 0.8;
    robot.run(2);
    robot.yaw_rate_radps = 0;
    robot.magnetometer = seen_after_it;
    robot.run(0.1);
    robot.magnetometer = false;
    robot.gnss = true;
    robot.run(1);
    ASSERT_TRUE(robot.tracking());
    EXPECT_LT(robot.heading_off_deg(), 2.5) << seen_after_it;  // the robot turned 92 degrees between the two
  }
}

TEST(InertialMagnetometer, leaves_a_heading_from_outside_that_is_better_than_its_own) {
  param::Parameters n = robot_parameters();
  n.inertial.gyro_turn_on_radps = 0.001F;
  Robot robot(n);
  robot.gnss = false;
  robot.run(2);
  static_cast<void>(
      robot.estimator.fuse(sensor::OutsideHeading{.yaw_rad = 0.08F, .acc_rad = 0.01F}, {5'000'000}, robot.ctx()));
  robot.run(1);
  robot.gnss = true;
  robot.run(2);
  ASSERT_TRUE(robot.tracking());
  EXPECT_NEAR(robot.heading_off_deg(), 0.08 / kDegree, 0.3);
  EXPECT_LT(robot.heading_sigma_rad(), 0.02);
}

TEST(InertialMagnetometer, knows_what_it_turned_since_the_gyroscopes_last_sample) {
  param::Parameters n = robot_parameters();
  n.magnetic.sigma_rad = 0.005F;
  Robot robot(n);
  robot.run(3);
  robot.field_noise_uT = 0;
  robot.flux_after_s = 0.009;
  robot.yaw_rate_radps = 2;
  robot.run(10);
  EXPECT_LT(robot.last_flux.nis, 6.0F);  // the robot turns by four sigma in 9 ms
  EXPECT_LT(robot.heading_off_deg(), 1.0);
}

TEST(InertialMagnetometer, never_makes_the_heading_better_known_than_a_compass_can) {
  for (const double error_rad : {-0.08, 0.08}) {  // of what calibration left, for ever
    Robot robot;
    robot.disturb = turned_by(error_rad);
    robot.run(300);
    EXPECT_GT(robot.heading_sigma_rad(), 0.95 * static_cast<double>(robot.n.magnetic.sigma_rad));
    EXPECT_LT(robot.heading_off_deg() * kDegree, 1.0 * robot.heading_sigma_rad());
    EXPECT_EQ(robot.rejected, 0);
  }
}

TEST(InertialMagnetometer, is_not_turned_by_a_magnet_and_says_what_it_rejects) {
  for (const bool gnss : {true, false})
    for (const bool moving : {false, true}) {
      Robot robot, without;
      for (Robot* one : {&robot, &without}) {
        drive(*one, 20);
        if (!moving) stop(*one);
        one->gnss = gnss;
      }
      robot.disturb = [](const nav::Vector3& m) { return nav::Vector3(m + nav::Vector3{4.0F, -7.0F, -20.0F}); };
      without.magnetometer = false;
      const int before = robot.rejected;
      for (Robot* one : {&robot, &without}) {
        if (moving) {
          drive(*one, 10);
        } else {
          one->run(10);
        }
      }
      EXPECT_GE(robot.rejected - before, 499);
      EXPECT_EQ(robot.last_flux.failed, sensor::Check::kField);
      EXPECT_EQ(robot.last_flux.dof, 0) << "no innovation was compared";
      EXPECT_GT(robot.last_flux.statistic, robot.last_flux.limit);
      EXPECT_EQ(base::bits(robot.now().state.q_nb.z), base::bits(without.now().state.q_nb.z));
      EXPECT_EQ(base::bits(robot.now().p(8, 8)), base::bits(without.now().p(8, 8)));
      robot.disturb = turned_by(0);
      robot.run(0.1);
      EXPECT_EQ(robot.last_flux.verdict, sensor::Verdict::kAccepted);
    }
}

TEST(InertialMagnetometer, is_not_turned_by_a_field_of_the_right_strength_and_dip_that_gnss_contradicts) {
  Robot robot;
  drive(robot, 40);
  EXPECT_LT(robot.heading_off_deg(), 2.0);
  robot.disturb = turned_by(0.7);
  drive(robot, 10);
  EXPECT_LT(robot.heading_off_deg(), 2.0);
  EXPECT_EQ(robot.last_flux.verdict, sensor::Verdict::kRejected);
  EXPECT_EQ(robot.last_flux.dof, 1);
  // The magnetometer agrees again: compared, but not used until it has for as long as it took to be disbelieved.
  robot.disturb = turned_by(0);
  drive(robot, 0.1);
  EXPECT_EQ(robot.last_flux.verdict, sensor::Verdict::kNotUsed);
  drive(robot, 1e-6 * static_cast<double>(robot.n.recovery.after_us) - 0.4);
  EXPECT_EQ(robot.last_flux.verdict, sensor::Verdict::kNotUsed);
  drive(robot, 0.6);
  EXPECT_EQ(robot.last_flux.verdict, sensor::Verdict::kAccepted);
}

/// Wrong from the start, and of the right strength and dip: the heading begins with it and agrees with it, so no gate
/// sees it. How the robot moves does: it is believed no more, and the heading pulled round, or begun anew with.
TEST(InertialMagnetometer, that_is_wrong_from_the_start_leads_the_heading_only_until_the_robot_moves) {
  for (const double off_rad : {0.75, -0.9, 1.2, -1.57, 2.6, 3.14}) {
    SCOPED_TRACE(off_rad);
    Robot robot;
    robot.disturb = turned_by(off_rad);
    robot.run(10);
    ASSERT_TRUE(robot.tracking());
    EXPECT_NEAR(robot.heading_off_deg(), std::abs(off_rad) / kDegree, 5) << "nothing else has shown it yet";
    drive(robot, 40);
    ASSERT_TRUE(robot.tracking());
    EXPECT_LE(robot.estimator.jump().count, 1);
    EXPECT_TRUE(robot.estimator.jump().count == 1 || std::abs(off_rad) < 1.3) << "nothing pulls it round";
    EXPECT_LT(robot.heading_off_deg(), 3.0);
    EXPECT_LT(robot.heading_off_deg() * kDegree, 4 * robot.heading_sigma_rad());
    EXPECT_NE(robot.last_flux.verdict, sensor::Verdict::kAccepted);
    // Put right, it is used again once it has agreed for as long as it takes to be disbelieved.
    robot.disturb = turned_by(0);
    drive(robot, 1e-6 * static_cast<double>(robot.n.recovery.after_us) + 0.5);
    EXPECT_EQ(robot.last_flux.verdict, sensor::Verdict::kAccepted);
    EXPECT_LT(robot.heading_off_deg(), 3.0);
  }
}

TEST(InertialMagnetometer, that_is_right_is_never_taken_for_one_that_leads_the_heading) {
  for (const double off_rad : {0.0, 0.1, -0.1}) {
    Robot robot;
    robot.disturb = turned_by(off_rad);
    robot.run(10);
    drive(robot, 120);
    EXPECT_EQ(robot.estimator.jump().count, 0) << off_rad;
    EXPECT_EQ(robot.last_flux.verdict, sensor::Verdict::kAccepted) << off_rad;
  }
}

TEST(InertialMagnetometer, brings_a_lost_heading_back_when_nothing_else_can) {
  Robot robot;
  drive(robot, 20);
  stop(robot);
  robot.run(1);
  robot.gnss = false;
  robot.run(4);
  robot.unseen_turn_radps = 10;  // knocked round by 57 degrees, faster than the gyroscope shows
  robot.run(0.1);
  robot.unseen_turn_radps = 0;
  robot.run(1);
  EXPECT_GT(robot.heading_off_deg(), 40.0);
  EXPECT_EQ(robot.last_flux.verdict, sensor::Verdict::kRejected);
  robot.run(1e-6 * static_cast<double>(robot.n.recovery.after_us));
  EXPECT_LT(robot.heading_off_deg(), 4.0);
  EXPECT_EQ(robot.last_flux.verdict, sensor::Verdict::kAccepted);
}

TEST(InertialMagnetometer, takes_a_new_field_for_known_after_motion_in_it_not_beside_a_parked_car) {
  Robot robot;
  drive(robot, 20);
  stop(robot);
  robot.disturb = [](const nav::Vector3& m) { return nav::Vector3(1.3F * m); };
  robot.run(60);
  EXPECT_EQ(robot.last_flux.verdict, sensor::Verdict::kRejected);
  drive(robot, static_cast<double>(robot.n.magnetic.field_new_s) - 2);
  EXPECT_EQ(robot.last_flux.verdict, sensor::Verdict::kRejected);
  EXPECT_EQ(robot.estimator.jump().count, 0);
  drive(robot, 4);
  EXPECT_NE(robot.last_flux.verdict, sensor::Verdict::kRejected);
  EXPECT_EQ(robot.estimator.jump().count, 1) << "and says so";
  EXPECT_EQ(robot.estimator.jump().cause, sensor::ResetCause::kMagneticField);
}

TEST(InertialMagnetometer, waits_for_a_field_of_the_configured_strength) {
  param::Parameters n = robot_parameters();
  n.magnetic.norm_uT = static_cast<float>(kField_uT);
  Robot robot(n);
  robot.disturb = [](const nav::Vector3& m) { return nav::Vector3(1.3F * m); };
  robot.run(5);
  EXPECT_FALSE(robot.tracking());
  EXPECT_EQ(robot.last_flux.verdict, sensor::Verdict::kRejected);
  robot.disturb = turned_by(0);
  robot.run(1);
  EXPECT_TRUE(robot.tracking());
}

TEST(InertialMagnetometer, refuses_what_is_no_field) {
  Robot robot;
  drive(robot, 20);
  const auto bits = [&robot] {
    std::vector<std::uint64_t> all;
    const auto sink = [&all](std::uint32_t word) { all.push_back(word); };
    base::each_word(robot.estimator, sink);
    return all;
  };
  const auto before = bits();
  constexpr float kBig = 3e38F;
  for (const std::array<float, 3>& flux : {std::array{base::kNan, 0.0F, 0.0F}, std::array{0.0F, base::kInfinity, 0.0F},
                                           std::array{0.0F, 0.0F, 0.0F}, std::array{kBig, kBig, kBig}}) {
    EXPECT_EQ(robot.estimator.fuse(sensor::MagneticFlux{.flux_b_uT = flux}, {4'000'000}, robot.ctx()).verdict,
              sensor::Verdict::kNotFinite);
    // One word of the state changes at most: it names the failed check of the source.
    const auto after = bits();
    ASSERT_EQ(after.size(), before.size());
    std::size_t changed = 0;
    for (std::size_t i = 0; i < after.size(); ++i) changed += after[i] != before[i] ? 1U : 0U;
    EXPECT_LE(changed, 1U);
  }
}

// --- The barometer.

TEST(PressureAltitude, is_that_of_the_standard_atmosphere) {
  EXPECT_NEAR(pressure_altitude_m(101325.0F), 0.0F, 0.01F);  // U.S. Standard Atmosphere 1976, table I
  EXPECT_NEAR(pressure_altitude_m(89874.6F), 1000.0F, 0.1F);
  EXPECT_NEAR(pressure_altitude_m(54019.9F), 5000.0F, 0.5F);
  EXPECT_NEAR(pressure_altitude_m(26436.3F), 10000.0F, 1.0F);
}

TEST(InertialBarometer, holds_the_height_through_an_outage_and_knows_how_well) {
  double off_m[2], sigma_m[2];
  for (const bool baro : {false, true}) {
    Robot robot;
    robot.baro = baro;
    drive(robot, 60);
    robot.gnss = false;
    drive(robot, 60);
    off_m[baro] = std::abs(robot.height_off_m());
    sigma_m[baro] = robot.height_sigma_m();
    EXPECT_LT(off_m[baro], 3 * sigma_m[baro]);
  }
  EXPECT_LT(off_m[1], 1.5);
  EXPECT_LT(sigma_m[1], 2.0);
  EXPECT_GT(sigma_m[0], 3.0);
}

TEST(InertialBarometer, follows_a_climb_without_gnss_as_far_as_air_is_known) {
  Robot robot;
  drive(robot, 60);
  robot.gnss = false;
  const double before_m = robot.height_sigma_m();
  climb(robot, 1);
  drive(robot, 60);
  EXPECT_LT(std::abs(robot.height_off_m()), 3.0);
  const double air_m = robot.up_m * static_cast<double>(robot.n.baro.scale_share);  // 3 m
  EXPECT_GT(robot.height_sigma_m(), 0.5 * std::hypot(before_m, air_m));
  EXPECT_LT(robot.height_sigma_m(), 1.5 * std::hypot(before_m, air_m));
}

TEST(InertialBarometer, does_not_drag_the_height_with_the_weather_while_there_is_gnss) {
  Robot robot;
  drive(robot, 30);
  robot.weather_Pa = [](double t_s) { return -0.1 * (t_s - 30); };  // 9 mm of height per second, 8 times a storm's
  double worst_m = 0, sum = 0;
  int count = 0;
  for (int k = 0; k < 600; ++k) {
    drive(robot, 1);
    worst_m = std::max(worst_m, std::abs(robot.height_off_m()));
    const double share = robot.height_off_m() / robot.height_sigma_m();
    sum += share * share;
    ++count;
  }
  EXPECT_LT(worst_m, 1.6);  // the weather: 5 m
  EXPECT_LT(sum / count, 2.0);
  EXPECT_EQ(robot.refused_airs, 0);  // the zero follows
  EXPECT_EQ(robot.last_air.verdict, sensor::Verdict::kAccepted);
}

TEST(InertialBarometer, never_makes_the_height_better_known_than_its_zero) {
  Robot robot;
  drive(robot, 30);
  const double at_outage_m = robot.height_sigma_m();
  robot.gnss = false;
  drive(robot, 100);
  const double drift_m = 10 * static_cast<double>(robot.n.baro.drift_m_rts);
  EXPECT_GT(robot.height_sigma_m(), 0.97 * std::hypot(at_outage_m, drift_m));
  EXPECT_LT(robot.height_sigma_m(), 1.25 * std::hypot(at_outage_m, drift_m));
}

TEST(InertialHeight, is_that_of_the_fixes_where_the_receiver_says_no_vertical_speed) {
  for (const bool climbs_at_the_start : {false, true}) {
    Robot robot;
    robot.baro = robot.gnss_climbs = false;
    if (climbs_at_the_start) robot.climb_mps = 2;
    drive(robot, climbs_at_the_start ? 5 : 60);
    double worst = 0, sum = 0;
    int count = 0;
    for (const double rate_mps : {2.0, 0.0, -3.0, 1.0}) {
      climb(robot, rate_mps);
      for (int k = 0; k < 150; ++k) {
        drive(robot, 0.2);
        const auto now = robot.now();
        const double off_mps = static_cast<double>(now.state.v_n_mps(2)) - robot.climb_mps;
        const double share = off_mps / std::sqrt(static_cast<double>(now.p(5, 5)));
        worst = std::max({worst, std::abs(share) / 3, std::abs(robot.height_off_m() / robot.height_sigma_m()) / 3});
        sum += share * share;
        ++count;
      }
    }
    EXPECT_LT(worst, 1.2) << climbs_at_the_start;
    EXPECT_LT(sum / count, 2.0) << climbs_at_the_start;
    EXPECT_GT(sum / count, 0.05) << climbs_at_the_start;
  }
}

TEST(InertialBarometer, takes_a_door_for_a_new_zero_not_for_a_climb) {
  for (const bool gnss : {true, false}) {
    Robot robot;
    drive(robot, 60);
    stop(robot);
    robot.gnss = gnss;
    robot.run(1);
    const double before_m = robot.height_off_m();
    robot.weather_Pa = [](double) { return -120.0; };  // 10 m
    robot.run(1);
    EXPECT_EQ(robot.last_air.verdict, sensor::Verdict::kRejected);
    EXPECT_GT(robot.last_air.nis, robot.last_air.gate);
    EXPECT_EQ(robot.last_air.dof, 1);
    robot.run(1e-6 * static_cast<double>(robot.n.recovery.after_us));
    EXPECT_EQ(robot.last_air.verdict, sensor::Verdict::kAccepted);
    EXPECT_EQ(robot.estimator.jump().cause, sensor::ResetCause::kBarometerZero) << "and says so";
    EXPECT_NEAR(robot.height_off_m(), before_m, 1.0) << gnss;
  }
}

/// Time for which height or climb is beyond 1.5 times its 3 sigma, while the robot runs.
double beyond_s(Robot& robot, double duration_s) {
  int steps = 0;
  for (const double end = robot.time_s() + duration_s; robot.time_s() < end;) {
    robot.run(0.05);
    const InertialEstimate now = robot.now();
    const double climb_off_mps = static_cast<double>(now.state.v_n_mps(2)) - robot.climb_mps;
    const bool off = std::abs(robot.height_off_m()) > 4.5 * robot.height_sigma_m() ||
                     std::abs(climb_off_mps) > 4.5 * std::sqrt(static_cast<double>(now.p(5, 5)));
    steps += off ? 1 : 0;
  }
  return 0.05 * steps;
}

/// Grace of the fault matrix: 2 s and three samples of the receiver.
constexpr double kGrace_s = 2.6;

// Barometer and receiver agree with each other: the accelerometer along the plumb line is wrong.
TEST(InertialBarometer, is_right_where_the_receiver_climbs_with_it) {
  for (const float off_mps2 : {0.8F, -1.2F, 2.0F, -4.9F})
    for (const double lean_rad : {0.0, 0.25}) {
      Robot robot;
      robot.roll_rad = lean_rad;
      robot.run(60);
      const std::uint8_t before = robot.estimator.jump().count;
      robot.accel_bias_mps2 = {0.0F, 0.0F, off_mps2};
      EXPECT_LT(beyond_s(robot, 10), kGrace_s) << off_mps2 << ' ' << lean_rad;
      robot.accel_bias_mps2 = nav::Vector3::Zero();
      EXPECT_LT(beyond_s(robot, 10), kGrace_s) << off_mps2 << ' ' << lean_rad;
      EXPECT_EQ(robot.estimator.jump().count, before) << off_mps2 << ' ' << lean_rad << ": the zero stays";
      EXPECT_EQ(robot.last_air.verdict, sensor::Verdict::kAccepted) << off_mps2 << ' ' << lean_rad;
      EXPECT_LT(robot.height_sigma_m(), 1.5) << off_mps2 << ' ' << lean_rad;
    }
}

// A receiver that climbs alone, against barometer and IMU.
TEST(InertialBarometer, holds_the_height_against_a_receiver_that_climbs_alone) {
  for (const double lie_mps : {1.5, -3.0, 20.0}) {
    Robot robot;
    robot.run(60);
    robot.receiver_climbs_mps = lie_mps;
    EXPECT_LT(beyond_s(robot, 15), 0.5) << lie_mps;
    EXPECT_LT(std::abs(static_cast<double>(robot.now().state.v_n_mps(2))), 0.5) << lie_mps;
    robot.receiver_climbs_mps = 0;
    EXPECT_LT(beyond_s(robot, 10), 0.5) << lie_mps;
  }
}

// The barometer was right against a receiver that climbs alone, and falls silent. Then the accelerometer errs.
TEST(InertialBarometer, is_no_witness_against_the_receiver_once_it_is_silent) {
  Robot robot;
  robot.run(60);
  robot.gnss_places = false;
  robot.receiver_climbs_mps = 3;
  robot.run(2);
  robot.baro = false;
  robot.accel_bias_mps2 = {0.0F, 0.0F, -3.0F};
  robot.run(3);
  robot.receiver_climbs_mps = 0;
  robot.run(10);
  EXPECT_LT(std::abs(static_cast<double>(robot.now().state.v_n_mps(2))), 3.0);
  EXPECT_LT(std::abs(robot.height_off_m()), 100.0);
}

TEST(BarometerZero, counts_from_the_stamp_at_which_it_was_set) {
  constexpr std::int64_t kWrap_us = std::int64_t{1} << 32;
  for (const std::int64_t stamp_us : {std::int64_t{1}, std::int64_t{60'000'000}, kWrap_us - 1, kWrap_us}) {
    BarometerZero zero;
    EXPECT_FALSE(zero.known());
    zero.set(100, 90, 1, {stamp_us});
    EXPECT_TRUE(zero.known());
    for (const std::int64_t later_us : {0, 1, 200'000, 600'000'000}) {
      EXPECT_GE(zero.known_for({stamp_us + later_us}).us, later_us);
      EXPECT_LE(zero.known_for({stamp_us + later_us}).us, later_us + 1);
    }
  }
}

// The IMU alone carries the height, which a pressure that stands would hold back.
TEST(InertialBarometer, is_left_out_while_it_repeats_its_pressure) {
  Robot robot;
  robot.n.baro.stuck_samples = 20;
  drive(robot, 60);
  robot.gnss = false;
  climb(robot, 0.3);
  robot.stuck_air = true;
  drive(robot, 10);
  EXPECT_EQ(robot.last_air.verdict, sensor::Verdict::kStale);
  EXPECT_EQ(robot.last_air.failed, Check::kStuck);
  EXPECT_LT(std::abs(robot.height_off_m()), 2.0);
  robot.stuck_air = false;
  drive(robot, 1);
  EXPECT_NE(robot.last_air.verdict, sensor::Verdict::kStale);
}

TEST(InertialBarometer, does_not_take_a_silence_for_a_refusal) {
  Robot robot;
  drive(robot, 30);
  robot.baro = false;
  drive(robot, 10);
  robot.weather_Pa = [](double) { return -240.0; };
  robot.baro = true;
  drive(robot, 1);
  EXPECT_GT(robot.refused_airs, 10);
}

TEST(InertialBarometer, refuses_what_is_no_air) {
  Robot robot;
  drive(robot, 20);
  for (const float pressure_Pa : {0.0F, -1e5F, 1e3F, 3e5F, 3e38F, base::kInfinity, base::kNan})
    EXPECT_EQ(robot.estimator.fuse(sensor::AirPressure{.pressure_Pa = pressure_Pa}, {23'000'000}, robot.ctx()).verdict,
              sensor::Verdict::kNotFinite);
  drive(robot, 1);
  EXPECT_TRUE(robot.now().state.finite());
  EXPECT_EQ(robot.last_air.verdict, sensor::Verdict::kAccepted);
}

}  // namespace
}  // namespace tetap::estimators
