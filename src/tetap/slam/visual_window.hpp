// SPDX-License-Identifier: Apache-2.0
// A camera beside a dead reckoning in fixed memory: the poses of the latest images stay in the state, each in a slot of
// its own, and a track that ends is a measurement of all the poses it was seen from
// (docs/explanation/visual_window.md). A core moves the present pose. Images are paced jobs.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/slam/point_map.hpp"
#include "tetap/slam/track_update.hpp"
#include "tetap/slam/tracks.hpp"

#include <span>

namespace tetap::slam {

struct VisualOptions {
  model::PinholeCamera camera;
  model::CameraMounting mounting;
  float sigma_px = 1.2F;              ///< a feature's noise, per axis; errors of a track are alike from image to image
  float sigma_mounting_rad = 0.003F;  ///< camera's rotation, per axis
  float far_m = 32.0F;                ///< the origin follows when the robot is farther from it
  int least_sightings = 4;            ///< tracks with fewer are not used

  [[nodiscard]] bool valid() const {
    return camera.valid() && nav::is_finite(mounting.lever_b_m) && sigma_px > 0.0F && sigma_px < 100.0F &&
           sigma_mounting_rad >= 0.0F && sigma_mounting_rad < 1.0F && far_m >= 2.0F && far_m < 1000.0F &&
           least_sightings >= 3;
  }
};

struct VisualCounters {
  std::uint32_t images = 0, used = 0, gated = 0, no_depth = 0, singular = 0;
  std::uint32_t refused = 0;  ///< motions and images while a job runs, and motions that are no numbers
  std::uint32_t origin_moves = 0;
};

/// Core: SpeedCore or its like. State: the camera's rotation, the core, six errors of each clone, then three of each
/// point of the map, where there is one (VisualMap).
template <class Core_, int kClones_, int kTracks_, int kPoints_ = 0>
class VisualWindow {
 public:
  using Core = Core_;
  using Motion = typename Core::Motion;
  static constexpr int kClones = kClones_, kTracks = kTracks_;
  static constexpr int kCamera = 0, kCore = 3, kFirstClone = kCore + Core::kErrors;
  static constexpr int kFirstPoint = kFirstClone + WorldPose::kErrors * kClones, kPoints = kPoints_;
  static constexpr int kStates = kFirstPoint + 3 * kPoints;
  using Update = TrackUpdate<kStates, kClones>;
  using Covariance = typename Update::Covariance;
  using Tracks = TrackStore<kClones, kTracks>;
  using Records = std::array<TrackRecord, Tracks::kUsed>;

  explicit VisualWindow(const VisualOptions& options = {}, const Core& core = Core())
      : options_(options), camera_(options.mounting), core_(core), tracks_(options.least_sightings) {}

  /// A pose with independent errors of attitude and place. The origin of p_n_m becomes `origin_um`, where the robot is.
  void start(const nav::Quaternion& q_nb, float sigma_attitude_rad, const std::array<std::int64_t, 3>& origin_um,
             float sigma_place_m) {
    start(q_nb, nav::Vector3::Constant(sigma_attitude_rad), origin_um, nav::Vector3::Constant(sigma_place_m));
  }
  /// The same with sigmas along the world's axes.
  void start(const nav::Quaternion& q_nb, const nav::Vector3& sigma_attitude_rad,
             const std::array<std::int64_t, 3>& origin_um, const nav::Vector3& sigma_place_m) {
    typename Covariance::States variance{};
    for (int i = 0; i < 3; ++i) {
      variance[at(kCamera + i)] = options_.sigma_mounting_rad * options_.sigma_mounting_rad;
      variance[at(kCore + i)] = sigma_attitude_rad(i) * sigma_attitude_rad(i);
      variance[at(kCore + 3 + i)] = sigma_place_m(i) * sigma_place_m(i);
    }
    core_.start(q_nb);
    for (int i = WorldPose::kErrors; i < Core::kErrors; ++i) variance[at(kCore + i)] = core_.variance(i);
    p_.begin(variance, kFirstPoint);
    map_.clear();
    camera_ = options_.mounting;
    origin_um_ = origin_um;
    forget_images();
  }

