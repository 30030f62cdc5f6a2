// SPDX-License-Identifier: Apache-2.0
// The scanner measures what plane geometry says, each beam at its own time; its faults are what they are called.
#include "sim_host/world/lidar.hpp"

#include "sim_host/world/floor_plan.hpp"
#include "test/sim/support.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

namespace tetap::sim {
namespace {

using std::numbers::pi;
constexpr double kHalf_m = 4;  // of the square room's side

LidarNumbers exact() {
  return {.rate_hz = 10, .x_b_m = 0, .sigma_m = 0, .dropout_probability = 0, .mount_error_rad = 0, .phase = {}};
}

Course in_walls(std::vector<Wall> walls) {
  Course course = parked_course(10);
  course.landmarks.clear();
  course.walls = std::move(walls);
  return course;
}

Course square_room() {
  std::vector<Wall> walls;
  add_box(walls, -kHalf_m, -kHalf_m, kHalf_m, kHalf_m);
  return in_walls(std::move(walls));
}

struct Scene {
  explicit Scene(const Course& course, LidarNumbers numbers = exact(), PeopleNumbers people = {},
                 std::vector<FaultSetting> settings = {})
      : surroundings{course, Plan{course, {}}, people, 1},
        lidar{numbers, surroundings, 1},
        faults{std::move(settings)} {}

  /// The first scan, with the poses of `path` at times in seconds.
  Lidar::Scan scan(const std::function<Truth(double)>& path) {
    for (base::Micros now;; now += base::Micros{500}) {
      const double t = static_cast<double>(now.us) * 1e-6;
      if (auto whole = lidar.sense(path(t), path(t + 500e-6), now, now + base::Micros{500}, faults)) return *whole;
    }
  }
  Surroundings surroundings;
  Lidar lidar;
  Faults faults;
};

Truth standing(double) { return {}; }
double bearing(const Lidar::Scan& scan, std::size_t beam) {
  return scan.head.first * 0.0005 + scan.head.step * 0.00001 * static_cast<double>(beam);
}
double metres(std::uint16_t range) { return range * 0.005; }
/// From the middle of the square room.
double to_square(double angle) { return kHalf_m / std::max(std::abs(std::cos(angle)), std::abs(std::sin(angle))); }

TEST(Lidar, a_beam_meets_a_wall_at_the_distance_over_the_cosine_of_its_angle) {
  const double distance_m = 3, lean_rad = 0.3;  // the wall's normal leans so far to the left of the x axis
  const double nx = std::cos(lean_rad), ny = std::sin(lean_rad);
  const Wall wall{.from_x_m = distance_m * nx + 20 * ny,
                  .from_y_m = distance_m * ny - 20 * nx,
                  .to_x_m = distance_m * nx - 20 * ny,
                  .to_y_m = distance_m * ny + 20 * nx};
  Scene scene{in_walls({wall})};
  const auto scan = scene.scan(standing);
  ASSERT_EQ(scan.ranges.size(), 360U);
  int returns = 0;
  for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
    const double cosine = std::cos(bearing(scan, i) - lean_rad);
    const bool there = cosine > 0.06 && distance_m / cosine < 11.9;
    if (there) {
      EXPECT_NEAR(metres(scan.ranges[i]), distance_m / cosine, 0.0026) << i;
    }
    if (cosine < 0.05 || distance_m / cosine > 12.1) {
      EXPECT_EQ(scan.ranges[i], 0) << i;
    }
    returns += there ? 1 : 0;
  }
  EXPECT_NEAR(returns, 2 * std::acos(3 / 12.0) / (2 * pi) * 360, 4);
}

TEST(Lidar, a_turn_at_constant_rate_smears_the_scan_by_rate_times_time_of_the_beam) {
  for (const double rate_radps : {1.0, -2.5}) {
    Scene scene{square_room()};
    const auto scan = scene.scan([rate_radps](double t) { return Truth{.yaw_rad = wrap(rate_radps * t)}; });
    for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
      const double t_s = 0.1 * static_cast<double>(i) / (2 * pi / 0.01745);
      ASSERT_NEAR(metres(scan.ranges[i]), to_square(bearing(scan, i) + rate_radps * t_s), 0.0027) << i;
    }
  }
}

