// SPDX-License-Identifier: Apache-2.0
#include "sim_host/replay/script.hpp"

#include "sim_host/play/arguments.hpp"
#include "sim_host/play/perturb.hpp"
#include "sim_host/replay/protocol.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <vector>

namespace tetap::sim {
namespace {

TimedFrame input(std::int64_t us, std::uint8_t tag, std::uint32_t id = 0x308) {
  return {{us}, {.id = id, .size = 8, .data = {tag}}};
}

struct Played {
  std::int64_t time_us;
  std::vector<int> tags;
  bool begins;
  friend bool operator==(const Played&, const Played&) = default;
};

std::vector<Played> all(const std::vector<TimedFrame>& log) {
  FramesInMemory frames(log);
  const bool has_ticks =
      std::any_of(log.begin(), log.end(), [](const TimedFrame& entry) { return is_tick(entry.frame, 0x300); });
  LogTicks source(frames, {}, has_ticks);
  std::vector<Played> ticks;
  Tick tick;
  while (source.next(tick)) {
    Played p{tick.time.us, {}, tick.begin.has_value()};
    for (const auto& f : tick.inputs) p.tags.push_back(f.data[0]);
    ticks.push_back(p);
  }
  EXPECT_FALSE(source.next(tick)) << "after the last tick there is none";
  return ticks;
}

TEST(Script, AFrameBelongsToTheFirstTickAtOrAfterIt) {
  const std::vector<TimedFrame> log{input(1'003'000, 1), input(1'010'000, 2), input(1'010'001, 3), input(1'045'000, 4)};
  const std::vector<Played> expected{{1'010'000, {1, 2}, true},
                                     {1'020'000, {3}, false},
                                     {1'030'000, {}, false},
                                     {1'040'000, {}, false},
                                     {1'050'000, {4}, false}};
  EXPECT_EQ(all(log), expected);
}

TEST(Script, AFrameFromThePastStaysWithItsPredecessor) {
  const std::vector<TimedFrame> log{input(1'015'000, 1), input(990'000, 2), input(1'021'000, 3)};
  const std::vector<Played> expected{{1'020'000, {1, 2}, true}, {1'030'000, {3}, false}};
  EXPECT_EQ(all(log), expected);
}

TEST(Script, TimeThatJumpsByYearsDoesNotMakeMillionsOfTicks) {
  const std::vector<TimedFrame> log{input(0, 1), input(1'000'000'000'000'000, 2)};
  const std::vector<Played> expected{{10'000, {1}, true}, {1'000'000'000'000'000, {2}, false}};
  EXPECT_EQ(all(log), expected);
}

TEST(Script, TicksInTheLogAreTheTicks) {
  std::vector<TimedFrame> log{input(1'000, 1),
                              {{2'000}, sync_frame(0x300, bus::SyncKind::kTick, {7'000'000}, 0)},
                              input(2'500, 2),
                              {{3'000}, sync_frame(0x300, bus::SyncKind::kClock, {1}, 1)},
                              {{4'000}, sync_frame(0x300, bus::SyncKind::kStep, {7'012'345}, 2)}};
  const std::vector<Played> expected{{7'000'000, {1}, true}, {7'012'345, {2}, false}};
  EXPECT_EQ(all(log), expected);
}

TEST(Script, TicksCountFromTheBeginOfTheBusNotByTheClockOfTheLog) {
  constexpr std::int64_t kToday_us = 1'795'555'498'360'954;  // candump's stamps are the calendar's
  const std::vector<TimedFrame> log{{{kToday_us}, sync_frame(0x300, bus::SyncKind::kBegin, {1'000'000}, 0)},
                                    input(kToday_us + 10, 1),
                                    {{kToday_us + 20}, sync_frame(0x300, bus::SyncKind::kStep, {1'010'000}, 1)},
                                    {{kToday_us + 30}, sync_frame(0x300, bus::SyncKind::kStep, {1'020'000}, 2)}};
  const std::vector<Played> expected{{1'010'000, {1}, true}, {1'020'000, {}, false}};
  EXPECT_EQ(all(log), expected);
}

TEST(Script, TicksFromBootStayAsTheyAreInALogOfTodayWithoutBegin) {
  constexpr std::int64_t kToday_us = 1'795'555'498'360'954;
  for (const std::int64_t start : {std::int64_t{46'010'000}, kToday_us}) {
    const std::vector<TimedFrame> log{{{kToday_us}, sync_frame(0x300, bus::SyncKind::kStep, {start}, 1)},
                                      input(kToday_us + 10, 1),
                                      {{kToday_us + 20}, sync_frame(0x300, bus::SyncKind::kStep, {start + 10'000}, 2)}};
    const std::vector<Played> expected{{start, {}, true}, {start + 10'000, {1}, false}};
    EXPECT_EQ(all(log), expected);
  }
}

TEST(Script, OnlyInputsOfTheNodesBlockArePlayedUnderItsIds) {
  const std::vector<TimedFrame> log{input(1, 1, 0x2FF), input(2, 2, 0x301),
                                    input(3, 3, 0x31F), input(4, 4, 0x320),
                                    input(5, 5, 0x340), {{6}, {.id = 0x308, .extended = true, .size = 1, .data = {6}}}};
  FramesInMemory frames(log);
  LogTicks script(frames, {.base = 0x480, .log_base = 0x300}, false);
  Tick tick;
  ASSERT_TRUE(script.next(tick));
  ASSERT_EQ(tick.inputs.size(), 2U);
  EXPECT_EQ(tick.inputs[0].id, 0x481U);
  EXPECT_EQ(tick.inputs[1].id, 0x49FU);
  EXPECT_FALSE(script.next(tick));
}

TEST(BusTime, FortyEightBitsExtendToTheNearestFullTime) {
  std::mt19937_64 draw(5);
  for (int i = 0; i < 10'000; ++i) {
    const auto truth = static_cast<std::int64_t>(draw() % 2'000'000'000'000'000);
    const auto reference = truth + static_cast<std::int64_t>(draw() % 200'000'000'000'000) - 100'000'000'000'000;
    EXPECT_EQ(extend_bus_time(static_cast<std::uint64_t>(truth) & kTimeMask, {reference}).us, truth);
  }
}

std::vector<TimedFrame> regular(int n) {
  std::vector<TimedFrame> frames;
  for (int i = 0; i < n; ++i) {
    frames.push_back(input(i * 10'000, static_cast<std::uint8_t>(i)));
    frames.back().frame.data[1] = static_cast<std::uint8_t>(i >> 8);
  }
  return frames;
}

int number(const TimedFrame& f) { return f.frame.data[0] + 256 * f.frame.data[1]; }

bool same(const std::vector<TimedFrame>& a, const std::vector<TimedFrame>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const auto& x, const auto& y) { return x.time == y.time && x.frame == y.frame; });
}

TEST(Perturb, FollowsFromTheSeedAlone) {
  const auto frames = regular(5000);
  const Perturbation how{.seed = 7, .jitter_ms = 5, .drop = 0.02, .duplicate = 0.02, .reorder = 0.05};
  Perturbation other = how;
  other.seed = 8;
  EXPECT_TRUE(same(perturb(frames, how).frames, perturb(frames, how).frames));
  EXPECT_FALSE(same(perturb(frames, how).frames, perturb(frames, other).frames));
}

TEST(Perturb, NothingAskedForChangesNothing) {
  const auto frames = regular(1000);
  EXPECT_TRUE(same(perturb(frames, {}).frames, frames));
}

TEST(Perturb, EveryFrameIsAccountedFor) {
  const auto frames = regular(20'000);
  const Perturbed result =
      perturb(frames, {.seed = 3, .jitter_ms = 5, .drop = 0.01, .duplicate = 0.03, .reorder = 0.02});
  EXPECT_EQ(result.frames.size(), frames.size() - result.dropped + result.duplicated);
  std::map<int, int> copies;
  for (const TimedFrame& f : result.frames) ++copies[number(f)];
  EXPECT_EQ(copies.size(), frames.size() - result.dropped);
  EXPECT_EQ(static_cast<std::uint64_t>(
                std::count_if(copies.begin(), copies.end(), [](const auto& c) { return c.second == 2; })),
            result.duplicated);
  // Binomial: five standard deviations on either side.
  EXPECT_NEAR(static_cast<double>(result.dropped), 200, 71);
  EXPECT_NEAR(static_cast<double>(result.duplicated), 594, 121);
  EXPECT_NEAR(static_cast<double>(result.reordered), 400, 100);
}

TEST(Perturb, JitterDelaysByNoMoreThanAsked) {
  const auto frames = regular(5000);
  const Perturbed result = perturb(frames, {.seed = 1, .jitter_ms = 4});
  std::int64_t longest = 0;
  for (const TimedFrame& f : result.frames) {
    const std::int64_t late = f.time.us - number(f) * 10'000;
    EXPECT_GE(late, 0);
    longest = std::max(longest, late);
  }
  EXPECT_LE(longest, 4000);
  EXPECT_GT(longest, 3900);
}

TEST(Perturb, SwitchingOneEffectOnLeavesTheDrawsOfTheOthers) {
  const auto frames = regular(5000);
  const auto dropped = [&](const Perturbation& how) {
    std::vector<bool> there(frames.size());
    for (const TimedFrame& f : perturb(frames, how).frames) there[static_cast<std::size_t>(number(f))] = true;
    return there;
  };
  EXPECT_EQ(dropped({.seed = 1, .drop = 0.1}),
            dropped({.seed = 1, .jitter_ms = 9, .drop = 0.1, .duplicate = 0.2, .reorder = 0.3}));
}

TEST(Perturb, ReorderingChangesPlacesOfNeighboursOnly) {
  const auto frames = regular(5000);
  const Perturbed result = perturb(frames, {.seed = 1, .reorder = 0.1});
  std::uint64_t moved = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    EXPECT_LE(std::abs(number(result.frames[i]) - static_cast<int>(i)), 1);
    moved += number(result.frames[i]) != static_cast<int>(i);
  }
  EXPECT_EQ(moved, 2 * result.reordered);
}

TEST(Arguments, WhatIsNotUnderstoodIsNamed) {
  const auto message = [](std::vector<std::string> words, auto ask) -> std::string {
    try {
      Arguments arguments(std::move(words));
      ask(arguments);
      arguments.finish();
    } catch (const UsageError& error) {
      return error.what();
    }
    return "";
  };
  const auto window = [](Arguments& a) { a.integer("--window", 8, 1, 128); };
  EXPECT_EQ(message({"--window", "3"}, window), "");
  EXPECT_EQ(message({"--window=0x10"}, window), "");
  EXPECT_EQ(message({"--windw", "3"}, window), "unknown option --windw (--help lists them)");
  EXPECT_EQ(message({"--window"}, window), "--window needs a value");
  EXPECT_EQ(message({"--window", "3x"}, window), "--window needs a whole number from 1 to 128, not '3x'");
  EXPECT_EQ(message({"--window", "-3"}, window), "--window needs a whole number from 1 to 128, not '-3'");
  EXPECT_EQ(message({"--drop", "nan"}, [](Arguments& a) { a.real("--drop", 0, 0, 1); }),
            "--drop needs a number from 0 to 1, not 'nan'");
  const auto base = [](Arguments& a) { static_cast<void>(a.base()); };
  EXPECT_EQ(message({"--base", "0x340"}, base), "");
  EXPECT_EQ(message({"--base=0x7C0"}, base), "");
  EXPECT_EQ(message({"--base", "0x301"}, base), "--base needs a multiple of 0x40 up to 0x7C0, not '0x301'");
  EXPECT_EQ(message({"--base", "0x800"}, base), "--base needs a multiple of 0x40 up to 0x7C0, not '0x800'");
  EXPECT_EQ(message({"--base", "0x"}, base), "--base needs a multiple of 0x40 up to 0x7C0, not '0x'");
  EXPECT_EQ(message({"a", "b"}, [](Arguments& a) { a.positional(); }), "one argument too many: b (--help lists them)");
}

TEST(Arguments, TheLastOfSeveralCountsAndAllCanBeHad) {
  Arguments arguments({"--seed", "1", "--quiet", "--fault=a", "--seed=2", "--quiet", "--fault", "b"});
  EXPECT_EQ(arguments.integer("--seed", 9, 0, 10), 2U);
  EXPECT_EQ(arguments.texts("--fault"), (std::vector<std::string>{"a", "b"}));
  EXPECT_TRUE(arguments.flag("--quiet"));
  EXPECT_FALSE(arguments.flag("--quiet"));
  EXPECT_FALSE(arguments.text("--seed"));
  EXPECT_NO_THROW(arguments.finish());
}

}  // namespace
}  // namespace tetap::sim
