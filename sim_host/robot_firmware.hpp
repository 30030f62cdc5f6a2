// SPDX-License-Identifier: Apache-2.0
// The firmware of a robot behind an interface, for host programs: each robot's node is compiled once, whatever bus it
// is put on.
#pragma once

#include "hal/board.hpp"
#include "hal/board/linux/clock.hpp"
#include "tetap/bus/version.hpp"
#include "tetap/param/parameters.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

namespace tetap::sim {

/// A CAN controller (hal::CanBus) chosen at run time.
class AnyCan {
 public:
  AnyCan() = default;
  AnyCan(const AnyCan&) = delete;
  AnyCan& operator=(const AnyCan&) = delete;
  virtual ~AnyCan() = default;

  virtual bool send(const base::CanFrame& frame) = 0;
  virtual std::optional<base::CanFrame> receive() = 0;
  virtual void flush() = 0;
  [[nodiscard]] virtual base::CanFaults faults() const = 0;
};

/// Forwards to a controller that outlives it.
template <hal::CanBus Can>
class CanAdapter final : public AnyCan {
 public:
  explicit CanAdapter(Can& can) : can_(can) {}

  bool send(const base::CanFrame& frame) override { return can_.send(frame); }
  std::optional<base::CanFrame> receive() override { return can_.receive(); }
  void flush() override { can_.flush(); }
  [[nodiscard]] base::CanFaults faults() const override { return can_.faults(); }

 private:
  Can& can_;
};

/// The host as a board: any bus, and the machine's monotonic clock from the board's beginning.
struct HostBoard {
  /// `longest_pause`: a longer time between two looks at the clock counts as so long; 0: all time counts. For a node
  /// that stands still together with its player, as in a stopped process.
  explicit HostBoard(AnyCan& bus, base::Micros longest_pause = {}) : can(bus), longest_pause_(longest_pause) {}

  [[nodiscard]] base::Micros now() {
    const base::Micros time = hal::monotonic_clock();
    const base::Micros pause = time - looked_;
    if (longest_pause_.us > 0 && pause > longest_pause_) began_ += pause - longest_pause_;
    looked_ = time;
    return time - began_;
  }

  static constexpr bool kSnapshots = true;
  static constexpr const char* kHardware = "Linux";
  [[nodiscard]] std::uint8_t canopen_id() const { return node_id; }

  AnyCan& can;
  std::uint8_t node_id = 0;  ///< on a CANopen bus; 0: none

 private:
  base::Micros longest_pause_;
  base::Micros began_ = hal::monotonic_clock();
  base::Micros looked_ = began_;
};

/// firmware::Firmware of some robot.
class RobotFirmware {
 public:
  RobotFirmware() = default;
  RobotFirmware(const RobotFirmware&) = delete;
  RobotFirmware& operator=(const RobotFirmware&) = delete;
  virtual ~RobotFirmware() = default;

  virtual void poll() = 0;
  /// Hash of the boot self-check over so many epochs.
  [[nodiscard]] virtual std::uint32_t self_check(std::uint32_t epochs) = 0;
  /// Goes on from a snapshot's state; false: that is of another layout.
  [[nodiscard]] virtual bool resume(std::span<const std::byte> state) = 0;
};

}  // namespace tetap::sim
