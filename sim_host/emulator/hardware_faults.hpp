// SPDX-License-Identifier: Apache-2.0
// Faults of the board's hardware by name, NAME@START+DURATION in seconds after the world's start; from -1 on,
// power-on.
#pragma once

#include "sim_host/emulator/board.hpp"
#include "sim_host/emulator/machine.hpp"
#include "sim_host/emulator/simulated_sensors.hpp"

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace tetap::board {

enum class HardwareFault : std::uint8_t {
  kImuDead,
  kImuPowerLost,
  kImuStalled,
  kGnssUnplugged,
  kGnssPowerLost,
  kEncoderUnplugged,
  kEncoderJump,
  kBusDisturbed,
  kBusStuck,
  kNoPartner,
  kForeignFrames,
  kForeignBurst,
  kCoreStalled,
  kMisoLow,
  kMisoHigh,
  kStackOverflow,
  kBadRead,
  kBadJump,
  kUndefinedInstruction,
  kUnalignedAccess,
  kFloatingPointOff,
  kLoopStalled,
};

struct HardwareFaultInfo {
  HardwareFault fault;
  std::string_view name;
  double start_s, duration_s;  ///< unless the command line gives others; a duration of 0: an instant
  std::string_view what;
};

struct HardwareFaultSetting {
  HardwareFault fault;
  Picoseconds start = 0, duration = 0;  ///< after the world's start
};

[[nodiscard]] std::span<const HardwareFaultInfo> hardware_fault_table();
/// One line per fault, for --help.
[[nodiscard]] std::string hardware_fault_help();
/// Nothing where `text` names none of the table; throws std::runtime_error where its times are no numbers.
[[nodiscard]] std::optional<HardwareFaultSetting> parse_hardware_fault(std::string_view text);

/// Lets faults begin and end on a board. Sensors that are absent (null) have none.
class HardwareFaults {
 public:
  /// `foreign_id`: identifier of kForeignFrames.
  HardwareFaults(Board& board, Machine& machine, SimulatedSensors* sensors, std::uint32_t foreign_id) noexcept
      : board_(board), machine_(machine), sensors_(sensors), foreign_id_(foreign_id) {}
  void add(const HardwareFaultSetting& setting, Picoseconds world_start);

 private:
  void begin(const HardwareFaultSetting& setting);
  void end(HardwareFault fault);
  void send_foreign(Picoseconds until, Picoseconds every);
  [[nodiscard]] bool upset(HardwareFault fault);

  Board& board_;
  Machine& machine_;
  SimulatedSensors* sensors_;
  std::uint32_t foreign_id_;
  std::vector<std::unique_ptr<Alarm>> alarms_;
};

}  // namespace tetap::board
