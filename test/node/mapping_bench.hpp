// SPDX-License-Identifier: Apache-2.0
// A robot that makes a map of its own on the bench: it circles among posts, frames in and frames out.
#pragma once

#include "bench.hpp"
#include "tetap/estimators/mapping/planar_mapper.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <random>

namespace tetap::test {

using Ekf = node::Estimators<estimators::Odometry, estimators::EkfSlam30>;
using Fast = node::Estimators<estimators::Odometry, estimators::FastSlam100>;

inline constexpr std::uint32_t kMappingBase = 0x300;
struct Place {
  double x, y;
};

/// A robot on a circle of 3 m around the origin, at 0.5 m/s, among posts. It sees what is within 6 m ten times a
/// second, all of one stamp.
template <class Estimators>
class Mapping {
 public:
  explicit Mapping(int posts = 8) : bench(std::make_unique<BenchOf<Estimators>>(numbers())) {
    for (int i = 0; i < posts; ++i) {
      const double angle = 2 * M_PI * i / posts;
      truth[i + 1] = {(i % 2 == 0 ? 5.0 : 4.0) * std::cos(angle), (i % 2 == 0 ? 5.0 : 4.0) * std::sin(angle)};
    }
    for (const auto& frame : set_pose(1, 3000, 0, static_cast<float>(M_PI / 2), 0.0F, 0.0F)) now.push_back(frame);
  }
  /// A node keeps a reference to its parameters.
  static const param::Parameters& numbers() {
    static const param::Parameters n = [] {
      param::Parameters p = kNumbers;
      p.landmark = {.sigma_range_m = 0.05F, .sigma_bearing_rad = 0.02F, .gate_scale = 1.5F};
      return p;
    }();
    return n;
  }

  /// Sightings are true but for a noise of `share` of their sigmas; `late_us`: they arrive so much later.
  void drive(int epochs, double share = 1, std::int64_t late_us = 0, bool backwards = false) {
    for (int i = 0; i < epochs; ++i, ++tick) {
      const std::int64_t at_us = bench->now_us + 5000;
      const double t = 1e-6 * static_cast<double>(at_us - bench->kStart_us), yaw = M_PI / 2 + t * kRate;
      now.push_back(body_speed(at_us, static_cast<float>(kSpeed), static_cast<float>(kRate), tick));
      Frames seen;
      for (const auto& [id, post] : tick % 10 == 9 ? truth : std::map<int, Place>{}) {
        const double dx = post.x - 3 * std::cos(t * kRate), dy = post.y - 3 * std::sin(t * kRate);
        std::normal_distribution<double> normal(0, share);
        const double range = std::hypot(dx, dy) + 0.05 * normal(draw);
        const double bearing = std::remainder(std::atan2(dy, dx) - yaw + 0.02 * normal(draw), 2 * M_PI);
        if (range < 6)
          seen.push_back(sighting(at_us, id, static_cast<float>(range), static_cast<float>(bearing), tick / 10));
      }
      if (backwards) std::reverse(seen.begin(), seen.end());
      for (const auto& frame : seen) waiting.push_back({bench->now_us + late_us, frame});
      while (!waiting.empty() && waiting.front().first <= bench->now_us) {
        now.push_back(waiting.front().second);
        waiting.erase(waiting.begin());
      }
      step();
    }
  }
  void step() {
    out = bench->epoch(now);
    now.clear();
    for (const auto& frame : out) {
      if (const auto one = message<bus::EstLandmark>(frame))
        map[one->id] = {one->x_raw * bus::EstLandmark::kXScale, one->y_raw * bus::EstLandmark::kYScale};
      if (const auto one = message<bus::EstDiagMapper>(frame)) page = *one;
      if (const auto one = message<bus::EstInnov>(frame))
        ++verdicts[one->sensor == sensor::Sensor::kRangeBearing ? one->verdict : sensor::Verdict::kNotUsed];
      if (const auto one = message<bus::EstStatus>(frame)) status = *one, map_faults |= one->map_faults;
      if (const auto one = message<bus::EstStateCrc>(frame)) crc = one->crc;
    }
  }
  template <class Message>
  static std::optional<Message> message(const base::CanFrame& frame) {
    if (frame.id != kMappingBase + bus::offset_of<Message>()) return std::nullopt;
    return bus::decode<Message>(bus::payload(frame));
  }
  [[nodiscard]] double worst_landmark_m() const {
    double worst = 0;
    for (const auto& [id, at] : map) worst = std::max(worst, std::hypot(at.x - truth.at(id).x, at.y - truth.at(id).y));
    return worst;
  }
  [[nodiscard]] Place robot() const {
    const auto pos = last<bus::EstPos>(out, 1);
    return {pos->x_raw * bus::EstPos::kXScale, pos->y_raw * bus::EstPos::kYScale};
  }

  static constexpr double kSpeed = 0.5, kRate = kSpeed / 3;
  std::unique_ptr<BenchOf<Estimators>> bench;
  std::map<int, Place> truth, map;  ///< posts by number; as last published
  bus::EstDiagMapper page;
  bus::EstStatus status;
  unsigned map_faults = 0;  ///< bits of MapFault that the status ever had
  std::map<sensor::Verdict, int> verdicts;
  std::uint32_t crc = 0;
  Frames now, out;
  std::vector<std::pair<std::int64_t, base::CanFrame>> waiting;
  std::mt19937 draw{4};
  int tick = 0;
};

}  // namespace tetap::test
