// SPDX-License-Identifier: Apache-2.0
// The driver and the fake of its chip on one bench, with a clock that the test moves.
#pragma once

#include "drivers/imu/icm42688/driver.hpp"
#include "support/fakes/icm42688.hpp"

#include <cmath>
#include <vector>

namespace tetap::drivers::icm42688 {

struct Bench {
  explicit Bench(const Settings& settings = {}) : driver(chip, settings) {
    chip.set_filters(true);
    chip.set_motion(living());
  }

  /// Noise-like but known: no value repeats.
  static fakes::Icm42688::MotionAt living() {
    return [](double t) {
      fakes::icm42688::Motion m;
      for (std::size_t i = 0; i < 3; ++i) {
        const double phase = static_cast<double>(i);
        m.rate_radps[i] = rate(t, i);
        m.specific_force_mps2[i] = (i == 2 ? 9.80665 : 0.0) + std::sin(31.0 * t + phase) + 0.3 * std::sin(47.0 * t);
      }
      m.temperature_degC = 30.0;
      return m;
    };
  }
  static double rate(double t, std::size_t axis) {
    const double phase = static_cast<double>(axis);
    return 0.8 * std::sin(23.0 * t + phase) + 0.3 * std::sin(37.0 * t - phase);
  }

  void run(std::int64_t for_us, std::int64_t every_us = 1000) {
    for (const std::int64_t end = now_us + for_us; now_us < end;) {
      now_us += every_us;
      chip.advance({now_us});
      driver.poll({now_us}, [this](const ImuReading& reading) { readings.push_back(reading); });
      ++polls;
    }
  }

  /// Until it runs; the readings begin then.
  bool start(std::int64_t every_us = 1000) {
    for (int i = 0; i < 2000 && !driver.running(); ++i) run(every_us, every_us);
    readings.clear();
    return driver.running();
  }

  [[nodiscard]] int of(Reason reason) const { return driver.health().of(reason); }
  [[nodiscard]] int troubles() const {
    int sum = 0;
    for (const int count : driver.health().counts) sum += count;
    return sum;
  }

  fakes::Icm42688 chip;
  Driver<fakes::Icm42688> driver;
  std::vector<ImuReading> readings;
  std::int64_t now_us = 0;
  int polls = 0;
};

}  // namespace tetap::drivers::icm42688
