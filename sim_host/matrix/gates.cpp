// SPDX-License-Identifier: Apache-2.0
#include "sim_host/matrix/gates.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace tetap::sim {

namespace {

constexpr std::array<double, 3> kChiSquare99{6.635, 9.210, 11.345};  ///< quantiles for 1, 2 and 3 degrees of freedom
constexpr double kGravity_mps2 = 9.81;
constexpr double kPressure_Pa_per_m = 12;  ///< ISO 2533 at sea level
constexpr double kHorizontalFlux_uT = 20;
constexpr double kWatched_s = 1;  ///< least time in which another device sees what became of a tilt
constexpr double kSlowest_mps = 0.1;

double gate(double scale, int degrees, double sigma, double noise) {
  return std::sqrt(scale * kChiSquare99[static_cast<std::size_t>(degrees - 1)]) * std::hypot(sigma, noise);
}
double wide(float x) { return static_cast<double>(x); }

double position_gate(double sigma_m, const Uncertainty& u, const param::Parameters& n) {
  const double noise_m = std::max(u.gnss_position_m * wide(n.gnss.sigma_scale), wide(n.gnss.sigma_floor_m));
  return gate(wide(n.gnss.gate_scale), 3, sigma_m, noise_m);
}

double wheel_gate(const Uncertainty& u, const param::Parameters& n) {
  const double noise_mps = wide(n.inertial.wheel_mps) + wide(n.inertial.slip_share) * u.speed_mps;
  return gate(wide(n.inertial.wheel_gate_scale), 3, u.velocity_mps, noise_mps);
}

/// Angle of heading that a device beside the gyroscope sees.
double heading_gate(const Uncertainty& u) {
  const double course_rad = u.gnss_velocity_mps / std::max(u.speed_mps, kSlowest_mps);
  return std::min(3 * std::hypot(u.heading_rad, course_rad), 1.5);
}

double imu_gate(const FrameFault& fault, double interval_s, const Uncertainty& u, const param::Parameters& n,
                bool planar) {
  const double lasts_s =
      fault.kind == FaultKind::kSpike ? fault.samples * interval_s : static_cast<double>(fault.duration.us) * 1e-6;
  const double seen_mps = planar ? position_gate(u.position_m, u, n) : velocity_gate(u, n);
  if (fault.sensor == "accel") return seen_mps / lasts_s;
  if (fault.axis == "z" || planar) return heading_gate(u) / lasts_s;
  return seen_mps / (kGravity_mps2 * lasts_s * std::max(lasts_s / 2, kWatched_s));
}

}  // namespace

double velocity_gate(const Uncertainty& u, const param::Parameters& n) {
  const double noise_mps = std::max(u.gnss_velocity_mps, wide(n.gnss.sigma_velocity_floor_mps));
  return gate(wide(n.gnss.gate_scale), 3, u.velocity_mps, noise_mps);
}

double gate_of(const FrameFault& fault, double interval_s, const Uncertainty& u, const param::Parameters& n,
               bool planar) {
  const std::string& sensor = fault.sensor;
  if (sensor == "gyro" || sensor == "accel") return imu_gate(fault, interval_s, u, n, planar);
  if (sensor == "wheels" || sensor == "speed") {
    if (fault.axis == "yaw")
      return heading_gate(u) / std::max(static_cast<double>(fault.duration.us) * 1e-6, interval_s);
    return planar ? position_gate(u.position_m, u, n) / kWatched_s : wheel_gate(u, n);
  }
  if (sensor == "gnss_position" || sensor == "gnss_both")
    return position_gate(fault.axis == "up" ? u.height_m : u.position_m, u, n);
  if (sensor == "gnss_velocity") return velocity_gate(u, n);
  if (sensor == "magnetometer")
    return kHorizontalFlux_uT * gate(wide(n.magnetic.gate_scale), 1, u.heading_rad, wide(n.magnetic.sigma_rad));
  if (sensor == "barometer")
    return kPressure_Pa_per_m * gate(wide(n.baro.gate_scale), 1, u.height_m, wide(n.baro.sigma_m));
  if (sensor == "heading") return gate(wide(n.gnss.gate_scale), 1, u.heading_rad, 0.035);
  if (sensor == "landmarks")
    return fault.axis == "range"
               ? gate(wide(n.landmark.gate_scale), 2, u.position_m, wide(n.landmark.sigma_range_m))
               : gate(wide(n.landmark.gate_scale), 2, u.heading_rad, wide(n.landmark.sigma_bearing_rad));
  if (sensor == "stamps") return position_gate(u.position_m, u, n) / std::max(u.speed_mps, kSlowest_mps);
  return 0;
}

}  // namespace tetap::sim
