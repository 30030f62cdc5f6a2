// SPDX-License-Identifier: Apache-2.0
// The heading finder against the bank of hypotheses that it stands for, and in a world of its own. Drives of a car and
// a rover in double, an IMU with biases and a wrong level, GNSS velocity or position, wheels.
#include "tetap/nav/yaw_estimator.hpp"
#include "tetap/base/state_words.hpp"

#include "support/consistency.hpp"
#include "support/least_eigenvalue.hpp"
#include "tetap/base/random.hpp"
#include "true_body.hpp"

#include <gtest/gtest.h>
#include <Eigen/Dense>
#include <algorithm>
#include <complex>
#include <cstdio>
#include <functional>
#include <numbers>
#include <vector>

namespace tetap {
namespace {

using Eigen::Vector3d;
constexpr double kPi = std::numbers::pi, kGravity = 9.80665, kDt_s = 0.005;
constexpr std::int64_t kDt_us = 5'000;

/// Motion of a drive at a time: speed along the nose, turning.
struct Drive {
  const char* name;
  std::function<double(double)> speed_mps, rate_radps;
};
double ramp(double t, double from, double to) { return std::clamp((t - from) / (to - from), 0.0, 1.0); }

const Drive kCarTraffic{"car: speeds up, brakes, turns", [](double t) { return 6 + 4 * std::sin(0.35 * t); },
                        [](double t) { return 0.25 * std::sin(0.23 * t) * ramp(t, 3, 6); }};
const Drive kCarBend{"car at 12 m/s goes straight, then takes a bend", [](double) { return 12.0; },
                     [](double t) { return 0.25 * (ramp(t, 4, 5) - ramp(t, 14, 15)); }};
const Drive kRoverCircle{"rover circles at 1.5 m/s", [](double) { return 1.5; }, [](double) { return 0.4; }};
const Drive kRoverEight{"rover drives eights at 1 to 2 m/s", [](double t) { return 1.5 + 0.5 * std::sin(0.8 * t); },
                        [](double t) { return 0.6 * std::sin(0.3 * t); }};
const Drive kReverse{"rover reverses and turns", [](double t) { return -1.5 - 0.8 * std::sin(0.7 * t); },
                     [](double t) { return 0.3 * std::cos(0.2 * t); }};
const Drive kRoverCrawl{"rover at 0.5 m/s straight on", [](double) { return 0.5; }, [](double) { return 0.0; }};
const Drive kConstant{"constant velocity", [](double) { return 5.0; }, [](double) { return 0.0; }};
const Drive kStand{"standstill", [](double) { return 0.0; }, [](double) { return 0.0; }};

/// Errors of the sensors; one sigma, drawn per seed.
struct World {
  double gyro_bias_radps = 0.0087;  ///< 0.5 deg/s
  double accel_bias_mps2 = 0.1;
  double tilt_rad = 0.05;  ///< tilt of the level it is given
  double gyro_radps_rthz = 1e-4, accel_mps2_rthz = 0.01;
  double velocity_mps = 0.1;
  double position_m = 0;  ///< above zero: no velocity but this
  double wheels_mps = 0;  ///< above zero: wheels
  double shake_rad = 0.03;
  bool level = true;
  double slow_mps = 0;      ///< size of a velocity error that lasts 2 s
  double receiver_mps = 0;  ///< accuracy as the receiver states it; 0: the truth
  double gyro_scale = 0, wheel_scale = 0;
};

class Trial {
 public:
  nav::YawEstimator finder;

