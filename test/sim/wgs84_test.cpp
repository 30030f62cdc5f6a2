// SPDX-License-Identifier: Apache-2.0
#include "sim_host/world/wgs84.hpp"

#include "sim_host/world/chance.hpp"

#include <gtest/gtest.h>

namespace tetap::sim {
namespace {

constexpr GeodeticOrigin kPlaces[] = {
    {48.2627, 11.6683, 520}, {0, 0, 0}, {-33.9, 151.2, 30}, {64.1, -21.9, -20}, {70.5, 179.9, 3000}};

TEST(Wgs84, there_and_back_is_the_same_place_to_the_resolution_of_the_bus) {
  Chance chance{1, Stream::kStart};
  for (const auto& place : kPlaces) {
    const Wgs84 earth{place};
    for (int i = 0; i < 200; ++i) {
      const std::array<double, 3> enu{chance.uniform(-5e3, 5e3), chance.uniform(-5e3, 5e3), chance.uniform(-300, 300)};
      const auto back = earth.enu_m(earth.geodetic(enu));
      EXPECT_NEAR(back[0], enu[0], 1.2e-4);  // half of 2e-9 deg is 0.11 mm
      EXPECT_NEAR(back[1], enu[1], 1.2e-4);
      EXPECT_NEAR(back[2], enu[2], 1e-6);
    }
  }
}

TEST(Wgs84, the_origin_is_where_it_says) {
  for (const auto& place : kPlaces) {
    const GeodeticPoint at = Wgs84{place}.geodetic({0, 0, 0});
    EXPECT_NEAR(static_cast<double>(at.latitude_2ndeg) * 2e-9, place.latitude_deg, 1.01e-9);
    EXPECT_NEAR(static_cast<double>(at.longitude_2ndeg) * 2e-9, place.longitude_deg, 1.01e-9);
    EXPECT_NEAR(at.height_m, place.height_m, 1e-7);
  }
}

// One degree of latitude is 110574.3 m at the equator and 111132.9 m about 45 deg: radius of curvature M =
// a(1-e2)/(1-e2 s^2)^1.5.
TEST(Wgs84, a_small_step_moves_by_the_radii_of_curvature) {
  for (const auto& place : kPlaces) {
    const Wgs84 earth{place};
    const double s = sim::sin(radians(place.latitude_deg));
    const double c = sim::cos(radians(place.latitude_deg));
    const double w2 = 1 - Wgs84::kE2 * s * s;
    const double meridian = Wgs84::kA * (1 - Wgs84::kE2) / (w2 * sim::sqrt(w2)) + place.height_m;
    const double parallel = (Wgs84::kA / sim::sqrt(w2) + place.height_m) * c;
    const GeodeticPoint from = earth.geodetic({0, 0, 0});
    const GeodeticPoint north = earth.geodetic({0, 50, 0});
    const GeodeticPoint east = earth.geodetic({50, 0, 0});
    const double unit = 2e-9 * kPi / 180;
    EXPECT_NEAR(static_cast<double>(north.latitude_2ndeg - from.latitude_2ndeg) * unit * meridian, 50, 5e-4);
    EXPECT_NEAR(static_cast<double>(east.longitude_2ndeg - from.longitude_2ndeg) * unit * parallel, 50, 5e-4);
  }
}

TEST(Wgs84, gravity_is_the_tabled_value_at_equator_and_pole_and_falls_with_height) {
  EXPECT_NEAR((Wgs84{{0, 0, 0}}.gravity_mps2()), 9.7803253359, 1e-9);
  EXPECT_NEAR((Wgs84{{90, 0, 0}}.gravity_mps2()), 9.8321849379, 1e-9);
  EXPECT_NEAR((Wgs84{{45, 0, 1000}}.gravity_mps2() - Wgs84{{45, 0, 0}}.gravity_mps2()), -3.086e-3, 5e-6);
}

}  // namespace
}  // namespace tetap::sim
