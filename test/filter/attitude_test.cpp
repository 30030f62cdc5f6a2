// SPDX-License-Identifier: Apache-2.0
// Attitude: laws that hold for any motion first (equivariance, scaling, independence), then what a disturbed sensor may
// do and how it ends. Truth is a double quaternion; sensors are ideal but for what a test adds.
#include "tetap/filter/attitude.hpp"

#include "tetap/filter/mahony.hpp"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <vector>

namespace tetap::filter {
namespace {

constexpr float kDt_s = 0.005F;
constexpr double kDegree = 3.14159265358979323846 / 180.0;

using Vec = Eigen::Vector3d;
using Quat = Eigen::Quaterniond;

struct Sample {
  Vector3 rate, force, field;
};

Quat turn(const Vec& axis, double angle) { return Quat(Eigen::AngleAxisd(angle, axis.normalized())); }
Quat wide(const Quaternion& q) {
  return {static_cast<double>(q.w), static_cast<double>(q.x), static_cast<double>(q.y), static_cast<double>(q.z)};
}
Vector3 narrow(const Vec& v) { return v.cast<float>(); }
double degrees_between(const Quat& a, const Quat& b) { return a.angularDistance(b) / kDegree; }
double inclination_deg(const Quat& estimate, const Quat& truth) {
  return 2.0 * std::asin(0.5 * (estimate.conjugate() * Vec::UnitZ() - truth.conjugate() * Vec::UnitZ()).norm()) /
         kDegree;
}
bool finite(const Quaternion& q) {
  return std::isfinite(q.w) && std::isfinite(q.x) && std::isfinite(q.y) && std::isfinite(q.z);
}
bool same_bits(const Quaternion& a, const Quaternion& b) {
  return base::bits(a.w) == base::bits(b.w) && base::bits(a.x) == base::bits(b.x) &&
         base::bits(a.y) == base::bits(b.y) && base::bits(a.z) == base::bits(b.z);
}

/// A body that turns and is pushed about, and what its sensors say of it.
class Motion {
 public:
  Quat truth = Quat::Identity();
  Vec field_n{0.0, 17.0, -46.0};  ///< north and down
  Vec bias_radps = Vec::Zero();
  std::function<Vec(double)> rate_radps = [](double) { return Vec(Vec::Zero()); };
  std::function<Vec(double)> push_n_mps2 = [](double) { return Vec(Vec::Zero()); };
  std::function<Vec(double)> magnet_b = [](double) { return Vec(Vec::Zero()); };
  double noise = 0.0;  ///< 1: 0.1 degrees/s, 0.03 m/s^2, 0.3 uT

  Sample next() {
    const Vec w = rate_radps(time_s_ + 0.5 * kDt);
    truth = truth * turn(w.norm() > 0 ? w : Vec(Vec::UnitX()), w.norm() * kDt);
    truth.normalize();
    time_s_ += kDt;
    const Quat back = truth.conjugate();
    return {narrow(w + bias_radps + noisy(0.1 * kDegree)),
            narrow(back * (Vec(0.0, 0.0, 9.81) + push_n_mps2(time_s_)) + noisy(0.03)),
            narrow(back * field_n + magnet_b(time_s_) + noisy(0.3))};
  }
  [[nodiscard]] double time_s() const { return time_s_; }

