// SPDX-License-Identifier: Apache-2.0
// Two attitudes of one body that were found in different ways: how far they are apart, and for how long.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/base/members.hpp"
#include "tetap/base/time.hpp"
#include "tetap/estimators/estimate.hpp"
#include "tetap/param/parameters.hpp"

#include <cstdint>

namespace tetap::estimators {

struct Disagreement {
  float tilt_rad = base::kNan;     ///< between the two verticals, 0 to pi; NaN: one of the two is not valid
  float heading_rad = base::kNan;  ///< about the vertical, -pi to pi; NaN: one of the two has no heading
};

/// Turn from b to a in the axes of n. The turn q_a q_b* is one about the vertical, the heading, followed by one about a
/// level axis, the tilt. At a tilt of half a turn no heading exists, and 0 stands for it.
[[nodiscard]] inline Disagreement disagreement(const AttitudeEstimate& a, const AttitudeEstimate& b) {
  if (!a.valid || !b.valid) return {};
  const filter::Quaternion d = a.q_nb * b.q_nb.conjugate();
  const float level = base::sqrt(d.x * d.x + d.y * d.y);
  const float upright = base::sqrt(d.w * d.w + d.z * d.z);
  return {
      .tilt_rad = 2.0F * base::atan2(level, upright),
      .heading_rad = a.heading_valid && b.heading_valid ? base::wrap_angle(2.0F * base::atan2(d.z, d.w)) : base::kNan};
}

/// Two attitudes disagree once they have been too far apart, in tilt or in heading, for longer than a stated time. They
/// agree again after as long within both limits. An attitude that is not known changes neither.
class AttitudeDisagreement {
 public:
  bool step(const Disagreement& d, base::Micros now, const param::DisagreementParameters& n) {
    const bool known = base::is_finite(d.tilt_rad);
    const float heading = d.heading_rad < 0.0F ? -d.heading_rad : d.heading_rad;
    const bool apart = d.tilt_rad > n.tilt_rad || heading > n.heading_rad;
    if (!known || apart == disagrees_) {
      since_ = now;
    } else if (now - since_ >= base::Micros{n.after_us}) {
      disagrees_ = apart;
      since_ = now;
    }
    return disagrees_;
  }
  /// Begins to agree at t.
  void restart(base::Micros t) { since_ = t, disagrees_ = false; }
  [[nodiscard]] bool disagrees() const { return disagrees_; }

  static constexpr auto members(auto& self) { return base::members(self.since_, self.disagrees_); }

 private:
  base::Micros since_;  ///< last time at which the limits agreed with disagrees_
  bool disagrees_ = false;
};

}  // namespace tetap::estimators
