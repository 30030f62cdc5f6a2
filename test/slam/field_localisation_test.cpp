// SPDX-License-Identifier: Apache-2.0
// Localisation on a likelihood field without a node: the field, the search of the whole map, and the particles.
#include "tetap/slam/field_localisation.hpp"
#include "support/field_of_walls.hpp"
#include "support/scan_room.hpp"

#include <gtest/gtest.h>
#include <cmath>
#include <memory>
#include <random>

namespace tetap::test {
namespace {

using filter::ParticlePose;
using slam::LikelihoodField;
using slam::ScanBeams;

struct At {
  double x, y, yaw;
};
ScanBeams seen_in_the_room(const At& at) {
  ScanBeams beams;
  for (int i = 0; i < ScanBeams::kMost; ++i) {
    const double bearing = 6.283185307 * i / ScanBeams::kMost, range = cast(kRoom, at.x, at.y, at.yaw + bearing);
    beams.point[static_cast<std::size_t>(beams.count++)] = {static_cast<float>(range * std::cos(bearing)),
                                                            static_cast<float>(range * std::sin(bearing))};
  }
  return beams;
}
double off_m(const ParticlePose& p, const At& at) {
  return std::hypot(static_cast<double>(p.x_m) - at.x, static_cast<double>(p.y_m) - at.y);
}
double off_rad(const ParticlePose& p, const At& at) {
  return std::abs(std::remainder(static_cast<double>(p.yaw_rad()) - at.yaw, 6.283185307));
}
OwnField room() {
  OwnField own;
  make_field(kRoom, 0.05, -4.4, -3.4, 11, 10, own);
  own.bind();
  return own;
}

TEST(LikelihoodField, KnowsWallsFreeSpaceAndWhatTheMapNeverSaw) {
  OwnField own;
  own.index = {1, LikelihoodField::kEmpty, LikelihoodField::kUnseen, 1};
  own.tiles.assign(LikelihoodField::kTileBytes, 0);
  own.tiles[0] = 0x53, own.tiles[127] = 0xF0;
  own.field = {.cell_m = 0.1F, .step_m = 0.05F, .columns = 2, .rows = 2};
  own.bind();
  const LikelihoodField& f = own.field;
  ASSERT_TRUE(f.valid());
  EXPECT_EQ(f.level(0, 0), 3);
  EXPECT_EQ(f.level(1, 0), 5);
  EXPECT_EQ(f.level(31, 31), 15);
  EXPECT_EQ(f.level(16, 0), f.kFar);
  EXPECT_EQ(f.level(0, 16), f.kUnknown);
  for (const auto& [x, y] : {std::pair{-1, 0}, {0, -1}, {32, 0}, {0, 32}}) EXPECT_EQ(f.level(x, y), f.kUnknown);
  own.index[3] = 2;
  EXPECT_FALSE(f.valid()) << "a tile that is not there";
  own.index[3] = 1, own.field.columns = 3;
  EXPECT_FALSE(f.valid());
}

TEST(FieldSearch, FindsEveryPlaceInTheRoomHoweverItsWorkIsCut) {
  const OwnField own = room();
  std::mt19937 draw(7);
  for (int k = 0; k < 20; ++k) {
    std::uniform_real_distribution<double> u(-1, 1);
    const At at{3.4 * u(draw), 2.4 * u(draw), 3.14 * u(draw)};
    if (std::hypot(at.x - 2.2, at.y + 0.8) < 0.5) continue;  // the pillar
    slam::FieldSearch<48> whole, cut;
    whole.begin(seen_in_the_room(at), own.field), cut.begin(seen_in_the_room(at), own.field);
    ASSERT_TRUE(whole.work(100'000'000, own.field));
    while (!cut.work(97, own.field)) {
    }
    ASSERT_EQ(whole.found().size(), cut.found().size());
    const auto* best = &whole.found()[0];
    for (std::size_t i = 0; i < whole.found().size(); ++i) {
      EXPECT_EQ(whole.found()[i].score, cut.found()[i].score);
      if (whole.found()[i].score > best->score) best = &whole.found()[i];
    }
    EXPECT_LT(off_m(best->pose, at), 0.1) << at.x << " " << at.y;
    EXPECT_LT(off_rad(best->pose, at), 0.05);
  }
}

/// Half a circle in the room, then on where the map saw nothing: the pose is kept, and its variance says how well.
TEST(FieldLocalisation, WhereTheMapSawNothingTheVarianceGrows) {
  const OwnField own = room();
  OwnField nothing = own;
  nothing.index.assign(nothing.index.size(), LikelihoodField::kUnseen);
  nothing.bind();
  const auto robot = std::make_unique<slam::FieldLocalisation<500>>();
  robot->start(ParticlePose::at(-0.5F, -0.5F, 1.5708F), 0.1F, 0.05F);
  At at{-0.5, -0.5, 1.5708};
  const auto drive = [&](const LikelihoodField& map) {
    const slam::Displacement<float> step{0.16F, 0.0F, slam::Heading<float>::from_radians(0.16F)};
    robot->move(step);
    at = {at.x + 0.16 * std::cos(at.yaw), at.y + 0.16 * std::sin(at.yaw), at.yaw + 0.16};
    EXPECT_TRUE(robot->see(seen_in_the_room(at), map));
    while (!robot->work(700, map)) {
    }
  };
  const auto variance = [&] { return robot->estimate().p(0, 0) + robot->estimate().p(1, 1); };
  for (int k = 0; k < 20; ++k) drive(own.field);
  EXPECT_TRUE(robot->valid());
  EXPECT_LT(off_m(robot->estimate().pose, at), 0.06);
  const float known = variance();
  for (int k = 0; k < 20; ++k) drive(nothing.field);
  EXPECT_TRUE(robot->valid()) << "nothing speaks against it";
  EXPECT_GT(variance(), 2.0F * known);
  EXPECT_LT(off_m(robot->estimate().pose, at), 3.0 * std::sqrt(static_cast<double>(variance())));
  for (int k = 0; k < 20; ++k) drive(own.field);
  EXPECT_TRUE(robot->valid());
  EXPECT_LT(off_m(robot->estimate().pose, at), 0.06);
}

}  // namespace
}  // namespace tetap::test
