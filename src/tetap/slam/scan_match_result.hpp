// SPDX-License-Identifier: Apache-2.0
// Options, result and counters of a scan match.
#pragma once

#include "tetap/slam/planar_motion.hpp"
#include "tetap/slam/scan_lines.hpp"

namespace tetap::slam {

struct ScanMatchOptions {
  float sigma_m = 0.02F;          ///< noise of a point's distance from a line, both scans together
  float reach_first_m = 0.6F;     ///< farthest partner in the first iteration
  float reach_last_m = 0.12F;     ///< likewise, in the last ones
  float coarse_half_rad = 0.5F;   ///< turns that are tried; at most three sigma of the prior
  float coarse_step_rad = 0.05F;  ///< from one to the next
  float least_share = 0.25F;      ///< share of the points; with fewer partners odometry alone counts
  float facing = 0.7F;            ///< least cosine between the normals of partners
  int least_pairs = 20;
  int window = 6;       ///< beams on either side in which a partner is looked for
  int every = 1;        ///< each so many points are matched
  int iterations = 15;  ///< at most
  ScanLineOptions lines;
};

enum class ScanFate : std::uint8_t {
  kMatched,
  kFirst,     ///< there is no keyframe
  kFewPairs,  ///< odometry alone
  kSingular,  ///< odometry alone: the normal equations have no factor
};

struct ScanMatchResult {
  /// The scan as seen from the newest keyframe, and the covariance of x, y (m) along that keyframe's axes and of yaw.
  UncertainDisplacement<float> pose;
  float residual_m = 0.0F;  ///< weighted RMS distance from the lines
  int pairs = 0, iterations = 0;
  ScanFate fate = ScanFate::kFirst;
  [[nodiscard]] bool matched() const { return fate == ScanFate::kMatched; }
};

struct ScanMatchCounters {
  std::uint32_t matched = 0, few_pairs = 0, singular = 0;
};

}  // namespace tetap::slam
