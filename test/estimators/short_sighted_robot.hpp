// SPDX-License-Identifier: Apache-2.0
// A robot that drives a circle among seven landmarks, of which it sees one at a time, and only near ones.
#pragma once

#include "estimators/circling_robot.hpp"

#include <algorithm>
#include <array>
#include <functional>
#include <utility>

namespace tetap::test {

inline constexpr float kReach_m = 3;  ///< landmarks farther away are not seen

/// Drives about a place of its own among seven landmarks; sees one at a time, in turn, and only near ones.
template <class E>
struct ShortSighted {
  explicit ShortSighted(unsigned seed) : robot(held_backward()), random(seed) {
    robot.numbers.landmark.gate_scale = 1.5F;
    robot.map.clear();
    for (std::uint8_t id = 1; id <= 7; ++id) {  // about the circle, some inside it
      const double angle = 0.9 * id, radius = id % 2 == 0 ? 4.5 : 1.5;
      static_cast<void>(robot.map.put({.x_mm = static_cast<std::int32_t>(1000 * radius * std::cos(angle)),
                                       .y_mm = static_cast<std::int32_t>(3000 + 1000 * radius * std::sin(angle)),
                                       .id = id}));
    }
    robot.random.seed(seed);
  }
  /// Half a second, and a sighting at its end: of the nearest landmark in every other, of the next nearest else.
  void look(const std::function<std::uint8_t(std::uint8_t)>& read_as) {
    robot.drive(10, false);
    std::array<std::uint8_t, 7> ids{1, 2, 3, 4, 5, 6, 7};
    std::sort(ids.begin(), ids.end(), [this](auto a, auto b) { return way(a) < way(b); });
    const std::uint8_t id = ids[looks++ % 2];
    if (way(id) <= static_cast<double>(kReach_m)) see(id, read_as(id));
  }
  /// A sighting, by a camera that looks so far aside.
  void see(std::uint8_t id, std::uint8_t read_as, double aside_rad = 0) {
    const model::Landmark at = *robot.map.find(id);
    const double dx = static_cast<double>(at.x.minus({})) - robot.x, dy = static_cast<double>(at.y.minus({})) - robot.y;
    const auto noise = [this](double sigma) { return std::normal_distribution<double>(0, sigma)(random); };
    static_cast<void>(robot.estimator.fuse(
        sensor::LandmarkSighting{.landmark = read_as,
                                 .range_m = static_cast<float>(std::hypot(dx, dy) + noise(0.1)),
                                 .bearing_rad = static_cast<float>(std::remainder(
                                     std::atan2(dy, dx) - robot.yaw + aside_rad + noise(0.02), 2 * M_PI))},
        {robot.us}, robot.ctx()));
  }
  [[nodiscard]] double way(std::uint8_t id) const {
    const model::Landmark at = *robot.map.find(id);
    return std::hypot(static_cast<double>(at.x.minus({})) - robot.x, static_cast<double>(at.y.minus({})) - robot.y);
  }
  /// Squared error of the pose over its covariance's diagonal, at its worst.
  [[nodiscard]] double worst_sigmas() {
    const estimators::Estimate e = robot.estimate();
    const double yaw = std::abs(std::remainder(static_cast<double>(e.pose.yaw_rad) - robot.yaw, 2 * M_PI));
    const auto sigma = [&e](int i) { return std::sqrt(static_cast<double>(e.p(i, i))); };
    return std::max({std::abs(static_cast<double>(e.pose.x.minus({})) - robot.x) / sigma(0),
                     std::abs(static_cast<double>(e.pose.y.minus({})) - robot.y) / sigma(1), yaw / sigma(2)});
  }
  CirclingRobot<E> robot;
  std::mt19937 random;
  std::size_t looks = 0;
};

inline const auto kRight = [](std::uint8_t id) { return id; };

}  // namespace tetap::test
