// SPDX-License-Identifier: Apache-2.0
// Landmarks and fixes against the motion: two devices that show the robot at one place beside the filter's outvote the
// wheels. Where they show two places, one of them is wrong itself, and nothing is concluded.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/base/members.hpp"
#include "tetap/checks/chi_square.hpp"
#include "tetap/checks/persistence.hpp"
#include "tetap/filter/update.hpp"
#include "tetap/model/gnss_position.hpp"
#include "tetap/model/landmark.hpp"

#include <cstddef>
#include <cstdint>

namespace tetap::estimators {

/// A refused fix: where it is from the filter's antenna.
struct FixOffset {
  float east_m = 0, north_m = 0;
  float m2 = 0;  ///< variance of one axis
};
/// A refused sighting: where its landmark is from the filter's sensor, and how far away it was seen. The range alone
/// does not depend on the heading, which errs with the motion.
struct SightedRange {
  float east_m = 0, north_m = 0;
  float range_m = 0;
  float m2 = 0;   ///< variance of the range
  float nis = 0;  ///< NIS of the range alone
};

class MotionVote {
 public:
  enum Source : std::size_t { kLandmark, kGnss, kSources };

  void note(const model::GnssPosition& fix, const model::PlanarPose&, const filter::Innovation<float, 2>& by) {
    fix_ = {.east_m = by.nu(0), .north_m = by.nu(1), .m2 = fix.sigma_m * fix.sigma_m};
  }
  template <class Sighting, int M>
  void note(const Sighting& seen, const model::PlanarPose& x, const filter::Innovation<float, M>& by) {
    if constexpr (requires { seen.range_m; }) {
      const model::Sight sight(x, seen.landmark, seen.mounting);
      seen_ = {.east_m = sight.dx_m,
               .north_m = sight.dy_m,
               .range_m = seen.range_m,
               .m2 = seen.sigma_range_m * seen.sigma_range_m,
               .nis = by.nu(0) * by.nu(0) / by.s(0, 0)};
    } else {
      seen_ = {.nis = base::kNan};  // a bearing depends on the heading
    }
  }
  /// The sighting's range fits the fix's place, and is a thousand times as likely from there as from the filter's
  /// place: 13.8 is twice the logarithm of a thousand. Both are Gaussian likelihoods without their factors.
  [[nodiscard]] bool one_place() const {
    const float east_m = seen_.east_m - fix_.east_m, north_m = seen_.north_m - fix_.north_m;
    const float off_m = base::sqrt(east_m * east_m + north_m * north_m) - seen_.range_m;
    const float from_fix = off_m * off_m / (fix_.m2 + seen_.m2);
    return from_fix <= filter::chi_square_99(1) && seen_.nis - from_fix >= checks::kChiSquare999Of2;
  }
  /// The motion was wrong by this way since the last agreement.
  void contradict(float way_m, base::Micros since, base::Micros stamp) {
    constexpr base::Micros kLeast{200'000};
    const float speed_error_mps = way_m / base::seconds(since > kLeast ? since : kLeast);
    if (speed_error_mps > speed_error_mps_) speed_error_mps_ = speed_error_mps;
    contradicted_at_ = stamp;
  }
  /// Both contradicted the motion within the last ten seconds.
  [[nodiscard]] bool contradicts(base::Micros stamp) const {
    return checks::recent(contradicted_at_, stamp, base::Micros{10'000'000});
  }
  /// Variance of the position that the speed's error adds at `since` the last accepted measurement.
  [[nodiscard]] float added_m2(base::Micros since, base::Micros stamp) {
    if (!contradicts(stamp)) {
      speed_error_mps_ = speed_error_m2_ = 0;
      return 0;
    }
    const float way_m = speed_error_mps_ * base::seconds(since), more_m2 = way_m * way_m - speed_error_m2_;
    if (!(more_m2 > 0.0F)) return 0;
    speed_error_m2_ += more_m2;
    return more_m2;
  }
  void accepted() { speed_error_m2_ = 0; }
  void reset() { *this = {}; }

  static constexpr auto members(auto& self) {
    return base::members(self.fix_, self.seen_, self.speed_error_mps_, self.speed_error_m2_, self.contradicted_at_);
  }

 private:
  FixOffset fix_;
  SightedRange seen_;
  float speed_error_mps_ = 0;     ///< 1 sigma of the speed, beside the wheels' own noise
  float speed_error_m2_ = 0;      ///< variance of the position by it since the last accepted measurement
  base::Micros contradicted_at_;  ///< stamp at which landmarks and fixes last contradicted the motion; 0: never
};

}  // namespace tetap::estimators
