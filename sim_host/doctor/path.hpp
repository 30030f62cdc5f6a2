// SPDX-License-Identifier: Apache-2.0
// The path of wheels and gyroscope against the fixes, chord by chord. Two chords one after the other have a ratio and
// an angle that no unknown heading changes. A mirror reverses the angle; swapped angles of the Earth stretch it, too.
#pragma once

#include "sim_host/doctor/detector.hpp"
#include "sim_host/doctor/fixes.hpp"
#include "sim_host/doctor/robot_facts.hpp"
#include "sim_host/doctor/speed_ratio.hpp"

#include <array>
#include <complex>
#include <cstddef>
#include <optional>
#include <vector>

namespace tetap::doctor {

class PathDetector : public Detector {
 public:
  PathDetector(const RobotFacts& robot, const Windows& windows)
      : robot_(robot), scale_(wheel_scale(robot)), windows_(windows) {}

  void sample(base::Micros time, const sensor::Sample& sample) override;
  void finish(Findings& findings) override;
  /// Chords by the fixes over those by the path; nothing where they have no factor in common, or the robot's geometry
  /// is not known.
  [[nodiscard]] std::optional<SpeedRatio> scale() const;
  /// Whether the fixes go as the path of the wheels does, as sent; nothing where no reading of their axes fits.
  [[nodiscard]] std::optional<bool> fixes_fit() const;
  [[nodiscard]] const RobotFacts& robot() const { return robot_; }
  /// Distance by the wheels up to now, forward and back.
  [[nodiscard]] double rolled_m() const { return rolled_m_; }

 private:
  using Complex = std::complex<double>;
  static constexpr std::size_t kRatios = 2048;  ///< most that are kept; of a long log each second, fourth, ... chord

  void turn_by(base::Micros time, const sensor::ImuSample& imu);
  void roll(base::Micros time, const sensor::Sample& sample);
  void end_chord(base::Micros time, const PlanePoint& here, double sigma_m);
  void add_pair(Complex fixes_before, Complex path_before, Complex fixes, Complex path);

  const RobotFacts& robot_;
  WheelScale scale_;
  const Windows& windows_;
  Plane plane_;
  double yaw_rad_ = 0;
  bool gyroscope_ = false;
  Complex path_m_{};
  double rolled_m_ = 0;
  std::optional<base::Micros> wheels_at_;
  std::optional<sensor::WheelCounts> counts_;
  std::optional<base::Micros> began_;
  Complex from_{}, path_from_{};
  std::optional<Complex> fixes_before_, path_before_;
  std::array<double, 4> left_{};  ///< squared logarithm of the ratio left over: as sent, swapped, latitude, longitude
  double pairs_ = 0;
  std::vector<float> ratios_;  ///< chord by the fixes over chord by the path
  std::size_t every_ = 1, seen_ = 0;
};

}  // namespace tetap::doctor
