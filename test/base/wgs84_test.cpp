// SPDX-License-Identifier: Apache-2.0
#include "tetap/base/wgs84.hpp"

#include <gtest/gtest.h>
#include <cmath>
#include <limits>

namespace tetap::base {
namespace {

TEST(Ecef, GoesBackToTheLatitudeLongitudeAndHeightItWasMadeFrom) {
  const double a = 6378137.0, f = 1 / 298.257223563, e2 = f * (2 - f), deg = M_PI / 180;
  for (double lat = -90; lat <= 90; lat += 7.5) {
    for (double lon = -180; lon < 180; lon += 45.5) {
      for (const double h : {-400.0, 0.0, 9'000.0, 400'000.0, 20'000'000.0}) {
        const double n = a / std::sqrt(1 - e2 * std::sin(lat * deg) * std::sin(lat * deg));
        const Ecef p{(n + h) * std::cos(lat * deg) * std::cos(lon * deg),
                     (n + h) * std::cos(lat * deg) * std::sin(lon * deg), (n * (1 - e2) + h) * std::sin(lat * deg)};
        const auto g = geodetic_of(p);
        ASSERT_TRUE(g.has_value());
        EXPECT_NEAR(static_cast<double>(g->latitude_2ndeg) * 2e-9, lat, 1.1e-9);
        const bool pole = std::abs(lat) > 89;  // there every longitude is right
        EXPECT_NEAR(static_cast<double>(g->longitude_2ndeg) * 2e-9, lon, pole ? 360 : 1.1e-9) << lat;
        EXPECT_NEAR(g->height_m, h, 1e-7);
        const Ecef up{std::cos(lat * deg) * std::cos(lon * deg), std::cos(lat * deg) * std::sin(lon * deg),
                      std::sin(lat * deg)};
        EXPECT_NEAR(Level(g->latitude_2ndeg, g->longitude_2ndeg).to_enu(up).up, 1, 1e-9);
      }
    }
  }
}

TEST(Ecef, IsNoPlaceInsideOfTheEarthOrFarFromIt) {
  EXPECT_FALSE(geodetic_of({0, 0, 0}).has_value());
  EXPECT_FALSE(geodetic_of({5.9e6, 0, 0}).has_value());
  EXPECT_FALSE(geodetic_of({1e9, 0, 0}).has_value());
  EXPECT_FALSE(geodetic_of({std::numeric_limits<double>::quiet_NaN(), 6.4e6, 0}).has_value());
}

TEST(Level, TurnsThereAndBackWithoutChange) {
  for (double lat = -90; lat <= 90; lat += 15) {
    for (double lon = -180; lon <= 180; lon += 40) {
      const Level level(std::llround(lat / 2e-9), std::llround(lon / 2e-9));
      const Enu d = level.to_enu(level.to_ecef({.east = 3, .north = -40, .up = 500}));
      EXPECT_NEAR(d.east, 3, 1e-12);
      EXPECT_NEAR(d.north, -40, 1e-12);
      EXPECT_NEAR(d.up, 500, 1e-12);
    }
  }
}

}  // namespace
}  // namespace tetap::base
