// SPDX-License-Identifier: Apache-2.0
// Quantiles of the chi-square distribution beside the 99 % of filter/update.hpp.
#pragma once

namespace tetap::checks {

inline constexpr float kChiSquare999Of2 = 13.816F;  ///< chi-square, 2 degrees of freedom, 99.9 %

}  // namespace tetap::checks
