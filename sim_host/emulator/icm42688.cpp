// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/icm42688.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace tetap::board {

namespace {

constexpr double kGravity_mps2 = 9.80665, kDegrees = 180.0 / 3.14159265358979323846;
constexpr std::int32_t kInvalid = -32768 * 16;           // 20-bit packets and registers: no valid sample
constexpr Picoseconds kResetTime = kMillisecond;         // 14.1: wait 1 ms after SOFT_RESET_CONFIG
constexpr Picoseconds kQuiet = 200 * kMicrosecond;       // 14.36: no register writes after a change from OFF
constexpr Picoseconds kGyroStart = 30 * kMillisecond;    // table 1: gyroscope start-up
constexpr Picoseconds kAccelStart = 20 * kMillisecond;   // table 2: accelerometer start-up from OFF
constexpr Picoseconds kPulse = 100 * kMicrosecond;       // 14.53: INT_TPULSE_DURATION = 0
constexpr Picoseconds kFrozen = 1'500 * kMicrosecond;    // ArduPilot pull request 25332: 1 to 2 ms
constexpr double kAfsrThreshold_radps = 100 / kDegrees;  // the same: 100 deg/s
constexpr double kGyroNoise = 2.8e-3 / kDegrees, kAccelNoise = 70e-6 * kGravity_mps2;  // per root hertz, page 1

// 14.37, 14.38: GYRO_ODR and ACCEL_ODR.
constexpr double kOdr_hz[16] = {0, 32'000, 16'000, 8'000, 4'000, 2'000, 1'000, 200, 100, 50, 25, 12.5, 0, 0, 0, 500};

constexpr std::uint8_t kDataReady = 0x08, kFifoThreshold = 0x04, kFifoFull = 0x02, kResetDone = 0x10;  // INT_STATUS

std::int32_t round_to(double value, std::int32_t low, std::int32_t high) {
  if (!(value > low)) return low;
  return value >= high ? high : static_cast<std::int32_t>(std::lround(value));
}

/// A value of the 20-bit scale as 16 bits, rounded; the mark of an invalid sample stays.
std::int32_t to_16_bits(std::int32_t value) { return value == kInvalid ? -32768 : std::min((value + 8) >> 4, 32767); }

}  // namespace

Icm42688::Icm42688(Scheduler& scheduler, Complaints& complaints, const Icm42688Options& options)
    : scheduler_(scheduler),
      complaints_(complaints),
      options_(options),
      sample_(scheduler, [this] { sample(); }),
      reset_done_(scheduler, [this] { bank0(kIntStatus) |= kResetDone; }),
      pulse_end_(scheduler, [this] { set_int1(false); }),
      random_(options.seed) {
  power_on();
}

void Icm42688::power_on() {
  powered_ = scheduler_.now();
  reset_registers();
  bank0(kIntStatus) = kResetDone;
}

void Icm42688::dip() {
  power_on();
  dipped_ = true;
}

// Reset values of section 13, where they are not 0.
void Icm42688::reset_registers() {
  for (auto& bank : registers_) bank.fill(0);
  constexpr std::pair<std::uint8_t, std::uint8_t> kValues[] = {
      {0x13, 0x05},          {kFifoData, 0xFF},     {kIntfConfig0, 0x30}, {kIntfConfig1, 0x91},
      {kGyroConfig0, 0x06},  {kAccelConfig0, 0x06}, {kGyroConfig1, 0x16}, {kGyroAccelConfig0, 0x11},
      {kAccelConfig1, 0x0D}, {kTmstConfig, 0x23},   {0x56, 0x82},         {0x62, 0x10},
      {kIntConfig1, 0x10},   {kIntSource0, 0x10}};
  for (const auto& [address, value] : kValues) bank0(address) = value;
  for (std::uint8_t at = kTempData1; at <= 0x2A; at = static_cast<std::uint8_t>(at + 2)) bank0(at) = 0x80;
  bank0(kWhoAmI) = options_.who_am_i;
  registers_[1][0x0B] = 0xA0;  // GYRO_CONFIG_STATIC2
  registers_[2][0x03] = 0x30;  // ACCEL_CONFIG_STATIC2
  bank_ = 0;
  flush_fifo();
  lost_ = 0;
  sample_.clear();
  next_sample_ = gyro_ready_ = accel_ready_ = kNever;
  last_gyro_.fill(kInvalid);
  last_accel_.fill(kInvalid);
  set_int1(false);
}

