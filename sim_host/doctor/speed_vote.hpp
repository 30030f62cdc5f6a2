// SPDX-License-Identifier: Apache-2.0
// Wheels, GNSS velocity and fixes measure one speed. Where one of the three differs from the two others, it is wrong.
#pragma once

#include "sim_host/doctor/fixes.hpp"
#include "sim_host/doctor/path.hpp"
#include "sim_host/doctor/wheel_speed.hpp"

#include <optional>

namespace tetap::doctor {

struct SpeedWitnesses {
  const WheelSpeedDetector& velocity_by_wheels;
  const PathDetector& fixes_by_wheels;
  const VelocityDetector& fixes_by_velocity;
};

class SpeedVoteDetector : public Detector {
 public:
  explicit SpeedVoteDetector(const SpeedWitnesses& witnesses) : by_(witnesses) {}
  void finish(Findings& findings) override;

 private:
  static void name_either(const SpeedRatio& receiver, Findings& findings);

  SpeedWitnesses by_;
};

}  // namespace tetap::doctor
