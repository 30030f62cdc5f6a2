// SPDX-License-Identifier: Apache-2.0
// A bus that is not trusted: sync frames that nobody meant, and commands that were replayed or made up. Samples damaged
// behind the CAN controller come too. A refused frame is counted and changes no bit of an estimate.
#include "node/bench.hpp"
#include "tetap/bus/guard_sender.hpp"
#include "tetap/firmware/firmware.hpp"
#include "tetap/firmware/snapshot.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <memory>
#include <random>
#include <utility>
#include <vector>

namespace tetap::test {
namespace {

using ProtectedRobot = node::WithBusProtection<node::Estimators<estimators::Odometry, estimators::PoseEkf>>;

// ---- sync frames

struct QuietBoard {
  struct Can {
    Frames to_node, sent;
    std::size_t next = 0;
    bool send(const base::CanFrame& frame) { return sent.push_back(frame), true; }
    std::optional<base::CanFrame> receive() {
      if (next == to_node.size()) return std::nullopt;
      return to_node[next++];
    }
    void flush() {}
    [[nodiscard]] base::CanFaults faults() const { return {}; }
  } can;
  base::Micros time;
  [[nodiscard]] base::Micros now() const { return time; }
};

class LoopOnABus : public ::testing::Test {
 protected:
  void start(param::Lockstep lockstep) {
    parameters.loop.lockstep = lockstep;
    firmware = std::make_unique<firmware::Firmware<QuietBoard, ProtectedRobot>>(board, parameters, bus::Version{});
  }
  void put(const bus::InSync& sync, bool guarded) {
    if (guarded) board.can.to_node.push_back(in(bus::guard_of_sync(sync)));
    board.can.to_node.push_back(in(sync));
  }
  static bus::InSync sync(bus::SyncKind kind, std::int64_t time_us, int counter) {
    return {.time_us = static_cast<std::uint64_t>(time_us), .ctr = static_cast<std::uint8_t>(counter), .kind = kind};
  }
  /// Number of ticks that there were.
  int run(std::int64_t us) {
    const auto before = ticks();
    for (const base::Micros until = board.time + base::Micros{us}; board.time < until; board.time += base::Micros{250})
      firmware->poll();
    return ticks() - before;
  }
  [[nodiscard]] int ticks() const { return static_cast<int>(all<bus::EstEpoch>(board.can.sent).size()); }
  [[nodiscard]] int refused() {
    run(3'000'000);
    return last<bus::EstDiagLimits>(board.can.sent).value_or(bus::EstDiagLimits{}).lock_refused;
  }

