// SPDX-License-Identifier: Apache-2.0
// Random draws of the world. Every effect has its own stream, so switching one on or off leaves all the others' draws
// as they were.
#pragma once

#include "sim_host/world/math.hpp"
#include "tetap/base/random.hpp"
#include "tetap/base/time.hpp"

#include <cstdint>

namespace tetap::sim {

/// One stream number per effect; the order is part of what a seed means, so new ones go to the end.
enum class Stream : std::uint32_t {
  kStart,
  kDriver,
  kGround,
  kSlip,
  kImuTurnOn,
  kImuNoise,
  kImuVibration,
  kImuLatency,
  kWheels,
  kWheelLatency,
  kGnssNoise,
  kGnssOutage,
  kGnssGlitch,
  kGnssAccuracy,
  kGnssLatency,
  kCamera,
  kCameraWrong,
  kCameraLatency,
  kSurvey,
  kFaultOutlier,
  kFaultLoss,
  kMagnetometer,
  kMagnetometerTurnOn,
  kMagnetometerLatency,
  kBarometer,
  kBarometerLatency,
  kJitter,
  kClutter,
  kMovers,
  kScanMatcher,
  kScanMatcherLatency,
  kMapPoints,
  kPeople,
  kLidar,
  kLidarLatency,
  kFeatureNoise,
  kFeatureTrack,
  kFeatureMount,
  kFeatureLatency,
};

class Chance {
 public:
  Chance(std::uint64_t seed, Stream stream) : random_{seed, static_cast<std::uint64_t>(stream)} {}
  /// A stream for one of many things, whose draws depend on none of the others.
  Chance(std::uint64_t seed, Stream stream, std::uint32_t thing)
      : random_{seed, static_cast<std::uint64_t>(stream) | std::uint64_t{thing} << 32} {}

  /// In (0, 1), with 52 bits.
  [[nodiscard]] double uniform() {
    const std::uint64_t high = random_.next() >> 6;
    const std::uint64_t low = random_.next() >> 6;
    return (static_cast<double>(high << 26 | low) + 0.5) * 0x1p-52;
  }
  [[nodiscard]] double uniform(double low, double high) { return low + (high - low) * uniform(); }
  [[nodiscard]] double normal() { return static_cast<double>(random_.normal()); }
  [[nodiscard]] double normal(double sigma) { return sigma * normal(); }
  [[nodiscard]] bool happens(double probability) { return uniform() < probability; }
  [[nodiscard]] base::Micros between(base::Micros low, base::Micros high) {
    return low + base::Micros{static_cast<std::int64_t>(uniform() * static_cast<double>(high.us - low.us + 1))};
  }

 private:
  base::Random random_;
};

/// First-order Gauss-Markov process: stationary with standard deviation `sigma`, autocorrelation exp(-|t|/tau)
/// (Gelb, Applied Optimal Estimation, 1974, sec. 2.4). Exact for any step.
class GaussMarkov {
 public:
  GaussMarkov(double sigma, double tau_s, double step_s, Chance& chance)
      : keep_{sim::exp(-step_s / tau_s)}, drive_{sigma * sim::sqrt(1 - keep_ * keep_)}, value_{chance.normal(sigma)} {}
  double next(Chance& chance) { return value_ = keep_ * value_ + chance.normal(drive_); }
  [[nodiscard]] double value() const { return value_; }

 private:
  double keep_;
  double drive_;
  double value_;
};

}  // namespace tetap::sim
