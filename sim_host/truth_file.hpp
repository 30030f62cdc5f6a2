// SPDX-License-Identifier: Apache-2.0
// The truth of a simulated run as files of the report, written as it comes: truth.csv, the landmark of each sighting,
// and the landmarks for run.json.
#pragma once

#include "sim_host/play/out_file.hpp"
#include "sim_host/replay/line.hpp"
#include "sim_host/residual_bias.hpp"
#include "sim_host/world/world.hpp"
#include "tetap/param/parameters.hpp"

#include <cstdint>
#include <cstdio>
#include <span>
#include <string>
#include <utility>

namespace tetap::sim {

/// The landmark map as the report draws it.
[[nodiscard]] inline std::string landmarks_json(const World& world) {
  std::string text;
  for (const Landmark& mark : world.map()) {
    char entry[96];
    std::snprintf(entry, sizeof entry, R"(%s{"id": %d, "x_m": %.3f, "y_m": %.3f})", text.empty() ? "" : ", ",
                  static_cast<int>(mark.id), mark.x_m, mark.y_m);
    text += entry;
  }
  return "[" + text + "]";
}

/// truth.csv, row by row. In lockstep each row is an epoch of the node, whatever became of the clock of the bus. Biases
/// are those that the robot's own calibration leaves. `origin` is that of the node's map.
class TruthTable {
 public:
  TruthTable(const std::string& folder, const param::Parameters& parameters, const World& world,
             const GeodeticOrigin& origin, bool lockstep)
      : file_(folder + "/truth.csv"),
        parameters_(parameters),
        change_(Earth(world.origin()), Earth(origin)),
        temperature_degC_(world.parameters().imu.temperature_degC),
        lockstep_(lockstep) {
    file_.write(
        "time_s,x_m,y_m,yaw_rad,z_m,roll_rad,pitch_rad,v_east_mps,v_north_mps,v_up_mps,gyro_bias_x_radps,gyro_bias_y_"
        "radps,"
        "gyro_bias_z_radps,acc_bias_x_mps2,acc_bias_y_mps2,acc_bias_z_mps2");
    file_.write(lockstep ? ",epoch\n" : "\n");
  }

  void add(const Truth& seen) {
    const Truth t = in_frame(residual_bias(seen, parameters_, temperature_degC_), change_);
    line_.clear();
    line_.fixed(t.time.us, 6).text(",").real(t.x_m, 6).text(",").real(t.y_m, 6).text(",").real(t.yaw_rad, 6);
    for (const double x : {t.z_m, t.roll_rad, t.pitch_rad}) line_.text(",").real(x, 6);
    for (const Vector3& v : {t.v_n_mps, t.gyro_bias_b_radps, t.accel_bias_b_mps2})
      for (const double x : v) line_.text(",").real(x, 6);
    if (lockstep_) line_.text(",").integer(++epoch_);
    file_.write(line_.text("\n").view());
  }

  /// The ended file.
  OutFile end() {
    file_.end();
    return std::move(file_);
  }

 private:
  OutFile file_;
  param::Parameters parameters_;
  FrameChange change_;
  double temperature_degC_;
  bool lockstep_;
  std::int64_t epoch_ = 0;
  Line line_;
};

/// Landmark of each sighting, as tools/dataset/import_mrclam writes it; 255: clutter or a moving obstacle.
class SightingTable {
 public:
  explicit SightingTable(const std::string& folder) : file_(folder + "/truth.sightings.csv") {
    file_.write("time_s,landmark\n");
  }

  void add(std::span<const TrueSighting> sightings) {
    for (const TrueSighting& one : sightings) {
      line_.clear();
      line_.fixed(one.stamp.us, 6).text(",").integer(one.landmark);
      file_.write(line_.text("\n").view());
    }
  }

  /// The ended file.
  OutFile end() {
    file_.end();
    return std::move(file_);
  }

 private:
  OutFile file_;
  Line line_;
};

}  // namespace tetap::sim
