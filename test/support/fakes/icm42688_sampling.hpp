// SPDX-License-Identifier: Apache-2.0
// The fake ICM-42688-P's sensor side: time, samples, FIFO packets, interrupts. Included by icm42688.hpp.
#pragma once

#include "support/fakes/icm42688.hpp"

#include <algorithm>
#include <cmath>

namespace tetap::fakes {

inline void Icm42688::advance(base::Micros now) {
  if (now <= host_) return;
  const std::int64_t rate = 1'000'000 + clock_error_ppm_;  // chip picoseconds in a host microsecond
  const Picos start = chip_ps_;
  const Picos target = start + (now - host_).us * rate;
  while (true) {
    const Picos never = std::numeric_limits<Picos>::max();
    const Picos due = std::min(gyro_.next.value_or(never), accel_.next.value_or(never));
    if (due > target) break;
    chip_ps_ = due;
    sample(due, 1e-6 * (static_cast<double>(host_.us) + static_cast<double>(due - start) / static_cast<double>(rate)));
  }
  chip_ps_ = target;
  host_ = now;
}

/// When each sensor samples next: on the grid of its rate, after its start-up, if it makes that rate and has a clock.
/// 14.35: CLKSEL 3 stops all clocks, RTC_MODE waits for an external clock that this board does not have.
inline void Icm42688::schedule() {
  using namespace icm42688;
  const bool clocked = (registers_[kIntfConfig1] & 0x03) != 0x03 && (registers_[kIntfConfig1] & 0x04) == 0;
  const auto next = [&](const Sensor& sensor, std::uint8_t odr, bool made) -> std::optional<Picos> {
    if (!sensor.on || !clocked || !made) return std::nullopt;
    const Picos period = odr_period(odr).value_or(kMillisecond);
    const Picos earliest = std::max(sensor.ready, chip_ps_ + 1) - odr_origin_;
    return odr_origin_ + (earliest + period - 1) / period * period;
  };
  const std::uint8_t gyro_odr = registers_[kGyroConfig0] & 0x0F;
  const std::uint8_t accel_odr = registers_[kAccelConfig0] & 0x0F;
  gyro_.next = next(gyro_, gyro_odr, gyro_makes(gyro_odr));
  accel_.next = next(accel_, accel_odr, accel_makes(accel_odr, accel_low_power()));
}

/// A boxcar of twice the group delay: the delay of the true filter, and about its bandwidth.
inline Icm42688::Motion Icm42688::filtered(double host_s, double delay_s) const {
  if (!filters_) return motion_(host_s);
  constexpr int kPoints = 8;
  Motion mean{.specific_force_mps2 = {}, .temperature_degC = 0.0};
  for (int k = 0; k < kPoints; ++k) {
    const Motion m = motion_(host_s - 2.0 * delay_s * (k + 0.5) / kPoints);
    for (std::size_t i = 0; i < 3; ++i) {
      mean.rate_radps[i] += m.rate_radps[i] / kPoints;
      mean.specific_force_mps2[i] += m.specific_force_mps2[i] / kPoints;
    }
    mean.temperature_degC += m.temperature_degC / kPoints;
  }
  return mean;
}

inline void Icm42688::sample(Picos at, double host_s) {
  using namespace icm42688;
  const bool gyro_new = gyro_.next == at;
  const bool accel_new = accel_.next == at;
  const std::uint8_t gyro0 = registers_[kGyroConfig0];
  const std::uint8_t accel0 = registers_[kAccelConfig0];
  std::array<std::uint8_t, 9> offset_bytes{};
  for (std::uint8_t i = 0; i < 9; ++i) offset_bytes[i] = registers_.at(4, static_cast<std::uint8_t>(kOffsetUser0 + i));
  const UserOffsets offsets = user_offsets(offset_bytes);

  const auto take_axes = [&](Sensor& sensor, const std::array<double, 3>& felt, const std::array<double, 3>& offset,
                             const std::array<Settling, 3>& test, double full_scale, double wide_scale,
                             int first_axis) {
    for (std::size_t i = 0; i < 3; ++i) {
      const int axis = first_axis + static_cast<int>(i);
      const bool weak = has(Fault::kSelfTestFails) && detail(Fault::kSelfTestFails).axis == axis;
      double value = felt[i] + offset[i] + test[i].at(at) * (weak ? 0.2 : 1.0);
      if (has(Fault::kAxisStuck) && detail(Fault::kAxisStuck).axis == axis) {
        std::optional<double>& frozen = frozen_[static_cast<std::size_t>(axis)];
        if (!frozen) frozen = value;
        value = *frozen;
      }
      sensor.of_full_scale[i] = value / full_scale;
      sensor.of_20_bit_scale[i] = value / wide_scale;
    }
    sensor.sampled = true;
  };
  if (gyro_new) {
    ++counters_.gyro_samples;
    const double delay_s =
        group_delay_s(gyro0 & 0x0F, registers_[kGyroAccelConfig0] & 0x0F, registers_[kGyroConfig1] >> 2 & 0x03);
    const std::array<double, 3> rate_radps = filtered(host_s, delay_s).rate_radps;
    if (!switches_range(at, rate_radps)) {
      take_axes(gyro_, rate_radps, offsets.rate_radps, gyro_test_, gyro_full_scale_radps(gyro0),
                gyro_full_scale_radps(0), 0);
    }
    *gyro_.next += odr_period(gyro0).value_or(kMillisecond);
  }
  if (accel_new) {
    ++counters_.accel_samples;
    const double delay_s =
        group_delay_s(accel0 & 0x0F, registers_[kGyroAccelConfig0] >> 4, registers_[kAccelConfig1] >> 3 & 0x03);
    take_axes(accel_, filtered(host_s, delay_s).specific_force_mps2, offsets.specific_force_mps2, accel_test_,
              accel_full_scale_mps2(accel0), accel_full_scale_mps2(0), 3);
    *accel_.next += odr_period(accel0).value_or(kMillisecond);
  }
  if ((registers_[kPwrMgmt0] & 0x20) == 0) {  // 4.13: temperature at the higher of the two rates
    temperature_degC_ = motion_(host_s).temperature_degC;
    temperature_sampled_ = true;
  }
  last_sample_s_ = host_s;
  registers_[kIntStatus] |= kDataReady;
  write_packet(at, accel_new, gyro_new);
  last_odr_ = at;
}

/// Not in the sheet (ArduPilot issues 25025 and 25332). Unless bits 7:6 of INTF_CONFIG1 are 01, the gyroscope repeats
/// its last values for up to 2 ms after an axis passed 100 deg/s.
inline bool Icm42688::switches_range(Picos at, const std::array<double, 3>& rate_radps) {
  using namespace icm42688;
  constexpr double kLimit_radps = 100.0 * 3.14159265358979 / 180.0;
  bool passed = false;
  for (std::size_t i = 0; i < 3; ++i)
    passed |= (std::abs(rate_radps[i]) > kLimit_radps) != (std::abs(rate_before_[i]) > kLimit_radps);
  rate_before_ = rate_radps;
  if ((registers_[kIntfConfig1] & 0xC0) == 0x40 || !gyro_.sampled) return false;
  if (passed) switching_until_ = at + 2 * kMillisecond;
  return at < switching_until_;
}

/// 12.7: the counter runs at 30/32 of a microsecond's rate, so "timestamp interval reported in FIFO requires scaling by
/// a factor of 32/30"; TMST_RES = 1 counts in sixteens.
inline std::uint64_t Icm42688::stamp_counts(Picos at) const {
  Picos passed = std::max<Picos>(at - stamp_origin_, 0);
  if (has(Fault::kStampClockOff)) passed += passed / 1'000'000 * detail(Fault::kStampClockOff).ppm;
  const bool sixteen = (registers_[icm42688::kTmstConfig] & 0x08) != 0;
  const Picos unit = 32 * icm42688::kMicrosecond;
  const auto counts = static_cast<std::uint64_t>(passed / unit * 30 + passed % unit * 30 / unit);
  return sixteen ? counts / 16 : counts;
}

inline void Icm42688::put(std::vector<std::uint8_t>& packet, int value) const {  // 14.34 SENSOR_DATA_ENDIAN
  const auto high = static_cast<std::uint8_t>(value >> 8);
  const auto low = static_cast<std::uint8_t>(value);
  packet.push_back(big_endian() ? high : low);
  packet.push_back(big_endian() ? low : high);
}

/// 6.1, 6.2, 6.4. A sensor that is in the packet but has no new sample is marked invalid, or repeats its last valid one
/// (12.8). Cases: "when accel and gyro are enabled with different ODRs", one is off, one still starts up. The header's
/// stamp bits are 11 only for the packet after an FSYNC edge, as 6.2 says. The table of 6.4 prints 11 for all packets
/// once FIFO_TMST_FSYNC_EN is set.
inline void Icm42688::write_packet(Picos at, bool accel_new, bool gyro_new) {
  using namespace icm42688;
  const std::uint8_t content = registers_[kFifoConfig1];
  const std::uint8_t tmst = registers_[kTmstConfig];
  const bool wide = (content & 0x10) != 0;
  const bool with_accel = wide || (content & 0x01) != 0;
  const bool with_gyro = wide || (content & 0x02) != 0;
  if ((registers_[kFifoConfig] & 0xC0) == 0 || !((with_accel && accel_new) || (with_gyro && gyro_new))) return;
  if (has(Fault::kFifoStuck)) return;
  if (has(Fault::kSamplesLost) && ++packets_under_fault_ % detail(Fault::kSamplesLost).every == 0) return;

  std::uint8_t header = static_cast<std::uint8_t>((with_accel ? 0x40 : 0) | (with_gyro ? 0x20 : 0) | (wide ? 0x10 : 0));
  const bool with_stamp = with_accel && with_gyro && (tmst & 0x01) != 0;
  std::uint64_t stamp = with_stamp ? stamp_counts(at) : 0;
  if (with_stamp) {
    header |= 0x08;
    if ((tmst & 0x04) != 0) stamp -= stamp_counts(last_odr_);  // 14.42 TMST_DELTA_EN: since the last ODR
    const bool pin9_is_fsync = (registers_.at(1, kIntfConfig5) & 0x06) == 0x02;
    if (fsync_ && pin9_is_fsync && (tmst & 0x02) != 0 && (content & 0x08) != 0) {
      header |= 0x04;
      stamp = stamp_counts(at) - stamp_counts(*fsync_);
    }
    fsync_.reset();
  }
  const auto note_odr = [&](Sensor& sensor, bool counts, std::uint8_t config0, std::uint8_t bit) {
    if (!counts) return;
    const std::uint8_t odr = config0 & 0x0F;
    if (sensor.packet_odr && *sensor.packet_odr != odr) header |= bit;
    sensor.packet_odr = odr;
  };
  note_odr(accel_, with_accel && accel_new, registers_[kAccelConfig0], 0x02);
  note_odr(gyro_, with_gyro && gyro_new, registers_[kGyroConfig0], 0x01);

  std::vector<std::uint8_t> packet{header};
  std::array<std::uint8_t, 3> extension{};
  const std::uint8_t off = registers_.at(1, kSensorConfig0);  // 15.1: bits 2:0 accelerometer, 5:3 gyroscope
  const auto axes = [&](const Sensor& sensor, bool is_new, int off_bits, int zero_bits, int shift) {
    for (std::size_t i = 0; i < 3; ++i) {
      const bool valid = is_new && (off_bits >> i & 1) == 0;
      int value = wide ? to_20_bits(sensor.of_20_bit_scale[i], zero_bits, hold_last())
                       : to_16_bits(sensor.of_full_scale[i], hold_last());
      if (!valid && hold_last() && !sensor.sampled) value = 0;
      if (!valid && !hold_last()) value = wide ? kInvalid20 : kInvalid16;
      put(packet, wide ? value >> 4 : value);
      if (wide) extension[i] = static_cast<std::uint8_t>(extension[i] | (value & 0x0F) << shift);
    }
  };
  if (with_accel) axes(accel_, accel_new, off & 0x07, 2, 4);
  if (with_gyro) axes(gyro_, gyro_new, off >> 3 & 0x07, 1, 0);

  const bool warm = temperature_sampled_ && (content & 0x04) != 0;
  const int no_value = hold_last() ? 0 : wide ? kInvalid16 : kInvalid8;
  if (wide) {
    put(packet, warm ? temperature_16_bits(temperature_degC_) : no_value);
  } else {
    packet.push_back(static_cast<std::uint8_t>(warm ? temperature_8_bits(temperature_degC_) : no_value));
  }
  if (with_accel && with_gyro) put(packet, static_cast<int>(stamp & 0xFFFF));
  if (wide) packet.insert(packet.end(), extension.begin(), extension.end());

  fifo_.write(std::move(packet), (registers_[kFifoConfig] & 0xC0) == 0x40);
  ++counters_.packets_written;
  if (fifo_.full()) registers_[kIntStatus] |= kFifoFull;
  update_threshold(true);
}

inline int Icm42688::watermark() const {
  return registers_[icm42688::kFifoConfig2] | (registers_[icm42688::kFifoConfig3] & 0x0F) << 8;
}

/// 14.46: "Generate interrupt when the FIFO reaches or exceeds FIFO_WM size ... Interrupt only fires once", or with
/// FIFO_WM_GT_TH (14.45) at every packet while it does.
inline void Icm42688::update_threshold(bool packet_written) {
  using namespace icm42688;
  const bool reached = watermark() != 0 && fifo_count() >= watermark();
  const bool every_packet = (registers_[kFifoConfig1] & 0x20) != 0;
  if (packet_written && reached && (every_packet || !threshold_passed_)) registers_[kIntStatus] |= kFifoThreshold;
  threshold_passed_ = reached;
}

}  // namespace tetap::fakes
