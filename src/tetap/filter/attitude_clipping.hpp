// SPDX-License-Identifier: Apache-2.0
// The turn that a gyroscope misses at the end of its range. Between the last reading below the limit and the next one
// the rate is taken as the cubic through both with their slopes (Hermite interpolation). Its integral over T seconds is
// (w0 + w1) T/2 + (a + c) T^2/12, for slopes a at the entry and -c at the exit. The turn that the readings show is
// taken off. A single wild reading has no slopes to support it, and adds nothing.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/filter/attitude_options.hpp"
#include "tetap/filter/quaternion.hpp"

#include <array>

namespace tetap::filter {

/// A rate at its limit, from the last reading below the limit to the next one. Rates are positive towards the limit.
class ClippedSpan {
 public:
  [[nodiscard]] bool active() const { return clipped_s_ > 0.0F; }
  /// The first reading at the limit, after the readings `last` and, one earlier, `before`.
  void begin(float rate_radps, float last_radps, float before_radps, float dt_s) {
    entry_radps_ = last_radps;
    slope_radps2_ = base::max(base::max(rate_radps - last_radps, last_radps - before_radps), 0.0F) / dt_s;
    clipped_s_ = dt_s;
    shown_rad_ = rate_radps * dt_s;
  }
  /// Another reading at the limit.
  void extend(float rate_radps, float dt_s) {
    clipped_s_ += dt_s;
    shown_rad_ += rate_radps * dt_s;
  }
  /// The first reading below the limit, after `last` at the limit: the turn that was missed. most_radps bounds its
  /// mean.
  float end(float rate_radps, float last_radps, float most_radps, float dt_s) {
    const float exit_radps2 = base::max(last_radps - rate_radps, 0.0F) / dt_s;
    const float span_s = clipped_s_ + dt_s;
    const float bulge_rad = (slope_radps2_ + exit_radps2) * span_s * span_s * (1.0F / 12.0F);
    const float chord_rad = 0.5F * (entry_radps_ + rate_radps) * clipped_s_;
    clipped_s_ = 0.0F;
    return base::clamp(chord_rad + bulge_rad - shown_rad_, 0.0F, most_radps * span_s);
  }
  static constexpr auto members(auto& self) {
    return base::members(self.clipped_s_, self.shown_rad_, self.entry_radps_, self.slope_radps2_);
  }

 private:
  float clipped_s_ = 0.0F, shown_rad_ = 0.0F, entry_radps_ = 0.0F, slope_radps2_ = 0.0F;
};

/// The three axes, and the rate as a whole where a driver reports clipping that the mean of an interval hides.
class ClippedTurn {
 public:
  struct Missed {
    Vector3 turn_b_rad = Vector3::Zero();
    float sigma_rad = 0.0F;  ///< 1 sigma of the attitude after this turn
  };

  explicit ClippedTurn(float range_radps) { set_range(range_radps); }
  void set_range(float range_radps) {
    range_radps_ = range_radps;
    limit_radps_ = SensorRange::kRangeShare * range_radps;
  }

  /// True when a span at the limit has ended with this reading; `missed` then holds its turn. w2: the rate squared.
  [[gnu::always_inline]] inline bool step(const Vector3& w_b_radps, float w2, bool reported, float dt_s,
                                          Missed& missed) {
    const bool near = reported || active_ || w2 >= limit_radps_ * limit_radps_;
    const bool ended = near && judge(w_b_radps, reported, dt_s, missed);
    before_ = last_;
    last_ = w_b_radps;
    return ended;
  }
  [[nodiscard]] const Vector3& rate_b_radps() const { return last_; }  ///< the last reading
  static constexpr auto members(auto& self) {
    return base::members(base::in_turns(self.spans_), base::in_turns(self.last_), base::in_turns(self.before_),
                         base::in_turns(self.range_radps_), base::in_turns(self.limit_radps_), self.hidden_s_,
                         self.hidden_radps2_, self.active_);
  }

 private:
  [[gnu::noinline]] bool judge(const Vector3& w, bool reported, float dt_s, Missed& missed) {
    missed = {};
    active_ = false;
    bool below = true;
    for (int i = 0; i < 3; ++i) {
      missed.turn_b_rad(i) = follow(spans_[static_cast<std::size_t>(i)], w(i), i, dt_s);
      missed.sigma_rad += base::abs(missed.turn_b_rad(i));
      below = below && base::abs(w(i)) < limit_radps_;
    }
    missed.sigma_rad += hide(w, reported && below, dt_s);
    return missed.sigma_rad > 0.0F;
  }
  /// One axis: the turn about it that a span has missed when it ends with this reading, or 0.
  float follow(ClippedSpan& span, float rate, int axis, float dt_s) {
    // The side is that of the reading at the limit: this one, or the last.
    const float side = (span.active() ? last_(axis) : rate) < 0.0F ? -1.0F : 1.0F;
    const float now = side * rate, last = side * last_(axis);
    float turn_rad = 0.0F;
    if (now >= limit_radps_ && span.active())
      span.extend(now, dt_s);
    else if (now >= limit_radps_)
      span.begin(now, last, side * before_(axis), dt_s);
    else if (span.active())
      turn_rad = side * span.end(now, last, range_radps_, dt_s);
    active_ = active_ || span.active();
    return turn_rad;
  }
  /// The turn that a span of reported intervals may hide, by the steepest change of the rate in it.
  float hide(const Vector3& w, bool hidden, float dt_s) {
    const bool ends = hidden_s_ > 0.0F && !hidden;
    if (!hidden && !ends) return 0.0F;
    const Vector3 change = w - last_;
    const float slope_radps2 = base::sqrt(dot(change, change)) / dt_s;
    const bool begins = !(hidden_s_ > 0.0F);
    if (begins) hidden_s_ = dt_s;
    hidden_radps2_ = begins ? slope_radps2 : base::max(hidden_radps2_, slope_radps2);
    if (!ends) {
      hidden_s_ += dt_s;
      active_ = true;
      return 0.0F;
    }
    const float hidden_rad = base::min(hidden_radps2_ * hidden_s_ * (1.0F / 6.0F), range_radps_) * hidden_s_;
    hidden_s_ = 0.0F;
    return hidden_rad;
  }

  std::array<ClippedSpan, 3> spans_;
  Vector3 last_ = Vector3::Zero(), before_ = Vector3::Zero();
  float range_radps_ = 0.0F, limit_radps_ = 0.0F;
  float hidden_s_ = 0.0F, hidden_radps2_ = 0.0F;
  bool active_ = false;
};

}  // namespace tetap::filter
