// SPDX-License-Identifier: Apache-2.0
// Heading of a robot that starts in motion, from gyroscope, accelerometer and the velocity that GNSS or wheels show.
// Beside a running filter it is an independent judge of its heading. The heading is written as a phasor z = exp(i yaw)
// in place of an angle: everything else becomes linear. Large heading uncertainty: Scherzinger 1996, "Inertial
// navigator error models for large heading uncertainty", PLANS; Rogers 1997, NAVIGATION 44(3). One filter holds what a
// bank of hypotheses only samples (Sorenson & Alspach 1971, Automatica 7(4); EKF-GSF of PX4 and ArduPilot). On the
// circle |z| = 1 its Gaussian is a von Mises density around arg z of concentration kappa = 2 |z| / P_zz. Mardia & Jupp
// 2000, "Directional Statistics", sec. 3.5.4, have that density. A heading that nothing has shown is z = 0: it cannot
// look known.
#pragma once

#include "tetap/base/anchored.hpp"
#include "tetap/base/members.hpp"
#include "tetap/nav/complex_kalman.hpp"
#include "tetap/nav/imu_increment.hpp"

namespace tetap::nav {

/// Noise of the yaw estimator's inputs, one sigma per axis.
struct YawFinderNoise {
  float accel_mps2_rthz = 0.03F;  ///< white, vibration included, m/s^2/sqrt(Hz)
  float gyro_radps_rthz = 3e-4F;  ///< rad/s/sqrt(Hz)
  float gyro_scale = 0.005F;      ///< share of every turn
  float accel_bias_mps2 = 0.1F;   ///< turn-on, fixed in the body
  float gyro_bias_radps = 0.01F;  ///< turn-on
  float tilt_rad = 0.05F;         ///< 1 sigma of the level it begins with
  float floor_rad = 0.02F;        ///< no heading is known better: mounting, what the model lacks
  float ready_rad = 0.15F;        ///< ready once sigma is below
};

/// Motion since the yaw filter's last prediction, in axes that the gyroscope's yaw turned from n by yaw - arg z.
struct PendingMotion {
  Complex v, p;    ///< specific force integrated once and twice
  Complex turned;  ///< integral of the heading
  float dt_s = 0, turn_rad = 0;
};

class YawEstimator {
 public:
  YawFinderNoise noise{};  ///< changed: restart

  YawEstimator() { restart(); }

  /// Nothing is known; the first increment shows roughly where up is.
  void restart() {
    up_b_ = Vector3::Zero();
    begin(kFirstTilt_rad);
  }
  /// Begins anew with a level from outside, good to noise.tilt_rad; its yaw does not matter.
  void restart(const Quaternion& q_level);

  /// Every increment, as the sensor shows it: the biases are found here. An increment that is not accepted changes
  /// nothing.
  [[nodiscard]] ImuVerdict predict(const ImuIncrement& imu);
  /// Increments are missing: the robot may have turned and sped up meanwhile.
  void predict_without_imu(base::Micros gap);

  /// GNSS velocity; `lever_b_m`: the antenna from the IMU, forward and left.
  void fuse_velocity(float east_mps, float north_mps, float sigma_mps, Complex lever_b_m = {});
  /// GNSS position, for receivers without a velocity: what counts is how it moves.
  void fuse_position(const base::Anchored& east, const base::Anchored& north, float sigma_m, Complex lever_b_m = {});
  /// Forward speed of the wheels, reversing is negative: it goes where it points (non-holonomic). `axle_b_m`: the axle
  /// that does not steer, from the IMU. Taken at most ten times a second; what slips is refused without consequence.
  void fuse_forward_speed(float mps, float sigma_mps, Complex axle_b_m = {});

  [[nodiscard]] float yaw_rad() const;
  /// 1 sigma of the yaw; pi / sqrt(3) where any heading is possible.
  [[nodiscard]] float sigma_rad() const;
  /// Sigma below noise.ready_rad after five fixes; sigma is small only while phasor and model agree.
  [[nodiscard]] bool ready() const { return fixes_ >= kFixes && sigma_rad() < noise.ready_rad; }
  /// Distance of another heading; and in sigma of the difference, 0 while not ready.
  [[nodiscard]] float apart_rad(float yaw_rad_other) const {
    return base::abs(base::wrap_angle(yaw_rad() - yaw_rad_other));
  }
  [[nodiscard]] float against(float yaw_rad_other, float sigma_rad_other) const;
  /// Bias of the gyroscope about the vertical.
  [[nodiscard]] float bias_radps() const { return bias_b_radps_.dot(up_b_); }
  /// Number of restarts because GNSS or the length of the phasor contradicted the state.
  [[nodiscard]] std::uint32_t restarts() const { return restarts_; }

