// SPDX-License-Identifier: Apache-2.0
// Robots that make a map of their own, as frames in and frames out: the map on the bus, set pose, reset, a full map,
// late sightings.
#include "bench.hpp"
#include "estimators/mapping/planar_mapper.hpp"

#include <gtest/gtest.h>
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <random>

namespace tetap::test {
namespace {

using Ekf = node::Estimators<estimators::Odometry, estimators::EkfSlam30>;
using Fast = node::Estimators<estimators::Odometry, estimators::FastSlam100>;
static_assert(Ekf::kMakesMap && !Ekf::kUsesMap);
static_assert(node::RecordsLater<estimators::EkfSlam30> && node::DigestsState<estimators::EkfSlam30>);
static_assert(sizeof(estimators::EkfSlam30) < 32 * 1024 && sizeof(estimators::FastSlam100) < 40 * 1024,
              "the class of 64 kB holds either with the window and the stack");

constexpr std::uint32_t kBase = 0x300;
struct Place {
  double x, y;
};

/// A robot on a circle of 3 m around the origin, at 0.5 m/s, among posts; sightings of what is within 6 m ten times a
/// second, all of one stamp.
template <class Estimators>
class Mapping {
 public:
  explicit Mapping(int posts = 8) : bench(std::make_unique<BenchOf<Estimators>>(numbers())) {
    for (int i = 0; i < posts; ++i) {
      const double angle = 2 * M_PI * i / posts;
      truth[i + 1] = {(i % 2 == 0 ? 5.0 : 4.0) * std::cos(angle), (i % 2 == 0 ? 5.0 : 4.0) * std::sin(angle)};
    }
    for (const auto& frame : set_pose(1, 3000, 0, static_cast<float>(M_PI / 2), 0.0F, 0.0F)) now.push_back(frame);
  }
  /// A node keeps a reference to its parameters.
  static const param::Parameters& numbers() {
    static const param::Parameters n = [] {
      param::Parameters p = kNumbers;
      p.landmark = {.sigma_range_m = 0.05F, .sigma_bearing_rad = 0.02F, .gate_scale = 1.5F};
      return p;
    }();
    return n;
  }

  /// Sightings are true but for a noise of `share` of their sigmas; `late_us`: they arrive so much later.
  void drive(int epochs, double share = 1, std::int64_t late_us = 0, bool backwards = false) {
    for (int i = 0; i < epochs; ++i, ++tick) {
      const std::int64_t at_us = bench->now_us + 5000;
      const double t = 1e-6 * static_cast<double>(at_us - bench->kStart_us), yaw = M_PI / 2 + t * kRate;
      now.push_back(body_speed(at_us, static_cast<float>(kSpeed), static_cast<float>(kRate), tick));
      Frames seen;
      for (const auto& [id, post] : tick % 10 == 9 ? truth : std::map<int, Place>{}) {
        const double dx = post.x - 3 * std::cos(t * kRate), dy = post.y - 3 * std::sin(t * kRate);
        std::normal_distribution<double> normal(0, share);
        const double range = std::hypot(dx, dy) + 0.05 * normal(draw);
        const double bearing = std::remainder(std::atan2(dy, dx) - yaw + 0.02 * normal(draw), 2 * M_PI);
        if (range < 6)
          seen.push_back(sighting(at_us, id, static_cast<float>(range), static_cast<float>(bearing), tick / 10));
      }
      if (backwards) std::reverse(seen.begin(), seen.end());
      for (const auto& frame : seen) waiting.push_back({bench->now_us + late_us, frame});
      while (!waiting.empty() && waiting.front().first <= bench->now_us) {
        now.push_back(waiting.front().second);
        waiting.erase(waiting.begin());
      }
      step();
    }
  }
  void step() {
    out = bench->epoch(now);
    now.clear();
    for (const auto& frame : out) {
      if (const auto one = message<bus::EstLandmark>(frame))
        map[one->id] = {one->x_raw * bus::EstLandmark::kXScale, one->y_raw * bus::EstLandmark::kYScale};
      if (const auto one = message<bus::EstDiagMapper>(frame)) page = *one;
      if (const auto one = message<bus::EstInnov>(frame))
        ++verdicts[one->sensor == sensor::Sensor::kRangeBearing ? one->verdict : sensor::Verdict::kNotUsed];
      if (const auto one = message<bus::EstStatus>(frame)) status = *one;
      if (const auto one = message<bus::EstStateCrc>(frame)) crc = one->crc;
    }
  }
  template <class Message>
  static std::optional<Message> message(const base::CanFrame& frame) {
    if (frame.id != kBase + bus::offset_of<Message>()) return std::nullopt;
    return bus::decode<Message>(bus::payload(frame));
  }
  [[nodiscard]] double worst_landmark_m() const {
    double worst = 0;
    for (const auto& [id, at] : map) worst = std::max(worst, std::hypot(at.x - truth.at(id).x, at.y - truth.at(id).y));
    return worst;
  }
  [[nodiscard]] Place robot() const {
    const auto pos = last<bus::EstPos>(out, 1);
    return {pos->x_raw * bus::EstPos::kXScale, pos->y_raw * bus::EstPos::kYScale};
  }

