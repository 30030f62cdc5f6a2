// SPDX-License-Identifier: Apache-2.0
// A robot with a scanner on the bench, and recorded scans driven through it as frames.
#pragma once

#include "bench.hpp"
#include "support/imported_scans.hpp"
#include "support/scan_frames.hpp"

#include <gtest/gtest.h>
#include <cmath>
#include <map>
#include <numbers>
#include <vector>

namespace tetap::test {

/// Wheels as body speeds that are means since the sample before, and scans.
template <class Robot>
struct DrivenOf {
  explicit DrivenOf(const param::Parameters& numbers) : parameters(numbers), bench(parameters) {}

  void tick(Frames frames, float forward_mps, float yaw_rate_radps) {
    frames.push_back(body_speed(bench.now_us + 10'000, forward_mps, yaw_rate_radps, seq++));
    const Frames out = bench.epoch(frames);
    for (const auto& one : all<bus::EstScanMatch>(out)) matches.push_back(one);
    for (const auto& one : all<bus::EstKeyframe>(out)) keyframes[one.id].scan = scans;
    for (const auto& one : all<bus::EstKeyframePose>(out)) {
      keyframes[one.id].x_m = static_cast<double>(one.x_m), keyframes[one.id].y_m = static_cast<double>(one.y_m);
      keyframes[one.id].yaw_rad = static_cast<double>(one.yaw_rad);
      keyframes[one.id].seen = bench.now_us;
    }
    if (const auto state = last<bus::EstGraph>(out)) graph = *state;
    if (const auto page = last<bus::EstDiagMapper>(out)) map = *page;
    for (const auto& one : all<bus::EstInnov>(out))
      if (one.sensor == sensor::Sensor::kScan) refused.push_back(one.verdict);
    if (const auto pos = last<bus::EstPos>(out, 1)) x_m = 1e-3 * pos->x_raw, y_m = 1e-3 * pos->y_raw;
    if (const auto motion = last<bus::EstMotion>(out, 1)) yaw_rad = static_cast<double>(motion->yaw_rad);
    if (const auto std = last<bus::EstStdPose>(out, 1)) sigma = *std;
    if (const auto status = last<bus::EstStatus>(out)) used |= status->used, valid = status->pos_valid != 0;
    crcs.push_back(last<bus::EstStateCrc>(out)->crc);
  }

  param::Parameters parameters;
  BenchOf<Robot> bench;
  std::vector<bus::EstScanMatch> matches;
  std::vector<sensor::Verdict> refused;
  std::vector<std::uint32_t> crcs;
  bus::EstStdPose sigma;
  double x_m = 0, y_m = 0, yaw_rad = 0;
  unsigned used = 0;
  bool valid = false;
  int seq = 0;
  struct Keyframe {
    std::size_t scan = 0;  ///< number of the scan
    double x_m = 0, y_m = 0, yaw_rad = 0;
    std::int64_t seen = 0;  ///< tick that published it last
  };
  std::map<int, Keyframe> keyframes;
  std::size_t scans = 0;
  bus::EstGraph graph;
  bus::EstDiagMapper map;
};

struct Place {
  double x, y, yaw;
};
inline Place seen_from(const Place& a, const Place& b) {
  const double c = std::cos(a.yaw), s = std::sin(a.yaw), dx = b.x - a.x, dy = b.y - a.y;
  return {c * dx + s * dy, c * dy - s * dx, std::remainder(b.yaw - a.yaw, 2 * std::numbers::pi)};
}
/// A robot with a recorded set's odometry: it is off by centimetres and degrees at each step, whatever its length.
inline param::Parameters recorded(param::Parameters n) {
  n.lidar = {.min_m = 0.05F, .max_m = 30};
  n.loop.work_units = 40'000;
  n.wheels.noise = {.speed = 0.05F, .yaw_rate = 0.05F};
  return n;
}
/// Poses of the scans of a recorded set: rows as tools/dataset/import_scans writes them. each() comes after each scan.
template <class Robot>
std::vector<Place> replayed(DrivenOf<Robot>& node, const std::vector<Row>& rows, auto&& each) {
  std::vector<Place> track;
  node.tick({}, 0, 0);  // a sample of the time of power-on is too late
  for (std::size_t k = 1; k < rows.size(); ++k) {
    const Row& row = rows[k];
    if (k > 1) {  // the step of odometry as a turn, a way and a turn of 0.2 s each
      const Row& before = rows[k - 1];
      const Place d = seen_from({before[1], before[2], before[3]}, {row[1], row[2], row[3]});
      const double back = d.x < 0 ? -1 : 1, turn = std::atan2(back * d.y, back * d.x);
      const auto leg = [&](double speed, double rate) {
        for (int i = 0; i < 20; ++i) node.tick({}, static_cast<float>(speed), static_cast<float>(rate));
      };
      leg(0, turn / 0.2);
      leg(back * std::hypot(d.x, d.y) / 0.2, 0);
      leg(0, std::remainder(d.yaw - turn, 2 * std::numbers::pi) / 0.2);
    }
    std::vector<std::uint16_t> ranges;
    for (std::size_t i = 4; i < row.size(); ++i) ranges.push_back(static_cast<std::uint16_t>(row[i]));
    node.scans = k;
    const auto first = static_cast<float>(rows[0][1]), step = static_cast<float>(rows[0][2]);
    node.tick(scan_frames(node.bench.now_us, static_cast<int>(k), ranges, first, step), 0, 0);
    for (int i = 0; i < 13; ++i) node.tick({}, 0, 0);  // the window, and the job
    track.push_back({node.x_m, node.y_m, node.yaw_rad});
    EXPECT_EQ(node.matches.size(), k) << "a match for each scan";
    each();
  }
  return track;
}
template <class Robot>
std::vector<Place> replayed(DrivenOf<Robot>& node, const std::vector<Row>& rows) {
  return replayed(node, rows, [] {});
}

}  // namespace tetap::test
