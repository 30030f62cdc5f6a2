// SPDX-License-Identifier: Apache-2.0
// Differential drive: what left and right wheel travelled, as path length and turn with covariance
// (Siegwart, Nourbakhsh, Scaramuzza 2011, sec. 5.2.4: Q_enc = diag(k_r |ds_r|, k_l |ds_l|)).
#pragma once

#include "tetap/model/planar_increment.hpp"

#include <cstdint>

namespace tetap::model {

struct DifferentialDrive {
  float left_radius_m = 0;
  float right_radius_m = 0;
  float track_m = 0;          ///< between the wheels' contact points
  float counts_per_turn = 1;  ///< encoder counts per turn of the wheel
  float noise_left = 0;       ///< k_l: variance of the travelled distance per metre [m]
  float noise_right = 0;      ///< k_r

  /// Travel of a wheel for a difference of counts: 2 pi r / N * n.
  [[nodiscard]] constexpr float left_m(std::int32_t counts) const { return travel_m(left_radius_m, counts); }
  [[nodiscard]] constexpr float right_m(std::int32_t counts) const { return travel_m(right_radius_m, counts); }
  /// 1 sigma of a travel by counts: a step has at each of its ends an even error of one count, so 1/sqrt(6) of a count.
  [[nodiscard]] constexpr float count_sigma_m() const { return 0.41F * left_m(1); }

  /// ds = (r + l)/2, dyaw = (r - l)/b, covariance M Q_enc M^T with M = [1/2 1/2; 1/b -1/b]:
  /// docs/explanation/equations.md (12).
  [[nodiscard]] constexpr PlanarIncrement increment(float ds_left_m, float ds_right_m, Arc arc = Arc::kExact) const {
    const float var_left = noise_left * (ds_left_m < 0 ? -ds_left_m : ds_left_m);
    const float var_right = noise_right * (ds_right_m < 0 ? -ds_right_m : ds_right_m);
    const float per_track = 1.0F / track_m;
    return {.ds_m = 0.5F * (ds_right_m + ds_left_m),
            .dyaw_rad = (ds_right_m - ds_left_m) * per_track,
            .var_ds = 0.25F * (var_right + var_left),
            .cov_ds_dyaw = 0.5F * per_track * (var_right - var_left),
            .var_dyaw = per_track * per_track * (var_right + var_left),
            .arc = arc};
  }

 private:
  [[nodiscard]] constexpr float travel_m(float radius_m, std::int32_t counts) const {
    constexpr float kTwoPi = 6.28318531F;
    return kTwoPi * radius_m / counts_per_turn * static_cast<float>(counts);
  }
};

/// The difference of two readings of a wrapping 16-bit counter: right while the wheel turns less than half the range
/// between them.
[[nodiscard]] constexpr std::int32_t count_difference(std::uint16_t now, std::uint16_t before) {
  const auto ahead = static_cast<std::uint16_t>(now - before);
  return ahead < 0x8000 ? static_cast<std::int32_t>(ahead) : static_cast<std::int32_t>(ahead) - 0x10000;
}

/// False: a wheel went farther than `most_m`, or not a number.
[[nodiscard]] constexpr bool possible_step(float left_m, float right_m, float most_m) {
  const float most_m2 = most_m * most_m;
  return left_m * left_m <= most_m2 && right_m * right_m <= most_m2;
}

}  // namespace tetap::model