TEST(Lidar, a_drive_at_constant_speed_smears_it_by_the_way) {
  Scene scene{square_room()};
  const auto scan = scene.scan([](double t) { return Truth{.x_m = 2 * t}; });
  for (const std::size_t i : {0U, 10U, 180U, 190U, 359U}) {
    const double x_m = 2 * 0.1 * static_cast<double>(i) * 0.01745 / (2 * pi), cosine = std::cos(bearing(scan, i));
    EXPECT_NEAR(metres(scan.ranges[i]), (kHalf_m - x_m * (cosine > 0 ? 1 : -1)) / std::abs(cosine), 0.0027) << i;
  }
}

TEST(Lidar, its_mounting_moves_and_turns_it) {
  LidarNumbers numbers = exact();
  numbers.x_b_m = 0.3, numbers.y_b_m = -0.2, numbers.yaw_rad = 0.5;
  numbers.clockwise = false;
  Scene scene{square_room(), numbers};
  const auto scan = scene.scan([](double) { return Truth{.x_m = 1, .y_m = -1, .yaw_rad = pi / 2}; });
  const double x_m = 1 + 0.2, y_m = -1 + 0.3;
  for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
    const double a = pi / 2 + 0.5 + 0.01745 * static_cast<double>(i), c = std::cos(a), s = std::sin(a);
    const double right = ((c > 0 ? kHalf_m : -kHalf_m) - x_m) / c, up = ((s > 0 ? kHalf_m : -kHalf_m) - y_m) / s;
    ASSERT_NEAR(metres(scan.ranges[i]), std::min(right, up), 0.0027) << i;
  }
}

TEST(Lidar, noise_and_dropouts_are_as_large_as_stated) {
  LidarNumbers numbers = exact();
  numbers.sigma_m = 0.02, numbers.dropout_probability = 0.05;
  Scene scene{square_room(), numbers};
  std::vector<double> errors;
  double lost = 0, all = 0;
  for (int k = 0; k < 50; ++k) {
    const auto scan = scene.scan(standing);
    for (std::size_t i = 0; i < scan.ranges.size(); ++i, ++all)
      if (scan.ranges[i] == 0)
        ++lost;
      else
        errors.push_back(metres(scan.ranges[i]) - to_square(bearing(scan, i)));
    scene.lidar = Lidar{numbers, scene.surroundings, static_cast<std::uint64_t>(k) + 2};
  }
  EXPECT_NEAR(lost / all, 0.05, 4 * std::sqrt(0.05 / all));
  const Statistics s = statistics(errors);
  EXPECT_NEAR(s.mean, 0, 4 * 0.02 / std::sqrt(all));
  EXPECT_NEAR(std::sqrt(s.variance), std::hypot(0.02, 0.005 / std::sqrt(12.0)), 0.0004);
}

TEST(Lidar, a_pane_returns_square_beams_loses_some_and_lets_the_others_through) {
  std::vector<Wall> walls;
  add_box(walls, -kHalf_m, -kHalf_m, kHalf_m, kHalf_m);
  walls.push_back({.from_x_m = 2, .from_y_m = -3.9, .to_x_m = 2, .to_y_m = 3.9, .surface = Surface::kGlass});
  int square = 0, none = 0, through = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Scene scene{in_walls(walls)};
    scene.lidar = Lidar{exact(), scene.surroundings, seed};
    const auto scan = scene.scan(standing);
    for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
      const double a = bearing(scan, i), cosine = std::cos(a), range_m = metres(scan.ranges[i]);
      if (cosine < std::cos(1.05)) continue;  // beside the pane
      if (cosine > 0.9801) {
        EXPECT_NEAR(range_m, 2 / cosine, 0.0026);
        ++square;
      } else if (cosine < 0.9799) {
        scan.ranges[i] == 0 ? ++none : ++through;
        if (scan.ranges[i] > 0) {
          EXPECT_NEAR(range_m, to_square(a), 0.0026);
        }
      }
    }
  }
  EXPECT_GT(square, 400);
  EXPECT_NEAR(through / static_cast<double>(none + through), 0.6, 0.04);
}