  Trial(const Drive& drive, const World& world, double yaw_rad, unsigned seed, const nav::YawFinderNoise& noise = {})
      : drive_(drive), world_(world), yaw_(yaw_rad), normal_(seed) {
    b_g_ = world.gyro_bias_radps * normal_.vector();
    b_a_ = world.accel_bias_mps2 * normal_.vector();
    q_ = attitude();
    v_ = velocity();
    const Vector3d wrong = world.tilt_rad * normal_.vector();
    const auto level = Eigen::AngleAxisd(1.1, Vector3d::UnitZ()) * test::exp_double({wrong(0), wrong(1), 0}) * q_;
    finder.noise = noise;
    finder.restart();
    if (world.level) finder.restart(test::as_float(level));
  }
  /// One IMU sample, and every fifth of a second GNSS, every twentieth wheels.
  void step() {
    const Vector3d v_before = v_;
    const Eigen::Quaterniond q_before = q_;
    move();
    const auto noise = [&](double density) { return Vector3d(density * std::sqrt(kDt_s) * normal_.vector()); };
    const Vector3d dtheta = (1 + world_.gyro_scale) * test::log_double(q_before.conjugate() * q_) + kDt_s * b_g_ +
                            noise(world_.gyro_radps_rthz);
    const Vector3d dv = q_before.conjugate() * (v_ - v_before + Vector3d(0, 0, kGravity * kDt_s)) + kDt_s * b_a_ +
                        noise(world_.accel_mps2_rthz);
    EXPECT_EQ(finder.predict(test::increment(dtheta, dv, kDt_us)), nav::ImuVerdict::kAccepted);
    ++steps_;
    const auto as_float = [](double x) { return static_cast<float>(x); };
    if (world_.wheels_mps > 0 && steps_ % 10 == 0)
      finder.fuse_forward_speed(
          as_float((1 + world_.wheel_scale) * drive_.speed_mps(t_) + world_.wheels_mps * normal_()),
          as_float(world_.wheels_mps));
    if (steps_ % 40 != 0) return;
    const nav::Complex lever =
        lever_known ? nav::Complex{as_float(lever_b_m(0)), as_float(lever_b_m(1))} : nav::Complex{};
    const Vector3d arm = q_ * lever_b_m;
    if (world_.position_m > 0) {
      const Vector3d at = p_ + arm + Vector3d(30'000, -20'000, 0) + world_.position_m * normal_.vector();
      finder.fuse_position(test::anchored(at(0)), test::anchored(at(1)), as_float(world_.position_m), lever);
    } else {
      const double keep = std::exp(-0.2 / 2.0);  // of the slow error
      if (world_.slow_mps > 0) slow_ = keep * slow_ + world_.slow_mps * std::sqrt(1 - keep * keep) * normal_.vector();
      const Vector3d swing = (arm - q_before * lever_b_m) / kDt_s;
      const Vector3d v = v_ + swing + slow_ + world_.velocity_mps * normal_.vector() + glitch;
      const double stated_mps = world_.receiver_mps > 0 ? world_.receiver_mps : world_.velocity_mps;
      finder.fuse_velocity(as_float(v(0)), as_float(v(1)), as_float(stated_mps), lever);
    }
  }
  void run(double seconds) {
    for (const double end = t_ + seconds; t_ < end - 1e-9;) step();
  }
  [[nodiscard]] double error_rad() const {
    return std::remainder(static_cast<double>(finder.yaw_rad()) - yaw_, 2 * kPi);
  }
  [[nodiscard]] double yaw_rad() const { return yaw_; }
  [[nodiscard]] double sigma_rad() const { return static_cast<double>(finder.sigma_rad()); }
  [[nodiscard]] double time_s() const { return t_; }

  /// Drives on, but no sample comes.
  void lose(double seconds) {
    for (const double end = t_ + seconds; t_ < end - 1e-9;) move();
    finder.predict_without_imu({static_cast<std::int64_t>(seconds * 1e6)});
  }
  [[nodiscard]] double gyro_bias_z_radps() const { return b_g_(2); }

  Vector3d glitch = Vector3d::Zero(), lever_b_m = Vector3d::Zero();
  bool lever_known = true;  ///< the filter is given the lever

 private:
  void move() {
    const Vector3d v_before = v_;
    yaw_ += kDt_s * drive_.rate_radps(t_ + 0.5 * kDt_s);
    t_ += kDt_s;
    q_ = attitude();
    v_ = velocity();
    p_ += 0.5 * kDt_s * (v_before + v_);
  }
  Eigen::Quaterniond attitude() const {
    const double pitch = world_.shake_rad * std::sin(2.1 * t_), roll = world_.shake_rad * std::sin(1.7 * t_ + 1);
    return Eigen::AngleAxisd(yaw_, Vector3d::UnitZ()) * Eigen::AngleAxisd(pitch, Vector3d::UnitY()) *
           Eigen::AngleAxisd(roll, Vector3d::UnitX());
  }
  Vector3d velocity() const { return drive_.speed_mps(t_) * Vector3d(std::cos(yaw_), std::sin(yaw_), 0); }

