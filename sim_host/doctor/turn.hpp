// SPDX-License-Identifier: Apache-2.0
// The turn by the gyroscope against the sum and the difference of the wheels. Right wheels: the turn follows the
// difference. Swapped: its negative, and both reversed as well, where most of the way is then backwards. One reversed:
// the sum, since the two have changed places. Up is where the mean
// specific force points, so an IMU in other axes changes nothing here.
#pragma once

#include "sim_host/doctor/detector.hpp"
#include "sim_host/doctor/moments.hpp"
#include "sim_host/doctor/turn_ratio.hpp"

#include <optional>
#include <string>

namespace tetap::doctor {

class TurnDetector : public Detector {
 public:
  explicit TurnDetector(const RobotFacts& robot) : robot_(robot), scale_(wheel_scale(robot)) {}

  void sample(base::Micros time, const sensor::Sample& sample) override;
  void window(const Window& w) override;
  void finish(Findings& findings) override;
  /// The gyroscope against the difference of the wheels; nothing where they do not turn alike.
  [[nodiscard]] std::optional<TurnRatio> ratio() const;
  /// A track with which the wheels turn `factor` times as fast.
  [[nodiscard]] Remedy track(double factor) const;
  /// Metres or speeds are known, so the magnitude of ratio() has a meaning.
  [[nodiscard]] bool knows_size() const { return scale_.known || message_ == "In_BodySpeed"; }

 private:
  /// Keeps a value within three times the RMS of all up to it: a wheel that spins for seconds decides nothing.
  class Limit {
   public:
    double limited(double value);

   private:
    double squares_ = 0, count_ = 0;
  };
  void judge_wheels(double gyro2, double by_difference, double by_sum, Findings& findings) const;
  void name_against(double by_difference, double gyro2, Findings& findings) const;
  void judge_unequal(Findings& findings) const;
  void judge_still(bool is_left, Findings& findings) const;

  const RobotFacts& robot_;
  WheelScale scale_;
  std::string message_;
  Moments<5> moments_;  ///< gyroscope x y z [rad/s], difference and sum of the wheels [m/s], both limited
  Moments<5> whole_;    ///< the same without a limit, which would make the turn by the wheels smaller
  Limit difference_, sum_;
  double ahead_ = 0, either_way_ = 0;  ///< sum of the wheels' sums, and of their magnitudes [m/s]
  Vector3 up_s_{};
};

}  // namespace tetap::doctor
