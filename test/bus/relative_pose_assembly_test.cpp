// SPDX-License-Identifier: Apache-2.0
// Displacements between stamps put together from their frames: values, lost and foreign frames, what is none.
#include "tetap/bus/relative_pose_assembly.hpp"
#include "support/relative_frames.hpp"
#include "tetap/sensor/plausibility.hpp"

#include <gtest/gtest.h>

namespace tetap::bus {
namespace {

struct Taken {
  std::vector<sensor::Sample> samples;
  void sample(const sensor::Sample& sample) { samples.push_back(sample); }
};
struct Relatives : testing::Test {
  void send(const std::vector<base::CanFrame>& frames) {
    for (const auto& frame : frames) {
      const auto offset = static_cast<std::uint8_t>(frame.id - 0x300);
      assembly.on_frame(offset, frame, frame_crc(offset, frame), {now_us}, counters, taken);
    }
  }
  std::vector<base::CanFrame> whole(const test::Relative& r = {}, int seq = 3) const {
    return test::relative_frames(now_us - 120'000, now_us - 20'000, seq, r);
  }
  bool plausible(const test::Relative& r) {
    taken.samples.clear();
    send(whole(r));
    return taken.samples.size() == 1 && sensor::plausible(taken.samples[0], 10);
  }
  RelativePoseAssembly assembly;
  Counters counters;
  Taken taken;
  std::int64_t now_us = 5'000'000;
};

TEST_F(Relatives, ADisplacementIsWhatItsFramesHold) {
  send(whole({.x_m = 0.5F,
              .y_m = -0.25F,
              .yaw_rad = 0.1F,
              .sigma_x_m = 0.02F,
              .sigma_y_m = 0.03F,
              .sigma_yaw_rad = 0.004F,
              .corr_xy = 0.5F,
              .corr_x_yaw = -0.25F,
              .corr_y_yaw = 0.125F}));
  ASSERT_EQ(taken.samples.size(), 1U);
  const sensor::Sample& sample = taken.samples[0];
  EXPECT_EQ(sample.stamp.us, now_us - 20'000);
  EXPECT_EQ(sample.sensor, sensor::Sensor::kRelativePose);
  EXPECT_EQ(sample.sequence, 3);
  const sensor::RelativePose& r = sample.payload.relative;
  EXPECT_EQ(r.interval_us, 100'000U);
  EXPECT_NEAR(r.x_m, 0.5F, 1e-6F);
  EXPECT_NEAR(r.y_m, -0.25F, 1e-6F);
  EXPECT_NEAR(r.yaw_rad, 0.1F, 1e-6F);
  const std::array sigma{0.02F, 0.03F, 0.004F}, correlation{0.5F, -0.25F, 0.125F};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(r.sigma_of(i), sigma[i], 1e-6F) << i;
    EXPECT_NEAR(r.correlation_of(i), correlation[i], 1e-6F) << i;
    EXPECT_FALSE(r.unknown(i)) << i;
  }
  EXPECT_TRUE(sensor::plausible(sample));
}

TEST_F(Relatives, AnAxisWithoutASigmaIsFree) {
  send(whole({.x_m = base::kNan, .sigma_x_m = base::kNan}));
  ASSERT_EQ(taken.samples.size(), 1U);
  EXPECT_TRUE(taken.samples[0].payload.relative.unknown(0));
  EXPECT_FALSE(taken.samples[0].payload.relative.unknown(1));
  EXPECT_TRUE(sensor::plausible(taken.samples[0]));
}

TEST_F(Relatives, ALostDoubledOrForeignFrameEndsItAndIsCounted) {
  for (int kind = 0; kind < 4; ++kind) {
    auto frames = whole();
    if (kind == 0) frames.erase(frames.begin() + 1);
    if (kind == 1) frames.insert(frames.begin() + 1, frames[1]), frames.insert(frames.begin() + 1, frames[2]);
    if (kind == 2) frames[2] = whole({}, 4)[2];
    if (kind == 3) frames.pop_back();
    send(frames);
    assembly.expire({now_us + 100'001}, {100'000}, counters);
    EXPECT_TRUE(taken.samples.empty()) << kind;
    EXPECT_GE(counters.incomplete, kind + 1) << kind;
  }
  send(whole());
  EXPECT_EQ(taken.samples.size(), 1U) << "the next one is none the worse";
}

TEST_F(Relatives, WhatNoRobotCanDoAndNoCovarianceAreRefused) {
  EXPECT_TRUE(plausible({.x_m = 0.9F}));
  EXPECT_FALSE(plausible({.x_m = 1.1F})) << "in 0.1 s, of a robot of 10 m/s";
  EXPECT_FALSE(plausible({.y_m = -1.1F}));
  EXPECT_FALSE(plausible({.sigma_y_m = 0})) << "certain";
  EXPECT_TRUE(plausible({.corr_xy = 0.9F, .corr_x_yaw = 0.9F, .corr_y_yaw = 0.9F}));
  EXPECT_FALSE(plausible({.corr_xy = 0.9F, .corr_x_yaw = 0.9F, .corr_y_yaw = -0.9F})) << "not positive definite";
  const auto before = counters.out_of_range;
  EXPECT_FALSE(plausible({.x_m = base::kNan}));
  EXPECT_FALSE(plausible({.yaw_rad = base::kNan}));
  EXPECT_FALSE(plausible({.sigma_yaw_rad = base::kNan}));
  EXPECT_EQ(counters.out_of_range, before + 3);
  taken.samples.clear();
  send(test::relative_frames(now_us, now_us, 1, {}));
  EXPECT_TRUE(taken.samples.empty()) << "no interval";
}

}  // namespace
}  // namespace tetap::bus
