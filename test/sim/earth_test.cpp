// SPDX-License-Identifier: Apache-2.0
#include "sim_host/world/earth.hpp"

#include "sim_host/world/chance.hpp"

#include <gtest/gtest.h>

#include <GeographicLib/Geocentric.hpp>
#include <GeographicLib/LocalCartesian.hpp>
#include <GeographicLib/NormalGravity.hpp>
#include <algorithm>
#include <cmath>
#include <vector>

namespace tetap::sim {
namespace {

// NIMA TR8350.2, 3rd ed., table 3.1.
constexpr double kA_m = 6378137.0, kF = 1 / 298.257223563, kE2 = kF * (2 - kF);

constexpr GeodeticOrigin kPlaces[] = {
    {48.2627, 11.6683, 520}, {0, 0, 0}, {-33.9, 151.2, 30}, {64.1, -21.9, -20}, {70.5, 179.9, 3000}};

TEST(Earth, there_and_back_is_the_same_place_to_the_resolution_of_the_bus) {
  Chance chance{1, Stream::kStart};
  for (const auto& place : kPlaces) {
    const Earth earth{place};
    for (int i = 0; i < 200; ++i) {
      const std::array<double, 3> enu{chance.uniform(-5e3, 5e3), chance.uniform(-5e3, 5e3), chance.uniform(-300, 300)};
      const auto back = earth.enu_m(earth.geodetic(enu));
      EXPECT_NEAR(back[0], enu[0], 1.2e-4);  // half of 2e-9 deg is 0.11 mm
      EXPECT_NEAR(back[1], enu[1], 1.2e-4);
      EXPECT_NEAR(back[2], enu[2], 1e-6);
    }
  }
}

TEST(Earth, the_origin_is_where_it_says) {
  for (const auto& place : kPlaces) {
    const GeodeticPoint at = Earth{place}.geodetic({0, 0, 0});
    EXPECT_NEAR(static_cast<double>(at.latitude_2ndeg) * 2e-9, place.latitude_deg, 1.01e-9);
    EXPECT_NEAR(static_cast<double>(at.longitude_2ndeg) * 2e-9, place.longitude_deg, 1.01e-9);
    EXPECT_NEAR(at.height_m, place.height_m, 1e-7);
  }
}

// One degree of latitude is 110574.3 m at the equator and 111132.9 m about 45 deg: radius of curvature M =
// a(1-e2)/(1-e2 s^2)^1.5.
TEST(Earth, a_small_step_moves_by_the_radii_of_curvature) {
  for (const auto& place : kPlaces) {
    const Earth earth{place};
    const double s = sim::sin(radians(place.latitude_deg));
    const double c = sim::cos(radians(place.latitude_deg));
    const double w2 = 1 - kE2 * s * s;
    const double meridian = kA_m * (1 - kE2) / (w2 * sim::sqrt(w2)) + place.height_m;
    const double parallel = (kA_m / sim::sqrt(w2) + place.height_m) * c;
    const GeodeticPoint from = earth.geodetic({0, 0, 0});
    const GeodeticPoint north = earth.geodetic({0, 50, 0});
    const GeodeticPoint east = earth.geodetic({50, 0, 0});
    const double unit = 2e-9 * kPi / 180;
    EXPECT_NEAR(static_cast<double>(north.latitude_2ndeg - from.latitude_2ndeg) * unit * meridian, 50, 5e-4);
    EXPECT_NEAR(static_cast<double>(east.longitude_2ndeg - from.longitude_2ndeg) * unit * parallel, 50, 5e-4);
  }
}

TEST(Earth, gravity_is_the_tabled_value_at_equator_and_pole_and_falls_with_height) {
  EXPECT_NEAR((Earth{{0, 0, 0}}.gravity_mps2()), 9.7803253359, 1e-9);
  EXPECT_NEAR((Earth{{90, 0, 0}}.gravity_mps2()), 9.8321849379, 1e-9);
  EXPECT_NEAR((Earth{{45, 0, 1000}}.gravity_mps2() - Earth{{45, 0, 0}}.gravity_mps2()), -3.086e-3, 5e-6);
}

// Meridians converge: tan of the angle between two norths is sin(latitude) tan(difference of longitudes) near by.
TEST(Earth, axes_of_a_far_place_are_turned_by_the_convergence_of_meridians_and_tilted_by_the_distance) {
  for (const double latitude_deg : {0.0, 48.0, 80.0})
    for (const double east_m : {28'000.0, 60'000.0, 100'000.0}) {
      const GeodeticOrigin origin{latitude_deg, 179.9, 100};
      const Earth earth{origin};
      const Vector3 at = earth.point_m(place_at(origin, east_m, 0));
      EXPECT_NEAR(at[0], east_m, 1e-6);
      EXPECT_NEAR(at[1], 0, 1e-6);
      const Matrix3 axes = earth.axes(at);
      const double further_rad = radians(earth.place(at).longitude_deg - 179.9);
      const double convergence_rad =
          sim::atan2(sim::sin(radians(latitude_deg)) * sim::sin(wrap(further_rad)), sim::cos(wrap(further_rad)));
      EXPECT_NEAR(sim::atan2(axes.m[3], axes.m[0]), convergence_rad, 1e-4 + 0.01 * convergence_rad);
      // Up leans away from the origin by the way over the radius of the prime vertical.
      const double s = sim::sin(radians(latitude_deg));
      const double normal_m = kA_m / sim::sqrt(1 - kE2 * s * s) + 100;
      EXPECT_NEAR(axes.m[2], east_m / normal_m, 1e-6);
    }
}

TEST(Earth, axes_are_those_of_geocentric_coordinates) {
  const Earth earth{{48.2, 11.7, 500}};
  const Vector3 p{71'000, -23'000, -400};
  const GeodeticOrigin at = earth.place(p);
  double x = 0, y = 0, z = 0;
  std::vector<double> of_place(9), of_origin(9);
  GeographicLib::Geocentric::WGS84().Forward(at.latitude_deg, at.longitude_deg, at.height_m, x, y, z, of_place);
  GeographicLib::Geocentric::WGS84().Forward(48.2, 11.7, 500, x, y, z, of_origin);
  Matrix3 a, b;
  for (std::size_t i = 0; i < 9; ++i) a.m[i] = of_place[i], b.m[i] = of_origin[i];
  const Matrix3 expected = b.transposed() * a, axes = earth.axes(p);
  for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(axes.m[i], expected.m[i], 1e-12);
}

/// Largest differences from GeographicLib over places from pole to pole.
struct Differences {
  double point_m = 0, height_m = 0, gravity_mps2 = 0;
};

Differences differences_of(const GeodeticOrigin& origin, const Vector3& p) {
  const Earth earth{origin};
  const GeographicLib::LocalCartesian judge(origin.latitude_deg, origin.longitude_deg, origin.height_m);
  double latitude_deg = 0, longitude_deg = 0, height_m = 0, north_mps2 = 0, up_mps2 = 0;
  std::vector<double> turn(9);
  judge.Reverse(p[0], p[1], p[2], latitude_deg, longitude_deg, height_m, turn);
  GeographicLib::NormalGravity::WGS84().Gravity(latitude_deg, height_m, north_mps2, up_mps2);
  const GeodeticOrigin place = earth.place(p);
  const Vector3 there = earth.point_m({latitude_deg, longitude_deg, height_m}), g = earth.gravity_n_mps2(p);
  // The place that the world has, as the judge sees it.
  Vector3 back;
  judge.Forward(place.latitude_deg, place.longitude_deg, place.height_m, back[0], back[1], back[2]);
  Differences most{.height_m = std::abs(place.height_m - height_m)};
  for (std::size_t i = 0; i < 3; ++i) {
    most.point_m = std::max({most.point_m, std::abs(there[i] - p[i]), std::abs(back[i] - p[i])});
    const double judged_mps2 = turn[3 * i + 1] * north_mps2 + turn[3 * i + 2] * up_mps2;
    most.gravity_mps2 = std::max(most.gravity_mps2, std::abs(g[i] - judged_mps2));
  }
  return most;
}

TEST(Earth, places_and_gravity_are_those_of_geographiclib_from_pole_to_pole) {
  for (const double latitude_deg : {-90.0, -80.0, -33.9, -6.9, 0.0, 0.001, 30.0, 48.2627, 70.5, 89.9, 90.0})
    for (const double longitude_deg : {-180.0, -21.9, 0.0, 11.6683, 179.9})
      for (const double height_m : {-100.0, 0.0, 520.0, 9000.0})
        for (const Vector3& p : {Vector3{0, 0, 0}, {5000, -3000, 200}, {-1e5, 8e4, -300}, {3, -4, 1000}}) {
          const Differences d = differences_of({latitude_deg, longitude_deg, height_m}, p);
          ASSERT_LT(d.point_m, 1e-8) << latitude_deg << " " << longitude_deg << " " << height_m;
          ASSERT_LT(d.height_m, 1e-8) << latitude_deg;
          ASSERT_LT(d.gravity_mps2, 1e-12) << latitude_deg;
        }
  EXPECT_EQ(wgs84::kRate_radps, GeographicLib::NormalGravity::WGS84().AngularVelocity());
  EXPECT_EQ(wgs84::kGm_m3ps2, GeographicLib::NormalGravity::WGS84().MassConstant());
}

TEST(Earth, a_change_of_frame_there_and_back_leaves_everything_as_it_was) {
  const Earth here{{80, 179.95, 20}}, there{origin_with({80, 179.95, 20}, 60'000, -30'000)};
  const Vector3 start = there.point_m(here.origin());
  EXPECT_NEAR(start[0], 60'000, 1e-5);
  EXPECT_NEAR(start[1], -30'000, 1e-5);
  const FrameChange go{here, there}, back{there, here};
  const Vector3 p{120, -50, 3}, attitude{0.1, -0.2, 2.5};
  const Vector3 q = back.point(go.point(p)), a = back.attitude(go.attitude(attitude));
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(q[i], p[i], 1e-7);
    EXPECT_NEAR(a[i], attitude[i], 1e-12);
  }
  EXPECT_GT(magnitude(go.attitude(attitude)[2] - attitude[2]), 0.03);  // some 3 deg of longitude
}

}  // namespace
}  // namespace tetap::sim
