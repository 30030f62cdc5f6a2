// SPDX-License-Identifier: Apache-2.0
// The attitude filter in the firmware: its present, what sensors do to it on their way, and how two attitudes are
// compared. The filter itself is judged in test/filter/attitude_test.cpp.
#include "tetap/estimators/attitude.hpp"

#include "tetap/estimators/attitude_disagreement.hpp"
#include "tetap/node/estimator_slot.hpp"

#include <gtest/gtest.h>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

namespace tetap::estimators {
namespace {

using filter::Quaternion;
using filter::Vector3;

static_assert(node::Estimator<Attitude> && node::EstimatorSlot<Attitude>::kDelayed);

constexpr float kDegree = 0.0174532925F;
constexpr std::int64_t kBegin_us = 3'000'000, kTick_us = 10'000, kImu_us = 5'000, kWindow_us = 200'000;

Quaternion about(const Vector3& axis, float angle_rad) {
  const float s = std::sin(0.5F * angle_rad) / std::sqrt(filter::dot(axis, axis));
  return {std::cos(0.5F * angle_rad), s * axis(0), s * axis(1), s * axis(2)};
}
float degrees_between(const Quaternion& a, const Quaternion& b) {
  const Quaternion d = a.conjugate() * b;
  return 2.0F * std::atan2(std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z), std::abs(d.w)) / kDegree;
}
float tilt_degrees_between(const Quaternion& a, const Quaternion& b) {
  const Vector3 off = filter::Rows(a).z - filter::Rows(b).z;
  return 2.0F * std::asin(0.5F * std::sqrt(filter::dot(off, off))) / kDegree;
}
param::Parameters with_magnetometer() {
  param::Parameters n;
  n.magnetic.use = 1;
  return n;
}
Vector3 tumbling(double t_s) {
  const auto t = static_cast<float>(t_s);
  return {1.1F * std::sin(0.9F * t), 0.8F * std::cos(1.3F * t), 0.7F * std::sin(0.5F * t + 1.0F)};
}

/// A body that turns; its sensors are ideal but for what a test does to their samples; a window as the history has it.
class Body {
 public:
  explicit Body(const param::Parameters& parameters) : n(parameters) { estimator.restart({kBegin_us}, ctx()); }

  param::Parameters n;
  Attitude estimator;
  Quaternion truth;
  std::function<Vector3(double)> rate_radps = [](double) { return Vector3(Vector3::Zero()); };
  std::function<bool(sensor::ImuSample&)> imu = [](sensor::ImuSample&) { return true; };  ///< false: the sample is lost
  std::function<bool(sensor::MagneticFlux&)> flux = [](sensor::MagneticFlux&) { return true; };
  std::int64_t flux_after_us = 0;  ///< how long after an IMU sample the magnetometer's is taken
  int refused = 0, rejected = 0;   ///< IMU samples; magnetometer samples

  /// The worst angle between the present and the truth from settled_s on.
  float run(double duration_s, double settled_s = 0) {
    float worst_deg = 0;
    const std::int64_t end_us = now_us + std::llround(duration_s * 1e6);
    const std::int64_t from_us = now_us + std::llround(settled_s * 1e6);
    while (now_us < end_us) {
      tick();
      const Quaternion q = estimator.attitude(ctx()).q_nb;
      EXPECT_TRUE(std::isfinite(q.norm2()));
      if (now_us > from_us) worst_deg = std::max(worst_deg, degrees_between(q, truth));
    }
    return worst_deg;
  }
  [[nodiscard]] Context ctx() const { return {n, map_frame}; }
  [[nodiscard]] AttitudeEstimate attitude() const { return estimator.attitude(ctx()); }
  [[nodiscard]] sensor::Mode mode() const { return estimator.mode(ctx()); }
  [[nodiscard]] float degrees_off() const { return degrees_between(attitude().q_nb, truth); }
  [[nodiscard]] float tilt_degrees_off() const { return tilt_degrees_between(attitude().q_nb, truth); }

  MapFrame map_frame;
  std::int64_t now_us = kBegin_us;

