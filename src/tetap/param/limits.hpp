// SPDX-License-Identifier: Apache-2.0
// Plausibility of parameters: each value within its row's limits, and rules between fields. A robot's parameters are
// refused where they are written: `constexpr Parameters parameters = checked({...})` does not compile with an
// implausible one. The compiler's message has path, value and limits; tools/run/explain_parameter_error forms one
// sentence of it.
#pragma once

#include "tetap/param/table.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::param {

/// A condition between fields: "`path` is so much; it has to be `text`".
struct Rule {
  const char* path;
  bool (*holds)(const Parameters& parameters);
  const char* text;
};

namespace detail {

constexpr float determinant(const std::array<float, 9>& m) {
  return m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) + m[2] * (m[3] * m[7] - m[4] * m[6]);
}
/// Orthogonal and not a mirror, to a thousandth.
constexpr bool rotation(const std::array<float, 9>& m) {
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) {
      const float off =
          m[3 * i] * m[3 * j] + m[3 * i + 1] * m[3 * j + 1] + m[3 * i + 2] * m[3 * j + 2] - (i == j ? 1.0F : 0.0F);
      if (!(off > -2e-3F && off < 2e-3F)) return false;
    }
  return determinant(m) > 0;
}
/// A sensor's scale and misalignment: every element within 0.2 of the unit matrix.
constexpr bool nearly_one(const std::array<float, 9>& m) {
  for (std::size_t i = 0; i < 9; ++i) {
    const float off = m[i] - (i % 4 == 0 ? 1.0F : 0.0F);
    if (!(off > -0.2F && off < 0.2F)) return false;
  }
  return true;
}
constexpr bool unit_vector(const std::array<float, 3>& v) {
  const float norm2 = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
  return norm2 > 0.99F && norm2 < 1.01F;
}
constexpr bool level_line(const std::array<float, 3>& v) { return v[0] * v[0] + v[1] * v[1] > 1e-4F; }
/// All zero: no wheel counts. Else a wheel has at least 5 mm and a track at least 1 cm.
constexpr bool wheels_complete(const model::DifferentialDrive& d) {
  const bool none = d.left_radius_m <= 0 && d.right_radius_m <= 0 && d.track_m <= 0;
  return none || (d.left_radius_m >= 0.005F && d.right_radius_m >= 0.005F && d.track_m >= 0.01F);
}
/// Degrees, u-blox' 1e-7 degrees or radians taken for steps of 2e-9 degrees lie in the open sea off Ghana. There is no
/// land within 1.8 degrees of the equator and 3.6 degrees of Greenwich.
constexpr bool origin_on_land(const GnssParameters& g) {
  constexpr std::int64_t kDegree = 500'000'000;
  const auto within = [](std::int64_t x, std::int64_t limit) { return x >= -limit && x <= limit; };
  return g.origin_configured == 0 || !within(g.origin_latitude_2ndeg, kDegree * 18 / 10) ||
         !within(g.origin_longitude_2ndeg, kDegree * 36 / 10);
}
/// Three axes of a chip that are axes of a right-handed frame.
constexpr bool axes(const WiredParameters& w) {
  std::array<float, 9> rows{};
  const auto row = [&rows](std::size_t i, ChipAxis axis) {
    const auto number = static_cast<std::size_t>(axis);
    rows[3 * i + number % 3] = number < 3 ? 1.0F : -1.0F;
  };
  row(0, w.imu_x);
  row(1, w.imu_y);
  row(2, w.imu_z);
  return rotation(rows);
}
constexpr bool wheels_have_noise(const WheelParameters& w) {
  return !(w.drive.left_radius_m > 0) || (w.drive.noise_left > 0 && w.drive.noise_right > 0) || w.noise.speed > 0 ||
         w.wheel_speed_noise > 0;
}
constexpr bool one_of(std::int32_t x, auto... values) { return ((x == values) || ...); }
/// An epoch of a configured receiver, 1720 bits with its covariance, takes at most half of the period.
constexpr bool line_suffices(const WiredParameters& w) {
  return w.gnss != 2 || std::int64_t{1720} * 2000 <= std::int64_t{w.gnss_baud} * w.gnss_period_ms;
}
constexpr bool multiple(std::int32_t x, std::int32_t of) { return of <= 0 || x % of == 0; }

}  // namespace detail

