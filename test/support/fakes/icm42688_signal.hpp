// SPDX-License-Identifier: Apache-2.0
// From motion to the numbers of the ICM-42688-P: output data rates, full scales, saturation, the code for "no sample",
// temperature, self test. Source: TDK DS-000347 revision 1.8, sections 3.1, 3.2, 4.9, 4.13, 5.5, 5.6, 6.1, 12.8 and
// 14.34.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>

namespace tetap::fakes::icm42688 {

/// Picoseconds of the chip's own clock: every output data rate of 5.6 has a whole number of them as its period.
using Picos = std::int64_t;
inline constexpr Picos kMicrosecond = 1'000'000;
inline constexpr Picos kMillisecond = 1000 * kMicrosecond;

inline constexpr Picos kResetTime = kMillisecond;           // 14.1: "wait 1ms for soft reset to be effective"; 3.3.2
inline constexpr Picos kQuietTime = 200 * kMicrosecond;     // 14.36: no register writes after OFF to any other mode
inline constexpr Picos kGyroMinimumOn = 45 * kMillisecond;  // 14.36: "needs to be kept ON for a minimum of 45ms"
inline constexpr Picos kGyroStartUp = 30 * kMillisecond;    // 3.1
inline constexpr Picos kAccelStartUp = 10 * kMillisecond;   // 3.2

inline constexpr double kDegree = 3.14159265358979323846 / 180.0;
inline constexpr double kStandardGravity_mps2 = 9.80665;

/// Motion of the die, in its own axes (10.1); flat on a table the z axis shows +1 g (4.7).
struct Motion {
  std::array<double, 3> rate_radps{};
  std::array<double, 3> specific_force_mps2{0.0, 0.0, kStandardGravity_mps2};
  double temperature_degC = 25.0;
};

/// 5.6: the period of an output data rate; empty for the reserved codes.
[[nodiscard]] inline std::optional<Picos> odr_period(std::uint8_t code) {
  constexpr std::array<Picos, 16> kPeriod_ns = {
      0,          31'250,     62'500,     125'000,    250'000,     500'000,     1'000'000,   5'000'000,
      10'000'000, 20'000'000, 40'000'000, 80'000'000, 160'000'000, 320'000'000, 640'000'000, 2'000'000};
  const Picos period = 1000 * kPeriod_ns[code & 0x0F];
  return period == 0 ? std::nullopt : std::optional<Picos>{period};
}
/// 5.6 and 14.37: the gyroscope makes 12.5 Hz to 32 kHz.
[[nodiscard]] inline bool gyro_makes(std::uint8_t code) { return (code >= 1 && code <= 11) || code == 15; }
/// 12.1: low noise mode has no rate below 12.5 Hz, low power mode none above 500 Hz.
[[nodiscard]] inline bool accel_makes(std::uint8_t code, bool low_power) {
  return low_power ? code >= 7 : (code >= 1 && code <= 11) || code == 15;
}

/// 3.1: 2000 dps halved per code; the sheet's LSB/dps (16.4, 32.8, 65.5, ...) are 32768 by this, rounded.
[[nodiscard]] inline double gyro_full_scale_radps(std::uint8_t config0) {
  return std::ldexp(2000.0 * kDegree, -(config0 >> 5));
}
/// 3.2: 16 g halved per code. Codes 4 to 7 are reserved (14.38); here they act by their low two bits.
[[nodiscard]] inline double accel_full_scale_mps2(std::uint8_t config0) {
  return std::ldexp(16.0 * kStandardGravity_mps2, -((config0 >> 5) & 3));
}

/// 12.8 and 14.34: -32768 marks a sample that is none, so with FIFO_HOLD_LAST_DATA_EN = 0 a true -32768 or -32767 is
/// sent as -32766.
inline constexpr int kInvalid16 = -32768;
inline constexpr int kInvalid20 = -524288;
inline constexpr int kInvalid8 = -128;  // of FIFO_TEMP_DATA; from TDK's own driver (Icm426xxDefs.h), the sheet has none

[[nodiscard]] inline int to_16_bits(double of_full_scale, bool hold_last) {
  const double counts = std::clamp(std::round(of_full_scale * 32768.0), -32768.0, 32767.0);
  const int value = static_cast<int>(counts);
  return !hold_last && value < -32766 ? -32766 : value;
}
/// 6.1: 19 bits of gyroscope with the lowest bit 0, 18 bits of accelerometer with the two lowest 0. The 131 LSB/dps and
/// 8192 LSB/g of the sheet count those 19 and 18 bits, so the 20-bit number's full scale is 2^19.
[[nodiscard]] inline int to_20_bits(double of_full_scale, int zero_bits, bool hold_last) {
  const double steps = std::ldexp(1.0, 19 - zero_bits);
  const double counts = std::clamp(std::round(of_full_scale * steps), -steps, steps - 1.0);
  const int value = static_cast<int>(counts) * (1 << zero_bits);
  return !hold_last && value <= -524258 ? -524256 : value;
}
/// 4.13: TEMP_DATA / 132.48 + 25.
[[nodiscard]] inline int temperature_16_bits(double temperature_degC) {
  return static_cast<int>(std::clamp(std::round((temperature_degC - 25.0) * 132.48), -32766.0, 32767.0));
}
/// 4.13: FIFO_TEMP_DATA / 2.07 + 25.
[[nodiscard]] inline int temperature_8_bits(double temperature_degC) {
  return static_cast<int>(std::clamp(std::round((temperature_degC - 25.0) * 2.07), -127.0, 127.0));
}

/// 5.5, roughly: the group delay of the user filter, which is where the sample lies in the past.
[[nodiscard]] inline double group_delay_s(std::uint8_t odr_code, std::uint8_t bandwidth, std::uint8_t order) {
  constexpr double kAt1kHz_ms[3][8] = {{0.6, 1.8, 2.0, 2.8, 3.1, 4.1, 4.7, 8.1},
                                       {0.7, 2.1, 2.4, 3.2, 3.7, 5.2, 6.1, 12.0},
                                       {0.8, 2.3, 2.7, 4.0, 4.6, 6.6, 8.2, 14.1}};
  const double odr_Hz = 1e12 / static_cast<double>(odr_period(odr_code).value_or(kMillisecond));
  const double filter_Hz = std::max(400.0, odr_Hz);
  if (odr_Hz > 1500.0) return 1.6 / odr_Hz;
  if (bandwidth == 0) return kAt1kHz_ms[order % 3][0] / odr_Hz;
  if (bandwidth < 8) return kAt1kHz_ms[order % 3][bandwidth] / filter_Hz;
  return bandwidth == 15 ? 0.2 / std::max(25.0, odr_Hz) : 1.5 / filter_Hz;
}

/// The response that the factory code stands for, as a share of full scale 3 (250 dps, 2 g): 2620 * 1.01^(code - 1)
/// counts. Every step of full scale halves it. The formula is TDK's own driver's (Icm426xxSelfTest.c); the sheet gives
/// the codes, 15.11 and 16.4, but no formula. The mechanics do not depend on the full scale chosen.
[[nodiscard]] inline double self_test_counts_at_3(std::uint8_t code) {
  return code == 0 ? 10'000.0 : 2620.0 * std::pow(1.01, code - 1);
}
[[nodiscard]] inline double self_test_radps(std::uint8_t code) {
  return self_test_counts_at_3(code) / 32768.0 * 250.0 * kDegree;
}
[[nodiscard]] inline double self_test_mps2(std::uint8_t code) {
  return self_test_counts_at_3(code) / 32768.0 * 2.0 * kStandardGravity_mps2;
}

/// A self-test response on its way to its target. TDK's driver waits 200 ms for the gyroscope and 25 ms for the
/// accelerometer after switching; five time constants fit in that.
class Settling {
 public:
  explicit Settling(Picos time_constant) : time_constant_(time_constant) {}
  void aim(Picos now, double target) {
    start_ = at(now);
    since_ = now;
    target_ = target;
  }
  [[nodiscard]] double at(Picos now) const {
    const double passed = static_cast<double>(now - since_) / static_cast<double>(time_constant_);
    return target_ + (start_ - target_) * std::exp(-passed);
  }

 private:
  Picos time_constant_;
  Picos since_ = 0;
  double start_ = 0.0;
  double target_ = 0.0;
};

/// 5.4: signed 12 bits, 1/32 dps a step for the gyroscope, 0.5 mg for the accelerometer, laid out over nine bytes. The
/// sheet prints "0.5 g" beside "max +-1 g" for 12 bits.
struct UserOffsets {
  std::array<double, 3> rate_radps{};
  std::array<double, 3> specific_force_mps2{};
};
[[nodiscard]] inline UserOffsets user_offsets(const std::array<std::uint8_t, 9>& b) {
  const auto signed_12 = [](int low, int high) {
    const int raw = low | (high & 0x0F) << 8;
    return static_cast<double>(raw >= 2048 ? raw - 4096 : raw);
  };
  const double dps = kDegree / 32.0;
  const double mg = 0.0005 * kStandardGravity_mps2;
  return {{signed_12(b[0], b[1]) * dps, signed_12(b[2], b[1] >> 4) * dps, signed_12(b[3], b[4]) * dps},
          {signed_12(b[5], b[4] >> 4) * mg, signed_12(b[6], b[7]) * mg, signed_12(b[8], b[7] >> 4) * mg}};
}

}  // namespace tetap::fakes::icm42688
