// SPDX-License-Identifier: Apache-2.0
// A GNSS receiver on a serial line: reads its bytes, configures a u-blox receiver, hands on each epoch with the time it
// was measured at. Receivers of other makers are read as they are: with `configure` off nothing is sent.
#pragma once

#include "drivers/gnss/epoch_clock.hpp"
#include "drivers/gnss/receiver.hpp"
#include "drivers/gnss/ubx/configurator.hpp"
#include "hal/byte_stream.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::drivers::gnss {

struct DriverSettings {
  ReceiverSettings receiver{};
  ubx::Settings ubx{};
  bool configure = true;
  base::Micros latency{60'000};  ///< from the measurement to the last byte; of the receiver and the baud rate
  base::Micros gap{100'000};     ///< a frame with a longer pause in it will not be completed
};

template <hal::ByteStream Port, std::size_t Capacity = 1029>
class GnssDriver {
 public:
  explicit constexpr GnssDriver(Port& port, const DriverSettings& settings = {})
      : port_(&port),
        settings_(settings),
        receiver_(settings.receiver),
        configurator_(port, settings.ubx),
        ubx_clock_(settings.latency),
        nmea_clock_(settings.latency),
        baseline_clock_(settings.latency) {}

  /// Calls `handler(report, stamp)` for every epoch, also those without a fix. A handler that takes a baseline gets
  /// `handler(baseline, stamp)` for every line between two antennas, also those that are no heading. Reads a bounded
  /// number of bytes.
  template <class Handler>
  constexpr void poll(base::Micros now, Handler&& handler) {
    Events<Handler> events{*this, handler, now};
    std::array<std::uint8_t, 64> bytes{};
    for (int reads = 0; reads < kReads; ++reads) {
      const std::size_t n = port_->read(bytes);
      if (n == 0 || n > bytes.size()) break;
      last_byte_ = now;
      receiver_.on_bytes(std::span(bytes).first(n), events);
    }
    if (receiver_.within_frame() && now - last_byte_ > settings_.gap) receiver_.on_gap(events);
    if (settings_.configure) configurator_.poll(now);
  }

  [[nodiscard]] constexpr const Health& health() const { return receiver_.health(); }
  [[nodiscard]] constexpr const ubx::Configurator<Port>& configurator() const { return configurator_; }

 private:
  static constexpr int kReads = 16;  ///< 1 kB: 11 ms at 921 600 baud

  template <class Handler>
  struct Events {
    GnssDriver& driver;
    Handler& handler;
    base::Micros now;

    constexpr void operator()(const Report& r) {
      if (r.protocol == Protocol::kUbx) driver.configurator_.on_report(now);
      handler(r, driver.stamp(r, now));
    }
    constexpr void operator()(const Baseline& b) {
      if (b.itow_ms) driver.configurator_.on_report(now);
      const base::Micros stamp = driver.stamp(b, now);
      if constexpr (requires { handler(b, stamp); }) handler(b, stamp);
    }
    constexpr void operator()(const ubx::Acknowledge& ack) {
      if (driver.settings_.configure) driver.configurator_.on_acknowledge(ack, now);
    }
    constexpr void operator()(const ubx::Identified&) {
      if (driver.settings_.configure) driver.configurator_.on_identified(now);
    }
  };

  /// A doubtful time of day is not used: then the arrival is all that is known of the time.
  constexpr base::Micros stamp(const Report& r, base::Micros now) {
    if (r.itow_ms) return ubx_clock_.stamp({std::int64_t{*r.itow_ms} * 1000}, now);
    if (!r.utc.time_valid || r.time_uncertain) return now - settings_.latency;
    const std::int64_t s = r.utc.hour * 3600 + r.utc.minute * 60 + r.utc.second;
    return nmea_clock_.stamp({s * 1'000'000 + r.utc.nano / 1000}, now);
  }

  /// A heading of NMEA has no time: its arrival is all that is known.
  constexpr base::Micros stamp(const Baseline& b, base::Micros now) {
    if (!b.itow_ms) return now - settings_.latency;
    const base::Micros itow{std::int64_t{*b.itow_ms} * 1000};
    const auto known = ubx_clock_.at(itow, now);
    return known ? *known : baseline_clock_.stamp(itow, now);
  }

  Port* port_;
  DriverSettings settings_;
  GnssReceiver<Capacity> receiver_;
  ubx::Configurator<Port> configurator_;
  EpochClock ubx_clock_;       ///< by time of week
  EpochClock nmea_clock_;      ///< by time of day
  EpochClock baseline_clock_;  ///< by time of week, of a receiver that sends baselines alone
  base::Micros last_byte_{};
};

}  // namespace tetap::drivers::gnss
