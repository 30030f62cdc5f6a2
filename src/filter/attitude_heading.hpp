// SPDX-License-Identifier: Apache-2.0
// Heading from a magnetometer, apart from inclination: one angle about the vertical. A field whose strength or dip is
// not that of the reference is left out; another homogeneous field becomes the reference only after motion in it, and
// a disturbance that does not end is followed in the end (the rules: Laidig & Seel 2023, sec. 3.6). Strength and dip
// are compared as one vector in the plane of the meridian, so no arcsine is needed.
#pragma once

#include "filter/attitude_options.hpp"
#include "filter/low_pass.hpp"

namespace tetap::filter {

class MagneticHeading {
 public:
  explicit MagneticHeading(const AttitudeOptions& o)
      : norm2_low_((1.0F - o.field_norm_share) * (1.0F - o.field_norm_share)),
        norm2_high_((1.0F + o.field_norm_share) * (1.0F + o.field_norm_share)),
        tan_dip_(base::sin(o.field_dip_rad) / base::cos(o.field_dip_rad)),
        declination_(base::sincos(o.declination_rad)) {}

  /// m_l: the field in axes that are level, heading free. turning: the body moves enough to part a field from a magnet.
  void step(const AttitudeOptions& o, const Vector3& m_l, bool turning, float dt_s) {
    const float h2 = m_l(0) * m_l(0) + m_l(1) * m_l(1);
    const float horizontal = base::sqrt(h2);
    if (!(horizontal > 0.0F)) return;
    // Strength and dip are not compared while the level is still being found.
    if (average_s_ >= kSettled_s || !started_) check_field(o, {horizontal, m_l(2)}, turning, dt_s);
    const float gain = weight(o, dt_s);
    if (!(gain > 0.0F)) return;
    // Cosine and sine of the turn that brings the field to the declination's direction, by the half-angle formula
    // t = tan(turn/2): a share of a turn is that share of t, exact for all of it and for small ones.
    const float c = half_.cos * half_.cos - half_.sin * half_.sin;
    const float s = 2.0F * half_.cos * half_.sin;
    const float east = c * m_l(0) - s * m_l(1);
    const float north = s * m_l(0) + c * m_l(1);
    const float sine = east * declination_.cos - north * declination_.sin;
    const float cosine = horizontal + (east * declination_.sin + north * declination_.cos);
    // Nearly opposite a share of t would be most of the turn; the start alone goes all the way.
    const float most = gain < 1.0F ? 4.0F : 1e5F;
    const float limit = most * cosine;
    const float half_tan = sine >= limit ? most : sine <= -limit ? -most : sine / cosine;
    turn(gain * half_tan);
  }

  /// The heading that the gyroscope carried is lost: a mean over the samples again, as if begun age_s ago.
  void average_anew(float age_s) {
    average_s_ = age_s;
    rejected_s_ = undisturbed_s_ = 0.0F;
    disturbed_ = false;
  }

  [[nodiscard]] bool known() const { return started_; }
  [[nodiscard]] bool disturbed() const { return disturbed_; }
  [[nodiscard]] float disturbed_s() const { return rejected_s_; }
  /// Level axes to n: the turn about the vertical, then q.
  [[nodiscard]] Quaternion turned(const Quaternion& q_lb) const {
    const float w = half_.cos, z = half_.sin;
    return {w * q_lb.w - z * q_lb.z, w * q_lb.x - z * q_lb.y, w * q_lb.y + z * q_lb.x, w * q_lb.z + z * q_lb.w};
  }

 private:
  using Field = Vector<float, 2>;  ///< horizontal, up

  [[nodiscard]] bool alike(const Field& a, const Field& b) const {
    const float a2 = a(0) * a(0) + a(1) * a(1);
    const float b2 = b(0) * b(0) + b(1) * b(1);
    const float across = a(0) * b(1) - a(1) * b(0);
    const float along = tan_dip_ * (a(0) * b(0) + a(1) * b(1));
    return a2 > norm2_low_ * b2 && a2 < norm2_high_ * b2 && across < along && -across < along;
  }

