// SPDX-License-Identifier: Apache-2.0
// Every robot in the world that its parameters describe. Without any fault its error fits its uncertainty. A copy with
// another body is simulated with that body.
#include "sim_host/in_process.hpp"
#include "sim_host/node_origin.hpp"
#include "sim_host/published_sensors.hpp"
#include "sim_host/replay/lockstep.hpp"
#include "sim_host/world_source.hpp"

#include "test/sim/support.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include <cmath>
#include <cstdio>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

namespace tetap::sim {
namespace {

constexpr std::uint32_t kBase = 0x300;

/// Poses of one estimator with their covariance, epoch by epoch.
class Listener {
 public:
  struct Row {
    bus::EstPos position;
    bus::EstMotion motion;
    std::optional<bus::EstStdPose> deviation;
    std::optional<bus::EstStdMore> correlation;
  };
  explicit Listener(std::size_t estimator) : k_{estimator} {}

  void restarted() {}
  void sent(const base::CanFrame&) {}
  void received(const base::CanFrame& frame) {
    const auto payload = bus::payload(frame);
    if (frame.id == kBase + bus::offset_of<bus::EstPos>(k_)) position_ = bus::decode<bus::EstPos>(payload);
    if (frame.id == kBase + bus::offset_of<bus::EstMotion>(k_)) motion_ = bus::decode<bus::EstMotion>(payload);
    if (frame.id != kBase + bus::offset_of<bus::EstStdPose>(k_)) return;
    if (const auto page = bus::decode<bus::EstStdPose>(payload)) deviation_ = page;
    if (const auto page = bus::decode<bus::EstStdMore>(payload)) correlation_ = page;
  }
  void epoch(const NodeEpoch&, base::Micros) {
    rows.push_back(position_ && motion_ ? std::optional<Row>{{*position_, *motion_, deviation_, correlation_}}
                                        : std::nullopt);
    position_.reset(), motion_.reset(), deviation_.reset(), correlation_.reset();
  }

  std::vector<std::optional<Row>> rows;

