// SPDX-License-Identifier: Apache-2.0
// Inertial navigation in the firmware: an error-state filter at the far end of the window (its samples come in order,
// each once), carried to the present by the IMU samples that the window holds. Fuses GNSS position and velocity, wheels
// with the non-holonomic constraint, standstill, and an outside heading.
#pragma once

#include "app/context.hpp"
#include "app/estimate.hpp"
#include "app/estimators/inertial_start.hpp"
#include "app/samples.hpp"
#include "model/dual_heading.hpp"
#include "model/gnss_fix_3d.hpp"
#include "model/gnss_velocity_3d.hpp"
#include "model/wheel_speed.hpp"
#include "model/zero_rate.hpp"
#include "model/zero_velocity.hpp"
#include "nav/ins.hpp"
#include "nav/preintegration.hpp"

#include <array>
#include <cstdint>

namespace tetap::app {

class Inertial {
 public:
  static constexpr can::EstimatorKind kKind = can::EstimatorKind::kInertial;
  static constexpr bool kDelayed = true;

  void restart(base::Micros t, const Context& with) {
    *this = {};
    time_ = t;
    noise_of(with.numbers.inertial);
    const StartNumbers& s = with.numbers.start;
    if (s.known != 0)
      start_.place({.x = base::Anchored{}.plus(s.x_m), .y = base::Anchored{}.plus(s.y_m), .yaw_rad = s.yaw_rad},
                   s.sigma_position_m, s.sigma_yaw_rad);
  }
  void set_pose(base::Micros, const SetPose& given, const Context& with) {
    start_.place(given.pose, given.sigma_position_m, given.sigma_yaw_rad);
    if (phase_ == Phase::kTracking) begin(with);
  }

  Innovation fuse(const ImuSample& sample, base::Micros stamp, const Context& with);
  Innovation fuse(const WheelCounts& counts, base::Micros stamp, const Context& with);
  Innovation fuse(const WheelSpeeds& speeds, base::Micros stamp, const Context& with) {
    return forward({.mps = 0.5F * (speeds.left_mps + speeds.right_mps)}, stamp, with);
  }
  Innovation fuse(const BodySpeed& speed, base::Micros stamp, const Context& with) {
    return forward({.mps = with.numbers.wheels.speed_scale * speed.forward_mps}, stamp, with);
  }
  Innovation fuse(const GnssPosition& fix, base::Micros stamp, const Context& with);
  Innovation fuse(const GnssVelocity& velocity, base::Micros stamp, const Context& with);
  Innovation fuse(const OutsideHeading& heading, base::Micros stamp, const Context& with);

  /// The present: what the filter has, carried over the samples of the window.
  template <class Window>
  void advance(base::Micros t, const Context& with, Window&& window) {
    now_ = t;
    ahead_ = nav::ImuChunk::with_biases_of(ins_.x);
    last_rate_b_radps_ = rate_b_radps_;
    if (phase_ != Phase::kTracking) return;
    window([&](const Sample& sample) {
      if (sample.sensor != can::Sensor::kImu || sample.instance != with.numbers.inertial.imu) return;
      const nav::ImuIncrement increment = increment_of(sample.payload.imu, with.numbers.inertial);
      if (increment.check() != nav::ImuVerdict::kAccepted) return;
      ahead_.add(increment);
      last_rate_b_radps_ = increment.dtheta_b_rad / base::seconds(increment.dt);
    });
  }

  [[nodiscard]] Estimate estimate(const Context& with) const;
  [[nodiscard]] InertialEstimate inertial(const Context& with) const;
  [[nodiscard]] can::Mode mode(const Context&) const {
    switch (phase_) {
      case Phase::kWaiting:
        return start_.levelling() ? can::Mode::kLevelling : can::Mode::kWaitingForImu;
      case Phase::kHeading:
        return start_.placed() ? can::Mode::kFindingHeading : can::Mode::kWaitingForPose;
      case Phase::kTracking:
        break;
    }
    for (const Refused& refused : refused_)
      if (refused.in_a_row >= 3) return can::Mode::kDegraded;
    return time_ - last_position_ > base::Micros{3'000'000} ? can::Mode::kDeadReckoning : can::Mode::kNominal;
  }
  template <class Sink>
  void each_bit(Sink&& sink) const;

