// SPDX-License-Identifier: Apache-2.0
// The rover with exactly the matched world's noise: what a filter must be told to be consistent there (Bar-Shalom, Li,
// Kirubarajan 2001, sec. 5.4: the filter's model is the world's). For judging; there is no such robot, so no image.
#pragma once

#include "config/rover.hpp"
#include "sim_host/world/world.hpp"

namespace tetap::sim {

/// For a world whose only errors are matched()'s. Everything that is not noise is the rover's.
[[nodiscard]] inline app::Numbers matched_rover(const World::Options& options = {.mismatched = false}) {
  const Numbers world = options.mismatched ? options.numbers : matched(options.numbers);
  const auto single = [](double x) { return static_cast<float>(x); };
  app::Numbers n = robot::rover::numbers;
  n.wheels.drive.counts_per_turn = single(world.wheels.counts_per_turn);
  n.wheels.drive.noise_left = n.wheels.drive.noise_right = single(world.wheels.noise_m);
  n.gyro.noise = single(world.imu.gyro_noise * world.imu.gyro_noise);
  n.gyro.bias_time_s = 1e9F;  // there is no bias: an average at standstill would learn the noise
  n.landmark.sigma_range_m = single(world.camera.sigma_range_m);
  n.landmark.sigma_range_per_m = single(world.camera.sigma_range_per_m);
  n.landmark.sigma_bearing_rad = single(world.camera.sigma_bearing_rad);
  n.gnss.sigma_floor_m = 0;  // the receiver's accuracy figure is exact
  n.gnss.sigma_scale = 1;
  // A first fix as origin would be a metre off the map, for the whole run.
  const GeodeticPoint origin = Wgs84{options.origin}.geodetic({});
  n.gnss.origin_configured = 1;
  n.gnss.origin_latitude_2ndeg = origin.latitude_2ndeg;
  n.gnss.origin_longitude_2ndeg = origin.longitude_2ndeg;
  n.gnss.origin_height_m = single(origin.height_m);
  return n;
}

}  // namespace tetap::sim
