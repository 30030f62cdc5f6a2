// SPDX-License-Identifier: Apache-2.0
// Origin and range of the map as a user of the node sees them on the bus. An origin comes from fixes that confirm each
// other. A wrong one is found out. A robot beyond the range is reported.
#include "bench.hpp"
#include "earth_drive.hpp"
#include "tetap/estimators/inertial/inertial.hpp"

#include <gtest/gtest.h>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <type_traits>

namespace tetap::test {
namespace {

constexpr GeoPlace kHere{59.3, 18.07, 30}, kDateLine{-16.8, 179.99999, 10};

/// Last words of the bus.
struct Received {
  bool pos_valid = false, ever_valid = false;
  std::uint16_t faults = 0;
  sensor::Mode mode = sensor::Mode::kBoot;
  std::uint8_t resets = 0;
  sensor::ResetCause cause = sensor::ResetCause::kPowerOn;
  sensor::OriginSource origin = sensor::OriginSource::kNone;
  double origin_latitude_deg = 0, origin_longitude_deg = 0, origin_height_m = 0;
  std::int32_t x_mm = 0, y_mm = 0;
  double valid_after_s = -1;  ///< time at which the position became valid

  [[nodiscard]] bool fault(sensor::Fault word) const { return (faults >> static_cast<unsigned>(word) & 1U) != 0; }
};

/// A node with inertial navigation that is given a drive's samples.
class Robot {
 public:
  Robot(const param::Parameters& n, EarthDrive::Options o)
      : parameters_(n), drive(std::move(o)), node_(std::make_unique<Node>(parameters_, bus::Version{})) {
    node_->power_on({drive.us});
    begin_us_ = drive.us;
  }
  /// Runs so long; each fix goes through `tamper` first, which may change it.
  void run(
      double duration_s, const std::function<void(sensor::GnssPosition&)>& tamper = [](auto&) {}) {
    for (const std::int64_t end = drive.us + std::llround(duration_s * 1e6); drive.us < end;) {
      drive.step([&]<class Payload>(const Payload& payload, std::int64_t us) {
        Payload given = payload;
        if constexpr (std::is_same_v<Payload, sensor::GnssPosition>) tamper(given);
        feed(given, us);
      });
      node_->tick({drive.us}, {}, [this](const base::CanFrame& frame) { receive(frame); });
    }
  }
  Received received;

 private:
  using Node = node::Node<node::Estimators<estimators::Inertial>>;

  static void put(sensor::Sample& s, const sensor::ImuSample& p) { s.sensor = sensor::Sensor::kImu, s.payload.imu = p; }
  static void put(sensor::Sample& s, const sensor::WheelCounts& p) {
    s.sensor = sensor::Sensor::kWheelCounts, s.payload.counts = p;
  }
  static void put(sensor::Sample& s, const sensor::GnssPosition& p) {
    s.sensor = sensor::Sensor::kGnssPosition, s.payload.gnss_position = p;
  }
  static void put(sensor::Sample& s, const sensor::GnssVelocity& p) {
    s.sensor = sensor::Sensor::kGnssVelocity, s.payload.gnss_velocity = p;
  }
  static void put(sensor::Sample& s, const sensor::MagneticFlux& p) {
    s.sensor = sensor::Sensor::kMagnetometer, s.payload.magnetic = p;
  }
  static void put(sensor::Sample& s, const sensor::AirPressure& p) {
    s.sensor = sensor::Sensor::kBarometer, s.payload.pressure = p;
  }
  static void put(sensor::Sample& s, const sensor::OutsideHeading& p) {
    s.sensor = sensor::Sensor::kHeading, s.payload.heading = p;
  }
  template <class Payload>
  void feed(const Payload& payload, std::int64_t us) {
    sensor::Sample sample;
    sample.stamp = {us};
    put(sample, payload);
    node_->sample(sample);
  }
  void receive(const base::CanFrame& frame) {
    const auto is = [&]<class M>(std::type_identity<M>) -> std::optional<M> {
      if (frame.id != 0x300 + bus::offset_of<M>(0)) return {};
      return bus::decode<M>(bus::payload(frame));
    };
    if (const auto m = is(std::type_identity<bus::EstStatus>{})) {
      received.pos_valid = m->pos_valid;
      received.faults = m->faults;
      received.mode = m->mode;
      received.resets = m->reset_ctr;
      received.cause = m->reset_cause;
    }
    if (const auto m = is(std::type_identity<bus::EstMotion>{}); m && m->pos_valid) {
      if (!received.ever_valid) received.valid_after_s = 1e-6 * static_cast<double>(drive.us - begin_us_);
      received.ever_valid = true;
    }
    if (const auto m = is(std::type_identity<bus::EstPos>{})) received.x_mm = m->x_raw, received.y_mm = m->y_raw;
    if (const auto m = is(std::type_identity<bus::EstOriginLat>{}))
      received.origin = m->source, received.origin_latitude_deg = static_cast<double>(m->lat_raw) * 2e-9;
    if (const auto m = is(std::type_identity<bus::EstOriginLon>{}))
      received.origin_longitude_deg = static_cast<double>(m->lon_raw) * 2e-9;
    if (const auto m = is(std::type_identity<bus::EstOriginHeight>{}))
      received.origin_height_m = static_cast<double>(m->height_m);
  }

