// SPDX-License-Identifier: Apache-2.0
#include "sim_host/replay/lockstep.hpp"

#include "host/stand_in_node.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <set>
#include <string>

namespace tetap::sim {
namespace {

using test::KeepAll;
using test::Sabotage;
using test::StandInNode;

constexpr int kTicks = 1000;
constexpr std::size_t kPerTick = 3;

Script regular_script(int ticks = kTicks) {
  Script script;
  for (int i = 0; i < ticks; ++i) {
    for (std::size_t k = 0; k < kPerTick; ++k)
      script.add_input({.id = 0x308, .size = 8, .data = {static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(k)}});
    script.add_tick({(i + 1) * 10'000}, i == 0 ? std::optional(base::Micros{5'000}) : std::nullopt);
  }
  return script;
}

struct Outcome {
  Counts counts;
  KeepAll kept;
  std::string error;
  std::uint64_t consumed = 0;
};

Outcome run(Sabotage sabotage = {}, std::size_t window = 8, Script script = regular_script(), bool silent = false) {
  Outcome outcome;
  hal::MemoryBus bus;
  hal::MemoryCan end = bus.node_end();
  StandInNode node(end, 0x300, std::move(sabotage));
  node.silent = silent;
  MemoryLink link(bus, [&node] { node.poll(); });
  const Patience hasty{.epoch = {30'000}, .begin = {60'000}, .repeat = {10'000}};
  const auto played =
      play_lockstep(link, script, outcome.kept, {.base = 0x300, .window = window, .patience = hasty}, outcome.counts);
  if (!played) outcome.error = played.failure().text;
  outcome.consumed = node.consumed();
  return outcome;
}

bool is_input(const base::CanFrame& f) { return f.id == 0x308; }
bool is_step(const base::CanFrame& f) {
  return f.id == 0x300 && f.data[7] == static_cast<std::uint8_t>(bus::SyncKind::kStep);
}

class Window : public testing::TestWithParam<std::size_t> {};
INSTANTIATE_TEST_SUITE_P(Sizes, Window, testing::Values(1U, 2U, 8U, 64U));

TEST_P(Window, ACleanRunLosesNothingAndIsTheSameForEveryWindow) {
  const Outcome o = run({}, GetParam());
  EXPECT_EQ(o.error, "");
  EXPECT_EQ(o.counts.inputs, kTicks * kPerTick);
  EXPECT_EQ(o.consumed, o.counts.inputs);
  EXPECT_EQ(o.counts.epochs, static_cast<std::uint64_t>(kTicks));
  EXPECT_EQ(o.counts.lost(), 0U);
  EXPECT_EQ(o.counts.extra(), 0U);
  EXPECT_EQ(o.counts.outputs + 1, o.kept.received_frames.size()) << "all but the answer to Begin";
  const Outcome one = run({}, 1);
  EXPECT_EQ(o.kept.received_frames, one.kept.received_frames);
  EXPECT_EQ(o.kept.times, one.kept.times);
  EXPECT_EQ(o.kept.restarts, 1);
}

TEST_P(Window, EveryInputLostOnItsWayIsCounted) {
  std::set<std::uint64_t> lost;
  const Outcome o = run({.into =
                             [&, n = 0U](std::uint64_t, const base::CanFrame& f) mutable {
                               return is_input(f) && ++n % 37 == 0 ? (lost.insert(n), 0) : 1;
                             },
                         .out_of = {}},
                        GetParam());
  EXPECT_EQ(o.error, "");
  EXPECT_EQ(o.counts.lost_inputs, lost.size());
  EXPECT_GT(lost.size(), 50U);
  EXPECT_EQ(o.counts.lost_outputs, 0U);
  EXPECT_EQ(o.counts.extra(), 0U);
}

TEST_P(Window, EveryInputConsumedTwiceIsCounted) {
  std::uint64_t doubled = 0;
  const Outcome o = run({.into =
                             [&, n = 0U](std::uint64_t, const base::CanFrame& f) mutable {
                               return is_input(f) && ++n % 41 == 0 ? (++doubled, 2) : 1;
                             },
                         .out_of = {}},
                        GetParam());
  EXPECT_EQ(o.counts.extra_inputs, doubled);
  EXPECT_EQ(o.counts.lost(), 0U);
}

TEST_P(Window, EveryOutputLostOrDoubledWithinAnEpochIsCounted) {
  std::uint64_t lost = 0, doubled = 0;
  const Outcome o = run({.into = {},
                         .out_of =
                             [&, n = 0U](std::uint64_t, const base::CanFrame& f) mutable {
                               if (f.id == 0x321 || f.id == 0x326)
                                 return 1;  // the epoch's end and the answer to Begin get through
                               ++n;
                               if (n % 23 == 0) return ++lost, 0;
                               return n % 29 == 0 ? (++doubled, 2) : 1;
                             }},
                        GetParam());
  EXPECT_EQ(o.error, "");
  // A frame lost and another one doubled in one epoch look like none: the two periods meet in an epoch now and then.
  EXPECT_LE(o.counts.lost_outputs, lost);
  EXPECT_EQ(lost - o.counts.lost_outputs, doubled - o.counts.extra_outputs);
  EXPECT_GT(o.counts.lost_outputs, lost * 3 / 4);
}

TEST(Lockstep, LostOutputsAloneAreCountedExactlyEpochHeadsIncluded) {
  std::uint64_t lost = 0;
  const Outcome o = run({.into = {}, .out_of = [&, n = 0U](std::uint64_t, const base::CanFrame& f) mutable {
                           if (f.id == 0x321 || f.id == 0x326) return 1;
                           return ++n % 7 == 0 ? (++lost, 0) : 1;
                         }});
  EXPECT_EQ(o.error, "");
  EXPECT_EQ(o.counts.lost_outputs, lost);
  EXPECT_EQ(o.counts.extra(), 0U);
  EXPECT_EQ(o.counts.epochs, static_cast<std::uint64_t>(kTicks));
}

TEST(Lockstep, LostEndsOfEpochsAreCountedWhileTheWindowGoesOn) {
  std::uint64_t lost = 0;
  const Outcome o = run({.into = {}, .out_of = [&, n = 0U](std::uint64_t, const base::CanFrame& f) mutable {
                           return f.id == 0x321 && ++n % 50 == 3 ? (++lost, 0) : 1;
                         }});
  EXPECT_EQ(o.error, "");
  EXPECT_EQ(o.counts.lost_outputs, lost);
  EXPECT_EQ(o.counts.lost_inputs, 0U);
  EXPECT_EQ(o.counts.epochs, kTicks - lost);
}

TEST(Lockstep, TwoEpochsThatRunIntoOneAreToldApartByTheirNumber) {
  int end = 0, head = 0;
  const Outcome o = run({.into = {}, .out_of = [&](std::uint64_t, const base::CanFrame& f) {
                           if (f.id == 0x321) return ++end == 500 ? 0 : 1;
                           return f.id == 0x320 && ++head == 501 ? 0 : 1;
                         }});
  EXPECT_EQ(o.error, "");
  EXPECT_EQ(o.counts.lost_inputs, 0U) << "the node made every tick";
  EXPECT_GE(o.counts.lost_outputs, 1U);
  EXPECT_EQ(o.counts.epochs, kTicks - 1U);
  EXPECT_EQ(o.kept.times[499].us, 5'010'000);
}

TEST(Lockstep, DoubledEndsOfEpochsAreCounted) {
  std::uint64_t doubled = 0;
  const Outcome o = run({.into = {}, .out_of = [&, n = 0U](std::uint64_t, const base::CanFrame& f) mutable {
                           return (f.id == 0x321 || f.id == 0x320) && ++n % 11 == 0 ? (++doubled, 2) : 1;
                         }});
  EXPECT_EQ(o.counts.extra_outputs, doubled);
  EXPECT_EQ(o.counts.lost(), 0U);
}

TEST(Lockstep, ALostSyncFrameIsALostInput) {
  std::uint64_t lost = 0;
  const Outcome o = run(
      {.into = [&, n = 0U](std::uint64_t,
                           const base::CanFrame& f) mutable { return is_step(f) && ++n % 100 == 50 ? (++lost, 0) : 1; },
       .out_of = {}});
  EXPECT_EQ(o.error, "");
  EXPECT_EQ(o.counts.lost_inputs, lost);
  EXPECT_EQ(o.counts.lost_outputs, 0U);
  EXPECT_EQ(o.counts.epochs, kTicks - lost);
}

TEST(Lockstep, ANodeThatStopsAnsweringIsReportedWithWhatIsMissing) {
  const Outcome step =
      run({.into = [n = 0](std::uint64_t, const base::CanFrame& f) mutable { return is_step(f) && ++n > 10 ? 0 : 1; },
           .out_of = {}},
          1);
  EXPECT_NE(step.error.find("no answer to the tick at 0.110 s"), std::string::npos) << step.error;
  EXPECT_NE(step.error.find("no frame of the epoch came; 10 epochs before it"), std::string::npos) << step.error;
  const Outcome end = run(
      {.into = {},
       .out_of = [n = 0](std::uint64_t, const base::CanFrame& f) mutable { return f.id == 0x321 && ++n > 4 ? 0 : 1; }},
      1);
  EXPECT_NE(end.error.find("Est_StateCrc) is missing, 4 of its frames came"), std::string::npos) << end.error;
}

TEST(Lockstep, ABusWithoutANodeIsReported) {
  const Outcome o = run({}, 8, regular_script(), true);
  EXPECT_NE(o.error.find("no node with id base 0x300 answers"), std::string::npos) << o.error;
  EXPECT_GT(o.counts.syncs, 2U) << "Begin is repeated";
}

TEST(Lockstep, AnEpochWithManyInputsDoesNotOverrunTheBus) {
  Script script;
  for (int i = 0; i < 30'000; ++i) script.add_input({.id = 0x305, .size = 8, .data = {static_cast<std::uint8_t>(i)}});
  script.add_tick({10'000}, base::Micros{0});
  const Outcome o = run({}, 8, script);
  EXPECT_EQ(o.error, "");
  EXPECT_EQ(o.counts.lost(), 0U);
  EXPECT_EQ(o.consumed, 30'000U);
}

TEST(Lockstep, GarbageOnTheBusIsNoNode) {
  hal::MemoryBus bus;
  hal::MemoryCan end = bus.node_end();
  StandInNode node(end, 0x300);
  std::uint64_t n = 0;
  MemoryLink link(bus, [&] {
    for (int i = 0; i < 5; ++i, ++n) {  // wrong lengths, other blocks, extended ids
      static_cast<void>(end.send({.id = 0x340 + static_cast<std::uint32_t>(n % 64), .size = 8}));
      static_cast<void>(end.send({.id = 0x321, .extended = true, .size = 8}));
    }
    node.poll();
  });
  Script script = regular_script(100);
  KeepAll sink;
  Counts counts;
  ASSERT_TRUE(play_lockstep(link, script, sink, {.base = 0x300}, counts));
  EXPECT_EQ(counts.lost() + counts.extra(), 0U);
  EXPECT_EQ(counts.epochs, 100U);
}

}  // namespace
}  // namespace tetap::sim
