// SPDX-License-Identifier: Apache-2.0
// Imperfections of what looks at walls and points: a turning laser scanner, and a camera whose features are followed.
// [own] our choice, as in numbers.hpp.
#pragma once

#include "sim_host/world/rotation.hpp"
#include "tetap/base/time.hpp"

#include <array>

namespace tetap::sim {

/// People walk to and fro on straight lines beside the way.
struct PeopleNumbers {
  int count = 0;
  double speed_mps = 1;   ///< [own]
  double way_m = 6;       ///< shorter where a wall is in the way
  double beside_m = 0.8;  ///< distance of their line from the way, to either side
  double radius_m = 0.2, height_m = 1.7;
};

/// A planar scanner. It turns at a constant rate, and each beam sees the world at its own time.
struct LidarNumbers {
  int rate_hz = 0;                                           ///< turns a second; 0: none; a divisor of 2000
  int beams = 360;                                           ///< beams of a turn, 77 to 1023
  bool clockwise = true;                                     ///< as most small scanners turn; else anticlockwise
  double first_rad = 0;                                      ///< bearing of the first beam
  double x_b_m = 0.1, y_b_m = 0, z_b_m = 0.25, yaw_rad = 0;  ///< place of its mounting, from the ground
  double min_m = 0.1, max_m = 12;                            ///< no return outside of them
  double sigma_m = 0.01;                                     ///< white, per range [own]
  double dropout_probability = 0.01;                         ///< per beam [own]
  double grazing_cos = 0.05;       ///< no return where the surface is hit at a flatter angle [own: 87 deg off square]
  double glass_square_cos = 0.98;  ///< a pane returns where the beam is as square as this, within 11 deg [own]
  double glass_through = 0.6;      ///< else the share of beams that return from behind it; the rest is lost [own]
  double mount_error_rad = 0.003;  ///< yaw of the mount against the robot's parameter [own]
  base::Micros phase{2'500};       ///< time of the first beam
  base::Micros frame{270};         ///< between two frames of a scan: 500 kbit/s
  base::Micros stamp_late{0};      ///< from the first beam to the stamp
  base::Micros latency_min{2'000}, latency_max{6'000};  ///< from the last beam to the first frame
};

[[nodiscard]] inline LidarNumbers matched(LidarNumbers n) {
  n.mount_error_rad = 0;
  return n;
}

/// A pinhole camera and a front end that follows features from image to image.
struct FeatureCameraNumbers {
  int rate_hz = 0;  ///< 0: none; a divisor of 2000
  int width_px = 752, height_px = 480;
  double fu_px = 460, fv_px = 460, cu_px = 375.5, cv_px = 239.5;  ///< lens of a usual global-shutter sensor [own]
  double x_b_m = 0.2, y_b_m = 0, z_b_m = 0.6;                     ///< place of its mounting, from the ground
  /// From the camera's axes (z along the view, x right, y down) into the body's; it looks ahead.
  Matrix3 mounting_bc{{0, 0, 1, -1, 0, 0, 0, -1, 0}};
  double mount_sigma_rad = 0.002;           ///< 1 sigma per axis of its rotation against the drawing [own]
  double near_m = 0.5, far_m = 30;          ///< depths at which a feature is found
  int features = 40;                        ///< followed at a time, 200 at the most
  bool landmarks_only = false;              ///< the points are the landmarks and nothing else
  double noise_px = 1;                      ///< white, 1 sigma per axis
  double life_min_s = 0.5, life_max_s = 3;  ///< a track ends after so long, if it is not lost before
  double loss_probability = 0.01;           ///< per feature and image [own]
  double wrong_probability = 0.01;          ///< per feature and image: a wrong match [own]
  double wrong_px = 60;                     ///< distance of a wrong match, per axis at the most [own]
  bool recognise = false;           ///< landmarks are recognised as well: features of camera 3, tracks are their ids
  double recognise_m = 15;          ///< within that range
  double miss_probability = 0.1;    ///< share of recognitions that fail [own]
  double wrong_id_probability = 0;  ///< a landmark that is taken for another one
  base::Micros exposure{4'000};
  base::Micros phase{21'500};
  base::Micros frame{135};                                ///< between two frames of an image: 1 Mbit/s
  base::Micros stamp_late{0};                             ///< from the middle of the exposure to the stamp
  base::Micros latency_min{30'000}, latency_max{60'000};  ///< from the middle of the exposure to the first frame
};

[[nodiscard]] inline FeatureCameraNumbers matched(FeatureCameraNumbers n) {
  n.mount_sigma_rad = n.wrong_probability = n.wrong_id_probability = 0;
  return n;
}

}  // namespace tetap::sim
