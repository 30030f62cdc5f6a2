// SPDX-License-Identifier: Apache-2.0
// Laws of localisation by particles as an estimator. It tracks, finds itself again, and reports when it is lost.
// Neither ticks nor the place on the map change what it does.
#include "tetap/estimators/planar/pose_particles.hpp"
#include "estimators/circling_robot.hpp"
#include "support/never_nan.hpp"
#include "tetap/base/state_words.hpp"
#include "tetap/node/estimator_slot.hpp"

#include <gtest/gtest.h>
#include <Eigen/Dense>
#include <memory>

namespace tetap::estimators {
namespace {

using Particles = PoseParticles<1000>;
using ParticleRobot = test::CirclingRobot<Particles>;
using test::held_backward;
using test::kStep_us;

static_assert(node::Estimator<Particles> && node::kIsDelayed<Particles>);
static_assert(sizeof(Particles) < 32 * 1024, "the class of 64 kB holds it with the window and the stack");

std::unique_ptr<ParticleRobot> robot_at(float x_m, float y_m, float yaw_rad) {
  auto robot = std::make_unique<ParticleRobot>(held_backward());
  robot->set(x_m, y_m, yaw_rad, 0.05F, 0.02F);
  return robot;
}
std::uint32_t whole_hash(const ParticleRobot& robot) {
  base::BitCrc crc;
  base::each_word(robot.estimator, crc);
  robot.estimator.hash_memory(crc);
  return crc.value();
}

TEST(PoseParticles, TracksAndIsConsistent) {
  const auto robot = robot_at(0, 0, 0);
  double nees = 0;
  constexpr int kLooks = 60;
  for (int k = 0; k < kLooks; ++k) {
    robot->drive(20);
    const Estimate e = robot->estimate();
    EXPECT_LT(robot->error_m(), 0.35) << k;
    EXPECT_TRUE(e.position_valid && e.heading_valid) << k;
    const Eigen::Vector3d error(robot->x - static_cast<double>(e.pose.x.minus({})),
                                robot->y - static_cast<double>(e.pose.y.minus({})),
                                std::remainder(robot->yaw - static_cast<double>(e.pose.yaw_rad), 2 * M_PI));
    nees += error.dot(e.p.dense().cast<double>().ldlt().solve(error)) / kLooks;
  }
  EXPECT_EQ(robot->estimator.mode(robot->ctx()), sensor::Mode::kNominal);
  EXPECT_LT(nees, 6.0);  // the tempered likelihood keeps the covariance wide
  EXPECT_GT(nees, 0.25);
}

TEST(PoseParticles, TicksBetweenSamplesChangeNoBit) {
  const auto quiet = robot_at(0, 0, 0), ticked = robot_at(0, 0, 0);
  for (int k = 0; k < 30; ++k) {
    quiet->drive(10), ticked->drive(10);
    static_cast<void>(quiet->estimate());
    for (std::int64_t ahead_us = 0; ahead_us < kStep_us; ahead_us += 10'000) {
      ticked->estimator.advance({ticked->us + ahead_us}, ticked->ctx(), {});
      static_cast<void>(ticked->estimator.estimate(ticked->ctx()));
    }
    const Estimate expected = quiet->estimate(), got = ticked->estimate();
    base::BitCrc of_quiet, of_ticked;  // without the digest, which takes a part of the cloud in each tick
    quiet->estimator.hash_memory(of_quiet), ticked->estimator.hash_memory(of_ticked);
    base::each_word(expected, of_quiet), base::each_word(got, of_ticked);
    ASSERT_EQ(of_quiet.value(), of_ticked.value()) << k;
  }
}

TEST(PoseParticles, TheWindowCarriesThePresent) {
  const auto early = robot_at(0, 0, 0), late = robot_at(0, 0, 0);
  std::vector<sensor::Sample> window;
  for (int k = 0; k < 4; ++k) {
    sensor::Sample sample;
    sample.stamp = {(k + 1) * kStep_us};
    sample.sensor = sensor::Sensor::kBodySpeed;
    sample.payload.body_speed = {.forward_mps = 1, .yaw_rate_radps = 0.3F};
    window.push_back(sample);
    static_cast<void>(early->estimator.fuse(sample.payload.body_speed, sample.stamp, early->ctx()));
  }
  early->estimator.advance({5 * kStep_us}, early->ctx(), {});
  late->estimator.advance({5 * kStep_us}, late->ctx(), window);
  const Estimate a = early->estimator.estimate(early->ctx()), b = late->estimator.estimate(late->ctx());
  EXPECT_EQ(a.pose.x.minus(b.pose.x), 0);
  EXPECT_EQ(a.pose.yaw_rad, b.pose.yaw_rad);
  EXPECT_EQ(a.p.packed(), b.p.packed());
  EXPECT_NEAR(a.pose.x.minus({}), 0.2F, 2e-3F);
}

TEST(PoseParticles, FindsItselfAfterAWrongStartAndSaysThatItIsLost) {
  for (const bool ids : {true, false}) {
    const auto robot = robot_at(2, 1, 1.5F);
    robot->ids = ids;
    bool doubted = false, found = false;
    for (int k = 0; k < 120 && !found; ++k) {
      robot->drive(10);
      const Estimate e = robot->estimate();
      doubted = doubted || !e.position_valid;
      found = e.position_valid && robot->error_m() < 0.3;
    }
    EXPECT_TRUE(doubted) << ids;
    EXPECT_TRUE(found) << ids;
  }
}

TEST(PoseParticles, WithoutAStartItLooksForItselfAmongTheLandmarks) {
  const auto robot = std::make_unique<ParticleRobot>(held_backward());
  EXPECT_EQ(robot->estimator.mode(robot->ctx()), sensor::Mode::kWaitingForPose);
  robot->drive(9);
  EXPECT_FALSE(robot->estimate().position_valid);
  robot->drive(10);
  EXPECT_FALSE(robot->estimate().position_valid);
  EXPECT_EQ(robot->estimator.mode(robot->ctx()), sensor::Mode::kAligning);
  bool found = false;
  for (int k = 0; k < 120 && !found; ++k) {
    robot->drive(10);
    found = robot->estimate().position_valid && robot->error_m() < 0.3;
  }
  EXPECT_TRUE(found);
}

TEST(PoseParticles, AHeadingThatIsNotKnownIsNotValid) {
  const auto robot = std::make_unique<ParticleRobot>(held_backward());
  robot->set(0, 0, 0, 0.1F, base::kNan);
  EXPECT_FALSE(robot->estimate().heading_valid);
  robot->drive(100);
  EXPECT_TRUE(robot->estimate().heading_valid);
  EXPECT_LT(robot->error_m(), 0.3);
}

TEST(PoseParticles, FarFromTheOriginItDoesTheSame) {
  const auto here = robot_at(0, 0, 0);
  const auto far = std::make_unique<ParticleRobot>(held_backward());
  constexpr std::int32_t kFar_mm = 50'176'000;  // 196 steps of 256 m: exact in the anchor and in float
  for (const estimators::MapEntry& entry :
       {MapEntry{kFar_mm + 5000, kFar_mm, 1}, MapEntry{kFar_mm, kFar_mm + 8000, 2},
        MapEntry{kFar_mm - 5000, kFar_mm + 1000, 3}, MapEntry{kFar_mm + 1000, kFar_mm - 4000, 4}})
    ASSERT_TRUE(far->map.put(entry));
  far->x = far->y = 50'176;
  const base::Anchored east = base::Anchored::from_um(std::int64_t{kFar_mm} * 1000);
  far->estimator.set_pose({0}, {.pose = {.x = east, .y = east}, .sigma_position_m = 0.05F, .sigma_yaw_rad = 0.02F},
                          far->ctx());
  for (int k = 0; k < 20; ++k) {
    here->drive(20), far->drive(20);
    const Estimate a = here->estimate(), b = far->estimate();
    EXPECT_NEAR(a.pose.x.minus({}), b.pose.x.minus(east), 2e-3F) << k;
    EXPECT_NEAR(a.pose.y.minus({}), b.pose.y.minus(east), 2e-3F) << k;
  }
}

/// Straight on for 200 m, beside a landmark every 8 m.
TEST(PoseParticles, TheOriginOfTheCloudFollowsTheRobot) {
  const auto robot = robot_at(0, 0, 0);
  robot->map.clear();
  for (std::uint8_t id = 0; id < 26; ++id)
    ASSERT_TRUE(robot->map.put({.x_mm = 8000 * id, .y_mm = id % 2 == 0 ? 3000 : -3000, .id = id}));
  float most_m = 0;
  for (int k = 0; k < 2000; ++k) {
    robot->us += kStep_us;
    robot->x += 0.1;
    static_cast<void>(robot->estimator.fuse(sensor::BodySpeed{.forward_mps = 2}, {robot->us}, robot->ctx()));
    if (k % 5 != 4) continue;
    for (std::uint8_t id = 0; id < 26; ++id) {
      const double dx = 8.0 * id - robot->x, dy = id % 2 == 0 ? 3 : -3;
      if (std::abs(dx) > 10) continue;
      static_cast<void>(
          robot->estimator.fuse(sensor::LandmarkSighting{.landmark = id,
                                                         .range_m = static_cast<float>(std::hypot(dx, dy)),
                                                         .bearing_rad = static_cast<float>(std::atan2(dy, dx))},
                                {robot->us}, robot->ctx()));
    }
    EXPECT_LT(robot->error_m(), 0.3) << k;
    EXPECT_LT(robot->estimate().pose.x.minus(robot->estimator.origin_x()), 66) << k;
    most_m = std::max(most_m, robot->estimate().pose.x.minus({}));
  }
  EXPECT_NEAR(most_m, 200, 0.3);
}

TEST(PoseParticles, ASightingThatDiffersInOneBitDiffersInTheDigest) {
  const auto a = robot_at(0, 0, 0), b = robot_at(0, 0, 0);
  a->drive(10), b->drive(10);
  for (auto* robot : {a.get(), b.get()}) static_cast<void>(robot->estimate());
  ASSERT_EQ(a->estimator.digest(), b->estimator.digest());
  sensor::LandmarkSighting sighting{.landmark = 1, .range_m = 5, .bearing_rad = 0.1F};
  const base::Micros stamp{a->us + 10'000};
  static_cast<void>(a->estimator.fuse(sighting, stamp, a->ctx()));
  sighting.range_m = std::nextafter(sighting.range_m, 6.0F);
  static_cast<void>(b->estimator.fuse(sighting, stamp, b->ctx()));
  EXPECT_NE(a->hash(), b->hash());  // while it waits for its stamp to be over
  for (auto* robot : {a.get(), b.get()}) static_cast<void>(robot->estimate());
  EXPECT_NE(a->estimator.digest(), b->estimator.digest());
}

TEST(PoseParticles, WhatItCannotUseIsCountedAndChangesNothing) {
  const auto robot = robot_at(0, 0, 0);
  robot->drive(9);
  static_cast<void>(robot->estimate());
  const std::uint32_t before = whole_hash(*robot);
  const auto verdict = [&](const sensor::LandmarkSighting& sighting) {
    return robot->estimator.fuse(sighting, {robot->us}, robot->ctx()).verdict;
  };
  EXPECT_EQ(verdict({.landmark = 77, .range_m = 5, .bearing_rad = 0}), sensor::Verdict::kUnknownLandmark);
  EXPECT_EQ(verdict({.landmark = 1, .range_m = 5, .bearing_rad = base::kNan}), sensor::Verdict::kNotUsed);
  EXPECT_EQ(verdict({.landmark = 1, .range_m = base::kNan, .bearing_rad = base::kNan}), sensor::Verdict::kNotFinite);
  EXPECT_EQ(whole_hash(*robot), before);
  for (std::size_t k = 0; k < Particles::kBatch; ++k)
    EXPECT_EQ(verdict({.landmark = 0xFF, .range_m = 5, .bearing_rad = 0}), sensor::Verdict::kAccepted) << k;
  EXPECT_EQ(verdict({.landmark = 1, .range_m = 5, .bearing_rad = 0}), sensor::Verdict::kNotUsed);
  robot->drive(1, false);
  EXPECT_EQ(verdict({.landmark = 1, .range_m = 40, .bearing_rad = 2}), sensor::Verdict::kRejected);
}

TEST(PoseParticles, NoSampleLeavesItWithoutNumbers) {
  for (const float value : test::kHostile)
    for (int field = 0; field < 2; ++field)
      for (const std::uint8_t landmark : {std::uint8_t{1}, std::uint8_t{0xFF}}) {
        const auto robot = robot_at(0, 0, 0);
        sensor::LandmarkSighting sighting{.landmark = landmark, .range_m = 5, .bearing_rad = 0.1F};
        (field == 0 ? sighting.range_m : sighting.bearing_rad) = value;
        for (int k = 0; k < 5; ++k) {
          robot->drive(1);
          static_cast<void>(robot->estimator.fuse(sighting, {robot->us}, robot->ctx()));
          const Estimate e = robot->estimate();
          EXPECT_TRUE(e.pose.finite()) << field << " = " << value;
          EXPECT_GT(test::least_eigenvalue(e.p), 0) << field << " = " << value;
        }
        robot->drive(400);
        EXPECT_LT(robot->error_m(), 0.35) << field << " = " << value;
      }
}

}  // namespace
}  // namespace tetap::estimators
