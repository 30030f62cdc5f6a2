// SPDX-License-Identifier: Apache-2.0
// Landmarks with known ids find the pose of a robot that has none, or has lost it. Two of them make a candidate, a
// later look makes it valid. Truth is the simulated drive's own; a misread barcode must not place the robot.
#include "estimators/short_sighted_robot.hpp"
#include "tetap/estimators/planar/pose_ekf.hpp"
#include "tetap/estimators/planar/pose_ukf.hpp"

#include <gtest/gtest.h>

namespace tetap::estimators {
namespace {

using test::kRight;
using test::ShortSighted;

template <class E>
class LandmarkAlignmentOf : public testing::Test {};
using Filters = testing::Types<PoseEkf, PoseUkf, PoseUkfSqrt>;
TYPED_TEST_SUITE(LandmarkAlignmentOf, Filters);

TYPED_TEST(LandmarkAlignmentOf, ARobotThatWasNeverPlacedFindsItselfByOneLandmarkAtATime) {
  double square = 0;
  constexpr unsigned kSeeds = 20;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    ShortSighted<TypeParam> drive(seed);
    int looks = 0;
    for (; looks < 60 && !drive.robot.estimate().position_valid; ++looks) {
      EXPECT_GT(drive.robot.estimate().p(0, 0), 1e5F) << "no pose, and none is claimed";
      drive.look(kRight);
    }
    EXPECT_LT(looks, 20) << seed;
    EXPECT_TRUE(drive.robot.estimate().heading_valid);
    EXPECT_LT(drive.worst_sigmas(), 4.0) << seed;
    square += drive.worst_sigmas() * drive.worst_sigmas() / kSeeds;
    for (int k = 0; k < 30; ++k) drive.look(kRight);
    EXPECT_LT(drive.robot.error_m(), 0.3) << seed;
    EXPECT_EQ(drive.robot.estimator.mode(drive.robot.ctx()), sensor::Mode::kNominal);
  }
  EXPECT_GT(square, 0.3) << "its covariance is not too large";
}

TYPED_TEST(LandmarkAlignmentOf, OneLandmarkAloneNeverPlacesIt) {
  ShortSighted<TypeParam> drive(3);
  const model::Landmark at = *drive.robot.map.find(1);
  for (int k = 0; k < 100; ++k) {
    drive.robot.drive(10, false);
    const double dx = static_cast<double>(at.x.minus({})) - drive.robot.x,
                 dy = static_cast<double>(at.y.minus({})) - drive.robot.y;
    const Innovation seen = drive.robot.estimator.fuse(
        sensor::LandmarkSighting{
            .landmark = 1,
            .range_m = static_cast<float>(std::hypot(dx, dy)),
            .bearing_rad = static_cast<float>(std::remainder(std::atan2(dy, dx) - drive.robot.yaw, 2 * M_PI))},
        {drive.robot.us}, drive.robot.ctx());
    EXPECT_EQ(seen.failed, sensor::Check::kUnconfirmed);
    EXPECT_FALSE(drive.robot.estimate().position_valid);
  }
}

// One barcode in four is read as another one. The robot may need longer, but is not valid at a wrong place.
TYPED_TEST(LandmarkAlignmentOf, MisreadLandmarksDelayItAndDoNotMisplaceIt) {
  int placed = 0, wrong = 0;
  constexpr int kSeeds = 40;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    ShortSighted<TypeParam> drive(seed);
    std::mt19937 chance(seed);
    const auto misread = [&chance](std::uint8_t id) {
      return chance() % 4 == 0 ? static_cast<std::uint8_t>(1 + (id + chance() % 6) % 7) : id;
    };
    for (int k = 0; k < 80 && !drive.robot.estimate().position_valid; ++k) drive.look(misread);
    if (!drive.robot.estimate().position_valid) continue;
    ++placed;
    if (drive.robot.error_m() > 0.6 && drive.worst_sigmas() > 4) ++wrong;
  }
  EXPECT_GE(placed, kSeeds - 2);
  EXPECT_LE(wrong, 2);
}

// A robot is carried off while its wheels are silent for ten seconds: it loses the heading, then landmarks place it.
TYPED_TEST(LandmarkAlignmentOf, ARobotThatIsLostComesBack) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    ShortSighted<TypeParam> drive(seed);
    drive.robot.set(0, 0, 0, 0.05F, 0.02F);
    for (int k = 0; k < 20; ++k) drive.look(kRight);
    EXPECT_LT(drive.robot.error_m(), 0.4);
    drive.robot.us += 10'000'000;
    drive.robot.x += 1.5, drive.robot.y -= 1, drive.robot.yaw += 2.5;
    drive.look(kRight);
    EXPECT_FALSE(drive.robot.estimate().position_valid) << seed;
    int looks = 0;
    for (; looks < 60 && !drive.robot.estimate().position_valid; ++looks) drive.look(kRight);
    EXPECT_LT(looks, 40) << seed;
    EXPECT_LT(drive.worst_sigmas(), 4.0) << seed;
    for (int k = 0; k < 30; ++k) drive.look(kRight);
    EXPECT_LT(drive.robot.error_m(), 0.4) << seed;
  }
}

}  // namespace
}  // namespace tetap::estimators
