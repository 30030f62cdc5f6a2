// SPDX-License-Identifier: Apache-2.0
// A robot with a pose graph, as frames in and frames out: keyframes by wheels or by a front end, closures, bad input.
// Set pose and reset come with a job in flight, and far more than fits is sent.
#include "tetap/estimators/mapping/graph_mapper.hpp"
#include "bench.hpp"
#include "tetap/bus/encoder.hpp"

#include <gtest/gtest.h>
#include <cmath>
#include <memory>
#include <random>

namespace tetap::test {
namespace {

using GraphRobot = node::Estimators<estimators::Odometry, estimators::GraphMapper128>;
static_assert(GraphRobot::kMakesMap && node::WorksInJobs<estimators::GraphMapper128> &&
              estimators::MapsKeyframes<estimators::GraphMapper128>);
static_assert(sizeof(estimators::GraphMapper128) < 53 * 1024, "an image of 64 kB holds it with window and stack");
static_assert(sizeof(estimators::GraphMapper256) < 116 * 1024, "and one of 128 kB");

struct Sigmas {
  float x_m = 0.1F, y_m = 0.1F, yaw_rad = 0.02F;
};

class GraphMapperTest : public testing::Test {
 protected:
  explicit GraphMapperTest(std::int32_t work_units = 100'000, std::int32_t keyframes = 1)
      : numbers_(numbers(work_units, keyframes)), bench_(std::make_unique<BenchOf<GraphRobot>>(numbers_)) {}
  static param::Parameters numbers(std::int32_t work_units, std::int32_t keyframes) {
    param::Parameters n = kNumbers;
    n.loop.window_us = 20'000;
    n.loop.work_units = work_units;
    n.mapping.publish_every = 1;
    n.mapping.keyframes = keyframes;
    n.publish.diagnostics_every = 1;
    n.publish.event_every = 1;
    return n;
  }

  Frames pages(int from, int to, float x_m, float y_m, float yaw_rad, const Sigmas& sigma = {}) {
    ++seq_;
    const auto seq = static_cast<std::uint8_t>(seq_ & 15);
    return {in(bus::InClosureFrames{.seq = seq,
                                    .from_id = static_cast<std::uint16_t>(from & 0x3FFF),
                                    .to_id = static_cast<std::uint16_t>(to & 0x3FFF),
                                    .stamp_us = stamp(bench_->now_us + 5'000)}),
            in(bus::InClosurePose{.seq = seq, .x_m = x_m, .y_m = y_m, .yaw_rad = yaw_rad}),
            in(bus::InClosureStd{.seq = seq, .std_x_m = sigma.x_m, .std_y_m = sigma.y_m, .std_yaw_rad = sigma.yaw_rad}),
            in(bus::InClosureCorr{.seq = seq})};
  }
  void tick(const Frames& frames = {}) {
    const Frames out = bench_->epoch(frames);
    for (const auto& one : all<bus::EstKeyframe>(out)) announced_.push_back(one);
    for (const auto& one : all<bus::EstInnov>(out))
      if (one.sensor == sensor::Sensor::kClosure) ++verdicts_[one.verdict];
    if (const auto graph = last<bus::EstGraph>(out)) graph_ = *graph;
    if (const auto page = last<bus::EstDiagMapper>(out)) page_ = *page;
    if (const auto page = last<bus::EstDiagFrames>(out)) counted_ = *page;
    if (const auto page = last<bus::EstDiagRefused>(out)) refused_ = *page;
    if (const auto page = last<bus::EstDiagOrder>(out)) order_ = *page;
    if (const auto status = last<bus::EstStatus>(out)) status_ = *status, faults_ |= status->faults;
    if (const auto k = last<bus::EstKeyframePose>(out)) keyframes_[k->id] = *k;
    if (const auto pos = last<bus::EstPos>(out, 1)) x_m_ = 1e-3 * pos->x_raw, y_m_ = 1e-3 * pos->y_raw;
    if (const auto motion = last<bus::EstMotion>(out, 1)) yaw_rad_ = static_cast<double>(motion->yaw_rad);
    if (const auto std = last<bus::EstStdPose>(out, 1)) std_ = *std;
    crc_ = last<bus::EstStateCrc>(out)->crc;
  }
  void ticks(int count) {
    for (int i = 0; i < count; ++i) tick();
  }
  /// Straight on, a keyframe a metre.
  void drive(int steps, const Sigmas& sigma = {}) {
    for (int i = 0; i < steps; ++i, ++steps_) tick(pages(steps_, steps_ + 1, 1, 0, 0, sigma));
    ticks(5);
  }

  param::Parameters numbers_;
  std::unique_ptr<BenchOf<GraphRobot>> bench_;
  std::vector<bus::EstKeyframe> announced_;
  std::map<sensor::Verdict, int> verdicts_;
  std::map<int, bus::EstKeyframePose> keyframes_;
  bus::EstGraph graph_;
  bus::EstDiagMapper page_;
  bus::EstDiagFrames counted_;
  bus::EstDiagRefused refused_;
  bus::EstDiagOrder order_;
  bus::EstStatus status_;
  bus::EstStdPose std_;
  unsigned faults_ = 0;
  double x_m_ = 0, y_m_ = 0, yaw_rad_ = 0;
  std::uint32_t crc_ = 0;
  int steps_ = 0, seq_ = 0;
};

class WheelsTest : public GraphMapperTest {
 protected:
  WheelsTest() : GraphMapperTest(100'000, 0) {}
};

/// 1 m/s for 5 s, a keyframe after half a metre: ids count from 1, each step is what was driven.
TEST_F(WheelsTest, WayMakesKeyframesThatTheBusAnnounces) {
  for (int i = 0; i < 500; ++i) tick({body_speed(bench_->now_us + 5'000, 1, 0, i)});
  ASSERT_GE(announced_.size(), 9U);
  for (std::size_t k = 0; k < announced_.size(); ++k) {
    EXPECT_EQ(announced_[k].id, k + 1);
    EXPECT_NEAR(announced_[k].step_x_m, 0.5, 0.012);
    EXPECT_NEAR(announced_[k].step_y_m, 0, 0.003);
  }
  EXPECT_NEAR(x_m_, 5.0, 0.02) << "the way since the last keyframe counts";
  // The sensor that closes loops names what it was told. Half of the way was slip.
  tick(pages(0, 9, 4.48F, 0, 0, {.x_m = 0.001F, .y_m = 0.001F, .yaw_rad = 0.001F}));
  ticks(20);
  EXPECT_EQ(graph_.status, bus::GraphStatus::kConverged);
  EXPECT_EQ(graph_.closures, 1);
}

/// Ten steps of 1 m with sigma s, and 10.5 m from end to end with sigma c. x = (10/10s^2 + 10.5/c^2)/(1/10s^2 + 1/c^2).
/// The sum of squares is 0.5^2 / (10 s^2 + c^2).
TEST_F(GraphMapperTest, AClosureGivesTheLeastSquaresOfAStraightLine) {
  drive(10);
  EXPECT_NEAR(x_m_, 10, 0.002);
  tick(pages(0, 10, 10.5F, 0, 0, {.x_m = 0.01F, .y_m = 0.1F, .yaw_rad = 0.02F}));
  ticks(30);
  EXPECT_EQ(graph_.status, bus::GraphStatus::kConverged);
  EXPECT_NEAR(x_m_, 10.4995, 0.001);
  EXPECT_NEAR(1e-6 * static_cast<double>(graph_.chi2_raw), 0.25 / 0.1001, 2e-4);
  EXPECT_NEAR(std_.std_x_m, 0.01, 0.003) << "odometry alone: 0.32 m";
  EXPECT_EQ(verdicts_[sensor::Verdict::kAccepted], 1) << "odometry makes no record";
  EXPECT_EQ(announced_.size(), 10U);
  ticks(100);
  EXPECT_EQ(refused_.not_used, 0) << "a closure is a sample that the graph takes";
}

TEST_F(GraphMapperTest, ClosuresThatAreFalseOrUnknownAreRefusedWithTheirReason) {
  drive(10);
  tick(pages(2, 8, 0, 0, 0));
  tick(pages(2, 500, 1, 0, 0));
  tick(pages(0, 12, 1, 0, 0));
  ticks(10);
  EXPECT_EQ(verdicts_[sensor::Verdict::kRejected], 1);
  EXPECT_EQ(verdicts_[sensor::Verdict::kUnknownLandmark], 2);
  EXPECT_EQ(graph_.closures, 0);
  EXPECT_EQ(page_.ambiguous, 1) << "contradicted";
  EXPECT_NEAR(x_m_, 10, 0.002);
}

TEST_F(GraphMapperTest, PagesOfTwoClosuresAreNeverMixed) {
  drive(10);
  for (std::size_t lost = 0; lost < 4; ++lost) {
    Frames frames = pages(0, 10, 10.4F, 0, 0);
    frames.erase(frames.begin() + static_cast<std::ptrdiff_t>(lost));
    seq_ += 15;  // the number comes again with the next one
    const Frames second = pages(0, 10, 10.0F, 0.1F, 0);
    frames.insert(frames.end(), second.begin(), second.end());
    tick(frames);
  }
  ticks(60);
  EXPECT_EQ(verdicts_[sensor::Verdict::kAccepted], 4) << "the whole ones";
  EXPECT_GT(counted_.incomplete, 3);
  EXPECT_NEAR(x_m_, 10.0, 0.01) << "nothing of the halves";
}

TEST_F(GraphMapperTest, BadClosuresAreCountedAndLoseNothing) {
  drive(10);
  const float nan = base::kNan;
  const std::vector<Frames> bad{pages(3, 3, 1, 0, 0), pages(0, 10, nan, 0, 0), pages(0, 10, 10, 0, nan),
                                pages(0, 10, 10, 0, 0, {.x_m = 0.0F}), pages(0, 10, 10, 0, 0, {.yaw_rad = nan})};
  for (const Frames& frames : bad) tick(frames);
  Frames beyond = pages(0, 10, 10, 0, 0);
  beyond.back() = in(bus::InClosureCorr{.seq = static_cast<std::uint8_t>(seq_ & 15), .corr_xy = 1.0F});
  tick(beyond);
  Frames singular = pages(0, 10, 10, 0, 0);  // each correlation by itself is one
  singular.back() = in(bus::InClosureCorr{
      .seq = static_cast<std::uint8_t>(seq_ & 15), .corr_xy = 0.9F, .corr_x_yaw = 0.9F, .corr_y_yaw = -0.9F});
  tick(singular);
  Frames brief = pages(0, 10, 10, 0, 0);
  brief[1].size = 7;
  tick(brief);
  ticks(60);
  EXPECT_EQ(counted_.out_of_range, 6);
  EXPECT_EQ(counted_.malformed, 1);
  EXPECT_EQ(verdicts_[sensor::Verdict::kSingular], 1);
  EXPECT_EQ(verdicts_[sensor::Verdict::kAccepted], 0);
  drive(1);
  EXPECT_NEAR(x_m_, 11, 0.002) << "the graph goes on";
}

TEST_F(GraphMapperTest, AClosureFromBeforeTheWindowIsRefusedAndCounted) {
  drive(5);
  const Frames late = pages(0, 5, 5, 0, 0);
  ticks(5);
  tick(late);
  ticks(20);
  EXPECT_EQ(order_.too_late, 1);
  EXPECT_EQ(verdicts_[sensor::Verdict::kTooLate], 1);
  EXPECT_EQ(graph_.closures, 0);
}

/// The distance of keyframes stays, a job in flight is given up and made anew, the sigma is the command's.
TEST_F(GraphMapperTest, SetPoseMovesTheGraphRigidlyAndRestartsTheJob) {
  bench_.reset();
  numbers_.loop.work_units = 5;  // a job of many ticks
  bench_ = std::make_unique<BenchOf<GraphRobot>>(numbers_);
  drive(10);
  tick(pages(0, 10, 10.5F, 0, 0, {.x_m = 0.01F, .y_m = 0.1F, .yaw_rad = 0.02F}));
  ticks(10);
  EXPECT_GT(page_.work_left, 0);
  EXPECT_EQ(graph_.jobs, 0);
  tick(set_pose(1, 100'000, -20'000, static_cast<float>(M_PI / 2), 0.2F, 0.1F));
  EXPECT_NEAR(x_m_, 100, 0.002);
  EXPECT_NEAR(y_m_, -20, 0.002);
  ticks(5);
  EXPECT_EQ(page_.jobs_aborted, 1);
  EXPECT_NEAR(std_.std_x_m, 0.2, 0.005);
  EXPECT_NEAR(std_.std_yaw_rad, 0.1, 0.002);
  ticks(3000);
  EXPECT_EQ(graph_.jobs, 1);
  EXPECT_EQ(graph_.status, bus::GraphStatus::kConverged);
  const auto length = std::hypot(keyframes_[10].x_m - keyframes_[0].x_m, keyframes_[10].y_m - keyframes_[0].y_m);
  EXPECT_NEAR(length, 10.4995, 0.015);
  EXPECT_NEAR(keyframes_[10].x_m - keyframes_[0].x_m, 0, 0.02) << "the line points north now";
}

TEST_F(GraphMapperTest, ResetForgetsTheGraphAndKeepsThePose) {
  drive(10);
  tick({in(bus::protect(bus::CmdReset{.ctr = 5, .what = bus::ResetWhat::kOwnMap}))});
  ticks(20);
  EXPECT_EQ(page_.map_size, 1);
  EXPECT_NEAR(x_m_, 10, 0.002);
  steps_ = 0;
  drive(3);
  ticks(10);
  EXPECT_EQ(page_.map_size, 4);
  EXPECT_NEAR(x_m_, 13, 0.005);
}

/// Once and four times the units a tick: the same state to the bit after the jobs have ended.
TEST_F(GraphMapperTest, HowTheUnitsAreDealtChangesNoBit) {
  std::array<double, 2> x{};
  std::array<std::uint64_t, 2> chi2{};
  std::array<int, 2> first_adopted{};
  for (const std::size_t k : {0U, 1U}) {
    numbers_.loop.work_units = k == 0 ? 20 : 80;
    bench_ = std::make_unique<BenchOf<GraphRobot>>(numbers_);
    steps_ = seq_ = 0;
    graph_ = {};
    drive(20);
    tick(pages(0, 20, 20.5F, 0.3F, 0.01F));
    for (int i = 0; i < 4000; ++i) {
      tick();
      if (graph_.jobs == 0) ++first_adopted[k];
    }
    EXPECT_EQ(graph_.status, bus::GraphStatus::kConverged);
    x[k] = x_m_;
    chi2[k] = graph_.chi2_raw;
  }
  EXPECT_EQ(x[0], x[1]);
  EXPECT_EQ(chi2[0], chi2[1]);
  EXPECT_GT(first_adopted[0], 2 * first_adopted[1]);
}

/// Ten times what fits: laps of a square with true and false closures, set pose and reset in between.
TEST_F(GraphMapperTest, TenTimesFullGoesThroughItsStagesAndNeverHangs) {
  std::mt19937 draw(7);
  std::normal_distribution<float> normal;
  const auto near = [&](float x) { return x + 0.02F * normal(draw); };
  const Sigmas sharp{.x_m = 0.03F, .y_m = 0.03F, .yaw_rad = 0.01F};
  for (int i = 1; i <= 1280; ++i, ++steps_) {
    Frames frames = pages(steps_, steps_ + 1, near(1), near(0), i % 5 == 0 ? 1.5708F : 0.0F, sharp);
    const auto add = [&](const Frames& more) { frames.insert(frames.end(), more.begin(), more.end()); };
    const int now = steps_ + 1;
    for (const int lap : {20, 40, 60})
      if (now > lap) add(pages(now - lap, now, near(0), near(0), 0, sharp));
    if (i % 9 == 0) add(pages(static_cast<int>(draw() % static_cast<unsigned>(now)), now, 9, 3, 1, sharp));
    if (i == 700) add(set_pose(1, 50'000, 0, 1));
    if (i == 1000) {
      add({in(bus::protect(bus::CmdReset{.ctr = 3, .what = bus::ResetWhat::kOwnMap}))});
      steps_ = -1;
    }
    tick(frames);
    if (i == 1000) tick();
    ASSERT_LE(page_.map_size, 128);
    ASSERT_TRUE(std::isfinite(x_m_ + y_m_ + yaw_rad_)) << i;
    ASSERT_NE(status_.reset_cause, sensor::ResetCause::kNotFinite) << i;
    ASSERT_NE(status_.reset_cause, sensor::ResetCause::kNotPositive) << i;
  }
  ticks(800);
  EXPECT_EQ(page_.work_left, 0) << "jobs end";
  EXPECT_EQ(graph_.status, bus::GraphStatus::kConverged);
  EXPECT_GE(page_.map_size, 128 / 4) << "a quarter of the places stays";
  EXPECT_GT(page_.ambiguous, 50) << "false closures";
  EXPECT_GT(verdicts_[sensor::Verdict::kAccepted], 500);
}

/// Any bits in closures and speeds: the estimate stays a number with a covariance.
TEST_F(GraphMapperTest, IsANumberWhateverComes) {
  std::mt19937 draw(3);
  for (int i = 0; i < 6000; ++i) {
    Frames frames =
        i % 2 == 0 ? pages(steps_, steps_ + 1, 1, 0, 0.1F) : pages(static_cast<int>(draw() % 4000), steps_, 1, 0, 0);
    if (i % 2 == 0) ++steps_;
    for (std::size_t page = 1; page < 4; ++page)
      if (draw() % 4 == 0)
        for (std::size_t b = 1; b < 8; ++b) frames[page].data[b] = static_cast<std::uint8_t>(draw());
    frames.push_back(body_speed(bench_->now_us + 3'000, static_cast<float>(draw() % 9), 1, i));
    tick(frames);
    if (announced_.size() < static_cast<std::size_t>(steps_)) steps_ = static_cast<int>(announced_.size());
    ASSERT_TRUE(std::isfinite(x_m_ + y_m_ + yaw_rad_)) << i;
    ASSERT_NE(status_.reset_cause, sensor::ResetCause::kNotFinite) << i;
    ASSERT_NE(status_.reset_cause, sensor::ResetCause::kNotPositive) << i;
  }
  EXPECT_GT(announced_.size(), 500U);
}

}  // namespace
}  // namespace tetap::test
