// SPDX-License-Identifier: Apache-2.0
// A robot is sent what it takes, and nothing else: its bus is loaded by nothing that nobody reads.
#include "sim_host/sent.hpp"

#include "sim_host/world_source.hpp"

#include <gtest/gtest.h>

#include <map>
#include <stdexcept>

namespace tetap::sim {
namespace {

std::map<std::uint32_t, int> sent_frames(const std::string& robot, double seconds,
                                         std::vector<FaultSetting> faults = {}) {
  World::Options options;
  options.faults = std::move(faults);
  send_only(sent_to(robot), options);
  WorldSource source(World(options, 1), 0x300, base::Micros{10'000}, {static_cast<std::int64_t>(seconds * 1e6)});
  std::map<std::uint32_t, int> count;
  Tick tick;
  while (source.next(tick))
    for (const base::CanFrame& frame : tick.inputs) ++count[frame.id - 0x300];
  return count;
}

struct Deaf {
  [[maybe_unused]] static constexpr can::EstimatorKind kKind = can::EstimatorKind::kEkf;
};
struct Compass : Deaf {
  app::Innovation fuse(const app::MagneticFlux&, base::Micros, const app::Context&) { return {}; }
};

TEST(Sent, a_robot_without_landmarks_gets_no_map_and_no_sightings) {
  const auto inertial = sent_frames("rover", 20);
  EXPECT_FALSE(inertial.contains(can::InMapEntry::kOffset));
  EXPECT_FALSE(inertial.contains(can::InRangeBearing::kOffset));
  EXPECT_GT(inertial.at(can::InGnssLat::kOffset), 90);
  EXPECT_GT(inertial.at(can::InGnssVelEN::kOffset), 90);
  const auto planar = sent_frames("rover_landmarks", 20);
  EXPECT_EQ(planar.at(can::InMapEntry::kOffset), 20);
  EXPECT_GT(planar.at(can::InRangeBearing::kOffset), 10);
  EXPECT_FALSE(planar.contains(can::InMag::kOffset));
  EXPECT_FALSE(planar.contains(can::InBaro::kOffset));
}

TEST(Sent, what_an_estimator_takes_is_found_at_compile_time) {
  static_assert(!Takes<Deaf, app::MagneticFlux>);
  static_assert(Takes<Compass, app::MagneticFlux> && !Takes<Compass, app::AirPressure>);
  EXPECT_THROW(static_cast<void>(sent_to("no such robot")), std::runtime_error);
}

TEST(Sent, a_start_in_motion_is_told_no_pose) {
  EXPECT_EQ(sent_frames("rover", 1).at(can::CmdSetPos::kOffset), 1);
  const auto moving = sent_frames("rover", 31, {{Fault::kMovingStart, {}, base::Micros{30'000'000}}});
  EXPECT_FALSE(moving.contains(can::CmdSetPos::kOffset));
  EXPECT_FALSE(moving.contains(can::CmdSetYaw::kOffset));
  EXPECT_NEAR(moving.at(can::InWheelCounts::kOffset), 100, 3);
}

}  // namespace
}  // namespace tetap::sim
