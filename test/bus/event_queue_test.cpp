// SPDX-License-Identifier: Apache-2.0
// A record of a measurement carries the statistic of the test that decided, over that test's limit.
#include "tetap/bus/event_queue.hpp"

#include <gtest/gtest.h>
#include <cmath>

namespace tetap::bus {
namespace {

EstInnov record_of(const estimators::Innovation& innovation) {
  EventQueue queue;
  Counters counters;
  sensor::Sample sample;
  sample.sensor = sensor::Sensor::kGnssPosition;
  queue.add(innovation, sample, 0, {}, counters);
  return queue.take(10'000);
}

/// A record may wait for its frame: its age counts to the tick of that frame.
TEST(EventQueue, TheAgeOfARecordThatWaitedCountsToItsFrame) {
  EventQueue queue;
  Counters counters;
  sensor::Sample sample;
  sample.stamp = base::Micros{1'000'000};
  for (int tick = 0; tick < 253; ++tick) queue.tick_begins(), queue.tick_ends();
  queue.tick_begins();
  queue.add({}, sample, 0, base::Micros{1'200'000}, counters);
  queue.add({}, sample, 0, base::Micros{1'200'000}, counters);
  EXPECT_NEAR(static_cast<double>(queue.take(10'000).age_s), 0.2, 1e-6);
  queue.tick_ends();
  for (int tick = 0; tick < 7; ++tick) queue.tick_begins(), queue.tick_ends();
  EXPECT_NEAR(static_cast<double>(queue.take(10'000).age_s), 0.27, 1e-6);
  EXPECT_TRUE(queue.empty());
}

TEST(EventQueue, RatioIsThatOfTheFailedCheckElseOfTheInnovationGate) {
  const estimators::Innovation accepted{.verdict = sensor::Verdict::kAccepted, .dof = 3, .nis = 2.0F, .gate = 8.0F};
  EXPECT_EQ(record_of(accepted).ratio, 0.25F);
  EXPECT_EQ(record_of(accepted).nis, 2.0F);

  estimators::Innovation drifts = accepted;
  drifts.verdict = sensor::Verdict::kRejected;
  drifts.failed = sensor::Check::kDrift;
  drifts.statistic = 30.0F;
  drifts.limit = 15.0F;
  EXPECT_EQ(record_of(drifts).ratio, 2.0F);
  EXPECT_EQ(record_of(drifts).nis, 2.0F) << "the fix's own, which is small";

  const EstInnov field =
      record_of({.verdict = sensor::Verdict::kRejected, .failed = sensor::Check::kField, .statistic = 3, .limit = 1});
  EXPECT_EQ(field.ratio, 3.0F);
  EXPECT_TRUE(std::isnan(field.nis)) << "no innovation was compared";
  EXPECT_TRUE(std::isnan(record_of({.verdict = sensor::Verdict::kStale}).ratio));
}

}  // namespace
}  // namespace tetap::bus
