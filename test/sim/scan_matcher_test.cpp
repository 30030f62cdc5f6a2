// SPDX-License-Identifier: Apache-2.0
// The simulated front end of a pose graph: keyframes where they are due, displacements of the stated noise, and a loop
// that is closed where the vehicle is back.
#include "sim_host/world/scan_matcher.hpp"

#include "test/sim/support.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace tetap::sim {
namespace {

/// Anticlockwise on a circle of 5 m, every 0.105 m: each fifth is a keyframe.
Truth on_circle(int step) {
  const double angle = 0.021 * step;
  return {.x_m = 5 * std::cos(angle), .y_m = 5 * std::sin(angle), .yaw_rad = wrap(angle + kPi / 2)};
}

TEST(ScanMatcher, makes_a_keyframe_each_half_metre_and_closes_the_second_lap_alone) {
  const ScanMatcherNumbers numbers;
  ScanMatcher matcher(numbers, 1);
  int odometry = 0, loops = 0;
  constexpr int kLap = 299;  // 10 pi m
  for (int step = 0; step <= 2 * kLap; ++step)
    for (const sensor::LoopClosure& z : matcher.sample(on_circle(step))) {
      if (z.to == z.from + 1) {
        EXPECT_EQ(z.from, odometry++);
        continue;
      }
      ++loops;
      EXPECT_GE(z.to - z.from, numbers.apart);
      EXPECT_GE(step, kLap - 25) << "within reach of the start";
      EXPECT_LT(std::hypot(z.x, z.y) * 1e-4, numbers.reach_m + 0.1);
    }
  EXPECT_NEAR(odometry, 2 * kLap / 5, 3);
  EXPECT_NEAR(loops, kLap / 5 + 4, 4);
}

TEST(ScanMatcher, errs_by_its_sigma_in_the_axes_of_the_first_keyframe) {
  const ScanMatcherNumbers numbers;
  ScanMatcher matcher(numbers, 2);
  std::vector<double> x, y, yaw;
  std::vector<Truth> keyframes{on_circle(0)};
  for (int step = 0; step < 20'000; ++step) {
    const Truth here = on_circle(step);
    for (const sensor::LoopClosure& z : matcher.sample(here)) {
      if (z.to == z.from + 1) keyframes.push_back(here);
      const Truth &a = keyframes[z.from], &b = keyframes[z.to];
      const double dx = b.x_m - a.x_m, dy = b.y_m - a.y_m, c = std::cos(a.yaw_rad), s = std::sin(a.yaw_rad);
      x.push_back((z.x * 1e-4 - (c * dx + s * dy)) / numbers.sigma_m);
      y.push_back((z.y * 1e-4 - (c * dy - s * dx)) / numbers.sigma_m);
      yaw.push_back(wrap(z.yaw * 1e-4 - (b.yaw_rad - a.yaw_rad)) / numbers.sigma_rad);
      EXPECT_EQ(sensor::LoopClosure::unpack(z.sigmas, 0), 200);
      EXPECT_EQ(sensor::LoopClosure::unpack(z.sigmas, 2), 500);
    }
  }
  ASSERT_GT(x.size(), 5'000U);
  for (const auto* one : {&x, &y, &yaw}) {
    double mean = 0, square = 0;
    for (const double e : *one)
      mean += e / static_cast<double>(one->size()), square += e * e / static_cast<double>(one->size());
    EXPECT_NEAR(mean, 0, 0.06);
    EXPECT_NEAR(square, 1, 0.08);
  }
}

TEST(ScanMatcher, the_other_way_round_is_no_loop) {
  ScanMatcher matcher({}, 1);
  int loops = 0;
  for (int step = 0; step < 300; ++step) {
    const int back = step < 150 ? step : 300 - step;
    const Truth here{.x_m = 0.1 * back, .yaw_rad = step < 150 ? 0 : -kPi};
    for (const sensor::LoopClosure& z : matcher.sample(here)) loops += z.to == z.from + 1 ? 0 : 1;
  }
  EXPECT_EQ(loops, 0);
}

}  // namespace
}  // namespace tetap::sim
