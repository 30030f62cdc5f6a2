// SPDX-License-Identifier: Apache-2.0
// Inertial navigation: an error-state filter at the horizon of the fusion window, carried to the present by an output
// predictor. The filter's samples come in order, each once. The class is a composition: one object per source,
// alignment, standstill, heading monitor, recovery, output predictor, work budget. Its members only pass facts between
// them.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/base/reinitialise.hpp"
#include "tetap/estimators/context.hpp"
#include "tetap/estimators/estimate.hpp"
#include "tetap/estimators/inertial/aiding_sources.hpp"
#include "tetap/estimators/inertial/alignment.hpp"
#include "tetap/estimators/inertial/fault_watch.hpp"
#include "tetap/estimators/inertial/filter_view_facts.hpp"
#include "tetap/estimators/inertial/imu_input.hpp"
#include "tetap/estimators/inertial/output_predictor.hpp"
#include "tetap/estimators/inertial/recovery.hpp"
#include "tetap/estimators/inertial/standstill.hpp"
#include "tetap/estimators/inertial/work_budget.hpp"
#include "tetap/filter/viewed.hpp"
#include "tetap/nav/ins.hpp"
#include "tetap/sensor/sample.hpp"
#include "tetap/sensor/window.hpp"

#include <cstdint>

namespace tetap::estimators {

/// `Watch`: hypotheses of faults beside the filter, or none. What they find widens the covariance that is published,
/// and leaves the filter alone.
template <class Watch>
class InertialWith {
 public:
  static constexpr sensor::EstimatorKind kKind = sensor::EstimatorKind::kInertial;
  static constexpr bool kDelayed = true;

  void restart(base::Micros t, const Context& ctx);
  void set_pose(base::Micros, const SetPose& given, const Context& ctx);

  Innovation fuse(const sensor::ImuSample& sample, base::Micros stamp, const Context& ctx);
  Innovation fuse(const sensor::WheelCounts& counts, base::Micros stamp, const Context& ctx);
  Innovation fuse(const sensor::WheelSpeeds& speeds, base::Micros stamp, const Context& ctx);
  Innovation fuse(const sensor::BodySpeed& speed, base::Micros stamp, const Context& ctx);
  Innovation fuse(const sensor::GnssPosition& fix, base::Micros stamp, const Context& ctx);
  Innovation fuse(const sensor::GnssVelocity& velocity, base::Micros stamp, const Context& ctx);
  Innovation fuse(const sensor::OutsideHeading& heading, base::Micros stamp, const Context& ctx);
  Innovation fuse(const sensor::MagneticFlux& flux, base::Micros stamp, const Context& ctx);
  Innovation fuse(const sensor::AirPressure& air, base::Micros stamp, const Context& ctx);

  void arrived(const sensor::Sample& sample, const Context& ctx) {
    if (!is_of(sample, ctx.parameters.inertial)) return;
    predictor_.note_arrival(sample.stamp);
    budget_.note_arrival();
  }
  /// Brings the estimate to t: the state at the horizon, carried over the samples of the window.
  void advance(base::Micros t, const Context& ctx, const sensor::Window& window);
  /// The sample asks for more work than this tick has left: it waits for the next one.
  [[nodiscard]] bool defers(const sensor::Sample& sample, const Context& ctx);
  /// The window is about to end, and its samples are fused in the next few ticks.
  void grant_share() { budget_.grant(WorkBudget::kShare); }