  param::Parameters parameters_;

 public:
  EarthDrive drive;

 private:
  std::unique_ptr<Node> node_;
  std::int64_t begin_us_ = 0;
};

param::Parameters robot() {
  param::Parameters n = kNumbers;
  n.wheels.drive.counts_per_turn = 20'000;
  n.inertial.gyro_radps_rthz = 5e-4F;
  n.inertial.accel_mps2_rthz = 1e-2F;
  n.gnss.sigma_floor_m = 0.1F;
  return n;
}
param::Parameters configured(const GeoPlace& origin, int how) {
  param::Parameters n = robot();
  n.gnss.origin_configured = how;
  n.gnss.origin_latitude_2ndeg = steps_2ndeg(origin.latitude_deg);
  n.gnss.origin_longitude_2ndeg = steps_2ndeg(origin.longitude_deg);
  n.gnss.origin_height_m = static_cast<float>(origin.height_m);
  return n;
}
EarthDrive::Options at(const GeoPlace& start) { return {.start = start, .noise = 0.2}; }
/// A place so far to the east of another.
GeoPlace east_of(const GeoPlace& place, double distance_m) {
  GeoPlace there = TangentFrame(place).geodetic({distance_m, 0, 0});
  there.height_m = place.height_m;
  return there;
}

void expect_right_at(const Robot& r, const GeoPlace& start, double off_m) {
  EXPECT_TRUE(r.received.pos_valid);
  EXPECT_EQ(r.received.mode, sensor::Mode::kNominal);
  EXPECT_EQ(r.received.origin, sensor::OriginSource::kFirstFix);
  const GeoPlace origin{r.received.origin_latitude_deg, r.received.origin_longitude_deg, r.received.origin_height_m};
  const Three apart = TangentFrame(start).enu_m(origin);
  EXPECT_LT(std::hypot(apart[0], apart[1]), off_m);
  const Three truth = r.drive.in(TangentFrame(origin)).enu_m;
  EXPECT_NEAR(r.received.x_mm * 1e-3, truth[0], 0.5);
  EXPECT_NEAR(r.received.y_mm * 1e-3, truth[1], 0.5);
  EXPECT_FALSE(r.received.fault(sensor::Fault::kOriginOutOfRange));
}

TEST(MapOrigin, is_the_first_of_fixes_that_confirm_each_other) {
  Robot r(robot(), at(kHere));
  std::optional<sensor::GnssPosition> first;
  r.run(40, [&](sensor::GnssPosition& fix) { first = first ? first : fix; });
  expect_right_at(r, kHere, 1);
  EXPECT_NEAR(r.received.origin_latitude_deg, static_cast<double>(first->latitude_2ndeg) * 2e-9, 1e-9);
  EXPECT_NEAR(r.received.origin_longitude_deg, static_cast<double>(first->longitude_2ndeg) * 2e-9, 1e-9);
  EXPECT_EQ(r.received.resets, 0);
}

TEST(MapOrigin, a_wrong_first_fix_is_none) {
  Robot r(robot(), at(kHere));
  int k = 0;
  r.run(40, [&](sensor::GnssPosition& fix) {
    if (k++ == 0) fix.latitude_2ndeg = fix.longitude_2ndeg = 0;
  });
  expect_right_at(r, kHere, 1);
  EXPECT_EQ(r.received.resets, 0);
}

TEST(MapOrigin, fixes_of_another_place_that_confirm_each_other_are_found_out) {
  for (const int wrong : {5, 6, 20, 200}) {
    SCOPED_TRACE(wrong);
    Robot r(robot(), at(kHere));
    int k = 0;
    const auto tamper = [&](sensor::GnssPosition& fix) {
      if (k++ < wrong) fix.latitude_2ndeg = fix.longitude_2ndeg = 0;
    };
    r.run(wrong * 0.2, tamper);
    EXPECT_EQ(r.received.origin_latitude_deg, 0);
    r.run(wrong < 30 ? 30 : 100, tamper);
    expect_right_at(r, kHere, 600);
    EXPECT_EQ(r.received.cause, sensor::ResetCause::kNewOrigin);
    EXPECT_EQ(r.received.resets, 1);
  }
}

TEST(MapOrigin, an_established_one_is_not_given_up_for_a_few_wrong_fixes) {
  for (const int wrong : {1, 5, 50}) {
    Robot r(robot(), at(kHere));
    r.run(40);
    const double latitude_deg = r.received.origin_latitude_deg;
    r.run(wrong * 0.2, [](sensor::GnssPosition& fix) { fix.latitude_2ndeg = fix.longitude_2ndeg = 0; });
    if (wrong != 5) {
      EXPECT_EQ(r.received.fault(sensor::Fault::kOriginOutOfRange), wrong > 5);
    }
    r.run(20);
    expect_right_at(r, kHere, 1);
    EXPECT_EQ(r.received.origin_latitude_deg, latitude_deg);
    EXPECT_EQ(r.received.resets, 0);
  }
}

TEST(MapOrigin, configured_and_out_of_range_has_a_word) {
  for (const double distance_m : {110e3, 120e3, 140e3, 300e3, 3'000e3}) {
    SCOPED_TRACE(distance_m);
    Robot r(configured(east_of(kHere, distance_m), 1), at(kHere));
    r.run(30);
    EXPECT_TRUE(r.received.fault(sensor::Fault::kOriginOutOfRange));
    EXPECT_FALSE(r.received.ever_valid);
    EXPECT_NE(r.received.mode, sensor::Mode::kNominal);
    EXPECT_EQ(r.received.origin, sensor::OriginSource::kConfigured);
    if (distance_m > 135e3) {
      EXPECT_TRUE(r.received.x_mm == 0 || r.received.x_mm == std::numeric_limits<std::int32_t>::min())
          << r.received.x_mm;
    }
  }
}

TEST(MapOrigin, configured_and_in_range_is_kept) {
  for (const int how : {1, 2})
    for (const double distance_m : {0.0, 28e3, 60e3, 100e3}) {
      SCOPED_TRACE(distance_m);
      const GeoPlace origin = east_of(kHere, distance_m);
      Robot r(configured(origin, how), at(kHere));
      r.run(40);
      EXPECT_TRUE(r.received.pos_valid);
      EXPECT_EQ(r.received.origin, sensor::OriginSource::kConfigured);
      EXPECT_EQ(r.received.faults, 0);
      const Three truth = r.drive.in(TangentFrame(origin)).enu_m;
      EXPECT_NEAR(r.received.x_mm * 1e-3, truth[0], 0.5);
      EXPECT_NEAR(r.received.y_mm * 1e-3, truth[1], 0.5);
    }
}

TEST(MapOrigin, proposed_for_another_place_gives_way_to_the_fixes) {
  for (const GeoPlace& start : {kHere, GeoPlace{-33.87, 151.2, 40}, GeoPlace{0.01, -179.9999, 0}}) {
    Robot r(configured({48.2627, 11.6683, 520}, 2), at(start));
    r.run(40);
    expect_right_at(r, start, 1);
  }
}

TEST(MapOrigin, who_drives_out_of_range_is_told_and_comes_back_without_a_reset) {
  const GeoPlace origin = east_of(kHere, 104.8e3);
  for (const int how : {1, 2}) {
    EarthDrive::Options o = at(kHere);
    o.course_rad = M_PI;  // away from the origin
    o.curve_rad = 0;
    o.fastest_mps = 30;
    o.turns_back_s = 40;
    Robot r(configured(origin, how), o);
    r.run(12);
    EXPECT_TRUE(r.received.pos_valid);
    EXPECT_EQ(r.received.faults, 0);
    r.run(25);
    EXPECT_FALSE(r.received.pos_valid);
    EXPECT_TRUE(r.received.fault(sensor::Fault::kOriginOutOfRange));
    r.run(50);
    EXPECT_TRUE(r.received.pos_valid);
    EXPECT_EQ(r.received.faults, 0);
    EXPECT_EQ(r.received.resets, 0);
    EXPECT_EQ(r.received.origin, sensor::OriginSource::kConfigured);
  }
}

TEST(MapOrigin, a_start_on_the_date_line_takes_no_longer_than_elsewhere) {
  Robot here(robot(), at(kHere)), there(robot(), at(kDateLine));
  here.run(40);
  there.run(40);
  expect_right_at(there, kDateLine, 1);
  EXPECT_NEAR(there.received.valid_after_s, here.received.valid_after_s, 0.2);
}

}  // namespace
}  // namespace tetap::test
