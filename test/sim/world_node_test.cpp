// SPDX-License-Identifier: Apache-2.0
// The node with the simulated world's frames: samples of several frames, late fixes, faults. Order of arrival leaves no
// trace; and the 1 sigma of the motion says how far it is off.
#include "config/rover.hpp"
#include "config/rover_landmarks.hpp"
#include "sim_host/matched_rover.hpp"
#include "sim_host/world_source.hpp"
#include "tetap/node/node.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>
#include <ostream>
#include <random>
#include <set>
#include <string>
#include <vector>

namespace tetap::sim {
namespace {

constexpr base::Micros kPeriod{10'000};

struct Epoch {
  std::vector<base::CanFrame> inputs;
  Tick tick;
  Truth truth;
};

std::vector<Epoch> made(const World::Options& options, std::uint64_t seed, int seconds) {
  WorldSource source(World(options, seed), param::Parameters{}.can_base, kPeriod, base::Micros{1'000'000LL * seconds});
  std::vector<Epoch> epochs;
  Tick tick;
  while (source.next(tick)) {
    Epoch& one = epochs.emplace_back();
    one.inputs.assign(tick.inputs.begin(), tick.inputs.end());
    one.tick = tick;
    one.truth = source.truth();
  }
  return epochs;
}

struct Robot {
  const char* name;
  param::Parameters parameters;
  bool inertial;
};
void PrintTo(const Robot& robot, std::ostream* out) { *out << robot.name; }

/// The first frame of `a` that `b` has not got, as its id and bytes.
std::string first_difference(const std::vector<base::CanFrame>& a, const std::vector<base::CanFrame>& b) {
  std::size_t i = 0;
  while (i < a.size() && i < b.size() && a[i] == b[i]) ++i;
  if (i == a.size() && i == b.size()) return "";
  std::string text = "frame " + std::to_string(i) + ":";
  for (const auto* frames : {&a, &b}) {
    char part[16];
    const base::CanFrame none{};
    const base::CanFrame& f = i < frames->size() ? (*frames)[i] : none;
    std::snprintf(part, sizeof part, " %03X#", static_cast<unsigned>(f.id));
    text += part;
    for (std::size_t k = 0; k < f.size; ++k)
      std::snprintf(part, sizeof part, "%02X", unsigned{f.data[k]}), text += part;
  }
  return text;
}

/// hear(k, frame) gets every frame of epoch k.
template <class Estimators, class Receive>
void run_as(const param::Parameters& parameters, const std::vector<Epoch>& epochs, Receive& receive) {
  const auto node = std::make_unique<node::Node<Estimators>>(parameters, bus::Version{});
  for (std::size_t k = 0; k < epochs.size(); ++k) {
    if (epochs[k].tick.begin) node->power_on(*epochs[k].tick.begin);
    for (const base::CanFrame& frame : epochs[k].inputs) node->on_frame(frame);
    node->tick(epochs[k].tick.time, {}, [&](const base::CanFrame& frame) { receive(k, frame); });
  }
}
template <class Receive>
void run(const Robot& robot, const std::vector<Epoch>& epochs, Receive&& receive) {
  if (robot.inertial) return run_as<robot::rover::Estimators>(robot.parameters, epochs, receive);
  run_as<robot::rover_landmarks::Estimators>(robot.parameters, epochs, receive);
}

std::vector<base::CanFrame> outputs(const Robot& robot, const std::vector<Epoch>& epochs) {
  std::vector<base::CanFrame> all;
  run(robot, epochs, [&all](std::size_t, const base::CanFrame& frame) { all.push_back(frame); });
  return all;
}

class Order : public ::testing::TestWithParam<Robot> {};

// IMU samples of three frames, fixes of four and two that come late, lost frames, another clock for a while.
TEST_P(Order, OfArrivalWithinAnEpochHasNoEffectOnAnyByte) {
  World::Options options;
  options.parameters.imu.rate_hz = 200;
  options.faults = {{Fault::kLostFrames, base::Micros{4'000'000}, base::Micros{6'000'000}},
                    {Fault::kGnssJump, base::Micros{12'000'000}, base::Micros{4'000'000}},
                    {Fault::kStaleStamps, base::Micros{18'000'000}, base::Micros{2'000'000}},
                    {Fault::kClockJump, base::Micros{22'000'000}, base::Micros{3'000'000}}};
  std::vector<Epoch> epochs = made(options, 3, 30);
  const std::vector<base::CanFrame> straight = outputs(GetParam(), epochs);
  std::mt19937 engine{5};
  for (int trial = 0; trial < 3; ++trial) {
    std::size_t moved = 0;
    for (Epoch& epoch : epochs) {
      const auto before = epoch.inputs;
      std::shuffle(epoch.inputs.begin(), epoch.inputs.end(), engine);
      moved += epoch.inputs != before ? 1 : 0;
    }
    ASSERT_GT(moved, epochs.size() / 2);
    EXPECT_EQ(first_difference(outputs(GetParam(), epochs), straight), "") << "shuffle " << trial;
  }
}

INSTANTIATE_TEST_SUITE_P(Robots, Order,
                         ::testing::Values(Robot{"rover", robot::rover::parameters, true},
                                           Robot{"rover_landmarks", robot::rover_landmarks::parameters, false}),
                         [](const auto& which) { return std::string(which.param.name); });

/// By epoch, the pages of Est_State; and whether attitude, velocity and Est_Std were in all of those epochs.
struct SaidPages {
  std::map<std::size_t, std::set<unsigned>> pages;
  bool whole = true;
};
SaidPages pages_of(const std::vector<Epoch>& epochs) {
  SaidPages said;
  std::map<std::size_t, std::set<std::uint32_t>> offsets;
  run({"rover", robot::rover::parameters, true}, epochs, [&](std::size_t k, const base::CanFrame& frame) {
    const std::uint32_t offset = frame.id - robot::rover::parameters.can_base;
    const unsigned page = frame.data[0] & 0xFU;
    const bool sources = page == bus::EstStateSources::kPage;  // sent from the start on: no covariance judges it
    if (offset == bus::offset_of<bus::EstStateHeight>(2) && !sources) said.pages[k].insert(page);
    if (offset == bus::offset_of<bus::EstStdPose>(2)) offsets[k].insert(offset + 100 * (frame.data[0] & 1U));
    if (offset == bus::offset_of<bus::EstAtt>(2) || offset == bus::offset_of<bus::EstVel>(2)) offsets[k].insert(offset);
  });
  for (const auto& [k, pages] : said.pages) said.whole = said.whole && offsets[k].size() == 4;
  return said;
}

// Values that are averaged over runs, or compared between a robot and its replay, come in the same epochs of each. Turn
// and acceleration are judged by the covariance of their own time.
TEST(Covariance, ComesWithWhatItJudgesInTurnsThatTheEpochSays) {
  World::Options late;
  late.faults = {{Fault::kMovingStart, base::Micros{0}, base::Micros{3'270'000}}};
  const SaidPages one = pages_of(made({}, 3, 20)), other = pages_of(made(late, 3, 20));
  EXPECT_TRUE(one.whole && other.whole);
  EXPECT_NE(one.pages.begin()->first, 0U);
  std::size_t compared = 0, missing = 0;
  for (const auto& [k, pages] : one.pages) {
    const auto found = other.pages.find(k);
    if (found == other.pages.end()) {
      ++missing;
      continue;
    }
    ++compared;
    EXPECT_EQ(pages, found->second) << "epoch " << k;
  }
  EXPECT_GT(compared, 50U);
  EXPECT_GT(missing, 3U) << "or both began at once";
}

// An IMU at 200 Hz, a window of half a second. A receiver's sample of 480 ms ago is fused at its own time, so the
// estimate does not depend on when it came.
template <std::size_t kPlaces>
using RoverWith =
    node::EstimatorsWithPlaces<kPlaces, estimators::Odometry, robot::rover::Attitude, robot::rover::Inertial>;

/// Count of samples that became final early for want of places, if the frame has it.
int short_windows(const base::CanFrame& frame) {
  if (frame.id != 0x300 + bus::EstDiagCapacity::kOffset) return 0;
  const auto full = bus::decode<bus::EstDiagCapacity>(bus::payload(frame));
  return full ? full->window_short + full->timeline_full : 0;
}
template <class Estimators>
int short_windows(const std::vector<Epoch>& epochs) {
  int count = 0;
  const auto receive = [&count](std::size_t, const base::CanFrame& frame) { count += short_windows(frame); };
  run_as<Estimators>(robot::rover::parameters, epochs, receive);
  return count;
}

TEST(Late, AnImuAt400HzHasPlaceWhereTheRobotSaysSo) {
  World::Options options;
  options.parameters.imu.rate_hz = 400;
  const std::vector<Epoch> epochs = made(options, 4, 20);
  EXPECT_EQ(short_windows<RoverWith<128>>(epochs), 0);
  EXPECT_GT(short_windows<robot::rover::Estimators>(epochs), 0) << "88 places hold 200 ms of 200 Hz";
}

TEST(Late, AFixOfAlmostHalfASecondAgoLeavesTheBytesOfOneOnTime) {
  World::Options options;
  options.parameters.imu.rate_hz = 200;
  options.parameters = without_latency(options.parameters);
  param::Parameters parameters = robot::rover::parameters;
  parameters.loop.window_us = 500'000;
  const std::vector<Epoch> on_time = made(options, 4, 40);
  std::vector<Epoch> late = on_time;
  const auto of_gnss = [](const base::CanFrame& frame) {
    const auto offset = frame.id - 0x300;
    return offset >= bus::offset_of<bus::InGnssLat>(0) && offset <= bus::offset_of<bus::InGnssVelU>(0);
  };
  constexpr std::size_t kLate = 48;
  std::size_t moved = 0;
  for (Epoch& epoch : late) std::erase_if(epoch.inputs, of_gnss);
  for (std::size_t k = 0; k < on_time.size(); ++k)
    for (const base::CanFrame& frame : on_time[k].inputs)
      if (of_gnss(frame) && k + kLate < late.size()) late[k + kLate].inputs.push_back(frame), ++moved;
  EXPECT_GT(moved, 500U);
  const auto said = [&](const std::vector<Epoch>& epochs) {
    std::vector<base::CanFrame> all;
    int without_place = 0;
    const auto receive = [&](std::size_t, const base::CanFrame& frame) {
      constexpr std::size_t kFused = 2;
      without_place += short_windows(frame);
      if (frame.id == 0x300 + bus::offset_of<bus::EstPos>(kFused) ||
          frame.id == 0x300 + bus::offset_of<bus::EstMotion>(kFused) ||
          frame.id == 0x300 + bus::offset_of<bus::EstStdPose>(kFused))
        all.push_back(frame);
    };
    run_as<RoverWith<176>>(parameters, epochs, receive);
    EXPECT_EQ(without_place, 0);
    return all;
  };
  const auto straight = said(on_time);
  EXPECT_GT(straight.size(), 4'000U);
  EXPECT_EQ(first_difference(said(late), straight), "");
}

// The non-holonomic constraint comes with the wheels, every 20 ms. A second constraint at the same instants would count
// the same trembling of the body twice, and the velocity would be too sure.
TEST(Constraint, WhatWheelsBringIsNotTakenTwice) {
  World::Options options{.mismatched = false, .inertial = true};
  options.parameters.imu.rate_hz = 200;
  const std::vector<Epoch> epochs = made(options, 1, 40);
  const auto sigma_up_mps = [&](std::int32_t constrain_every_us) {
    param::Parameters parameters = matched_rover();
    parameters.inertial.constrain_every_us = constrain_every_us;
    float last = 0;
    const auto receive = [&last](std::size_t, const base::CanFrame& frame) {
      constexpr std::size_t kFused = 2;
      if (frame.id != 0x300 + bus::offset_of<bus::EstStateStdVel>(kFused)) return;
      if (const auto page = bus::decode<bus::EstStateStdVel>(bus::payload(frame))) last = page->std_vel_up_mps;
    };
    run_as<robot::rover::Estimators>(parameters, epochs, receive);
    return last;
  };
  const float alone = sigma_up_mps(0), both = sigma_up_mps(20'000);
  EXPECT_GT(alone, 5e-4F);
  EXPECT_NEAR(both / alone, 1.0F, 0.03F);
}

// In the matched world, over the drive: the normalised square of an error whose 1 sigma is right is 1 in the mean.
TEST(Motion, TheOneSigmaOfSpeedAndTurnRateIsThatOfTheirErrors) {
  for (const Robot& robot :
       {Robot{"rover", matched_rover(), true}, Robot{"rover_landmarks", matched_landmarks_rover(), false}}) {
    struct Sum {
      double speed = 0, rate = 0, count = 0;
    };
    std::map<std::size_t, Sum> sums;
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      const std::vector<Epoch> epochs = made({.mismatched = false, .inertial = robot.inertial}, seed, 60);
      std::map<std::size_t, bus::EstMotion> motion;
      run(robot, epochs, [&](std::size_t k, const base::CanFrame& frame) {
        if (k < 500) return;  // the robot stands, then drives
        for (std::size_t i = 0; i < 4; ++i) {
          if (frame.id == 0x300 + bus::offset_of<bus::EstMotion>(i))
            if (const auto said = bus::decode<bus::EstMotion>(bus::payload(frame))) motion[i] = *said;
          if (frame.id != 0x300 + bus::offset_of<bus::EstStdMore>(i)) continue;
          const auto std = bus::decode<bus::EstStdMore>(bus::payload(frame));
          if (!std || !motion[i].vel_valid || std->std_speed_mps < 1e-3F) continue;  // Speed itself has steps of 1 mm/s
          const auto square = [](float said, double truth, float sigma) {
            const double z = (static_cast<double>(said) - truth) / static_cast<double>(sigma);
            return z * z;
          };
          Sum& sum = sums[i];
          sum.speed += square(motion[i].speed_mps, epochs[k].truth.speed_mps, std->std_speed_mps);
          sum.rate += square(motion[i].yaw_rate_radps, epochs[k].truth.yaw_rate_radps, std->std_yaw_rate_radps);
          sum.count += 1;
        }
      });
    }
    EXPECT_GE(sums.size(), 2U) << robot.name;
    for (const auto& [i, sum] : sums) {
      std::printf("%s, estimator %zu: mean squares of speed %.2f, turn rate %.2f over %.0f\n", robot.name, i,
                  sum.speed / sum.count, sum.rate / sum.count, sum.count);
      EXPECT_GT(sum.count, 500);
      EXPECT_NEAR(sum.speed / sum.count, 1.0, 0.5) << robot.name << i;
      EXPECT_NEAR(sum.rate / sum.count, 1.0, 0.7) << robot.name << i;
    }
  }
}

// A stuck IMU leaves the turn to the wheels, or to nothing: the published sigmas grow either way.
TEST(Motion, TheOneSigmaOfSpeedAndTurnRateGrowsWithTheirErrorsWhereTheImuIsStuck) {
  for (const bool wheels : {true, false}) {
    double speed = 0, rate = 0, count = 0;
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      World::Options options;
      options.faults = {{Fault::kImuStuck, base::Micros{40'000'000}, base::Micros{10'000'000}}};
      if (!wheels) options.parameters.wheels.rate_hz = 0;
      const std::vector<Epoch> epochs = made(options, seed, 52);
      std::optional<bus::EstMotion> motion;
      run(Robot{"rover", robot::rover::parameters, true}, epochs, [&](std::size_t k, const base::CanFrame& frame) {
        constexpr std::size_t kFused = 2;
        if (frame.id == 0x300 + bus::offset_of<bus::EstMotion>(kFused))
          motion = bus::decode<bus::EstMotion>(bus::payload(frame));
        if (k < 4100 || k > 4990 || frame.id != 0x300 + bus::offset_of<bus::EstStdMore>(kFused)) return;
        const auto std = bus::decode<bus::EstStdMore>(bus::payload(frame));
        if (!std || !motion) return;
        const auto square = [](double error, float sigma) {
          return error * error / static_cast<double>(sigma * sigma);
        };
        speed += square(static_cast<double>(motion->speed_mps) - epochs[k].truth.speed_mps, std->std_speed_mps);
        rate += square(static_cast<double>(motion->yaw_rate_radps) - epochs[k].truth.yaw_rate_radps,
                       std->std_yaw_rate_radps);
        count += 1;
      });
    }
    std::printf("IMU stuck, %s wheels: mean squares of speed %.2f, turn rate %.2f over %.0f\n",
                wheels ? "with" : "without", speed / count, rate / count, count);
    EXPECT_GT(count, 100);
    EXPECT_LT(speed / count, 4.0);
    EXPECT_LT(rate / count, 4.0);
    EXPECT_GT(rate / count, wheels ? 0.02 : 0.001) << "nor is everything possible";
  }
}

constexpr double kTrembles_mps = 0.005;  ///< trembling of a body, as an engine makes it

// Wheels that scatter, and no GNSS that would hide it. Readings on the slow side count for no more than the others.
// With each reading's own uncertainty the robot would lose 0.7 mm/s, or 25.
TEST(Motion, WheelsWhoseReadingsScatterDoNotSlowTheRobot) {
  for (const bool counts : {true, false}) {
    double off_mps = 0, count = 0;
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
      World::Options options{.mismatched = false, .inertial = true};
      options.parameters.gnss.rate_hz = 0;
      Robot robot{"matched", matched_rover(), true};
      robot.parameters.start = {.known = 1};
      if (!counts) {
        constexpr double kShare = 0.2;
        options.parameters.wheels.output = WheelOutput::kWheelSpeeds;
        options.parameters.wheels.noise_share = kShare;
        robot.parameters.inertial.slip_share = static_cast<float>(kShare / 1.4142);  // two wheels
      }
      const std::vector<Epoch> epochs = made(options, seed, 60);
      const auto receive = [&](std::size_t k, const base::CanFrame& frame) {
        if (k < 1500 || frame.id != 0x300 + bus::offset_of<bus::EstMotion>(1) || epochs[k].truth.speed_mps < 0.5)
          return;
        const auto said = bus::decode<bus::EstMotion>(bus::payload(frame));
        if (!said || !said->vel_valid) return;
        off_mps += static_cast<double>(said->speed_mps) - epochs[k].truth.speed_mps;
        count += 1;
      };
      run_as<node::Estimators<estimators::Odometry, estimators::Inertial>>(robot.parameters, epochs, receive);
    }
    std::printf("%s: speed off by %.2f mm/s in the mean of %.0f\n", counts ? "counts" : "speeds", 1e3 * off_mps / count,
                count);
    EXPECT_GT(count, 5'000);
    EXPECT_NEAR(off_mps / count, 0.0, counts ? 0.0005 : 0.01);
  }
}

// With fixes of 1 cm, wheels that stand and a gyroscope nothing measures a heading, nor takes it away. The body may be
// still or shaken by an engine.
TEST(Standstill, NeitherTellsAHeadingNorCostsOne) {
  for (const Robot& robot : {Robot{"rover", robot::rover::parameters, true}, Robot{"matched", matched_rover(), true},
                             Robot{"trembling", robot::rover::parameters, true}}) {
    World::Options options{.mismatched = robot.name != std::string("matched"), .inertial = true};
    if (robot.name == std::string("trembling")) {
      options.parameters.imu.accel_range_mps2 = 16 * kG0;
      options.parameters.vehicle.jitter_mps = options.parameters.vehicle.jitter_ahead_mps = kTrembles_mps;
    }
    options.course.waypoints.front().stop_s = 1e6;
    options.parameters.gnss = with_error(options.parameters.gnss, 0.01);
    options.parameters.gnss.rate_hz = 10;
    const std::vector<Epoch> epochs = made(options, 2, 300);
    ASSERT_EQ(epochs.size(), 30'000U);
    EXPECT_LT(std::abs(epochs.back().truth.x_m - epochs.front().truth.x_m),
              robot.name == std::string("rover") ? 1e-6 : 0.03);
    std::map<std::size_t, float> sigma_rad, yaw_rad;  // by epoch
    run(robot, epochs, [&](std::size_t k, const base::CanFrame& frame) {
      constexpr std::size_t kFused = 2;
      if (frame.id == 0x300 + bus::offset_of<bus::EstStdPose>(kFused))
        if (const auto std = bus::decode<bus::EstStdPose>(bus::payload(frame))) sigma_rad[k] = std->std_yaw_rad;
      if (frame.id == 0x300 + bus::offset_of<bus::EstMotion>(kFused))
        if (const auto said = bus::decode<bus::EstMotion>(bus::payload(frame))) yaw_rad[k] = said->yaw_rad;
    });
    const auto from_s = [](const std::map<std::size_t, float>& said, std::size_t s) {
      return said.lower_bound(100 * s)->second;
    };
    const float before = from_s(sigma_rad, 15), after = from_s(sigma_rad, 299);
    std::printf("%s: 1 sigma of the heading %.4f rad, after five minutes at rest %.4f\n", robot.name,
                static_cast<double>(before), static_cast<double>(after));
    EXPECT_NEAR(after / before, 1.0F, 0.03F) << robot.name;
    EXPECT_NEAR(from_s(yaw_rad, 299), from_s(yaw_rad, 15), 0.1F * before) << robot.name;
  }
}

}  // namespace
}  // namespace tetap::sim