void Icm42688::soft_reset() {
  reset_registers();
  reset_done_.set(scheduler_.now() + kResetTime);
}

// Data registers are of type SYNCR: one transfer reads one sample.
void Icm42688::select() {
  phase_ = Phase::kAddress;
  latched_ = registers_[0];
}

void Icm42688::deselect() {
  if (phase_ == Phase::kRead && address_ == kFifoData) end_fifo_read();
  phase_ = Phase::kIdle;
}

// 9.5: the first byte is the address with the read bit on top; then data, the address counts up but for FIFO_DATA.
std::uint8_t Icm42688::exchange(std::uint8_t out) {
  const bool starts = scheduler_.now() < powered_ + kResetTime;
  if (dead || (dipped_ && starts)) return 0xFF;
  if (phase_ == Phase::kAddress) {
    phase_ = (out & 0x80) != 0 ? Phase::kRead : Phase::kWrite;
    address_ = out & 0x7F;
    if (reset_done_.pending() || starts) {
      complain("register access within 1 ms of power-on or soft reset");
    }
    return 0xFF;
  }
  std::uint8_t in = 0xFF;
  if (phase_ == Phase::kRead) {
    in = read(address_);
  } else if (phase_ == Phase::kWrite) {
    write(address_, out);
  }
  if (!(bank_ == 0 && address_ == kFifoData)) address_ = (address_ + 1) & 0x7F;
  return in;
}

std::uint8_t Icm42688::read(std::uint8_t address) {
  if (address == kRegBankSel) return bank_;
  if (bank_ != 0) return registers_[bank_][address];
  switch (address) {
    case kIntStatus: {
      const std::uint8_t status = bank0(kIntStatus);
      bank0(kIntStatus) = 0;  // read to clear
      if ((bank0(kIntConfig) & 4) != 0) set_int1(false);
      return status;
    }
    case kFifoCountH: {
      const std::uint16_t count = fifo_count();
      const bool big = (bank0(kIntfConfig0) & 0x20) != 0;
      latched_count_l_ = static_cast<std::uint8_t>(big ? count : count >> 8);
      return static_cast<std::uint8_t>(big ? count >> 8 : count);
    }
    case kFifoCountL:
      return latched_count_l_;
    case kFifoData:
      return pop_fifo();
    case kFifoLostPkt0:
      return static_cast<std::uint8_t>(lost_);
    case kFifoLostPkt0 + 1:
      return static_cast<std::uint8_t>(lost_ >> 8);
    default:
      return address >= kTempData1 && address < kIntStatus ? latched_[address] : bank0(address);
  }
}

void Icm42688::write(std::uint8_t address, std::uint8_t value) {
  if (scheduler_.now() < mode_changed_ + kQuiet) complain("register written within 200 us of switching a sensor on");
  if (address == kRegBankSel) {
    bank_ = value & 7;
    if (bank_ >= kBanks) {
      complain("no such register bank");
      bank_ = 0;
    }
    return;
  }
  // 12.9: while sensors run, only rates, ranges and modes may change.
  const bool allowed = bank_ == 0 && (address == kGyroConfig0 || address == kAccelConfig0 || address == kPwrMgmt0 ||
                                      address == kSignalPathReset || address == kDeviceConfig);
  if ((gyro_on() || accel_on()) && !allowed) {
    char text[96];
    std::snprintf(text, sizeof text, "register 0x%02X of bank %d written while sensors run", address, bank_);
    complain(text);
  }
  if (bank_ != 0) {
    registers_[bank_][address] = value;
    return;
  }
  write_bank0(address, value);
}

