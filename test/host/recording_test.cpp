// SPDX-License-Identifier: Apache-2.0
// Records of runs are made with the stand-in node in every way a run can go, and repeated.
#include "sim_host/replay/recording.hpp"

#include "host/stand_in_node.hpp"
#include "sim_host/play/play.hpp"
#include "sim_host/play/realtime.hpp"
#include "sim_host/replay/candump.hpp"
#include "sim_host/replay/lockstep.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>

namespace tetap::sim {
namespace {

using test::KeepAll;
using test::StandInNode;

/// A node that ticks on its own while frames come as they like. The log sees frames in the order of the bus; the node
/// takes up to `lag` of them later than its epoch's frames appear.
struct FreeRun {
  Log log;
  std::mt19937_64 draw{9};
  hal::MemoryBus bus;
  hal::MemoryCan node_end = bus.node_end();
  hal::MemoryCan our_end = bus.player_end();
  StandInNode<hal::MemoryCan> node{node_end, 0x300};
  std::int64_t now_us = 1'000'000;

  void note(const base::CanFrame& f) { log.frames.push_back({{now_us++}, f}); }
  void outputs() {
    while (const auto f = our_end.receive()) note(*f);
  }
  void begin(std::int64_t time_us) {
    const auto frame = sync_frame(0x300, bus::SyncKind::kBegin, {time_us}, 0);
    note(frame);
    static_cast<void>(our_end.send(frame));
    node.poll();
    outputs();
  }
  void inputs(std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      const base::CanFrame f{.id = 0x301 + static_cast<std::uint32_t>(draw() % 0x1F),
                             .size = 8,
                             .data = {static_cast<std::uint8_t>(draw()), static_cast<std::uint8_t>(draw())}};
      note(f);
      static_cast<void>(our_end.send(f));
    }
  }
  void ticks(int count, std::int64_t from_us) {
    for (int i = 0; i < count; ++i) {
      inputs(draw() % 6);
      node.poll();
      inputs(draw() % 3);  // on the bus before the epoch's frames, and not in them
      node.tick(from_us + i * 10'000);
      outputs();
    }
  }
};

struct Repeated {
  Counts counts;
  std::uint64_t compared, different, missing;
  std::string first;
};

Recording surveyed(const Log& log, const ScriptOptions& options = {}) {
  FramesInMemory frames(log.frames);
  return *recording_of(frames, log.name, options);
}

Repeated repeat(const Log& log, const ScriptOptions& options = {}, std::uint32_t flaw = 0) {
  FramesInMemory frames(log.frames);
  const Recording recording = *recording_of(frames, log.name, options);
  RecordedTicks ticks(frames, recording, options);
  hal::MemoryBus bus;
  hal::MemoryCan end = bus.node_end();
  StandInNode node(end, options.base);
  node.loop_time_us = 4711;  // differs from run to run, and must not matter
  node.state_flaw = flaw;
  MemoryLink link(bus, [&node] { node.poll(); });
  Comparison comparison(ticks, recording, options);
  struct Both : KeepAll {
    Comparison* comparison = nullptr;
    void epoch(const NodeEpoch& e, base::Micros t) { comparison->epoch(e, t); }
  } sink;
  sink.comparison = &comparison;
  Repeated r{};
  EXPECT_TRUE(play_lockstep(link, ticks, sink, {.base = options.base}, r.counts));
  r.compared = comparison.compared();
  r.different = comparison.different();
  r.missing = comparison.missing();
  r.first = comparison.first_difference();
  return r;
}

std::string refusal(const Log& log) {
  FramesInMemory frames(log.frames);
  const auto recording = recording_of(frames, log.name, {});
  return recording ? "" : recording.failure().text;
}

TEST(Recording, AFreeRunIsRepeatedByteForByte) {
  FreeRun run;
  run.begin(500'000);
  run.ticks(2000, 1'000'000);
  const Recording recording = surveyed(run.log);
  EXPECT_EQ(recording.epochs, 2000U);
  EXPECT_FALSE(recording.inputs_differ_at);
  const Repeated r = repeat(run.log);
  EXPECT_EQ(r.compared, 2000U);
  EXPECT_EQ(r.different, 0U) << r.first;
  EXPECT_EQ(r.counts.lost() + r.counts.extra() + r.missing, 0U);
}

TEST(Recording, ItIsRepeatedOnANodeWithOtherIds) {
  FreeRun run;
  run.begin(0);
  run.ticks(100, 1'000'000);
  const Repeated r = repeat(run.log, {.base = 0x500, .log_base = 0x300});
  EXPECT_EQ(r.compared, 100U);
  EXPECT_EQ(r.different, 0U) << r.first;
}

TEST(Recording, MoreInputsThanTheCounterHoldsAreNoTrouble) {
  FreeRun run;
  run.begin(0);
  run.ticks(20'000, 1'000'000);
  ASSERT_GT(run.node.consumed(), 65'536U);
  const Repeated r = repeat(run.log);
  EXPECT_EQ(r.compared, 20'000U);
  EXPECT_EQ(r.different, 0U) << r.first;
}

TEST(Recording, ANodeSwitchedOnWhileFramesFlowIsFoundByItsOwnCrc) {
  FreeRun run;
  run.inputs(40);  // nobody there yet
  while (run.node_end.receive()) continue;
  run.inputs(7);
  run.ticks(50, 10'000);
  const Recording recording = surveyed(run.log);
  EXPECT_FALSE(recording.inputs_differ_at);
  const Repeated r = repeat(run.log);
  EXPECT_EQ(r.compared, 50U);
  EXPECT_EQ(r.different, 0U) << r.first;
}

TEST(Recording, ANodeThatWasRestartedIsRestartedAgain) {
  FreeRun run;
  run.begin(0);
  run.ticks(30, 1'000'000);
  run.inputs(3);
  run.node.poll();
  run.begin(77);
  run.begin(78);
  run.ticks(300, 5'000'000);
  FramesInMemory frames(run.log.frames);
  const Recording recording = *recording_of(frames, run.log.name, {});
  RecordedTicks ticks(frames, recording, {});
  std::vector<std::int64_t> begins;
  Tick tick;
  while (ticks.next(tick))
    if (tick.begin) begins.push_back(tick.begin->us);
  EXPECT_EQ(begins, (std::vector<std::int64_t>{0, 78}));
  const Repeated r = repeat(run.log);
  EXPECT_EQ(r.compared, 330U);
  EXPECT_EQ(r.different, 0U) << r.first;
}

TEST(Recording, WhatTheNodeDidBeforeTheLogBeganIsLeftOutWhenItIsRestarted) {
  for (const std::ptrdiff_t cut : {100, 101, 102, 103, 104, 105, 106, 107, 108}) {  // also in the middle of an epoch
    FreeRun run;
    run.begin(0);
    run.ticks(30, 1'000'000);
    run.begin(5'000'000);
    run.ticks(40, 6'000'000);
    run.log.frames.erase(run.log.frames.begin(), run.log.frames.begin() + cut);
    const Recording recording = surveyed(run.log);
    EXPECT_EQ(recording.epochs, 40U);
    EXPECT_GT(recording.skipped_epochs, 10U);
    const Repeated r = repeat(run.log);
    EXPECT_EQ(r.compared, 40U);
    EXPECT_EQ(r.different, 0U) << r.first;
  }
}

TEST(Recording, ANodeThatComputesSomethingElseIsNoticedInItsFirstEpoch) {
  FreeRun run;
  run.begin(0);
  run.ticks(20, 1'000'000);
  const Repeated r = repeat(run.log, {}, 1);
  EXPECT_EQ(r.different, 20U);
  EXPECT_EQ(r.first.find("epoch 1 at 1.000 s: recorded Est_StateCrc "), 0U) << r.first;
}

TEST(Recording, OneInputBitChangedIsNoticed) {
  FreeRun run;
  run.begin(0);
  run.ticks(200, 1'000'000);
  for (std::size_t i = run.log.frames.size() / 2;; ++i)
    if (is_counted_input(run.log.frames[i].frame, 0x300)) {
      run.log.frames[i].frame.data[5] ^= 1;
      break;
    }
  const Recording recording = surveyed(run.log);
  ASSERT_TRUE(recording.inputs_differ_at && recording.hole);
  EXPECT_EQ(recording.hole->time, *recording.inputs_differ_at);
  EXPECT_NE(recording.hole->why.find("consumed other input frames than the log holds"), std::string::npos);
  const Repeated r = repeat(run.log);
  EXPECT_EQ(r.different, 0U) << "before the change all is equal";
  EXPECT_GT(r.compared, 50U);
  EXPECT_LT(r.compared, 150U);
  EXPECT_EQ(r.compared + recording.unlogged, 200U);
}

TEST(Recording, AFrameOfTheNodeMissingInTheRecordIsCountedAndShown) {
  FreeRun run;
  run.begin(0);
  run.ticks(50, 1'000'000);
  auto& frames = run.log.frames;
  std::size_t seen = 0;
  for (auto f = frames.begin(); f != frames.end(); ++f)
    if (f->frame.id == 0x328 && ++seen == 20) {
      frames.erase(f);
      break;
    }
  const Recording recording = surveyed(run.log);
  EXPECT_EQ(recording.missing_outputs, 1U);
  const Repeated r = repeat(run.log);
  EXPECT_EQ(r.different, 1U);
  EXPECT_EQ(r.first.find("epoch 20 at 1.190 s: recorded Est0_Motion"), 0U) << r.first;
}

TEST(Recording, ALogIsRepeatedUpToAHoleWithTheReason) {
  FreeRun run;
  run.begin(0);
  run.ticks(50, 1'000'000);
  const auto expect_hole = [](const Log& log, std::uint64_t epochs, const char* why) {
    const Recording recording = surveyed(log);
    ASSERT_TRUE(recording.hole) << why;
    EXPECT_NE(recording.hole->why.find(why), std::string::npos) << recording.hole->why;
    EXPECT_NEAR(static_cast<double>(recording.hole->time.us), 1e6 + 1e4 * static_cast<double>(epochs), 2e4) << why;
    const Repeated r = repeat(log);
    EXPECT_EQ(r.compared, epochs) << why;
    EXPECT_EQ(r.different + r.missing, 0U) << r.first;
    EXPECT_GE(recording.epochs + recording.unlogged, 49U) << why;
  };
  const auto without = [&run](std::uint32_t id, std::size_t which) {
    Log log = run.log;
    std::size_t seen = 0;
    std::erase_if(log.frames, [&](const TimedFrame& f) { return f.frame.id == id && ++seen == which; });
    return log;
  };
  expect_hole(without(0x320, 10), 9, "lacks its first frame");
  expect_hole(without(0x321, 10), 9, "lacks its last frame");
  Log hole = run.log;
  std::size_t epoch = 0;
  std::erase_if(hole.frames, [&](const TimedFrame& f) {
    epoch += f.frame.id == 0x320 ? 1 : 0;
    return epoch == 20 && f.frame.id >= 0x320;
  });
  expect_hole(hole, 19, "epochs are missing");
  Log inputs_end = run.log;
  std::size_t inputs = 0;
  std::erase_if(inputs_end.frames,
                [&](const TimedFrame& f) { return is_counted_input(f.frame, 0x300) && ++inputs > 100; });
  const Recording recording = surveyed(inputs_end);
  ASSERT_TRUE(recording.hole);
  EXPECT_NE(recording.hole->why.find("more input frames"), std::string::npos) << recording.hole->why;
  EXPECT_GT(recording.epochs, 20U);
  EXPECT_EQ(repeat(inputs_end).different, 0U);
}

TEST(Recording, WhatCannotBeRepeatedAtAllIsRefusedWithTheReason) {
  FreeRun run;
  run.begin(0);
  run.ticks(50, 1'000'000);
  Log late = run.log;
  late.frames.erase(late.frames.begin(), late.frames.begin() + 120);
  EXPECT_NE(refusal(late).find("begins after the node's start"), std::string::npos) << refusal(late);
  Log inputs_gone = run.log;
  std::erase_if(inputs_gone.frames, [](const TimedFrame& f) { return is_counted_input(f.frame, 0x300); });
  EXPECT_NE(refusal(inputs_gone).find("no input frames in this log"), std::string::npos) << refusal(inputs_gone);
}

/// The log as a file of its own, and how the player would play it.
PlayMode mode_of(const Log& log, std::uint32_t base) {
  const std::string path = testing::TempDir() + "tetap_mode_of.log";
  std::ofstream out(path);
  for (const TimedFrame& entry : log.frames) {
    Line line;
    append_log_line(line, entry.time, "vcan0", entry.frame);
    out << line.view();
  }
  out.close();
  PlayOptions options{.log = path, .script = {.base = base, .log_base = base}};
  static_cast<void>(survey_for(options));
  std::filesystem::remove(path);
  return options.mode;
}

TEST(Recording, ALogWithoutNodeIsNone) {
  FreeRun run;
  run.inputs(10);
  EXPECT_EQ(mode_of(run.log, 0x300), PlayMode::kLockstep);
  run.node.poll();
  run.ticks(1, 1);
  EXPECT_EQ(mode_of(run.log, 0x300), PlayMode::kAsRecorded);
  EXPECT_EQ(mode_of(run.log, 0x340), PlayMode::kLockstep);
}

/// Counts what is read.
class Counted : public Frames {
 public:
  explicit Counted(std::span<const TimedFrame> frames) : frames_(frames) {}
  bool next(TimedFrame& frame) override {
    ++read;
    return frames_.next(frame);
  }
  void rewind() override {
    read = 0;
    frames_.rewind();
  }
  std::size_t read = 0;

 private:
  FramesInMemory frames_;
};

TEST(Recording, ALongLogIsReadAsItIsPlayed) {
  FreeRun run;
  run.begin(0);
  run.ticks(5'000, 1'000'000);
  std::vector<std::size_t> ends;  // of epochs, in the log
  for (std::size_t i = 0; i < run.log.frames.size(); ++i)
    if (run.log.frames[i].frame.id == 0x300 + bus::EstStateCrc::kOffset) ends.push_back(i + 1);
  run.inputs(1'000);  // the node is switched off
  Counted frames(run.log.frames);
  const Recording recording = *recording_of(frames, run.log.name, {});
  RecordedTicks ticks(frames, recording, {});
  Tick tick;
  for (const std::size_t end : ends) {
    ASSERT_TRUE(ticks.next(tick));
    EXPECT_EQ(frames.read, end);
  }
  EXPECT_FALSE(ticks.next(tick));
  EXPECT_EQ(frames.read, ends.back()) << "what comes after the last epoch is not read again";
}

TEST(Recording, InputsBehindABeginFrameThatNobodyAnsweredAreTheNodesAsBefore) {
  FreeRun run;
  run.begin(0);
  run.ticks(20, 1'000'000);
  run.inputs(5);
  run.note(sync_frame(0x300, bus::SyncKind::kBegin, {9'000'000}, 1));  // the node never sees it
  run.ticks(20, 2'000'000);
  const Repeated r = repeat(run.log);
  EXPECT_EQ(r.compared, 40U);
  EXPECT_EQ(r.different, 0U) << r.first;
  EXPECT_EQ(r.counts.lost() + r.counts.extra() + r.missing, 0U);
}

TEST(Recording, AnInputThatTheLogShowsLateIsTakenFromThere) {
  FreeRun run;
  run.begin(0);
  run.ticks(100, 1'000'000);
  auto& frames = run.log.frames;
  std::size_t moved = 0;
  for (std::size_t i = 50; i + 1 < frames.size(); ++i) {  // candump may stamp the node's frames before an input
    if (!is_counted_input(frames[i].frame, 0x300) || is_counted_input(frames[i + 1].frame, 0x300)) continue;
    std::size_t end = i + 1;  // inputs keep their own order
    while (end < std::min(i + 12, frames.size()) && !is_counted_input(frames[end].frame, 0x300)) ++end;
    std::rotate(frames.begin() + static_cast<std::ptrdiff_t>(i), frames.begin() + static_cast<std::ptrdiff_t>(i) + 1,
                frames.begin() + static_cast<std::ptrdiff_t>(end));
    ++moved;
    i += 40;
  }
  ASSERT_GT(moved, 5U);
  const Recording recording = surveyed(run.log);
  EXPECT_EQ(recording.epochs, 100U);
  EXPECT_FALSE(recording.hole) << recording.hole->why;
}

TEST(Realtime, FramesAndTicksKeepTheOrderOfTheLogHoweverLateTheyAre) {
  hal::MemoryBus bus;
  hal::MemoryCan end = bus.node_end();
  StandInNode node(end, 0x300);
  std::uint64_t polls = 0;
  MemoryLink link(bus, [&] {
    node.poll();
    if (++polls % 50 == 0)
      hal::sleep_for({35'000});  // a machine that was busy with something else: much is due at once
  });
  std::vector<TimedFrame> frames;
  for (int i = 0; i < 200; ++i)
    frames.push_back({{5'000'000 + i * 1'000}, {.id = 0x308, .size = 8, .data = {static_cast<std::uint8_t>(i)}}});
  KeepAll sink;
  Counts counts;
  ASSERT_TRUE(play_realtime(link, frames, sink, {.base = 0x300}, counts));
  EXPECT_EQ(counts.inputs, 200U);
  EXPECT_EQ(node.consumed(), 200U);
  EXPECT_EQ(counts.lost() + counts.extra(), 0U);
  EXPECT_EQ(counts.epochs, 21U);
  for (std::size_t i = 1; i < sink.times.size(); ++i) EXPECT_EQ(sink.times[i].us - sink.times[i - 1].us, 10'000);
  std::size_t sent = 0;
  for (const base::CanFrame& f : sink.sent_frames) {
    if (f.id == 0x308) {
      EXPECT_EQ(f.data[0], sent++);
    }
    const auto sync = f.id == 0x300 ? bus::decode<bus::InSync>(bus::payload(f)) : std::nullopt;
    if (!sync || sync->kind != bus::SyncKind::kTick) continue;
    EXPECT_EQ(sent, std::min<std::size_t>((sync->time_us - 5'000'000) / 1'000 + 1, 200))
        << "before the tick at " << sync->time_us;
  }
}

TEST(Realtime, LostFramesAreCountedInBothDirections) {
  hal::MemoryBus bus;
  hal::MemoryCan end = bus.node_end();
  std::uint64_t lost_in = 0, lost_out = 0;
  StandInNode node(end, 0x300,
                   {.into =
                        [&, n = 0U](std::uint64_t, const base::CanFrame& f) mutable {
                          return f.id != 0x300 && ++n % 10 == 0 ? (++lost_in, 0) : 1;
                        },
                    .out_of =
                        [&, n = 0U](std::uint64_t, const base::CanFrame& f) mutable {
                          return f.id == 0x328 && ++n % 5 == 0 ? (++lost_out, 0) : 1;
                        }});
  MemoryLink link(bus, [&node] { node.poll(); });
  std::vector<TimedFrame> frames;
  for (int i = 0; i < 200; ++i) frames.push_back({{i * 1'000}, {.id = 0x308, .size = 8}});
  KeepAll sink;
  Counts counts;
  ASSERT_TRUE(play_realtime(link, frames, sink, {.base = 0x300}, counts));
  EXPECT_EQ(counts.lost_inputs, lost_in);
  EXPECT_EQ(counts.lost_outputs, lost_out);
  EXPECT_GT(lost_in, 10U);
  EXPECT_GT(lost_out, 2U);
}

}  // namespace
}  // namespace tetap::sim
