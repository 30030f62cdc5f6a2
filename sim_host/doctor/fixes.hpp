// SPDX-License-Identifier: Apache-2.0
// The way by the fixes against the integral of the GNSS velocity, and against the path of wheels and gyroscope. Axes
// that are swapped or reversed on one side show as the map between the two.
#pragma once

#include "sim_host/doctor/detector.hpp"
#include "sim_host/doctor/gyro_reference.hpp"
#include "sim_host/doctor/moments.hpp"
#include "sim_host/doctor/plane.hpp"
#include "sim_host/doctor/robot_facts.hpp"
#include "sim_host/doctor/speed_ratio.hpp"

#include <array>
#include <optional>

namespace tetap::doctor {

class PathDetector;

class VelocityDetector : public Detector {
 public:
  VelocityDetector(const CourseDetector& course, const PathDetector& path) : course_(course), path_(path) {}

  void sample(base::Micros time, const sensor::Sample& sample) override;
  void finish(Findings& findings) override;
  /// The way by the fixes over the integral of the velocity; nothing where their axes do not agree.
  [[nodiscard]] std::optional<SpeedRatio> ratio() const;

 private:
  void end_leg(base::Micros time, const PlanePoint& here);
  void judge_up(Findings& findings) const;

  const CourseDetector& course_;
  const PathDetector& path_;
  Plane plane_;
  std::optional<base::Micros> velocity_at_;
  Vector3 velocity_{};
  // Sums of the leg under way.
  std::optional<base::Micros> began_;
  PlanePoint from_;
  Vector3 flown_m_{};
  bool broken_ = false;
  Moments<4> legs_;    ///< east and north by the fixes, by the velocity; each leg divided by its length
  Moments<2> climbs_;  ///< up by the fixes, by the velocity [m]
};

}  // namespace tetap::doctor
