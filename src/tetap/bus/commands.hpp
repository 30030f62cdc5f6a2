// SPDX-License-Identifier: Apache-2.0
// Commands from the bus: protected by CRC and counter, each obeyed once; a set pose comes in two frames of one counter.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/bus/codec.hpp"
#include "tetap/bus/command_policy.hpp"
#include "tetap/bus/counters.hpp"
#include "tetap/bus/e2e.hpp"
#include "tetap/bus/messages.hpp"
#include "tetap/estimators/context.hpp"

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <type_traits>

namespace tetap::bus {

/// The codec's value for "not available" where a field is an integer of steps.
inline constexpr std::int32_t kNoSteps = std::numeric_limits<std::int32_t>::min();

/// Whether a robot has a map of its own, which a command resets.
template <class Out>
inline constexpr bool kMakesMap = requires {
  requires std::remove_cvref_t<Out>::kMakesMap;
};

class Commands {
 public:
  /// `offset` is that of CmdReset, CmdSetPos or CmdSetYaw. Out gets reset(bus::ResetWhat), set_pose(SetPose).
  template <class Out>
  void on_frame(std::uint8_t offset, const base::CanFrame& frame, base::Micros reference, Counters& counters, Out& out);

  void power_on() {
    halves_ = {};
    policy_.power_on();
  }
  /// Half commands older than `patience`, or from a time still to come, are given up and counted.
  void expire(base::Micros now, base::Micros patience, Counters& counters) {
    for (PoseHalves& halves : halves_)
      if (halves.waits() && (now - halves.since > patience || halves.since > now)) {
        halves = {};
        ++counters.command_refused;
      }
  }
  void discard() { halves_ = {}; }

 private:
  /// A set-pose command of which one frame is there.
  struct PoseHalves {
    std::optional<bus::CmdSetPos> position;
    std::optional<bus::CmdSetYaw> yaw;
    std::uint8_t counter = 0;
    base::Micros since;
    [[nodiscard]] constexpr bool waits() const { return position.has_value() || yaw.has_value(); }
  };
  PoseHalves& halves_of(std::uint8_t counter, base::Micros reference, Counters& counters);

  std::array<PoseHalves, 4> halves_{};
  CommandPolicy policy_;
};

inline Commands::PoseHalves& Commands::halves_of(std::uint8_t counter, base::Micros reference, Counters& counters) {
  PoseHalves* halves = &halves_[0];
  for (PoseHalves& candidate : halves_) {
    if (candidate.waits() && candidate.counter == counter) return candidate;
    if (halves->waits() && (!candidate.waits() || candidate.since < halves->since)) halves = &candidate;
  }
  if (halves->waits()) {  // more at once than there is room for
    *halves = {};
    ++counters.command_refused;
  }
  halves->since = reference;
  halves->counter = counter;
  return *halves;
}

template <class Out>
[[gnu::cold]] void Commands::on_frame(std::uint8_t offset, const base::CanFrame& frame, base::Micros reference,
                                      Counters& counters, Out& out) {
  const auto counter = static_cast<std::uint8_t>(frame.data[1] & 0x0F);
  const CommandKind kind = offset == bus::CmdReset::kOffset ? CommandKind::kReset : CommandKind::kSetPose;
  if (!bus::e2e_valid(offset, bus::payload(frame)) || policy_.repeats(kind, counter))
    return void(++counters.command_refused);
  if (offset == bus::CmdReset::kOffset) {
    const auto reset = bus::decode<bus::CmdReset>(bus::payload(frame));
    if (!reset) return void(++counters.malformed);
    if (reset->what > (kMakesMap<Out> ? bus::ResetWhat::kOwnMap : bus::ResetWhat::kWiredOn))
      return void(++counters.out_of_range);
    if (policy_.admits(kind, counter, reference, counters)) out.reset(reset->what);
    return;
  }
  PoseHalves& halves = halves_of(counter, reference, counters);
  if (offset == bus::CmdSetPos::kOffset) halves.position = bus::decode<bus::CmdSetPos>(bus::payload(frame));
  if (offset == bus::CmdSetYaw::kOffset) halves.yaw = bus::decode<bus::CmdSetYaw>(bus::payload(frame));
  if (!halves.position || !halves.yaw) return;
  const bus::CmdSetPos position = *halves.position;
  const bus::CmdSetYaw yaw = *halves.yaw;
  halves = {};
  if (!policy_.admits(kind, counter, reference, counters)) return;
  constexpr std::int64_t kUmPerStep = 2000;
  const bool heading = base::is_finite(yaw.std_yaw_rad) && base::is_finite(yaw.yaw_rad);
  if (position.x_raw == kNoSteps || position.y_raw == kNoSteps || !base::is_finite(yaw.std_pos_m)) {
    return void(++counters.out_of_range);
  }
  out.set_pose(estimators::SetPose{.pose = {.x = base::Anchored::from_um(position.x_raw * kUmPerStep),
                                            .y = base::Anchored::from_um(position.y_raw * kUmPerStep),
                                            .yaw_rad = heading ? yaw.yaw_rad : 0.0F},
                                   .sigma_position_m = yaw.std_pos_m,
                                   .sigma_yaw_rad = heading ? yaw.std_yaw_rad : 4.0F,
                                   .counter = counter});
}

}  // namespace tetap::bus
