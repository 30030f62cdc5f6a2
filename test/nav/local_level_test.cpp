// SPDX-License-Identifier: Apache-2.0
// Axes, height and gravity of a place in the map, against GeographicLib.
#include "tetap/nav/geodesy.hpp"
#include "tetap/nav/gravity.hpp"

#include <gtest/gtest.h>
#include <GeographicLib/LocalCartesian.hpp>
#include <GeographicLib/NormalGravity.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

namespace tetap::nav {
namespace {

constexpr double kDegree = M_PI / 180;

std::int64_t steps(double degrees) { return std::llround(degrees / 2e-9); }
base::Anchored metres(double m) { return base::Anchored::from_um(std::llround(m * 1e6)); }

struct Origin {
  double latitude_deg, longitude_deg, height_m;
};
constexpr Origin kOrigins[] = {
    {0, 0, 0},          {0, 179.999, 30}, {48.2627, 11.6683, 520}, {-33.8688, 151.2, 40}, {80, -179.9, 10},
    {-80, 60, 2'800.0}, {87, 5, 0}};

LocalFrame frame_of(const Origin& o) {
  return {steps(o.latitude_deg), steps(o.longitude_deg), static_cast<float>(o.height_m)};
}

/// A place by direction and distance on the map of an origin, at a height above the ellipsoid, as GeographicLib has it.
struct Place {
  double latitude_deg = 0, longitude_deg = 0, height_m = 0;
  std::array<double, 3> enu_m{};
  std::vector<double> axes;  ///< row by row: rotates level axes of the place into those of the origin

  Place(const Origin& o, double azimuth_deg, double distance_m, double above_m) {
    const GeographicLib::LocalCartesian map(o.latitude_deg, o.longitude_deg, o.height_m);
    double up_m = 0;
    map.Reverse(distance_m * std::sin(azimuth_deg * kDegree), distance_m * std::cos(azimuth_deg * kDegree), 0,
                latitude_deg, longitude_deg, up_m);
    height_m = o.height_m + above_m;
    axes.resize(9);
    map.Forward(latitude_deg, longitude_deg, height_m, enu_m[0], enu_m[1], enu_m[2], axes);
  }
  [[nodiscard]] LocalLevel level(const Origin& o) const {
    return {frame_of(o).curvature(), metres(enu_m[0]), metres(enu_m[1]), metres(enu_m[2])};
  }
};

template <class Judge>
void for_each_place(Judge&& judge) {
  for (const Origin& o : kOrigins)
    for (const double distance_m : {0.0, 100.0, 28e3, 60e3, 105e3})
      for (double azimuth_deg = 0; azimuth_deg < 360; azimuth_deg += 30)
        for (const double above_m : {0.0, 300.0}) {
          SCOPED_TRACE(std::to_string(o.latitude_deg) + " N, " + std::to_string(distance_m) + " m to " +
                       std::to_string(azimuth_deg) + " deg, " + std::to_string(above_m) + " m up");
          judge(o, Place(o, azimuth_deg, distance_m, above_m));
        }
}

TEST(LocalLevel, axes_are_those_of_geographiclib_to_a_microradian) {
  double worst_rad = 0;
  for_each_place([&](const Origin& o, const Place& at) {
    const LocalLevel level = at.level(o);
    const std::array<Vector3, 3> axes{level.to_map({1, 0, 0}), level.to_map({0, 1, 0}), level.up_n};
    for (std::size_t row = 0; row < 3; ++row)
      for (std::size_t column = 0; column < 3; ++column) {
        const double off_rad =
            std::abs(static_cast<double>(axes[column](static_cast<int>(row))) - at.axes[3 * row + column]);
        worst_rad = std::max(worst_rad, off_rad);
        ASSERT_LT(off_rad, 1e-6) << row << column;
      }
  });
  RecordProperty("worst_nanoradian", static_cast<int>(worst_rad * 1e9));
}

TEST(LocalLevel, quaternion_and_convergence_are_those_of_the_axes) {
  for_each_place([](const Origin& o, const Place& at) {
    const LocalLevel level = at.level(o);
    const Vector3 v{0.3F, -0.7F, 0.2F};
    ASSERT_LT((level.to_map({0, 0, 1}) - level.up_n).norm(), 1e-6F);
    ASSERT_LT((level.from_map(level.to_map(v)) - v).norm(), 1e-6F);
    // A direction in the level plane: an angle between planes that lean by 16 mrad is off by their square at most.
    ASSERT_LT(std::abs(std::remainder(static_cast<double>(level.convergence_rad()) - std::atan2(at.axes[3], at.axes[0]),
                                      2 * M_PI)),
              1e-6);
  });
}

TEST(LocalLevel, height_is_that_above_the_ellipsoid) {
  for_each_place([](const Origin& o, const Place& at) {
    ASSERT_NEAR(static_cast<double>(at.level(o).height_m), at.height_m - o.height_m, 0.1);
  });
}

TEST(Earth, gravity_of_a_place_is_the_normal_gravity_there) {
  const auto& judge = GeographicLib::NormalGravity::WGS84();
  for_each_place([&](const Origin& o, const Place& at) {
    Earth earth = Earth::at(frame_of(o), false);
    earth.move_to(at.level(o), frame_of(o).curvature());
    double north_mps2 = 0, up_mps2 = 0;
    judge.Gravity(at.latitude_deg, at.height_m, north_mps2, up_mps2);
    ASSERT_NEAR(static_cast<double>(earth.gravity_mps2), -up_mps2, 2e-5);
  });
}

TEST(LocalLevel, at_the_origin_the_map_is_level_to_the_last_bit) {
  for (const Origin& o : kOrigins) {
    const LocalLevel level(frame_of(o).curvature(), {}, {}, {});
    EXPECT_EQ(level.up_n, (Vector3{0, 0, 1}));
    EXPECT_EQ(level.to_map({1, 0, 0}), (Vector3{1, 0, 0}));
    EXPECT_EQ(level.to_map({0, 1, 0}), (Vector3{0, 1, 0}));
    EXPECT_EQ(level.height_m, 0.0F);
    EXPECT_EQ(level.q_nl.w, 1.0F);
    Earth moved = Earth::at(frame_of(o), true);
    moved.move_to(level, frame_of(o).curvature());
    EXPECT_EQ(moved.gravity_mps2, Earth::at(frame_of(o), true).gravity_mps2);
  }
}

TEST(LocalLevel, differences_of_longitude_take_the_short_way) {
  EXPECT_EQ(longitude_difference_2ndeg(steps(-179.999), steps(179.999)), steps(0.002));
  EXPECT_EQ(longitude_difference_2ndeg(steps(179.999), steps(-179.999)), steps(-0.002));
  EXPECT_EQ(longitude_difference_2ndeg(steps(12), steps(11)), steps(1));
  EXPECT_EQ(longitude_difference_2ndeg(steps(180), steps(-180)), 0);
}

}  // namespace
}  // namespace tetap::nav
