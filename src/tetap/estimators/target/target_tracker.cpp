// SPDX-License-Identifier: Apache-2.0
#include "tetap/estimators/target/target_tracker.hpp"

#include "tetap/model/radar.hpp"
#include "tetap/model/target_position.hpp"

namespace tetap::estimators {

template <class Tracking>
Innovation TargetTracker<Tracking>::fuse(const sensor::LandmarkSighting& sighting, base::Micros stamp,
                                         const Context& ctx) {
  using State = typename Filter::State;
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
    static_cast<void>(filter_.predict(Tracking::motion(base::seconds(stamp - time_), n)));
    time_ = stamp;
  }
  Innovation result;
  if (radar) {
    const model::Radar<State> model{.range_m = sighting.range_m,
                                    .bearing_rad = sighting.bearing_rad,
                                    .range_rate_mps = sighting.range_rate_mps,
                                    .sigma_range_m = n.sigma_range_m,
                                    .sigma_bearing_rad = n.sigma_bearing_rad,
                                    .sigma_range_rate_mps = n.sigma_range_rate_mps};
    result = record(filter_.update(model, n.gate_scale * filter::chi_square_99(3)));
  } else {
    const model::TargetPosition<State> model{.x_m = x_m, .y_m = y_m, .sigma_m = n.sigma_position_m};
    result = record(filter_.update(model, n.gate_scale * filter::chi_square_99(2)));
  }
  if (result.verdict == sensor::Verdict::kAccepted || result.verdict == sensor::Verdict::kRejected)
    refused_.update(result.verdict == sensor::Verdict::kRejected, stamp);
  return result;
}

template <class Tracking>
Estimate TargetTracker<Tracking>::estimate(const Context& ctx) const {
  Filter ahead = filter_;
  const bool tracks = this->tracks(ctx);
  if (tracks && now_ > time_)
    static_cast<void>(ahead.predict(Tracking::motion(base::seconds(now_ - time_), ctx.parameters.target)));
  Estimate estimate{.time = now_};
  estimate.p = filter::Symmetric<float, 3>::diagonal(
      {kUnknown_m * kUnknown_m, kUnknown_m * kUnknown_m, kUnknown_rad * kUnknown_rad});
  if (!begun_) return estimate;
  const model::Kinematics<float> k = model::kinematics(ahead.x);
  const float speed2 = k(2) * k(2) + k(3) * k(3);
  estimate.pose = {
      .x = base::Anchored{}.plus(k(0)), .y = base::Anchored{}.plus(k(1)), .yaw_rad = base::atan2(k(3), k(2))};
  estimate.forward_mps = base::sqrt(speed2);
  estimate.yaw_rate_radps = Tracking::yaw_rate_radps(ahead);
  // Covariance of position and velocity; the direction of the velocity from it, as far as that is linear.
  const auto j = model::kinematics_jacobian(ahead.x);
  const filter::Matrix<float, 4, 4> c = j.lazyProduct(ahead.p.dense()).lazyProduct(j.transpose());
  const filter::Vector<float, 4> turn{0, 0, -k(3) / (speed2 > 1e-6F ? speed2 : 1e-6F),
                                      k(2) / (speed2 > 1e-6F ? speed2 : 1e-6F)};
  const filter::Vector<float, 4> across = c.lazyProduct(turn);
  const float variance = turn.dot(across);
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