  /// Bits of sensor::Fault: IMU, wheels and stuck sensors.
  [[nodiscard]] std::uint16_t faults() const;
  /// The last step of the estimate that no measurement made.
  [[nodiscard]] const Jump& jump() const { return recovery_.jump(); }
  [[nodiscard]] Estimate estimate(const Context& ctx) const;
  [[nodiscard]] MotionVariance motion_variance(const Context& ctx) const;
  [[nodiscard]] InertialEstimate inertial(const Context& ctx) const;
  /// Attitude of that estimate alone.
  [[nodiscard]] AttitudeEstimate inertial_attitude() const { return attitude_of(present(), tracking()); }
  /// Level plane of the place, in the map.
  [[nodiscard]] const nav::LocalLevel& level() const { return level_; }
  /// The parameters are others now.
  void configure(const Context& ctx) { set_noise(ctx.parameters.inertial); }
  [[nodiscard]] sensor::Mode mode(const Context& ctx) const;
  /// State of every source, and the test that failed last.
  [[nodiscard]] SourceStates sources(const Context& ctx) const;
  /// The likeliest fault of a sensor.
  [[nodiscard]] trust::LikelyFault likeliest_fault() const requires requires(const Watch& watch) { watch.likeliest(); }
  {
    // Clang 14 makes it for every watch.
    if constexpr (requires { watch_.likeliest(); }) return watch_.likeliest();
    return {};
  }
  static constexpr auto members(auto& self) {
    return base::members(self.ins_, self.predictor_, self.budget_, self.phase_, base::in_turns(self.alignment_),
                         self.heading_monitor_, self.time_, self.levelled_at_, base::in_turns(self.level_), self.imu_,
                         base::in_turns(self.standstill_), self.sources_, base::in_turns(self.recovery_), self.watch_);
  }

 protected:  // estimators/all_round adds a scanner
  enum class Phase : std::uint8_t { kLevelling, kFindingHeading, kTracking };

