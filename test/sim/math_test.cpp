// SPDX-License-Identifier: Apache-2.0
// Angles of the world; the functions themselves are judged by the tests of src/tetap/base.
#include "sim_host/world/math.hpp"

#include "sim_host/world/chance.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tetap::sim {
namespace {

constexpr double kUlp = 0x1p-52;

TEST(Math, a_direction_is_a_unit_vector_whose_angle_is_the_angle) {
  Chance chance{1, Stream::kStart};
  for (int i = 0; i < 100'000; ++i) {
    const double x = chance.uniform(-100, 100);
    const Direction d = direction(x);
    ASSERT_NEAR(d.sin * d.sin + d.cos * d.cos, 1, 4 * kUlp) << x;
    ASSERT_NEAR(wrap(sim::atan2(d.sin, d.cos) - x), 0, 1e-13) << x;
  }
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
