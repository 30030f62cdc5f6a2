// SPDX-License-Identifier: Apache-2.0
// The pose that a node publishes, against the truth of the simulated world.
#pragma once

#include "sim_host/world/motion.hpp"
#include "tetap/bus/codec.hpp"

#include <Eigen/LU>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace tetap::sim {

/// One epoch's frames of one estimator, as anybody on the bus decodes them.
struct Published {
  std::optional<bus::EstPos> position;
  std::optional<bus::EstMotion> motion;
  std::optional<bus::EstStdPose> deviation;
  std::optional<bus::EstStdMore> correlation;

  void take(std::uint32_t offset, std::span<const std::uint8_t> payload, std::size_t k) {
    if (offset == bus::offset_of<bus::EstPos>(k)) position = bus::decode<bus::EstPos>(payload);
    if (offset == bus::offset_of<bus::EstMotion>(k)) motion = bus::decode<bus::EstMotion>(payload);
    if (offset != bus::offset_of<bus::EstStdPose>(k)) return;
    if (const auto page = bus::decode<bus::EstStdPose>(payload)) deviation = page;
    if (const auto page = bus::decode<bus::EstStdMore>(payload)) correlation = page;
  }
  /// Normalised squared error; empty in an epoch without a covariance.
  [[nodiscard]] std::optional<double> nees(const Truth& truth) const {
    if (!position || !motion || !deviation || !correlation) return std::nullopt;
    const auto real = [](float x) { return static_cast<double>(x); };
    const Eigen::Vector3d std{real(deviation->std_x_m), real(deviation->std_y_m), real(deviation->std_yaw_rad)};
    const Eigen::Vector3d error{bus::EstPos::kXScale * position->x_raw - truth.x_m,
                                bus::EstPos::kYScale * position->y_raw - truth.y_m,
                                wrap(real(motion->yaw_rad) - truth.yaw_rad)};
    Eigen::Matrix3d p = Eigen::Matrix3d::Identity();
    p(0, 1) = p(1, 0) = real(deviation->corr_xy);
    p(0, 2) = p(2, 0) = real(correlation->corr_x_yaw);
    p(1, 2) = p(2, 1) = real(correlation->corr_y_yaw);
    const Eigen::Vector3d scaled = error.cwiseQuotient(std);
    return scaled.dot(p.inverse() * scaled);
  }
};

}  // namespace tetap::sim
