// SPDX-License-Identifier: Apache-2.0
// Inertial navigation, part: headings from outside.
#pragma once

#include "app/estimators/inertial.hpp"
#include "app/estimators/inertial_measure.hpp"
#include "model/dual_heading.hpp"

namespace tetap::app {

inline Innovation Inertial::fuse(const OutsideHeading& heading, base::Micros stamp, const Context& with) {
  const float own = base::is_finite(heading.acc_rad) ? heading.acc_rad : 0.1F;
  const float sigma = own > 0.005F ? own : 0.005F;
  if (phase_ != Phase::kTracking) {
    start_.heading(heading.yaw_rad, sigma);
    return {.verdict = can::Verdict::kAccepted};
  }
  return measure(model::DualHeading({1.0F, 0.0F, 0.0F}, heading.yaw_rad, sigma), kHeadings,
                 with.numbers.gnss.gate_scale, stamp, with);
}

}  // namespace tetap::app
