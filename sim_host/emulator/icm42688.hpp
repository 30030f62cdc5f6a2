// SPDX-License-Identifier: Apache-2.0
// ICM-42688-P on SPI: register banks, signal path, FIFO, timestamps, interrupt pin, start-up and reset times. Data
// sheet DS-000347: section 6 (FIFO), 12 (use notes), 13 to 19 (register map). AFSR: ArduPilot issue 25025 and pull
// request 25332, as the data sheet has no word on INTF_CONFIG1 bits 7:6.
#pragma once

#include "sim_host/emulator/complaints.hpp"
#include "sim_host/emulator/sensor_world.hpp"
#include "sim_host/emulator/spi.hpp"
#include "sim_host/emulator/virtual_time.hpp"
#include "tetap/base/random.hpp"

#include <array>
#include <cstdint>
#include <deque>
#include <functional>

namespace tetap::board {

/// One chip as it came from the factory, and its faults.
struct Icm42688Options {
  double clock_error = 0;  ///< relative; +0.01: samples and timestamps come one per cent too fast
  bool noise = false;      ///< white noise of the data sheet's densities
  std::uint64_t seed = 1;  ///< seed of the noise
  std::uint8_t who_am_i = 0x47;
};

class Icm42688 final : public SpiDevice {
 public:
  Icm42688(Scheduler& scheduler, Complaints& complaints, const Icm42688Options& options);

  /// Rates and forces at the chip; empty: it lies still at 25 degrees and weighs nothing.
  std::function<ImuTruth(Picoseconds)> world;
  /// One sample as the registers have it, in SI, at the chip's axes.
  struct Reading {
    Picoseconds time = 0, delay = 0;  ///< delay: that of the interface filter at 0 Hz
    std::array<double, 3> rate_radps{}, force_mps2{};
    double temperature_c = 0;
  };
  /// Called with each valid sample; for observers that are no part of the board.
  std::function<void(const Reading&)> on_reading;
  /// INT1 pin; called with each change of its level.
  std::function<void(bool level)> on_int1;
  /// From then on it answers nothing: MISO floats.
  bool dead = false;
  /// Samples stop while registers still answer.
  bool stalled = false;

  void select() override;
  void deselect() override;
  std::uint8_t exchange(std::uint8_t out) override;
  [[nodiscard]] unsigned modes() const override { return 1U << 0 | 1U << 3; }  // section 9.5
  [[nodiscard]] std::int64_t limit_hz() const override { return 24'000'000; }

  void power_on();
  /// The supply fails for an instant: as after power_on(), and no program can know that it must wait.
  void dip();
  /// Samples since power-on.
  [[nodiscard]] std::uint64_t samples() const { return samples_; }
  [[nodiscard]] std::uint32_t lost_packets() const { return lost_; }

 private:
  static constexpr std::size_t kBanks = 5, kRegisters = 0x80, kFifoBytes = 2048;
  struct Filter {
    std::array<double, 3> stages{};
    bool begun = false;
  };
  struct Packet {
    std::array<std::uint8_t, 20> bytes{};
    std::size_t size = 0;
  };

