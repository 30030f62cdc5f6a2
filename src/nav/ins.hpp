// SPDX-License-Identifier: Apache-2.0
// Inertial navigation as an error-state Kalman filter (Sola 2017, sec. 5-7; Groves 2013, ch. 14): state prediction per
// increment, covariance prediction whenever the caller wants one, measurements through the update all filters share.
#pragma once

#include "filter/state.hpp"
#include "filter/update.hpp"
#include "nav/ins_covariance.hpp"
#include "nav/strapdown.hpp"

namespace tetap::nav {

/// One sigma of what drives the errors. A time constant of zero makes the bias a random walk.
struct InsNoise {
  float gyro_radps_rthz = 5e-5F;        ///< angle random walk, rad/s/sqrt(Hz)
  float accel_mps2_rthz = 7e-4F;        ///< velocity random walk, m/s^2/sqrt(Hz)
  float gyro_bias_radps2_rthz = 1e-6F;  ///< bias random walk, rad/s^2/sqrt(Hz)
  float accel_bias_mps3_rthz = 1e-4F;   ///< m/s^3/sqrt(Hz)
  float gyro_bias_time_s = 0;
  float accel_bias_time_s = 0;
  float motion_sigma = 3;  ///< what the accelerometer shows counts as motion beyond so many sigma of its noise
};

class Ins {
 public:
  static constexpr int kErrors = InsState::kErrors;
  using Covariance = filter::Symmetric<float, kErrors>;

  InsState x{};
  Covariance p = Covariance::diagonal({1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1});
  InsNoise noise{};
  Earth earth{};

  /// Moves the state; the covariance waits for predict_covariance(). Whatever is not accepted changes nothing: the
  /// caller has a gap in time, to be bridged with predict_without_imu().
  [[nodiscard]] ImuVerdict predict(const ImuIncrement& imu) {
    const ImuVerdict verdict = imu.check();
    if (verdict != ImuVerdict::kAccepted) return verdict;
    InsState moved = x;
    const StrapdownStep step = strapdown(moved, imu, earth);
    if (!(moved.v_n_mps.squaredNorm() < kMostSpeed_mps * kMostSpeed_mps)) return ImuVerdict::kDiverged;
    x = moved;
    pending_.dt_s += step.dt_s;
    pending_.dv_n_mps += step.dv_n_mps;
    pending_.r_dt += step.r_nb * step.dt_s;
    return verdict;
  }

  /// Brings the covariance to the state's time: after every increment, or once for several (up to some 50 ms; the
  /// measurement that comes needs it). `vibration` scales the noise density of gyroscope and accelerometer.
  void predict_covariance(float vibration = 1.0F) {
    if (!(pending_.dt_s > 0.0F)) return;
    const float dt_s = pending_.dt_s;
    const auto variance = [dt_s](float density) { return density * density * dt_s; };
    const auto keep = [dt_s](float time_s) { return time_s > dt_s ? 1.0F - dt_s / time_s : 1.0F; };
    const float more = vibration > 1.0F && vibration < 1e4F ? vibration : 1.0F;
    pending_.var_v = variance(more * noise.accel_mps2_rthz);
    pending_.var_theta = variance(more * noise.gyro_radps_rthz);
    pending_.var_b_a = variance(noise.accel_bias_mps3_rthz);
    pending_.var_b_g = variance(noise.gyro_bias_radps2_rthz);
    pending_.keep_b_a = keep(noise.accel_bias_time_s);
    pending_.keep_b_g = keep(noise.gyro_bias_time_s);
    x.b_a_mps2 *= pending_.keep_b_a;
    x.b_g_radps *= pending_.keep_b_g;
    if (noise.motion_sigma > 0.0F) keep_motion(pending_);
    nav::predict_covariance(p, pending_);
    pending_ = {};
    maintain();
  }

