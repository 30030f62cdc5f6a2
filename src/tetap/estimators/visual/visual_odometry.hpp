// SPDX-License-Identifier: Apache-2.0
// A camera beside wheels and a gyroscope as an estimator: slam::VisualWindow of body speeds. The tracks of an image are
// a job in units of work. docs/explanation/visual_window.md has the equations.
//
// Delayed: the window filter is at the far end of the fusion window and rests while a job runs. Dead reckoning carries
// its pose to the present, so an image that is late by less than the window costs nothing.
//
// With slam::VisualMap it makes a map: what a recogniser found in the image comes as an image of its own behind it.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/base/state_digest.hpp"
#include "tetap/estimators/context.hpp"
#include "tetap/estimators/estimate.hpp"
#include "tetap/estimators/own_map.hpp"
#include "tetap/estimators/planar/dead_reckoning.hpp"
#include "tetap/estimators/visual/visual_report.hpp"
#include "tetap/sensor/window.hpp"
#include "tetap/slam/speed_core.hpp"
#include "tetap/slam/visual_map.hpp"

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace tetap::estimators {

/// Window: slam::VisualWindow or slam::VisualMap with slam::SpeedCore.
template <class Window>
class VisualOdometry {
 public:
  static constexpr sensor::EstimatorKind kKind = sensor::EstimatorKind::kMsckf;
  static constexpr bool kDelayed = true;
  static constexpr bool kMaps = Window::kPoints > 0;
  /// Words of the covariance that enter the digest in one tick.
  static constexpr std::size_t kScanned = 64;

  /// Without a start pose the robot's place is the origin.
  void restart(base::Micros t, const Context& ctx);
  /// Poses of earlier images are forgotten, and their tracks with them. Roll and pitch stay. A map moves with the
  /// robot.
  void set_pose(base::Micros t, const SetPose& given, const Context& ctx);
  void advance(base::Micros t, const Context& ctx, const sensor::Window& window);
  void work(std::uint32_t units, const Context& ctx);
  void abort_job() {
    window_.give_up();
    conclude();
  }
  /// The job of the image before is under way: what follows waits.
  [[nodiscard]] bool defers(const sensor::Sample&, const Context&) const { return window_.busy(); }

  template <class Input>
  requires requires(DeadReckoning& motion, const Input& input, const param::Parameters& n) {
    motion.fuse(input, base::Micros{}, n);
  }
  Innovation fuse(const Input& input, base::Micros stamp, const Context& ctx) {
    if (stamp > latest_) step_to(latest_, ctx);
    latest_ = stamp;
    const sensor::Verdict verdict = motion_.fuse(input, stamp, ctx.parameters);
    if constexpr (std::same_as<Input, sensor::BodySpeed> || std::same_as<Input, sensor::WheelSpeeds>)
      if (verdict == sensor::Verdict::kAccepted) settle_speed(stamp, ctx);
    if constexpr (requires { input.dangle_b_rad; })
      if (verdict == sensor::Verdict::kAccepted) tilt(turn_b_rad_, input, ctx);
    return input_record(verdict);
  }
  /// Pending where tracks of the image before are judged: their records come with the job.
  Innovation fuse(const sensor::CameraImage& image, base::Micros stamp, std::uint8_t instance, const Context& ctx);
  template <class Sink>
  void late_records(Sink&& sink) {
    for (std::size_t i = 0; i < records_; ++i) sink(record_[i]);
    records_ = 0;
  }
  void close_batch(const Context&) {}

  [[nodiscard]] Estimate estimate(const Context& ctx) const;
  [[nodiscard]] MotionVariance motion_variance(const Context& ctx) const {
    return present_.motion_variance(ctx.parameters);
  }
  [[nodiscard]] AttitudeEstimate attitude(const Context& ctx) const;
  /// DeadReckoning: no track was used for five seconds.
  [[nodiscard]] sensor::Mode mode(const Context&) const {
    return now_ - last_used_ > base::Micros{5'000'000} ? sensor::Mode::kDeadReckoning : sensor::Mode::kNominal;
  }
  /// The image that ended in this tick, if any.
  [[nodiscard]] std::optional<VisualReport> new_report() const {
    return shown_ ? std::optional(report_) : std::nullopt;
  }
  [[nodiscard]] Height height(const Context& ctx) const;

  // Templates, so that an explicit instantiation of a window without a map leaves these out.
  template <class W = Window>
  void reset_own_map() requires(W::kPoints > 0) {
    constexpr std::uint32_t kMapReset = 0x4D41'5052;  // a word of its own in the digest
    finish_job();
    window_.reset_map();
    digest_.update(kMapReset);
  }
  template <class W = Window>
  [[nodiscard]] MapReport own_map() const requires(W::kPoints > 0) {
    const slam::MapCounters& counters = window_.map_counters();
    return {.size = static_cast<std::uint32_t>(window_.map().size()),
            .refused = counters.no_room,
            .ambiguous = counters.alone};
  }
  /// In the plane; what the filter has of its height stays in the node.
  template <class W = Window>
  [[nodiscard]] MappedLandmark own_landmark(std::size_t i) const requires(W::kPoints > 0) {
    const int point = static_cast<int>(i), state = W::kFirstPoint + 3 * point;
    const slam::MapPoint& one = window_.map()[point];
    const auto& origin = window_.origin_um();
    const auto& p = window_.covariance();
    return {.id = landmark_of(one.id),
            .place = {.x = base::Anchored::from_um(origin[0]).plus(one.at_n_m(0)),
                      .y = base::Anchored::from_um(origin[1]).plus(one.at_n_m(1))},
            .xx_m2 = p(state, state),
            .xy_m2 = p(state, state + 1),
            .yy_m2 = p(state + 1, state + 1),
            .hits = one.hits,
            .age = now_ - base::Micros{one.seen_us},
            .confirmed = true};
  }
  /// Capacity, for a second after a point found no room.
  template <class W = Window>
  [[nodiscard]] std::uint16_t faults() const requires(W::kPoints > 0) {
    const bool full = refused_ > 0 && now_ - last_refused_ < base::Micros{1'000'000};
    return static_cast<std::uint16_t>(full ? 1U << static_cast<unsigned>(sensor::Fault::kCapacity) : 0U);
  }

  /// The window filter is not hashed: the digest stands for it, by each fate and by the covariance, a part a tick.
  static constexpr auto members(auto& self) {
    return base::members(base::unhashed(self.window_), self.motion_, base::unhashed(self.present_),
                         base::unhashed(self.now_), self.stepped_, self.latest_, self.turn_b_rad_,
                         base::unhashed(self.ahead_b_rad_), self.speed_at_, self.passed_m_, self.owed_m_,
                         base::unhashed(self.image_), base::count(self.features_), self.in_image_, self.job_stamp_,
                         self.last_used_, self.job_number_, self.told_, base::unhashed(self.record_),
                         base::count(self.records_), base::unhashed(self.report_), self.left_before_, self.ended_,
                         self.shown_, self.recognising_, self.last_refused_, self.refused_, self.digest_);
  }
  [[nodiscard]] std::uint32_t digest() const { return digest_.value(); }

 private:
  static constexpr std::size_t kFeatures = sensor::kImageFeatures;
  /// Identity of a point on the bus, whose landmarks have 8 bits: above 254 it has none.
  static constexpr std::uint8_t landmark_of(std::uint16_t id) {
    return id <= 254 ? static_cast<std::uint8_t>(id) : std::uint8_t{0xFF};
  }
  static constexpr std::size_t kRecords =
      Window::Tracks::kUsed + (kMaps ? 10 : 0);     ///< records of an image and its recogniser
  static constexpr base::Micros kLeastStep{5'000};  ///< samples of a fast sensor are summed

  /// `keep`: a map goes along.
  void begin(base::Micros t, const model::PlanarPose& pose, const nav::Euler& tilt, const nav::Vector3& sigma_rad,
             float sigma_place_m, bool keep);
  void take_features(const sensor::CameraImage& image, base::Micros stamp, const Context& ctx);
  [[nodiscard]] const slam::TrackRecord* next_record() const;
  void tell(const slam::TrackRecord& track);
  /// The window filter follows to the stamp of the last sample, where the dead reckoning is.
  void step_to(base::Micros t, const Context& ctx, bool whole = false);
  void finish_job();
  /// Turns about x and y, with those of one more sample.
  static void tilt(std::array<float, 2>& turn_b_rad, const sensor::ImuSample& imu, const Context& ctx);
  /// A speed is the mean since the one before. The gyroscope's samples between them went on with the older one.
  void settle_speed(base::Micros stamp, const Context& ctx);
  /// Way of the dead reckoning since the last step, along the arc.
  [[nodiscard]] float way_m() const;
  /// Records of tracks whose fate is known, and the end of the image behind the last of them.
  void conclude();
  void end_image();
  [[nodiscard]] nav::Vector3 ahead_n_m(const Estimate& ahead) const;
  [[nodiscard]] Estimate ahead(const Context& ctx) const { return present_.estimate(ctx.parameters); }

  Window window_;
  DeadReckoning motion_;               ///< at the far end of the fusion window: from the last step of the window filter
  DeadReckoning present_;              ///< the same carried over the fusion window
  base::Micros now_;                   ///< unhashed: of the last tick, set anew by the next
  base::Micros stepped_;               ///< time of the window filter
  base::Micros latest_;                ///< stamp of the last sample of motion
  std::array<float, 2> turn_b_rad_{};  ///< about x and y since the last step
  std::array<float, 2> ahead_b_rad_{};  ///< the same carried over the fusion window
  base::Micros speed_at_;               ///< stamp of the last speed; 0: none
  float passed_m_ = 0;                  ///< way of the dead reckoning's steps since then
  float owed_m_ = 0;                    ///< way by the speeds that is in no step yet
  std::array<model::ImageFeature, kFeatures> image_{};
  std::size_t features_ = 0;  ///< number of them in the image whose job runs
  bool in_image_ = false;     ///< an image was begun and has not ended
  base::Micros job_stamp_, last_used_;
  std::uint8_t job_number_ = 0;
  int told_ = 0;  ///< tracks of the image that have a record
  std::array<LateRecord, kRecords> record_{};
  std::size_t records_ = 0;
  VisualReport report_;
  std::uint32_t left_before_ = 0;
  bool ended_ = false, shown_ = false;  ///< an image ended since the last tick, and is shown in this one
  bool recognising_ = false;            ///< the image under way is that of the recogniser
  base::Micros last_refused_;
  std::uint32_t refused_ = 0;  ///< points without room
  base::StateDigest digest_;
};

/// Six images and forty tracks, and the small shape.
using VisualOdometry6 = VisualOdometry<slam::VisualWindow<slam::SpeedCore, 6, 40>>;
using VisualOdometry4 = VisualOdometry<slam::VisualWindow<slam::SpeedCore, 4, 20>>;
/// Six images, forty tracks and a map of 64 points.
using VisualSlam64 = VisualOdometry<slam::VisualMap<slam::SpeedCore, 6, 40, 64>>;

}  // namespace tetap::estimators
