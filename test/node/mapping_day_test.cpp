// SPDX-License-Identifier: Apache-2.0
// A full map for as long as a robot may run: $TETAP_MAP_HOURS of simulated time (default three minutes, 24 hours in the
// proof). No field that the node sends is ever empty, the filter never restarts, and the map stays where it is.
#include "mapping_bench.hpp"

#include <gtest/gtest.h>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>

namespace tetap::test {
namespace {

double hours() {
  const char* const given = std::getenv("TETAP_MAP_HOURS");
  return given != nullptr ? std::stod(given) : 0.05;
}

template <class Estimators>
void check_fields(const Frames& out) {
  const auto position = last<bus::EstPos>(out, 1);
  ASSERT_TRUE(position);
  ASSERT_NE(position->x_raw, bus::EstPos::kXNotAvailable);
  ASSERT_NE(position->y_raw, bus::EstPos::kYNotAvailable);
  const auto motion = last<bus::EstMotion>(out, 1);
  ASSERT_TRUE(motion && base::is_finite(motion->yaw_rad) && base::is_finite(motion->yaw_rate_radps) &&
              motion->pos_valid);
  if (const auto deviation = last<bus::EstStdPose>(out, 1)) {
    ASSERT_TRUE(deviation->std_x_m >= 0 && deviation->std_y_m >= 0 && deviation->std_yaw_rad >= 0);
    ASSERT_TRUE(base::is_finite(deviation->corr_xy));
  }
  if (const auto status = last<bus::EstStatus>(out)) {
    ASSERT_LE(status->reset_ctr, 1);
    ASSERT_TRUE(status->reset_cause == sensor::ResetCause::kPowerOn ||
                status->reset_cause == sensor::ResetCause::kSetPose);
  }
  for (const auto& one : all<bus::EstLandmark>(out)) {
    ASSERT_NE(one.x_raw, bus::EstLandmark::kXNotAvailable);
    ASSERT_NE(one.y_raw, bus::EstLandmark::kYNotAvailable);
  }
  for (const auto& one : all<bus::EstLandmarkStd>(out))
    ASSERT_TRUE(one.std_x_m >= 0 && one.std_y_m >= 0 && base::is_finite(one.corr_xy));
}

template <class Estimators>
class AFullMap : public testing::Test {};
using Mappers = testing::Types<Ekf, Fast>;
TYPED_TEST_SUITE(AFullMap, Mappers);

TYPED_TEST(AFullMap, HoldsForADay) {
  constexpr int kPlaces = std::is_same_v<TypeParam, Ekf> ? 30 : 15;
  Mapping<TypeParam> run(kPlaces + 3);
  // The particles cost three times the filter: an eighth of the day.
  const auto epochs = static_cast<std::int64_t>(hours() * 360'000 / (std::is_same_v<TypeParam, Ekf> ? 1 : 8));
  const std::int64_t filled = 8000;
  for (std::int64_t i = 0; i < epochs + filled; ++i) {
    run.drive(1);
    check_fields<TypeParam>(run.out);
    if (testing::Test::HasFatalFailure()) FAIL() << "in epoch " << i;
    if (i >= filled && run.page.map_size != kPlaces) FAIL() << "in epoch " << i;
  }
  EXPECT_EQ(run.map.size(), static_cast<std::size_t>(kPlaces));
  EXPECT_LT(run.worst_landmark_m(), 0.4);
  const double t = 1e-6 * static_cast<double>(run.bench->now_us - run.bench->kStart_us);
  EXPECT_LT(std::hypot(run.robot().x - 3 * std::cos(t * run.kRate), run.robot().y - 3 * std::sin(t * run.kRate)), 0.4);
}

}  // namespace
}  // namespace tetap::test
