// SPDX-License-Identifier: Apache-2.0
// Each rule between fields is broken by the fields that it names, and by no other.
#include "tetap/param/limits.hpp"

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

namespace tetap::param {
namespace {

struct Break {
  const char* path;
  void (*edit)(Parameters& parameters);
};

const std::vector<Break> kBreaks{
    {"can_base", [](Parameters& p) { p.can_base = 0x310; }},
    {"loop.window_us", [](Parameters& p) { p.loop.window_us = p.loop.period_us - 1; }},
    {"wheels.drive.left_radius_m", [](Parameters& p) { p.wheels.drive = {.right_radius_m = 0.1F, .track_m = 0.5F}; }},
    {"wheels.drive.left_radius_m",
     [](Parameters& p) { p.wheels.drive = {.left_radius_m = 0.1F, .right_radius_m = 0.1F}; }},
    {"wheels.drive.left_radius_m",
     [](Parameters& p) { p.wheels.drive = {.left_radius_m = 0.0049F, .right_radius_m = 0.1F, .track_m = 0.5F}; }},
    {"imu.accel_matrix", [](Parameters& p) { p.imu.accel_matrix[4] = 0.79F; }},
    {"imu.accel_matrix", [](Parameters& p) { p.imu.accel_matrix[1] = 0.21F; }},
    {"gyro.up_s",
     [](Parameters& p) {
       p.gyro.up_s = {0, 0, 0.9F};
     }},
    {"gnss.baseline_b_m",
     [](Parameters& p) {
       p.gnss.baseline_b_m = {0, 0, 1};
     }},
    {"inertial.mounting_bs", [](Parameters& p) { p.inertial.mounting_bs[0] = -1; }},
    {"inertial.wheels_every_us", [](Parameters& p) { p.inertial.wheels_every_us = p.wheels.timeout_us / 2 + 1; }},
    {"magnetic.soft_iron", [](Parameters& p) { p.magnetic.soft_iron[8] = -1; }},
    {"magnetic.mounting_bs", [](Parameters& p) { p.magnetic.mounting_bs[8] = 0.9F; }},
    {"attitude.declination_rad", [](Parameters& p) { p.attitude.declination_rad = 0.1F; }},
    {"publish.state_every", [](Parameters& p) { p.publish.attitude_every = 3; }},
    {"publish.state_every", [](Parameters& p) { p.publish.std_every = 20; }},
    {"loop.lockstep",
     [](Parameters& p) {
       p.bus = {.commands = CommandAccess::kAuthenticated, .key = {1, 2, 3, 4}};
     }},
    {"bus.key",
     [](Parameters& p) {
       p.bus.commands = CommandAccess::kAuthenticated;
       p.loop.lockstep = Lockstep::kAuthenticated;
     }},
    {"wired.imu_x", [](Parameters& p) { p.wired.imu_x = ChipAxis::kMinusX; }},
    {"wired.imu_x", [](Parameters& p) { p.wired.imu_y = ChipAxis::kX; }},
    {"wired.imu_rate_hz", [](Parameters& p) { p.wired.imu_rate_hz = 999; }},
    {"wired.imu_readings", [](Parameters& p) { p.wired.imu_readings = 7, p.wired.imu_rate_hz = 100; }},
    {"wired.gnss_baud", [](Parameters& p) { p.wired.gnss = 2, p.wired.gnss_baud = 9'600; }},
    {"camera.fv_px", [](Parameters& p) { p.camera.fu_px = 400; }},
    {"camera.mounting_bc", [](Parameters& p) { p.camera.mounting_bc[0] = 0.9F; }},
    {"recovery.confirm_fixes", [](Parameters& p) { p.recovery.confirm_fixes = p.recovery.persist_fixes + 1; }},
};

TEST(ParameterRules, each_is_broken_by_its_own_fields) {
  std::set<const Rule*> broken;
  for (const Break& one : kBreaks) {
    Parameters parameters;
    one.edit(parameters);
    const Rule* const rule = broken_rule(parameters);
    ASSERT_NE(rule, nullptr) << one.path;
    EXPECT_STREQ(rule->path, one.path);
    broken.insert(rule);
  }
  for (const Rule& rule : kRules) {
    if (std::string(rule.path) == "gnss.origin_latitude_deg") continue;  // below
    EXPECT_EQ(broken.count(&rule), 1U) << rule.path << ": no test breaks it";
  }
}

GnssParameters origin(double latitude, double longitude, double per_degree) {
  return {.origin_configured = 1,
          .origin_latitude_2ndeg = static_cast<std::int64_t>(latitude * per_degree),
          .origin_longitude_2ndeg = static_cast<std::int64_t>(longitude * per_degree)};
}

/// Units of other programs: degrees, microdegrees, 1e-7 degrees (UBX-NAV-PVT), radians; places on every continent.
TEST(ParameterRules, an_origin_in_another_unit_than_steps_of_2e_9_degrees_is_refused) {
  constexpr double kPlaces[][2]{{48.26, 11.67}, {-33.87, 151.21}, {37.42, -122.08},
                                {-54.8, -68.3}, {69.6, 18.95},    {5.6, -0.19}};
  for (const auto& place : kPlaces) {
    Parameters parameters;
    parameters.gnss = origin(place[0], place[1], 5e8);
    EXPECT_EQ(broken_rule(parameters), nullptr) << place[0];
    for (const double per_degree : {1.0, 1e6, 1e7, 3.14159265 / 180}) {
      parameters.gnss = origin(place[0], place[1], per_degree);
      const Rule* const rule = broken_rule(parameters);
      ASSERT_NE(rule, nullptr) << place[0] << " at " << per_degree;
      EXPECT_STREQ(rule->path, "gnss.origin_latitude_deg");
    }
    parameters.gnss.origin_configured = 0;
    EXPECT_EQ(broken_rule(parameters), nullptr);
  }
}

}  // namespace
}  // namespace tetap::param
