// SPDX-License-Identifier: Apache-2.0
// libFuzzer: bytes become samples of every sensor with fields of any value. They come late, early and out of order,
// between those of a robot that drives on. The node has inertial navigation, the attitude filter and odometry.
// Plausible samples go in. No estimator may leave the numbers for it, and the node answers the same a second time.
#include "config/rover.hpp"
#include "tetap/bus/frame_sink.hpp"
#include "tetap/estimators/attitude.hpp"
#include "tetap/estimators/inertial/inertial.hpp"
#include "tetap/estimators/odometry.hpp"
#include "tetap/sensor/plausibility.hpp"

#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <span>

namespace tetap {
namespace {

using Node = node::Node<node::Estimators<estimators::Odometry, estimators::Attitude, estimators::Inertial>>;
using sensor::Sensor;

constexpr param::Parameters kNumbers = [] {
  param::Parameters n = robot::rover::parameters;
  n.magnetic.use = n.baro.use = 1;
  n.inertial.level_s = 0.1F;  // a short input has to get somewhere
  n.gnss.antenna_x_b_m = 0.3F;
  n.gnss.antenna_z_b_m = 0.8F;
  return n;
}();

[[noreturn]] void fail(const char* what, std::size_t record) {
  std::fprintf(stderr, "fuzz_samples: %s, in record %zu\n", what, record);
  std::abort();
}

// ---- input: records of twelve bytes (the writer is test/fuzz/seeds) -------------------------------------------------
//   0  low nibble: a sensor; 10: so many ticks (byte 1); 11: set pose; 12: reset (byte 1); 13: a tick of any time
//      (bytes 2, 3: signed milliseconds after the last)
//   1  of a sample: which field (low nibble) gets which value of kValues (high nibble; 15: none)
//   2, 3  when the sample was true, signed, in 10 us from now
//   4 .. 11  four signed numbers, each times the field's scale
constexpr std::size_t kRecord = 12;
constexpr int kMostTicks = 120;
constexpr std::array<float, 15> kValues{base::kNan,
                                        base::kInfinity,
                                        -base::kInfinity,
                                        0.0F,
                                        -0.0F,
                                        std::numeric_limits<float>::max(),
                                        -std::numeric_limits<float>::max(),
                                        std::numeric_limits<float>::denorm_min(),
                                        19.9F,
                                        199.0F,
                                        -199.0F,
                                        499.0F,
                                        -499.0F,
                                        1e5F,
                                        1e6F};

class Run {
 public:
  explicit Run(Node& node) : node_(node) { node_.power_on(now_); }

  std::uint32_t over(std::span<const std::uint8_t> bytes) {
    for (std::size_t at = 0; at + kRecord <= bytes.size() && ticks_ < kMostTicks; at += kRecord, ++record_) {
      const std::uint8_t* b = &bytes[at];
      const int kind = b[0] & 0x0F;
      if (kind < 10) {
        sample(static_cast<Sensor>(kind), b);
      } else if (kind == 11) {
        node_.set_pose({.pose = {.x = base::Anchored{}.plus(10.0F * number(b, 0)), .yaw_rad = 1e-4F * number(b, 1)},
                        .sigma_position_m = 1e-2F * base::abs(number(b, 2)),
                        .sigma_yaw_rad = 2e-4F * base::abs(number(b, 3)),
                        .counter = b[1]});
      } else if (kind == 12) {
        node_.reset(static_cast<bus::ResetWhat>(b[1] % 3));
      } else if (kind == 13) {
        now_ += base::Micros{1000 * std::int64_t{word(b, 2)}};
        tick();
      } else {
        for (int i = b[1] % 16; i >= 0; --i) drive_on();
      }
    }
    for (int i = 0; i < 25; ++i) drive_on();  // what was taken leaves the window
    return hash_.value();
  }

 private:
  [[nodiscard]] static std::int16_t word(const std::uint8_t* b, std::size_t at) {
    return static_cast<std::int16_t>(b[at] | b[at + 1] << 8);
  }
  [[nodiscard]] static float number(const std::uint8_t* b, std::size_t i) {
    return static_cast<float>(word(b, 4 + 2 * i));
  }