 private:
  static constexpr double kDt = static_cast<double>(kDt_s);
  Vec noisy(double sigma) {
    const double x = normal_(engine_), y = normal_(engine_), z = normal_(engine_);
    return noise * sigma * Vec(x, y, z);
  }
  double time_s_ = 0.0;
  std::mt19937 engine_{7};
  std::normal_distribution<double> normal_;
};

Vec tumbling(double t) { return {1.1 * std::sin(0.9 * t), 0.8 * std::cos(1.3 * t), 0.7 * std::sin(0.5 * t + 1.0)}; }
Vec jolting(double t) { return {3.0 * std::cos(7.0 * t), 2.0 * std::sin(9.0 * t), 4.0 * std::cos(11.0 * t)}; }

void feed(Attitude& filter, const Sample& s) {
  ASSERT_EQ(filter.step(s.rate, s.force, kDt_s), AttitudeVerdict::kAccepted);
  ASSERT_TRUE(filter.magnetometer(s.field, kDt_s));
}

/// Runs both for a time and gives the worst error on the way, in degrees.
double worst_error_deg(Attitude& filter, Motion& motion, double seconds) {
  double worst = 0.0;  // NaN would not be noticed by max
  for (const double end = motion.time_s() + seconds; motion.time_s() < end;) {
    feed(filter, motion.next());
    EXPECT_TRUE(finite(filter.q_nb()));
    worst = std::max(worst, degrees_between(wide(filter.q_nb()), motion.truth));
  }
  return worst;
}

std::vector<Sample> recorded(double seconds) {
  Motion motion;
  motion.rate_radps = tumbling;
  motion.push_n_mps2 = [](double t) { return Vec(0.3 * jolting(t)); };  // no verdict hangs on the last bit
  motion.bias_radps = Vec(0.003, -0.004, 0.002);
  motion.noise = 1.0;
  std::vector<Sample> samples;
  while (motion.time_s() < seconds) samples.push_back(motion.next());
  return samples;
}

std::vector<Quaternion> answers(const std::vector<Sample>& samples, const AttitudeOptions& options = {},
                                float dt_s = kDt_s, const SensorRange& range = {}) {
  Attitude filter(options, range);
  std::vector<Quaternion> result;
  for (const Sample& s : samples) {
    static_cast<void>(filter.step(s.rate, s.force, dt_s));
    filter.magnetometer(s.field, dt_s);
    result.push_back(filter.q_nb());
  }
  return result;
}

// --- Laws.

TEST(Attitude, turns_with_the_world_about_the_vertical) {
  const std::vector<Sample> samples = recorded(30.0);
  const std::vector<Quaternion> before = answers(samples);
  for (const double angle : {0.3, -1.2, 2.5, 3.1}) {
    // The world, field and truth, is turned; in body axes only the direction of north differs.
    Attitude filter(AttitudeOptions{.declination_rad = static_cast<float>(-angle)});
    const Quat turned_world = turn(Vec::UnitZ(), angle);
    double worst = 0.0;
    for (std::size_t k = 0; k < samples.size(); ++k) {
      feed(filter, samples[k]);
      worst = std::max(worst, degrees_between(wide(filter.q_nb()), turned_world * wide(before[k])));
    }
    EXPECT_LT(worst, 0.01) << "by " << angle;
  }
}

TEST(Attitude, does_not_care_how_the_axes_of_the_body_are_named) {
  const std::vector<Sample> samples = recorded(60.0);
  const std::vector<Quaternion> before = answers(samples);
  int orientations = 0;
  for (int first = 0; first < 3; ++first)
    for (int second = 0; second < 3; ++second)
      for (const double a : {1.0, -1.0})
        for (const double b : {1.0, -1.0}) {
          if (first == second) continue;
          Eigen::Matrix3d axes = Eigen::Matrix3d::Zero();
          axes(0, first) = a;
          axes(1, second) = b;
          axes.row(2) = axes.row(0).cross(axes.row(1));
          const Eigen::Matrix3f relabel = axes.cast<float>();
          std::vector<Sample> other;
          for (const Sample& s : samples) other.push_back({relabel * s.rate, relabel * s.force, relabel * s.field});
          const std::vector<Quaternion> after = answers(other);
          // The bias filter takes one horizontal axis after the other, and the first sample decides where they point.
          double worst = 0.0;
          for (std::size_t k = 8000; k < samples.size(); ++k)
            worst = std::max(worst, degrees_between(wide(after[k]), wide(before[k]) * Quat(axes).conjugate()));
          EXPECT_LT(worst, 0.02) << axes;
          ++orientations;
        }
  EXPECT_EQ(orientations, 24);
}

TEST(Attitude, gives_the_same_bits_when_all_times_are_doubled) {
  const std::vector<Sample> samples = recorded(30.0);
  AttitudeOptions slow;
  for (float* time : {&slow.tau_inclination_s, &slow.inclination_hold_s, &slow.bias_walk_s, &slow.rest_after_s,
                      &slow.tau_rest_s, &slow.tau_heading_s})
    *time *= 2.0F;
  for (float* rate :
       {&slow.inclination_limit_radps, &slow.bias_start_sigma_radps, &slow.bias_walk_radps, &slow.bias_limit_radps,
        &slow.bias_motion_sigma_radps, &slow.bias_rest_sigma_radps, &slow.rest_rate_radps})
    *rate *= 0.5F;
  SensorRange slow_range;
  slow_range.gyroscope_radps *= 0.5F;
  std::vector<Sample> slower = samples;
  for (Sample& s : slower) s.rate *= 0.5F;
  const std::vector<Quaternion> a = answers(samples), b = answers(slower, slow, 2.0F * kDt_s, slow_range);
  for (std::size_t k = 0; k < a.size(); ++k) ASSERT_TRUE(same_bits(a[k], b[k])) << "sample " << k;
}

TEST(Attitude, does_not_care_about_the_unit_of_the_magnetometer) {
  const std::vector<Sample> samples = recorded(20.0);
  std::vector<Sample> other = samples;
  for (Sample& s : other) s.field *= 0.015625F;
  const std::vector<Quaternion> a = answers(samples), b = answers(other);
  for (std::size_t k = 0; k < a.size(); ++k) ASSERT_TRUE(same_bits(a[k], b[k])) << "sample " << k;
}

TEST(Attitude, keeps_inclination_and_bias_free_of_whatever_the_magnetometer_says) {
  std::vector<Sample> samples = recorded(30.0);
  Attitude ctx, without;
  std::mt19937 engine(3);
  std::normal_distribution<float> normal;
  for (const Sample& s : samples) {
    static_cast<void>(ctx.step(s.rate, s.force, kDt_s));
    ctx.magnetometer({normal(engine), normal(engine), normal(engine)}, kDt_s);
    static_cast<void>(without.step(s.rate, s.force, kDt_s));
    ASSERT_EQ(base::bits(ctx.bias_b_radps()(0)), base::bits(without.bias_b_radps()(0)));
    ASSERT_LT(inclination_deg(wide(ctx.q_nb()), wide(without.q_nb())), 1e-4);
  }
}

/// The body tumbles for 60 s among jolts; the worst error after 20 s, in degrees, of a filter that runs at this rate.
double error_at_rate_deg(double rate_hz) {
  const double dt_s = 1.0 / rate_hz;
  const Vec field_n(0.0, 17.0, -46.0);
  Quat truth = Quat::Identity();
  Attitude filter;
  double worst = 0.0;
  for (int k = 0; k < static_cast<int>(60.0 * rate_hz); ++k) {
    const double t = k * dt_s;
    const Vec w = tumbling(t + 0.5 * dt_s);
    truth = (truth * turn(w, w.norm() * dt_s)).normalized();
    const Quat back = truth.conjugate();
    EXPECT_EQ(filter.step(narrow(w), narrow(back * (Vec(0.0, 0.0, 9.81) + jolting(t))), static_cast<float>(dt_s)),
              AttitudeVerdict::kAccepted);
    EXPECT_TRUE(filter.magnetometer(narrow(back * field_n), static_cast<float>(dt_s)));
    if (t > 20.0) worst = std::max(worst, degrees_between(wide(filter.q_nb()), truth));
  }
  return worst;
}
TEST(Attitude, is_as_good_at_any_sampling_rate) {
  const double reference = error_at_rate_deg(200.0);
  EXPECT_LT(reference, 1.5);
  for (const double rate_hz : {50.0, 100.0, 500.0, 1000.0})
    EXPECT_NEAR(error_at_rate_deg(rate_hz), reference, 0.3) << rate_hz << " Hz";
}

TEST(Attitude, does_not_care_about_a_range_that_is_not_reached) {
  const std::vector<Sample> samples = recorded(20.0);  // up to 1.5 rad/s
  const std::vector<Quaternion> a = answers(samples),
                                b = answers(samples, {}, kDt_s, {.gyroscope_radps = 2.0F, .accelerometer_mps2 = 40.0F});
  for (std::size_t k = 0; k < a.size(); ++k) ASSERT_TRUE(same_bits(a[k], b[k])) << "sample " << k;
}

TEST(Attitude, stays_a_unit_quaternion) {
  for (const Quaternion& q : answers(recorded(60.0))) ASSERT_NEAR(q.norm2(), 1.0F, 2e-6F);
}

// --- Start.

TEST(Attitude, is_right_from_the_first_sample_at_any_attitude) {
  std::mt19937 engine(1);
  std::normal_distribution<double> normal;
  for (int k = 0; k < 2000; ++k) {
    Motion motion;
    // Random ones, and those where a formula may break: upside down, on the side, a quarter turn of heading.
    const double w = normal(engine), x = normal(engine), y = normal(engine), z = normal(engine);
    motion.truth = k < 24 ? turn(Vec::UnitZ(), (k % 4) * 90 * kDegree) *
                                turn(k < 16 ? Vec(Vec::UnitX()) : Vec(Vec::UnitY()), ((k / 4) % 4) * 90 * kDegree)
                          : Quat(w, x, y, z).normalized();
    Attitude filter;
    feed(filter, motion.next());
    ASSERT_LT(degrees_between(wide(filter.q_nb()), motion.truth), 0.1) << k;
  }
}

TEST(Attitude, settles_within_a_second_from_any_attitude_with_noise_and_a_jolt_at_the_start) {
  std::mt19937 engine(2);
  std::normal_distribution<double> normal;
  for (int k = 0; k < 100; ++k) {
    Motion motion;
    const double w = normal(engine), x = normal(engine), y = normal(engine), z = normal(engine);
    motion.truth = Quat(w, x, y, z).normalized();
    motion.noise = 1.0;
    motion.bias_radps = Vec(0.5, -0.5, 0.5) * kDegree;
    motion.push_n_mps2 = [](double t) { return t < 0.05 ? Vec(5.0, -5.0, 0.0) : Vec(Vec::Zero()); };
    Attitude filter;
    worst_error_deg(filter, motion, 0.95);
    EXPECT_LT(worst_error_deg(filter, motion, 0.05), 3.0) << k;
  }
}

TEST(Attitude, waits_for_an_accelerometer_that_says_something) {
  Attitude filter;
  EXPECT_EQ(filter.step(Vector3::Zero(), Vector3::Zero(), kDt_s), AttitudeVerdict::kRefused);
  EXPECT_FALSE(filter.magnetometer({0.0F, 17.0F, -46.0F}, kDt_s));
  EXPECT_FALSE(filter.started());
  EXPECT_EQ(filter.step(Vector3::Zero(), {0.0F, 0.0F, 9.81F}, kDt_s), AttitudeVerdict::kAccepted);
  EXPECT_TRUE(filter.started());
  EXPECT_FALSE(filter.heading_known());
}

// --- Gyroscope bias.

TEST(Attitude, learns_the_bias_at_rest_about_all_axes) {
  Motion motion;
  motion.noise = 1.0;
  motion.truth = turn(Vec(1, 2, 3), 1.0);
  motion.bias_radps = Vec(0.8, -0.6, 0.4) * kDegree;
  Attitude filter;
  for (int k = 0; k < 6000; ++k) {  // no magnetometer: the vertical axis is the gyroscope's own
    const Sample s = motion.next();
    ASSERT_EQ(filter.step(s.rate, s.force, kDt_s), AttitudeVerdict::kAccepted);
  }
  EXPECT_TRUE(filter.at_rest());
  EXPECT_LT((filter.bias_b_radps().cast<double>() - motion.bias_radps).norm(), 0.05 * kDegree);
  EXPECT_LT(filter.bias_sigma_radps(), 0.1F * AttitudeOptions::kDegree);
}

TEST(Attitude, learns_the_bias_in_motion_that_never_rests) {
  Motion motion;
  motion.noise = 1.0;
  motion.rate_radps = tumbling;
  motion.push_n_mps2 = jolting;
  motion.bias_radps = Vec(0.4, -0.3, 0.2) * kDegree;
  Attitude filter;
  for (int k = 0; k < 60'000; ++k) {
    const Sample s = motion.next();
    ASSERT_EQ(filter.step(s.rate, s.force, kDt_s), AttitudeVerdict::kAccepted);
    ASSERT_FALSE(filter.at_rest());
  }
  EXPECT_LT((filter.bias_b_radps().cast<double>() - motion.bias_radps).norm(), 0.1 * kDegree);
}

TEST(Attitude, never_takes_a_slow_turn_for_rest_beyond_the_limit_of_a_bias) {
  Motion motion;
  motion.rate_radps = [](double) { return Vec(0.0, 0.0, 5.0 * kDegree); };
  Attitude filter;
  EXPECT_LT(worst_error_deg(filter, motion, 30.0), 0.5);
  EXPECT_FALSE(filter.at_rest());
  EXPECT_LT(filter.bias_b_radps().norm(), 0.1F * AttitudeOptions::kDegree);
}

// --- Disturbed accelerometer.

TEST(Attitude, averages_motion_out_of_the_vertical) {
  Motion motion;
  motion.rate_radps = tumbling;
  motion.push_n_mps2 = jolting;
  Attitude filter;
  worst_error_deg(filter, motion, 10.0);
  EXPECT_LT(worst_error_deg(filter, motion, 60.0), 1.5);
}

TEST(Attitude, holds_through_a_long_push_and_recovers) {
  Motion motion;
  motion.rate_radps = tumbling;
  motion.push_n_mps2 = [](double t) { return t > 20.0 && t < 25.0 ? Vec(5.0, 0.0, 0.0) : Vec(Vec::Zero()); };
  Attitude filter;
  worst_error_deg(filter, motion, 20.0);
  EXPECT_LT(worst_error_deg(filter, motion, 3.0), 9.0);
  EXPECT_TRUE(filter.accelerometer_disturbed());
  EXPECT_LT(worst_error_deg(filter, motion, 7.0), 9.0);  // believed, the push would be 27 degrees
  worst_error_deg(filter, motion, 10.0);
  EXPECT_FALSE(filter.accelerometer_disturbed());
  EXPECT_LT(worst_error_deg(filter, motion, 10.0), 1.0);
}

TEST(Attitude, believes_the_accelerometer_in_the_end) {
  // The body is knocked over and the gyroscope has not seen it.
  for (const double degrees : {4.0, 40.0, 120.0, 179.0, 180.0}) {
    Motion motion;
    Attitude filter;
    worst_error_deg(filter, motion, 10.0);
    motion.truth = motion.truth * turn(Vec(1, 1, 0), degrees * kDegree);
    worst_error_deg(filter, motion, 45.0);
    EXPECT_LT(inclination_deg(wide(filter.q_nb()), motion.truth), 0.5) << degrees;
    EXPECT_FALSE(filter.accelerometer_disturbed());
  }
}

TEST(Attitude, leaves_out_samples_that_clip) {
  Motion motion;
  motion.rate_radps = tumbling;
  Attitude filter;
  worst_error_deg(filter, motion, 10.0);
  for (int k = 0; k < 100; ++k) {
    Sample s = motion.next();
    if (k % 2 == 0) s.force = {156.9F, 3.0F, 0.0F};
    EXPECT_EQ(filter.step(s.rate, s.force, kDt_s),
              k % 2 == 0 ? AttitudeVerdict::kAccelerometerRefused : AttitudeVerdict::kAccepted);
    filter.magnetometer(s.field, kDt_s);
    ASSERT_LT(degrees_between(wide(filter.q_nb()), motion.truth), 0.3);
  }
}

TEST(Attitude, finds_itself_again_within_two_seconds_after_the_gyroscope_clipped) {
  Motion motion;
  Attitude filter;
  worst_error_deg(filter, motion, 10.0);
  // Half a second at 40 rad/s of which the gyroscope says 34.9.
  const double begin = motion.time_s();
  motion.rate_radps = [begin](double t) { return Vec(t < begin + 0.5 ? 40.0 : 0.0, 0.0, 0.0); };
  for (int k = 0; k < 100; ++k) {
    Sample s = motion.next();
    s.rate(0) = std::min(s.rate(0), 34.9F);
    static_cast<void>(filter.step(s.rate, s.force, kDt_s));
    filter.magnetometer(s.field, kDt_s);
  }
  worst_error_deg(filter, motion, 2.0);
  EXPECT_LT(inclination_deg(wide(filter.q_nb()), motion.truth), 3.0);
  worst_error_deg(filter, motion, 8.0);
  EXPECT_LT(degrees_between(wide(filter.q_nb()), motion.truth), 2.0);
}

/// A swing about x and a smaller one about y, each a smooth pulse of the rate. A gyroscope of this range shows it.
struct Swing {
  double missed_deg = 0.0;  ///< the turn above the range
  double error_deg = 0.0;   ///< right after the swing
};
Swing swing(double peak_radps, double range_radps, double duration_s) {
  Motion motion;
  Attitude filter({}, {.gyroscope_radps = static_cast<float>(range_radps)});
  worst_error_deg(filter, motion, 60.0);
  const double begin = motion.time_s();
  motion.rate_radps = [=](double t) {
    const double phase = (t - begin) / duration_s;
    const double pulse = phase > 0.0 && phase < 1.0 ? std::pow(std::sin(3.14159265 * phase), 2) : 0.0;
    return Vec(peak_radps * pulse, 1.5 * pulse, 0.0);
  };
  Swing result;
  while (motion.time_s() < begin + duration_s) {
    Sample s = motion.next();
    const double excess = std::max(0.0, static_cast<double>(s.rate(0)) - range_radps);
    result.missed_deg += excess * static_cast<double>(kDt_s) / kDegree;
    s.rate(0) = std::min(s.rate(0), static_cast<float>(range_radps));
    EXPECT_NE(filter.step(s.rate, s.force, kDt_s), AttitudeVerdict::kRefused);
    EXPECT_TRUE(filter.magnetometer(s.field, kDt_s));
  }
  result.error_deg = degrees_between(wide(filter.q_nb()), motion.truth);
  return result;
}
TEST(Attitude, finds_most_of_the_turn_that_a_clipped_gyroscope_misses) {
  for (const double peak_radps : {8.0, 10.0, 13.0})
    for (const double duration_s : {0.4, 1.0}) {
      const Swing clipped = swing(peak_radps, 7.2, duration_s), whole = swing(peak_radps, 20.0, duration_s);
      EXPECT_GT(clipped.missed_deg, 1.5);
      EXPECT_EQ(whole.missed_deg, 0.0);
      EXPECT_LT(whole.error_deg, 0.1);
      EXPECT_LT(clipped.error_deg, 0.35 * clipped.missed_deg) << peak_radps << " rad/s for " << duration_s << " s";
    }
}

TEST(Attitude, loses_no_more_by_one_reading_at_the_range_than_the_reading_turns_it) {
  for (const float reading : {34.5F, -34.9F})
    for (int axis = 0; axis < 3; ++axis) {
      Motion motion;
      Attitude filter;
      worst_error_deg(filter, motion, 60.0);
      Sample s = motion.next();
      s.rate(axis) = reading;
      EXPECT_EQ(filter.step(s.rate, s.force, kDt_s), AttitudeVerdict::kAccepted);
      const double turn_deg = 34.9 * static_cast<double>(kDt_s) / kDegree;
      EXPECT_LT(worst_error_deg(filter, motion, 10.0), 1.05 * turn_deg) << axis;
      worst_error_deg(filter, motion, 20.0);
      EXPECT_LT(degrees_between(wide(filter.q_nb()), motion.truth), 0.1 * turn_deg) << axis;
    }
}

TEST(Attitude, follows_the_slow_sensors_sooner_the_more_it_may_have_missed) {
  // A tilt and a heading that the gyroscope has not shown, and a driver that reports clipping in so many intervals.
  struct Left {
    double inclination_deg, total_deg;
  };
  const auto left = [](int reported) {
    Motion motion;
    Attitude filter;
    worst_error_deg(filter, motion, 60.0);
    motion.truth = turn(Vec(0.3, 0.2, 0.5), 0.2) * motion.truth;
    Left result{};
    for (int k = 0; k < 1600; ++k) {
      Sample s = motion.next();
      if (k < reported) s.rate(0) = k % 2 == 0 ? 1.0F : -1.0F;
      EXPECT_EQ(filter.step(s.rate, s.force, kDt_s, {.gyroscope = k < reported, .accelerometer = false}),
                AttitudeVerdict::kAccepted);
      filter.magnetometer(s.field, kDt_s);
      if (k == 100) result.inclination_deg = inclination_deg(wide(filter.q_nb()), motion.truth);
    }
    result.total_deg = degrees_between(wide(filter.q_nb()), motion.truth);
    return result;
  };
  const Left none = left(0), few = left(8), many = left(30);
  EXPECT_GT(none.inclination_deg, 5.5);
  EXPECT_LT(few.inclination_deg, 0.9 * none.inclination_deg);
  EXPECT_LT(many.inclination_deg, 0.2 * few.inclination_deg);
  EXPECT_GT(none.total_deg, 3.5);
  EXPECT_LT(few.total_deg, 0.95 * none.total_deg);
  EXPECT_LT(many.total_deg, 0.5 * few.total_deg);
}

TEST(Attitude, recovers_from_a_gyroscope_that_was_stuck_at_its_range) {
  for (int axis = 0; axis < 3; ++axis) {
    Motion motion;
    Attitude filter;
    worst_error_deg(filter, motion, 10.0);
    for (int k = 0; k < 2000; ++k) {
      Sample s = motion.next();
      s.rate(axis) = 34.9F;
      static_cast<void>(filter.step(s.rate, s.force, kDt_s));
      filter.magnetometer(s.field, kDt_s);
      ASSERT_TRUE(finite(filter.q_nb()));
    }
    worst_error_deg(filter, motion, 20.0);
    EXPECT_LT(degrees_between(wide(filter.q_nb()), motion.truth), 1.0) << axis;
  }
}

// --- Disturbed magnetometer.

TEST(Attitude, turns_back_a_heading_that_is_exactly_opposite) {
  Motion motion;
  Attitude filter;
  feed(filter, motion.next());
  motion.field_n = Vec(0.0, -17.0, -46.0);
  worst_error_deg(filter, motion, 60.0);
  EXPECT_NEAR(degrees_between(wide(filter.q_nb()), motion.truth), 180.0, 2.0);
}

TEST(Attitude, rejects_a_magnet_that_passes_and_recovers) {
  Motion motion;
  motion.rate_radps = tumbling;
  motion.magnet_b = [](double t) { return t > 30.0 && t < 50.0 ? Vec(25.0, -10.0, 5.0) : Vec(Vec::Zero()); };
  Attitude filter;
  worst_error_deg(filter, motion, 30.0);
  EXPECT_LT(worst_error_deg(filter, motion, 5.0), 1.0);
  EXPECT_TRUE(filter.magnetometer_disturbed());
  EXPECT_LT(worst_error_deg(filter, motion, 20.0), 2.0);
  worst_error_deg(filter, motion, 5.0);
  EXPECT_FALSE(filter.magnetometer_disturbed());
  EXPECT_LT(worst_error_deg(filter, motion, 5.0), 1.0);
}

TEST(Attitude, rejects_a_magnet_though_it_has_not_moved_since_the_start) {
  Motion motion;
  motion.magnet_b = [](double t) { return t > 20.0 && t < 28.0 ? Vec(25.0, -10.0, 5.0) : Vec(Vec::Zero()); };
  Attitude filter;
  EXPECT_LT(worst_error_deg(filter, motion, 40.0), 1.5);
}

TEST(Attitude, takes_another_homogeneous_field_for_its_reference_after_motion_in_it) {
  Motion motion;
  motion.rate_radps = tumbling;
  Attitude filter;
  worst_error_deg(filter, motion, 30.0);
  motion.field_n = Vec(0.0, 24.0, -60.0);  // into another building: stronger, the same north
  worst_error_deg(filter, motion, 2.0);
  EXPECT_TRUE(filter.magnetometer_disturbed());
  worst_error_deg(filter, motion, 38.0);
  EXPECT_FALSE(filter.magnetometer_disturbed());
  EXPECT_LT(worst_error_deg(filter, motion, 10.0), 1.0);
}

/// Tumbles for 60 s in one field, and is then for 40 s in another one whose north is 40 degrees off: how far the
/// heading has followed.
double followed_deg(double rate_radps) {
  Motion motion;
  motion.rate_radps = [rate_radps](double t) { return t < 60.0 ? tumbling(t) : Vec(0.0, 0.0, rate_radps); };
  Attitude filter;
  worst_error_deg(filter, motion, 60.0);
  motion.field_n = turn(Vec::UnitZ(), 40.0 * kDegree) * Vec(0.0, 25.0, -40.0);
  worst_error_deg(filter, motion, 40.0);
  return degrees_between(wide(filter.q_nb()), motion.truth);
}
TEST(Attitude, follows_another_field_when_it_turns_in_it) {
  EXPECT_LT(followed_deg(0.0), 5.0);  // at rest a magnet nearby is as likely
  EXPECT_GT(followed_deg(0.5), 30.0);
}

TEST(Attitude, leaves_a_reference_that_was_contradicted_for_as_long_as_it_was_confirmed) {
  Motion motion;
  Attitude filter;
  motion.field_n = Vec(3000.0, 100.0, 500.0);  // a garbled range at the start
  worst_error_deg(filter, motion, 5.0);
  motion.field_n = Vec(0.0, 17.0, -46.0);
  worst_error_deg(filter, motion, 50.0);
  EXPECT_FALSE(filter.magnetometer_disturbed());
  EXPECT_LT(degrees_between(wide(filter.q_nb()), motion.truth), 3.0);
}

TEST(MagneticHeading, is_a_number_when_the_field_turns_to_the_exact_opposite) {
  const AttitudeOptions options;
  MagneticHeading heading(options);
  heading.step({0.0F, 17.0F, -46.0F}, 0.0F, 1.0F, kDt_s);
  for (int k = 0; k < 10'000; ++k) {
    heading.step({0.0F, -17.0F, -46.0F}, 0.0F, 1.0F, kDt_s);
    ASSERT_TRUE(finite(heading.turned({})));
  }
  EXPECT_NEAR(base::abs(heading.turned({}).z), 1.0F, 1e-3F);
}

TEST(Attitude, leaves_a_reference_that_was_wrong_at_the_start) {
  Motion motion;  // rests beside a magnet, then moves away
  motion.rate_radps = [](double t) { return t < 20.0 ? Vec(Vec::Zero()) : tumbling(t); };
  motion.magnet_b = [](double t) { return t < 20.0 ? Vec(20.0, 0.0, 30.0) : Vec(Vec::Zero()); };
  Attitude filter;
  worst_error_deg(filter, motion, 80.0);
  EXPECT_FALSE(filter.magnetometer_disturbed());
  EXPECT_LT(worst_error_deg(filter, motion, 5.0), 2.0);
}

// --- Whatever comes.

TEST(Attitude, stays_finite_and_says_no_to_what_is_no_measurement) {
  constexpr float kMost = std::numeric_limits<float>::max(), kLeast = std::numeric_limits<float>::min();
  const std::array<float, 9> bad{NAN, -NAN, INFINITY, -INFINITY, 0.0F, kMost, -kMost, kLeast, 1e-45F};
  const std::vector<Sample> samples = recorded(4.0);
  for (int field = 0; field < 11; ++field)
    for (const float value : bad) {
      Attitude filter;
      std::size_t k = 0;
      for (; k < 400; ++k) feed(filter, samples[k]);
      for (; k < 600; ++k) {
        Sample s = samples[k];
        float dt_s = kDt_s, field_dt_s = kDt_s;
        if (field < 3) s.rate(field) = value;
        if (field >= 3 && field < 6) s.force(field - 3) = value;
        if (field >= 6 && field < 9) s.field(field - 6) = value;
        if (field == 9) dt_s = value;
        if (field == 10) field_dt_s = value;
        const AttitudeVerdict verdict = filter.step(s.rate, s.force, dt_s);
        if (!std::isfinite(value) && field < 6) {
          ASSERT_EQ(verdict, AttitudeVerdict::kRefused);
        }
        if (field == 9) {
          ASSERT_EQ(verdict, AttitudeVerdict::kRefused) << value;
        }
        const bool heard = filter.magnetometer(s.field, field_dt_s);
        if (!std::isfinite(value) && field >= 6 && field < 9) {
          ASSERT_FALSE(heard);
        }
      }
      for (; k < 800; ++k) feed(filter, samples[k]);
      ASSERT_TRUE(finite(filter.q_nb())) << field << ' ' << value;
      ASSERT_NEAR(filter.q_nb().norm2(), 1.0F, 1e-5F);
      ASSERT_TRUE(std::isfinite(filter.bias_sigma_radps()));
      ASSERT_LE(filter.bias_b_radps().norm(), 4.0F * AttitudeOptions::kDegree);
    }
}

TEST(Attitude, knows_its_bias_no_better_than_a_hundred_thousand_steps_can_tell) {
  Motion motion;
  motion.noise = 1.0;
  Attitude filter;
  for (int k = 0; k < 100'000; ++k) {
    const Sample s = motion.next();
    static_cast<void>(filter.step(s.rate, s.force, kDt_s));
  }
  EXPECT_GT(filter.bias_sigma_radps(), 0.01F * AttitudeOptions::kDegree);
  EXPECT_LT(filter.bias_sigma_radps(), 0.05F * AttitudeOptions::kDegree);
}

// --- The parts.

TEST(Quaternion, levelled_brings_any_direction_up_also_the_exact_opposite) {
  for (const Vector3& up_b : {Vector3{0.0F, 0.0F, -9.81F}, Vector3{0.0F, 1e-6F, -9.81F}, Vector3{-4.0F, 0.0F, -9.0F},
                              Vector3{0.0F, 0.0F, 2.0F}, Vector3{1.0F, 0.0F, 0.0F}, Vector3{0.0F, -30.0F, 0.0F}}) {
    const Vector3 up_n = Rows(levelled(up_b)) * up_b;
    EXPECT_NEAR(up_n(2), up_b.norm(), 1e-5F);
    EXPECT_LT(std::hypot(up_n(0), up_n(1)), 1e-5F);
  }
}

TEST(Quaternion, turned_is_the_exponential) {
  std::mt19937 engine(5);
  std::normal_distribution<double> normal;
  for (int k = 0; k < 1000; ++k) {
    const double x = normal(engine), y = normal(engine), z = normal(engine);
    const Vec axis = Vec(x, y, z).normalized();
    const double angle = 0.5 * (k + 1) / 1000.0;
    const Quaternion q = turned({0.5F, 0.5F, -0.5F, 0.5F}, narrow(0.5 * angle * axis));
    EXPECT_LT(degrees_between(wide(q), Quat(0.5, 0.5, -0.5, 0.5) * turn(axis, angle)), 3e-5);
  }
}

TEST(LowPass, has_unit_gain_whatever_the_intervals) {
  LowPass<1> low_pass;
  low_pass.start(Vector<float, 1>(3.0F));
  std::mt19937 engine(9);
  std::uniform_real_distribution<float> interval(0.001F, 0.2F);
  for (int k = 0; k < 3000; ++k) low_pass.step(Vector<float, 1>(-2.0F), LowPass<1>::factor(1.0F, interval(engine)));
  EXPECT_NEAR(low_pass.value(0), -2.0F, 1e-5F);
}

TEST(LowPass, has_the_magnitude_of_a_second_order_butterworth) {
  constexpr double kTau = 1.0;
  for (const double ratio : {0.1, 0.5, 1.0, 2.0, 5.0}) {
    const double w = ratio * std::sqrt(2.0) / kTau;
    LowPass<1> low_pass;
    double peak = 0.0;
    const float k = LowPass<1>::factor(1.0F, 0.001F);
    for (int step = 0; step < 200'000; ++step) {
      low_pass.step(Vector<float, 1>(static_cast<float>(std::sin(w * 0.001 * step))), k);
      if (step > 100'000) peak = std::max(peak, std::abs(static_cast<double>(low_pass.value(0))));
    }
    EXPECT_NEAR(peak, 1.0 / std::sqrt(1.0 + std::pow(ratio, 4)), 0.003) << ratio;
  }
}

TEST(Mahony, converges_to_the_truth_and_to_the_bias) {
  Motion motion;
  motion.rate_radps = tumbling;
  motion.bias_radps = Vec(0.5, -0.3, 0.4) * kDegree;
  Mahony six, nine;
  six.ki = nine.ki = 0.05F;
  nine.start({0.8F, 0.0F, 0.6F, 0.0F});
  for (int k = 0; k < 60'000; ++k) {
    const Sample s = motion.next();
    six.step(s.rate, s.force, kDt_s);
    nine.step(s.rate, s.force, s.field, kDt_s);
  }
  // The error is taken against the attitude before the turn, as published: a share of one step's turn remains.
  EXPECT_LT(degrees_between(wide(nine.q_nb()), motion.truth), 0.4);
  EXPECT_LT((nine.bias_b_radps().cast<double>() - motion.bias_radps).norm(), 0.02 * kDegree);
  EXPECT_LT(inclination_deg(wide(six.q_nb()), motion.truth), 0.4);
}

TEST(Mahony, stays_finite_whatever_comes) {
  Mahony filter;
  for (const float value : {NAN, INFINITY, -INFINITY, 0.0F, 3e38F, -3e38F, 1e-45F, 1e5F})
    for (int field = 0; field < 10; ++field) {
      Sample s{{0.1F, 0.2F, 0.3F}, {1.0F, 2.0F, 9.0F}, {5.0F, 17.0F, -46.0F}};
      float dt_s = kDt_s;
      if (field < 3) s.rate(field) = value;
      if (field >= 3 && field < 6) s.force(field - 3) = value;
      if (field >= 6 && field < 9) s.field(field - 6) = value;
      if (field == 9) dt_s = value;
      filter.step(s.rate, s.force, s.field, dt_s);
      filter.step(s.rate, s.force, dt_s);
      ASSERT_TRUE(finite(filter.q_nb())) << field << ' ' << value;
      ASSERT_NEAR(filter.q_nb().norm2(), 1.0F, 1e-3F);
    }
}

}  // namespace
}  // namespace tetap::filter
