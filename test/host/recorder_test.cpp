// SPDX-License-Identifier: Apache-2.0
#include "sim_host/play/recorder.hpp"

#include "host/stand_in_node.hpp"
#include "sim_host/play/log_file.hpp"
#include "sim_host/play/session.hpp"
#include "sim_host/replay/lockstep.hpp"
#include "sim_host/replay/log.hpp"
#include "sim_host/replay/names.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <sstream>
#include <string>

namespace tetap::sim {
namespace {

using test::StandInNode;

std::string read(const std::string& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}
std::string line(const std::string& text, std::size_t number) {
  std::istringstream in(text);
  std::string got;
  for (std::size_t i = 0; i <= number; ++i)
    if (!std::getline(in, got)) return {};
  return got;
}

class Folder : public testing::Test {
 protected:
  std::string path_ = testing::TempDir() + "tetap_" + testing::UnitTest::GetInstance()->current_test_info()->name();
  void SetUp() override { std::filesystem::remove_all(path_); }
  void TearDown() override { std::filesystem::remove_all(path_); }

  int play(Script script, test::Sabotage sabotage = {}, const std::string& folder = "", std::size_t window = 8) {
    hal::MemoryBus bus;
    hal::MemoryCan end = bus.node_end();
    StandInNode node(end, 0x300, std::move(sabotage));
    MemoryLink link(bus, [&node] { node.poll(); });
    Session session({.program = "test",
                     .folder = folder.empty() ? path_ : folder,
                     .raw = true,
                     .mode = "lockstep",
                     .bus = "memory",
                     .robot = "none",
                     .log = "a \"log\"",
                     .quiet = true});
    return session.run(
        [&] { return play_lockstep(link, script, session, {.base = 0x300, .window = window}, session.counts()); });
  }
  static Script script(int ticks) {
    Script s;
    for (int i = 0; i < ticks; ++i) {
      s.add_input({.id = 0x308, .size = 8, .data = {static_cast<std::uint8_t>(i)}});
      s.add_tick({1'000'000 + i * 10'000}, i == 0 ? std::optional(base::Micros{0}) : std::nullopt);
    }
    return s;
  }
};

TEST_F(Folder, ARunLeavesItsFilesBehind) {
  EXPECT_EQ(play(script(20)), 0);
  const std::string estimates = read(path_ + "/estimates.csv");
  EXPECT_EQ(line(estimates, 0).find("epoch,time_s,estimator,kind,x_m,y_m,yaw_rad"), 0U);
  EXPECT_EQ(line(estimates, 1), "1,1.000000,0,Odometry,0.001,-0.001,0.5000,-1.250,0.0000,,,,,,,1,0,,");
  EXPECT_EQ(line(estimates, 5),
            "5,1.040000,0,Odometry,0.005,-0.005,0.5000,-1.250,0.0000,0.2500,0.5000,0.1000,-0.5000,,,1,0,,");
  EXPECT_EQ(line(estimates, 21), "");
  const std::string log = read(path_ + "/estimates.log");
  EXPECT_EQ(line(log, 0).find("(0000000001.000000) vcan0 320#40420F000000"), 0U);
  EXPECT_EQ(log.find(" 325#"), std::string::npos) << "loop times differ from run to run";
  EXPECT_EQ(log.find(" 326#"), std::string::npos);
  EXPECT_NE(read(path_ + "/raw.log").find(" 325#"), std::string::npos);
  const std::string json = read(path_ + "/run.json");
  for (const char* text : {"\"frames_in\": 20,", "\"frames_lost\": 0,", "\"estimates_out\": 20,", "\"epochs\": 20,",
                           "\"duration_s\": 0.190,", "\"log\": \"a \\\"log\\\"\","})
    EXPECT_NE(json.find(text), std::string::npos) << text << " in " << json;
  Sha256 hash;
  hash.add(log);
  EXPECT_NE(json.find("\"estimates_sha256\": \"" + hash.hex() + "\""), std::string::npos);
}

TEST_F(Folder, ANodeWithoutAMapLeavesNoTableOfOneNotEvenAnOldOne) {
  make_folder(path_);
  std::ofstream(path_ + "/map.csv") << "of an earlier run\n";
  EXPECT_EQ(play(script(20)), 0);
  for (const char* const name : {"map.csv", "keyframes.csv", "graph.csv"})
    for (const char* const end : {"", ".part"}) EXPECT_FALSE(std::filesystem::exists(path_ + "/" + name + end)) << name;
  EXPECT_TRUE(std::filesystem::exists(path_ + "/sources.csv"));
}

TEST_F(Folder, EstimatesAreTheSameBytesForEveryWindow) {
  EXPECT_EQ(play(script(100), {}, path_ + "/a", 1), 0);
  EXPECT_EQ(play(script(100), {}, path_ + "/b", 64), 0);
  EXPECT_EQ(read(path_ + "/a/estimates.log"), read(path_ + "/b/estimates.log"));
  EXPECT_EQ(read(path_ + "/a/estimates.csv"), read(path_ + "/b/estimates.csv"));
}

TEST_F(Folder, EpochsAreNumberedOnWhenTheNodeIsRestarted) {
  Script s = script(300);
  for (int i = 0; i < 3; ++i)
    s.add_tick({9'000'000 + i * 10'000}, i == 0 ? std::optional(base::Micros{8'000'000}) : std::nullopt);
  EXPECT_EQ(play(s), 0);
  const std::string estimates = read(path_ + "/estimates.csv");
  EXPECT_EQ(line(estimates, 300).find("300,3.990000,0,"), 0U) << line(estimates, 300);
  EXPECT_EQ(line(estimates, 301).find("301,9.000000,0,"), 0U) << line(estimates, 301);
  EXPECT_EQ(line(estimates, 303).find("303,9.020000,0,"), 0U) << line(estimates, 303);
}

TEST_F(Folder, TheRawLogIsARecordingOfTheRun) {
  EXPECT_EQ(play(script(100)), 0);
  LogFile log(path_ + "/raw.log", {});
  const Recording recording = *recording_of(log, "raw.log", {});
  EXPECT_EQ(recording.epochs, 100U);
  EXPECT_FALSE(recording.inputs_differ_at);
}

TEST_F(Folder, ALostFrameMakesTheRunFail) {
  EXPECT_EQ(
      play(script(100), {.into = [](std::uint64_t n, const base::CanFrame&) { return n == 51 ? 0 : 1; }, .out_of = {}}),
      1);
  EXPECT_NE(read(path_ + "/run.json").find("\"frames_lost\": 1,"), std::string::npos);
}

TEST_F(Folder, AnyBytesFromTheNodeAreWrittenWithoutHarm) {
  Recorder recorder({.folder = path_, .base = 0x300, .raw = true, .interface = "vcan0"});
  EpochCollector collector(0x300);
  std::mt19937_64 draw(6);
  for (int i = 0; i < 100'000; ++i) {
    base::CanFrame f{.id = 0x2F0 + static_cast<std::uint32_t>(draw() % 0x60),
                     .extended = draw() % 50 == 0,
                     .size = static_cast<std::uint8_t>(draw() % 10 == 0 ? draw() % 9 : 8)};
    if (draw() % 8 == 0) f.id = 0x321;
    for (std::size_t b = 0; b < 8; ++b) f.data[b] = draw() % 4 == 0 ? 0xFF : static_cast<std::uint8_t>(draw());
    recorder.received(f);
    if (const auto epoch = collector.add(f)) recorder.epoch(*epoch, {static_cast<std::int64_t>(draw() & kTimeMask)});
  }
  const auto& totals = recorder.finish();
  EXPECT_EQ(totals.frames_received, 100'000U);
  EXPECT_GT(totals.epochs, 1000U);
  std::istringstream csv(read(path_ + "/estimates.csv"));
  for (std::string row; std::getline(csv, row);) EXPECT_EQ(std::count(row.begin(), row.end(), ','), 18) << row;
  std::istringstream innovations(read(path_ + "/innovations.csv"));
  for (std::string row; std::getline(innovations, row);) EXPECT_EQ(std::count(row.begin(), row.end(), ','), 11) << row;
}

/// Frames with the identifiers of a map are the node's when its count has them, else another node's inputs.
TEST(EpochCollector, AMapBelongsToTheNodeThatCountsIt) {
  const auto epoch = [](EpochCollector& collector, std::uint8_t frames) {
    static_cast<void>(collector.add(bus::frame(0x300, bus::EstEpoch{.time_us = 5})));
    static_cast<void>(collector.add(bus::frame(0x300, bus::EstLandmark{.id = 7})));
    return *collector.add(bus::frame(0x300, bus::EstStateCrc{.frames = frames}));
  };
  EpochCollector maps(0x300), other(0x300);
  EXPECT_EQ(epoch(maps, 3).received, 3U);
  EXPECT_EQ(epoch(maps, 4).received, 3U);  // one is lost, and the map is still the node's
  const NodeEpoch without = epoch(other, 2);
  EXPECT_EQ(without.received, 2U);
  ASSERT_EQ(without.frames.size(), 2U);
  EXPECT_EQ(without.frames[1].id, 0x321U);
}

TEST(WorstCaseBits, AreThoseOfTheLiterature) {
  EXPECT_EQ(worst_case_bits({.id = 1, .size = 8}), 135U);
  EXPECT_EQ(worst_case_bits({.id = 1, .size = 0}), 55U);
  EXPECT_EQ(worst_case_bits({.id = 1, .extended = true, .size = 8}), 160U);
}

/// VAL_TABLE_ lines and the node's messages, read from the DBC.
struct Dbc {
  std::map<std::string, std::map<int, std::string>> tables;
  std::map<std::uint32_t, std::string> messages;

  Dbc() {
    std::istringstream in(read(TETAP_DBC));
    for (std::string row; std::getline(in, row);) {
      std::istringstream words(row);
      std::string kind, table, text;
      words >> kind >> table;
      if (kind == "VAL_TABLE_")
        for (int value = 0; words >> value >> text;) tables[table][value] = text.substr(1, text.size() - 2);
      if (kind == "BO_" && words >> text)
        messages[static_cast<std::uint32_t>(std::stoul(table))] = text.substr(0, text.size() - 1);
    }
  }
};

template <class Enum>
void expect_names(const std::map<int, std::string>& table) {
  ASSERT_FALSE(table.empty());
  for (int value = 0; value < 16; ++value) {
    const auto named = table.find(value);
    EXPECT_EQ(name(static_cast<Enum>(value)), named == table.end() ? "?" : named->second);
  }
}

TEST(Names, AreTheDbcs) {
  const Dbc dbc;
  expect_names<sensor::Sensor>(dbc.tables.at("Sensor"));
  expect_names<sensor::Verdict>(dbc.tables.at("Verdict"));
  expect_names<sensor::Mode>(dbc.tables.at("Mode"));
  expect_names<sensor::ResetCause>(dbc.tables.at("ResetCause"));
  expect_names<sensor::EstimatorKind>(dbc.tables.at("EstimatorKind"));
  expect_names<bus::FaultRow>(dbc.tables.at("FaultRow"));
  std::size_t checked = 0;
  for (const auto& [id, text] : dbc.messages) {
    if (id < 0x320 || id >= 0x340) continue;
    EXPECT_EQ(message_name(id - 0x300), text);
    ++checked;
  }
  EXPECT_GE(checked, 16U);
}

}  // namespace
}  // namespace tetap::sim
