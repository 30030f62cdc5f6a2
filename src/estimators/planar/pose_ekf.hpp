// SPDX-License-Identifier: Apache-2.0
// The planar pose by extended Kalman filter: dead reckoning corrected by known landmarks and GNSS, with a gate and a
// rule for getting back in when everything is refused.
#pragma once

#include "checks/persistence.hpp"
#include "estimators/context.hpp"
#include "estimators/planar/dead_reckoning.hpp"
#include "estimators/planar/gnss_alignment.hpp"
#include "model/bearing.hpp"
#include "model/gnss_position.hpp"
#include "model/range.hpp"
#include "model/range_bearing.hpp"

#include <array>
#include <optional>

namespace tetap::estimators {

class PoseEkf {
 public:
  static constexpr sensor::EstimatorKind kKind = sensor::EstimatorKind::kEkf;

  void restart(base::Micros t, const Context& ctx) {
    *this = {};
    const param::StartParameters& s = ctx.parameters.start;
    const SetPose start{
        .pose = {.x = base::Anchored{}.plus(s.x_m), .y = base::Anchored{}.plus(s.y_m), .yaw_rad = s.yaw_rad},
        .sigma_position_m = s.sigma_position_m,
        .sigma_yaw_rad = s.sigma_yaw_rad};
    if (s.known != 0) {
      set_pose(t, start, ctx);
    } else {
      motion_.start(t, model::PlanarPose{}, kUnknown_m, kUnknown_rad);
    }
  }
  void set_pose(base::Micros t, const SetPose& given, const Context& ctx) {
    motion_.propagate(t, ctx.parameters);
    const bool heading = given.sigma_yaw_rad < 3.14F;  // false for NaN too
    motion_.start(t, given.pose, given.sigma_position_m, heading ? given.sigma_yaw_rad : kUnknown_rad);
    phase_ = heading ? Phase::kTracking : Phase::kWaiting;
    alignment_ = {};
    last_absolute_ = t;
    refused_ = {};
  }

  void advance(base::Micros t, const Context&) { motion_.advance(t), now_ = t; }

  template <class Input>
  requires requires(DeadReckoning& motion, const Input& input, const param::Parameters& n) {
    motion.fuse(input, base::Micros{}, n);
  }
  Innovation fuse(const Input& input, base::Micros stamp, const Context& ctx) {
    const bool used = motion_.fuse(input, stamp, ctx.parameters);
    return {.verdict = used ? sensor::Verdict::kAccepted : sensor::Verdict::kNotUsed};
  }

  Innovation fuse(const sensor::LandmarkSighting& sighting, base::Micros stamp, const Context& ctx);
  Innovation fuse(const sensor::GnssPosition& fix, base::Micros stamp, const Context& ctx);

  [[nodiscard]] Estimate estimate(const Context& ctx) const {
    Estimate estimate = motion_.estimate(ctx.parameters);
    estimate.position_valid = estimate.heading_valid = phase_ == Phase::kTracking;
    return estimate;
  }
  [[nodiscard]] MotionVariance motion_variance(const Context& ctx) const {
    return motion_.motion_variance(ctx.parameters);
  }
  [[nodiscard]] sensor::Mode mode(const Context&) const {
    if (phase_ == Phase::kWaiting) return sensor::Mode::kWaitingForPose;
    if (phase_ == Phase::kAligning) return sensor::Mode::kAligning;
    for (const checks::Persistence& refused : refused_)
      if (refused.count() >= 3) return sensor::Mode::kDegraded;
    return now_ - last_absolute_ > base::Micros{5'000'000} ? sensor::Mode::kDeadReckoning : sensor::Mode::kNominal;
  }
  template <class Sink>
  void hash_state(Sink&& sink) const {
    motion_.hash_state(sink);
    sink(static_cast<std::uint32_t>(phase_));
    alignment_.hash_state(sink);
    for (const checks::Persistence& refused : refused_) refused.hash_state(sink);
    sink(last_absolute_.us);
  }

 private:
  enum class Phase : std::uint8_t { kWaiting, kAligning, kTracking };
  enum Source : std::size_t { kLandmark, kGnss, kSources };
  static constexpr float kLost_rad = 1;

