// SPDX-License-Identifier: Apache-2.0
#include "tetap/base/anchored.hpp"

#include <gtest/gtest.h>
#include <random>

namespace tetap {
namespace {

TEST(Anchored, KeepsMillimetresFiftyKilometresOut) {
  base::Anchored x = base::Anchored::from_um(50'000'000'000);
  for (int i = 0; i < 1000; ++i) x = x.plus(0.001F);
  EXPECT_NEAR(static_cast<double>(x.um()), 50'001'000'000.0, 50.0);
}

TEST(Anchored, OffsetStaysSmallAndSumsAreTheIntegers) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> step(-100.0F, 130.0F);
  base::Anchored x;
  double sum = 0;
  for (int i = 0; i < 20000; ++i) {
    const float d = std::round(step(random) * 1024.0F) / 1024.0F;  // exact in float at every offset
    x = x.plus(d);
    sum += static_cast<double>(d);
    ASSERT_LE(std::abs(x.offset_m), 128.0F);
  }
  EXPECT_GT(sum, 250'000.0);
  EXPECT_NEAR(static_cast<double>(x.um()) * 1e-6, sum, 1e-4) << "re-anchoring loses no bit";
}

TEST(Anchored, DifferencesDoNotDependOnTheAnchor) {
  const base::Anchored a{.anchor_um = 7'000'000'123, .offset_m = 1.5F},
      b{.anchor_um = 6'999'000'000, .offset_m = -2.25F};
  EXPECT_NEAR(a.minus(b), 1.000123F + 3.75F, 1e-6F);
  const base::Anchored a2 = base::Anchored::from_um(a.um()), b2 = base::Anchored::from_um(b.um());
  EXPECT_NEAR(a2.minus(b2), a.minus(b), 1e-6F);
}

TEST(Anchored, AJumpBeyondTheStepIsTakenWhole) {
  EXPECT_NEAR(static_cast<double>(base::Anchored{}.plus(1500.0F).um()), 1.5e9, 100.0);
  EXPECT_NEAR(static_cast<double>(base::Anchored{}.plus(-900.0F).um()), -9e8, 100.0);
}

TEST(Micrometres, SaturateAndRefuseNan) {
  EXPECT_EQ(base::micrometres(1e30F), 2'000'000'000);
  EXPECT_EQ(base::micrometres(-1e30F), -2'000'000'000);
  EXPECT_EQ(base::micrometres(__builtin_nanf("")), 0);
}

}  // namespace
}  // namespace tetap
