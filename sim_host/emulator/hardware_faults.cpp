// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/hardware_faults.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <utility>

namespace tetap::board {

namespace {

constexpr std::int64_t kJump_edges = 5'000, kForeign_hz = 300, kBurst = 128;

constexpr std::array kTable{
    HardwareFaultInfo{HardwareFault::kImuDead, "imu_dead", 60, 10, "the IMU answers nothing: its MISO line floats"},
    HardwareFaultInfo{HardwareFault::kImuPowerLost, "imu_power_lost", 60, 0,
                      "the IMU's supply dips: its registers are those of power-on"},
    HardwareFaultInfo{HardwareFault::kImuStalled, "imu_stalled", 60, 5,
                      "the IMU answers, and takes no samples any more"},
    HardwareFaultInfo{HardwareFault::kGnssUnplugged, "gnss_unplugged", 60, 20, "the receiver's cable is out"},
    HardwareFaultInfo{HardwareFault::kGnssPowerLost, "gnss_power_lost", 60, 0,
                      "the receiver's supply dips: it starts with its factory settings"},
    HardwareFaultInfo{HardwareFault::kEncoderUnplugged, "encoder_unplugged", 60, 10, "both encoders' cable is out"},
    HardwareFaultInfo{HardwareFault::kEncoderJump, "encoder_jump", 60, 0,
                      "a disturbance adds 5000 edges to the right encoder"},
    HardwareFaultInfo{HardwareFault::kBusDisturbed, "bus_disturbed", 60, 1,
                      "a short circuit of CAN_H and CAN_L: no frame comes through, the controller goes bus-off"},
    HardwareFaultInfo{HardwareFault::kBusStuck, "bus_stuck", 60, 1, "the transceiver's receive line stays dominant"},
    HardwareFaultInfo{HardwareFault::kNoPartner, "no_partner", 60, 2, "no other node acknowledges"},
    HardwareFaultInfo{HardwareFault::kForeignFrames, "foreign_frames", 60, 10,
                      "another node sends 300 frames a second that this node takes"},
    HardwareFaultInfo{HardwareFault::kForeignBurst, "foreign_burst", 60, 0,
                      "another node sends 128 such frames back to back"},
    HardwareFaultInfo{HardwareFault::kCoreStalled, "core_stalled", 60, 0.12,
                      "the core executes nothing, as while its flash is erased; all blocks run on"},
    HardwareFaultInfo{HardwareFault::kMisoLow, "miso_low", 60, 5, "a short circuit: the IMU's MISO line stays low"},
    HardwareFaultInfo{HardwareFault::kMisoHigh, "miso_high", 60, 5, "the IMU's MISO line stays high"},
    HardwareFaultInfo{HardwareFault::kStackOverflow, "stack_overflow", 60, 0, "the program recurses without an end"},
    HardwareFaultInfo{HardwareFault::kBadRead, "bad_read", 60, 0, "the program reads where no memory is"},
    HardwareFaultInfo{HardwareFault::kBadJump, "bad_jump", 60, 0, "the program jumps to where no memory is"},
    HardwareFaultInfo{HardwareFault::kUndefinedInstruction, "undefined_instruction", 60, 0,
                      "the program meets an undefined instruction"},
    HardwareFaultInfo{HardwareFault::kUnalignedAccess, "unaligned_access", 60, 0,
                      "the program reads two words at an unaligned address"},
    HardwareFaultInfo{HardwareFault::kFloatingPointOff, "floating_point_off", 60, 0,
                      "the floating-point unit is switched off"},
    HardwareFaultInfo{HardwareFault::kLoopStalled, "loop_stalled", 60, 0,
                      "the program's loop comes round no more; its interrupts go on"},
};

std::optional<double> seconds(std::string_view text) {
  double value = 0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed);
  if (code != std::errc{} || end != text.data() + text.size() || !(value >= -1 && value <= 1e6)) return std::nullopt;
  return value;
}

Picoseconds picoseconds(double time_s) { return std::llround(time_s * 1e6) * kMicrosecond; }

}  // namespace

std::span<const HardwareFaultInfo> hardware_fault_table() { return kTable; }

std::string hardware_fault_help() {
  std::string text;
  for (const HardwareFaultInfo& row : kTable) {
    std::array<char, 200> line{};
    std::snprintf(line.data(), line.size(), "  %-18s @%g+%-8g %s\n", std::string(row.name).c_str(), row.start_s,
                  row.duration_s, std::string(row.what).c_str());
    text += line.data();
  }
  return text;
}