  param::Parameters parameters = kNumbers;
  QuietBoard board;
  std::unique_ptr<firmware::Firmware<QuietBoard, ProtectedRobot>> firmware;
};

TEST_F(LoopOnABus, OneFrameWithoutAChecksumStopsNothing) {
  start(param::Lockstep::kGuarded);
  run(1'000'000);
  base::CanFrame frame{.id = 0x300, .size = 8, .data = {0, 0, 0, 0, 0, 0, 0, 3}};  // the case one_begin_frame.log
  board.can.to_node.push_back(frame);
  EXPECT_EQ(run(500'000), 50);
  frame.data[7] = 1;
  board.can.to_node.push_back(frame);
  EXPECT_EQ(run(500'000), 50);
  EXPECT_EQ(last<bus::EstStatus>(board.can.sent)->reset_ctr, 0) << "nor does it reset anything";
  EXPECT_EQ(refused(), 2);
}

TEST_F(LoopOnABus, AForeignStepDoesNotResetANodeThatFollowsTicks) {
  start(param::Lockstep::kGuarded);
  std::int64_t time_us = 8'000'000;
  int counter = 0;
  const auto follow = [&](int periods) {
    for (int k = 0; k < periods; ++k) {
      put(sync(bus::SyncKind::kTick, time_us += 10'000, ++counter), false);
      run(10'000);
    }
  };
  follow(50);
  put(sync(bus::SyncKind::kStep, 0, 0), false);
  const int before = ticks();
  follow(50);
  EXPECT_EQ(ticks() - before, 50);
  EXPECT_EQ(last<bus::EstStatus>(board.can.sent)->reset_ctr, 0);
}

TEST_F(LoopOnABus, AGuardIsForTheFrameBehindItAndNoOther) {
  const bus::InSync begin = sync(bus::SyncKind::kBegin, 5'000'000, 7);
  for (int wrong = 0; wrong < 4; ++wrong) {
    board = {};
    start(param::Lockstep::kGuarded);
    run(100'000);
    board.can.to_node.push_back(in(bus::guard_of_sync(begin)));
    bus::InSync other = begin;
    if (wrong == 0) other.time_us ^= 1U << 20;
    if (wrong == 1) other.ctr = 8;
    if (wrong == 2) board.can.to_node.push_back(in(sync(bus::SyncKind::kBegin, 6'000'000, 7)));  // used up by this
    if (wrong == 3) board.can.to_node.back().data[2] ^= 0x10;
    board.can.to_node.push_back(in(other));
    EXPECT_GE(run(1'000'000), 99) << wrong;
    EXPECT_EQ(refused(), wrong == 2 ? 2 : 1) << wrong;
  }
}

TEST_F(LoopOnABus, AGuardedBeginIsObeyedAndTheOwnTimerComesBackTwoSecondsAfterTheLastStep) {
  start(param::Lockstep::kGuarded);
  run(100'000);
  put(sync(bus::SyncKind::kBegin, 5'000'000, 0), true);
  EXPECT_EQ(run(1'000'000), 0);
  for (int k = 1; k <= 100; ++k) put(sync(bus::SyncKind::kStep, 5'000'000 + k * 10'000, k), false);
  EXPECT_EQ(run(1'000'000), 100) << "a Step needs no guard once the node is in lockstep";
  EXPECT_EQ(last<bus::EstEpoch>(board.can.sent)->time_us, 6'000'000U);
  EXPECT_EQ(run(950'000), 0);
  EXPECT_NEAR(run(2'000'000), 190, 10);
  EXPECT_NEAR(static_cast<double>(last<bus::EstEpoch>(board.can.sent)->time_us), 9.92e6, 0.1e6) << "time went on";
}

TEST_F(LoopOnABus, ParametersSayWhoMayAskForLockstep) {
  for (const auto& [allowed, guarded, obeyed] : {std::tuple{param::Lockstep::kAuthenticated, true, false},
                                                 {param::Lockstep::kAuthenticated, false, false},
                                                 {param::Lockstep::kGuarded, true, true},
                                                 {param::Lockstep::kGuarded, false, false},
                                                 {param::Lockstep::kPlain, true, true},
                                                 {param::Lockstep::kPlain, false, true}}) {
    board = {};
    start(allowed);
    run(100'000);
    put(sync(bus::SyncKind::kBegin, 5'000'000, 0), guarded);
    EXPECT_EQ(run(1'000'000) == 0, obeyed) << static_cast<int>(allowed) << ' ' << guarded;
  }
}

TEST_F(LoopOnABus, WhoeverTakesTheNodeOverDoesSoOnceInTwoSeconds) {
  start(param::Lockstep::kGuarded);
  run(100'000);
  int begun = 0;
  for (int k = 0; k < 1'000; ++k) {  // ten seconds of Begin and Clock in turn
    const auto versions = [&] { return all<bus::EstVersion>(board.can.sent).size(); };
    put(sync(bus::SyncKind::kClock, 5'000'000 + k * 10'000, 2 * k), false);
    run(5'000);
    const auto before = versions();
    put(sync(bus::SyncKind::kBegin, 5'000'000 + k * 10'000, 2 * k + 1), true);
    run(5'000);
    begun += versions() > before ? 1 : 0;
  }
  EXPECT_GE(begun, 4);
  EXPECT_LE(begun, 5 + 40 + 1) << "and the versions that it publishes by itself";
}

TEST_F(LoopOnABus, APollTicksOnceAtMostAndLosesNothing) {
  start(param::Lockstep::kGuarded);
  put(sync(bus::SyncKind::kBegin, 5'000'000, 0), true);
  for (int k = 1; k <= 60; ++k) put(sync(bus::SyncKind::kStep, 5'000'000 + k * 10'000, k), false);
  int most = 0;
  for (int k = 0; k < 100; ++k) {
    const int before = ticks();
    firmware->poll();
    most = std::max(most, ticks() - before);
  }
  EXPECT_EQ(most, 1);
  EXPECT_EQ(ticks(), 60);
}

// ---- commands

/// A command behind the tag that opens its counter and the tag that covers it.
Frames tagged_by(const base::SipKey& key, const bus::TagContext& of, const base::CanFrame& command) {
  bus::InGuardTag opening{.tag_id = static_cast<std::uint8_t>(command.id & 0x3FU), .tag_ctr = of.counter};
  bus::InGuardTag covering = opening;
  opening.tag_crc = bus::tag_of(key, of, {});
  covering.tag_crc = bus::tag_of(key, of, command.data);
  return {in(opening), in(covering), command};
}

class ProtectedBench {
 public:
  explicit ProtectedBench(const param::Parameters& parameters, std::uint32_t noise = 1)
      : parameters_(parameters), node_(parameters_, {.git = 1}), noise_(noise) {
    node_.power_on({Bench::kStart_us});
  }
  ProtectedBench(const ProtectedBench&) = delete;
  ProtectedBench& operator=(const ProtectedBench&) = delete;

  /// One epoch with wheels, whose counts are never the same in another bench, and these frames.
  Frames epoch(const Frames& frames = {}) {
    noise_ = noise_ * 1'664'525U + 1'013'904'223U;
    left_ += 30 + (noise_ >> 30);
    Frames out;
    const auto wheels = in(bus::InWheelCounts{.stamp_us = stamp(now_us_ + 4'000),
                                              .seq = static_cast<std::uint8_t>(++k_ & 15),
                                              .left = static_cast<std::uint16_t>(left_),
                                              .right = static_cast<std::uint16_t>(left_)});
    for (const auto& frame : sensors ? sensors(wheels) : Frames{wheels}) node_.on_frame(frame);
    for (const auto& frame : frames) node_.on_frame(frame);
    now_us_ += 10'000;
    node_.tick({now_us_}, {}, [&](const base::CanFrame& frame) { out.push_back(frame); });
    for (const auto& frame : out) {
      if (const auto page = last<bus::EstDiagGuard>({frame})) {
        nonce = {.nonce = page->nonce, .turn = static_cast<std::uint32_t>(now_us_ >> 21)};
        guard = *page;
      }
      if (const auto page = last<bus::EstDiagLimits>({frame})) rate = page->cmd_rate;
      if (const auto page = last<bus::EstDiagRefused>({frame})) refused = page->cmd_refused;
      if (const auto tail = last<bus::EstStateCrc>({frame})) state.push_back(tail->crc);
      if (const auto status = last<bus::EstStatus>({frame})) resets = status->reset_ctr;
    }
    return out;
  }
  Frames run(int epochs) {
    Frames all;
    for (int k = 0; k < epochs; ++k)
      for (const auto& frame : epoch()) all.push_back(frame);
    return all;
  }
  /// The command with both tags before it.
  [[nodiscard]] Frames tagged(const base::CanFrame& command, std::uint32_t counter) const {
    bus::TagContext of = nonce;
    of.id = command.id;
    of.counter = counter;
    return tagged_by(parameters_.bus.key, of, command);
  }

  [[nodiscard]] const node::Node<ProtectedRobot>& node() const { return node_; }
  /// Goes on where `other` is.
  void resume(const ProtectedBench& other, const node::Node<ProtectedRobot>& its_node) {
    node_.resume(its_node);
    noise_ = other.noise_;
    left_ = other.left_;
    k_ = other.k_;
    now_us_ = other.now_us_;
  }

  bus::TagContext nonce;
  bus::EstDiagGuard guard;
  int refused = 0, rate = 0, resets = 0;
  std::vector<std::uint32_t> state;
  std::function<Frames(const base::CanFrame&)> sensors;

 private:
  param::Parameters parameters_;
  node::Node<ProtectedRobot> node_;
  std::uint32_t noise_;
  std::uint32_t left_ = 0;
  int k_ = 0;
  std::int64_t now_us_ = Bench::kStart_us;
};

param::Parameters with(param::CommandAccess commands, int guard = 0) {
  param::Parameters parameters = kNumbers;
  parameters.bus = {.commands = commands, .guard = guard, .key = {0x03020100U, 0x07060504U, 0x0B0A0908U, 0x0F0E0D0CU}};
  return parameters;
}
base::CanFrame reset_estimators(int counter) {
  return in(
      bus::protect(bus::CmdReset{.ctr = static_cast<std::uint8_t>(counter & 15), .what = bus::ResetWhat::kEstimators}));
}

TEST(OpenCommands, AreObeyedInTheOrderOfTheirCounter) {
  ProtectedBench bench(with(param::CommandAccess::kOpen));
  bench.run(5);
  bench.epoch(set_pose(1, 0, 0, 0));
  bench.run(200);
  EXPECT_EQ(bench.resets, 1);
  bench.epoch(set_pose(7, 500'000, 0, 0));  // the case spoof_setpose.log: a counter that is not the next
  bench.run(200);
  EXPECT_EQ(bench.resets, 1);
  EXPECT_EQ(bench.refused, 1);
  bench.epoch(set_pose(2, 1'000, 0, 0));
  bench.run(200);
  EXPECT_EQ(bench.resets, 2);
  bench.epoch(set_pose(5, 1'000, 0, 0));  // two were lost
  bench.run(200);
  EXPECT_EQ(bench.resets, 3);
  bench.epoch(set_pose(1, 1'000, 0, 0));
  bench.run(200);
  bench.epoch(set_pose(2, 1'000, 0, 0));  // a sender that began anew
  bench.run(200);
  EXPECT_EQ(bench.resets, 4);
  EXPECT_EQ(bench.refused, 2);
}

TEST(OpenCommands, AStormIsObeyedSlowly) {
  ProtectedBench bench(with(param::CommandAccess::kOpen));
  bench.run(5);
  for (int k = 0; k < 1'000; ++k) bench.epoch(set_pose(k, 1'000, 0, 0));
  bench.run(400);
  EXPECT_GE(bench.resets, 20);
  EXPECT_LE(bench.resets, 4 + 20 + 1);
  EXPECT_EQ(bench.resets + bench.rate, 1'000);
}

TEST(ClosedCommands, NoneIsObeyedAndNoBitChanges) {
  ProtectedBench quiet(with(param::CommandAccess::kNone)), attacked(with(param::CommandAccess::kNone));
  for (int k = 0; k < 300; ++k) {
    quiet.epoch();
    Frames frames = set_pose(k, 9'000, 0, 1);
    frames.push_back(reset_estimators(k));
    frames.push_back(map_entry(k & 15, k, k));
    attacked.epoch(frames);
  }
  quiet.run(200), attacked.run(200);
  EXPECT_EQ(quiet.state, attacked.state);
  EXPECT_EQ(attacked.refused, 1'200);
}

TEST(Tags, OfAFrameAreThoseOfOpenssl) {
  // openssl mac over the 24 bytes EFBEADDE D2040000 03030000 4D000000 7901000000000000, key 000102..0f: DFFA674E...
  constexpr base::SipKey kKey{0x03020100U, 0x07060504U, 0x0B0A0908U, 0x0F0E0D0CU};
  constexpr std::array<std::uint8_t, 8> kData{0x79, 1, 0, 0, 0, 0, 0, 0};
  static_assert(bus::tag_of(kKey, {.nonce = 0xDEADBEEFU, .turn = 1234, .id = 0x303, .counter = 77}, kData) ==
                0x4E67FADFU);
}

class TaggedCommands : public ::testing::Test {
 protected:
  param::Parameters parameters = with(param::CommandAccess::kAuthenticated);
  ProtectedBench bench{parameters}, quiet{parameters};

  void SetUp() override {
    both(600);
    ASSERT_NE(bench.nonce.nonce, 0U);
  }
  void both(int epochs) { bench.run(epochs), quiet.run(epochs); }
  /// The attacked node and the one that was left alone computed the same, bit for bit.
  void expect_untouched() {
    both(400);
    EXPECT_EQ(bench.state, quiet.state);
    EXPECT_EQ(bench.resets, 0);
  }
  void send(const Frames& frames) { bench.epoch(frames), quiet.epoch(); }
};

TEST_F(TaggedCommands, AreObeyedOnceEach) {
  bench.epoch(bench.tagged(reset_estimators(1), 5));
  bench.run(20);
  EXPECT_EQ(bench.resets, 1);
  Frames pose;
  for (const base::CanFrame& half : set_pose(1, 1'000, 2'000, 0))
    for (const base::CanFrame& frame : bench.tagged(half, half.id == 0x303 ? 6 : 7)) pose.push_back(frame);
  bench.epoch(pose);
  const Frames out = bench.run(20);
  EXPECT_EQ(bench.resets, 2);
  EXPECT_NEAR(last<bus::EstPos>(out, 1)->y_raw, 2'000, 2);
  bench.run(400);
  EXPECT_EQ(bench.guard.auth_bad, 0);
  EXPECT_EQ(bench.guard.replayed, 0);
}

TEST_F(TaggedCommands, WithoutATagAreRefused) {
  send({reset_estimators(1)});
  send(set_pose(1, 1'000, 0, 0));
  send({map_entry(3, 1, 1)});
  expect_untouched();
  EXPECT_EQ(bench.guard.auth_bad, 4);
}

TEST_F(TaggedCommands, WithOneBitWrongAreRefused) {
  const Frames good = bench.tagged(reset_estimators(1), 9);
  int tried = 0;
  for (std::size_t bit = 0; bit < 192; ++bit) {
    Frames bad = good;
    base::CanFrame& frame = bad[bit / 64];
    if (bit < 128 && bit % 64 < 8) continue;  // another page or id: no tag of this command
    frame.data[bit % 64 / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
    if (bit >= 128 && bit % 64 >= 8) frame.data[0] = bus::e2e_crc(2, frame.data);  // a forger does that, too
    send(bad);
    ++tried;
    bench.run(30), quiet.run(30);
  }
  expect_untouched();
  EXPECT_EQ(bench.guard.auth_bad, tried);
}

TEST_F(TaggedCommands, UnderTheTagOfAnotherIdOrNodeAreRefused) {
  Frames other_id = bench.tagged(set_pose(1, 0, 0, 0)[0], 9);
  other_id[2].id = 0x304;
  send(other_id);
  param::Parameters elsewhere = parameters;
  elsewhere.can_base = 0x340;
  bus::TagContext of = bench.nonce;
  of.id = elsewhere.can_base + bus::CmdReset::kOffset;
  of.counter = 10;
  Frames other_node = tagged_by(parameters.bus.key, of, reset_estimators(1));
  send(other_node);
  expect_untouched();
  EXPECT_EQ(bench.guard.auth_bad, 2);
}

TEST_F(TaggedCommands, ReplayedOrOfAnOldCounterAreRefused) {
  const Frames first = bench.tagged(reset_estimators(1), 20), older = bench.tagged(reset_estimators(2), 19);
  const Frames map = bench.tagged(map_entry(3, 1, 1), 18);
  bench.epoch(first);
  bench.run(10);
  ASSERT_EQ(bench.resets, 1);
  bench.epoch(first);
  bench.epoch(older);
  bench.epoch(map);
  bench.run(400);
  EXPECT_EQ(bench.resets, 1);
  EXPECT_EQ(bench.guard.replayed, 3);
}

TEST_F(TaggedCommands, RunOutAfterTwoTurns) {
  const Frames old = bench.tagged(reset_estimators(1), 5);
  both(450);
  send(old);
  expect_untouched();
  EXPECT_EQ(bench.guard.auth_bad, 1);
}

TEST_F(TaggedCommands, OfTheLifeBeforeAreRefusedAfterARestart) {
  const Frames recorded = bench.tagged(reset_estimators(1), 5);
  ProtectedBench restarted(parameters, 2), alone(parameters, 2);  // the sensors' noise is another
  for (int k = 0; k < 600; ++k) restarted.epoch(), alone.epoch();
  EXPECT_EQ(restarted.nonce.turn, bench.nonce.turn) << "even at the same time after the start";
  restarted.epoch(recorded), alone.epoch();
  for (int k = 0; k < 400; ++k) restarted.epoch(), alone.epoch();
  EXPECT_EQ(restarted.resets, 0);
  EXPECT_EQ(restarted.state, alone.state);
  EXPECT_EQ(restarted.guard.auth_bad, 1);
}

TEST_F(TaggedCommands, GuessesAreLimited) {
  for (int k = 0; k < 2'000; ++k)
    send({in(bus::InGuardTag{.tag_id = 2, .tag_ctr = 100, .tag_crc = static_cast<std::uint32_t>(k)}),
          reset_estimators(k)});
  expect_untouched();
  EXPECT_EQ(bench.guard.auth_bad, 2'000 % 512) << "the counter has nine bits";
}

/// 1 Mbit/s brings 90 frames in 10 ms: tags of the owner's counter, of others, and commands, before and between the
/// owner's three.
TEST_F(TaggedCommands, AreObeyedWhileWrongTagsFillTheBus) {
  std::mt19937 random(8);
  for (int command = 1; command <= 10; ++command) {
    const auto counter = static_cast<std::uint32_t>(4 * command);
    const Frames right = bench.tagged(reset_estimators(command), counter);
    std::size_t next = 0;
    for (int epoch = 0; epoch < 60; ++epoch) {
      Frames all;
      for (int k = 0; k < 87; ++k) {
        if (k % 9 == 4) {
          all.push_back(reset_estimators(command + 1 + static_cast<int>(random() % 15)));
        } else {
          const bool same = k % 18 < 3;
          all.push_back(in(bus::InGuardTag{.tag_id = 2,
                                           .tag_ctr = same ? counter : static_cast<std::uint32_t>(random() >> 8),
                                           .tag_crc = static_cast<std::uint32_t>(random())}));
        }
        if (epoch == 20 && k % 18 == 17 && next < right.size()) all.push_back(right[next++]);
      }
      bench.epoch(all);
    }
    EXPECT_EQ(bench.resets, command);
  }
}

TEST_F(TaggedCommands, CostOneHashIn50usOfATickAtMost) {
  const auto obeyed_behind = [&](int wrong, int command) {
    Frames all;
    for (int k = 0; k < wrong; ++k)
      all.push_back(in(bus::InGuardTag{.tag_id = 2, .tag_ctr = 1'000U + static_cast<std::uint32_t>(k), .tag_crc = 1}));
    for (const auto& frame : bench.tagged(reset_estimators(command), static_cast<std::uint32_t>(command)))
      all.push_back(frame);
    const int before = bench.resets;
    bench.epoch(all);
    bench.run(30);
    return bench.resets - before;
  };
  EXPECT_EQ(obeyed_behind(98, 1), 1);  // two hashes each, of the 200 of 10 ms
  EXPECT_EQ(obeyed_behind(101, 2), 0);
}

TEST_F(TaggedCommands, BearThreeTagsOfTheirCounterAndSevenCommands) {
  const auto obeyed = [&](int command, int tags, int commands) {
    const auto counter = static_cast<std::uint32_t>(command);
    const Frames right = bench.tagged(reset_estimators(command), counter);
    Frames all{right[0], right[1]};
    for (int k = 0; k < tags; ++k) all.push_back(in(bus::InGuardTag{.tag_id = 2, .tag_ctr = counter, .tag_crc = 1}));
    for (int k = 0; k < commands; ++k) all.push_back(reset_estimators(15));
    all.push_back(right[2]);
    const int before = bench.resets;
    bench.epoch(all);
    bench.run(30);
    return bench.resets - before;
  };
  EXPECT_EQ(obeyed(1, 3, 7), 1);
  EXPECT_EQ(obeyed(2, 4, 0), 0);
  EXPECT_EQ(obeyed(3, 0, 8), 0);
  EXPECT_EQ(obeyed(4, 0, 0), 1) << "the next counter is free";
}

/// Tags of 12 bits in place of 32: what SECURITY.md computes for those is 2^20 times as frequent.
TEST(Tags, AreForgedAsSeldomAsThePageComputes) {
  constexpr std::uint32_t kMask = 0xFFF;
  const param::Parameters parameters = with(param::CommandAccess::kAuthenticated);
  bus::AuthenticationBy<kMask> node(parameters);
  node.power_on();
  std::int64_t us = 0;
  std::mt19937 random(9);
  const auto tick = [&] { node.tick({us += 10'000}); };
  for (int k = 0; k < 600; ++k) node.input(reset_estimators(k % 16)), tick();
  ASSERT_NE(node.nonce(), 0U);
  bus::Counters counters;
  int openings = 0, forged = 0;
  constexpr int kGuesses = 200'000, kOwned = 20'000;
  const auto tag = [](std::uint32_t counter, std::uint32_t crc) {
    return bus::InGuardTag{.tag_id = 2, .tag_ctr = counter, .tag_crc = crc};
  };
  us = (us >> 21 << 21);  // the nonces stand still: no new turn
  for (int k = 0; k < kGuesses; ++k) {
    if (k % 64 == 0) node.tick({us});
    const bool open = node.waits_for(2);
    node.announce(tag(1 + static_cast<std::uint32_t>(k), static_cast<std::uint32_t>(random())), counters);
    openings += !open && node.waits_for(2) ? 1 : 0;
    for (int wrong = 0; wrong < 8 && node.waits_for(2); ++wrong)
      static_cast<void>(node.admits(2, reset_estimators(wrong), counters));
  }
  // One frame is held against two nonces: 2 / 2^12.
  const double expected = kGuesses * 2.0 / 4096;
  EXPECT_NEAR(openings, expected, 5 * std::sqrt(expected));
  for (int k = 0; k < kOwned; ++k) {
    node.tick({us});
    const auto counter = 1'000'000U + static_cast<std::uint32_t>(k);
    const bus::TagContext of{
        .nonce = node.nonce(), .turn = static_cast<std::uint32_t>(us >> 21), .id = 0x302, .counter = counter};
    node.announce(tag(counter, bus::tag_of(parameters.bus.key, of, {})), counters);  // the owner's, who then is silent
    ASSERT_TRUE(node.waits_for(2));
    for (int guess = 0; guess < 4; ++guess) node.announce(tag(counter, static_cast<std::uint32_t>(random())), counters);
    bool obeyed = false;
    for (int wrong = 0; wrong < 8 && node.waits_for(2); ++wrong) {
      base::CanFrame command = reset_estimators(1);
      command.data[7] = static_cast<std::uint8_t>(wrong);
      obeyed = node.admits(2, command, counters) || obeyed;
    }
    forged += obeyed ? 1 : 0;
    EXPECT_FALSE(node.waits_for(2)) << "used up";
  }
  // Eight commands against four tags: 32 / 2^12.
  const double forgeries = kOwned * 32.0 / 4096;
  EXPECT_NEAR(forged, forgeries, 5 * std::sqrt(forgeries));
}

/// Bytes of a snapshot's state, as everybody on the bus gets them.
std::vector<std::byte> published_state(const node::Node<ProtectedRobot>& node) {
  firmware::SnapshotSender<node::Node<ProtectedRobot>> sender(0x300, {10'000});
  sender.freeze(node, {}, 0);
  std::vector<std::byte> bytes;
  for (int epoch = 0; epoch < 1'000; ++epoch)
    sender.send([&bytes](const base::CanFrame& frame) {
      for (std::size_t i = 2; i < 8; ++i) bytes.push_back(std::byte{frame.data[i]});
      return true;
    });
  bytes.erase(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(sizeof(firmware::SnapshotHeader)));
  bytes.resize(sizeof(node::Node<ProtectedRobot>));
  return bytes;
}

TEST_F(TaggedCommands, GoOnBehindASnapshot) {
  const std::vector<std::byte> state = published_state(bench.node());
  const auto sender =
      std::make_unique<firmware::SnapshotSender<node::Node<ProtectedRobot>>>(0x300, base::Micros{10'000});
  ProtectedBench desk(parameters);
  const auto* const loaded = sender->load(state);
  ASSERT_NE(loaded, nullptr);
  desk.resume(bench, *loaded);
  desk.run(500), bench.run(500);
  EXPECT_EQ(desk.nonce.nonce, bench.nonce.nonce) << "two turns later";
  const Frames command = bench.tagged(reset_estimators(1), 5);
  desk.epoch(command), bench.epoch(command);
  desk.run(200), bench.run(200);
  EXPECT_EQ(bench.resets, 1);
  EXPECT_EQ(desk.resets, 1);
  EXPECT_TRUE(std::equal(desk.state.begin(), desk.state.end(), bench.state.end() - 701));
}

/// The rounds of SipHash can be turned back: whoever has a hash under way and what went into it has the key.
TEST_F(TaggedCommands, ASnapshotHasNoHashUnderWayNorTheKey) {
  const std::vector<std::byte> state = published_state(bench.node());
  const auto holds = [&state](const void* words, std::size_t size) {
    const auto* const first = static_cast<const std::byte*>(words);
    return std::search(state.begin(), state.end(), first, first + size) != state.end();
  };
  EXPECT_FALSE(holds(parameters.bus.key.data(), 8));
  EXPECT_FALSE(holds(parameters.bus.key.data() + 2, 8));
  for (std::size_t at = 0; at + 8 <= state.size(); at += 8) {  // any of them may be the chain that the hash began with
    std::array<std::uint32_t, 2> chain{};
    std::memcpy(chain.data(), state.data() + at, sizeof chain);
    base::SipHash hash(parameters.bus.key);
    for (const std::uint32_t word : chain) hash.add_word(word);
    std::array<std::uint64_t, 4> rounds{};
    static_assert(sizeof rounds <= sizeof hash);
    std::memcpy(rounds.data(), static_cast<const void*>(&hash), sizeof rounds);
    ASSERT_FALSE(holds(rounds.data(), sizeof rounds)) << "byte " << at;
  }
}

TEST_F(TaggedCommands, AreJudgedAlikeInAReplay) {
  ProtectedBench again(parameters);
  again.run(600);
  EXPECT_EQ(again.nonce.nonce, bench.nonce.nonce);
  const Frames command = bench.tagged(reset_estimators(1), 5);
  bench.epoch(command), again.epoch(command);
  bench.run(50), again.run(50);
  EXPECT_EQ(again.state, bench.state);
  EXPECT_EQ(again.resets, 1);
}

/// Frames of one tick in another order give the same nonce; any other change gives another one.
TEST_F(TaggedCommands, TheNonceDependsOnTheFramesOfATickAndNotOnTheirOrder) {
  const base::CanFrame heading = in(bus::InHeading{.stamp_us = 1, .seq = 3});
  base::CanFrame other_id = heading, other_data = heading;
  other_id.id += 1;
  other_data.data[7] ^= 1;
  const auto nonce_with = [&](const Frames& before, const Frames& after, bool tick_between) {
    ProtectedBench life(parameters);
    life.run(600);
    life.sensors = [&](const base::CanFrame& wheels) {
      Frames frames = before;
      frames.push_back(wheels);
      if (!tick_between) frames.insert(frames.end(), after.begin(), after.end());
      return frames;
    };
    life.epoch();
    life.sensors = nullptr;
    life.epoch(tick_between ? after : Frames{});
    life.run(500);
    return life.nonce.nonce;
  };
  const std::uint32_t nonce = nonce_with({heading, other_data}, {}, false);
  EXPECT_EQ(nonce, nonce_with({other_data, heading}, {}, false));
  EXPECT_EQ(nonce, nonce_with({heading}, {other_data}, false));
  EXPECT_EQ(nonce, nonce_with({}, {other_data, heading}, false));
  EXPECT_NE(nonce, nonce_with({heading, other_id}, {}, false)) << "another frame";
  EXPECT_NE(nonce, nonce_with({heading, heading}, {}, false)) << "one twice";
  EXPECT_NE(nonce, nonce_with({heading}, {other_data}, true)) << "another tick";
  EXPECT_NE(nonce, nonce_with({heading}, {}, false)) << "one less";
}

TEST(TaggedBegin, IsObeyedWhereNothingElseIs) {
  QuietBoard board;
  const param::Parameters parameters = [] {
    param::Parameters p = with(param::CommandAccess::kAuthenticated);
    p.loop.lockstep = param::Lockstep::kAuthenticated;
    return p;
  }();
  firmware::Firmware<QuietBoard, ProtectedRobot> firmware(board, parameters, bus::Version{});
  const auto run = [&](std::int64_t us, bool wheels) {
    const auto before = all<bus::EstEpoch>(board.can.sent).size();
    for (const base::Micros until = board.time + base::Micros{us}; board.time < until;
         board.time += base::Micros{250}) {
      if (wheels && board.time.us % 1'000 == 0)
        board.can.to_node.push_back(in(bus::InWheelCounts{.stamp_us = stamp(board.time.us)}));
      firmware.poll();
    }
    return all<bus::EstEpoch>(board.can.sent).size() - before;
  };
  run(5'000'000, true);
  const bus::InSync begin{.time_us = 9'000'000, .ctr = 1, .kind = bus::SyncKind::kBegin};
  const auto nonce = last<bus::EstDiagGuard>(board.can.sent);
  ASSERT_TRUE(nonce && nonce->nonce != 0);
  std::uint32_t turn = 0;  // of the epoch that had the page
  std::uint64_t time_us = 0;
  for (const base::CanFrame& frame : board.can.sent) {
    if (const auto epoch = last<bus::EstEpoch>({frame})) time_us = epoch->time_us;
    if (last<bus::EstDiagGuard>({frame})) turn = static_cast<std::uint32_t>(time_us >> 21);
  }
  const base::CanFrame frame = in(begin);
  board.can.to_node.push_back(in(bus::guard_of_sync(begin)));
  board.can.to_node.push_back(frame);
  EXPECT_GT(run(500'000, false), 45U) << "a guard is not enough";
  const bus::TagContext of{.nonce = nonce->nonce, .turn = turn, .id = 0x300, .counter = 1};
  for (const base::CanFrame& one : tagged_by(parameters.bus.key, of, frame)) board.can.to_node.push_back(one);
  EXPECT_EQ(run(500'000, false), 0U);
}

// ---- guarded samples

/// Every wheel sample with its guard, before or behind it.
struct GuardingSender {
  int counter = 0;
  bool behind = false;
  Frames operator()(const base::CanFrame& wheels) {
    bus::InGuardSample guard{.sensor = sensor::Sensor::kWheelCounts,
                             .sample_seq = static_cast<std::uint8_t>(wheels.data[2] >> 4),
                             .sample_ctr = static_cast<std::uint8_t>(counter++)};
    guard.sample_crc = bus::sample_guard_crc(guard, bus::guard_crc(bus::InWheelCounts::kOffset, wheels.data));
    return behind ? Frames{wheels, in(guard)} : Frames{in(guard), wheels};
  }
};

int way_mm(ProtectedBench& bench, int epochs) {
  const auto at = [&] { return last<bus::EstPos>(bench.run(20), 0)->x_raw; };
  bench.epoch(set_pose(1, 0, 0, 0));
  const int before = at();
  bench.run(epochs);
  return at() - before;
}

TEST(GuardedSamples, AreUsedBeforeOrBehindTheirGuardAndOnlyWithIt) {
  ProtectedBench plain(with(param::CommandAccess::kOpen, 0));
  const int expected = way_mm(plain, 400);
  ASSERT_GT(expected, 1'000);
  for (const bool behind : {false, true}) {
    ProtectedBench bench(with(param::CommandAccess::kOpen, 1));
    bench.sensors = GuardingSender{.behind = behind};
    EXPECT_EQ(way_mm(bench, 400), expected);
    EXPECT_EQ(bench.guard.guard_bad, 0);
  }
  ProtectedBench bare(with(param::CommandAccess::kOpen, 1));
  EXPECT_EQ(way_mm(bare, 400), 0);
  EXPECT_GE(bare.guard.guard_bad, 200) << "as of the last page";
  EXPECT_LE(bare.guard.guard_bad, 441);
}

TEST(GuardedSamples, DamagedOnesAreRefusedWhereverTheDamageIs) {
  ProtectedBench bench(with(param::CommandAccess::kOpen, 1));
  int damaged = 0;
  bench.sensors = [&, sender = GuardingSender{}, k = 0](const base::CanFrame& wheels) mutable {
    Frames frames = sender(wheels);
    if (++k % 4 != 0) return frames;
    ++damaged;
    const int bit = k / 4 % 112;  // of the guard 16 to 39: counter and checksum; of the sample the counts
    base::CanFrame& frame = frames[bit < 24 ? 0 : 1];
    const int at = bit < 24 ? 16 + bit : 26 + (bit - 24) % 32;
    frame.data[static_cast<std::size_t>(at / 8)] ^= static_cast<std::uint8_t>(1U << (at % 8));
    return frames;
  };
  bench.run(2'000);
  bench.run(200);
  const int late = damaged - static_cast<int>(bench.guard.guard_bad);
  EXPECT_GE(late, 0);
  EXPECT_LE(late, 60) << "since the page was sent";
}

TEST(GuardedSamples, ReplayedOnesAreRefused) {
  ProtectedBench quiet(with(param::CommandAccess::kOpen, 1)), attacked(with(param::CommandAccess::kOpen, 1));
  std::vector<Frames> seen;
  quiet.sensors = GuardingSender{};
  attacked.sensors = [&, sender = GuardingSender{}](const base::CanFrame& wheels) mutable {
    Frames frames = sender(wheels);
    seen.push_back(frames);
    if (seen.size() > 5)
      for (const base::CanFrame& frame : seen[seen.size() - 5]) frames.push_back(frame);
    return frames;
  };
  quiet.run(600), attacked.run(600);
  EXPECT_EQ(quiet.state, attacked.state);
  EXPECT_GT(attacked.guard.guard_bad, 350);
}

TEST(GuardedSamples, OfSeveralFramesAreUsedWithWhatASenderMakes) {
  // A judge that adds bit by bit: the sum over the frames, then over the guard without its checksum.
  const auto by_bits = [](std::vector<std::uint8_t> bytes) {
    unsigned crc = 0xFFFF;
    for (const unsigned byte : bytes)
      for (unsigned bit = 0x80; bit != 0; bit >>= 1) {
        const bool out = ((crc >> 15 & 1U) != 0) != ((byte & bit) != 0);
        crc = (crc << 1 & 0xFFFFU) ^ (out ? 0x1021U : 0U);
      }
    return crc;
  };
  bus::GuardSender sender;
  const Frames imu{in(bus::ImuGyro{.ang_z_rad = 0.01F, .seq = 9}), in(bus::ImuAccel{.vel_z_mps = 0.098F, .seq = 9}),
                   in(bus::ImuTime{.stamp_us = 77, .interval_us = 10'000, .seq = 9})};
  for (int k = 0; k < 3; ++k) {
    unsigned sum = 0;
    for (std::size_t i = 0; i < imu.size(); ++i) {
      const auto offset = static_cast<std::uint8_t>(imu[i].id - 0x300);
      std::vector<std::uint8_t> bytes{offset};
      bytes.insert(bytes.end(), imu[i].data.begin(), imu[i].data.end());
      sum += by_bits(bytes);
      const auto guard = sender.after(offset, imu[i]);
      ASSERT_EQ(guard.has_value(), i == 2);
      if (!guard) continue;
      EXPECT_EQ(guard->sample_ctr, k);
      const base::CanFrame frame = in(*guard);
      sum += by_bits({0x01, frame.data[0], frame.data[1], frame.data[2]});
      EXPECT_EQ(guard->sample_crc, sum & 0xFFFFU);
    }
  }
}

TEST(GuardedEntries, OfAMapNeedTheirGuard) {
  ProtectedBench bench(with(param::CommandAccess::kOpen, 1)), quiet(with(param::CommandAccess::kOpen, 1));
  bench.run(5), quiet.run(5);
  bench.epoch({map_entry(3, 1, 1)}), quiet.epoch();
  bench.run(200), quiet.run(200);
  EXPECT_EQ(bench.state, quiet.state);
  const base::CanFrame entry = map_entry(3, 1, 1);
  bus::InGuardEntry guard{.entry_id = 3, .entry_ctr = 1};
  guard.entry_crc = bus::entry_guard_crc(guard, entry);
  bench.epoch({in(guard), entry}), quiet.epoch();
  EXPECT_NE(bench.state.back(), quiet.state.back());
}

}  // namespace
}  // namespace tetap::test
