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
      : tan_dip_(base::sin(o.field_dip_rad) / base::cos(o.field_dip_rad)),
        declination_(base::sincos(o.declination_rad)) {}

  /// m_l: the field in axes that are level, heading free. turning: the body moves enough to tell a field from a magnet.
  void step(const AttitudeOptions& o, const Vector3& m_l, bool turning, float dt_s) {
    const float h2 = m_l(0) * m_l(0) + m_l(1) * m_l(1);
    if (!(h2 > 0.0F)) return;
    check_field(o, {base::sqrt(h2), m_l(2)}, turning, dt_s);
    const float gain = weight(o, dt_s);
    if (gain <= 0.0F) return;
    const float east = cos_ * m_l(0) - sin_ * m_l(1);
    const float north = sin_ * m_l(0) + cos_ * m_l(1);
    // The turn that brings it to where the declination says.
    const float error = base::atan2(declination_.cos * east - declination_.sin * north,
                                    declination_.sin * east + declination_.cos * north);
    turn(gain * error);
  }

  /// What the gyroscope carried is lost: a mean over the samples again, as if it had begun age_s ago.
  void average_anew(float age_s) { average_s_ = age_s; }

  [[nodiscard]] bool known() const { return started_; }
  [[nodiscard]] bool disturbed() const { return disturbed_; }
  [[nodiscard]] float disturbed_s() const { return rejected_s_; }
  /// Turns the level axes into n.
  [[nodiscard]] Quaternion q() const {
    // Half the angle without trigonometry; the branch keeps the root away from zero.
    return cos_ > -0.5F ? Quaternion{1.0F + cos_, 0.0F, 0.0F, sin_}.normalised()
                        : Quaternion{sin_, 0.0F, 0.0F, 1.0F - cos_}.normalised();
  }

 private:
  using Field = Vector<float, 2>;  ///< horizontal, up

  [[nodiscard]] bool alike(const AttitudeOptions& o, const Field& a, const Field& b) const {
    const float a2 = a(0) * a(0) + a(1) * a(1);
    const float b2 = b(0) * b(0) + b(1) * b(1);
    const float low = 1.0F - o.field_norm_share, high = 1.0F + o.field_norm_share;
    const float across = a(0) * b(1) - a(1) * b(0);
    const float along = a(0) * b(0) + a(1) * b(1);
    return a2 > low * low * b2 && a2 < high * high * b2 && base::abs(across) < tan_dip_ * along;
  }

  void check_field(const AttitudeOptions& o, const Field& sample, bool turning, float dt_s) {
    if (!started_) field_.start(sample), candidate_ = sample;
    field_.step(sample, LowPass<2>::factor(o.tau_field_s, dt_s));
    const Field& now = field_.value;
    const float share = dt_s / (o.tau_reference_s + dt_s);
    if (has_reference_ && alike(o, now, reference_)) {
      undisturbed_s_ += dt_s;
      if (undisturbed_s_ >= o.field_undisturbed_s) {
        undisturbed_s_ = o.field_undisturbed_s;
        disturbed_ = false;
        reference_ += share * (now - reference_);
      }
    } else {
      undisturbed_s_ = 0.0F;
      disturbed_ = has_reference_;
    }
    if (alike(o, now, candidate_)) {
      // Motion alone shows that a field is the same everywhere; until there was some, the first one has to do.
      if (turning || !has_reference_) candidate_s_ += dt_s;
      moved_s_ += turning ? dt_s : 0.0F;
      candidate_ += share * (now - candidate_);
      const float needed_s = !has_reference_ || provisional_ ? o.field_first_s : o.field_new_s;
      if ((!has_reference_ || disturbed_) && candidate_s_ >= needed_s) {
        provisional_ = !has_reference_ && moved_s_ < o.field_first_s;
        reference_ = candidate_;
        has_reference_ = true;
        disturbed_ = false;
        undisturbed_s_ = o.field_undisturbed_s;
        candidate_s_ = 0.0F;
      }
      // Confirmed by motion in it.
      if (provisional_ && !disturbed_ && moved_s_ >= o.field_first_s) provisional_ = false;
    } else {
      moved_s_ = 0.0F;
      candidate_ = now;
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
    return dt_s / average_s_;
  }

  void turn(float angle) {
    const base::SinCos by = base::sincos(angle);
    const float c = cos_ * by.cos - sin_ * by.sin;
    const float s = sin_ * by.cos + cos_ * by.sin;
    const float scale = 1.5F - 0.5F * (c * c + s * s);
    cos_ = c * scale;
    sin_ = s * scale;
  }

  float tan_dip_;
  base::SinCos declination_;
  float cos_ = 1.0F, sin_ = 0.0F;
  LowPass<2> field_;
  Field reference_ = Field::Zero(), candidate_ = Field::Zero();
  float undisturbed_s_ = 0.0F, candidate_s_ = 0.0F, rejected_s_ = 0.0F, average_s_ = 0.0F, moved_s_ = 0.0F;
  bool started_ = false, has_reference_ = false, disturbed_ = false, provisional_ = false;
};

}  // namespace tetap::filter