  [[nodiscard]] std::uint8_t read(std::uint8_t address);
  void write(std::uint8_t address, std::uint8_t value);
  void write_bank0(std::uint8_t address, std::uint8_t value);
  void write_power(std::uint8_t value);
  void soft_reset();
  void reset_registers();
  void sample();
  void plan_sample();
  void measure(std::array<std::int32_t, 3>& gyro, std::array<std::int32_t, 3>& accel, double& temperature_c);
  /// Share of the way to a new value that one stage goes with each sample; 1: no filter.
  [[nodiscard]] static double filter_gain(int bandwidth_code, int order, double odr_hz);
  [[nodiscard]] static double filtered(Filter& filter, double value, int bandwidth_code, int order, double odr_hz);
  void report_reading(const std::array<std::int32_t, 3>& gyro, const std::array<std::int32_t, 3>& accel,
                      double temperature_c) const;
  void store_registers(const std::array<std::int32_t, 3>& gyro, const std::array<std::int32_t, 3>& accel, double t_c);
  void push_packet(const std::array<std::int32_t, 3>& gyro, const std::array<std::int32_t, 3>& accel, double t_c);
  [[nodiscard]] std::uint8_t pop_fifo();
  void end_fifo_read();
  void flush_fifo();
  [[nodiscard]] std::uint16_t fifo_count() const;
  [[nodiscard]] std::size_t fifo_bytes() const;
  [[nodiscard]] std::uint16_t timestamp() const;
  [[nodiscard]] std::int64_t chip_time_ns() const;
  [[nodiscard]] double odr_hz() const;
  [[nodiscard]] bool gyro_on() const { return (bank0(kPwrMgmt0) >> 2 & 3) == 3; }
  [[nodiscard]] bool accel_on() const { return (bank0(kPwrMgmt0) & 3) >= 2; }
  void raise(std::uint8_t bits);
  void set_int1(bool active);
  void put16(std::uint8_t address, std::int32_t value);
  [[nodiscard]] std::uint8_t& bank0(std::uint8_t address) { return registers_[0][address]; }
  [[nodiscard]] std::uint8_t bank0(std::uint8_t address) const { return registers_[0][address]; }
  void complain(const std::string& text) const { complaints_.add("ICM-42688-P", text); }

  // Bank 0, section 14.
  static constexpr std::uint8_t kDeviceConfig = 0x11, kIntConfig = 0x14, kFifoConfig = 0x16, kTempData1 = 0x1D,
                                kAccelDataX1 = 0x1F, kGyroDataX1 = 0x25, kTmstFsyncH = 0x2B, kIntStatus = 0x2D,
                                kFifoCountH = 0x2E, kFifoCountL = 0x2F, kFifoData = 0x30, kSignalPathReset = 0x4B,
                                kIntfConfig0 = 0x4C, kIntfConfig1 = 0x4D, kPwrMgmt0 = 0x4E, kGyroConfig0 = 0x4F,
                                kAccelConfig0 = 0x50, kGyroConfig1 = 0x51, kGyroAccelConfig0 = 0x52,
                                kAccelConfig1 = 0x53, kTmstConfig = 0x54, kFifoConfig1 = 0x5F, kFifoConfig2 = 0x60,
                                kFifoConfig3 = 0x61, kIntConfig1 = 0x64, kIntSource0 = 0x65, kFifoLostPkt0 = 0x6C,
                                kWhoAmI = 0x75, kRegBankSel = 0x76;

  Scheduler& scheduler_;
  Complaints& complaints_;
  Icm42688Options options_;
  Alarm sample_, reset_done_, pulse_end_;
  std::array<std::array<std::uint8_t, kRegisters>, kBanks> registers_{};
  std::array<std::uint8_t, kRegisters> latched_{};  ///< data registers as they were when the chip was selected
  std::deque<Packet> fifo_;
  std::size_t read_in_packet_ = 0;  ///< bytes of the first packet that have been read
  std::uint32_t lost_ = 0;
  std::uint8_t bank_ = 0, address_ = 0, latched_count_l_ = 0;
  enum class Phase : std::uint8_t { kIdle, kAddress, kRead, kWrite };
  Phase phase_ = Phase::kIdle;
  bool int1_ = false, dipped_ = false;
  Picoseconds powered_ = 0, mode_changed_ = -kSecond, gyro_ready_ = kNever, accel_ready_ = kNever;
  Picoseconds next_sample_ = kNever, frozen_until_ = -1;
  bool fast_ = false;  ///< AFSR: beyond its threshold
  std::array<std::int32_t, 3> last_gyro_{}, last_accel_{};
  std::array<Filter, 3> gyro_filters_{}, accel_filters_{};
  std::uint16_t last_timestamp_ = 0;
  std::uint8_t odr_changed_ = 0;
  std::uint64_t samples_ = 0;
  base::Random random_;
};

}  // namespace tetap::board
