// SPDX-License-Identifier: Apache-2.0
// The world's functions against the C library's, which is good to less than one unit in the last place.
#include "sim_host/world/math.hpp"

#include "sim_host/world/chance.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tetap::sim {
namespace {

constexpr double kUlp = 0x1p-52;

TEST(Math, sine_and_cosine_are_good_to_a_few_units_in_the_last_place_over_many_turns) {
  Chance chance{1, Stream::kStart};
  for (const double size : {1e-6, 0.5, 3.0, 100.0, 1e5}) {
    for (int i = 0; i < 20'000; ++i) {
      const double x = chance.uniform(-size, size);
      const Direction d = direction(x);
      ASSERT_NEAR(d.sin, std::sin(x), 2 * kUlp) << x;
      ASSERT_NEAR(d.cos, std::cos(x), 2 * kUlp) << x;
      ASSERT_NEAR(d.sin * d.sin + d.cos * d.cos, 1, 3 * kUlp) << x;
    }
  }
}

TEST(Math, atan2_is_good_all_around_and_on_the_axes) {
  Chance chance{2, Stream::kStart};
  for (int i = 0; i < 100'000; ++i) {
    const double x = chance.uniform(-3, 3);
    const double y = chance.uniform(-3, 3);
    ASSERT_NEAR(sim::atan2(y, x), std::atan2(y, x), 3 * kUlp) << y << " " << x;
  }
  EXPECT_EQ(sim::atan2(0, 0), 0);
  EXPECT_EQ(sim::atan2(0, 2), 0);
  EXPECT_EQ(sim::atan2(2, 0), kPi / 2);
  EXPECT_EQ(sim::atan2(-2, 0), -kPi / 2);
  EXPECT_EQ(sim::atan2(0, -2), kPi);
}

TEST(Math, exp_and_log_are_good_and_each_others_inverse) {
  Chance chance{3, Stream::kStart};
  for (int i = 0; i < 100'000; ++i) {
    const double x = chance.uniform(-40, 40);
    ASSERT_NEAR(sim::exp(x) / std::exp(x), 1, 2 * kUlp) << x;
    const double y = chance.uniform();
    ASSERT_NEAR(sim::log(y), std::log(y), 4 * kUlp * std::fmax(1, -std::log(y))) << y;
    ASSERT_NEAR(sim::log(sim::exp(x)), x, 1e-14);
  }
  EXPECT_EQ(sim::exp(0), 1);
  EXPECT_EQ(sim::log(1), 0);
}

TEST(Math, wrap_stays_within_half_a_turn_and_changes_by_whole_turns) {
  Chance chance{4, Stream::kStart};
  for (int i = 0; i < 100'000; ++i) {
    const double x = chance.uniform(-100, 100);
    const double w = wrap(x);
    ASSERT_GE(w, -kPi - 1e-13);
    ASSERT_LT(w, kPi + 1e-13);
    ASSERT_NEAR(std::remainder(x - w, 2 * kPi), 0, 1e-12);
  }
}

}  // namespace
}  // namespace tetap::sim
