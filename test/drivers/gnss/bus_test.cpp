// SPDX-License-Identifier: Apache-2.0
// From the receiver's bytes over the bus to the filter's input. The place is kept to the last unit. The heading of two
// antennas becomes that of the body, however their line lies on the robot.
#include "drivers/gnss/gnss_bytes.hpp"
#include "node/bench.hpp"
#include "tetap/bus/encoder.hpp"
#include "tetap/estimators/inertial/sources/outside_heading.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <vector>

namespace tetap::drivers::gnss {
namespace {

/// The one sample that the bus makes of a value.
template <class Value>
sensor::Sample over_the_bus(const Value& value) {
  struct {
    std::vector<sensor::Sample> all;
    void sample(const sensor::Sample& s) { all.push_back(s); }
    void map_entry(const estimators::MapEntry&) {}
    void set_pose(const estimators::SetPose&) {}
    void reset(bus::ResetWhat) {}
  } out;
  bus::Decoder decoder;
  bus::Counters counters;
  bus::encode_sample(value, bus::SampleHead::of({10'000'000}, 1, 0), [&](const auto& message, std::size_t of = 0) {
    const base::CanFrame frame = bus::frame(0x300, message, of);
    decoder.on_frame(static_cast<std::uint8_t>(frame.id - 0x300), frame, {10'000'000}, counters, out);
  });
  EXPECT_EQ(out.all.size(), 1U);
  return out.all.empty() ? sensor::Sample{} : out.all[0];
}

TEST(GnssOverTheBus, AHighPrecisionPlaceArrivesWithinATenthOfAMillimetreAndItsHeightWithinOne) {
  Bytes hp(36, 0);
  put(hp, 4, 100'000, 4), put(hp, 8, -1'213'142'468, 4), put(hp, 12, 440'690'105, 4), put(hp, 16, 1'125'900, 4);
  put(hp, 24, -37, 1), put(hp, 25, 45, 1), put(hp, 26, -3, 1), put(hp, 28, 142, 4), put(hp, 32, 101, 4);
  const auto position = position_of(only(ubx_frame(1, 7, pvt()) + ubx_frame(1, 0x14, hp)));
  ASSERT_TRUE(position.has_value());
  const sensor::GnssPosition got = over_the_bus(*position).payload.gnss_position;
  constexpr double kMetresPerDegree = 111'132.0;
  EXPECT_NEAR((static_cast<double>(got.latitude_2ndeg) * 2e-9 - 44.069010545) * kMetresPerDegree, 0, 1.2e-4);
  EXPECT_NEAR((static_cast<double>(got.longitude_2ndeg) * 2e-9 + 121.314246837) * kMetresPerDegree, 0, 1.2e-4);
  EXPECT_NEAR(static_cast<double>(got.height_m), 1125.8997, 1.1e-3);
  EXPECT_NEAR(static_cast<double>(got.horizontal_acc_m), 0.0142, 2.6e-3);
}

/// NAV-RELPOSNED of a line (east, north).
Bytes line(double east_m, double north_m) {
  Bytes p(64, 0);
  const double course_deg = std::atan2(east_m, north_m) * 180 / M_PI;
  put(p, 0, 1, 1), put(p, 4, 100'000, 4);
  put(p, 8, std::llround(north_m * 100), 4), put(p, 12, std::llround(east_m * 100), 4);
  put(p, 20, std::llround(std::hypot(east_m, north_m) * 100), 4);
  put(p, 24, std::llround((course_deg < 0 ? course_deg + 360 : course_deg) * 1e5), 4);
  put(p, 52, 57'296, 4), put(p, 60, 0x137, 4);  // 0.01 rad
  return p;
}

TEST(GnssOverTheBus, TheHeadingOfTwoAntennasIsThatOfTheBodyWhereverTheyAreMounted) {
  const std::vector<std::array<float, 3>> mountings{
      {1, 0, 0}, {-0.8F, 0, 0}, {0, 0.6F, 0}, {0, -1.2F, 0.1F}, {0.5F, 0.5F, 0}};
  for (const auto& baseline_b_m : mountings) {
    for (int deg = -170; deg <= 180; deg += 25) {
      const double yaw = deg * M_PI / 180;
      const double east =
          std::cos(yaw) * static_cast<double>(baseline_b_m[0]) - std::sin(yaw) * static_cast<double>(baseline_b_m[1]);
      const double north =
          std::sin(yaw) * static_cast<double>(baseline_b_m[0]) + std::cos(yaw) * static_cast<double>(baseline_b_m[1]);
      const Received received = receive(ubx_frame(1, 0x3C, line(east, north)));
      ASSERT_EQ(received.baselines.size(), 1U);
      const auto heading = heading_of(received.baselines[0]);
      ASSERT_TRUE(heading.has_value());
      const sensor::OutsideHeading got = over_the_bus(*heading).payload.heading;
      EXPECT_NEAR(static_cast<double>(got.acc_rad), 0.01, 3e-4);
      param::GnssParameters parameters;
      parameters.baseline_b_m = baseline_b_m;
      const float body = estimators::OutsideHeadingSource::body_yaw_rad(got, nav::Quaternion{}, parameters);
      EXPECT_NEAR(std::remainder(static_cast<double>(body) - yaw, 2 * M_PI), 0, 2e-4) << deg;
    }
  }
}

}  // namespace
}  // namespace tetap::drivers::gnss
