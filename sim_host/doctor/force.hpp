// SPDX-License-Identifier: Apache-2.0
// The accelerometer against gravity: over a log its mean is 9.81 m/s^2 upwards, whatever the robot drives or flies.
#pragma once

#include "sim_host/doctor/detector.hpp"
#include "sim_host/doctor/robot_facts.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace tetap::doctor {

class ForceDetector : public Detector {
 public:
  explicit ForceDetector(const RobotFacts& robot) : robot_(robot) {}

  void sample(base::Micros time, const sensor::Sample& sample) override;
  void window(const Window& w) override;
  void finish(Findings& findings) override;
  /// Cosine between the mean specific force and where up is stated; nothing where no up is stated.
  [[nodiscard]] std::optional<double> upward() const;

 private:
  static constexpr std::size_t kBins = 2048;  ///< factors up to e^10 either way: no unit lies beyond
  void judge_direction(Findings& findings) const;
  [[nodiscard]] std::vector<Remedy> upright() const;
  void judge_scale(Findings& findings) const;

  const RobotFacts& robot_;
  int windows_ = 0;
  double magnitude_sum_ = 0;
  Vector3 force_sum_{};
  double samples_ = 0, increment_sum_mps_ = 0;
  std::array<std::uint32_t, kBins> magnitudes_{};  ///< windows by the logarithm of their force over gravity
  std::uint32_t whole_windows_ = 0;                ///< without lost samples
};

}  // namespace tetap::doctor
