// SPDX-License-Identifier: Apache-2.0
// The data of one second in one struct: means of what IMU, wheels, receiver and magnetometer measure in it. Times are
// those of arrival, so a wrong stamp spoils no comparison.
#pragma once

#include "sim_host/doctor/robot_facts.hpp"
#include "sim_host/doctor/vector.hpp"
#include "tetap/base/time.hpp"
#include "tetap/sensor/sample.hpp"

#include <cstdint>
#include <optional>

namespace tetap::doctor {

/// Wheels as sum and difference of their speeds: the forward speed is half the sum, the yaw rate the difference over
/// the track.
struct WheelMotion {
  double sum_mps = 0;
  std::optional<double> difference_mps;  ///< nothing: a speedometer
};

struct Window {
  double start_s = 0;
  std::optional<Vector3> turn_s_radps;  ///< mean of the gyroscope, in the sensor's axes
  std::optional<Vector3> force_s_mps2;  ///< mean of the accelerometer
  std::optional<WheelMotion> wheels;    ///< in counts per second where the robot's geometry is not known
  std::optional<Vector3> velocity_n_mps;
  std::optional<Vector3> flux_s_uT;
  double imu_share = 1;  ///< intervals of the IMU's samples over the time in which they came: less where some are lost
  Vector3 up_s{};        ///< direction of the mean specific force up to here, in the sensor's axes; 0: not known yet
};

/// Metres of a wheel's count, the track [m] over which a difference becomes a turn, and the scales of stated speeds.
struct WheelScale {
  double left_m = 1, right_m = 1, track_m = 1;
  bool known = false;
  /// True over stated, of In_BodySpeed and In_WheelSpeed.
  double speed = 1, yaw_rate = 1, left_speed = 1, right_speed = 1;
};

[[nodiscard]] WheelScale wheel_scale(const RobotFacts& robot);

/// Gathers samples into windows of a second.
class Windows {
 public:
  explicit Windows(const RobotFacts& robot) : imu_(robot.imu), scale_(wheel_scale(robot)) {}

  /// The finished window when this sample begins another one.
  std::optional<Window> add(base::Micros time, const sensor::Sample& sample);
  [[nodiscard]] const Vector3& up_s() const { return up_s_; }

 private:
  struct Sum3 {
    Vector3 sum{};
    int count = 0;
    void add(const Vector3& x) {
      for (std::size_t i = 0; i < 3; ++i) sum[i] += x[i];
      ++count;
    }
    [[nodiscard]] std::optional<Vector3> mean() const {
      if (count == 0) return std::nullopt;
      return scaled(1.0 / count, sum);
    }
  };
  [[nodiscard]] Window finished();
  void add_imu(base::Micros time, const sensor::ImuSample& imu);
  void add_wheels(base::Micros time, const sensor::Sample& sample);
  void add_speeds(double dt_s, double left_mps, double right_mps);

  std::uint8_t imu_;
  WheelScale scale_;
  std::int64_t start_us_ = 0;
  bool begun_ = false;
  // Sums of the window under way.
  Sum3 velocity_, flux_;
  Vector3 turn_rad_{}, velocity_change_mps_{};
  std::optional<base::Micros> imu_last_;  ///< also of the window before
  double imu_s_ = 0, intervals_s_ = 0;
  double wheels_s_ = 0, wheel_sum_m_ = 0, wheel_difference_m_ = 0;
  bool has_difference_ = false;
  std::optional<base::Micros> wheels_last_;
  std::optional<sensor::WheelCounts> counts_last_;
  Vector3 force_sum_{}, up_s_{};
};

}  // namespace tetap::doctor
