// SPDX-License-Identifier: Apache-2.0
// A robot's own body and sensors in the simulated world, from its parameters: class of vehicle, geometry, mounting,
// course, noise. Nothing here asks for a robot's name, so a copy with other numbers is simulated with those.
//
// A robot's parameters state what a filter may count on. Each magnitude of the world is a share of that, below 1: the
// world has errors beside that no filter models. The shares are those of the default rover's data sheets
// (world/numbers.hpp) over its parameters.
#pragma once

#include "sim_host/world/world.hpp"
#include "tetap/param/parameters.hpp"

#include <algorithm>
#include <array>
#include <cstddef>

namespace tetap::sim {

/// Wheels that steer give a speed and no turn, and are kept from moving sideways; without either, it flies.
[[nodiscard]] constexpr VehicleKind vehicle_kind(const param::Parameters& n, bool inertial) {
  if (n.wheels.drive.left_radius_m > 0 || !inertial) return VehicleKind::kDifferentialDrive;
  const bool constrained = n.inertial.constrain_every_us > 0 || n.inertial.starts_forward != 0;
  return constrained ? VehicleKind::kCar : VehicleKind::kMulticopter;
}

/// Choices of a simulation, beside the robot's parameters.
struct SimulatedAs {
  VehicleKind kind = VehicleKind::kDifferentialDrive;
  bool inertial = false;   ///< an inertial filter is there, whose parameters state the noise of its sensors
  bool landmarks = false;  ///< the robot sees landmarks, whose map fixes its frame
  bool own_map = false;    ///< the robot makes that map and is given none
  bool nameless = false;   ///< the landmarks have no identities
  bool scans = false;      ///< the robot has a laser scanner, and a camera whose features are followed
  bool images = false;
  bool own_noise = true;  ///< false: the world's own numbers are already those of the robot's parameters
};

namespace detail {

inline constexpr double kNoiseShare = 0.4;  ///< densities of IMU noise in motion, and of the walks of its biases
inline constexpr double kGyroShare = 0.1;   ///< broadband vibration of a gyroscope
inline constexpr double kAccelTurnOnShare = 0.25;
inline constexpr double kGyroTurnOnShare = 0.1745;  ///< 0.1 deg/s for 0.01 rad/s
inline constexpr double kVelocityShare = 0.5;       ///< speed error over the floor of its 1 sigma
inline constexpr double kWrongIds = 0.05;           ///< share of recognitions that name another landmark [own]
inline constexpr double kOwnSpeed_radps = 20;       ///< fastest turn of a gear motor's wheel [own]

template <std::size_t N>
[[nodiscard]] std::array<double, N> wide(const std::array<float, N>& single) {
  std::array<double, N> all;
  std::copy(single.begin(), single.end(), all.begin());
  return all;
}
[[nodiscard]] inline double wide(float x) { return static_cast<double>(x); }

/// From the axes of the IMU into the body's. A planar robot states the third row alone: any such rotation will do.
[[nodiscard]] inline Matrix3 imu_mounting(const param::Parameters& n, bool inertial) {
  if (inertial) return {wide(n.inertial.mounting_bs)};
  const Vector3 up = wide(n.gyro.up_s);
  const Vector3 other = magnitude(up[0]) < 0.9 ? Vector3{1, 0, 0} : Vector3{0, 1, 0};
  const Vector3 y = cross(up, other);
  const Vector3 left = 1 / sim::sqrt(y[0] * y[0] + y[1] * y[1] + y[2] * y[2]) * y;
  const Vector3 ahead = cross(left, up);
  return {{ahead[0], ahead[1], ahead[2], left[0], left[1], left[2], up[0], up[1], up[2]}};
}

inline void set_wheels(const param::WheelParameters& n, World::Options& world) {
  const auto& d = n.drive;
  VehicleParameters& vehicle = world.parameters.vehicle;
  WheelSensorNumbers& wheels = world.parameters.wheels;
  if (d.left_radius_m <= 0) return;
  vehicle.wheel_radius_m = 0.5 * (wide(d.left_radius_m) + wide(d.right_radius_m));
  vehicle.drawn_difference = (wide(d.left_radius_m) - wide(d.right_radius_m)) / vehicle.wheel_radius_m;
  vehicle.track_m = wide(d.track_m);
  if (d.counts_per_turn > 1) wheels.counts_per_turn = wide(d.counts_per_turn);
  world.limits.speed_mps = std::min(world.limits.speed_mps, kOwnSpeed_radps * vehicle.wheel_radius_m);
  if (d.noise_left > 0 || n.hold == param::Hold::kForward) return;
  if (n.wheel_speed_noise > 0) {
    wheels.output = WheelOutput::kWheelSpeeds;
    wheels.rate_hz = 10;
    wheels.stated_scale = {1 / wide(n.left_speed_scale), 1 / wide(n.right_speed_scale)};
  } else if (n.noise.speed > 0) {
    wheels.output = WheelOutput::kBodySpeed;
    wheels.rate_hz = 10;
    wheels.stated_scale = {1 / wide(n.speed_scale), 1 / wide(n.yaw_rate_scale)};
    // Skidding: a share that lasts for tau errs by 2 share^2 tau rate per radian turned; at half a radian a second.
    constexpr double kTurn_radps = 0.5;
    vehicle.slip_yaw =
        kNoiseShare * sim::sqrt(wide(n.noise.yaw_rate_per_yaw_rate) / (2 * vehicle.slip_random_tau_s * kTurn_radps));
  }
}

/// A car of 5.5 m turning radius with a speedometer on its wheels [own].
inline void set_car(const param::InertialParameters& n, World::Options& world) {
  VehicleParameters& vehicle = world.parameters.vehicle;
  vehicle.wheel_radius_m = 0.3;
  vehicle.track_m = 1.5;
  vehicle.turning_radius_m = 5.5;
  vehicle.acceleration_lag_s = 0.3;
  vehicle.steer_beside_per_m2 = 0.015;
  vehicle.steer_heading_per_m = 0.25;
  vehicle.steer_most_m = 2;
  vehicle.driver_wander_m = 0.2;
  world.limits = {.speed_mps = 12, .acceleration_mps2 = 1.5, .lateral_mps2 = 2, .yaw_rate_radps = 0.6};
  WheelSensorNumbers& wheels = world.parameters.wheels;
  wheels.output = WheelOutput::kBodySpeed;
  wheels.rate_hz = 10;
  wheels.yaw_rate = false;
  wheels.speed_noise_mps = kNoiseShare * wide(n.wheel_mps);
  wheels.speed_scale = kNoiseShare * wide(n.slip_share);
  world.parameters.imu.vibration_speed_mps = 12;  // on springs, and on a road
}

/// A multicopter, whose rotors shake it at 80 Hz while it flies [own].
inline void set_multicopter(World::Options& world) {
  VehicleParameters& vehicle = world.parameters.vehicle;
  ImuParameters& imu = world.parameters.imu;
  vehicle.driver_wander_m = 0.3;
  imu.lugs = 1;
  vehicle.rotor_mps = imu.vibration_speed_mps;
  vehicle.wheel_radius_m = vehicle.rotor_mps / (2 * kPi * 80);  // of the circle on which the shaking goes round
  world.limits = {.speed_mps = 5, .acceleration_mps2 = 1.5, .lateral_mps2 = 2, .yaw_rate_radps = 0.8};
  world.parameters.magnetometer.local_uT = 0.3;  // high above the iron in the ground
}

inline void set_mounting(const param::Parameters& n, bool inertial, Parameters& world) {
  world.vehicle.axle_x_b_m = wide(n.inertial.axle_x_b_m);
  world.gnss.antenna_b_m = {wide(n.gnss.antenna_x_b_m), wide(n.gnss.antenna_y_b_m), wide(n.gnss.antenna_z_b_m)};
  world.imu.mounting_bs = imu_mounting(n, inertial);
  world.imu.position_b_m = wide(n.inertial.position_b_m);
  world.camera.x_b_m = wide(n.landmark.mounting.x_b_m);
  world.camera.y_b_m = wide(n.landmark.mounting.y_b_m);
  world.camera.yaw_rad = wide(n.landmark.mounting.yaw_rad);
  // The errors that a calibration of the robot found are its sensors' own.
  world.imu.accel_matrix = {wide(n.imu.accel_matrix)};
  world.imu.accel_bias_mps2 = wide(n.imu.accel_bias_mps2);
  const double warmer = world.imu.temperature_degC - wide(n.imu.gyro_bias_at_degC);
  world.imu.gyro_bias_radps = wide(n.imu.gyro_bias_radps) + warmer * wide(n.imu.gyro_bias_slope_radps_per_degC);
  if (n.magnetic.use == 0) return;
  world.magnetometer.mounting_bs = {wide(n.magnetic.mounting_bs)};
  world.magnetometer.soft_iron = {wide(n.magnetic.soft_iron)};
  world.magnetometer.found_hard_iron_uT = wide(n.magnetic.hard_iron_uT);
  world.magnetometer.declination_rad = wide(n.magnetic.declination_rad);
  if (n.magnetic.norm_uT > 0) world.magnetometer.field_uT = wide(n.magnetic.norm_uT);
}

inline void set_scanner(const param::LidarParameters& n, LidarNumbers& lidar) {
  lidar.x_b_m = wide(n.x_b_m);
  lidar.y_b_m = wide(n.y_b_m);
  lidar.yaw_rad = wide(n.yaw_rad);
  lidar.min_m = wide(n.min_m);
  lidar.max_m = wide(n.max_m);
  lidar.stamp_late = {n.delay_us};
}

/// An image whose middle the camera's axis meets.
inline void set_camera(const param::CameraParameters& n, FeatureCameraNumbers& camera) {
  camera.fu_px = wide(n.fu_px);
  camera.fv_px = wide(n.fv_px);
  camera.cu_px = wide(n.cu_px);
  camera.cv_px = wide(n.cv_px);
  camera.width_px = static_cast<int>(2 * camera.cu_px + 1);
  camera.height_px = static_cast<int>(2 * camera.cv_px + 1);
  camera.mounting_bc = {wide(n.mounting_bc)};
  camera.x_b_m = wide(n.position_b_m[0]);
  camera.y_b_m = wide(n.position_b_m[1]);
  camera.z_b_m = wide(n.position_b_m[2]);
  camera.stamp_late = {n.delay_us};
  camera.noise_px = std::min(camera.noise_px, wide(n.sigma_px));
  camera.mount_sigma_rad = std::min(camera.mount_sigma_rad, wide(n.sigma_mounting_rad));
}

inline void set_imu_noise(const param::InertialParameters& n, ImuParameters& imu) {
  imu.gyro_noise = std::min(imu.gyro_noise, wide(n.gyro_radps_rthz));
  for (double& one : imu.accel_noise) one = std::min(one, wide(n.accel_mps2_rthz));
  imu.vibration_noise = kNoiseShare * wide(n.accel_mps2_rthz);
  imu.vibration_gyro_noise = kGyroShare * wide(n.gyro_radps_rthz);
  imu.gyro_scale = wide(n.gyro_scale);
  imu.gyro_turn_on_radps = kGyroTurnOnShare * wide(n.gyro_turn_on_radps);
  imu.accel_turn_on_mps2 = kAccelTurnOnShare * wide(n.accel_turn_on_mps2);
  // A Gauss-Markov process is driven with a density of sigma sqrt(2 / tau).
  const double per_density = kNoiseShare * sim::sqrt(imu.walk_tau_s / 2);
  imu.gyro_walk_radps = per_density * wide(n.gyro_bias_radps2_rthz);
  imu.accel_walk_mps2 = per_density * wide(n.accel_bias_mps3_rthz);
}

inline void set_gnss_noise(const param::GnssParameters& n, GnssParameters& gnss) {
  const double own_m = sim::sqrt(gnss.white_m * gnss.white_m + gnss.correlated_m * gnss.correlated_m);
  const double total_m = std::max(own_m, wide(n.sigma_floor_m));
  if (n.correlation_s > 0) {
    gnss.white_m *= total_m / own_m;
    gnss.correlated_m *= total_m / own_m;
    gnss.correlated_tau_s = wide(n.correlation_s);
  } else {
    gnss.white_m = total_m;
    gnss.correlated_m = 0;
  }
  gnss.accuracy_scale = 1 / wide(n.sigma_scale);
  gnss.velocity_mps = std::max(gnss.velocity_mps, kVelocityShare * wide(n.sigma_velocity_floor_mps));
}

/// Only what an inertial filter models, as large as its parameters state; on top of world/numbers.hpp's own.
inline void set_matched_noise(const param::Parameters& n, Parameters& world) {
  const Parameters own = world;
  world = matched_inertial(world);
  world.wheels.counts_per_turn = own.wheels.counts_per_turn;
  world.wheels.speed_noise_mps /= kNoiseShare;
  world.wheels.speed_scale = 0;
  world.wheels.noise_m = wide(n.wheels.drive.noise_left);
  world.vehicle.slip_yaw = 0;
  world.gnss.antenna_b_m = own.gnss.antenna_b_m;
  world.gnss.velocity_mps = std::max(own.gnss.velocity_mps, wide(n.gnss.sigma_velocity_floor_mps));
  ImuParameters& imu = world.imu;
  imu.gyro_noise = wide(n.inertial.gyro_radps_rthz);
  imu.accel_noise.fill(wide(n.inertial.accel_mps2_rthz));
  const double per_density = sim::sqrt(imu.walk_tau_s / 2);
  imu.gyro_walk_radps = per_density * wide(n.inertial.gyro_bias_radps2_rthz);
  imu.accel_walk_mps2 = per_density * wide(n.inertial.accel_bias_mps3_rthz);
  const auto rest = [](double all, double walk) { return all > walk ? sim::sqrt(all * all - walk * walk) : 0; };
  imu.gyro_turn_on_radps = rest(wide(n.inertial.gyro_turn_on_radps), imu.gyro_walk_radps);
  imu.accel_turn_on_mps2 = rest(wide(n.inertial.accel_turn_on_mps2), imu.accel_walk_mps2);
}

/// World::effective()'s matched world, with the encoder and the antenna that the robot states.
inline void set_matched_geometry(Parameters& world) {
  const Parameters own = world;
  world = matched(world);
  world.wheels.counts_per_turn = own.wheels.counts_per_turn;
  world.gnss.antenna_b_m = own.gnss.antenna_b_m;
}

}  // namespace detail

/// Course and limits are those of its class; `world.mismatched`: all of the world's errors act.
inline void simulate(const param::Parameters& n, const SimulatedAs& as, World::Options& world) {
  Parameters& p = world.parameters;
  p.vehicle.kind = as.kind;
  detail::set_wheels(n.wheels, world);
  if (as.kind == VehicleKind::kCar) detail::set_car(n.inertial, world);
  if (as.kind == VehicleKind::kMulticopter) detail::set_multicopter(world);
  if (as.inertial && n.recovery.at_least * 500'000LL < n.recovery.after_us) p.gnss.rate_hz = 1;  // fixes come seldom
  world.surveyed = as.landmarks || n.gnss.origin_configured != 0;
  world.map_given = !as.own_map;
  p.camera.identities = !as.nameless;
  if (as.scans) detail::set_scanner(n.lidar, p.lidar);
  if (as.images) detail::set_camera(n.camera, p.features);
  if (as.images && as.own_map) p.features.wrong_id_probability = detail::kWrongIds;
  if (!as.own_noise) return;
  detail::set_mounting(n, as.inertial, p);
  p.camera.sigma_range_m = std::min(p.camera.sigma_range_m, detail::wide(n.landmark.sigma_range_m));
  p.camera.sigma_bearing_rad = std::min(p.camera.sigma_bearing_rad, detail::wide(n.landmark.sigma_bearing_rad));
  if (as.inertial) {
    detail::set_imu_noise(n.inertial, p.imu);
    detail::set_gnss_noise(n.gnss, p.gnss);
  }
  world.as_given = !world.mismatched && (as.inertial || n.wheels.drive.counts_per_turn > 1);
  if (!world.as_given) return;
  if (as.inertial) {
    detail::set_matched_noise(n, p);
  } else {
    detail::set_matched_geometry(p);
  }
}

}  // namespace tetap::sim
