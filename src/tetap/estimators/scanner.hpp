// SPDX-License-Identifier: Apache-2.0
// A planar laser scanner by its parameters, and what its matches report: for every estimator that takes scans.
#pragma once

#include "tetap/estimators/own_map.hpp"
#include "tetap/sensor/calibration.hpp"
#include "tetap/slam/scan_keyframes.hpp"
#include "tetap/slam/scan_match_result.hpp"

namespace tetap::estimators {

/// Beams of a scan, in the scanner's frame.
[[nodiscard]] inline slam::ScanGeometry scan_geometry(const sensor::PlanarScan& scan, const param::LidarParameters& n) {
  return {.beams = scan.beams,
          .first_rad = scan.first_rad,
          .step_rad = scan.step_rad,
          .sweep_s = sensor::sweep_s(scan, n),
          .min_m = n.min_m,
          .max_m = n.max_m};
}

/// The scanner as seen from the body, without an error.
[[nodiscard]] inline slam::UncertainDisplacement<float> scanner_mounting(const param::LidarParameters& n) {
  return {.mean = {n.x_b_m, n.y_b_m, slam::Heading<float>::from_radians(n.yaw_rad)}, .covariance = {}};
}

/// Distance and turn from a keyframe after which the next one is due.
[[nodiscard]] inline slam::ScanKeyframeOptions keyframe_options(const param::MappingParameters& n) {
  return {.distance_m = n.keyframe_distance_m, .turn_rad = n.keyframe_turn_rad};
}

/// The report of a match that ended in the tick `now`.
inline void report_match(const slam::ScanMatchResult& result, base::Micros now, ScanMatchReport& report) {
  static_assert(static_cast<int>(slam::ScanFate::kMatched) == static_cast<int>(ScanEnd::kMatched) &&
                static_cast<int>(slam::ScanFate::kFirst) == static_cast<int>(ScanEnd::kFirst) &&
                static_cast<int>(slam::ScanFate::kFewPairs) == static_cast<int>(ScanEnd::kFewPairs) &&
                static_cast<int>(slam::ScanFate::kSingular) == static_cast<int>(ScanEnd::kSingular));
  const auto& p = result.pose.covariance;
  const float half = 0.5F * (p(0, 0) - p(1, 1));
  report.end = static_cast<ScanEnd>(result.fate);
  report.ended = now;
  report.iterations = result.iterations;
  report.pairs = result.pairs;
  report.sigma_m = base::sqrt(0.5F * (p(0, 0) + p(1, 1)) + base::sqrt(half * half + p(0, 1) * p(0, 1)));
  report.sigma_yaw_rad = base::sqrt(p(2, 2));
}

}  // namespace tetap::estimators
