// SPDX-License-Identifier: Apache-2.0
// A late sample in a long window: its replay is spread over ticks, and ends where a sample on time would have led.
#include "tetap/node/fusion_window.hpp"

#include <gtest/gtest.h>
#include <algorithm>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

namespace tetap {
namespace {

/// Its state depends on every sample and on their order; it counts what it is asked to fuse.
struct OrderSensitive {
  static constexpr auto kKind = sensor::EstimatorKind::kOdometry;
  static inline int fused = 0;
  base::StateHash state;

  void restart(base::Micros, const estimators::Context&) { state = {}; }
  void set_pose(base::Micros, const estimators::SetPose&, const estimators::Context&) {}
  void advance(base::Micros, const estimators::Context&) {}
  estimators::Innovation fuse(const sensor::BodySpeed&, base::Micros stamp, const estimators::Context&) {
    ++fused;
    state(stamp.us);
    return {.verdict = sensor::Verdict::kAccepted};
  }
  [[nodiscard]] estimators::Estimate estimate(const estimators::Context&) const { return {}; }
  [[nodiscard]] sensor::Mode mode(const estimators::Context&) const { return sensor::Mode::kNominal; }
  static constexpr auto members(auto& self) { return base::members(base::unhashed(self.state)); }
};

using Two = node::EstimatorsWithPlaces<512, OrderSensitive, OrderSensitive>;
constexpr std::int64_t kWindow_us = 500'000, kTick_us = 10'000, kEvery_us = 2'000;
constexpr int kNewInATick = static_cast<int>(kTick_us / kEvery_us), kLanes = 2;

/// A window of 250 samples, or of another length.
class Bench {
  auto noting() {
    return [this](std::size_t, const sensor::Sample& sample, const estimators::Innovation& innovation) {
      ++records_[{sample.stamp.us, innovation.verdict}];
    };
  }

 public:
  explicit Bench(std::int64_t window_us = kWindow_us) : window_us_(window_us) { window_.power_on({0}, ctx()); }
  void insert(std::int64_t us) {
    sensor::Sample sample;
    sample.stamp = {us};
    sample.sensor = sensor::Sensor::kBodySpeed;
    sample.bits = static_cast<std::uint32_t>(us);
    static_cast<void>(window_.insert(sample, ctx(), noting()));
  }
  /// One tick with its samples on time, but for that at `missing`. How many samples were fused.
  int tick(std::int64_t missing = -1) {
    for (std::int64_t us = now_ + kEvery_us; us <= now_ + kTick_us; us += kEvery_us)
      if (us != missing) insert(us);
    now_ += kTick_us;
    OrderSensitive::fused = 0;
    static_cast<void>(window_.consume(
        {now_}, ctx(), [](const sensor::Sample&) {}, noting()));
    window_.advance({now_}, ctx());
    window_.retire_until({now_ - window_us_}, ctx(), noting());
    return OrderSensitive::fused;
  }
  void close() { window_.close_window({now_}, ctx(), noting()); }
  [[nodiscard]] std::int64_t now() const { return now_; }
  /// Records of a stamp, by verdict.
  [[nodiscard]] int records(std::int64_t us, sensor::Verdict verdict) const {
    const auto found = records_.find({us, verdict});
    return found == records_.end() ? 0 : found->second;
  }
  /// State of each estimator's present.
  [[nodiscard]] std::vector<std::uint32_t> estimates() const {
    std::vector<std::uint32_t> all;
    window_.each_slot([&](const auto& slot) { all.push_back(std::get<0>(slot.members(slot)).state.value()); });
    return all;
  }

 private:
  [[nodiscard]] estimators::Context ctx() const { return {.parameters = parameters_, .map_frame = map_frame_}; }

