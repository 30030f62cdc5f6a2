// SPDX-License-Identifier: Apache-2.0
// Inertial navigation in the firmware: an error-state filter at the far end of the window (its samples come in order,
// each once), carried to the present by the IMU samples that the window holds. Fuses GNSS position and velocity, wheels
// with the non-holonomic constraint, standstill, headings from outside, a magnetometer and a barometer.
#pragma once

#include "base/reinitialise.hpp"
#include "checks/coloured_noise.hpp"
#include "checks/frozen_position.hpp"
#include "checks/imu_health.hpp"
#include "checks/magnetic_field_check.hpp"
#include "checks/offset_hypothesis.hpp"
#include "checks/position_drift.hpp"
#include "checks/startup_fix_check.hpp"
#include "checks/stuck_value.hpp"
#include "checks/wheel_slip.hpp"
#include "estimators/context.hpp"
#include "estimators/estimate.hpp"
#include "estimators/inertial/alignment.hpp"
#include "estimators/inertial/barometer_zero.hpp"
#include "estimators/inertial/output_predictor.hpp"
#include "model/gnss_fix_3d.hpp"
#include "nav/ins.hpp"
#include "sensor/sample.hpp"

#include <array>
#include <cstdint>

namespace tetap::estimators {

struct FixNis;

class Inertial {
 public:
  static constexpr sensor::EstimatorKind kKind = sensor::EstimatorKind::kInertial;
  static constexpr bool kDelayed = true;

  void restart(base::Micros t, const Context& ctx) {
    base::reinitialise(*this);
    time_ = t;
    noise_of(ctx.parameters.inertial);
    const param::StartParameters& s = ctx.parameters.start;
    if (s.known != 0)
      start_.place({.x = base::Anchored{}.plus(s.x_m), .y = base::Anchored{}.plus(s.y_m), .yaw_rad = s.yaw_rad},
                   s.sigma_position_m, s.sigma_yaw_rad);
  }
  void set_pose(base::Micros, const SetPose& given, const Context& ctx) {
    if (phase_ == Phase::kTracking) start_.stay(ins_.x, base::sqrt(ins_.p(8, 8)));
    start_.place(given.pose, given.sigma_position_m, given.sigma_yaw_rad);
    place_.forget();
    height_.forget();
    drift_.forget();
    back_ = false;
    if (phase_ != Phase::kTracking) return;
    if (Alignment::is_heading(given.sigma_yaw_rad) && !take_heading(given)) return begin(ctx);
    ins_.place(given.pose.x, given.pose.y, given.sigma_position_m);
    is_elsewhere();
  }

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
    if (ahead_.arrived(sample.stamp)) corrected();
    ++arrived_;
  }
  /// The present: what the filter has, carried over the samples of the window.
  template <class Window>
  void advance(base::Micros t, const Context& ctx, const Window& window);
  /// Measurements are most of the work, so a tick takes one: what is due waits for the next.
  [[nodiscard]] bool rests(const sensor::Sample& sample, const Context& ctx);

  /// Bits of sensor::Fault: what is wrong with the IMU and the wheels.
  [[nodiscard]] std::uint16_t faults() const;
  /// The last step that fixes which persisted made the position take.
  [[nodiscard]] const Jump& jump() const { return jump_; }

  [[nodiscard]] Estimate estimate(const Context& ctx) const;
  [[nodiscard]] MotionVariance motion_variance(const Context& ctx) const;
  [[nodiscard]] InertialEstimate inertial(const Context& ctx) const;
  [[nodiscard]] sensor::Mode mode(const Context&) const {
    switch (phase_) {
      case Phase::kWaiting:
        return start_.levelling() ? sensor::Mode::kLevelling : sensor::Mode::kWaitingForImu;
      case Phase::kHeading:
        return start_.placed() ? sensor::Mode::kFindingHeading : sensor::Mode::kWaitingForPose;
      case Phase::kTracking:
        break;
    }
    constexpr base::Micros kLately{1'000'000};
    if (blind_ || imu_.stuck_lately(time_) || (bridged_.us > 0 && time_ - bridged_ < kLately)) {
      const bool carried = time_ - counts_time_ < kLately || time_ - last_position_ < base::Micros{3'000'000};
      return carried ? sensor::Mode::kDegraded : sensor::Mode::kWaitingForImu;
    }
    if (slip_.slip() != checks::WheelSlip::Slip::kNone) return sensor::Mode::kDegraded;
    for (const Refused& refused : refused_)
      if (refused.in_a_row >= 3) return sensor::Mode::kDegraded;
    return time_ - last_position_ > base::Micros{3'000'000} ? sensor::Mode::kDeadReckoning : sensor::Mode::kNominal;
  }
  template <class Sink>
  void hash_state(Sink&& sink) const;

