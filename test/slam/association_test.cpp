// SPDX-License-Identifier: Apache-2.0
#include "tetap/slam/association.hpp"

#include <gtest/gtest.h>
#include <limits>
#include <random>
#include <vector>

namespace tetap {
namespace {

using Association = slam::Association<6, 8>;
using Costs = std::vector<std::vector<std::int32_t>>;

/// The least total over all ways to pair, by trying each.
std::int64_t least_total(const Costs& costs, std::size_t row, std::vector<bool>& taken, std::int32_t gate) {
  if (row == costs.size()) return 0;
  std::int64_t least = gate + least_total(costs, row + 1, taken, gate);
  for (std::size_t c = 0; c < taken.size(); ++c) {
    if (taken[c] || costs[row][c] >= gate) continue;
    taken[c] = true;
    least = std::min(least, costs[row][c] + least_total(costs, row + 1, taken, gate));
    taken[c] = false;
  }
  return least;
}
Association with(const Costs& costs, int columns, std::int32_t gate) {
  Association a;
  a.begin(static_cast<int>(costs.size()), columns, gate);
  for (std::size_t r = 0; r < costs.size(); ++r)
    for (int c = 0; c < columns; ++c) a.set(static_cast<int>(r), c, costs[r][static_cast<std::size_t>(c)]);
  return a;
}

TEST(Association, TotalIsTheLeastOfAllWaysToPair) {
  std::mt19937 random(5);
  for (int run = 0; run < 2000; ++run) {
    const int rows = 1 + static_cast<int>(random() % 5), columns = 1 + static_cast<int>(random() % 6);
    const std::int32_t most = run % 2 == 0 ? 6 : 300;  // few values: many ties
    const auto gate = static_cast<std::int32_t>(1 + random() % 250);
    Costs costs(static_cast<std::size_t>(rows), std::vector<std::int32_t>(static_cast<std::size_t>(columns)));
    for (auto& row : costs)
      for (auto& cost : row) cost = static_cast<std::int32_t>(random() % static_cast<unsigned>(most));
    Association association = with(costs, columns, gate);
    const auto got = association.assign();
    std::vector<bool> taken(static_cast<std::size_t>(columns), false);
    std::int64_t total = 0;
    for (int r = 0; r < rows; ++r) {
      const int c = got[static_cast<std::size_t>(r)];
      if (c == Association::kNone) {
        total += gate;
        continue;
      }
      ASSERT_FALSE(taken[static_cast<std::size_t>(c)]) << "a landmark twice";
      taken[static_cast<std::size_t>(c)] = true;
      ASSERT_LT(costs[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)], gate);
      total += costs[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)];
    }
    std::vector<bool> none(static_cast<std::size_t>(columns), false);
    EXPECT_EQ(total, least_total(costs, 0, none, gate)) << "run " << run;
  }
}

TEST(Association, EqualsScipysExample) {
  // The example of scipy.optimize.linear_sum_assignment: columns 1, 0, 2, total 5.
  Association association = with({{4, 1, 3}, {2, 0, 5}, {3, 2, 2}}, 3, 1000);
  const auto got = association.assign();
  EXPECT_EQ(got[0], 1);
  EXPECT_EQ(got[1], 0);
  EXPECT_EQ(got[2], 2);
}

TEST(Association, OneToOneWhereNearestNeighbourTakesALandmarkTwice) {
  Association association = with({{10, 30}, {12, 200}}, 2, 100);
  const auto nearest = association.nearest();
  EXPECT_EQ(nearest[0], 0);
  EXPECT_EQ(nearest[1], 0);
  const auto assigned = association.assign();
  EXPECT_EQ(assigned[0], 1);
  EXPECT_EQ(assigned[1], 0);
}

TEST(Association, TheGateAndTheFirstOfEquals) {
  Association association = with({{50, 50, 50}, {99, 100, 101}}, 3, 100);
  EXPECT_EQ(association.nearest()[0], 0);
  EXPECT_EQ(association.nearest()[1], 0);
  Association strict = with({{100, 100, 100}}, 3, 100);
  EXPECT_EQ(strict.nearest()[0], Association::kNone);
  EXPECT_EQ(strict.assign()[0], Association::kNone);
}

TEST(Association, CostsThatAreNoNumberAreForbidden) {
  EXPECT_EQ(slam::association_cost(std::numeric_limits<float>::quiet_NaN()), slam::kForbidden);
  EXPECT_EQ(slam::association_cost(std::numeric_limits<float>::infinity()), slam::kForbidden);
  EXPECT_EQ(slam::association_cost(-1.0F), 0);
  EXPECT_EQ(slam::association_cost(9.21F), 147);
}

}  // namespace
}  // namespace tetap
