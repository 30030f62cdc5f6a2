// SPDX-License-Identifier: Apache-2.0
// What a robot's filters believe of noise, and where they refuse, in one line of words: so that a table of results can
// say under which Q, R and gates it came about.
#pragma once

#include "app/numbers.hpp"

#include <cstdio>
#include <string>

namespace tetap::sim {

[[nodiscard]] inline std::string numbers_words(const app::Numbers& n) {
  std::string words;
  const auto add = [&words](const char* name, double value) {
    char text[64];
    std::snprintf(text, sizeof text, "%s %.6g", name, value);
    if (!words.empty() && words.back() != ' ') words += ", ";
    words += text;
  };
  const auto begin = [&words](const char* title) { words += (words.empty() ? "" : "; ") + std::string(title) + ": "; };
  begin("Q");
  const auto& u = n.wheels.noise;
  add("speed", double{u.speed});
  add("speed per speed", double{u.speed_per_speed});
  add("yaw rate", double{u.yaw_rate});
  add("yaw rate per yaw rate", double{u.yaw_rate_per_yaw_rate});
  add("yaw rate per speed", double{u.yaw_rate_per_speed});
  add("k left", double{n.wheels.drive.noise_left});
  add("k right", double{n.wheels.drive.noise_right});
  if (n.gyro.use != 0) add("gyro", double{n.gyro.noise});
  add("IMU gyro", double{n.inertial.gyro_radps_rthz});
  add("IMU accel", double{n.inertial.accel_mps2_rthz});
  begin("R (1 sigma)");
  add("range m", double{n.landmark.sigma_range_m});
  add("per m", double{n.landmark.sigma_range_per_m});
  add("bearing rad", double{n.landmark.sigma_bearing_rad});
  add("GNSS floor m", double{n.gnss.sigma_floor_m});
  add("GNSS scale", double{n.gnss.sigma_scale});
  begin("gates (times the 99 % quantile)");
  add("landmark", double{n.landmark.gate_scale});
  add("GNSS", double{n.gnss.gate_scale});
  add("wheels", double{n.inertial.wheel_gate_scale});
  return words;
}

}  // namespace tetap::sim