std::optional<HardwareFaultSetting> parse_hardware_fault(std::string_view text) {
  const auto at = text.find('@');
  const auto row = std::find_if(kTable.begin(), kTable.end(),
                                [&](const HardwareFaultInfo& one) { return one.name == text.substr(0, at); });
  if (row == kTable.end()) return std::nullopt;
  HardwareFaultSetting setting{row->fault, picoseconds(row->start_s), picoseconds(row->duration_s)};
  if (at == std::string_view::npos) return setting;
  const std::string_view when = text.substr(at + 1);
  const auto plus = when.find('+');
  const auto start = seconds(when.substr(0, plus));
  const auto duration =
      plus == std::string_view::npos ? std::optional(row->duration_s) : seconds(when.substr(plus + 1));
  if (!start || !duration || *duration < 0)
    throw std::runtime_error("fault '" + std::string(text) + "': the form is NAME[@START[+DURATION]], in seconds, " +
                             "START from -1 on");
  setting.start = picoseconds(*start);
  setting.duration = picoseconds(*duration);
  return setting;
}

// True: one of the core, which has no end of its own.
bool HardwareFaults::upset(HardwareFault fault) {
  constexpr std::array kUpsets{std::pair{HardwareFault::kStackOverflow, Upset::kStackOverflow},
                               std::pair{HardwareFault::kBadRead, Upset::kBadRead},
                               std::pair{HardwareFault::kBadJump, Upset::kBadJump},
                               std::pair{HardwareFault::kUndefinedInstruction, Upset::kUndefinedInstruction},
                               std::pair{HardwareFault::kUnalignedAccess, Upset::kUnalignedAccess},
                               std::pair{HardwareFault::kFloatingPointOff, Upset::kFloatingPointOff},
                               std::pair{HardwareFault::kLoopStalled, Upset::kEndlessLoop}};
  for (const auto& [one, what] : kUpsets) {
    if (one == fault) return machine_.upset(what), true;
  }
  return false;
}

void HardwareFaults::add(const HardwareFaultSetting& setting, Picoseconds world_start) {
  Scheduler& scheduler = board_.processor.scheduler;
  alarms_.push_back(std::make_unique<Alarm>(scheduler, [this, setting] { begin(setting); }));
  alarms_.back()->set(world_start + setting.start);
  if (setting.duration == 0) return;
  alarms_.push_back(std::make_unique<Alarm>(scheduler, [this, setting] { end(setting.fault); }));
  alarms_.back()->set(world_start + setting.start + setting.duration);
}

void HardwareFaults::begin(const HardwareFaultSetting& setting) {
  const Picoseconds now = board_.processor.scheduler.now();
  CanLine& line = board_.processor.can_line();
  if (upset(setting.fault)) return;
  switch (setting.fault) {
    case HardwareFault::kImuDead:
      board_.imu.dead = true;
      break;
    case HardwareFault::kImuPowerLost:
      board_.imu.dip();
      break;
    case HardwareFault::kImuStalled:
      board_.imu.stalled = true;
      break;
    case HardwareFault::kGnssUnplugged:
      board_.plug_gnss(false);
      break;
    case HardwareFault::kGnssPowerLost:
      if (sensors_ != nullptr) sensors_->receiver.power_on(now);
      break;
    case HardwareFault::kEncoderUnplugged:
      board_.plug_encoders(false);
      break;
    case HardwareFault::kEncoderJump:
      if (sensors_ != nullptr) sensors_->extra_edges += kJump_edges;
      break;
    case HardwareFault::kBusDisturbed:
      line.disturb(now + setting.duration);
      break;
    case HardwareFault::kBusStuck:
      line.stuck_dominant = true;
      break;
    case HardwareFault::kNoPartner:
      line.partner = false;
      break;
    case HardwareFault::kForeignFrames:
      send_foreign(now + setting.duration, kSecond / kForeign_hz);
      break;
    case HardwareFault::kForeignBurst:
      send_foreign(now + kBurst * kMicrosecond, kMicrosecond);
      break;
    case HardwareFault::kCoreStalled:
      machine_.stall(now + setting.duration);
      break;
    case HardwareFault::kMisoLow:
    case HardwareFault::kMisoHigh:
      board_.processor.spi().stuck_miso = setting.fault == HardwareFault::kMisoHigh;
      break;
    default:
      break;
  }
}

void HardwareFaults::end(HardwareFault fault) {
  CanLine& line = board_.processor.can_line();
  switch (fault) {
    case HardwareFault::kImuDead:
      board_.imu.dead = false;
      break;
    case HardwareFault::kImuStalled:
      board_.imu.stalled = false;
      break;
    case HardwareFault::kGnssUnplugged:
      board_.plug_gnss(true);
      break;
    case HardwareFault::kEncoderUnplugged:
      board_.plug_encoders(true);
      break;
    case HardwareFault::kBusStuck:
      line.release();
      break;
    case HardwareFault::kNoPartner:
      line.partner = true;
      break;
    case HardwareFault::kMisoLow:
    case HardwareFault::kMisoHigh:
      board_.processor.spi().stuck_miso.reset();
      break;
    default:
      break;
  }
  line.poke();
}

void HardwareFaults::send_foreign(Picoseconds until, Picoseconds every) {
  std::uint8_t number = 0;
  for (Picoseconds at = board_.processor.scheduler.now(); at < until; at += every)
    board_.processor.can_line().send({.id = foreign_id_, .size = 8, .data = {number++}}, at);
}

}  // namespace tetap::board
