// SPDX-License-Identifier: Apache-2.0
// What the inertial estimator takes of a robot's memory. The samples of the window, and what carries them to the
// present in cells, are the delay ring; the rest is the filter with all its rules.
#include "estimators/inertial/inertial.hpp"

#include <gtest/gtest.h>
#include <cstdio>

namespace tetap::estimators {
namespace {

TEST(InertialSize, TheFilterWithoutTheDelayRingTakesNoMoreThanItsBudget) {
  std::printf(
      "filter %zu bytes, carried ahead %zu, a sample of the window %zu; of the filter: state and covariance %zu, "
      "start %zu\n",
      sizeof(Inertial) - sizeof(OutputPredictor), sizeof(OutputPredictor), sizeof(sensor::Sample), sizeof(nav::Ins),
      sizeof(Alignment));
  EXPECT_LE(sizeof(Inertial) - sizeof(OutputPredictor), 2'800U);
}

}  // namespace
}  // namespace tetap::estimators
