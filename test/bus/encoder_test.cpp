// SPDX-License-Identifier: Apache-2.0
// Whatever is encoded is decoded as the same sample: values, stamp, sequence and instance.
#include "tetap/bus/encoder.hpp"
#include "node/bench.hpp"

#include <gtest/gtest.h>
#include <vector>

namespace tetap::test {
namespace {

struct Samples {
  std::vector<sensor::Sample> all;
  void sample(const sensor::Sample& s) { all.push_back(s); }
  void map_entry(const estimators::MapEntry&) {}
  void set_pose(const estimators::SetPose&) {}
  void reset(bus::ResetWhat) {}
};

/// The only sample that comes of the value's frames, sent at 10 s with sequence 21 (5 of 4 bits), in either order.
template <class Value>
sensor::Sample decoded(const Value& value, std::uint8_t instance, std::size_t frames, bool backwards = false) {
  std::vector<base::CanFrame> sent;
  bus::encode_sample(
      value, bus::SampleHead::of({10'000'123}, 21, instance),
      [&sent](const auto& message, std::size_t of = 0) { sent.push_back(bus::frame(0x300, message, of)); });
  EXPECT_EQ(sent.size(), frames);
  bus::Decoder decoder;
  bus::Counters counters;
  Samples out;
  for (std::size_t i = 0; i < sent.size(); ++i) {
    const base::CanFrame& frame = sent[backwards ? sent.size() - 1 - i : i];
    decoder.on_frame(static_cast<std::uint8_t>(frame.id - 0x300), frame, {10'000'000}, counters, out);
  }
  EXPECT_EQ(out.all.size(), 1U);
  if (out.all.size() != 1) return {};
  EXPECT_EQ(out.all[0].stamp.us, 10'000'123);
  EXPECT_EQ(out.all[0].sequence, 5);
  EXPECT_EQ(out.all[0].instance, instance);
  return out.all[0];
}

TEST(Encoder, AnImuSampleComesBackToTheLastStepOfTheBus) {
  const sensor::ImuSample v{.dangle_b_rad = {1e-3F, -2e-3F, 3e-6F},
                            .dvelocity_b_mps = {0.01F, -0.02F, 0.0981F},
                            .temperature_degC = 31.5F,
                            .interval_us = 2'500,
                            .clipped_gyro = 3,
                            .clipped_accel = 1};
  for (const bool backwards : {false, true}) {
    const sensor::ImuSample got = decoded(v, 2, 3, backwards).payload.imu;
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_NEAR(got.dangle_b_rad[i], v.dangle_b_rad[i], 0.51e-6F);
      EXPECT_NEAR(got.dvelocity_b_mps[i], v.dvelocity_b_mps[i], 0.51e-5F);
    }
    EXPECT_EQ(got.interval_us, 2'500);
    EXPECT_EQ(got.clipped_gyro, 3);
    EXPECT_EQ(got.clipped_accel, 1);
    EXPECT_NEAR(got.temperature_degC, 31.5F, 0.5F);
  }
}

TEST(Encoder, WheelsAndSpeedsComeBack) {
  const auto counts = decoded(sensor::WheelCounts{.left = 65'535, .right = 1}, 0, 1).payload.counts;
  EXPECT_EQ(counts.left, 65'535);
  EXPECT_EQ(counts.right, 1);
  const auto speeds = decoded(sensor::WheelSpeeds{.left_mps = -1.25F, .right_mps = 2.5F}, 1, 1).payload.wheel_speeds;
  EXPECT_NEAR(speeds.left_mps, -1.25F, 1e-3F);
  EXPECT_NEAR(speeds.right_mps, 2.5F, 1e-3F);
  const auto body =
      decoded(sensor::BodySpeed{.forward_mps = 3.0F, .yaw_rate_radps = base::kNan}, 0, 1).payload.body_speed;
  EXPECT_NEAR(body.forward_mps, 3.0F, 1e-3F);
  EXPECT_TRUE(base::is_nan(body.yaw_rate_radps));
}

TEST(Encoder, AFixComesBackWholeAndItsAnglesToTheLastDigit) {
  const sensor::GnssPosition v{.latitude_2ndeg = 21'187'906'001,
                               .longitude_2ndeg = -35'573'697'333,
                               .height_m = -12.5F,
                               .horizontal_acc_m = 0.8F,
                               .vertical_acc_m = base::kNan,
                               .fix = sensor::GnssFix::kRtkFloat,
                               .satellites = 14};
  for (const bool backwards : {false, true}) {
    const sensor::GnssPosition got = decoded(v, 1, 4, backwards).payload.gnss_position;
    EXPECT_EQ(got.latitude_2ndeg, v.latitude_2ndeg);
    EXPECT_EQ(got.longitude_2ndeg, v.longitude_2ndeg);
    EXPECT_NEAR(got.height_m, v.height_m, 1e-2F);
    EXPECT_NEAR(got.horizontal_acc_m, 0.8F, 2e-3F);
    EXPECT_TRUE(base::is_nan(got.vertical_acc_m));
    EXPECT_EQ(got.fix, v.fix);
    EXPECT_EQ(got.satellites, 14);
  }
}

TEST(Encoder, AVelocityWithoutClimbComesBackWithoutOne) {
  const auto got = decoded(sensor::GnssVelocity{.v_n_mps = {1.5F, -0.5F, base::kNan}, .acc_mps = 0.2F}, 0, 2, true);
  EXPECT_NEAR(got.payload.gnss_velocity.v_n_mps[0], 1.5F, 1e-3F);
  EXPECT_NEAR(got.payload.gnss_velocity.v_n_mps[1], -0.5F, 1e-3F);
  EXPECT_TRUE(base::is_nan(got.payload.gnss_velocity.v_n_mps[2]));
  EXPECT_NEAR(got.payload.gnss_velocity.acc_mps, 0.2F, 2e-3F);
}

TEST(Encoder, SightingsFieldPressureAndHeadingComeBack) {
  const auto seen = decoded(sensor::LandmarkSighting{.landmark = 7, .range_m = 4.2F, .bearing_rad = -0.3F}, 0, 1);
  EXPECT_EQ(seen.payload.sighting.landmark, 7);
  EXPECT_NEAR(seen.payload.sighting.range_m, 4.2F, 2e-3F);
  EXPECT_NEAR(seen.payload.sighting.bearing_rad, -0.3F, 1e-3F);
  EXPECT_TRUE(base::is_nan(seen.payload.sighting.range_rate_mps));
  const auto target = decoded(
      sensor::LandmarkSighting{.landmark = 0xFF, .range_m = 42, .bearing_rad = 0.5F, .range_rate_mps = -7.5F}, 1, 1);
  EXPECT_EQ(target.sensor, sensor::Sensor::kRangeBearing);
  EXPECT_EQ(target.instance, 1);
  EXPECT_EQ(target.payload.sighting.landmark, 0xFF);
  EXPECT_NEAR(target.payload.sighting.range_m, 42.0F, 5.1e-3F);
  EXPECT_NEAR(target.payload.sighting.bearing_rad, 0.5F, 8.1e-4F);
  EXPECT_NEAR(target.payload.sighting.range_rate_mps, -7.5F, 2.1e-2F);
  const auto flux = decoded(sensor::MagneticFlux{.flux_b_uT = {20.0F, -1.0F, -43.0F}}, 0, 1);
  EXPECT_NEAR(flux.payload.magnetic.flux_b_uT[2], -43.0F, 0.02F);
  const auto air = decoded(sensor::AirPressure{.pressure_Pa = 95'123.0F, .temperature_degC = 20.0F}, 0, 1);
  EXPECT_NEAR(air.payload.pressure.pressure_Pa, 95'123.0F, 0.5F);
  const auto heading = decoded(sensor::OutsideHeading{.yaw_rad = 1.0F, .acc_rad = 0.01F}, 3, 1);
  EXPECT_NEAR(heading.payload.heading.yaw_rad, 1.0F, 5e-5F);
  EXPECT_NEAR(heading.payload.heading.acc_rad, 0.01F, 2e-4F);
}

}  // namespace
}  // namespace tetap::test
