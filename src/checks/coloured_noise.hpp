// SPDX-License-Identifier: Apache-2.0
// Weights of fixes whose errors last.
#pragma once

#include "base/exp_log.hpp"

namespace tetap::checks {

/// A filter that cannot look back gives the first of many such fixes the weight of two (the best weights share it with
/// the last): its variance is up to a fifth above what the sum of their information promises.
inline constexpr float kColouredNoiseInflation = 1.22F;

/// 1 sigma of the place where it begins (with a pose: of the height), in the accuracy figure of that moment: the fixes
/// that follow hardly correct it, so a figure that is too small stays for minutes. That it is off by a fifth (1 sigma,
/// from half to twice) is assumed, as of the simulated receiver; none was measured. Then 99.73 % of all errors are
/// inside 3.68 times the figure, which is to be 3 sigma.
inline constexpr float kStartPositionInflation = 1.23F;

/// By how much the variance of a fix whose error lasts for `correlation_s` grows when the one before was `since_s` ago:
/// with phi = exp(-t / tau), z_k - phi z_(k-1) has a white error of variance (1 - phi^2) r and sees (1 - phi) of the
/// position: (1 + phi) / (1 - phi) (Bryson & Henrikson 1968, measurement differencing). A fix after a long silence
/// counts in full, and many in a row together as much as one every 2 tau.
[[nodiscard]] constexpr float repeated(float since_s, float correlation_s) {
  if (!(correlation_s > 0.0F) || !(since_s < 10.0F * correlation_s)) return 1.0F;
  const float phi = base::exp(-(since_s > 1e-3F ? since_s : 1e-3F) / correlation_s);
  return (1.0F + phi) / (1.0F - phi);
}

}  // namespace tetap::checks
