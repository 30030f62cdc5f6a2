// SPDX-License-Identifier: Apache-2.0
// Health of an IMU, sample by sample. Then what the inertial estimator does about it, and when it takes itself to be
// standing, in a small world of its own. Each sample is fused at its own time.
#include "tetap/checks/imu_health.hpp"

#include "tetap/estimators/inertial/inertial.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace tetap::checks {
namespace {

class Sensor {
 public:
  explicit Sensor(int rate_hz = 100) : rate_hz_(rate_hz) {}
  ImuHealth watch;
  param::InertialParameters n;
  float force_mps2 = 0, rate_radps = 0;  ///< amplitudes of a vibration of 31 Hz
  std::uint8_t clipped_gyro = 0, clipped_accel = 0;
  std::int64_t us = 1'000'000;

  sensor::ImuSample next() {
    const float dt_s = 1.0F / static_cast<float>(rate_hz_);
    us += 1'000'000 / rate_hz_;
    const float wave = static_cast<float>(std::sin(6.283185307 * 31e-6 * static_cast<double>(us)));
    sensor::ImuSample s{.interval_us = static_cast<std::uint16_t>(1'000'000 / rate_hz_),
                        .clipped_gyro = clipped_gyro,
                        .clipped_accel = clipped_accel};
    for (std::size_t i = 0; i < 3; ++i) {
      s.dangle_b_rad[i] = 1e-6F * normal_(engine_);
      s.dvelocity_b_mps[i] = 1e-5F * normal_(engine_);
    }
    s.dangle_b_rad[0] += rate_radps * wave * dt_s;
    s.dvelocity_b_mps[2] += (9.81F + force_mps2 * wave) * dt_s;
    return last_ = s;
  }
  bool update() {
    const sensor::ImuSample sample = next();
    return watch.update(sample, {us}, n);
  }
  bool repeat() {
    us += 1'000'000 / rate_hz_;
    return watch.update(last_, {us}, n);
  }
  void run(double s) {
    for (int i = 0; i < std::lround(s * rate_hz_); ++i) update();
  }

