// SPDX-License-Identifier: Apache-2.0
// Statistics of every sensor, with bounds on both sides: an error that is too small is as wrong as one that is too
// large.
#include "sim_host/world/sensors.hpp"

#include "test/sim/support.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace tetap::sim {
namespace {

const Earth kEarth{{48.2627, 11.6683, 520}};
const Faults kNoFaults;

/// Allan deviation of rates at averaging time m samples (IEEE Std 952, annex C, non-overlapping).
double allan(const std::vector<double>& rates, std::size_t m) {
  std::vector<double> means;
  for (std::size_t i = 0; i + m <= rates.size(); i += m) {
    double sum = 0;
    for (std::size_t k = i; k < i + m; ++k) sum += rates[k];
    means.push_back(sum / static_cast<double>(m));
  }
  double square = 0;
  for (std::size_t i = 1; i < means.size(); ++i) square += (means[i] - means[i - 1]) * (means[i] - means[i - 1]);
  return sim::sqrt(0.5 * square / static_cast<double>(means.size() - 1));
}

/// Samples of an IMU at rest for that long: six series, rate and specific force.
std::array<std::vector<double>, 6> imu_at_rest(const ImuParameters& parameters, double seconds, std::uint64_t seed) {
  Imu imu{parameters, 0.1, kEarth, seed};
  const int steps = 2000 / parameters.rate_hz;
  std::array<std::vector<double>, 6> series;
  base::Micros now;
  for (int i = 0; i < static_cast<int>(seconds * parameters.rate_hz); ++i) {
    for (int k = 0; k < steps; ++k) imu.sense({}, 0, now += Vehicle::kStep, kNoFaults);
    const sensor::ImuSample s = imu.sample(now, kNoFaults);
    for (std::size_t a = 0; a < 3; ++a) {
      series[a].push_back(static_cast<double>(s.dangle_b_rad[a]) * parameters.rate_hz);
      series[3 + a].push_back(static_cast<double>(s.dvelocity_b_mps[a]) * parameters.rate_hz);
    }
  }
  return series;
}

TEST(GaussMarkov, has_the_stated_variance_and_correlation_time) {
  Chance chance{1, Stream::kSlip};
  GaussMarkov process{2.0, 3.0, 0.1, chance};
  std::vector<double> values;
  for (int i = 0; i < 400'000; ++i) values.push_back(process.next(chance));
  EXPECT_NEAR(statistics(values).variance, 4, 0.2);
  EXPECT_NEAR(correlation(values, 30), std::exp(-1), 0.03);
  EXPECT_NEAR(correlation(values, 60), std::exp(-2), 0.03);
}

TEST(Chance, uniform_and_normal_have_their_moments_and_streams_are_apart) {
  Chance a{1, Stream::kSlip};
  Chance b{1, Stream::kGround};
  std::vector<double> uniform, normal, product;
  double fourth = 0;
  for (int i = 0; i < 200'000; ++i) {
    uniform.push_back(a.uniform());
    ASSERT_GT(uniform.back(), 0);
    ASSERT_LT(uniform.back(), 1);
    normal.push_back(a.normal());
    product.push_back(normal.back() * b.normal());
    fourth += std::pow(normal.back(), 4) / 200'000;
  }
  EXPECT_NEAR(statistics(uniform).mean, 0.5, 0.003);
  EXPECT_NEAR(statistics(uniform).variance, 1.0 / 12, 0.001);
  EXPECT_NEAR(statistics(normal).mean, 0, 0.01);
  EXPECT_NEAR(statistics(normal).variance, 1, 0.015);
  EXPECT_NEAR(fourth, 3, 0.1);
  EXPECT_NEAR(statistics(product).mean, 0, 0.01);
}

TEST(Chance, every_seed_and_every_stream_draws_its_own_numbers) {
  std::set<double> first;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    for (std::uint32_t stream = 0; stream < 20; ++stream) first.insert(Chance{seed, Stream{stream}}.uniform());
  }
  EXPECT_EQ(first.size(), 2000U);
}

TEST(Imu, white_noise_is_the_data_sheets_at_every_rate) {
  for (const int rate_hz : {100, 200, 400}) {
    ImuParameters parameters = matched(Parameters{}).imu;
    parameters.rate_hz = rate_hz;
    const auto series = imu_at_rest(parameters, 300, 5);
    for (std::size_t a = 0; a < 3; ++a) {
      // Allan deviation of white noise at one second is the density itself.
      EXPECT_NEAR(allan(series[a], static_cast<std::size_t>(rate_hz)) / parameters.gyro_noise, 1, 0.2);
      EXPECT_NEAR(allan(series[3 + a], static_cast<std::size_t>(rate_hz)) / parameters.accel_noise[a], 1, 0.2);
      EXPECT_NEAR(statistics(series[a]).variance / (parameters.gyro_noise * parameters.gyro_noise * rate_hz), 1, 0.05);
    }
  }
}

TEST(Imu, allan_deviation_falls_with_white_noise_and_rises_with_the_wandering_bias) {
  ImuParameters parameters;
  parameters.gyro_walk_radps = 1e-4;
  parameters.walk_tau_s = 60;
  const auto series = imu_at_rest(parameters, 2400, 6);
  EXPECT_NEAR(allan(series[2], 10) / (parameters.gyro_noise / sim::sqrt(0.1)), 1, 0.05);
  EXPECT_NEAR(allan(series[2], 40) / allan(series[2], 10), 0.5, 0.05);
  // Markov noise (IEEE Std 952, annex C): AVAR(T) = 2 sigma^2 tau/T (1 - tau/2T (3 - 4 e^(-T/tau) + e^(-2T/tau))), 0.58
  // sigma at T = tau.
  EXPECT_NEAR(allan(series[2], 6000) / parameters.gyro_walk_radps, 0.58, 0.2);
}

TEST(Imu, turn_on_biases_differ_between_seeds_by_as_much_as_stated) {
  std::vector<double> gyro, accel;
  const ImuParameters parameters;
  for (std::uint64_t seed = 1; seed <= 150; ++seed) {
    const auto series = imu_at_rest(parameters, 2, seed);
    for (std::size_t a = 0; a < 2; ++a) {
      gyro.push_back(statistics(series[a]).mean);
      accel.push_back(statistics(series[3 + a]).mean);
    }
  }
  EXPECT_NEAR(sim::sqrt(statistics(gyro).variance) / parameters.gyro_turn_on_radps, 1, 0.15);
  EXPECT_NEAR(sim::sqrt(statistics(accel).variance) / parameters.accel_turn_on_mps2, 1, 0.15);
}

TEST(Imu, at_rest_it_feels_gravity_upward_and_the_turning_earth) {
  ImuParameters parameters = matched(Parameters{}).imu;
  parameters.earth_rotation = true;
  parameters.gyro_noise = 0;
  const auto series = imu_at_rest(parameters, 60, 7);
  EXPECT_NEAR(statistics(series[5]).mean, kEarth.gravity_mps2(), 3e-4);
  EXPECT_NEAR(statistics(series[3]).mean, 0, 3e-4);
  EXPECT_NEAR(statistics(series[2]).mean, 7.292115e-5 * std::sin(48.2627 * kPi / 180), 1e-9);
  EXPECT_NEAR(statistics(series[1]).mean, 7.292115e-5 * std::cos(48.2627 * kPi / 180), 1e-9);
}

// A second of 2 rad/s2 about up, then 2 rad/s: its own speed at (x, y) is w (-y, x), and the pull inward w^2 (x, y).
TEST(Imu, away_from_the_origin_it_swings_round_it) {
  ImuParameters parameters = matched(Parameters{}).imu;
  parameters.earth_rotation = false;
  parameters.gyro_noise = 0;
  parameters.accel_noise = {};
  parameters.position_b_m = {0.4, -0.3, 0.2};
  Imu imu{parameters, 0.1, kEarth, 7};
  Motion motion;
  base::Micros now;
  Vector3 gained{}, pulled{};
  for (int k = 1; k <= 4'000; ++k) {
    motion.rate_b_radps[2] = std::min(0.001 * k, 2.0);
    imu.sense(motion, 0, now += Vehicle::kStep, kNoFaults);
    if (k % (2'000 / parameters.rate_hz) != 0) continue;
    const sensor::ImuSample s = imu.sample(now, kNoFaults);
    Vector3& sum = k <= 2'000 ? gained : pulled;
    for (std::size_t a = 0; a < 3; ++a) sum[a] += static_cast<double>(s.dvelocity_b_mps[a]);
  }
  EXPECT_NEAR(gained[0], 2 * 0.3 - 4.0 / 3 * 0.4, 0.02);
  EXPECT_NEAR(gained[1], 2 * 0.4 + 4.0 / 3 * 0.3, 0.02);
  EXPECT_NEAR(pulled[0], -4 * 0.4, 0.02);
  EXPECT_NEAR(pulled[1], 4 * 0.3, 0.02);
  EXPECT_NEAR(pulled[2], kEarth.gravity_mps2(), 0.001);
}

TEST(Imu, vibration_grows_with_speed_and_is_none_at_rest) {
  ImuParameters parameters = matched(Parameters{}).imu;
  parameters.accel_noise = {};
  parameters.vibration_mps2 = 1.5;
  parameters.rate_hz = 400;
  const auto spread = [&](double speed) {
    Imu imu{parameters, 0.1, kEarth, 1};
    std::vector<double> z;
    base::Micros now;
    for (int i = 0; i < 4000; ++i) {
      for (int k = 0; k < 5; ++k) imu.sense({}, speed, now += Vehicle::kStep, kNoFaults);
      z.push_back(static_cast<double>(imu.sample(now, kNoFaults).dvelocity_b_mps[2]) * 400);
    }
    return sim::sqrt(statistics(z).variance);
  };
  EXPECT_LT(spread(0), 1e-4);
  const double slow = spread(1);
  const double fast = spread(2);
  EXPECT_NEAR(fast / slow, 2, 0.2);
  EXPECT_NEAR(fast, 1.5 * 0.7, 0.15);  // amplitude 0.7 sqrt 2 of 1.5 m/s^2 has the rms 0.7 of it
}

Motion rolling(double left_m, double right_m) {
  Motion motion;
  motion.rim_left_m = left_m;
  motion.rim_right_m = right_m;
  return motion;
}

TEST(Wheels, counting_rounds_down_to_a_count_and_never_drifts) {
  const WheelSensorNumbers parameters;
  const VehicleParameters rover{.radius_difference = 0};
  const double metres = 2 * kPi * rover.wheel_radius_m / parameters.counts_per_turn;
  Wheels wheels{parameters, rover, 3};
  base::Micros now;
  const sensor::WheelCounts first = wheels.counts();
  sensor::WheelCounts last = first;
  std::vector<double> error;
  double truth_m = 0;
  std::int64_t left = 0;
  for (int i = 0; i < 20'000; ++i) {
    const double step_m = 1.234567e-3 * (1 + 0.5 * sim::sin(0.01 * i));
    truth_m += step_m;
    wheels.sense(rolling(step_m, -step_m), now += Vehicle::kStep, kNoFaults);
    const sensor::WheelCounts counts = wheels.counts();
    left += static_cast<std::int16_t>(counts.left - last.left);
    last = counts;
    error.push_back(truth_m / metres - static_cast<double>(left));
    ASSERT_LT(magnitude(error.back()), 1) << i;
  }
  EXPECT_NEAR(statistics(error).variance, 1.0 / 12, 0.1 / 12);
}

TEST(Wheels, counters_start_anywhere_and_wrap_both_ways) {
  std::vector<double> starts;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) starts.push_back(Wheels{{}, {}, seed}.counts().left);
  EXPECT_NEAR(statistics(starts).mean, 32768, 4000);
  EXPECT_GT(*std::max_element(starts.begin(), starts.end()), 64000);
  EXPECT_LT(*std::min_element(starts.begin(), starts.end()), 1500);
}

TEST(Wheels, matched_noise_has_the_variance_k_per_metre) {
  const Parameters n = matched(Parameters{});
  Wheels wheels{n.wheels, n.vehicle, 3};
  const double metres = 2 * kPi * n.vehicle.wheel_radius_m / n.wheels.counts_per_turn;
  base::Micros now;
  sensor::WheelCounts last = wheels.counts();
  std::vector<double> left, right;
  for (int i = 0; i < 30'000; ++i) {
    wheels.sense(rolling(0.02, 0.01), now += Vehicle::kStep, kNoFaults);
    const sensor::WheelCounts counts = wheels.counts();
    left.push_back(static_cast<std::int16_t>(counts.left - last.left) * metres - 0.02);
    right.push_back(static_cast<std::int16_t>(counts.right - last.right) * metres - 0.01);
    last = counts;
  }
  // Rounding adds two twelfths of a squared count to each difference.
  const double rounding = metres * metres / 6;
  EXPECT_NEAR((statistics(left).variance - rounding) / (n.wheels.noise_m * 0.02), 1, 0.04);
  EXPECT_NEAR((statistics(right).variance - rounding) / (n.wheels.noise_m * 0.01), 1, 0.04);
  EXPECT_NEAR(statistics(left).mean, 0, 2e-5);
}

TEST(Wheels, speeds_are_the_counts_differences_over_the_interval) {
  WheelSensorNumbers parameters;
  parameters.rate_hz = 50;
  parameters.counts_per_turn = 1e6;
  const VehicleParameters rover{.radius_difference = 0};
  Wheels a{parameters, rover, 3};
  Wheels b{parameters, rover, 3};
  base::Micros now;
  for (int i = 0; i < 40; ++i) {
    a.sense(rolling(0.8 / 2000, 1.2 / 2000), now += Vehicle::kStep, kNoFaults);
    b.sense(rolling(0.8 / 2000, 1.2 / 2000), now, kNoFaults);
  }
  const sensor::WheelSpeeds speeds = a.wheel_speeds();
  EXPECT_NEAR(speeds.left_mps, 0.8F, 1e-4F);
  EXPECT_NEAR(speeds.right_mps, 1.2F, 1e-4F);
  const sensor::BodySpeed body = b.body_speed();
  EXPECT_NEAR(body.forward_mps, 1.0F, 1e-4F);
  EXPECT_NEAR(body.yaw_rate_radps, 0.8F, 2e-4F);
}

TEST(Wheels, slip_is_there_in_curves_and_on_acceleration_and_small) {
  World::Options options{.latency = false};
  options.parameters.vehicle.radius_difference = options.parameters.vehicle.track_error = 0;
  World world{options, 1};
  std::vector<Measurement> arrived;
  world.advance_to(world.start() + base::Micros{8'500}, arrived);
  double rim = 0, path = 0;
  const sensor::WheelCounts* last = nullptr;
  std::vector<Measurement> all;
  for (base::Micros t = world.start(); t < world.start() + world.duration(); t += base::Micros{10'000}) {
    world.advance_to(t, all);
    path += world.truth().speed_mps * 0.01;
  }
  for (const auto& m : all)
    if (const auto* c = std::get_if<sensor::WheelCounts>(&m.value)) {
      if (last)
        rim += 0.5 *
               (static_cast<std::int16_t>(c->left - last->left) + static_cast<std::int16_t>(c->right - last->right)) *
               2 * kPi * 0.1 / 2000;
      last = c;
    }
  EXPECT_GT(rim / path, 1.001);
  EXPECT_LT(rim / path, 1.02);
}

struct GnssSeries {
  std::vector<double> east, north, up, accuracy, velocity;
  int fixes = 0, outages = 0, lost = 0;
};

GnssSeries gnss_at_rest(const GnssParameters& parameters, int samples, std::uint64_t seed) {
  Gnss gnss{parameters, kEarth, seed};
  GnssSeries series;
  base::Micros now;
  bool was_lost = false;
  for (int i = 0; i < samples; ++i) {
    const auto reading = gnss.sample({}, now += base::Micros{200'000}, kNoFaults);
    const auto& p = *reading.position;
    const bool is_lost = p.fix == sensor::GnssFix::kNone;
    if (is_lost) {
      ++series.lost;
      series.outages += was_lost ? 0 : 1;
      EXPECT_FALSE(reading.velocity);
      EXPECT_TRUE(std::isnan(p.horizontal_acc_m));
    } else {
      const auto enu = kEarth.enu_m({p.latitude_2ndeg, p.longitude_2ndeg, static_cast<double>(p.height_m)});
      series.east.push_back(enu[0]), series.north.push_back(enu[1]), series.up.push_back(enu[2]);
      series.accuracy.push_back(static_cast<double>(p.horizontal_acc_m));
      series.velocity.push_back(static_cast<double>(reading.velocity->v_n_mps[0]));
      ++series.fixes;
    }
    was_lost = is_lost;
  }
  return series;
}

TEST(Gnss, error_is_correlated_over_the_stated_time_and_as_large_as_the_receiver_says) {
  GnssParameters parameters;
  parameters.outage_every_s = parameters.glitch_probability = 0;
  parameters.antenna_b_m = {};
  const auto s = gnss_at_rest(parameters, 200'000, 2);
  const double total = 0.8 * 0.8 + 0.3 * 0.3;
  EXPECT_NEAR(statistics(s.east).variance / total, 1, 0.15);
  EXPECT_NEAR(statistics(s.north).variance / total, 1, 0.15);
  EXPECT_NEAR(statistics(s.up).variance / total, 1.6 * 1.6, 0.5);
  EXPECT_NEAR(correlation(s.east, 300), 0.64 / total * std::exp(-1), 0.08);
  EXPECT_NEAR(correlation(s.north, 1), 0.64 / total, 0.03);  // the rest is white
  EXPECT_NEAR(statistics(s.accuracy).mean, sim::sqrt(total), 0.03);
  EXPECT_NEAR(sim::sqrt(statistics(s.accuracy).variance) / sim::sqrt(total), 0.2, 0.04);
  EXPECT_NEAR(sim::sqrt(statistics(s.velocity).variance), 0.05, 0.001);
  std::vector<double> radial;
  for (std::size_t i = 0; i < s.east.size(); ++i) radial.push_back(std::hypot(s.east[i], s.north[i]));
  std::nth_element(radial.begin(), radial.begin() + 100'000, radial.end());
  EXPECT_NEAR(radial[100'000], 1.0, 0.08);  // circular error probable
}

TEST(Gnss, outages_and_glitches_come_as_often_as_stated_and_never_at_the_start) {
  GnssParameters parameters;
  parameters.correlated_m = 0;
  parameters.white_m = 0.1;
  const auto s = gnss_at_rest(parameters, 100'000, 3);  // 20 000 s
  EXPECT_NEAR(s.outages, 20'000 / 95.0, 45);
  EXPECT_NEAR(s.lost * 0.2 / s.outages, 5, 0.6);
  const auto glitched =
      static_cast<double>(std::count_if(s.east.begin(), s.east.end(), [&, i = std::size_t{0}](double) mutable {
        const bool far = std::hypot(s.east[i], s.north[i]) > 2;
        ++i;
        return far;
      }));
  EXPECT_NEAR(glitched / s.fixes, 0.004 * 2.5, 0.003);
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    const auto start = gnss_at_rest(parameters, 99, seed);
    EXPECT_EQ(start.lost, 0);
    for (const double e : start.east) EXPECT_LT(magnitude(e), 1);
  }
}

TEST(Gnss, in_the_matched_world_it_is_white_with_the_sigma_it_states) {
  const auto s = gnss_at_rest(matched(Parameters{}).gnss, 40'000, 4);
  EXPECT_EQ(s.fixes, 40'000);
  EXPECT_NEAR(statistics(s.east).variance / (0.85 * 0.85), 1, 0.03);
  EXPECT_NEAR(correlation(s.east, 1), 0, 0.02);
  for (const double a : s.accuracy) ASSERT_NEAR(a, 0.85, 1e-6);
}

TEST(Gnss, the_antenna_swings_with_the_body) {
  GnssParameters parameters = perfect().gnss;
  parameters.antenna_b_m = {0.3, 0, 0.4};
  Gnss gnss{parameters, kEarth, 1};
  Truth truth{.roll_rad = 0.1, .yaw_rad = kPi / 2, .rate_b_radps = {0, 0, 0.5}, .v_n_mps = {0, 1, 0}};
  const auto reading = gnss.sample(truth, {200'000}, kNoFaults);
  const auto& p = *reading.position;
  const auto enu = kEarth.enu_m({p.latitude_2ndeg, p.longitude_2ndeg, static_cast<double>(p.height_m)});
  EXPECT_NEAR(enu[0], 0.4 * std::sin(0.1), 2e-4);  // heading north, leaning to the right: the mast leans east
  EXPECT_NEAR(enu[1], 0.3, 2e-4);
  EXPECT_NEAR(enu[2], 0.4 * std::cos(0.1), 2e-4);
  EXPECT_NEAR(reading.velocity->v_n_mps[0], -0.5 * 0.3 * std::cos(0.1), 1e-6);
  EXPECT_NEAR(reading.velocity->v_n_mps[1], 1, 1e-6);
}

TEST(Camera, sees_what_is_in_range_and_in_view_and_nothing_else) {
  const auto landmarks = parked_course(1).landmarks;
  Camera camera{perfect().camera, landmarks, 1};
  // ahead 5 m; 33 deg left 7.2 m; 90 deg left; 39 deg right 14.2 m; behind
  const auto seen = camera.sample({}, {200'000}, kNoFaults);
  ASSERT_EQ(seen.size(), 2U);
  EXPECT_EQ(seen[0].sighting.landmark, 1);
  EXPECT_FLOAT_EQ(seen[0].sighting.range_m, 5);
  EXPECT_NEAR(seen[0].sighting.bearing_rad, 0, 1e-6F);
  EXPECT_EQ(seen[1].sighting.landmark, 2);
  EXPECT_NEAR(seen[1].sighting.range_m, std::sqrt(52.0F), 1e-5F);
  EXPECT_NEAR(seen[1].sighting.bearing_rad, std::atan2(4.0F, 6.0F), 1e-6F);
  const auto turned = camera.sample({.yaw_rad = kPi - 0.1}, {400'000}, kNoFaults);
  ASSERT_EQ(turned.size(), 1U);
  EXPECT_EQ(turned[0].sighting.landmark, 5);
  EXPECT_NEAR(turned[0].sighting.bearing_rad, 0.1F, 1e-6F);
}

TEST(Camera, noise_misses_and_wrong_names_come_as_often_as_stated) {
  for (const bool mismatched : {false, true}) {
    const CameraNumbers n = mismatched ? CameraNumbers{} : matched(Parameters{}).camera;
    Camera camera{n, parked_course(1).landmarks, 1};
    std::vector<double> range, bearing;
    int wrong = 0;
    constexpr int kLooks = 40'000;
    for (int i = 0; i < kLooks; ++i)
      for (const auto& [s, landmark] : camera.sample({}, {200'000}, kNoFaults)) {
        if (s.range_m > 6.2F) continue;  // landmark 1 only, by its range
        EXPECT_EQ(landmark, 1);
        range.push_back(static_cast<double>(s.range_m) - 5);
        bearing.push_back(static_cast<double>(s.bearing_rad));
        wrong += s.landmark != 1 ? 1 : 0;
      }
    const double seen = static_cast<double>(range.size()) / kLooks;
    EXPECT_NEAR(seen, 0.85, 0.01);
    EXPECT_NEAR(sim::sqrt(statistics(range).variance), mismatched ? 0.15 : 0.10, 0.003);
    EXPECT_NEAR(statistics(range).mean, mismatched ? 0.025 : 0, 0.004);
    EXPECT_NEAR(sim::sqrt(statistics(bearing).variance), 0.015, 0.0003);
    EXPECT_NEAR(statistics(bearing).mean, mismatched ? -0.004 : 0, 0.0004);
    EXPECT_NEAR(wrong / static_cast<double>(range.size()), mismatched ? 0.005 * 0.8 : 0,
                0.0015);  // one in five draws names itself
  }
}

TEST(Camera, withholds_identities_and_keeps_what_was_truly_seen) {
  CameraNumbers n = perfect().camera;
  n.identities = false;
  Camera camera{n, parked_course(1).landmarks, 1};
  const auto seen = camera.sample({}, {200'000}, kNoFaults);
  ASSERT_EQ(seen.size(), 2U);
  for (const auto& one : seen) EXPECT_EQ(one.sighting.landmark, Camera::kNoLandmark);
  EXPECT_EQ(seen[0].landmark, 1);
  EXPECT_EQ(seen[1].landmark, 2);
}

TEST(Camera, clutter_comes_as_often_as_stated_anywhere_in_view_and_changes_no_other_draw) {
  CameraNumbers n;
  n.clutter = 1.3;
  Camera plain{CameraNumbers{}, parked_course(1).landmarks, 3}, cluttered{n, parked_course(1).landmarks, 3};
  constexpr int kLooks = 20'000;
  std::vector<double> bearing;
  for (int i = 0; i < kLooks; ++i) {
    const auto all = cluttered.sample({}, {200'000}, kNoFaults);
    std::vector<Camera::Seen> landmarks;
    for (const auto& one : all) {
      if (one.landmark != Camera::kNoLandmark) {
        landmarks.push_back(one);
        continue;
      }
      EXPECT_EQ(one.sighting.landmark, Camera::kNoLandmark);
      EXPECT_LE(static_cast<double>(one.sighting.range_m), n.range_max_m);
      bearing.push_back(static_cast<double>(one.sighting.bearing_rad));
    }
    const auto expected = plain.sample({}, {200'000}, kNoFaults);
    ASSERT_EQ(landmarks.size(), expected.size());
    for (std::size_t k = 0; k < expected.size(); ++k) {
      EXPECT_EQ(landmarks[k].sighting.range_m, expected[k].sighting.range_m);
      EXPECT_EQ(landmarks[k].sighting.landmark, expected[k].sighting.landmark);
    }
  }
  EXPECT_NEAR(static_cast<double>(bearing.size()) / kLooks, 1.3, 0.02);
  EXPECT_NEAR(statistics(bearing).mean, 0, 0.02);
  EXPECT_NEAR(sim::sqrt(statistics(bearing).variance), n.field_of_view_rad / std::sqrt(12.0), 0.01);
}

TEST(Camera, a_moving_obstacle_goes_to_and_fro_at_its_speed) {
  CameraNumbers n = perfect().camera;
  n.movers = 1;
  n.range_max_m = 100;
  n.field_of_view_rad = 2 * kPi;
  Camera camera{n, parked_course(1).landmarks, 5};
  double x = 0, y = 0, least_x = 1e9, most_x = -1e9, least_y = 1e9, most_y = -1e9;
  int turns = 0;
  for (int i = 0; i < 600; ++i) {
    for (const auto& one : camera.sample({}, seconds_us(0.1 * i), kNoFaults)) {
      if (one.landmark != Camera::kNoLandmark) continue;
      const double at_x =
          static_cast<double>(one.sighting.range_m) * std::cos(static_cast<double>(one.sighting.bearing_rad));
      const double at_y =
          static_cast<double>(one.sighting.range_m) * std::sin(static_cast<double>(one.sighting.bearing_rad));
      const double step = std::hypot(at_x - x, at_y - y);
      if (i > 0 && std::abs(step - 0.1 * n.mover_mps) > 1e-4) ++turns;  // it turns within the step
      if (i > 0) {
        EXPECT_LT(step, 0.1 * n.mover_mps + 1e-4);
      }
      x = at_x, y = at_y;
      least_x = std::min(least_x, x), most_x = std::max(most_x, x);
      least_y = std::min(least_y, y), most_y = std::max(most_y, y);
    }
  }
  EXPECT_NEAR(std::hypot(most_x - least_x, most_y - least_y), n.mover_way_m, 0.05);
  EXPECT_GE(turns, 4);
  EXPECT_LE(turns, 5);
}

TEST(Imu, the_biases_of_the_truth_are_what_it_shows_too_much) {
  ImuParameters parameters;
  parameters.gyro_noise = 0;
  parameters.accel_noise = {};
  parameters.earth_rotation = false;
  Imu imu{parameters, 0.1, kEarth, 3};
  base::Micros now;
  const Faults step{{{Fault::kGyroBiasStep, seconds_us(1), seconds_us(1)}}};
  for (int i = 0; i < 300; ++i) {
    for (int k = 0; k < 20; ++k) imu.sense({}, 0, now += Vehicle::kStep, step);
    const sensor::ImuSample s = imu.sample(now, step);
    const Vector3 gyro = imu.gyro_bias_radps();
    const Vector3 accel = imu.accel_bias_mps2();
    for (std::size_t a = 0; a < 3; ++a) {
      ASSERT_NEAR(static_cast<double>(s.dangle_b_rad[a]) * 100, gyro[a], 1e-7);
      ASSERT_NEAR(static_cast<double>(s.dvelocity_b_mps[a]) * 100, accel[a] + (a == 2 ? kEarth.gravity_mps2() : 0),
                  1e-5);
    }
  }
}

TEST(Wheels, an_error_that_is_a_share_of_each_readings_travel_has_that_size_and_no_memory) {
  WheelSensorNumbers parameters;
  parameters.counts_per_turn = 2e6;
  parameters.noise_share = 0.03;
  parameters.output = WheelOutput::kWheelSpeeds;
  Wheels wheels{parameters, matched(Parameters{}).vehicle, 5};
  std::vector<double> errors;
  Motion motion;
  motion.rim_left_m = motion.rim_right_m = 0.001;  // 2 m/s
  base::Micros now;
  for (int i = 0; i < 40'000; ++i) {
    for (int k = 0; k < 20; ++k) wheels.sense(motion, now += Vehicle::kStep, kNoFaults);
    errors.push_back(static_cast<double>(wheels.wheel_speeds().left_mps) - 2);
  }
  EXPECT_NEAR(statistics(errors).mean, 0, 0.001);
  EXPECT_NEAR(statistics(errors).variance / (0.06 * 0.06), 1, 0.03);
  EXPECT_NEAR(correlation(errors, 1), 0, 0.02);
}

MagnetometerNumbers perfect_magnetometer() {
  MagnetometerNumbers n;
  n.rate_hz = 20;
  n.noise_uT = n.hard_iron_uT = n.scale = n.local_uT = 0;
  return n;
}

TEST(Magnetometer, a_perfect_one_points_to_magnetic_north_whatever_the_attitude) {
  const MagnetometerNumbers parameters = perfect_magnetometer();
  Magnetometer magnetometer{parameters, kEarth, 1};
  for (const Vector3& attitude : {Vector3{0, 0, 0}, {0, 0, 1.2}, {0.2, -0.1, -2.5}, {-0.3, 0.4, 3.0}}) {
    Truth truth;
    truth.roll_rad = attitude[0], truth.pitch_rad = attitude[1], truth.yaw_rad = attitude[2];
    const sensor::MagneticFlux flux = magnetometer.sample(truth, {}, kNoFaults);
    const auto wide = [&flux](std::size_t i) { return static_cast<double>(flux.flux_b_uT[i]); };
    const Vector3 n = to_level(attitude, {wide(0), wide(1), wide(2)});
    EXPECT_NEAR(sim::atan2(n[0], n[1]), parameters.declination_rad, 1e-6);  // from north towards east
    EXPECT_NEAR(sim::atan2(-n[2], sim::sqrt(n[0] * n[0] + n[1] * n[1])), parameters.dip_rad, 1e-6);
    EXPECT_NEAR(sim::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]), parameters.field_uT, 1e-4);
  }
}

TEST(Magnetometer, its_errors_are_as_large_as_stated) {
  MagnetometerNumbers parameters = perfect_magnetometer();
  parameters.noise_uT = 0.3;
  Magnetometer noisy{parameters, kEarth, 2};
  Magnetometer clean{perfect_magnetometer(), kEarth, 2};
  std::vector<double> noise;
  for (int i = 0; i < 20'000; ++i)
    noise.push_back(static_cast<double>(noisy.sample({}, {}, kNoFaults).flux_b_uT[0]) -
                    static_cast<double>(clean.sample({}, {}, kNoFaults).flux_b_uT[0]));
  EXPECT_NEAR(statistics(noise).variance / 0.09, 1, 0.05);
  parameters.noise_uT = 0;
  parameters.hard_iron_uT = 0.8;
  std::vector<double> iron;
  for (std::uint64_t seed = 0; seed < 2'000; ++seed) {
    Magnetometer one{parameters, kEarth, seed};
    const float first = one.sample({}, {}, kNoFaults).flux_b_uT[1];
    ASSERT_EQ(one.sample({}, {}, kNoFaults).flux_b_uT[1], first) << "it stays";
    iron.push_back(static_cast<double>(first) - static_cast<double>(clean.sample({}, {}, kNoFaults).flux_b_uT[1]));
  }
  EXPECT_NEAR(statistics(iron).mean, 0, 0.06);
  EXPECT_NEAR(statistics(iron).variance / 0.64, 1, 0.1);
}

TEST(Magnetometer, iron_in_the_ground_changes_while_the_rover_drives_and_not_while_it_stands) {
  MagnetometerNumbers parameters = perfect_magnetometer();
  parameters.local_uT = 1;
  Magnetometer magnetometer{parameters, kEarth, 4};
  Truth truth;
  const auto flux = [&] { return static_cast<double>(magnetometer.sample(truth, {}, kNoFaults).flux_b_uT[0]); };
  const double parked = flux();
  for (int i = 0; i < 100; ++i) ASSERT_EQ(flux(), parked);
  truth.speed_mps = 1;
  std::vector<double> driving;
  for (int i = 0; i < 100'000; ++i) driving.push_back(flux());
  EXPECT_NEAR(statistics(driving).variance, 1, 0.15);
}

TEST(Barometer, a_perfect_one_is_the_standard_atmosphere) {
  BarometerNumbers parameters;
  parameters.rate_hz = 10;
  parameters.noise_Pa = parameters.turn_on_Pa = parameters.drift_Pa = 0;
  const auto at_height = [](double height_m) { return Earth{{48, 11, height_m}}; };
  const Earth low = at_height(500), high = at_height(1000);
  // ISO 2533, table 5: 95 460.8 Pa at 500 m, 89 874.6 Pa at 1000 m (of geopotential height).
  EXPECT_NEAR(static_cast<double>(Barometer(parameters, low, 1).sample({}).pressure_Pa), 95'460.8, 2);
  EXPECT_NEAR(static_cast<double>(Barometer(parameters, high, 1).sample({}).pressure_Pa), 89'874.6, 2);
  Truth higher;
  higher.z_m = 10;
  const double per_metre = (static_cast<double>(Barometer(parameters, kEarth, 1).sample(higher).pressure_Pa) -
                            static_cast<double>(Barometer(parameters, kEarth, 1).sample({}).pressure_Pa)) /
                           10;
  EXPECT_NEAR(per_metre, -11.43, 0.05);
}

TEST(Barometer, noise_offset_and_drift_are_as_large_as_stated) {
  BarometerNumbers parameters;
  parameters.rate_hz = 10;
  std::vector<double> offsets, noise;
  for (std::uint64_t seed = 0; seed < 1'000; ++seed) {
    Barometer barometer{parameters, kEarth, seed};
    const auto pressure = [&] { return static_cast<double>(barometer.sample({}).pressure_Pa); };
    const double first = pressure();
    offsets.push_back(first);
    noise.push_back(pressure() - first);
  }
  EXPECT_NEAR(statistics(offsets).variance / (50.0 * 50 + 30 * 30 + 2 * 2), 1, 0.12);
  EXPECT_NEAR(statistics(noise).variance / 8, 1, 0.15);  // of two readings; the drift is slow
}

}  // namespace
}  // namespace tetap::sim