  /// A gap in the increments: the velocity is kept, and the noise is that of a robot that may have done anything of
  /// this size.
  void predict_without_imu(base::Micros gap, float sigma_mps2, float sigma_radps) {
    predict_covariance();
    for (std::int64_t left_us = gap.us < kMostGap_us ? gap.us : kMostGap_us; left_us > 0; left_us -= kGapStep_us) {
      const float dt_s = base::seconds({left_us < kGapStep_us ? left_us : kGapStep_us});
      move(x.x, x.v_n_mps(0) * dt_s);
      move(x.y, x.v_n_mps(1) * dt_s);
      move(x.z, x.v_n_mps(2) * dt_s);
      nav::predict_covariance(p, {.dt_s = dt_s,
                                  .var_v = sigma_mps2 * sigma_mps2 * dt_s * kGapStep_s,
                                  .var_theta = sigma_radps * sigma_radps * dt_s * kGapStep_s});
    }
    condition(p);
  }

  /// Joint gate, then sequential scalar updates; a measurement that is not accepted changes nothing. The covariance is
  /// brought up to date first.
  template <filter::MeasurementModel<InsState> Measurement>
  [[nodiscard]] filter::Innovation<float, Measurement::kDimension> update(const Measurement& measurement, float gate) {
    constexpr int kM = Measurement::kDimension;
    predict_covariance();
    filter::Linearised<float, kM, static_cast<int>(Measurement::kTouches.size())> at;
    if constexpr (requires { measurement.linearised(x); }) {
      at = measurement.linearised(x);
    } else {
      at = {.z_hat = measurement.predict(x), .h = measurement.jacobian(x)};
    }
    const auto result = filter::update<float, kErrors, kM, Measurement::kTouches.size()>(
        p, at.h, Measurement::kTouches, measurement.residual(at.z_hat), measurement.noise(), gate);
    if (result.innovation.verdict != filter::Verdict::kAccepted) return result.innovation;
    x = x.plus(result.dx);
    // A measurement 10^4 times as sharp as the prediction leaves few digits of P.
    const auto variances = measurement.noise();
    for (int m = 0; m < kM; ++m) {
      if (variances(m) > 1e-4F * result.innovation.s(m, m)) continue;
      condition(p);
      break;
    }
    return result.innovation;
  }

  /// Begins anew; whatever was pending is forgotten.
  void start(const InsState& at, const Covariance& covariance) {
    x = at;
    p = covariance;
    pending_ = {};
    since_ = 0;
  }

  /// How often the covariance had to be put right (see condition()).
  [[nodiscard]] std::uint32_t conditioned() const { return conditioned_; }

 private:
  static constexpr float kMostSpeed_mps = 1000.0F;
  static constexpr std::int64_t kGapStep_us = 100'000, kMostGap_us = 60'000'000;
  static constexpr float kGapStep_s = 0.1F;
  static constexpr std::uint32_t kEvery = 16;

  /// Sensor noise taken for acceleration would let the filter believe that it sees its heading at standstill: v gains
  /// theta x (dv + noise), and every noisy sample looks like a known push whose direction was then observed. The
  /// horizontal part of dv in F shrinks by the share of its energy that noise explains (James & Stein 1961).
  void keep_motion(InsCovarianceStep<float>& step) const {
    const float energy = step.dv_n_mps(0) * step.dv_n_mps(0) + step.dv_n_mps(1) * step.dv_n_mps(1);
    const float explained = noise.motion_sigma * noise.motion_sigma * step.var_v;
    const float share = energy > explained ? 1.0F - explained / energy : 0.0F;
    step.dv_n_mps(0) *= share;
    step.dv_n_mps(1) *= share;
  }

  /// The check costs as much as a prediction, so it is made now and then; what rounding does in between is far below
  /// its margin.
  void maintain() {
    if (++since_ < kEvery) return;
    since_ = 0;
    if (!condition(p)) ++conditioned_;
  }

  InsCovarianceStep<float> pending_{};
  std::uint32_t since_ = 0;
  std::uint32_t conditioned_ = 0;
};

}  // namespace tetap::nav
