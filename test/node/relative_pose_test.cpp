// SPDX-License-Identifier: Apache-2.0
// Displacements between stamps as frames of another computer: drift of bad wheels, late ones, those beyond the window.
#include "bench.hpp"
#include "support/relative_frames.hpp"
#include "tetap/estimators/planar/cloning_pose_ekf.hpp"

#include <gtest/gtest.h>
#include <algorithm>
#include <cmath>
#include <random>

namespace tetap::test {
namespace {

using Robot = node::Estimators<estimators::Odometry, estimators::CloningPoseEkf>;
using RelativeBench = BenchOf<Robot>;
static_assert(Robot::kNeedsMapIds && node::Node<Robot>::takes_map_input(bus::InRelativePose::kOffset) &&
              node::Node<Robot>::takes_map_input(bus::InRelativePoseStdY::kOffset) &&
              !node::Node<node::Estimators<estimators::Odometry, estimators::PoseEkf>>::takes_map_input(
                  bus::InRelativePose::kOffset));

param::Parameters numbers() {
  param::Parameters n = kNumbers;
  n.wheels.noise = {.speed = 0.02F, .yaw_rate = 0.02F};
  n.wheels.hold = param::Hold::kBackward;
  return n;
}
/// A circle at 1 m/s and 0.5 rad/s, by wheels that state a tenth too much and a turn that is wrong; ten displacements a
/// second, each `late_us` after its end.
std::vector<Frames> drive(int epochs, std::int64_t late_us, double wrong_m = 0) {
  std::vector<Frames> all(static_cast<std::size_t>(epochs));
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (int k = 0; k < epochs; ++k) {
    const std::int64_t t = RelativeBench::kStart_us + 10'000 * (k + 1);
    auto& frames = all[static_cast<std::size_t>(k)];
    if (k == 0) frames = set_pose(1, 0, 0, 0.0F, 0.01F, 0.005F);
    frames.push_back(body_speed(t - 3'000, 1.1F, 0.53F, k));
    if (k % 10 != 5 || k >= epochs - 30) continue;  // the last one has come, however late
    const double turn = 0.05, way = 0.1, bad = k % 100 == 55 ? wrong_m : 0;
    const Relative r{.x_m = static_cast<float>(way * std::sin(turn) / turn + bad + 0.005 * normal(random)),
                     .y_m = static_cast<float>(way * (1 - std::cos(turn)) / turn + 0.005 * normal(random)),
                     .yaw_rad = static_cast<float>(turn + 0.002 * normal(random)),
                     .sigma_x_m = 0.005F,
                     .sigma_y_m = 0.005F,
                     .sigma_yaw_rad = 0.002F};
    const auto then = static_cast<std::size_t>(k + late_us / 10'000);
    if (then < all.size())
      for (const auto& frame : relative_frames(t - 104'000, t - 4'000, k / 10, r)) all[then].push_back(frame);
  }
  return all;
}
struct Driven {
  RelativeBench bench{numbers};
  static inline const param::Parameters numbers = test::numbers();
  Frames out;
  Driven(int epochs, std::int64_t late_us, double wrong_m = 0) {
    for (const auto& frames : drive(epochs, late_us, wrong_m))
      for (const auto& frame : bench.epoch(frames)) out.push_back(frame);
    for (const auto& frame : bench.idle(40)) out.push_back(frame);
  }
  [[nodiscard]] double off_m(double t_s) const {
    const auto pos = last<bus::EstPos>(out, 1);
    return std::hypot(1e-3 * pos->x_raw - 2 * std::sin(0.5 * t_s), 1e-3 * pos->y_raw - 2 * (1 - std::cos(0.5 * t_s)));
  }
  [[nodiscard]] long count(sensor::Verdict verdict) const {
    long n = 0;
    for (const auto& one : all<bus::EstInnov>(out))
      n += one.sensor == sensor::Sensor::kRelativePose && one.verdict == verdict ? 1 : 0;
    return n;
  }
};

TEST(RelativePoses, TakeTheDriftOfBadWheelsAway) {
  // The wheels' held speed of 0.36 s at the end is the wheels' own.
  const Driven node(600, 0);
  std::vector<Frames> alone = drive(600, 100'000'000);
  RelativeBench bench(Driven::numbers);
  Frames out;
  for (const auto& frames : alone)
    for (const auto& frame : bench.epoch(frames)) out.push_back(frame);
  const auto without = last<bus::EstPos>(out, 1);
  const double wheels =
      std::hypot(1e-3 * without->x_raw - 2 * std::sin(3.0), 1e-3 * without->y_raw - 2 * (1 - std::cos(3.0)));
  EXPECT_GT(wheels, 0.3);
  const auto best = [&] {
    double least = 1e9;
    for (int k = 0; k < 60; ++k) least = std::min(least, node.off_m(5.9 + 0.01 * k));
    return least;
  }();
  EXPECT_LT(best, 0.12);
  EXPECT_EQ(node.count(sensor::Verdict::kAccepted), 56);
  EXPECT_EQ(node.count(sensor::Verdict::kRejected), 0);
}

TEST(RelativePoses, ALateOneEndsInTheSameStateAsOneOnTime) {
  const Driven on_time(400, 0), late(400, 150'000);
  EXPECT_EQ(last<bus::EstStateCrc>(on_time.out)->crc, last<bus::EstStateCrc>(late.out)->crc);
  EXPECT_EQ(late.count(sensor::Verdict::kTooLate), 0);
}

TEST(RelativePoses, OnesBeyondTheWindowAreRefusedAndCounted) {
  const Driven node(400, 260'000);
  EXPECT_EQ(node.count(sensor::Verdict::kAccepted), 0);
  EXPECT_GE(node.count(sensor::Verdict::kTooLate), 35);
}

TEST(RelativePoses, WrongOnesAreRefusedByTheGateAndLeaveThePoseAlone) {
  const Driven right(600, 0), wrong(600, 0, 2.0);
  EXPECT_EQ(wrong.count(sensor::Verdict::kRejected), 6);
  EXPECT_EQ(wrong.count(sensor::Verdict::kAccepted), 50);
  const auto a = last<bus::EstPos>(right.out, 1), b = last<bus::EstPos>(wrong.out, 1);
  EXPECT_LT(std::hypot(a->x_raw - b->x_raw, a->y_raw - b->y_raw), 250);
}

}  // namespace
}  // namespace tetap::test
