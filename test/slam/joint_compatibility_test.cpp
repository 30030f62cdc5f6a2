// SPDX-License-Identifier: Apache-2.0
#include "tetap/slam/joint_compatibility.hpp"

#include <gtest/gtest.h>
#include <random>
#include <vector>

namespace tetap::slam {
namespace {

/// Sightings of points on a line whose errors share an offset: variance `common` between all, `own` for each.
struct Line {
  std::vector<float> seen, places;
  float common = 1, own = 0.01F;

  [[nodiscard]] float nu(int row, int column) const {
    return seen[static_cast<std::size_t>(row)] - places[static_cast<std::size_t>(column)];
  }
  [[nodiscard]] bool allowed(int row, int column) const {
    return nu(row, column) * nu(row, column) < 9.21F * (common + own);
  }
  struct Innovation {
    std::array<float, 2> nu{};
  };
  [[nodiscard]] Innovation line(int row, int column) const { return {{nu(row, column), 0.0F}}; }
  [[nodiscard]] Covariance2 innovation(int /*row*/, int /*column*/) const { return {common + own, 0, 1}; }
  [[nodiscard]] Block2 cross(int, int, int, int) const { return {{{common, 0}, {0, 0}}}; }
};

TEST(JointCompatibility, PairsByWhatTheSightingsShare) {
  // All are 0.9 off. One by one, the second place is the nearest of the first sighting, and so on.
  const Line model{.seen = {0.9F, 1.9F, 2.9F}, .places = {0, 1, 2, 3.3F}};
  static JointCompatibility<4, 5> joint;
  const auto result = joint.search(model, 3, 4);
  EXPECT_FALSE(result.exhausted);
  EXPECT_EQ(result.pairs, 3);
  EXPECT_EQ(result.landmark[0], 0);
  EXPECT_EQ(result.landmark[1], 1);
  EXPECT_EQ(result.landmark[2], 2);
  EXPECT_NEAR(result.nis, 0.9 * 0.9 / (1 + 0.01 / 3), 1e-3);
}

TEST(JointCompatibility, LeavesOutWhatFitsNothingBesideTheOthers) {
  const Line model{.seen = {0.5F, 1.5F, 1.75F}, .places = {0, 1, 2}};
  static JointCompatibility<4, 5> joint;
  const auto result = joint.search(model, 3, 3);
  EXPECT_EQ(result.pairs, 2);
  EXPECT_EQ(result.landmark[0], 0);
  EXPECT_EQ(result.landmark[1], 1);
  EXPECT_EQ(result.landmark[2], (JointCompatibility<4, 5>::kNone));
}

TEST(JointCompatibility, NisIsThatOfTheWholeCovariance) {
  std::mt19937 random(2);
  std::normal_distribution<float> normal;
  static JointCompatibility<4, 5> joint;
  for (int run = 0; run < 100; ++run) {
    Line model{.seen = {}, .places = {0, 20, 40}};
    const float offset = normal(random);
    for (const float place : model.places) model.seen.push_back(place + offset + 0.1F * normal(random));
    const auto result = joint.search(model, 3, 3);
    if (result.pairs < 3) continue;  // beyond the joint gate of 99 %
    // (common 1 1^T + own I)^-1 = (I - common 1 1^T / (own + n common)) / own
    float sum = 0, squares = 0;
    for (int i = 0; i < 3; ++i) sum += model.nu(i, i), squares += model.nu(i, i) * model.nu(i, i);
    const float expected = (squares - model.common * sum * sum / (model.own + 3 * model.common)) / model.own;
    EXPECT_NEAR(result.nis, expected, 0.01F * (1 + expected));
  }
}

TEST(JointCompatibility, WorkIsBounded) {
  Line model;
  for (int i = 0; i < 12; ++i) model.seen.push_back(0.01F * static_cast<float>(i));
  for (int i = 0; i < 20; ++i) model.places.push_back(0.02F * static_cast<float>(i));
  model.own = 1;
  static JointCompatibility<12, 20, 200> joint;
  const auto result = joint.search(model, 12, 20);
  EXPECT_TRUE(result.exhausted);
  EXPECT_GT(result.pairs, 0);
}

TEST(JointCompatibility, NothingFromNothing) {
  static JointCompatibility<4, 5> joint;
  EXPECT_EQ(joint.search(Line{}, 0, 0).pairs, 0);
  EXPECT_EQ(joint.search(Line{.seen = {1, 2}, .places = {}}, 2, 0).pairs, 0);
}

}  // namespace
}  // namespace tetap::slam
