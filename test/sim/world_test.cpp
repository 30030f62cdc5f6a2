// SPDX-License-Identifier: Apache-2.0
// Laws of motion and of the world as a whole; what single sensors do is in sensors_test.cpp.
#include "sim_host/world/world.hpp"

#include "config/parameters/rover.hpp"
#include "config/parameters/rover_landmarks.hpp"
#include "config/parameters/visual.hpp"
#include "sim_host/simulated_robot.hpp"
#include "test/sim/support.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <utility>
#include <variant>

namespace tetap::sim {
namespace {

World::Options quiet(Parameters parameters = perfect()) {
  return {.mismatched = true, .latency = false, .parameters = parameters};
}

double distance_m(const Truth& a, const Truth& b) {
  return sim::sqrt((a.x_m - b.x_m) * (a.x_m - b.x_m) + (a.y_m - b.y_m) * (a.y_m - b.y_m));
}

TEST(World, a_circle_is_driven_as_a_circle) {
  World::Options options = quiet();
  options.course = circle_course(4, 3);
  World world{options, 1};
  std::vector<Measurement> arrived;
  int checked = 0;
  for (base::Micros t = world.start(); t < world.start() + world.duration(); t += base::Micros{10'000}) {
    world.advance_to(t, arrived);
    const PlanPoint wanted = world.plan().at(t - world.start());
    if (wanted.s_m < 5 + 8 * kPi || wanted.s_m > 5 + 20 * kPi) continue;  // the second turn and half of the third
    const Truth truth = world.truth();
    const double radius = sim::sqrt(truth.x_m * truth.x_m + (truth.y_m - 4) * (truth.y_m - 4));
    ASSERT_NEAR(radius, 4, 0.02);
    ASSERT_NEAR(truth.speed_mps / truth.yaw_rate_radps, 4, 0.02);
    ASSERT_NEAR(sim::sin(truth.yaw_rad), truth.x_m / radius, 0.02);
    ASSERT_NEAR(sim::cos(truth.yaw_rad), -(truth.y_m - 4) / radius, 0.02);
    ++checked;
  }
  EXPECT_GT(checked, 1500);
}

TEST(World, truth_is_the_integral_of_its_own_velocity) {
  World world{{}, 3};
  std::vector<Measurement> arrived;
  world.advance_to(world.start() + seconds_us(9), arrived);
  Truth before = world.truth();
  double x = before.x_m, y = before.y_m;
  for (base::Micros t = world.start() + seconds_us(9); t <= world.start() + world.duration(); t += base::Micros{500}) {
    world.advance_to(t, arrived);
    const Truth now = world.truth();
    x += 250e-6 * (before.v_n_mps[0] + now.v_n_mps[0]);
    y += 250e-6 * (before.v_n_mps[1] + now.v_n_mps[1]);
    before = now;
    ASSERT_NEAR(x, now.x_m, 1e-4);
    ASSERT_NEAR(y, now.y_m, 1e-4);
  }
}

TEST(World, doubling_the_integration_rate_moves_the_pose_by_less_than_a_millimetre) {
  World::Options options;
  World once{options, 5};
  options.substeps = 2;
  World twice{options, 5};
  std::vector<Measurement> arrived;
  double worst_m = 0;
  double worst_rad = 0;
  for (base::Micros t = once.start(); t < once.start() + once.duration(); t += base::Micros{100'000}) {
    once.advance_to(t, arrived);
    twice.advance_to(t, arrived);
    worst_m = std::max(worst_m, distance_m(once.truth(), twice.truth()));
    worst_rad = std::max(worst_rad, magnitude(wrap(once.truth().yaw_rad - twice.truth().yaw_rad)));
  }
  RecordProperty("worst_um", static_cast<int>(worst_m * 1e6));
  EXPECT_LT(worst_m, 1e-3);
  EXPECT_LT(worst_rad, 1e-3);
  EXPECT_GT(worst_m, 0);  // or the option did nothing
}

TEST(World, without_slip_the_wheels_travel_what_the_rover_travels) {
  World world{quiet(), 1};
  std::vector<Measurement> arrived;
  world.advance_to(world.start() + base::Micros{8'500}, arrived);
  double left = 0, right = 0, path = 0, turned = 0;
  std::optional<sensor::WheelCounts> last;
  Truth before = world.truth();
  for (base::Micros t = world.start() + base::Micros{8'500}; t < world.start() + world.duration();
       t += base::Micros{10'000}) {
    arrived.clear();
    world.advance_to(t, arrived);
    const Truth now = world.truth();
    path += 0.5 * (before.speed_mps + now.speed_mps) * 0.01;
    turned += wrap(now.yaw_rad - before.yaw_rad);
    before = now;
    for (const auto& m : arrived)
      if (const auto* counts = std::get_if<sensor::WheelCounts>(&m.value)) {
        if (last) {
          left += static_cast<std::int16_t>(counts->left - last->left) * 2 * kPi * 0.1 / 20000;
          right += static_cast<std::int16_t>(counts->right - last->right) * 2 * kPi * 0.1 / 20000;
        }
        last = *counts;
      }
  }
  ASSERT_GT(path, 300);
  EXPECT_NEAR(0.5 * (left + right), path, 2e-3);
  EXPECT_NEAR((right - left) / 0.5, turned, 2e-3);
}

TEST(World, unequal_wheels_and_a_wrong_track_show_in_the_counts_as_large_as_stated) {
  Parameters parameters = perfect();
  parameters.vehicle.radius_difference = 0.005;
  parameters.vehicle.track_error = 0.01;
  World::Options options = quiet(parameters);
  options.course = {.waypoints = {{.x_m = 0, .stop_s = 1}, {.x_m = 100, .stop_s = 1}}, .landmarks = {}};
  const auto travel = [](const std::vector<Measurement>& all) {
    std::array<double, 2> sum{};
    const sensor::WheelCounts* last = nullptr;
    for (const auto& m : all)
      if (const auto* c = std::get_if<sensor::WheelCounts>(&m.value)) {
        if (last)
          sum[0] += static_cast<std::int16_t>(c->left - last->left),
              sum[1] += static_cast<std::int16_t>(c->right - last->right);
        last = c;
      }
    for (double& counts : sum) counts *= 2 * kPi * 0.1 / 20000;
    return sum;
  };
  const auto straight = travel(run(options, 1, seconds_us(60)));
  EXPECT_NEAR(straight[0], 100 / 1.0025, 0.02);
  EXPECT_NEAR(straight[1], 100 / 0.9975, 0.02);

  parameters.vehicle.radius_difference = 0;
  options = quiet(parameters);
  options.course = circle_course(4, 4);
  World world{options, 1};
  std::vector<Measurement> all;
  world.advance_to(world.start() + world.duration(), all);
  const auto turns = travel(all);
  EXPECT_NEAR((turns[1] - turns[0]) / 0.5, 8 * kPi * 1.01, 0.01);
}

/// Straight navigation equations over the world's IMU increments: what was gained is told in the axes at the begin.
struct Strapdown {
  Vector3 attitude{};  // roll, pitch, yaw
  Vector3 v{}, p{};
  Earth earth;  ///< GeographicLib's gravity of the place

  void advance(const sensor::ImuSample& s, double t) {
    const Vector3 w{static_cast<double>(s.dangle_b_rad[0]), static_cast<double>(s.dangle_b_rad[1]),
                    static_cast<double>(s.dangle_b_rad[2])};
    const Vector3 f{static_cast<double>(s.dvelocity_b_mps[0]), static_cast<double>(s.dvelocity_b_mps[1]),
                    static_cast<double>(s.dvelocity_b_mps[2])};
    const auto rates = [&w](const Vector3& a) {  // Euler's kinematic equation, z-y-x
      const Direction r = direction(a[0]), q = direction(a[1]);
      const double lean = r.sin * w[1] + r.cos * w[2];
      return Vector3{w[0] + lean * q.sin / q.cos, r.cos * w[1] - r.sin * w[2], lean / q.cos};
    };
    const Vector3 dv = to_level(attitude, f);
    const Vector3 half = rates(attitude);
    Vector3 middle;
    for (std::size_t i = 0; i < 3; ++i) middle[i] = attitude[i] + 0.5 * half[i];
    const Vector3 full = rates(middle);
    for (std::size_t i = 0; i < 3; ++i) attitude[i] += full[i];
    const Vector3 gravity = earth.gravity_n_mps2(p);
    for (std::size_t i = 0; i < 3; ++i) {
      const double change = dv[i] + gravity[i] * t;
      p[i] += (v[i] + 0.5 * change) * t;
      v[i] += change;
    }
  }
};

TEST(World, a_perfect_imu_integrates_to_the_truth) {
  Parameters parameters = perfect();
  parameters.vehicle = VehicleParameters{};  // lean, side slip, uneven ground and all
  parameters.imu.rate_hz = 200;
  World::Options options = quiet(parameters);
  World world{options, 11};
  std::vector<Measurement> arrived;
  // The IMU's intervals end 3.5 ms after each full 5 ms: start between two of them, at rest.
  const base::Micros begin = world.start() + base::Micros{3'500};
  world.advance_to(begin, arrived);
  const Truth at = world.truth();
  Strapdown strapdown{.attitude = {at.roll_rad, at.pitch_rad, at.yaw_rad},
                      .p = {at.x_m, at.y_m, at.z_m},
                      .earth = Earth{options.origin}};
  for (base::Micros t = begin; t <= begin + seconds_us(75); t += base::Micros{5'000}) {
    arrived.clear();
    if (t == begin) continue;
    world.advance_to(t, arrived);
    for (const auto& m : arrived)
      if (const auto* s = std::get_if<sensor::ImuSample>(&m.value)) strapdown.advance(*s, 0.005);
  }
  const Truth end = world.truth();
  EXPECT_NEAR(wrap(strapdown.attitude[2] - end.yaw_rad), 0, 1e-5);
  EXPECT_NEAR(strapdown.attitude[0], end.roll_rad, 5e-5);
  EXPECT_NEAR(strapdown.attitude[1], end.pitch_rad, 5e-5);
  EXPECT_NEAR(strapdown.v[0], end.v_n_mps[0], 1e-3);
  EXPECT_NEAR(strapdown.v[1], end.v_n_mps[1], 1e-3);
  EXPECT_NEAR(strapdown.v[2], 0, 1e-3);
  EXPECT_NEAR(strapdown.p[0], end.x_m, 0.02);
  EXPECT_NEAR(strapdown.p[1], end.y_m, 0.02);
}

TEST(World, perfect_gnss_and_camera_say_the_truth_of_their_stamp) {
  Parameters parameters = perfect();
  parameters.vehicle = VehicleParameters{};
  parameters.gnss.antenna_b_m = {0.3, 0.1, 0.4};
  World::Options options = quiet(parameters);
  World world{options, 13};
  const Earth earth{options.origin};
  std::vector<Measurement> arrived;
  int positions = 0, velocities = 0, sightings = 0;
  std::optional<Vector3> antenna;
  for (base::Micros t = world.start(); t < world.start() + seconds_us(60); t += base::Micros{500}) {
    arrived.clear();
    world.advance_to(t, arrived);
    const Truth truth = world.truth();
    const Vector3 lever = to_level({truth.roll_rad, truth.pitch_rad, truth.yaw_rad}, parameters.gnss.antenna_b_m);
    const Vector3 now{truth.x_m + lever[0], truth.y_m + lever[1], truth.z_m + lever[2]};
    for (const auto& m : arrived) {
      if (const auto* p = std::get_if<sensor::GnssPosition>(&m.value)) {
        const auto enu = earth.enu_m({p->latitude_2ndeg, p->longitude_2ndeg, static_cast<double>(p->height_m)});
        ASSERT_NEAR(enu[0], now[0], 2e-4);
        ASSERT_NEAR(enu[1], now[1], 2e-4);
        ASSERT_NEAR(enu[2], now[2], 2e-4);
        ++positions;
      } else if (const auto* v = std::get_if<sensor::GnssVelocity>(&m.value)) {
        for (std::size_t i = 0; i < 3; ++i) {
          ASSERT_NEAR(static_cast<double>(v->v_n_mps[i]), (now[i] - (*antenna)[i]) / 500e-6, 2e-3);
        }
        ++velocities;
      } else if (const auto* l = std::get_if<sensor::LandmarkSighting>(&m.value)) {
        const auto& at = options.course.landmarks.at(l->landmark - 1U);
        const double away = truth.yaw_rad + static_cast<double>(l->bearing_rad);
        ASSERT_NEAR(truth.x_m + static_cast<double>(l->range_m) * sim::cos(away), at.x_m, 1e-4);
        ASSERT_NEAR(truth.y_m + static_cast<double>(l->range_m) * sim::sin(away), at.y_m, 1e-4);
        ++sightings;
      }
    }
    antenna = now;
  }
  EXPECT_GE(positions, 299);
  EXPECT_GE(velocities, 299);
  EXPECT_GT(sightings, 200);
}

TEST(World, standstill_is_exact) {
  World world{{}, 2};
  std::vector<Measurement> arrived;
  world.advance_to(world.start() + seconds_us(1), arrived);
  const Truth before = world.truth();
  world.advance_to(world.start() + seconds_us(9.5), arrived);
  EXPECT_EQ(distance_m(before, world.truth()), 0);
  EXPECT_EQ(world.truth().speed_mps, 0);
}

TEST(World, no_two_seeds_drive_the_same_line_and_all_stay_near_the_plan) {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    World world{{}, seed};
    std::vector<Measurement> arrived;
    double worst = 0;
    for (base::Micros t = world.start(); t < world.start() + world.duration(); t += base::Micros{100'000}) {
      world.advance_to(t, arrived);
      const PathPoint plan = world.plan().path(world.plan().at(t - world.start()).s_m);
      const Truth truth = world.truth();
      worst = std::max(worst, sim::sqrt((plan.x_m - truth.x_m) * (plan.x_m - truth.x_m) +
                                        (plan.y_m - truth.y_m) * (plan.y_m - truth.y_m)));
    }
    EXPECT_GT(worst, 0.05) << seed;
    EXPECT_LT(worst, 0.6) << seed;
  }
}

TEST(World, five_metres_a_second_is_driven_too) {
  World::Options options;
  options.limits.speed_mps = 5;
  World world{options, 1};
  std::vector<Measurement> arrived;
  double top = 0;
  for (base::Micros t = world.start(); t < world.start() + world.duration(); t += base::Micros{10'000}) {
    world.advance_to(t, arrived);
    top = std::max(top, world.truth().speed_mps);
  }
  EXPECT_GT(top, 4.8);
  EXPECT_LT(top, 5.3);
  EXPECT_LT(sim::sqrt(world.truth().x_m * world.truth().x_m + world.truth().y_m * world.truth().y_m), 1.5);
}

TEST(World, the_same_seed_gives_the_same_measurements_and_another_seed_others) {
  const base::Micros length = seconds_us(40);
  EXPECT_EQ(hash(run({}, 7, length)), hash(run({}, 7, length)));
  EXPECT_NE(hash(run({}, 7, length)), hash(run({}, 8, length)));
}

TEST(World, how_often_it_is_asked_changes_nothing) {
  const base::Micros length = seconds_us(20);
  const std::uint64_t often = hash(run({}, 7, length, {700}));
  EXPECT_EQ(often, hash(run({}, 7, length, {10'000})));
  EXPECT_EQ(often, hash(run({}, 7, length, {3'333'333})));
}

TEST(World, switching_a_sensor_off_leaves_the_others_as_they_were) {
  World::Options options;
  const auto all = run(options, 7, seconds_us(30));
  options.parameters.imu.rate_hz = 0;
  options.parameters.camera.rate_hz = 0;
  std::vector<Measurement> rest;
  for (const auto& m : all)
    if (!std::holds_alternative<sensor::ImuSample>(m.value) &&
        !std::holds_alternative<sensor::LandmarkSighting>(m.value))
      rest.push_back(m);
  EXPECT_EQ(hash(rest), hash(run(options, 7, seconds_us(30))));
}

TEST(World, measurements_come_in_order_of_arrival_after_they_were_true_within_the_stated_latency) {
  const auto all = run({}, 4, seconds_us(60));
  base::Micros before{};
  for (const auto& m : all) {
    EXPECT_GE(m.arrival, before);
    before = m.arrival;
    const std::int64_t late = (m.arrival - m.stamp).us;
    switch (m.value.index()) {
      case 0:
        EXPECT_TRUE(late >= 300 && late <= 700) << late;
        break;
      case 1:
        EXPECT_TRUE(late >= 300 && late <= 900) << late;
        break;
      case 4:
      case 5:
        EXPECT_TRUE(late >= 80'000 && late <= 120'000) << late;
        break;
      case 6:
        EXPECT_TRUE(late >= 20'000 && late <= 60'000) << late;
        break;
      default:
        FAIL() << m.value.index();
    }
  }
  for (const auto& m : run({.latency = false}, 4, seconds_us(30))) EXPECT_LE((m.arrival - m.stamp).us, 0);
}

TEST(World, each_sensor_comes_at_its_rate_with_a_running_sequence) {
  for (const int imu_hz : {100, 200, 400}) {
    World::Options options;
    options.parameters.imu.rate_hz = imu_hz;
    options.parameters.wheels.rate_hz = 50;
    std::array<int, 7> count{};
    std::array<int, 7> sequence{};
    sequence.fill(-1);
    std::array<std::int64_t, 7> stamp{};
    for (const auto& m : run(options, 4, seconds_us(20))) {
      const std::size_t kind = m.value.index();
      if (sequence[kind] >= 0) {
        EXPECT_EQ(m.sequence, static_cast<std::uint8_t>(sequence[kind] + 1));
      }
      if (kind == 0 && count[0] > 0) {
        EXPECT_EQ(m.stamp.us - stamp[0], 1'000'000 / imu_hz);
      }
      if (const auto* s = std::get_if<sensor::ImuSample>(&m.value)) {
        EXPECT_EQ(s->interval_us, 1'000'000 / imu_hz);
      }
      sequence[kind] = m.sequence;
      stamp[kind] = m.stamp.us;
      ++count[kind];
    }
    EXPECT_NEAR(count[0], 20 * imu_hz, 1);
    EXPECT_NEAR(count[1], 20 * 50, 1);
    EXPECT_NEAR(count[4], 100, 1);
    EXPECT_NEAR(count[5], 100, 1);
  }
}

// A kilometre away gravity and the turn of the Earth are the same to a part in a million, so only GNSS and map differ.
TEST(World, moving_the_whole_course_changes_nothing_but_gnss_so_no_other_sensor_knows_the_place) {
  World::Options options;
  const auto here = run(options, 9, seconds_us(60));
  options.place = place_at(options.origin, 1024, -512);
  const auto there = run(options, 9, seconds_us(60));
  ASSERT_EQ(here.size(), there.size());
  int gnss = 0;
  for (std::size_t i = 0; i < here.size(); ++i) {
    const Measurement& a = here[i];
    const Measurement& b = there[i];
    ASSERT_EQ(a.stamp, b.stamp);
    if (const auto* p = std::get_if<sensor::ImuSample>(&a.value)) {
      const auto& q = std::get<sensor::ImuSample>(b.value);
      for (std::size_t k = 0; k < 3; ++k) {
        ASSERT_NEAR(p->dangle_b_rad[k], q.dangle_b_rad[k], 1e-7F);
        ASSERT_NEAR(p->dvelocity_b_mps[k], q.dvelocity_b_mps[k], 1e-6F);
      }
    } else if (const auto* c = std::get_if<sensor::WheelCounts>(&a.value)) {
      const auto& d = std::get<sensor::WheelCounts>(b.value);
      ASSERT_LE(static_cast<std::int16_t>(c->left - d.left) * static_cast<std::int16_t>(c->left - d.left), 1);
      ASSERT_LE(static_cast<std::int16_t>(c->right - d.right) * static_cast<std::int16_t>(c->right - d.right), 1);
    } else if (const auto* l = std::get_if<sensor::LandmarkSighting>(&a.value)) {
      const auto& k = std::get<sensor::LandmarkSighting>(b.value);
      ASSERT_EQ(l->landmark, k.landmark);
      ASSERT_NEAR(l->range_m, k.range_m, 1e-5F);
      ASSERT_NEAR(l->bearing_rad, k.bearing_rad, 1e-5F);
    } else if (const auto* g = std::get_if<sensor::GnssPosition>(&a.value)) {
      ASSERT_GT(std::get<sensor::GnssPosition>(b.value).longitude_2ndeg - g->longitude_2ndeg, 6'000'000);
      ++gnss;
    }
  }
  EXPECT_GT(gnss, 250);
}

TEST(World, what_a_filter_is_told_is_not_the_truth) {
  World world{{}, 12};
  const StartPose stated = world.start_pose();
  const Truth truth = world.truth();
  EXPECT_NE(stated.x_m, truth.x_m);
  EXPECT_NE(stated.yaw_rad, truth.yaw_rad);
  const Course course = default_course();
  std::vector<double> survey;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const World other{{}, seed};
    for (std::size_t i = 0; i < course.landmarks.size(); ++i) {
      ASSERT_EQ(other.map()[i].id, course.landmarks[i].id);
      survey.push_back(other.map()[i].x_m - course.landmarks[i].x_m);
      survey.push_back(other.map()[i].y_m - course.landmarks[i].y_m);
    }
  }
  EXPECT_NEAR(sim::sqrt(statistics(survey).variance), 0.015, 0.0015);
}

TEST(World, the_start_pose_is_off_by_what_it_says) {
  std::vector<double> x, yaw;
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    const World world{{.mismatched = false}, seed};
    x.push_back((world.truth().x_m - world.start_pose().x_m) / world.start_pose().sigma_m);
    yaw.push_back((world.truth().yaw_rad - world.start_pose().yaw_rad) / world.start_pose().sigma_yaw_rad);
  }
  for (const auto& values : {x, yaw}) {
    EXPECT_NEAR(statistics(values).mean, 0, 0.2);
    EXPECT_NEAR(statistics(values).variance, 1, 0.25);
  }
}

TEST(World, in_the_matched_world_the_map_is_exact_and_the_body_level) {
  World world{{.mismatched = false}, 3};
  const Course course = default_course();
  for (std::size_t i = 0; i < course.landmarks.size(); ++i) EXPECT_EQ(world.map()[i].x_m, course.landmarks[i].x_m);
  std::vector<Measurement> arrived;
  for (base::Micros t = world.start(); t < world.start() + seconds_us(60); t += base::Micros{100'000}) {
    world.advance_to(t, arrived);
    ASSERT_EQ(world.truth().roll_rad, 0);
    ASSERT_EQ(world.truth().pitch_rad, 0);
  }
}

TEST(World, a_rate_that_is_no_divisor_is_refused) {
  World::Options options;
  EXPECT_EQ(World::refusal(options), "");
  options.parameters.imu.rate_hz = 300;
  EXPECT_EQ(World::refusal(options), "IMU rate of 300 Hz does not divide 2000 Hz");
  options.parameters.imu.rate_hz = -1;
  EXPECT_NE(World::refusal(options), "");
  EXPECT_DEATH((World{options, 1}), "");
  options.parameters.imu.rate_hz = 100;
  options.course.waypoints.clear();
  EXPECT_EQ(World::refusal(options), Plan::refusal(options.course));
}

TEST(World, in_the_world_matched_to_an_inertial_filter_the_body_trembles_without_memory_also_at_rest) {
  World::Options options{.mismatched = false, .inertial = true};
  options.course.waypoints.front().stop_s = 45;
  World world{options, 9};
  const double sigma = world.parameters().vehicle.jitter_mps, sigma_ahead = world.parameters().vehicle.jitter_ahead_mps;
  std::vector<Measurement> ignored;
  std::vector<double> side, up, ahead;
  double x_m = 0;
  double z_m = 0;
  Truth before = world.truth();
  for (base::Micros t = world.start(); t < world.start() + seconds_us(90); t += base::Micros{500}) {
    world.advance_to(t, ignored);
    const Truth now = world.truth();
    x_m += 0.5 * 500e-6 * (before.v_n_mps[0] + now.v_n_mps[0]);
    z_m += 0.5 * 500e-6 * (before.v_n_mps[2] + now.v_n_mps[2]);
    before = now;
    const Direction d = direction(now.yaw_rad);
    if (t.us % 10'000 != 0) continue;
    side.push_back(now.v_n_mps[1] * d.cos - now.v_n_mps[0] * d.sin);
    up.push_back(now.v_n_mps[2]);
    if (t < world.start() + seconds_us(40)) {
      ahead.push_back(now.speed_mps / sigma_ahead * sigma);
      EXPECT_NEAR(now.v_n_mps[0] * d.cos + now.v_n_mps[1] * d.sin, now.speed_mps, 1e-12);
    }
  }
  for (const auto& series : {side, up, ahead}) {
    EXPECT_NEAR(statistics(series).variance / (sigma * sigma), 1, 0.06);
    EXPECT_NEAR(correlation(series, 1), 0, 0.04);
  }
  EXPECT_NEAR(z_m, before.z_m, 1e-6);
  EXPECT_NEAR(x_m, before.x_m - World({.mismatched = false, .inertial = true}, 9).truth().x_m, 2e-3);
}

TEST(World, a_gnss_error_that_is_asked_for_is_the_whole_error_in_every_world) {
  World::Options options;
  options.parameters.gnss = with_error(options.parameters.gnss, 1.5);
  const GnssParameters& n = options.parameters.gnss;
  EXPECT_NEAR(n.white_m * n.white_m + n.correlated_m * n.correlated_m, 2.25, 1e-12);
  EXPECT_NEAR(n.white_m / n.correlated_m, GnssParameters{}.white_m / GnssParameters{}.correlated_m, 1e-12);
  options.mismatched = false;
  options.inertial = true;
  const World world{options, 1};
  EXPECT_NEAR(world.parameters().gnss.white_m, 1.5, 1e-12);
  EXPECT_EQ(world.parameters().gnss.correlated_m, 0);
}

/// Distance that a robot reads from the counts of its wheels, and the true one [m].
std::pair<double, double> counted_and_driven_m(const param::Parameters& n, const SimulatedAs& as) {
  World::Options options{.mismatched = false};
  simulate(n, as, options);
  World world{options, 1};
  std::vector<Measurement> arrived;
  std::optional<sensor::WheelCounts> last;
  double counts = 0, driven_m = 0;
  Truth before = world.truth();
  for (base::Micros t = world.start(); t < world.start() + seconds_us(30); t += base::Micros{10'000}) {
    world.advance_to(t, arrived);
    driven_m += distance_m(before, world.truth());
    before = world.truth();
    for (const Measurement& m : arrived) {
      const auto* now = std::get_if<sensor::WheelCounts>(&m.value);
      if (now == nullptr) continue;
      if (last)
        counts += 0.5 * (static_cast<std::int16_t>(now->left - last->left) +
                         static_cast<std::int16_t>(now->right - last->right));
      last = *now;
    }
    arrived.clear();
  }
  const double radius_m = static_cast<double>(n.wheels.drive.left_radius_m);
  return {counts * 2 * kPi * radius_m / static_cast<double>(n.wheels.drive.counts_per_turn), driven_m};
}

TEST(World, matched_to_a_robot_turns_the_encoder_that_the_robot_states) {
  param::Parameters coarse = robot::visual::parameters;
  coarse.wheels.drive.counts_per_turn = 500;
  coarse.gnss.antenna_x_b_m = 0.7F;
  for (const auto& [n, as] : {std::pair{robot::visual::parameters, SimulatedAs{.images = true}},
                              {robot::rover_landmarks::parameters, SimulatedAs{.landmarks = true}},
                              {robot::rover::parameters, SimulatedAs{.inertial = true}},
                              {coarse, SimulatedAs{.images = true}}}) {
    const auto [counted_m, driven_m] = counted_and_driven_m(n, as);
    EXPECT_GT(driven_m, 10);
    EXPECT_NEAR(counted_m / driven_m, 1, 0.02);
  }
  // The rest is the matched world: no error but noise.
  World::Options options{.mismatched = false};
  simulate(coarse, {.images = true}, options);
  const World world{options, 1};
  EXPECT_NEAR(world.parameters().gnss.antenna_b_m[0], 0.7, 1e-6);
  EXPECT_EQ(world.parameters().vehicle.slip_random, 0);
  EXPECT_EQ(world.parameters().imu.gyro_turn_on_radps, 0);
  EXPECT_EQ(world.parameters().features.wrong_probability, 0);
}

}  // namespace
}  // namespace tetap::sim
