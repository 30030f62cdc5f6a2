// SPDX-License-Identifier: Apache-2.0
// A receiver that stamps its measurements late, with the row that says so, against one whose stamps are right.
#include "bench.hpp"
#include "earth_drive.hpp"
#include "tetap/base/state_words.hpp"
#include "tetap/estimators/inertial/inertial.hpp"
#include "tetap/localizer.hpp"

#include <gtest/gtest.h>
#include <deque>
#include <type_traits>

namespace tetap::test {
namespace {

using Robot = Localizer<node::EstimatorsWithPlaces<160, estimators::Inertial>>;  // 400 ms of IMU and wheels

constexpr GeoPlace kHere{59.3, 18.07, 30};
constexpr std::int64_t kLate_us = 200'000;

param::Parameters numbers(std::int32_t delay_us) {
  param::Parameters n = kNumbers;
  n.wheels.drive.counts_per_turn = 20'000;
  n.loop.window_us = 400'000;
  n.gnss.delay_us = delay_us;
  n.gnss.origin_configured = 1;
  n.gnss.origin_latitude_2ndeg = steps_2ndeg(kHere.latitude_deg);
  n.gnss.origin_longitude_2ndeg = steps_2ndeg(kHere.longitude_deg);
  n.gnss.origin_height_m = static_cast<float>(kHere.height_m);
  return n;
}

/// Whether it is a receiver's.
template <class Payload>
constexpr bool kReceived =
    std::is_same_v<Payload, sensor::GnssPosition> || std::is_same_v<Payload, sensor::GnssVelocity> ||
    std::is_same_v<Payload, sensor::OutsideHeading>;

/// A drive; what the receiver shows comes after `on_the_way_us`, with a stamp that is as late or right.
struct Outing {
  Outing(std::int64_t on_the_way, bool stamped_late, std::int32_t delay_us)
      : n(numbers(delay_us)), robot(n), on_the_way_us(on_the_way), late_us(stamped_late ? on_the_way : 0) {
    robot.start({drive.us});
  }
  void step() {
    drive.step([&]<class Payload>(const Payload& payload, std::int64_t us) {
      if constexpr (kReceived<Payload>) {
        waiting.push_back({us + on_the_way_us, sensor::sample_of(payload, {us + late_us})});
      } else {
        robot.add(payload, {us});
      }
    });
    for (; !waiting.empty() && waiting.front().arrives_us <= drive.us; waiting.pop_front()) {
      const sensor::Sample& s = waiting.front().sample;
      if (s.sensor == sensor::Sensor::kGnssPosition) last = robot.add(s.payload.gnss_position, s.stamp);
      if (s.sensor == sensor::Sensor::kGnssVelocity) last = robot.add(s.payload.gnss_velocity, s.stamp);
      if (s.sensor == sensor::Sensor::kHeading) last = robot.add(s.payload.heading, s.stamp);
      taken += last == Admission::kTaken;
      ++received;
    }
    robot.advance({drive.us});
  }

  struct Message {
    std::int64_t arrives_us;
    sensor::Sample sample;
  };
  param::Parameters n;
  EarthDrive drive{{.start = kHere, .noise = 1, .antennas = true}};
  Robot robot;
  std::int64_t on_the_way_us, late_us;
  std::deque<Message> waiting;
  Admission last = Admission::kTaken;
  int taken = 0, received = 0;
};

TEST(ReceiverDelay, OfTheRowIsTakenOutToTheBit) {
  Outing right(kLate_us, false, 0), row(kLate_us, true, kLate_us), late(kLate_us, true, 0), on_time(0, false, 0);
  double most_m = 0, most_late_m = 0;
  for (int k = 0; k < 6'000; ++k) {
    for (Outing* run : {&right, &row, &late, &on_time}) run->step();
    ASSERT_EQ(row.robot.state_crc(), right.robot.state_crc()) << k;
    const auto apart = [&](const Outing& a) {
      const auto &x = a.robot.estimate().pose, &y = on_time.robot.estimate().pose;
      return std::hypot(static_cast<double>(x.x.minus(y.x)), static_cast<double>(x.y.minus(y.y)));
    };
    if (k > 1'000) most_m = std::max(most_m, apart(row)), most_late_m = std::max(most_late_m, apart(late));
  }
  EXPECT_GT(row.received, 800);
  EXPECT_EQ(row.taken, row.received);
  EXPECT_TRUE(row.robot.estimate().position_valid);
  EXPECT_EQ(most_m, 0);         // on its way or not, a fix within the window counts as one that came at once
  EXPECT_GT(most_late_m, 0.5);  // at 5 m/s, without the row
}

// A delay that the window does not hold: every measurement is refused, and as too late.
TEST(ReceiverDelay, BeyondTheWindowIsTooLate) {
  Outing run(0, false, 450'000);
  for (int k = 0; k < 500; ++k) run.step();
  EXPECT_GT(run.received, 50);
  EXPECT_EQ(run.last, Admission::kTooLate);
  EXPECT_EQ(run.taken, 0);
  EXPECT_FALSE(run.robot.estimate().position_valid);
}

}  // namespace
}  // namespace tetap::test
