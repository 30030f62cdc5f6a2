// SPDX-License-Identifier: Apache-2.0
// A position from two GNSS receivers (instances 0 and 1): by inverse variance on the first output, by covariance
// intersection on the second, for receivers whose errors share a cause.
#pragma once

#include "estimators/planar/position_fusion.hpp"
#include "node/node.hpp"
#include "param/limits.hpp"

namespace tetap::robot::fusion2 {

using estimators::FusionRule;
using estimators::PositionFusion;
using Estimators =
    node::Estimators<PositionFusion<FusionRule::kInverseVariance>, PositionFusion<FusionRule::kIntersection>>;

inline constexpr param::Parameters parameters = param::checked({
    // Two receivers of the same make state 1 sigma per axis; the origin is the first fix.
    .gnss = {.sigma_floor_m = 0.05F, .sigma_scale = 1.0F},
});

}  // namespace tetap::robot::fusion2
