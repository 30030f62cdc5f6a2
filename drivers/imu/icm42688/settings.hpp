// SPDX-License-Identifier: Apache-2.0
// Choices of a robot for its ICM-42688-P, and the register fields that follow from them. Sections: DS-000347 rev. 1.8.
#pragma once

#include "drivers/imu/icm42688/registers.hpp"
#include "drivers/imu/mounting.hpp"

#include <array>
#include <cstdint>

namespace tetap::drivers::icm42688 {

enum class GyroRange : std::uint8_t { k2000dps, k1000dps, k500dps, k250dps, k125dps, k62dps, k31dps, k15dps };  // 14.37
enum class AccelRange : std::uint8_t { k16g, k8g, k4g, k2g };                                                   // 14.38
/// One rate for both: with two, the slower sensor fills the packets between with markers (14.34, invalid data c).
enum class Rate : std::uint8_t {
  k8kHz = 0x3,
  k4kHz = 0x4,
  k2kHz = 0x5,
  k1kHz = 0x6,
  k500Hz = 0xF,
  k200Hz = 0x7,
  k100Hz = 0x8,
  k50Hz = 0x9,
  k25Hz = 0xA
};
enum class FilterOrder : std::uint8_t { kFirst, kSecond, kThird };  // 5.5
/// Divisor of max(400 Hz, rate), but of the rate itself for kBy2 (14.40). Without effect at 2 kHz and above.
enum class Bandwidth : std::uint8_t { kBy2, kBy4, kBy5, kBy8, kBy10, kBy16, kBy20, kBy40 };
enum class Resolution : std::uint8_t { k16bit, k20bit };  // 6.1: packet 3 or packet 4
enum class Tick : std::uint8_t { k1us, k16us };           // 14.42

/// Anti-alias filter before decimation: a row of the table in 5.3; delt = 0: off.
struct AntiAlias {
  std::uint8_t delt;
  std::uint16_t delt_squared;
  std::uint8_t shift;
};
inline constexpr AntiAlias kAntiAliasOff{0, 0, 0}, kAntiAlias42Hz{1, 1, 15}, kAntiAlias84Hz{2, 4, 13},
    kAntiAlias126Hz{3, 9, 12}, kAntiAlias213Hz{5, 25, 10}, kAntiAlias258Hz{6, 36, 10}, kAntiAlias394Hz{9, 81, 9},
    kAntiAlias536Hz{12, 144, 8}, kAntiAlias997Hz{21, 440, 6}, kAntiAlias1962Hz{37, 1376, 4};

struct Settings {
  GyroRange gyro_range = GyroRange::k2000dps;
  AccelRange accel_range = AccelRange::k16g;
  Rate rate = Rate::k1kHz;
  FilterOrder order = FilterOrder::kSecond;  ///< one order and bandwidth for both, so that both are equally late
  Bandwidth bandwidth = Bandwidth::kBy4;
  AntiAlias anti_alias = kAntiAlias258Hz;
  Resolution resolution = Resolution::k16bit;
  Tick tick = Tick::k1us;
  std::uint8_t watermark_packets = 1;   ///< INT1 pulses when so many wait
  std::uint32_t external_clock_Hz = 0;  ///< on pin 9, 31 to 50 kHz; 0: the chip's own, 3 % (table 4)
  Mounting mounting{};
  /// Delays besides the interface filter's (5.5): the anti-alias filter's, and one that a calibration found. The sheet
  /// has no number for the former: a second order of bandwidth f is sqrt(2) / (2 pi f) late, 0.9 ms at 258 Hz.
  std::int32_t more_delay_us = 0;
  /// One axis with the same value so often in a row is a fault; 0: never. Filters that leave less noise raise the
  /// number by themselves (noise.hpp).
  std::uint16_t stuck_accel_samples = 100;
  std::uint16_t stuck_gyro_samples = 2000;

  /// Bytes of one packet in the FIFO (6.4).
  [[nodiscard]] constexpr int packet_size() const { return resolution == Resolution::k20bit ? 20 : 16; }
  [[nodiscard]] constexpr bool external() const { return external_clock_Hz != 0; }

