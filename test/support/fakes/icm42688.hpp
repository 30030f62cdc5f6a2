// SPDX-License-Identifier: Apache-2.0
// A fake ICM-42688-P: answers over SPI like the chip and fails in named ways. It is written from the data sheet alone
// (TDK DS-000347 revision 1.8; the section stands beside each behaviour) and from no driver. Open points of the sheet
// are answered in the way that is hardest on the host, and a comment marks each.
//
//   Icm42688 chip;
//   chip.set_motion({.rate_radps = {0.0, 0.0, 0.1}});
//   chip.transfer(out, in);               // the driver's side
//   chip.advance(base::Micros{1000});     // the test's side: host time moves on, the chip samples
//   EXPECT_EQ(chip.broken_rules(), 0);    // did the host keep to what the sheet asks of it?
#pragma once

#include "support/fakes/icm42688_faults.hpp"
#include "support/fakes/icm42688_fifo.hpp"
#include "support/fakes/icm42688_registers.hpp"
#include "support/fakes/icm42688_signal.hpp"
#include "tetap/base/random.hpp"
#include "tetap/base/time.hpp"

#include <array>
#include <concepts>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace tetap::fakes {

class Icm42688 {
 public:
  using Motion = icm42688::Motion;
  /// Asked for the host time of each sample, in seconds: the chip samples between the host's microseconds.
  using MotionAt = std::function<Motion(double host_s)>;

  struct Counters {
    int transfers = 0;
    int register_reads = 0;   ///< bytes, FIFO_DATA not among them
    int register_writes = 0;  ///< bytes that reached the chip, taken or not
    int fifo_bytes_read = 0;
    int fifo_bytes_beyond_end = 0;
    int packets_written = 0;
    int accel_samples = 0;
    int gyro_samples = 0;
    int resets = 0;
    int flushes = 0;
  };

  /// One transaction with chip select low throughout: `out` is sent, then `in` is clocked in. The first byte is the
  /// address, its bit 7 set for a read (9.6). False: the bus failed and `in` holds nothing.
  bool transfer(std::span<const std::uint8_t> out, std::span<std::uint8_t> in);
  /// Host time is now this; the chip's clock runs along, faster by its error.
  void advance(base::Micros now);

  void set_motion(const Motion& motion) {
    motion_ = [motion](double) { return motion; };
  }
  template <std::invocable<double> F>
  void set_motion(F motion) {
    motion_ = std::move(motion);
  }
  /// The chip's oscillator against the host's clock: samples come early by this much, and stamps count along. 3.3.2
  /// allows 1.5 % with the gyroscope running, 3 % without. Takes effect from the present instant on.
  void set_clock_error(int ppm) { clock_error_ppm_ = ppm; }
  /// Whether samples are delayed and smoothed by the user filters' group delay (5.5); otherwise they are of their
  /// instant.
  void set_filters(bool on) { filters_ = on; }
  /// Called before each transfer, so that time can pass between two of them; it may call advance().
  void set_before_transfer(std::function<void()> passes) { before_transfer_ = std::move(passes); }
  /// Bytes of FIFO memory the read cache adds (6.3): 0, 1 or 2 packets.
  void set_read_cache(int packets) { fifo_.read_cache_packets = packets; }
  /// The factory's self-test codes, x y z; 0 is a part without one.
  void set_self_test_codes(std::array<std::uint8_t, 3> gyro, std::array<std::uint8_t, 3> accel);
  /// The FSYNC pin's edge, with pin 9 set to FSYNC: the next packet carries the time since it instead of a stamp (6.2).
  void pulse_fsync() { fsync_ = chip_ps_; }

  void inject(Fault fault, const FaultDetail& detail = {});
  void clear(Fault fault) { active_[index(fault)] = false; }

  [[nodiscard]] const Counters& counters() const { return counters_; }
  [[nodiscard]] int broken(Rule rule) const { return rules_[index(rule)]; }
  [[nodiscard]] int broken_rules() const;
  [[nodiscard]] std::string broken_rules_in_words() const;
  void forget_broken_rules() { rules_ = {}; }
  /// View of a debugger: no side effects, no faults.
  [[nodiscard]] std::uint8_t peek(std::uint8_t bank, std::uint8_t address) const {
    return registers_.at(bank, address);
  }
  [[nodiscard]] const icm42688::Fifo& fifo() const { return fifo_; }
  /// INT1, taken as latched: low until a source that INT_SOURCE0 routes is set; it does not work before INT_ASYNC_RESET
  /// is cleared (12.6).
  [[nodiscard]] bool int1() const;
  /// Host time of the last sample that was made.
  [[nodiscard]] double last_sample_s() const { return last_sample_s_; }

