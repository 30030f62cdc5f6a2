// SPDX-License-Identifier: Apache-2.0
// The replay core without the player around it. The log is made by a rover in this process, from samples of its own.
#include "host/text_replay.hpp"

#include "config/parameters/rover.hpp"
#include "config/rover.hpp"
#include "sim_host/replay/candump.hpp"
#include "sim_host/robot_of.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

namespace tetap::sim {
namespace {

using test::replay_text;
using test::TextReplay;

const Robot& rover() {
  static const Robot robot = robot_of<tetap::robot::rover::Estimators>("rover", tetap::robot::rover::parameters);
  return robot;
}

/// Three seconds of an IMU at rest, as a candump of the inputs alone.
std::string inputs() {
  std::string text;
  for (std::uint8_t i = 0; i < 250; ++i) {
    const std::int64_t us = 1'000'000 + i * 12'000;
    const auto seq = static_cast<std::uint8_t>(i & 0x0F);
    for (const base::CanFrame& frame :
         {bus::frame(0x300, bus::ImuGyro{.seq = seq}),
          bus::frame(0x300, bus::ImuAccel{.vel_z_mps = 0.117F, .seq = seq}),
          bus::frame(
              0x300,
              bus::ImuTime{.stamp_us = static_cast<std::uint32_t>(us & 0xFFFFF), .interval_us = 12'000, .seq = seq})}) {
      Line line;
      append_log_line(line, {us}, "can0", frame);
      text += line.view();
    }
  }
  return text;
}

/// The record of a run of these inputs, as the player's raw.log has it.
std::string record() {
  struct Raw {
    std::string text;
    std::int64_t us = 1'000'000;
    void note(const base::CanFrame& frame) {
      Line line;
      append_log_line(line, {us += 10}, "can0", frame);
      text += line.view();
    }
    void restarted() {}
    void sent(const base::CanFrame& frame) { note(frame); }
    void received(const base::CanFrame& frame) { note(frame); }
    void epoch(const NodeEpoch&, base::Micros) {}
  } raw;
  const std::string text = inputs();
  LogText log(text, "inputs");
  LogTicks ticks(log, {}, false);
  const param::Parameters parameters = MemoryNode::for_player(*rover().parameters, 0x300);
  MemoryNode node(rover(), parameters, {});
  Counts counts;
  EXPECT_TRUE(play_lockstep(node.link(), ticks, raw, {}, counts));
  return raw.text;
}

TEST(TextReplay, InputsAndTheRecordOfTheirRunGiveTheSameTables) {
  TextReplay played, repeated;
  replay_text(inputs(), "inputs", rover(), played);
  replay_text(record(), "record", rover(), repeated);
  EXPECT_EQ(played.failure + repeated.failure, "");
  EXPECT_EQ(played.counts.inputs, 750U);
  EXPECT_EQ(played.totals.epochs, 300U);
  EXPECT_EQ(repeated.compared, played.totals.epochs);
  EXPECT_EQ(repeated.different, 0U);
  EXPECT_EQ(played.text, repeated.text);
  EXPECT_EQ(played.totals.estimates_sha256, repeated.totals.estimates_sha256);
  // Judge of the hash: that of the text itself.
  Sha256 hash;
  hash.add(played.text[static_cast<std::size_t>(Table::kEstimatesLog)]);
  EXPECT_EQ(played.totals.estimates_sha256, hash.hex());
  for (const Table table : {Table::kEstimates, Table::kStates, Table::kStatus, Table::kSources})
    EXPECT_GT(std::ranges::count(played.text[static_cast<std::size_t>(table)], '\n'), 10);
}

TEST(TextReplay, AChangedByteOfTheRecordIsFound) {
  std::string text = record();
  Line id;
  id.put(' ').hex(0x300 + bus::EstPos::kOffset, 3).put('#');
  const std::size_t position = text.find(id.view(), text.size() / 2);
  ASSERT_NE(position, std::string::npos);
  char& digit = text[position + 6];
  digit = digit == '0' ? '1' : '0';
  TextReplay repeated;
  replay_text(text, "record", rover(), repeated);
  EXPECT_EQ(repeated.failure, "");
  EXPECT_EQ(repeated.different, 1U);
}

TEST(TextReplay, WhatCannotBePlayedIsAResult) {
  const std::string text = inputs();
  const auto failure = [](const std::string& log) {
    TextReplay out;
    replay_text(log, "a log", rover(), out);
    return out.failure;
  };
  EXPECT_EQ(failure(text + "(9.0) can0 301#1\n"), "a log:751: an odd number of data digits: '(9.0) can0 301#1'");
  const std::string whole = record();
  const std::string late = whole.substr(whole.find('\n', whole.size() / 2) + 1);
  EXPECT_EQ(
      failure(late),
      "a log: cannot be repeated exactly: it begins after the node's start: no Begin frame, its first epoch is not "
      "the node's first, and no snapshot is in it (make record asks for one)");
}

}  // namespace
}  // namespace tetap::sim