  /// One interval of the core. False, and nothing changes, while an image's job runs or when something is no number.
  [[nodiscard]] bool predict(const Motion& motion) {
    if (job_ != kIdle || !Core::valid(motion)) return ++count_.refused, false;
    core_.predict(motion, p_, kCore);
    moved_ = true;
    return true;
  }

  /// Begins an image at the present pose; its features get sorted. They are asked for again at its end.
  [[nodiscard]] bool begin_image(std::span<ImageFeature> image) {
    if (job_ != kIdle) return ++count_.refused, false;
    tracks_.begin(image);
    records_ = {};
    job_ = 0;
    next_track();
    return true;
  }
  /// Work is left before the image can end.
  [[nodiscard]] bool busy() const { return job_ != kIdle && job_ < tracks_.chosen_count(); }
  /// Up to so many units of the job, a unit being about ten floating-point operations. An operation that is begun is
  /// ended, and the excess is taken from the next call. The result is the same however the units are dealt.
  void work(int units) {
    credit_ += units;
    while (credit_ > 0 && busy()) {
      credit_ -= update_.step(p_, camera_, options_.sigma_px / options_.camera.fu_px, considered());
      if (!update_.busy()) conclude();
    }
    if (!busy()) credit_ = 0;
  }
  /// Leaves the rest of the job undone: its tracks are lost, and the image can end.
  void give_up() {
    if (busy()) job_ = tracks_.chosen_count();
    credit_ = 0;
  }
  /// Ends the image: the present pose is cloned, and its features join their tracks. False while work is left.
  [[nodiscard]] bool end_image(std::span<const ImageFeature> image) {
    if (job_ == kIdle || busy()) return ++count_.refused, false;
    follow();
    clone();
    tracks_.end(image, slot_);
    slot_ = (slot_ + 1) % kClones;
    ++count_.images;
    job_ = kIdle;
    return true;
  }

  [[nodiscard]] const WorldPose& pose() const { return core_.pose(); }
  [[nodiscard]] const std::array<std::int64_t, 3>& origin_um() const { return origin_um_; }
  [[nodiscard]] const Core& core() const { return core_; }
  [[nodiscard]] const model::CameraMounting& mounting() const { return camera_; }
  [[nodiscard]] const Covariance& covariance() const { return p_; }
  [[nodiscard]] const VisualCounters& counters() const { return count_; }
  [[nodiscard]] const Tracks& tracks() const { return tracks_; }
  [[nodiscard]] const Records& records() const { return records_; }  ///< tracks of the latest image
  [[nodiscard]] int concluded() const {
    return job_ == kIdle ? tracks_.chosen_count() : job_;
  }  ///< how many have a fate
  /// Covariance of (theta, error of the place): with the error rho + theta x p of the place.
  [[nodiscard]] filter::Symmetric<float, 6> pose_covariance() const {
    filter::Symmetric<float, 6> out;
    const nav::Matrix3 lever = -nav::skew(pose().p_n_m);
    filter::Matrix<float, 6, 6> t = filter::Matrix<float, 6, 6>::Identity(), p;
    t.bottomLeftCorner<3, 3>() = lever;
    for (int r = 0; r < 6; ++r)
      for (int c = 0; c < 6; ++c) p(r, c) = p_(kCore + r, kCore + c);
    const filter::Matrix<float, 6, 6> tp = t.lazyProduct(p);
    for (int c = 0; c < 6; ++c)
      for (int r = 0; r <= c; ++r) out(r, c) = tp.row(r).dot(t.row(c));
    return out;
  }
  /// The origin moves by whole metres, and every error with it: rho -= a x theta. No pose loses a digit.
  void move_origin(const std::array<std::int32_t, 3>& by_m) {
    const nav::Vector3 a{static_cast<float>(by_m[0]), static_cast<float>(by_m[1]), static_cast<float>(by_m[2])};
    for (std::size_t i = 0; i < 3; ++i) origin_um_[i] += std::int64_t{by_m[i]} * 1'000'000;
    core_.shift(-a);
    map_.shift(-a);
    lever_rho(kCore, a);
    for (int s = 0; s < live_; ++s) {
      clone_[at(s)].p_n_m -= a;
      lever_rho(state_of(s), a);
    }
    ++count_.origin_moves;
  }
  /// Words of memory that a digest reads in turn.
  [[nodiscard]] std::size_t words() const { return p_.words(); }
  template <class Sink>
  void hash_word(std::size_t i, Sink&& sink) const {
    sink(base::bits(p_.word(i)));
  }
  /// The options are parameters, the update begins anew with each track, and nothing follows from the counts.
  static constexpr auto members(auto& self) {
    return base::members(base::unhashed(self.options_), self.camera_, self.core_, self.p_, self.clone_, self.tracks_,
                         base::unhashed(self.update_), self.origin_um_, self.records_, base::unhashed(self.count_),
                         self.live_, self.slot_, self.job_, self.credit_, self.moved_, self.map_);
  }

