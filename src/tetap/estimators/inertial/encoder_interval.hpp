// SPDX-License-Identifier: Apache-2.0
// Encoder counts over an interval: wheel speeds, their uncertainty, and when the wheels moved last.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/checks/persistence.hpp"
#include "tetap/estimators/inertial/filter_view.hpp"
#include "tetap/estimators/inertial/wheel_reading.hpp"
#include "tetap/model/differential_drive.hpp"

#include <optional>

namespace tetap::estimators {

/// Wheels that come so soon after the last ones: counts are left to the next difference, speeds are left out.
[[nodiscard]] constexpr bool below_min_interval(base::Micros last, base::Micros at,
                                                const param::InertialParameters& n) {
  return at > last && at - last < base::Micros{n.wheels_every_us};
}

class EncoderInterval {
 public:
  /// Counts are also skipped while a standstill update is pending: it is worth more than counts that do not change.
  [[nodiscard]] bool skips(base::Micros at, bool standstill_pending, base::Micros longest,
                           const param::InertialParameters& n) const {
    return has_counts() &&
           (below_min_interval(counted_at_, at, n) || (standstill_pending && at - counted_at_ < longest));
  }
  /// Counts that skips() leaves out: a step is judged over `wheels_every_us` at least, for stamps may be bunched.
  void skip(const sensor::WheelCounts& counts, base::Micros stamp, const param::Parameters& n) {
    if (counts.left != counts_.left || counts.right != counts_.right) moved_at_ = stamp;
    const std::int32_t us = static_cast<std::int32_t>((stamp - counted_at_).us), least_us = n.inertial.wheels_every_us;
    const float most_m = n.wheels.most_mps * (1e-6F * static_cast<float>(us > least_us ? us : least_us));
    const model::DifferentialDrive& drive = n.wheels.drive;
    if (!model::possible_step(drive.left_m(model::count_difference(counts.left, counts_.left)),
                              drive.right_m(model::count_difference(counts.right, counts_.right)), most_m))
      leapt_at_ = stamp;
  }
  /// Speeds over the interval that ends here; none without a begin.
  [[nodiscard]] std::optional<WheelReading> update(const sensor::WheelCounts& counts, const FilterView& filter);
  /// Forward speed gained by the IMU within one sample.
  void note_gain(float gained_mps) { gained_mps_ += gained_mps; }
  /// The gain since the last counts is not known.
  void invalidate_gain() { gained_mps_ = base::kNan; }

  /// Counts came within 0.1 s.
  [[nodiscard]] bool counts_recently(base::Micros at) const {
    return checks::recent(counted_at_, at, base::Micros{100'000});
  }
  /// Counts came within 1 s.
  [[nodiscard]] bool counts_lately(base::Micros at) const {
    return checks::recent(counted_at_, at, base::Micros{1'000'000});
  }
  /// Counts come, and have not changed for 0.5 s.
  [[nodiscard]] bool at_rest(base::Micros at) const {
    return counts_recently(at) && checks::older(moved_at_, at, base::Micros{500'000});
  }

  /// A wheel went farther than it can, within half a second: its counter is broken, and shorter steps are chance.
  [[nodiscard]] bool leapt_recently(base::Micros at) const {
    return checks::recent(leapt_at_, at, base::Micros{500'000});
  }

  static constexpr auto members(auto& self) {
    return base::members(self.counts_, self.gained_mps_, self.counted_at_, self.moved_at_, self.leapt_at_);
  }

 private:
  [[nodiscard]] bool has_counts() const { return counted_at_.us > 0; }

  sensor::WheelCounts counts_;     ///< last counts
  float gained_mps_ = base::kNan;  ///< forward, by the IMU, since the last counts; NaN: not known
  base::Micros counted_at_;        ///< stamp of the last counts; 0: none
  base::Micros moved_at_;          ///< last stamp at which counts had changed; 0: never
  base::Micros leapt_at_;          ///< last stamp of a step that no wheel can do; 0: none
};

/// Counts are the mean over the interval, the state is at its end: half of the speed gained in between is added. It is
/// the IMU's gain: corrections of measurements meanwhile were no gain. The noise is one count over the interval, and
/// the slip and radii of the way, as odometry has them (m^2 per m). The way is the filter's: by the counts' own, those
/// that err to the slow side would count for more.
inline std::optional<WheelReading> EncoderInterval::update(const sensor::WheelCounts& counts,
                                                           const FilterView& filter) {
  const model::DifferentialDrive& drive = filter.parameters().wheels.drive;
  const base::Micros stamp = filter.stamp(), interval = stamp - counted_at_;
  const bool usable =
      has_counts() && interval.us > 0 && interval <= base::Micros{filter.parameters().wheels.timeout_us};
  const std::int32_t left = model::count_difference(counts.left, counts_.left);
  const std::int32_t right = model::count_difference(counts.right, counts_.right);
  counts_ = counts;
  counted_at_ = stamp;
  if (!usable || left != 0 || right != 0) moved_at_ = stamp;
  const float later_mps = base::is_finite(gained_mps_) ? 0.5F * gained_mps_ : 0.0F;
  gained_mps_ = 0;
  if (!usable) return std::nullopt;
  const float per_s = 1.0F / base::seconds(interval);
  WheelReading reading{.wheels = {.left_mps = drive.left_m(left) * per_s, .right_mps = drive.right_m(right) * per_s},
                       .later_mps = later_mps};
  if (!model::possible_step(reading.wheels.left_mps, reading.wheels.right_mps, filter.parameters().wheels.most_mps))
    leapt_at_ = stamp;
  const float count_mps = drive.count_sigma_m() * per_s;
  const float mean_mps = filter.tracking() ? filter.forward_mps() : reading.mean_mps();
  const float half_mps = filter.tracking() ? 0.5F * drive.track_m * filter.turn_b_radps()(2)
                                           : 0.5F * (reading.wheels.right_mps - reading.wheels.left_mps);
  const float way =
      drive.noise_left * base::abs(mean_mps - half_mps) + drive.noise_right * base::abs(mean_mps + half_mps);
  reading.sigma_mps = base::sqrt(count_mps * count_mps + 0.25F * way * per_s);
  return reading;
}

}  // namespace tetap::estimators
