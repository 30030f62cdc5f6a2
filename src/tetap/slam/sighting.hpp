// SPDX-License-Identifier: Apache-2.0
// A landmark as a mapper sees it: range, bearing or both, with or without identity, and the sighting's fate.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/model/landmark.hpp"
#include "tetap/model/planar_pose.hpp"

#include <array>
#include <cstdint>

namespace tetap::slam {

/// Fate of a sighting. The numbers below 8 are those of sensor::Verdict.
enum class SightingVerdict : std::uint8_t {
  kAccepted = 0,
  kRejected = 1,  ///< beyond the gate of the landmark that its identity names
  kNotUsed = 2,   ///< no part of this kind of sighting can be used
  kSingular = 5,
  kNotFinite = 6,
  kNewLandmark = 8,
  kAmbiguous = 9,  ///< more than one landmark, or neither a known nor surely a new one
  kNoRoom = 10,    ///< a new landmark, and the map is full
  kPending = 11,   ///< kept until more sightings of the same landmark make a place of it
  kOutlier = 12,   ///< possible by itself, not beside the other sightings of its stamp
};

/// Range and bearing from the sensor, bearing counter-clockwise from its axis; NaN: not measured.
struct Sighting {
  static constexpr std::uint16_t kNoId = 0xffff;
  std::uint16_t id = kNoId;
  float range_m = base::kNan;
  float bearing_rad = base::kNan;

  [[nodiscard]] constexpr bool has_range() const { return !base::is_nan(range_m); }
  [[nodiscard]] constexpr bool has_bearing() const { return !base::is_nan(bearing_rad); }
  [[nodiscard]] constexpr int components() const { return (has_range() ? 1 : 0) + (has_bearing() ? 1 : 0); }
  [[nodiscard]] constexpr bool valid() const {
    const bool range = !has_range() || (range_m > 0.0F && range_m < 1e4F);
    const bool bearing = !has_bearing() || base::abs(bearing_rad) < 1e3F;
    return components() > 0 && range && bearing;
  }
  /// Order by identity, range and bearing: the same for every order of arrival.
  [[nodiscard]] constexpr bool before(const Sighting& other) const {
    if (id != other.id) return id < other.id;
    const std::uint32_t r = base::bits(range_m), s = base::bits(other.range_m);
    return r != s ? r < s : base::bits(bearing_rad) < base::bits(other.bearing_rad);
  }
};

struct SightingNoise {
  float sigma_range_m = 0.1F;
  float sigma_range_per_m = 0;  ///< grows with the range
  float sigma_bearing_rad = 0.02F;

  /// Noise of `factor` times the variances.
  [[nodiscard]] SightingNoise scaled(float factor) const {
    const float root = base::sqrt(factor);
    return {.sigma_range_m = root * sigma_range_m,
            .sigma_range_per_m = root * sigma_range_per_m,
            .sigma_bearing_rad = root * sigma_bearing_rad};
  }
  [[nodiscard]] constexpr float range_variance(float range_m) const {
    const float sigma = sigma_range_m + sigma_range_per_m * range_m;
    return sigma * sigma;
  }
  [[nodiscard]] constexpr float bearing_variance() const { return sigma_bearing_rad * sigma_bearing_rad; }
};

/// Way travelled and turned: how much the view of the landmarks changes. Whole micrometres, so that hours lose nothing.
class ViewPath {
 public:
  void move(float ds_m, float dyaw_rad) {
    constexpr float kTurnAsPath_m = 0.25F;  // a radian changes the view like this much way
    path_um_ += base::micrometres(base::abs(ds_m) + kTurnAsPath_m * base::abs(dyaw_rad));
  }
  [[nodiscard]] std::int64_t um() const { return path_um_; }

  /// Factor on the variances of a landmark's sighting whose last one was at `last_um`. Errors of a first-order
  /// Markov process along the path make n sightings worth n (1 - rho)/(1 + rho) independent ones. Implements
  /// docs/explanation/ekf_slam.md (4). A correlation of 0 m: independent.
  [[nodiscard]] float repetition(std::int64_t last_um, float correlation_m) const {
    constexpr float kMost = 99.0F;  // a robot at rest still gains a little, as much as its own noise takes
    if (!(correlation_m > 0.0F)) return 1.0F;
    const float rho = base::exp(-base::metres(path_um_ - last_um) / correlation_m);
    return rho < 0.98F ? (1.0F + rho) / (1.0F - rho) : kMost;
  }

 private:
  std::int64_t path_um_ = 0;
};

/// A sighting against one landmark, linearised. Columns of h: x, y, yaw of the robot, x, y of the landmark. A component
/// that was not measured has a row of zeros and unit noise, so that it changes nothing.
struct SightLine {
  std::array<float, 2> nu{};
  std::array<std::array<float, 5>, 2> h{};
  std::array<float, 2> r{1.0F, 1.0F};

  /// Implements docs/explanation/ekf_slam.md (1). The range's noise is that of the predicted range, so that a range
  /// measured short does not weigh more.
  SightLine(const model::PlanarPose& pose, const model::Landmark& landmark, const model::PlanarMounting& mounting,
            const Sighting& seen, const SightingNoise& noise) {
    const model::Sight sight(pose, landmark, mounting);
    const float range_m = sight.range_m();
    if (seen.has_range()) {
      nu[0] = seen.range_m - range_m;
      r[0] = noise.range_variance(range_m);
      fill(h[0], sight.range_row());
    }
    if (seen.has_bearing()) {
      nu[1] = base::wrap_angle(seen.bearing_rad - sight.bearing_rad(pose, mounting));
      r[1] = noise.bearing_variance();
      fill(h[1], sight.bearing_row());
    }
  }

 private:
  static void fill(std::array<float, 5>& row, const filter::Matrix<float, 1, 3>& of_pose) {
    row = {of_pose(0, 0), of_pose(0, 1), of_pose(0, 2), -of_pose(0, 0), -of_pose(0, 1)};
  }
};

/// A 2 x 2 covariance with its factor.
struct Covariance2 {
  float xx = 0, xy = 0, yy = 0;
};

/// The lower Cholesky factor of a 2 x 2 covariance.
struct Root2 {
  float xx = 0, yx = 0, yy = 0;
  bool valid = false;

  explicit Root2(const Covariance2& s) {
    if (!(s.xx > 0.0F)) return;
    xx = base::sqrt(s.xx);
    yx = s.xy / xx;
    const float pivot = s.yy - yx * yx;
    if (!(pivot > 0.0F) || !(pivot < 1e30F) || !(s.xx < 1e30F)) return;
    yy = base::sqrt(pivot);
    valid = true;
  }
  /// L^-1 v
  [[nodiscard]] std::array<float, 2> solve(const std::array<float, 2>& v) const {
    const float y0 = v[0] / xx;
    return {y0, (v[1] - yx * y0) / yy};
  }
  [[nodiscard]] float squared(const std::array<float, 2>& v) const {
    const auto y = solve(v);
    return y[0] * y[0] + y[1] * y[1];
  }
};

/// Innovation of a sighting, and its fate.
struct SightingRecord {
  SightingVerdict verdict = SightingVerdict::kNotUsed;
  std::uint8_t components = 0;         ///< degrees of freedom of the NIS
  std::uint16_t id = Sighting::kNoId;  ///< landmark that the sighting was fused with
  std::array<float, 2> nu{};           ///< measured minus predicted: m, rad
  Covariance2 s;                       ///< its covariance, before the stamp's other sightings
  float nis = 0;
};

}  // namespace tetap::slam
