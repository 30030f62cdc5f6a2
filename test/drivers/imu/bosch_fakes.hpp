// SPDX-License-Identifier: Apache-2.0
// Fakes of the BMI088's two chips and of the BMI270 at their select lines, from the data sheets' register maps and
// apart from the drivers. They take SPI only after a rising edge, need their waits, and convert a motion in doubles.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <vector>

namespace tetap::fakes::bosch {

struct Motion {
  std::array<double, 3> rate_dps{}, force_g{};
  double temperature_degC = 25;
};
using MotionAt = std::function<Motion(double seconds)>;

enum class Line : std::uint8_t { kWorks, kStuckLow, kStuckHigh, kFails };

/// Device at a select line: the line, waits after a reset, and registers.
class Device {
 public:
  explicit Device(bool idle_byte) : idle_byte_(idle_byte) {}
  virtual ~Device() = default;
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  bool transfer(std::span<const std::uint8_t> out, std::span<std::uint8_t> in) {
    if (line == Line::kFails) return false;
    ++transfers;
    for (auto& byte : in) byte = line == Line::kStuckHigh ? 0xFF : 0;
    if (out.empty() || line != Line::kWorks) return true;
    const bool ready = speaks_spi_ && now_us >= ready_us_;
    speaks_spi_ = true;
    if (!ready) {
      early += now_us < ready_us_ ? 1 : 0;
      return true;
    }
    const unsigned address = out[0] % 128;
    if (out[0] < 128) {
      for (std::size_t i = 1; i < out.size(); ++i)
        store(address == 0x5E ? address : address + static_cast<unsigned>(i) - 1, out[i]);
      return true;
    }
    // Clocked bytes after the address: perhaps one of nothing, then registers from the address on.
    const std::size_t skipped = (idle_byte_ ? 2 : 1) - out.size();
    for (std::size_t i = skipped; i < in.size(); ++i) in[i] = load(address + static_cast<unsigned>(i - skipped));
    now_us += reading_us;
    return true;
  }

  void brown_out() { reset(0); }

  double now_us = 0;
  double clock_error = 0;  ///< relative; +0.01: the sensor time runs one per cent too fast
  double reading_us = 0;   ///< from the first register of a reading to the sensor time
  Line line = Line::kWorks;
  MotionAt motion = [](double) { return Motion{}; };
  std::map<unsigned, std::uint8_t> registers;
  int transfers = 0;
  int early = 0;  ///< accesses within the wait after a reset

 protected:
  virtual void store(unsigned address, std::uint8_t value) = 0;
  virtual std::uint8_t load(unsigned address) = 0;
  virtual void clear() = 0;

