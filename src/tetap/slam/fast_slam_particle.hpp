// SPDX-License-Identifier: Apache-2.0
// One particle of FastSLAM: a pose, landmarks with a covariance each, and the motion that all particles share. It has
// the pose's distribution given that motion and sightings. docs/explanation/fast_slam.md has the equations.
#pragma once

#include "tetap/filter/symmetric.hpp"
#include "tetap/model/planar_increment.hpp"
#include "tetap/slam/sighting.hpp"

#include <array>
#include <cstddef>

namespace tetap::slam {

/// A pose beside an origin, in m and rad.
struct PlanarOffset {
  float x_m = 0;
  float y_m = 0;
  float yaw_rad = 0;
};

/// A sighting from a pose against a landmark: innovation and the derivative by the landmark (x, y). The derivative by
/// the pose is its negative, and -1 of the bearing by yaw.
struct OffsetSight {
  std::array<float, 2> nu;
  float rx, ry, bx, by;  ///< d range / d (x, y), d bearing / d (x, y)
  float range_m;

  OffsetSight(const PlanarOffset& pose, float x_m, float y_m, const Sighting& seen) {
    const float dx = x_m - pose.x_m, dy = y_m - pose.y_m;
    const float square = dx * dx + dy * dy;
    const float range2 = square > 1e-4F ? square : 1e-4F;
    range_m = base::sqrt(range2);
    nu = {seen.range_m - range_m, base::wrap_angle(seen.bearing_rad - (base::atan2(dy, dx) - pose.yaw_rad))};
    rx = dx / range_m, ry = dy / range_m, bx = -dy / range2, by = dx / range2;
  }
};

/// Log-likelihood of an innovation, capped at the gate: an outlier costs a particle no more than that.
[[nodiscard]] inline float capped_log_likelihood(const Root2& root, float nis, float gate) {
  return -0.5F * (nis < gate ? nis : gate) - base::log(root.xx * root.yy);
}

struct FastSlamLandmark {
  float x_m = 0;
  float y_m = 0;
  Covariance2 p;

  /// The place from a sighting alone.
  [[nodiscard]] static FastSlamLandmark seen_from(const PlanarOffset& pose, const Sighting& seen,
                                                  const SightingNoise& noise) {
    const base::SinCos look = base::sincos(pose.yaw_rad + seen.bearing_rad);
    const float along = noise.range_variance(seen.range_m);
    const float across = seen.range_m * seen.range_m * noise.bearing_variance();
    return {.x_m = pose.x_m + seen.range_m * look.cos,
            .y_m = pose.y_m + seen.range_m * look.sin,
            .p = {.xx = look.cos * look.cos * along + look.sin * look.sin * across,
                  .xy = look.cos * look.sin * (along - across),
                  .yy = look.sin * look.sin * along + look.cos * look.cos * across}};
  }
  /// The covariance of a sighting from a known pose: H P H^T + R.
  [[nodiscard]] Covariance2 innovation(const OffsetSight& at, const SightingNoise& noise) const {
    const float rpx = at.rx * p.xx + at.ry * p.xy, rpy = at.rx * p.xy + at.ry * p.yy;
    const float bpx = at.bx * p.xx + at.by * p.xy, bpy = at.bx * p.xy + at.by * p.yy;
    return {.xx = rpx * at.rx + rpy * at.ry + noise.range_variance(at.range_m),
            .xy = rpx * at.bx + rpy * at.by,
            .yy = bpx * at.bx + bpy * at.by + noise.bearing_variance()};
  }
  /// Kalman update from a known pose; beyond the gate nothing changes. The sighting's log-likelihood. Implements
  /// docs/explanation/fast_slam.md (6).
  float update(const PlanarOffset& pose, const Sighting& seen, const SightingNoise& noise, float gate) {
    const OffsetSight at(pose, x_m, y_m, seen);
    const Root2 root(innovation(at, noise));
    if (!root.valid) return -0.5F * gate;
    const auto v = root.solve(at.nu);
    const float nis = v[0] * v[0] + v[1] * v[1];
    if (!(nis <= gate)) return capped_log_likelihood(root, gate, gate);
    // Columns of G = P H^T L^-T.
    const float g00 = (p.xx * at.rx + p.xy * at.ry) / root.xx, g10 = (p.xy * at.rx + p.yy * at.ry) / root.xx;
    const float g01 = (p.xx * at.bx + p.xy * at.by - root.yx * g00) / root.yy;
    const float g11 = (p.xy * at.bx + p.yy * at.by - root.yx * g10) / root.yy;
    x_m += g00 * v[0] + g01 * v[1];
    y_m += g10 * v[0] + g11 * v[1];
    const float floor_x = 1e-6F * p.xx, floor_y = 1e-6F * p.yy;  // variances stay above what rounding leaves of them
    p.xx -= g00 * g00 + g01 * g01;
    p.xy -= g00 * g10 + g01 * g11;
    p.yy -= g10 * g10 + g11 * g11;
    if (!(p.xx > floor_x)) p.xx = floor_x;
    if (!(p.yy > floor_y)) p.yy = floor_y;
    return capped_log_likelihood(root, nis, gate);
  }
};

/// A normal distribution of a pose.
struct PosePosterior {
  PlanarOffset mean;
  filter::Symmetric<float, 3> p;

