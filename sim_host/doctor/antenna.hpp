// SPDX-License-Identifier: Apache-2.0
// The place of the antenna by its speed in turns. With r ahead x and to the left y, speed v and turn rate w of the
// body: |v_antenna|^2 = v^2 - 2 v w y + w^2 (x^2 + y^2).
#pragma once

#include "sim_host/doctor/detector.hpp"
#include "sim_host/doctor/moments.hpp"
#include "sim_host/doctor/robot_facts.hpp"

namespace tetap::doctor {

class AntennaDetector : public Detector {
 public:
  explicit AntennaDetector(const RobotFacts& robot) : robot_(robot) {}
  void window(const Window& w) override;
  void finish(Findings& findings) override;

 private:
  const RobotFacts& robot_;
  Moments<4> squares_;  ///< v^2, -2 v w, w^2, |v_antenna|^2
};

}  // namespace tetap::doctor
