// SPDX-License-Identifier: Apache-2.0
// The ICM-42688-P over SPI, as a machine that is polled and never waits. The start comes first, then the FIFO with time
// stamps. Every register is checked in turn while it runs; a lasting fault restarts the chip. DS-000347 rev. 1.8;
// sections at the places. Poll it at INT1 or at any pace that empties 2 kB in time.
#pragma once

#include "drivers/imu/icm42688/self_test.hpp"
#include "drivers/imu/icm42688/startup.hpp"
#include "drivers/imu/icm42688/stream.hpp"

namespace tetap::drivers::icm42688 {

template <hal::SpiDevice Spi>
class Driver {
 public:
  constexpr Driver(Spi& spi, const Settings& settings)
      : bus_(spi), settings_(settings), startup_(settings), stream_(settings) {
    if (!settings.valid()) health_.state = State::kMisconfigured;
  }

  /// `sink(const ImuReading&)` is called for every sample, oldest first. A few transfers at most, never a wait.
  template <class Sink>
  constexpr void poll(base::Micros now, Sink&& sink) {
    if (health_.state == State::kMisconfigured) return;
    if (!polled_) {
      polled_ = true;
      startup_.begin(now + kPowerUpTime, health_);
    }
    if (health_.state == State::kRunning) return run(now, sink);
    if (health_.state == State::kSelfTest) return self_test(now);
    switch (startup_.step(bus_, now, health_)) {
      case Startup::Progress::kBusy:
        return;
      case Startup::Progress::kFailed:
        return restart(now, kRetryTime);
      case Startup::Progress::kRunning:
        break;
    }
    health_.state = State::kRunning;
    stream_.interrupt();
    check_due_ = now + kCheckTime;
    responded_ = now;
    retried_ = false;
    checked_ = 0;
  }

  [[nodiscard]] constexpr const Health& health() const { return health_; }
  [[nodiscard]] constexpr bool running() const { return health_.state == State::kRunning; }

  /// Takes a second or two, in which no samples come; ends with a restart. Refused (false) unless running.
  constexpr bool request_self_test(base::Micros now) {
    if (!running()) return false;
    health_.state = State::kSelfTest;
    self_test_.start(now);
    return true;
  }
  [[nodiscard]] constexpr const SelfTestResult& self_test_result() const { return self_test_.result(); }

  /// Excess of the chip's tick over its nominal length, by the MCU's clock, in parts per million.
  [[nodiscard]] constexpr std::int32_t clock_error_ppm() const { return stream_.clock_error_ppm(); }

 private:
  static constexpr base::Micros kPowerUpTime{3'000};  // table 4: 1 ms, after a ramp of up to 3 ms that may be going on
  static constexpr base::Micros kRetryTime{100'000};
  static constexpr base::Micros kCheckTime{5'000};  // one register each
  static constexpr int kBatch = 8;                  // packets per transfer
  static constexpr int kBatches = 4;                // transfers per poll
  static constexpr int kFifoBytes = 2080;           // 6.3: the most it can ever hold

  constexpr bool ok(BusResult result) { return Startup::ok(result, health_); }

  constexpr void restart(base::Micros now, base::Micros wait) {
    ++health_.restarts;
    stream_.restart();
    startup_.begin(now + wait, health_);
  }

  template <class Sink>
  constexpr void run(base::Micros now, Sink&& sink) {
    std::array<std::uint8_t, 3> head{};
    if (ok(bus_.read(kIntStatus, head))) {
      const int bytes = big_endian(head[1], head[2]);
      if (bytes > kFifoBytes) {
        health_.add(Reason::kBadCount);
        bus_.invalidate_bank();
      } else {
        if ((head[0] & kFifoFull) != 0) health_.add(Reason::kFifoOverflow);
        if (bytes % settings_.packet_size() != 0) health_.add(Reason::kBadCount);
        if (drain(bytes / settings_.packet_size(), now, sink)) {
          responded_ = now;
          retried_ = false;
        }
      }
    }
    watch(now);
    if (running() && now >= check_due_) check(now);
  }

  /// True if samples came that are newer than the last.
  template <class Sink>
  constexpr bool drain(int packets, base::Micros now, Sink&& sink) {
    std::array<std::uint8_t, kBatch * 20> bytes{};
    const auto size = static_cast<std::size_t>(settings_.packet_size());
    bool went_on = false;
    for (int batch = 0; batch < kBatches && packets > 0; ++batch) {
      const auto count = static_cast<std::size_t>(packets < kBatch ? packets : kBatch);
      const std::span<std::uint8_t> part = std::span(bytes).first(count * size);
      if (!ok(bus_.read(kFifoData, part))) {
        flush();  // how far the reading got is not known
        return went_on;
      }
      std::array<Packet, kBatch> parsed{};
      std::size_t good = 0;
      PacketKind kind = PacketKind::kSample;
      for (; good < count; ++good) {
        parsed[good] = parse(part.subspan(good * size, size), settings_.resolution);
        kind = parsed[good].kind;
        if (kind == PacketKind::kEmpty || kind == PacketKind::kForeign) break;
      }
      went_on |= stream_.take(std::span<const Packet>(parsed).first(good), packets, now, health_, sink);
      packets -= static_cast<int>(count);
      if (good == count) continue;
      health_.add(kind == PacketKind::kEmpty ? Reason::kFifoShort : Reason::kBadHeader);
      if (kind == PacketKind::kForeign) {
        bus_.invalidate_bank();
        flush();
      }
      return went_on;
    }
    return went_on;
  }

  constexpr void flush() {
    stream_.interrupt();
    static_cast<void>(ok(bus_.write(kSignalPathReset, kFifoFlush)));  // 14.33; if it fails, headers will show it again
  }

  /// Silence: first the bank is selected again, then everything.
  constexpr void watch(base::Micros now) {
    const base::Micros silence{settings_.period_ns() / 50 + 20'000};  // 20 periods and 20 ms
    const base::Micros since = now - responded_;
    if (since < silence) return;
    if (!retried_) {
      retried_ = true;
      health_.add(Reason::kStale);
      bus_.invalidate_bank();
    } else if (since >= silence + silence) {
      restart(now, base::Micros{0});
    }
  }

  /// In turn: the bank, every field but the first (which means "off"), the identity.
  constexpr void check(base::Micros now) {
    check_due_ = now + kCheckTime;
    const std::size_t nth = checked_;
    checked_ = nth < kFieldCount ? nth + 1 : 0;
    if (nth == 0) {
      static_cast<void>(ok(bus_.confirm_bank()));
      return;
    }
    const Field& field = nth < kFieldCount ? startup_.wanted()[nth] : kIdentityField;
    if (Startup::compare(bus_, field, health_) != Compared::kDifferent) return;
    health_.add(Reason::kConfigChanged);
    restart(now, base::Micros{0});
  }

  constexpr void self_test(base::Micros now) {
    const SelfTest::Progress progress = self_test_.step(bus_, now);
    if (progress == SelfTest::Progress::kBusy) return;
    if (progress == SelfTest::Progress::kBroken || !self_test_.result().passed) health_.add(Reason::kSelfTestFailed);
    restart(now, base::Micros{0});
  }

  static constexpr Field kIdentityField{kWhoAmI, 0xFF, kIdentity};

  Bus<Spi> bus_;
  Settings settings_;
  Startup startup_;
  Stream stream_;
  SelfTest self_test_{};
  Health health_{};
  base::Micros check_due_{}, responded_{};
  std::size_t checked_ = 0;
  bool polled_ = false;
  bool retried_ = false;
};

}  // namespace tetap::drivers::icm42688