 private:
  void tick() {
    for (int i = 0; i < kTick_us / kImu_us; ++i) sample();
    while (!window_.empty() && window_.front().stamp.us <= now_us - kWindow_us) {
      leave(window_.front());
      window_.erase(window_.begin());
    }
    estimator.advance({now_us}, ctx(), window_);
  }
  void sample() {
    if (now_us % kTick_us == 0 && flux_after_us > 0) take_flux();
    const Vector3 w = rate_radps(1e-6 * static_cast<double>(now_us + kImu_us / 2));
    truth = turned(w, kImu_us);
    now_us += kImu_us;
    constexpr float kDt_s = 1e-6F * static_cast<float>(kImu_us);
    const Vector3 f = filter::Rows(truth.conjugate()) * Vector3{0.0F, 0.0F, 9.81F};
    sensor::ImuSample values{.dangle_b_rad = {w(0) * kDt_s, w(1) * kDt_s, w(2) * kDt_s},
                             .dvelocity_b_mps = {f(0) * kDt_s, f(1) * kDt_s, f(2) * kDt_s},
                             .interval_us = kImu_us};
    if (imu(values)) {
      sensor::Sample s{.stamp = {now_us}, .sensor = sensor::Sensor::kImu};
      s.payload.imu = values;
      window_.push_back(s);
    }
    if (now_us % kTick_us == 0 && flux_after_us == 0) take_flux();
  }
  void take_flux() {
    const Vector3 w = rate_radps(1e-6 * static_cast<double>(now_us + kImu_us / 2));
    const Vector3 m = filter::Rows(turned(w, flux_after_us).conjugate()) * Vector3{0.0F, 17.0F, -46.0F};
    sensor::MagneticFlux values{.flux_b_uT = {m(0), m(1), m(2)}};
    if (!flux(values)) return;
    sensor::Sample s{.stamp = {now_us + flux_after_us}, .sensor = sensor::Sensor::kMagnetometer};
    s.payload.magnetic = values;
    window_.push_back(s);
  }
  [[nodiscard]] Quaternion turned(const Vector3& w, std::int64_t span_us) const {
    const float norm = std::sqrt(filter::dot(w, w));
    return norm > 0.0F ? (truth * about(w, norm * 1e-6F * static_cast<float>(span_us))).normalised() : truth;
  }
  void leave(const sensor::Sample& s) {
    if (s.sensor == sensor::Sensor::kImu) {
      refused += estimator.fuse(s.payload.imu, s.stamp, ctx()).verdict != sensor::Verdict::kAccepted;
    } else {
      rejected += estimator.fuse(s.payload.magnetic, s.stamp, ctx()).verdict == sensor::Verdict::kRejected;
    }
  }

