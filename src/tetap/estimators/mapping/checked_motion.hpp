// SPDX-License-Identifier: Apache-2.0
// Dead reckoning of a mapper, judged by TurnCheck as that of the other planar estimators. A wheel that slips is the
// likelier cause, so the way is uncertain at once. The heading follows when the landmarks do not vouch for it.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/estimators/mapping/recording_ekf.hpp"
#include "tetap/estimators/planar/turn_check.hpp"

#include <concepts>

namespace tetap::estimators {

class CheckedMotion : public PlanarDeadReckoning<RecordingEkf> {
  using Motion = PlanarDeadReckoning<RecordingEkf>;

 public:
  template <class Input>
  requires requires(Motion& motion, const Input& input, base::Micros stamp, const param::Parameters& n) {
    motion.fuse(input, stamp, n);
  }
  sensor::Verdict fuse(const Input& input, base::Micros stamp, const param::Parameters& n) {
    const sensor::Verdict verdict = Motion::fuse(input, stamp, n);
    if (!std::same_as<Input, sensor::ImuSample> && verdict == sensor::Verdict::kAccepted) judge(stamp, n);
    return verdict;
  }
  /// After the sightings of one stamp: two landmarks that fit have corrected the way and vouch for the heading.
  void looked(int accepted) {
    if (accepted >= 2) {
      heading_rad2_ = 0;
      turn_.residual.corrected();
    } else {
      widen_heading();
    }
  }
  void trust() {
    heading_rad2_ = 0;
    turn_.residual.reset();
  }
  /// Wheels and gyroscope contradict each other in the mean of the last second.
  [[nodiscard]] bool contradicts() const { return turn_.residual.contradicts(); }
  [[nodiscard]] std::uint16_t faults() const { return turn_.faults(); }
  /// Variance of the heading by that contradiction, beside the filter's.
  [[nodiscard]] float heading_rad2() const { return heading_rad2_; }

  static constexpr auto members(auto& self) {
    return base::members(base::base_of<Motion>(self), self.turn_, self.heading_rad2_, self.heading_since_);
  }

 private:
  static constexpr base::Micros kUnseen{1'000'000};  ///< time without landmarks after which the heading is uncertain

  void judge(base::Micros stamp, const param::Parameters& n) {
    const float turned_rad2 = turn_.update(*this, stamp, n);
    if (turned_rad2 > 0.0F) {
      filter.predict(model::PlanarIncrement{.var_ds = TurnCheck::place_m2(turned_rad2, n)});
      if (!(heading_rad2_ > 0.0F)) heading_since_ = stamp;
      const float most_rad2 = n.recovery.inflate_yaw_rad * n.recovery.inflate_yaw_rad;
      heading_rad2_ = heading_rad2_ + turned_rad2 < most_rad2 ? heading_rad2_ + turned_rad2 : most_rad2;
    }
    if (heading_rad2_ > 0.0F && stamp - heading_since_ > kUnseen) widen_heading();
  }
  void widen_heading() {
    if (heading_rad2_ > 0.0F) filter.predict(model::PlanarIncrement{.var_dyaw = heading_rad2_});
    heading_rad2_ = 0;
  }

  TurnCheck turn_;
  float heading_rad2_ = 0;      ///< by the contradiction, not in the filter yet
  base::Micros heading_since_;  ///< stamp of its begin
};

}  // namespace tetap::estimators
