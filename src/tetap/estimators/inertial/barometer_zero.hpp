// SPDX-License-Identifier: Apache-2.0
// Zero of a barometer: pressure is a height above an unknown zero, which drifts. The worse known of zero and robot's
// height is found from the other, and never becomes better known than it. Their errors are shared from then on. No
// cross covariance is kept of them.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/base/members.hpp"
#include "tetap/base/time.hpp"
#include "tetap/checks/persistence.hpp"
#include "tetap/param/parameters.hpp"

#include <cstdint>

namespace tetap::estimators {

/// Height in the standard atmosphere (U.S. Standard Atmosphere 1976, eq. 33a; ICAO Doc 7488, up to 11 km).
[[nodiscard]] inline float pressure_altitude_m(float pressure_Pa) {
  return 44330.77F * (1.0F - base::exp(0.1902632F * base::log(pressure_Pa * (1.0F / 101325.0F))));
}

/// Variance of a measurement with which the estimate (variance p) ends at `floor`, were the measurement repeated
/// without end; p > floor.
[[nodiscard]] inline float variance_towards(float floor, float p) { return floor * p / (p - floor); }

class BarometerZero {
 public:
  /// Carries the zero to a sample's time.
  void predict(base::Micros stamp, const param::BaroParameters& n) {
    const base::Micros since = stamp - last_;
    if (since.us > 0) p_ += n.drift_m_rts * n.drift_m_rts * base::seconds(since);
    if (checks::older(last_, stamp, kGap))
      agreed_ = stamp - base::Micros{1};  // neither refused for long nor in agreement
    last_ = stamp;
  }
  /// Variance of a height above the zero: in air other than the standard's a share of the climb since the zero was
  /// found is wrong.
  [[nodiscard]] float variance(float altitude_m, const param::BaroParameters& n) const {
    const float air_m = n.scale_share * (altitude_m - altitude_m_);
    return p_ + air_m * air_m;
  }
  void set(float altitude_m, float zero_m, float variance, base::Micros stamp) {
    altitude_m_ = altitude_m;
    zero_m_ = zero_m;
    p_ = variance;
    last_ = agreed_ = stamp;
    set_at_us_ = static_cast<std::uint32_t>(stamp.us - 1) | 1U;
  }
  /// Corrects the zero (variance p) by a height of variance p_z < p; `nu`: how much higher the zero should be.
  void correct(float nu, float p, float p_z, float white, float altitude_m) {
    const float k = p / (p + variance_towards(p_z, p) + white);
    zero_m_ += k * nu;
    p_ = p - k * p;
    altitude_m_ = altitude_m;
  }
  /// Variance of the zero itself.
  [[nodiscard]] float variance() const { return p_; }
  [[nodiscard]] bool known() const { return set_at_us_ != 0; }
  /// Time since the zero was set, modulo 2^32 us: before that no height agreed with it.
  [[nodiscard]] base::Micros known_for(base::Micros stamp) const {
    return {static_cast<std::uint32_t>(stamp.us) - set_at_us_};
  }
  [[nodiscard]] float zero_m() const { return zero_m_; }
  void agreed(base::Micros stamp) { agreed_ = stamp; }
  [[nodiscard]] base::Micros refused_for(base::Micros stamp) const { return stamp - agreed_; }
  /// Stamp of the last height; 0: none.
  [[nodiscard]] base::Micros last() const { return last_; }

  static constexpr auto members(auto& self) {
    return base::members(self.zero_m_, self.p_, self.altitude_m_, self.set_at_us_, self.last_, self.agreed_);
  }

 private:
  static constexpr base::Micros kGap{1'000'000};  ///< a longer silence does not count as refused
  float zero_m_ = 0, p_ = 0;
  float altitude_m_ = 0;         ///< altitude at which the zero was found
  std::uint32_t set_at_us_ = 0;  ///< stamp at which it was set, modulo 2^32, odd; 0: never
  base::Micros last_, agreed_;
};

}  // namespace tetap::estimators
