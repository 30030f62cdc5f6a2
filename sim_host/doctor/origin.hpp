// SPDX-License-Identifier: Apache-2.0
// The place of the fixes against the robot's configured origin: far away, or near it with swapped or negated angles.
#pragma once

#include "sim_host/doctor/detector.hpp"
#include "sim_host/doctor/robot_facts.hpp"

namespace tetap::doctor {

class OriginDetector : public Detector {
 public:
  explicit OriginDetector(const RobotFacts& robot) : robot_(robot) {}
  void sample(base::Micros time, const sensor::Sample& sample) override;
  void finish(Findings& findings) override;

 private:
  [[nodiscard]] double distance_m(double latitude_rad, double longitude_rad) const;

  const RobotFacts& robot_;
  int fixes_ = 0, far_ = 0;
  double latitude_rad_ = 0, longitude_rad_ = 0;  ///< last far fix
};

}  // namespace tetap::doctor
