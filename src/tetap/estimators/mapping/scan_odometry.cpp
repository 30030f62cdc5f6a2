// SPDX-License-Identifier: Apache-2.0
#include "tetap/estimators/mapping/scan_odometry.hpp"

#include "tetap/base/reinitialise.hpp"
#include "tetap/estimators/mapping/map_pose.hpp"
#include "tetap/estimators/mapping/pose_covariance.hpp"
#include "tetap/estimators/planar/window_motion.hpp"
#include "tetap/estimators/scanner.hpp"

namespace tetap::estimators {

namespace {

/// Motion of the scanner from that of the body: forward speed and yaw rate.
slam::ScanMotion motion_of_scanner(float forward_mps, float yaw_rate_radps, const param::LidarParameters& n) {
  const base::SinCos turn = base::sincos(n.yaw_rad);
  const float x_mps = forward_mps - yaw_rate_radps * n.y_b_m, y_mps = yaw_rate_radps * n.x_b_m;
  return {.forward_mps = turn.cos * x_mps + turn.sin * y_mps,
          .left_mps = turn.cos * y_mps - turn.sin * x_mps,
          .yaw_rate_radps = yaw_rate_radps};
}

/// Covariance of a pose, carried on by a displacement from it.
filter::Symmetric<float, 3> carried(const filter::Symmetric<float, 3>& p, slam::Heading<float> yaw,
                                    const slam::UncertainDisplacement<float>& by) {
  const slam::UncertainDisplacement<float> pose{.mean = {0.0F, 0.0F, yaw}, .covariance = p};
  return compose(pose, by).covariance;
}

}  // namespace

template <int kBeams, int kFrames>
auto ScanOdometry<kBeams, kFrames>::displaced(const Estimate& estimate) -> Step {
  const model::PlanarPose& d = estimate.pose;
  return {.mean = {d.x.minus({}), d.y.minus({}), slam::Heading<float>::from_radians(d.yaw_rad)},
          .covariance = estimate.p};
}

template <int kBeams, int kFrames>
void ScanOdometry<kBeams, kFrames>::restart(base::Micros t, const Context& ctx) {
  base::reinitialise(*this);
  now_ = t;
  motion_.start(t, {}, 0.0F, 0.0F);
  const MapStart start(ctx.parameters.start);
  place(t, start.pose, start.p);
  present_ = motion_;
}

template <int kBeams, int kFrames>
void ScanOdometry<kBeams, kFrames>::place(base::Micros t, const model::PlanarPose& pose,
                                          const filter::Symmetric<float, 3>& p) {
  match_.cancel();
  keyframes_.clear();
  reference_ = graph_pose<float>(pose);
  reference_p_ = p;
  odometry_ = step_ = {};
  motion_.relocate({}, 0.0F, 0.0F);
  digest_.update(t.us, pose.x.um(), pose.y.um(), pose.yaw_rad, p(0, 0), p(2, 2));
}

template <int kBeams, int kFrames>
void ScanOdometry<kBeams, kFrames>::set_pose(base::Micros t, const SetPose& given, const Context& ctx) {
  motion_.propagate(t, ctx.parameters);
  motion_.advance(t);
  model::PlanarPose pose = given.pose;
  if (!(given.sigma_yaw_rad < 3.14F)) {
    present_ = motion_;
    pose.yaw_rad = estimate(ctx).pose.yaw_rad;
  }
  pose.yaw_rad = base::wrap_angle(pose.yaw_rad);
  place(t, pose, covariance_of_pose(given.sigma_position_m, given.sigma_yaw_rad));
  present_ = motion_;
}

template <int kBeams, int kFrames>
void ScanOdometry<kBeams, kFrames>::advance(base::Micros t, const Context& ctx, const sensor::Window& window) {
  now_ = t;
  motion_.advance(t);
  present_ = motion_;
  move_through(window, present_, ctx.parameters);
}

template <int kBeams, int kFrames>
Innovation ScanOdometry<kBeams, kFrames>::fuse(const sensor::PlanarScan& scan, base::Micros stamp,
                                               std::uint8_t instance, const Context& ctx) {
  if (instance != 0) return {};
  motion_.propagate(stamp, ctx.parameters);
  const bool gyro = motion_.gyro_shows(stamp, ctx.parameters);
  scanner_motion_ = motion_of_scanner(motion_.wheels_forward_mps(),
                                      gyro ? motion_.gyro_turn_radps() : motion_.wheels_turn_radps(ctx.parameters),
                                      ctx.parameters.lidar);
  const model::PlanarPose& d = motion_.filter.x;
  const Step since{.mean = {d.x.minus({}), d.y.minus({}), slam::Heading<float>::from_radians(d.yaw_rad)},
                   .covariance = covariance_of(motion_.filter)};
  odometry_ = compose(odometry_, since);
  // The prior's covariance is that of the wheels since the keyframe: an earlier match against it counts once.
  step_ = {.mean = compose(step_, since).mean, .covariance = odometry_.covariance};
  motion_.relocate({}, 0.0F, 0.0F);
  scan_ = scan;
  record_ = {.stamp = stamp, .sensor = sensor::Sensor::kScan, .instance = instance};
  report_ = {.ended = report_.ended, .sequence = scan.sequence, .instance = instance};
  if (ctx.scans == nullptr || ctx.scans->ranges(scan).empty())
    return {.verdict = sensor::Verdict::kNoRoom, .failed = sensor::Check::kTime};
  if (!match_.begin(scan_geometry(scan, ctx.parameters.lidar), scanner_motion_,
                    as_of(step_, scanner_mounting(ctx.parameters.lidar)))) {
    report_.end = ScanEnd::kNoGeometry;
    report_.ended = now_;
    return {.verdict = sensor::Verdict::kRejected, .failed = sensor::Check::kValue};
  }
  return {.verdict = sensor::Verdict::kPending};
}

template <int kBeams, int kFrames>
void ScanOdometry<kBeams, kFrames>::work(std::uint32_t units, const Context& ctx) {
  if (!match_.busy()) return;
  const auto ranges = ctx.scans->ranges(scan_);
  if (match_.reads_ranges() && ranges.empty()) {  // a newer scan has its place
    match_.cancel();
    return record(sensor::Verdict::kNoRoom, sensor::Check::kTime);
  }
  match_.work(static_cast<int>(units), ranges, keyframes_);
  if (!match_.busy()) conclude(ctx);
}

template <int kBeams, int kFrames>
void ScanOdometry<kBeams, kFrames>::abort_job() {
  if (!match_.busy()) return;
  match_.cancel();
  record(sensor::Verdict::kStale, sensor::Check::kNone);
}

template <int kBeams, int kFrames>
void ScanOdometry<kBeams, kFrames>::record(sensor::Verdict verdict, sensor::Check failed) {
  record_.innovation = {.verdict = verdict, .failed = failed};
  recorded_ = true;
}

template <int kBeams, int kFrames>
void ScanOdometry<kBeams, kFrames>::conclude(const Context& ctx) {
  const slam::ScanMatchResult& result = match_.result();
  const auto& p = result.pose.covariance;
  report_match(result, now_, report_);
  if (result.matched()) {
    step_ = as_of(result.pose, inverse(scanner_mounting(ctx.parameters.lidar)));
    matched_ = true;
    last_match_ = record_.stamp;
  }
  const auto& mean = step_.mean;
  digest_.update(record_.stamp.us, static_cast<std::uint32_t>(result.fate), mean.x_m, mean.y_m, mean.yaw.radians(),
                 p(0, 0), p(1, 1), p(2, 2));
  keyframes_.set_options(keyframe_options(ctx.parameters.mapping));
  if (match_.scan().known > 0 && keyframes_.due(result.pose.mean)) make_keyframe(ctx);
  switch (result.fate) {
    case slam::ScanFate::kMatched:
    case slam::ScanFate::kFirst:
      return record(sensor::Verdict::kAccepted, sensor::Check::kNone);
    case slam::ScanFate::kFewPairs:
      return record(sensor::Verdict::kRejected, sensor::Check::kGate);
    case slam::ScanFate::kSingular:
      return record(sensor::Verdict::kSingular, sensor::Check::kValue);
  }
}

template <int kBeams, int kFrames>
void ScanOdometry<kBeams, kFrames>::make_keyframe(const Context& ctx) {
  reference_p_ = carried(reference_p_, reference_.yaw, step_);
  reference_ = reference_.plus(step_.mean);
  keyframe_step_ = step_;
  new_keyframe_ = true;
  odometry_ = step_ = {};
  keyframes_.add(match_.scan(), reference_.plus(scanner_mounting(ctx.parameters.lidar).mean));
}

template <int kBeams, int kFrames>
slam::Displacement<float> ScanOdometry<kBeams, kFrames>::since_keyframe(base::Micros t, const Context& ctx) {
  motion_.propagate(t, ctx.parameters);
  const model::PlanarPose& d = motion_.filter.x;
  const slam::Displacement<float> since{d.x.minus({}), d.y.minus({}), slam::Heading<float>::from_radians(d.yaw_rad)};
  return compose(step_, Step{.mean = since, .covariance = {}}).mean;
}

template <int kBeams, int kFrames>
void ScanOdometry<kBeams, kFrames>::move_keyframe(const Pose& pose, const filter::Symmetric<float, 3>& p) {
  keyframes_.move(reference_, pose);
  reference_ = pose;
  reference_p_ = p;
}

template <int kBeams, int kFrames>
Estimate ScanOdometry<kBeams, kFrames>::estimate(const Context& ctx) const {
  Estimate estimate = present_.estimate(ctx.parameters);
  const Step since = displaced(estimate);
  const Pose scan = reference_.plus(step_.mean);
  estimate.pose = planar_pose(scan.plus(since.mean));
  estimate.p = carried(carried(reference_p_, reference_.yaw, step_), scan.yaw, since);
  estimate.heading_valid = !(estimate.p(2, 2) > 1.0F);
  return estimate;
}

template class ScanOdometry<361, 4>;

}  // namespace tetap::estimators
