// SPDX-License-Identifier: Apache-2.0
// Parameters with which the devices of a log would agree, as numbers that can be tried.
#pragma once

#include "sim_host/doctor/finding.hpp"
#include "sim_host/doctor/robot_facts.hpp"

#include <cmath>
#include <cstdlib>
#include <optional>
#include <string_view>

namespace tetap::doctor {

/// Five digits: a log does not show more.
[[nodiscard]] inline double five_digits(double value) { return std::strtod(text("%.5g", value).c_str(), nullptr); }

/// Wheels whose distances are these factors longer than stated; none: that wheel is right.
[[nodiscard]] inline Remedy wheels_by(const param::Parameters& p, std::optional<double> left,
                                      std::optional<double> right) {
  Remedy remedy;
  const auto add = [&](std::string_view path, auto stated, std::optional<double> factor) {
    if (factor) remedy.push_back({path, {five_digits(static_cast<double>(stated) * *factor)}});
  };
  const param::WheelParameters& w = p.wheels;
  if (w.drive.left_radius_m > 0) {
    add("wheels.drive.left_radius_m", w.drive.left_radius_m, left);
    add("wheels.drive.right_radius_m", w.drive.right_radius_m, right);
    return remedy;
  }
  // One of the two kinds of speed comes; the other kind's factors have no effect.
  if (left && right) add("wheels.speed_scale", w.speed_scale, left);
  add("wheels.left_speed_scale", w.left_speed_scale, left);
  add("wheels.right_speed_scale", w.right_speed_scale, right);
  return remedy;
}

/// The body's axes in those of the IMU.
[[nodiscard]] inline Remedy mounting(const Matrix3& rows) {
  Setting setting{.path = "inertial.mounting_bs", .values = {}};
  for (const Vector3& row : rows)
    for (const double element : row) setting.values.push_back(std::round(element * 1e6) / 1e6 + 0.0);
  return {setting};
}

/// The stated mounting after the smallest turn that brings its up to the measured one.
[[nodiscard]] inline Remedy levelled(const Matrix3& stated, const Vector3& up_s) {
  const Vector3 axis = cross(stated[2], up_s);
  const double angle = std::atan2(norm(axis), dot(stated[2], up_s));
  const Vector3 turn = scaled(angle, unit(axis));
  return mounting({turned(turn, stated[0]), turned(turn, stated[1]), turned(turn, stated[2])});
}

}  // namespace tetap::doctor