 private:
  using Picos = icm42688::Picos;
  struct Sensor {
    bool on = false;
    Picos ready = 0;  ///< end of start-up
    Picos switched_on = 0;
    std::optional<Picos> next;  ///< time at which the next sample is due; empty: none will be
    std::array<double, 3> of_full_scale{};
    std::array<double, 3> of_20_bit_scale{};
    bool sampled = false;                      ///< ever, since reset
    std::optional<std::uint8_t> packet_odr{};  ///< ODR code of the previous packet with this sensor (6.2)
  };

  [[nodiscard]] bool has(Fault fault) const { return active_[index(fault)]; }
  [[nodiscard]] const FaultDetail& detail(Fault fault) const { return details_[index(fault)]; }
  void break_rule(Rule rule) { ++rules_[index(rule)]; }

  // Bus
  [[nodiscard]] bool strikes(Fault fault);
  void flip(std::span<std::uint8_t> bytes, double rate);
  std::uint8_t read(std::uint8_t address);
  void write(std::uint8_t address, std::uint8_t value);
  void check_write(const icm42688::Register& r, std::uint8_t value);
  [[nodiscard]] std::uint8_t sense_register(std::uint8_t address) const;
  [[nodiscard]] std::uint16_t fifo_count() const;
  void take(std::uint8_t bank, std::uint8_t address, std::uint8_t value);
  void command(std::uint8_t value);
  void power_mode(std::uint8_t before, std::uint8_t after);
  void self_test(std::uint8_t value);
  void reset(Picos until);

  // Sampling
  [[nodiscard]] bool hold_last() const { return (registers_[icm42688::kIntfConfig0] & 0x80) != 0; }
  [[nodiscard]] bool big_endian() const { return (registers_[icm42688::kIntfConfig0] & 0x10) != 0; }
  [[nodiscard]] bool high_byte_first() const { return (registers_[icm42688::kIntfConfig0] & 0x20) != 0; }
  [[nodiscard]] bool sensors_on() const { return gyro_.on || accel_.on; }
  [[nodiscard]] bool accel_low_power() const { return (registers_[icm42688::kPwrMgmt0] & 0x03) == 0x02; }
  [[nodiscard]] int watermark() const;
  void schedule();
  [[nodiscard]] Motion filtered(double host_s, double delay_s) const;
  [[nodiscard]] bool switches_range(Picos at, const std::array<double, 3>& rate_radps);
  void sample(Picos at, double host_s);
  void update_threshold(bool packet_written);
  void write_packet(Picos at, bool accel_new, bool gyro_new);
  [[nodiscard]] std::uint64_t stamp_counts(Picos at) const;
  void put(std::vector<std::uint8_t>& packet, int value) const;

  icm42688::RegisterFile registers_;
  icm42688::Fifo fifo_;
  MotionAt motion_ = [](double) { return Motion{}; };
  std::function<void()> before_transfer_;
  Counters counters_;
  std::array<int, index(Rule::kCount)> rules_{};
  std::array<bool, index(Fault::kCount)> active_{};
  std::array<FaultDetail, index(Fault::kCount)> details_{};
  base::Random noise_{1};
  std::array<int, index(Fault::kCount)> struck_{};
  int packets_under_fault_ = 0;

  base::Micros host_{};
  int clock_error_ppm_ = 0;
  bool filters_ = false;
  Picos chip_ps_ = 0;       ///< the chip's own time
  Picos stamp_origin_ = 0;  ///< time at which the time-stamp counter was 0
  Picos odr_origin_ = 0;    ///< the grid of all output data rates
  Picos reset_until_ = 0;
  Picos quiet_until_ = 0;
  Picos last_odr_ = 0;
  bool reset_by_host_ = false;
  bool deaf_ = false;  ///< SPI was switched off by UI_SIFS_CFG (14.34): only a power cycle helps
  bool threshold_passed_ = false;
  std::uint16_t latched_count_ = 0;
  std::size_t announced_bytes_ = 0;
  std::optional<Picos> fsync_;
  double last_sample_s_ = 0.0;
  Sensor gyro_;
  Sensor accel_;
  double temperature_degC_ = 25.0;
  bool temperature_sampled_ = false;
  std::array<std::optional<double>, 6> frozen_{};
  std::array<double, 3> rate_before_{};
  Picos switching_until_ = 0;  ///< end of the repetition after a change of range
  std::array<std::uint8_t, 3> gyro_codes_{140, 145, 150};
  std::array<std::uint8_t, 3> accel_codes_{110, 115, 120};
  std::array<icm42688::Settling, 3> gyro_test_{icm42688::Settling{40 * icm42688::kMillisecond},
                                               icm42688::Settling{40 * icm42688::kMillisecond},
                                               icm42688::Settling{40 * icm42688::kMillisecond}};
  std::array<icm42688::Settling, 3> accel_test_{icm42688::Settling{5 * icm42688::kMillisecond},
                                                icm42688::Settling{5 * icm42688::kMillisecond},
                                                icm42688::Settling{5 * icm42688::kMillisecond}};
};

}  // namespace tetap::fakes

#include "support/fakes/icm42688_bus.hpp"
#include "support/fakes/icm42688_sampling.hpp"
