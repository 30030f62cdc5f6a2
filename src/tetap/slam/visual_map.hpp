// SPDX-License-Identifier: Apache-2.0
// Visual SLAM in fixed memory: a visual window whose recognised points join the state and stay in it. The covariance is
// the whole joint one, so no point is perfect and none is counted twice (docs/explanation/visual_window.md).
//
// A recogniser sends an image of its own beside the camera's: features whose identities are those of points that look
// the same when they are seen again. An identity that the map has is a sighting. One that it does not have is followed
// as a track; when the track is used and its depth is known well, its point joins the map.
#pragma once

#include "tetap/slam/map_move.hpp"
#include "tetap/slam/map_sightings.hpp"
#include "tetap/slam/visual_window.hpp"

namespace tetap::slam {

struct MapCounters {
  std::uint32_t sightings = 0;  ///< sightings that moved the state
  std::uint32_t gated = 0;      ///< beyond the gate, or against the others of their image
  std::uint32_t alone = 0;      ///< not borne out by another one
  std::uint32_t left = 0;       ///< beyond those that are used of an image
  std::uint32_t no_room = 0;    ///< points that found the map full
  std::uint32_t forgotten = 0;  ///< points whose sightings were gated again and again
};

/// kNew: tracks that may become points, at a time.
template <class Core_, int kClones_, int kTracks_, int kPoints_, int kNew_ = 24>
class VisualMap : public VisualWindow<Core_, kClones_, kTracks_, kPoints_> {
  using Window = VisualWindow<Core_, kClones_, kTracks_, kPoints_>;
  using Window::at, Window::camera_, Window::clone_, Window::credit_, Window::job_, Window::kIdle, Window::map_,
      Window::moved_, Window::options_, Window::origin_um_, Window::p_, Window::core_, Window::slot_, Window::update_;

 public:
  using Window::kFirstPoint, Window::kStates, Window::kClones;
  static constexpr int kMostSightings = 8;  ///< sightings of an image that are used, at most
  using Sightings = MapSightings<kStates, kFirstPoint, kMostSightings>;
  /// The camera's image has taken the oldest slot when what was recognised in it is looked at.
  using NewTracks = TrackStore<kClones_, kNew_, kClones_ - 1>;
  using MapRecords = std::array<TrackRecord, kMostSightings + NewTracks::kUsed>;

  explicit VisualMap(const VisualOptions& options = {}, const Core_& core = Core_())
      : Window(options, core), new_(options.least_sightings) {}

  template <class... Pose>
  void start(const Pose&... pose) {
    Window::start(pose...);
    new_.clear();
    recognised_ = fresh_ = false;
  }
  /// The robot is put elsewhere, and the map with it. Earlier images are forgotten. The origin of p_n_m becomes
  /// `origin_um`, where the robot is.
  void move(const nav::Quaternion& q_nb, const PoseSigmas& sigmas, const std::array<std::int64_t, 3>& origin_um) {
    give_up();
    const WorldPose to{.q_nb = q_nb};
    move_map(p_, map_, Window::kCore, Window::kFirstClone, kFirstPoint, this->pose(), to, sigmas);
    core_.place(to);
    origin_um_ = origin_um;
    this->forget_images();
    new_.clear();
    recognised_ = fresh_ = false;
  }
  /// Forgets the points. The poses keep what they have learnt from them: their states are marginalised.
  void reset_map() {
    give_up();
    if (recognised_) static_cast<void>(end_recognised({}));
    if (map_.size() > 0) p_.remove(kFirstPoint, 3 * map_.size());
    map_.clear();
    new_.clear();
  }

