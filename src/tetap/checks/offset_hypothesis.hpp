// SPDX-License-Identifier: Apache-2.0
// Hypothesis "the filter is off by this much", from fixes that were not fused. Errors of a receiver last (multipath,
// atmosphere), so an offset becomes credible only by persisting. The filter goes on without the fixes meanwhile: they
// repeat an offset only if they move as the filter does.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/checks/chi_square.hpp"
#include "tetap/checks/persistence.hpp"

#include <cstdint>

namespace tetap::checks {

class OffsetHypothesis {
 public:
  /// One more fix: the filter's offset, and the variance of the fix on one axis and of the filter on two. The offset
  /// may move by the growth of the filter's variance. A fix that contradicts the hypothesis is left out; five in a row
  /// begin a new one.
  [[gnu::noinline]] void update(base::Micros stamp, float east_m, float north_m, float fix_m2, float filter_m2) {
    const float d_east_m = east_m - east_m_, d_north_m = north_m - north_m_;
    const float grown_m2 = filter_m2 > begun_m2_ ? filter_m2 - begun_m2_ : 0.0F;
    const bool same = d_east_m * d_east_m + d_north_m * d_north_m <= kChiSquare999Of2 * (2.0F * fix_m2 + grown_m2);
    if (!supported_.holds() || (!same && ++against_ >= kAgainst)) {
      reset();
      east_m_ = east_m;
      north_m_ = north_m;
      begun_m2_ = filter_m2;
    } else if (!same) {
      return;
    }
    against_ = 0;
    supported_.update(true, stamp);
    const float share = 1.0F / static_cast<float>(supported_.count());
    east_m_ += share * (east_m - east_m_);
    north_m_ += share * (north_m - north_m_);
  }
  void reset() { *this = {}; }

  /// Fixes that support it are used from now on.
  void accept() { accepted_ = true; }
  [[nodiscard]] bool accepted() const { return accepted_; }
  /// The last fix did not support it.
  [[nodiscard]] bool contradicted() const { return against_ != 0; }
  [[nodiscard]] bool holds() const { return supported_.holds(); }
  [[nodiscard]] bool confirmed(std::int32_t fixes) const { return supported_.count() >= fixes; }
  [[nodiscard]] bool persisted(base::Micros for_, std::int32_t fixes) const {
    return supported_.persisted(for_, fixes);
  }
  /// The offset agrees with (east, north) within its variance.
  [[nodiscard]] bool agrees(float east_m, float north_m, float variance_m2) const {
    const float d_east_m = east_m_ - east_m, d_north_m = north_m_ - north_m;
    return d_east_m * d_east_m + d_north_m * d_north_m <= kChiSquare999Of2 * variance_m2;
  }
  /// Mean offset of the fixes so far.
  [[nodiscard]] float east_m() const { return east_m_; }
  [[nodiscard]] float north_m() const { return north_m_; }

  static constexpr auto members(auto& self) {
    return base::members(self.supported_, self.east_m_, self.north_m_, self.begun_m2_, self.against_, self.accepted_);
  }

 private:
  static constexpr std::uint8_t kAgainst = 5;

  Persistence supported_;           ///< fixes that support the hypothesis
  float east_m_ = 0, north_m_ = 0;  ///< mean offset of the fixes
  float begun_m2_ = 0;              ///< variance of the filter at the first of them
  std::uint8_t against_ = 0;        ///< fixes in a row that contradict the hypothesis
  bool accepted_ = false;
};

}  // namespace tetap::checks