  std::vector<sensor::Sample> window_;
};

// --- The present.

TEST(AttitudeEstimator, gives_the_present_not_the_far_end_of_the_window_while_it_tumbles) {
  Body body(with_magnetometer());
  body.rate_radps = tumbling;
  EXPECT_LT(body.run(30, 2), 0.5F);  // what it turns within the window: up to 17 degrees
  EXPECT_TRUE(body.attitude().valid);
  EXPECT_TRUE(body.attitude().heading_valid);
  EXPECT_EQ(body.mode(), sensor::Mode::kNominal);
  EXPECT_EQ(body.refused, 0);
}

TEST(AttitudeEstimator, turns_ahead_without_the_gyroscopes_bias) {
  Body body(with_magnetometer());
  body.imu = [](sensor::ImuSample& s) {
    for (float& angle : s.dangle_b_rad) angle += 0.02F * 0.005F;
    return true;
  };
  body.run(40);
  EXPECT_LT(body.degrees_off(), 0.03F);  // the bias over the window: 0.4 degrees
  EXPECT_NEAR(body.estimator.estimate(body.ctx()).yaw_rate_radps, 0.0F, 1e-3F);
}

TEST(AttitudeEstimator, follows_the_fastest_turn_a_sensor_shows_through_the_window) {
  Body body(with_magnetometer());
  body.run(5);
  body.rate_radps = [](double) { return Vector3{1.0F, -2.0F, 30.0F}; };
  EXPECT_LT(body.run(0.19), 0.1F);  // 5.7 rad in steps of 0.15, all in the window
}

/// Whatever came late, the present is in the end the one of samples that came in time, to the bit.
TEST(AttitudeEstimator, has_the_bits_of_samples_in_time_once_a_late_one_is_there) {
  const param::Parameters n = with_magnetometer();
  const MapFrame map_frame;
  const Context ctx{n, map_frame};
  const auto sample = [](int k) {
    const float turn = 0.01F * std::sin(0.3F * static_cast<float>(k));
    sensor::Sample s{.stamp = {kBegin_us + k * kImu_us}, .sensor = sensor::Sensor::kImu};
    s.payload.imu = {
        .dangle_b_rad = {turn, 0.004F, -turn}, .dvelocity_b_mps = {0, 0, 0.04905F}, .interval_us = kImu_us};
    return s;
  };
  constexpr int kHeld = 200, kDue = 220, kFirst = 190;  // the sample 200 comes after 220; 190 is the window's first
  Attitude in_time, late;
  for (Attitude* one : {&in_time, &late}) {
    one->restart({kBegin_us}, ctx);
    std::vector<sensor::Sample> window;
    const auto advance = [&](int k) { one->advance({kBegin_us + k * kImu_us}, ctx, window); };
    for (int k = 1; k <= kDue; ++k) {
      if (k <= kFirst) {
        one->fuse(sample(k).payload.imu, sample(k).stamp, ctx);
      } else if (one == &in_time || k != kHeld) {
        one->arrived(sample(k), ctx);
        window.push_back(sample(k));
      }
      advance(k);
    }
    if (one == &late) {
      const Quaternion without = late.attitude(ctx).q_nb, with = in_time.attitude(ctx).q_nb;
      EXPECT_GT(degrees_between(without, with), 0.1F);
      late.arrived(sample(kHeld), ctx);
      window.insert(window.begin() + (kHeld - kFirst - 1), sample(kHeld));
      advance(kDue);
    }
  }
  const Quaternion a = in_time.attitude(ctx).q_nb, b = late.attitude(ctx).q_nb;
  EXPECT_EQ(a.w, b.w);
  EXPECT_EQ(a.x, b.x);
  EXPECT_EQ(a.y, b.y);
  EXPECT_EQ(a.z, b.z);
  EXPECT_EQ(in_time.estimate(ctx).yaw_rate_radps, late.estimate(ctx).yaw_rate_radps);
}

TEST(AttitudeEstimator, is_the_same_however_the_imu_is_mounted) {
  static constexpr std::array<float, 9> kMounting{0, 0, 1, 1, 0, 0, 0, 1, 0};  // the sensor's z is the body's x
  param::Parameters n = with_magnetometer();
  n.inertial.mounting_bs = kMounting;
  Body body(n);
  body.imu = [](sensor::ImuSample& s) {
    const auto sensor = [](const std::array<float, 3>& b) {
      const Vector3 v = sensor::transposed_times(kMounting, {b[0], b[1], b[2]});
      return std::array<float, 3>{v(0), v(1), v(2)};
    };
    s.dangle_b_rad = sensor(s.dangle_b_rad);
    s.dvelocity_b_mps = sensor(s.dvelocity_b_mps);
    s.dangle_b_rad[0] += 0.02F * 0.005F;
    return true;
  };
  body.run(40);
  EXPECT_LT(body.degrees_off(), 0.03F);  // the bias over the window: 0.2 degrees, about an axis of the sensor
  body.rate_radps = tumbling;
  EXPECT_LT(body.run(5), 0.5F);
}

TEST(AttitudeEstimator, says_what_it_waits_for_and_that_it_has_fallen_silent) {
  Body body(with_magnetometer());
  EXPECT_EQ(body.mode(), sensor::Mode::kWaitingForImu);
  EXPECT_FALSE(body.attitude().valid);
  body.flux = [](sensor::MagneticFlux&) { return false; };
  body.run(2);
  EXPECT_EQ(body.mode(), sensor::Mode::kFindingHeading);
  EXPECT_TRUE(body.attitude().valid);
  EXPECT_FALSE(body.attitude().heading_valid);
  EXPECT_FALSE(body.estimator.estimate(body.ctx()).heading_valid);
  body.flux = [](sensor::MagneticFlux&) { return true; };
  body.run(2);
  EXPECT_EQ(body.mode(), sensor::Mode::kNominal);
  EXPECT_TRUE(body.estimator.estimate(body.ctx()).heading_valid);
  body.imu = [](sensor::ImuSample&) { return false; };
  body.run(0.4);
  EXPECT_TRUE(body.attitude().valid);
  body.run(0.4);
  EXPECT_FALSE(body.attitude().valid);
  EXPECT_EQ(body.mode(), sensor::Mode::kWaitingForImu);
}

TEST(AttitudeEstimator, never_claims_a_place_and_its_covariance_is_one) {
  Body body(with_magnetometer());
  for (int i = 0; i < 100; ++i) {
    body.run(0.05);
    const Estimate e = body.estimator.estimate(body.ctx());
    ASSERT_FALSE(e.position_valid);
    ASSERT_TRUE(e.p.positive_definite());
    if (!e.heading_valid) {
      ASSERT_GT(std::sqrt(e.p(2, 2)), 1.5F);
    }
  }
  EXPECT_NEAR(std::sqrt(body.estimator.estimate(body.ctx()).p(2, 2)), body.n.magnetic.sigma_rad, 1e-6F);
}

TEST(AttitudeEstimator, begins_anew_after_a_restart) {
  Body body(with_magnetometer());
  body.rate_radps = tumbling;
  body.run(5);
  body.estimator.restart({body.now_us}, body.ctx());
  EXPECT_FALSE(body.attitude().valid);
  EXPECT_FALSE(body.attitude().heading_valid);
  EXPECT_LT(body.run(5, 1.2), 1.0F);
}

// --- Samples that are lost, clipped or nonsense.

TEST(AttitudeEstimator, bridges_lost_samples_with_the_turn_of_the_next) {
  Body body(with_magnetometer());
  body.rate_radps = [](double) { return Vector3{0.0F, 0.0F, 1.0F}; };
  body.run(5);
  int count = 0;
  body.imu = [&count](sensor::ImuSample&) {
    return ++count % 25 != 0 && count % 25 != 1;
  };  // 4.6 degrees/s are not seen
  body.run(1);
  EXPECT_LT(body.run(10), 1.5F);  // and at most two of them within the window
}

TEST(AttitudeEstimator, finds_level_again_in_a_second_when_it_turned_over_in_a_gap) {
  Body body(with_magnetometer());
  body.run(10);
  body.imu = [](sensor::ImuSample&) { return false; };
  body.flux = [](sensor::MagneticFlux&) { return false; };
  body.rate_radps = [](double) { return Vector3{1.0F, 0.0F, 0.0F}; };
  body.run(1);
  body.imu = [](sensor::ImuSample&) { return true; };
  body.flux = [](sensor::MagneticFlux&) { return true; };
  body.rate_radps = [](double) { return Vector3(Vector3::Zero()); };
  body.run(1.2);
  EXPECT_LT(body.tilt_degrees_off(), 3.0F);
  EXPECT_LT(body.run(10, 4), 3.0F);
}

TEST(AttitudeEstimator, does_not_follow_an_accelerometer_that_says_it_is_clipped) {
  const auto tilt_after = [](std::uint8_t clipped) {
    Body body(with_magnetometer());
    body.run(10);
    body.imu = [clipped](sensor::ImuSample& s) {  // 20 m/s^2 to the side: far below the limit of a reading
      s.dvelocity_b_mps[1] += 20.0F * 0.005F;
      s.clipped_accel = clipped;
      return true;
    };
    body.run(1);
    return body.tilt_degrees_off();
  };
  EXPECT_LT(tilt_after(1), 0.1F);
  EXPECT_GT(tilt_after(0), 0.5F);
}

TEST(AttitudeEstimator, follows_the_slow_sensors_when_the_gyroscope_reports_clipping) {
  const auto tilt_after = [](std::uint8_t clipped) {
    Body body(with_magnetometer());
    body.run(10);
    body.rate_radps = [](double) { return Vector3{20.0F, 0.0F, 0.0F}; };
    body.imu = [clipped](sensor::ImuSample& s) {  // it shows half of what it turns, for 0.1 s: one radian is missing
      s.dangle_b_rad[0] *= 0.5F;
      s.clipped_gyro = clipped;
      return true;
    };
    body.run(0.1);
    body.rate_radps = [](double) { return Vector3(Vector3::Zero()); };
    body.imu = [](sensor::ImuSample&) { return true; };
    body.run(1.5);
    return body.tilt_degrees_off();
  };
  EXPECT_LT(tilt_after(3), 4.0F);
  EXPECT_GT(tilt_after(0), 20.0F);
}

/// A smooth turn about x, up to 15 rad/s, of which the gyroscope shows 10 rad/s; the error right after it.
float degrees_off_after_clipping(float range_radps) {
  param::Parameters n = with_magnetometer();
  n.inertial.gyro_range_radps = range_radps;
  Body body(n);
  body.run(30);
  const auto begin = 1e-6 * static_cast<double>(body.now_us);
  body.rate_radps = [begin](double t_s) {
    const auto phase = static_cast<float>((t_s - begin) / 0.5);
    const float pulse = phase > 0.0F && phase < 1.0F ? std::sin(3.14159265F * phase) : 0.0F;
    return Vector3{15.0F * pulse * pulse, 0.0F, 0.0F};
  };
  body.imu = [](sensor::ImuSample& s) {
    s.dangle_b_rad[0] = std::min(s.dangle_b_rad[0], 10.0F * 1e-6F * static_cast<float>(s.interval_us));
    return true;
  };
  body.run(0.8);  // the window of 0.2 s is behind
  return body.degrees_off();
}
TEST(AttitudeEstimator, takes_the_range_of_the_gyroscope_from_the_parameters) {
  EXPECT_GT(degrees_off_after_clipping(35.0F), 25.0F);
  EXPECT_LT(degrees_off_after_clipping(10.0F), 10.0F);
}

TEST(AttitudeEstimator, does_not_throw_the_heading_away_for_a_short_gap) {
  Body body(with_magnetometer());
  body.run(30);
  body.imu = [](sensor::ImuSample&) { return false; };
  body.flux = [](sensor::MagneticFlux&) { return false; };
  body.run(0.25);
  body.imu = [](sensor::ImuSample&) { return true; };
  body.flux = [](sensor::MagneticFlux& s) { return s.flux_b_uT[0] += 15.0F, true; };  // a magnet passes right after
  body.run(1);
  body.flux = [](sensor::MagneticFlux&) { return true; };
  EXPECT_LT(body.run(5), 1.0F);
}

TEST(AttitudeEstimator, refuses_nonsense_on_its_way_in_and_does_not_turn_ahead_by_it) {
  const sensor::ImuSample bad[] = {
      {.interval_us = 0},
      {.dangle_b_rad = {0.1F, 0.0F, 0.0F}, .interval_us = 0},
      {.dangle_b_rad = {0.0F, 3e38F, 0.0F}, .dvelocity_b_mps = {0.0F, 0.0F, 0.05F}, .interval_us = 5000},
      {.dangle_b_rad = {0.0F, 0.0F, base::kNan}, .dvelocity_b_mps = {0.0F, 0.0F, 0.05F}, .interval_us = 5000},
      {.dvelocity_b_mps = {base::kInfinity, 0.0F, 0.05F}, .interval_us = 5000},
      {.dangle_b_rad = {0.6F, 0.0F, 0.0F}, .dvelocity_b_mps = {0.0F, 0.0F, 0.05F}, .interval_us = 5000},
  };
  for (const sensor::ImuSample& nonsense : bad) {
    Body body(with_magnetometer());
    body.run(5);
    body.imu = [&](sensor::ImuSample& s) { return s = nonsense, true; };
    body.run(0.01);
    body.imu = [](sensor::ImuSample&) { return true; };
    EXPECT_LT(body.run(3), 0.1F);
    EXPECT_EQ(body.refused, 2);
  }
}

TEST(AttitudeEstimator, takes_the_present_from_its_own_imu_only) {
  Body body(with_magnetometer());
  body.run(5);
  sensor::Sample other{.stamp = {body.now_us}, .sensor = sensor::Sensor::kImu, .instance = 1};
  other.payload.imu = {.dangle_b_rad = {0.0F, 0.0F, 0.3F}, .interval_us = 5000};
  body.estimator.advance({body.now_us}, body.ctx(), std::vector<sensor::Sample>{other});
  EXPECT_LT(body.degrees_off(), 0.1F);
}

// --- The magnetometer.

TEST(AttitudeEstimator, leaves_the_heading_free_without_a_magnetometer) {
  Body body(param::Parameters{});
  body.truth = about({0.0F, 0.0F, 1.0F}, 2.0F);
  body.run(5);
  EXPECT_FALSE(body.attitude().heading_valid);
  EXPECT_EQ(body.mode(), sensor::Mode::kNominal);
  EXPECT_LT(body.tilt_degrees_off(), 0.1F);
}

TEST(AttitudeEstimator, takes_calibration_mounting_and_declination_off) {
  param::Parameters n = with_magnetometer();
  n.magnetic.declination_rad = 0.3F;
  n.magnetic.hard_iron_uT = {30.0F, -20.0F, 12.0F};
  n.magnetic.soft_iron = {1.1F, 0.05F, 0.0F, 0.05F, 0.9F, 0.02F, 0.0F, 0.02F, 1.0F};
  n.magnetic.mounting_bs = {0, -1, 0, -1, 0, 0, 0, 0, -1};
  Body body(n);
  body.rate_radps = tumbling;
  const Quaternion east_of_north = about({0.0F, 0.0F, 1.0F}, -0.3F);  // where the field of this place points
  body.flux = [&](sensor::MagneticFlux& s) {
    const Vector3 m =
        filter::Rows(body.truth.conjugate()) * (filter::Rows(east_of_north) * Vector3{0.0F, 17.0F, -46.0F});
    const Vector3 in_sensor = sensor::transposed_times(n.magnetic.mounting_bs, m);
    Eigen::Matrix3f soft;
    for (int i = 0; i < 9; ++i) soft(i / 3, i % 3) = n.magnetic.soft_iron[static_cast<std::size_t>(i)];
    const Eigen::Vector3f raw = soft.inverse() * Eigen::Vector3f(in_sensor(0), in_sensor(1), in_sensor(2));
    for (int i = 0; i < 3; ++i)
      s.flux_b_uT[static_cast<std::size_t>(i)] = raw(i) + n.magnetic.hard_iron_uT[static_cast<std::size_t>(i)];
    return true;
  };
  EXPECT_LT(body.run(30, 2), 0.5F);
  EXPECT_EQ(body.rejected, 0);
}

TEST(AttitudeEstimator, knows_what_it_turned_between_the_gyroscopes_sample_and_the_magnetometers) {
  Body body(with_magnetometer());
  body.rate_radps = [](double) { return Vector3{0.0F, 0.0F, 2.0F}; };
  body.flux_after_us = 4'900;
  body.run(30);
  EXPECT_LT(body.degrees_off(), 0.1F);  // 0.56 degrees in 4.9 ms
}

TEST(AttitudeEstimator, rejects_a_magnet_and_says_so) {
  Body body(with_magnetometer());
  body.rate_radps = tumbling;
  body.run(30);
  EXPECT_EQ(body.rejected, 0);
  body.flux = [](sensor::MagneticFlux& s) { return s.flux_b_uT[0] += 40.0F, true; };
  body.run(5);
  EXPECT_LT(body.degrees_off(), 2.0F);
  EXPECT_GT(body.rejected, 300);
  EXPECT_TRUE(body.attitude().field_disturbed);
  EXPECT_EQ(body.mode(), sensor::Mode::kDegraded);
  EXPECT_GT(std::sqrt(body.estimator.estimate(body.ctx()).p(2, 2)), 1.0001F * body.n.magnetic.sigma_rad);
  body.flux = [](sensor::MagneticFlux&) { return true; };
  body.run(5);
  EXPECT_FALSE(body.attitude().field_disturbed);
  EXPECT_EQ(body.mode(), sensor::Mode::kNominal);
}

// --- Comparing two attitudes.

AttitudeEstimate attitude_of(const Quaternion& q, bool heading = true) {
  return {.q_nb = q, .valid = true, .heading_valid = heading};
}

TEST(Disagreement, is_the_tilt_and_the_heading_that_one_was_turned_by) {
  for (const float heading : {-3.0F, -0.4F, 0.0F, 0.02F, 2.5F})
    for (const float tilt : {0.0F, 0.01F, 0.7F, 2.9F})
      for (const float way : {0.0F, 1.0F, 4.0F}) {
        const Quaternion b = about({0.3F, -0.5F, 0.8F}, 1.9F);
        const Quaternion a = about({std::cos(way), std::sin(way), 0.0F}, tilt) * about({0.0F, 0.0F, 1.0F}, heading) * b;
        const Disagreement d = disagreement(attitude_of(a), attitude_of(b));
        EXPECT_NEAR(d.tilt_rad, tilt, 2e-6F);
        EXPECT_NEAR(d.heading_rad, heading, 4e-6F);
        const Disagreement minus = disagreement(attitude_of(a.scaled(-1.0F)), attitude_of(b));
        EXPECT_NEAR(minus.tilt_rad, tilt, 2e-6F);
        EXPECT_NEAR(minus.heading_rad, heading, 4e-6F);
      }
}

TEST(Disagreement, does_not_depend_on_which_way_both_look) {
  const Quaternion a = about({0.3F, -0.5F, 0.8F}, 1.9F), b = about({0.2F, 0.1F, 0.9F}, 1.1F);
  const Disagreement d = disagreement(attitude_of(a), attitude_of(b));
  for (const float angle : {0.5F, 2.0F, -3.0F}) {
    const Quaternion turn = about({0.0F, 0.0F, 1.0F}, angle);
    const Disagreement same = disagreement(attitude_of(turn * a), attitude_of(turn * b));
    EXPECT_NEAR(same.tilt_rad, d.tilt_rad, 1e-6F);
    EXPECT_NEAR(same.heading_rad, d.heading_rad, 1e-6F);
    const Disagreement back = disagreement(attitude_of(b), attitude_of(a));
    EXPECT_NEAR(back.tilt_rad, d.tilt_rad, 1e-6F);
    EXPECT_NEAR(back.heading_rad, -d.heading_rad, 1e-6F);
  }
}

TEST(Disagreement, is_not_known_of_what_is_not_valid) {
  const Quaternion q = about({0.3F, -0.5F, 0.8F}, 1.9F);
  EXPECT_TRUE(std::isnan(disagreement({}, attitude_of(q)).tilt_rad));
  EXPECT_TRUE(std::isnan(disagreement(attitude_of(q), {}).tilt_rad));
  EXPECT_TRUE(std::isnan(disagreement(attitude_of(q), {}).heading_rad));
  const Disagreement no_heading = disagreement(attitude_of(q), attitude_of(about({0.0F, 0.0F, 1.0F}, 1.0F) * q, false));
  EXPECT_TRUE(std::isnan(no_heading.heading_rad));
  EXPECT_NEAR(no_heading.tilt_rad, 0.0F, 1e-6F);
}

TEST(Disagreement, is_said_after_the_stated_time_and_taken_back_after_the_same) {
  const param::DisagreementParameters n;
  const Disagreement none{.tilt_rad = 0.0F, .heading_rad = 0.0F};
  const Disagreement tilt{.tilt_rad = 1.01F * n.tilt_rad, .heading_rad = 0.0F};
  const Disagreement left{.tilt_rad = 0.0F, .heading_rad = 1.01F * n.heading_rad};
  const Disagreement right{.tilt_rad = 0.0F, .heading_rad = -1.01F * n.heading_rad};
  const Disagreement tilt_only{.tilt_rad = 1.01F * n.tilt_rad};
  for (const Disagreement& apart : {tilt, left, right, tilt_only}) {
    AttitudeDisagreement watch;
    std::int64_t t_us = kBegin_us;
    watch.restart({t_us});
    const auto lasts_us = [&](const Disagreement& d) {
      const bool was = watch.disagrees();
      const std::int64_t from_us = t_us;
      while (watch.step(d, {t_us}, n) == was && t_us - from_us < 100'000'000) t_us += kTick_us;
      return t_us - from_us;
    };
    EXPECT_LE(std::abs(lasts_us(apart) - n.after_us), 2 * kTick_us);
    EXPECT_LE(std::abs(lasts_us(none) - n.after_us), 2 * kTick_us);
  }
}

TEST(Disagreement, of_a_moment_is_not_said_however_often_it_comes) {
  const param::DisagreementParameters n;
  AttitudeDisagreement watch;
  for (std::int64_t t_us = 0; t_us < 100'000'000; t_us += kTick_us) {
    const bool apart = t_us % n.after_us > kTick_us;  // but for two ticks of every period
    EXPECT_FALSE(watch.step({.tilt_rad = apart ? 1.0F : 0.0F, .heading_rad = 0.0F}, {t_us}, n)) << t_us;
  }
}

TEST(Disagreement, stays_said_while_nothing_is_known) {
  const param::DisagreementParameters n;
  AttitudeDisagreement watch;
  std::int64_t t_us = 0;
  for (; t_us < 10'000'000; t_us += kTick_us) EXPECT_FALSE(watch.step({}, {t_us}, n));
  for (; t_us < 20'000'000; t_us += kTick_us) watch.step({.tilt_rad = 1.0F}, {t_us}, n);
  EXPECT_TRUE(watch.disagrees());
  for (; t_us < 30'000'000; t_us += kTick_us) EXPECT_TRUE(watch.step({}, {t_us}, n));
}

}  // namespace
}  // namespace tetap::estimators
