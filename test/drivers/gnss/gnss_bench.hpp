// SPDX-License-Identifier: Apache-2.0
// The driver on a line with a fake u-blox receiver, and a clock that the test moves.
#pragma once

#include "drivers/gnss/driver.hpp"
#include "support/fakes/ublox.hpp"

#include <vector>

namespace tetap::drivers::gnss {

using fakes::Generation;
using fakes::ublox::key;
using ubx::ConfigReason;
using ubx::ConfigState;

static_assert(hal::SerialPort<fakes::Ublox>);

struct Bench {
  explicit Bench(Generation generation, std::uint32_t baud = 9600, const DriverSettings& settings = {})
      : receiver(generation, baud), driver(receiver, settings) {}

  /// Until it stands still in the state, or for so long.
  bool until(ConfigState state, double most_s) {
    for (const auto end = now + base::Micros{static_cast<std::int64_t>(most_s * 1e6)}; now < end;) {
      step();
      if (driver.configurator().state() == state) return true;
    }
    return false;
  }
  void step() {
    now += base::Micros{2'000};
    receiver.advance(now);
    driver.poll(now, *this);
  }
  void operator()(const Report& r, base::Micros stamp) {
    reports.push_back(r);
    stamps.push_back(stamp);
  }
  void operator()(const Baseline& b, base::Micros stamp) {
    baselines.push_back(b);
    baseline_stamps.push_back(stamp);
  }
  void run(double s) {
    for (const auto end = now + base::Micros{static_cast<std::int64_t>(s * 1e6)}; now < end;) step();
  }
  [[nodiscard]] int count(ConfigReason reason) const { return driver.configurator().of(reason); }

  fakes::Ublox receiver;
  GnssDriver<fakes::Ublox> driver;
  base::Micros now{};
  std::vector<Report> reports;
  std::vector<base::Micros> stamps;
  std::vector<Baseline> baselines;
  std::vector<base::Micros> baseline_stamps;
};

}  // namespace tetap::drivers::gnss
