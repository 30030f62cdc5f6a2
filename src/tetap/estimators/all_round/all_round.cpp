// SPDX-License-Identifier: Apache-2.0
#include "tetap/estimators/all_round/all_round.hpp"

#include "tetap/estimators/scanner.hpp"

namespace tetap::estimators {

void AllRound::restart(base::Micros t, const Context& ctx) {
  Inertial::restart(t, ctx);
  match_.cancel();
  keyframes_.clear();
  report_ = {};
  recorded_ = false;
  now_ = t;
  keyframe_at_ = wheels_at_ = contradicted_at_ = {};
  wheels_turn_rad_ = scan_turn_rad_ = 0;
  digest_.restart();
}

/// Motion of the scanner, in its own axes.
slam::ScanMotion AllRound::scanner_motion(const param::LidarParameters& n) const {
  const nav::Vector3 v_b = ins_.x.q_nb.conjugate().rotate(ins_.x.v_n_mps);
  const float turn_radps = imu_.end_rate_b_radps()(2) - ins_.x.b_g_radps(2);
  const base::SinCos mount = base::sincos(n.yaw_rad);
  const float x_mps = v_b(0) - turn_radps * n.y_b_m, y_mps = v_b(1) + turn_radps * n.x_b_m;
  return {.forward_mps = mount.cos * x_mps + mount.sin * y_mps,
          .left_mps = mount.cos * y_mps - mount.sin * x_mps,
          .yaw_rate_radps = turn_radps};
}

void AllRound::note_wheels(base::Micros stamp) {
  constexpr base::Micros kLongest{200'000};
  const base::Micros since = stamp - wheels_at_;
  if (since.us > 0 && since <= kLongest) wheels_turn_rad_ += sources_.wheels.turn_radps() * base::seconds(since);
  wheels_at_ = stamp;
}

bool AllRound::gyroscope_lies(const slam::ScanMatchResult& result) const {
  const slam::Heading<float> by_filter = watch_.bank().displacement().mean.yaw;
  const float off_rad = base::abs((result.pose.mean.yaw - by_filter).radians());
  const float wheels_off_rad = base::abs(base::wrap_angle(scan_turn_rad_ - by_filter.radians()));
  return 3 * result.pairs > match_.scan().known && 3.0F * wheels_off_rad > off_rad;
}

SourceStates AllRound::sources(const Context& ctx) const {
  constexpr base::Micros kLasts{10'000'000};
  SourceStates states = Inertial::sources(ctx);
  if (contradicted_at_.us != 0 && time_ - contradicted_at_ < kLasts)
    states.set(sensor::Sensor::kImu, {SourceState::kDistrusted, Check::kDrift});
  return states;
}

bool AllRound::keyframe_due(const slam::Displacement<float>& d, base::Micros stamp, float times,
                            const Context& ctx) const {
  const param::MappingParameters& m = ctx.parameters.mapping;
  const bool late =
      m.keyframe_time_ms > 0 && stamp - keyframe_at_ >= base::Micros{std::int64_t{1'000} * m.keyframe_time_ms};
  slam::ScanKeyframeOptions far = keyframe_options(m);
  far.distance_m *= times;
  far.turn_rad *= times;
  return slam::beyond(d, far) || (late && times <= 1.0F);
}

Innovation AllRound::fuse(const sensor::PlanarScan& scan, base::Micros stamp, std::uint8_t instance,
                          const Context& ctx) {
  constexpr float kFarthest_m2 = 1e3F;  // above, the float has too few digits left for a displacement
  constexpr int kX = nav::InsState::kPosition;
  if (instance != 0 || !tracking()) return {};
  predict_covariance();
  if (!(ins_.p(kX, kX) + ins_.p(kX + 1, kX + 1) < kFarthest_m2)) {
    watch_.begin();
    return {.failed = sensor::Check::kUnconfirmed};
  }
  ScanClones& clones = watch_.bank();
  scan_turn_rad_ = wheels_turn_rad_;
  const slam::ScanMotion motion = scanner_motion(ctx.parameters.lidar);
  clones.take_scan(ins_, base::seconds(stamp - time_), motion.yaw_rate_radps,
                   scanner_mounting(ctx.parameters.lidar).mean);
  prior_ = {.mean = {}, .covariance = filter::Symmetric<float, 3>::diagonal({1, 1, 1})};
  if (clones.has_keyframe()) {
    prior_ = clones.displacement();
    if (!keyframe_due(prior_.mean, stamp, 1, ctx)) return {};
  } else {
    keyframes_.clear();
  }
  record_ = {.stamp = stamp, .sensor = sensor::Sensor::kScan, .instance = instance};
  report_ = {.ended = report_.ended, .sequence = scan.sequence, .instance = instance};
  scan_ = scan;
  if (ctx.scans == nullptr || ctx.scans->ranges(scan).empty())
    return {.verdict = sensor::Verdict::kNoRoom, .failed = sensor::Check::kTime};
  if (!match_.begin(scan_geometry(scan, ctx.parameters.lidar), motion, prior_)) {
    report_.end = ScanEnd::kNoGeometry;
    report_.ended = now_;
    return {.verdict = sensor::Verdict::kRejected, .failed = sensor::Check::kValue};
  }
  return {.verdict = sensor::Verdict::kPending};
}

void AllRound::work(std::uint32_t units, const Context& ctx) {
  if (!match_.busy()) return;
  const auto ranges = ctx.scans->ranges(scan_);
  if (match_.reads_ranges() && ranges.empty()) {  // a newer scan has its place
    match_.cancel();
    return record({.verdict = sensor::Verdict::kNoRoom, .failed = sensor::Check::kTime});
  }
  match_.work(static_cast<int>(units), ranges, keyframes_);
  if (!match_.busy()) conclude(ctx);
}

void AllRound::abort_job() {
  if (!match_.busy()) return;
  match_.cancel();
  record({.verdict = sensor::Verdict::kStale});
}

void AllRound::make_keyframe() {
  keyframes_.clear();
  keyframes_.add(match_.scan(), {});
  watch_.bank().keep_scan();
  keyframe_at_ = record_.stamp;
  wheels_turn_rad_ -= scan_turn_rad_;
}

void AllRound::conclude(const Context& ctx) {
  const slam::ScanMatchResult& result = match_.result();
  const auto& p = result.pose.covariance;
  report_match(result, now_, report_);
  const auto& mean = result.pose.mean;
  digest_.update(record_.stamp.us, static_cast<std::uint32_t>(result.fate), mean.x_m, mean.y_m, mean.yaw.radians(),
                 p(0, 0), p(1, 1), p(2, 2));
  ScanClones& clones = watch_.bank();
  if (!clones.has_scan()) return record({.verdict = sensor::Verdict::kStale});  // the filter began anew meanwhile
  const bool shows = match_.scan().known > 0;
  switch (result.fate) {
    case slam::ScanFate::kFirst:
      if (shows) make_keyframe();
      return record({.verdict = sensor::Verdict::kAccepted});
    case slam::ScanFate::kMatched: {
      predict_covariance();
      const DisplacementLikelihood z = DisplacementLikelihood::between(prior_, result.pose);
      Innovation fused = clones.fuse(ins_, z, kGateScale);
      if (fused.verdict == sensor::Verdict::kRejected && gyroscope_lies(result)) {
        const float off_rad = (result.pose.mean.yaw - clones.displacement().mean.yaw).radians();
        clones.widen_turn(ins_, off_rad, base::seconds(record_.stamp - keyframe_at_));
        if (sources_.wheels.slip() == Wheels::Slip::kNone) contradicted_at_ = record_.stamp;
        fused = clones.fuse(ins_, z, kGateScale);
      }
      if (fused.verdict == sensor::Verdict::kAccepted) {
        budget_.spend(WorkBudget::kConditioning);
        predictor_.note_correction();
      }
      make_keyframe();
      return record(fused);
    }
    case slam::ScanFate::kFewPairs:
    case slam::ScanFate::kSingular:
      // The next scan is tried with the same keyframe, unless that is too far by now.
      if (shows && keyframe_due(prior_.mean, record_.stamp, 2, ctx)) make_keyframe();
      const bool few = result.fate == slam::ScanFate::kFewPairs;
      return record({.verdict = few ? sensor::Verdict::kRejected : sensor::Verdict::kSingular,
                     .failed = few ? sensor::Check::kGate : sensor::Check::kValue});
  }
}

}  // namespace tetap::estimators