  static constexpr double kSpeed = 0.5, kRate = kSpeed / 3;
  std::unique_ptr<BenchOf<Estimators>> bench;
  std::map<int, Place> truth, map;  ///< posts by number; as last published
  bus::EstDiagMapper page;
  bus::EstStatus status;
  std::map<sensor::Verdict, int> verdicts;
  std::uint32_t crc = 0;
  Frames now, out;
  std::vector<std::pair<std::int64_t, base::CanFrame>> waiting;
  std::mt19937 draw{4};
  int tick = 0;
};

template <class Estimators>
class OwnMap : public testing::Test {};
using Mappers = testing::Types<Ekf, Fast>;
TYPED_TEST_SUITE(OwnMap, Mappers);

TYPED_TEST(OwnMap, GoesOutOnTheBusAndIsTrue) {
  Mapping<TypeParam> run;
  run.drive(3800);
  EXPECT_EQ(run.map.size(), 8U);
  EXPECT_EQ(run.page.map_size, 8);
  EXPECT_LT(run.worst_landmark_m(), 0.25);
  const double t = 1e-6 * static_cast<double>(run.bench->now_us - run.bench->kStart_us);
  EXPECT_LT(std::hypot(run.robot().x - 3 * std::cos(t * run.kRate), run.robot().y - 3 * std::sin(t * run.kRate)), 0.3);
  EXPECT_EQ(run.verdicts[sensor::Verdict::kNewLandmark], 8);
  EXPECT_EQ(run.verdicts[sensor::Verdict::kPending], 0);  // fuse()'s own word is no record
  EXPECT_GT(run.verdicts[sensor::Verdict::kAccepted], 1000);
  EXPECT_EQ(run.status.mode, sensor::Mode::kNominal);
}

TEST(OwnMapFrames, HaveTheLayoutOfAMapEntry) {
  EXPECT_EQ(bus::encode(bus::EstLandmark{.id = 7, .x_raw = -123456, .y_raw = 654321}),
            bus::encode(bus::InMapEntry{.id = 7, .x_raw = -123456, .y_raw = 654321}));
  EXPECT_EQ(bus::EstLandmark::kOffset, 0x40);
}

/// Sightings of one stamp are fused together: neither their order nor how late they come changes a bit.
TYPED_TEST(OwnMap, OrderAndDelayOfSightingsChangeNothing) {
  Mapping<TypeParam> on_time, turned, late;
  for (int i = 0; i < 40; ++i) {
    on_time.drive(20), turned.drive(20, 1, 0, true), late.drive(20, 1, 120'000);
    EXPECT_EQ(on_time.crc, turned.crc) << i;
  }
  // All that is late has come; the present needs no sightings of the last 200 ms.
  on_time.drive(1), late.drive(1);
  EXPECT_EQ(on_time.map.size(), late.map.size());
  for (const auto& [id, at] : on_time.map) {
    EXPECT_EQ(at.x, late.map.at(id).x) << id;
    EXPECT_EQ(at.y, late.map.at(id).y) << id;
  }
}

TYPED_TEST(OwnMap, ASetPoseMovesRobotAndMapRigidly) {
  Mapping<TypeParam> run;
  run.drive(2400);
  const auto before = run.map;
  const Place from = run.robot();
  const auto heading = last<bus::EstMotion>(run.out, 1)->yaw_rad;
  for (const auto& frame : set_pose(2, 100'000, -50'000, 0.0F, 0.01F, 0.001F)) run.now.push_back(frame);
  run.step();
  run.map.clear();
  for (int i = 0; i < 100; ++i) run.step();
  EXPECT_EQ(run.page.map_size, 8);
  ASSERT_EQ(run.map.size(), 8U);
  const double c = std::cos(-static_cast<double>(heading)), s = std::sin(-static_cast<double>(heading));
  for (const auto& [id, at] : before) {
    const double dx = at.x - from.x, dy = at.y - from.y;
    // Within the way of a fifth of a second: the pose is set where the window ends.
    EXPECT_NEAR(run.map.at(id).x, 100 + c * dx - s * dy, 0.1) << id;
    EXPECT_NEAR(run.map.at(id).y, -50 + s * dx + c * dy, 0.1) << id;
  }
}

TYPED_TEST(OwnMap, AResetForgetsTheMapAndKeepsThePose) {
  Mapping<TypeParam> run;
  run.drive(1000);
  ASSERT_GE(run.page.map_size, 6);
  const Place from = run.robot();
  run.now.push_back(in(bus::protect(bus::CmdReset{.ctr = 5, .what = bus::ResetWhat::kOwnMap})));
  run.step();
  EXPECT_NEAR(run.robot().x, from.x, 0.05);
  EXPECT_NEAR(run.robot().y, from.y, 0.05);
  for (int i = 0; i < 100; ++i) run.step();
  EXPECT_EQ(run.page.map_size, 0);
  EXPECT_EQ(last<bus::EstDiagFrames>(run.bench->idle(130))->out_of_range, 0);
}

/// More posts than places: those that are there stay, the others are refused, counted and said.
TYPED_TEST(OwnMap, AFullMapRefusesCountsAndSays) {
  constexpr int kPlaces = std::is_same_v<TypeParam, Ekf> ? 30 : 15;
  Mapping<TypeParam> run(kPlaces + 6);
  run.drive(3800, 0.2);
  EXPECT_EQ(run.page.map_size, kPlaces);
  EXPECT_EQ(run.map.size(), static_cast<std::size_t>(kPlaces));
  EXPECT_GT(run.page.map_refused, 100);
  EXPECT_GT(run.verdicts[sensor::Verdict::kNoRoom], 10);
  EXPECT_NE(run.status.faults & 1U << static_cast<unsigned>(sensor::Fault::kCapacity), 0);
  EXPECT_LT(run.worst_landmark_m(), 0.3);
}

/// Any bits in sightings and speeds, set poses and resets in between: the estimate stays a number with a covariance.
TYPED_TEST(OwnMap, IsANumberWhateverComes) {
  auto bench = std::make_unique<BenchOf<TypeParam>>(Mapping<TypeParam>::numbers());
  std::mt19937 draw(11);
  for (int i = 0; i < 6000; ++i) {
    Frames frames;
    const auto add = [&](base::CanFrame frame, std::size_t first_free) {  // stamp, sequence and identity stay
      for (std::size_t b = first_free; b < 8; ++b) frame.data[b] = static_cast<std::uint8_t>(draw());
      frames.push_back(frame);
    };
    const std::int64_t at_us = bench->now_us + 1 + static_cast<std::int64_t>(draw() % 9999);
    if (i % 3 == 0) add(body_speed(at_us, 0, 0, i), i % 30 == 0 ? 3 : 8);
    for (unsigned k = 0; k < draw() % 4; ++k)
      add(sighting(at_us, static_cast<int>(draw() % 40), 3, 0, static_cast<int>(draw())), 5);
    if (i % 500 == 499)
      for (const auto& frame :
           set_pose(i / 500, static_cast<int>(draw() % 100'000), 0, 1, 0.5F, draw() % 2 ? 4.0F : 0.1F))
        frames.push_back(frame);
    if (i % 700 == 699)
      frames.push_back(in(bus::protect(
          bus::CmdReset{.ctr = static_cast<std::uint8_t>(i / 700 & 15), .what = bus::ResetWhat::kOwnMap})));
    const Frames out = bench->epoch(frames);
    ASSERT_NE(last<bus::EstPos>(out, 1)->x_raw, bus::EstPos::kXNotAvailable) << i;
    ASSERT_TRUE(base::is_finite(last<bus::EstMotion>(out, 1)->yaw_rad)) << i;
    if (const auto status = last<bus::EstStatus>(out)) {
      ASSERT_NE(status->reset_cause, sensor::ResetCause::kNotFinite) << i;
      ASSERT_NE(status->reset_cause, sensor::ResetCause::kNotPositive) << i;
    }
    if (const auto deviation = last<bus::EstStdPose>(out, 1)) {
      ASSERT_GT(deviation->std_x_m, -1) << i;
      ASSERT_GT(deviation->std_yaw_rad, -1) << i;
    }
    for (const auto& one : all<bus::EstLandmark>(out)) ASSERT_NE(one.x_raw, bus::EstLandmark::kXNotAvailable) << i;
  }
}

}  // namespace
}  // namespace tetap::test
