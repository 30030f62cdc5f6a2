// SPDX-License-Identifier: Apache-2.0
// A camera that looks along the way of a vehicle, against the gyroscope: the turn between two images by what a feature
// moves across the ray from the point of expansion, which no depth enters (Longuet-Higgins, Prazdny 1980).
#pragma once

#include "sim_host/doctor/detector.hpp"
#include "sim_host/doctor/moments.hpp"
#include "sim_host/doctor/path.hpp"
#include "sim_host/doctor/robot_facts.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

namespace tetap::doctor {

class CameraDetector : public Detector {
 public:
  /// `path` sees each sample before this detector does.
  CameraDetector(const RobotFacts& robot, const PathDetector& path);
  void frame(const SeenFrame& seen) override;
  void sample(base::Micros time, const sensor::Sample& sample) override;
  void finish(Findings& findings) override;

 private:
  static constexpr double kStep_s = 0.02;
  static constexpr int kAhead = 5;            ///< steps by which a stamp may be early
  static constexpr std::size_t kDelays = 21;  ///< -0.1 to 0.3 s
  /// In normalised coordinates.
  struct Feature {
    std::uint16_t track;
    double x, y;
  };
  struct Image {
    double time_s = 0, rolled_m = 0;
    std::vector<Feature> features;
  };
  /// A feature in two images: where it is between them, and its motion a second.
  struct Flow {
    double x, y, dx, dy;
  };
  /// The turn of the camera between two images, about the robot's up and about the axis across it and the view.
  struct Turn {
    double from_s, to_s, up_radps, across_radps;
  };
  struct Angle {
    double time_s, rad;
  };
  struct Best {
    double delay_s = 0, explained = 0, stated = 0;  ///< shares of the turn's variance, at that delay and at none
    const Moments<3>* moments = nullptr;            ///< about up, across, by the gyroscope
  };

  void end(double time_s);
  /// Whether the robot drives, and which way its camera moves then: in a turn its place swings to the side.
  [[nodiscard]] bool moves_along();
  [[nodiscard]] static std::vector<Flow> flows(const Image& before, const Image& after);
  [[nodiscard]] std::optional<Vector3> turn_of(const std::vector<Flow>& flow) const;
  void expand(const std::vector<Flow>& flow, const Vector3& turn_radps);
  void hold_against();
  [[nodiscard]] std::optional<double> angle_rad(double time_s) const;
  [[nodiscard]] Best best() const;

  const RobotFacts& robot_;
  const PathDetector& path_;
  Vector3 ahead_c_{}, left_c_{}, up_c_{}, across_c_{};  ///< in the camera's axes
  Vector3 along_c_{};                                   ///< its motion between the latest two images
  Vector3 up_s_{};                                      ///< in those of the IMU
  bool usable_ = false;
  std::uint32_t stamp_us_ = 0;
  Image now_, before_;
  std::deque<Angle> angles_;
  std::deque<Turn> waiting_;
  std::array<Moments<3>, kDelays> turns_;
  Moments<1> lower_, upper_;  ///< rate of expansion in the halves of the image
};

}  // namespace tetap::doctor
