// SPDX-License-Identifier: Apache-2.0
// The simulated world as a source of ticks: what its sensors send, as frames. The truth is for the report and never
// sent.
#pragma once

#include "sim_host/encode.hpp"
#include "sim_host/replay/script.hpp"
#include "sim_host/world/world.hpp"
#include "tetap/bus/e2e.hpp"
#include "tetap/bus/guard_sender.hpp"

#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace tetap::sim {

/// Appends a node's frames of the start: the map of landmarks, and the start pose where `pose` asks for it.
inline void introduce(const World& world, std::uint32_t base, bool pose, std::vector<base::CanFrame>& frames) {
  const auto millimetres = [](double m) { return static_cast<std::int32_t>(std::lround(m * 1000.0)); };
  for (const Landmark& mark : world.map_given() ? world.map() : std::span<const Landmark>{})
    frames.push_back(bus::frame(
        base, bus::InMapEntry{.id = mark.id, .x_raw = millimetres(mark.x_m), .y_raw = millimetres(mark.y_m)}));
  const StartPose start = world.start_pose();
  // Further from the origin than the bus can carry, the robot has to find its place by itself.
  constexpr double kFarthest_m = 67'000;
  if (!pose || magnitude(start.x_m) > kFarthest_m || magnitude(start.y_m) > kFarthest_m) return;
  frames.push_back(
      bus::frame(base, bus::protect(bus::CmdSetPos{
                           .ctr = 1, .x_raw = millimetres(start.x_m) / 2, .y_raw = millimetres(start.y_m) / 2})));
  frames.push_back(
      bus::frame(base, bus::protect(bus::CmdSetYaw{.ctr = 1,
                                                   .yaw_rad = static_cast<float>(start.yaw_rad),
                                                   .std_pos_m = static_cast<float>(start.sigma_m),
                                                   .std_yaw_rad = static_cast<float>(start.sigma_yaw_rad)})));
}

/// The world as whoever plays it sees it: step(), frames(), inject(). As a source it is stepped tick by tick.
class WorldSource {
 public:
  WorldSource(World world, std::uint32_t base, base::Micros period, base::Micros limit,
              bool initial_pose_estimate = true)
      : world_(std::move(world)),
        initial_pose_estimate_(initial_pose_estimate),
        base_(base),
        period_(period),
        now_(world_.start()),
        end_(world_.start() + (limit < world_.duration() ? limit : world_.duration())) {}

  /// From now on guards are sent with samples and map entries (param::BusParameters::guard).
  void send_guards() { guards_.emplace(); }

  /// Lets the world run for so long. The first step brings the landmark map and the start pose.
  void step(std::int64_t ms) { run_for({ms * 1'000}); }
  /// Frames of the last step, in the order in which they are sent.
  [[nodiscard]] std::span<const base::CanFrame> frames() const { return frames_; }
  /// As World::inject().
  void inject(const FaultSetting& fault) { world_.inject(fault); }
  FaultSetting inject(Fault fault, base::Micros duration) { return world_.inject(fault, duration); }

  bool next(Tick& tick) {
    if (now_ + period_ > end_) return false;
    const bool first = !begun_;
    run_for(period_);
    tick = {.time = now_ + world_.clock_offset(), .inputs = frames_, .begin = {}};
    if (first) tick.begin = now_ - period_;
    return true;
  }

  /// As of the last step.
  [[nodiscard]] const Truth& truth() const { return truth_; }
  [[nodiscard]] const World& world() const { return world_; }
  /// Sightings since they were taken last.
  [[nodiscard]] std::vector<TrueSighting> take_sightings() { return world_.take_sightings(); }

 private:
  void run_for(base::Micros span) {
    now_ += span;
    measurements_.clear();
    frames_.clear();
    world_.advance_to(now_, measurements_);
    const bool pose = initial_pose_estimate_ && !world_.faults().active(Fault::kMovingStart, {});
    if (!std::exchange(begun_, true)) introduce(world_, base_, pose, frames_);
    for (const Measurement& m : measurements_) encode(base_, m, frames_);
    if (guards_) guard();
    truth_ = world_.truth();
  }
  /// Each guard behind the last frame of its sample, or before its map entry.
  void guard() {
    guarded_.clear();
    for (const base::CanFrame& frame : frames_) {
      const auto offset = static_cast<std::uint8_t>(frame.id - base_);
      if (offset == bus::InMapEntry::kOffset) {
        bus::InGuardEntry entry{.entry_id = frame.data[0], .entry_ctr = entries_++};
        entry.entry_crc = bus::entry_guard_crc(entry, frame);
        guarded_.push_back(bus::frame(base_, entry));
      }
      guarded_.push_back(frame);
      if (const auto sample = guards_->after(offset, frame)) guarded_.push_back(bus::frame(base_, *sample));
    }
    frames_.swap(guarded_);
  }

  World world_;
  bool initial_pose_estimate_;
  std::uint32_t base_;
  base::Micros period_;
  base::Micros now_;
  base::Micros end_;
  std::vector<Measurement> measurements_;
  std::vector<base::CanFrame> frames_, guarded_;
  std::optional<bus::GuardSender> guards_;
  std::uint8_t entries_ = 0;  ///< map entries guarded
  Truth truth_;
  bool begun_ = false;
};

static_assert(Source<WorldSource>);

}  // namespace tetap::sim
