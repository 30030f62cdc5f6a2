// SPDX-License-Identifier: Apache-2.0
// Votes of devices on a refused measurement. Witnesses are devices: the receiver (position and velocity), the wheels or
// a speedometer, the IMU. A device that is refused is right when another device contradicts the filter likewise, or
// when none vouches for the filter for long. A vote for or against takes a likelihood ratio, not a gate: Wald 1945,
// "Sequential tests of statistical hypotheses", Ann. Math. Stat. 16(2).
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/checks/persistence.hpp"
#include "tetap/nav/so3.hpp"
#include "tetap/param/parameters.hpp"

#include <cstdint>

namespace tetap::estimators {

/// Way of a deviation that grows from nothing, in that of its last velocity.
inline constexpr float kGrowth = 0.7F;

enum class Vote : std::uint8_t {
  kAbsent,    ///< the device is silent
  kAbstains,  ///< the device's measurements do not decide
  kWaits,     ///< no measurement of the device since the question; one may still come
  kFor,       ///< the filter is right
  kAgainst,   ///< the filter is wrong
};

/// Record of a device's measurements so far: accepted or refused, and when.
class DeviceRecord {
 public:
  void update(bool refused, base::Micros stamp) {
    refused_.update(refused, stamp);
    last_measurement_ = stamp;
    if (!refused) last_accepted_ = stamp;
  }
  [[nodiscard]] const checks::Persistence& refused() const { return refused_; }
  /// First refusal of the present run.
  [[nodiscard]] base::Micros since(base::Micros stamp) const { return stamp - refused_.held_for(stamp); }
  [[nodiscard]] base::Micros last_measurement() const { return last_measurement_; }
  /// Time from the last agreement to `stamp`, at most ten seconds: what the filter is off by has grown in it.
  [[nodiscard]] float disagreement_s(base::Micros stamp) const {
    constexpr base::Micros kMost{10'000'000};
    const base::Micros for_ = last_accepted_.us > 0 ? stamp - last_accepted_ : refused_.held_for(stamp);
    return base::seconds(for_ < kMost ? for_ : kMost);
  }
  /// Refused at least three times, the last one within 1.5 s.
  [[nodiscard]] bool contradicts(base::Micros stamp) const {
    return refused_.count() >= kRefusals && checks::recent(last_measurement_, stamp, base::Micros{1'500'000});
  }
  /// kAbstains: a measurement came after `since`; kWaits: one may still come; kAbsent: the device is silent.
  [[nodiscard]] Vote presence(base::Micros since, base::Micros stamp) const {
    constexpr base::Micros kPresent{3'000'000}, kPatience{2'500'000};
    if (!checks::recent(last_measurement_, stamp, kPresent)) return Vote::kAbsent;
    if (last_measurement_ > since) return Vote::kAbstains;
    return stamp - since > kPatience ? Vote::kAbsent : Vote::kWaits;
  }
  /// Vote of a velocity: accepted or refused since.
  [[nodiscard]] Vote of_velocity(base::Micros since, base::Micros stamp) const {
    const Vote present = presence(since, stamp);
    if (present != Vote::kAbstains) return present;
    return refused_.holds() ? Vote::kAgainst : Vote::kFor;
  }
  /// The filter gave way: refusals so far were its own error.
  void reset_refusals() { refused_.reset(); }
  /// The filter begins.
  void begin() { *this = {}; }
  /// Measurements since `before` were of something else: stamps go back to those of `before`.
  void restore_stamps(const DeviceRecord& before) {
    last_measurement_ = before.last_measurement_;
    last_accepted_ = before.last_accepted_;
  }

  static constexpr std::int32_t kRefusals = 3;

  static constexpr auto members(auto& self) {
    return base::members(self.refused_, self.last_measurement_, self.last_accepted_);
  }

 private:
  checks::Persistence refused_;    ///< refusals in a row
  base::Micros last_measurement_;  ///< stamp of the last measurement; 0: none
  base::Micros last_accepted_;     ///< stamp of the last one that was accepted; 0: none
};

/// Innovation of a fix: a level offset, and the mean variance of one axis.
struct LevelInnovation {
  float east_m = 0, north_m = 0, variance_m2 = 1;
};

/// Vote of the last fix, which came t after the velocity was first refused by nu. (2 d v - d^2) / S is twice the log
/// likelihood ratio of "off by d = nu t" to "not off". Accepted alone shows nothing.
[[nodiscard]] inline Vote vote_of_fix(const LevelInnovation& fix, bool refused, const nav::Vector3& nu_mps, float t_s) {
  constexpr float kRatio = 9.0F;  // 3 sigma
  const float east_m = kGrowth * t_s * nu_mps(0), north_m = kGrowth * t_s * nu_mps(1);
  const float for_filter =
      (east_m * (east_m - 2.0F * fix.east_m) + north_m * (north_m - 2.0F * fix.north_m)) / fix.variance_m2;
  if (for_filter < -kRatio) return Vote::kAgainst;
  return for_filter > kRatio && !refused ? Vote::kFor : Vote::kAbstains;
}

/// Votes on a refused velocity.
struct Votes {
  Vote speed = Vote::kAbsent;  ///< the other velocity
  Vote fixes = Vote::kAbsent;
  bool speeds_agree = false;  ///< both velocities agree, so that they contradict the filter likewise
};

/// The filter gives way to a velocity: soon where a second device contradicts it, after RecoveryParameters::after_us
/// where none vouches for it.
[[nodiscard]] inline bool filter_yields(const checks::Persistence& refused, const Votes& votes, base::Micros stamp,
                                        const param::RecoveryParameters& n) {
  const auto any = [&votes](Vote vote) { return votes.speed == vote || votes.fixes == vote; };
  if (any(Vote::kFor) || any(Vote::kWaits)) return false;
  const bool against = votes.fixes == Vote::kAgainst || (votes.speed == Vote::kAgainst && votes.speeds_agree);
  if (against) return refused.persists(stamp, base::Micros{200'000}, DeviceRecord::kRefusals);
  return votes.speed != Vote::kAgainst && refused.persists(stamp, base::Micros{n.after_us}, n.at_least);
}

}  // namespace tetap::estimators
