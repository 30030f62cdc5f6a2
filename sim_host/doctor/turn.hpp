// SPDX-License-Identifier: Apache-2.0
// The turn by the gyroscope against the sum and the difference of the wheels. Right wheels: the turn follows the
// difference. Swapped: its negative. One reversed: the sum, since the two have changed places. Up is where the mean
// specific force points, so an IMU in other axes changes nothing here.
#pragma once

#include "sim_host/doctor/detector.hpp"
#include "sim_host/doctor/moments.hpp"

#include <string>

namespace tetap::doctor {

class TurnDetector : public Detector {
 public:
  explicit TurnDetector(const RobotFacts& robot) : scale_(wheel_scale(robot)) {}

  void sample(base::Micros time, const sensor::Sample& sample) override;
  void window(const Window& w) override;
  void finish(Findings& findings) override;

 private:
  /// Keeps a value within three times the RMS of all up to it: a wheel that spins for seconds decides nothing.
  class Limit {
   public:
    double limited(double value);

   private:
    double squares_ = 0, count_ = 0;
  };
  void judge_wheels(double gyro2, double by_difference, double by_sum, Findings& findings) const;
  void judge_gyroscope(double ratio, Findings& findings) const;

  WheelScale scale_;
  std::string message_;
  Moments<5> moments_;  ///< gyroscope x y z [rad/s], difference and sum of the wheels [m/s]
  Limit difference_, sum_;
  Vector3 up_s_{};
};

}  // namespace tetap::doctor
