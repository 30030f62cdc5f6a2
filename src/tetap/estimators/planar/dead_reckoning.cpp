// SPDX-License-Identifier: Apache-2.0
#include "tetap/estimators/planar/dead_reckoning.hpp"

#include "tetap/estimators/mapping/recording_ekf.hpp"
#include "tetap/estimators/planar/cloning_ekf.hpp"
#include "tetap/estimators/planar/summing_ekf.hpp"
#include "tetap/filter/ukf.hpp"
#include "tetap/filter/ukf_sqrt.hpp"

namespace tetap::estimators {

template <class Filter>
model::PlanarIncrement PlanarDeadReckoning<Filter>::held_increment(float dt_s, bool gyro,
                                                                   const param::Parameters& n) const {
  model::PlanarIncrement increment;
  switch (held_.kind) {
    case Held::Kind::kNone:
      break;
    case Held::Kind::kBody:
      increment =
          model::Unicycle{.forward_mps = held_.first_mps, .yaw_rate_radps = held_.second, .noise = n.wheels.noise}
              .increment(dt_s);
      break;
    case Held::Kind::kWheels: {
      increment = n.wheels.drive.increment(held_.first_mps * dt_s, held_.second * dt_s);
      const float white = n.wheels.wheel_speed_noise * dt_s;
      increment.var_ds += 0.5F * white;
      increment.var_dyaw += 2.0F * white / (n.wheels.drive.track_m * n.wheels.drive.track_m);
      break;
    }
  }
  if (gyro) turn(increment, gyro_rate_radps_ * dt_s, n.gyro.noise * dt_s);
  return increment;
}

template <class Filter>
template <class Predict>
void PlanarDeadReckoning<Filter>::each_held(base::Micros t, const param::Parameters& n, Predict&& predict) const {
  if (t <= time_ || held_.kind == Held::Kind::kNone) return;  // no motion was ever measured: the robot stands
  // Held speeds count until the time-out, as they were published; after that anything may have happened.
  const base::Micros silent = last_input_ + base::Micros{n.wheels.timeout_us};
  const base::Micros held_until = t < silent ? t : silent;
  if (time_ < held_until) {
    const float dt_s = base::seconds(held_until - time_);
    const bool gyro = gyro_shows(held_until, n);
    predict(held_increment(dt_s, gyro, n), dt_s, gyro);
  }
  const base::Micros from = time_ < held_until ? held_until : time_;
  if (from < t) {
    const float grown = n.wheels.timeout_noise * base::seconds(t - from);
    predict(model::PlanarIncrement{.var_ds = grown, .var_dyaw = grown}, 0.0F, false);
  }
}

template <class Filter>
model::PlanarIncrement PlanarDeadReckoning<Filter>::take_held(base::Micros t, const param::Parameters& n) {
  model::PlanarIncrement last;
  bool waits = false;  // one increment, of the held speeds, before that of the time-out
  each_held(t, n, [&](const model::PlanarIncrement& increment, float dt_s, bool gyro) {
    if (waits) filter.predict(last);
    last = increment;
    waits = true;
    if (held_.kind == Held::Kind::kWheels) {
      applied_left_m_ += held_.first_mps * dt_s;
      applied_right_m_ += held_.second * dt_s;
    }
    if (gyro) applied_yaw_rad_ += gyro_rate_radps_ * dt_s;
  });
  if (t > time_) time_ = t;
  return last;
}

template <class Filter>
void PlanarDeadReckoning<Filter>::propagate(base::Micros t, const param::Parameters& n) {
  if (t <= time_) return;
  const bool moves = held_.kind != Held::Kind::kNone;
  const model::PlanarIncrement increment = take_held(t, n);
  if (moves) filter.predict(increment);
}

template <class Filter>
sensor::Verdict PlanarDeadReckoning<Filter>::fuse(const sensor::WheelCounts& now, base::Micros stamp,
                                                  const param::Parameters& n) {
  const auto& drive = n.wheels.drive;
  const bool gyro = gyro_shows(stamp, n);
  const bool usable = have_counts_ && stamp > counts_time_ && stamp - counts_time_ <= base::Micros{n.wheels.timeout_us};
  sensor::Verdict verdict = sensor::Verdict::kAccepted;
  if (usable) {
    const float left_m = drive.left_m(model::count_difference(now.left, counts_.left));
    const float right_m = drive.right_m(model::count_difference(now.right, counts_.right));
    const float dt_s = base::seconds(stamp - counts_time_);
    if (model::possible_step(left_m, right_m, n.wheels.most_mps * dt_s)) {
      // With a gyroscope: its turn up to here, to which the counts add length.
      const model::PlanarIncrement held = gyro ? take_held(stamp, n) : model::PlanarIncrement{};
      model::PlanarIncrement increment = drive.increment(left_m - applied_left_m_, right_m - applied_right_m_);
      if (gyro) {
        turn(increment, held.dyaw_rad, held.var_dyaw);
        increment.ds_m += held.ds_m;
        increment.var_ds += held.var_ds;
      }
      filter.predict(increment);
      const float per_s = 1.0F / dt_s;
      held_ = {.kind = Held::Kind::kWheels, .first_mps = left_m * per_s, .second = right_m * per_s};
    } else {
      propagate(stamp, n);  // as far as the last speeds hold
      verdict = sensor::Verdict::kRejected;
    }
  } else {
    if (have_counts_ || gyro) propagate(stamp, n);  // variance of the gap stays; its way is not known
    held_ = {.kind = Held::Kind::kWheels};
  }
  if (stamp > time_) time_ = stamp;
  untravelled();
  counts_ = now;
  counts_time_ = stamp;
  if (verdict == sensor::Verdict::kAccepted) last_input_ = stamp;
  have_counts_ = true;
  return verdict;
}

template <class Filter>
sensor::Verdict PlanarDeadReckoning<Filter>::fuse_speed(const Held& held, base::Micros stamp,
                                                        const param::Parameters& n) {
  const bool first = held_.kind == Held::Kind::kNone;
  const bool gap = stamp - last_input_ > base::Micros{n.wheels.timeout_us};
  if (n.wheels.hold == param::Hold::kForward || first || gap) propagate(stamp, n);
  held_ = held;
  last_input_ = stamp;
  if (n.wheels.hold == param::Hold::kBackward) propagate(stamp, n);
  if (stamp > time_) time_ = stamp;
  return sensor::Verdict::kAccepted;
}

template <class Filter>
sensor::Verdict PlanarDeadReckoning<Filter>::fuse(const sensor::ImuSample& sample, base::Micros stamp,
                                                  const param::Parameters& n) {
  const base::Micros interval{sample.interval_us};
  if (n.gyro.use == 0 || interval.us == 0 || interval > base::Micros{n.wheels.timeout_us})
    return sensor::Verdict::kNotUsed;
  const float interval_s = base::seconds(interval);
  const float raw_radps = (n.gyro.up_s[0] * sample.dangle_b_rad[0] + n.gyro.up_s[1] * sample.dangle_b_rad[1] +
                           n.gyro.up_s[2] * sample.dangle_b_rad[2]) /
                          interval_s;
  if (!(base::abs(raw_radps) <= n.inertial.gyro_range_radps)) return sensor::Verdict::kRejected;
  const float forward = forward_mps();
  const bool still =
      held_.kind != Held::Kind::kNone && forward < n.gyro.standstill_mps && -forward < n.gyro.standstill_mps;
  if (!still) {
    moving_ = true;
  } else if (moving_) {
    moving_ = false;
    still_since_ = stamp;
  } else if (stamp - still_since_ > base::Micros{1'000'000}) {
    gyro_bias_radps_ += (raw_radps - gyro_bias_radps_) * (interval_s / n.gyro.bias_time_s);
  }
  const float before_radps = gyro_rate_radps_;
  gyro_rate_radps_ = raw_radps - gyro_bias_radps_;
  // The extrapolation since the sample before is taken off. In a gap between the samples the rate changed evenly.
  const base::Micros span = stamp - gyro_time_;
  const bool follows = gyro_time_.us != 0 && span.us > 0 && span <= base::Micros{n.wheels.timeout_us};
  if (follows) {
    float turned_rad = gyro_rate_radps_ * base::seconds(span), variance = 0;
    const base::Micros gap = span - interval;
    if (2 * gap.us > interval.us) {  // half an interval or more: a sample is lost
      const float changed_rad = (before_radps - gyro_rate_radps_) * base::seconds(gap);
      // The change may have come at any time in the gap: the turn is evenly distributed, with a variance of span^2
      // / 12.
      turned_rad += 0.5F * changed_rad;
      variance = changed_rad * changed_rad * (1.0F / 12);
    }
    model::PlanarIncrement increment = take_held(stamp, n);
    increment.dyaw_rad += turned_rad - applied_yaw_rad_;
    increment.var_dyaw += variance;
    filter.predict(increment);
  } else {
    propagate(stamp, n);
  }
  applied_yaw_rad_ = 0;
  gyro_time_ = stamp;
  return sensor::Verdict::kAccepted;
}

template <class Filter>
Estimate PlanarDeadReckoning<Filter>::estimate(const param::Parameters& n) const {
  Filter ahead = filter;
  each_held(out_time_, n, [&ahead](const model::PlanarIncrement& increment, float, bool) { ahead.predict(increment); });
  const bool fresh = this->fresh(n);
  return {.time = out_time_,
          .pose = ahead.x,
          .p = covariance_of(ahead),
          .forward_mps = fresh ? forward_mps() : 0.0F,
          .yaw_rate_radps = fresh ? yaw_rate_radps(n) : 0.0F,
          .position_valid = true,
          .heading_valid = true,
          .velocity_valid = fresh};
}

template <class Filter>
[[gnu::noinline]] MotionVariance PlanarDeadReckoning<Filter>::motion_variance(const param::Parameters& n) const {
  if (!fresh(n)) return {};
  // Variance of the motion over one period: its share in that of the pose, and the steps of the counters.
  const float period_s = base::seconds(base::Micros{n.loop.period_us});
  const bool gyro = gyro_shows(out_time_, n);
  const model::PlanarIncrement one = held_increment(period_s, gyro, n);
  const float step_m = have_counts_ ? n.wheels.drive.count_sigma_m() : 0.0F;
  const float track_m = n.wheels.drive.track_m;
  const float step_rad = gyro || !have_counts_ ? 0.0F : step_m / track_m;
  // Samples are means, too: true in their middle.
  const float aged =
      n.loop.turn_radps2 * (base::seconds(out_time_ - (gyro ? gyro_time_ : last_input_)) + 0.5F * period_s);
  const float per_s2 = 1.0F / (period_s * period_s);
  return {.forward_m2ps2 = (one.var_ds + 0.5F * step_m * step_m) * per_s2,
          .yaw_rate_rad2ps2 = (one.var_dyaw + 2.0F * step_rad * step_rad) * per_s2 + aged * aged};
}

template class PlanarDeadReckoning<PlanarEkf>;
template class PlanarDeadReckoning<RecordingEkf>;
template class PlanarDeadReckoning<SummingEkf>;
template class PlanarDeadReckoning<CloningEkf>;
template class PlanarDeadReckoning<filter::Ukf<model::PlanarPose>>;
template class PlanarDeadReckoning<filter::UkfSqrt<model::PlanarPose>>;

}  // namespace tetap::estimators