  /// Half of the work per sample, in turns: against the reference, and towards the next one.
  [[gnu::always_inline]] inline void check_field(const AttitudeOptions& o, const Field& sample, bool turning,
                                                 float dt_s) {
    if (!started_) field_.start(sample), candidate_ = sample;
    const float span_s = 2.0F * dt_s;
    const float share = span_s / (o.tau_reference_s + span_s);
    odd_ = !odd_;
    if (odd_) {
      field_.step(sample, LowPass<2>::factor(o.tau_field_s, span_s));
      compare(o, share, span_s);
    } else {
      look_for_reference(o, turning, share, span_s);
    }
  }
  void compare(const AttitudeOptions& o, float share, float span_s) {
    if (!has_reference_ || !alike(field_.value, reference_)) {
      undisturbed_s_ = 0.0F;
      disturbed_ = has_reference_;
      return;
    }
    undisturbed_s_ += span_s;
    if (undisturbed_s_ < o.field_undisturbed_s) return;
    undisturbed_s_ = o.field_undisturbed_s;
    disturbed_ = false;
    reference_ += share * (field_.value - reference_);
  }
  /// Motion alone shows that a field is the same everywhere; until there was some, the first one has to do.
  void look_for_reference(const AttitudeOptions& o, bool turning, float share, float span_s) {
    if (!alike(field_.value, candidate_)) {
      candidate_ = field_.value;
      candidate_s_ = moved_s_ = 0.0F;
      return;
    }
    candidate_ += share * (field_.value - candidate_);
    if (turning || !has_reference_) candidate_s_ += span_s;
    if (turning) moved_s_ += span_s;
    const bool moved = moved_s_ >= o.field_first_s;
    if (has_reference_ && !disturbed_) {
      if (moved) provisional_ = false;
      candidate_s_ = 0.0F;
    } else if (candidate_s_ >= (has_reference_ && !provisional_ ? o.field_new_s : o.field_first_s)) {
      provisional_ = !moved;
      reference_ = candidate_;
      has_reference_ = true;
      disturbed_ = false;
      undisturbed_s_ = o.field_undisturbed_s;
      candidate_s_ = 0.0F;
    }
  }

  /// Share of the error to take off: a mean over the samples at first, then dt/tau, less while disturbed.
  [[nodiscard]] float weight(const AttitudeOptions& o, float dt_s) {
    const float steady = dt_s / (o.tau_heading_s + dt_s);
    if (!started_) {
      started_ = true;
      average_s_ = dt_s;
      return 1.0F;
    }
    if (disturbed_) {
      if (rejected_s_ < (provisional_ ? o.field_provisional_s : o.field_reject_s)) {
        rejected_s_ += dt_s;
        return 0.0F;
      }
      return steady / o.field_reject_factor;
    }
    rejected_s_ = rejected_s_ > 2.0F * dt_s ? rejected_s_ - 2.0F * dt_s : 0.0F;
    if (average_s_ >= o.tau_heading_s) return steady;
    average_s_ += dt_s;
    return average_s_ > 3.0F * dt_s ? 3.0F * dt_s / average_s_ : 1.0F;  // the last samples count most
  }

  /// By an angle given as the tangent of its half.
  void turn(float half_tan) {
    const float c = half_.cos - half_.sin * half_tan;
    const float s = half_.sin + half_.cos * half_tan;
    const float scale = 1.0F / base::sqrt(c * c + s * s);
    half_ = {.sin = s * scale, .cos = c * scale};
  }

  static constexpr float kSettled_s = 1.0F;
  float norm2_low_, norm2_high_;
  float tan_dip_;
  base::SinCos declination_;
  base::SinCos half_{.sin = 0.0F, .cos = 1.0F};  ///< half the heading of the level axes
  LowPass<2> field_;
  Field reference_ = Field::Zero(), candidate_ = Field::Zero();
  float undisturbed_s_ = 0.0F, candidate_s_ = 0.0F, rejected_s_ = 0.0F, average_s_ = 0.0F, moved_s_ = 0.0F;
  bool started_ = false, has_reference_ = false, disturbed_ = false, provisional_ = false, odd_ = false;
};

}  // namespace tetap::filter
