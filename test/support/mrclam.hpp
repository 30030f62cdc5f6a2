// SPDX-License-Identifier: Apache-2.0
// One robot of a UTIAS MRCLAM set (Leung, Halpern, Barfoot, Liu, IJRR 2011), read from its text files: commands,
// sightings by barcode, truth and map. The run is the time in which odometry and truth both exist.
#pragma once

#include "support/recorded.hpp"

#include <array>
#include <map>
#include <string>
#include <vector>

namespace tetap::test {

struct Mrclam {
  struct Command {
    double t_s, forward_mps, yaw_rate_radps;
  };
  struct Sighting {
    double t_s;
    int barcode;
    double range_m, bearing_rad;
  };
  struct Pose {
    double t_s, x_m, y_m, yaw_rad;
  };

  /// From the command to the motion, and how short turns come out; both as config/mrclam.hpp has them.
  static constexpr double kDelay_s = 0.2, kTurnScale = 0.95;

  std::vector<Command> commands;
  std::vector<Sighting> sightings;
  std::vector<Pose> truth;
  std::map<int, std::array<double, 2>> landmarks;  ///< by barcode
  std::size_t begin = 0;                           ///< first row of the truth that belongs to the run

  Mrclam(const std::string& folder, int robot) {
    const std::string name = folder + "/Robot" + std::to_string(robot);
    std::map<int, int> barcode_of;
    for (const Row& row : read_rows(folder + "/Barcodes.dat"))
      barcode_of[static_cast<int>(row[0])] = static_cast<int>(row[1]);
    for (const Row& row : read_rows(folder + "/Landmark_Groundtruth.dat"))
      landmarks[barcode_of[static_cast<int>(row[0])]] = {row[1], row[2]};
    for (const Row& row : read_rows(name + "_Odometry.dat")) commands.push_back({row[0], row[1], row[2]});
    for (const Row& row : read_rows(name + "_Measurement.dat"))
      sightings.push_back({row[0], static_cast<int>(row[1]), row[2], row[3]});
    for (const Row& row : read_rows(name + "_Groundtruth.dat")) truth.push_back({row[0], row[1], row[2], row[3]});
    const auto earlier = [](const auto& a, const auto& b) { return a.t_s < b.t_s; };
    std::stable_sort(commands.begin(), commands.end(), earlier);
    std::stable_sort(sightings.begin(), sightings.end(), earlier);
    std::stable_sort(truth.begin(), truth.end(), earlier);
    while (truth[begin].t_s < commands[0].t_s) ++begin;
  }

  [[nodiscard]] const Pose& start() const { return truth[begin]; }
  [[nodiscard]] double end_s() const { return std::min(commands.back().t_s, truth.back().t_s); }

  /// The truth at a time, between two rows at most 0.2 s apart. False where there is none.
  [[nodiscard]] bool truth_at(double t_s, Pose& pose) const {
    const auto after =
        std::lower_bound(truth.begin(), truth.end(), t_s, [](const Pose& a, double t) { return a.t_s < t; });
    if (after == truth.begin() || after == truth.end()) return false;
    const Pose &a = *(after - 1), &b = *after;
    if (b.t_s - a.t_s > 0.2) return false;
    const double f = (t_s - a.t_s) / (b.t_s - a.t_s);
    pose = {t_s, a.x_m + f * (b.x_m - a.x_m), a.y_m + f * (b.y_m - a.y_m),
            a.yaw_rad + f * std::remainder(b.yaw_rad - a.yaw_rad, 2 * M_PI)};
    return true;
  }

  /// The run in the order of time: move(command, dt_s), see(sightings of one stamp that are on the map), and every half
  /// second look(t_s).
  template <class Move, class See, class Look>
  void drive(double until_s, const Move& move, const See& see, const Look& look) const {
    double t = start().t_s, next = t + 0.5;
    std::size_t command = 0, sighting = 0;
    Command now{};
    const auto begins = [&](std::size_t i) { return commands[i].t_s + kDelay_s; };
    while (sighting < sightings.size() && sightings[sighting].t_s < t) ++sighting;
    const auto advance = [&](double to) {
      for (; command < commands.size() && begins(command) <= to; ++command) {
        if (begins(command) > t) move(now, begins(command) - t), t = begins(command);
        now = commands[command];
        now.yaw_rate_radps *= kTurnScale;
      }
      if (to > t) move(now, to - t), t = to;
    };
    while (next < until_s) {
      if (sighting < sightings.size() && sightings[sighting].t_s <= next) {
        const double stamp = sightings[sighting].t_s;
        advance(stamp);
        std::vector<Sighting> batch;
        for (; sighting < sightings.size() && sightings[sighting].t_s <= stamp; ++sighting)
          if (landmarks.count(sightings[sighting].barcode) > 0) batch.push_back(sightings[sighting]);
        if (!batch.empty()) see(batch);
      } else {
        advance(next);
        look(next);
        next += 0.5;
      }
    }
  }
};

}  // namespace tetap::test
