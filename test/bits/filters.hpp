// SPDX-License-Identifier: Apache-2.0
// Every filter on random input with outliers and resets; the raw bits of state, covariance and innovation hashed at
// every step.
#pragma once

#include "config/rover.hpp"
#include "tetap/base/selfcheck.hpp"
#include "tetap/base/state_words.hpp"
#include "tetap/estimators/planar/dead_reckoning.hpp"
#include "tetap/filter/kalman.hpp"
#include "tetap/firmware/boot_self_check.hpp"
#include "tetap/model/bearing.hpp"
#include "tetap/model/constant_velocity.hpp"
#include "tetap/model/gnss_position.hpp"
#include "tetap/model/range.hpp"
#include "tetap/model/range_bearing.hpp"
#include "tetap/nav/geodesy.hpp"

#include <array>
#include <cstdint>

namespace tetap::bits {

/// A generator of numbers and of incidents. Two draws never stand in one argument list: compilers order those as they
/// like; in braces they stand in order.
struct Chance {
  base::Random random;
  firmware::Dice dice{2026};

  float normal() { return random.normal(); }
  float spread() { return 2.0F * random.uniform() - 1.0F; }
  /// In [-limit, limit).
  std::int64_t within(std::int64_t limit) {
    return static_cast<std::int64_t>(dice.roll() >> 6) * limit / (1 << 25) - limit;
  }
  bool one_in(std::uint32_t n) { return dice.one_in(n); }
  /// Noise of a sensor: one in forty is an outlier.
  float noise(float sigma) { return sigma * (one_in(40) ? 25.0F : 1.0F) * normal(); }
};

template <class Filter>
void hash_packed(base::WordHash& hash, const Filter& filter) {
  for (const float v : filter.p.packed()) hash(v);
}
template <int M>
void hash_innovation(base::WordHash& hash, const filter::Innovation<float, M>& innovation) {
  for (int i = 0; i < M; ++i) hash(innovation.nu(i));
  for (const float v : innovation.s.packed()) hash(v);
  hash(innovation.nis);
  hash(static_cast<std::uint32_t>(innovation.verdict));
}
template <int N>
void hash_vector(base::WordHash& hash, const filter::Vector<float, N>& x) {
  for (int i = 0; i < N; ++i) hash(x(i));
}

/// Constant velocity in the plane, position measured.
[[nodiscard]] inline std::uint32_t kalman_constant_velocity(std::uint32_t steps) {
  base::WordHash hash;
  Chance chance{.random = base::Random{1, 1}};
  filter::Kalman<float, 4> kf;
  float x_m = 0, y_m = 0;
  for (std::uint32_t k = 0; k < steps; ++k) {
    if (k % 1000 == 0 || chance.one_in(700)) {
      kf.x.value << chance.normal(), 0.0F, chance.normal(), 0.0F;
      kf.p = filter::Symmetric<float, 4>::diagonal({10.0F, 10.0F, 10.0F, 10.0F});
      x_m = y_m = 0;
    }
    const float dt_s = 0.1F + 0.05F * chance.spread();
    x_m += 1.0F * dt_s;
    y_m += 0.3F * dt_s;
    kf.predict(model::ConstantVelocity<float>{.dt_s = dt_s, .acceleration_variance = 0.1F});
    const auto innovation =
        kf.update(filter::DirectMeasurement<float, 4, 0, 2>{.z = {x_m + chance.noise(0.5F), y_m + chance.noise(0.5F)},
                                                            .variance = {0.25F, 0.25F}},
                  filter::chi_square_99(2));
    hash_innovation(hash, innovation);
    hash_vector<4>(hash, kf.x.value);
    hash_packed(hash, kf);
  }
  return hash.value();
}

/// Eight states with a dense transition, four measured at once: sums long enough for a compiler or library to reorder.
[[nodiscard]] inline std::uint32_t kalman_dense(std::uint32_t steps) {
  base::WordHash hash;
  Chance chance{.random = base::Random{1, 2}};
  filter::Kalman<float, 8> kf;
  filter::LinearMotion<float, 8> motion;
  for (std::uint32_t k = 0; k < steps; ++k) {
    if (k % 1000 == 0 || chance.one_in(700)) {
      for (int c = 0; c < 8; ++c)
        for (int r = 0; r < 8; ++r) motion.f(r, c) = (r == c ? 0.95F : 0.0F) + 0.05F * chance.spread();
      motion.q = {};
      for (int i = 0; i < 8; ++i) motion.q(i, i) = 0.01F + 0.01F * chance.random.uniform();
      kf = {};
      for (int i = 0; i < 8; ++i) kf.p(i, i) = 10.0F;
    }
    kf.predict(motion);
    const auto innovation = kf.update(
        filter::DirectMeasurement<float, 8, 0, 2, 5, 7>{
            .z = {chance.noise(0.3F), chance.noise(0.3F), chance.noise(0.3F), chance.noise(0.3F)},
            .variance = {0.09F, 0.09F, 0.16F, 0.04F}},
        filter::chi_square_99(4));
    hash_innovation(hash, innovation);
    hash_vector<8>(hash, kf.x.value);
    hash_packed(hash, kf);
  }
  return hash.value();
}

/// The planar pose with every motion and measurement model there is, 50 km from the origin.
[[nodiscard]] inline std::uint32_t ekf_planar(std::uint32_t steps) {
  base::WordHash hash;
  Chance chance{.random = base::Random{1, 3}};
  estimators::PlanarEkf ekf;
  const model::UnicycleNoise noise{
      .speed = 1e-3F, .speed_per_speed = 1e-2F, .yaw_rate = 1e-3F, .yaw_rate_per_yaw_rate = 1e-2F};
  const model::DifferentialDrive drive{.left_radius_m = 0.1F,
                                       .right_radius_m = 0.1F,
                                       .track_m = 0.5F,
                                       .counts_per_turn = 2000.0F,
                                       .noise_left = 0.002F,
                                       .noise_right = 0.002F};
  const model::PlanarMounting mounting{.x_b_m = 0.2F, .y_b_m = -0.1F, .yaw_rad = 0.3F};
  constexpr std::int64_t kFar_um = 50'000'000'000;
  model::PlanarPose truth;
  const auto move = [&](const model::PlanarIncrement& increment) {
    truth = increment.predict(truth);
    ekf.predict(increment);
  };
  for (std::uint32_t k = 0; k < steps; ++k) {
    if (k % 1000 == 0 || chance.one_in(700)) {
      truth = {.x = base::Anchored::from_um(kFar_um),
               .y = base::Anchored::from_um(-kFar_um),
               .yaw_rad = 3.0F * chance.spread()};
      ekf.x = truth.plus({0.3F * chance.normal(), 0.3F * chance.normal(), 0.1F * chance.normal()});
      ekf.p = filter::Symmetric<float, 3>::diagonal({0.1F, 0.1F, 0.01F});
    }
    const std::array<float, 2> speeds{chance.spread(), chance.spread()};
    if (k % 2 == 0) {
      move(model::Unicycle{.forward_mps = 1.0F + speeds[0], .yaw_rate_radps = speeds[1], .noise = noise}.increment(
          0.1F));
    } else {
      move(drive.increment(0.1F + 0.05F * speeds[0], 0.1F + 0.05F * speeds[1],
                           k % 3 == 0 ? model::Arc::kMidpoint : model::Arc::kExact));
    }
    const model::Landmark landmark{.x = base::Anchored::from_um(kFar_um).plus(40.0F * chance.spread()),
                                   .y = base::Anchored::from_um(-kFar_um).plus(40.0F * chance.spread())};
    const model::Sight sight(truth, landmark, mounting);
    const float range_m = sight.range_m() + chance.noise(0.1F);
    const float bearing_rad = sight.bearing_rad(truth, mounting) + chance.noise(0.02F);
    const float gate1 = filter::chi_square_99(1), gate2 = filter::chi_square_99(2);
    switch (chance.dice.below(5)) {
      case 0:
        hash_innovation(hash, ekf.update(model::RangeBearing{.range_m = range_m,
                                                             .bearing_rad = bearing_rad,
                                                             .sigma_range_m = 0.1F,
                                                             .sigma_bearing_rad = 0.02F,
                                                             .landmark = landmark,
                                                             .mounting = mounting},
                                         gate2));
        break;
      case 1:
        hash_innovation(
            hash,
            ekf.update(
                model::Range{.range_m = range_m, .sigma_range_m = 0.1F, .landmark = landmark, .mounting = mounting},
                gate1));
        break;
      case 2:
        hash_innovation(hash, ekf.update(model::Bearing{.bearing_rad = bearing_rad,
                                                        .sigma_bearing_rad = 0.02F,
                                                        .landmark = landmark,
                                                        .mounting = mounting},
                                         gate1));
        break;
      case 3:
        hash_innovation(hash, ekf.update(model::GnssPosition{.x = truth.x.plus(chance.noise(1.0F)),
                                                             .y = truth.y.plus(chance.noise(1.0F)),
                                                             .sigma_m = 1.0F,
                                                             .antenna_x_b_m = 0.3F},
                                         gate2));
        break;
      default:
        break;
    }
    hash(ekf.x.x.anchor_um);
    hash(ekf.x.x.offset_m);
    hash(ekf.x.y.anchor_um);
    hash(ekf.x.y.offset_m);
    hash(ekf.x.yaw_rad);
    hash_packed(hash, ekf);
  }
  return hash.value();
}

/// Odometry from counts, wheel speeds, body speeds and a gyroscope, with gaps and samples in the wrong order.
[[nodiscard]] inline std::uint32_t dead_reckoning(std::uint32_t steps) {
  base::WordHash hash;
  Chance chance{.random = base::Random{1, 4}};
  param::Parameters parameters = robot::rover::parameters;
  estimators::DeadReckoning motion;
  std::int64_t now_us = 0;
  sensor::WheelCounts counts;
  for (std::uint32_t k = 0; k < steps; ++k) {
    if (k % 1000 == 0 || chance.one_in(700)) {
      parameters.gyro.use = static_cast<std::int32_t>(chance.dice.below(2));
      parameters.wheels.hold = chance.one_in(2) ? param::Hold::kForward : param::Hold::kBackward;
      motion = {};
      motion.start({now_us}, model::PlanarPose{.yaw_rad = 3.0F * chance.spread()}, 0.1F, 0.05F);
    }
    now_us += chance.one_in(200) ? 700'000 : 10'000;
    const base::Micros stamp{now_us - static_cast<std::int64_t>(chance.dice.below(20'000))};
    counts.left = static_cast<std::uint16_t>(counts.left + 30 + chance.dice.below(20));
    counts.right = static_cast<std::uint16_t>(counts.right + 30 + chance.dice.below(25));
    switch (chance.dice.below(8)) {
      case 0:
        motion.fuse(sensor::WheelSpeeds{.left_mps = chance.spread(), .right_mps = chance.spread()}, stamp, parameters);
        break;
      case 1:
        motion.fuse(sensor::BodySpeed{.forward_mps = chance.spread(), .yaw_rate_radps = chance.spread()}, stamp,
                    parameters);
        break;
      default:
        motion.fuse(counts, stamp, parameters);
        break;
    }
    motion.fuse(sensor::ImuSample{.dangle_b_rad = {0.0F, 0.0F, 0.01F * chance.normal()}, .interval_us = 10'000}, stamp,
                parameters);
    motion.advance({now_us});
    base::each_word(motion, hash);
    const estimators::Estimate ahead = motion.estimate(parameters);
    hash(ahead.pose.x.um());
    hash(ahead.pose.y.um());
    hash(ahead.pose.yaw_rad);
    hash_packed(hash, ahead);
  }
  return hash.value();
}

/// WGS84 to the local plane and back: the one place where double is flashed.
[[nodiscard]] inline std::uint32_t geodesy(std::uint32_t steps) {
  base::WordHash hash;
  Chance chance{.random = base::Random{1, 5}};
  nav::LocalFrame frame;
  for (std::uint32_t k = 0; k < steps; ++k) {
    if (k % 16 == 0) {
      const std::array<std::int64_t, 2> origin{chance.within(45'000'000'000), chance.within(90'000'000'000)};
      frame = nav::LocalFrame(origin[0], origin[1], 4000.0F * chance.spread());
    }
    const std::array<std::int64_t, 2> fix{frame.latitude_2ndeg() + chance.within(50'000'000),
                                          frame.longitude_2ndeg() + chance.within(50'000'000)};
    const nav::Local local = frame.to_local(fix[0], fix[1], 4000.0F * chance.spread());
    hash(local.east_um);
    hash(local.north_um);
    hash(static_cast<std::uint32_t>(local.valid));
    const auto back = frame.to_geodetic(local);
    hash(static_cast<std::uint32_t>(back.has_value()));
    if (!back.has_value()) continue;
    hash(back->latitude_2ndeg);
    hash(back->longitude_2ndeg);
    hash(back->height_m);
  }
  return hash.value();
}

}  // namespace tetap::bits
