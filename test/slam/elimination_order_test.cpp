// SPDX-License-Identifier: Apache-2.0
#include "tetap/slam/elimination_order.hpp"

#include <gtest/gtest.h>
#include <algorithm>
#include <random>
#include <set>
#include <vector>

namespace tetap {
namespace {

constexpr int kNodes = 40;
using Order = slam::EliminationOrder<kNodes, 800>;
using Neighbours = std::vector<std::set<int>>;

struct Found {
  Neighbours graph{kNodes};
  Order order;
};

Found found(int nodes, const std::vector<std::pair<int, int>>& edges) {
  Found f;
  slam::Adjacency<kNodes> adjacency{};
  f.order.begin(nodes, adjacency);
  for (const auto& [a, b] : edges) {
    adjacency.connect(a, b);
    f.graph[static_cast<std::size_t>(a)].insert(b);
    f.graph[static_cast<std::size_t>(b)].insert(a);
  }
  f.order.sort(adjacency);
  while (f.order.fits() && !f.order.all_eliminated()) static_cast<void>(f.order.pivot(adjacency));
  if (f.order.fits()) static_cast<void>(f.order.finish());
  return f;
}

/// Eliminates by sets, in the order that was found: what fills in must be what the order says.
void expect_pattern_of_elimination(Found f, int nodes) {
  std::vector<int> at_position(static_cast<std::size_t>(nodes), -1);
  for (int p = 0; p < nodes; ++p) at_position[static_cast<std::size_t>(p)] = f.order.node(p);
  std::vector<int> sorted = at_position;
  std::sort(sorted.begin(), sorted.end());
  for (int i = 0; i < nodes; ++i) ASSERT_EQ(sorted[static_cast<std::size_t>(i)], i) << "each node once";
  EXPECT_EQ(f.order.node(nodes - 1), nodes - 1) << "the last node waits for the end";
  for (int p = 0; p < nodes; ++p) {
    const int node = f.order.node(p);
    ASSERT_EQ(f.order.position(node), p);
    const std::set<int> row = f.graph[static_cast<std::size_t>(node)];
    std::set<int> positions;
    for (const int n : row) positions.insert(f.order.position(n));
    std::set<int> got;
    for (int k = 0; k < f.order.count(p); ++k) got.insert(f.order.entry(p, k));
    EXPECT_EQ(got, positions) << "row " << p;
    for (int k = 1; k < f.order.count(p); ++k) EXPECT_LT(f.order.entry(p, k - 1), f.order.entry(p, k));
    for (const int a : row) {
      f.graph[static_cast<std::size_t>(a)].erase(node);
      for (const int b : row)
        if (a != b) f.graph[static_cast<std::size_t>(a)].insert(b);
    }
  }
}

TEST(EliminationOrder, PatternIsThatOfEliminationBySets) {
  std::mt19937 random(1);
  for (int run = 0; run < 200; ++run) {
    const int nodes = 2 + static_cast<int>(random() % (kNodes - 1U));
    std::vector<std::pair<int, int>> edges;
    for (int i = 1; i < nodes; ++i) edges.emplace_back(i - 1, i);
    for (auto k = static_cast<unsigned>(random() % 20); k > 0; --k) {
      const int a = static_cast<int>(random() % static_cast<unsigned>(nodes)),
                b = static_cast<int>(random() % static_cast<unsigned>(nodes));
      if (a != b) edges.emplace_back(a, b);
    }
    expect_pattern_of_elimination(found(nodes, edges), nodes);
  }
}

TEST(EliminationOrder, AChainAndAStarFillNothingIn) {
  std::vector<std::pair<int, int>> chain, star;
  for (int i = 1; i < kNodes; ++i) chain.emplace_back(i - 1, i), star.emplace_back(0, i);
  for (const auto& edges : {chain, star}) {
    const Found f = found(kNodes, edges);
    EXPECT_EQ(f.order.entries(), edges.size());
    expect_pattern_of_elimination(f, kNodes);
  }
}

TEST(EliminationOrder, MoreEntriesThanThereIsRoomAreRefused) {
  std::vector<std::pair<int, int>> all;
  for (int a = 0; a < kNodes; ++a)
    for (int b = 0; b < a; ++b) all.emplace_back(a, b);
  const Found full = found(kNodes, all);  // 780 entries of 800
  EXPECT_TRUE(full.order.fits());
  EXPECT_EQ(full.order.entries(), 780U);
  slam::EliminationOrder<kNodes, 779> small;
  slam::Adjacency<kNodes> adjacency{};
  small.begin(kNodes, adjacency);
  for (const auto& [a, b] : all) adjacency.connect(a, b);
  small.sort(adjacency);
  for (int k = 0; k < kNodes && small.fits(); ++k) static_cast<void>(small.pivot(adjacency));
  EXPECT_FALSE(small.fits());
}

}  // namespace
}  // namespace tetap