  /// Begins what was recognised in the image whose pose is the present one; the features get sorted. Those of mapped
  /// points are judged together, the others are followed. They are asked for again at the end.
  [[nodiscard]] bool begin_recognised(std::span<ImageFeature> image, std::int64_t stamp_us = 0) {
    if (job_ != kIdle) return ++this->count_.refused, false;
    new_.begin(image);
    map_records_ = {};
    choose_sightings(image);
    recognised_ = true;
    stamp_us_ = stamp_us;
    job_ = 0;
    next();
    return true;
  }
  [[nodiscard]] bool busy() const {
    return recognised_ ? job_ < sightings_.count() + new_.chosen_count() : Window::busy();
  }
  /// As that of the window.
  void work(int units) {
    if (!recognised_) return Window::work(units);
    credit_ += units;
    while (credit_ > 0 && busy()) credit_ -= job_ < sightings_.count() ? sight() : track();
    if (!busy()) credit_ = 0;
  }
  void give_up() {
    if (recognised_ && busy()) job_ = sightings_.count() + new_.chosen_count();
    Window::give_up();
  }
  [[nodiscard]] bool end_image(std::span<const ImageFeature> image) {
    if (recognised_) return ++this->count_.refused, false;
    if (!Window::end_image(image)) return false;
    if (!fresh_) new_.clear();  // what follows would not be of images in a row
    fresh_ = false;
    return true;
  }
  /// Ends what was recognised: its unknown identities come first and join their tracks, which are of the latest image's
  /// pose. False while work is left.
  [[nodiscard]] bool end_recognised(std::span<ImageFeature> image) {
    if (!recognised_ || busy()) return ++this->count_.refused, false;
    if (!moved_ && !fresh_) {
      std::size_t unknown = 0;
      for (const ImageFeature& feature : image)
        if (map_.find(feature.id) < 0) image[unknown++] = feature;
      new_.end(image.first(unknown), (slot_ + kClones_ - 1) % kClones_);
      fresh_ = true;
    } else {
      new_.clear();  // of no image of the window
    }
    count_misses();
    forget();
    recognised_ = false;
    job_ = kIdle;
    return true;
  }

  [[nodiscard]] const PointMap<kPoints_>& map() const { return map_; }
  [[nodiscard]] const MapCounters& map_counters() const { return map_count_; }
  [[nodiscard]] const MapRecords& map_records() const { return map_records_; }  ///< fates of what was recognised last
  [[nodiscard]] int map_concluded() const {
    return recognised_ ? job_ : sightings_.count() + new_.chosen_count();
  }  ///< how many of these have a fate

  static constexpr auto members(auto& self) {
    return base::members(base::base_of<Window>(self), self.stamp_us_, self.new_, base::unhashed(self.sightings_),
                         self.map_records_, base::unhashed(self.map_count_), self.recognised_, self.fresh_);
  }

 private:
  static constexpr std::uint16_t kMostMisses = 15;

  [[nodiscard]] float sigma() const { return options_.sigma_px / options_.camera.fu_px; }

