// SPDX-License-Identifier: Apache-2.0
// The truth of a simulated run as files of the report: truth.csv, and the landmarks for run.json.
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

/// The ended file. In lockstep each row is an epoch of the node, whatever became of the clock of the bus. Biases are
/// those that the robot's own calibration leaves. `origin` is that of the node's map.
[[nodiscard]] inline OutFile write_truth(const std::string& folder, const param::Parameters& parameters,
                                         const World& world, std::span<const Truth> rows, const GeodeticOrigin& origin,
                                         bool lockstep) {
  const FrameChange change(Earth(world.origin()), Earth(origin));
  const double temperature_degC = world.parameters().imu.temperature_degC;
  OutFile file(folder + "/truth.csv");
  Line line;
  file.write(
      "time_s,x_m,y_m,yaw_rad,z_m,roll_rad,pitch_rad,v_east_mps,v_north_mps,v_up_mps,gyro_bias_x_radps,gyro_bias_y_"
      "radps,"
      "gyro_bias_z_radps,acc_bias_x_mps2,acc_bias_y_mps2,acc_bias_z_mps2");
  file.write(lockstep ? ",epoch\n" : "\n");
  std::int64_t epoch = 0;
  for (const Truth& seen : rows) {
    const Truth t = in_frame(residual_bias(seen, parameters, temperature_degC), change);
    line.clear();
    line.fixed(t.time.us, 6).text(",").real(t.x_m, 6).text(",").real(t.y_m, 6).text(",").real(t.yaw_rad, 6);
    for (const double x : {t.z_m, t.roll_rad, t.pitch_rad}) line.text(",").real(x, 6);
    for (const Vector3& v : {t.v_n_mps, t.gyro_bias_b_radps, t.accel_bias_b_mps2})
      for (const double x : v) line.text(",").real(x, 6);
    if (lockstep) line.text(",").integer(++epoch);
    file.write(line.text("\n").view());
  }
  file.end();
  return file;
}

/// Landmark of each sighting, as tools/dataset/import_mrclam writes it; 255: clutter or a moving obstacle.
[[nodiscard]] inline OutFile write_sightings(const std::string& folder, const World& world) {
  OutFile file(folder + "/truth.sightings.csv");
  Line line;
  file.write("time_s,landmark\n");
  for (const TrueSighting& one : world.sightings()) {
    line.clear();
    line.fixed(one.stamp.us, 6).text(",").integer(one.landmark);
    file.write(line.text("\n").view());
  }
  file.end();
  return file;
}

}  // namespace tetap::sim
