// SPDX-License-Identifier: Apache-2.0
// A robot's drive in the simulated world without a fault, as ticks of input frames with the truth at each. The
// situations in which a fault may fall on it are found in that truth.
#pragma once

#include "sim_host/replay/log.hpp"
#include "sim_host/world/world.hpp"
#include "tetap/param/parameters.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace tetap::sim {

struct CleanLog {
  param::Parameters parameters;
  base::Micros begin;  ///< the node's power-on
  std::vector<base::Micros> ticks;
  std::vector<TimedFrame> frames;  ///< in the order of their ticks; each has the time of its tick
  std::vector<std::size_t> first;  ///< index of a tick's first frame; one entry more than ticks
  std::vector<Truth> truth;        ///< at each tick, in the frame of the world's map
  GeodeticOrigin origin;           ///< origin of that map
  bool recorded = false;           ///< the truth is that of a data set: position and perhaps heading
  bool planar = false;             ///< no inertial filter: neither velocity nor tilt are estimated
  bool surveyed = true;            ///< landmarks fix the node's map there; false: it may begin at a fix

  [[nodiscard]] std::span<const TimedFrame> of(std::size_t tick) const {
    return std::span(frames).subspan(first[tick], first[tick + 1] - first[tick]);
  }
};

/// The robot on its class's course, in the mismatched world. A robot that fuses an outside heading and has neither
/// course constraint nor magnetometer is sent one at 5 Hz, 1 sigma 2 deg.
[[nodiscard]] CleanLog clean_log(const std::string& robot, std::uint64_t seed);

/// A recorded log with its truth (CSV with time_s, x_m, y_m and perhaps yaw_rad, in the log's time and the map's
/// frame). Truth is linear between its rows, and none in a gap of more than two and a half of their median distance.
/// Throws std::runtime_error for a file that cannot be read.
[[nodiscard]] CleanLog recorded_log(const std::string& robot, const std::string& path, const std::string& truth);

inline constexpr std::string_view kSituations =
    "standing straight curve start outage, of a recorded log place1 to place10";

/// The tick at which a fault begins in that situation; the places of a recorded log are evenly spread over it. Throws
/// std::runtime_error for an unknown name.
[[nodiscard]] std::size_t tick_of(std::string_view situation, const CleanLog& log);

/// Mean speed and turn rate over the five seconds from a tick on.
struct Moving {
  double speed_mps = 0;
  double turn_radps = 0;  ///< mean magnitude over half seconds
};
[[nodiscard]] Moving moving_at(const CleanLog& log, std::size_t tick);

/// Receiver off during the situation "outage": from so long before the fault to so long after its begin.
inline constexpr base::Micros kOutageBefore{5'000'000}, kOutageAfter{10'000'000};

}  // namespace tetap::sim
