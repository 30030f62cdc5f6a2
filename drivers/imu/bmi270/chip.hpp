// SPDX-License-Identifier: Apache-2.0
// The BMI270 over SPI. BST-BMI270-DS000 rev. 1.3; sections at the places. It measures nothing before it has Bosch's
// configuration file, which is not part of this repository: `bmi270_config_file`, 8 192 bytes in bmi270.c of
// github.com/boschsensortec/BMI270_SensorAPI, BSD-3-Clause. The caller gives it and keeps it alive.
#pragma once

#include "drivers/imu/bosch/bus.hpp"
#include "drivers/imu/bosch/driver.hpp"
#include "tetap/base/float_bits.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

namespace tetap::drivers::bmi270 {

enum class AccelRange : std::uint8_t { k2g, k4g, k8g, k16g };  // ACC_RANGE
using bosch::GyroRange;                                        // GYR_RANGE
using bosch::Rate;                                             // ACC_CONF and GYR_CONF, both

struct Settings {
  AccelRange accel_range = AccelRange::k16g;
  GyroRange gyro_range = GyroRange::k2000dps;
  Rate rate = Rate::k800Hz;
  /// Delay of the filters. A second order of bandwidth f is sqrt(2) / (2 pi f) late, which is 0.8 ms at 280 Hz.
  std::int32_t delay_us = 800;
  std::uint16_t stuck_samples = 200;  ///< one axis with the same value so often in a row is a fault; 0: never
  Mounting mounting{};
};

/// TEMPERATURE_0 and _1: 1/512 K each, 0 at 23 degC; 0x8000: none.
[[nodiscard]] constexpr float temperature_degC(std::uint8_t low, std::uint8_t high) {
  const auto raw = static_cast<std::int16_t>(low | high << 8);
  return raw == -32'768 ? base::kNan : 23.0F + static_cast<float>(raw) / 512.0F;
}

template <hal::SpiDevice Spi>
class Chip {
 public:
  /// `file`: Bosch's configuration file, whole words, at most 8 192 bytes.
  constexpr Chip(Spi& spi, std::span<const std::uint8_t> file, const Settings& settings)
      : bus_(spi), file_(file), settings_(settings) {
    using bosch::Kind, bosch::Reason;
    const auto byte = [](auto value) { return static_cast<std::uint8_t>(value); };
    constexpr std::uint8_t kPerformance = 0x80, kLowNoise = 0x40, kNormalFilter = 0x20;
    actions_ = {{
        {Kind::kTouch, 0, 0x00, 0, 0, 1'000},        // the rising edge of its select line selects SPI
        {Kind::kWrite, 0, 0x7E, 0xFF, 0xB6, 2'000},  // CMD: reset
        {Kind::kTouch, 0, 0x00, 0, 0, 1'000},
        {Kind::kExpect, 0, 0x00, 0xFF, 0x24},        // CHIP_ID
        {Kind::kWrite, 0, 0x7C, 0xFF, 0x00, 1'000},  // PWR_CONF: no power save; 450 us
        {Kind::kWrite, 0, 0x59, 0xFF, 0x00},         // INIT_CTRL: the file follows
        {Kind::kUpload, 0, 0x5E},
        {Kind::kWrite, 0, 0x59, 0xFF, 0x01,
         150'000},  // the file is whole; the sheet: 20 ms at most, before rev. 1.1 140
        {Kind::kExpect, 0, 0x21, 0x0F, 0x01, 0, Reason::kFileRefused},  // INTERNAL_STATUS: initialised
        {Kind::kKeep, 0, 0x2F, 0xFF, 0x00, 1'000},                      // FEAT_PAGE 0
        {Kind::kLearn, 0, 0x3C},                                        // GYR_CAS, written by the file
        {Kind::kKeep, 0, 0x40, 0xFF, byte(kPerformance | kNormalFilter | byte(settings.rate))},
        {Kind::kKeep, 0, 0x41, 0x03, byte(settings.accel_range)},
        {Kind::kKeep, 0, 0x42, 0xFF, byte(kPerformance | kLowNoise | kNormalFilter | byte(settings.rate))},
        {Kind::kKeep, 0, 0x43, 0x07, byte(settings.gyro_range)},
        {Kind::kKeep, 0, 0x7D, 0x0F, 0x0E, 50'000},  // PWR_CTRL: gyroscope (45 ms), accelerometer, temperature
        {Kind::kKeep, 0, 0x7C, 0x03, 0x02},          // PWR_CONF: performance mode
    }};
  }

  [[nodiscard]] constexpr bool valid() const {
    return !file_.empty() && file_.size() % 2 == 0 && file_.size() <= kMostBytes && bosch::offered(settings_);
  }
  [[nodiscard]] constexpr bosch::StreamSettings stream() const { return bosch::stream_settings(2, settings_); }
  [[nodiscard]] constexpr std::span<const bosch::Action> actions() const { return actions_; }

  [[nodiscard]] constexpr bool read(std::uint8_t, std::uint8_t address, std::span<std::uint8_t> in) {
    return bus_.read(address, in);
  }
  [[nodiscard]] constexpr bool write(std::uint8_t, std::span<const std::uint8_t> out) { return bus_.write(out); }

  /// x, y, z of both sensors, the sensor time, and the temperature at 0x22, in one reading. The gyroscope's x is rid
  /// of its share of z (section "Gyroscope Data Post-Processing").
  [[nodiscard]] constexpr bool sample(bosch::Raw& raw) {
    std::array<std::uint8_t, 24> b{};
    if (!bus_.read(0x0C, b)) return false;
    raw.accel = bosch::words(std::span(b).first(6));
    raw.gyro = bosch::words(std::span(b).subspan(6, 6));
    const std::int32_t x = raw.gyro[0] - factor_zx_ * raw.gyro[2] / 512;
    // At an end of the range there is nothing to correct.
    if (raw.gyro[0] < kEnd && raw.gyro[0] > -kEnd) raw.gyro[0] = std::clamp(x, -kEnd, kEnd);
    raw.sensor_time = bosch::counter(std::span(b).subspan(12));
    raw.temperature_degC = temperature_degC(b[22], b[23]);
    return true;
  }

  /// The next part of the file: its place in words in INIT_ADDR_0 (4 bits) and _1 (8 bits), then bytes for INIT_DATA.
  [[nodiscard]] constexpr bool upload() {
    if (sent_ >= file_.size()) sent_ = 0;
    const std::size_t words = sent_ / 2, count = std::min(kPart, file_.size() - sent_);
    const std::array<std::uint8_t, 3> place{0x5B, static_cast<std::uint8_t>(words & 0x0F),
                                            static_cast<std::uint8_t>(words >> 4)};
    std::array<std::uint8_t, 1 + kPart> part{0x5E};
    std::copy_n(file_.begin() + static_cast<std::ptrdiff_t>(sent_), count, part.begin() + 1);
    const bool sent = bus_.write(place) && bus_.write(std::span(part).first(1 + count));
    sent_ = sent ? sent_ + count : 0;
    return sent;
  }
  [[nodiscard]] constexpr bool uploaded() const { return sent_ >= file_.size(); }
  /// GYR_CAS: seven bits with sign.
  constexpr void learn(std::uint8_t value) { factor_zx_ = (value & 0x7F) - ((value & 0x40) != 0 ? 0x80 : 0); }

 private:
  static constexpr std::size_t kMostBytes = 8'192, kPart = 64;
  static constexpr std::int32_t kEnd = 32'767;

  bosch::Bus<Spi, 1> bus_;
  std::span<const std::uint8_t> file_;
  Settings settings_;
  std::array<bosch::Action, 17> actions_{};
  std::size_t sent_ = 0;  ///< bytes of the file that the chip has
  std::int32_t factor_zx_ = 0;
};

template <hal::SpiDevice Spi>
using Driver = bosch::Driver<Chip<Spi>>;

}  // namespace tetap::drivers::bmi270
