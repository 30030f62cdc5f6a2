// SPDX-License-Identifier: Apache-2.0
// The ICM-42688-P over SPI, as a machine that is polled and never waits: reset, identity, configuration written and
// read back, then the FIFO with time stamps, every register checked in turn while it runs, a restart for whatever does
// not heal. DS-000347 rev. 1.8; sections at the places. Poll it at INT1 or at any pace that empties 2 kB in time.
#pragma once

#include "drivers/imu/icm42688/bus.hpp"
#include "drivers/imu/icm42688/health.hpp"
#include "drivers/imu/icm42688/packet.hpp"
#include "drivers/imu/icm42688/self_test.hpp"
#include "drivers/imu/icm42688/stream.hpp"

namespace tetap::drivers::icm42688 {

template <hal::SpiDevice Spi>
class Driver {
 public:
  constexpr Driver(Spi& spi, const Settings& settings)
      : bus_(spi), settings_(settings), fields_(fields(settings)), stream_(settings) {
    if (!settings.valid()) health_.state = State::kMisconfigured;
  }

  /// `sink(const ImuReading&)` is called for every sample, oldest first. At most a few transfers, never a wait.
  template <class Sink>
  constexpr void poll(base::Micros now, Sink&& sink) {
    if (!started_) {
      started_ = true;
      due_ = now + kPowerUpTime;
    }
    if (now < due_) return;
    switch (health_.state) {
      case State::kPowerUp:
        return reset(now);
      case State::kReset:
        return await_reset(now);
      case State::kIdentify:
        return identify(now);
      case State::kConfigure:
        return configure(now);
      case State::kVerify:
        return verify(now);
      case State::kWarmUp:
        return warm_up(now);
      case State::kRunning:
        return run(now, sink);
      case State::kSelfTest:
        return self_test(now);
      case State::kMisconfigured:
        return;
    }
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

  /// What the chip's clock runs at, against the MCU's.
  [[nodiscard]] constexpr std::int32_t clock_error_ppm() const { return stream_.clock_error_ppm(); }

 private:
  static constexpr base::Micros kPowerUpTime{3'000};  // table 4: 1 ms, after a ramp of up to 3 ms that may be going on
  static constexpr base::Micros kResetTime{1'000};    // 14.1
  static constexpr base::Micros kResetLimit{50'000};  // ours: no answer by then is an answer
  static constexpr base::Micros kWarmUpTime{50'000};  // 14.36: on for at least 45 ms; table 1: 30 ms to start
  static constexpr base::Micros kRetryTime{100'000};
  static constexpr base::Micros kCheckTime{5'000};  // one register each
  static constexpr int kFieldsPerPoll = 4;
  static constexpr int kBatch = 8;         // packets per transfer
  static constexpr int kBatches = 4;       // transfers per poll
  static constexpr int kFifoBytes = 2080;  // 6.3: the most it can ever hold

  constexpr bool ok(BusResult result) {
    if (result == BusResult::kDone) return true;
    health_.add(result == BusResult::kFault ? Reason::kBusFault : Reason::kBankLost);
    return false;
  }

  constexpr void go(State state, base::Micros due) {
    health_.state = state;
    due_ = due;
    next_ = 0;
  }

  constexpr void restart(base::Micros now, base::Micros wait) {
    ++health_.restarts;
    stream_.restart();
    go(State::kPowerUp, now + wait);
  }

  constexpr void reset(base::Micros now) {
    bus_.forget_bank();
    if (!ok(bus_.write(kDeviceConfig, kSoftReset))) return restart(now, kRetryTime);
    bus_.forget_bank();  // the chip is in bank 0 now (14.59), but it may not have heard us
    reset_limit_ = now + kResetLimit;
    // 14.1: no other access for 1 ms; one more for a clock that is read in steps.
    go(State::kReset, now + kResetTime + base::Micros{1'000});
  }

  constexpr void await_reset(base::Micros now) {
    std::uint8_t status = 0;
    if (ok(bus_.read(kIntStatus, status)) && (status & kResetDone) != 0 && status != 0xFF) {
      return go(State::kIdentify, now);
    }
    if (now < reset_limit_) return;
    health_.add(Reason::kResetIncomplete);
    restart(now, kRetryTime);
  }

  constexpr void identify(base::Micros now) {
    std::uint8_t identity = 0;
    if (!ok(bus_.read(kWhoAmI, identity))) return restart(now, kRetryTime);
    if (identity == kIdentity) return go(State::kConfigure, now);
    health_.add(Reason::kWrongIdentity);
    restart(now, kRetryTime);
  }

  /// All but the last field, which starts the sensors.
  constexpr void configure(base::Micros now) {
    for (int i = 0; i < kFieldsPerPoll && next_ + 1 < kFieldCount; ++i, ++next_) {
      const Field& field = fields_[next_];
      if (!ok(bus_.modify(field.where, field.mask, field.value))) return restart(now, kRetryTime);
    }
    if (next_ + 1 == kFieldCount) go(State::kVerify, now);
  }

  constexpr void verify(base::Micros now) {
    for (int i = 0; i < kFieldsPerPoll && next_ + 1 < kFieldCount; ++i, ++next_) {
      const Compared compared = compare(fields_[next_]);
      if (compared == Compared::kNoAnswer) return restart(now, kRetryTime);
      if (compared == Compared::kEqual) continue;
      health_.add(Reason::kConfigRefused);
      return restart(now, kRetryTime);
    }
    if (next_ + 1 < kFieldCount) return;
    const Field& start = fields_[kFieldCount - 1];
    if (!ok(bus_.modify(start.where, start.mask, start.value))) return restart(now, kRetryTime);
    go(State::kWarmUp, now + kWarmUpTime);
  }

  /// What came before the gyroscope's drive was ready is thrown away.
  constexpr void warm_up(base::Micros now) {
    std::uint8_t old_status = 0;  // 14.21: reading clears; the FIFO may have been full meanwhile
    if (!flush() || !ok(bus_.read(kIntStatus, old_status))) return restart(now, kRetryTime);
    go(State::kRunning, now);
    check_due_ = now + kCheckTime;
    heard_ = now;
    asked_again_ = false;
  }

  template <class Sink>
  constexpr void run(base::Micros now, Sink&& sink) {
    std::array<std::uint8_t, 3> head{};
    if (ok(bus_.read(kIntStatus, head))) {
      const int bytes = big_endian(head[1], head[2]);
      if (bytes > kFifoBytes) {
        health_.add(Reason::kBadCount);
        bus_.forget_bank();
      } else {
        if ((head[0] & kFifoFull) != 0) health_.add(Reason::kFifoOverflow);
        if (bytes % settings_.packet_size() != 0) health_.add(Reason::kBadCount);
        if (drain(bytes / settings_.packet_size(), now, sink)) {
          heard_ = now;
          asked_again_ = false;
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
    bool any = false;
    for (int batch = 0; batch < kBatches && packets > 0; ++batch) {
      const int count = packets < kBatch ? packets : kBatch;
      const std::span<std::uint8_t> part = std::span(bytes).first(static_cast<std::size_t>(count) * size);
      if (!ok(bus_.read(kFifoData, part))) {
        static_cast<void>(flush());  // how far the reading got is not known
        return any;
      }
      std::array<Packet, kBatch> parsed{};
      int good = 0;
      for (; good < count; ++good) {
        parsed[static_cast<std::size_t>(good)] =
            parse(part.subspan(static_cast<std::size_t>(good) * size, size), settings_.resolution);
        const PacketKind kind = parsed[static_cast<std::size_t>(good)].kind;
        if (kind == PacketKind::kSample || kind == PacketKind::kInvalid) continue;
        health_.add(kind == PacketKind::kEmpty ? Reason::kFifoShort : Reason::kBadHeader);
        break;
      }
      any |= stream_.take(std::span<const Packet>(parsed).first(static_cast<std::size_t>(good)), packets, now, health_,
                          sink);
      packets -= count;
      if (good == count) continue;
      if (parsed[static_cast<std::size_t>(good)].kind == PacketKind::kForeign) {
        bus_.forget_bank();
        static_cast<void>(flush());
      }
      return any;
    }
    return any;
  }

  constexpr bool flush() {
    stream_.interrupt();
    return ok(bus_.write(kSignalPathReset, kFifoFlush));  // 14.33
  }

  /// Silence: first the bank is selected again, then everything.
  constexpr void watch(base::Micros now) {
    const base::Micros silence{settings_.period_ns() / 50 + 20'000};  // 20 periods and 20 ms
    const base::Micros since = now - heard_;
    if (since < silence) return;
    if (!asked_again_) {
      asked_again_ = true;
      health_.add(Reason::kStale);
      bus_.forget_bank();
    } else if (since >= silence + silence) {
      restart(now, base::Micros{0});
    }
  }

  enum class Compared : std::uint8_t { kEqual, kDifferent, kNoAnswer };

  constexpr Compared compare(const Field& field) {
    std::uint8_t value = 0;
    if (!ok(bus_.read(field.where, value))) return Compared::kNoAnswer;
    return (value & field.mask) == field.value ? Compared::kEqual : Compared::kDifferent;
  }

  /// In turn: the bank, the identity, every field but the first, which says "off".
  constexpr void check(base::Micros now) {
    check_due_ = now + kCheckTime;
    if (next_ == 0) {
      static_cast<void>(ok(bus_.confirm_bank()));
    } else {
      const Compared compared = compare(next_ < kFieldCount ? fields_[next_] : Field{kWhoAmI, 0xFF, kIdentity});
      if (compared == Compared::kDifferent) {
        health_.add(Reason::kConfigChanged);
        return restart(now, base::Micros{0});
      }
    }
    next_ = next_ < kFieldCount ? next_ + 1 : 0;
  }

  constexpr void self_test(base::Micros now) {
    const SelfTest::Progress progress = self_test_.step(bus_, now);
    if (progress == SelfTest::Progress::kBusy) return;
    if (progress == SelfTest::Progress::kBroken || !self_test_.result().passed) health_.add(Reason::kSelfTestFailed);
    restart(now, base::Micros{0});
  }

  Bus<Spi> bus_;
  Settings settings_;
  std::array<Field, kFieldCount> fields_;
  Stream stream_;
  SelfTest self_test_{};
  Health health_{};
  base::Micros due_{}, reset_limit_{}, check_due_{}, heard_{};
  std::size_t next_ = 0;  ///< field that is written, verified or checked next
  bool started_ = false;
  bool asked_again_ = false;
};

}  // namespace tetap::drivers::icm42688
