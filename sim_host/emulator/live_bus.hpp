// SPDX-License-Identifier: Apache-2.0
// The emulated bus joined to a CAN interface of the host, in real time: the one place of the emulated board that reads
// the host's clock. What comes through on either side is on both.
#pragma once

#include "hal/board/linux/socket_can.hpp"
#include "sim_host/emulator/can_line.hpp"
#include "sim_host/emulator/virtual_time.hpp"

#include <deque>
#include <string>

namespace tetap::board {

class LiveBus {
 public:
  /// Throws std::runtime_error with one line where the interface is not there.
  LiveBus(const std::string& interface, CanLine& line, Scheduler& scheduler);
  LiveBus(const LiveBus&) = delete;
  LiveBus& operator=(const LiveBus&) = delete;

  /// A frame came through on the emulated bus.
  void came_through(const CanOffer& frame, bool own);
  /// The longest time that the board was behind the host's clock.
  [[nodiscard]] base::Micros latest() const { return latest_; }

 private:
  static constexpr Picoseconds kStep = 2 * kMillisecond;
  void pace();
  void take();

  hal::SocketCan can_;
  CanLine& line_;
  Scheduler& scheduler_;
  Alarm step_;
  base::Micros began_, latest_;
  std::deque<base::CanFrame> taken_;  ///< frames of the interface that have not come through yet
};

}  // namespace tetap::board