  /// Between two samples, as configured; 12.5: the rates scale with an external clock.
  [[nodiscard]] constexpr std::int64_t period_ns() const {
    std::int64_t period = 0;
    switch (rate) {
      case Rate::k8kHz:
        period = 125'000;
        break;
      case Rate::k4kHz:
        period = 250'000;
        break;
      case Rate::k2kHz:
        period = 500'000;
        break;
      case Rate::k1kHz:
        period = 1'000'000;
        break;
      case Rate::k500Hz:
        period = 2'000'000;
        break;
      case Rate::k200Hz:
        period = 5'000'000;
        break;
      case Rate::k100Hz:
        period = 10'000'000;
        break;
      case Rate::k50Hz:
        period = 20'000'000;
        break;
      case Rate::k25Hz:
        period = 40'000'000;
        break;
    }
    return external() ? period * 32'000 / external_clock_Hz : period;
  }

  /// Microseconds per tick of the time stamp in units of 2^-32. 12.7: the chip's microsecond is 32/30 of one.
  [[nodiscard]] constexpr std::int64_t tick_q32() const {
    constexpr std::int64_t kOne = std::int64_t{1} << 32;
    if (!external()) return (tick == Tick::k16us ? 16 : 1) * (kOne * 32 / 30);
    if (tick == Tick::k16us) return kOne * 1'000'000 / external_clock_Hz;
    return kOne * 32'768 / external_clock_Hz;
  }

