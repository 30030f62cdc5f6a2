// SPDX-License-Identifier: Apache-2.0
// The speed of the wheels against that of GNSS.
#pragma once

#include "sim_host/doctor/detector.hpp"
#include "sim_host/doctor/moments.hpp"
#include "sim_host/doctor/robot_facts.hpp"
#include "sim_host/doctor/speed_ratio.hpp"

#include <optional>

namespace tetap::doctor {

class WheelSpeedDetector : public Detector {
 public:
  explicit WheelSpeedDetector(const RobotFacts& robot) : robot_(robot) {}
  void window(const Window& w) override;
  void finish(Findings&) override {}
  /// GNSS over wheels; nothing where the two do not go alike, or the robot's geometry is not known.
  [[nodiscard]] std::optional<SpeedRatio> ratio() const;
  [[nodiscard]] const RobotFacts& robot() const { return robot_; }

 private:
  const RobotFacts& robot_;
  Moments<2> speeds_;  ///< magnitudes by wheels and by GNSS [m/s]
};

}  // namespace tetap::doctor
