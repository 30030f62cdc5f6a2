// SPDX-License-Identifier: Apache-2.0
// Noise of the ICM-42688-P's samples in counts, behind its filters, and how long one value may repeat by chance.
// DS-000347 rev. 1.8: tables 1 and 2 (densities), 5.3 (anti-alias filter), 5.5 and 14.40 (interface filter).
#pragma once

#include "drivers/imu/icm42688/packet.hpp"
#include "drivers/imu/icm42688/settings.hpp"
#include "tetap/base/math.hpp"

#include <cstdint>

namespace tetap::drivers::icm42688 {

/// Samples per second.
[[nodiscard]] constexpr float rate_Hz(const Settings& s) { return 1e9F / static_cast<float>(s.period_ns()); }

/// The narrowest of both filters and half the rate, Hz.
[[nodiscard]] constexpr float bandwidth_Hz(const Settings& s) {
  constexpr float kDivisor[8] = {2, 4, 5, 8, 10, 16, 20, 40};
  const float rate = rate_Hz(s);
  float bandwidth = 0.5F * rate;
  if (rate < 2000.0F && s.bandwidth != Bandwidth::kBy2) {
    // 14.40: a part of 400 Hz or of the rate, whichever is more.
    const float interface = base::max(400.0F, rate) / kDivisor[static_cast<std::size_t>(s.bandwidth)];
    bandwidth = base::min(bandwidth, interface);
  }
  // 5.3: 42 Hz a step at the narrow end, more at the wide one.
  if (s.anti_alias.delt != 0) bandwidth = base::min(bandwidth, 42.0F * static_cast<float>(s.anti_alias.delt));
  return bandwidth;
}

/// 1 sigma of one axis, in counts of the packet. A second order lets 1.11 of its bandwidth pass.
struct Noise {
  float gyro;
  float accel;
};
[[nodiscard]] constexpr Noise noise_counts(const Settings& s) {
  constexpr float kGyro_dps_rtHz = 0.0028F, kAccel_g_rtHz = 70e-6F;
  const Scales scale = scales(s);
  const float root = base::sqrt(1.11F * bandwidth_Hz(s));
  return {kGyro_dps_rtHz * kRadiansPerDegree * root / scale.rate_radps,
          kAccel_g_rtHz * kStandardGravity_mps2 * root / scale.force_mps2};
}

/// Number of equal samples of one axis in a row that no healthy sensor at rest shows more than once in 10^12 tries. It
/// is as many as its noise, in the middle of a count, needs to leave it. Independent are two values per period of the
/// bandwidth. `floor`: at least so many; 0: never. 0 too where the number cannot be counted.
[[nodiscard]] constexpr std::uint16_t stuck_samples(std::uint16_t floor, float sigma_counts, const Settings& s) {
  constexpr float kLogOfTries = 27.6F;        // ln 10^12
  constexpr float kQuieter = 0.8F;            // ours: a sensor quieter than the typical one
  constexpr float kCounts[2] = {1.0F, 2.0F};  // 6.1: packet 4 leaves the last bit of a rate 0, here taken for both
  if (floor == 0) return 0;
  const float half = 0.5F * kCounts[s.resolution == Resolution::k20bit ? 1 : 0] / (kQuieter * sigma_counts);
  // Both tails beyond `half`: Abramowitz and Stegun, eq. 7.1.26, at half / sqrt(2); within 1.5e-7.
  const float x = half * 0.70710678F, t = 1.0F / (1.0F + 0.3275911F * x);
  const float series =
      t * (0.254829592F + t * (-0.284496736F + t * (1.421413741F + t * (-1.453152027F + t * 1.061405429F))));
  const float leaves = series * base::exp(-x * x);
  const float rate = rate_Hz(s);
  const float independent = base::min(rate, 2.0F * bandwidth_Hz(s));
  const float samples = leaves < 1e-6F ? 1e9F : kLogOfTries / -base::log(1.0F - leaves) * rate / independent;
  if (samples > 65'534.0F) return 0;
  const auto needed = static_cast<std::uint16_t>(samples + 1.0F);
  return needed > floor ? needed : floor;
}

}  // namespace tetap::drivers::icm42688
