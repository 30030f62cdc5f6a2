// SPDX-License-Identifier: Apache-2.0
// A mapper's landmarks and records in the words of the bus.
#pragma once

#include "tetap/estimators/estimate.hpp"
#include "tetap/slam/sighting.hpp"

#include <cstdint>

namespace tetap::estimators {

/// Identity on the bus: that of the landmark, or a number from 254 downwards where it was seen without one.
[[nodiscard]] constexpr std::uint8_t bus_id(std::uint16_t id) {
  constexpr std::uint16_t kFirstNameless = 0x4000;
  if (id < kFirstNameless) return static_cast<std::uint8_t>(id);
  return id == slam::Sighting::kNoId ? std::uint8_t{0xFF} : static_cast<std::uint8_t>(254 - (id - kFirstNameless));
}

[[nodiscard]] constexpr sensor::Verdict word_of(slam::SightingVerdict verdict) {
  using slam::SightingVerdict, sensor::Verdict;
  const auto same = [](SightingVerdict a, Verdict b) { return static_cast<int>(a) == static_cast<int>(b); };
  static_assert(
      same(SightingVerdict::kAccepted, Verdict::kAccepted) && same(SightingVerdict::kRejected, Verdict::kRejected) &&
      same(SightingVerdict::kNotUsed, Verdict::kNotUsed) && same(SightingVerdict::kSingular, Verdict::kSingular) &&
      same(SightingVerdict::kNotFinite, Verdict::kNotFinite) &&
      same(SightingVerdict::kNewLandmark, Verdict::kNewLandmark) &&
      same(SightingVerdict::kAmbiguous, Verdict::kAmbiguous) && same(SightingVerdict::kNoRoom, Verdict::kNoRoom) &&
      same(SightingVerdict::kPending, Verdict::kPending) && same(SightingVerdict::kOutlier, Verdict::kOutlier));
  return static_cast<Verdict>(verdict);
}

/// `gate` is that of the sighting's components.
[[nodiscard]] constexpr Innovation record(const slam::SightingRecord& from, float gate) {
  const sensor::Verdict verdict = word_of(from.verdict);
  const bool compared = from.nis > 0.0F;
  const bool gated = verdict == sensor::Verdict::kRejected || verdict == sensor::Verdict::kOutlier;
  return {.verdict = verdict,
          .dof = compared ? from.components : std::uint8_t{0},
          .nis = from.nis,
          .gate = gate,
          .landmark = bus_id(from.id),
          .failed = gated                                    ? sensor::Check::kGate
                    : verdict == sensor::Verdict::kNotFinite ? sensor::Check::kValue
                                                             : sensor::Check::kNone};
}

}  // namespace tetap::estimators
