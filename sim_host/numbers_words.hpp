// SPDX-License-Identifier: Apache-2.0
// What a robot's filters believe of noise, and where they refuse, in one line of words: so that a table of results can
// say under which Q, R and gates it came about.
#pragma once

#include "param/parameters.hpp"

#include <cstdio>
#include <string>

namespace tetap::sim {

[[nodiscard]] inline std::string numbers_words(const param::Parameters& n) {
  std::string words;
  const auto add = [&words](const char* name, float value) {
    char text[64];
    std::snprintf(text, sizeof text, "%s %.6g", name, static_cast<double>(value));
    if (!words.empty() && words.back() != ' ') words += ", ";
    words += text;
  };
  const auto begin = [&words](const char* title) { words += (words.empty() ? "" : "; ") + std::string(title) + ": "; };
  begin("Q");
  const auto& u = n.wheels.noise;
  add("speed", u.speed);
  add("speed per speed", u.speed_per_speed);
  add("yaw rate", u.yaw_rate);
  add("yaw rate per yaw rate", u.yaw_rate_per_yaw_rate);
  add("yaw rate per speed", u.yaw_rate_per_speed);
  add("wheel speed", n.wheels.wheel_speed_noise);
  add("k left", n.wheels.drive.noise_left);
  add("k right", n.wheels.drive.noise_right);
  if (n.gyro.use != 0) add("gyro", n.gyro.noise);
  add("IMU gyro", n.inertial.gyro_radps_rthz);
  add("IMU gyro scale", n.inertial.gyro_scale);
  add("IMU accel", n.inertial.accel_mps2_rthz);
  begin("R (1 sigma)");
  add("range m", n.landmark.sigma_range_m);
  add("per m", n.landmark.sigma_range_per_m);
  add("bearing rad", n.landmark.sigma_bearing_rad);
  add("GNSS floor m", n.gnss.sigma_floor_m);
  add("GNSS scale", n.gnss.sigma_scale);
  begin("gates (times the 99 % quantile)");
  add("landmark", n.landmark.gate_scale);
  add("GNSS", n.gnss.gate_scale);
  add("wheels", n.inertial.wheel_gate_scale);
  return words;
}

}  // namespace tetap::sim