  void sample(Sensor sensor, const std::uint8_t* b) {
    sensor::Sample s;
    s.stamp = now_ + base::Micros{10 * std::int64_t{word(b, 2)}};
    s.sensor = sensor;
    s.instance = static_cast<std::uint8_t>(b[0] >> 6);
    s.sequence = static_cast<std::uint8_t>(record_ & 15);
    const std::array<float, 4> x{number(b, 0), number(b, 1), number(b, 2), number(b, 3)};
    const auto value = [&](std::size_t field, float scale) {
      const std::size_t which = b[1] >> 4;
      return which < kValues.size() && (b[1] & 0x0F) == field ? kValues[which] : scale * x[field % 4];
    };
    auto& p = s.payload;
    switch (sensor) {
      case Sensor::kImu:
        p.imu = {.dangle_b_rad = {value(0, 1e-5F), value(1, 1e-5F), value(2, 1e-5F)},
                 .dvelocity_b_mps = {value(3, 1e-4F), value(4, 1e-4F), 0.0981F + value(5, 1e-4F)},
                 .interval_us = static_cast<std::uint16_t>(b[0] & 0x20 ? word(b, 10) : 10'000),
                 .clipped_accel = static_cast<std::uint8_t>(b[0] >> 4 & 1)};
        break;
      case Sensor::kWheelCounts:
        p.counts = {.left = static_cast<std::uint16_t>(word(b, 4)), .right = static_cast<std::uint16_t>(word(b, 6))};
        break;
      case Sensor::kWheelSpeed:
        p.wheel_speeds = {.left_mps = value(0, 1e-3F), .right_mps = value(1, 1e-3F)};
        break;
      case Sensor::kBodySpeed:
        p.body_speed = {.forward_mps = value(0, 1e-3F), .yaw_rate_radps = value(1, 1e-3F)};
        break;
      case Sensor::kGnssPosition:
        p.gnss_position = {.latitude_2ndeg = kNumbers.gnss.origin_latitude_2ndeg +
                                             std::int64_t{word(b, 4)} * (b[0] & 0x20 ? 1'000'000 : 100),
                           .longitude_2ndeg = kNumbers.gnss.origin_longitude_2ndeg +
                                              std::int64_t{word(b, 6)} * (b[0] & 0x20 ? 2'000'000 : 100),
                           .height_m = 520.0F + value(2, 0.1F),
                           .horizontal_acc_m = base::abs(value(3, 0.01F)),
                           .vertical_acc_m = base::abs(value(4, 0.01F)),
                           .fix = sensor::GnssFix::k3d};
        break;
      case Sensor::kGnssVelocity:
        p.gnss_velocity = {.v_n_mps = {value(0, 1e-2F), value(1, 1e-2F), value(2, 1e-2F)},
                           .acc_mps = base::abs(value(3, 1e-3F))};
        break;
      case Sensor::kRangeBearing:
        p.sighting = {.landmark = 1, .range_m = base::abs(value(0, 0.1F)), .bearing_rad = value(1, 1e-4F)};
        if ((b[0] & 0x20) != 0) p.sighting.range_rate_mps = value(2, 1e-3F);
        break;
      case Sensor::kMagnetometer:
        p.magnetic = {.flux_b_uT = {value(0, 0.01F), value(1, 0.01F), value(2, 0.01F)}};
        break;
      case Sensor::kBarometer:
        p.pressure = {.pressure_Pa = 95'000.0F + value(0, 3.0F), .temperature_degC = value(1, 0.01F)};
        break;
      case Sensor::kHeading:
        p.heading = {.yaw_rad = value(0, 1e-4F), .acc_rad = base::abs(value(1, 1e-4F))};
        break;
      case Sensor::kClosure:  // this robot takes none
      case Sensor::kFeature:
      case Sensor::kScan:
      case Sensor::kRelativePose:  // likewise
      case Sensor::kNotAvailable:
        return;
    }
    if (sensor::plausible(s)) node_.sample(s);
  }
  /// Ten milliseconds of a good IMU and good wheels.
  void drive_on() {
    now_ += base::Micros{10'000};
    sensor::Sample imu;
    imu.stamp = now_ - base::Micros{1'000};
    imu.sensor = Sensor::kImu;
    imu.payload.imu = {.dangle_b_rad = {0, 0, 0.001F}, .dvelocity_b_mps = {0, 0.01F, 0.0981F}, .interval_us = 10'000};
    node_.sample(imu);
    counts_ = static_cast<std::uint16_t>(counts_ + 32);
    sensor::Sample wheels;
    wheels.stamp = now_ - base::Micros{2'000};
    wheels.sensor = Sensor::kWheelCounts;
    wheels.payload.counts = {.left = counts_, .right = counts_};
    node_.sample(wheels);
    tick();
  }
  void tick() {
    ++ticks_;
    node_.tick(now_, {}, [this](const base::CanFrame& frame) {
      hash_(frame);
      if (frame.id != kNumbers.can_base + bus::EstStatus::kOffset) return;
      const auto status = bus::decode<bus::EstStatus>(bus::payload(frame));
      if (!status) fail("a status that does not decode", record_);
      if (status->reset_cause == sensor::ResetCause::kNotFinite) fail("the state was not finite", record_);
      if (status->reset_cause == sensor::ResetCause::kNotPositive) fail("a covariance was none", record_);
    });
  }

  Node& node_;
  bus::FrameHash hash_{kNumbers.can_base};
  base::Micros now_{1'000'000};
  std::uint16_t counts_ = 0;
  std::size_t record_ = 0;
  int ticks_ = 0;
};

}  // namespace
}  // namespace tetap

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tetap;
  static Node node(kNumbers, bus::Version{});
  const std::uint32_t first = Run(node).over({data, size});
  const bool again = size % 4 == 0;
  if (again && Run(node).over({data, size}) != first) fail("another answer the second time", size / kRecord);
  return 0;
}
