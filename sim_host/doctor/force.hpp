// SPDX-License-Identifier: Apache-2.0
// The accelerometer against gravity: over a log its mean is 9.81 m/s^2 upwards, whatever the robot drives or flies.
#pragma once

#include "sim_host/doctor/detector.hpp"
#include "sim_host/doctor/robot_facts.hpp"

namespace tetap::doctor {

class ForceDetector : public Detector {
 public:
  explicit ForceDetector(const RobotFacts& robot) : robot_(robot) {}

  void sample(base::Micros time, const sensor::Sample& sample) override;
  void window(const Window& w) override;
  void finish(Findings& findings) override;

 private:
  void judge_direction(Findings& findings) const;

  const RobotFacts& robot_;
  int windows_ = 0;
  double magnitude_sum_ = 0;
  Vector3 force_sum_{};
  double samples_ = 0, increment_sum_mps_ = 0;
};

}  // namespace tetap::doctor
