// SPDX-License-Identifier: Apache-2.0
// A displacement between stamps as its frames on the bus, for a node at base 0x300.
#pragma once

#include "tetap/bus/codec.hpp"
#include "tetap/bus/messages.hpp"

#include <array>
#include <cstdint>
#include <vector>

namespace tetap::test {

struct Relative {
  float x_m = 0, y_m = 0, yaw_rad = 0;
  float sigma_x_m = 0.01F, sigma_y_m = 0.01F, sigma_yaw_rad = 0.002F;
  float corr_xy = 0, corr_x_yaw = 0, corr_y_yaw = 0;
};
[[nodiscard]] inline std::vector<base::CanFrame> relative_frames(std::int64_t from_us, std::int64_t to_us, int seq,
                                                                 const Relative& r) {
  const auto number = static_cast<std::uint8_t>(seq & 15);
  return {
      bus::frame(0x300, bus::InRelativePose{.stamp_us = static_cast<std::uint32_t>(to_us & 0xFFFFF),
                                            .seq = number,
                                            .interval_us = static_cast<std::uint32_t>(to_us - from_us),
                                            .yaw_rad = r.yaw_rad}),
      bus::frame(
          0x300,
          bus::InRelativePoseStdX{
              .seq = number, .x_m = r.x_m, .std_x_m = r.sigma_x_m, .corr_xy = r.corr_xy, .corr_x_yaw = r.corr_x_yaw}),
      bus::frame(0x300, bus::InRelativePoseStdY{.seq = number,
                                                .y_m = r.y_m,
                                                .std_y_m = r.sigma_y_m,
                                                .std_yaw_rad = r.sigma_yaw_rad,
                                                .corr_y_yaw = r.corr_y_yaw})};
}

}  // namespace tetap::test
