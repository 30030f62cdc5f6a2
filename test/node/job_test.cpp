// SPDX-License-Identifier: Apache-2.0
// Jobs longer than a tick. Neither how much of a job a tick does nor how long that takes changes what is adopted. A
// change that makes a result worthless aborts the job.
#include "bench.hpp"
#include "tetap/estimators/own_map.hpp"
#include "tetap/estimators/paced_job.hpp"

#include <gtest/gtest.h>
#include <array>
#include <cmath>

namespace tetap::test {
namespace {

/// Odometry whose speed is smoothed in a job. The job makes a weighted mean of kUnits terms of the speeds that were
/// there when it began, one a unit. Later speeds are added when the result is adopted.
class Smoother {
 public:
  static constexpr sensor::EstimatorKind kKind = sensor::EstimatorKind::kPoseGraph;
  static constexpr bool kDelayed = true;
  static constexpr std::uint32_t kUnits = 10'000;

  void restart(base::Micros, const estimators::Context&) {
    const estimators::PacedJob was = job_;
    *this = {};
    job_ = was;
    job_.cancel();
  }
  void set_pose(base::Micros, const estimators::SetPose&, const estimators::Context&) { job_.cancel(); }
  void abort_job() { job_.cancel(); }
  estimators::Innovation fuse(const sensor::BodySpeed& speed, base::Micros, const estimators::Context& ctx) {
    since_ += speed.forward_mps;
    if (!job_.busy() && ++count_ % 40 == 0) {
      snapshot_ = adopted_ + since_;
      since_ = 0;
      sum_ = 0;
      done_ = 0;
      job_.begin(kUnits, static_cast<std::uint32_t>(ctx.parameters.loop.work_units));
    }
    return {.verdict = sensor::Verdict::kAccepted};
  }
  void work(std::uint32_t units, const estimators::Context&) {
    job_.work(
        units,
        [this](std::uint32_t n) {
          for (; n > 0; --n) sum_ += snapshot_ / (1.0F + static_cast<float>(static_cast<std::int32_t>(++done_)));
        },
        [this] { adopted_ = sum_, ++adoptions_; });
  }
  void advance(base::Micros t, const estimators::Context&, const sensor::Window&) { now_ = t; }
  [[nodiscard]] estimators::Estimate estimate(const estimators::Context&) const {
    estimators::Estimate e;
    e.time = now_;
    e.pose.x = base::Anchored{}.plus(adopted_);
    e.pose.y = base::Anchored{}.plus(static_cast<float>(adoptions_));
    e.p = filter::Symmetric<float, 3>::diagonal({1, 1, 1});
    return e;
  }
  [[nodiscard]] sensor::Mode mode(const estimators::Context&) const { return sensor::Mode::kNominal; }
  [[nodiscard]] estimators::MapReport own_map() const {
    return {.work_left = job_.units_left(), .jobs_aborted = job_.aborted()};
  }
  [[nodiscard]] estimators::MappedLandmark own_landmark(std::size_t) const { return {}; }
  void reset_own_map() { job_.cancel(); }
  static constexpr auto members(auto& self) {
    return base::members(self.job_, self.now_, self.since_, self.snapshot_, self.sum_, self.adopted_, self.done_,
                         self.count_, self.adoptions_);
  }

 private:
  estimators::PacedJob job_;
  base::Micros now_;
  float since_ = 0, snapshot_ = 0, sum_ = 0, adopted_ = 0;
  std::uint32_t done_ = 0;
  int count_ = 0, adoptions_ = 0;
};
static_assert(node::WorksInJobs<Smoother> && node::Estimator<Smoother>);

using Robot = node::Estimators<estimators::Odometry, Smoother>;

struct Adoption {
  int epoch;
  float x_m;
};
/// Adopted values and their epochs over a run with so many units a tick.
std::vector<Adoption> adoptions(std::int32_t units, int epochs = 400) {
  param::Parameters n = kNumbers;
  n.loop.work_units = units;
  BenchOf<Robot> bench(n);
  std::vector<Adoption> found;
  std::int32_t before = 0;
  for (int i = 0; i < epochs; ++i) {
    const float speed = i < 60 ? 0.1F + 0.01F * static_cast<float>(i % 7) : 0.0F;
    Frames frames;
    if (i < 60) frames.push_back(body_speed(bench.now_us + 5000, speed, 0.0F, i));
    const Frames out = bench.epoch(frames);
    const auto pos = last<bus::EstPos>(out, 1);
    if (pos->y_raw != before) found.push_back({i, static_cast<float>(pos->x_raw)});
    before = pos->y_raw;
  }
  return found;
}

TEST(Jobs, FourTimesTheUnitsGiveTheSameStateEarlier) {
  const auto slow = adoptions(100), fast = adoptions(400);
  ASSERT_EQ(slow.size(), 1U);
  ASSERT_EQ(fast.size(), 1U);
  EXPECT_EQ(slow[0].x_m, fast[0].x_m);
  EXPECT_GT(slow[0].x_m, 0);
  EXPECT_EQ(slow[0].epoch - fast[0].epoch, 75);  // 100 ticks against 25
}

TEST(Jobs, TheTickOfAdoptionIsFixedAtTheBegin) {
  estimators::PacedJob job;
  int done = 0, adopted_at = 0;
  job.begin(1000, 100);
  for (int tick = 1; tick <= 12; ++tick)
    job.work(
        tick < 4 ? 100U : 7U, [&](std::uint32_t n) { done += static_cast<int>(n); }, [&] { adopted_at = tick; });
  EXPECT_EQ(adopted_at, 10);
  EXPECT_EQ(done, 1000);
  EXPECT_FALSE(job.busy());
}

/// Jobs aborted by what is sent while one is under way.
int aborted_by(const Frames& frames) {
  param::Parameters n = kNumbers;
  n.loop.work_units = 20;
  BenchOf<Robot> bench(n);
  for (int i = 0; i < 80; ++i) bench.epoch({body_speed(bench.now_us + 5000, 0.2F, 0.0F, i)});
  EXPECT_GT(last<bus::EstDiagMapper>(bench.idle(96))->work_left, 0);
  const auto said = [](const Frames& out) {
    return (last<bus::EstStatus>(out)->map_faults >> static_cast<unsigned>(bus::MapFault::kJobsAborted) & 1U) != 0;
  };
  EXPECT_FALSE(said(bench.idle(12)));
  bench.epoch(frames);
  EXPECT_TRUE(said(bench.idle(12)));
  const auto page = last<bus::EstDiagMapper>(bench.idle(96));
  EXPECT_EQ(page->work_left, 0);
  EXPECT_FALSE(said(bench.idle(12))) << "a second later";
  return page->jobs_aborted;
}

TEST(Jobs, AreAbortedAndCounted) {
  EXPECT_EQ(aborted_by(set_pose(1, 0, 0, 0)), 1);
  EXPECT_EQ(aborted_by({in(bus::protect(bus::CmdReset{.ctr = 2, .what = bus::ResetWhat::kEstimators}))}), 1);
  EXPECT_EQ(aborted_by({in(bus::protect(bus::CmdReset{.ctr = 2, .what = bus::ResetWhat::kOwnMap}))}), 1);
}

}  // namespace
}  // namespace tetap::test
