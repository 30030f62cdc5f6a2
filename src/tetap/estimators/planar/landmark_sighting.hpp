// SPDX-License-Identifier: Apache-2.0
// A sighting of a landmark of the map, for estimators that weigh places instead of correcting a pose.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/estimators/context.hpp"
#include "tetap/estimators/estimate.hpp"
#include "tetap/estimators/planar/planar_ekf.hpp"
#include "tetap/model/range_bearing.hpp"
#include "tetap/sensor/samples.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>

namespace tetap::estimators {

/// Identity of a sighting without one.
inline constexpr std::uint8_t kAnyLandmark = 0xFF;

struct RangeAndBearing {
  float range_m, bearing_rad;
};
/// The sighting as it would be from the body's origin.
[[nodiscard]] inline RangeAndBearing from_body(float range_m, float bearing_rad,
                                               const model::PlanarMounting& mounting) {
  const base::SinCos look = base::sincos(bearing_rad + mounting.yaw_rad);
  const float x_m = mounting.x_b_m + range_m * look.cos;
  const float y_m = mounting.y_b_m + range_m * look.sin;
  return {.range_m = base::sqrt(x_m * x_m + y_m * y_m), .bearing_rad = base::atan2(y_m, x_m)};
}

/// Distance of the sighting from an estimate, which is left as it is.
[[nodiscard]] inline Innovation distance_from(const model::PlanarPose& x, const filter::Symmetric<float, 3>& p,
                                              const sensor::LandmarkSighting& sighting, const model::Landmark& landmark,
                                              const param::LandmarkParameters& n, float gate) {
  PlanarEkf estimate;
  estimate.x = x;
  estimate.p = p;
  const model::RangeBearing model{.range_m = sighting.range_m,
                                  .bearing_rad = sighting.bearing_rad,
                                  .sigma_range_m = n.sigma_range_m + n.sigma_range_per_m * sighting.range_m,
                                  .sigma_bearing_rad = n.sigma_bearing_rad,
                                  .landmark = landmark,
                                  .mounting = n.mounting};
  return record(estimate.update(model, gate), sighting.landmark);
}

/// The verdict on a sighting that has no range and bearing of a landmark of the map; none where it has.
[[nodiscard]] inline std::optional<Innovation> refusal_of(const sensor::LandmarkSighting& sighting,
                                                          const LandmarkMap<kMapCapacity>* map) {
  Innovation refused{.landmark = sighting.landmark};
  const bool any = sighting.landmark == kAnyLandmark;
  if (map == nullptr || (any ? map->size() == 0 : map->index(sighting.landmark) < 0)) {
    refused.verdict = sensor::Verdict::kUnknownLandmark;
    return refused;
  }
  const bool has_range = base::is_finite(sighting.range_m), has_bearing = base::is_finite(sighting.bearing_rad);
  if (!has_range && !has_bearing) {
    refused.verdict = sensor::Verdict::kNotFinite;
    refused.failed = sensor::Check::kValue;
    return refused;
  }
  if (!has_range || !has_bearing || base::is_finite(sighting.range_rate_mps))
    return refused;  // a radar sees no landmark
  return std::nullopt;
}

struct MapRectangle {
  base::Anchored low_x, low_y, high_x, high_y;

  constexpr void add(const base::Anchored& x, const base::Anchored& y) {
    if (x.minus(low_x) < 0.0F) low_x = x;
    if (y.minus(low_y) < 0.0F) low_y = y;
    if (x.minus(high_x) > 0.0F) high_x = x;
    if (y.minus(high_y) > 0.0F) high_y = y;
  }
};
/// The least rectangle that has all landmarks; the map has one at least.
[[nodiscard]] inline MapRectangle rectangle_of(const LandmarkMap<kMapCapacity>& map) {
  const model::Landmark first = map.entry(0);
  MapRectangle all{.low_x = first.x, .low_y = first.y, .high_x = first.x, .high_y = first.y};
  for (std::size_t i = 1; i < map.size(); ++i) all.add(map.entry(i).x, map.entry(i).y);
  return all;
}

}  // namespace tetap::estimators