  /// Kalman update by a sighting of an uncertain landmark, which itself stays: version 2's proposal. Beyond the gate
  /// nothing changes. The sighting's log-likelihood under motion and landmark. Implements
  /// docs/explanation/fast_slam.md (3).
  float refine(const Sighting& seen, const FastSlamLandmark& landmark, const SightingNoise& noise, float gate) {
    const OffsetSight at(mean, landmark.x_m, landmark.y_m, seen);
    std::array<std::array<float, 3>, 2> g;  // P H^T by columns
    for (int n = 0; n < 3; ++n) {
      const auto i = static_cast<std::size_t>(n);
      g[0][i] = -at.rx * p(n, 0) - at.ry * p(n, 1);
      g[1][i] = -at.bx * p(n, 0) - at.by * p(n, 1) - p(n, 2);
    }
    Covariance2 s = landmark.innovation(at, noise);
    s.xx += -at.rx * g[0][0] - at.ry * g[0][1];
    s.xy += -at.rx * g[1][0] - at.ry * g[1][1];
    s.yy += -at.bx * g[1][0] - at.by * g[1][1] - g[1][2];
    const Root2 root(s);
    if (!root.valid) return -0.5F * gate;
    const auto v = root.solve(at.nu);
    const float nis = v[0] * v[0] + v[1] * v[1];
    if (!(nis <= gate)) return capped_log_likelihood(root, gate, gate);
    for (std::size_t i = 0; i < 3; ++i) {
      g[0][i] /= root.xx;
      g[1][i] = (g[1][i] - root.yx * g[0][i]) / root.yy;
    }
    mean.x_m += g[0][0] * v[0] + g[1][0] * v[1];
    mean.y_m += g[0][1] * v[0] + g[1][1] * v[1];
    mean.yaw_rad = base::wrap_angle(mean.yaw_rad + g[0][2] * v[0] + g[1][2] * v[1]);
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r <= c; ++r) {
        const auto i = static_cast<std::size_t>(r), j = static_cast<std::size_t>(c);
        p(r, c) -= g[0][i] * g[0][j] + g[1][i] * g[1][j];
      }
    return capped_log_likelihood(root, nis, gate);
  }

  /// A draw from it, by the lower Cholesky factor; a direction without variance gets none. Implements
  /// docs/explanation/fast_slam.md (4).
  [[nodiscard]] PlanarOffset sample(const std::array<float, 3>& normal) const {
    const auto root_of = [](float v) { return v > 0.0F ? base::sqrt(v) : 0.0F; };
    const auto over = [](float a, float b) { return b > 1e-12F ? a / b : 0.0F; };
    const float a = root_of(p(0, 0)), b = over(p(0, 1), a), d = over(p(0, 2), a);
    const float c = root_of(p(1, 1) - b * b), e = over(p(1, 2) - b * d, c);
    const float f = root_of(p(2, 2) - d * d - e * e);
    return {.x_m = mean.x_m + a * normal[0],
            .y_m = mean.y_m + b * normal[0] + c * normal[1],
            .yaw_rad = base::wrap_angle(mean.yaw_rad + d * normal[0] + e * normal[1] + f * normal[2])};
  }
};

/// The motion since the last sighting, as a displacement in the frame it began in, with its covariance. It is the same
/// for every particle, whatever its pose. Implements docs/explanation/fast_slam.md (1) to (2).
class SharedMotion {
 public:
  /// False, and nothing has changed, when the increment is no number.
  bool add(const model::PlanarIncrement& increment) {
    if (!(base::abs(increment.ds_m) < 1e4F && base::abs(increment.dyaw_rad) < 1e3F && increment.var_ds >= 0.0F &&
          increment.var_ds < 1e6F && increment.var_dyaw >= 0.0F && increment.var_dyaw < 1e4F &&
          base::abs(increment.cov_ds_dyaw) < 1e5F))
      return false;
    const auto step = increment.step(pose_);
    p_ = filter::propagate(p_, step.f, step.q);
    pose_ = step.x;
    return true;
  }
  /// The distribution of a particle's pose after the motion.
  [[nodiscard]] PosePosterior from(const PlanarOffset& pose) const {
    const base::SinCos turn = base::sincos(pose.yaw_rad);
    const float x = pose_.x.minus({}), y = pose_.y.minus({});
    filter::Matrix<float, 3, 3> rotation;
    rotation << turn.cos, -turn.sin, 0.0F, turn.sin, turn.cos, 0.0F, 0.0F, 0.0F, 1.0F;
    return {.mean = {.x_m = pose.x_m + turn.cos * x - turn.sin * y,
                     .y_m = pose.y_m + turn.sin * x + turn.cos * y,
                     .yaw_rad = base::wrap_angle(pose.yaw_rad + pose_.yaw_rad)},
            .p = filter::propagate(p_, rotation, {})};
  }

 private:
  model::PlanarPose pose_;
  filter::Symmetric<float, 3> p_;
};

template <int kLandmarks>
struct FastSlamParticle {
  PlanarOffset pose;
  std::array<FastSlamLandmark, static_cast<std::size_t>(kLandmarks)> landmarks{};
};

}  // namespace tetap::slam