  static constexpr auto members(auto& self) {
    return base::members(base::in_turns(self.noise), self.filter_, base::in_turns(self.pending_),
                         base::in_turns(self.heading_), base::in_turns(self.up_b_), base::in_turns(self.bias_b_radps_),
                         base::in_turns(self.rate_radps_), base::in_turns(self.wheels_s_), base::in_turns(self.east_),
                         base::in_turns(self.north_), base::in_turns(self.restarts_), self.refused_, self.fixes_,
                         self.placed_);
  }

  /// For the tests: the covariance.
  [[nodiscard]] const auto& filter() const { return filter_; }

 private:
  /// States, all in n, east + i north: position from the last fix (kP), velocity (kV), the heading's phasor (kZ). kW is
  /// the acceleration that the level's error feigns. kR drives it: the gyroscope's level biases times gravity. kA is
  /// the accelerometer's bias. kR and kA are along the body but turned by z. kU is z times the gyroscope's bias about
  /// the vertical.
  enum : int { kP, kV, kZ, kW, kR, kA, kU, kStates };
  using Filter = ComplexKalman<kStates>;

  static constexpr float kGravity = 9.80665F;
  static constexpr float kFast_mps = 15.0F;       ///< before anything has shown its speed
  static constexpr float kFar_m2 = 1e4F;          ///< before the first fix
  static constexpr float kStep_s = 0.1F;          ///< between predictions of the filter
  static constexpr float kBlind_m2ps2 = 1e6F;     ///< variance of the velocity after too long without anything
  static constexpr float kLean_s = 5.0F;          ///< own level leans towards the specific force
  static constexpr float kMemory_s = 30.0F;       ///< one unit of 1 / P_zz is forgotten in
  static constexpr float kGate = 13.8F;           ///< one in a thousand, two degrees of freedom
  static constexpr float kFirstTilt_rad = 0.15F;  ///< tilt of one increment in motion
  static constexpr float kKeptTilt_rad = 0.1F;    ///< tilt of the own level after giving up
  static constexpr float kWheelShare = 0.05F;     ///< one sigma of a speed, beside the caller's
  static constexpr std::uint8_t kMostRefused = 5, kFixes = 5;
  // Random walks, per axis and root of a second: the level's error, the biases.
  static constexpr float kWander_mps2_rts = 0.01F, kBiasWalk_radps_rts = 1e-5F, kAccelWalk_mps2_rts = 2e-4F;

  static constexpr float square(float a) { return a * a; }
  [[nodiscard]] static float from(const base::Anchored& a, const base::Anchored& b);
  [[nodiscard]] static bool fits(float a, float b, float sigma, Complex lever);
  /// z = x_i + heading c_b z + noise, whose variance is 2 sigma^2 + more.
  Filter::Verdict measure(int i, Complex c_b, Complex z, float sigma, float more = 0.0F);
  void begin(float tilt_rad);
  void flush();
  void bound();
  void give_up();
  void judge(Filter::Verdict verdict, bool gnss);

  Filter filter_{};
  PendingMotion pending_{};
  Complex heading_{1.0F, 0.0F};  ///< exp(i yaw) by gyroscope alone
  Vector3 up_b_ = Vector3::Zero();
  Vector3 bias_b_radps_ = Vector3::Zero();  ///< taken off the gyroscope
  float rate_radps_ = 0;
  float wheels_s_ = 0;               ///< time since wheels were taken
  base::Anchored east_{}, north_{};  ///< the newest fix
  std::uint32_t restarts_ = 0;
  std::uint8_t refused_ = 0, fixes_ = 0;
  bool placed_ = false;
};

}  // namespace tetap::nav

#include "tetap/nav/yaw_estimator_steps.hpp"  // IWYU pragma: keep
