// SPDX-License-Identifier: Apache-2.0
// Random draws of the world. Every effect has its own stream, so switching one on or off leaves all the others' draws
// as they were.
#pragma once

#include "base/time.hpp"
#include "sim_host/world/math.hpp"

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
};

/// Counter-based: draw n of a stream is a function of (seed, stream, n). SplitMix64 with its output mix (Steele, Lea,
/// Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014); normal draws after Box and Muller, 1958.
class Chance {
 public:
  Chance(std::uint64_t seed, Stream stream)
      : key_{seed * 0x9E3779B97F4A7C15U + static_cast<std::uint32_t>(stream) + 1} {}

  /// In (0, 1).
  [[nodiscard]] double uniform() {
    std::uint64_t z = key_ * 0xD1342543DE82EF95U + (++counter_) * 0x9E3779B97F4A7C15U;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9U;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBU;
    z ^= z >> 31;
    return (static_cast<double>(z >> 12) + 0.5) * 0x1p-52;
  }
  [[nodiscard]] double uniform(double low, double high) { return low + (high - low) * uniform(); }
  [[nodiscard]] double normal() {
    const double radius = sim::sqrt(-2 * sim::log(uniform()));
    return radius * sim::cos(2 * kPi * uniform());
  }
  [[nodiscard]] double normal(double sigma) { return sigma * normal(); }
  [[nodiscard]] bool happens(double probability) { return uniform() < probability; }
  [[nodiscard]] base::Micros between(base::Micros low, base::Micros high) {
    return low + base::Micros{static_cast<std::int64_t>(uniform() * static_cast<double>(high.us - low.us + 1))};
  }

 private:
  std::uint64_t key_;
  std::uint64_t counter_ = 0;
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
