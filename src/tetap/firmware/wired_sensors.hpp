// SPDX-License-Identifier: Apache-2.0
// One class per kind of wired sensor: its driver is polled, and each sample becomes the frames of the bus. Stamps are
// bus time: the board's own plus an offset.
#pragma once

#include "drivers/encoder/quadrature_pair.hpp"
#include "drivers/gnss/driver.hpp"
#include "drivers/imu/icm42688/driver.hpp"
#include "drivers/imu/integration.hpp"
#include "hal/board.hpp"
#include "tetap/bus/encoder.hpp"
#include "tetap/param/parameters.hpp"

#include <algorithm>
#include <cstdint>

namespace tetap::firmware {

/// A count within the bits of its signal: it stays at the most.
template <class To>
[[nodiscard]] constexpr To saturated(std::uint64_t count, std::uint64_t most) {
  return static_cast<To>(count < most ? count : most);
}

/// Frames of a node's samples: put(frame) for each. The sequence runs by kind of sensor.
template <class Put>
class SampleFrames {
 public:
  SampleFrames(std::uint32_t can_base, Put& put) : base_(can_base), put_(put) {}
  template <class Sample>
  void operator()(const Sample& sample, base::Micros stamp, std::uint8_t& sequence, std::uint8_t instance) const {
    bus::encode_sample(sample, bus::SampleHead::of(stamp, sequence++, instance),
                       [this]<class... Instance>(const auto& message, Instance... nth) {
                         put_(bus::frame(base_, message, static_cast<std::size_t>(nth)...));
                       });
  }

 private:
  std::uint32_t base_;
  Put& put_;
};

/// An ICM-42688-P; increments over `imu_readings` of its samples.
template <hal::SpiDevice Spi>
class WiredImu {
 public:
  WiredImu(Spi& spi, const param::Parameters& parameters)
      : driver_(spi, settings_of(parameters.wired)),
        readings_(static_cast<std::uint8_t>(parameters.wired.imu_readings)),
        integrator_(readings_),
        instance_(static_cast<std::uint8_t>(parameters.inertial.imu)) {}

  template <class Frames>
  void poll(base::Micros now, base::Micros offset, Frames&& frames) {
    driver_.poll(now, [&](drivers::ImuReading reading) {
      // The reading before it lies in another time: nothing is known of its interval's start.
      if (std::exchange(begins_, false)) reading.after_gap = true;
      if (const auto done = integrator_.add(reading)) frames(done->sample, done->stamp + offset, sequence_, instance_);
    });
  }
  /// Time has jumped: the increment that was begun is given up.
  void restart() {
    integrator_ = drivers::ImuIntegrator(readings_);
    begins_ = true;
  }

  [[nodiscard]] bool owns(std::uint32_t offset) const {
    const std::uint32_t first = bus::ImuGyro::kOffset + instance_ * bus::ImuGyro::kStride;
    return offset >= first && offset < first + bus::ImuGyro::kStride;
  }
  [[nodiscard]] std::uint8_t instance() const { return instance_; }

  [[nodiscard]] bus::EstDiagImu page() const {
    using drivers::icm42688::Reason;
    const drivers::icm42688::Health& h = driver_.health();
    const auto sum = [&h](auto... reasons) {
      return saturated<std::uint8_t>((std::uint64_t{0} + ... + h.of(reasons)), 0xFF);
    };
    return {.imu_state = static_cast<bus::ImuState>(static_cast<unsigned>(h.state) + 1),
            .imu_identity = sum(Reason::kWrongIdentity),
            .imu_bus_fault = sum(Reason::kBusFault, Reason::kResetIncomplete, Reason::kConfigRefused,
                                 Reason::kConfigChanged, Reason::kBankLost),
            .imu_fifo = sum(Reason::kFifoOverflow, Reason::kBadCount, Reason::kBadHeader, Reason::kFifoShort,
                            Reason::kLostSamples, Reason::kBadStamp),
            .imu_stall = sum(Reason::kStale, Reason::kStuckAccel, Reason::kStuckGyro),
            .imu_restarts = saturated<std::uint8_t>(h.restarts, 0x7F),
            .imu_clock = 1e-6F * static_cast<float>(driver_.clock_error_ppm())};
  }

  [[nodiscard]] static drivers::icm42688::Settings settings_of(const param::WiredParameters& n) {
    using drivers::icm42688::Rate;
    using drivers::icm42688::Tick;
    const auto rate = [](std::int32_t hz) {
      switch (hz) {
        case 8'000:
          return Rate::k8kHz;
        case 4'000:
          return Rate::k4kHz;
        case 2'000:
          return Rate::k2kHz;
        case 500:
          return Rate::k500Hz;
        case 200:
          return Rate::k200Hz;
        case 100:
          return Rate::k100Hz;
        case 50:
          return Rate::k50Hz;
        case 25:
          return Rate::k25Hz;
        default:
          return Rate::k1kHz;
      }
    };
    // Both enumerations count x, y, z, then the same backwards.
    const auto axis = [](param::ChipAxis a) { return static_cast<drivers::Axis>(a); };
    // The stamp of 16 bits must not wrap between two samples.
    return {.rate = rate(n.imu_rate_hz),
            .tick = n.imu_rate_hz > 25 ? Tick::k1us : Tick::k16us,
            .mounting = drivers::Mounting::of(axis(n.imu_x), axis(n.imu_y), axis(n.imu_z))};
  }

