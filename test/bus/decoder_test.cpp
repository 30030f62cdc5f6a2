// SPDX-License-Identifier: Apache-2.0
#include "node/bench.hpp"
#include "tetap/bus/fault_hold.hpp"

#include <gtest/gtest.h>
#include <cmath>
#include <vector>

namespace tetap::test {
namespace {

struct Collected {
  std::vector<sensor::Sample> samples;
  std::vector<estimators::MapEntry> entries;
  std::vector<estimators::SetPose> poses;
  std::vector<bus::ResetWhat> resets;
  void sample(const sensor::Sample& s) { samples.push_back(s); }
  void map_entry(const estimators::MapEntry& e) { entries.push_back(e); }
  void set_pose(const estimators::SetPose& p) { poses.push_back(p); }
  void reset(bus::ResetWhat w) { resets.push_back(w); }
};

struct Desk {
  bus::Decoder inbox;
  bus::Counters counters;
  Collected out;
  void put(const base::CanFrame& frame, std::int64_t reference_us = 10'000'000) {
    inbox.on_frame(static_cast<std::uint8_t>(frame.id - 0x300), frame, {reference_us}, counters, out);
  }
};

TEST(Decoder, ExtendsTwentyBitStampsAroundTheReference) {
  for (const std::int64_t truth : {9'600'000LL, 9'999'999LL, 10'000'000LL, 10'400'000LL}) {
    Desk desk;
    desk.put(body_speed(truth, 1.0F, 0.0F));
    ASSERT_EQ(desk.out.samples.size(), 1U);
    EXPECT_EQ(desk.out.samples[0].stamp.us, truth);
  }
}

TEST(Decoder, PutsAFixTogetherFromFourFramesInAnyOrder) {
  const auto s = stamp(9'990'000);
  const Frames frames{
      in(bus::InGnssLat{.stamp_us = s, .seq = 4, .inst = 1, .lat_raw = 21'187'906'000}),
      in(bus::InGnssLon{.stamp_us = s, .seq = 4, .inst = 1, .lon_raw = -35'573'697'333}),
      in(bus::InGnssAlt{
          .stamp_us = s, .seq = 4, .inst = 1, .height_m = 7.3F, .fix = bus::GnssFix::kFix3D, .num_sv = 9}),
      in(bus::InGnssAcc{.stamp_us = s, .seq = 4, .inst = 1, .hor_m = 0.9F, .ver_m = 1.8F})};
  for (const auto& order : {std::vector{0, 1, 2, 3}, std::vector{3, 1, 0, 2}}) {
    Desk desk;
    for (const int i : order) desk.put(frames[static_cast<std::size_t>(i)]);
    ASSERT_EQ(desk.out.samples.size(), 1U);
    const auto& fix = desk.out.samples[0].payload.gnss_position;
    EXPECT_EQ(fix.latitude_2ndeg, 21'187'906'000);
    EXPECT_EQ(fix.longitude_2ndeg, -35'573'697'333);
    EXPECT_NEAR(fix.height_m, 7.3F, 1e-3F);
    EXPECT_NEAR(fix.horizontal_acc_m, 0.9F, 1e-3F);
    EXPECT_EQ(fix.fix, sensor::GnssFix::k3d);
    EXPECT_EQ(desk.out.samples[0].instance, 1);
    EXPECT_EQ(desk.out.samples[0].stamp.us, 9'990'000);
  }
}

TEST(Decoder, FramesOfTwoFixesUnderOneSequenceNumberAreNeverMixed) {
  Desk desk;
  const auto part = [](std::int64_t t, int which) -> base::CanFrame {
    if (which == 0) return in(bus::InGnssLat{.stamp_us = stamp(t), .seq = 4, .lat_raw = t});
    if (which == 1) return in(bus::InGnssLon{.stamp_us = stamp(t), .seq = 4, .lon_raw = t});
    if (which == 2) return in(bus::InGnssAlt{.stamp_us = stamp(t), .seq = 4});
    return in(bus::InGnssAcc{.stamp_us = stamp(t), .seq = 4});
  };
  desk.put(part(9'800'000, 0));
  desk.put(part(9'800'000, 1));
  for (int which = 0; which < 4; ++which) desk.put(part(9'990'000, which));
  ASSERT_EQ(desk.out.samples.size(), 1U);
  EXPECT_EQ(desk.out.samples[0].payload.gnss_position.latitude_2ndeg, 9'990'000);
  EXPECT_EQ(desk.out.samples[0].payload.gnss_position.longitude_2ndeg, 9'990'000);
  EXPECT_EQ(desk.counters.incomplete, 1);
}

TEST(Decoder, RangeOnlyAndBearingOnlyPassAndNeitherIsRefused) {
  const float none = std::numeric_limits<float>::quiet_NaN();
  Desk desk;
  desk.put(sighting(10'000'000, 1, 2.0F, none));
  desk.put(sighting(10'000'000, 2, none, 0.5F));
  desk.put(sighting(10'000'000, 3, none, none));
  ASSERT_EQ(desk.out.samples.size(), 2U);
  EXPECT_FALSE(base::is_finite(desk.out.samples[0].payload.sighting.bearing_rad));
  EXPECT_FALSE(base::is_finite(desk.out.samples[1].payload.sighting.range_m));
  EXPECT_EQ(desk.counters.out_of_range, 1);
}

TEST(Decoder, SetPoseNeedsBothHalvesOfOneCounter) {
  Desk desk;
  desk.put(set_pose(1, 1000, 2000, 0.5F)[0]);
  desk.put(set_pose(2, 3000, 4000, 0.7F)[1]);
  EXPECT_TRUE(desk.out.poses.empty());
  desk.put(set_pose(2, 3000, 4000, 0.7F)[0]);
  ASSERT_EQ(desk.out.poses.size(), 1U);
  EXPECT_EQ(desk.out.poses[0].pose.x.um(), 3'000'000);
  EXPECT_NEAR(desk.out.poses[0].pose.yaw_rad, 0.7F, 5e-5F);
}

TEST(Decoder, AnImuSampleCarriesIncrementsIntervalAndClips) {
  Desk desk;
  desk.put(in(bus::ImuGyro{.ang_x_rad = 0.001F, .ang_y_rad = -0.002F, .ang_z_rad = 0.003F, .seq = 9}, 2));
  desk.put(in(bus::ImuAccel{.vel_x_mps = 0.1F, .vel_y_mps = 0.2F, .vel_z_mps = 0.0981F, .seq = 9}, 2));
  desk.put(in(bus::ImuTime{.stamp_us = stamp(9'999'000),
                           .interval_us = 5'000,
                           .clip_gyro = 3,
                           .clip_accel = 1,
                           .temp_degC = 30.5F,
                           .seq = 9},
              2));
  ASSERT_EQ(desk.out.samples.size(), 1U);
  const auto& s = desk.out.samples[0];
  EXPECT_EQ(s.instance, 2);
  EXPECT_EQ(s.payload.imu.interval_us, 5'000);
  EXPECT_NEAR(s.payload.imu.dangle_b_rad[1], -0.002F, 1e-6F);
  EXPECT_NEAR(s.payload.imu.dvelocity_b_mps[2], 0.0981F, 1e-5F);
  EXPECT_EQ(s.payload.imu.clipped_gyro, 3);
  EXPECT_NEAR(s.payload.imu.temperature_degC, 30.5F, 0.05F);
}

TEST(Decoder, AnImuSampleOverNoTimeIsMalformedAndLeavesNoHalf) {
  Desk desk;
  for (std::uint8_t seq = 0; seq < 40; ++seq) {
    const auto interval = static_cast<std::uint16_t>(seq == 20 ? 5'000 : 0);
    desk.put(in(bus::ImuGyro{.ang_x_rad = 0.001F, .seq = seq}, 0));
    desk.put(in(bus::ImuAccel{.vel_z_mps = 0.1F, .seq = seq}, 0));
    desk.put(in(bus::ImuTime{.stamp_us = stamp(9'999'000), .interval_us = interval, .seq = seq}, 0));
  }
  EXPECT_EQ(desk.out.samples.size(), 1U);
  EXPECT_EQ(desk.counters.out_of_range, 39);
  EXPECT_EQ(desk.counters.incomplete + desk.counters.duplicate, 0);
  bus::FaultHold faults;
  faults.note(desk.counters, 1, 10);
  EXPECT_EQ(faults.faults(1).bits, 1U << static_cast<unsigned>(sensor::Fault::kMalformed)) << "and no other word";
}

TEST(Decoder, AHeadingFromOutsideIsOneSampleWithOrWithoutItsAccuracy) {
  const float none = std::numeric_limits<float>::quiet_NaN();
  Desk desk;
  desk.put(
      in(bus::InHeading{.stamp_us = stamp(9'990'000), .seq = 11, .inst = 2, .angle_rad = -2.9F, .acc_rad = 0.02F}));
  desk.put(in(bus::InHeading{.stamp_us = stamp(9'995'000), .seq = 12, .inst = 2, .angle_rad = 1.5F, .acc_rad = none}));
  desk.put(in(bus::InHeading{.stamp_us = stamp(9'999'000), .seq = 13, .inst = 2, .angle_rad = none, .acc_rad = 0.02F}));
  ASSERT_EQ(desk.out.samples.size(), 2U) << "no angle is no heading";
  EXPECT_EQ(desk.counters.out_of_range, 1);
  const auto& first = desk.out.samples[0];
  EXPECT_EQ(first.sensor, sensor::Sensor::kHeading);
  EXPECT_EQ(first.instance, 2);
  EXPECT_EQ(first.sequence, 11);
  EXPECT_EQ(first.stamp.us, 9'990'000);
  EXPECT_NEAR(first.payload.heading.yaw_rad, -2.9F, 3e-5F);
  EXPECT_NEAR(first.payload.heading.acc_rad, 0.02F, 1.1e-4F);
  const auto& second = desk.out.samples[1];
  EXPECT_EQ(second.stamp.us, 9'995'000);
  EXPECT_NEAR(second.payload.heading.yaw_rad, 1.5F, 3e-5F);
  EXPECT_TRUE(std::isnan(second.payload.heading.acc_rad)) << "not available is not exact";
}

// The sequence comes round in 16 samples: a frame that waits for a lost one must not meet the frames of a later sample.
TEST(Decoder, ALostImuFrameCostsOneSampleAndShiftsNone) {
  for (const std::int64_t period_us : {10'000, 5'000, 2'500})
    for (const int lost : {0, 1, 2}) {
      Desk desk;
      for (int k = 0; k < 60; ++k) {
        const std::int64_t t = 10'000'000 + k * period_us;
        const std::int64_t tick = t / 10'000 * 10'000;
        const auto seq = static_cast<std::uint8_t>(k % 16);
        const float angle_rad = 1e-4F * static_cast<float>(k);
        if (k != 5 || lost != 0) desk.put(in(bus::ImuGyro{.ang_z_rad = angle_rad, .seq = seq}, 0), tick);
        if (k != 5 || lost != 1) desk.put(in(bus::ImuAccel{.vel_x_mps = 10 * angle_rad, .seq = seq}, 0), tick);
        if (k != 5 || lost != 2)
          desk.put(in(bus::ImuTime{.stamp_us = stamp(t), .interval_us = 2'500, .seq = seq}, 0), tick);
      }
      ASSERT_EQ(desk.out.samples.size(), 59U) << period_us << " " << lost;
      EXPECT_EQ(desk.counters.incomplete, 1) << period_us << " " << lost;
      for (const sensor::Sample& s : desk.out.samples) {
        const float expected_rad = 1e-4F * static_cast<float>((s.stamp.us - 10'000'000) / period_us);
        ASSERT_NEAR(s.payload.imu.dangle_b_rad[2], expected_rad, 1e-6F) << period_us << " " << lost;
        ASSERT_NEAR(s.payload.imu.dvelocity_b_mps[0], 10 * expected_rad, 1e-5F) << period_us << " " << lost;
      }
    }
}

}  // namespace
}  // namespace tetap::test
