// SPDX-License-Identifier: Apache-2.0
// A scanner RPLIDAR A1 on a serial line: asks for its health, starts a standard scan, hands on each whole turn with the
// time of its first beam. Beam k is at k degrees clockwise, as with the LD19. The motor has a pin of its own
// (MOTOCTL), which is the board's. Slamtec, RPLIDAR Interface Protocol and Application Notes, rev. 1.1.
#pragma once

#include "drivers/lidar/line.hpp"
#include "drivers/lidar/rplidar/framer.hpp"
#include "drivers/lidar/turn_assembly.hpp"
#include "hal/byte_stream.hpp"
#include "tetap/base/time.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace tetap::drivers::rplidar {

/// Counts of what was read and refused: noise in bytes, the rest in measurements, turns or events.
struct Health {
  std::uint32_t nodes = 0;       ///< measurements that counted
  std::uint32_t noise = 0;       ///< bytes that belong to none
  std::uint32_t turns_cut = 0;   ///< turns given up: the line was quiet within them
  std::uint32_t restarts = 0;    ///< begun again: no answer, or the scan went quiet
  std::uint32_t errors = 0;      ///< answers of the scanner that it is in protection stop
  std::optional<Status> status;  ///< last answer of the scanner
};

template <hal::ByteStream Port>
class Driver {
 public:
  explicit constexpr Driver(Port& port) : port_(&port) {}

  /// Calls `handler(ranges, first)` for every whole turn: 360 ranges, and the time of the beam at 0 degrees. Reads a
  /// bounded number of bytes, never waits. The time is that of the bytes' arrival less what they took on the line.
  template <class Handler>
  constexpr void poll(base::Micros now, Handler&& handler) {
    read_line(*port_, [&](std::uint8_t byte, std::size_t after) { on_byte(byte, now, after, handler); });
    step(now);
    health_.turns_cut = turns_.cut();
  }

  [[nodiscard]] constexpr const Health& health() const { return health_; }
  [[nodiscard]] constexpr bool scanning() const { return state_ == State::kScan; }

 private:
  enum class State : std::uint8_t { kBegin, kQuiet, kBoot, kHealth, kStart, kScan };

  static constexpr base::Micros kQuietTime{20'000};    ///< the notes ask for 1 ms after a stop; the line empties
  static constexpr base::Micros kBootTime{2'000'000};  ///< ours: the A1 prints its version as text meanwhile
  static constexpr base::Micros kAnswerTime{500'000};  ///< ours: no answer by then is none
  static constexpr base::Micros kSpinTime{5'000'000};  ///< ours: measurements begin when the motor is at its speed
  static constexpr base::Micros kSilence{1'000'000};   ///< ours: five turns without a measurement
  static constexpr base::Micros kGap{50'000};          ///< a quarter of a turn is missing

  constexpr void go(State state, base::Micros due) {
    state_ = state;
    due_ = due;
    matched_ = 0;
    answered_ = 0;
  }

  /// False: the port had no room; a part of a request is no request, and the next one begins with a stop.
  constexpr bool send(const Request& request) { return port_->write(std::span(request)) == request.size(); }

  constexpr void step(base::Micros now) {
    if (state_ == State::kBegin) {
      if (send(kAskStop)) go(State::kQuiet, now + kQuietTime);
      return;
    }
    if (now < due_) return;
    if (state_ == State::kQuiet || state_ == State::kBoot) {
      go(send(kAskHealth) ? State::kHealth : State::kBegin, now + kAnswerTime);
    } else {
      ++health_.restarts;
      turns_.give_up();
      go(State::kBegin, now);
    }
  }

  template <class Handler>
  constexpr void on_byte(std::uint8_t byte, base::Micros now, std::size_t after, Handler& handler) {
    if (state_ == State::kHealth && matched_ == kDescriptorBytes) {
      answer_[answered_] = byte;
      if (++answered_ == kHealthBytes) on_health(now);
    } else if (state_ == State::kHealth) {
      match(kHealthFollows, byte);
    } else if (state_ == State::kStart) {
      match(kScanFollows, byte);
      if (matched_ < kDescriptorBytes) return;
      framer_.clear();
      go(State::kScan, now + kSpinTime);
    } else if (state_ == State::kScan) {
      scan(byte, now, after, handler);
    }
  }

  /// One byte more of the descriptor that is awaited, or its start again.
  constexpr void match(const Descriptor& wanted, std::uint8_t byte) {
    matched_ = byte == wanted[matched_] ? matched_ + 1 : byte == wanted[0] ? 1 : 0;
  }

  constexpr void on_health(base::Micros now) {
    const std::uint8_t status = answer_[0];
    if (status > static_cast<std::uint8_t>(Status::kError)) return go(State::kHealth, due_);  // no such answer
    health_.status = static_cast<Status>(status);
    if (health_.status != Status::kError) return go(send(kAskScan) ? State::kStart : State::kBegin, now + kAnswerTime);
    ++health_.errors;
    go(send(kAskReset) ? State::kBoot : State::kBegin, now + kBootTime);
  }

  template <class Handler>
  constexpr void scan(std::uint8_t byte, base::Micros now, std::size_t after, Handler& handler) {
    const auto node = framer_.on_byte(byte, health_.noise);
    if (!node) return;
    ++health_.nodes;
    due_ = now + kSilence;
    // The measurement is taken to be of the time at which its first byte was sent.
    const base::Micros at = now - line_time(after + framer_.waiting() + kNodeBytes, kBaud);
    turns_.add({.angle_cdeg = node->angle_cdeg(), .distance_mm = node->distance_mm, .at = at}, handler);
  }

  Port* port_;
  Framer framer_{};
  Health health_{};
  TurnAssembly turns_{kGap};
  State state_ = State::kBegin;
  base::Micros due_{};       ///< time of the next step, or the end of the patience for an answer
  std::size_t matched_ = 0;  ///< bytes of the descriptor that is awaited
  std::size_t answered_ = 0;
  std::array<std::uint8_t, kHealthBytes> answer_{};
};

}  // namespace tetap::drivers::rplidar
