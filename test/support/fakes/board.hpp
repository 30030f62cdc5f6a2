// SPDX-License-Identifier: Apache-2.0
// A board made of the fakes: every sensor that a node can have wired, a bus in memory, a clock that the test moves.
#pragma once

#include "hal/board.hpp"
#include "support/fakes/encoder.hpp"
#include "support/fakes/icm42688.hpp"
#include "support/fakes/ublox.hpp"
#include "tetap/base/time.hpp"

#include <cstdint>

namespace tetap::fakes {

/// `Can` is the board's end of a bus. Time passes by advance() alone.
template <hal::CanBus Can>
struct WiredBoard {
  explicit WiredBoard(Can bus) : can(std::move(bus)) {}

  [[nodiscard]] base::Micros now() const { return time; }
  void idle() { ++idles; }
  void start_watchdog() { watchdog_started = true; }
  void kick() { ++kicks; }
  [[nodiscard]] const hal::BootReport& boot() const { return report; }
  [[nodiscard]] hal::StackUse stack() const { return stack_use; }

  void advance(base::Micros to) {
    time = to;
    imu.advance(to);
    left_encoder.advance(to);
    right_encoder.advance(to);
    gnss.advance(to);
  }

  Can can;
  Icm42688 imu{};
  Encoder<std::uint32_t> left_encoder{};
  Encoder<std::uint16_t> right_encoder{};
  Ublox gnss{Generation::kKeys, 38'400};

  base::Micros time{};
  hal::BootReport report{};
  hal::StackUse stack_use{};
  std::uint64_t idles = 0, kicks = 0;
  bool watchdog_started = false;
};

}  // namespace tetap::fakes