using P = Parameters;
inline constexpr std::array kRules{
    Rule{"can_base", [](const P& p) { return p.can_base % 64 == 0; }, "a multiple of 64"},
    Rule{"loop.window_us", [](const P& p) { return p.loop.window_us >= p.loop.period_us; }, "at least loop.period_us"},
    Rule{"wheels.drive.left_radius_m", [](const P& p) { return detail::wheels_complete(p.wheels.drive); },
         "0 with right_radius_m and track_m, or all three above 0: radii from 0.005, track_m from 0.01"},
    Rule{"imu.accel_matrix", [](const P& p) { return detail::nearly_one(p.imu.accel_matrix); },
         "within 0.2 of the unit matrix in every element"},
    Rule{"gyro.up_s", [](const P& p) { return detail::unit_vector(p.gyro.up_s); }, "a unit vector"},
    Rule{"gnss.baseline_b_m", [](const P& p) { return detail::level_line(p.gnss.baseline_b_m); },
         "at least 0.01 m long in the level plane"},
    Rule{"gnss.origin_latitude_deg", [](const P& p) { return detail::origin_on_land(p.gnss); },
         "a place on land, stored in steps of 2e-9 degrees: this one lies in the sea at 0 N 0 E"},
    Rule{"inertial.mounting_bs", [](const P& p) { return detail::rotation(p.inertial.mounting_bs); }, "a rotation"},
    Rule{"inertial.wheels_every_us",
         [](const P& p) { return 2 * std::int64_t{p.inertial.wheels_every_us} <= p.wheels.timeout_us; },
         "at most half of wheels.timeout_us"},
    Rule{"magnetic.soft_iron", [](const P& p) { return detail::determinant(p.magnetic.soft_iron) > 0; },
         "a matrix with a determinant above 0"},
    Rule{"magnetic.mounting_bs", [](const P& p) { return detail::rotation(p.magnetic.mounting_bs); }, "a rotation"},
    Rule{"attitude.declination_rad",
         [](const P& p) { return !(p.attitude.declination_rad < 0 || p.attitude.declination_rad > 0); },
         "given as magnetic.declination_rad"},
    Rule{"publish.state_every",
         [](const P& p) { return detail::multiple(p.publish.state_every, p.publish.attitude_every); },
         "a multiple of publish.attitude_every"},
    Rule{"publish.state_every", [](const P& p) { return detail::multiple(p.publish.state_every, p.publish.std_every); },
         "a multiple of publish.std_every"},
    // A Begin sets the numbers back that make tags fresh.
    Rule{"loop.lockstep",
         [](const P& p) {
           return p.bus.commands != CommandAccess::kAuthenticated || p.loop.lockstep != Lockstep::kGuarded;
         },
         "0, or 2 on a desk, where bus.commands is 1"},
    Rule{"bus.key",
         [](const P& p) {
           return p.bus.commands != CommandAccess::kAuthenticated ||
                  (p.bus.key[0] | p.bus.key[1] | p.bus.key[2] | p.bus.key[3]) != 0;
         },
         "set where bus.commands is 1"},
    Rule{"recovery.confirm_fixes", [](const P& p) { return p.recovery.confirm_fixes <= p.recovery.persist_fixes; },
         "at most recovery.persist_fixes"},
    Rule{"camera.fv_px", [](const P& p) { return (p.camera.fu_px > 1) == (p.camera.fv_px > 1); },
         "0 with camera.fu_px, or both above 1"},
    Rule{"camera.mounting_bc", [](const P& p) { return detail::rotation(p.camera.mounting_bc); }, "a rotation"},
    Rule{"wired.imu_x", [](const P& p) { return detail::axes(p.wired); },
         "one of three different axes that with imu_y and imu_z make a right-handed frame"},
    Rule{"wired.imu_rate_hz",
         [](const P& p) {
           return detail::one_of(p.wired.imu_rate_hz, 25, 50, 100, 200, 500, 1'000, 2'000, 4'000, 8'000);
         },
         "25, 50, 100, 200, 500, 1000, 2000, 4000 or 8000"},
    Rule{"wired.imu_readings",
         [](const P& p) { return std::int64_t{p.wired.imu_readings} * 1'000'000 <= p.wired.imu_rate_hz * 65'000; },
         "as many as come in 65 ms at wired.imu_rate_hz"},
    Rule{"wired.gnss_baud", [](const P& p) { return detail::line_suffices(p.wired); },
         "fast enough for 3440 bits in each wired.gnss_period_ms"},
};

/// Judged when a robot compiles only: no image holds them, and a world without noise may be played.
inline constexpr std::array kCompiledRules{
    Rule{"wheels.drive.noise_left", [](const P& p) { return detail::wheels_have_noise(p.wheels); },
         "above 0 with noise_right, or else wheels.noise.speed or wheels.wheel_speed_noise: no wheel is without noise"},
    Rule{"gyro.noise", [](const P& p) { return p.gyro.use == 0 || p.gyro.noise > 0; },
         "above 0 where gyro.use is 1: no gyroscope is without noise"},
    Rule{"wired.lidar", [](const P& p) { return p.wired.lidar == 0 || p.wired.gnss == 0; },
         "0 where wired.gnss has the line"},
};

/// The first rule that does not hold; null when all do.
[[nodiscard]] constexpr const Rule* broken_rule(const Parameters& parameters) {
  for (const Rule& rule : kRules)
    if (!rule.holds(parameters)) return &rule;
  return nullptr;
}

namespace detail {
// A call that ends a constant expression: g++ prints its evaluated arguments, clang++ those of the function around it.
consteval void require_within(bool holds, const char* path, double value, const char* unit, double minimum,
                              double maximum) {
  if (!holds) __builtin_printf("%s is %.7g %s; it has to be from %.7g to %.7g", path, value, unit, minimum, maximum);
}
consteval void require_rule(bool holds, const char* path, double value, const char* unit, const char* text) {
  if (!holds) __builtin_printf("%s is %.7g %s; it has to be %s", path, value, unit, text);
}
consteval void require_rule(bool holds, const char* path, const char* text) {
  if (!holds) __builtin_printf("%s has to be %s", path, text);
}
consteval void require(const Rule& rule, const Parameters& parameters) {
  const bool holds = rule.holds(parameters);
  const Row* const row = holds ? nullptr : row_of(rule.path);
  if (row == nullptr || row->elements > 1)
    require_rule(holds, rule.path, rule.text);
  else
    require_rule(holds, rule.path, row->get(parameters, 0), row->unit, rule.text);
}
}  // namespace detail

/// The 16 ids of a robot's own map begin 64 above its block, so blocks of such robots are 128 apart.
[[nodiscard]] constexpr bool has_map_ids(std::uint32_t can_base) { return can_base % 128 == 0; }
inline constexpr const char* kMapIdsRule = "a multiple of 128, for maps and images have ids behind the block of 64";

/// To be asserted of a robot and its parameters.
consteval bool checked_map_ids(bool needs_map_ids, const Parameters& parameters) {
  detail::require_rule(!needs_map_ids || has_map_ids(parameters.can_base), "can_base", parameters.can_base, "",
                       kMapIdsRule);
  return true;
}

consteval Parameters checked(const Parameters& parameters) {
  for (const Row& row : kTable)
    for (std::size_t i = 0; i < row.elements; ++i) {
      const double value = row.get(parameters, i);
      detail::require_within(within(row, value), row.path, value, row.unit, row.minimum, row.maximum);
    }
  for (const Rule& rule : kRules) detail::require(rule, parameters);
  for (const Rule& rule : kCompiledRules) detail::require(rule, parameters);
  return parameters;
}

}  // namespace tetap::param
