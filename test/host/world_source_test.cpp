// SPDX-License-Identifier: Apache-2.0
// The world as it is played with: steps, frames, faults on a button, and rows of truth that wait on disk.
#include "sim_host/world_source.hpp"

#include "sim_host/play/spool.hpp"
#include "sim_host/world/floor_plan.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

namespace tetap::sim {
namespace {

using Frames = std::vector<base::CanFrame>;

WorldSource source(std::vector<FaultSetting> faults = {}) {
  World::Options options;
  options.faults = std::move(faults);
  options.parameters.magnetometer.rate_hz = 20;
  return {World(options, 5), 0x300, base::Micros{10'000}, base::Micros{60'000'000}};
}

void append(Frames& all, std::span<const base::CanFrame> more) { all.insert(all.end(), more.begin(), more.end()); }

bool same(const Truth& a, const Truth& b) { return std::memcmp(&a, &b, sizeof a) == 0; }

TEST(WorldSource, StepsOfAnyLengthGiveTheFramesOfTicks) {
  WorldSource ticked = source(), stepped = source();
  Frames of_ticks, of_steps;
  Tick tick;
  for (int i = 0; i < 2'000; ++i) {
    ASSERT_TRUE(ticked.next(tick));
    append(of_ticks, tick.inputs);
    for (const std::int64_t ms : {1, 7, 2}) {
      stepped.step(ms);
      append(of_steps, stepped.frames());
    }
    ASSERT_TRUE(same(ticked.truth(), stepped.truth())) << i;
  }
  EXPECT_GT(of_ticks.size(), 2'000U * 4);
  EXPECT_EQ(of_ticks, of_steps);
}

/// 27 seconds, with what `on_a_straight` does after 20.
template <class OnAStraight>
Frames drive(WorldSource world, OnAStraight&& on_a_straight) {
  Frames frames;
  for (int i = 0; i < 2'700; ++i) {
    if (i == 2'000) on_a_straight(world);
    world.step(10);
    append(frames, world.frames());
  }
  return frames;
}

TEST(WorldSource, AnInjectedFaultIsTheSameRunAgainAsASetting) {
  const auto nothing = [](WorldSource&) {};
  const Frames calm = drive(source(), nothing);
  for (const FaultInfo& fault : fault_table()) {
    std::string text;
    const Frames played = drive(source(), [&](WorldSource& world) {
      text = text_of(world.inject(fault.fault, base::Micros{fault.duration_s > 0 ? 3'000'000 : 0}));
    });
    const FaultsParsed parsed = parse_faults(text);
    ASSERT_EQ(parsed.error, "") << text;
    EXPECT_EQ(drive(source(parsed.settings), nothing), played) << text;
    // Too late, or not yet, for these: they last longer than the drive, or need sensors that it has not.
    const bool lacks = fault.falls_on == FallsOn::kLandmarks || fault.falls_on == FallsOn::kLidar ||
                       fault.falls_on == FallsOn::kFeatures;
    const bool acts = !lacks && fault.fault != Fault::kGnssFar;
    if (acts) {
      EXPECT_NE(played, calm) << text;
    }
  }
}

TEST(WorldSource, SightingsAreTakenOnce) {
  WorldSource world = source(), kept = source();
  std::size_t taken = 0;
  for (int i = 0; i < 1'000; ++i) {
    world.step(10), kept.step(10);
    taken += world.take_sightings().size();
  }
  EXPECT_GT(taken, 50U);
  EXPECT_EQ(taken, kept.world().sightings().size());
  EXPECT_TRUE(world.world().sightings().empty());
}

/// Bits `from` to `from + length` of a frame, from the least one up.
std::int64_t bits(const base::CanFrame& frame, int from, int length, bool with_sign = false) {
  std::uint64_t word = 0;
  for (std::size_t i = 0; i < 8; ++i) word |= std::uint64_t{frame.data[i]} << (8 * i);
  word = word << (64 - from - length);
  return with_sign ? static_cast<std::int64_t>(word) >> (64 - length)
                   : static_cast<std::int64_t>(word >> (64 - length));
}

TEST(WorldSource, ScansAndImagesTravelInTheBitsOfTheirFrames) {
  World::Options options;
  options.course = lab_course(1);
  options.parameters.lidar.rate_hz = options.parameters.features.rate_hz = 10;
  WorldSource played{World(options, 5), 0x300, base::Micros{10'000}, base::Micros{60'000'000}, false};
  World seen{options, 5};
  std::vector<Measurement> all;
  Frames frames;
  for (int i = 1; i <= 300; ++i) {
    played.step(10);
    for (const base::CanFrame& f : played.frames())
      if (f.id == 0x34B || f.id == 0x34C || f.id == 0x34D || f.id == 0x34F) frames.push_back(f);
    seen.advance_to(seen.start() + base::Micros{10'000 * i}, all);
  }
  std::erase_if(all, [](const Measurement& m) {
    return !(std::holds_alternative<ScanHead>(m.value) || std::holds_alternative<ScanBlock>(m.value) ||
             std::holds_alternative<ImageFeature>(m.value) || std::holds_alternative<ImageEnd>(m.value));
  });
  ASSERT_EQ(frames.size(), all.size());
  ASSERT_GT(frames.size(), 3'000U);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const base::CanFrame& f = frames[i];
    const Measurement& m = all[i];
    if (const auto* scan = std::get_if<ScanBlock>(&m.value)) {
      ASSERT_EQ(f.id, 0x34BU);
      ASSERT_EQ(bits(f, 0, 4), m.sequence % 16);
      ASSERT_EQ(bits(f, 4, 8), scan->block);
      for (int k = 0; k < 4; ++k) ASSERT_EQ(bits(f, 12 + 13 * k, 13), scan->ranges[static_cast<std::size_t>(k)]);
      continue;
    }
    ASSERT_EQ(bits(f, 0, 20), m.stamp.us % (1 << 20));
    ASSERT_EQ(bits(f, 20, 4), m.sequence % 16);
    ASSERT_EQ(bits(f, 24, 2), 0);
    if (const auto* head = std::get_if<ScanHead>(&m.value)) {
      ASSERT_EQ(f.id, 0x34CU);
      ASSERT_EQ(bits(f, 26, 10), head->count);
      ASSERT_EQ(bits(f, 36, 14, true), head->first);
      ASSERT_EQ(bits(f, 50, 14, true), head->step);
    } else if (const auto* feature = std::get_if<ImageFeature>(&m.value)) {
      ASSERT_EQ(f.id, 0x34FU);
      ASSERT_EQ(bits(f, 26, 12), feature->track);
      ASSERT_EQ(bits(f, 38, 13), feature->u);
      ASSERT_EQ(bits(f, 51, 13), feature->v);
    } else {
      const ImageEnd& end = std::get<ImageEnd>(m.value);
      ASSERT_EQ(f.id, 0x34DU);
      ASSERT_EQ(bits(f, 26, 8), end.count);
      ASSERT_EQ(bits(f, 34, 12), end.exposure_10us);
      ASSERT_EQ(bits(f, 46, 3), 1);
    }
  }
}

TEST(Spool, RowsComeBackAndLeaveNoFile) {
  const auto folder = std::filesystem::temp_directory_path() / ("tetap-spool-" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  Spool<Truth> spool(folder.string());
  for (int i = 0; i < 100'000; ++i) spool.add({.time = {i}, .x_m = 0.1 * i});
  EXPECT_TRUE(std::filesystem::is_empty(folder));
  std::int64_t rows = 0;
  spool.each([&rows](const Truth& row) {
    ASSERT_EQ(row.time.us, rows);
    ASSERT_EQ(row.x_m, 0.1 * static_cast<double>(rows));
    ++rows;
  });
  EXPECT_EQ(rows, 100'000);
  std::filesystem::remove_all(folder);
  EXPECT_THROW(Spool<Truth>{folder.string()}, std::runtime_error) << "no folder";
}

}  // namespace
}  // namespace tetap::sim
