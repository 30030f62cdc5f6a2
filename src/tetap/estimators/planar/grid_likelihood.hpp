// SPDX-License-Identifier: Apache-2.0
// Likelihood of a pose on a grid, given ranges and bearings to known landmarks and perhaps a start pose. A cell counts
// as wide as it is: the variance of an even distribution over it (step^2 / 12) is added to the sensor's.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/filter/grid.hpp"

#include <array>
#include <cstddef>
#include <span>

namespace tetap::estimators {

/// A landmark of a known place, as seen from the body's origin.
struct LandmarkRay {
  float x_m = 0;  ///< place of the landmark, from the zero of the grid's coordinates
  float y_m = 0;
  float range_m = 0;
  float bearing_rad = 0;
  float var_range_m2 = 0;
  float var_bearing_rad2 = 0;
};

/// A normal distribution of the pose, independent in place and heading; nothing is known where both are 0.
struct StartDensity {
  filter::GridPose pose;
  float per_var_place = 0;    ///< 1/m^2, of each axis
  float per_var_heading = 0;  ///< 1/rad^2
};

/// At most kMost rays; those beyond have no effect.
template <std::size_t kMost>
class GridLikelihood {
 public:
  /// Power of the likelihood: errors of one landmark's sightings are not independent.
  static constexpr float kTemper = 0.5F;
  /// Largest squared distance of a sighting, the 99.9 % quantile of chi-square with two degrees of freedom: an outlier
  /// decides no more than that.
  static constexpr float kCap = 13.8F;

  GridLikelihood(std::span<const LandmarkRay> rays, const StartDensity& start, float step_m, float turn_step_rad)
      : rays_(rays.first(rays.size() < kMost ? rays.size() : kMost)),
        start_(start),
        var_place_m2_(step_m * step_m * kEven),
        var_heading_rad2_(turn_step_rad * turn_step_rad * kEven) {}

  /// The headings of one place: what does not depend on the heading is computed once.
  class Headings {
   public:
    Headings(const GridLikelihood& likelihood, float x_m, float y_m) : start_(likelihood.start_) {
      const float dx_m = x_m - start_.pose.x_m, dy_m = y_m - start_.pose.y_m;
      misfit_ = (dx_m * dx_m + dy_m * dy_m) * start_.per_var_place;
      for (const LandmarkRay& ray : likelihood.rays_) add(ray, likelihood, x_m, y_m);
    }
    [[nodiscard]] float operator()(float yaw_rad) const {
      const float off_rad = base::wrap_angle(yaw_rad - start_.pose.yaw_rad);
      float misfit = misfit_ + off_rad * off_rad * start_.per_var_heading;
      for (std::size_t i = 0; i < size_; ++i) {
        const float b = base::wrap_angle(yaw_rad - looks_[i].heading_rad);
        misfit += kTemper * base::min(looks_[i].misfit + b * b * looks_[i].per_var, kCap);
      }
      return base::exp(-0.5F * misfit);
    }

   private:
    struct Look {
      float heading_rad;  ///< at which the bearing would fit
      float misfit;       ///< range's squared misfit over its variance
      float per_var;      ///< bearing's inverse variance, 1/rad^2
    };
    /// Implements docs/explanation/pose_grid.md (6).
    void add(const LandmarkRay& ray, const GridLikelihood& likelihood, float x_m, float y_m) {
      const float dx_m = ray.x_m - x_m, dy_m = ray.y_m - y_m;
      const float squared_m2 = dx_m * dx_m + dy_m * dy_m;
      const float off_m = base::sqrt(squared_m2) - ray.range_m;
      const float var_swing = likelihood.var_place_m2_ / (squared_m2 + likelihood.var_place_m2_);
      looks_[size_++] = {.heading_rad = base::atan2(dy_m, dx_m) - ray.bearing_rad,
                         .misfit = off_m * off_m / (ray.var_range_m2 + likelihood.var_place_m2_),
                         .per_var = 1.0F / (ray.var_bearing_rad2 + likelihood.var_heading_rad2_ + var_swing)};
    }

    const StartDensity& start_;
    float misfit_;
    std::size_t size_ = 0;
    std::array<Look, kMost> looks_;
  };
  /// Implements docs/explanation/pose_grid.md (5).
  [[nodiscard]] Headings at(float x_m, float y_m) const { return {*this, x_m, y_m}; }

 private:
  static constexpr float kEven = 1.0F / 12.0F;
  std::span<const LandmarkRay> rays_;
  StartDensity start_;
  float var_place_m2_, var_heading_rad2_;
};

}  // namespace tetap::estimators
