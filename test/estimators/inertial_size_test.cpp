// SPDX-License-Identifier: Apache-2.0
// Memory that the inertial estimator takes of a robot. The delay ring holds the samples of the window and the cells
// that carry them to the present. The rest is the filter with all its rules.
#include "tetap/estimators/inertial/inertial.hpp"

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
  EXPECT_LE(sizeof(Inertial) - sizeof(OutputPredictor), 2'824U);
  EXPECT_LE(sizeof(WatchedInertial) - sizeof(Inertial), 1'552U) << "14 hypotheses and a covariance";
}

}  // namespace
}  // namespace tetap::estimators