 private:
  drivers::icm42688::Driver<Spi> driver_;
  std::uint8_t readings_;
  drivers::ImuIntegrator integrator_;
  std::uint8_t instance_;
  std::uint8_t sequence_ = 0;
  bool begins_ = false;  ///< the next reading follows nothing
};

/// Two encoders: both counts at a fixed period.
template <hal::EncoderCounter Left, hal::EncoderCounter Right>
class WiredEncoders {
 public:
  WiredEncoders(Left& left, Right& right, const param::WiredParameters& n)
      : pair_(left, settings_of(n, n.left_inverted), right, settings_of(n, n.right_inverted)),
        every_{n.encoders_every_us} {}

  template <class Frames>
  void poll(base::Micros now, base::Micros offset, Frames&& frames) {
    if (now < due_) return;
    pair_.poll(now);
    due_ = now - due_ < every_ ? due_ + every_ : now + every_;
    frames(pair_.counts(), now + offset, sequence_, std::uint8_t{0});
  }

  [[nodiscard]] static bool owns(std::uint32_t offset) { return offset == bus::InWheelCounts::kOffset; }

  void note(bus::EstDiagWired& page) const {
    using drivers::EncoderReason;
    const auto sum = [this](auto... reasons) {
      return (std::uint64_t{0} + ... + (pair_.left().health().of(reasons) + pair_.right().health().of(reasons)));
    };
    page.encoder_jumps = saturated<std::uint8_t>(sum(EncoderReason::kJump), 63);
    page.encoder_other =
        saturated<std::uint8_t>(sum(EncoderReason::kRebased, EncoderReason::kAmbiguous, EncoderReason::kBadEdge), 7);
  }

 private:
  [[nodiscard]] static drivers::QuadratureSettings settings_of(const param::WiredParameters& n, std::int32_t inverted) {
    return {.most_counts_per_s = n.encoder_most_per_s, .inverted = inverted != 0};
  }

  drivers::QuadraturePair<Left, Right> pair_;
  base::Micros every_;
  base::Micros due_{};
  std::uint8_t sequence_ = 0;
};

/// A receiver: position and velocity of each epoch that has them.
template <hal::ByteStream Port>
class WiredGnss {
 public:
  WiredGnss(Port& port, const param::WiredParameters& n)
      : port_(port), driver_(port, settings_of(n)), configures_(n.gnss == 2), baud_(n.gnss_baud) {}

  template <class Frames>
  void poll(base::Micros now, base::Micros offset, Frames&& frames) {
    if constexpr (hal::SerialPort<Port>) {
      // A receiver that is read as it is has the baud rate of the parameters from the start.
      if (!std::exchange(opened_, true) && !configures_) port_.set_baud(static_cast<std::uint32_t>(baud_));
    }
    driver_.poll(now, [&](const drivers::gnss::Report& report, base::Micros stamp) {
      if (const auto position = position_of(report)) frames(*position, stamp + offset, position_sequence_, kInstance);
      if (const auto velocity = velocity_of(report)) frames(*velocity, stamp + offset, velocity_sequence_, kInstance);
    });
  }

  [[nodiscard]] static bool owns(std::uint32_t offset) {
    return offset >= bus::InGnssLat::kOffset && offset <= bus::InGnssVelU::kOffset;
  }

  void note(bus::EstDiagWired& page) const {
    using drivers::gnss::Reason;
    const drivers::gnss::Health& h = driver_.health();
    const hal::SerialFaults line = port_.faults();
    page.gnss_state = configures_
                          ? static_cast<bus::GnssState>(static_cast<unsigned>(driver_.configurator().state()) + 1)
                          : bus::GnssState::kReadOnly;
    page.gnss_baud = configures_ ? driver_.configurator().baud() : static_cast<std::uint32_t>(baud_);
    page.gnss_checksum = saturated<std::uint8_t>(
        std::uint64_t{h.of(Reason::kUbxChecksum)} + h.of(Reason::kNmeaChecksum) + h.of(Reason::kRtcmCrc), 0xFF);
    page.gnss_framing = saturated<std::uint8_t>(line.framing, 0xFF);
    page.gnss_lost = saturated<std::uint8_t>(std::uint64_t{line.overrun} + line.lapped, 63);
  }

 private:
  static constexpr std::uint8_t kInstance = 0;

  [[nodiscard]] static drivers::gnss::DriverSettings settings_of(const param::WiredParameters& n) {
    return {.ubx = {.baud = static_cast<std::uint32_t>(n.gnss_baud),
                    .period_ms = static_cast<std::uint16_t>(n.gnss_period_ms)},
            .configure = n.gnss == 2,
            .latency = {n.gnss_latency_us}};
  }

  Port& port_;
  drivers::gnss::GnssDriver<Port> driver_;
  bool configures_;
  std::int32_t baud_;
  std::uint8_t position_sequence_ = 0, velocity_sequence_ = 0;
  bool opened_ = false;
};

}  // namespace tetap::firmware
