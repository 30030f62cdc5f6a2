// SPDX-License-Identifier: Apache-2.0
// A robot gets the messages that it takes, and nothing else. Nothing that nobody reads loads its bus, and a fault of a
// message that it does not get is refused.
#include "sim_host/published_sensors.hpp"
#include "sim_host/robot_of.hpp"

#include "sim_host/world_source.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

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

std::vector<std::string> words(std::string_view text) {
  std::istringstream in{std::string{text}};
  return {std::istream_iterator<std::string>{in}, {}};
}

/// Frames of the world to that robot, tick by tick, as text: ids and bytes.
class Sending {
 public:
  Sending(const std::string& robot, std::vector<FaultSetting> faults)
      : source_{World(options(robot, std::move(faults)), 1), 0x300, base::Micros{10'000}, base::Micros{20'000'000}} {}
  static World::Options options(const std::string& robot, std::vector<FaultSetting> faults) {
    World::Options options;
    options.faults = std::move(faults);
    send_only(sent_to(robot), options);
    return options;
  }
  bool next(std::string& bytes) {
    Tick tick;
    if (!source_.next(tick)) return false;
    bytes.clear();
    for (const base::CanFrame& frame : tick.inputs) {
      bytes += std::to_string(frame.id) + ":";
      bytes.append(reinterpret_cast<const char*>(frame.data.data()), frame.size);
    }
    return true;
  }

 private:
  WorldSource source_;
};

bool changes_a_frame(const std::vector<std::string>& without, Sending faulty) {
  std::string bytes;
  for (const std::string& one : without)
    if (!faulty.next(bytes) || bytes != one) return true;
  return false;
}

/// One robot of each kind of diet: the world is the same to the others.
std::vector<std::string> robots() {
  std::vector<std::string> found;
  for (const std::string& name : words(robot_names()))
    if (std::none_of(found.begin(), found.end(), [&](const auto& one) { return sent_to(one) == sent_to(name); }))
      found.push_back(name);
  return found;
}

struct Deaf {
  [[maybe_unused]] static constexpr sensor::EstimatorKind kKind = sensor::EstimatorKind::kEkf;
};
struct Compass : Deaf {
  estimators::Innovation fuse(const sensor::MagneticFlux&, base::Micros, const estimators::Context&) { return {}; }
};

TEST(Sent, a_robot_without_landmarks_gets_no_map_and_no_sightings) {
  const auto inertial = sent_frames("rover", 20);
  EXPECT_FALSE(inertial.contains(bus::InMapEntry::kOffset));
  EXPECT_FALSE(inertial.contains(bus::InRangeBearing::kOffset));
  EXPECT_GT(inertial.at(bus::InGnssLat::kOffset), 90);
  EXPECT_GT(inertial.at(bus::InGnssVelEN::kOffset), 90);
  const auto planar = sent_frames("rover_landmarks", 20);
  EXPECT_EQ(planar.at(bus::InMapEntry::kOffset), 20);
  EXPECT_GT(planar.at(bus::InRangeBearing::kOffset), 10);
  EXPECT_FALSE(planar.contains(bus::InMag::kOffset));
  EXPECT_FALSE(planar.contains(bus::InBaro::kOffset));
}

TEST(Sent, scans_and_images_go_to_robots_that_take_them) {
  const auto scanner = sent_frames("scanner", 20), visual = sent_frames("visual", 20), rover = sent_frames("rover", 20);
  EXPECT_NEAR(scanner.at(bus::InScanHead::kOffset), 200, 2);
  EXPECT_NEAR(visual.at(bus::InImage::kOffset), 200, 2);
  EXPECT_FALSE(scanner.contains(bus::InImage::kOffset) || visual.contains(bus::InScanHead::kOffset));
  EXPECT_FALSE(rover.contains(bus::InImage::kOffset) || rover.contains(bus::InScanHead::kOffset));
  EXPECT_FALSE(visual.contains(bus::InMapEntry::kOffset)) << "it sees the posts, and is not told where they are";
}

TEST(Sent, every_fault_that_a_robot_accepts_changes_what_it_is_sent_and_no_other_does) {
  std::set<std::string_view> acted;
  ASSERT_GE(robots().size(), 4U);
  for (const std::string& robot : robots()) {
    std::vector<std::string> without;
    std::string bytes;
    for (Sending sending{robot, {}}; sending.next(bytes);) without.push_back(bytes);
    const std::vector<std::string> act = words(applicable_faults(Sending::options(robot, {})));
    for (const FaultInfo& row : fault_table()) {
      // The robot stands until 10 s; its pose at the start comes with the first tick.
      const std::vector<FaultSetting> faults{{row.fault, base::Micros{14'000'000}, base::Micros{5'000'000}}};
      const std::string why = cannot_act(Sending::options(robot, faults), robot);
      EXPECT_EQ(why.empty(), changes_a_frame(without, Sending{robot, faults})) << robot << ": " << row.name << why;
      EXPECT_EQ(why.empty(), std::find(act.begin(), act.end(), row.name) != act.end()) << robot << ": " << row.name;
      if (why.empty()) acted.insert(row.name);
    }
  }
  EXPECT_EQ(acted.size(), fault_table().size()) << "there is a robot for every fault";
}

TEST(Sent, what_cannot_act_is_said_with_what_can) {
  const auto why = [](const char* robot, Fault fault, bool wheels = true) {
    World::Options options;
    options.faults = {{Fault::kLostFrames, {}, {}}, {fault, {}, {}}};
    if (!wheels) options.parameters.wheels.rate_hz = 0;
    return cannot_act(options, robot);
  };
  EXPECT_EQ(why("rover", Fault::kMagDisturbance).substr(0, 79),
            "fault 'mag_disturbance': robot rover has no magnetometer; faults that act on it");
  EXPECT_NE(why("rover", Fault::kLandmarkOutlier).find("robot rover has no landmarks; "), std::string::npos);
  EXPECT_NE(why("mrclam", Fault::kImuStuck).find("robot mrclam has no IMU; "), std::string::npos);
  EXPECT_NE(why("rover", Fault::kSlipLeft, false).find("robot rover has no wheels; "), std::string::npos);
  EXPECT_EQ(why("rover", Fault::kSlipLeft), "");
  EXPECT_EQ(why("rover", Fault::kMagDisturbance).find("landmark"), std::string::npos);
  EXPECT_TRUE(why("rover", Fault::kMagDisturbance).ends_with("; robots on which it acts: iris"));
  EXPECT_NE(why("iris", Fault::kLandmarkOutlier)
                .find("; robots on which it acts: husky labyrinth mapper mapper_fast mrclam "),
            std::string::npos);
  EXPECT_TRUE(why("rover", Fault::kSlipLeft, false).ends_with("; in this world it acts on none"));
}

TEST(Sent, what_an_estimator_takes_is_found_at_compile_time) {
  static_assert(!Takes<Deaf, sensor::MagneticFlux>);
  static_assert(Takes<Compass, sensor::MagneticFlux> && !Takes<Compass, sensor::AirPressure>);
  EXPECT_THROW(static_cast<void>(sent_to("no such robot")), std::runtime_error);
}

TEST(Sent, a_start_in_motion_is_told_no_pose) {
  EXPECT_EQ(sent_frames("rover", 1).at(bus::CmdSetPos::kOffset), 1);
  const auto moving = sent_frames("rover", 31, {{Fault::kMovingStart, {}, base::Micros{30'000'000}}});
  EXPECT_FALSE(moving.contains(bus::CmdSetPos::kOffset));
  EXPECT_FALSE(moving.contains(bus::CmdSetYaw::kOffset));
  EXPECT_NEAR(moving.at(bus::InWheelCounts::kOffset), 100, 3);
}

}  // namespace
}  // namespace tetap::sim