  [[nodiscard]] constexpr bool valid() const {
    // 6.1: with 20 bits the chip has its largest ranges, whatever is asked for.
    const bool ranges =
        resolution == Resolution::k16bit || (gyro_range == GyroRange::k2000dps && accel_range == AccelRange::k16g);
    const bool clock = !external() || (external_clock_Hz >= 31'000 && external_clock_Hz <= 50'000);
    // The stamp wraps at 65536 ticks; the interval must stay below half of that.
    const bool stamp = ((period_ns() / 1000) << 32) / tick_q32() < 32'768;
    const int watermark_bytes = watermark_packets * packet_size();
    return ranges && clock && stamp && watermark_packets > 0 && watermark_bytes < 2048 && mounting.valid();
  }
};

/// Late by so much is what the interface filter lets out: group delay at 0 Hz (5.5), in units of 0.1 ms.
[[nodiscard]] constexpr std::int64_t group_delay_us(const Settings& s) {
  constexpr std::uint16_t kDelay[3][3][8] = {
      // 1 kHz, 500 Hz, 200 Hz and below (there kBy2 grows with the period); by bandwidth
      {{6, 18, 20, 28, 31, 41, 47, 81}, {11, 36, 40, 55, 61, 81, 93, 162}, {27, 44, 50, 68, 76, 102, 117, 203}},
      {{7, 21, 24, 32, 37, 52, 61, 120}, {13, 41, 47, 64, 73, 104, 122, 240}, {33, 51, 58, 80, 91, 129, 153, 300}},
      {{8, 23, 27, 40, 46, 66, 82, 141}, {16, 46, 54, 79, 92, 132, 163, 281}, {40, 58, 68, 98, 114, 165, 204, 352}}};
  const auto order = static_cast<std::size_t>(s.order);
  const auto bandwidth = static_cast<std::size_t>(s.bandwidth);
  switch (s.rate) {
    case Rate::k8kHz:
      return 200;
    case Rate::k4kHz:
      return 400;
    case Rate::k2kHz:
      return 800;
    case Rate::k1kHz:
      return kDelay[order][0][bandwidth] * 100;
    case Rate::k500Hz:
      return kDelay[order][1][bandwidth] * 100;
    default:
      break;
  }
  const std::int64_t delay = kDelay[order][2][bandwidth] * 100;
  const std::int64_t slower = s.rate == Rate::k200Hz ? 1 : s.rate == Rate::k100Hz ? 2 : s.rate == Rate::k50Hz ? 4 : 8;
  return s.bandwidth == Bandwidth::kBy2 ? delay * slower : delay;
}

/// A field of a register and what has to be in it.
struct Field {
  Register where;
  std::uint8_t mask;
  std::uint8_t value;
};

inline constexpr std::size_t kFieldCount = 38;

/// In the order of writing. The last starts the sensors; all others are written while they are off (12.9).
[[nodiscard]] constexpr std::array<Field, kFieldCount> fields(const Settings& s) {
  const auto byte = [](auto value) { return static_cast<std::uint8_t>(value); };
  const auto offset = [&](int nth) { return Field{{kOffsetUser0.bank, byte(kOffsetUser0.address + nth)}, 0xFF, 0}; };
  const auto order = byte(s.order);
  const auto bandwidth = byte(s.bandwidth);
  const bool fast = s.period_ns() <= 250'000;
  const bool filtered = s.anti_alias.delt != 0;
  const int watermark = s.watermark_packets * s.packet_size();
  const auto square_high = byte(s.anti_alias.shift << 4 | s.anti_alias.delt_squared >> 8);
  return {{
      {kPwrMgmt0, kPowerFields, kBothOff},
      {kDriveConfig, kSlewRates, kSlewRatesSpi},
      {kIntConfig, kInt1Fields, kInt1PushPullActiveHigh},
      {kIntfConfig0, kIntfFields, kIntfMarkBytesBigSpi},
      {kIntfConfig1, kRangeSwitch | kRtcMode | kClockSelect,
       byte(kRangeSwitchOff | kClockPll | (s.external() ? kRtcMode : 0))},
      {kGyroConfig0, kRangeAndRate, byte(byte(s.gyro_range) << kRangeShift | byte(s.rate))},
      {kAccelConfig0, kRangeAndRate, byte(byte(s.accel_range) << kRangeShift | byte(s.rate))},
      {kGyroConfig1, kGyroFilterOrder, byte(order << kGyroFilterOrderShift)},
      {kGyroAccelConfig0, 0xFF, byte(bandwidth << kAccelBandwidthShift | bandwidth)},
      {kAccelConfig1, kAccelFilterOrder, byte(order << kAccelFilterOrderShift)},
      {kTmstConfig, kTmstFields, byte(kTmstEnable | (s.tick == Tick::k16us ? kTmstCoarse : 0))},
      {kFifoConfig1, kFifoFields,
       byte(kFifoPartialRead | kFifoWatermarkEach | kFifoTempGyroAccel |
            (s.resolution == Resolution::k20bit ? kFifoHires : 0))},
      {kFifoConfig2, 0xFF, byte(watermark & 0xFF)},
      {kFifoConfig3, kWatermarkHigh, byte(watermark >> 8)},
      {kIntConfig0, kIntClearFields, kThresholdClearsOnFifoRead},
      {kIntConfig1, kIntTiming, fast ? kIntFastPulse : byte(0)},
      {kIntSource0, kIntSources, kThresholdToInt1},
      // Nobody sets these, and a bit that fell over in one would be a bias or a dead axis without a word.
      {kSelfTestConfig, kSelfTestFields, 0},
      {kSensorConfig0, kAxesOff, 0},
      {kGyroConfigStatic2, kGyroFilters, filtered ? byte(0) : kGyroAntiAliasOff},
      {kGyroConfigStatic3, kGyroDelt, filtered ? s.anti_alias.delt : byte(1)},
      {kGyroConfigStatic4, 0xFF, byte(s.anti_alias.delt_squared & 0xFF)},
      {kGyroConfigStatic5, 0xFF, square_high},
      {kIntfConfig5, kPin9Function, s.external() ? kPin9ClockIn : byte(0)},
      {kAccelConfigStatic2, kAccelFilters, filtered ? byte(s.anti_alias.delt << 1) : byte(2 | kAccelAntiAliasOff)},
      {kAccelConfigStatic3, 0xFF, byte(s.anti_alias.delt_squared & 0xFF)},
      {kAccelConfigStatic4, 0xFF, square_high},
      offset(0),
      offset(1),
      offset(2),
      offset(3),
      offset(4),
      offset(5),
      offset(6),
      offset(7),
      offset(8),
      {kFifoConfig, kFifoMode, kFifoStream},
      {kPwrMgmt0, kPowerFields, kBothLowNoise},
  }};
}

}  // namespace tetap::drivers::icm42688