  [[nodiscard]] bool tracking() const { return phase_ == Phase::kTracking; }
  [[nodiscard, gnu::always_inline]] FilterView view(base::Micros stamp, const Context& ctx) const {
    return FilterView({.ins = ins_,
                       .imu = imu_,
                       .sources = sources_,
                       .heading_monitor = heading_monitor_,
                       .recovery = recovery_,
                       .level = level_,
                       .ctx = ctx,
                       .time = time_,
                       .stamp = stamp,
                       .tracking = tracking()});
  }
  void set_noise(const param::InertialParameters& n) {
    ins_.noise = {.gyro_radps_rthz = n.gyro_radps_rthz,
                  .accel_mps2_rthz = n.accel_mps2_rthz,
                  .gyro_bias_radps2_rthz = n.gyro_bias_radps2_rthz,
                  .accel_bias_mps3_rthz = n.accel_bias_mps3_rthz,
                  .gyro_scale = n.gyro_scale};
  }
  // Start and restart.
  void begin(const Context& ctx);
  void relocated();
  void restart_filter(base::Micros t, sensor::ResetCause cause, const Context& ctx);
  [[nodiscard]] bool take_heading(const SetPose& given);
  // IMU.
  Innovation imu_stuck(const nav::ImuIncrement& increment, bool was_stuck, const Context& ctx);
  Innovation align(const nav::ImuIncrement& increment, base::Micros pause, base::Micros stamp, const Context& ctx);
  [[nodiscard]] nav::Vector3 to_origin(nav::ImuIncrement& increment, const nav::Vector3& before_b_radps,
                                       const param::InertialParameters& n) const;
  Innovation propagate(const sensor::ImuSample& sample, const nav::ImuIncrement& increment,
                       const nav::Vector3& moved_b_m, base::Micros stamp, const Context& ctx);
  void bridge(base::Micros gap, const Context& ctx);
  void bridge_lost_samples(base::Micros gap, const Context& ctx);
  void follow_level(const Context& ctx);
  void set_level(const base::Anchored& x, const base::Anchored& y, const base::Anchored& z, const Context& ctx);
  void inflate_clipped(const sensor::ImuSample& sample, float dt_s, const param::InertialParameters& n);
  void judge_drift(base::Micros since, const param::Parameters& n);
  void detect_standstill(base::Micros stamp, const Context& ctx);
  void fuse_zero_rate(const param::InertialParameters& n);
  /// P is that of the state's time, and the hypotheses go along.
  void predict_covariance() { ins_.predict_covariance(watch_.bank()); }
  // Measurements.
  template <class Model>
  [[nodiscard]] filter::Innovation<float, Model::kDimension> update(const Model& model, float gate) {
    budget_.spend(WorkBudget::kMeasurement);
    predictor_.note_correction();
    return ins_.update(model, gate, watch_.bank());
  }
  template <class Model, class Source>
  Innovation measure(const Model& model, Source& source, float gate_scale, const FilterView& filter);
  template <int M, class Source>
  Innovation conclude(const filter::Innovation<float, M>& result, Source& source, const FilterView& filter);
  void apply(const Assessment& a, const FilterView& filter) {
    if (a.action == Action::kWidenVelocity || a.action == Action::kWidenPosition || a.action == Action::kWidenClimb)
      predict_covariance();
    if (a.action == Action::kResetPosition || a.action == Action::kResetHeight) watch_.begin();
    if (recovery_.apply(a, ins_, filter.stamp(), filter.parameters())) {
      predictor_.note_correction();
      budget_.spend(WorkBudget::kConditioning);
    }
    if (a.action == Action::kWidenVelocity)
      sources_.wheels.reset_slip();  // a slip is judged by the speed that was wrong
  }
  Innovation fuse_fix(model::GnssFix3d& fix, const FilterView& filter);
  Innovation update_by_fix(model::GnssFix3d& fix, const FixMeasurement& z, bool with_height, const FilterView& filter);
  void compare_with_ground(const VelocityMeasurement& z, const FilterView& filter);
  Innovation assess_wheels(const WheelReading& reading, const FilterView& filter, ForwardReading& forward);
  Innovation fuse_wheels(const WheelReading& reading, const FilterView& filter);
  Innovation fuse_forward(const ForwardReading& reading, const FilterView& filter);
  void fuse_constraint(base::Micros stamp, const Context& ctx);
  [[nodiscard]] bool skips_counts(base::Micros at, const param::InertialParameters& n) const {
    constexpr base::Micros kLongest{Standstill::kEvery.us / 2};
    return sources_.wheels.encoders().skips(at, standstill_.pending(), kLongest, n);
  }
  [[nodiscard]] bool skips_speed(base::Micros at, const param::InertialParameters& n) const {
    return below_min_interval(sources_.forward.fused_at(), at, n);
  }
  // Tick.
  [[nodiscard]] std::int32_t work_of(const sensor::Sample& sample, const Context& ctx) const;
  void bridge_to(base::Micros horizon, const Context& ctx);
  void predict_output(const OutputPredictor::Inputs& in, const sensor::Window& window);
  // Output.
  [[nodiscard]] float unseen_turn_radps(const Context& ctx) const {
    const param::InertialParameters& n = ctx.parameters.inertial;
    return view(time_, ctx).wheels_show_turn() ? n.gap_wheels_radps : n.gap_radps;
  }
  /// From the filter's time to the present; 0 while there is no filter.
  [[nodiscard]] float ahead_s() const { return tracking() ? base::seconds(predictor_.time() - time_) : 0.0F; }
  [[nodiscard]] const nav::InsState& present() const { return tracking() ? predictor_.present() : ins_.x; }
  [[nodiscard]] float unseen_s2(float unseen_s) const;
  [[nodiscard]] nav::InsCovarianceStep<float> step_ahead(const Context& ctx) const;

  filter::Viewable<nav::Ins> ins_;
  OutputPredictor predictor_;
  WorkBudget budget_;
  Phase phase_ = Phase::kLevelling;
  Alignment alignment_;
  HeadingMonitor heading_monitor_;
  base::Micros time_;         ///< time of the filter's state
  base::Micros levelled_at_;  ///< time of the level plane
  nav::LocalLevel level_;     ///< level plane of the place, in the map
  ImuInput imu_;
  Standstill standstill_;
  AidingSources sources_;
  Recovery recovery_;
  [[no_unique_address]] Watch watch_;
};

using Inertial = InertialWith<NoWatch>;
using WatchedInertial = InertialWith<FaultWatch>;

/// Record of an assessment; an accepted measurement failed no test.
[[nodiscard]] inline Innovation record_of(const Assessment& a) {
  const bool accepted = a.verdict == sensor::Verdict::kAccepted;
  return {.verdict = a.verdict,
          .dof = a.dof,
          .nis = a.nis,
          .gate = a.gate,
          .failed = accepted ? Check::kNone : a.failed,
          .statistic = a.statistic,
          .limit = a.limit};
}

}  // namespace tetap::estimators
