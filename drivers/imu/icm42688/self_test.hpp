// SPDX-License-Identifier: Apache-2.0
// Self test of the ICM-42688-P (DS-000347, 4.9). Response is output with the actuation minus output without. It is
// compared with the factory's (codes: 15.11-15.13, 16.4-16.6). The data sheet has neither the codes' meaning nor the
// limits. They are facts of InvenSense's reference driver for this family. 2620 counts * 1.01^(code - 1) at 250 deg/s
// and 2 g, ratio 0.5 to 1.5. Without codes 60 deg/s and 50 to 1200 mg. The robot has to stand still.
#pragma once

#include "drivers/imu/icm42688/bus.hpp"
#include "drivers/imu/icm42688/packet.hpp"
#include "tetap/base/time.hpp"

#include <array>
#include <cstdint>

namespace tetap::drivers::icm42688 {

struct SelfTestAxis {
  float response = 0;  ///< deg/s or g
  float expected = 0;  ///< by the factory's code; 0: the chip has none
  bool passed = false;
};

struct SelfTestResult {
  bool done = false;
  bool passed = false;
  bool moving = false;  ///< the gyroscope's output without actuation was beyond 20 deg/s
  std::array<SelfTestAxis, 3> gyro{};
  std::array<SelfTestAxis, 3> accel{};
};

/// 1.01^(code - 1), in single steps: at most 254.
[[nodiscard]] constexpr float factory_growth(std::uint8_t code) {
  float growth = 1.0F;
  for (int i = 1; i < code; ++i) growth *= 1.01F;
  return growth;
}

[[nodiscard]] constexpr SelfTestAxis judge(float response, std::uint8_t code, float unit, float least, float most) {
  SelfTestAxis axis{.response = response < 0 ? -response : response};
  if (code != 0) {
    axis.expected = unit * factory_growth(code);
    axis.passed = axis.response > 0.5F * axis.expected && axis.response < 1.5F * axis.expected;
  } else {
    axis.passed = axis.response >= least && axis.response <= most;
  }
  return axis;
}

/// The sequence, one step per call. It leaves the chip in a configuration of its own: reset it afterwards.
class SelfTest {
 public:
  enum class Progress : std::uint8_t { kBusy, kDone, kBroken };

  constexpr void start(base::Micros now) {
    *this = SelfTest{};
    due_ = now;
  }

  [[nodiscard]] constexpr const SelfTestResult& result() const { return result_; }