  Drive drive_;
  World world_;
  double yaw_, t_ = 0;
  test::Normal normal_;
  Vector3d b_g_, b_a_, v_, p_ = Vector3d::Zero(), slow_ = Vector3d::Zero();
  Eigen::Quaterniond q_;
  int steps_ = 0;
};

struct Figures {
  double nees = 0, worst = 0, rms_rad = 0, sigma_rad = 0;  ///< at the end, of those that are ready
  double ready_median_s = 0, ready_worst_s = 0;
  double ready_error = 0;  ///< the largest error over sigma while ready, ever
  double ready_share = 0;
  unsigned restarts = 0;
  int runs = 0;
};

Figures monte_carlo(const Drive& drive, const World& world, double seconds, int headings, unsigned seeds,
                    const nav::YawFinderNoise& noise = {}) {
  Figures f;
  std::vector<double> ready;
  double at_end = 0;
  for (int heading = 0; heading < headings; ++heading) {
    for (unsigned seed = 0; seed < seeds; ++seed) {
      Trial r(drive, world, 2 * kPi * heading / headings - kPi, 1000 * seed + static_cast<unsigned>(heading), noise);
      double first = seconds;
      while (r.time_s() < seconds - 1e-9) {
        r.run(0.2);
        if (!r.finder.ready()) continue;
        first = std::min(first, r.time_s());
        f.ready_error = std::max(f.ready_error, std::abs(r.error_rad()) / r.sigma_rad());
      }
      ready.push_back(first);
      const double over = r.error_rad() / r.sigma_rad();
      f.nees += over * over, ++f.runs;
      f.worst = std::max(f.worst, std::abs(over));
      f.rms_rad += r.error_rad() * r.error_rad();
      f.sigma_rad += r.sigma_rad();
      f.restarts += r.finder.restarts();
      at_end += r.finder.ready() ? 1 : 0;
    }
  }
  f.nees /= f.runs, f.sigma_rad /= f.runs, f.rms_rad = std::sqrt(f.rms_rad / f.runs);
  f.ready_share = at_end / f.runs;
  std::sort(ready.begin(), ready.end());
  f.ready_median_s = ready[ready.size() / 2], f.ready_worst_s = ready.back();
  std::printf(
      "%-48s ready %5.1f s (worst %5.1f, at end %3.0f %%), rms %5.2f deg, sigma %5.2f deg, NEES %5.2f, worst "
      "%4.1f sigma at end, %4.1f ever, %u restarts\n",
      drive.name, f.ready_median_s, f.ready_worst_s, 100 * f.ready_share, f.rms_rad * 180 / kPi,
      f.sigma_rad * 180 / kPi, f.nees, f.worst, f.ready_error, f.restarts);
  return f;
}

using Complexd = std::complex<double>;
Complexd wide(nav::Complex z) { return {static_cast<double>(z.re), static_cast<double>(z.im)}; }
nav::Complex narrow(Complexd z) { return {static_cast<float>(z.real()), static_cast<float>(z.imag())}; }

/// The filter's covariance as the one of twice as many real numbers.
template <int N>
Eigen::MatrixXd real_covariance(const nav::ComplexKalman<N>& f) {
  Eigen::MatrixXd p(2 * N, 2 * N);
  for (int r = 0; r < N; ++r) {
    for (int c = 0; c < N; ++c) {
      const Complexd e = wide(f.covariance(r, c));
      p.block<2, 2>(2 * r, 2 * c) << e.real() / 2, -e.imag() / 2, e.imag() / 2, e.real() / 2;
    }
  }
  return p;
}
Eigen::Matrix2d times(Complexd c) {
  Eigen::Matrix2d m;
  m << c.real(), -c.imag(), c.imag(), c.real();
  return m;
}

TEST(ComplexKalman, IsTheKalmanFilterOfTwiceAsManyRealNumbers) {
  constexpr int kN = 4;
  nav::ComplexKalman<kN> f;
  Eigen::VectorXd x = Eigen::VectorXd::Zero(2 * kN);
  Eigen::MatrixXd p = Eigen::MatrixXd::Zero(2 * kN, 2 * kN);
  base::Random random(7);
  const auto some = [&] { return nav::Complex{random.normal(), random.normal()}; };
  const auto set_real = [&](int i, nav::Complex value, float variance) {
    x.segment<2>(2 * i) << static_cast<double>(value.re), static_cast<double>(value.im);
    p.middleRows(2 * i, 2).setZero();
    p.middleCols(2 * i, 2).setZero();
    p(2 * i, 2 * i) = p(2 * i + 1, 2 * i + 1) = static_cast<double>(variance) / 2;
  };
  for (int i = 0; i < kN; ++i) {
    const nav::Complex value = some();
    f.set(i, value, 2.0F);
    set_real(i, value, 2.0F);
  }
  for (int step = 0; step < 300; ++step) {
    const int i = static_cast<int>(random.next() % kN), j = (i + 1 + static_cast<int>(random.next() % (kN - 1))) % kN;
    const nav::Complex c = some() * 0.3F;
    Eigen::MatrixXd a = Eigen::MatrixXd::Identity(2 * kN, 2 * kN);
    switch (step % 4) {
      case 0:
        f.add(i, c, j);
        a.block<2, 2>(2 * i, 2 * j) = times(wide(c));
        x = a * x, p = a * p * a.transpose();
        break;
      case 1: {
        std::array<nav::Complex, kN> direction{};
        Eigen::MatrixXd g(2 * kN, 2);
        for (int k = 0; k < kN; ++k) {
          direction[static_cast<std::size_t>(k)] = some();
          g.middleRows<2>(2 * k) = times(wide(direction[static_cast<std::size_t>(k)]));
        }
        f.spread(direction, 0.02F);
        p += 0.02 / 2 * g * g.transpose();
        break;
      }
      case 2: {
        const nav::Complex z = f.value(i) + c * f.value(j) + some() * 0.3F;
        Eigen::MatrixXd h = Eigen::MatrixXd::Zero(2, 2 * kN);
        h.block<2, 2>(0, 2 * i) = Eigen::Matrix2d::Identity();
        h.block<2, 2>(0, 2 * j) = times(wide(c));
        const Eigen::Matrix2d s = h * p * h.transpose() + 0.05 * Eigen::Matrix2d::Identity();
        const Eigen::MatrixXd k = p * h.transpose() * s.inverse();
        x += k * (Eigen::Vector2d(static_cast<double>(z.re), static_cast<double>(z.im)) - h * x);
        p -= k * s * k.transpose();
        ASSERT_EQ(f.update(i, c, j, z, 0.1F, 1e9F), nav::ComplexKalman<kN>::Verdict::kAccepted);
        break;
      }
      default:
        f.scale(i, 0.9F);
        a.block<2, 2>(2 * i, 2 * i) *= static_cast<double>(0.9F);
        x = a * x, p = a * p * a.transpose();
    }
    if (step == 150) f.set(2, {1, 2}, 0.5F), set_real(2, {1, 2}, 0.5F);
    ASSERT_LT((real_covariance(f) - p).norm(), 2e-5 * p.norm()) << step;
    for (int k = 0; k < kN; ++k)
      ASSERT_LT(std::abs(wide(f.value(k)) - Complexd(x(2 * k), x(2 * k + 1))), 1e-4 * (1 + x.norm())) << step;
  }
}

TEST(ComplexKalman, AGateRefusesWithoutATrace) {
  nav::ComplexKalman<2> f;
  f.set(0, {1, 0}, 1.0F);
  f.set(1, {0, 1}, 1.0F);
  EXPECT_EQ(f.update(0, {1, 0}, 1, {9, 9}, 0.1F, 13.8F), nav::ComplexKalman<2>::Verdict::kRefused);
  EXPECT_EQ(f.update(0, {1, 0}, 1, {base::kNan, 0}, 0.1F, 13.8F), nav::ComplexKalman<2>::Verdict::kRefused);
  EXPECT_EQ(f.update(0, {1, 0}, 1, {0, 0}, base::kNan, 13.8F), nav::ComplexKalman<2>::Verdict::kSingular);
  EXPECT_EQ(wide(f.value(0)), Complexd(1, 0));
  EXPECT_EQ(base::bits(f.variance(0)), base::bits(1.0F));
}

/// One filter of phasors equals a bank of 360 hypotheses. Each of them is a Kalman filter (in double) of velocity and
/// accelerometer bias with a known yaw, weighted by its likelihoods. The weights are the von Mises density.
TEST(YawEstimator, OneFilterOfPhasorsIsABankOf360Hypotheses) {
  constexpr int kBank = 360;
  base::Random random(11);
  const auto noise = [&random] { return wide({random.normal(), random.normal()}); };
  const double yaw = 2.3, r = 2 * 0.1 * 0.1, q = 2 * 0.02 * 0.02;
  const Complexd bias = 0.1 * noise();
  nav::ComplexKalman<3> f;  // velocity, z, z times the bias
  f.set(0, {}, 200.0F);
  f.set(1, {}, 1.0F);
  f.set(2, {}, 0.02F);
  std::vector<Eigen::Vector2cd> x(kBank, Eigen::Vector2cd::Zero());
  std::vector<double> log_weight(kBank, 0.0);
  Eigen::Matrix2cd p = Eigen::Vector2cd(200.0, 0.02).asDiagonal();
  Complexd v(1.0, -2.0);
  double widest = 0;
  for (int step = 0; step < 100; ++step) {
    const double turned = 0.05 * step;  // the gyroscope knows this
    const Complexd e = std::polar(1.0, turned), force = 0.3 * Complexd(std::sin(0.1 * step), 0.2);  // in 0.2 s
    v += std::polar(1.0, yaw) * e * force + std::sqrt(q / 2) * noise();
    const Complexd shown = e * (force - 0.2 * bias);
    const Complexd z = v + std::sqrt(r / 2) * noise();
    // The phasors.
    f.add(0, narrow(shown), 1);
    f.add(0, narrow(0.2 * e), 2);
    f.add_noise(0, static_cast<float>(q));
    ASSERT_EQ(f.update(0, {}, 1, narrow(z), static_cast<float>(r), 1e9F), nav::ComplexKalman<3>::Verdict::kAccepted);
    // The bank: all have one covariance.
    Eigen::Matrix2cd a;
    a << 1.0, 0.2 * e, 0.0, 1.0;
    p = a * p * a.adjoint();
    p(0, 0) += q;
    const double s = p(0, 0).real() + r;
    const Eigen::Vector2cd gain = p.col(0) / s;
    for (std::size_t k = 0; k < kBank; ++k) {
      x[k] = a * x[k] + Eigen::Vector2cd(std::polar(1.0, 2 * kPi * static_cast<double>(k) / kBank) * shown, 0.0);
      const Complexd nu = z - x[k](0);
      log_weight[k] -= std::norm(nu) / s;
      x[k] += gain * nu;
    }
    p -= gain * s * gain.adjoint();
    // To the same zero.
    const double kappa = 2 * std::abs(wide(f.value(1))) / static_cast<double>(f.variance(1));
    const double mean = std::arg(wide(f.value(1)));
    double offset = 0;
    for (std::size_t k = 0; k < kBank; ++k) offset += log_weight[k] / kBank;  // of a cosine the mean is zero
    for (std::size_t k = 0; k < kBank; ++k) {
      const double is = kappa * std::cos(2 * kPi * static_cast<double>(k) / kBank - mean);
      ASSERT_NEAR(log_weight[k] - offset, is, 2e-3 * (1 + kappa)) << "step " << step << ", hypothesis " << k;
    }
    widest = std::max(widest, kappa);
  }
  EXPECT_GT(widest, 50.0);
  EXPECT_LT(std::abs(std::remainder(std::arg(wide(f.value(1))) - yaw, 2 * kPi)), 0.2);
}

struct Case {
  const Drive& drive;
  World world;
  double seconds, ready_median_s, ready_worst_s, rms_deg;
};
TEST(YawEstimator, EndsAlignedFromEveryHeadingInEveryMotionThatShowsIt) {
  const World plain, own_level{.level = false}, wheels{.wheels_mps = 0.05}, places{.position_m = 1.5};
  const Case cases[] = {
      {kCarTraffic, plain, 20, 6, 8, 2.5},     {kCarTraffic, own_level, 20, 6, 8, 2.5},
      {kCarTraffic, places, 40, 15, 20, 5},    {kCarBend, plain, 20, 6, 8, 3},
      {kRoverEight, plain, 30, 8, 16, 2},      {kRoverEight, own_level, 30, 8, 16, 2},
      {kRoverEight, places, 60, 40, 55, 6},    {kReverse, plain, 30, 8, 12, 3},
      {kReverse, own_level, 30, 8, 12, 3},     {kCarTraffic, wheels, 5, 1.01, 1.01, 1.5},
      {kRoverCircle, wheels, 5, 1.01, 2.1, 3}, {kRoverEight, wheels, 5, 1.01, 2.1, 3},
      {kReverse, wheels, 5, 1.01, 2.1, 3},     {kConstant, wheels, 5, 1.01, 1.01, 1.5},
      {kRoverCrawl, wheels, 10, 3, 5, 4},
  };
  for (const Case& c : cases) {
    const Figures f = monte_carlo(c.drive, c.world, c.seconds, 36, 2);
    EXPECT_EQ(f.ready_share, 1.0) << c.drive.name;
    EXPECT_LT(f.worst, 3.0) << c.drive.name;
    EXPECT_LT(f.ready_error, 4.5) << c.drive.name;
    EXPECT_LE(f.ready_median_s, c.ready_median_s) << c.drive.name;
    EXPECT_LE(f.ready_worst_s, c.ready_worst_s) << c.drive.name;
    EXPECT_LT(f.rms_rad * 180 / kPi, c.rms_deg) << c.drive.name;
  }
}

/// The filter told what the world is like, and no floor: then its sigma is neither too small nor too large.
nav::YawFinderNoise matched(const World& w) {
  return {.accel_mps2_rthz = static_cast<float>(w.accel_mps2_rthz),
          .gyro_radps_rthz = static_cast<float>(w.gyro_radps_rthz),
          .gyro_scale = 0,
          .accel_bias_mps2 = static_cast<float>(w.accel_bias_mps2),
          .gyro_bias_radps = static_cast<float>(w.gyro_bias_radps),
          .tilt_rad = static_cast<float>(w.tilt_rad),
          .floor_rad = 1e-4F};
}
TEST(YawEstimator, SaysHowWrongItIs) {
  for (const auto& [drive, world, seconds] :
       std::initializer_list<std::tuple<Drive, World, double>>{{kCarTraffic, {}, 10},
                                                               {kCarTraffic, {}, 30},
                                                               {kRoverEight, {}, 20},
                                                               {kReverse, {}, 20},
                                                               {kCarBend, {}, 20},
                                                               {kRoverEight, {.position_m = 1.0}, 60}}) {
    const Figures f = monte_carlo(drive, world, seconds, 36, 4, matched(world));
    EXPECT_GT(f.nees, 0.5) << drive.name;
    EXPECT_LT(f.nees, 1.4) << drive.name;
  }
}

TEST(YawEstimator, StaysUndecidedWhereNothingShowsTheHeading) {
  for (const Drive& drive : {kStand, kConstant}) {
    for (const World& world : {World{}, World{.level = false}, World{.position_m = 1.5}, World{.velocity_mps = 0.03}}) {
      const Figures f = monte_carlo(drive, world, 60, 12, 2);
      EXPECT_EQ(f.ready_share, 0.0) << drive.name;
      EXPECT_EQ(f.ready_error, 0.0) << "was ready";
      EXPECT_GT(f.sigma_rad, 1.3) << drive.name;
    }
  }
  // Wheels that stand still do not show it either.
  const Figures f = monte_carlo(kStand, {.wheels_mps = 0.05}, 60, 12, 2);
  EXPECT_EQ(f.ready_error, 0.0);
}

TEST(YawEstimator, AnHourOfStandstillShowsNothing) {
  Trial r(kStand, {.velocity_mps = 0.05}, 1.0, 3);
  for (int second = 0; second < 3600; ++second) {
    r.run(1);
    ASSERT_FALSE(r.finder.ready()) << second;
    ASSERT_GT(r.sigma_rad(), 0.3) << second;
  }
  EXPECT_EQ(r.finder.restarts(), 0U);
}

/// Round and round, the acceleration is as fixed in the body as what the biases feign.
TEST(YawEstimator, ACircleAloneShowsNoHeading) {
  for (unsigned seed = 0; seed < 12; ++seed) {
    Trial r(kRoverCircle, {}, 0.5 * seed, seed);
    while (r.time_s() < 60) {
      r.run(0.5);
      ASSERT_FALSE(r.finder.ready()) << seed << ' ' << r.time_s();
    }
  }
}

TEST(YawEstimator, FindsTheGyroscopesBias) {
  double largest = 0;
  for (unsigned seed = 0; seed < 8; ++seed) {
    Trial r(kRoverEight, {}, -2.0, seed);
    r.run(120);
    EXPECT_NEAR(static_cast<double>(r.finder.bias_radps()), r.gyro_bias_z_radps(), 1e-3) << seed;
    largest = std::max(largest, std::abs(r.gyro_bias_z_radps()));
  }
  EXPECT_GT(largest, 8e-3) << "0.5 deg/s was among them";
}

TEST(YawEstimator, OneWrongVelocityDoesNotRuinIt) {
  for (const double jump : {2.0, 5.0, 50.0}) {
    for (const double when : {0.0, 2.0, 10.0}) {
      for (unsigned seed = 0; seed < 8; ++seed) {
        Trial r(kCarTraffic, {}, 0.8 * seed, seed);
        r.run(when);
        r.glitch = jump * Vector3d(std::cos(seed), std::sin(seed), 0);
        r.run(0.2);
        r.glitch.setZero();
        while (r.time_s() < 25) {
          r.run(0.2);
          ASSERT_FALSE(r.finder.ready() && std::abs(r.error_rad()) > 4 * r.sigma_rad()) << jump << " at " << when;
        }
        EXPECT_TRUE(r.finder.ready()) << jump << " at " << when;
        EXPECT_LT(std::abs(r.error_rad()), 3 * r.sigma_rad()) << jump << " at " << when;
      }
    }
  }
}

TEST(YawEstimator, VelocitiesThatStayWrongMakeItBeginAnew) {
  Trial r(kCarTraffic, {}, 1.0, 5);
  r.run(15);
  ASSERT_TRUE(r.finder.ready());
  r.glitch = {8, -5, 0};
  r.run(0.9);
  EXPECT_EQ(r.finder.restarts(), 0U);
  r.run(0.2);
  EXPECT_EQ(r.finder.restarts(), 1U);
  EXPECT_FALSE(r.finder.ready());
  EXPECT_GT(r.sigma_rad(), 1.5);
  r.run(15);  // a constant error of the velocity does not matter to how it changes
  EXPECT_TRUE(r.finder.ready());
  EXPECT_LT(std::abs(r.error_rad()), 3 * r.sigma_rad());
}

/// Worse than it believes: a slow error in the velocities, wheels and gyroscope that show too much, vibration.
TEST(YawEstimator, KeepsItsWordInAWorseWorld) {
  for (const Drive& drive : {kCarTraffic, kRoverEight, kReverse}) {
    for (const double wheels : {0.0, 0.05}) {
      World worse{.accel_mps2_rthz = 0.05, .velocity_mps = 0.05, .wheels_mps = wheels};
      worse.receiver_mps = 0.1, worse.slow_mps = 0.05;
      worse.gyro_scale = 0.01, worse.wheel_scale = 0.03;
      const Figures f = monte_carlo(drive, worse, 30, 18, 2);
      EXPECT_LT(f.ready_error, 4.5) << drive.name;
      EXPECT_GT(f.ready_share, 0.9) << drive.name;
    }
  }
}

TEST(YawEstimator, JudgesAnotherHeading) {
  Trial r(kCarTraffic, {}, 2.0, 9);
  EXPECT_EQ(r.finder.against(0, 0.1F), 0.0F) << "knows nothing yet";
  double worst_right = 0, least_wrong = 1e9;
  for (r.run(15); r.time_s() < 60; r.run(0.2)) {
    ASSERT_TRUE(r.finder.ready());
    const auto at = [&](double off) {
      return static_cast<double>(
          r.finder.against(static_cast<float>(std::remainder(r.yaw_rad() + off, 2 * kPi)), 0.03F));
    };
    worst_right = std::max(worst_right, at(0));
    least_wrong = std::min({least_wrong, at(0.5), at(-0.5), at(kPi), at(-2.0)});
  }
  EXPECT_LT(worst_right, 2.0);
  EXPECT_GT(least_wrong, 5.0);
}

TEST(YawEstimator, AnAntennaBesideTheImuIsTakenAlong) {
  for (const bool velocity : {true, false}) {
    for (const bool lever_known : {true, false}) {
      Trial r(kRoverEight, {.position_m = velocity ? 0.0 : 0.05}, 1.0, 21);
      r.lever_b_m = {-1.5, 1.0, 0};
      r.lever_known = lever_known;
      r.run(40);
      EXPECT_EQ(lever_known, r.finder.ready() && std::abs(r.error_rad()) < 0.06) << velocity;
    }
  }
}

TEST(YawEstimator, SamplesThatWereLostCostCertaintyNotTruth) {
  for (unsigned seed = 0; seed < 12; ++seed) {
    Trial r(kCarTraffic, {}, 0.5 * seed, seed);
    r.run(15);
    const double before = r.sigma_rad();
    r.lose(0.3);
    EXPECT_GT(r.sigma_rad(), before + 0.1);
    r.run(20);
    EXPECT_TRUE(r.finder.ready());
    EXPECT_LT(std::abs(r.error_rad()), 3 * r.sigma_rad());
  }
}

/// All of the state, as numbers.
std::vector<std::uint32_t> bits_of(const nav::YawEstimator& finder) {
  struct Sink {
    std::vector<std::uint32_t> all;
    void operator()(std::uint32_t word) { all.push_back(word); }
  } sink;
  base::each_word(finder, sink);
  return sink.all;
}

TEST(YawEstimator, TheSameInputsGiveTheSameBits) {
  Trial a(kRoverEight, {.wheels_mps = 0.05}, 1.0, 4), b(kRoverEight, {.wheels_mps = 0.05}, 1.0, 4);
  a.run(20), b.run(20);
  EXPECT_EQ(bits_of(a.finder), bits_of(b.finder));
  b.run(0.005);
  EXPECT_NE(bits_of(a.finder), bits_of(b.finder));
  a.finder.restart(), b.finder.restart();
  Trial fresh(kRoverEight, {.level = false}, 1.0, 4);
  EXPECT_EQ(bits_of(a.finder).size(), bits_of(fresh.finder).size());
}

TEST(YawEstimator, NumbersThatNoSensorMeansChangeNothing) {
  Trial r(kCarTraffic, {}, 1.0, 4);
  r.run(12);
  const auto before = bits_of(r.finder);
  const nav::Vector3 zero = nav::Vector3::Zero();
  for (const float bad : {base::kNan, base::kInfinity, -base::kInfinity, 3e38F}) {
    for (int axis = 0; axis < 3; ++axis) {
      nav::ImuIncrement imu{.dtheta_b_rad = zero, .dv_b_mps = {0, 0, 0.05F}, .dt = {5'000}};
      imu.dtheta_b_rad(axis) = bad;
      EXPECT_NE(r.finder.predict(imu), nav::ImuVerdict::kAccepted);
      imu.dtheta_b_rad(axis) = 0, imu.dv_b_mps(axis) = bad;
      EXPECT_NE(r.finder.predict(imu), nav::ImuVerdict::kAccepted);
    }
    r.finder.fuse_velocity(bad, 0, 0.1F);
    r.finder.fuse_velocity(0, bad, 0.1F);
    r.finder.fuse_velocity(0, 0, bad);
    r.finder.fuse_velocity(0, 0, 0.1F, {bad, 0});
    r.finder.fuse_velocity(0, 0, 0.1F, {0, bad});
    r.finder.fuse_position({.anchor_um = 0, .offset_m = bad}, {}, 1);
    r.finder.fuse_position({}, {.anchor_um = 0, .offset_m = bad}, 1);
    r.finder.fuse_position({}, {}, bad);
    r.finder.fuse_forward_speed(bad, 0.1F);
    r.finder.fuse_forward_speed(1, bad);
  }
  r.finder.fuse_velocity(0, 0, 0);
  r.finder.fuse_velocity(0, 0, -1);
  r.finder.predict_without_imu({-1});
  for (const std::int64_t dt : {0, -5'000, 300'000})
    EXPECT_EQ(r.finder.predict({.dtheta_b_rad = zero, .dv_b_mps = {0, 0, 0.05F}, .dt = {dt}}),
              nav::ImuVerdict::kBadInterval);
  EXPECT_EQ(bits_of(r.finder), before);
  nav::YawEstimator levelled;
  for (const nav::Quaternion& q : {nav::Quaternion{base::kNan, 0, 0, 0}, nav::Quaternion{0, 0, 0, 0}}) {
    levelled.restart(q);
    EXPECT_EQ(bits_of(levelled), bits_of(nav::YawEstimator{})) << "a level that is none";
  }
}

/// Accepted input may still be nonsense.
TEST(YawEstimator, StaysFiniteWhateverComes) {
  base::Random random(99);
  const auto wild = [&] { return random.normal() * base::exp(6 * random.normal()); };
  nav::YawEstimator f;
  int accepted = 0;
  for (int i = 0; i < 300'000; ++i) {
    const nav::ImuIncrement imu{.dtheta_b_rad = {0.01F * wild(), 0.01F * wild(), 0.01F * wild()},
                                .dv_b_mps = {0.05F * wild(), 0.05F * wild(), 0.05F * wild()},
                                .dt = {static_cast<std::int64_t>(random.next() % 220'000U)}};
    accepted += f.predict(imu) == nav::ImuVerdict::kAccepted ? 1 : 0;
    if (i % 7 == 0) f.fuse_velocity(wild(), wild(), base::exp(3 * random.normal()), {wild(), wild()});
    if (i % 11 == 0) f.fuse_forward_speed(wild(), base::exp(3 * random.normal()), {wild(), wild()});
    if (i % 13 == 0)
      f.fuse_position({.anchor_um = static_cast<std::int64_t>(random.next()) << 20, .offset_m = wild()}, {},
                      base::exp(3 * random.normal()));
    if (i % 997 == 0) f.predict_without_imu({static_cast<std::int64_t>(random.next())});
    ASSERT_TRUE(base::is_finite(f.yaw_rad()) && base::is_finite(f.sigma_rad())) << i;
    ASSERT_TRUE(f.yaw_rad() <= base::kPi && f.yaw_rad() >= -base::kPi);
    for (int k = 0; k < 7; ++k) ASSERT_TRUE(base::is_finite(f.filter().variance(k))) << i;
  }
  EXPECT_GT(accepted, 100'000);
}

TEST(YawEstimator, AMillionStepsWithoutAMeasurement) {
  nav::YawEstimator f;
  const nav::ImuIncrement imu{.dtheta_b_rad = {1e-5F, 0, 2e-5F}, .dv_b_mps = {0.001F, 0, 0.049F}, .dt = {5'000}};
  for (int i = 0; i < 1'000'000; ++i) ASSERT_EQ(f.predict(imu), nav::ImuVerdict::kAccepted);
  EXPECT_TRUE(base::is_finite(f.yaw_rad()));
  EXPECT_FALSE(f.ready());
  EXPECT_GT(f.restarts(), 0U) << "blind for more than an hour: what it thought was worth nothing";
}

TEST(YawEstimator, ItsCovarianceStaysPositiveForHours) {
  for (const double sigma : {0.1, 0.01}) {
    Trial r(kRoverEight, {.velocity_mps = sigma, .wheels_mps = 0.05}, 1.0, 31);
    for (int minute = 0; minute < 60; ++minute) {
      r.run(60);
      const Eigen::MatrixXd p =
          real_covariance(r.finder.filter()).bottomRightCorner(12, 12);  // no position is measured
      ASSERT_GT(test::least_eigenvalue(p), 1e-5) << minute;
      ASSERT_TRUE(r.finder.ready());
      ASSERT_LT(std::abs(r.error_rad()), 0.05);
    }
    EXPECT_EQ(r.finder.restarts(), 0U);
  }
}

TEST(YawEstimator, WithTheNoseUpThereIsNoHeading) {
  nav::YawEstimator f;
  f.restart(nav::from_euler({.pitch_rad = -1.5F}));
  EXPECT_EQ(f.predict({.dv_b_mps = {0.049F, 0, 0}, .dt = {5'000}}), nav::ImuVerdict::kAccepted);
  EXPECT_EQ(f.restarts(), 1U);
  EXPECT_GT(f.sigma_rad(), 1.8F);
}

TEST(YawEstimator, IsSmall) { EXPECT_LE(sizeof(nav::YawEstimator), 400U); }

}  // namespace
}  // namespace tetap
