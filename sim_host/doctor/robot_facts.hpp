// SPDX-License-Identifier: Apache-2.0
// A robot as the doctor needs it: geometry, mounting of the IMU, origin.
#pragma once

#include "sim_host/doctor/vector.hpp"
#include "tetap/param/parameters.hpp"

#include <cstdint>
#include <optional>
#include <string>

namespace tetap::doctor {

struct RobotFacts {
  std::string name;  ///< empty: not known
  param::Parameters parameters;
  std::uint8_t imu = 0;             ///< instance
  std::optional<Vector3> up_s;      ///< the body's z axis in the axes of the sensor
  std::optional<Matrix3> mounting;  ///< rows: the body's axes in those of the sensor; planar robots have none
};

/// `inertial`: an estimator takes the whole IMU, so its mounting is stated.
[[nodiscard]] inline RobotFacts facts_of(const std::string& name, const param::Parameters& n, bool inertial) {
  RobotFacts facts{.name = name, .parameters = n, .imu = 0, .up_s = {}, .mounting = {}};
  if (inertial) {
    const auto& m = n.inertial.mounting_bs;
    Matrix3 rows{};
    for (std::size_t i = 0; i < 3; ++i)
      rows[i] = {static_cast<double>(m[3 * i]), static_cast<double>(m[3 * i + 1]), static_cast<double>(m[3 * i + 2])};
    facts.imu = static_cast<std::uint8_t>(n.inertial.imu);
    facts.mounting = rows;
    facts.up_s = rows[2];
  } else if (n.gyro.use != 0) {
    const auto& up = n.gyro.up_s;
    facts.up_s = unit({static_cast<double>(up[0]), static_cast<double>(up[1]), static_cast<double>(up[2])});
  }
  return facts;
}

}  // namespace tetap::doctor
