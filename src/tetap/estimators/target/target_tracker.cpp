// SPDX-License-Identifier: Apache-2.0
#include "tetap/estimators/target/target_tracker.hpp"

#include "tetap/model/radar.hpp"
#include "tetap/model/target_position.hpp"

namespace tetap::estimators {

/// The same position and velocity in polar form; the yaw rate is as of a new track.
void TurnTracking::begin_to_turn(const param::TargetParameters& n) {
  const TargetMotion motion = straight_.motion();
  const float vx = motion.mean(2), vy = motion.mean(3), speed = base::sqrt(vx * vx + vy * vy);
  filter::Vector<float, 4> across;
  const float variance = motion.direction_variance(across);
  if (!(speed > 1e-3F) || !(variance < n.sigma_yaw_rad * n.sigma_yaw_rad)) return;
  filter::Matrix<float, 4, 4> j = filter::Matrix<float, 4, 4>::Zero();
  j(0, 0) = j(1, 1) = 1;
  j(2, 2) = vx / speed, j(2, 3) = vy / speed;
  j(3, 2) = -vy / (speed * speed), j(3, 3) = vx / (speed * speed);
  const filter::Matrix<float, 4, 4> c = j.lazyProduct(motion.covariance).lazyProduct(j.transpose());
  filter_.x.value << motion.mean(0), motion.mean(1), speed, base::atan2(vy, vx), 0;
  filter_.p = {};
  for (int k = 0; k < 4; ++k)
    for (int r = 0; r <= k; ++r) filter_.p(r, k) = c(r, k);
  filter_.p(4, 4) = n.sigma_yaw_rate_radps * n.sigma_yaw_rate_radps;
  turns_ = true;
}

template <class Tracking>
Innovation TargetTracker<Tracking>::fuse(const sensor::LandmarkSighting& sighting, base::Micros stamp,
                                         const Context& ctx) {
  const param::TargetParameters& n = ctx.parameters.target;
  const bool radar = base::is_finite(sighting.range_rate_mps);
  if (!base::is_finite(sighting.range_m) || !base::is_finite(sighting.bearing_rad))
    return {.verdict = sensor::Verdict::kNotFinite, .failed = sensor::Check::kValue};
  const base::SinCos look = base::sincos(sighting.bearing_rad);
  const float x_m = sighting.range_m * look.cos, y_m = sighting.range_m * look.sin;
  const bool lost =
      !begun_ || stamp - time_ > base::Micros{n.timeout_us} ||
      refused_.persists(stamp, base::Micros{ctx.parameters.recovery.after_us}, ctx.parameters.recovery.at_least);
  if (lost) {
    begin(stamp, x_m, y_m, radar ? n.sigma_range_m : n.sigma_position_m, ctx);
    return {.verdict = sensor::Verdict::kAccepted};
  }
  if (stamp > time_) {
    target_.predict(base::seconds(stamp - time_), n);
    time_ = stamp;
  }
  Innovation result;
  if (radar) {
    const auto model = [&]<class State>(std::type_identity<State>) {
      return model::Radar<State>{.range_m = sighting.range_m,
                                 .bearing_rad = sighting.bearing_rad,
                                 .range_rate_mps = sighting.range_rate_mps,
                                 .sigma_range_m = n.sigma_range_m,
                                 .sigma_bearing_rad = n.sigma_bearing_rad,
                                 .sigma_range_rate_mps = n.sigma_range_rate_mps};
    };
    result = record(target_.update(model, n.gate_scale * filter::chi_square_99(3), n));
  } else {
    const auto model = [&]<class State>(std::type_identity<State>) {
      return model::TargetPosition<State>{.x_m = x_m, .y_m = y_m, .sigma_m = n.sigma_position_m};
    };
    result = record(target_.update(model, n.gate_scale * filter::chi_square_99(2), n));
  }
  if (result.verdict == sensor::Verdict::kAccepted || result.verdict == sensor::Verdict::kRejected)
    refused_.update(result.verdict == sensor::Verdict::kRejected, stamp);
  return result;
}

template <class Tracking>
Estimate TargetTracker<Tracking>::estimate(const Context& ctx) const {
  Tracking ahead = target_;
  const bool tracks = this->tracks(ctx);
  if (tracks && now_ > time_) ahead.predict(base::seconds(now_ - time_), ctx.parameters.target);
  Estimate estimate{.time = now_};
  estimate.p = filter::Symmetric<float, 3>::diagonal(
      {kUnknown_m * kUnknown_m, kUnknown_m * kUnknown_m, kUnknown_rad * kUnknown_rad});
  if (!begun_) return estimate;
  const TargetMotion motion = ahead.motion();
  const model::Kinematics<float>& k = motion.mean;
  const filter::Matrix<float, 4, 4>& c = motion.covariance;
  estimate.pose = {
      .x = base::Anchored{}.plus(k(0)), .y = base::Anchored{}.plus(k(1)), .yaw_rad = base::atan2(k(3), k(2))};
  estimate.forward_mps = base::sqrt(k(2) * k(2) + k(3) * k(3));
  estimate.yaw_rate_radps = motion.yaw_rate_radps;
  filter::Vector<float, 4> across;
  const float variance = motion.direction_variance(across);
  const bool directed = variance < kUnknown_rad * kUnknown_rad && variance > 0.0F;
  estimate.p(0, 0) = c(0, 0), estimate.p(0, 1) = c(0, 1), estimate.p(1, 1) = c(1, 1);
  if (directed) {
    estimate.p(0, 2) = across(0), estimate.p(1, 2) = across(1);
    estimate.p(2, 2) = variance * 1.0001F + 1e-8F;  // above the rounding of the product
  }
  estimate.position_valid = estimate.velocity_valid = tracks;
  estimate.heading_valid = tracks && directed && variance < 1.0F;
  return estimate;
}

template class TargetTracker<VelocityTracking>;
template class TargetTracker<TurnTracking>;

}  // namespace tetap::estimators
