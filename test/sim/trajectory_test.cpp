// SPDX-License-Identifier: Apache-2.0
// The path and its sensors, judged by means that neither world nor firmware use. The means: inertial axes instead of
// local ones, geocentric coordinates of GeographicLib, contact points of wheels.
#include "test/sim/support.hpp"

#include <gtest/gtest.h>
#include <GeographicLib/Geocentric.hpp>
#include <GeographicLib/NormalGravity.hpp>

#include <algorithm>
#include <array>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

namespace tetap::sim {
namespace {

constexpr double kEarthRate_radps = 7.292115e-5;  // NIMA TR8350.2, table 3.1

struct Case {
  const char* name;
  VehicleKind kind;
  GeodeticOrigin place;
  double east_m, north_m;  ///< offset of the place from the map's origin
  double course_m = 0;     ///< offset of the course from the place, to the east
};
void PrintTo(const Case& one, std::ostream* out) { *out << one.name; }

/// Perfect sensors on a body that leans, slips sideways and wanders.
World::Options options_of(const Case& one) {
  Parameters parameters = perfect();
  const VehicleParameters driven{.kind = one.kind};
  parameters.vehicle = driven;
  parameters.imu.earth_rotation = true;
  parameters.imu.rate_hz = 400;
  parameters.gnss.antenna_b_m = {0.3, -0.2, 0.8};
  World::Options options{.latency = false, .parameters = parameters};
  options.place = one.place;
  options.origin = origin_with(one.place, one.east_m, one.north_m);
  if (one.kind == VehicleKind::kCar) {
    options.course = street_course(1);
    options.limits = {.speed_mps = 12, .acceleration_mps2 = 1.5, .lateral_mps2 = 2, .yaw_rate_radps = 0.6};
    options.parameters.vehicle.turning_radius_m = 5.5;
    options.parameters.vehicle.steer_beside_per_m2 = 0.015;
    options.parameters.vehicle.steer_heading_per_m = 0.25;
    options.parameters.vehicle.acceleration_lag_s = 0.3;
    options.parameters.vehicle.axle_x_b_m = -1.2;
  }
  for (Waypoint& at : options.course.waypoints) at.x_m += one.course_m;
  if (one.kind == VehicleKind::kMulticopter) {
    options.course = flight_course(1);
    options.limits = {.speed_mps = 5, .acceleration_mps2 = 1.5, .lateral_mps2 = 2, .yaw_rate_radps = 0.8};
  }
  return options;
}

/// Rotation by an angle vector: Rodrigues' formula.
Matrix3 turned_by(const Vector3& angle) {
  const double norm = sim::sqrt(angle[0] * angle[0] + angle[1] * angle[1] + angle[2] * angle[2]);
  const double s = norm > 1e-9 ? sim::sin(norm) / norm : 1;
  const double h = norm > 1e-9 ? (1 - sim::cos(norm)) / (norm * norm) : 0.5;
  const auto& [x, y, z] = angle;
  return {{1 - h * (y * y + z * z), h * x * y - s * z, h * x * z + s * y, h * x * y + s * z, 1 - h * (x * x + z * z),
           h * y * z - s * x, h * x * z - s * y, h * y * z + s * x, 1 - h * (x * x + y * y)}};
}

struct Geocentric {
  Vector3 position_m;
  Matrix3 axes;  ///< from east, north, up of the place
};

Geocentric geocentric(const GeodeticOrigin& at) {
  Geocentric g;
  std::vector<double> turn(9);
  GeographicLib::Geocentric::WGS84().Forward(at.latitude_deg, at.longitude_deg, at.height_m, g.position_m[0],
                                             g.position_m[1], g.position_m[2], turn);
  for (std::size_t i = 0; i < 9; ++i) g.axes.m[i] = turn[i];
  return g;
}

/// Double integration in axes that do not turn: no Coriolis force, no local level, no gravity but attraction.
class InertialAxes {
 public:
  InertialAxes(const Truth& at, const GeodeticOrigin& origin) : map_{geocentric(origin)} {
    position_m_ = map_.position_m + map_.axes * Vector3{at.x_m, at.y_m, at.z_m};
    velocity_mps_ = map_.axes * at.v_n_mps + cross({0, 0, kEarthRate_radps}, position_m_);
    r_ib_ = map_.axes * rotation({at.roll_rad, at.pitch_rad, at.yaw_rad});
  }
  void advance(const sensor::ImuSample& s) {
    const auto wide = [](const std::array<float, 3>& v) {
      return Vector3{static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
    };
    const double t_s = s.interval_us * 1e-6;
    const Vector3 before = velocity_mps_;
    velocity_mps_ = velocity_mps_ + r_ib_ * wide(s.dvelocity_b_mps) +
                    t_s * attraction(position_m_ + 0.5 * t_s * velocity_mps_, time_s_ + 0.5 * t_s);
    position_m_ = position_m_ + 0.5 * t_s * (before + velocity_mps_);
    r_ib_ = r_ib_ * turned_by(wide(s.dangle_b_rad));
    time_s_ += t_s;
  }
  /// In the frame of the map, which has turned with the Earth meanwhile.
  [[nodiscard]] Truth in_map() const {
    const Matrix3 to_map = map_.axes.transposed() * earth_turn(time_s_).transposed();
    const Vector3 from_centre = to_map * position_m_ - map_.axes.transposed() * map_.position_m;
    const Vector3 v = to_map * (velocity_mps_ - cross({0, 0, kEarthRate_radps}, position_m_));
    const Vector3 a = attitude(to_map * r_ib_);
    return {.x_m = from_centre[0],
            .y_m = from_centre[1],
            .z_m = from_centre[2],
            .roll_rad = a[0],
            .pitch_rad = a[1],
            .yaw_rad = a[2],
            .v_n_mps = v};
  }

 private:
  static Matrix3 earth_turn(double time_s) { return turned_by({0, 0, kEarthRate_radps * time_s}); }
  static Vector3 attraction(const Vector3& p_i, double time_s) {
    const Vector3 p = earth_turn(time_s).transposed() * p_i;
    Vector3 g;
    GeographicLib::NormalGravity::WGS84().V0(p[0], p[1], p[2], g[0], g[1], g[2]);
    return earth_turn(time_s) * g;
  }

  Geocentric map_;
  Vector3 position_m_, velocity_mps_;
  Matrix3 r_ib_;
  double time_s_ = 0;
};

class Path : public ::testing::TestWithParam<Case> {};

// Earth rate x 10 m/s for a minute and a half is 6 m; meridians that converge by 3 deg, 30 m.
TEST_P(Path, imu_increments_integrate_twice_to_the_truth) {
  const World::Options options = options_of(GetParam());
  World world{options, 11};
  std::vector<Measurement> arrived;
  // IMU intervals of 2.5 ms end 1 ms after each full 2.5 ms.
  const base::Micros begin = world.start() + base::Micros{1'000};
  world.advance_to(begin, arrived);
  InertialAxes integrated{world.truth(), options.origin};
  double way_m = 0;
  Truth truth = world.truth();
  for (base::Micros t = begin + base::Micros{2'500}; t <= begin + seconds_us(90); t += base::Micros{2'500}) {
    arrived.clear();
    world.advance_to(t, arrived);
    for (const auto& m : arrived)
      if (const auto* s = std::get_if<sensor::ImuSample>(&m.value)) integrated.advance(*s);
    const Truth now = world.truth();
    way_m += sim::sqrt((now.x_m - truth.x_m) * (now.x_m - truth.x_m) + (now.y_m - truth.y_m) * (now.y_m - truth.y_m));
    truth = now;
  }
  const Truth end = integrated.in_map();
  EXPECT_GT(way_m, 100);
  EXPECT_NEAR(end.x_m, truth.x_m, 0.005);
  EXPECT_NEAR(end.y_m, truth.y_m, 0.005);
  EXPECT_NEAR(end.z_m, truth.z_m, 0.005);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(end.v_n_mps[i], truth.v_n_mps[i], 2e-4);
  EXPECT_NEAR(end.roll_rad, truth.roll_rad, 3e-6);
  EXPECT_NEAR(end.pitch_rad, truth.pitch_rad, 3e-6);
  EXPECT_NEAR(wrap(end.yaw_rad - truth.yaw_rad), 0, 3e-6);
}

TEST_P(Path, gnss_says_place_and_velocity_in_the_axes_of_its_own_place) {
  const World::Options options = options_of(GetParam());
  World world{options, 13};
  const Geocentric map = geocentric(options.origin);
  // Antenna in geocentric coordinates at the last three steps; a central difference is the velocity in between.
  std::array<Vector3, 3> antenna_m{};
  std::optional<sensor::GnssVelocity> velocity;
  Matrix3 axes;
  int positions = 0, velocities = 0;
  double fastest_mps = 0;
  for (base::Micros t = world.start() + seconds_us(25); t < world.start() + seconds_us(60); t += base::Micros{500}) {
    std::vector<Measurement> arrived;
    world.advance_to(t, arrived);
    const Truth truth = world.truth();
    const Vector3 at = Vector3{truth.x_m, truth.y_m, truth.z_m} +
                       to_level({truth.roll_rad, truth.pitch_rad, truth.yaw_rad}, options.parameters.gnss.antenna_b_m);
    antenna_m = {antenna_m[1], antenna_m[2], map.position_m + map.axes * at};
    if (velocity) {
      const Vector3 expected = axes.transposed() * (1000.0 * (antenna_m[2] - antenna_m[0]));
      for (std::size_t i = 0; i < 3; ++i)
        ASSERT_NEAR(static_cast<double>(velocity->v_n_mps[i]), expected[i], 2e-3) << i << " at " << t.us;
      fastest_mps = std::max(fastest_mps, sim::sqrt(expected[0] * expected[0] + expected[1] * expected[1]));
      ++velocities;
      velocity.reset();
    }
    if (t == world.start() + seconds_us(25)) continue;  // what has piled up
    for (const auto& m : arrived) {
      if (const auto* p = std::get_if<sensor::GnssPosition>(&m.value)) {
        const Geocentric place =
            geocentric({static_cast<double>(p->latitude_2ndeg) * 2e-9, static_cast<double>(p->longitude_2ndeg) * 2e-9,
                        static_cast<double>(p->height_m)});
        for (std::size_t i = 0; i < 3; ++i) ASSERT_NEAR(place.position_m[i], antenna_m[2][i], 3e-4);
        axes = place.axes;
        ++positions;
      } else if (const auto* v = std::get_if<sensor::GnssVelocity>(&m.value)) {
        velocity = *v;
      }
    }
  }
  EXPECT_GE(positions, 174);
  EXPECT_GE(velocities, 174);
  EXPECT_GT(fastest_mps, 1.5);
}

TEST_P(Path, the_compass_sees_the_field_of_the_place) {
  World::Options options = options_of(GetParam());
  options.parameters.magnetometer.rate_hz = 20;
  const double declination_rad = options.parameters.magnetometer.declination_rad = 0.2;
  options.parameters.magnetometer.noise_uT = 0;
  World world{options, 5};
  std::vector<Measurement> arrived;
  int seen = 0;
  for (base::Micros t = world.start(); t < world.start() + seconds_us(40); t += base::Micros{500}) {
    arrived.clear();
    world.advance_to(t, arrived);
    for (const auto& m : arrived) {
      const auto* flux = std::get_if<sensor::MagneticFlux>(&m.value);
      if (flux == nullptr) continue;
      const Truth truth = world.truth();
      const Geocentric map = geocentric(options.origin);
      const Geocentric place = geocentric(Earth{options.origin}.place({truth.x_m, truth.y_m, truth.z_m}));
      const Vector3 in_map = to_level({truth.roll_rad, truth.pitch_rad, truth.yaw_rad},
                                      {static_cast<double>(flux->flux_b_uT[0]), static_cast<double>(flux->flux_b_uT[1]),
                                       static_cast<double>(flux->flux_b_uT[2])});
      const Vector3 field = place.axes.transposed() * (map.axes * in_map);
      ASSERT_NEAR(sim::atan2(field[0], field[1]), declination_rad, 1e-6);
      ++seen;
    }
  }
  EXPECT_GE(seen, 790);
}

TEST_P(Path, velocity_acceleration_and_turn_are_derivatives_of_place_and_attitude) {
  const World::Options options = options_of(GetParam());
  const Plan plan{options.course, options.limits};
  Vehicle vehicle{options.parameters.vehicle, plan, 3, 1};
  Truth before = vehicle.truth();
  for (int k = 0; k < 2000 * 60; ++k) {
    const Motion now = vehicle.step();
    const Truth after = vehicle.truth();
    const auto near = [&](double derivative, double a, double b, double most) {
      ASSERT_NEAR(derivative, (b - a) * 2000, most) << k;
    };
    near(now.velocity_n_mps[0], before.x_m, after.x_m, 1e-5);
    near(now.velocity_n_mps[1], before.y_m, after.y_m, 1e-5);
    near(now.velocity_n_mps[2], before.z_m, after.z_m, 1e-5);
    for (std::size_t i = 0; i < 3; ++i) near(now.acceleration_n_mps2[i], before.v_n_mps[i], after.v_n_mps[i], 1e-3);
    before = after;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Vehicles, Path,
    ::testing::Values(Case{"rover", VehicleKind::kDifferentialDrive, {48.2627, 11.6683, 520}, 0, 0},
                      Case{"rover_80N_far", VehicleKind::kDifferentialDrive, {80, 179.95, 20}, 71'000, 20'000, 15'000},
                      Case{"car", VehicleKind::kCar, {-33.9, 151.2, 30}, -28'000, 5'000},
                      Case{"multicopter_on_the_equator", VehicleKind::kMulticopter, {0, 180, 0}, 100'000, 0}),
    [](const auto& which) { return std::string(which.param.name); });

// A wheel rolls the way of its contact point, however the body leans above.
TEST(Wheels, roll_the_way_of_their_contact_points) {
  Parameters parameters = perfect();
  parameters.vehicle.wheel_radius_m = 0.15;
  parameters.vehicle.track_m = 0.8;
  parameters.vehicle.drawn_difference = 0.1;
  parameters.vehicle.axle_x_b_m = -0.3;
  parameters.vehicle.roll_rad_per_mps2 = 0.012;
  World::Options options{.latency = false, .parameters = parameters};
  World world{options, 1};
  std::vector<Measurement> arrived;
  std::array<double, 2> rolled_m{}, counted_m{};
  double sideways_m = 0;
  std::array<Vector3, 2> contact{};
  std::optional<sensor::WheelCounts> last;
  const std::array<double, 2> radius_m{0.15 * 1.05, 0.15 * 0.95};
  for (base::Micros t = world.start() + base::Micros{500}; t <= world.start() + seconds_us(100);
       t += base::Micros{500}) {
    arrived.clear();
    world.advance_to(t, arrived);
    const Truth truth = world.truth();
    const Direction d = direction(truth.yaw_rad);
    for (std::size_t i = 0; i < 2; ++i) {
      const double left_m = i == 0 ? 0.4 : -0.4;
      const Vector3 now{truth.x_m - 0.3 * d.cos - left_m * d.sin, truth.y_m - 0.3 * d.sin + left_m * d.cos, 0};
      const Vector3 way = now - contact[i];
      if (t > world.start() + base::Micros{8'500}) {
        rolled_m[i] += way[0] * d.cos + way[1] * d.sin;
        sideways_m += magnitude(way[1] * d.cos - way[0] * d.sin);
      }
      contact[i] = now;
    }
    for (const auto& m : arrived)
      if (const auto* c = std::get_if<sensor::WheelCounts>(&m.value)) {
        const std::array<int, 2> by{last ? static_cast<std::int16_t>(c->left - last->left) : 0,
                                    last ? static_cast<std::int16_t>(c->right - last->right) : 0};
        for (std::size_t i = 0; i < 2; ++i) counted_m[i] += by[i] * 2 * kPi * radius_m[i] / 20'000;
        last = *c;
      }
  }
  ASSERT_GT(rolled_m[0], 100);
  EXPECT_LT(sideways_m, 2e-3 * rolled_m[0]) << "an axle does not move sideways";
  EXPECT_NEAR(counted_m[0], rolled_m[0], 0.005);
  EXPECT_NEAR(counted_m[1], rolled_m[1], 0.005);
}

}  // namespace
}  // namespace tetap::sim
