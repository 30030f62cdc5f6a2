// SPDX-License-Identifier: Apache-2.0
// Laws of localisation by a grid of poses as an estimator. It finds itself and reports when it is lost. Its work may be
// cut anywhere.
#include "tetap/estimators/planar/pose_grid.hpp"
#include "estimators/circling_robot.hpp"
#include "support/never_nan.hpp"
#include "tetap/base/state_words.hpp"
#include "tetap/node/estimator_slot.hpp"

#include <gtest/gtest.h>
#include <Eigen/Dense>
#include <memory>

namespace tetap::estimators {
namespace {

using Grid = PoseGrid<16, 32, 48>;
using test::held_backward;
using test::kStep_us;

static_assert(node::Estimator<Grid> && node::kIsDelayed<Grid> && node::WorksInJobs<Grid>);
static_assert(sizeof(Grid) < 100 * 1024, "the class of 128 kB holds it with the window and the stack");

/// Landmarks about the circle, in a rectangle of 4 m by 7 m.
struct GridRobot : test::CirclingRobot<Grid> {
  explicit GridRobot(std::int32_t units = 100) : CirclingRobot(held_backward()) {
    numbers.loop.work_units = units;
    map.clear();
    for (const MapEntry& entry :
         {MapEntry{2000, 0, 1}, MapEntry{-2000, 1000, 2}, MapEntry{1000, 7000, 3}, MapEntry{-1500, 5000, 4}})
      static_cast<void>(map.put(entry));
  }
  /// Steps of the circle, each of five ticks.
  void go(int steps) {
    for (int k = 0; k < steps; ++k) {
      drive(1, false);
      if (++steps_ % 10 == 0) look();
      for (int tick = 0; tick < 5; ++tick) tick_once();
    }
  }
  void tick_once() { estimator.work(static_cast<std::uint32_t>(numbers.loop.work_units), ctx()); }
  void look() {
    for (std::uint8_t id = 1; id <= 4; ++id) static_cast<void>(estimator.fuse(seen(id), {us}, ctx()));
  }
  [[nodiscard]] sensor::LandmarkSighting seen(std::uint8_t id) {
    const auto normal = [this](double sigma) { return std::normal_distribution<double>(0, sigma)(random); };
    const model::Landmark at = *map.find(id);
    const double dx = static_cast<double>(at.x.minus({})) - x, dy = static_cast<double>(at.y.minus({})) - y;
    const double bearing = std::remainder(std::atan2(dy, dx) - yaw + normal(0.02), 2 * M_PI);
    return {.landmark = id,
            .range_m = static_cast<float>(std::hypot(dx, dy) + normal(0.1)),
            .bearing_rad = static_cast<float>(bearing)};
  }
  /// Until a valid estimate is within half a metre; -1 after so many steps.
  int found_after(int most) {
    for (int k = 0; k < most; ++k) {
      go(1);
      if (estimate().position_valid && error_m() < 0.5) return k;
    }
    return -1;
  }
  [[nodiscard]] std::uint32_t whole_hash() const {
    base::BitCrc crc;
    base::each_word(estimator, crc);
    estimator.hash_memory(crc);
    return crc.value();
  }

