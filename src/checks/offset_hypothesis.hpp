// SPDX-License-Identifier: Apache-2.0
// What refused fixes state: a common offset, since when, and how often.
#pragma once

#include "base/time.hpp"
#include "checks/chi_square.hpp"

#include <cstdint>

namespace tetap::checks {

/// What fixes that are not taken say: "you are off by this much", since when, and how often they said it. The filter
/// goes on without them meanwhile, so they say the same only if they move as it does.
class OffsetHypothesis {
 public:
  /// One more fix: by how much the filter is off, the variance of the fix on one axis, and that of the filter on two
  /// (what it grows by while it goes on alone is what a claim may move by). What contradicts the claim so far is left
  /// out; so many in a row are a new one.
  [[gnu::noinline]] void hear(base::Micros stamp, float east_m, float north_m, float fix_m2, float filter_m2) {
    const float d_east_m = east_m - east_m_, d_north_m = north_m - north_m_;
    const float grown_m2 = filter_m2 > begun_m2_ ? filter_m2 - begun_m2_ : 0.0F;
    const bool same = d_east_m * d_east_m + d_north_m * d_north_m <= kChiSquare999Of2 * (2.0F * fix_m2 + grown_m2);
    if (fixes_ == 0 || (!same && ++against_ >= kAgainst)) {
      *this = {};
      since_ = stamp;
      east_m_ = east_m;
      north_m_ = north_m;
      begun_m2_ = filter_m2;
    } else if (!same) {
      return;
    }
    against_ = 0;
    if (fixes_ < kMost) ++fixes_;
    last_ = stamp;
    const float share = 1.0F / static_cast<float>(fixes_);
    east_m_ += share * (east_m - east_m_);
    north_m_ += share * (north_m - north_m_);
  }
  void forget() { *this = {}; }

  [[nodiscard]] bool confirmed(std::int32_t fixes) const { return fixes_ >= fixes; }
  [[nodiscard]] bool persisted(std::int32_t for_us, std::int32_t fixes) const {
    return fixes_ >= fixes && last_ - since_ >= base::Micros{for_us};
  }
  /// Whether they say what (east, north) says.
  [[nodiscard]] bool says(float east_m, float north_m, float variance_m2) const {
    const float d_east_m = east_m_ - east_m, d_north_m = north_m_ - north_m;
    return d_east_m * d_east_m + d_north_m * d_north_m <= kChiSquare999Of2 * variance_m2;
  }
  /// The mean of what they said.
  [[nodiscard]] float east_m() const { return east_m_; }
  [[nodiscard]] float north_m() const { return north_m_; }

  template <class Sink>
  void hash_state(Sink&& sink) const {
    sink(since_.us);
    sink(last_.us);
    sink(east_m_);
    sink(north_m_);
    sink(begun_m2_);
    sink(fixes_);
    sink(static_cast<std::uint32_t>(against_));
  }

 private:
  static constexpr std::uint8_t kAgainst = 5;
  static constexpr std::int32_t kMost = 1'000'000;

  base::Micros since_, last_;
  float east_m_ = 0, north_m_ = 0;
  float begun_m2_ = 0;
  std::int32_t fixes_ = 0;
  std::uint8_t against_ = 0;
};

}  // namespace tetap::checks
