// SPDX-License-Identifier: Apache-2.0
// What a barometer shows is a height above an unknown zero, which drifts. Whichever of the two, the zero or the robot's
// height, is known worse is found from the other, and never becomes better known than that: their errors are shared
// from then on, and no cross covariance is kept that would say how.
#pragma once

#include "base/math.hpp"
#include "base/time.hpp"
#include "param/parameters.hpp"

#include <cstdint>

namespace tetap::estimators {

/// Height in the standard atmosphere (U.S. Standard Atmosphere 1976, eq. 33a; ICAO Doc 7488, up to 11 km).
[[nodiscard]] inline float pressure_altitude_m(float pressure_Pa) {
  return 44330.77F * (1.0F - base::exp(0.1902632F * base::log(pressure_Pa * (1.0F / 101325.0F))));
}

/// The variance a measurement must be given so that the estimate (variance p) ends at `floor`, when the measurement
/// were repeated without end; p > floor.
[[nodiscard]] inline float variance_towards(float floor, float p) { return floor * p / (p - floor); }

class BarometerZero {
 public:
  /// Of the zero to a sample's time.
  void predict(base::Micros stamp, const param::BaroParameters& n) {
    const base::Micros since = stamp - last_;
    if (since.us > 0) p_ += n.drift_m_rts * n.drift_m_rts * base::seconds(since);
    if (since > kGap) agreed_ = stamp;
    last_ = stamp;
  }
  /// Of a height above the zero, at this one: air that is not the standard's is off by a share of what was climbed
  /// since the zero was found.
  [[nodiscard]] float variance(float altitude_m, const param::BaroParameters& n) const {
    const float air_m = n.scale_share * (altitude_m - altitude_m_);
    return p_ + air_m * air_m;
  }
  void set(float altitude_m, float zero_m, float variance, base::Micros stamp) {
    altitude_m_ = altitude_m;
    zero_m_ = zero_m;
    p_ = variance;
    last_ = agreed_ = stamp;
    known_ = true;
  }
  /// From its variance p by a height of variance p_z < p that says the zero should be `nu` higher.
  void correct(float nu, float p, float p_z, float white, float altitude_m) {
    const float k = p / (p + variance_towards(p_z, p) + white);
    zero_m_ += k * nu;
    p_ = p - k * p;
    altitude_m_ = altitude_m;
  }
  [[nodiscard]] bool known() const { return known_; }
  [[nodiscard]] float zero_m() const { return zero_m_; }
  void agreed(base::Micros stamp) { agreed_ = stamp; }
  [[nodiscard]] base::Micros refused_for(base::Micros stamp) const { return stamp - agreed_; }

  template <class Sink>
  void hash_state(Sink&& sink) const {
    sink(zero_m_);
    sink(p_);
    sink(altitude_m_);
    sink(last_.us);
    sink(agreed_.us);
    sink(static_cast<std::uint32_t>(known_));
  }

 private:
  static constexpr base::Micros kGap{1'000'000};  ///< of silence does not count as refused
  float zero_m_ = 0, p_ = 0;
  float altitude_m_ = 0;  ///< where the zero was found
  bool known_ = false;
  base::Micros last_, agreed_;
};

}  // namespace tetap::estimators