 private:
  int steps_ = 0;
};

TEST(PoseGrid, FindsItselfFromNoStartAndIsConsistent) {
  const auto robot = std::make_unique<GridRobot>();
  EXPECT_EQ(robot->estimator.mode(robot->ctx()), sensor::Mode::kWaitingForPose);
  robot->go(9);
  EXPECT_FALSE(robot->estimate().position_valid);
  robot->go(2);
  EXPECT_EQ(robot->estimator.mode(robot->ctx()), sensor::Mode::kAligning);
  EXPECT_GE(robot->found_after(200), 0);
  double nees = 0, square_m2 = 0;
  constexpr int kLooks = 60;
  for (int k = 0; k < kLooks; ++k) {
    robot->go(20);
    const Estimate e = robot->estimate();
    EXPECT_TRUE(e.position_valid && e.heading_valid) << k;
    const Eigen::Vector3d error(robot->x - static_cast<double>(e.pose.x.minus({})),
                                robot->y - static_cast<double>(e.pose.y.minus({})),
                                std::remainder(robot->yaw - static_cast<double>(e.pose.yaw_rad), 2 * M_PI));
    nees += error.dot(e.p.dense().cast<double>().ldlt().solve(error)) / kLooks;
    square_m2 += error.head<2>().squaredNorm() / kLooks;
  }
  EXPECT_EQ(robot->estimator.mode(robot->ctx()), sensor::Mode::kNominal);
  EXPECT_LT(std::sqrt(square_m2), 0.5 * static_cast<double>(robot->estimator.grid().step_m()));
  EXPECT_GT(std::sqrt(square_m2), 0.02);
  EXPECT_LT(nees, 5);  // a cell is never surer than it is wide
  EXPECT_GT(nees, 0.1);
}

TEST(PoseGrid, AStartIsUsedAndAWrongOneIsFoundOut) {
  const auto right = std::make_unique<GridRobot>(), wrong = std::make_unique<GridRobot>();
  right->set(0, 0, 0, 0.05F, 0.02F);
  wrong->set(2, 1, 1.5F, 0.05F, 0.02F);
  EXPECT_TRUE(right->estimate().position_valid);
  int since = -1;  // the first step from which on the wrong start has no effect
  for (int k = 0; k < 600; ++k) {
    right->go(1), wrong->go(1);
    ASSERT_TRUE(right->estimate().position_valid) << k;
    ASSERT_LT(right->error_m(), 0.5) << k;
    const bool found = wrong->estimate().position_valid && wrong->error_m() < 0.5;
    since = !found ? -1 : since < 0 ? k : since;
  }
  EXPECT_GT(since, 10);
  EXPECT_LT(since, 200);
}

TEST(PoseGrid, AHeadingThatIsNotKnownIsFound) {
  const auto robot = std::make_unique<GridRobot>();
  robot->set(0, 0, 0, 0.1F, base::kNan);
  EXPECT_FALSE(robot->estimate().heading_valid);
  EXPECT_GE(robot->found_after(200), 0);
}

TEST(PoseGrid, AStepInPiecesLeavesTheSameBits) {
  const auto after = [](std::int32_t units, int ticks) {
    const auto robot = std::make_unique<GridRobot>(units);
    robot->look();
    for (int tick = 0; tick < ticks; ++tick) robot->tick_once();
    robot->drive(30, false);
    robot->look();
    for (int tick = 0; tick < ticks; ++tick) {
      EXPECT_EQ(robot->estimator.job().busy(), tick > 0);
      robot->tick_once();
    }
    EXPECT_FALSE(robot->estimator.job().busy());
    base::BitCrc crc;
    robot->estimator.hash_memory(crc);
    return crc.value();
  };
  const std::uint32_t whole = after(100'000, 1);
  EXPECT_EQ(after(3840, 1), whole);
  EXPECT_EQ(after(7, 3840 / 7 + 1), whole);
}

TEST(PoseGrid, SightingsWaitForTheStepUnderWayAndMoveWithTheRobot) {
  const auto robot = std::make_unique<GridRobot>();
  robot->set(0, 0, 0, 0.05F, 0.02F);
  robot->go(10);  // the first step has begun
  EXPECT_TRUE(robot->estimator.job().busy());
  for (std::size_t k = 0; k < Grid::kBatch; ++k)
    EXPECT_NE(robot->estimator.fuse(robot->seen(1), {robot->us}, robot->ctx()).verdict, sensor::Verdict::kNotUsed);
  EXPECT_EQ(robot->estimator.fuse(robot->seen(2), {robot->us}, robot->ctx()).verdict, sensor::Verdict::kNotUsed);
  robot->go(9);
  EXPECT_LT(robot->error_m(), 0.4);
}

TEST(PoseGrid, ASetPoseAbortsTheStepAndAClosedWindowDoesNot) {
  const auto robot = std::make_unique<GridRobot>();
  robot->go(10);
  ASSERT_TRUE(robot->estimator.job().busy());
  robot->estimator.abort_job();
  EXPECT_TRUE(robot->estimator.job().busy());
  robot->set(0, 0, 0, 0.05F, 0.02F);
  EXPECT_FALSE(robot->estimator.job().busy());
  EXPECT_EQ(robot->estimator.job().aborted(), 1U);
  robot->go(10);
  robot->estimator.restart({robot->us}, robot->ctx());
  EXPECT_EQ(robot->estimator.job().aborted(), 2U);
  EXPECT_EQ(robot->estimator.mode(robot->ctx()), sensor::Mode::kWaitingForPose);
}

TEST(PoseGrid, ASightingThatDiffersInOneBitDiffersInTheDigest) {
  const auto a = std::make_unique<GridRobot>(), b = std::make_unique<GridRobot>();
  for (GridRobot* robot : {a.get(), b.get()}) robot->go(12);
  ASSERT_EQ(a->hash(), b->hash());
  sensor::LandmarkSighting sighting{.landmark = 1, .range_m = 2, .bearing_rad = 0.1F};
  static_cast<void>(a->estimator.fuse(sighting, {a->us}, a->ctx()));
  sighting.range_m = std::nextafter(sighting.range_m, 3.0F);
  static_cast<void>(b->estimator.fuse(sighting, {b->us}, b->ctx()));
  EXPECT_NE(a->hash(), b->hash());
  for (GridRobot* robot : {a.get(), b.get()}) robot->go(7), static_cast<void>(robot->estimate());
  EXPECT_NE(a->estimator.digest(), b->estimator.digest());
}

TEST(PoseGrid, WhatItCannotUseIsCountedAndChangesNothing) {
  const auto robot = std::make_unique<GridRobot>();
  robot->set(0, 0, 0, 0.05F, 0.02F);
  const std::uint32_t before = robot->whole_hash();
  const auto verdict = [&](const sensor::LandmarkSighting& sighting) {
    return robot->estimator.fuse(sighting, {robot->us}, robot->ctx()).verdict;
  };
  EXPECT_EQ(verdict({.landmark = 77, .range_m = 5, .bearing_rad = 0}), sensor::Verdict::kUnknownLandmark);
  EXPECT_EQ(verdict({.landmark = 0xFF, .range_m = 5, .bearing_rad = 0}), sensor::Verdict::kNotUsed);
  EXPECT_EQ(verdict({.landmark = 1, .range_m = 5, .bearing_rad = base::kNan}), sensor::Verdict::kNotUsed);
  EXPECT_EQ(verdict({.landmark = 1, .range_m = base::kNan, .bearing_rad = base::kNan}), sensor::Verdict::kNotFinite);
  EXPECT_EQ(robot->whole_hash(), before);
  EXPECT_EQ(verdict(robot->seen(1)), sensor::Verdict::kAccepted);
  EXPECT_EQ(verdict({.landmark = 1, .range_m = 9, .bearing_rad = 2}), sensor::Verdict::kRejected);
}

TEST(PoseGrid, NoSampleLeavesItWithoutNumbers) {
  for (const float value : test::kHostile)
    for (int field = 0; field < 3; ++field) {
      const auto robot = std::make_unique<GridRobot>();
      robot->set(0, 0, 0, field == 2 ? value : 0.05F, 0.02F);
      sensor::LandmarkSighting sighting{.landmark = 1, .range_m = 2, .bearing_rad = 0.1F};
      if (field < 2) (field == 0 ? sighting.range_m : sighting.bearing_rad) = value;
      for (int k = 0; k < 8; ++k) {
        robot->go(1);
        static_cast<void>(robot->estimator.fuse(sighting, {robot->us}, robot->ctx()));
        const Estimate e = robot->estimate();
        EXPECT_TRUE(e.pose.finite()) << field << " = " << value;
        EXPECT_GT(test::least_eigenvalue(e.p), 0) << field << " = " << value;
      }
      robot->go(400);
      EXPECT_LT(robot->error_m(), 0.5) << field << " = " << value;
    }
}

}  // namespace
}  // namespace tetap::estimators
