// SPDX-License-Identifier: Apache-2.0
#include "nav/geodesy.hpp"

#include <gtest/gtest.h>
#include <cmath>

namespace tetap {
namespace {

constexpr std::int64_t ndeg2(double deg) { return static_cast<std::int64_t>(deg / 2e-9 + (deg < 0 ? -0.5 : 0.5)); }

// Figures of GeographicLib 2.1.2: echo LAT LON H | CartConvert -l LAT0 LON0 H0 -p 6
struct Case {
  double lat0, lon0, h0, lat, lon, h, east, north, up;
};
constexpr Case kCases[] = {
#include "geodesy_cases.inc"
};

TEST(Geodesy, AgreesWithGeographicLibWithinAMillimetreOutToAHundredKilometres) {
  for (const Case& c : kCases) {
    const nav::LocalFrame frame(ndeg2(c.lat0), ndeg2(c.lon0), static_cast<float>(c.h0));
    const auto local = frame.to_local(ndeg2(c.lat), ndeg2(c.lon), static_cast<float>(c.h));
    ASSERT_TRUE(local.valid);
    EXPECT_NEAR(static_cast<double>(local.east_um), c.east * 1e6, 500.0);
    EXPECT_NEAR(static_cast<double>(local.north_um), c.north * 1e6, 500.0);
    EXPECT_NEAR(static_cast<double>(local.up_um), c.up * 1e6, 500.0);
  }
}

TEST(Geodesy, TheOriginIsAtZeroAndNorthIsNorth) {
  const nav::LocalFrame frame(ndeg2(48.1), ndeg2(11.5), 500.0F);
  const auto here = frame.to_local(ndeg2(48.1), ndeg2(11.5), 500.0F);
  EXPECT_EQ(here.east_um, 0);
  EXPECT_EQ(here.north_um, 0);
  EXPECT_EQ(here.up_um, 0);
  EXPECT_GT(frame.to_local(ndeg2(48.2), ndeg2(11.5), 500.0F).north_um, 11'000'000'000);
  EXPECT_GT(frame.to_local(ndeg2(48.1), ndeg2(11.6), 500.0F).east_um, 7'000'000'000);
  EXPECT_EQ(frame.to_local(ndeg2(48.1), ndeg2(11.5), 503.0F).up_um, 3'000'000);
}

TEST(Geodesy, PlacesThatAreNoneAndPlacesTooFarAreNotValid) {
  const nav::LocalFrame frame(ndeg2(48.1), ndeg2(11.5), 0.0F);
  EXPECT_FALSE(frame.to_local(ndeg2(91), ndeg2(11.5), 0.0F).valid);
  EXPECT_FALSE(frame.to_local(ndeg2(48.1), ndeg2(170), 0.0F).valid);
  EXPECT_FALSE(frame.to_local(ndeg2(48.1), ndeg2(11.5), 3e7F).valid);
  EXPECT_TRUE(frame.to_local(ndeg2(48.1), ndeg2(11.5), __builtin_nanf("")).valid) << "no height: the origin's";
}

}  // namespace
}  // namespace tetap