 private:
  std::size_t k_;
  std::optional<bus::EstPos> position_;
  std::optional<bus::EstMotion> motion_;
  std::optional<bus::EstStdPose> deviation_;
  std::optional<bus::EstStdMore> correlation_;
};

struct Judged {
  double nees = 0;    ///< mean over x, y, yaw (3)
  double beyond = 0;  ///< largest error over 3 sigma, of x or y
  double rmse_m = 0;
  double share = 0;  ///< epochs with a covariance
  double way_m = 0;
  double highest_m = 0;
};

struct Case {
  const char* robot;
  std::size_t estimator;  ///< the fused one
  double way_m;           ///< driven or flown in the time, at least
  VehicleKind kind;
};
void PrintTo(const Case& one, std::ostream* out) { *out << one.robot; }

Course course_of(VehicleKind kind) {
  return kind == VehicleKind::kCar           ? street_course(1)
         : kind == VehicleKind::kMulticopter ? flight_course(1)
                                             : default_course();
}

World::Options world_of(const std::string& robot, const param::Parameters& parameters) {
  World::Options options;
  const Sent sent = sent_to(robot);
  simulate(robot, sent, parameters, options);
  if (parameters.gnss.origin_configured != 0)
    options.origin = {static_cast<double>(parameters.gnss.origin_latitude_2ndeg) * 2e-9,
                      static_cast<double>(parameters.gnss.origin_longitude_2ndeg) * 2e-9,
                      static_cast<double>(parameters.gnss.origin_height_m)};
  options.course = course_of(sent.kind);
  send_only(sent, options);
  return options;
}

Judged run(const Case& one, const World::Options& options, const ParameterSettings& stated, std::uint64_t seed,
           double seconds) {
  Listener listener(one.estimator);
  NodeOrigin origin(kBase);
  OriginWatch watch(listener, origin);
  struct Drive {
    WorldSource source;
    std::vector<Truth> truths;
    bool next(Tick& tick) {
      if (!source.next(tick)) return false;
      truths.push_back(source.truth());
      return true;
    }
  } drive{.source = {World(options, seed), kBase, base::Micros{10'000}, seconds_us(seconds)}, .truths = {}};
  Counts counts;
  with_node_in_process(one.robot, stated, kBase, [&](InProcessLink& link) {
    EXPECT_TRUE(play_lockstep(link, drive, watch, {.base = kBase}, counts));
    return 0;
  });
  const FrameChange change(Earth(options.origin),
                           Earth(options.surveyed ? options.origin : origin.from_fix().value_or(options.origin)));
  Judged judged;
  double compared = 0, square = 0;
  const auto& truths = drive.truths;
  for (std::size_t i = 0; i < truths.size(); ++i) {
    const Truth truth = in_frame(truths[i], change);
    judged.highest_m = std::max(judged.highest_m, truth.z_m);
    if (i > 0) judged.way_m += std::hypot(truths[i].x_m - truths[i - 1].x_m, truths[i].y_m - truths[i - 1].y_m);
    if (i >= listener.rows.size() || !listener.rows[i]) continue;
    const Listener::Row& row = *listener.rows[i];
    if (!row.deviation || !row.correlation || !row.motion.pos_valid) continue;
    const auto wide = [](float x) { return static_cast<double>(x); };
    const Eigen::Vector3d std{wide(row.deviation->std_x_m), wide(row.deviation->std_y_m),
                              wide(row.deviation->std_yaw_rad)};
    const Eigen::Vector3d error{bus::EstPos::kXScale * row.position.x_raw - truth.x_m,
                                bus::EstPos::kYScale * row.position.y_raw - truth.y_m,
                                wrap(wide(row.motion.yaw_rad) - truth.yaw_rad)};
    Eigen::Matrix3d p = Eigen::Matrix3d::Identity();
    p(0, 1) = p(1, 0) = wide(row.deviation->corr_xy);
    p(0, 2) = p(2, 0) = wide(row.correlation->corr_x_yaw);
    p(1, 2) = p(2, 1) = wide(row.correlation->corr_y_yaw);
    const Eigen::Vector3d scaled = error.cwiseQuotient(std);
    judged.nees += scaled.dot(p.inverse() * scaled);
    judged.beyond = std::max({judged.beyond, std::abs(scaled.x()) / 3, std::abs(scaled.y()) / 3});
    square += error.head<2>().squaredNorm();
    compared += 1;
  }
  judged.nees /= compared;
  judged.rmse_m = std::sqrt(square / compared);
  judged.share = compared / static_cast<double>(truths.size());
  return judged;
}

constexpr int kSeeds = 3;
constexpr double kLength_s = 75;

Judged mean_of(const Case& one, const World::Options& options, const ParameterSettings& stated = {}) {
  Judged mean;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const Judged j = run(one, options, stated, seed, kLength_s);
    std::printf("%s, seed %d: NEES %.2f (3), error %.2f of 3 sigma, RMSE %.2f m, %.0f m, %.0f m high\n", one.robot,
                static_cast<int>(seed), j.nees, j.beyond, j.rmse_m, j.way_m, j.highest_m);
    mean.nees += j.nees / kSeeds;
    mean.beyond = std::max(mean.beyond, j.beyond);
    mean.rmse_m += j.rmse_m / kSeeds;
    mean.share += j.share / kSeeds;
    mean.way_m += j.way_m / kSeeds;
    mean.highest_m = std::max(mean.highest_m, j.highest_m);
  }
  return mean;
}

class Robots : public ::testing::TestWithParam<Case> {};

TEST_P(Robots, without_a_fault_are_as_uncertain_as_they_say) {
  const Case& one = GetParam();
  const Judged j = mean_of(one, world_of(one.robot, parameters_of(one.robot)));
  EXPECT_GT(j.way_m, one.way_m);
  EXPECT_EQ(j.highest_m > 5, one.kind == VehicleKind::kMulticopter);
  EXPECT_GT(j.share, 0.05);
  EXPECT_LT(j.nees, 4.5);
  EXPECT_GT(j.nees, 0.3) << "nor is it ten times as good as it says";
  EXPECT_LT(j.beyond, 2) << "multipath that a gate of 99 % lets through";
}

INSTANTIATE_TEST_SUITE_P(All, Robots,
                         ::testing::Values(Case{"rover", 2, 80, VehicleKind::kDifferentialDrive},
                                           Case{"husky_inertial", 1, 80, VehicleKind::kDifferentialDrive},
                                           Case{"car", 0, 300, VehicleKind::kCar},
                                           Case{"iris", 1, 100, VehicleKind::kMulticopter},
                                           Case{"scanner", 1, 40, VehicleKind::kDifferentialDrive},
                                           Case{"visual", 1, 80, VehicleKind::kDifferentialDrive}),
                         [](const auto& which) { return std::string(which.param.robot); });

/// The rover's node told of another body; the world has it, or not.
struct Copy {
  param::Parameters parameters = parameters_of("rover");
  ParameterSettings stated;
  void set(const char* setting) { stated.set(setting, "test"); }
  void apply() { parameters = stated.over(parameters); }
};

TEST(Copies, with_another_body_are_simulated_with_that) {
  Copy copy;
  for (const char* one : {"wheels.drive.left_radius_m=0.15", "wheels.drive.right_radius_m=0.15",
                          "wheels.drive.track_m=0.9", "wheels.drive.counts_per_turn=1200", "gnss.antenna_x_b_m=0.7",
                          "inertial.axle_x_b_m=-0.4", "inertial.mounting_bs=0,0,-1,-1,0,0,0,1,0"})
    copy.set(one);
  copy.apply();
  const Case rover{"rover", 2, 80, VehicleKind::kDifferentialDrive};
  const Judged right = mean_of(rover, world_of("rover", copy.parameters), copy.stated);
  EXPECT_LT(right.nees, 4.5);
  EXPECT_GT(right.nees, 0.3);
  EXPECT_LT(right.beyond, 1.3);
  // The same node in the world of the rover as it was drawn: wheels that are half as large again.
  Copy wheels;
  for (const char* one : {"wheels.drive.left_radius_m=0.15", "wheels.drive.right_radius_m=0.15"}) wheels.set(one);
  const Judged wrong = run(rover, world_of("rover", parameters_of("rover")), wheels.stated, 1, kLength_s);
  EXPECT_GT(wrong.rmse_m, 3 * right.rmse_m);
}

}  // namespace
}  // namespace tetap::sim
