// SPDX-License-Identifier: Apache-2.0
// The core of a visual window that moves its pose by an inertial sensor: nav::strapdown for the state, the right-
// invariant error of SE_2(3) for the covariance (Barrau & Bonnabel 2017). A turn about the plumb line and a shift of
// the world stay constant directions of error, so images cannot seem to show them.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/filter/big_covariance.hpp"
#include "tetap/nav/ins.hpp"
#include "tetap/slam/world_pose.hpp"

namespace tetap::slam {

/// Noise, gravity and the errors' sigmas at the start, as a visual-inertial filter takes them for given.
struct InertialSetup {
  nav::InsNoise noise{.gyro_radps_rthz = 1e-3F,
                      .accel_mps2_rthz = 1.5e-2F,
                      .gyro_bias_radps2_rthz = 2e-5F,
                      .accel_bias_mps3_rthz = 3e-3F};
  nav::Earth earth;
  float sigma_speed_mps = 0.02F;
  float sigma_gyro_bias_radps = 0.01F;  ///< after the mean at rest
  float sigma_accel_bias_mps2 = 0.2F;
  float time_offset_s = 0;  ///< an image shows the moment of its stamp and this
  float sigma_time_offset_s = 0.01F;

  [[nodiscard]] bool valid() const {
    const float sum = noise.gyro_radps_rthz + noise.accel_mps2_rthz + noise.gyro_bias_radps2_rthz +
                      noise.accel_bias_mps3_rthz + sigma_speed_mps + sigma_gyro_bias_radps + sigma_accel_bias_mps2 +
                      sigma_time_offset_s;
    const bool signs = noise.gyro_radps_rthz >= 0.0F && noise.accel_mps2_rthz >= 0.0F &&
                       noise.gyro_bias_radps2_rthz >= 0.0F && noise.accel_bias_mps3_rthz >= 0.0F &&
                       sigma_speed_mps >= 0.0F && sigma_gyro_bias_radps >= 0.0F && sigma_accel_bias_mps2 >= 0.0F &&
                       sigma_time_offset_s >= 0.0F;
    return signs && base::is_finite(sum) && base::abs(time_offset_s) < 1.0F;
  }
};

/// A pose; the velocity, whose error is nu in v = Exp(theta) v^ + nu; the biases of gyroscope and accelerometer; the
/// time offset of the camera.
class InertialCore {
 public:
  static constexpr int kErrors = 16, kConsidered = -1;
  static constexpr int kVelocity = 6, kGyroBias = 9, kAccelBias = 12, kOffset = 15;
  using Motion = nav::ImuIncrement;

  explicit InertialCore(const InertialSetup& setup = {}) : setup_(setup), offset_s_(setup.time_offset_s) {}

  [[nodiscard]] const WorldPose& pose() const { return pose_; }
  [[nodiscard]] const nav::Vector3& velocity_n_mps() const { return ins_.v_n_mps; }
  [[nodiscard]] const nav::Vector3& gyro_bias_radps() const { return ins_.b_g_radps; }
  [[nodiscard]] const nav::Vector3& accel_bias_mps2() const { return ins_.b_a_mps2; }
  /// Turn rate of late, in n: smoothed, since its noise times an error of the offset would look like a motion.
  [[nodiscard]] const nav::Vector3& rate_n_radps() const { return rate_n_radps_; }
  [[nodiscard]] float time_offset_s() const { return offset_s_; }

  [[nodiscard]] static bool valid(const nav::ImuIncrement& imu) { return imu.check() == nav::ImuVerdict::kAccepted; }
  /// At rest at the origin; `gyro_bias_radps` is the gyroscope's mean there.
  void start(const nav::Quaternion& q_nb, const nav::Vector3& gyro_bias_radps = nav::Vector3::Zero()) {
    pose_ = {.q_nb = q_nb};
    ins_ = {};
    ins_.q_nb = q_nb;
    ins_.b_g_radps = gyro_bias_radps;
    offset_s_ = setup_.time_offset_s;
    rate_n_radps_ = nav::Vector3::Zero();
    pending_ = {};
  }
  void know_gyro_bias(const nav::Vector3& gyro_bias_radps) { ins_.b_g_radps = gyro_bias_radps; }
  [[nodiscard]] float variance(int error) const {
    const float sigma = error == kOffset      ? setup_.sigma_time_offset_s
                        : error >= kAccelBias ? setup_.sigma_accel_bias_mps2
                        : error >= kGyroBias  ? setup_.sigma_gyro_bias_radps
                                              : setup_.sigma_speed_mps;
    return sigma * sigma;
  }
  void shift(const nav::Vector3& by_m) {
    nav::move(ins_, by_m);
    pose_.p_n_m = place();
  }
  void correct(const float* error) {
    const nav::Vector3 before = pose_.p_n_m;
    pose_.correct(error);
    const nav::Quaternion turn = nav::exp_quaternion({error[0], error[1], error[2]});
    ins_.q_nb = pose_.q_nb;
    nav::move(ins_, pose_.p_n_m - before);
    ins_.v_n_mps = turn.rotate(ins_.v_n_mps) + group(error, kVelocity);
    ins_.b_g_radps += group(error, kGyroBias);
    ins_.b_a_mps2 += group(error, kAccelBias);
    offset_s_ += error[kOffset];
  }
  /// One increment: the state at once, the covariance of the errors from `first` on after kLongest_s at the latest.
  template <class Covariance>
  void predict(const nav::ImuIncrement& imu, Covariance& p, int first) {
    const nav::Vector3 speed = ins_.v_n_mps, from = pose_.p_n_m;
    const nav::StrapdownStep step = nav::strapdown(ins_, imu, setup_.earth);
    pose_ = {.q_nb = ins_.q_nb, .p_n_m = place()};
    const nav::Matrix3 r = 0.5F * (step.r_nb + pose_.q_nb.matrix());
    const nav::Vector3 rate = r * (imu.dtheta_b_rad * (1.0F / step.dt_s) - ins_.b_g_radps);
    rate_n_radps_ += (step.dt_s / (step.dt_s + kSmooth_s)) * (rate - rate_n_radps_);
    pending_.add(r, 0.5F * (speed + ins_.v_n_mps), 0.5F * (from + pose_.p_n_m), gravity(), step.dt_s);
    if (pending_.dt_s > kLongest_s) predict_covariance(p, first);
  }
  /// Brings the covariance to the state's time. With errors e of state and bias: rho += nu T + [g]x theta T^2/2 - C b_a
  /// - D b_g, nu += [g]x theta T - A b_a - B b_g, theta -= A b_g.
  template <class Covariance>
  void predict_covariance(Covariance& p, int first) {
    const float dt_s = pending_.dt_s;
    if (!(dt_s > 0.0F)) return;
    const int rho = first + 3, nu = first + kVelocity, gyro = first + kGyroBias, accel = first + kAccelBias;
    for (int i = 0; i < 3; ++i) p.add_share(rho + i, dt_s, nu + i);
    const nav::Matrix3 falls = nav::skew(gravity());
    share(p, rho, (0.5F * dt_s * dt_s) * falls, first);
    share(p, rho, -pending_.c, accel);
    share(p, rho, -pending_.d, gyro);
    share(p, nu, dt_s * falls, first);
    share(p, nu, -pending_.a, accel);
    share(p, nu, -pending_.b, gyro);
    share(p, first, -pending_.a, gyro);
    add_noise(p, first, dt_s);
    pending_ = {};
  }
  static constexpr auto members(auto& self) {
    return base::members(base::unhashed(self.setup_), self.pose_, self.ins_, self.offset_s_, self.rate_n_radps_,
                         self.pending_);
  }

