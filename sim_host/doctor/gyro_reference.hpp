// SPDX-License-Identifier: Apache-2.0
// The gyroscope's unit without wheels: against the course by GNSS, and against the magnetic field. The field turns in
// the body as the body turns in the field.
#pragma once

#include "sim_host/doctor/detector.hpp"
#include "sim_host/doctor/moments.hpp"
#include "sim_host/doctor/plane.hpp"
#include "sim_host/doctor/robot_facts.hpp"
#include "sim_host/doctor/turn_ratio.hpp"
#include "sim_host/doctor/vector_turn.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace tetap::doctor {

/// The course comes from the GNSS velocity, without one from the chords between fixes.
class CourseDetector : public Detector {
 public:
  explicit CourseDetector(std::uint8_t imu) : imu_(imu) {}
  void sample(base::Micros time, const sensor::Sample& sample) override;
  void window(const Window& w) override;
  void finish(Findings& findings) override;
  /// Correlation of the gyroscope's turn with that of the velocity's course; 0 where nothing is known.
  [[nodiscard]] double correlation_with_course() const { return correlation_of(by_velocity_); }
  /// The gyroscope against the course; nothing where they do not turn alike.
  [[nodiscard]] std::optional<TurnRatio> ratio() const;

 private:
  /// From one fix to another.
  struct Chord {
    double course_rad = 0, middle_s = 0;
    Vector3 middle_turned_rad{};
  };
  void end_chord(double time_s, const PlanePoint& here, double sigma_m);
  [[nodiscard]] double correlation_of(const Moments<4>& moments) const;

  std::uint8_t imu_;
  std::optional<Window> before_;
  Vector3 up_s_{};
  Moments<4> by_velocity_;  ///< gyroscope x y z, rate of the course [rad/s]
  Moments<4> by_fixes_;     ///< likewise
  double by_fixes_s_ = 0;   ///< time between the chords that it has
  Plane plane_;
  Vector3 turned_rad_{};  ///< sum of the gyroscope's increments
  std::optional<double> began_s_;
  PlanePoint from_;
  Vector3 turned_from_rad_{};
  std::optional<Chord> chord_;
};

class FieldDetector : public Detector {
 public:
  explicit FieldDetector(const RobotFacts& robot) : robot_(robot) {}
  void window(const Window& w) override;
  void finish(Findings& findings) override;
  /// True turn over measured turn about an axis of the gyroscope, by the field.
  [[nodiscard]] std::optional<AxisFactor> factor(std::size_t axis) const { return turns_.factor(axis); }

 private:
  [[nodiscard]] Vector3 field_b_uT(const Vector3& flux_s_uT) const;

  const RobotFacts& robot_;
  std::optional<Window> before_;
  int windows_ = 0;
  VectorTurn turns_;
  double still2_ = 0;              ///< sum of the squared changes of the field
  std::array<double, 3> left2_{};  ///< the same, after the turn in radians, from degrees, from radians twice converted
};

}  // namespace tetap::doctor