 protected:
  static constexpr std::int32_t kIdle = -1;
  static constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }
  static constexpr int state_of(int slot) { return kFirstClone + WorldPose::kErrors * slot; }
  static constexpr int considered() { return Core::kConsidered < 0 ? -1 : kCore + Core::kConsidered; }

  void forget_images() {
    clone_ = {};
    live_ = 0;
    slot_ = 0;
    tracks_.clear();
    job_ = kIdle;
    moved_ = true;
  }
  void next_track() {
    if (busy()) begin_track(tracks_.chosen(job_));
  }
  template <class Track>
  void begin_track(const Track& track, bool keep = false) {
    update_.begin(track.id, keep);
    for (int k = 0; k < track.count; ++k) {
      const int slot = track.slot(k);
      const auto& pixel = track.seen[at(slot)];
      update_.add(
          {.pose = clone_[at(slot)], .seen = options_.camera.direction(pixel[0], pixel[1]), .state = state_of(slot)});
    }
  }
  void conclude() {
    const TrackRecord& record = update_.record();
    records_[at(job_)] = record;
    count(record);
    if (record.fate == TrackFate::kUsed) correct(update_.dx().data());
    ++job_;
    next_track();
  }
  void count(const TrackRecord& record) {
    count_.used += record.fate == TrackFate::kUsed ? 1U : 0U;
    count_.gated += record.fate == TrackFate::kGated ? 1U : 0U;
    count_.no_depth += record.fate == TrackFate::kNoDepth ? 1U : 0U;
    count_.singular += record.fate == TrackFate::kSingular ? 1U : 0U;
  }
  void correct(const float* dx) {
    camera_.q_cb = (nav::exp_quaternion({dx[kCamera], dx[kCamera + 1], dx[kCamera + 2]}) * camera_.q_cb).renormalised();
    core_.correct(dx + kCore);
    for (int s = 0; s < live_; ++s) clone_[at(s)].correct(dx + state_of(s));
    map_.correct(dx + kFirstPoint);
  }
  void clone() {
    clone_[at(slot_)] = pose();
    p_.copy(kCore, state_of(slot_), WorldPose::kErrors);
    if (live_ <= slot_) live_ = slot_ + 1;
    moved_ = false;
  }
  void follow() {
    const nav::Vector3& p = pose().p_n_m;
    const float square = p(0) * p(0) + p(1) * p(1) + p(2) * p(2);
    if (!(square > options_.far_m * options_.far_m) || !(square < 1e12F)) return;
    move_origin({static_cast<std::int32_t>(p(0)), static_cast<std::int32_t>(p(1)), static_cast<std::int32_t>(p(2))});
  }
  void lever_rho(int pose_state, const nav::Vector3& a) {
    for (int i = 0; i < 3; ++i) {  // rho_i -= a_j theta_k - a_k theta_j
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      p_.add_share(pose_state + 3 + i, -a(j), pose_state + k);
      p_.add_share(pose_state + 3 + i, a(k), pose_state + j);
    }
  }

  VisualOptions options_;
  model::CameraMounting camera_;
  Core core_;
  Covariance p_;
  std::array<WorldPose, kClones> clone_{};
  Tracks tracks_;
  Update update_;
  std::array<std::int64_t, 3> origin_um_{};
  Records records_{};
  VisualCounters count_;
  std::int32_t live_ = 0, slot_ = 0, job_ = kIdle, credit_ = 0;
  bool moved_ = true;  ///< the pose moved since the latest clone
  [[no_unique_address]] PointMap<kPoints> map_;
};

}  // namespace tetap::slam
