// SPDX-License-Identifier: Apache-2.0
// Laws of time in checks, against a list of all tests so far (no counters): recent, older, and what persists.
#include "tetap/checks/persistence.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace tetap::checks {
namespace {

constexpr base::Micros ms(std::int64_t t) { return {t * 1000}; }

TEST(Recent, LastsFromTheEventForTheStatedSpanAndNotAMicrosecondMore) {
  EXPECT_TRUE(recent(ms(100), ms(100), ms(50)));
  EXPECT_TRUE(recent(ms(100), {149'999}, ms(50)));
  EXPECT_FALSE(recent(ms(100), ms(150), ms(50)));
}

TEST(Recent, AnEventThatNeverHappenedIsNotRecentHoweverEarlyItIs) {
  EXPECT_FALSE(recent({}, {1}, ms(50)));
  EXPECT_TRUE(older({}, {1}, ms(50)));
}

TEST(Older, BeginsAMicrosecondAfterTheStatedSpan) {
  EXPECT_FALSE(older(ms(100), ms(150), ms(50)));
  EXPECT_TRUE(older(ms(100), {150'001}, ms(50)));
}

TEST(Older, AndRecentNeverHoldTogetherAndLeaveOneMicrosecondBetweenThem) {
  for (std::int64_t now = 100'000; now < 200'000; now += 500) {
    EXPECT_FALSE(recent(ms(100), {now}, ms(50)) && older(ms(100), {now}, ms(50))) << now;
    EXPECT_EQ(!recent(ms(100), {now}, ms(50)) && !older(ms(100), {now}, ms(50)), now == 150'000) << now;
  }
}

/// Promises of the class, from the list of all tests.
struct Tests {
  struct One {
    bool held;
    base::Micros stamp;
  };
  std::vector<One> all;
  base::Micros max_gap = Persistence::kNoGap;

  /// First test of the run that ends with the last one; all.size(): there is none.
  [[nodiscard]] std::size_t first() const {
    std::size_t i = all.size();
    while (i > 0 && all[i - 1].held && (i == all.size() || all[i].stamp - all[i - 1].stamp <= max_gap)) --i;
    return i;
  }
  [[nodiscard]] int count() const { return static_cast<int>(all.size() - first()); }
  [[nodiscard]] bool persists(base::Micros now, base::Micros span, int at_least) const {
    return count() > 0 && count() >= at_least && now - all[first()].stamp >= span;
  }
};

TEST(Persistence, IsWhatTheListOfAllTestsSays) {
  std::mt19937 random(5);
  const auto one_in = [&](int n) { return std::uniform_int_distribution<int>(1, n)(random) == 1; };
  int persisted = 0;
  for (const base::Micros max_gap : {ms(150), Persistence::kNoGap}) {
    Persistence p;
    Tests truth;
    truth.max_gap = max_gap;
    base::Micros now = ms(1000);
    for (int i = 0; i < 4000; ++i) {
      now += ms(one_in(12) ? 151 : one_in(5) ? 150 : 20);
      const bool held = !one_in(9);
      p.update(held, now, max_gap);
      truth.all.push_back({held, now});
      ASSERT_EQ(p.count(), truth.count()) << i;
      ASSERT_EQ(p.holds(), truth.count() > 0) << i;
      for (const auto span : {ms(0), ms(100), ms(400)})
        for (const int at_least : {1, 3, 8}) {
          const base::Micros later = now + ms(one_in(2) ? 0 : 70);
          ASSERT_EQ(p.persists(later, span, at_least), truth.persists(later, span, at_least)) << i;
          ASSERT_EQ(p.persisted(span, at_least), truth.persists(now, span, at_least)) << i;
          persisted += p.persists(later, span, at_least) ? 1 : 0;
        }
    }
  }
  EXPECT_GT(persisted, 1000) << "the case was there";
}

TEST(Persistence, ASingleFailureEndsTheRun) {
  Persistence p;
  for (int i = 0; i < 10; ++i) p.update(true, ms(100 * i));
  EXPECT_TRUE(p.persists(ms(900), ms(900), 10));
  p.update(false, ms(910));
  EXPECT_EQ(p.count(), 0);
  EXPECT_EQ(p.held_for(ms(5000)).us, 0);
  p.update(true, ms(920));
  EXPECT_FALSE(p.persists(ms(5000), ms(0), 2));
  EXPECT_EQ(p.held_for(ms(930)), ms(10));
}

TEST(Persistence, TimeWithoutATestCountsOnlyWhereTheCallerLooksLater) {
  Persistence p;
  p.update(true, ms(100));
  EXPECT_TRUE(p.persists(ms(700), ms(600)));
  EXPECT_FALSE(p.persisted({1})) << "one test has lasted no time";
  EXPECT_TRUE(p.persisted(ms(0)));
}

TEST(Persistence, NothingPersistsBeforeTheFirstTestOrAfterAReset) {
  Persistence p;
  EXPECT_FALSE(p.persists(ms(1'000'000), ms(0), 0));
  p.update(true, ms(10));
  p.reset();
  EXPECT_FALSE(p.persists(ms(1'000'000), ms(0), 0));
}

TEST(Persistence, ARunOfHoursStillLastsAndEndsAtAGap) {
  Persistence p;
  const auto minutes = [](std::int64_t t) { return base::Micros{60'000'000 * t}; };
  for (int i = 1; i <= 300; ++i) {
    p.update(true, minutes(i), minutes(2));
    ASSERT_EQ(p.count(), i) << "a minute is no gap";
    ASSERT_EQ(p.persisted(minutes(70)), i > 70);
  }
  EXPECT_GT(p.held_for(minutes(300)), minutes(71));
  p.update(true, minutes(303), minutes(2));
  EXPECT_EQ(p.count(), 1);
}

TEST(Persistence, TheCountNeverWraps) {
  Persistence p;
  for (int i = 0; i < 1'000'010; ++i) p.update(true, {i});
  EXPECT_EQ(p.count(), 1'000'000);
}

}  // namespace
}  // namespace tetap::checks
