// SPDX-License-Identifier: Apache-2.0
// What an inertial filter has beside it: hypotheses of its sensors' faults, or none. The filter, its gates and its
// decisions are the same to the bit with either.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/nav/ins.hpp"
#include "tetap/trust/inertial_faults.hpp"

namespace tetap::estimators {

/// No hypotheses: what is published is the filter's own.
struct NoWatch {
  static constexpr bool kWatches = false;
  [[nodiscard]] static nav::NoFaults bank() { return {}; }
  static void begin() {}
  static void judge(float) {}
  static void publish(const nav::Ins::Covariance&) {}
  [[nodiscard]] static const nav::Ins::Covariance& published_p(const nav::Ins::Covariance& p) { return p; }
  static constexpr auto members(auto&) { return base::members(); }
};

/// The bank of faults, and the covariance of the mixture that it publishes.
class FaultWatch {
 public:
  static constexpr bool kWatches = true;

  [[nodiscard]] trust::InertialBank& bank() { return bank_; }
  [[nodiscard]] const trust::InertialBank& bank() const { return bank_; }
  /// The filter begins anew, or was set from outside.
  void begin() { bank_.begin(); }
  /// Every row is weighed, dt_s after the last time.
  void judge(float dt_s) { bank_.judge(dt_s); }
  /// The tick's last word on P.
  void publish(const nav::Ins::Covariance& p) {
    wider_ = bank_.suspects();
    if (!wider_) return;
    published_.copy_from(p);
    bank_.widen(published_);
  }
  [[nodiscard]] trust::LikelyFault likeliest() const { return bank_.likeliest(); }
  /// The filter's own P to the bit while no row is likely.
  [[nodiscard]] const nav::Ins::Covariance& published_p(const nav::Ins::Covariance& p) const {
    return wider_ ? published_ : p;
  }

  static constexpr auto members(auto& self) {
    // P and the bank make published_ anew in every tick.
    return base::members(self.bank_, base::unhashed(self.published_), self.wider_);
  }

 private:
  trust::InertialBank bank_;
  nav::Ins::Covariance published_;
  bool wider_ = false;  ///< published_ is that of this tick
};

}  // namespace tetap::estimators
