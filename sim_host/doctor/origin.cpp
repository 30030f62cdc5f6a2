// SPDX-License-Identifier: Apache-2.0
#include "sim_host/doctor/origin.hpp"

#include "sim_host/doctor/plane.hpp"
#include "tetap/base/wgs84.hpp"
#include "tetap/estimators/map_frame.hpp"

#include <array>
#include <cmath>
#include <numbers>

namespace tetap::doctor {
namespace {

constexpr auto kMapRange_m = static_cast<double>(estimators::kRange_m);  ///< beyond, the node sets OriginOutOfRange
constexpr int kLeastFixes = 3;

}  // namespace

double OriginDetector::distance_m(double latitude_rad, double longitude_rad) const {
  const param::GnssParameters& n = robot_.parameters.gnss;
  const double origin = static_cast<double>(n.origin_latitude_2ndeg) * base::kRadPer2ndeg;
  const double east = longitude_rad - static_cast<double>(n.origin_longitude_2ndeg) * base::kRadPer2ndeg;
  const double north = std::sin(0.5 * (latitude_rad - origin)), across = std::sin(0.5 * east);
  const double h = north * north + std::cos(latitude_rad) * std::cos(origin) * across * across;
  return 2 * kEarth_m * std::asin(std::sqrt(std::min(1.0, std::max(0.0, h))));
}

void OriginDetector::sample(base::Micros, const sensor::Sample& sample) {
  if (robot_.name.empty() || robot_.parameters.gnss.origin_configured == 0) return;
  if (sample.sensor != sensor::Sensor::kGnssPosition || sample.payload.gnss_position.fix < sensor::GnssFix::k2d) return;
  const sensor::GnssPosition& fix = sample.payload.gnss_position;
  const double latitude = static_cast<double>(fix.latitude_2ndeg) * base::kRadPer2ndeg;
  const double longitude = static_cast<double>(fix.longitude_2ndeg) * base::kRadPer2ndeg;
  ++fixes_;
  if (distance_m(latitude, longitude) < kMapRange_m) return;
  ++far_;
  latitude_rad_ = latitude, longitude_rad_ = longitude;
}

void OriginDetector::finish(Findings& findings) {
  if (fixes_ < kLeastFixes || 2 * far_ < fixes_) return;
  struct Reading {
    Code code;
    double latitude_rad, longitude_rad;
    const char* words;
  };
  const std::array<Reading, 3> readings{
      Reading{Code::kLatLonSwapped, longitude_rad_, latitude_rad_, "latitude and longitude swapped"},
      Reading{Code::kLatitudeSign, -latitude_rad_, longitude_rad_, "the latitude's sign changed"},
      Reading{Code::kLongitudeSign, latitude_rad_, -longitude_rad_, "the longitude's sign changed"}};
  const double here = distance_m(latitude_rad_, longitude_rad_);
  constexpr double kDegree = std::numbers::pi / 180;
  for (const Reading& one : readings) {
    const double there = distance_m(one.latitude_rad, one.longitude_rad);
    if (there > kMapRange_m) continue;
    findings.push_back({.code = one.code,
                        .evidence = text("The fixes lie %.0f km from the robot's configured origin, with %s %.1f km.",
                                         here * 1e-3, one.words, there * 1e-3),
                        .change = {}});
    return;
  }
  findings.push_back(
      {.code = Code::kOriginFar,
       .evidence = text("The fixes lie at %.5f, %.5f deg, %.0f km from the robot's configured origin; the "
                        "map reaches 105 km.",
                        latitude_rad_ / kDegree, longitude_rad_ / kDegree, here * 1e-3),
       .change = {}});
}

}  // namespace tetap::doctor