void Icm42688::write_bank0(std::uint8_t address, std::uint8_t value) {
  const std::uint8_t before = bank0(address);
  const bool read_only = (address >= kTempData1 && address <= 0x38) || address == kWhoAmI || address == kFifoLostPkt0 ||
                         address == kFifoLostPkt0 + 1;
  if (read_only) return complain("a read-only register is written");
  switch (address) {
    case kDeviceConfig:
      if ((value & 1) != 0) return soft_reset();
      break;
    case kPwrMgmt0:
      return write_power(value);
    case kSignalPathReset:
      if ((value & 2) != 0) flush_fifo();
      if ((value & 4) != 0) {
        const std::int64_t ticks = chip_time_ns() * 15 / 16 / 1000;
        for (std::uint8_t i = 0; i < 3; ++i) registers_[1][0x62 + i] = static_cast<std::uint8_t>(ticks >> 8 * i);
      }
      return;  // bits clear themselves
    case kFifoConfig:
      if ((before ^ value) >> 6 != 0) flush_fifo();
      break;
    case kGyroConfig0:
    case kAccelConfig0:
      if (((before ^ value) & 0x0F) != 0) odr_changed_ |= address == kGyroConfig0 ? 1 : 2;
      if (kOdr_hz[value & 0x0F] <= 0) complain("reserved output data rate");
      bank0(address) = value;
      return plan_sample();
    case kIntSource0:
      if ((value & 0x0E) != 0 && (bank0(kIntConfig1) & 0x10) != 0) {
        complain("INT1 in use with INT_ASYNC_RESET = 1 (12.6)");
      }
      break;
    default:
      break;
  }
  bank0(address) = value;
}

void Icm42688::write_power(std::uint8_t value) {
  const bool gyro_was = gyro_on(), accel_was = accel_on();
  bank0(kPwrMgmt0) = value;
  const Picoseconds now = scheduler_.now();
  if ((value & 3) == 1 || (value >> 2 & 3) == 2) complain("PWR_MGMT0 with a reserved mode");
  if ((value & 3) == 2) complain("accelerometer in low-power mode: not modelled");
  if (gyro_on() && !gyro_was) gyro_ready_ = now + kGyroStart;
  if (accel_on() && !accel_was) accel_ready_ = now + kAccelStart;
  if ((gyro_on() && !gyro_was) || (accel_on() && !accel_was)) mode_changed_ = now;
  if (!gyro_on()) gyro_ready_ = kNever;
  if (!accel_on()) accel_ready_ = kNever;
  for (Filter& one : gyro_filters_) one = {};
  for (Filter& one : accel_filters_) one = {};
  plan_sample();
}

double Icm42688::odr_hz() const {
  const double gyro = gyro_on() ? kOdr_hz[bank0(kGyroConfig0) & 0x0F] : 0;
  const double accel = accel_on() ? kOdr_hz[bank0(kAccelConfig0) & 0x0F] : 0;
  return std::max(gyro, accel);
}

void Icm42688::plan_sample() {
  const double hz = odr_hz();
  if (hz <= 0) return sample_.clear();
  if (gyro_on() && accel_on() && (bank0(kGyroConfig0) & 0x0F) != (bank0(kAccelConfig0) & 0x0F)) {
    complain("two output data rates: only the faster one is modelled");
  }
  const auto period = static_cast<Picoseconds>(1e12 / hz / (1 + options_.clock_error));
  next_sample_ = sample_.pending() ? std::min(sample_.at(), scheduler_.now() + period) : scheduler_.now() + period;
  sample_.set(next_sample_);
}

// 14.40 and 14.39: bandwidth in parts of the rate, order 1 to 3; one-pole stages in a row with the same 3 dB point.
double Icm42688::filter_gain(int bandwidth_code, int order, double hz) {
  constexpr double kParts[8] = {2, 4, 5, 8, 10, 16, 20, 40};
  if (bandwidth_code >= 8 || bandwidth_code == 0) return 1;
  const double base_hz = std::max(400.0, hz);
  const double corner_hz = base_hz / kParts[bandwidth_code] / std::sqrt(std::pow(2.0, 1.0 / order) - 1);
  return 1 - std::exp(-2 * 3.14159265358979323846 * corner_hz / hz);
}