  /// A heading that could be anything is looked for afresh: a filter that linearises about it would never find it.
  void give_up_when_lost() {
    if (phase_ != Phase::kTracking || !(motion_.filter.p(2, 2) > kLost_rad * kLost_rad)) return;
    phase_ = Phase::kWaiting;
    alignment_ = {};
  }
  template <class Model>
  Innovation measure(const Model& model, Source source, float gate_scale, base::Micros stamp, const Context& ctx,
                     std::uint8_t landmark = 0xFF);
  void recover(checks::Persistence& refused, base::Micros stamp, const param::RecoveryParameters& n);

  DeadReckoning motion_;
  GnssAlignment alignment_;
  Phase phase_ = Phase::kWaiting;
  std::array<checks::Persistence, kSources> refused_{};  ///< rejections in a row of one kind of sensor
  base::Micros last_absolute_;                           ///< stamp of the last accepted landmark or fix
  base::Micros now_;
};

template <class Model>
Innovation PoseEkf::measure(const Model& model, Source source, float gate_scale, base::Micros stamp, const Context& ctx,
                            std::uint8_t landmark) {
  const auto result = motion_.filter.update(model, gate_scale * filter::chi_square_99(Model::kDimension));
  checks::Persistence& refused = refused_[source];
  if (result.verdict == filter::Verdict::kAccepted) {
    refused.update(false, stamp);
    last_absolute_ = stamp;
  } else if (result.verdict == filter::Verdict::kRejected) {
    refused.update(true, stamp);
    recover(refused, stamp, ctx.parameters.recovery);
  }
  return record(result, landmark);
}

inline void PoseEkf::recover(checks::Persistence& refused, base::Micros stamp, const param::RecoveryParameters& n) {
  if (!refused.persists(stamp, base::Micros{n.after_us}, n.at_least)) return;
  auto& p = motion_.filter.p;
  p(0, 0) += n.inflate_position_m * n.inflate_position_m;
  p(1, 1) += n.inflate_position_m * n.inflate_position_m;
  p(2, 2) += n.inflate_yaw_rad * n.inflate_yaw_rad;
  refused.reset();
}

inline Innovation PoseEkf::fuse(const sensor::LandmarkSighting& sighting, base::Micros stamp, const Context& ctx) {
  const param::LandmarkParameters& n = ctx.parameters.landmark;
  const std::optional<model::Landmark> landmark =
      ctx.map_frame.map != nullptr ? ctx.map_frame.map->find(sighting.landmark) : std::nullopt;
  if (!landmark) return {.verdict = sensor::Verdict::kUnknownLandmark, .landmark = sighting.landmark};
  motion_.propagate(stamp, ctx.parameters);
  give_up_when_lost();
  if (phase_ != Phase::kTracking) return {.verdict = sensor::Verdict::kNotUsed, .landmark = sighting.landmark};
  const bool has_range = base::is_finite(sighting.range_m);
  const bool has_bearing = base::is_finite(sighting.bearing_rad);
  if (has_range && has_bearing) {
    const model::RangeBearing model{.range_m = sighting.range_m,
                                    .bearing_rad = sighting.bearing_rad,
                                    .sigma_range_m = n.sigma_range_m + n.sigma_range_per_m * sighting.range_m,
                                    .sigma_bearing_rad = n.sigma_bearing_rad,
                                    .landmark = *landmark,
                                    .mounting = n.mounting};
    return measure(model, kLandmark, n.gate_scale, stamp, ctx, sighting.landmark);
  }
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
  return {.verdict = sensor::Verdict::kNotFinite, .landmark = sighting.landmark};
}

inline Innovation PoseEkf::fuse(const sensor::GnssPosition& fix, base::Micros stamp, const Context& ctx) {
  const param::GnssParameters& n = ctx.parameters.gnss;
  if (fix.fix < sensor::GnssFix::k2d || ctx.map_frame.origin == sensor::OriginSource::kNone) return {};
  const nav::Local local = ctx.map_frame.frame.to_local(fix.latitude_2ndeg, fix.longitude_2ndeg, fix.height_m);
  if (!local.valid) return {.verdict = sensor::Verdict::kNotFinite};
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
    phase_ = Phase::kTracking;
    last_absolute_ = stamp;
  }
  return {.verdict = sensor::Verdict::kAccepted};
}

}  // namespace tetap::estimators
