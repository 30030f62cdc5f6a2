// SPDX-License-Identifier: Apache-2.0
// A position from two GNSS receivers (instances 0 and 1): by inverse variance on the first output, by covariance
// intersection on the second, for receivers whose errors share a cause.
#pragma once

#include "config/parameters/fusion2.hpp"
#include "tetap/estimators/planar/position_fusion.hpp"
#include "tetap/node/node.hpp"

namespace tetap::robot::fusion2 {

using estimators::FusionRule;
using estimators::PositionFusion;
using Estimators =
    node::Estimators<PositionFusion<FusionRule::kInverseVariance>, PositionFusion<FusionRule::kIntersection>>;

}  // namespace tetap::robot::fusion2