 private:
  static constexpr float kLongest_s = 0.045F, kSmooth_s = 0.02F;

  /// Integrals over the time that the covariance does not have yet: A = R, B = [v]x R + [g]x A, C = A, D = B + [p]x R.
  struct Pending {
    float dt_s = 0;
    nav::Matrix3 a = nav::Matrix3::Zero(), b = nav::Matrix3::Zero(), c = nav::Matrix3::Zero(), d = nav::Matrix3::Zero();

    void add(const nav::Matrix3& r, const nav::Vector3& v, const nav::Vector3& p, const nav::Vector3& g, float dt) {
      const nav::Matrix3 a_middle = a + (0.5F * dt) * r;
      const nav::Matrix3 rise = dt * (nav::skew(v) * r + nav::skew(g) * a_middle);
      d += dt * (b + 0.5F * rise + nav::skew(p) * r);
      c += dt * a_middle;
      b += rise;
      a += dt * r;
      dt_s += dt;
    }
    static constexpr auto members(auto& self) { return base::members(self.dt_s, self.a, self.b, self.c, self.d); }
  };

  [[nodiscard]] nav::Vector3 gravity() const { return -setup_.earth.gravity_mps2 * setup_.earth.up_n; }
  [[nodiscard]] nav::Vector3 place() const {
    return {nav::difference(ins_.x, {}), nav::difference(ins_.y, {}), nav::difference(ins_.z, {})};
  }
  static nav::Vector3 group(const float* error, int first) {
    return {error[first], error[first + 1], error[first + 2]};
  }
  template <class Covariance>
  static void share(Covariance& p, int to, const nav::Matrix3& m, int from) {
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        if (m(i, j) < 0.0F || m(i, j) > 0.0F) p.add_share(to + i, m(i, j), from + j);
  }
  /// A turn of the body by n is theta = n, nu = v x n, rho = p x n; a push by n is nu = n, and rho = n T/2 in the mean.
  template <class Covariance>
  void add_noise(Covariance& p, int first, float dt_s) {
    const nav::InsNoise& noise = setup_.noise;
    const auto over = [&](float density) { return density * density * dt_s; };
    const float turn = over(noise.gyro_radps_rthz), push = over(noise.accel_mps2_rthz);
    const nav::Matrix3 of_v = nav::skew(ins_.v_n_mps), of_p = nav::skew(pose_.p_n_m);
    const nav::Matrix3 vv = turn * of_v * of_v.transpose(), pp = turn * of_p * of_p.transpose(),
                       pv = turn * of_p * of_v.transpose();
    const int rho = first + 3, nu = first + kVelocity;
    for (int i = 0; i < 3; ++i) {
      p(first + i, first + i) += turn;
      p(rho + i, rho + i) += push * dt_s * dt_s / 3.0F;
      p(nu + i, nu + i) += push;
      p(rho + i, nu + i) += 0.5F * dt_s * push;
      for (int j = 0; j < 3; ++j) {
        p(rho + i, first + j) += turn * of_p(i, j);
        p(nu + i, first + j) += turn * of_v(i, j);
        p(rho + i, nu + j) += pv(i, j);
      }
      for (int j = i; j < 3; ++j) {
        p(rho + i, rho + j) += pp(i, j);
        p(nu + i, nu + j) += vv(i, j);
      }
      p(first + kGyroBias + i, first + kGyroBias + i) += over(noise.gyro_bias_radps2_rthz);
      p(first + kAccelBias + i, first + kAccelBias + i) += over(noise.accel_bias_mps3_rthz);
    }
  }

  InertialSetup setup_;
  WorldPose pose_;
  nav::InsState ins_;
  float offset_s_ = 0;
  nav::Vector3 rate_n_radps_ = nav::Vector3::Zero();
  Pending pending_;
};

}  // namespace tetap::slam
