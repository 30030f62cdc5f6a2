// SPDX-License-Identifier: Apache-2.0
// Signs of single axes of gyroscope and accelerometer. A turned IMU keeps a right-handed frame, a single wrong sign
// does not, so it shows as a contradiction: devices vote on the yaw rate, and roll and pitch turn gravity.
#pragma once

#include "sim_host/doctor/detector.hpp"
#include "sim_host/doctor/force.hpp"
#include "sim_host/doctor/forward.hpp"
#include "sim_host/doctor/gyro_reference.hpp"
#include "sim_host/doctor/robot_facts.hpp"
#include "sim_host/doctor/turn.hpp"
#include "sim_host/doctor/vector_turn.hpp"

#include <cstddef>
#include <optional>
#include <string>

namespace tetap::doctor {

/// Detectors by which the signs are judged.
struct AxisWitnesses {
  const TurnDetector& turn;
  const CourseDetector& course;
  const FieldDetector& field;
  const ForceDetector& force;
  const ForwardDetector& forward;
};

class AxesDetector : public Detector {
 public:
  AxesDetector(const RobotFacts& robot, const AxisWitnesses& witnesses) : robot_(robot), by_(witnesses) {}
  void window(const Window& w) override;
  void finish(Findings& findings) override;

 private:
  /// Devices that turn with the gyroscope, and against it.
  struct Votes {
    int with = 0, against = 0;
    Devices uses = kNoDevice;  ///< devices of those against
    std::string words;         ///< those against, with their figures
    void add(double figure, double least, const char* device, Devices devices);
  };
  /// On the yaw rate about the mean specific force.
  [[nodiscard]] Votes votes(bool upside_down) const;
  void judge_upside(const Votes& yaw, double upward, Findings& findings) const;
  /// Comparison that shows every axis of both sensors reversed, where the force points down; empty: none.
  [[nodiscard]] std::string all_reversed() const;
  void judge_yaw(const Votes& yaw, Findings& findings) const;
  void judge_force(const Votes& yaw, Findings& findings) const;
  void judge_level(std::size_t axis, Findings& findings) const;
  void push(Code code, std::size_t axis, int uses, const std::string& evidence, std::optional<Code> beside,
            Findings& findings) const;
  [[nodiscard]] std::size_t up_axis() const;
  [[nodiscard]] double agreement(std::size_t axis) const;

  const RobotFacts& robot_;
  AxisWitnesses by_;
  std::optional<Window> before_;
  VectorTurn gravity_;
  Vector3 up_s_{};
};

}  // namespace tetap::doctor
