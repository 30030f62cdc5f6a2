// SPDX-License-Identifier: Apache-2.0
// The BMI088 over SPI, two chips in one case: accelerometer and gyroscope, each with a select line. BST-BMI088-DS001
// rev. 1.4; sections at the places. Samples are the accelerometer's, which has the sensor time. The gyroscope has a
// clock of its own and samples at 1 or 2 kHz: its newest value is taken, 0.5 ms old at most at 2 kHz.
#pragma once

#include "drivers/imu/bosch/bus.hpp"
#include "drivers/imu/bosch/driver.hpp"
#include "tetap/base/float_bits.hpp"

#include <array>
#include <cstdint>
#include <span>

namespace tetap::drivers::bmi088 {

enum class AccelRange : std::uint8_t { k3g, k6g, k12g, k24g };    // 5.3.10
using bosch::GyroRange;                                           // 5.5.5
using bosch::Rate;                                                // 5.3.9
enum class GyroFilter : std::uint8_t { k532Hz, k230Hz, k116Hz };  // 5.5.6: output 2 kHz, 2 kHz, 1 kHz

struct Settings {
  AccelRange accel_range = AccelRange::k24g;
  GyroRange gyro_range = GyroRange::k2000dps;
  Rate rate = Rate::k800Hz;
  GyroFilter filter = GyroFilter::k230Hz;
  /// Delay of the filters. The sheet has no number: a second order of bandwidth f is sqrt(2) / (2 pi f) late, which is
  /// 0.98 ms at 230 Hz.
  std::int32_t delay_us = 980;
  std::uint16_t stuck_samples = 200;  ///< one axis with the same value so often in a row is a fault; 0: never
  Mounting mounting{};
};

/// 5.3.7: 11 bits, 0.125 K each, 0 at 23 degC; 0x80 in the first register: none.
[[nodiscard]] constexpr float temperature_degC(std::uint8_t high, std::uint8_t low) {
  if (high == 0x80) return base::kNan;
  const std::int32_t eighths = high * 8 + low / 32;
  return 23.0F + 0.125F * static_cast<float>(eighths > 1023 ? eighths - 2048 : eighths);
}

template <hal::SpiDevice Accel, hal::SpiDevice Gyro>
class Chip {
 public:
  constexpr Chip(Accel& accel, Gyro& gyro, const Settings& settings) : accel_(accel), gyro_(gyro), settings_(settings) {
    using bosch::Kind;
    const auto byte = [](auto value) { return static_cast<std::uint8_t>(value); };
    constexpr std::uint8_t kNormalFilter = 0xA0;
    actions_ = {{
        {Kind::kTouch, kAccel, 0x00, 0, 0, 1'000},        // 6.1.2: the rising edge of its select line selects SPI
        {Kind::kWrite, kAccel, 0x7E, 0xFF, 0xB6, 2'000},  // 5.3.21: reset, 1 ms
        {Kind::kTouch, kAccel, 0x00, 0, 0, 1'000},
        {Kind::kExpect, kAccel, 0x00, 0xFF, 0x1E},        // 5.3.1
        {Kind::kWrite, kGyro, 0x14, 0xFF, 0xB6, 30'000},  // 5.5.8: reset, 30 ms
        {Kind::kExpect, kGyro, 0x00, 0xFF, 0x0F},         // 5.5.1
        {Kind::kKeep, kAccel, 0x7C, 0xFF, 0x00, 1'000},   // 5.3.19: active
        {Kind::kKeep, kAccel, 0x7D, 0xFF, 0x04, 50'000},  // 5.3.20: on
        {Kind::kKeep, kAccel, 0x6D, 0xFF, 0x00},          // 5.3.18: no self-test
        {Kind::kKeep, kAccel, 0x40, 0xFF, byte(kNormalFilter | byte(settings.rate))},
        {Kind::kKeep, kAccel, 0x41, 0x03, byte(settings.accel_range)},
        {Kind::kKeep, kGyro, 0x11, 0xFF, 0x00, 30'000},  // 5.5.7: normal mode
        {Kind::kKeep, kGyro, 0x0F, 0xFF, byte(settings.gyro_range)},
        {Kind::kKeep, kGyro, 0x10, 0x0F, byte(settings.filter), 50'000},  // bit 7 is 1 in every answer
    }};
  }

  [[nodiscard]] constexpr bool valid() const {
    return bosch::offered(settings_) && settings_.filter <= GyroFilter::k116Hz;
  }
  [[nodiscard]] constexpr bosch::StreamSettings stream() const { return bosch::stream_settings(3, settings_); }
  [[nodiscard]] constexpr std::span<const bosch::Action> actions() const { return actions_; }

  [[nodiscard]] constexpr bool read(std::uint8_t target, std::uint8_t address, std::span<std::uint8_t> in) {
    return target == kGyro ? gyro_.read(address, in) : accel_.read(address, in);
  }
  [[nodiscard]] constexpr bool write(std::uint8_t target, std::span<const std::uint8_t> out) {
    return target == kGyro ? gyro_.write(out) : accel_.write(out);
  }

  /// 5.3.4 to 5.3.7: x, y, z, sensor time, and the temperature at 0x22; 5.5.2: x, y, z.
  [[nodiscard]] constexpr bool sample(bosch::Raw& raw) {
    std::array<std::uint8_t, 18> a{};
    std::array<std::uint8_t, 6> g{};
    if (!accel_.read(0x12, a) || !gyro_.read(0x02, g)) return false;
    raw.accel = bosch::words(a);
    raw.gyro = bosch::words(g);
    raw.sensor_time = bosch::counter(std::span(a).subspan(6));
    raw.temperature_degC = temperature_degC(a[16], a[17]);
    return true;
  }

  [[nodiscard]] static constexpr bool upload() { return true; }
  [[nodiscard]] static constexpr bool uploaded() { return true; }
  static constexpr void learn(std::uint8_t) {}

 private:
  static constexpr std::uint8_t kAccel = 0, kGyro = 1;

  bosch::Bus<Accel, 1> accel_;
  bosch::Bus<Gyro, 0> gyro_;
  Settings settings_;
  std::array<bosch::Action, 14> actions_{};
};

template <hal::SpiDevice Accel, hal::SpiDevice Gyro>
using Driver = bosch::Driver<Chip<Accel, Gyro>>;

}  // namespace tetap::drivers::bmi088