TEST(Lidar, a_person_is_a_disc_that_walks_at_its_speed) {
  Scene scene{square_room(), exact(), {.count = 1, .beside_m = 2}};
  const Vector3 at = scene.surroundings.person_at(0, {});
  const Vector3 later = scene.surroundings.person_at(0, {100'000});
  EXPECT_NEAR(std::hypot(later[0] - at[0], later[1] - at[1]), 0.1, 1e-9);
  LidarNumbers fast = exact();
  fast.rate_hz = 2000;
  Scene still{square_room(), fast, {.count = 1, .beside_m = 2}};
  const auto scan = still.scan(standing);
  const double distance_m = std::hypot(at[0], at[1]), towards = std::atan2(at[1], at[0]);
  int hits = 0;
  for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
    const double off = wrap(bearing(scan, i) - towards);
    if (std::abs(off) > std::asin(0.2 / distance_m) - 0.005) continue;
    // Law of cosines: r^2 - 2 r d cos(off) + d^2 = R^2.
    const double d = distance_m, r = metres(scan.ranges[i]);
    EXPECT_NEAR(r * r - 2 * r * d * std::cos(off) + d * d, 0.04, 0.01) << i;
    EXPECT_LT(r, d);
    ++hits;
  }
  EXPECT_GE(hits, 8);
}

TEST(Lidar, scans_of_a_run_are_whole_and_equally_spaced_with_all_blocks_in_order) {
  World::Options options;
  options.course = lab_course(1);
  options.parameters.lidar.rate_hz = 10;
  std::int64_t last_us = 0;
  int scans = 0, block = 90, sequence = 0;
  for (const Measurement& m : run(options, 3, seconds_us(20))) {
    if (const auto* head = std::get_if<ScanHead>(&m.value)) {
      EXPECT_EQ(block, 90) << "all of the one before";
      EXPECT_EQ(head->count, 360);
      EXPECT_EQ(head->step, -1745);
      if (scans > 0) {
        EXPECT_EQ(m.stamp.us - last_us, 100'000);
      }
      EXPECT_GT((m.arrival - m.stamp).us, 99'000) << "after its last beam";
      last_us = m.stamp.us, block = 0, sequence = m.sequence;
      ++scans;
    } else if (const auto* ranges = std::get_if<ScanBlock>(&m.value)) {
      EXPECT_EQ(ranges->block, block++);
      EXPECT_EQ(m.sequence, sequence);
    }
  }
  EXPECT_NEAR(scans, 198, 2);
}

TEST(LidarFaults, covered_mirrored_turned_and_in_glass) {
  const auto with = [](std::vector<Fault> faults) {
    std::vector<FaultSetting> settings;
    for (const Fault f : faults) settings.push_back({f, {}, seconds_us(1)});
    std::vector<Wall> walls;
    add_box(walls, -2, -3, 4, 5);
    Scene scene{in_walls(walls), exact(), {}, std::move(settings)};
    return scene.scan(standing).ranges;
  };
  const auto right = with({}), mirrored = with({Fault::kLidarMirrored}), turned = with({Fault::kLidarTurned});
  const auto covered = with({Fault::kLidarCovered}), glass = with({Fault::kLidarGlass});
  double none = 0, far = 0, square = 0;
  for (std::size_t i = 0; i < right.size(); ++i) {
    EXPECT_EQ(covered[i], 0);
    if (i >
        0) {  // 360 steps are 1 mrad short of a turn: the beams of a mirror image lie beside those of the other half
      EXPECT_NEAR(metres(mirrored[i]), metres(right[360 - i]), 0.02) << i;
    }
    EXPECT_NEAR(metres(turned[(i + 90) % 360]), metres(right[i]), 0.02) << i;
    glass[i] == 0 ? ++none : glass[i] > right[i] ? ++far : ++square;
  }
  EXPECT_EQ(with({Fault::kLidarMirrored, Fault::kLidarCovered}), covered);
  EXPECT_GT(none, 90);
  EXPECT_GT(far, 120);
  EXPECT_GT(square, 60);
}

TEST(FloorPlan, courses_keep_clear_of_walls) {
  for (const Course& course : {lab_course(2), corridor_course(), default_course(), loop_course(100, 1, 63)}) {
    const Plan plan{course, {}};
    const Surroundings all{course, plan, {}, 1};
    for (double s = 0; s < plan.length_m(); s += 0.1) {
      const PathPoint at = plan.path(s);
      for (int k = 0; k < 24; ++k) {
        const double a = 2 * pi * k / 24;
        const auto hit = all.nearest({{at.x_m, at.y_m, 0.25}, {std::cos(a), std::sin(a), 0}}, {}, false);
        ASSERT_TRUE(hit);
        ASSERT_GT(hit->range_m, 0.4) << at.x_m << " " << at.y_m;
      }
    }
  }
}

}  // namespace
}  // namespace tetap::sim
