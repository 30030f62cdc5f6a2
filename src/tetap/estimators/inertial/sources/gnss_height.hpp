// SPDX-License-Identifier: Apache-2.0
// GNSS position, vertical: a height may be refused by itself, and becomes true by persisting.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/checks/offset_hypothesis.hpp"
#include "tetap/estimators/inertial/filter_view.hpp"
#include "tetap/estimators/inertial/fix_measurement.hpp"
#include "tetap/estimators/inertial/refusal.hpp"

namespace tetap::estimators {

class GnssHeightSource {
 public:
  using Measurement = FixMeasurement;

  /// After the horizontal part was fused or reset. `fuses()`: the height is fused with it.
  [[nodiscard]] Assessment assess(const FixMeasurement& z, const FilterView& filter) {
    const param::Parameters& n = filter.parameters();
    Assessment a{.dof = 3, .nis = z.statistics.joint_nis, .gate = fix_gate(n.gnss, 3)};
    const bool agrees = a.nis <= a.gate;
    refused_.update(!agrees, filter.stamp());
    const float p_z = filter.p()(2, 2);
    const bool decides = p_z > FixMeasurement::kDecides * z.r(2);
    if (!agrees || decides) {
      offset_.update(filter.stamp(), z.nu(2), 0.0F, z.r(2), p_z);
      if (agrees) {
        confirm(a, n.recovery);
      } else {
        judge_refused(z, a, n.recovery);
      }
    }
    // Fixes that repeat each other move an unsure height slowly: what was confirmed stays so until the filter is sure.
    if (a.fuses() && !(agrees && decides)) offset_.reset();
    return a;
  }
  /// Offsets so far were measured from elsewhere.
  void reset() { offset_.reset(); }
  void relocated() { refused_.reset(); }

  [[nodiscard]] const checks::Persistence& refused() const { return refused_; }
  /// A height comes with its fix, and times out with it.
  [[nodiscard]] static bool timed_out(base::Micros) { return false; }
  [[nodiscard]] SourceStatus status(base::Micros) const {
    if (!refused_.holds() && offset_.holds() && !offset_.accepted())
      return {SourceState::kConfirming, Check::kUnconfirmed};
    return status_of(refused_);
  }
  static constexpr auto members(auto& self) { return base::members(self.offset_, self.refused_); }

 private:
  void confirm(Assessment& a, const param::RecoveryParameters& n) {
    if (offset_.confirmed(n.confirm_fixes) && !offset_.contradicted()) return offset_.accept();
    a.action = Action::kSkip;
    a.failed = Check::kUnconfirmed;
  }
  void judge_refused(const FixMeasurement& z, Assessment& a, const param::RecoveryParameters& n) {
    a.failed = Check::kGate;
    if (!offset_.persisted(base::Micros{n.persist_us}, n.persist_fixes)) {
      a.action = Action::kReject;
      return;
    }
    a.action = Action::kResetHeight;
    a.remedy.step_m = {0.0F, 0.0F, offset_.east_m()};
    a.remedy.variance_m2 = z.r;
  }

  checks::OffsetHypothesis offset_;  ///< offset of heights that were not fused
  checks::Persistence refused_;      ///< heights in a row that were refused
};

}  // namespace tetap::estimators
