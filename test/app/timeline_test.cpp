// SPDX-License-Identifier: Apache-2.0
#include "app/timeline.hpp"

#include <gtest/gtest.h>
#include <algorithm>
#include <random>
#include <vector>

namespace tetap {
namespace {

app::Sample sample(std::int64_t us, can::Sensor sensor = can::Sensor::kBodySpeed, int instance = 0, int sequence = 0,
                   int detail = 0) {
  app::Sample s;
  s.stamp = {us};
  s.sensor = sensor;
  s.instance = static_cast<std::uint8_t>(instance);
  s.sequence = static_cast<std::uint8_t>(sequence);
  s.detail = static_cast<std::uint8_t>(detail);
  return s;
}

TEST(Timeline, SortsByStampKindInstanceSequenceAndDetail) {
  std::vector<app::Sample> all;
  for (int stamp : {100, 200})
    for (const auto sensor : {can::Sensor::kImu, can::Sensor::kGnssPosition})
      for (int instance : {0, 1})
        for (int sequence : {0, 5}) all.push_back(sample(stamp, sensor, instance, sequence));
  auto shuffled = all;
  std::mt19937 random(1);
  for (int trial = 0; trial < 20; ++trial) {
    std::shuffle(shuffled.begin(), shuffled.end(), random);
    app::Timeline<32> timeline;
    for (const auto& s : shuffled) ASSERT_EQ(timeline.insert(s), app::Insert::kTaken);
    for (std::size_t i = 0; i < all.size(); ++i) EXPECT_TRUE(timeline[i].order(all[i]) == 0);
  }
}

TEST(Timeline, RefusesDuplicatesAndOverflowWithoutLosingAnything) {
  app::Timeline<3> timeline;
  EXPECT_EQ(timeline.insert(sample(3)), app::Insert::kTaken);
  EXPECT_EQ(timeline.insert(sample(1)), app::Insert::kTaken);
  EXPECT_EQ(timeline.insert(sample(3)), app::Insert::kDuplicate);
  EXPECT_EQ(timeline.insert(sample(3, can::Sensor::kBodySpeed, 0, 0, 1)), app::Insert::kTaken);
  EXPECT_EQ(timeline.insert(sample(2)), app::Insert::kFull);
  EXPECT_EQ(timeline.size(), 3U);
  EXPECT_EQ(timeline.high_water(), 3U);
  EXPECT_EQ(timeline.until({2}), 1U);
  timeline.drop_front(1);
  EXPECT_EQ(timeline[0].stamp.us, 3);
}

}  // namespace
}  // namespace tetap
