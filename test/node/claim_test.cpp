// SPDX-License-Identifier: Apache-2.0
// The first key of a node over its bus: who may give it and until when, and what intruders do before and behind it.
#include "node/bench.hpp"
#include "node/queued_can.hpp"
#include "tetap/firmware/firmware.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <string_view>

namespace tetap::test {
namespace {

using bus::ParamAnswer;
using Planar = node::Estimators<estimators::Odometry, estimators::PoseEkf>;
using Claimable = node::WithBusParameters<node::WithBusProtection<Planar>>;
constexpr base::SipKey kKey{0xA3020100U, 0xB7060504U, 0xCB0A0908U, 0xDF0E0D0CU};
constexpr std::uint32_t kName = param::StagedParameters::kName;

struct ClaimBoard {
  QueuedCan can;
  base::Micros time{1'000'000};
  [[nodiscard]] base::Micros now() const { return time; }
};

std::uint16_t index_of(std::string_view path) { return param::row_of(path)->index; }

template <class Robot = Claimable>
struct ClaimBench {
  explicit ClaimBench(const param::Parameters& p = kNumbers) : parameters(p) {
    firmware = std::make_unique<firmware::Firmware<ClaimBoard, Robot>>(board, parameters, bus::Version{});
    run(100'000);
  }
  void run(std::int64_t us) {
    for (const base::Micros until = board.time + base::Micros{us}; board.time < until; board.time += base::Micros{500})
      firmware->poll();
  }
  template <class Message>
  [[nodiscard]] base::CanFrame command(Message message) {
    message.ctr = counter = (counter + 1) & 0xF;
    return in(bus::protect(message));
  }
  ParamAnswer answer_to(const Frames& frames) {
    const std::size_t before = board.can.sent.size();
    for (const base::CanFrame& frame : frames) board.can.to_node.push_back(frame);
    run(30'000);
    const Frames sent(board.can.sent.begin() + static_cast<std::ptrdiff_t>(before), board.can.sent.end());
    for (const auto& row : all<bus::EstParamRow>(sent))
      if (row.row_ctr == counter) return row.row_answer;
    for (const auto& set : all<bus::EstParamSet>(sent))
      if (set.set_ctr == counter) return set.set_answer;
    return ParamAnswer::kBusy;
  }
  template <class Message>
  ParamAnswer ask(const Message& message) {
    return answer_to({command(message)});
  }
  ParamAnswer set_word(std::size_t word, std::uint32_t value) {
    return ask(bus::CmdParamSet{
        .set_word = static_cast<std::uint8_t>(word), .set_row_id = index_of("bus.key"), .set_value = value});
  }
  void stage_key(ParamAnswer expected = ParamAnswer::kDone, const base::SipKey& key = kKey) {
    for (std::size_t word = 0; word < 4; ++word) EXPECT_EQ(set_word(word, key[word]), expected) << word;
  }
  [[nodiscard]] static bus::CmdParamApply naming(const param::Parameters& before, const param::Parameters& after) {
    return {.apply_before_crc = param::crc(before) & kName, .apply_after_crc = param::crc(after) & kName};
  }
  [[nodiscard]] param::Parameters owned() const {
    param::Parameters p = parameters;
    p.bus.commands = param::CommandAccess::kAuthenticated;
    return p;
  }
  ParamAnswer claim(const base::SipKey& key = kKey) {
    stage_key(ParamAnswer::kDone, key);
    return ask(naming(parameters, owned()));
  }
  /// The command with both tags before it, once the node has a nonce.
  template <class Message>
  Frames tagged(const Message& message, const base::SipKey& key = kKey) {
    for (int k = 0; k < 300; ++k) {
      board.can.to_node.push_back(command(bus::CmdParamGet{.get_row_id = index_of("can_base")}));
      if (k % 4 == 3) run(50'000);
    }
    const std::size_t begin = board.can.sent.size();
    run(1'100'000);
    bus::TagContext of;
    std::uint64_t epoch_us = 0;
    for (std::size_t i = begin; i < board.can.sent.size(); ++i) {
      const Frames one{board.can.sent[i]};
      if (const auto epoch = last<bus::EstEpoch>(one)) epoch_us = epoch->time_us;
      if (const auto guard = last<bus::EstDiagGuard>(one))
        of.nonce = guard->nonce, of.turn = static_cast<std::uint32_t>(epoch_us >> 21);
    }
    EXPECT_NE(of.nonce, 0U);
    const base::CanFrame frame = command(message);
    of.id = frame.id, of.counter = ++tag_counter;
    const auto tag = [&](std::span<const std::uint8_t> covered) {
      return in(bus::InGuardTag{.tag_id = 6, .tag_ctr = tag_counter, .tag_crc = bus::tag_of(key, of, covered)});
    };
    return {tag({}), tag(frame.data), frame};
  }
  ParamAnswer tagged_apply(const base::SipKey& key = kKey) { return answer_to(tagged(naming(owned(), owned()), key)); }
  [[nodiscard]] int refused() {
    run(3'000'000);
    return last<bus::EstDiagRefused>(board.can.sent)->cmd_refused;
  }

  ClaimBoard board;
  param::Parameters parameters;
  std::unique_ptr<firmware::Firmware<ClaimBoard, Robot>> firmware;
  std::uint8_t counter = 0;
  std::uint32_t tag_counter = 0;
};

TEST(Claim, GivesANodeItsFirstKeyAndNobodyAnother) {
  ClaimBench bench;
  EXPECT_EQ(bench.claim(), ParamAnswer::kDone);
  EXPECT_EQ(bench.ask(bench.naming(bench.owned(), bench.owned())), ParamAnswer::kRefused) << "without a tag";
  EXPECT_EQ(bench.tagged_apply(), ParamAnswer::kDone);
  bench.stage_key(ParamAnswer::kRefused, {1, 2, 3, 4});
  for (const char* path : {"bus.commands", "bus.guard", "can_base", "loop.lockstep"})
    EXPECT_EQ(bench.ask(bus::CmdParamSet{.set_row_id = index_of(path)}), ParamAnswer::kRefused) << path;
  EXPECT_EQ(bench.tagged_apply({1, 2, 3, 4}), ParamAnswer::kRefused);
  EXPECT_EQ(bench.tagged_apply(), ParamAnswer::kDone);
  EXPECT_EQ(bench.refused(), 8) << "writes of access, each counted";
  // A read is an error, and no frame of the node has a word of the key.
  for (const bus::ParamSource source : {bus::ParamSource::kActive, bus::ParamSource::kStaged})
    for (std::uint8_t word = 0; word < 4; ++word)
      EXPECT_EQ(bench.ask(bus::CmdParamGet{.get_word = word, .get_row_id = index_of("bus.key"), .get_source = source}),
                ParamAnswer::kUnknown);
  for (const base::CanFrame& frame : bench.board.can.sent)
    for (std::size_t at = 0; at <= 4; ++at)
      for (const std::uint32_t word : kKey) EXPECT_NE(std::memcmp(&frame.data[at], &word, 4), 0) << frame.id;
}

TEST(Claim, IsOverAMinuteBehindPowerOn) {
  ClaimBench late;
  late.run(59'000'000);
  EXPECT_EQ(late.set_word(0, kKey[0]), ParamAnswer::kDone);
  late.run(1'000'000);
  EXPECT_EQ(late.set_word(1, kKey[1]), ParamAnswer::kRefused);
  EXPECT_EQ(late.ask(late.naming(late.parameters, late.owned())), ParamAnswer::kOtherStaged) << "half a key is gone";
  EXPECT_EQ(late.ask(late.naming(late.parameters, late.parameters)), ParamAnswer::kDone) << "and nothing hinders";
}

TEST(Claim, IsOverWhereAnotherSenderHasBegunTheNode) {
  for (const auto policy : {param::Lockstep::kGuarded, param::Lockstep::kPlain}) {
    param::Parameters p = kNumbers;
    p.loop.lockstep = policy;
    ClaimBench bench(p);
    const bus::InSync begin{.time_us = 1'200'000, .ctr = 1, .kind = bus::SyncKind::kBegin};
    bench.board.can.to_node.push_back(in(bus::guard_of_sync(begin)));
    bench.board.can.to_node.push_back(in(begin));
    bench.run(3'000'000);  // the lockstep has ended
    // A desk's node repeats the log of a robot that was claimed.
    const bool desk = policy == param::Lockstep::kPlain;
    EXPECT_EQ(bench.set_word(0, 1), desk ? ParamAnswer::kDone : ParamAnswer::kRefused);
  }
}

TEST(Claim, NeedsANodeThatJudgesTagsAndHasNoKey) {
  ClaimBench<node::WithBusProtection<node::WithBusParameters<Planar>>> no_tags;
  no_tags.stage_key(ParamAnswer::kRefused);
  param::Parameters p = kNumbers;
  p.bus.key = {0, 0, 0, 9};
  ClaimBench has_one(p);
  has_one.stage_key(ParamAnswer::kRefused);
  ClaimBench zero;
  EXPECT_EQ(zero.claim({}), ParamAnswer::kNotTogether);
  EXPECT_EQ(zero.claim(), ParamAnswer::kDone);
}

TEST(Claim, StandsAgainstRestoreAndBegin) {
  ClaimBench bench;
  ASSERT_EQ(bench.claim(), ParamAnswer::kDone);
  const bus::CmdParamRestore restore{.restore_before_crc = param::crc(bench.owned()) & kName};
  EXPECT_EQ(bench.ask(restore), ParamAnswer::kRefused);
  EXPECT_EQ(bench.answer_to(bench.tagged(restore)), ParamAnswer::kDone);
  EXPECT_EQ(bench.tagged_apply(), ParamAnswer::kDone);
  // A Begin with a guard alone was obeyed before the claim.
  const bus::InSync begin{.time_us = 9'000'000, .ctr = 1, .kind = bus::SyncKind::kBegin};
  bench.board.can.to_node.push_back(in(bus::guard_of_sync(begin)));
  bench.board.can.to_node.push_back(in(begin));
  bench.run(3'000'000);
  EXPECT_EQ(last<bus::EstDiagLimits>(bench.board.can.sent)->lock_refused, 1);
  EXPECT_EQ(bench.tagged_apply(), ParamAnswer::kDone);
}

TEST(Claim, ForeignRowsAndReplaysMakeAnApplyFail) {
  ClaimBench bench;
  ASSERT_EQ(bench.claim(), ParamAnswer::kDone);
  const std::uint16_t gate = index_of("landmark.gate_scale");
  const auto stage = [&](float value) {
    bus::CmdParamSet set{.set_row_id = gate};
    std::memcpy(&set.set_value, &value, 4);
    EXPECT_EQ(bench.ask(set), ParamAnswer::kDone);
  };
  param::Parameters wanted = bench.owned();
  wanted.landmark.gate_scale = 2;
  stage(2);
  const Frames apply = bench.tagged(bench.naming(bench.owned(), wanted));
  const std::uint8_t counter = bench.counter;
  stage(3);  // an intruder's
  bench.counter = counter;
  EXPECT_EQ(bench.answer_to(apply), ParamAnswer::kOtherStaged);
  stage(2);
  bench.counter = counter;
  EXPECT_EQ(bench.answer_to(apply), ParamAnswer::kRefused) << "replayed";
  bench.run(3'000'000);
  EXPECT_GE(last<bus::EstDiagGuard>(bench.board.can.sent)->replayed, 1);
  EXPECT_EQ(last<bus::EstParamSet>(bench.board.can.sent)->set_config, param::crc(bench.owned())) << "nothing changed";
  EXPECT_EQ(bench.answer_to(bench.tagged(bench.naming(bench.owned(), wanted))), ParamAnswer::kDone);
}

TEST(Claim, OfTwoAtOnceIsNobodys) {
  ClaimBench bench;
  bench.stage_key();
  EXPECT_EQ(bench.set_word(2, 77), ParamAnswer::kDone);  // another one's
  EXPECT_EQ(bench.ask(bench.naming(bench.parameters, bench.owned())), ParamAnswer::kDone);
  EXPECT_EQ(bench.tagged_apply(), ParamAnswer::kRefused) << "the tag proves that the key is another one";
}

TEST(Claim, RowsThatAreNotAsCompiledAreNamedAgainAndAgain) {
  ClaimBench bench;
  ASSERT_EQ(bench.claim(), ParamAnswer::kDone);
  bench.run(1'000'000);
  bench.board.can.sent.clear();
  bench.run(31'000'000);
  int commands = 0;
  const auto rows = all<bus::EstParamRow>(bench.board.can.sent);
  for (const auto& row : rows) commands += row.row_id == index_of("bus.commands") && row.row_value == 1;
  EXPECT_GE(commands, 2);
  EXPECT_LE(rows.size(), 8U) << "two rows each ten seconds";
  ClaimBench plain;
  plain.run(31'000'000);
  EXPECT_TRUE(all<bus::EstParamRow>(plain.board.can.sent).empty());
}

}  // namespace
}  // namespace tetap::test
