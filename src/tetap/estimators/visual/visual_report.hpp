// SPDX-License-Identifier: Apache-2.0
// Output of an estimator with a camera, beyond pose and attitude.
#pragma once

#include "tetap/base/float_bits.hpp"

#include <concepts>
#include <cstdint>
#include <optional>

namespace tetap::estimators {

struct Context;

/// Fates of the tracks of one image.
struct VisualReport {
  std::uint8_t number = 0;  ///< low 4 bits of the image's number
  std::uint8_t used = 0, gated = 0, no_depth = 0;
  std::uint32_t left = 0;     ///< long tracks for which there was no time
  float nis = base::kNan;     ///< statistic of the last one that was compared, divided by its degrees of freedom
  float direction_y_rad = 0;  ///< angle of the speed in the body
  float direction_z_rad = 0;
};

/// Above the origin, and 1 sigma.
struct Height {
  float height_m = 0, sigma_m = 0;
};

template <class E>
concept SeesImages = requires(const E& e, const Context& ctx) {
  { e.new_report() } -> std::same_as<std::optional<VisualReport>>;
  { e.height(ctx) } -> std::same_as<Height>;
};

}  // namespace tetap::estimators
