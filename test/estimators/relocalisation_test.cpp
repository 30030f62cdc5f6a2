// SPDX-License-Identifier: Apache-2.0
// A robot that is carried off while it tracks: landmarks that agree about another pose place it there, with a word. A
// camera or an identity that is wrong must not. Truth is the simulated drive's own.
#include "estimators/short_sighted_robot.hpp"
#include "tetap/estimators/planar/pose_ekf.hpp"
#include "tetap/estimators/planar/pose_ukf.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <vector>

namespace tetap::estimators {
namespace {

using test::kRight;
using test::ShortSighted;

constexpr unsigned kSeeds = 10;

/// Placed and driven for twenty seconds.
template <class E>
ShortSighted<E> tracking(unsigned seed) {
  ShortSighted<E> drive(seed);
  drive.robot.set(0, 0, 0, 0.05F, 0.02F);
  for (int k = 0; k < 40; ++k) drive.look(kRight);
  return drive;
}
template <class E>
void carry_off(ShortSighted<E>& drive) {
  drive.robot.x += 1.5, drive.robot.y -= 1, drive.robot.yaw += 2.5;
}
template <class E>
int jumps(const ShortSighted<E>& drive) {
  return drive.robot.estimator.jump().count;
}

template <class E>
class RelocalisationOf : public testing::Test {};
using Filters = testing::Types<PoseEkf, PoseUkf, PoseUkfSqrt>;
TYPED_TEST_SUITE(RelocalisationOf, Filters);

TYPED_TEST(RelocalisationOf, ARobotThatIsCarriedOffUnseenComesBack) {
  std::vector<int> looks_needed;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    ShortSighted<TypeParam> drive = tracking<TypeParam>(seed);
    EXPECT_LT(drive.robot.error_m(), 0.4);
    carry_off(drive);
    int looks = 0;
    for (; looks < 120 && drive.robot.error_m() > 0.4; ++looks) drive.look(kRight);
    looks_needed.push_back(looks);
    for (int k = 0; k < 40; ++k) drive.look(kRight);
    EXPECT_LT(drive.robot.error_m(), 0.4) << seed;
    EXPECT_LT(drive.worst_sigmas(), 4.0) << seed;
    EXPECT_EQ(drive.robot.estimator.mode(drive.robot.ctx()), sensor::Mode::kNominal) << seed;
  }
  std::nth_element(looks_needed.begin(), looks_needed.begin() + kSeeds / 2, looks_needed.end());
  EXPECT_LE(looks_needed[kSeeds / 2], 40) << "half a second each: one turn of the circle, most of it without landmarks";
}

TYPED_TEST(RelocalisationOf, TheJumpHasACauseAndACount) {
  ShortSighted<TypeParam> drive = tracking<TypeParam>(1);
  EXPECT_EQ(jumps(drive), 0);
  carry_off(drive);
  for (int k = 0; k < 120; ++k) drive.look(kRight);
  EXPECT_EQ(jumps(drive), 1);
  EXPECT_EQ(drive.robot.estimator.jump().cause, sensor::ResetCause::kPositionJump);
  drive.robot.set(0, 0, 0, 0.05F, 0.02F);
  EXPECT_EQ(jumps(drive), 1) << "a pose from outside is no jump, and ends no count";
}

// One barcode in ten is read as another one, for five minutes.
TYPED_TEST(RelocalisationOf, MisreadLandmarksAreNoReasonToJump) {
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    ShortSighted<TypeParam> drive = tracking<TypeParam>(seed);
    std::mt19937 chance(seed);
    const auto misread = [&chance](std::uint8_t id) {
      return chance() % 10 == 0 ? static_cast<std::uint8_t>(1 + (id + chance() % 6) % 7) : id;
    };
    for (int k = 0; k < 600; ++k) drive.look(misread);
    EXPECT_EQ(jumps(drive), 0) << seed;
    EXPECT_LT(drive.robot.error_m(), 0.6) << seed;
  }
}

template <class E>
void fix(test::CirclingRobot<E>& robot, base::Anchored x, base::Anchored y, float sigma_m) {
  const auto at = robot.frame.frame.to_geodetic({.east_um = x.um(), .north_um = y.um(), .up_um = 0, .valid = true});
  ASSERT_TRUE(at.has_value());
  static_cast<void>(robot.estimator.fuse(sensor::GnssPosition{.latitude_2ndeg = at->latitude_2ndeg,
                                                              .longitude_2ndeg = at->longitude_2ndeg,
                                                              .height_m = static_cast<float>(at->height_m),
                                                              .horizontal_acc_m = sigma_m,
                                                              .fix = sensor::GnssFix::k3d},
                                         {robot.us}, robot.ctx()));
}
/// A fix of half a metre at the filter's own estimate.
template <class E>
void fix_agrees_with_filter(test::CirclingRobot<E>& robot) {
  const Estimate e = robot.estimate();
  fix(robot, e.pose.x, e.pose.y, 0.5F);
}
template <class E>
void fix_at_robot(test::CirclingRobot<E>& robot) {
  fix(robot, base::Anchored{}.plus(static_cast<float>(robot.x)), base::Anchored{}.plus(static_cast<float>(robot.y)),
      0.01F);
}