double Icm42688::filtered(Filter& filter, double value, int bandwidth_code, int order, double hz) {
  if (bandwidth_code >= 8 || bandwidth_code == 0) return value;
  const double gain = filter_gain(bandwidth_code, order, hz);
  for (int i = 0; i < order; ++i) {
    double& stage = filter.stages[static_cast<std::size_t>(i)];
    stage = filter.begun ? stage + gain * (value - stage) : value;
    value = stage;
  }
  filter.begun = true;
  return value;
}

// Results are in the 20-bit scale: 1/16 of a 16-bit step at the full-scale range that is set.
void Icm42688::measure(std::array<std::int32_t, 3>& gyro, std::array<std::int32_t, 3>& accel, double& temperature_c) {
  const Picoseconds now = scheduler_.now();
  ImuTruth truth;
  if (world) truth = world(now);
  temperature_c = truth.temperature_c;
  const double hz = odr_hz();
  const double range_radps = 2000.0 / kDegrees / (1 << (bank0(kGyroConfig0) >> 5));
  const double range_mps2 = 16 * kGravity_mps2 / (1 << (bank0(kAccelConfig0) >> 5));
  const double spread = options_.noise ? std::sqrt(hz / 2) : 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const double rate = truth.rate_radps[i] + spread * kGyroNoise * static_cast<double>(random_.normal());
    const double force = truth.force_mps2[i] + spread * kAccelNoise * static_cast<double>(random_.normal());
    const double w = filtered(gyro_filters_[i], rate, bank0(kGyroAccelConfig0) & 0x0F,
                              std::min(2, bank0(kGyroConfig1) >> 2 & 3) + 1, hz);
    const double f = filtered(accel_filters_[i], force, bank0(kGyroAccelConfig0) >> 4,
                              std::min(2, bank0(kAccelConfig1) >> 3 & 3) + 1, hz);
    gyro[i] = round_to(w / range_radps * 524288, -32767 * 16, 32767 * 16 + 15);
    accel[i] = round_to(f / range_mps2 * 524288, -32767 * 16, 32767 * 16 + 15);
  }
  double fastest = 0;
  for (const double rate : truth.rate_radps) fastest = std::max(fastest, std::fabs(rate));
  const bool fast = fastest > kAfsrThreshold_radps;
  if (fast != fast_ && (bank0(kIntfConfig1) >> 6) != 1) frozen_until_ = now + kFrozen;
  fast_ = fast;
  if (now < frozen_until_ || truth.stuck) gyro = last_gyro_;
  if (truth.stuck) accel = last_accel_;
  if (now < gyro_ready_) gyro.fill(kInvalid);
  if (now < accel_ready_) accel.fill(kInvalid);
}

void Icm42688::sample() {
  const auto period = static_cast<Picoseconds>(1e12 / odr_hz() / (1 + options_.clock_error));
  next_sample_ += period;
  sample_.set(next_sample_);
  if (dead || stalled) return;
  ++samples_;
  std::array<std::int32_t, 3> gyro{}, accel{};
  double temperature_c = 25;
  measure(gyro, accel, temperature_c);
  last_gyro_ = gyro;
  last_accel_ = accel;
  store_registers(gyro, accel, temperature_c);
  if (on_reading && gyro[0] != kInvalid && accel[0] != kInvalid) report_reading(gyro, accel, temperature_c);
  if ((bank0(kFifoConfig) >> 6) != 0 && (bank0(kFifoConfig1) & 3) != 0) push_packet(gyro, accel, temperature_c);
  std::uint8_t events = kDataReady;
  const std::uint32_t watermark = bank0(kFifoConfig2) | (bank0(kFifoConfig3) & 0x0FU) << 8;
  const std::size_t filled = (bank0(kIntfConfig0) & 0x40) != 0 ? fifo_.size() : fifo_bytes();
  if (watermark != 0 && filled >= watermark) events |= kFifoThreshold;
  if (fifo_bytes() + (fifo_.empty() ? 0 : fifo_.back().size) > kFifoBytes) events |= kFifoFull;
  raise(events);
}