  template <class Bus>
  [[nodiscard]] constexpr Progress step(Bus& bus, base::Micros now) {
    if (now < due_) return Progress::kBusy;
    switch (phase_) {
      case Phase::kOff:
        return enter(Phase::kSetUp, write(bus, kPwrMgmt0, kPowerFields, kBothOff), now, base::Micros{1'000});
      case Phase::kSetUp:
        return enter(Phase::kQuiet, set_up(bus), now, kStart);
      case Phase::kQuiet:
        return average(bus, now, quiet_, Phase::kShakeGyro);
      case Phase::kShakeGyro:
        return enter(Phase::kGyro, write(bus, kSelfTestConfig, kSelfTestFields, kSelfTestGyro), now, kStart);
      case Phase::kGyro:
        return average(bus, now, gyro_, Phase::kShakeAccel);
      case Phase::kShakeAccel:
        return enter(Phase::kAccel, write(bus, kSelfTestConfig, kSelfTestFields, kSelfTestAccel), now, kStart);
      case Phase::kAccel:
        return average(bus, now, accel_, Phase::kEnd);
      case Phase::kEnd:
        break;
    }
    if (!write(bus, kSelfTestConfig, kSelfTestFields, 0)) return Progress::kBroken;
    evaluate();
    return Progress::kDone;
  }

 private:
  enum class Phase : std::uint8_t { kOff, kSetUp, kQuiet, kShakeGyro, kGyro, kShakeAccel, kAccel, kEnd };

  // Start-up 30 ms (table 1); 200 ms after actuation in the reference driver.
  static constexpr base::Micros kStart{250'000};
  static constexpr base::Micros kLimit{3'000'000};  ///< for one average
  static constexpr int kSamples = 64;
  static constexpr std::uint8_t kRate1kHz = 0x06, kGyro250dps = 3 << kRangeShift, kAccel4g = 2 << kRangeShift;
  static constexpr float kCountsPerDps = 131.0F, kCountsPerG = 8192.0F;

  struct Sums {
    std::array<std::int32_t, 3> accel{}, gyro{};
    int samples = 0;
  };

  template <class Bus>
  static constexpr bool write(Bus& bus, Register where, std::uint8_t mask, std::uint8_t value) {
    return bus.modify(where, mask, value) == BusResult::kDone;
  }

  constexpr Progress enter(Phase next, bool ok, base::Micros now, base::Micros wait) {
    if (!ok) return Progress::kBroken;
    phase_ = next;
    due_ = now + wait;
    limit_ = due_ + kLimit;
    return Progress::kBusy;
  }

  /// Third order, a tenth of the rate: what the factory's numbers were measured with.
  template <class Bus>
  constexpr bool set_up(Bus& bus) {
    return bus.read(kXgStData, gyro_codes_) == BusResult::kDone &&
           bus.read(kXaStData, accel_codes_) == BusResult::kDone &&
           write(bus, kGyroConfig0, kRangeAndRate, kGyro250dps | kRate1kHz) &&
           write(bus, kAccelConfig0, kRangeAndRate, kAccel4g | kRate1kHz) &&
           write(bus, kGyroConfig1, kGyroFilterOrder, 2 << kGyroFilterOrderShift) &&
           write(bus, kGyroAccelConfig0, 0xFF, 0x44) &&
           write(bus, kAccelConfig1, kAccelFilterOrder, 2 << kAccelFilterOrderShift) &&
           write(bus, kPwrMgmt0, kPowerFields, kBothLowNoise);
  }

  template <class Bus>
  constexpr Progress average(Bus& bus, base::Micros now, Sums& sums, Phase next) {
    if (now > limit_) return Progress::kBroken;
    std::uint8_t status = 0;
    if (bus.read(kIntStatus, status) != BusResult::kDone) return Progress::kBroken;
    if ((status & kDataReady) == 0) return Progress::kBusy;
    std::array<std::uint8_t, 12> bytes{};
    if (bus.read(kAccelDataX1, bytes) != BusResult::kDone) return Progress::kBroken;
    std::array<std::int16_t, 6> values{};
    for (std::size_t i = 0; i < 6; ++i) {
      values[i] = signed_big_endian(bytes[2 * i], bytes[2 * i + 1]);
      if (values[i] == kMarker16) return Progress::kBusy;  // 12.8: no sample yet
    }
    for (std::size_t i = 0; i < 3; ++i) {
      sums.accel[i] += values[i];
      sums.gyro[i] += values[i + 3];
    }
    return ++sums.samples < kSamples ? Progress::kBusy : enter(next, true, now, base::Micros{0});
  }

  [[nodiscard]] static constexpr float mean(std::int32_t sum) { return static_cast<float>(sum) / kSamples; }

  constexpr void evaluate() {
    result_.done = result_.passed = true;
    for (std::size_t i = 0; i < 3; ++i) {
      const float still = mean(quiet_.gyro[i]) / kCountsPerDps;
      result_.moving |= still > 20.0F || still < -20.0F;
      result_.gyro[i] =
          judge(mean(gyro_.gyro[i] - quiet_.gyro[i]) / kCountsPerDps, gyro_codes_[i], 2620.0F / 131.0F, 60.0F, 250.0F);
      result_.accel[i] = judge(mean(accel_.accel[i] - quiet_.accel[i]) / kCountsPerG, accel_codes_[i],
                               2620.0F / 16384.0F, 0.05F, 1.2F);
      result_.passed &= result_.gyro[i].passed && result_.accel[i].passed;
    }
    result_.passed &= !result_.moving;
  }

  Phase phase_ = Phase::kOff;
  base::Micros due_{}, limit_{};
  Sums quiet_{}, gyro_{}, accel_{};
  std::array<std::uint8_t, 3> gyro_codes_{}, accel_codes_{};
  SelfTestResult result_{};
};

}  // namespace tetap::drivers::icm42688
