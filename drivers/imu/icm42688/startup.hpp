// SPDX-License-Identifier: Apache-2.0
// From power-up to running sensors, in steps that never wait. Reset, identity, every field written, every field read
// back, sensors on, their samples discarded while they start. DS-000347 rev. 1.8; sections at the places.
#pragma once

#include "drivers/imu/icm42688/bus.hpp"
#include "drivers/imu/icm42688/health.hpp"
#include "drivers/imu/icm42688/settings.hpp"
#include "tetap/base/time.hpp"

namespace tetap::drivers::icm42688 {

enum class Compared : std::uint8_t { kEqual, kDifferent, kNoResponse };

class Startup {
 public:
  enum class Progress : std::uint8_t { kBusy, kRunning, kFailed };

  explicit constexpr Startup(const Settings& settings) : fields_(fields(settings)) {}

  [[nodiscard]] constexpr const std::array<Field, kFieldCount>& wanted() const { return fields_; }

  /// From the beginning, not before `due`.
  constexpr void begin(base::Micros due, Health& health) { go(State::kPowerUp, due, health); }

  template <class Bus>
  [[nodiscard]] constexpr Progress step(Bus& bus, base::Micros now, Health& health) {
    if (now < due_) return Progress::kBusy;
    switch (health.state) {
      case State::kPowerUp:
        return reset(bus, now, health);
      case State::kReset:
        return await_reset(bus, now, health);
      case State::kIdentify:
        return identify(bus, now, health);
      case State::kConfigure:
        return configure(bus, now, health);
      case State::kVerify:
        return verify(bus, now, health);
      case State::kWarmUp:
        return warm_up(bus, health);
      default:
        return Progress::kFailed;
    }
  }

  template <class Bus>
  static constexpr Compared compare(Bus& bus, const Field& field, Health& health) {
    std::uint8_t value = 0;
    if (!ok(bus.read(field.where, value), health)) return Compared::kNoResponse;
    return (value & field.mask) == field.value ? Compared::kEqual : Compared::kDifferent;
  }

  /// Counts what went wrong on the bus.
  static constexpr bool ok(BusResult result, Health& health) {
    if (result == BusResult::kDone) return true;
    health.add(result == BusResult::kFault ? Reason::kBusFault : Reason::kBankLost);
    return false;
  }

 private:
  static constexpr base::Micros kResetTime{1'000};    // 14.1: no other access
  static constexpr base::Micros kGrain{1'000};        // added to it, for a clock that is read in steps
  static constexpr base::Micros kResetLimit{50'000};  // ours: no answer by then is an answer
  static constexpr base::Micros kWarmUpTime{50'000};  // 14.36: on for at least 45 ms; table 1: 30 ms to start
  static constexpr std::size_t kFieldsPerPoll = 4;

  constexpr void go(State state, base::Micros due, Health& health) {
    health.state = state;
    due_ = due;
    next_ = 0;
  }

  template <class Bus>
  constexpr Progress reset(Bus& bus, base::Micros now, Health& health) {
    bus.invalidate_bank();
    if (!ok(bus.write(kDeviceConfig, kSoftReset), health)) return Progress::kFailed;
    bus.invalidate_bank();  // the chip is in bank 0 now (14.59), but it may have missed the command
    reset_limit_ = now + kResetLimit;
    go(State::kReset, now + kResetTime + kGrain, health);
    return Progress::kBusy;
  }

  template <class Bus>
  constexpr Progress await_reset(Bus& bus, base::Micros now, Health& health) {
    std::uint8_t status = 0;
    if (ok(bus.read(kIntStatus, status), health) && (status & kResetDone) != 0 && status != 0xFF) {
      go(State::kIdentify, now, health);
      return Progress::kBusy;
    }
    if (now < reset_limit_) return Progress::kBusy;
    health.add(Reason::kResetIncomplete);
    return Progress::kFailed;
  }

  template <class Bus>
  constexpr Progress identify(Bus& bus, base::Micros now, Health& health) {
    switch (compare(bus, {kWhoAmI, 0xFF, kIdentity}, health)) {
      case Compared::kEqual:
        go(State::kConfigure, now, health);
        return Progress::kBusy;
      case Compared::kDifferent:
        health.add(Reason::kWrongIdentity);
        return Progress::kFailed;
      case Compared::kNoResponse:
        break;
    }
    return Progress::kFailed;
  }

  /// All but the last field, which starts the sensors.
  template <class Bus>
  constexpr Progress configure(Bus& bus, base::Micros now, Health& health) {
    for (std::size_t i = 0; i < kFieldsPerPoll && next_ + 1 < kFieldCount; ++i, ++next_) {
      const Field& field = fields_[next_];
      if (!ok(bus.modify(field.where, field.mask, field.value), health)) return Progress::kFailed;
    }
    if (next_ + 1 == kFieldCount) go(State::kVerify, now, health);
    return Progress::kBusy;
  }

  template <class Bus>
  constexpr Progress verify(Bus& bus, base::Micros now, Health& health) {
    for (std::size_t i = 0; i < kFieldsPerPoll && next_ + 1 < kFieldCount; ++i, ++next_) {
      const Compared compared = compare(bus, fields_[next_], health);
      if (compared == Compared::kEqual) continue;
      if (compared == Compared::kDifferent) health.add(Reason::kConfigRefused);
      return Progress::kFailed;
    }
    if (next_ + 1 < kFieldCount) return Progress::kBusy;
    const Field& on = fields_[kFieldCount - 1];
    if (!ok(bus.modify(on.where, on.mask, on.value), health)) return Progress::kFailed;
    go(State::kWarmUp, now + kWarmUpTime, health);
    return Progress::kBusy;
  }

  template <class Bus>
  constexpr Progress warm_up(Bus& bus, Health& health) {
    std::uint8_t old_status = 0;  // 14.21: reading clears; the FIFO may have been full meanwhile
    const bool clean =
        ok(bus.write(kSignalPathReset, kFifoFlush), health) && ok(bus.read(kIntStatus, old_status), health);
    return clean ? Progress::kRunning : Progress::kFailed;
  }

  std::array<Field, kFieldCount> fields_;
  base::Micros due_{}, reset_limit_{};
  std::size_t next_ = 0;  ///< field that is written or read back next
};

}  // namespace tetap::drivers::icm42688