// A stage of one pole lags by (1 - gain) / gain samples at 0 Hz.
void Icm42688::report_reading(const std::array<std::int32_t, 3>& gyro, const std::array<std::int32_t, 3>& accel,
                              double temperature_c) const {
  const double hz = odr_hz() * (1 + options_.clock_error);
  const int order = std::min(2, bank0(kGyroConfig1) >> 2 & 3) + 1;
  const double gain = filter_gain(bank0(kGyroAccelConfig0) & 0x0F, order, odr_hz());
  Reading reading{.time = scheduler_.now(),
                  .delay = static_cast<Picoseconds>(order * (1 - gain) / gain / hz * 1e12),
                  .temperature_c = temperature_c};
  const double range_radps = 2000.0 / kDegrees / (1 << (bank0(kGyroConfig0) >> 5));
  const double range_mps2 = 16 * kGravity_mps2 / (1 << (bank0(kAccelConfig0) >> 5));
  for (std::size_t i = 0; i < 3; ++i) {
    reading.rate_radps[i] = gyro[i] * range_radps / 524288;
    reading.force_mps2[i] = accel[i] * range_mps2 / 524288;
  }
  on_reading(reading);
}

void Icm42688::put16(std::uint8_t address, std::int32_t value) {
  const bool big = (bank0(kIntfConfig0) & 0x10) != 0;
  const auto high = static_cast<std::uint8_t>(value >> 8), low = static_cast<std::uint8_t>(value);
  bank0(address) = big ? high : low;
  bank0(static_cast<std::uint8_t>(address + 1)) = big ? low : high;
}

// 4.13: temperature in degrees is the value / 132.48 + 25.
void Icm42688::store_registers(const std::array<std::int32_t, 3>& gyro, const std::array<std::int32_t, 3>& accel,
                               double t_c) {
  put16(kTempData1, round_to((t_c - 25) * 132.48, -32767, 32767));
  for (std::uint8_t i = 0; i < 3; ++i) {
    put16(static_cast<std::uint8_t>(kAccelDataX1 + 2 * i), to_16_bits(accel[i]));
    put16(static_cast<std::uint8_t>(kGyroDataX1 + 2 * i), to_16_bits(gyro[i]));
  }
}

std::int64_t Icm42688::chip_time_ns() const {
  const auto since_ns = (scheduler_.now() - powered_) / 1000;
  return since_ns + static_cast<std::int64_t>(static_cast<double>(since_ns) * options_.clock_error);
}

// 12.7: a step of 1 us lasts 32/30 us (with the internal clock); TMST_RES = 1: 16 steps.
std::uint16_t Icm42688::timestamp() const {
  const std::int64_t ticks = chip_time_ns() * 15 / 16 / 1000;
  return static_cast<std::uint16_t>((bank0(kTmstConfig) & 8) != 0 ? ticks / 16 : ticks);
}