// Receiver against camera: landmarks that all agree about another pose do not win while fixes contradict it.
TYPED_TEST(RelocalisationOf, FixesBarAPoseThatContradictsThem) {
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    ShortSighted<TypeParam> drive = tracking<TypeParam>(seed);
    drive.robot.numbers.recovery.at_least = 1000;  // refused sightings widen nothing: the filter stays where it is
    carry_off(drive);
    for (int k = 0; k < 60; ++k) {
      fix_agrees_with_filter(drive.robot);
      drive.look(kRight);
    }
    EXPECT_EQ(jumps(drive), 0) << seed;
    for (int k = 0; k < 60; ++k) drive.look(kRight);
    EXPECT_EQ(jumps(drive), 1) << seed;
  }
}

TYPED_TEST(RelocalisationOf, AFixJustBeforeBarsItForTenSeconds) {
  test::CirclingRobot<TypeParam> robot(test::held_backward());
  robot.numbers.recovery.at_least = 1000;
  robot.set(0, 0, 0, 0.05F, 0.02F);
  robot.drive(200);
  fix_agrees_with_filter(robot);
  robot.x += 1.5, robot.y -= 1, robot.yaw += 2.5;
  robot.drive(190);
  EXPECT_EQ(robot.estimator.jump().count, 0) << "nine and a half seconds";
  robot.drive(30);
  EXPECT_EQ(robot.estimator.jump().count, 1);
}

/// A robot that was carried off and jumped: share of its position's sigma that the first fix afterwards leaves.
template <class E>
float share_left_by_first_fix(bool rival_has_a_fix) {
  test::CirclingRobot<E> robot(test::held_backward());
  robot.numbers.recovery.at_least = 1000;
  robot.numbers.gnss.correlation_s = 60;
  robot.numbers.gnss.sigma_scale = 1;
  robot.numbers.gnss.sigma_floor_m = 0.01F;
  robot.set(0, 0, 0, 0.05F, 0.02F);
  robot.drive(200);
  fix_at_robot(robot);  // a part of the pose that the filter leaves
  robot.x += 1.5, robot.y -= 1, robot.yaw += 2.5;
  for (int k = 0; k < 60 && robot.estimator.jump().count == 0; ++k) {
    robot.drive(10);
    if (rival_has_a_fix && k == 6) fix_at_robot(robot);
  }
  EXPECT_EQ(robot.estimator.jump().count, 1);
  const float before_m2 = robot.estimate().p(0, 0);
  fix_at_robot(robot);
  return base::sqrt(robot.estimate().p(0, 0) / before_m2);
}

// With errors that last for a minute, a fix after the jump repeats those of the rival, and none of the filter's.
TYPED_TEST(RelocalisationOf, AFixAfterTheJumpRepeatsThoseOfTheRivalAlone) {
  EXPECT_LT(share_left_by_first_fix<TypeParam>(false), 0.6F);
  EXPECT_GT(share_left_by_first_fix<TypeParam>(true), 0.8F);
}

// Landmarks seen at once, twice a second; fewer of them take longer, and one alone does nothing.
TYPED_TEST(RelocalisationOf, AgreementHasToLast) {
  for (const auto& [seen, too_short, long_enough] : {std::array{4, 100, 80}, std::array{2, 200, 80}}) {
    test::CirclingRobot<TypeParam> robot(test::held_backward());
    robot.numbers.recovery.at_least = 1000;
    robot.set(0, 0, 0, 0.05F, 0.02F);
    robot.drive(200);
    robot.x += 1.5, robot.y -= 1, robot.yaw += 2.5;
    robot.seen = static_cast<std::uint8_t>(seen);
    robot.drive(too_short);
    EXPECT_EQ(robot.estimator.jump().count, 0) << seen;
    robot.drive(long_enough);
    EXPECT_EQ(robot.estimator.jump().count, 1) << seen;
    EXPECT_LT(robot.error_m(), 0.4) << seen;
  }
}
TYPED_TEST(RelocalisationOf, OneLandmarkAloneMovesNothing) {
  test::CirclingRobot<TypeParam> robot(test::held_backward());
  robot.numbers.recovery.at_least = 1000;
  robot.set(0, 0, 0, 0.05F, 0.02F);
  robot.drive(200);
  robot.x += 1.5, robot.y -= 1, robot.yaw += 2.5;
  robot.seen = 1;
  robot.drive(1000);
  EXPECT_EQ(robot.estimator.jump().count, 0);
}