 private:
  enum class Phase : std::uint8_t { kWaiting, kHeading, kTracking };
  enum Source : std::size_t { kPosition, kVelocity, kWheels, kHeadings, kSources };
  struct Refused {
    std::int32_t in_a_row = 0;
    base::Micros since;
  };
  struct Forward {
    float mps = 0;
    float sigma_mps = 0;  ///< of counting: what one count is over the interval
  };

  static nav::ImuIncrement increment_of(const ImuSample& sample, const InertialNumbers& n) {
    const auto body = [&m = n.mounting_bs](const std::array<float, 3>& s) {
      return nav::Vector3{m[0] * s[0] + m[1] * s[1] + m[2] * s[2], m[3] * s[0] + m[4] * s[1] + m[5] * s[2],
                          m[6] * s[0] + m[7] * s[1] + m[8] * s[2]};
    };
    return {.dtheta_b_rad = body(sample.dangle_b_rad),
            .dv_b_mps = body(sample.dvelocity_b_mps),
            .dt = base::Micros{sample.interval_us}};
  }
  void noise_of(const InertialNumbers& n) {
    ins_.noise = {.gyro_radps_rthz = n.gyro_radps_rthz,
                  .accel_mps2_rthz = n.accel_mps2_rthz,
                  .gyro_bias_radps2_rthz = n.gyro_bias_radps2_rthz,
                  .accel_bias_mps3_rthz = n.accel_bias_mps3_rthz};
  }
  void begin(const Context& with);
  void stand(base::Micros stamp, const Context& with);
  Innovation forward(const Forward& speed, base::Micros stamp, const Context& with);
  template <class Model>
  Innovation measure(const Model& model, Source source, float gate_scale, base::Micros stamp, const Context& with);
  template <int M>
  void recover(const filter::Vector<float, M>& nu, Source source, const RecoveryNumbers& n);

