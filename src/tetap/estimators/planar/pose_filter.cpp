// SPDX-License-Identifier: Apache-2.0
#include "tetap/estimators/planar/cloning_pose_ekf.hpp"
#include "tetap/estimators/planar/correlated_fix.hpp"
#include "tetap/estimators/planar/landmark_sighting.hpp"
#include "tetap/estimators/planar/pose_ekf.hpp"
#include "tetap/estimators/planar/pose_ukf.hpp"

namespace tetap::estimators {

namespace {

/// Square of the position's and of the heading's error that would explain an innovation alone.
struct SquaredError {
  float place_m2 = 0, yaw_rad2 = 0;
};
SquaredError squared_error(const model::GnssPosition&, const filter::Vector<float, 2>& nu) {
  return {nu(0) * nu(0) + nu(1) * nu(1), 0};
}
SquaredError squared_error(const model::RangeBearing& seen, const filter::Vector<float, 2>& nu) {
  const float aside_m = seen.range_m * nu(1);
  return {nu(0) * nu(0) + aside_m * aside_m, nu(1) * nu(1)};
}
SquaredError squared_error(const model::Range&, const filter::Vector<float, 1>& nu) { return {nu(0) * nu(0), 0}; }
SquaredError squared_error(const model::Bearing&, const filter::Vector<float, 1>& nu) { return {0, nu(0) * nu(0)}; }

}  // namespace

template <class Filter>
template <class Model>
Innovation PoseFilter<Filter>::measure(const Model& model, Source source, float gate_scale, base::Micros stamp,
                                       const Context& ctx, std::uint8_t landmark, bool named) {
  const float gate = gate_scale * filter::chi_square_99(Model::kDimension);
  if (relocalisation_.searches()) relocalisation_.move(motion_.filter.x, covariance_of(motion_.filter));
  const auto result = update_by(model, gate, stamp, ctx.parameters.gnss);
  checks::Persistence& refused = refused_[source];
  std::uint8_t& in_a_row = in_a_row_[source];
  if (result.verdict == filter::Verdict::kAccepted) {
    refused.update(false, stamp);
    in_a_row = 0;
    last_absolute_ = stamp;
    vote_.accepted();
  } else if (result.verdict == filter::Verdict::kRejected) {
    refused.update(true, stamp);
    if (in_a_row < kDegraded) ++in_a_row;
    vote_.note(model, motion_.filter.x, result);
    if (both_refuse(source, stamp)) {
      const auto [place_m2, yaw_rad2] = squared_error(model, result.nu);
      const float most_rad = ctx.parameters.recovery.inflate_yaw_rad, most_rad2 = most_rad * most_rad;
      widen_by_vote(place_m2, yaw_rad2 < most_rad2 ? yaw_rad2 : most_rad2, stamp);
    }
    recover(refused, stamp, ctx.parameters.recovery);
  }
  if (relocalisation_.searches() || in_a_row_[kLandmark] >= kDegraded)
    relocalisation_.note(motion_.filter.x, covariance_of(motion_.filter));
  if constexpr (std::same_as<Model, model::GnssPosition>)
    relocalisation_.add(model, stamp, gate, ctx.parameters.gnss.correlation_s);
  if constexpr (std::same_as<Model, model::RangeBearing>)
    if (named && relocalisation_.add(model, landmark, stamp, result, in_a_row_[kLandmark] >= kDegraded)) {
      take_rival(stamp);
      return {.verdict = sensor::Verdict::kAccepted, .landmark = landmark};
    }
  return record(result, landmark);
}

template <class Filter>
template <class Model>
auto PoseFilter<Filter>::update_by(const Model& model, float gate, base::Micros stamp, const param::GnssParameters& n)
    -> filter::Innovation<float, Model::kDimension> {
  if constexpr (std::same_as<Model, model::GnssPosition>) {
    const float since_s = last_fused_fix_.us > 0 ? base::seconds(stamp - last_fused_fix_) : base::kInfinity;
    auto judged = update_by_fix(motion_.filter, model, gate, since_s, n.correlation_s);
    if (judged.verdict == filter::Verdict::kAccepted) last_fused_fix_ = stamp;
    return judged;
  } else {
    return motion_.filter.update(model, gate);
  }
}

template <class Filter>
[[gnu::noinline]] void PoseFilter<Filter>::take_rival(base::Micros stamp) {
  motion_.filter.x = relocalisation_.rival().x;
  set_covariance(motion_.filter, relocalisation_.rival().p);
  last_fused_fix_ = relocalisation_.last_fused_fix();
  relocalisation_.reset();
  for (checks::Persistence& refused : refused_) refused.reset();
  in_a_row_ = {};
  trust_motion();
  forget_clones();
  last_absolute_ = stamp;
  ++jumps_;
}

/// Each was refused twice in a row, the other since less than the time of dead reckoning, and both for the same place.
template <class Filter>
bool PoseFilter<Filter>::both_refuse(Source source, base::Micros stamp) const {
  const Source other = source == kGnss ? kLandmark : kGnss;
  return refused_[source].count() >= 2 && refused_[other].count() >= 2 &&
         refused_[other].held_for(stamp) < base::Micros{5'000'000} && vote_.one_place();
}

template <class Filter>
void PoseFilter<Filter>::widen_by_vote(float place_m2, float yaw_rad2, base::Micros stamp) {
  add_variance(motion_.filter, {place_m2, place_m2, yaw_rad2});
  vote_.contradict(base::sqrt(place_m2), stamp - last_absolute_, stamp);
  for (checks::Persistence& refused : refused_) refused.reset();
}

template <class Filter>
void PoseFilter<Filter>::judge_motion(base::Micros stamp, const param::Parameters& n) {
  const float turned_rad2 = turn_.update(motion_, stamp, n);
  const float place_m2 = TurnCheck::place_m2(turned_rad2, n);
  if (turned_rad2 > 0.0F) widen({place_m2, place_m2, turned_rad2});
  const float more_m2 = vote_.added_m2(stamp - last_absolute_, stamp);
  if (more_m2 > 0.0F) widen({more_m2, more_m2, 0.0F});
}

template <class Filter>
void PoseFilter<Filter>::recover(checks::Persistence& refused, base::Micros stamp, const param::RecoveryParameters& n) {
  if (!refused.persists(stamp, base::Micros{n.after_us}, n.at_least)) return;
  const float place_m2 = n.inflate_position_m * n.inflate_position_m;
  add_variance(motion_.filter, {place_m2, place_m2, n.inflate_yaw_rad * n.inflate_yaw_rad});
  refused.reset();
}

template <class Filter>
Innovation PoseFilter<Filter>::fuse(const sensor::LandmarkSighting& seen, base::Micros stamp, const Context& ctx) {
  sensor::LandmarkSighting sighting = seen;
  if (seen.landmark == kAnyLandmark) {
    const std::optional<Innovation> refused = refusal_of(seen, ctx.map_frame.map);
    if (refused) return *refused;
    motion_.propagate(stamp, ctx.parameters);
    give_up_when_lost();
    sighting.landmark = nearest_landmark(seen, ctx);
    if (sighting.landmark == kAnyLandmark) return {.landmark = sighting.landmark};
  }
  const param::LandmarkParameters& n = ctx.parameters.landmark;
  const std::optional<model::Landmark> landmark =
      ctx.map_frame.map != nullptr ? ctx.map_frame.map->find(sighting.landmark) : std::nullopt;
  if (!landmark) return {.verdict = sensor::Verdict::kUnknownLandmark, .landmark = sighting.landmark};
  motion_.propagate(stamp, ctx.parameters);
  give_up_when_lost();
  const bool has_range = base::is_finite(sighting.range_m);
  const bool has_bearing = base::is_finite(sighting.bearing_rad);
  if (has_range && has_bearing) {
    const model::RangeBearing model{.range_m = sighting.range_m,
                                    .bearing_rad = sighting.bearing_rad,
                                    .sigma_range_m = n.sigma_range_m + n.sigma_range_per_m * sighting.range_m,
                                    .sigma_bearing_rad = n.sigma_bearing_rad,
                                    .landmark = *landmark,
                                    .mounting = n.mounting};
    if (phase_ != Phase::kTracking) return align(model, stamp, ctx, sighting.landmark);
    return measure(model, kLandmark, n.gate_scale, stamp, ctx, sighting.landmark, seen.landmark != kAnyLandmark);
  }
  if (phase_ != Phase::kTracking) return {.verdict = sensor::Verdict::kNotUsed, .landmark = sighting.landmark};
  if (has_range) {
    const model::Range model{.range_m = sighting.range_m,
                             .sigma_range_m = n.sigma_range_only_m + n.sigma_range_per_m * sighting.range_m,
                             .landmark = *landmark,
                             .mounting = n.mounting};
    return measure(model, kLandmark, n.gate_scale, stamp, ctx, sighting.landmark);
  }
  if (has_bearing) {
    const model::Bearing model{.bearing_rad = sighting.bearing_rad,
                               .sigma_bearing_rad = n.sigma_bearing_rad,
                               .landmark = *landmark,
                               .mounting = n.mounting};
    return measure(model, kLandmark, n.gate_scale, stamp, ctx, sighting.landmark);
  }
  return {.verdict = sensor::Verdict::kNotFinite, .landmark = sighting.landmark, .failed = sensor::Check::kValue};
}

template <class Filter>
std::uint8_t PoseFilter<Filter>::nearest_landmark(const sensor::LandmarkSighting& sighting, const Context& ctx) const {
  if (phase_ != Phase::kTracking) return kAnyLandmark;
  const LandmarkMap<kMapCapacity>& map = *ctx.map_frame.map;
  std::uint8_t nearest = kAnyLandmark;
  float least = base::kInfinity;
  for (std::size_t i = 0; i < map.size(); ++i) {
    const Innovation distance = distance_from(motion_.filter.x, covariance_of(motion_.filter), sighting, map.entry(i),
                                              ctx.parameters.landmark, 0.0F);
    const bool compared = distance.verdict == sensor::Verdict::kAccepted || distance.failed == sensor::Check::kGate;
    if (!compared || !(distance.nis < least)) continue;
    least = distance.nis;
    nearest = map.id(i);
  }
  return nearest;
}

/// The candidate's own frame is the map; refused, it is one as good as any other.
template <class Filter>
Innovation PoseFilter<Filter>::align(const model::RangeBearing& seen, base::Micros stamp, const Context& ctx,
                                     std::uint8_t landmark) {
  const Innovation waits{
      .verdict = sensor::Verdict::kNotUsed, .landmark = landmark, .failed = sensor::Check::kUnconfirmed};
  Innovation third = waits;
  if (landmarks_.has_candidate()) {
    if (!landmarks_.is_third(landmark, stamp)) return waits;
    const float gate = ctx.parameters.landmark.gate_scale * filter::chi_square_99(model::RangeBearing::kDimension);
    third = record(motion_.filter.update(seen, gate), landmark);
    if (third.verdict == sensor::Verdict::kAccepted) {
      begin_tracking(stamp);
      return third;
    }
    phase_ = Phase::kWaiting;
  }
  const LandmarkAlignment::Result found =
      landmarks_.add(seen, landmark, stamp, motion_.filter.x, covariance_of(motion_.filter));
  using Outcome = LandmarkAlignment::Outcome;
  if (found.outcome == Outcome::kFirst || found.outcome == Outcome::kContradicts) motion_.forget_error();
  if (found.outcome == Outcome::kContradicts)
    return {.verdict = sensor::Verdict::kRejected,
            .dof = 1,
            .nis = found.nis,
            .gate = found.gate,
            .landmark = landmark,
            .failed = sensor::Check::kGate};
  if (found.outcome == Outcome::kCandidate) {
    motion_.relocate(found.pose.pose, found.pose.sigma_position_m, found.pose.sigma_yaw_rad);
    alignment_ = {};  // it knew the frame of before
    phase_ = Phase::kAligning;
  }
  return third;
}

template <class Filter>
Innovation PoseFilter<Filter>::fuse(const sensor::GnssPosition& fix, base::Micros stamp, const Context& ctx) {
  const param::GnssParameters& n = ctx.parameters.gnss;
  if (fix.fix < sensor::GnssFix::k2d || ctx.map_frame.origin == sensor::OriginSource::kNone) return {};
  const nav::Local local = ctx.map_frame.frame.to_local(fix.latitude_2ndeg, fix.longitude_2ndeg, fix.height_m);
  if (!local.valid) return {.verdict = sensor::Verdict::kNotFinite, .failed = sensor::Check::kValue};
  const float own = base::is_finite(fix.horizontal_acc_m) ? n.sigma_scale * fix.horizontal_acc_m : 10.0F;
  const float sigma_m = own > n.sigma_floor_m ? own : n.sigma_floor_m;
  const model::GnssPosition model{.x = base::Anchored::from_um(local.east_um),
                                  .y = base::Anchored::from_um(local.north_um),
                                  .sigma_m = sigma_m,
                                  .antenna_x_b_m = n.antenna_x_b_m,
                                  .antenna_y_b_m = n.antenna_y_b_m};
  motion_.propagate(stamp, ctx.parameters);
  give_up_when_lost();
  if (phase_ == Phase::kTracking) return measure(model, kGnss, n.gate_scale, stamp, ctx);

  phase_ = Phase::kAligning;
  const auto aligned = alignment_.add(model, motion_.filter.x, n.align_distance_m);
  if (aligned) {
    motion_.start(stamp, aligned->pose, aligned->sigma_position_m, aligned->sigma_yaw_rad);
    begin_tracking(stamp);
    last_fused_fix_ = stamp;
  }
  return {.verdict = sensor::Verdict::kAccepted};
}

/// Implements docs/explanation/equations.md (18).
template <class Filter>
Innovation PoseFilter<Filter>::fuse_relative(const sensor::RelativePose& displacement, base::Micros stamp,
                                             const Context& ctx) {
  Innovation result{.failed = sensor::Check::kUnconfirmed};
  if constexpr (kTakesRelatives) {
    constexpr float kFarthest_m2 = 1e3F;  // above, the float has too few digits left for a displacement
    motion_.propagate(stamp, ctx.parameters);
    give_up_when_lost();
    Filter& filter = motion_.filter;
    if (phase_ != Phase::kTracking || !(filter.p(0, 0) + filter.p(1, 1) < kFarthest_m2)) return result;
    const base::Micros interval{displacement.interval_us};
    const int from = filter.clones.find(stamp - interval);
    int kept = PoseClones::kNone;
    result.failed = sensor::Check::kTime;
    if (from != PoseClones::kNone) {
      if (relocalisation_.searches()) relocalisation_.move(filter.x, filter.p);
      if (!motion_.measured(stamp, ctx.parameters)) {  // nothing but the displacement shows the way
        const float free_m = ctx.parameters.wheels.most_mps * base::seconds(interval);
        filter.p.add_diagonal(displacement.as_unknown_motion(free_m));
      }
      const auto judged = filter.update_relative(displacement, from, 1.0F);
      result = record(judged);
      result.dof = static_cast<std::uint8_t>(3 - (displacement.unknown(0) ? 1 : 0) - (displacement.unknown(1) ? 1 : 0));
      if (judged.verdict == filter::Verdict::kAccepted) kept = from;
      if (relocalisation_.searches()) relocalisation_.note(filter.x, filter.p);
    }
    filter.clones.add(stamp, filter.x, filter.p, kept);
  }
  return result;
}

template class PoseFilter<PlanarEkf>;                       // PoseEkf
template class PoseFilter<filter::Ukf<model::PlanarPose>>;  // PoseUkf
template class PoseFilter<filter::UkfSqrt<model::PlanarPose>>;
template class PoseFilter<CloningEkf>;  // CloningPoseEkf

}  // namespace tetap::estimators
