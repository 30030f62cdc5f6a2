// SPDX-License-Identifier: Apache-2.0
// A planar pose as a particle has it, with motion along an arc and the likelihood of a sighting. The heading is a unit
// vector: a turn costs a short series, and a bearing is compared by products instead of an arctangent.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/filter/symmetric.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::filter {

/// Metres from an origin that the owner of the cloud holds; heading in n, 0 = east, counter-clockwise (REP-103).
struct ParticlePose {
  float x_m = 0;
  float y_m = 0;
  float cos_yaw = 1;
  float sin_yaw = 0;

  [[nodiscard]] static constexpr ParticlePose at(float x_m, float y_m, float yaw_rad) {
    const base::SinCos heading = base::sincos(yaw_rad);
    return {.x_m = x_m, .y_m = y_m, .cos_yaw = heading.cos, .sin_yaw = heading.sin};
  }
  [[nodiscard]] constexpr float yaw_rad() const { return base::atan2(sin_yaw, cos_yaw); }
};

/// Path length and turn along a circular arc with independent normal errors (Thrun, Burgard, Fox 2005, sec. 5.3): the
/// bootstrap proposal of wheel odometry. A jitter is an arc of no length, with errors beside the path too.
struct ParticleArc {
  static constexpr int kNormals = 2;
  float ds_m = 0;
  float dyaw_rad = 0;
  float sigma_ds_m = 0;
  float sigma_dyaw_rad = 0;

  /// Numbers, and of sizes whose sums stay numbers.
  [[nodiscard]] constexpr bool valid() const {
    return base::abs(ds_m) < 1e4F && base::abs(dyaw_rad) < 1e3F && sigma_ds_m >= 0.0F && sigma_ds_m < 1e3F &&
           sigma_dyaw_rad >= 0.0F && sigma_dyaw_rad < 1e2F;
  }
  [[nodiscard]] constexpr ParticlePose sample(const ParticlePose& from, const std::array<float, 2>& normal) const {
    const float ds = ds_m + sigma_ds_m * normal[0];
    const float h = 0.5F * (dyaw_rad + sigma_dyaw_rad * normal[1]);
    const float h2 = h * h;
    float chord = 1.0F - h2 * (1.0F / 6.0F - h2 * (1.0F / 120.0F));  // sin(h)/h: h^6/5040 < 2e-10 is left out
    float cos_h = 1.0F - h2 * (0.5F - h2 * (1.0F / 24.0F));          // h^6/720 < 2e-9
    float sin_h = h * chord;
    if (h2 > 0.01F) [[unlikely]] {
      const base::SinCos half = base::sincos(h);
      chord = half.sin / h;
      cos_h = half.cos;
      sin_h = half.sin;
    }
    const float along_cos = from.cos_yaw * cos_h - from.sin_yaw * sin_h;
    const float along_sin = from.sin_yaw * cos_h + from.cos_yaw * sin_h;
    const float c = along_cos * cos_h - along_sin * sin_h;
    const float s = along_sin * cos_h + along_cos * sin_h;
    const float to_unit = 1.5F - 0.5F * (c * c + s * s);  // a Newton step of the inverse root: length stays one
    const float length = ds * chord;
    return {.x_m = from.x_m + length * along_cos,
            .y_m = from.y_m + length * along_sin,
            .cos_yaw = c * to_unit,
            .sin_yaw = s * to_unit};
  }
};

/// Range and bearing to a point with independent errors. The range is normal. The bearing is von Mises with
/// concentration 1/sigma^2, the normal of the circle (Mardia & Jupp, Directional Statistics, 2000, sec. 3.5.4). It
/// needs no arctangent and no wrap. Rounding blurs the bearing by some 4e-4 rad.
struct ParticleSighting {
  float x_m = 0;  ///< the landmark
  float y_m = 0;
  float range_m = 0;
  float cos_bearing = 1;  ///< the bearing as a unit vector in b
  float sin_bearing = 0;
  float per_sigma_range = 0;      ///< 1/m
  float twice_concentration = 0;  ///< 2/sigma_bearing^2

  [[nodiscard]] static constexpr ParticleSighting at(float x_m, float y_m, float range_m, float bearing_rad,
                                                     float sigma_range_m, float sigma_bearing_rad) {
    const base::SinCos bearing = base::sincos(bearing_rad);
    return {.x_m = x_m,
            .y_m = y_m,
            .range_m = range_m,
            .cos_bearing = bearing.cos,
            .sin_bearing = bearing.sin,
            .per_sigma_range = 1.0F / sigma_range_m,
            .twice_concentration = 2.0F / (sigma_bearing_rad * sigma_bearing_rad)};
  }
  /// Implements docs/explanation/particle_filter.md (9).
  /// -2 log p(z | pose) without its constant: squared errors in units of the variances. NaN for a pose at the landmark.
  [[nodiscard]] constexpr float distance(const ParticlePose& pose) const { return distance(pose, x_m, y_m); }
  /// Distance beside another landmark.
  [[nodiscard]] constexpr float distance(const ParticlePose& pose, float landmark_x_m, float landmark_y_m) const {
    const float dx = landmark_x_m - pose.x_m;
    const float dy = landmark_y_m - pose.y_m;
    const float look_x = pose.cos_yaw * cos_bearing - pose.sin_yaw * sin_bearing;
    const float look_y = pose.sin_yaw * cos_bearing + pose.cos_yaw * sin_bearing;
    const float range = base::sqrt(dx * dx + dy * dy);
    const float cosine = (look_x * dx + look_y * dy) / range;
    const float range_error = (range - range_m) * per_sigma_range;
    return range_error * range_error + (1.0F - cosine) * twice_concentration;
  }
};

