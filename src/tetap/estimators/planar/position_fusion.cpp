// SPDX-License-Identifier: Apache-2.0
#include "tetap/estimators/planar/position_fusion.hpp"

#include "tetap/filter/update.hpp"

namespace tetap::estimators {

template <FusionRule kRule>
Innovation PositionFusion<kRule>::fuse(const sensor::GnssPosition& fix, base::Micros stamp, std::uint8_t instance,
                                       const Context& ctx) {
  const param::GnssParameters& n = ctx.parameters.gnss;
  if (fix.fix < sensor::GnssFix::k2d || ctx.map_frame.origin == sensor::OriginSource::kNone) return {};
  const nav::Local local = ctx.map_frame.frame.to_local(fix.latitude_2ndeg, fix.longitude_2ndeg, fix.height_m);
  if (!local.valid) return {.verdict = sensor::Verdict::kNotFinite, .failed = sensor::Check::kValue};
  const float own = base::is_finite(fix.horizontal_acc_m) ? n.sigma_scale * fix.horizontal_acc_m : 10.0F;
  const float sigma_m = base::clamp(own, n.sigma_floor_m, kUnknown_m);
  const base::Anchored x = base::Anchored::from_um(local.east_um), y = base::Anchored::from_um(local.north_um);
  filter::Estimate<float, 2> other{.p = filter::Symmetric<float, 2>::diagonal({sigma_m * sigma_m, sigma_m * sigma_m})};
  const auto bit = static_cast<std::uint8_t>(1U << (instance & 3U));
  if (receivers_ == 0 || stamp != epoch_) {
    x_ = x;
    y_ = y;
    p_ = other.p;
    epoch_ = stamp;
    receivers_ = bit;
    return {.verdict = sensor::Verdict::kAccepted};
  }
  if ((receivers_ & bit) != 0) return {};  // one fix of a receiver is enough for an epoch
  other.x = {x.minus(x_), y.minus(y_)};
  // The position fused so far is the prediction, and the joint gate is that of every filter.
  filter::Symmetric<float, 2> p = p_;
  const auto compared =
      filter::update<float, 2, 2, 2>(p, filter::Matrix<float, 2, 2>::Identity(), {0, 1}, other.x,
                                     {other.p(0, 0), other.p(1, 1)}, n.gate_scale * filter::chi_square_99(2));
  const Innovation verdict = record(compared.innovation);
  if (verdict.verdict != sensor::Verdict::kAccepted) return verdict;
  const filter::Estimate<float, 2> known{.p = p_};
  filter::Fusion<filter::Estimate<float, 2>> fused;
  if constexpr (kRule == FusionRule::kInverseVariance) {
    const std::array<filter::Estimate<float, 2>, 2> both{known, other};
    fused = filter::inverse_variance<float, 2>(both);
  } else {
    fused = filter::covariance_intersection(known, other);
  }
  if (!fused.valid) return {.verdict = sensor::Verdict::kSingular, .failed = sensor::Check::kValue};
  x_ = x_.plus(fused.estimate.x(0));
  y_ = y_.plus(fused.estimate.x(1));
  p_ = fused.estimate.p;
  receivers_ = static_cast<std::uint8_t>(receivers_ | bit);
  return verdict;
}

template class PositionFusion<FusionRule::kInverseVariance>;
template class PositionFusion<FusionRule::kIntersection>;

}  // namespace tetap::estimators
