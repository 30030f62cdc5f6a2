// SPDX-License-Identifier: Apache-2.0
// The speed of the wheels against that of GNSS.
#pragma once

#include "sim_host/doctor/detector.hpp"
#include "sim_host/doctor/moments.hpp"
#include "sim_host/doctor/robot_facts.hpp"

namespace tetap::doctor {

class WheelSpeedDetector : public Detector {
 public:
  explicit WheelSpeedDetector(const RobotFacts& robot) : robot_(robot) {}
  void window(const Window& w) override;
  void finish(Findings& findings) override;

 private:
  const RobotFacts& robot_;
  Moments<2> speeds_;  ///< magnitudes by wheels and by GNSS [m/s]
};

}  // namespace tetap::doctor
