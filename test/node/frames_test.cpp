// SPDX-License-Identifier: Apache-2.0
// Frames and range: an estimate is as right 100 km from the map's origin as at it, anywhere on the Earth. Judge:
// GeographicLib (earth_drive.hpp).
#include "earth_drive.hpp"
#include "tetap/estimators/inertial/inertial.hpp"
#include "tetap/estimators/planar/pose_ekf.hpp"

#include <gtest/gtest.h>
#include <string>

namespace tetap::test {
namespace {

using estimators::Context;
using estimators::Inertial;
using estimators::MapFrame;

param::Parameters robot(const EarthDrive::Options& o) {
  param::Parameters n;
  n.wheels.drive = {.left_radius_m = 0.1F,
                    .right_radius_m = 0.1F,
                    .track_m = 0.5F,
                    .counts_per_turn = 20'000,
                    .noise_left = 1e-4F,
                    .noise_right = 1e-4F};
  n.inertial.gyro_radps_rthz = 5e-4F;
  n.inertial.accel_mps2_rthz = 1e-2F;
  n.gnss.sigma_floor_m = 0.1F;
  n.gnss.gate_scale = 1.6F;
  n.magnetic.use = o.compass ? 1 : 0;
  n.magnetic.declination_rad = static_cast<float>(EarthDrive::kDeclination_rad);
  n.baro.use = o.barometer ? 1 : 0;
  return n;
}

MapFrame map_at(const GeoPlace& origin) {
  MapFrame map;
  map.frame = nav::LocalFrame(steps_2ndeg(origin.latitude_deg), steps_2ndeg(origin.longitude_deg),
                              static_cast<float>(origin.height_m));
  map.origin = sensor::OriginSource::kConfigured;
  return map;
}

double metres(const base::Anchored& a) { return 1e-6 * static_cast<double>(a.um()); }

/// An estimate in the tangent frame of the start, so that runs of different maps can be compared.
struct Published {
  bool valid = false;
  Three enu_m{};
  double yaw_rad = 0, pitch_rad = 0, roll_rad = 0, sigma_m = 0, sigma_yaw_rad = 0;
};

Published in_start_frame(const Inertial& estimator, const Context& ctx, const TangentFrame& map,
                         const GeoPlace& start) {
  const estimators::InertialEstimate e = estimator.inertial(ctx);
  Published published{.valid = e.valid};
  if (!e.valid) return published;
  const TangentFrame frame(start);
  published.enu_m = frame.enu_m(map.geodetic({metres(e.state.x), metres(e.state.y), metres(e.state.z)}));
  const nav::Matrix3 r = e.state.q_nb.matrix();
  const auto axis = [&](int c) {
    return map.to_level(start,
                        {static_cast<double>(r(0, c)), static_cast<double>(r(1, c)), static_cast<double>(r(2, c))});
  };
  const Three x = axis(0), y = axis(1), z = axis(2);
  published.yaw_rad = std::atan2(x[1], x[0]);
  published.pitch_rad = -std::asin(x[2]);
  published.roll_rad = std::atan2(y[2], z[2]);
  published.sigma_m = std::sqrt(0.5 * static_cast<double>(e.covariance<0>() + e.covariance<1>()));
  published.sigma_yaw_rad = std::sqrt(static_cast<double>(e.covariance<8>()));
  return published;
}

/// Runs an estimator through a drive in the map of an origin; judge(drive, said) after every step.
template <class Judge>
void run(const EarthDrive::Options& o, const GeoPlace& origin, double duration_s, Judge&& judge) {
  const param::Parameters n = robot(o);
  const MapFrame map_frame = map_at(origin);
  const Context ctx{n, map_frame};
  const TangentFrame map(origin);
  EarthDrive drive(o);
  Inertial estimator;
  estimator.restart({o.begin_us}, ctx);
  while (drive.us - o.begin_us < std::llround(duration_s * 1e6)) {
    drive.step([&](const auto& payload, std::int64_t us) { estimator.fuse(payload, {us}, ctx); });
    estimator.advance({drive.us}, ctx, {});
    judge(drive, in_start_frame(estimator, ctx, map, o.start));
  }
}

double apart_rad(double a, double b) { return std::abs(std::remainder(a - b, 2 * M_PI)); }

/// Origins so far from a start in these directions.
GeoPlace origin_of(const GeoPlace& start, double distance_m, double azimuth_deg) {
  const double a = azimuth_deg * M_PI / 180;
  GeoPlace origin = TangentFrame(start).geodetic({distance_m * std::sin(a), distance_m * std::cos(a), 0});
  origin.height_m = start.height_m;
  return origin;
}

constexpr GeoPlace kStarts[] = {
    {0.001, 11, 30}, {48.2627, 11.6683, 520}, {80, 20, 100}, {-33.9, 179.9995, 20}, {80, -179.9, 5}};
constexpr double kDistances_m[] = {0, 28e3, 60e3, 100e3};

std::string name(const GeoPlace& start, double distance_m, double azimuth_deg) {
  return std::to_string(start.latitude_deg) + " N " + std::to_string(start.longitude_deg) + " E, origin " +
         std::to_string(distance_m) + " m to " + std::to_string(azimuth_deg) + " deg";
}

TEST(Frames, error_is_within_three_sigma_up_to_100_km_as_at_the_origin) {
  for (const GeoPlace& start : kStarts)
    for (const double distance_m : kDistances_m)
      for (const double azimuth_deg : {90.0, 215.0}) {
        SCOPED_TRACE(name(start, distance_m, azimuth_deg));
        int judged = 0, outside = 0, outside_yaw = 0;
        double worst_m = 0;
        run({.start = start, .fastest_mps = 15, .noise = 1}, origin_of(start, distance_m, azimuth_deg), 60,
            [&](const EarthDrive& drive, const Published& published) {
              if (!published.valid || drive.us < 15'000'000) return;
              ++judged;
              const double off_m =
                  std::hypot(published.enu_m[0] - drive.place_m[0], published.enu_m[1] - drive.place_m[1]);
              worst_m = std::max(worst_m, off_m);
              outside += off_m > 3 * std::sqrt(2) * published.sigma_m ? 1 : 0;
              outside_yaw += apart_rad(published.yaw_rad, drive.yaw_rad) > 3 * published.sigma_yaw_rad ? 1 : 0;
            });
        EXPECT_GT(judged, 4'000);
        EXPECT_LE(outside, judged / 100);
        EXPECT_LE(outside_yaw, judged / 100);
        EXPECT_LT(worst_m, 0.8);
      }
}

constexpr double kQuiet = 0.02;  ///< share of a rover's noise; without any the IMU would be stuck

/// How far two runs that should say the same are apart.
struct Apart {
  double m = 0, rad = 0, tilt_rad = 0;  ///< 25 s after the start, when the heading is known, and later
  double sigmas = 0;                    ///< position or heading, at any time
};

/// Law: where the map's origin is, when the run is, and which way it heads changes nothing of what is said of the
/// robot.
Apart apart(const EarthDrive::Options& o, const GeoPlace& origin, const EarthDrive::Options& other) {
  std::vector<Published> here;
  run(o, o.start, 60, [&](const EarthDrive&, const Published& published) { here.push_back(published); });
  std::size_t k = 0, compared = 0;
  Apart worst;
  const double turn = other.course_rad - o.course_rad, c = std::cos(turn), s = std::sin(turn);
  run(other, origin, 60, [&](const EarthDrive& drive, const Published& published) {
    const Published& row = here[k++];
    ASSERT_EQ(published.valid, row.valid);
    if (!published.valid) return;
    ++compared;
    const Three& p = row.enu_m;
    const double m = std::hypot(published.enu_m[0] - (c * p[0] - s * p[1]), published.enu_m[1] - (s * p[0] + c * p[1]));
    const double rad = apart_rad(published.yaw_rad, row.yaw_rad + turn);
    worst.sigmas = std::max({worst.sigmas, m / row.sigma_m, rad / row.sigma_yaw_rad});
    if (drive.us < other.begin_us + 25'000'000) return;
    worst.m = std::max(worst.m, m);
    worst.rad = std::max(worst.rad, rad);
    worst.tilt_rad = std::max(
        {worst.tilt_rad, apart_rad(published.pitch_rad, row.pitch_rad), apart_rad(published.roll_rad, row.roll_rad)});
  });
  EXPECT_GT(compared, 4'000U);
  std::printf("  %.3f mm, %.2f urad, tilt %.2f urad, %.4f sigma\n", worst.m * 1e3, worst.rad * 1e6,
              worst.tilt_rad * 1e6, worst.sigmas);
  return worst;
}
/// Sensors as good as can be. The grid of fixes (0.2 mm) alone makes some microradians of heading.
void same_answer(const EarthDrive::Options& o, const GeoPlace& origin, const EarthDrive::Options& other,
                 double m = 1e-3, double rad = 1e-5) {
  const Apart found = apart(o, origin, other);
  EXPECT_LT(found.m, m);
  EXPECT_LT(found.rad, rad);
  EXPECT_LT(found.tilt_rad, rad);
  EXPECT_LT(found.sigmas, 0.05);
}

TEST(FramesLaw, another_origin_for_the_same_run_changes_nothing) {
  for (const GeoPlace& start : kStarts)
    for (const double distance_m : {28e3, 60e3, 100e3})
      for (const double azimuth_deg : {90.0, 180.0, 305.0}) {
        SCOPED_TRACE(name(start, distance_m, azimuth_deg));
        const EarthDrive::Options o{.start = start, .noise = kQuiet};
        same_answer(o, origin_of(start, distance_m, azimuth_deg), o);
      }
}

TEST(FramesLaw, the_same_run_at_another_time_gives_the_same_bits) {
  for (const std::int64_t later_us : {std::int64_t{86'400'000'000}, std::int64_t{1'800'000'000'000'000}}) {
    const EarthDrive::Options o{.start = kStarts[1], .noise = 1};
    EarthDrive::Options later = o;
    later.begin_us += later_us;
    const Apart found = apart(o, o.start, later);
    EXPECT_EQ(found.sigmas, 0);
  }
}

TEST(FramesLaw, the_same_run_turned_by_90_degrees_gives_the_answer_turned) {
  const EarthDrive::Options o{.start = kStarts[1], .noise = kQuiet};
  for (int quarter = 1; quarter < 4; ++quarter) {
    EarthDrive::Options turned = o;
    turned.course_rad += quarter * M_PI / 2;
    same_answer(o, o.start, turned);
  }
}

TEST(FramesLaw, the_same_run_elsewhere_on_earth_gives_the_same_answer) {
  const EarthDrive::Options o{.start = kStarts[1], .noise = kQuiet};
  for (const GeoPlace& start : kStarts) {
    SCOPED_TRACE(name(start, 0, 0));
    EarthDrive::Options there = o;
    there.start = start;
    same_answer(o, start, there);
  }
}

TEST(FramesLaw, with_a_rovers_noise_it_holds_to_a_twentieth_of_sigma) {
  for (const GeoPlace& start : kStarts)
    for (const double azimuth_deg : {90.0, 180.0}) {
      SCOPED_TRACE(name(start, 100e3, azimuth_deg));
      EarthDrive::Options o{.start = start, .noise = 1};
      EXPECT_LT(apart(o, origin_of(start, 100e3, azimuth_deg), o).sigmas, 0.05);
      o.climb_rate = false;
      EXPECT_LT(apart(o, origin_of(start, 100e3, azimuth_deg), o).sigmas, 0.05);
    }
}

TEST(FramesLaw, compass_antennas_barometer_and_velocities_without_climb_are_of_the_place) {
  for (const GeoPlace& start : kStarts)
    for (const double azimuth_deg : {90.0, 215.0}) {
      SCOPED_TRACE(name(start, 100e3, azimuth_deg));
      const GeoPlace origin = origin_of(start, 100e3, azimuth_deg);
      EarthDrive::Options o{.start = start, .fastest_mps = 10, .noise = 1, .wheels = false};
      o.compass = o.barometer = true;
      EXPECT_LT(apart(o, origin, o).sigmas, 0.05);
      o.climb_rate = false;  // without wheels nothing else shows the climb either
      EXPECT_LT(apart(o, origin, o).sigmas, 0.2);
      o.compass = o.barometer = o.gnss_velocity = false;
      o.wheels = o.antennas = true;
      EXPECT_LT(apart(o, origin, o).sigmas, 0.05);
    }
}

TEST(Frames, the_planar_filter_is_right_100_km_from_its_origin) {
  for (const GeoPlace& start : kStarts)
    for (const double distance_m : kDistances_m) {
      SCOPED_TRACE(name(start, distance_m, 90));
      const EarthDrive::Options o{.start = start, .noise = 1, .gnss_velocity = false};
      const param::Parameters n = robot(o);
      const GeoPlace origin = origin_of(start, distance_m, 90);
      const MapFrame map_frame = map_at(origin);
      const Context ctx{n, map_frame};
      const TangentFrame map(origin);
      EarthDrive drive(o);
      estimators::PoseEkf estimator;
      estimator.restart({o.begin_us}, ctx);
      int judged = 0, outside = 0;
      while (drive.us < 90'000'000) {
        drive.step([&](const auto& payload, std::int64_t us) {
          if constexpr (requires { estimator.fuse(payload, base::Micros{us}, ctx); })
            estimator.fuse(payload, base::Micros{us}, ctx);
        });
        estimator.advance({drive.us}, ctx);
        const estimators::Estimate e = estimator.estimate(ctx);
        if (!e.position_valid || drive.us < 40'000'000) continue;
        ++judged;
        const EarthDrive::InMap truth = drive.in(map);
        const double off_m = std::hypot(metres(e.pose.x) - truth.enu_m[0], metres(e.pose.y) - truth.enu_m[1]);
        const double sigma_m = std::sqrt(static_cast<double>(e.p(0, 0) + e.p(1, 1)) / 2);
        const bool yaw = apart_rad(static_cast<double>(e.pose.yaw_rad), truth.yaw_rad) >
                         3 * std::sqrt(static_cast<double>(e.p(2, 2)));
        outside += off_m > 3 * std::sqrt(2) * sigma_m || yaw ? 1 : 0;
      }
      EXPECT_GT(judged, 4'000);
      EXPECT_LE(outside, judged / 50);
    }
}

}  // namespace
}  // namespace tetap::test
