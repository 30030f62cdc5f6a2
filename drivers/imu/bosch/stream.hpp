// SPDX-License-Identifier: Apache-2.0
// From registers to samples: the chip's 24-bit sensor time numbers the samples and puts them on the MCU's clock; lost
// samples, stuck values and the ends of the range are found; axes become the body's.
#pragma once

#include "drivers/imu/bosch/health.hpp"
#include "drivers/imu/clock_map.hpp"
#include "drivers/imu/reading.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::drivers::bosch {

/// Registers of one reading.
struct Raw {
  std::array<std::int32_t, 3> accel{}, gyro{};
  std::uint32_t sensor_time = 0;  ///< 24 bits of 39.0625 us
  float temperature_degC = 0;     ///< NaN: not available
};

/// Three signed words, low byte first.
[[nodiscard]] constexpr std::array<std::int32_t, 3> words(std::span<const std::uint8_t> b) {
  const auto word = [&b](std::size_t at) { return std::int32_t{static_cast<std::int16_t>(b[at] | b[at + 1] << 8)}; };
  return {word(0), word(2), word(4)};
}
/// 24 bits, low byte first.
[[nodiscard]] constexpr std::uint32_t counter(std::span<const std::uint8_t> b) {
  return std::uint32_t{b[0]} | std::uint32_t{b[1]} << 8 | std::uint32_t{b[2]} << 16;
}

/// A chip's settings that its samples are read with.
struct StreamSettings {
  std::int32_t period_ticks;  ///< period in ticks of the sensor time, a power of two
  float rate_radps;           ///< rate of one bit
  float force_mps2;           ///< force of one bit
  std::int32_t delay_us;      ///< delay by the chip's filters
  std::uint16_t stuck_samples;
  Mounting mounting;
};

enum class GyroRange : std::uint8_t { k2000dps, k1000dps, k500dps, k250dps, k125dps };
enum class Rate : std::uint8_t { k100Hz = 0x8, k200Hz, k400Hz, k800Hz, k1600Hz };

/// Whether a chip's settings are some it has. Its ranges of force are four.
template <class Settings>
[[nodiscard]] constexpr bool offered(const Settings& settings) {
  return static_cast<unsigned>(settings.accel_range) < 4 && settings.gyro_range <= GyroRange::k125dps &&
         settings.rate >= Rate::k100Hz && settings.rate <= Rate::k1600Hz && settings.mounting.valid();
}

/// Scales of 16 bits over a chip's ranges, the first of which is +-`least_g`; each next one is twice as wide.
template <class Settings>
[[nodiscard]] constexpr StreamSettings stream_settings(int least_g, const Settings& settings) {
  constexpr float kStandardGravity_mps2 = 9.80665F, kRadPerDeg = 0.017453293F, kFull = 32'768.0F;
  constexpr std::array kDps{2000, 1000, 500, 250, 125};
  const auto code = [](auto value) { return static_cast<unsigned>(value); };
  const int range_g = least_g << code(settings.accel_range) % 4, range_dps = kDps[code(settings.gyro_range) % 5];
  return {.period_ticks = 256 >> (code(settings.rate) - code(Rate::k100Hz)) % 5,
          .rate_radps = static_cast<float>(range_dps) * kRadPerDeg / kFull,
          .force_mps2 = static_cast<float>(range_g) * kStandardGravity_mps2 / kFull,
          .delay_us = settings.delay_us,
          .stuck_samples = settings.stuck_samples,
          .mounting = settings.mounting};
}

class Stream {
 public:
  explicit constexpr Stream(const StreamSettings& settings) : settings_(settings) {}

  [[nodiscard]] constexpr std::int32_t clock_error_ppm() const { return clock_.rate_error_ppm(); }
  [[nodiscard]] constexpr base::Micros period() const { return base::Micros{settings_.period_ticks * kTick_q4us / 16}; }

  /// The chip was reset, and its sensor time with it.
  constexpr void restart() {
    clock_.stop();
    follows_ = false;
    accel_ = gyro_ = {};
  }

  /// Whether a sample may have come within this reading, so that values and time may be of two samples.
  [[nodiscard]] constexpr bool doubtful(const Raw& raw) const {
    return static_cast<std::int32_t>(raw.sensor_time) % settings_.period_ticks < kGuard_ticks;
  }

