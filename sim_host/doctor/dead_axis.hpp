// SPDX-License-Identifier: Apache-2.0
// Axes of the IMU that keep one value while the others move. Noise alone changes a live axis from sample to sample.
#pragma once

#include "sim_host/doctor/detector.hpp"
#include "sim_host/doctor/robot_facts.hpp"

#include <array>
#include <cstddef>

namespace tetap::doctor {

class DeadAxisDetector : public Detector {
 public:
  explicit DeadAxisDetector(const RobotFacts& robot) : robot_(robot) {}
  void sample(base::Micros time, const sensor::Sample& sample) override;
  void finish(Findings& findings) override;

 private:
  struct Axis {
    float value = 0;
    double since_s = 0, others = 0;         ///< last change; samples that moved another axis after it
    double longest_s = 0, most_others = 0;  ///< longest such stretch, and its samples
  };
  using Axes = std::array<Axis, 3>;
  static void add(Axes& axes, const std::array<float, 3>& values, float most, double time_s);
  void judge(const Axes& axes, const char* message, const char* signal, Device device, Findings& findings) const;
  [[nodiscard]] bool needed(std::size_t axis, Device device) const;

  const RobotFacts& robot_;
  Axes gyroscope_{}, accelerometer_{};
  bool begun_ = false;
};

}  // namespace tetap::doctor
