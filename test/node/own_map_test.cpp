// SPDX-License-Identifier: Apache-2.0
// Robots that make a map of their own, as frames in and frames out. The cases: the map on the bus, set pose, reset, a
// full map, late sightings.
#include "mapping_bench.hpp"

#include <gtest/gtest.h>
#include <cmath>
#include <memory>
#include <random>

namespace tetap::test {
namespace {

static_assert(Ekf::kMakesMap && !Ekf::kUsesMap);
static_assert(node::RecordsLater<estimators::EkfSlam30>);
static_assert(sizeof(estimators::EkfSlam30) < 32 * 1024 && sizeof(estimators::FastSlam100) < 40 * 1024,
              "the class of 64 kB holds either with the window and the stack");

template <class Estimators>
class OwnMap : public testing::Test {};
using Mappers = testing::Types<Ekf, Fast>;

bool says(const bus::EstStatus& status, bus::MapFault fault) {
  return (status.map_faults >> static_cast<unsigned>(fault) & 1U) != 0;
}
TYPED_TEST_SUITE(OwnMap, Mappers);

TYPED_TEST(OwnMap, GoesOutOnTheBusAndIsTrue) {
  Mapping<TypeParam> run;
  run.drive(3800);
  EXPECT_EQ(run.map.size(), 8U);
  EXPECT_EQ(run.page.map_size, 8);
  EXPECT_LT(run.worst_landmark_m(), 0.25);
  const double t = 1e-6 * static_cast<double>(run.bench->now_us - run.bench->kStart_us);
  EXPECT_LT(std::hypot(run.robot().x - 3 * std::cos(t * run.kRate), run.robot().y - 3 * std::sin(t * run.kRate)), 0.3);
  EXPECT_EQ(run.verdicts[sensor::Verdict::kNewLandmark], 8);
  EXPECT_EQ(run.verdicts[sensor::Verdict::kPending], 0);  // fuse()'s own word is no record
  EXPECT_GT(run.verdicts[sensor::Verdict::kAccepted], 1000);
  EXPECT_EQ(run.status.mode, sensor::Mode::kNominal);
  EXPECT_EQ(run.map_faults, 0U);
}

TEST(OwnMapFrames, HaveTheLayoutOfAMapEntry) {
  EXPECT_EQ(bus::encode(bus::EstLandmark{.id = 7, .x_raw = -123456, .y_raw = 654321}),
            bus::encode(bus::InMapEntry{.id = 7, .x_raw = -123456, .y_raw = 654321}));
  EXPECT_EQ(bus::EstLandmark::kOffset, 0x40);
}

/// Sightings of one stamp are fused together: neither their order nor how late they come changes a bit.
TYPED_TEST(OwnMap, OrderAndDelayOfSightingsChangeNothing) {
  Mapping<TypeParam> on_time, turned, late;
  for (int i = 0; i < 40; ++i) {
    on_time.drive(20), turned.drive(20, 1, 0, true), late.drive(20, 1, 120'000);
    EXPECT_EQ(on_time.crc, turned.crc) << i;
  }
  // All that is late has come; the present needs no sightings of the last 200 ms.
  on_time.drive(1), late.drive(1);
  EXPECT_EQ(on_time.map.size(), late.map.size());
  for (const auto& [id, at] : on_time.map) {
    EXPECT_EQ(at.x, late.map.at(id).x) << id;
    EXPECT_EQ(at.y, late.map.at(id).y) << id;
  }
}

TYPED_TEST(OwnMap, ASetPoseMovesRobotAndMapRigidly) {
  Mapping<TypeParam> run;
  run.drive(2400);
  const auto before = run.map;
  const Place from = run.robot();
  const auto heading = last<bus::EstMotion>(run.out, 1)->yaw_rad;
  for (const auto& frame : set_pose(2, 100'000, -50'000, 0.0F, 0.01F, 0.001F)) run.now.push_back(frame);
  run.step();
  run.map.clear();
  for (int i = 0; i < 100; ++i) run.step();
  EXPECT_EQ(run.page.map_size, 8);
  ASSERT_EQ(run.map.size(), 8U);
  const double c = std::cos(-static_cast<double>(heading)), s = std::sin(-static_cast<double>(heading));
  for (const auto& [id, at] : before) {
    const double dx = at.x - from.x, dy = at.y - from.y;
    // Within the way of a fifth of a second: the pose is set where the window ends.
    EXPECT_NEAR(run.map.at(id).x, 100 + c * dx - s * dy, 0.1) << id;
    EXPECT_NEAR(run.map.at(id).y, -50 + s * dx + c * dy, 0.1) << id;
  }
}

TYPED_TEST(OwnMap, AResetForgetsTheMapAndKeepsThePose) {
  Mapping<TypeParam> run;
  run.drive(1000);
  ASSERT_GE(run.page.map_size, 6);
  const Place from = run.robot();
  run.now.push_back(in(bus::protect(bus::CmdReset{.ctr = 5, .what = bus::ResetWhat::kOwnMap})));
  run.step();
  EXPECT_NEAR(run.robot().x, from.x, 0.05);
  EXPECT_NEAR(run.robot().y, from.y, 0.05);
  for (int i = 0; i < 100; ++i) run.step();
  EXPECT_EQ(run.page.map_size, 0);
  EXPECT_EQ(last<bus::EstDiagFrames>(run.bench->idle(130))->out_of_range, 0);
}

/// More posts than places: those that are there stay, the others are refused, counted and said.
TYPED_TEST(OwnMap, AFullMapRefusesCountsAndSays) {
  constexpr int kPlaces = std::is_same_v<TypeParam, Ekf> ? 30 : 15;
  Mapping<TypeParam> run(kPlaces + 6);
  run.drive(3800, 0.2);
  EXPECT_EQ(run.page.map_size, kPlaces);
  EXPECT_EQ(run.map.size(), static_cast<std::size_t>(kPlaces));
  EXPECT_GT(run.page.map_refused, 100);
  EXPECT_GT(run.verdicts[sensor::Verdict::kNoRoom], 10);
  EXPECT_NE(run.status.faults & 1U << static_cast<unsigned>(sensor::Fault::kCapacity), 0);
  EXPECT_NE(run.map_faults & 1U << static_cast<unsigned>(bus::MapFault::kMapFull), 0U);
  EXPECT_LT(run.worst_landmark_m(), 0.3);
}

/// A sighting between two posts half a metre apart names neither: it changes nothing, is counted and said for a second.
TEST(OwnMapWithoutIdentities, AnAmbiguousSightingIsSaidAndCounted) {
  auto bench = std::make_unique<BenchOf<Ekf>>(Mapping<Ekf>::numbers());
  bench->epoch(set_pose(1, 0, 0, 0, 0.0F, 0.0F));
  const auto look = [&](int id, float range_m, float bearing_rad, int seq) {
    const auto at_us = bench->now_us + 5000;
    return bench->epoch({body_speed(at_us, 0, 0, seq), sighting(at_us, id, range_m, bearing_rad, seq)});
  };
  for (int i = 0; i < 10; ++i) look(1, 4, 0.0625F, 2 * i), look(2, 4, -0.0625F, 2 * i + 1);
  bus::EstStatus status = *last<bus::EstStatus>(bench->idle(130));
  EXPECT_FALSE(says(status, bus::MapFault::kAssociationAmbiguous));
  look(0xFF, 4, 0, 1);
  const Frames out = bench->idle(60);
  status = *last<bus::EstStatus>(out);
  EXPECT_TRUE(says(status, bus::MapFault::kAssociationAmbiguous));
  EXPECT_FALSE(says(status, bus::MapFault::kMapFull));
  int ambiguous = 0;
  for (const auto& one : all<bus::EstInnov>(out)) ambiguous += one.verdict == sensor::Verdict::kAmbiguous ? 1 : 0;
  EXPECT_EQ(ambiguous, 1);
  const Frames later = bench->idle(200);
  EXPECT_FALSE(says(*last<bus::EstStatus>(later), bus::MapFault::kAssociationAmbiguous));
  EXPECT_EQ(last<bus::EstDiagMapper>(later)->ambiguous, 1);
  EXPECT_EQ(last<bus::EstDiagMapper>(later)->map_size, 2);
}

/// Two sightings of one post in one stamp: one landmark, and each sighting has a record of its own.
TYPED_TEST(OwnMap, TwoSightingsOfOnePostInOneStampMakeOneLandmark) {
  auto bench = std::make_unique<BenchOf<TypeParam>>(Mapping<TypeParam>::numbers());
  bench->epoch(set_pose(1, 0, 0, 0, 0.0F, 0.0F));
  Frames out;
  for (int i = 0; i < 4; ++i) {
    const auto at_us = bench->now_us + 5000;
    for (const auto& frame : bench->epoch({body_speed(at_us, 0, 0, i), sighting(at_us, 7, 3, 0.1F, 2 * i),
                                           sighting(at_us, 7, 3.01F, 0.1F, 2 * i + 1)}))
      out.push_back(frame);
  }
  for (const auto& frame : bench->idle(130)) out.push_back(frame);
  EXPECT_EQ(last<bus::EstDiagMapper>(out)->map_size, 1);
  std::map<sensor::Verdict, int> verdicts;
  for (const auto& one : all<bus::EstInnov>(out))
    if (one.sensor == sensor::Sensor::kRangeBearing) ++verdicts[one.verdict];
  EXPECT_EQ(verdicts[sensor::Verdict::kNewLandmark] + verdicts[sensor::Verdict::kPending], 2);
  EXPECT_EQ(verdicts[sensor::Verdict::kAccepted], 6);
}

/// A sighting behind the window: refused, counted, said; the map stays as it was.
TYPED_TEST(OwnMap, ASightingBehindTheWindowIsTooLate) {
  Mapping<TypeParam> run;
  run.drive(400);
  const auto before = run.map;
  const auto held = run.page.map_size;
  for (int i = 0; i < 5; ++i) {
    run.now.push_back(sighting(run.bench->now_us - 300'000, 99, 3, 0.2F, i));
    run.step();
  }
  run.status = *last<bus::EstStatus>(run.bench->idle(20));
  EXPECT_NE(run.status.faults & 1U << static_cast<unsigned>(sensor::Fault::kTooLate), 0);
  for (int i = 0; i < 100; ++i) run.step();
  EXPECT_EQ(run.page.map_size, held);
  EXPECT_EQ(run.map.count(99), 0U);
  for (const auto& [id, at] : before) EXPECT_LT(std::hypot(run.map.at(id).x - at.x, run.map.at(id).y - at.y), 0.05);
  EXPECT_GE(run.verdicts[sensor::Verdict::kTooLate], 1);
  EXPECT_EQ(last<bus::EstDiagOrder>(run.bench->idle(130))->too_late, 5);
}

/// A full map, a set pose and a reset of the map in one tick. The reset comes first, so that the pose is as it was set.
TYPED_TEST(OwnMap, ResetAndSetPoseOfAFullMapInOneTick) {
  constexpr int kPlaces = std::is_same_v<TypeParam, Ekf> ? 30 : 15;
  Mapping<TypeParam> run(kPlaces + 2);
  run.drive(2400, 0.2);
  ASSERT_EQ(run.page.map_size, kPlaces);
  run.now.push_back(in(bus::protect(bus::CmdReset{.ctr = 5, .what = bus::ResetWhat::kOwnMap})));
  for (const auto& frame : set_pose(2, 20'000, 10'000, 0.5F, 0.01F, 0.001F)) run.now.push_back(frame);
  run.step();
  EXPECT_NEAR(run.robot().x, 20, 0.05);
  EXPECT_NEAR(run.robot().y, 10, 0.05);
  for (int i = 0; i < 130; ++i) run.step();
  EXPECT_EQ(run.page.map_size, 0);
  EXPECT_FALSE(says(run.status, bus::MapFault::kMapFull));
}

/// Any bits in sightings and speeds, set poses and resets in between: the estimate stays a number with a covariance.
TYPED_TEST(OwnMap, IsANumberWhateverComes) {
  auto bench = std::make_unique<BenchOf<TypeParam>>(Mapping<TypeParam>::numbers());
  std::mt19937 draw(11);
  for (int i = 0; i < 6000; ++i) {
    Frames frames;
    const auto add = [&](base::CanFrame frame, std::size_t first_free) {  // stamp, sequence and identity stay
      for (std::size_t b = first_free; b < 8; ++b) frame.data[b] = static_cast<std::uint8_t>(draw());
      frames.push_back(frame);
    };
    const std::int64_t at_us = bench->now_us + 1 + static_cast<std::int64_t>(draw() % 9999);
    if (i % 3 == 0) add(body_speed(at_us, 0, 0, i), i % 30 == 0 ? 3 : 8);
    for (unsigned k = 0; k < draw() % 4; ++k)
      add(sighting(at_us, static_cast<int>(draw() % 40), 3, 0, static_cast<int>(draw())), 5);
    if (i % 500 == 499)
      for (const auto& frame :
           set_pose(i / 500, static_cast<int>(draw() % 100'000), 0, 1, 0.5F, draw() % 2 ? 4.0F : 0.1F))
        frames.push_back(frame);
    if (i % 700 == 699)
      frames.push_back(in(bus::protect(
          bus::CmdReset{.ctr = static_cast<std::uint8_t>(i / 700 & 15), .what = bus::ResetWhat::kOwnMap})));
    const Frames out = bench->epoch(frames);
    ASSERT_NE(last<bus::EstPos>(out, 1)->x_raw, bus::EstPos::kXNotAvailable) << i;
    ASSERT_TRUE(base::is_finite(last<bus::EstMotion>(out, 1)->yaw_rad)) << i;
    if (const auto status = last<bus::EstStatus>(out)) {
      ASSERT_NE(status->reset_cause, sensor::ResetCause::kNotFinite) << i;
      ASSERT_NE(status->reset_cause, sensor::ResetCause::kNotPositive) << i;
    }
    if (const auto deviation = last<bus::EstStdPose>(out, 1)) {
      ASSERT_GT(deviation->std_x_m, -1) << i;
      ASSERT_GT(deviation->std_yaw_rad, -1) << i;
    }
    for (const auto& one : all<bus::EstLandmark>(out)) ASSERT_NE(one.x_raw, bus::EstLandmark::kXNotAvailable) << i;
  }
}

}  // namespace
}  // namespace tetap::test
