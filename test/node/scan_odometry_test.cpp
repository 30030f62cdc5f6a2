// SPDX-License-Identifier: Apache-2.0
// A robot with a scanner, as frames in and frames out: a drive through a room whose walls are cast in double, with
// slipping wheels; scans that are lost or bad, a pose given, guards; the Intel Research Lab.
#include "tetap/estimators/mapping/scan_odometry.hpp"
#include "config/parameters/scanner.hpp"
#include "scan_robot.hpp"
#include "support/scan_room.hpp"
#include "tetap/bus/guard_sender.hpp"

#include <gtest/gtest.h>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <numbers>
#include <random>

namespace tetap::test {
namespace {

using Robot = node::Estimators<estimators::Odometry, estimators::ScanOdometry361>;
static_assert(Robot::kNeedsMapIds && !Robot::kMakesMap && estimators::MatchesScans<estimators::ScanOdometry361> &&
              node::RecordsLater<estimators::ScanOdometry361> && node::WorksInJobs<estimators::ScanOdometry361>);
static_assert(sizeof(node::Node<Robot>) < 32 * 1024, "an image of 64 kB holds it with stack and drivers");

using Driven = DrivenOf<Robot>;

struct Way {
  double x_m = 0, y_m = 0, yaw_rad = 0;
};
/// A weave, by small steps.
Way way_at(double t_s) {
  Way w{.yaw_rad = 0.6 * std::sin(0.6 * t_s)};
  for (int i = 0; i < 400; ++i) {
    const double turn = 0.6 * std::sin(0.6 * t_s * (i + 0.5) / 400), step_m = 0.25 * t_s / 400;
    w.x_m += step_m * std::cos(turn), w.y_m += step_m * std::sin(turn);
  }
  return w;
}
/// 10 s in a room: wheels that state too much by `slip`, a scanner of 10 Hz off the middle, its turn's smear.
/// `frames` may change what is sent.
Way drive(Driven& node, double slip, auto&& frames) {
  const param::LidarParameters& lidar = node.parameters.lidar;
  const double mount_x = static_cast<double>(lidar.x_b_m), mount_y = static_cast<double>(lidar.y_b_m);
  std::mt19937 random{3};
  std::normal_distribution<double> noise(0, 0.01);
  constexpr float kStep = 0.0174533F;
  const std::int64_t begin_us = node.bench.now_us;
  std::vector<std::uint16_t> ranges;
  for (int k = 0; k < 1'000; ++k) {
    const double t_s = 0.01 * k;
    Frames out;
    if (k % 10 == 0 && k > 0) {  // the turn that ends now began 0.1 s ago
      ranges.clear();
      for (int i = 0; i < 360; ++i) {
        const Way w = way_at(t_s - 0.1 + 0.1 * i / 360);
        const double c = std::cos(w.yaw_rad), s = std::sin(w.yaw_rad);
        const double x = w.x_m + c * mount_x - s * mount_y, y = w.y_m + s * mount_x + c * mount_y;
        const double bearing =
            -3.1415 + static_cast<double>(kStep) * i + w.yaw_rad + static_cast<double>(lidar.yaw_rad);
        ranges.push_back(range_steps(cast(kRoom, x - 1.5, y, bearing) + noise(random)));
      }
      out = frames(k / 10, scan_frames(begin_us + 10'000 * k - 100'000, k / 10, ranges, -3.1415F, kStep));
    }
    const Way a = way_at(t_s), b = way_at(t_s + 0.01);
    const double speed = std::hypot(b.x_m - a.x_m, b.y_m - a.y_m) / 0.01;
    node.tick(std::move(out), static_cast<float>(speed * (1 + slip)),
              static_cast<float>((b.yaw_rad - a.yaw_rad) / 0.01));
  }
  return way_at(10.0);
}
param::Parameters mounted() {
  param::Parameters n = robot::scanner::parameters;
  n.lidar.x_b_m = 0.2F, n.lidar.y_b_m = -0.1F, n.lidar.yaw_rad = 0.5F;
  return n;
}
const auto kAsTheyAre = [](int, Frames frames) { return frames; };

TEST(ScanOdometry, SeesThatWheelsSlip) {
  Driven node(mounted());
  const Way truth = drive(node, 0.2, kAsTheyAre);
  const double off_m = std::hypot(node.x_m - truth.x_m, node.y_m - truth.y_m);
  std::printf("after 2.5 m with wheels off by a fifth: %.3f m, %.2f deg, sigma %.3f m\n", off_m,
              (node.yaw_rad - truth.yaw_rad) * 180 / std::numbers::pi, static_cast<double>(node.sigma.std_x_m));
  EXPECT_LT(off_m, 0.06) << "the wheels alone: 0.5 m; those of the last 0.2 s are 0.01 m of it";
  EXPECT_NEAR(node.yaw_rad, truth.yaw_rad, 0.01);
  EXPECT_LT(off_m, 4 * static_cast<double>(node.sigma.std_x_m + node.sigma.std_y_m));
  EXPECT_LT(node.sigma.std_x_m, 0.1F);
  ASSERT_GE(node.matches.size(), 96U);
  EXPECT_EQ(node.matches.front().fate, bus::ScanFate::kFirst);
  for (std::size_t k = 1; k < node.matches.size(); ++k) {
    EXPECT_EQ(node.matches[k].fate, bus::ScanFate::kMatched) << k;
    EXPECT_EQ(node.matches[k].seq, (k + 1) % 16);
    EXPECT_GT(node.matches[k].pairs, 200);
  }
  EXPECT_TRUE((node.used & 1U << static_cast<unsigned>(sensor::Sensor::kClosure)) != 0) << "scans have its bit";
  EXPECT_TRUE(node.refused.empty());
}

TEST(ScanOdometry, IsTheSameHoweverManyUnitsATickHas) {
  param::Parameters few = mounted();
  few.loop.work_units = 3'600;
  Driven a(mounted()), b(few), again(few);
  drive(a, 0.2, kAsTheyAre);
  drive(b, 0.2, kAsTheyAre);
  drive(again, 0.2, kAsTheyAre);
  EXPECT_EQ(b.crcs, again.crcs);
  EXPECT_NE(a.crcs, b.crcs) << "matches end in other ticks";
  ASSERT_EQ(a.matches.size(), b.matches.size());
  for (std::size_t k = 0; k < a.matches.size(); ++k) EXPECT_EQ(a.matches[k].pairs, b.matches[k].pairs) << k;
}

TEST(ScanOdometry, GoesOnByWheelsWhereScansAreMissingEmptyOrBroken) {
  for (const int kind : {0, 1, 2}) {
    Driven node(mounted());
    const Way truth = drive(node, 0.0, [&](int scan, Frames frames) {
      if (scan < 30 || scan > 60) return frames;
      if (kind == 0) return Frames{};
      if (kind == 1) frames.erase(frames.begin() + 40);
      if (kind == 2)
        frames = scan_frames(node.bench.now_us - 90'000, scan, std::vector<std::uint16_t>(360, 0), -3.1F, 0.0174F);
      return frames;
    });
    EXPECT_NEAR(node.x_m, truth.x_m, 0.05) << kind;
    EXPECT_NEAR(node.y_m, truth.y_m, 0.05) << kind;
    const auto empty = std::count_if(node.matches.begin(), node.matches.end(),
                                     [](const auto& m) { return m.fate == bus::ScanFate::kFewPairs; });
    EXPECT_EQ(empty, kind == 2 ? 31 : 0);
    EXPECT_EQ(std::count(node.refused.begin(), node.refused.end(), sensor::Verdict::kRejected), 0) << "no gate failed";
  }
}

TEST(ScanOdometry, KeepsTheGivenPoseWithAMatchUnderWay) {
  Driven node(mounted());
  drive(node, 0.0, [&](int scan, Frames frames) {
    if (scan == 50)
      for (const auto& frame : set_pose(1, 4'000, -7'000, 1.0F, 0.001F, 0.001F)) frames.push_back(frame);
    return frames;
  });
  const Way from = way_at(5.01), truth = way_at(10.0);  // what was driven since, from the pose that was given
  const double c = std::cos(1.0 - from.yaw_rad), s = std::sin(1.0 - from.yaw_rad);
  const double dx = truth.x_m - from.x_m, dy = truth.y_m - from.y_m;
  EXPECT_NEAR(node.x_m, 4 + c * dx - s * dy, 0.05);
  EXPECT_NEAR(node.y_m, -7 + s * dx + c * dy, 0.05);
  EXPECT_NEAR(node.yaw_rad, 1.0 + truth.yaw_rad - from.yaw_rad, 0.02);
  EXPECT_EQ(node.matches.back().fate, bus::ScanFate::kMatched);
}

TEST(ScanOdometry, UsesAGuardedScanWithItsGuardAlone) {
  param::Parameters n = robot::scanner::parameters;
  n.bus.guard = 1;
  BenchOf<node::WithBusProtection<Robot>> bench(n);
  bench.idle(2);
  bus::GuardSender sender;
  int matches = 0;
  const auto send = [&](int seq, bool guard, bool damaged) {
    Frames frames = scan_frames(bench.now_us, seq, std::vector<std::uint16_t>(360, 400), -3.1F, 0.0174F);
    std::optional<bus::InGuardSample> made;
    for (const auto& frame : frames)
      if (const auto last = sender.after(static_cast<std::uint8_t>(frame.id - 0x300), frame)) made = last;
    ASSERT_TRUE(made.has_value());
    if (damaged) frames[20].data[4] ^= 1U;
    if (guard) frames.insert(frames.begin(), in(*made));
    Frames out = bench.epoch(frames);
    for (const auto& frame : bench.idle(20)) out.push_back(frame);
    matches = static_cast<int>(all<bus::EstScanMatch>(out).size());
  };
  send(1, false, false);
  EXPECT_EQ(matches, 0);
  send(2, true, false);
  EXPECT_EQ(matches, 1);
  const auto refused = bench.node.counters().guard_bad;
  send(3, true, true);
  EXPECT_EQ(matches, 0);
  EXPECT_EQ(bench.node.counters().guard_bad, refused + 1);
}

TEST(ScanOdometry, MeetsTheRelationsOfTheIntelLab) {
  const std::string name = imported_scans("intel_gfs.json.xz", "--relations", "intel.relations");
  if (name.empty()) GTEST_SKIP() << "scans is not in $TETAP_DATA";
  const auto rows = read_rows(name + ".scans"), relations = read_rows(name + ".relations");
  ASSERT_EQ(rows.size(), 911U) << name;
  Driven node(recorded(robot::scanner::parameters));
  const std::vector<Place> track = replayed(node, rows);
  double near_m = 0, near_rad = 0, near = 0, all_m = 0, all_rad = 0;
  for (const auto& r : relations) {
    const Place d = seen_from(track[static_cast<std::size_t>(r[0])], track[static_cast<std::size_t>(r[1])]);
    const double m = std::hypot(d.x - r[2], d.y - r[3]);
    const double rad = std::abs(std::remainder(d.yaw - r[4], 2 * std::numbers::pi));
    all_m += m / 105, all_rad += rad / 105;
    if (std::abs(r[1] - r[0]) <= 3) near_m += m, near_rad += rad, near += 1;
  }
  const double deg = 180 / std::numbers::pi;
  std::printf("Intel on the node: %.0f neighbours %.4f m, %.3f deg; all %.3f m, %.2f deg\n", near, near_m / near,
              near_rad / near * deg, all_m, all_rad * deg);
  EXPECT_EQ(near, 78);
  EXPECT_LE(near_m / near, 0.014);
  EXPECT_LE(near_rad / near * deg, 0.45);
  EXPECT_LE(all_m, 0.25);
  EXPECT_LE(all_rad * deg, 1.5);
}

TEST(ScanOdometry, DriftsLittleOverTwoHundredMetres) {
  const std::string name = imported_scans("simul.rawlog", "--truth", "simul.rawlog.GT.txt");
  if (name.empty()) GTEST_SKIP() << "scans/simul.rawlog is not in $TETAP_DATA";
  const auto rows = read_rows(name + ".scans"), truth = read_rows(name + ".truth");
  ASSERT_EQ(rows.size(), truth.size() + 1) << name;
  param::Parameters n = recorded(robot::scanner::parameters);
  n.lidar.x_b_m = 0.2F;  // scanner_b of the log
  Driven node(n);
  const std::vector<Place> track = replayed(node, rows);
  double worst_m = 0, worst_rad = 0;
  for (std::size_t k = 0; k < track.size(); ++k) {
    worst_m = std::max(worst_m, std::hypot(track[k].x - truth[k][0], track[k].y - truth[k][1]));
    worst_rad = std::max(worst_rad, std::abs(std::remainder(track[k].yaw - truth[k][2], 2 * std::numbers::pi)));
  }
  std::printf("simul on the node, 197 m: at most %.3f m, %.2f deg off\n", worst_m, worst_rad * 180 / std::numbers::pi);
  EXPECT_LE(worst_m, 1.5);
  EXPECT_LE(worst_rad * 180 / std::numbers::pi, 3.0);
}

}  // namespace
}  // namespace tetap::test