 private:
  enum class Phase : std::uint8_t { kWaiting, kHeading, kTracking };
  enum Source : std::size_t { kPosition, kHeight, kVelocity, kWheels, kHeadings, kSources };
  struct Refused {
    std::int32_t in_a_row = 0;
    base::Micros since;
  };
  struct Forward {
    float mps = 0;
    float sigma_mps = 0;  ///< of counting: what one count is over the interval
  };
  static constexpr float kUnknown_mps = 1e4F;  ///< the sigma of a wheel speed of which nothing is known

  void noise_of(const param::InertialParameters& n) {
    ins_.noise = {.gyro_radps_rthz = n.gyro_radps_rthz,
                  .accel_mps2_rthz = n.accel_mps2_rthz,
                  .gyro_bias_radps2_rthz = n.gyro_bias_radps2_rthz,
                  .accel_bias_mps3_rthz = n.accel_bias_mps3_rthz,
                  .gyro_scale = n.gyro_scale};
  }
  void begin(const Context& ctx);
  void is_elsewhere();
  void begin_anew(base::Micros t, sensor::ResetCause cause, const Context& ctx);
  /// Something was taken anew that moves nothing at once: the sizes stay those of the last step.
  void say(sensor::ResetCause cause) {
    jump_.cause = cause;
    jump_.count = static_cast<std::uint8_t>(jump_.count + 1);
  }
  void measure_step(const nav::InsState& next);
  /// From the last IMU sample to a measurement; beyond a sample or two what that one showed says nothing any more.
  [[nodiscard]] float later_s(base::Micros stamp) const {
    constexpr base::Micros kMost{20'000};
    const base::Micros later = stamp - time_;
    return later < kMost && base::Micros{0} - later < kMost ? base::seconds(later) : 0.0F;
  }
  [[nodiscard]] nav::Vector3 axle_mps(const nav::Vector3& v_n_mps, const Context& ctx) const;
  [[nodiscard]] bool looks_wrong(const nav::Vector3& v_b_mps, float level_mps, float sigma_mps, base::Micros stamp,
                                 const Context& ctx);
  /// A heading that is said and does not contradict the filter's own is a measurement: all else that it knows stays.
  [[nodiscard]] bool take_heading(const SetPose& given);
  /// Neither wheels nor a speedometer, which may be as slow as one reading a second, were heard of late.
  [[nodiscard]] bool alone(base::Micros at) const { return rolled_.us == 0 || at - rolled_ >= base::Micros{1'500'000}; }
  [[nodiscard]] bool contradicted(base::Micros stamp, const Context& ctx);
  [[nodiscard]] bool wrong_for_long(bool wrong, base::Micros stamp, const param::RecoveryParameters& rules);
  void stand(base::Micros stamp, const Context& ctx);
  void hold_heading(float gate, const param::InertialParameters& n);
  [[nodiscard]] bool resting(base::Micros stamp, const Context& ctx) const;
  void hear_ground(const nav::Vector3& v_n_mps, const nav::Vector3& v_b_mps, float sigma_mps, base::Micros stamp,
                   const Context& ctx);
  [[nodiscard]] bool turn_known(base::Micros at) const;
  /// 1 sigma of how it turns while no gyroscope says so.
  [[nodiscard]] float unseen_turn_radps(const param::InertialParameters& n) const {
    return turn_known(time_) ? n.gap_wheels_radps : n.gap_radps;
  }
  /// Variance of the heading, as far as a small angle is meant: what is not known at all turns by one radian.
  [[nodiscard]] float heading_rad2() const { return ins_.p(8, 8) < 1.0F ? ins_.p(8, 8) : 1.0F; }
  [[nodiscard]] bool wheels_agree(base::Micros at, const Context& ctx) const;
  [[nodiscard]] bool without_imu() const;
  /// Wheels that are heard so soon after the last: counts are left to the difference of the next, speeds left out. So
  /// are counts while standing still waits to be told, which says more than that they do not change.
  [[nodiscard]] bool counts_soon(base::Micros at, const Context& ctx) const {
    constexpr base::Micros kLongest{kStandEvery.us / 2};
    return have_counts_ && (is_soon(at, counts_time_, ctx) || (stand_waits_ && at - counts_time_ < kLongest));
  }
  [[nodiscard]] bool speed_soon(base::Micros at, const Context& ctx) const { return is_soon(at, constrained_, ctx); }
  [[nodiscard]] static constexpr bool is_soon(base::Micros at, base::Micros last, const Context& ctx) {
    return at > last && at - last < base::Micros{ctx.parameters.inertial.wheels_every_us};
  }
  void bridge(base::Micros gap, const Context& ctx);
  void doubt(float sigma_mps, float sigma_rad);
  /// From the filter's time to the present; 0 while there is no filter.
  [[nodiscard]] float ahead_s() const { return phase_ == Phase::kTracking ? base::seconds(now_ - time_) : 0.0F; }
  [[nodiscard]] const nav::InsState& now_x() const { return phase_ == Phase::kTracking ? ahead_.present() : ins_.x; }
  [[nodiscard]] float unseen_s2(float unseen_s) const;
  [[nodiscard]] nav::InsCovarianceStep<float> step_ahead(const param::InertialParameters& n) const;
  [[nodiscard]] std::int32_t work_of(const sensor::Sample& sample, const Context& ctx) const;
  /// What is to be said every so often can be in this tick, or has waited long enough.
  [[nodiscard]] bool can_do(base::Micros since, base::Micros every) const {
    return work_left_ >= kMeasurement || since.us >= 2 * every.us;
  }
  /// The state at the far end is not what it was predicted to be.
  void corrected() {
    if (corrected_ == 0) corrected_ = 1;
  }
  Innovation roll(const checks::WheelSlip::Wheels& wheels, float sigma_mps, float later_mps, base::Micros stamp,
                  const Context& ctx);
  [[nodiscard]] float forward_mps() const { return ins_.x.q_nb.rotated_x().dot(ins_.x.v_n_mps); }
  Innovation forward(const Forward& speed, base::Micros stamp, const Context& ctx);
  void constrain(base::Micros stamp, const Context& ctx);
  [[nodiscard]] bool believe(const nav::Vector3& nu, const nav::Vector3& r, bool agrees, base::Micros stamp,
                             const param::RecoveryParameters& rules);
  [[nodiscard]] bool drifts(const nav::Vector3& nu, const nav::Vector3& r, const FixNis& of_fix,
                            const param::GnssParameters& n, Innovation& record);
  Innovation weigh(model::GnssFix3d& fix, base::Micros stamp, const Context& ctx);
  void refused_or_not(Source source, bool refused, base::Micros stamp);
  void step(int first, int count, const nav::Vector3& by_m, const nav::Vector3& variance_m2);
  template <class Model>
  [[nodiscard]] filter::Innovation<float, Model::kDimension> update(const Model& model, float gate) {
    work_left_ -= kMeasurement;
    corrected();
    return ins_.update(model, gate);
  }
  template <class Model>
  Innovation measure(const Model& model, Source source, float gate_scale, base::Micros stamp, const Context& ctx);
  template <int M>
  void recover(const filter::Vector<float, M>& nu, Source source, const param::Parameters& n);

  /// Work of a tick, in IMU samples: what keeps pace with the IMU, and one measurement; or, after that, all that is
  /// ahead carried anew. More of them the farther the far end is behind.
  static constexpr std::int32_t kMeasurement = 5;
  static constexpr std::int32_t kOfAFix = 2;           ///< to find its place, and whether it is to be trusted
  static constexpr base::Micros kStandEvery{100'000};  ///< that it stands is told

  nav::Ins ins_;
  OutputPredictor ahead_;
  std::int32_t work_left_ = 0;  ///< in this tick
  std::int32_t arrived_ = 0;    ///< IMU samples since the last
  base::Micros anew_at_;        ///< when all that is ahead was carried anew last
  Alignment start_;
  Phase phase_ = Phase::kWaiting;
  base::Micros time_;  ///< of the filter's state
  base::Micros now_;   ///< of the estimate
  base::Micros last_position_;
  base::Micros counts_time_;
  base::Micros constrained_;  ///< last stamp at which wheels, or that there are some, were fused
  base::Micros moved_;        ///< last stamp at which something moved
  base::Micros stood_;        ///< last that it stands was told; while it moves such that it is due at once
  sensor::WheelCounts counts_;
  bool have_counts_ = false;
  float gained_mps_ = base::kNan;                     ///< forward, by the IMU, since they were fused; NaN: not known
  nav::Vector3 rate_b_radps_ = nav::Vector3::Zero();  ///< as the gyroscope shows it, at the filter's time
  /// Mean of the gyroscope over so much standing.
  struct Still {
    nav::Vector3 rate_radps = nav::Vector3::Zero();
    float s = 0;
  };
  Still still_;                                     ///< since the last
  Still waiting_;                                   ///< until it is known that the robot had not begun to move
  nav::Vector3 ground_mps_ = nav::Vector3::Zero();  ///< mean of GNSS velocities since the IMU is calm
  std::int32_t grounds_ = 0;
  base::Micros ground_;   ///< last of them
  base::Micros calm_;     ///< since when the IMU shows no motion; 0: it does
  base::Micros bridged_;  ///< up to where the filter last went without IMU
  base::Micros wheels_;   ///< last stamp at which wheels said how it turns,
  float wheel_turn_radps_ = 0;
  bool speed_known_ = false;    ///< since it began: the constraint without wheels waits for that
  bool blind_ = false;          ///< the present is without IMU
  bool unusable_ = false;       ///< the last IMU sample was
  bool anew_ = false;           ///< all that is ahead was carried anew in this tick
  bool one_by_one_ = false;     ///< and samples of it were looked at by themselves
  bool waits_ = false;          ///< something that was due was left for the next tick
  bool stand_waits_ = false;    ///< that it stands was, or what the gyroscope shows then
  std::uint8_t corrected_ = 0;  ///< ticks since the far end was, and what is ahead of it does not have it; 0: it does
  checks::ImuHealth imu_;
  checks::WheelSlip slip_;
  std::array<Refused, kSources> refused_{};
  Refused wrong_way_;          ///< that it looks where it does, by receiver and wheels, or by how it moves
  base::Micros wrong_way_at_;  ///< last of that
  checks::StartupFixCheck first_fixes_;
  checks::FrozenPosition frozen_;
  checks::PositionDrift drift_;
  float rolled_mps_ = 0;                     ///< as wheels or a speedometer said last,
  base::Micros rolled_;                      ///< and when
  checks::OffsetHypothesis place_, height_;  ///< of fixes that are not taken
  std::array<float, 2> led_m_{};             ///< by how much the last fixes moved the position
  bool doubted_ = false, back_ = false;      ///< so is that; the last jump may be taken back
  std::uint8_t recoveries_ = 0;              ///< of the velocity, since a fix was accepted
  Jump jump_;
  checks::MagneticFieldCheck field_;
  BarometerZero baro_;
  checks::StuckValue<3> fluxes_;
  checks::StuckValue<1> pressures_, headings_;
};

}  // namespace tetap::estimators

#include "estimators/inertial/inertial_gnss.hpp"     // IWYU pragma: keep
#include "estimators/inertial/inertial_heading.hpp"  // IWYU pragma: keep
#include "estimators/inertial/inertial_height.hpp"   // IWYU pragma: keep
#include "estimators/inertial/inertial_imu.hpp"      // IWYU pragma: keep
#include "estimators/inertial/inertial_measure.hpp"  // IWYU pragma: keep
#include "estimators/inertial/inertial_output.hpp"   // IWYU pragma: keep
#include "estimators/inertial/inertial_present.hpp"  // IWYU pragma: keep
#include "estimators/inertial/inertial_wheels.hpp"   // IWYU pragma: keep
