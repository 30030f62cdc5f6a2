// SPDX-License-Identifier: Apache-2.0
#include "tetap/node/timeline.hpp"

#include <gtest/gtest.h>
#include <algorithm>
#include <random>
#include <vector>

namespace tetap {
namespace {

sensor::Sample sample(std::int64_t us, sensor::Sensor sensor = sensor::Sensor::kBodySpeed, int instance = 0,
                      int sequence = 0, int detail = 0) {
  sensor::Sample s;
  s.stamp = {us};
  s.sensor = sensor;
  s.instance = static_cast<std::uint8_t>(instance);
  s.sequence = static_cast<std::uint8_t>(sequence);
  s.detail = static_cast<std::uint8_t>(detail);
  return s;
}

TEST(Timeline, SortsByStampKindInstanceSequenceAndDetail) {
  std::vector<sensor::Sample> all;
  for (int stamp : {100, 200})
    for (const auto sensor : {sensor::Sensor::kImu, sensor::Sensor::kGnssPosition})
      for (int instance : {0, 1})
        for (int sequence : {0, 5}) all.push_back(sample(stamp, sensor, instance, sequence));
  auto shuffled = all;
  std::mt19937 random(1);
  for (int trial = 0; trial < 20; ++trial) {
    std::shuffle(shuffled.begin(), shuffled.end(), random);
    node::Timeline<32> timeline;
    for (const auto& s : shuffled) ASSERT_EQ(timeline.insert(s), node::Insert::kTaken);
    for (std::size_t i = 0; i < all.size(); ++i) EXPECT_TRUE(timeline[i].order(all[i]) == 0);
  }
}

TEST(Timeline, RefusesDuplicatesAndOverflowWithoutLosingAnything) {
  node::Timeline<3> timeline;
  EXPECT_EQ(timeline.insert(sample(3)), node::Insert::kTaken);
  EXPECT_EQ(timeline.insert(sample(1)), node::Insert::kTaken);
  EXPECT_EQ(timeline.insert(sample(3)), node::Insert::kDuplicate);
  EXPECT_EQ(timeline.insert(sample(3, sensor::Sensor::kBodySpeed, 0, 0, 1)), node::Insert::kTaken);
  EXPECT_EQ(timeline.insert(sample(2)), node::Insert::kFull);
  EXPECT_EQ(timeline.size(), 3U);
  EXPECT_EQ(timeline.high_water(), 3U);
  EXPECT_EQ(timeline.until({2}), 1U);
  timeline.drop_front(1);
  EXPECT_EQ(timeline[0].stamp.us, 3);
}

/// Against a sorted list, long enough for the ring to go round many times.
TEST(Timeline, IsAListThatNeverMovesWhatStays) {
  std::mt19937 random(2);
  const auto below = [&](int n) { return std::uniform_int_distribution<int>(0, n - 1)(random); };
  node::Timeline<16> timeline;
  std::vector<std::pair<sensor::Sample, bool>> model;
  for (int i = 0; i < 20'000; ++i) {
    const sensor::Sample s = sample(100 * i + below(900), sensor::Sensor::kBodySpeed, 0, i % 256);
    const auto result = timeline.insert(s);
    ASSERT_EQ(result, model.size() == 16 ? node::Insert::kFull : node::Insert::kTaken);
    if (result == node::Insert::kTaken) {
      const auto at = std::find_if(model.begin(), model.end(), [&](const auto& m) { return m.first.order(s) > 0; });
      model.insert(at, {s, false});
    }
    if (below(2) == 0 && !model.empty()) {
      const auto k = static_cast<std::size_t>(below(static_cast<int>(model.size())));
      timeline.consume(k);
      model[k].second = true;
    }
    if (below(3) == 0 || model.size() == 16) {
      const auto count = static_cast<std::size_t>(below(static_cast<int>(model.size()) + 1));
      timeline.drop_front(count);
      model.erase(model.begin(), model.begin() + static_cast<std::ptrdiff_t>(count));
    }
    ASSERT_EQ(timeline.size(), model.size());
    const bool all = std::all_of(model.begin(), model.end(), [](const auto& m) { return m.second; });
    ASSERT_EQ(timeline.known() == model.size(), all);
    for (std::size_t k = 0; k < timeline.known(); ++k) ASSERT_TRUE(model[k].second) << i;
    for (std::size_t k = 0; k < model.size(); ++k) {
      ASSERT_TRUE(timeline[k].order(model[k].first) == 0);
      ASSERT_EQ(timeline.consumed(k), model[k].second);
    }
    node::Timeline<16> fresh;
    for (auto m = model.rbegin(); m != model.rend(); ++m) static_cast<void>(fresh.insert(m->first));
    ASSERT_EQ(timeline.digest(), fresh.digest()) << "of the content alone, however it came about";
    const sensor::Window window = timeline.window(timeline.size());
    ASSERT_EQ(window.size(), model.size());
    for (std::size_t k = 0; k < model.size(); ++k) ASSERT_TRUE(window[k].order(model[k].first) == 0);
    const base::Micros t{100 * i + below(900)};
    ASSERT_EQ(window.until(t), static_cast<std::size_t>(std::count_if(
                                   model.begin(), model.end(), [&](const auto& m) { return m.first.stamp <= t; })));
  }
}

TEST(Timeline, EveryBitOfASampleChangesItsDigest) {
  node::Timeline<4> timeline;
  static_cast<void>(timeline.insert(sample(1'000'000)));
  for (int bit = 0; bit < 32; ++bit) {
    node::Timeline<4> other;
    sensor::Sample changed = sample(1'000'000);
    changed.bits ^= 1U << bit;
    static_cast<void>(other.insert(changed));
    EXPECT_NE(timeline.digest(), other.digest()) << bit;
  }
  const std::uint32_t one = timeline.digest();
  static_cast<void>(timeline.insert(sample(2'000'000)));
  timeline.drop_front(1);
  EXPECT_NE(timeline.digest(), one);
  timeline.clear();
  EXPECT_EQ(timeline.digest(), node::Timeline<4>{}.digest());
}

}  // namespace
}  // namespace tetap
