// SPDX-License-Identifier: Apache-2.0
#include "tetap/estimators/visual/visual_odometry.hpp"

#include "tetap/base/reinitialise.hpp"
#include "tetap/estimators/mapping/pose_covariance.hpp"
#include "tetap/estimators/planar/window_motion.hpp"
#include "tetap/filter/update.hpp"
#include "tetap/sensor/row_major.hpp"

namespace tetap::estimators {

namespace {

/// The rotation from the body's axes into the camera's, of its inverse as a matrix row by row. The columns of the
/// inverse are where the axes of the camera lie in the body.
nav::Quaternion q_cb(const std::array<float, 9>& mounting_bc) {
  // Shepperd 1978, of the greatest component: r is the matrix of q_cb, the transpose of mounting_bc.
  const auto r = [&](std::size_t i, std::size_t j) { return mounting_bc[3 * j + i]; };
  const std::array<float, 4> squares{1.0F + r(0, 0) + r(1, 1) + r(2, 2), 1.0F + r(0, 0) - r(1, 1) - r(2, 2),
                                     1.0F - r(0, 0) + r(1, 1) - r(2, 2), 1.0F - r(0, 0) - r(1, 1) + r(2, 2)};
  std::size_t most = 0;
  for (std::size_t i = 1; i < 4; ++i)
    if (squares[i] > squares[most]) most = i;
  const float root = base::sqrt(squares[most]), half = 0.5F * root, s = 0.5F / root;
  nav::Quaternion q;
  switch (most) {
    case 0:
      q = {half, (r(2, 1) - r(1, 2)) * s, (r(0, 2) - r(2, 0)) * s, (r(1, 0) - r(0, 1)) * s};
      break;
    case 1:
      q = {(r(2, 1) - r(1, 2)) * s, half, (r(0, 1) + r(1, 0)) * s, (r(0, 2) + r(2, 0)) * s};
      break;
    case 2:
      q = {(r(0, 2) - r(2, 0)) * s, (r(0, 1) + r(1, 0)) * s, half, (r(1, 2) + r(2, 1)) * s};
      break;
    default:
      q = {(r(1, 0) - r(0, 1)) * s, (r(0, 2) + r(2, 0)) * s, (r(1, 2) + r(2, 1)) * s, half};
      break;
  }
  return q.renormalised();
}

slam::VisualOptions options_of(const param::CameraParameters& n) {
  return {
      .camera = {.fu_px = n.fu_px, .fv_px = n.fv_px, .cu_px = n.cu_px, .cv_px = n.cv_px},
      .mounting = {.q_cb = q_cb(n.mounting_bc), .lever_b_m = {n.position_b_m[0], n.position_b_m[1], n.position_b_m[2]}},
      .sigma_px = n.sigma_px,
      .sigma_mounting_rad = n.sigma_mounting_rad};
}
/// Noise of speed and turn comes with each step of the dead reckoning.
slam::SpeedNoise noise_of(const param::CameraParameters& n) {
  return {.position_walk_m = 0.0F,
          .angle_walk_rad = 0.0F,
          .sigma_scale = n.sigma_scale,
          .sigma_direction_rad = n.sigma_direction_rad,
          .direction_walk_rad = n.direction_walk};
}

constexpr std::uint8_t counted(std::uint8_t n) { return n < 255 ? static_cast<std::uint8_t>(n + 1) : n; }

}  // namespace

template <class Window>
void VisualOdometry<Window>::begin(base::Micros t, const model::PlanarPose& pose, const nav::Euler& tilt,
                                   const nav::Vector3& sigma_rad, float sigma_place_m, bool keep) {
  constexpr float kHeight_m = 0.5e-3F;  // heights are counted from the start
  const nav::Quaternion q_nb = nav::from_euler({pose.yaw_rad, tilt.pitch_rad, tilt.roll_rad});
  const std::array<std::int64_t, 3> origin_um{pose.x.um(), pose.y.um(), window_.origin_um()[2]};
  const nav::Vector3 sigma_m{sigma_place_m, sigma_place_m, kHeight_m};
  if constexpr (kMaps)
    if (keep) window_.move(q_nb, {.attitude_rad = sigma_rad, .place_m = sigma_m}, origin_um);
  if (!kMaps || !keep) window_.start(q_nb, sigma_rad, origin_um, sigma_m);
  motion_.start(t, {}, 0.0F, 0.0F);
  turn_b_rad_ = ahead_b_rad_ = {};
  stepped_ = latest_ = t;
  speed_at_ = {};
  passed_m_ = owed_m_ = 0;
  in_image_ = recognising_ = false;
  features_ = 0;
  present_ = motion_;
}

template <class Window>
void VisualOdometry<Window>::restart(base::Micros t, const Context& ctx) {
  const param::CameraParameters& n = ctx.parameters.camera;
  base::reinitialise(*this);
  base::reinitialise(window_, options_of(n), slam::SpeedCore(noise_of(n)));
  now_ = last_used_ = t;
  const MapStart start(ctx.parameters.start);
  begin(t, start.pose, {}, {n.sigma_tilt_rad, n.sigma_tilt_rad, base::sqrt(start.p(2, 2))}, base::sqrt(start.p(0, 0)),
        false);
}

template <class Window>
void VisualOdometry<Window>::set_pose(base::Micros t, const SetPose& given, const Context& ctx) {
  finish_job();
  step_to(latest_, ctx, true);
  const nav::Euler now = nav::euler(window_.pose().q_nb);
  const filter::Symmetric<float, 6> p = window_.pose_covariance();
  model::PlanarPose pose = given.pose;
  if (!(given.sigma_yaw_rad < 3.14F)) pose.yaw_rad = now.yaw_rad;
  pose.yaw_rad = base::wrap_angle(pose.yaw_rad);
  const filter::Symmetric<float, 3> stated = covariance_of_pose(given.sigma_position_m, given.sigma_yaw_rad);
  begin(t, pose, now, {base::sqrt(p(0, 0)), base::sqrt(p(1, 1)), base::sqrt(stated(2, 2))}, base::sqrt(stated(0, 0)),
        true);
  digest_.update(pose.x.um(), pose.y.um(), pose.yaw_rad, stated(0, 0), stated(2, 2));
}

template <class Window>
void VisualOdometry<Window>::tilt(std::array<float, 2>& turn_b_rad, const sensor::ImuSample& imu, const Context& ctx) {
  const auto& angle = imu.dangle_b_rad;
  const filter::Vector3 turned = sensor::times(ctx.parameters.inertial.mounting_bs, {angle[0], angle[1], angle[2]});
  turn_b_rad[0] += turned(0);
  turn_b_rad[1] += turned(1);
}

template <class Window>
float VisualOdometry<Window>::way_m() const {
  const model::PlanarPose& d = motion_.filter.x;
  const float x_m = d.x.minus({}), y_m = d.y.minus({});
  const float arc_m = base::sqrt(x_m * x_m + y_m * y_m) * (1.0F + d.yaw_rad * d.yaw_rad * (1.0F / 24));
  return x_m < 0.0F ? -arc_m : arc_m;
}

template <class Window>
void VisualOdometry<Window>::settle_speed(base::Micros stamp, const Context& ctx) {
  const param::WheelParameters& n = ctx.parameters.wheels;
  const base::Micros span = stamp - speed_at_;
  if (n.hold == param::Hold::kBackward && speed_at_.us != 0 && span <= base::Micros{n.timeout_us})
    owed_m_ += motion_.wheels_forward_mps() * base::seconds(span) - (passed_m_ + way_m());
  passed_m_ = -way_m();
  speed_at_ = stamp;
}

template <class Window>
void VisualOdometry<Window>::step_to(base::Micros t, const Context& ctx, bool whole) {
  const base::Micros span = t - stepped_;
  if (span.us <= 0 || (!whole && span < kLeastStep)) return;
  finish_job();
  motion_.propagate(t, ctx.parameters);
  const model::PlanarPose& d = motion_.filter.x;
  const filter::Symmetric<float, 3>& p = covariance_of(motion_.filter);
  const float yaw_rad = d.yaw_rad, dt_s = base::seconds(span), per_s = 1.0F / dt_s;
  const float reckoned_m = way_m(), way_m = reckoned_m + owed_m_;
  passed_m_ += reckoned_m;
  owed_m_ = 0;
  // A step that no number describes is one of a broken state: the node finds it in the estimate.
  static_cast<void>(window_.predict({.speed_b_mps = {way_m * per_s, 0.0F, 0.0F},
                                     .rate_b_radps = nav::Vector3{turn_b_rad_[0], turn_b_rad_[1], yaw_rad} * per_s,
                                     .dt_s = dt_s,
                                     .var_way_m2 = p(0, 0),
                                     .var_turn_rad2 = p(2, 2)}));
  motion_.filter.x = {};
  motion_.filter.p = {};
  turn_b_rad_ = {};
  stepped_ = t;
}

template <class Window>
void VisualOdometry<Window>::take_features(const sensor::CameraImage& image, base::Micros stamp, const Context& ctx) {
  finish_job();
  step_to(stamp, ctx, true);
  latest_ = job_stamp_ = stamp;
  features_ = 0;
  for (const model::ImageFeature& feature : ctx.images.features(image.place)) image_[features_++] = feature;
  told_ = 0;
}

template <class Window>
Innovation VisualOdometry<Window>::fuse(const sensor::CameraImage& image, base::Micros stamp, std::uint8_t instance,
                                        const Context& ctx) {
  const bool recognised = kMaps && instance == sensor::CameraImage::kRecogniser;
  if (ctx.images.images == nullptr || !ctx.parameters.camera.any() || (instance != 0 && !recognised)) return {};
  take_features(image, stamp, ctx);
  if constexpr (kMaps)
    if (recognised && !window_.begin_recognised({image_.data(), features_}, stamp.us)) return {};
  if (!recognised) {
    if (!window_.begin_image({image_.data(), features_})) return {};
    job_number_ = image.number;
    report_ = {.number = image.number};
  }
  in_image_ = true;
  recognising_ = recognised;
  const bool judged = window_.busy();
  conclude();
  return {.verdict = judged ? sensor::Verdict::kPending : sensor::Verdict::kNotUsed};
}

template <class Window>
void VisualOdometry<Window>::work(std::uint32_t units, const Context&) {
  if (!window_.busy()) return;
  window_.work(static_cast<int>(units));
  conclude();
}

template <class Window>
void VisualOdometry<Window>::finish_job() {
  constexpr int kAtOnce = 1'000'000;  // more than the tracks of an image are worth
  if (window_.busy()) window_.work(kAtOnce);
  conclude();
}

/// The next one whose fate is known and untold.
template <class Window>
const slam::TrackRecord* VisualOdometry<Window>::next_record() const {
  const auto i = static_cast<std::size_t>(told_);
  if constexpr (kMaps)
    if (recognising_) return told_ < window_.map_concluded() ? &window_.map_records()[i] : nullptr;
  return told_ < window_.concluded() ? &window_.records()[i] : nullptr;
}

template <class Window>
void VisualOdometry<Window>::tell(const slam::TrackRecord& track) {
  Innovation innovation{.verdict = sensor::Verdict::kNotUsed};
  VisualReport unseen;
  VisualReport& report = recognising_ ? unseen : report_;
  switch (track.fate) {
    case slam::TrackFate::kUsed:
    case slam::TrackFate::kKept:
    case slam::TrackFate::kNoRoom:
      innovation.verdict = track.fate == slam::TrackFate::kKept     ? sensor::Verdict::kNewLandmark
                           : track.fate == slam::TrackFate::kNoRoom ? sensor::Verdict::kNoRoom
                                                                    : sensor::Verdict::kAccepted;
      report.used = counted(report.used);
      last_used_ = job_stamp_;
      break;
    case slam::TrackFate::kGated:
      innovation.verdict = sensor::Verdict::kOutlier;
      innovation.failed = sensor::Check::kGate;
      report.gated = counted(report.gated);
      break;
    case slam::TrackFate::kAlone:
      innovation.verdict = sensor::Verdict::kAmbiguous;
      break;
    case slam::TrackFate::kSingular:
      innovation.verdict = sensor::Verdict::kSingular;
      innovation.failed = sensor::Check::kValue;
      break;
    case slam::TrackFate::kNoDepth:
      report.no_depth = counted(report.no_depth);
      break;
    case slam::TrackFate::kPending:
      break;
  }
  if (track.nis >= 0.0F) {
    innovation.dof = track.degrees;
    innovation.nis = track.nis;
    innovation.gate = track.sightings == 1 ? filter::chi_square_99(2) : slam::track_gate(track.sightings);
    report.nis = track.nis / static_cast<float>(track.degrees);
  }
  if (recognising_) innovation.landmark = landmark_of(track.id);
  digest_.update(static_cast<std::uint32_t>(track.id) << 16 | static_cast<std::uint32_t>(track.fate), track.nis);
  if (innovation.verdict == sensor::Verdict::kNotUsed || records_ == record_.size()) return;
  record_[records_++] = {.stamp = job_stamp_,
                         .sensor = sensor::Sensor::kFeature,
                         .instance = recognising_ ? sensor::CameraImage::kRecogniser : std::uint8_t{0},
                         .innovation = innovation};
}

template <class Window>
void VisualOdometry<Window>::conclude() {
  if (!in_image_) return;
  for (const slam::TrackRecord* track = next_record(); track != nullptr; track = next_record()) {
    tell(*track);
    ++told_;
  }
  if (!window_.busy()) end_image();
}

template <class Window>
void VisualOdometry<Window>::end_image() {
  in_image_ = false;
  if constexpr (kMaps) {
    if (recognising_) {
      static_cast<void>(window_.end_recognised({image_.data(), features_}));
      const std::uint32_t refused = window_.map_counters().no_room;
      if (refused != refused_) last_refused_ = now_;
      refused_ = refused;
    }
  }
  if (!recognising_) {
    static_cast<void>(window_.end_image({image_.data(), features_}));
    const std::uint32_t left = window_.tracks().counters().left;
    report_.left = left - left_before_;
    left_before_ = left;
    report_.direction_y_rad = window_.core().direction_y_rad();
    report_.direction_z_rad = window_.core().direction_z_rad();
    ended_ = true;
  }
  const slam::WorldPose& pose = window_.pose();
  digest_.update(static_cast<std::uint32_t>(features_), pose.p_n_m(0), pose.p_n_m(1), pose.p_n_m(2), pose.q_nb.w,
                 pose.q_nb.x, pose.q_nb.y, pose.q_nb.z);
}

template <class Window>
void VisualOdometry<Window>::advance(base::Micros t, const Context& ctx, const sensor::Window& window) {
  now_ = t;
  shown_ = ended_;
  ended_ = false;
  motion_.advance(t);
  present_ = motion_;
  move_through(window, present_, ctx.parameters);
  ahead_b_rad_ = turn_b_rad_;
  for (std::size_t i = 0; i < window.size(); ++i)
    if (is_imu(window[i], ctx.parameters.inertial.imu)) tilt(ahead_b_rad_, window[i].payload.imu, ctx);
  digest_.scan(window_.words(), kScanned, [this](std::size_t i, auto& sink) { window_.hash_word(i, sink); });
}

/// The way since the last step, along the speed's direction in the body.
template <class Window>
nav::Vector3 VisualOdometry<Window>::ahead_n_m(const Estimate& ahead) const {
  const float x_m = ahead.pose.x.minus({}) + owed_m_, y_m = ahead.pose.y.minus({});
  const float aside = window_.core().direction_y_rad(), up = window_.core().direction_z_rad();
  return window_.pose().q_nb.rotate({x_m - aside * y_m, y_m + aside * x_m, up * x_m});
}

template <class Window>
Estimate VisualOdometry<Window>::estimate(const Context& ctx) const {
  Estimate estimate = ahead(ctx);
  const nav::Vector3 way = ahead_n_m(estimate);
  const slam::WorldPose& pose = window_.pose();
  const nav::Euler euler = nav::euler(pose.q_nb);
  const float yaw_rad = euler.yaw_rad;
  const auto& origin = window_.origin_um();
  const float turn_rad = estimate.pose.yaw_rad;
  estimate.pose = {.x = base::Anchored::from_um(origin[0]).plus(pose.p_n_m(0)).plus(way(0)),
                   .y = base::Anchored::from_um(origin[1]).plus(pose.p_n_m(1)).plus(way(1)),
                   .yaw_rad = base::wrap_angle(yaw_rad + turn_rad)};
  // x, y and yaw of the far end, then the way: d(x, y) = (x, y) + (-way_y, way_x) yaw + R way's own.
  const filter::Symmetric<float, 6> far = window_.pose_covariance();
  const filter::Symmetric<float, 3> own = estimate.p;
  const float c = base::cos(yaw_rad), s = base::sin(yaw_rad);
  constexpr int kYaw = 2, kX = 3, kY = 4;
  const float yy = far(kYaw, kYaw), lx = -way(1), ly = way(0);
  filter::Symmetric<float, 3> p;
  p(0, 0) = far(kX, kX) + 2.0F * lx * far(kX, kYaw) + lx * lx * yy + c * c * own(0, 0) - 2.0F * c * s * own(0, 1) +
            s * s * own(1, 1);
  p(1, 1) = far(kY, kY) + 2.0F * ly * far(kY, kYaw) + ly * ly * yy + s * s * own(0, 0) + 2.0F * c * s * own(0, 1) +
            c * c * own(1, 1);
  p(0, 1) = far(kX, kY) + ly * far(kX, kYaw) + lx * far(kY, kYaw) + lx * ly * yy + c * s * (own(0, 0) - own(1, 1)) +
            (c * c - s * s) * own(0, 1);
  p(0, 2) = far(kX, kYaw) + lx * yy + c * own(0, 2) - s * own(1, 2);
  p(1, 2) = far(kY, kYaw) + ly * yy + s * own(0, 2) + c * own(1, 2);
  p(2, 2) = yy + own(2, 2);
  estimate.p = p;
  estimate.heading_valid = !(p(2, 2) > 1.0F);
  return estimate;
}

template <class Window>
AttitudeEstimate VisualOdometry<Window>::attitude(const Context& ctx) const {
  const nav::Quaternion q =
      (window_.pose().q_nb * nav::exp_quaternion({ahead_b_rad_[0], ahead_b_rad_[1], ahead(ctx).pose.yaw_rad}))
          .renormalised();
  return {.q_nb = {q.w, q.x, q.y, q.z}, .valid = true, .heading_valid = true};
}

template <class Window>
Height VisualOdometry<Window>::height(const Context& ctx) const {
  const filter::Symmetric<float, 6> p = window_.pose_covariance();
  const float z_m = base::metres(window_.origin_um()[2]) + window_.pose().p_n_m(2);
  return {.height_m = z_m + ahead_n_m(ahead(ctx))(2), .sigma_m = base::sqrt(p(5, 5))};
}

template class VisualOdometry<slam::VisualWindow<slam::SpeedCore, 6, 40>>;   // VisualOdometry6
template class VisualOdometry<slam::VisualWindow<slam::SpeedCore, 4, 20>>;   // VisualOdometry4
template class VisualOdometry<slam::VisualMap<slam::SpeedCore, 6, 40, 64>>;  // VisualSlam64

}  // namespace tetap::estimators
