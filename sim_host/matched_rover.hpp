// SPDX-License-Identifier: Apache-2.0
// The rover with exactly the matched world's noise, the numbers with which a filter is consistent there. The filter's
// model is the world's (Bar-Shalom, Li, Kirubarajan 2001, sec. 5.4). It is for judging: there is no such robot, so no
// image.
#pragma once

#include "config/parameters/rover.hpp"
#include "config/parameters/rover_landmarks.hpp"
#include "sim_host/world/world.hpp"

namespace tetap::sim {

/// For a world whose only errors are matched()'s. Everything that is not noise is the rover's.
[[nodiscard]] inline param::Parameters matched_landmarks_rover(const World::Options& options = {.mismatched = false}) {
  const Parameters world = options.mismatched ? options.parameters : matched(options.parameters);
  const auto single = [](double x) { return static_cast<float>(x); };
  param::Parameters n = robot::rover_landmarks::parameters;
  // The world's own, whatever a calibration made of the robot's.
  n.imu = {};
  n.wheels.drive.left_radius_m = n.wheels.drive.right_radius_m = single(world.vehicle.wheel_radius_m);
  n.wheels.drive.track_m = single(world.vehicle.track_m);
  n.wheels.drive.counts_per_turn = single(world.wheels.counts_per_turn);
  n.wheels.drive.noise_left = n.wheels.drive.noise_right = single(world.wheels.noise_m);
  n.gyro.noise = single(world.imu.gyro_noise * world.imu.gyro_noise);
  n.gyro.bias_time_s = 1e9F;  // there is no bias: an average at standstill would learn the noise
  n.landmark.sigma_range_m = single(world.camera.sigma_range_m);
  n.landmark.sigma_range_per_m = single(world.camera.sigma_range_per_m);
  n.landmark.sigma_bearing_rad = single(world.camera.sigma_bearing_rad);
  n.gnss.sigma_floor_m = 0.001F;  // the receiver's accuracy figure is exact
  n.gnss.sigma_scale = 1;
  // A first fix as origin would be a metre off the map, for the whole run.
  const GeodeticPoint origin = Earth{options.origin}.geodetic({});
  n.gnss.origin_configured = 1;
  n.gnss.origin_latitude_2ndeg = origin.latitude_2ndeg;
  n.gnss.origin_longitude_2ndeg = origin.longitude_2ndeg;
  n.gnss.origin_height_m = single(origin.height_m);
  return n;
}

/// Parameters of the rover with inertial navigation, for a world with matched_inertial()'s errors.
[[nodiscard]] inline param::Parameters matched_rover() {
  const World::Options options{.mismatched = false, .inertial = true};
  const Parameters world = matched_inertial(options.parameters);
  const auto single = [](double x) { return static_cast<float>(x); };
  const double walk_rthz = sim::sqrt(2 / world.imu.walk_tau_s);
  param::Parameters n = robot::rover::parameters;
  const param::Parameters planar = matched_landmarks_rover();
  n.imu = planar.imu;
  n.wheels = planar.wheels;
  n.gyro = planar.gyro;
  n.gnss = planar.gnss;
  n.gnss.gate_scale = robot::rover::parameters.gnss.gate_scale;
  n.gnss.antenna_x_b_m = single(world.gnss.antenna_b_m[0]);
  n.gnss.antenna_y_b_m = single(world.gnss.antenna_b_m[1]);
  n.gnss.antenna_z_b_m = single(world.gnss.antenna_b_m[2]);
  n.gnss.sigma_velocity_floor_mps = 0.001F;
  n.inertial.mounting_bs = param::InertialParameters{}.mounting_bs;
  n.inertial.gyro_radps_rthz = single(world.imu.gyro_noise);
  n.inertial.gyro_scale = 0;
  n.inertial.accel_mps2_rthz = single(world.imu.accel_noise[2]);
  n.inertial.gyro_bias_radps2_rthz = single(world.imu.gyro_walk_radps * walk_rthz);
  n.inertial.accel_bias_mps3_rthz = single(world.imu.accel_walk_mps2 * walk_rthz);
  n.inertial.gyro_turn_on_radps = single(world.imu.gyro_walk_radps);
  n.inertial.accel_turn_on_mps2 = single(world.imu.accel_walk_mps2);
  n.inertial.wheel_mps = single(world.vehicle.jitter_ahead_mps);
  n.inertial.slip_share = 0;  // the wheels' noise is that of odometry: k metres squared per metre
  n.inertial.lateral_mps = n.inertial.vertical_mps = single(world.vehicle.jitter_mps);
  // Bus or not, a judge wants sigmas beside their errors.
  n.publish.std_every = n.publish.attitude_every = n.publish.state_every = 5;
  return n;
}

}  // namespace tetap::sim