/// A step in (x, y, yaw) of a normal distribution, from the lower triangular root of its covariance. A kernel density
/// adds one to each particle (Musso, Oudjane, Le Gland 2001, "Improving regularised particle filters").
struct ParticleKernel {
  static constexpr int kNormals = 3;
  std::array<float, 6> root{};  ///< rows of the lower triangle

  /// The root of bandwidth^2 P by Cholesky; a direction without variance gets none.
  [[nodiscard]] static constexpr ParticleKernel of(const Symmetric<float, 3>& p, float bandwidth) {
    const auto root_of = [](float v) { return v > 0.0F ? base::sqrt(v) : 0.0F; };
    const auto over = [](float a, float b) { return b > 0.0F ? a / b : 0.0F; };
    const float a = root_of(p(0, 0)), b = over(p(0, 1), a), d = over(p(0, 2), a);
    const float c = root_of(p(1, 1) - b * b), e = over(p(1, 2) - b * d, c);
    const float f = root_of(p(2, 2) - d * d - e * e);
    return {{bandwidth * a, bandwidth * b, bandwidth * c, bandwidth * d, bandwidth * e, bandwidth * f}};
  }
  [[nodiscard]] constexpr bool valid() const {
    float largest = 0.0F;
    for (const float r : root) largest = base::max(largest, base::abs(r));
    return largest < 1e3F;
  }
  [[nodiscard]] constexpr ParticlePose sample(const ParticlePose& from, const std::array<float, 3>& normal) const {
    const base::SinCos turn = base::sincos(root[3] * normal[0] + root[4] * normal[1] + root[5] * normal[2]);
    return {.x_m = from.x_m + root[0] * normal[0],
            .y_m = from.y_m + root[1] * normal[0] + root[2] * normal[1],
            .cos_yaw = from.cos_yaw * turn.cos - from.sin_yaw * turn.sin,
            .sin_yaw = from.sin_yaw * turn.cos + from.cos_yaw * turn.sin};
  }
};

/// Weighted mean of the particles that `use` picks: of the places, and of the headings as unit vectors. Sums are taken
/// beside the first particle, in one fixed order.
template <class Cloud, class Use>
[[nodiscard]] constexpr ParticlePose mean_pose(const Cloud& cloud, const Use& use) {
  const ParticlePose& from = cloud[0];
  float sum = 0.0F, x = 0.0F, y = 0.0F, c = 0.0F, s = 0.0F;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const ParticlePose& p = cloud[i];
    if (!use(p)) continue;
    const float w = static_cast<float>(static_cast<std::int32_t>(cloud.integer_weight(i)));
    sum += w;
    x += w * (p.x_m - from.x_m);
    y += w * (p.y_m - from.y_m);
    c += w * p.cos_yaw;
    s += w * p.sin_yaw;
  }
  const float length2 = c * c + s * s;
  if (!(sum > 0.0F) || !(length2 > 0.0F)) return from;
  const float per_sum = 1.0F / sum, per_length = 1.0F / base::sqrt(length2);
  return {.x_m = from.x_m + x * per_sum,
          .y_m = from.y_m + y * per_sum,
          .cos_yaw = c * per_length,
          .sin_yaw = s * per_length};
}
template <class Cloud>
[[nodiscard]] constexpr ParticlePose mean_pose(const Cloud& cloud) {
  return mean_pose(cloud, [](const ParticlePose&) { return true; });
}

/// Weighted covariance (x, y, yaw) about `centre` of the particles that `use` picks.
template <class Cloud, class Use>
[[nodiscard]] Symmetric<float, 3> pose_covariance(const Cloud& cloud, const ParticlePose& centre, const Use& use) {
  Symmetric<float, 3> p;
  float sum = 0.0F;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const ParticlePose& q = cloud[i];
    if (!use(q)) continue;
    const float w = static_cast<float>(static_cast<std::int32_t>(cloud.integer_weight(i)));
    const float turn = base::atan2(q.sin_yaw * centre.cos_yaw - q.cos_yaw * centre.sin_yaw,
                                   q.cos_yaw * centre.cos_yaw + q.sin_yaw * centre.sin_yaw);
    const std::array<float, 3> e{q.x_m - centre.x_m, q.y_m - centre.y_m, turn};
    sum += w;
    for (int column = 0; column < 3; ++column)
      for (int row = 0; row <= column; ++row)
        p(row, column) += w * e[static_cast<std::size_t>(row)] * e[static_cast<std::size_t>(column)];
  }
  Symmetric<float, 3> result;
  if (!(sum > 0.0F)) return result;
  for (int column = 0; column < 3; ++column)
    for (int row = 0; row <= column; ++row) result(row, column) = p(row, column) / sum;
  return result;
}

}  // namespace tetap::filter
