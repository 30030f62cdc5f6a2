// SPDX-License-Identifier: Apache-2.0
#include "drivers/imu/mounting.hpp"

#include <gtest/gtest.h>

namespace tetap::drivers {
namespace {

TEST(Mounting, ExactlyTwentyFourOfAllAxisChoicesAreRotations) {
  int rotations = 0;
  for (int f = 0; f < 6; ++f) {
    for (int l = 0; l < 6; ++l) {
      for (int u = 0; u < 6; ++u) {
        rotations += Mounting::of(static_cast<Axis>(f), static_cast<Axis>(l), static_cast<Axis>(u)).valid() ? 1 : 0;
      }
    }
  }
  EXPECT_EQ(rotations, 24);
}

TEST(Mounting, TheSensorsAxisThatPointsForwardBecomesX) {
  constexpr Mounting kOnItsSide = Mounting::of(Axis::kMinusZ, Axis::kPlusX, Axis::kMinusY);
  static_assert(kOnItsSide.valid());
  const Vector3 forward = kOnItsSide.to_body({0, 0, -1});
  const Vector3 left = kOnItsSide.to_body({1, 0, 0});
  const Vector3 up = kOnItsSide.to_body({0, -1, 0});
  EXPECT_FLOAT_EQ(forward[0], 1);
  EXPECT_FLOAT_EQ(left[1], 1);
  EXPECT_FLOAT_EQ(up[2], 1);
}

TEST(Mounting, AnyRotationIsTakenAndAStretchIsNot) {
  Mounting tilted{};
  tilted.R_bs = {Vector3{0.6F, 0, 0.8F}, Vector3{0, 1, 0}, Vector3{-0.8F, 0, 0.6F}};
  EXPECT_TRUE(tilted.valid());
  EXPECT_FLOAT_EQ(tilted.to_body({1, 0, 0})[2], -0.8F);
  tilted.R_bs[1][1] = 1.01F;
  EXPECT_FALSE(tilted.valid());
}

}  // namespace
}  // namespace tetap::drivers
