// SPDX-License-Identifier: Apache-2.0
#include "sim_host/world/course.hpp"

#include "sim_host/world/math.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

namespace tetap::sim {
namespace {

constexpr base::Micros kStep{2'000};

TEST(Course, the_default_path_is_continuous_in_position_and_heading) {
  const Plan plan{default_course(), {}};
  for (double s = 0; s + 0.01 <= plan.length_m(); s += 0.01) {
    const PathPoint a = plan.path(s);
    const PathPoint b = plan.path(s + 0.01);
    const double chord = sim::sqrt((b.x_m - a.x_m) * (b.x_m - a.x_m) + (b.y_m - a.y_m) * (b.y_m - a.y_m));
    ASSERT_NEAR(chord, 0.01, 1e-5) << s;
    ASSERT_LE(magnitude(b.yaw_rad - a.yaw_rad), 0.01 / 0.6 + 1e-9) << s;
  }
}

TEST(Course, the_default_course_fits_a_yard_and_comes_home) {
  const Course course = default_course();
  const Plan plan{course, {}};
  for (double s = 0; s <= plan.length_m(); s += 0.1) {
    const PathPoint p = plan.path(s);
    ASSERT_TRUE(p.x_m >= -6 && p.x_m <= 54 && p.y_m >= -6 && p.y_m <= 34) << s;
  }
  const PathPoint end = plan.path(plan.length_m());
  EXPECT_LT(sim::sqrt(end.x_m * end.x_m + end.y_m * end.y_m), 1);
  EXPECT_GE(plan.duration().us, 180'000'000);
  EXPECT_LE(plan.duration().us, 240'000'000);
  EXPECT_GE(course.landmarks.size(), 12U);
  EXPECT_LE(course.landmarks.size(), 20U);
  std::set<int> ids;
  for (const auto& landmark : course.landmarks) ids.insert(landmark.id);
  EXPECT_EQ(ids.size(), course.landmarks.size());
}

TEST(Course, no_landmark_stands_in_the_way) {
  const Course course = default_course();
  const Plan plan{course, {}};
  for (double s = 0; s <= plan.length_m(); s += 0.1)
    for (const auto& l : course.landmarks) {
      const PathPoint p = plan.path(s);
      ASSERT_GT((l.x_m - p.x_m) * (l.x_m - p.x_m) + (l.y_m - p.y_m) * (l.y_m - p.y_m), 1.5 * 1.5)
          << "landmark " << int{l.id};
    }
}

TEST(Course, the_plan_keeps_every_limit_and_uses_each_of_them) {
  for (const double speed : {0.5, 2.0, 5.0}) {
    const CourseLimits limits{.speed_mps = speed};
    const Plan plan{default_course(), limits};
    double top = 0, top_lateral = 0, top_turn = 0;
    for (base::Micros t; t <= plan.duration(); t += kStep) {
      const PlanPoint p = plan.at(t);
      const double bend = magnitude(plan.path(p.s_m).curvature_per_m);
      ASSERT_LE(magnitude(p.acceleration_mps2), limits.acceleration_mps2 * 1.001) << t.us;
      // A corner begins between two nodes of the plan, 2 cm apart.
      ASSERT_LE(p.speed_mps * p.speed_mps * bend, limits.lateral_mps2 + 2 * 0.02 * bend) << t.us;
      top = std::max(top, p.speed_mps);
      top_lateral = std::max(top_lateral, p.speed_mps * p.speed_mps * bend);
      top_turn = std::max(top_turn, p.speed_mps * bend);
    }
    EXPECT_LE(top, speed * (1 + 1e-12));
    EXPECT_GE(top, speed * 0.95);
    if (speed >= 2) {
      EXPECT_GE(top_lateral, 0.95 * limits.lateral_mps2);
      EXPECT_GE(top_turn, 1.0);
    }
  }
}

TEST(Course, speed_is_the_derivative_of_path_length) {
  const Plan plan{default_course(), {}};
  for (base::Micros t; t + kStep <= plan.duration(); t += kStep) {
    const PlanPoint a = plan.at(t);
    const PlanPoint b = plan.at(t + kStep);
    ASSERT_NEAR((b.s_m - a.s_m) / 2e-3, 0.5 * (a.speed_mps + b.speed_mps), 2e-3) << t.us;
  }
}

TEST(Course, the_rover_stands_at_the_start_in_the_middle_and_at_the_end) {
  const Plan plan{default_course(), {}};
  double parked_s = 0;
  int stands = 0;
  bool before = false;
  for (base::Micros t; t < plan.duration(); t += kStep) {
    const bool parked = plan.at(t).parked;
    stands += parked && !before ? 1 : 0;
    parked_s += parked ? 2e-3 : 0;
    before = parked;
  }
  EXPECT_EQ(stands, 3);
  EXPECT_NEAR(parked_s, 10 + 12 + 8, 0.05);
}

TEST(Course, time_at_is_the_inverse_of_at) {
  const Plan plan{default_course(), {}};
  for (double s = 0.5; s < plan.length_m(); s += 7.3) EXPECT_NEAR(plan.at(plan.time_at(s)).s_m, s, 0.021);
}

TEST(Course, a_course_that_cannot_be_driven_is_refused_with_the_waypoint) {
  const auto message = [](std::vector<Waypoint> waypoints) {
    return Plan::refusal({.waypoints = std::move(waypoints), .landmarks = {}});
  };
  EXPECT_NE(
      message({{.x_m = 0}, {.x_m = 2, .radius_m = 3}, {.x_m = 2, .y_m = 9}}).find("waypoint 1: its arc does not fit"),
      std::string::npos);
  EXPECT_NE(message({{.x_m = 0}, {.x_m = 2}, {.x_m = 2, .y_m = 9}}).find("waypoint 1: a corner without a radius"),
            std::string::npos);
  EXPECT_NE(message({{.x_m = 0}, {.x_m = 9, .radius_m = 1, .stop_s = 1}, {.x_m = 9, .y_m = 9}})
                .find("waypoint 1: a standstill"),
            std::string::npos);
  EXPECT_NE(message({{.x_m = 0}}), "");
  EXPECT_EQ(Plan::refusal(default_course()), "");
  EXPECT_DEATH((Plan{{.waypoints = {}, .landmarks = {}}, {}}), "");
}

TEST(Course, laps_follow_each_other_with_a_standstill_between) {
  const Plan once{default_course(), {}};
  const Plan thrice{default_course(3), {}};
  EXPECT_NEAR(static_cast<double>(thrice.duration().us) / static_cast<double>(once.duration().us), 3, 0.15);
  EXPECT_GE(thrice.duration().us, 600'000'000);
  int standstills = 0;
  bool parked = false;
  for (base::Micros t; t < thrice.duration(); t += base::Micros{100'000}) {
    const bool now = thrice.at(t).parked;
    standstills += now && !parked ? 1 : 0;
    parked = now;
  }
  EXPECT_EQ(standstills, 7);  // start, and twice a lap
}

TEST(Course, a_loop_is_as_long_as_it_was_asked_for_with_landmarks_beside_it) {
  for (const double length_m : {20.0, 60.0, 400.0}) {
    const Course course = loop_course(length_m, 3, 24);
    const Plan plan(course, {});
    EXPECT_NEAR(plan.length_m(), 3 * length_m, 1e-6);
    ASSERT_EQ(course.landmarks.size(), 24U);
    for (const Landmark& mark : course.landmarks) {
      double nearest = 1e9;
      for (double s = 0; s < length_m; s += 0.02) {
        const PathPoint at = plan.path(s);
        nearest = std::min(nearest, std::hypot(at.x_m - mark.x_m, at.y_m - mark.y_m));
      }
      EXPECT_NEAR(nearest, 2, 1.1) << "the inner side of a corner of a short loop is nearer";
    }
    for (double s = 0; s < length_m; s += 1) {
      EXPECT_NEAR(plan.path(s).x_m, plan.path(s + length_m).x_m, 1e-6);
      EXPECT_NEAR(plan.path(s).y_m, plan.path(s + length_m).y_m, 1e-6);
    }
  }
  for (const Course& none : {loop_course(19, 1, 24), loop_course(60, 1, 3), loop_course(60, 1, 255)})
    EXPECT_NE(Plan::refusal(none), "");
}

TEST(Course, the_road_is_driven_at_five_metres_a_second_for_a_minute_and_more) {
  const Plan plan{road_course(2), {.speed_mps = 5}};
  int fast = 0;
  int longest = 0;
  for (base::Micros t; t < plan.duration(); t += base::Micros{100'000}) {
    fast = plan.at(t).speed_mps > 4.9 ? fast + 1 : 0;
    longest = std::max(longest, fast);
  }
  EXPECT_GE(longest, 900);
  for (base::Micros t{300'000'000}; t < base::Micros{360'000'000}; t += base::Micros{100'000})
    ASSERT_GT(plan.at(t).speed_mps, 4.9) << t.us;
}

TEST(Course, streets_are_for_a_car_at_its_speed_with_turns_both_ways) {
  const Plan plan{street_course(1), {.speed_mps = 12, .acceleration_mps2 = 1.5, .lateral_mps2 = 2}};
  double top = 0, left = 0, right = 0;
  for (base::Micros t; t < plan.duration(); t += base::Micros{100'000}) {
    const PlanPoint p = plan.at(t);
    const double bend = plan.path(p.s_m).curvature_per_m;
    top = std::max(top, p.speed_mps);
    left = std::max(left, bend), right = std::max(right, -bend);
  }
  EXPECT_NEAR(top, 12, 0.1);
  EXPECT_NEAR(1 / left, 10, 1e-9);  // well above a car's 5.5 m
  EXPECT_NEAR(1 / right, 12, 1e-9);
  EXPECT_GE(plan.duration().us, 120'000'000);
  EXPECT_NEAR(plan.departure_s(), 10, 1e-9);
  EXPECT_NEAR(plan.arrival_s(), static_cast<double>(plan.duration().us) * 1e-6 - 8, 0.02);
  EXPECT_GT(Plan({street_course(3)}, {.speed_mps = 12}).length_m(), 2.9 * plan.length_m());
}

TEST(Course, a_flight_leaves_time_to_climb_and_to_land) {
  for (const int laps : {1, 2}) {
    const Plan plan{flight_course(laps), {.speed_mps = 5, .acceleration_mps2 = 1.5, .lateral_mps2 = 2}};
    EXPECT_NEAR(plan.departure_s(), 24, 1e-9);
    EXPECT_NEAR(plan.arrival_s(), static_cast<double>(plan.duration().us) * 1e-6 - 24, 0.02);
    EXPECT_GE(plan.duration().us, 120'000'000 * laps);
  }
}

}  // namespace
}  // namespace tetap::sim
