// SPDX-License-Identifier: Apache-2.0
#include "tetap/nav/geodesy.hpp"

#include "support/samples.hpp"

#include <gtest/gtest.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

namespace tetap {
namespace {

constexpr std::int64_t ndeg2(double deg) { return static_cast<std::int64_t>(deg / 2e-9 + (deg < 0 ? -0.5 : 0.5)); }
constexpr double degrees(std::int64_t ndeg2) { return static_cast<double>(ndeg2) * 2e-9; }

/// Latitude, longitude [deg], height [m]; or east, north, up [m].
using Triple = std::array<double, 3>;

nav::Local local_of(const Triple& enu_m) {
  const auto um = [](double m) { return static_cast<std::int64_t>(std::llround(m * 1e6)); };
  return {.east_um = um(enu_m[0]), .north_um = um(enu_m[1]), .up_um = um(enu_m[2]), .valid = true};
}

double apart_m(const nav::Local& ours, const Triple& enu_m) {
  return std::hypot(static_cast<double>(ours.east_um) * 1e-6 - enu_m[0],
                    static_cast<double>(ours.north_um) * 1e-6 - enu_m[1],
                    static_cast<double>(ours.up_um) * 1e-6 - enu_m[2]);
}

/// By the radii of curvature: near a pole a wrong longitude is a short way.
double apart_m(const base::Geodetic& ours, const Triple& judge) {
  const double latitude_rad = judge[0] * M_PI / 180;
  const double w2 = 1 - base::kEccentricity2 * std::sin(latitude_rad) * std::sin(latitude_rad);
  const double parallel_m = (base::kSemiMajor_m / std::sqrt(w2) + judge[2]) * std::cos(latitude_rad);
  const double meridian_m = base::kSemiMajor_m * (1 - base::kEccentricity2) / (w2 * std::sqrt(w2)) + judge[2];
  return std::hypot((degrees(ours.latitude_2ndeg) - judge[0]) * M_PI / 180 * meridian_m,
                    std::remainder(degrees(ours.longitude_2ndeg) - judge[1], 360.0) * M_PI / 180 * parallel_m,
                    ours.height_m - judge[2]);
}

/// GeographicLib's tool: places to a local plane, or with `back` the other way. Empty where the tool is not.
std::vector<Triple> cart_convert(const Triple& origin, bool back, const std::vector<Triple>& given) {
  const auto words = [](const Triple& t) {
    std::array<char, 128> text{};
    std::snprintf(text.data(), text.size(), "%.9f %.9f %.9f", t[0], t[1], t[2]);
    return std::string(text.data());
  };
  std::string command =
      "CartConvert -p 9 " + std::string(back ? "-r " : "") + "-l " + words(origin) + " --input-string '";
  for (const Triple& one : given) command += words(one) + ";";
  std::vector<Triple> answers;
  std::FILE* tool = popen((command + "' 2>&1").c_str(), "r");
  if (tool == nullptr) return {};
  Triple t{};
  while (std::fscanf(tool, "%lf %lf %lf", &t[0], &t[1], &t[2]) == 3) answers.push_back(t);
  pclose(tool);
  return answers;
}

double uniform(std::uint64_t index, double low, double high) {
  return low + (high - low) * test::fraction_of(test::mixed(index));
}

/// Poles, date line and equator, then anywhere. The sine of the latitude is uniform: as much sea as there is.
std::vector<Triple> origins() {
  std::vector<Triple> all{{90, 0, 0},     {-90, 77, 100},   {89.9, -120, 10}, {-89.5, 30, 2800}, {12, 180, 0},
                          {-40, -180, 5}, {66, 179.99, -3}, {0, 0, 0},        {0, 180, 20},      {0.01, -78, 4000}};
  for (std::uint64_t k = 0; k < 40; ++k)
    all.push_back({std::asin(uniform(3 * k, -1, 1)) * 180 / M_PI, uniform(3 * k + 1, -180, 180),
                   std::round(uniform(3 * k + 2, -500, 10'000))});
  for (Triple& one : all) one = {degrees(ndeg2(one[0])), degrees(ndeg2(one[1])), one[2]};
  return all;
}

/// Ten places up to 100 km from the origin, 500 m below the ellipsoid to 10 000 m above.
std::vector<Triple> around(const Triple& origin, std::uint64_t seed) {
  std::vector<Triple> places;
  for (std::uint64_t k = 0; k < 10; ++k) {
    const std::uint64_t index = 1000 + 3 * (10 * seed + k);
    const double bearing = uniform(index, -M_PI, M_PI), away_m = uniform(index + 1, 0, 100e3);
    const double drop_m = away_m * away_m / (2 * base::kSemiMajor_m);
    places.push_back({std::round(away_m * std::sin(bearing)), std::round(away_m * std::cos(bearing)),
                      std::round(uniform(index + 2, -500, 10'000) - origin[2] - drop_m)});
  }
  return places;
}

nav::LocalFrame frame_at(const Triple& origin) {
  return {ndeg2(origin[0]), ndeg2(origin[1]), static_cast<float>(origin[2])};
}

TEST(Geodesy, AgreesWithGeographicLibBothWaysWithinAMillimetreOutToAHundredKilometres) {
  if (cart_convert({0, 0, 0}, false, {{0, 0, 0}}).empty()) GTEST_SKIP() << "no CartConvert (geographiclib-tools)";
  double worst_there_m = 0, worst_back_m = 0;
  std::size_t judged = 0;
  for (const Triple& origin : origins()) {
    const nav::LocalFrame frame = frame_at(origin);
    const auto given = around(origin, judged);
    const auto places = cart_convert(origin, true, given);
    ASSERT_EQ(places.size(), given.size());
    std::vector<Triple> on_the_bus;
    for (std::size_t k = 0; k < given.size(); ++k) {
      const auto back = frame.to_geodetic(local_of(given[k]));
      ASSERT_TRUE(back.has_value());
      const double error_m = apart_m(*back, places[k]);
      EXPECT_LT(error_m, 1e-3) << "to lat " << places[k][0] << " lon " << places[k][1] << " h " << places[k][2];
      worst_back_m = std::max(worst_back_m, error_m);
      on_the_bus.push_back({degrees(ndeg2(places[k][0])), degrees(ndeg2(places[k][1])),
                            static_cast<double>(static_cast<float>(places[k][2]))});
    }
    const auto seen = cart_convert(origin, false, on_the_bus);
    ASSERT_EQ(seen.size(), given.size());
    for (std::size_t k = 0; k < given.size(); ++k) {
      const Triple& at = on_the_bus[k];
      const auto local = frame.to_local(ndeg2(at[0]), ndeg2(at[1]), static_cast<float>(at[2]));
      ASSERT_TRUE(local.valid);
      const double error_m = apart_m(local, seen[k]);
      EXPECT_LT(error_m, 1e-3) << "from lat " << at[0] << " lon " << at[1] << " h " << at[2];
      worst_there_m = std::max(worst_there_m, error_m);
    }
    judged += given.size();
  }
  EXPECT_EQ(judged, 500U);
  std::printf("worst of %zu: to local %.4f mm, to geodetic %.4f mm\n", judged, worst_there_m * 1e3, worst_back_m * 1e3);
}

// Rounding on the bus is the only loss: half of 2e-9 deg each way, and half a float's last place of the height.
TEST(Geodesy, ThereAndBackIsTheSamePlaceToTheResolutionOfTheBus) {
  std::uint64_t seed = 0;
  for (const Triple& origin : origins()) {
    const nav::LocalFrame frame = frame_at(origin);
    for (const Triple& enu_m : around(origin, seed++)) {
      const auto at = frame.to_geodetic(local_of(enu_m));
      ASSERT_TRUE(at.has_value());
      EXPECT_LE(std::abs(at->latitude_2ndeg), 45'000'000'000);
      EXPECT_LE(std::abs(at->longitude_2ndeg), 90'000'000'000);
      const auto again = frame.to_local(at->latitude_2ndeg, at->longitude_2ndeg, static_cast<float>(at->height_m));
      ASSERT_TRUE(again.valid);
      EXPECT_LT(apart_m(again, enu_m), 0.6e-3) << origin[0] << " " << origin[1];
    }
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
  const auto back = frame.to_geodetic(here);
  ASSERT_TRUE(back.has_value());
  EXPECT_EQ(back->latitude_2ndeg, ndeg2(48.1));
  EXPECT_EQ(back->longitude_2ndeg, ndeg2(11.5));
  EXPECT_NEAR(back->height_m, 500.0, 1e-6);
}

TEST(Geodesy, PlacesThatAreNoneAndPlacesTooFarAreNotValid) {
  const nav::LocalFrame frame(ndeg2(48.1), ndeg2(11.5), 0.0F);
  EXPECT_FALSE(frame.to_local(ndeg2(91), ndeg2(11.5), 0.0F).valid);
  EXPECT_FALSE(frame.to_local(ndeg2(48.1), ndeg2(170), 0.0F).valid);
  EXPECT_FALSE(frame.to_local(ndeg2(48.1), ndeg2(11.5), 3e7F).valid);
  EXPECT_TRUE(frame.to_local(ndeg2(48.1), ndeg2(11.5), __builtin_nanf("")).valid) << "no height: the origin's";

  EXPECT_FALSE(frame.to_geodetic({}).has_value()) << "not valid";
  EXPECT_FALSE(frame.to_geodetic(local_of({1.1e6, 0, 0})).has_value());
  EXPECT_FALSE(frame.to_geodetic(local_of({0, 0, -0.9e6})).has_value()) << "nobody is there";
  EXPECT_TRUE(frame.to_geodetic(local_of({0, 0.9e6, 0.9e6})).has_value());
}

}  // namespace
}  // namespace tetap
