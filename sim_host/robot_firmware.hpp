// SPDX-License-Identifier: Apache-2.0
// The firmware of a robot behind an interface, for host programs: each robot's node is compiled once, whatever bus it
// is put on.
#pragma once

#include "bus/version.hpp"
#include "hal/board.hpp"
#include "hal/board/linux/clock.hpp"
#include "param/parameters.hpp"

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
  [[nodiscard]] virtual hal::CanFaults faults() const = 0;
};

/// Forwards to a controller that outlives it.
template <hal::CanBus Can>
class CanAdapter final : public AnyCan {
 public:
  explicit CanAdapter(Can& can) : can_(can) {}

  bool send(const base::CanFrame& frame) override { return can_.send(frame); }
  std::optional<base::CanFrame> receive() override { return can_.receive(); }
  void flush() override { can_.flush(); }
  [[nodiscard]] hal::CanFaults faults() const override { return can_.faults(); }

 private:
  Can& can_;
};

/// The host as a board: any bus, and the machine's monotonic clock from the board's beginning.
struct HostBoard {
  explicit HostBoard(AnyCan& bus) : can(bus) {}

  [[nodiscard]] base::Micros now() const { return hal::monotonic_clock() - began; }

  static constexpr bool kSnapshots = true;
  AnyCan& can;
  base::Micros began = hal::monotonic_clock();
};

/// node::Firmware of some robot.
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

/// Firmware with these estimators; instantiated once for each robot, in a file that CMake makes. The board and the
/// parameters outlive it.
template <class Estimators>
[[nodiscard]] std::unique_ptr<RobotFirmware> make_firmware(HostBoard& board, const param::Parameters& parameters,
                                                           const bus::Version& version);

}  // namespace tetap::sim
