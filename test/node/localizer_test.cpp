// SPDX-License-Identifier: Apache-2.0
// The library's door beside the node: the same drive, once as frames and once as samples, leaves the same bits.
#include "tetap/localizer.hpp"
#include "config/rover.hpp"
#include "config/rover_landmarks.hpp"
#include "node/bench.hpp"
#include "sim_host/world_source.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

namespace tetap::sim {
namespace {

constexpr base::Micros kPeriod{10'000};
constexpr std::uint32_t kBase = 0x300;

/// Samples of the frames that a node gets, for the library.
template <class Robot>
struct Reader {
  Robot& robot;
  void sample(const sensor::Sample& s) {
    sensor::visit(s, [&](const auto& payload) {
      if (robot.add(payload, s.stamp, s.instance, s.sequence) == Admission::kTaken) ++taken;
    });
  }
  void map_entry(const estimators::MapEntry& entry) { robot.add_landmark(entry); }
  void set_pose(const estimators::SetPose& p) { robot.set_pose(p.pose, p.sigma_position_m, p.sigma_yaw_rad); }
  void reset(bus::ResetWhat) {}
  int taken = 0;
};

template <class Message, class Field>
void expect_frame(const std::vector<base::CanFrame>& frames, std::size_t instance, int& compared, Field&& set) {
  for (const base::CanFrame& frame : frames) {
    if (frame.id != kBase + bus::offset_of<Message>(instance)) continue;
    std::optional<Message> message = bus::decode<Message>(bus::payload(frame));
    if (!message) continue;  // another page of this id
    set(*message);
    EXPECT_EQ(bus::frame(kBase, *message, instance), frame);
    ++compared;
  }
}

/// Every pose, sigma, attitude and velocity that the node sends, and at two rests of the bus the whole state.
template <class Estimators>
void expect_same(const param::Parameters& parameters, const World::Options& options, bool spatial) {
  constexpr std::size_t kPrimary = Estimators::kCount - 1;
  WorldSource source(World(options, 5), kBase, kPeriod, base::Micros{40'000'000});
  const auto node = std::make_unique<node::Node<Estimators>>(parameters, bus::Version{});
  const auto robot = std::make_unique<Localizer<Estimators>>(parameters);
  bus::Decoder decoder;
  bus::Counters counters;
  Reader<Localizer<Estimators>> reader{*robot};
  base::Micros now;
  int poses = 0, sigmas = 0, attitudes = 0, rests = 0, fixes = 0;
  Tick tick;
  for (int k = 0; source.next(tick); ++k) {
    if (tick.begin) node->power_on(now = *tick.begin), robot->start(now);
    const int rest = k % 2'000 - 1'900;  // 1 s without a sample in 20 s: the window runs empty
    for (const base::CanFrame& frame : tick.inputs) {
      if (rest >= 0) continue;
      node->on_frame(frame);
      decoder.on_frame(static_cast<std::uint8_t>(frame.id - kBase), frame, now, counters, reader);
    }
    now = tick.time;
    std::vector<base::CanFrame> sent;
    node->tick(now, {}, [&](const base::CanFrame& frame) { sent.push_back(frame); });
    robot->advance(now);
    const Localization& e = robot->estimate();
    ASSERT_EQ(e.time, now);
    const auto millimetres = [](const base::Anchored& a) {
      return static_cast<std::int32_t>((a.um() + (a.um() < 0 ? -500 : 500)) / 1'000);
    };
    expect_frame<bus::EstPos>(sent, kPrimary, poses, [&](bus::EstPos& m) {
      m.x_raw = millimetres(e.pose.x), m.y_raw = millimetres(e.pose.y);
    });
    if (const auto status = test::last<bus::EstStatus>(sent)) {
      EXPECT_EQ(status->mode, e.mode);
      EXPECT_EQ(status->reset_ctr, e.resets);
    }
    expect_frame<bus::EstMotion>(sent, kPrimary, poses, [&](bus::EstMotion& m) {
      m.yaw_rad = e.pose.yaw_rad, m.speed_mps = e.forward_mps, m.yaw_rate_radps = e.yaw_rate_radps;
      m.pos_valid = e.position_valid, m.hdg_valid = e.heading_valid, m.vel_valid = e.velocity_valid;
    });
    expect_frame<bus::EstStdPose>(sent, kPrimary, sigmas, [&](bus::EstStdPose& m) {
      m.std_x_m = std::sqrt(e.p(0, 0)), m.std_y_m = std::sqrt(e.p(1, 1)), m.std_yaw_rad = std::sqrt(e.p(2, 2));
      m.corr_xy = e.p(0, 1) / (m.std_x_m * m.std_y_m);
    });
    expect_frame<bus::EstVel>(sent, kPrimary, attitudes, [&](bus::EstVel& m) {
      m.east_mps = e.space.v_n_mps[0], m.north_mps = e.space.v_n_mps[1], m.up_mps = e.space.v_n_mps[2];
    });
    expect_frame<bus::EstAtt>(sent, kPrimary, attitudes, [&](bus::EstAtt& m) {
      const filter::Quaternion& q = e.space.q_nb;
      m.w = q.w, m.x = q.x, m.y = q.y, m.z = q.z;
    });
    for (const Record& r : robot->records()) {
      EXPECT_GT(r.stamp, now - base::Micros{parameters.loop.window_us + 100'000});
      fixes += r.sensor == sensor::Sensor::kGnssPosition && r.innovation.verdict == sensor::Verdict::kAccepted;
    }
    EXPECT_EQ(robot->records_lost(), 0U);
    if (rest < 60) continue;
    EXPECT_EQ(node->window_crc(), robot->state_crc()) << "epoch " << k;
    ++rests;
    if (::testing::Test::HasFailure()) return;
  }
  EXPECT_GT(reader.taken, 4'000);
  EXPECT_GT(poses, 3'000);
  EXPECT_GT(sigmas, 300);
  EXPECT_EQ(attitudes > 300, spatial);
  EXPECT_GT(fixes, 100);
  EXPECT_EQ(rests, 80);
}

TEST(Localizer, OfAnInertialRobotHasTheBitsOfItsNode) {
  expect_same<robot::rover::Estimators>(robot::rover::parameters, {.inertial = true}, true);
}

TEST(Localizer, OfAPlanarRobotHasTheBitsOfItsNode) {
  expect_same<robot::rover_landmarks::Estimators>(robot::rover_landmarks::parameters, {}, false);
}

using Planar = Localizer<node::Estimators<estimators::Odometry, estimators::PoseEkf>>;

/// Drives a circle for 2 s at 0.5 m/s; a share of the samples comes `late` ticks after its time.
std::unique_ptr<Planar> circle(int late) {
  static constexpr param::Parameters kParameters = test::kNumbers;
  auto robot = std::make_unique<Planar>(kParameters);
  robot->start({1'000'000});
  const auto speed = [&](int k) {
    return robot->add(sensor::BodySpeed{.forward_mps = 0.5F, .yaw_rate_radps = 0.01F * static_cast<float>(k % 20)},
                      {1'000'000 + 10'000 * k});
  };
  for (int k = 1; k <= 200; ++k) {
    const auto held = [](int i) { return i % 7 == 3 && i < 180; };
    if (late == 0 || !held(k)) {
      EXPECT_EQ(speed(k), Admission::kTaken);
    }
    if (late > 0 && k > late && held(k - late)) {
      EXPECT_EQ(speed(k - late), late < 20 ? Admission::kTaken : Admission::kTooLate);
    }
    robot->advance({1'000'000 + 10'000 * k});
  }
  return robot;
}

TEST(Localizer, FusesALateSampleAtItsOwnTime) {
  const auto on_time = circle(0), late = circle(15);
  EXPECT_EQ(on_time->state_crc(), late->state_crc());
  EXPECT_NEAR(static_cast<double>(late->estimate().forward_mps), 0.5, 1e-3);
  EXPECT_NE(circle(15)->state_crc(), circle(30)->state_crc()) << "beyond the window it is lost";
}

TEST(Localizer, NamesTheFateOfEachMeasurement) {
  Planar robot(test::kNumbers);
  constexpr base::Micros t{5'000'000};
  const sensor::BodySpeed slow{.forward_mps = 0.1F, .yaw_rate_radps = 0};
  robot.start(t - base::Micros{10'000});
  robot.advance(t);
  robot.add_landmark({.x_mm = 5'000, .y_mm = 0, .id = 7});
  robot.set_pose({}, 0.1F, 0.05F);
  robot.advance(t + kPeriod);
  const auto at = [&](int ms) { return t + base::Micros{1'000 * ms}; };
  EXPECT_EQ(robot.add(slow, at(12)), Admission::kTaken);
  EXPECT_EQ(robot.add(slow, at(12)), Admission::kDuplicate);
  EXPECT_EQ(robot.add(slow, at(12), 0, 1), Admission::kTaken);
  EXPECT_EQ(robot.add(slow, at(-500)), Admission::kTooLate);
  EXPECT_EQ(robot.add(slow, at(900)), Admission::kTooEarly);
  EXPECT_EQ(robot.add(sensor::BodySpeed{.forward_mps = base::kNan}, at(13)), Admission::kOutOfRange);
  EXPECT_EQ(robot.add(sensor::AirPressure{.pressure_Pa = 1e5F}, at(13)), Admission::kNotUsed);
  EXPECT_EQ(robot.add(sensor::LandmarkSighting{.landmark = 7, .range_m = 5, .bearing_rad = 0}, at(15)),
            Admission::kTaken);
  EXPECT_EQ(robot.add(sensor::LandmarkSighting{.landmark = 7, .range_m = 9, .bearing_rad = 0}, at(16)),
            Admission::kTaken);
  robot.advance(at(20));
  const auto of = [&](sensor::Sensor kind, base::Micros stamp) {
    std::optional<Record> found;
    for (const Record& r : robot.records())
      if (r.sensor == kind && r.stamp == stamp && r.estimator == (kind == sensor::Sensor::kRangeBearing ? 1 : 0))
        found = r;
    return found.value_or(Record{});
  };
  const Record good = of(sensor::Sensor::kRangeBearing, at(15)), wild = of(sensor::Sensor::kRangeBearing, at(16));
  EXPECT_EQ(good.innovation.verdict, sensor::Verdict::kAccepted);
  EXPECT_LT(good.size(), 1.0F);
  EXPECT_EQ(wild.innovation.verdict, sensor::Verdict::kRejected);
  EXPECT_EQ(wild.innovation.failed, sensor::Check::kGate);
  EXPECT_GT(wild.size(), 1.0F);
  EXPECT_EQ(robot.records().front().innovation.verdict, sensor::Verdict::kTooLate);
  EXPECT_EQ(of(sensor::Sensor::kBodySpeed, at(12)).innovation.verdict, sensor::Verdict::kAccepted);
  robot.advance(at(30));
  EXPECT_TRUE(robot.records().empty());
  robot.advance(at(3'000));
  EXPECT_EQ(robot.estimate().reset_cause, sensor::ResetCause::kTimeJump);
}

}  // namespace
}  // namespace tetap::sim
