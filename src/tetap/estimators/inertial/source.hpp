// SPDX-License-Identifier: Apache-2.0
// One shape for every aiding source. A source assesses a measurement against a read-only view of the filter and changes
// nothing but itself. The Assessment is what is to be done with the measurement, and with the filter. PX4 publishes the
// like for every source (EstimatorAidSource).
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/base/time.hpp"
#include "tetap/nav/so3.hpp"
#include "tetap/sensor/source_state.hpp"
#include "tetap/sensor/vocabulary.hpp"

#include <array>
#include <concepts>
#include <cstdint>

namespace tetap::estimators {

using sensor::Check;
using sensor::SourceState;

/// Ratio of two variances from which an update by the smaller one changes the larger one noticeably.
inline constexpr float kLeastVarianceRatio = 1.05F;

enum class Action : std::uint8_t {
  kFuse,            ///< update the filter
  kSkip,            ///< leave the measurement out: it is no news, or waits for others
  kReject,          ///< leave the measurement out: a test failed
  kInflateMotion,   ///< reject; the source was refused for too long: velocity and heading become less certain
  kWidenVelocity,   ///< reject; a velocity is right: what can have made the filter wrong by the innovation
  kWidenPosition,   ///< fuse, after the same of a fix
  kWidenClimb,      ///< reject; barometer and receiver are right: the same of the climb
  kInflateHeading,  ///< the heading becomes as uncertain as the innovation
  kResetZero,       ///< reject; the source took a new zero
  kResetPosition,   ///< fuse, after the horizontal position was reset
  kResetHeight,     ///< fuse, after the height was reset
};

/// Operands of Recovery; zero where the action needs none.
struct Remedy {
  nav::Vector3 step_m = nav::Vector3::Zero();       ///< reset: how far
  nav::Vector3 variance_m2 = nav::Vector3::Zero();  ///< variance of the position after a reset
  std::array<float, 2> pulled_m{};                  ///< 1 sigma by which refused fixes may have led the position before
  nav::Vector3 innovation = nav::Vector3::Zero();   ///< kWidenVelocity (m/s), kWidenPosition (m): level axes
  float climb_mps = 0;                              ///< kWidenClimb: climb rate that the filter lacks
  float height_m = 0;                               ///< kWidenClimb: height that the filter lacks
  float since_s = 0;                                ///< time in which the innovation grew
  float sigma_rad = 0;                              ///< 1 sigma of the heading, beside
  bool undoes = false;                              ///< kResetPosition: back to where the last reset came from
};

/// The uniform record of one test of one measurement: what is to be done, and why.
struct Assessment {
  Action action = Action::kFuse;
  Check failed = Check::kNone;
  sensor::Verdict verdict = sensor::Verdict::kAccepted;
  sensor::ResetCause cause = sensor::ResetCause::kPositionJump;  ///< cause of a reset or a restart
  std::uint8_t dof = 0;
  float nis = 0;
  float gate = 0;
  float statistic = 0;  ///< statistic of the failed check, where that is not the innovation gate
  float limit = 0;      ///< the statistic's limit
  Remedy remedy;

  void reject(Check check) {
    action = Action::kReject;
    failed = check;
    verdict = sensor::Verdict::kRejected;
  }
  [[nodiscard]] bool fuses() const {
    return action == Action::kFuse || action == Action::kResetPosition || action == Action::kResetHeight ||
           action == Action::kWidenPosition;
  }
};

/// The word of a source and the test that failed last.
struct SourceStatus {
  SourceState state = SourceState::kStopped;
  Check failed = Check::kNone;

  void fused() { *this = {SourceState::kFusing, Check::kNone}; }
  void confirming() { *this = {SourceState::kConfirming, Check::kUnconfirmed}; }
  void rejecting(Check check) { *this = {SourceState::kRejecting, check}; }
  void distrusted(Check check) { *this = {SourceState::kDistrusted, check}; }
  static constexpr auto members(auto& self) { return base::members(self.state, self.failed); }
};

class FilterView;

template <class S>
concept AidingSource = requires(S& s, const S& seen, const typename S::Measurement& z, const FilterView& filter,
                                base::Micros at) {
  { s.assess(z, filter) } -> std::same_as<Assessment>;
  { seen.timed_out(at) } -> std::same_as<bool>;
  { seen.status(at) } -> std::same_as<SourceStatus>;
  S::members(seen);
};

}  // namespace tetap::estimators
