// SPDX-License-Identifier: Apache-2.0
// The time base of wired samples, and what an image holds of their drivers.
#include "tetap/firmware/wired_inputs.hpp"

#include "hal/board/linux/memory_can.hpp"
#include "support/fakes/board.hpp"
#include "tetap/firmware/pacer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <random>

namespace tetap::firmware {
namespace {

using base::Micros;

TEST(StampOffset, jitter_of_sync_frames_moves_stamps_by_less_than_half_of_it) {
  std::mt19937 draw(3);
  StampOffset offset;
  std::int64_t least = 1'000'000, most = 0;
  for (std::int64_t now_us = 0; now_us < 20'000'000; now_us += 10'000) {
    const Micros seen{50'000 + static_cast<std::int64_t>(draw() % 1'000)};
    EXPECT_FALSE(offset.follow(seen, {now_us}));
    if (now_us < 1'000'000) continue;
    least = std::min(least, offset.used().us);
    most = std::max(most, offset.used().us);
  }
  EXPECT_GE(least, 50'000);
  EXPECT_LE(most, 51'000);
  EXPECT_LE(most - least, 500);
}

TEST(StampOffset, two_crystals_that_drift_apart_are_followed) {
  StampOffset offset;
  for (std::int64_t now_us = 0; now_us < 60'000'000; now_us += 250) {
    const Micros seen{now_us / 10'000};  // 100 ppm
    ASSERT_FALSE(offset.follow(seen, {now_us}));
    if (now_us > 1'000'000) {
      ASSERT_NEAR(static_cast<double>(offset.used().us), static_cast<double>(seen.us), 2.0);
    }
  }
}

TEST(StampOffset, a_jump_is_taken_at_once_and_reported_once) {
  StampOffset offset;
  EXPECT_FALSE(offset.follow({7'000'000}, {0})) << "the first is where time begins";
  EXPECT_EQ(offset.used().us, 7'000'000);
  for (const std::int64_t jump_us : {2'001, -2'001, 5'000'000, -9'000'000}) {
    const Micros to = offset.used() + Micros{jump_us};
    EXPECT_TRUE(offset.follow(to, {1'000}));
    EXPECT_EQ(offset.used(), to);
    EXPECT_FALSE(offset.follow(to, {1'250}));
  }
}

TEST(Pacer, its_offset_is_that_of_the_last_clock_frame) {
  Pacer pacer(Micros{10'000});
  bus::LoopHealth health;
  EXPECT_EQ(pacer.offset().us, 0);
  EXPECT_FALSE(pacer.on_sync(bus::SyncKind::kClock, {5'000'000}, {300'000}, health));
  EXPECT_EQ(pacer.offset().us, 4'700'000);
}

// A board holds only what it has and what the robot asks for.
using Full = fakes::WiredBoard<hal::MemoryCan>;
struct Bare {
  [[nodiscard]] Micros now() const { return {}; }
  hal::MemoryCan& can;
};
constexpr WiredParts kAll{.imu = true, .encoders = true, .gnss = true};
static_assert(WiredInputs<Full, kAll>::kImu && WiredInputs<Full, kAll>::kEncoders && WiredInputs<Full, kAll>::kGnss);
static_assert(!WiredInputs<Bare, kAll>::kAny && !WiredInputs<Full, WiredParts{}>::kAny);
static_assert(WiredInputs<Full, WiredParts{.encoders = true}>::kEncoders &&
              !WiredInputs<Full, WiredParts{.encoders = true}>::kGnss);
static_assert(sizeof(WiredInputs<Full, WiredParts{.encoders = true}>) < sizeof(WiredInputs<Full, kAll>) - 1'000,
              "no receiver, no buffer of its messages");

TEST(WiredParts, are_those_that_the_parameters_name) {
  param::Parameters p;
  EXPECT_FALSE(WiredParts::of(p).any());
  p.wired.gnss = 2;
  EXPECT_TRUE(WiredParts::of(p).gnss);
  EXPECT_FALSE(WiredParts::of(p).imu || WiredParts::of(p).encoders || WiredParts::of(p).lidar);
  p.wired = {.lidar = 1};
  EXPECT_TRUE(p.wired.any() && WiredParts::of(p).lidar && WiredParts::of(p).any());
}

TEST(WiredImu, takes_rate_and_axes_of_the_parameters) {
  param::WiredParameters n;
  n.imu_x = param::ChipAxis::kY;
  n.imu_y = param::ChipAxis::kMinusX;
  for (const std::int32_t hz : {25, 50, 100, 200, 500, 1'000, 2'000, 4'000, 8'000}) {
    n.imu_rate_hz = hz;
    const auto settings = WiredImu<fakes::Icm42688>::settings_of(n);
    EXPECT_TRUE(settings.valid()) << hz;
    EXPECT_EQ(settings.period_ns(), 1'000'000'000 / hz);
    EXPECT_EQ(settings.mounting.to_body({1, 2, 3}), (drivers::Vector3{2, -1, 3}));
  }
}

}  // namespace
}  // namespace tetap::firmware
