// SPDX-License-Identifier: Apache-2.0
// Weight of fixes whose errors last: time-correlated measurement noise (Bryson & Henrikson 1968).
#pragma once

#include "tetap/base/exp_log.hpp"

namespace tetap::checks {

/// Extra variance of correlated fixes. A filter without smoothing gives the first of many such fixes the weight of two.
/// The best weights share it with the last. The filter's variance is up to a fifth above the sum of their information.
inline constexpr float kColouredNoiseInflation = 1.22F;

/// Factor of the receiver's accuracy at the start (with a given pose: of its height). Later fixes hardly correct the
/// start, so an accuracy figure that is too small stays for minutes. Assumed: the figure is off by a fifth (1 sigma,
/// limited to half and twice), as the simulated receiver's is; none was measured. Then 99.73 % of all errors are inside
/// 3.68 times the figure, which is to be 3 sigma.
inline constexpr float kStartPositionInflation = 1.23F;

/// Factor of the variance of a fix whose error lasts for `correlation_s`, when the fix before was `since_s` ago. With
/// phi = exp(-t / tau), z_k - phi z_(k-1) has a white error of variance (1 - phi^2) r. The difference sees (1 - phi) of
/// the position: the factor is (1 + phi) / (1 - phi) (measurement differencing). A fix after a long silence counts in
/// full. Many in a row count together as much as one every 2 tau.
[[nodiscard]] constexpr float repeated(float since_s, float correlation_s) {
  if (!(correlation_s > 0.0F) || !(since_s < 10.0F * correlation_s)) return 1.0F;
  const float phi = base::exp(-(since_s > 1e-3F ? since_s : 1e-3F) / correlation_s);
  return (1.0F + phi) / (1.0F - phi);
}

}  // namespace tetap::checks