  void reset(double wait_us) {
    registers.clear();
    clear();
    speaks_spi_ = !idle_byte_;
    ready_us_ = now_us + wait_us;
    started_us_ = now_us;
  }
  [[nodiscard]] std::uint8_t held(unsigned address, std::uint8_t otherwise) const {
    const auto found = registers.find(address);
    return found == registers.end() ? otherwise : found->second;
  }
  [[nodiscard]] double ticks(double at_us) const { return (at_us - started_us_) * (1 + clock_error) / 39.0625; }
  /// Sensor time of the newest sample at a rate, and when it was on the host's clock.
  [[nodiscard]] double sampled_us(double hz) const {
    const double period = 25'600 / hz, tick = std::floor(std::floor(ticks(now_us)) / period) * period;
    return started_us_ + tick * 39.0625 / (1 + clock_error);
  }
  [[nodiscard]] std::uint8_t sensor_time(unsigned byte) const {
    return static_cast<std::uint8_t>(static_cast<std::uint32_t>(ticks(now_us + reading_us)) >> (8 * byte));
  }
  static std::uint8_t half(double value, double full, unsigned byte) {
    const double bits = std::fmin(std::fmax(std::round(value / full * 32'768), -32'767), 32'767);
    return static_cast<std::uint8_t>(static_cast<int>(bits) >> (8 * byte));
  }
  /// Rates of ACC_CONF and GYR_CONF: 8 is 100 Hz, each next one twice it.
  static double hertz(unsigned code) { return 100 * std::pow(2, static_cast<double>(code % 16) - 8); }

 private:
  bool idle_byte_;
  bool speaks_spi_ = false;
  double ready_us_ = 0, started_us_ = 0;
};

class Bmi088Accel final : public Device {
 public:
  Bmi088Accel() : Device(true) {}
  std::uint8_t identity = 0x1E;

 private:
  void clear() override { written_us_ = -1e9; }
  void store(unsigned address, std::uint8_t value) override {
    if (address == 0x7E && value == 0xB6) return reset(1'000);
    const bool suspended = held(0x7C, 3) == 3;
    if (suspended && now_us - written_us_ < 1'000) return;  // idle time between writes
    written_us_ = now_us;
    registers[address] = value;
    if (address == 0x7D) powered_us_ = now_us + 450;
  }
  std::uint8_t load(unsigned address) override {
    if (address == 0) return identity;
    const bool on = held(0x7C, 3) == 0 && held(0x7D, 0) == 4 && now_us >= powered_us_;
    const double at = sampled_us(hertz(held(0x40, 0xA8))) * 1e-6;
    if (address >= 0x12 && address <= 0x17) {
      const double full = 3 * std::pow(2, held(0x41, 1));
      return on ? half(motion(at).force_g[(address - 0x12) / 2], full, address % 2) : 0;
    }
    if (address >= 0x18 && address <= 0x1A) return on ? sensor_time(address - 0x18) : 0;
    if (address == 0x22 || address == 0x23) {
      const int eighths = static_cast<int>(std::floor((motion(at).temperature_degC - 23) * 8)) & 0x7FF;
      return static_cast<std::uint8_t>(address == 0x22 ? eighths / 8 : eighths % 8 * 32);
    }
    return held(address, address == 0x7C ? 3 : address == 0x40 ? 0xA8 : address == 0x41 ? 1 : 0);
  }
  double written_us_ = -1e9, powered_us_ = 0;
};

class Bmi088Gyro final : public Device {
 public:
  Bmi088Gyro() : Device(false) {}
  std::uint8_t identity = 0x0F;

 private:
  void clear() override {}
  void store(unsigned address, std::uint8_t value) override {
    if (address == 0x14 && value == 0xB6) return reset(30'000);
    registers[address] = value;
  }
  std::uint8_t load(unsigned address) override {
    if (address == 0) return identity;
    if (address >= 2 && address <= 7) {
      const double full = 2000 / std::pow(2, held(0x0F, 0));
      const double period_us = held(0x10, 0) % 16 < 2 ? 500 : 1'000;
      return half(motion(std::floor(now_us / period_us) * period_us * 1e-6).rate_dps[(address - 2) / 2], full,
                  address % 2);
    }
    return static_cast<std::uint8_t>(held(address, 0) | (address == 0x10 ? 0x80 : 0));
  }
};

class Bmi270 final : public Device {
 public:
  Bmi270() : Device(true) {}
  std::uint8_t identity = 0x24;
  std::vector<std::uint8_t> wanted_file;  ///< file that has to arrive before it measures
  int cross = 0;                          ///< share of z in the gyroscope's x, in 1/512

 private:
  void clear() override {
    memory_.assign(8'192, 0);
    place_ = 0;
    loaded_ = false;
  }
  void store(unsigned address, std::uint8_t value) override {
    if (address == 0x7E && value == 0xB6) return reset(2'000);
    const bool saving = held(0x7C, 3) % 2 == 1;
    if (saving && address != 0x7C) return;
    if (address == 0x5E) {
      if (held(0x59, 1) == 0 && place_ < memory_.size()) memory_[place_++] = value;
      return;
    }
    registers[address] = value;
    if (address == 0x5B || address == 0x5C) place_ = 2U * (held(0x5B, 0) % 16U + 16U * held(0x5C, 0));
    if (address == 0x59 && value == 1) {
      std::vector<std::uint8_t> wanted = wanted_file;
      wanted.resize(memory_.size());
      loaded_ = memory_ == wanted;
      loaded_us_ = now_us + 20'000;
    }
  }
  std::uint8_t load(unsigned address) override {
    const bool runs = loaded_ && now_us >= loaded_us_;
    const std::uint8_t power = runs ? held(0x7D, 0) : 0;
    const double at = sampled_us(hertz(held(0x40, 0xA8))) * 1e-6;
    if (address == 0) return identity;
    if (address == 0x21) return runs ? 1 : loaded_ ? 0 : 2;
    if (address == 0x3C) return held(0x2F, 9) == 0 && runs ? static_cast<std::uint8_t>(cross & 0x7F) : 0;
    if (address >= 0x0C && address <= 0x11)
      return power / 4 % 2 == 1
                 ? half(motion(at).force_g[(address - 0x0C) / 2], 2 * std::pow(2, held(0x41, 2)), address % 2)
                 : 0;
    if (address >= 0x12 && address <= 0x17) {
      Motion m = motion(at);
      m.rate_dps[0] += m.rate_dps[2] * cross / 512;
      return power / 2 % 2 == 1 ? half(m.rate_dps[(address - 0x12) / 2], 2000 / std::pow(2, held(0x43, 0)), address % 2)
                                : 0;
    }
    if (address >= 0x18 && address <= 0x1A) return sensor_time(address - 0x18);
    if (address == 0x22 || address == 0x23) {
      const int bits =
          power / 8 % 2 == 1 ? static_cast<int>(std::lround((motion(at).temperature_degC - 23) * 512)) : -32'768;
      return static_cast<std::uint8_t>(bits >> (8 * (address - 0x22)));
    }
    return held(address, address == 0x7C ? 3 : 0);
  }

  std::vector<std::uint8_t> memory_ = std::vector<std::uint8_t>(8'192, 0);
  std::size_t place_ = 0;
  bool loaded_ = false;
  double loaded_us_ = 0;
};

}  // namespace tetap::fakes::bosch
