// SPDX-License-Identifier: Apache-2.0
// A ramp of fixes inside the gate of each of them.
#pragma once

#include "base/math.hpp"

#include <array>
#include <cstdint>

namespace tetap::checks {

/// Notices fixes that drift away while the receiver's own velocity goes along with the filter: the mean of what the
/// last ten or so say the filter is off by, less that of the last thirty. Each of them alone may be inside its gate (a
/// ramp, spoofing); what stays where it is, as a filter's own error does, leaves both means alike. Exponentially
/// weighted means as in Roberts 1959 (control charts); innovations averaged against a slow fault: Diesel & Luu 1995.
class PositionDrift {
 public:
  void hear(float east_m, float north_m) {
    follow(soon_m_, kSoon, east_m, north_m);
    follow(late_m_, kLate, east_m, north_m);
  }
  /// The difference of both means, squared and normalised (2 degrees of freedom), of fixes whose errors are new with
  /// each. What the filter does not know of where the antenna is (variances to east and north) counts in full.
  [[nodiscard]] float nis(float fix_m2, float east_m2, float north_m2) const {
    const float d_east_m = soon_m_[0] - late_m_[0], d_north_m = soon_m_[1] - late_m_[1];
    const float of_fixes_m2 = kShare * fix_m2;
    return d_east_m * d_east_m / (of_fixes_m2 + east_m2) + d_north_m * d_north_m / (of_fixes_m2 + north_m2);
  }
  /// Whether the receiver's velocity was what the filter expects: it vouches for the next few fixes, for they may come
  /// more often.
  [[nodiscard]] bool vouched_for() {
    if (vouches_ == 0) return false;
    --vouches_;
    return true;
  }
  void velocity(bool agrees) { vouches_ = agrees ? kFixesOfAVelocity : std::uint8_t{0}; }
  void forget() { *this = {}; }

  template <class Sink>
  void hash_state(Sink&& sink) const {
    sink(soon_m_[0]);
    sink(soon_m_[1]);
    sink(late_m_[0]);
    sink(late_m_[1]);
    sink(static_cast<std::uint32_t>(vouches_));
  }

 private:
  using Mean = std::array<float, 2>;
  static constexpr std::uint8_t kFixesOfAVelocity = 10;  ///< a receiver that says one a second
  static constexpr float kSoon = 0.1F, kLate = 0.03F;    ///< what the newest counts for
  /// Variance of the difference, of the variance of one: that of a mean is w / (2 - w), what two have in common
  /// v w / (v + w - v w).
  static constexpr float kShare =
      kSoon / (2 - kSoon) + kLate / (2 - kLate) - 2 * kSoon * kLate / (kSoon + kLate - kSoon * kLate);
  static void follow(Mean& mean_m, float weight, float east_m, float north_m) {
    mean_m = {mean_m[0] + weight * (east_m - mean_m[0]), mean_m[1] + weight * (north_m - mean_m[1])};
  }

  Mean soon_m_{}, late_m_{};
  std::uint8_t vouches_ = 0;
};

}  // namespace tetap::checks
