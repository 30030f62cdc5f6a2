// SPDX-License-Identifier: Apache-2.0
// The fake ICM-42688-P's serial side: transactions, registers, commands, faults of the bus. Included by icm42688.hpp.
#pragma once

#include "support/fakes/icm42688.hpp"

#include <algorithm>

namespace tetap::fakes {

/// Whether a bus fault acts on this transfer: it may begin late and end by itself.
inline bool Icm42688::strikes(Fault fault) {
  if (!has(fault)) return false;
  const FaultDetail& d = detail(fault);
  const int nth = struck_[index(fault)]++;
  return nth >= d.after_transfers && (d.transfers < 0 || nth < d.after_transfers + d.transfers);
}

inline bool Icm42688::transfer(std::span<const std::uint8_t> out, std::span<std::uint8_t> in) {
  using namespace icm42688;
  if (before_transfer_) before_transfer_();
  ++counters_.transfers;
  if (strikes(Fault::kBusDead) || out.empty()) return false;
  if (strikes(Fault::kBusStuckLow)) return std::ranges::fill(in, std::uint8_t{0x00}), true;
  if (strikes(Fault::kBusStuckHigh)) return std::ranges::fill(in, std::uint8_t{0xFF}), true;

  std::vector<std::uint8_t> sent(out.begin(), out.end());
  if (strikes(Fault::kWrittenBitFlips)) flip(sent, detail(Fault::kWrittenBitFlips).rate);
  const bool reads = (sent[0] & 0x80) != 0;
  std::ranges::fill(in, std::uint8_t{0xFF});  // nobody drives SDO
  if (deaf_ || chip_ps_ < reset_until_) {
    if (!deaf_ && reset_by_host_) break_rule(Rule::kNoAccessDuringReset);
    return true;
  }
  if (!reads) {
    if (sent.size() > 1) write(sent[0], sent[1]);
    if (sent.size() + in.size() > 2) break_rule(Rule::kSingleWrites);
    return true;
  }

  // 9.6 burst read: the address counts up, and stays at FIFO_DATA so that a burst empties the FIFO. Bytes clocked while
  // the host still sends are read too, and lost.
  const bool bank_0 = (registers_[kRegBankSel] & 0x07) == 0;
  std::uint8_t address = sent[0] & 0x7F;
  fifo_.begin_burst();
  for (std::size_t i = 1; i < sent.size() + in.size(); ++i) {
    std::uint8_t value = 0;
    if (bank_0 && address == kFifoData) {
      bool beyond_end = false;
      value = fifo_.next(beyond_end);
      ++counters_.fifo_bytes_read;
      counters_.fifo_bytes_beyond_end += beyond_end ? 1 : 0;
    } else {
      value = read(address);
      address = static_cast<std::uint8_t>((address + 1) & 0x7F);
    }
    if (i >= sent.size()) in[i - sent.size()] = value;
  }
  if (!has(Fault::kFifoStuck)) {
    fifo_.end_burst((registers_[kFifoConfig1] & 0x40) != 0, announced_bytes_);
    update_threshold(false);
  }
  // 15.17: in 3-wire mode the chip talks on SDI, and this host listens to SDO.
  if ((registers_.at(1, kIntfConfig4) & 0x02) == 0) std::ranges::fill(in, std::uint8_t{0xFF});
  if (strikes(Fault::kBitFlips)) flip(in, detail(Fault::kBitFlips).rate);
  return true;
}

inline void Icm42688::flip(std::span<std::uint8_t> bytes, double rate) {
  for (std::uint8_t& byte : bytes) {
    for (int bit = 0; bit < 8; ++bit) {
      if (static_cast<double>(noise_.next()) < rate * 4294967296.0) byte = static_cast<std::uint8_t>(byte ^ 1 << bit);
    }
  }
}

inline std::uint8_t Icm42688::read(std::uint8_t address) {
  using namespace icm42688;
  ++counters_.register_reads;
  const std::uint8_t bank = registers_[kRegBankSel] & 0x07;
  if (address == kRegBankSel) return registers_[kRegBankSel];
  if (bank >= RegisterFile::kBanks) return 0;
  if (bank == 1 && address >= kTmstVal0 && address < kTmstVal0 + 3) {
    return (registers_[kTmstConfig] & 0x10) != 0 ? registers_.at(1, address)
                                                 : std::uint8_t{0};  // 14.42 TMST_TO_REGS_EN
  }
  if (bank != 0) return registers_.at(bank, address);

  if (address >= kTempData1 && address < kGyroDataX1 + 6) return sense_register(address);
  switch (address) {
    case kIntStatus:  // 14.21: "clears to 0 after the register has been read"
      return std::exchange(registers_[kIntStatus], std::uint8_t{0});
    case kFifoCountH:  // 14.22: "Reading this byte latches the data for both"
      latched_count_ = fifo_count();
      announced_bytes_ = fifo_.bytes();
      return high_byte_first() ? static_cast<std::uint8_t>(latched_count_ >> 8)
                               : static_cast<std::uint8_t>(latched_count_);
    case kFifoCountL:
      return high_byte_first() ? static_cast<std::uint8_t>(latched_count_)
                               : static_cast<std::uint8_t>(latched_count_ >> 8);
    case kFifoLostPkt0:  // 14.55 says low byte here, the table of 13.1 says high byte: the description is followed
      return static_cast<std::uint8_t>(fifo_.lost());
    case kFifoLostPkt1:
      return static_cast<std::uint8_t>(fifo_.lost() >> 8);
    case kWhoAmI:
      return has(Fault::kWrongIdentity) ? detail(Fault::kWrongIdentity).value : registers_[kWhoAmI];
    default:
      return registers_[address];
  }
}

inline std::uint16_t Icm42688::fifo_count() const {  // 14.34 FIFO_COUNT_REC
  const bool in_records = (registers_[icm42688::kIntfConfig0] & 0x40) != 0;
  return static_cast<std::uint16_t>(in_records ? fifo_.records() : fifo_.bytes());
}

/// 14.5 to 14.18, 12.8: before the first sample -32768, or 0 with FIFO_HOLD_LAST_DATA_EN; afterwards the last valid
/// one.
inline std::uint8_t Icm42688::sense_register(std::uint8_t address) const {
  using namespace icm42688;
  const int word = (address - kTempData1) / 2;  // 0 temperature, 1 to 3 accelerometer, 4 to 6 gyroscope
  int value = hold_last() ? 0 : kInvalid16;
  if (word == 0 && temperature_sampled_) value = temperature_16_bits(temperature_degC_);
  const Sensor& sensor = word <= 3 ? accel_ : gyro_;
  if (word > 0 && sensor.sampled) {
    value = to_16_bits(sensor.of_full_scale[static_cast<std::size_t>((word - 1) % 3)], hold_last());
  }
  const bool first_byte = (address - kTempData1) % 2 == 0;
  return static_cast<std::uint8_t>(first_byte == big_endian() ? value >> 8 : value);
}

inline void Icm42688::write(std::uint8_t address, std::uint8_t value) {
  using namespace icm42688;
  ++counters_.register_writes;
  if (chip_ps_ < quiet_until_) return break_rule(Rule::kNoWriteInQuietTime);
  const std::uint8_t bank = registers_[kRegBankSel] & 0x07;
  const Register* r = bank < RegisterFile::kBanks || address == kRegBankSel ? find_register(bank, address) : nullptr;
  if (r == nullptr) return break_rule(Rule::kRegisterExists);
  if (r->access == Access::kReadOnly || r->access == Access::kClearOnRead) return break_rule(Rule::kReadOnlyNotWritten);
  check_write(*r, value);
  if (has(Fault::kRegisterRefuses)) {
    const FaultDetail& d = detail(Fault::kRegisterRefuses);
    if (d.bank == r->bank && d.address == address) return;
  }
  if (r->access == Access::kCommand) return command(value);
  take(r->bank, address, value);
}

/// The rules that hold whatever the register.
inline void Icm42688::check_write(const icm42688::Register& r, std::uint8_t value) {
  using namespace icm42688;
  if (((value ^ r.reset) & ~r.settable & 0xFF) != 0) break_rule(Rule::kReservedBitsKept);
  if (r.access == Access::kCommand || r.address == kRegBankSel) {
    if (r.address == kRegBankSel && (value & 0x07) >= RegisterFile::kBanks) break_rule(Rule::kNoReservedValue);
    return;
  }
  // 12.9; 6.4 lets FIFO_CONFIG1 change while the FIFO fills, and self test (4.9) and reset (14.1) need running sensors.
  constexpr std::array kFree = {kDeviceConfig, kPwrMgmt0, kGyroConfig0, kAccelConfig0, kFifoConfig1, kSelfTestConfig};
  const bool free = r.bank == 0 && std::ranges::find(kFree, r.address) != kFree.end();
  if (sensors_on() && !free && value != registers_.at(r.bank, r.address)) break_rule(Rule::kNoChangeWhileRunning);
  if (r.bank != 0) return;
  if (r.address == kGyroConfig0 && !gyro_makes(value & 0x0F)) break_rule(Rule::kNoReservedValue);
  if (r.address == kAccelConfig0 && ((value & 0x0F) == 0 || value >= 0x80)) break_rule(Rule::kNoReservedValue);
  if (r.address == kPwrMgmt0 && (value & 0x0C) == 0x08) break_rule(Rule::kNoReservedValue);
}

/// A register has a new value, by the host's hand or by a fault: what follows from it.
inline void Icm42688::take(std::uint8_t bank, std::uint8_t address, std::uint8_t value) {
  using namespace icm42688;
  const std::uint8_t before = std::exchange(registers_.at(bank, address), value);
  if (bank == 1 && address == kSensorConfig0) schedule();
  if (bank != 0) return;
  switch (address) {
    case kDeviceConfig:
      if ((value & 0x01) != 0) {
        ++counters_.resets;
        reset(chip_ps_ + kResetTime);
        reset_by_host_ = true;
      } else if ((value & 0x10) != 0) {
        deaf_ = true;  // 14.1 SPI_MODE: it listens in modes 1 and 2 only, and this bus is mode 0 or 3
      }
      break;
    case kIntfConfig0:
      if ((value & 0x03) == 0x02) deaf_ = true;  // 14.34 UI_SIFS_CFG: "Disable SPI"
      break;
    case kFifoConfig:
      if ((value & 0xC0) == 0) fifo_.clear();
      break;
    case kPwrMgmt0:
      power_mode(before, value);
      schedule();
      break;
    case kGyroConfig0:
    case kAccelConfig0:
    case kIntfConfig1:
      schedule();
      break;
    case kSelfTestConfig:
      self_test(value);
      break;
    default:
      break;
  }
  const bool rate_matters = address == kPwrMgmt0 || address == kAccelConfig0;
  const std::uint8_t accel_odr = registers_[kAccelConfig0] & 0x0F;
  if (rate_matters && accel_.on && accel_odr != 0 && !accel_makes(accel_odr, accel_low_power())) {
    break_rule(Rule::kRateFitsMode);
  }
  const bool routed = ((registers_[kIntSource0] | registers_[0x68]) & kFifoThreshold) != 0;
  const bool threshold_matters =
      address == kIntSource0 || address == 0x68 || address == kFifoConfig2 || address == kFifoConfig3;
  if (threshold_matters && routed && watermark() == 0) break_rule(Rule::kWatermarkNotZero);
}

inline void Icm42688::command(std::uint8_t value) {  // 14.33
  using namespace icm42688;
  if ((value & 0x02) != 0) {
    ++counters_.flushes;
    if (!has(Fault::kFifoStuck)) fifo_.clear();
    update_threshold(false);
  }
  if ((value & 0x04) != 0) {  // TMST_STROBE: "the time stamp counter is latched into the time stamp register"
    const std::uint64_t counts = stamp_counts(chip_ps_);
    for (std::uint8_t i = 0; i < 3; ++i) {
      registers_.at(1, static_cast<std::uint8_t>(kTmstVal0 + i)) =
          static_cast<std::uint8_t>(counts >> 8 * i & (i == 2 ? 0x0FU : 0xFFU));
    }
  }
  if ((value & 0x08) != 0) {  // ABORT_AND_RESET: "restarting the ODR counter"
    odr_origin_ = chip_ps_;
    schedule();
  }
}

inline void Icm42688::power_mode(std::uint8_t before, std::uint8_t after) {  // 14.36
  using namespace icm42688;
  const bool were_on = sensors_on();
  const bool drive_before = (before & 0x0C) != 0;
  const bool drive = (after & 0x0C) != 0;
  if (!drive_before && drive) {
    gyro_.switched_on = chip_ps_;
    gyro_.ready = chip_ps_ + kGyroStartUp;
    quiet_until_ = chip_ps_ + kQuietTime;
  }
  if (drive_before && !drive && chip_ps_ - gyro_.switched_on < kGyroMinimumOn) break_rule(Rule::kGyroOnFor45ms);
  gyro_.on = (after & 0x0C) == 0x0C;
  const bool accel_before = (before & 0x02) != 0;
  accel_.on = (after & 0x02) != 0;
  if (!accel_before && accel_.on) {
    accel_.switched_on = chip_ps_;
    accel_.ready = chip_ps_ + kAccelStartUp;
    quiet_until_ = chip_ps_ + kQuietTime;
  }
  if (!were_on && sensors_on()) odr_origin_ = chip_ps_;
}

inline void Icm42688::self_test(std::uint8_t value) {  // 14.57; the accelerometer needs ACCEL_ST_POWER besides
  using namespace icm42688;
  const bool powered = (value & 0x40) != 0;
  for (std::uint8_t i = 0; i < 3; ++i) {
    const std::uint8_t gyro_code = registers_.at(1, static_cast<std::uint8_t>(kXgStData + i));
    const std::uint8_t accel_code = registers_.at(2, static_cast<std::uint8_t>(kXaStData + i));
    gyro_test_[i].aim(chip_ps_, (value >> i & 1) != 0 ? self_test_radps(gyro_code) : 0.0);
    accel_test_[i].aim(chip_ps_, powered && (value >> (3 + i) & 1) != 0 ? self_test_mps2(accel_code) : 0.0);
  }
}

inline void Icm42688::reset(Picos until) {  // 14.1: "The device powers up in sleep mode" (14)
  using namespace icm42688;
  registers_.reset();
  set_self_test_codes(gyro_codes_, accel_codes_);
  fifo_.clear();
  fifo_.forget_losses();
  gyro_ = {};
  accel_ = {};
  temperature_sampled_ = false;
  reset_until_ = until;
  reset_by_host_ = false;
  quiet_until_ = 0;
  stamp_origin_ = until;
  latched_count_ = 0;
  announced_bytes_ = 0;
  threshold_passed_ = false;
  fsync_.reset();
  self_test(0);
}

inline void Icm42688::set_self_test_codes(std::array<std::uint8_t, 3> gyro, std::array<std::uint8_t, 3> accel) {
  gyro_codes_ = gyro;
  accel_codes_ = accel;
  for (std::uint8_t i = 0; i < 3; ++i) {
    registers_.at(1, static_cast<std::uint8_t>(icm42688::kXgStData + i)) = gyro[i];
    registers_.at(2, static_cast<std::uint8_t>(icm42688::kXaStData + i)) = accel[i];
  }
}

inline void Icm42688::inject(Fault fault, const FaultDetail& d) {
  active_[index(fault)] = true;
  details_[index(fault)] = d;
  struck_[index(fault)] = 0;
  packets_under_fault_ = 0;
  noise_ = base::Random{d.seed};
  if (fault == Fault::kRegisterChanges) take(d.bank, d.address, d.value);
  if (fault == Fault::kAxisStuck) frozen_ = {};
  if (fault == Fault::kBrownOut) {
    deaf_ = false;
    reset(chip_ps_ + icm42688::kResetTime);
  }
}

inline int Icm42688::broken_rules() const {
  int sum = 0;
  for (const int count : rules_) sum += count;
  return sum;
}

inline std::string Icm42688::broken_rules_in_words() const {
  std::string words;
  for (std::size_t i = 0; i < rules_.size(); ++i) {
    if (rules_[i] > 0) words += std::string{name(static_cast<Rule>(i))} + " x" + std::to_string(rules_[i]) + "; ";
  }
  return words;
}

inline bool Icm42688::int1() const {
  using namespace icm42688;
  const bool works = (registers_[kIntConfig1] & 0x10) == 0;
  return works && (registers_[kIntStatus] & registers_[kIntSource0] & 0x7F) != 0;
}

}  // namespace tetap::fakes