  /// Mapped points with the fewest sightings yet come first. An identity that came twice is that of no point.
  void choose_sightings(std::span<const ImageFeature> image) {
    struct Choice {
      std::size_t feature;
      std::int32_t point;
    };
    std::array<Choice, static_cast<std::size_t>(kMostSightings)> choice{};
    int n = 0;
    for (std::size_t i = 0; i < image.size(); ++i) {
      const int point = map_.find(image[i].id);
      const bool twice =
          (i > 0 && image[i - 1].id == image[i].id) || (i + 1 < image.size() && image[i + 1].id == image[i].id);
      if (point < 0 || twice) continue;
      int k = n < kMostSightings ? n++ : kMostSightings;
      if (k == kMostSightings) {
        ++map_count_.left;
        if (map_[point].hits >= map_[choice[at(k - 1)].point].hits) continue;
        --k;
      }
      for (; k > 0 && map_[choice[at(k - 1)].point].hits > map_[point].hits; --k) choice[at(k)] = choice[at(k - 1)];
      choice[at(k)] = {i, point};
    }
    sightings_.begin();
    for (int k = 0; k < n; ++k) {
      const ImageFeature& feature = image[choice[at(k)].feature];
      sightings_.add({.id = feature.id,
                      .point = choice[at(k)].point,
                      .at = options_.camera.direction(feature.u_quarter_px, feature.v_quarter_px)});
    }
  }
  int sight() {
    const int cost = sightings_.step(p_, this->pose(), camera_, map_, sigma(), this->considered());
    const TrackRecord* const record = sightings_.concluded();
    if (record == nullptr) return cost;
    map_records_[at(job_++)] = *record;
    MapPoint& point = map_[sightings_.point()];
    if (record->fate == TrackFate::kUsed) {
      this->correct(sightings_.dx().data());
      ++map_count_.sightings;
      point.hits = counted(point.hits);
      point.misses = 0;
      point.seen_us = stamp_us_;
    }
    map_count_.gated += record->fate == TrackFate::kGated ? 1U : 0U;
    map_count_.alone += record->fate == TrackFate::kAlone ? 1U : 0U;
    next();
    return cost;
  }
  int track() {
    const int cost = update_.step(p_, camera_, sigma(), this->considered());
    if (update_.busy()) return cost;
    const TrackRecord& record = update_.record();
    map_records_[at(job_++)] = record;
    this->count(record);
    if (record.fate == TrackFate::kKept)
      map_.add({.at_n_m = update_.point_n_m() + update_.point_step_m(),
                .first_n_m = update_.point_n_m(),
                .seen_us = stamp_us_,
                .id = record.id,
                .hits = record.sightings});
    map_count_.no_room += record.fate == TrackFate::kNoRoom ? 1U : 0U;
    if (record.fate == TrackFate::kUsed || record.fate == TrackFate::kKept || record.fate == TrackFate::kNoRoom)
      this->correct(update_.dx().data());
    next();
    return cost;
  }
  /// A track of a mapped identity is left from the time before it was mapped.
  void next() {
    for (; busy() && job_ >= sightings_.count(); ++job_) {
      const auto& track = new_.chosen(job_ - sightings_.count());
      const bool mapped = map_.find(track.id) >= 0;
      if (!mapped) return this->begin_track(track, true);
      map_records_[at(job_)] = {.id = track.id, .fate = TrackFate::kNoDepth};
    }
  }
  /// A gated sighting speaks against a point that ought to be in the image, where others bear the pose out.
  void count_misses() {
    int used = 0;
    const int n = job_ < sightings_.count() ? job_ : sightings_.count();
    for (int i = 0; i < n; ++i) used += map_records_[at(i)].fate == TrackFate::kUsed ? 1 : 0;
    for (int i = 0; i < n && used > 0; ++i) {
      if (map_records_[at(i)].fate != TrackFate::kGated) continue;
      MapPoint& point = map_[map_.find(map_records_[at(i)].id)];
      const PointSighting sight(this->pose(), camera_, point.at_n_m);
      const model::PinholeCamera& c = options_.camera;
      const bool inside =
          sight.at.seen && base::abs(sight.at.at.x) * c.fu_px < c.cu_px && base::abs(sight.at.at.y) * c.fv_px < c.cv_px;
      if (inside) point.misses = counted(point.misses);
    }
  }
  /// Points that are not where the map has them.
  void forget() {
    for (int i = map_.size() - 1; i >= 0; --i) {
      if (map_[i].misses < kMostMisses) continue;
      p_.remove(kFirstPoint + 3 * i, 3);
      map_.remove(i);
      ++map_count_.forgotten;
    }
  }
  static constexpr std::uint16_t counted(std::uint16_t n) { return n < 0xFFFF ? static_cast<std::uint16_t>(n + 1) : n; }

  std::int64_t stamp_us_ = 0;  ///< stamp of what is recognised
  NewTracks new_;
  Sightings sightings_;
  MapRecords map_records_{};
  MapCounters map_count_;
  bool recognised_ = false;  ///< the job is that of what was recognised
  bool fresh_ = false;       ///< the new tracks have the latest image
};

}  // namespace tetap::slam