  param::Parameters parameters_{};
  estimators::MapFrame map_frame_;
  node::FusionWindow<Two, 512> window_;
  std::int64_t window_us_, now_ = 0;
  std::map<std::pair<std::int64_t, sensor::Verdict>, int> records_;
};

constexpr auto kAccepted = sensor::Verdict::kAccepted, kTooLate = sensor::Verdict::kTooLate;

/// Ticks that a late sample takes until the estimates are those of a twin that had it on time; 0 when they never are.
int ticks_until_equal(std::int64_t window_us, std::int64_t late_by_us, int& most_fused) {
  Bench bench(window_us), twin(window_us);
  for (int i = 0; i < 100; ++i) bench.tick(), twin.tick();
  const std::int64_t late = bench.now() + kEvery_us;
  bench.tick(late), twin.tick();
  while (bench.now() < late + late_by_us) bench.tick(), twin.tick();
  bench.insert(late);
  for (int i = 1; i < 60; ++i) {
    most_fused = std::max(most_fused, bench.tick());
    twin.tick();
    if (bench.estimates() != twin.estimates()) continue;
    EXPECT_EQ(bench.records(late, kAccepted), kLanes) << "one record an estimator, as of every other sample";
    for (int more = 0; more < 100; ++more) {
      bench.tick(), twin.tick();
      EXPECT_EQ(bench.estimates(), twin.estimates());
    }
    return i;
  }
  return 0;
}

/// Present and far end take each new sample once; besides, a tick repeats its share.
constexpr int kShare = 56;  // docs/explanation/delayed_fusion.md
constexpr int kMostFused = 2 * kLanes * kNewInATick + kShare;

TEST(ReplaySpread, EndsInTheStateOfASampleOnTimeWithinAHandfulOfTicks) {
  int most = 0;
  EXPECT_EQ(ticks_until_equal(40'000, 30'000, most), 1) << "a short window fits into one tick";
  for (const std::int64_t late_us : {100'000, 250'000, 400'000, 480'000}) {
    const int ticks = ticks_until_equal(kWindow_us, late_us, most);
    EXPECT_GT(ticks, 0) << late_us;
    EXPECT_LE(ticks, 20) << late_us;  // 250 samples of two estimators; a crowded window repeats fewer than 56 a tick
  }
  EXPECT_LE(most, kMostFused + kLanes);
  EXPECT_GT(most, kMostFused / 2);
}

TEST(ReplaySpread, NoTickFusesMoreWhateverIsLate) {
  Bench bench;
  for (int i = 0; i < 60; ++i) bench.tick();
  std::int64_t stamp = bench.now() - 490'000 + 777;
  int most = 0;
  for (int i = 0; i < 200; ++i) {  // something late in every tick, anywhere in the window
    bench.insert(stamp);
    most = std::max(most, bench.tick());
    stamp = bench.now() - (i * 7919) % 490'000 + 333;
  }
  EXPECT_LE(most, kMostFused + 2 * kLanes);
}

TEST(ReplaySpread, WhatTheFarEndHasPassedIsRefusedAndSaidOnce) {
  Bench bench;
  for (int i = 0; i < 100; ++i) bench.tick();
  const std::int64_t first = bench.now() - 480'001;
  bench.insert(first);
  for (int i = 0; i < 20; ++i) bench.tick();
  const std::int64_t second = bench.now() - 400'001;  // within the window, before the far end
  bench.insert(second);
  bench.tick();
  EXPECT_EQ(bench.records(first, kAccepted), kLanes);
  EXPECT_EQ(bench.records(second, kTooLate), kLanes);
  EXPECT_EQ(bench.records(second, kAccepted), 0);
  for (int i = 0; i < 60; ++i) bench.tick();
  const std::int64_t third = bench.now() - 400'001;  // the window has its length again
  bench.insert(third);
  for (int i = 0; i < 20; ++i) bench.tick();
  EXPECT_EQ(bench.records(third, kAccepted), kLanes);
}

TEST(ReplaySpread, AClosedWindowLosesNothingThatWasOnItsWay) {
  Bench bench, twin;
  for (int i = 0; i < 100; ++i) bench.tick(), twin.tick();
  const std::int64_t late = bench.now() + kEvery_us;
  bench.tick(late), twin.tick();
  for (int i = 0; i < 40; ++i) bench.tick(), twin.tick();
  bench.insert(late);
  bench.tick(), twin.tick();
  EXPECT_NE(bench.estimates(), twin.estimates()) << "still on its way";
  bench.close(), twin.close();
  EXPECT_EQ(bench.estimates(), twin.estimates());
  EXPECT_EQ(bench.records(late, kAccepted), kLanes);
}

}  // namespace
}  // namespace tetap
