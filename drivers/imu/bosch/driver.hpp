// SPDX-License-Identifier: Apache-2.0
// A Bosch IMU over SPI, as a machine that is polled and never waits: the chip's table of actions, all kept fields read
// back, then a sample at each poll that finds a new one. Kept fields are checked in turn; a lasting fault begins again.
// Poll it at its data rate at least; a poll that comes too late loses samples, which are counted.
#pragma once

#include "drivers/imu/bosch/action.hpp"
#include "drivers/imu/bosch/stream.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::drivers::bosch {

template <class Chip>
class Driver {
 public:
  explicit constexpr Driver(const Chip& chip) : chip_(chip), stream_(chip.stream()) {
    if (!chip_.valid()) health_.state = State::kMisconfigured;
  }

  /// `sink(const ImuReading&)` is called for a new sample. A few transfers at most, never a wait.
  template <class Sink>
  constexpr void poll(base::Micros now, Sink&& sink) {
    if (health_.state == State::kMisconfigured) return;
    if (!polled_) {
      polled_ = true;
      due_ = now + kPowerUpTime;
    }
    if (health_.state == State::kRunning) return run(now, sink);
    if (now < due_) return;
    if (health_.state == State::kStartup) {
      start(now);
    } else {
      verify(now);
    }
  }

  [[nodiscard]] constexpr const Health& health() const { return health_; }
  [[nodiscard]] constexpr bool running() const { return health_.state == State::kRunning; }
  /// Excess of the chip's tick over its nominal length, by the MCU's clock, in parts per million.
  [[nodiscard]] constexpr std::int32_t clock_error_ppm() const { return stream_.clock_error_ppm(); }

 private:
  static constexpr base::Micros kPowerUpTime{3'000};
  static constexpr base::Micros kGrain{100};  ///< added to a wait, for a clock that is read in steps
  static constexpr base::Micros kRetryTime{100'000};
  static constexpr base::Micros kCheckTime{5'000};  ///< one field each

  constexpr void restart(base::Micros due) {
    ++health_.restarts;
    health_.state = State::kStartup;
    stream_.restart();
    next_ = 0;
    due_ = due;
  }

  constexpr bool ok(bool transferred) {
    if (!transferred) health_.add(Reason::kBusFault);
    return transferred;
  }

  constexpr void start(base::Micros now) {
    const Action& action = chip_.actions()[next_];
    if (!carry_out(action)) return restart(now + kRetryTime);
    if (action.kind == Kind::kUpload && !chip_.uploaded()) return;
    due_ = now + base::Micros{action.wait_us} + kGrain;
    if (++next_ < chip_.actions().size()) return;
    next_ = 0;
    health_.state = State::kVerify;
  }

  /// False: refused; the reason is counted.
  constexpr bool carry_out(const Action& action) {
    std::uint8_t value = 0;
    const std::array<std::uint8_t, 2> out{action.address, action.value};
    switch (action.kind) {
      case Kind::kTouch:
        return ok(chip_.read(action.target, action.address, std::span(&value, 1)));
      case Kind::kWrite:
      case Kind::kKeep:
        return ok(chip_.write(action.target, out));
      case Kind::kExpect:
        return holds(action, action.otherwise);
      case Kind::kUpload:
        return ok(chip_.upload());
      case Kind::kLearn:
        if (!ok(chip_.read(action.target, action.address, std::span(&value, 1)))) return false;
        chip_.learn(value);
        return true;
    }
    return false;
  }

  constexpr bool holds(const Action& action, Reason otherwise) {
    std::uint8_t value = 0;
    if (!ok(chip_.read(action.target, action.address, std::span(&value, 1)))) return false;
    if ((value & action.mask) == action.value) return true;
    health_.add(otherwise);
    return false;
  }

  [[nodiscard]] static constexpr bool stays(const Action& action) {
    return action.kind == Kind::kKeep || action.kind == Kind::kExpect;
  }

  constexpr void verify(base::Micros now) {
    const Action& action = chip_.actions()[next_];
    if (stays(action) && !holds(action, Reason::kConfigRefused)) return restart(now + kRetryTime);
    if (++next_ < chip_.actions().size()) return;
    next_ = 0;
    health_.state = State::kRunning;
    stream_.restart();
    check_due_ = now + kCheckTime;
    responded_ = now;
  }

  template <class Sink>
  constexpr void run(base::Micros now, Sink&& sink) {
    Raw raw{};
    bool read = ok(chip_.sample(raw));
    if (read && stream_.doubtful(raw)) read = ok(chip_.sample(raw));
    if (read && stream_.take(raw, now, health_, sink)) responded_ = now;
    const base::Micros silence{20 * stream_.period().us + 20'000};
    if (now - responded_ > silence) {
      health_.add(Reason::kStale);
      return restart(now);
    }
    if (now >= check_due_) check(now);
  }

  /// One field in turn. A fault of the bus is no change.
  constexpr void check(base::Micros now) {
    check_due_ = now + kCheckTime;
    const Action& action = chip_.actions()[next_];
    next_ = next_ + 1 < chip_.actions().size() ? next_ + 1 : 0;
    const std::uint16_t faults = health_.of(Reason::kBusFault);
    if (!stays(action) || holds(action, Reason::kConfigChanged) || health_.of(Reason::kBusFault) != faults) return;
    restart(now);
  }

  Chip chip_;
  Stream stream_;
  Health health_{};
  base::Micros due_{}, check_due_{}, responded_{};
  std::size_t next_ = 0;  ///< action that is carried out or checked next
  bool polled_ = false;
};

}  // namespace tetap::drivers::bosch