// 6.1: packets 1 to 4 and their header.
void Icm42688::push_packet(const std::array<std::int32_t, 3>& gyro, const std::array<std::int32_t, 3>& accel,
                           double t_c) {
  const std::uint8_t content = bank0(kFifoConfig1);
  const bool wide = (content & 0x10) != 0, with_accel = wide || (content & 1) != 0,
             with_gyro = wide || (content & 2) != 0;
  const bool stamped = (bank0(kTmstConfig) & 1) != 0 && with_accel && with_gyro;
  Packet packet;
  const auto put = [&packet](std::int32_t byte) { packet.bytes[packet.size++] = static_cast<std::uint8_t>(byte); };
  const bool big = (bank0(kIntfConfig0) & 0x10) != 0;
  const auto put_pair = [&](std::int32_t value) {
    put(big ? value >> 8 : value);
    put(big ? value : value >> 8);
  };
  put((with_accel ? 0x40 : 0) | (with_gyro ? 0x20 : 0) | (wide ? 0x10 : 0) | (stamped ? 0x08 : 0) |
      ((odr_changed_ & 2) != 0 ? 2 : 0) | ((odr_changed_ & 1) != 0 ? 1 : 0));
  odr_changed_ = 0;
  // 20-bit packets are fixed to 2000 deg/s and 16 g, whatever the ranges.
  const auto widest = [](std::array<std::int32_t, 3> values, int shift) {
    for (std::int32_t& one : values) one = one == kInvalid ? kInvalid : one >> shift;
    return values;
  };
  const auto wide_gyro = widest(gyro, bank0(kGyroConfig0) >> 5), wide_accel = widest(accel, bank0(kAccelConfig0) >> 5);
  for (std::size_t i = 0; with_accel && i < 3; ++i) put_pair(wide ? wide_accel[i] >> 4 : to_16_bits(accel[i]));
  for (std::size_t i = 0; with_gyro && i < 3; ++i) put_pair(wide ? wide_gyro[i] >> 4 : to_16_bits(gyro[i]));
  if (wide) {
    put_pair(round_to((t_c - 25) * 132.48, -32767, 32767));
  } else {
    put(round_to((t_c - 25) * 2.07, -127, 127));
  }
  if (with_accel && with_gyro) {
    const std::uint16_t now = timestamp();
    put_pair((bank0(kTmstConfig) & 1) == 0   ? 0
             : (bank0(kTmstConfig) & 4) != 0 ? static_cast<std::uint16_t>(now - last_timestamp_)
                                             : now);
    last_timestamp_ = now;
  }
  for (std::size_t i = 0; wide && i < 3; ++i) {
    put((wide_accel[i] & 0xC) << 4 | (wide_gyro[i] & 0xE));
  }
  const bool stop_on_full = (bank0(kFifoConfig) >> 6) >= 2;
  while (fifo_bytes() + packet.size > kFifoBytes) {
    lost_ = std::min<std::uint32_t>(lost_ + 1, 0xFFFF);
    if (stop_on_full) return;
    fifo_.pop_front();
    read_in_packet_ = 0;
  }
  fifo_.push_back(packet);
}

std::size_t Icm42688::fifo_bytes() const {
  return fifo_.empty() ? 0 : fifo_.size() * fifo_.front().size - read_in_packet_;
}

std::uint16_t Icm42688::fifo_count() const {
  const bool records = (bank0(kIntfConfig0) & 0x40) != 0;
  return static_cast<std::uint16_t>(records ? fifo_.size() : fifo_bytes());
}

std::uint8_t Icm42688::pop_fifo() {
  if (fifo_.empty()) return 0xFF;  // HEADER_MSG = 1: the FIFO is empty
  const std::uint8_t byte = fifo_.front().bytes[read_in_packet_++];
  if (read_in_packet_ == fifo_.front().size) {
    fifo_.pop_front();
    read_in_packet_ = 0;
  }
  return byte;
}

// 14.48, FIFO_RESUME_PARTIAL_RD = 0: a packet that was read in part is read again from its beginning.
void Icm42688::end_fifo_read() {
  if (read_in_packet_ == 0 || (bank0(kFifoConfig1) & 0x40) != 0) return;
  complain("a FIFO packet was read in part");
  read_in_packet_ = 0;
}

void Icm42688::flush_fifo() {
  fifo_.clear();
  read_in_packet_ = 0;
}

void Icm42688::raise(std::uint8_t bits) {
  bank0(kIntStatus) |= bits;
  if ((bits & bank0(kIntSource0) & 0x1F) == 0) return;
  set_int1(true);
  if ((bank0(kIntConfig) & 4) == 0) pulse_end_.set(scheduler_.now() + kPulse);
}

void Icm42688::set_int1(bool active) {
  int1_ = active;
  const bool active_high = (bank0(kIntConfig) & 1) != 0;
  if (on_int1) on_int1(active == active_high);
}

}  // namespace tetap::board
