// SPDX-License-Identifier: Apache-2.0
// A robot that drives a circle among four landmarks, and an estimator behind its sensors.
#pragma once

#include "config/mrclam.hpp"
#include "tetap/base/bit_crc.hpp"
#include "tetap/base/state_words.hpp"
#include "tetap/estimators/context.hpp"
#include "tetap/estimators/estimate.hpp"
#include "tetap/sensor/window.hpp"

#include <cmath>
#include <random>
#include <vector>

namespace tetap::test {

inline constexpr std::int64_t kStep_us = 50'000;

/// Among four landmarks, driving a circle of 3 m; the truth is a double.
template <class E>
struct CirclingRobot {
  explicit CirclingRobot(const param::Parameters& parameters = robot::mrclam::parameters) : numbers(parameters) {
    static_cast<void>(map.put({.x_mm = 5000, .id = 1}));
    static_cast<void>(map.put({.y_mm = 8000, .id = 2}));
    static_cast<void>(map.put({.x_mm = -5000, .y_mm = 1000, .id = 3}));
    static_cast<void>(map.put({.x_mm = 1000, .y_mm = -4000, .id = 4}));
    frame.map = &map;
    frame.frame = nav::LocalFrame(24'000'000'000, 5'500'000'000, 500.0F);
    frame.origin = sensor::OriginSource::kConfigured;
    estimator.restart({}, ctx());
  }
  [[nodiscard]] estimators::Context ctx() const { return {.parameters = numbers, .map_frame = frame}; }
  void set(float x_m, float y_m, float yaw_rad, float sigma_m, float sigma_rad) {
    estimator.set_pose({us},
                       {.pose = {.x = base::Anchored{}.plus(x_m), .y = base::Anchored{}.plus(y_m), .yaw_rad = yaw_rad},
                        .sigma_position_m = sigma_m,
                        .sigma_yaw_rad = sigma_rad},
                       ctx());
  }
  /// One step of the circle, with a sighting of every landmark each tenth.
  void drive(int steps, bool sees = true) {
    const auto normal = [this](double sigma) { return std::normal_distribution<double>(0, sigma)(random); };
    for (int k = 0; k < steps; ++k) {
      us += kStep_us;
      const double dt = 1e-6 * static_cast<double>(kStep_us);
      const double ds = dt * (1.0 + normal(0.05)), dyaw = dt * (1.0 / 3.0 + normal(0.02));
      x += ds * std::cos(yaw + dyaw / 2), y += ds * std::sin(yaw + dyaw / 2), yaw += dyaw;
      static_cast<void>(
          estimator.fuse(sensor::BodySpeed{.forward_mps = 1.0F, .yaw_rate_radps = 1.0F / 3}, {us}, ctx()));
      if (!sees || k % 10 != 9) continue;
      for (std::uint8_t id = 1; id <= seen; ++id) {
        const model::Landmark at = *map.find(id);
        const double dx = static_cast<double>(at.x.minus({})) - x, dy = static_cast<double>(at.y.minus({})) - y;
        verdicts.push_back(
            estimator
                .fuse(sensor::LandmarkSighting{.landmark = ids ? id : std::uint8_t{0xFF},
                                               .range_m = static_cast<float>(std::hypot(dx, dy) + normal(0.1)),
                                               .bearing_rad = static_cast<float>(
                                                   std::remainder(std::atan2(dy, dx) - yaw + normal(0.02), 2 * M_PI))},
                      {us}, ctx())
                .verdict);
      }
    }
  }
  [[nodiscard]] estimators::Estimate estimate() {
    if constexpr (requires { estimator.advance({us}, ctx(), sensor::Window{}); }) {
      estimator.advance({us}, ctx(), {});
    } else {
      estimator.advance({us}, ctx());
    }
    return estimator.estimate(ctx());
  }
  [[nodiscard]] double error_m() {
    const estimators::Estimate e = estimate();
    return std::hypot(static_cast<double>(e.pose.x.minus({})) - x, static_cast<double>(e.pose.y.minus({})) - y);
  }
  [[nodiscard]] std::uint32_t hash() const {
    base::BitCrc crc;
    base::each_word(estimator, crc);
    return crc.value();
  }

  param::Parameters numbers;
  estimators::LandmarkMap<estimators::kMapCapacity> map;
  estimators::MapFrame frame;
  E estimator;
  std::mt19937 random{7};
  std::vector<sensor::Verdict> verdicts;
  double x = 0, y = 0, yaw = 0;
  std::int64_t us = 0;
  bool ids = true;        ///< landmarks are told apart
  std::uint8_t seen = 4;  ///< landmarks 1 to this one are seen
};

inline param::Parameters held_backward() {
  param::Parameters numbers = robot::mrclam::parameters;
  numbers.wheels.hold = param::Hold::kBackward;
  numbers.wheels.noise = {.speed = 1.3e-4F, .yaw_rate = 2e-5F};  // densities of the circle's noise
  numbers.landmark = {.sigma_range_m = 0.1F, .sigma_bearing_rad = 0.02F, .gate_scale = 3};
  return numbers;
}

}  // namespace tetap::test
