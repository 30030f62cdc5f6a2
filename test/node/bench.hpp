// SPDX-License-Identifier: Apache-2.0
// A node on the bench: frames in, frames out, nothing else.
#pragma once

#include "tetap/estimators/odometry.hpp"
#include "tetap/estimators/planar/pose_ekf.hpp"
#include "tetap/node/node.hpp"

#include <map>
#include <optional>
#include <vector>

namespace tetap::test {

using Frames = std::vector<base::CanFrame>;

inline constexpr param::Parameters kNumbers{
    .wheels = {.drive = {.left_radius_m = 0.1F,
                         .right_radius_m = 0.1F,
                         .track_m = 0.5F,
                         .counts_per_turn = 2000,
                         .noise_left = 1e-4F,
                         .noise_right = 1e-4F},
               .noise = {.speed = 1e-3F, .yaw_rate = 1e-3F}},
    .landmark = {.sigma_range_m = 0.1F, .sigma_bearing_rad = 0.02F},
};

template <class Estimators>
class BenchOf {
 public:
  explicit BenchOf(const param::Parameters& parameters = kNumbers) : node(parameters, {.git = 0x12345678}) {
    node.power_on({kStart_us});
  }

  /// One epoch: frames in this order, then the tick. The frames that came out.
  Frames epoch(const Frames& in) {
    Frames out;
    for (const auto& frame : in) node.on_frame(frame);
    now_us += 10'000;
    node.tick({now_us}, {}, [&out](const base::CanFrame& frame) { out.push_back(frame); });
    return out;
  }
  Frames idle(int epochs) {
    Frames all;
    for (int i = 0; i < epochs; ++i)
      for (const auto& frame : epoch({})) all.push_back(frame);
    return all;
  }

  static constexpr std::int64_t kStart_us = 5'000'000;
  std::int64_t now_us = kStart_us;
  node::Node<Estimators> node;
};
using Bench = BenchOf<node::Estimators<estimators::Odometry, estimators::PoseEkf>>;

template <class Message>
base::CanFrame in(const Message& message, std::size_t instance = 0) {
  return bus::frame(0x300, message, instance);
}

inline std::uint32_t stamp(std::int64_t us) { return static_cast<std::uint32_t>(us & 0xFFFFF); }

inline base::CanFrame body_speed(std::int64_t at_us, float forward_mps, float yaw_rate_radps, int seq = 0) {
  return in(bus::InBodySpeed{.stamp_us = stamp(at_us),
                             .seq = static_cast<std::uint8_t>(seq & 15),
                             .forward_mps = forward_mps,
                             .yaw_rate_radps = yaw_rate_radps});
}
inline base::CanFrame sighting(std::int64_t at_us, int landmark, float range_m, float bearing_rad, int seq = 0) {
  return in(bus::InRangeBearing{.stamp_us = stamp(at_us),
                                .seq = static_cast<std::uint8_t>(seq & 15),
                                .id = static_cast<std::uint8_t>(landmark),
                                .range_m = range_m,
                                .bearing_rad = bearing_rad});
}
inline base::CanFrame map_entry(int id, int x_mm, int y_mm) {
  return in(bus::InMapEntry{.id = static_cast<std::uint8_t>(id), .x_raw = x_mm, .y_raw = y_mm});
}
inline Frames set_pose(int counter, int x_mm, int y_mm, float yaw_rad, float sigma_m = 0.1F, float sigma_rad = 0.05F) {
  const auto ctr = static_cast<std::uint8_t>(counter & 15);
  return {
      in(bus::protect(bus::CmdSetPos{.ctr = ctr, .x_raw = x_mm / 2, .y_raw = y_mm / 2})),
      in(bus::protect(bus::CmdSetYaw{.ctr = ctr, .yaw_rad = yaw_rad, .std_pos_m = sigma_m, .std_yaw_rad = sigma_rad}))};
}

/// The last message of this kind in the frames, if any.
template <class Message>
std::optional<Message> last(const Frames& frames, std::size_t instance = 0) {
  std::optional<Message> found;
  for (const auto& frame : frames)
    if (frame.id == 0x300 + bus::offset_of<Message>(instance))
      if (const auto message = bus::decode<Message>(bus::payload(frame))) found = message;
  return found;
}
template <class Message>
std::vector<Message> all(const Frames& frames, std::size_t instance = 0) {
  std::vector<Message> found;
  for (const auto& frame : frames)
    if (frame.id == 0x300 + bus::offset_of<Message>(instance))
      if (const auto message = bus::decode<Message>(bus::payload(frame))) found.push_back(*message);
  return found;
}

}  // namespace tetap::test