  /// True: a sample that was not taken before. The counter's lower bits begin anew with each.
  template <class Sink>
  constexpr bool take(const Raw& raw, base::Micros now, Health& health, Sink&& sink) {
    if (blank(raw)) return false;
    const auto low = static_cast<std::int64_t>(raw.sensor_time) / settings_.period_ticks * settings_.period_ticks;
    if (!clock_.running() || now - taken_ > kLongGap) {
      clock_.start(low, now);
      follows_ = false;
      ticks_ = low;
    } else {
      const std::int64_t since = (low - ticks_) & (kTurn - 1);
      if (since == 0) return false;
      ticks_ += since;
      if (!clock_.observe(ticks_, now)) {
        health.add(Reason::kBadStamp);
        restart();
        return false;
      }
      if (follows_ && since > settings_.period_ticks)
        health.add(Reason::kLostSamples, static_cast<std::uint32_t>(since / settings_.period_ticks - 1));
      follows_ = follows_ && since == settings_.period_ticks;
    }
    taken_ = now;
    emit(raw, health, sink);
    return true;
  }

 private:
  /// Six equal values are a line that nobody drives.
  [[nodiscard]] static constexpr bool blank(const Raw& raw) {
    for (std::size_t i = 0; i < 3; ++i)
      if (raw.accel[i] != raw.accel[0] || raw.gyro[i] != raw.accel[0]) return false;
    return true;
  }

  struct Repeats {
    std::array<std::int32_t, 3> value{};
    std::array<std::uint16_t, 3> times{};
  };

  template <class Sink>
  constexpr void emit(const Raw& raw, Health& health, Sink& sink) {
    ImuReading reading{};
    reading.stamp = clock_.time(ticks_) - base::Micros{settings_.delay_us};
    if (stamped_ && reading.stamp <= last_stamp_) reading.stamp = last_stamp_ + base::Micros{1};
    reading.interval = follows_ ? reading.stamp - last_stamp_ : period();
    reading.after_gap = !follows_;
    last_stamp_ = reading.stamp;
    stamped_ = true;
    const bool stuck_accel = stuck(raw.accel, accel_), stuck_gyro = stuck(raw.gyro, gyro_);
    if (stuck_accel) health.add(Reason::kStuckAccel);
    if (stuck_gyro) health.add(Reason::kStuckGyro);
    follows_ = !stuck_accel && !stuck_gyro;  // what follows a withheld one has a gap before it
    if (!follows_) return;
    reading.rate_b_radps = settings_.mounting.to_body(scaled(raw.gyro, settings_.rate_radps));
    reading.force_b_mps2 = settings_.mounting.to_body(scaled(raw.accel, settings_.force_mps2));
    reading.temperature_degC = raw.temperature_degC;
    reading.clipped_gyro = clipped(raw.gyro);
    reading.clipped_accel = clipped(raw.accel);
    if (reading.clipped_gyro) health.add(Reason::kClippedGyro);
    if (reading.clipped_accel) health.add(Reason::kClippedAccel);
    ++health.samples;
    sink(static_cast<const ImuReading&>(reading));
  }

  [[nodiscard]] static constexpr Vector3 scaled(const std::array<std::int32_t, 3>& raw, float per_bit) {
    return {static_cast<float>(raw[0]) * per_bit, static_cast<float>(raw[1]) * per_bit,
            static_cast<float>(raw[2]) * per_bit};
  }
  [[nodiscard]] static constexpr bool at_end(std::int32_t x) {
    constexpr std::int32_t kEnd = 32'767;
    return x >= kEnd || x <= -kEnd;
  }
  [[nodiscard]] static constexpr bool clipped(const std::array<std::int32_t, 3>& raw) {
    return at_end(raw[0]) || at_end(raw[1]) || at_end(raw[2]);
  }
  /// Any axis that repeats itself so often and is not at an end of its range: a living sensor has noise.
  constexpr bool stuck(const std::array<std::int32_t, 3>& now, Repeats& repeats) const {
    bool any = false;
    for (std::size_t i = 0; i < 3; ++i) {
      auto& times = repeats.times[i];
      const bool repeats_itself = now[i] == repeats.value[i] && !at_end(now[i]);
      times = repeats_itself ? static_cast<std::uint16_t>(times + (times < 0xFFFF)) : std::uint16_t{0};
      any |= settings_.stuck_samples != 0 && times >= settings_.stuck_samples;
    }
    repeats.value = now;
    return any;
  }

  static constexpr std::int64_t kTurn = std::int64_t{1} << 24;
  static constexpr std::int64_t kTick_q4us = 625;              ///< 39.0625 us in 1/16 us
  static constexpr std::int64_t kTick_q32 = kTick_q4us << 28;  ///< in 2^-32 us
  static constexpr std::int32_t kGuard_ticks = 2;              ///< longer than a reading takes on the bus
  static constexpr base::Micros kLongGap{300'000'000};         ///< the counter turns in 655 s

  StreamSettings settings_;
  ClockMap clock_{kTick_q32};
  std::int64_t ticks_ = 0;
  base::Micros taken_{}, last_stamp_{};
  Repeats accel_{}, gyro_{};
  bool follows_ = false;  ///< the sample before was delivered
  bool stamped_ = false;  ///< some sample got a stamp since power-on
};

}  // namespace tetap::drivers::bosch