// A robot that stands and sees a turn may have a camera that looks aside.
TYPED_TEST(RelocalisationOf, ARobotThatStandsDoesNotJump) {
  ShortSighted<TypeParam> drive = tracking<TypeParam>(1);
  drive.robot.numbers.recovery.at_least = 1000;
  for (int k = 0; k < 60; ++k) {
    drive.robot.us += 500'000;
    static_cast<void>(drive.robot.estimator.fuse(sensor::BodySpeed{.forward_mps = 0, .yaw_rate_radps = 0},
                                                 {drive.robot.us}, drive.robot.ctx()));
    for (std::uint8_t id = 1; id <= 7; ++id) drive.see(id, id, 0.5);
  }
  EXPECT_EQ(jumps(drive), 0);
}

// A filter that is right refuses one sighting, just beyond its gate: the rival is as good as the filter, and no better.
TEST(Relocalisation, OddsDecideAndNotOneRefusal) {
  for (const bool filter_errs : {false, true}) {
    Relocalisation search;
    const auto p = filter::Symmetric<float, 3>::diagonal({1e-3F, 1e-3F, 1e-4F});
    const std::array<std::array<float, 2>, 3> places{{{5, 2}, {0, 3}, {3, -3}}};
    model::PlanarPose pose;
    bool jumped = false;
    for (std::uint8_t k = 0; k < 9; ++k) {
      pose.x = pose.x.plus(0.5F);
      const std::uint8_t id = k % 3;
      model::RangeBearing seen{
          .sigma_range_m = 0.1F,
          .sigma_bearing_rad = 0.02F,
          .landmark = {.x = base::Anchored{}.plus(places[id][0]), .y = base::Anchored{}.plus(places[id][1])}};
      const auto exact = seen.predict(pose);
      seen.range_m = exact(0), seen.bearing_rad = exact(1);
      PlanarEkf filter;
      filter.x = pose, filter.p = p;
      auto judged = filter.update(seen, 9.2F);
      if (filter_errs || k % 7 == 0) {
        judged.verdict = filter::Verdict::kRejected;
        judged.nis = filter_errs ? 1000.0F : 9.3F;
      }
      search.move(pose, p);
      search.note(pose, p);
      jumped = search.add(seen, id, {1'000'000 * (k + 1)}, judged, k == 0) || jumped;
    }
    EXPECT_EQ(jumped, filter_errs);
  }
}

/// A hundred fixes in twenty seconds. Their errors last for a minute, or are white.
TEST(Relocalisation, FixesWhoseErrorLastsWeighLessInTheRival) {
  for (const float correlation_s : {0.0F, 60.0F}) {
    Relocalisation search;
    const auto p = filter::Symmetric<float, 3>::diagonal({1e-3F, 1e-3F, 1e-4F});
    filter::Innovation<float, 2> refused;
    refused.verdict = filter::Verdict::kRejected, refused.nis = 1000, refused.gate = 9.2F;
    search.note({}, p);
    for (std::uint8_t id = 0; id < 2; ++id) {
      const float along_m = id == 0 ? 3.0F : 5.0F, aside_m = id == 0 ? 2.0F : -1.0F;
      model::RangeBearing seen{.sigma_range_m = 0.1F,
                               .sigma_bearing_rad = 0.02F,
                               .landmark = {.x = base::Anchored{}.plus(along_m), .y = base::Anchored{}.plus(aside_m)}};
      const auto exact = seen.predict({});
      seen.range_m = exact(0), seen.bearing_rad = exact(1);
      EXPECT_FALSE(search.add(seen, id, {1'000'000 + 100'000 * id}, refused, true));
    }
    ASSERT_EQ(search.last_fused_fix().us, 0);
    for (int k = 1; k <= 100; ++k)
      search.add(model::GnssPosition{.sigma_m = 0.05F}, {1'100'000 + 200'000 * k}, 9.2F, correlation_s);
    EXPECT_EQ(search.last_fused_fix().us, 21'100'000);
    const float sigma_m = base::sqrt(search.rival().p(0, 0));
    if (correlation_s > 0) {
      EXPECT_GT(sigma_m, 0.03F);
      EXPECT_LT(sigma_m, 0.06F);
    } else {
      EXPECT_LT(sigma_m, 0.006F);
    }
  }
}

}  // namespace
}  // namespace tetap::estimators
