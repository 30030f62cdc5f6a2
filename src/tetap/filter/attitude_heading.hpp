// SPDX-License-Identifier: Apache-2.0
// Heading from a magnetometer, apart from inclination: one angle about the vertical, by a Kalman filter of one state.
// Horizontal and vertical part of the field, which no heading changes, are compared with a reference. A disturbance
// that moves them turns the field by about as much, so the deviation is the sigma of the added error. Its variance
// enters squared, for a disturbance lasts: the weight is that of Geman and McClure (1987, Bull. Int. Stat. Inst. 52).
// Turning alone shows that a field is homogeneous: the reference forgets by the angle that the body turns, not by time.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/filter/attitude_options.hpp"
#include "tetap/filter/low_pass.hpp"

namespace tetap::filter {

class MagneticHeading {
 public:
  explicit MagneticHeading(const AttitudeOptions& o)
      : per_deviation2_(1.0F / (o.field_deviation_share * o.field_deviation_share)),
        per_turn_(1.0F / o.field_turn_rad),
        per_tau_(1.0F / o.tau_heading_s),
        declination_(base::sincos(o.declination_rad)) {}

  /// m_l: the field in level axes, heading free. rate: how fast the body turns. level_variance: that of the vertical,
  /// in units of the settled one. The dip of the field turns an error of the level into one of heading.
  void step(const Vector3& m_l, float rate_radps, float level_variance, float dt_s) {
    const float h2 = m_l(0) * m_l(0) + m_l(1) * m_l(1);
    const float horizontal = base::sqrt(h2);
    if (!(horizontal > 0.0F)) return;
    const float spread = compare({horizontal, m_l(2)}, rate_radps, dt_s);
    // Variances are in units of the settled one; the noise of a sample without disturbance is 1 / share of those.
    const float share = dt_s * per_tau_;
    p_ += share;
    const float ratio = p_ * share / (spread * spread * level_variance);
    const float rest = 1.0F / (1.0F + ratio);
    const float gain = ratio * rest;
    p_ *= rest;
    if (!(gain > 0.0F)) return;
    // Cosine and sine of the turn that brings the field to the declination's direction, by the half-angle formula
    // t = tan(turn/2). A share of a turn is that share of t. The rule is exact for all of the turn and for small turns.
    const float c = half_.cos * half_.cos - half_.sin * half_.sin;
    const float s = 2.0F * half_.cos * half_.sin;
    const float east = c * m_l(0) - s * m_l(1);
    const float north = s * m_l(0) + c * m_l(1);
    const float sine = east * declination_.cos - north * declination_.sin;
    const float cosine = horizontal + (east * declination_.sin + north * declination_.cos);
    // Nearly opposite a share of t would be most of the turn; the start alone goes all the way.
    const float most = gain < 0.9F ? 4.0F : 1e5F;
    const float limit = most * cosine;
    const float half_tan = sine >= limit ? most : sine <= -limit ? -most : sine / cosine;
    turn(gain * half_tan);
  }

  /// The gyroscope missed a turn: the time constant shrinks by the factor 1 + sigmas.
  void lose(float sigmas) { p_ += sigmas; }

  [[nodiscard]] bool known() const { return known_; }
  [[nodiscard]] bool disturbed() const { return disturbed_share_ > 0.5F; }
  [[nodiscard]] float disturbed_s() const { return disturbed_s_; }
  /// Level axes to n: the turn about the vertical, then q.
  [[nodiscard]] Quaternion turned(const Quaternion& q_lb) const {
    const float w = half_.cos, z = half_.sin;
    return {w * q_lb.w - z * q_lb.z, w * q_lb.x - z * q_lb.y, w * q_lb.y + z * q_lb.x, w * q_lb.z + z * q_lb.w};
  }
  static constexpr auto members(auto& self) {
    return base::members(base::in_turns(self.per_deviation2_), base::in_turns(self.per_turn_),
                         base::in_turns(self.per_tau_), base::in_turns(self.declination_), self.half_,
                         base::in_turns(self.reference_), self.p_, self.confirmed_s_, self.disturbed_s_,
                         self.disturbed_share_, self.known_, self.odd_);
  }

 private:
  using Field = Vector<float, 2>;  ///< horizontal, up

  /// The sigma of a sample, in units of an undisturbed one. The reference is the mean at first, and later forgets by
  /// turning. Its step is bounded however far a sample deviates, as that of a median (Huber 1964, Ann. Math. Stat. 35).
  /// Samples that contradict a reference for as long as others have confirmed it begin another one.
  [[gnu::always_inline]] inline float compare(const Field& sample, float rate_radps, float dt_s) {
    const float x = sample(0) - reference_(0), y = sample(1) - reference_(1);
    const float scale = reference_(0) * reference_(0) + kLeast2;
    const float spread = 1.0F + (x * x + y * y) / scale * per_deviation2_;
    // Half of the work at each sample, in turns, and as if for two: both are means over seconds.
    const float span_s = 2.0F * dt_s;
    odd_ = !odd_;
    if (odd_) {
      note(spread > kDisturbed, span_s);
      if (known_ && disturbed_s_ <= confirmed_s_) return spread;
      begin(sample, dt_s);
      return 1.0F;
    }
    const float news = rate_radps * span_s * per_turn_ + span_s / confirmed_s_;
    const float step = news / ((1.0F + news) * base::sqrt(spread));
    reference_(0) += step * x;
    reference_(1) += step * y;
    return spread;
  }

  void begin(const Field& sample, float dt_s) {
    reference_ = sample;
    confirmed_s_ = dt_s;
    disturbed_s_ = 0.0F;
    disturbed_share_ = 0.0F;
    known_ = true;
  }

  /// Counts the time of samples that confirm the reference, and of those that contradict it.
  void note(bool disturbed, float dt_s) {
    disturbed_share_ += dt_s / (kShareOver_s + dt_s) * ((disturbed ? 1.0F : 0.0F) - disturbed_share_);
    if (disturbed) {
      disturbed_s_ += dt_s;
      return;
    }
    confirmed_s_ = confirmed_s_ < kConfirmed_s ? confirmed_s_ + dt_s : confirmed_s_;
    disturbed_s_ = disturbed_s_ > 2.0F * dt_s ? disturbed_s_ - 2.0F * dt_s : 0.0F;
  }

  /// By an angle given as the tangent of its half.
  void turn(float half_tan) {
    const float c = half_.cos - half_.sin * half_tan;
    const float s = half_.sin + half_.cos * half_tan;
    const float scale = 1.0F / base::sqrt(c * c + s * s);
    half_ = {.sin = s * scale, .cos = c * scale};
  }

  static constexpr float kDisturbed = 5.0F;     ///< spread of a sample that is disturbed: its weight is 1/25
  static constexpr float kShareOver_s = 0.5F;   ///< time constant of the share of such samples
  static constexpr float kConfirmed_s = 60.0F;  ///< a longer confirmation counts no more
  static constexpr float kLeast2 = 1e-30F;
  static constexpr float kUnknown = 1e20F;  ///< variance of a heading that no sample has set
  float per_deviation2_, per_turn_, per_tau_;
  base::SinCos declination_;
  base::SinCos half_{.sin = 0.0F, .cos = 1.0F};  ///< half the heading of the level axes
  Field reference_ = Field::Zero();
  float p_ = kUnknown;  ///< variance of the heading, in units of the settled one
  float confirmed_s_ = 0.0F, disturbed_s_ = 0.0F, disturbed_share_ = 0.0F;
  bool known_ = false, odd_ = false;
};

}  // namespace tetap::filter
