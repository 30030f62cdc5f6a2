// SPDX-License-Identifier: Apache-2.0
// Inertial navigation, part: IMU samples, the begin of tracking, standstill.
#pragma once

#include "app/estimators/inertial.hpp"
#include "model/zero_rate.hpp"
#include "model/zero_velocity.hpp"

namespace tetap::app {

inline Innovation Inertial::fuse(const ImuSample& sample, base::Micros stamp, const Context& with) {
  const nav::ImuIncrement increment = increment_of(sample, with.numbers.inertial);
  if (increment.check() != nav::ImuVerdict::kAccepted) return {.verdict = can::Verdict::kNotFinite};
  const float dt_s = base::seconds(increment.dt);
  rate_b_radps_ = increment.dtheta_b_rad / dt_s;
  if (phase_ != Phase::kTracking) {
    time_ = stamp;
    if (start_.level(increment, with.numbers.inertial)) phase_ = Phase::kHeading;
    if (phase_ == Phase::kHeading && start_.ready()) begin(with);
    return {.verdict = can::Verdict::kAccepted};
  }
  // Lost samples: what is missing between the last and the begin of this one is bridged.
  const base::Micros gap = stamp - increment.dt - time_;
  if (gap > base::Micros{1'500})
    ins_.predict_without_imu(gap, with.numbers.inertial.gap_mps2, with.numbers.inertial.gap_radps);
  if (ins_.predict(increment) != nav::ImuVerdict::kAccepted) return {.verdict = can::Verdict::kNotFinite};
  ins_.predict_covariance(sample.clipped_accel + sample.clipped_gyro > 0 ? 10.0F : 1.0F);
  time_ = stamp;
  still_s_ += dt_s;
  still_rate_radps_ += (rate_b_radps_ - still_rate_radps_) * (dt_s / (still_s_ > dt_s ? still_s_ : dt_s));
  stand(stamp, with);
  constrain(stamp, with);
  return {.verdict = can::Verdict::kAccepted};
}

/// The filter begins where the start found the robot.
inline void Inertial::begin(const Context& with) {
  if (with.site.origin != can::OriginSource::kNone) ins_.earth = nav::Earth::at(with.site.frame, false);
  start_.begin(ins_, with.numbers.inertial, phase_ == Phase::kTracking);
  phase_ = Phase::kTracking;
  last_position_ = time_;
  refused_ = {};
  still_s_ = 0;
}

/// Wheels that have not turned for half a second: no velocity, and the gyroscope's mean is its bias.
inline void Inertial::stand(base::Micros stamp, const Context& with) {
  const InertialNumbers& n = with.numbers.inertial;
  constexpr base::Micros kQuiet{500'000}, kEvery{100'000};
  const bool quiet = have_counts_ && stamp - counts_time_ < kEvery && stamp - moved_ > kQuiet;
  const nav::Vector3 turn = rate_b_radps_ - ins_.x.b_g_radps;
  if (!quiet || turn.squaredNorm() > n.still_radps * n.still_radps) {
    still_s_ = 0;
    return;
  }
  if (stamp - stood_ < kEvery) return;
  stood_ = stamp;
  static_cast<void>(ins_.update(model::ZeroVelocity{.sigma_mps = n.still_mps}, filter::chi_square_99(3) * 4.0F));
  if (still_s_ < 0.5F) return;
  // The mean over the standstill so far; successive means share their samples, so the sigma is that of the last tenth.
  const float sigma = 3.0F * n.gyro_radps_rthz * base::sqrt(10.0F);
  static_cast<void>(ins_.update(model::ZeroRate{.gyro_b_radps = still_rate_radps_, .sigma_radps = sigma},
                                filter::chi_square_99(3) * 4.0F));
}

}  // namespace tetap::app
