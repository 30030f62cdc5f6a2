// SPDX-License-Identifier: Apache-2.0
// Heading from outside: of a receiver with two antennas, for instance.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/checks/stuck_value.hpp"
#include "tetap/estimators/inertial/filter_view.hpp"
#include "tetap/estimators/inertial/refusal.hpp"
#include "tetap/model/dual_heading.hpp"

namespace tetap::estimators {

class OutsideHeadingSource {
 public:
  using Measurement = sensor::OutsideHeading;

  [[nodiscard]] static float sigma_rad(const sensor::OutsideHeading& z) {
    const float own = base::is_finite(z.acc_rad) ? z.acc_rad : 0.1F;
    return own > 0.005F ? own : 0.005F;
  }
  /// The innovation gate follows in the update.
  [[nodiscard]] Assessment assess(const sensor::OutsideHeading& z, const FilterView& filter) {
    if (!base::is_finite(z.yaw_rad))
      return {.action = Action::kReject, .failed = Check::kValue, .verdict = sensor::Verdict::kNotFinite};
    if (!repeats_.update({z.yaw_rad}, filter.parameters().gnss.heading_stuck_samples, filter.stamp())) return {};
    return {.action = Action::kSkip, .failed = Check::kStuck, .verdict = sensor::Verdict::kStale};
  }
  /// At the time of the last IMU sample, as the state is.
  [[nodiscard]] static model::DirectionMeasurement model(const sensor::OutsideHeading& z, const FilterView& filter) {
    const std::array<float, 3>& b = filter.parameters().gnss.baseline_b_m;
    const float turn_radps = filter.level().up_n.dot(filter.x().q_nb.rotate(filter.turn_b_radps()));
    const float yaw_rad = base::wrap_angle(z.yaw_rad - turn_radps * filter.later_s());
    model::DirectionMeasurement direction = model::DualHeading({b[0], b[1], b[2]}, yaw_rad, sigma_rad(z));
    direction.q_nl = filter.level().q_nl;
    return direction;
  }
  /// The body's heading at its place before the filter runs, by the levelled attitude.
  [[nodiscard]] static float body_yaw_rad(const sensor::OutsideHeading& z, const nav::Quaternion& level,
                                          const param::GnssParameters& n) {
    const nav::Vector3 line = level.rotate({n.baseline_b_m[0], n.baseline_b_m[1], n.baseline_b_m[2]});
    return base::wrap_angle(z.yaw_rad - base::atan2(line(1), line(0)) + nav::euler(level).yaw_rad);
  }
  void conclude(Assessment& a, const filter::Vector<float, 1>&, const FilterView& filter) {
    count_refusal(refused_, a, Action::kInflateMotion, filter);
  }
  void begin() { refused_.reset(); }

  [[nodiscard]] const checks::Persistence& refused() const { return refused_; }
  [[nodiscard]] bool stuck(base::Micros at) const { return repeats_.stuck(at); }
  [[nodiscard]] bool timed_out(base::Micros at) const {
    return !checks::recent(repeats_.last(), at, base::Micros{2'000'000});
  }
  [[nodiscard]] SourceStatus status(base::Micros at) const {
    if (timed_out(at)) return {};
    return stuck(at) ? SourceStatus{SourceState::kDistrusted, Check::kStuck} : status_of(refused_);
  }
  static constexpr auto members(auto& self) { return base::members(self.repeats_, self.refused_); }

 private:
  checks::StuckValue<1> repeats_;
  checks::Persistence refused_;  ///< headings in a row that were refused
};

}  // namespace tetap::estimators