 private:
  int rate_hz_;
  sensor::ImuSample last_;
  std::mt19937 engine_{3};
  std::normal_distribution<float> normal_;
};

TEST(ImuHealth, ASampleRepeatedTenTimesIsOneOfAStuckSensorUntilItShowsAnother) {
  Sensor s;
  s.run(1);
  for (int i = 1; i < s.n.stuck_samples; ++i) EXPECT_TRUE(s.repeat()) << i;
  EXPECT_FALSE(s.repeat());
  EXPECT_TRUE(s.watch.stuck());
  for (int i = 0; i < 1000; ++i) ASSERT_FALSE(s.repeat());
  EXPECT_TRUE(s.update());
  EXPECT_FALSE(s.watch.stuck());
  EXPECT_TRUE(s.watch.stuck_lately({s.us + 500'000}));
  EXPECT_FALSE(s.watch.stuck_lately({s.us + 1'500'000}));
}

TEST(ImuHealth, HalfASensorThatIsStuckIsStuck) {
  for (const bool gyro : {false, true}) {
    Sensor s;
    s.run(0.1);
    const sensor::ImuSample held = s.next();
    bool accepted = true;
    for (int i = 0; i <= s.n.stuck_samples; ++i) {
      sensor::ImuSample sample = s.next();
      (gyro ? sample.dangle_b_rad : sample.dvelocity_b_mps) = gyro ? held.dangle_b_rad : held.dvelocity_b_mps;
      accepted = s.watch.update(sample, {s.us}, s.n);
    }
    EXPECT_FALSE(accepted) << (gyro ? "gyroscope" : "accelerometer");
  }
}

// Both halves take turns, so an axis is found after twice the readings, whatever value it keeps.
TEST(ImuHealth, OneAxisThatKeepsItsValueWhileBothOthersChangeIsStuck) {
  for (std::size_t axis = 0; axis < 6; ++axis) {
    for (const float kept : {0.0F, 0.003F}) {
      Sensor s;
      s.run(1);
      int found = -1;
      for (int i = 0; i < 100; ++i) {
        sensor::ImuSample sample = s.next();
        (axis < 3 ? sample.dangle_b_rad : sample.dvelocity_b_mps)[axis % 3] = kept;
        if (!s.watch.update(sample, {s.us}, s.n) && found < 0) found = i;
      }
      EXPECT_GE(found, 2 * StuckAxis::kReadings - 2) << axis << ' ' << kept;
      EXPECT_LE(found, 2 * StuckAxis::kReadings + 2) << axis << ' ' << kept;
      EXPECT_TRUE(s.watch.axis_stuck());
      s.run(0.05);
      EXPECT_FALSE(s.watch.stuck()) << "it moves again";
    }
  }
}

TEST(ImuHealth, AStuckAxisIsNotLookedForWhereRepetitionsMayBeOneOfTheSensor) {
  Sensor s;
  s.n.stuck_samples = 0;
  for (int i = 0; i < 1000; ++i) {
    sensor::ImuSample sample = s.next();
    sample.dangle_b_rad[1] = 0;
    ASSERT_TRUE(s.watch.update(sample, {s.us}, s.n));
  }
}

// A yaw gyroscope alone shows two axes of nothing; a coarse sensor at rest repeats each axis at every other sample.
TEST(ImuHealth, NeitherTwoAxesThatAreNotThereNorACoarseResolutionAreAStuckAxis) {
  Sensor one;
  for (int i = 0; i < 5'000; ++i) {
    sensor::ImuSample sample = one.next();
    sample.dangle_b_rad[0] = sample.dangle_b_rad[1] = 0;
    ASSERT_TRUE(one.watch.update(sample, {one.us}, one.n));
  }
  for (const float noise : {0.3F, 0.5F, 1.0F}) {  // in steps of the sensor; the third axis is twice as noisy
    Sensor s;
    std::mt19937 engine{5};
    std::normal_distribution<float> normal;
    int stuck = 0;
    for (int i = 0; i < 300'000; ++i) {
      sensor::ImuSample sample = s.next();
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const float sigma = axis == 2 ? 2 * noise : noise;
        sample.dangle_b_rad[axis] = 1e-5F * std::round(sigma * normal(engine));
        sample.dvelocity_b_mps[axis] = 5e-5F * std::round(sigma * normal(engine));
      }
      s.watch.update(sample, {s.us}, s.n);
      stuck += s.watch.axis_stuck() ? 1 : 0;
    }
    EXPECT_EQ(stuck, 0) << noise;
  }
}

// A wild sample is doubted by as much as it is beyond what motion and vibration do; the same within them is not.
TEST(ImuHealth, ASampleThatLeapsIsDoubtedInProportion) {
  const auto leap_of = [](float rate_radps, float force_mps2, float shaken_radps) {
    Sensor s;
    s.rate_radps = shaken_radps;
    s.run(3);
    sensor::ImuSample sample = s.next();
    sample.dangle_b_rad[1] += 0.01F * rate_radps;
    sample.dvelocity_b_mps[1] += 0.01F * force_mps2;
    s.watch.update(sample, {s.us}, s.n);
    return s.watch.vibration().leaps() ? s.watch.vibration().leap() : Vibration::Leap{};
  };
  EXPECT_EQ(leap_of(2, 0, 0).rate_radps, 0.0F);
  EXPECT_EQ(leap_of(0, 30, 0).force_mps2, 0.0F);
  const float small = leap_of(6, 0, 0).rate_radps, large = leap_of(26, 0, 0).rate_radps;
  EXPECT_GT(small, 2.0F);
  EXPECT_LT(small, 6.0F);
  EXPECT_NEAR(large - small, 20, 4);
  const float push = leap_of(0, 60, 0).force_mps2, blow = leap_of(0, 140, 0).force_mps2;
  EXPECT_GT(push, 10.0F);
  EXPECT_LT(push, 60.0F);
  EXPECT_NEAR(blow - push, 80, 16);
  EXPECT_EQ(leap_of(6, 0, 3).rate_radps, 0.0F) << "as large as the vibration allows";
  Sensor s;
  s.run(1);
  for (int i = 0; i < 100; ++i) {  // a robot that turns ever faster, 10 rad/s^2, and brakes as hard as tyres hold
    sensor::ImuSample sample = s.next();
    sample.dangle_b_rad[2] += 0.01F * 0.1F * static_cast<float>(i);
    sample.dvelocity_b_mps[0] -= 0.01F * 9.0F;
    s.watch.update(sample, {s.us}, s.n);
    ASSERT_FALSE(s.watch.vibration().leaps()) << i;
  }
}

TEST(ImuHealth, IsStaleWhenNothingHasBeenSaidForTheStatedTime) {
  Sensor s;
  EXPECT_FALSE(s.watch.stale({s.us}, s.n)) << "before it has begun";
  s.run(0.1);
  EXPECT_FALSE(s.watch.stale({s.us + s.n.stale_us}, s.n));
  EXPECT_TRUE(s.watch.stale({s.us + s.n.stale_us + 1}, s.n));
  for (int i = 0; i < 40; ++i) s.repeat();
  EXPECT_TRUE(s.watch.stale({s.us}, s.n)) << "repetitions say nothing";
}

TEST(ImuHealth, CountsSamplesWithAClippedAxisAndSaysSoForASecond) {
  Sensor s;
  s.run(0.5);
  EXPECT_FALSE(s.watch.clipped_lately({s.us}));
  s.clipped_accel = 3;
  s.run(0.05);
  s.clipped_accel = 0, s.clipped_gyro = 1;
  s.run(0.05);
  s.clipped_gyro = 0;
  EXPECT_EQ(s.watch.report().clipped, 10);
  s.run(0.9);
  EXPECT_TRUE(s.watch.clipped_lately({s.us}));
  s.run(0.2);
  EXPECT_FALSE(s.watch.clipped_lately({s.us}));
  s.clipped_gyro = 1;
  for (int i = 0; i < 70'000; ++i) s.update();
  EXPECT_EQ(s.watch.report().clipped, 0xFFFF) << "stays at the end";
}

TEST(ImuHealth, VibrationIsTheRmsOfWhatIsFasterThanMotion) {
  for (const int rate_hz : {100, 200, 400}) {
    Sensor s(rate_hz);
    s.force_mps2 = 6, s.rate_radps = 0.8F;
    s.run(3);
    EXPECT_NEAR(s.watch.report().vibration_mps2, 6 / std::sqrt(2.0), 0.5) << rate_hz;
    EXPECT_NEAR(s.watch.report().vibration_radps, 0.8 / std::sqrt(2.0), 0.07) << rate_hz;
  }
}

TEST(ImuHealth, ASteadyForceAndASteadyTurnAreNoVibration) {
  Sensor s;
  for (int i = 0; i < 300; ++i) {
    sensor::ImuSample sample = s.next();
    sample.dangle_b_rad[2] += 0.02F, sample.dvelocity_b_mps[0] += 0.03F;
    s.watch.update(sample, {s.us}, s.n);
  }
  EXPECT_LT(s.watch.report().vibration_mps2, 0.05);
  EXPECT_LT(s.watch.report().vibration_radps, 0.05);
  EXPECT_TRUE(s.watch.calm(s.n)) << "which is why it alone does not tell standing still from constant velocity";
}

TEST(ImuHealth, NoiseGrowsInProportionToVibrationBeyondWhatTheNumbersHoldFor) {
  Sensor s;
  s.run(3);
  EXPECT_EQ(s.watch.vibration().noise_factor(s.n), 1.0F);
  EXPECT_FALSE(s.watch.vibration().shaken());
  s.force_mps2 = 5 * s.n.vibration_mps2 * std::sqrt(2.0F);
  s.run(5);
  EXPECT_NEAR(s.watch.vibration().noise_factor(s.n), 5, 0.5);
  EXPECT_TRUE(s.watch.vibration().shaken());
  s.force_mps2 = 0, s.rate_radps = 3 * s.n.vibration_radps * std::sqrt(2.0F);
  s.run(5);
  EXPECT_NEAR(s.watch.vibration().noise_factor(s.n), 3, 0.4) << "whichever sensor is shaken more";
  s.rate_radps = 1.5F * s.n.vibration_radps * std::sqrt(2.0F);
  s.run(5);
  EXPECT_TRUE(s.watch.vibration().shaken()) << "said from twice, until it is once";
  s.rate_radps = 0;
  s.run(5);
  EXPECT_FALSE(s.watch.vibration().shaken());
}

/// On a circle or straight on at a constant speed, or standing; GNSS at 5 Hz, IMU and wheels at 100.
class Robot {
 public:
  explicit Robot(double speed_mps, double turn_radps = 0, float bias_walk = 1e-5F) : v_(speed_mps), w_(turn_radps) {
    n.inertial.gyro_bias_radps2_rthz = bias_walk;
    n.loop.window_us = 0;
    n.wheels.drive = {.left_radius_m = 0.1F, .right_radius_m = 0.1F, .track_m = 0.5F, .counts_per_turn = 2000};
    n.inertial.gyro_radps_rthz = 1e-4F, n.inertial.accel_mps2_rthz = 2e-3F;
    map_frame.frame = nav::LocalFrame(24'131'350'000, 5'834'150'000, 500.0F);
    map_frame.origin = sensor::OriginSource::kConfigured;
    estimator.restart({us}, ctx());
    estimator.set_pose({us}, {.sigma_position_m = 0.5F, .sigma_yaw_rad = 0.02F}, ctx());
    estimator.fuse(sensor::GnssVelocity{.v_n_mps = {static_cast<float>(v_), 0, 0}, .acc_mps = 0.05F}, {us}, ctx());
  }
  param::Parameters n;
  estimators::MapFrame map_frame;
  estimators::Inertial estimator;
  bool imu = true, stuck = false, wheels = true, gnss = true;
  double spin_mps = 0;
  std::uint8_t clipped_gyro = 0, clipped_accel = 0;
  std::int64_t us = 1'000'000;
  double worst_ratio = 0, worst_m = 0;
  int nominal = 0;
  estimators::Innovation of_wheels;

  void run(double duration_s) {
    for (int i = 0; i < std::lround(duration_s * 100); ++i) step();
  }
  [[nodiscard]] estimators::Context ctx() const { return {n, map_frame}; }
  [[nodiscard]] estimators::InertialEstimate now() const { return estimator.inertial(ctx()); }
  [[nodiscard]] sensor::Mode mode() const { return estimator.mode(ctx()); }
  [[nodiscard]] bool says(sensor::Fault fault) const { return estimator.faults() >> static_cast<unsigned>(fault) & 1U; }
  [[nodiscard]] double sigma(int i) const { return std::sqrt(static_cast<double>(now().p(i, i))); }
  [[nodiscard]] double off_m() const {
    const auto e = estimator.estimate(ctx());
    return std::hypot(static_cast<double>(e.pose.x.minus(base::Anchored{})) - x_,
                      static_cast<double>(e.pose.y.minus(base::Anchored{})) - y_);
  }
  [[nodiscard]] double yaw_off_rad() const {
    return std::remainder(static_cast<double>(nav::euler(now().state.q_nb).yaw_rad) - yaw_, 6.283185307179586);
  }

 private:
  void step() {
    const double dt = 0.01;
    yaw_ += 0.5 * w_ * dt;
    x_ += v_ * std::cos(yaw_) * dt, y_ += v_ * std::sin(yaw_) * dt;
    yaw_ += 0.5 * w_ * dt;
    us += 10'000;
    if (imu) {
      if (!stuck) {
        sample_ = {.interval_us = 10'000, .clipped_gyro = clipped_gyro, .clipped_accel = clipped_accel};
        for (std::size_t i = 0; i < 3; ++i) {
          sample_.dangle_b_rad[i] = 1e-5F * normal_(engine_);
          sample_.dvelocity_b_mps[i] = 2e-4F * normal_(engine_);
        }
        sample_.dangle_b_rad[2] += static_cast<float>(clipped_gyro > 0 ? 0 : w_ * dt);
        sample_.dvelocity_b_mps[1] += static_cast<float>(w_ * v_ * dt);
        sample_.dvelocity_b_mps[2] += 9.8073F * 0.01F;
      }
      estimator.fuse(sample_, {us}, ctx());
    }
    left_m_ += (v_ - 0.25 * w_) * dt, right_m_ += (v_ + 0.25 * w_ + spin_mps) * dt;
    if (wheels) {
      const auto count = [](double m) {
        return static_cast<std::uint16_t>(std::llround(m / (6.283185307 * 0.1 / 2000)) & 0xFFFF);
      };
      of_wheels = estimator.fuse(sensor::WheelCounts{.left = count(left_m_), .right = count(right_m_)}, {us}, ctx());
    }
    if (gnss && us % 200'000 == 0) {
      const auto z = [&] { return static_cast<double>(normal_(engine_)); };
      const double north = y_ + 0.5 * z(), east = x_ + 0.5 * z();
      const double latitude = 48.2627 + north / 111'200.0, per_east = 1 / (111'320.0 * std::cos(48.2627 / 57.29577951));
      const double vx = v_ * std::cos(yaw_) + 0.05 * z(), vy = v_ * std::sin(yaw_) + 0.05 * z();
      estimator.fuse(sensor::GnssPosition{.latitude_2ndeg = std::llround(latitude / 2e-9),
                                          .longitude_2ndeg = std::llround((11.6683 + east * per_east) / 2e-9),
                                          .height_m = 500,
                                          .horizontal_acc_m = 0.5F,
                                          .vertical_acc_m = 1,
                                          .fix = sensor::GnssFix::k3d,
                                          .satellites = 10},
                     {us}, ctx());
      estimator.fuse(sensor::GnssVelocity{.v_n_mps = {static_cast<float>(vx), static_cast<float>(vy),
                                                      static_cast<float>(0.05 * z())},
                                          .acc_mps = 0.05F},
                     {us}, ctx());
    }
    estimator.advance({us}, ctx(), {});
    if (mode() == sensor::Mode::kNominal) ++nominal;
    worst_m = std::max(worst_m, off_m());
    worst_ratio = std::max(worst_ratio, off_m() / (3 * std::max(sigma(0), sigma(1))));
  }

  double v_, w_, x_ = 0, y_ = 0, yaw_ = 0, left_m_ = 0, right_m_ = 0;
  sensor::ImuSample sample_;
  std::mt19937 engine_{11};
  std::normal_distribution<float> normal_;
};

TEST(ImuHealth, AStuckOrAbsentImuIsBridgedByWheelsAndGnssNeverNominalAndBackAfterwards) {
  for (const bool stuck : {true, false}) {
    Robot r(1.5, 0.4);
    r.run(20);
    ASSERT_EQ(r.mode(), sensor::Mode::kNominal);
    r.worst_ratio = r.worst_m = 0;
    (stuck ? r.stuck : r.imu) = stuck;
    r.run(0.15);
    r.nominal = 0;
    for (int i = 0; i < 1000; ++i) {
      r.run(0.01);
      ASSERT_TRUE(r.says(stuck ? sensor::Fault::kSensorStuck : sensor::Fault::kInputStale)) << i;
      ASSERT_LT(std::abs(r.yaw_off_rad()), 3 * r.sigma(8)) << i;
    }
    (stuck ? r.stuck : r.imu) = !stuck;
    r.run(0.5);
    EXPECT_EQ(r.nominal, 0) << "nor right after";
    r.run(5);
    EXPECT_EQ(r.mode(), sensor::Mode::kNominal);
    EXPECT_EQ(r.estimator.faults(), 0);
    EXPECT_LT(r.worst_ratio, 1);
    EXPECT_LT(r.worst_m, 1.5);
  }
}

TEST(ImuHealth, WithoutImuAndWheelsTheDoubtGrowsUntilNothingCarriesIt) {
  Robot r(1.5, 0.4);
  r.run(20);
  r.imu = r.wheels = false;
  r.run(1);
  EXPECT_EQ(r.mode(), sensor::Mode::kDegraded) << "GNSS carries it";
  r.run(9);
  EXPECT_LT(r.worst_ratio, 1);
  const double with_gnss = r.sigma(0);
  r.gnss = false;
  r.run(5);
  EXPECT_EQ(r.mode(), sensor::Mode::kWaitingForImu);
  EXPECT_GT(r.sigma(0), 3 * with_gnss);
  EXPECT_LT(r.worst_ratio, 1);
}

// Two samples may come late; what has not come after that was not seen, at the end of the window as anywhere in it.
TEST(ImuHealth, AHoleAtTheEndIsDoubtedBeforeItIsASilence) {
  Robot r(1.5, 0.4);
  r.run(20);
  r.wheels = r.gnss = r.imu = false;
  const auto sigma_mps = [&] { return std::sqrt(static_cast<double>(r.now().covariance<3>())); };
  const double before_mps = sigma_mps();
  r.run(0.02);
  EXPECT_LT(sigma_mps(), 1.1 * before_mps);
  r.run(0.03);
  EXPECT_FALSE(r.says(sensor::Fault::kInputStale));
  const auto gap_mps2 = static_cast<double>(r.n.inertial.gap_mps2);
  EXPECT_NEAR(sigma_mps(), std::hypot(before_mps, gap_mps2 * std::sqrt(0.1 * 0.05)), 0.1 * sigma_mps());
  EXPECT_NEAR(static_cast<double>(r.now().ahead.var_p), 0.1 * 0.05 * std::pow(gap_mps2 * 0.5 * 0.05, 2), 1e-6)
      << "a way not seen, too";
  r.imu = true;
  r.run(0.01);
  EXPECT_LT(std::abs(r.yaw_off_rad()), 3 * r.sigma(8));
}

TEST(ImuHealth, AClippedGyroscopeIsReplacedByWheelsAndWithoutThemIsAsUncertainAsNone) {
  Robot a(1.5, 0.4), b(1.5, 0.4);
  b.wheels = false;
  for (Robot* r : {&a, &b}) {
    r->run(20);
    const double before = r->sigma(8);
    r->clipped_gyro = 5;
    r->run(2);
    EXPECT_TRUE(r->says(sensor::Fault::kImuClipped));
    EXPECT_EQ(r->now().imu.clipped, 200);
    EXPECT_GT(r->sigma(8), 3 * before);
    EXPECT_LT(std::abs(r->yaw_off_rad()), 3 * r->sigma(8));
  }
  EXPECT_LT(a.sigma(8), 0.5 * b.sigma(8));
  EXPECT_NEAR(a.estimator.estimate(a.ctx()).yaw_rate_radps, 0.4F, 0.05F) << "as the wheels show it";
  EXPECT_LT(std::abs(a.yaw_off_rad()), 0.1) << "it did not show 0.8 rad";
}

// The turn it still shows, so only the velocity is in doubt: by a walk of the force that may have gone unseen.
TEST(ImuHealth, AClippedAccelerometerMakesTheVelocityDoubtedAndNothingOfTheTurn) {
  Robot good(1.5, 0.4), clipped(1.5, 0.4);
  for (Robot* r : {&good, &clipped}) {
    r->run(20);
    r->gnss = r->wheels = false;  // nothing but the IMU goes on
    r->clipped_accel = r == &clipped ? 7 : 0;
    r->run(1);
  }
  EXPECT_TRUE(clipped.says(sensor::Fault::kImuClipped));
  EXPECT_FALSE(good.says(sensor::Fault::kImuClipped));
  EXPECT_EQ(clipped.now().imu.clipped, 100);
  const double unseen_mps = static_cast<double>(good.n.inertial.gap_mps2) * std::sqrt(0.1 * 1);
  for (const int i : {3, 4, 5}) {
    const double grown_mps = std::sqrt(std::pow(clipped.sigma(i), 2) - std::pow(good.sigma(i), 2));
    EXPECT_NEAR(grown_mps, unseen_mps, 0.02 * unseen_mps) << i;
  }
  EXPECT_NEAR(clipped.sigma(8), good.sigma(8), 1e-4 * good.sigma(8));
  clipped.gnss = clipped.wheels = true;
  clipped.clipped_accel = 0;
  clipped.run(5);
  EXPECT_FALSE(clipped.says(sensor::Fault::kImuClipped));
  EXPECT_LT(clipped.sigma(3), 0.1) << "and it is told again how fast it is";
}

TEST(ImuHealth, OneSpinningWheelIsSaidAtOnceAndCostsNearlyNothing) {
  Robot r(1.5, 0.4);
  r.run(20);
  const double before = r.off_m();
  r.spin_mps = 2;
  r.run(0.1);
  EXPECT_TRUE(r.says(sensor::Fault::kWheelSlip));
  EXPECT_EQ(r.mode(), sensor::Mode::kDegraded);
  r.gnss = false;  // the other wheel and the gyroscope alone
  for (int i = 0; i < 490; ++i) {
    r.run(0.01);
    ASSERT_EQ(r.of_wheels.verdict, sensor::Verdict::kAccepted) << i;
  }
  EXPECT_NEAR(r.off_m(), before, 0.15);
  r.spin_mps = 0;
  r.gnss = true;
  r.run(2);
  EXPECT_FALSE(r.says(sensor::Fault::kWheelSlip));
}

TEST(Standstill, ConstantVelocityIsNoneWithoutWheels) {
  for (const double speed : {0.3, 2.0}) {
    Robot r(speed);
    r.wheels = false;
    r.run(60);
    EXPECT_NEAR(static_cast<double>(r.now().state.v_n_mps(0)), speed, 0.1);
    EXPECT_LT(r.worst_ratio, 1);
  }
}

TEST(Standstill, IsFoundWithoutWheelsAndTheGyroscopesBiasLearnt) {
  Robot stands(0), drives(0.5);
  for (Robot* r : {&stands, &drives}) {
    r->wheels = false;
    r->run(30);
  }
  EXPECT_LT(stands.sigma(14), 0.3 * drives.sigma(14));
  EXPECT_LT(stands.sigma(14), 3e-4);
}

TEST(Standstill, DoesNotMakeItSurerThanItsSamplesCan) {
  for (const bool wheels : {true, false}) {
    Robot r(0, 0, 1e-8F);
    r.wheels = wheels;
    r.run(60);
    // The mean of 60 s of white noise of this density; and what may go unnoticed is no smaller for being looked at.
    EXPECT_GT(r.sigma(14), static_cast<double>(r.n.inertial.gyro_radps_rthz) / std::sqrt(60.0));
    if (wheels) {
      EXPECT_GT(r.sigma(3), 0.5 * static_cast<double>(r.n.inertial.still_mps));
    }
  }
}

}  // namespace
}  // namespace tetap::checks