  nav::Ins ins_;
  nav::ImuChunk ahead_;
  InertialStart start_;
  Phase phase_ = Phase::kWaiting;
  base::Micros time_;  ///< of the filter's state
  base::Micros now_;   ///< of the estimate
  base::Micros last_position_;
  base::Micros counts_time_;
  base::Micros moved_;  ///< last stamp at which something moved
  base::Micros stood_;  ///< last stamp at which standing still was fused
  WheelCounts counts_;
  bool have_counts_ = false;
  nav::Vector3 rate_b_radps_ = nav::Vector3::Zero();  ///< as the gyroscope shows it, at the filter's time
  nav::Vector3 last_rate_b_radps_ = nav::Vector3::Zero();
  nav::Vector3 still_rate_radps_ = nav::Vector3::Zero();  ///< mean since it stands
  float still_s_ = 0;
  std::array<Refused, kSources> refused_{};
};

inline Innovation Inertial::fuse(const ImuSample& sample, base::Micros stamp, const Context& with) {
  const nav::ImuIncrement increment = increment_of(sample, with.numbers.inertial);
  if (increment.check() != nav::ImuVerdict::kAccepted) return {.verdict = can::Verdict::kNotFinite};
  const float dt_s = base::seconds(increment.dt);
  rate_b_radps_ = increment.dtheta_b_rad / dt_s;
  if (phase_ != Phase::kTracking) {
    time_ = stamp;
    if (start_.level(increment, with.numbers.inertial)) phase_ = Phase::kHeading;
    if (phase_ == Phase::kHeading && start_.ready()) begin(with);
    return {.verdict = can::Verdict::kAccepted};
  }
  // Lost samples: what is missing between the last and the begin of this one is bridged.
  const base::Micros gap = stamp - increment.dt - time_;
  if (gap > base::Micros{1'500})
    ins_.predict_without_imu(gap, with.numbers.inertial.gap_mps2, with.numbers.inertial.gap_radps);
  if (ins_.predict(increment) != nav::ImuVerdict::kAccepted) return {.verdict = can::Verdict::kNotFinite};
  ins_.predict_covariance(sample.clipped_accel + sample.clipped_gyro > 0 ? 10.0F : 1.0F);
  time_ = stamp;
  still_s_ += dt_s;
  still_rate_radps_ += (rate_b_radps_ - still_rate_radps_) * (dt_s / (still_s_ > dt_s ? still_s_ : dt_s));
  stand(stamp, with);
  return {.verdict = can::Verdict::kAccepted};
}

/// The filter begins where the start found the robot.
inline void Inertial::begin(const Context& with) {
  if (with.site.origin != can::OriginSource::kNone) ins_.earth = nav::Earth::at(with.site.frame, false);
  start_.begin(ins_, with.numbers.inertial, phase_ == Phase::kTracking);
  phase_ = Phase::kTracking;
  last_position_ = time_;
  refused_ = {};
  still_s_ = 0;
}

/// Wheels that have not turned for half a second: no velocity, and the gyroscope's mean is its bias.
inline void Inertial::stand(base::Micros stamp, const Context& with) {
  const InertialNumbers& n = with.numbers.inertial;
  constexpr base::Micros kQuiet{500'000}, kEvery{100'000};
  const bool quiet = have_counts_ && stamp - counts_time_ < kEvery && stamp - moved_ > kQuiet;
  const nav::Vector3 turn = rate_b_radps_ - ins_.x.b_g_radps;
  if (!quiet || turn.squaredNorm() > n.still_radps * n.still_radps) {
    still_s_ = 0;
    return;
  }
  if (stamp - stood_ < kEvery) return;
  stood_ = stamp;
  static_cast<void>(ins_.update(model::ZeroVelocity{.sigma_mps = n.still_mps}, filter::chi_square_99(3) * 4.0F));
  if (still_s_ < 0.5F) return;
  // The mean over the standstill so far; successive means share their samples, so the sigma is that of the last tenth.
  const float sigma = 3.0F * n.gyro_radps_rthz * base::sqrt(10.0F);
  static_cast<void>(ins_.update(model::ZeroRate{.gyro_b_radps = still_rate_radps_, .sigma_radps = sigma},
                                filter::chi_square_99(3) * 4.0F));
}

template <class Model>
Innovation Inertial::measure(const Model& model, Source source, float gate_scale, base::Micros stamp,
                             const Context& with) {
  const auto result = ins_.update(model, gate_scale * filter::chi_square_99(Model::kDimension));
  Refused& refused = refused_[source];
  if (result.verdict == filter::Verdict::kAccepted) {
    refused.in_a_row = 0;
    if (source == kPosition) last_position_ = stamp;
  } else if (result.verdict == filter::Verdict::kRejected) {
    if (refused.in_a_row++ == 0) refused.since = stamp;
    if (refused.in_a_row >= with.numbers.recovery.at_least &&
        stamp - refused.since >= base::Micros{with.numbers.recovery.after_us})
      recover(result.nu, source, with.numbers.recovery);
  }
  return record(result);
}

/// What was refused that long is right and the filter wrong, or the filter will refuse it again: its doubts grow by
/// what it was off.
template <int M>
void Inertial::recover(const filter::Vector<float, M>& nu, Source source, const RecoveryNumbers& n) {
  if constexpr (M == 3) {
    for (int i = 0; i < 3; ++i) {
      if (source == kPosition) ins_.p(i, i) += nu(i) * nu(i);
      if (source == kVelocity) ins_.p(3 + i, 3 + i) += nu(i) * nu(i);
    }
  }
  for (int i = 3; i < 6; ++i) ins_.p(i, i) += 0.25F;
  ins_.p(8, 8) += n.inflate_yaw_rad * n.inflate_yaw_rad;
  refused_[source] = {};
}

inline Innovation Inertial::fuse(const GnssPosition& fix, base::Micros stamp, const Context& with) {
  const GnssNumbers& n = with.numbers.gnss;
  if (fix.fix < GnssFix::k2d || with.site.origin == can::OriginSource::kNone) return {};
  const nav::Local local = with.site.frame.to_local(fix.latitude_2ndeg, fix.longitude_2ndeg, fix.height_m);
  if (!local.valid) return {.verdict = can::Verdict::kNotFinite};
  const auto sigma = [&n](float own, float otherwise) {
    const float scaled = base::is_finite(own) ? n.sigma_scale * own : otherwise;
    return scaled > n.sigma_floor_m ? scaled : n.sigma_floor_m;
  };
  model::GnssFix3d model{.x = base::Anchored::from_um(local.east_um),
                         .y = base::Anchored::from_um(local.north_um),
                         .z = base::Anchored::from_um(local.up_um),
                         .sigma_horizontal_m = sigma(fix.horizontal_acc_m, 10.0F),
                         .sigma_vertical_m = sigma(fix.vertical_acc_m, 20.0F),
                         .antenna_b_m = {n.antenna_x_b_m, n.antenna_y_b_m, n.antenna_z_b_m}};
  if (phase_ != Phase::kTracking) {
    start_.fix(model, stamp, n.align_distance_m);
    return {.verdict = can::Verdict::kAccepted};
  }
  // The fix is true at its own time, the state at that of the last IMU sample: moved by the velocity in between.
  const float later_s = base::seconds(stamp - time_);
  nav::move(model.x, -ins_.x.v_n_mps(0) * later_s);
  nav::move(model.y, -ins_.x.v_n_mps(1) * later_s);
  nav::move(model.z, -ins_.x.v_n_mps(2) * later_s);
  return measure(model, kPosition, n.gate_scale, stamp, with);
}

inline Innovation Inertial::fuse(const GnssVelocity& velocity, base::Micros stamp, const Context& with) {
  const GnssNumbers& n = with.numbers.gnss;
  const nav::Vector3 v_n{velocity.v_n_mps[0], velocity.v_n_mps[1],
                         base::is_finite(velocity.v_n_mps[2]) ? velocity.v_n_mps[2] : 0.0F};
  const float own = base::is_finite(velocity.acc_mps) ? velocity.acc_mps : 0.5F;
  const float sigma = own > n.sigma_velocity_floor_mps ? own : n.sigma_velocity_floor_mps;
  if (phase_ != Phase::kTracking) {
    start_.velocity(v_n, sigma);
    return {.verdict = can::Verdict::kAccepted};
  }
  return measure(model::GnssVelocity3d{.v_n_mps = v_n,
                                       .sigma_horizontal_mps = sigma,
                                       .sigma_vertical_mps = 1.5F * sigma,
                                       .antenna_b_m = {n.antenna_x_b_m, n.antenna_y_b_m, n.antenna_z_b_m},
                                       .gyro_b_radps = rate_b_radps_},
                 kVelocity, n.gate_scale, stamp, with);
}

inline Innovation Inertial::fuse(const WheelCounts& counts, base::Micros stamp, const Context& with) {
  const auto& drive = with.numbers.wheels.drive;
  const base::Micros interval = stamp - counts_time_;
  const bool usable = have_counts_ && interval.us > 0 && interval <= base::Micros{with.numbers.wheels.timeout_us};
  const std::int32_t left = model::count_difference(counts.left, counts_.left);
  const std::int32_t right = model::count_difference(counts.right, counts_.right);
  counts_ = counts;
  counts_time_ = stamp;
  have_counts_ = true;
  if (!usable || left != 0 || right != 0) moved_ = stamp;
  if (!usable) return {.verdict = can::Verdict::kAccepted};
  const float per_s = 1.0F / base::seconds(interval);
  return forward(
      {.mps = 0.5F * (drive.left_m(left) + drive.right_m(right)) * per_s, .sigma_mps = 0.41F * drive.left_m(1) * per_s},
      stamp, with);
}

inline Innovation Inertial::forward(const Forward& speed, base::Micros stamp, const Context& with) {
  const InertialNumbers& n = with.numbers.inertial;
  if (phase_ != Phase::kTracking) return {.verdict = can::Verdict::kAccepted};
  const float slip = n.slip_share * (speed.mps < 0 ? -speed.mps : speed.mps);
  const float sigma = base::sqrt(n.wheel_mps * n.wheel_mps + slip * slip + speed.sigma_mps * speed.sigma_mps);
  return measure(model::WheelSpeed{.forward_mps = speed.mps,
                                   .sigma_forward_mps = sigma,
                                   .sigma_lateral_mps = n.lateral_mps,
                                   .sigma_vertical_mps = n.vertical_mps,
                                   .axle_b_m = {n.axle_x_b_m, 0.0F, 0.0F},
                                   .gyro_b_radps = rate_b_radps_},
                 kWheels, n.wheel_gate_scale, stamp, with);
}

inline Innovation Inertial::fuse(const OutsideHeading& heading, base::Micros stamp, const Context& with) {
  const float own = base::is_finite(heading.acc_rad) ? heading.acc_rad : 0.1F;
  const float sigma = own > 0.005F ? own : 0.005F;
  if (phase_ != Phase::kTracking) {
    start_.heading(heading.yaw_rad, sigma);
    return {.verdict = can::Verdict::kAccepted};
  }
  return measure(model::DualHeading({1.0F, 0.0F, 0.0F}, heading.yaw_rad, sigma), kHeadings,
                 with.numbers.gnss.gate_scale, stamp, with);
}

inline InertialEstimate Inertial::inertial(const Context&) const {
  return {.state = phase_ == Phase::kTracking ? ahead_.apply(ins_.x, ins_.earth) : ins_.x,
          .p = ins_.p,
          .valid = phase_ == Phase::kTracking};
}

inline Estimate Inertial::estimate(const Context& with) const {
  const InertialEstimate full = inertial(with);
  const nav::InsState& x = full.state;
  const nav::Vector3 v_b = x.q_nb.conjugate().rotate(x.v_n_mps);
  const nav::Vector3 w_n = x.q_nb.rotate(last_rate_b_radps_ - x.b_g_radps);
  constexpr std::array<int, 3> kPlanar{0, 1, 8};
  filter::Symmetric<float, 3> p;
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r <= c; ++r)
      p(r, c) = full.p(kPlanar[static_cast<std::size_t>(r)], kPlanar[static_cast<std::size_t>(c)]);
  // Position is uncertain at the present by what the velocity was at the far end, too.
  const float ahead_s = base::seconds(ahead_.dt);
  p(0, 0) += ahead_s * (2.0F * full.p(0, 3) + ahead_s * full.p(3, 3));
  p(1, 1) += ahead_s * (2.0F * full.p(1, 4) + ahead_s * full.p(4, 4));
  p(0, 1) += ahead_s * (full.p(0, 4) + full.p(1, 3) + ahead_s * full.p(3, 4));
  p(0, 2) += ahead_s * full.p(3, 8);
  p(1, 2) += ahead_s * full.p(4, 8);
  return {.time = now_,
          .pose = {.x = x.x, .y = x.y, .yaw_rad = nav::euler(x.q_nb).yaw_rad},
          .p = p,
          .forward_mps = v_b(0),
          .yaw_rate_radps = w_n(2),
          .position_valid = full.valid,
          .heading_valid = full.valid,
          .velocity_valid = full.valid};
}

template <class Sink>
void Inertial::each_bit(Sink&& sink) const {
  const nav::InsState& x = ins_.x;
  for (const base::Anchored* coordinate : {&x.x, &x.y, &x.z}) {
    sink(coordinate->anchor_um);
    sink(coordinate->offset_m);
  }
  for (int i = 0; i < 3; ++i) {
    sink(x.v_n_mps(i));
    sink(x.b_a_mps2(i));
    sink(x.b_g_radps(i));
    sink(still_rate_radps_(i));
  }
  sink(x.q_nb.w);
  sink(x.q_nb.x);
  sink(x.q_nb.y);
  sink(x.q_nb.z);
  for (const float v : ins_.p.packed()) sink(v);
  sink(static_cast<std::uint32_t>(phase_));
  start_.each_bit(sink);
  sink(time_.us);
  sink(last_position_.us);
  sink(moved_.us);
  sink(still_s_);
  for (const Refused& refused : refused_) {
    sink(refused.in_a_row);
    sink(refused.since.us);
  }
}

}  // namespace tetap::app
