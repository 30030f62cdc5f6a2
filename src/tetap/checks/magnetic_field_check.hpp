// SPDX-License-Identifier: Apache-2.0
// Magnetic field against the Earth's. The known field is the first one found, of the configured strength where there is
// one. A sample of another strength or dip is disturbed, and left out. Another field becomes the known one after it
// stayed the same through a stretch of motion: no magnet on the way does that.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/base/members.hpp"
#include "tetap/checks/persistence.hpp"
#include "tetap/param/parameters.hpp"

#include <cstdint>

namespace tetap::checks {

class MagneticFieldCheck {
 public:
  /// In the plane of the magnetic meridian.
  struct Field {
    float horizontal_uT = 0;
    float up_uT = 0;
  };

  /// Squared distance of the sample from the known field, in units of the allowed one; above 1 (or NaN): disturbed.
  [[gnu::noinline]] float update(const Field& f, bool moving, base::Micros stamp, const param::MagneticParameters& n) {
    const base::Micros since = stamp - last_;
    last_ = stamp;
    renewed_ = false;
    const float off = compare(f, moving && since <= kGap ? base::seconds(since) : 0.0F, n);
    if (!(off <= 1.0F) || since > kGap) unchanged_since_ = stamp;
    return off;
  }
  /// The last update() made another field the known one.
  [[nodiscard]] bool renewed() const { return renewed_; }

  /// Headings are trusted until they have contradicted better sensors for `after`, and again when they have agreed for
  /// as long.
  [[nodiscard]] bool trusted() const { return !distrusted_; }
  /// Samples come, are not trusted, and may have led the heading astray.
  [[nodiscard]] bool is_suspect(base::Micros at) const { return distrusted_ && !older(last_, at, kGap); }
  /// True: the magnetometer contradicted for that long, or agreed for as long while it was not trusted.
  [[nodiscard]] bool trust_changes(bool agrees, base::Micros stamp, base::Micros after) {
    if (agrees == trusted()) unchanged_since_ = stamp;
    return stamp - unchanged_since_ >= after;
  }
  void set_trusted(bool trusted, base::Micros stamp) { distrusted_ = !trusted, unchanged_since_ = stamp; }
  /// Stamp of the last sample; 0: none.
  [[nodiscard]] base::Micros last() const { return last_; }

  static constexpr auto members(auto& self) {
    return base::members(self.known_field_, self.other_field_, self.other_s_, self.known_, self.distrusted_,
                         self.renewed_, self.last_, self.unchanged_since_);
  }

 private:
  static constexpr base::Micros kGap{1'000'000};  ///< a longer silence ends every comparison

  float compare(const Field& f, float moved_s, const param::MagneticParameters& n) {
    if (!known_) {
      const float off = strength_apart(f, n);
      if (off <= 1.0F) known_field_ = other_field_ = f, known_ = true;
      return off;
    }
    const float off = apart(f, known_field_, n);
    if (off <= 1.0F) {
      other_s_ = 0;
      return off;
    }
    if (!(apart(f, other_field_, n) <= 1.0F && strength_apart(f, n) <= 1.0F)) {
      other_field_ = f;
      other_s_ = 0;
      return off;
    }
    constexpr float kShare = 0.02F;
    other_field_.horizontal_uT += kShare * (f.horizontal_uT - other_field_.horizontal_uT);
    other_field_.up_uT += kShare * (f.up_uT - other_field_.up_uT);
    other_s_ += moved_s;
    if (other_s_ < n.field_new_s) return off;
    known_field_ = other_field_;
    other_s_ = 0;
    renewed_ = true;
    return apart(f, known_field_, n);
  }
  /// Squared distance from the configured strength; 0 where none is configured.
  static float strength_apart(const Field& f, const param::MagneticParameters& n) {
    if (!(n.norm_uT > 0.0F)) return 0.0F;
    const float norm = base::sqrt(f.horizontal_uT * f.horizontal_uT + f.up_uT * f.up_uT);
    const float strength = (norm / n.norm_uT - 1.0F) / n.norm_share;
    return strength * strength;
  }
  static float apart(const Field& f, const Field& from, const param::MagneticParameters& n) {
    const float f2 = f.horizontal_uT * f.horizontal_uT + f.up_uT * f.up_uT;
    const float from2 = from.horizontal_uT * from.horizontal_uT + from.up_uT * from.up_uT;
    const float strength = (base::sqrt(f2 / from2) - 1.0F) / n.norm_share;
    const float across = from.horizontal_uT * f.up_uT - from.up_uT * f.horizontal_uT;
    const float along = from.horizontal_uT * f.horizontal_uT + from.up_uT * f.up_uT;
    const float dip = base::atan2(across, along) / n.dip_rad;
    return strength * strength + dip * dip;
  }

  Field known_field_, other_field_;  ///< the second: a disturbed one that lasts
  float other_s_ = 0;                ///< time in motion that the other field has lasted
  bool known_ = false, distrusted_ = false, renewed_ = false;
  base::Micros last_;             ///< stamp of the last sample; 0: none
  base::Micros unchanged_since_;  ///< last stamp at which the trust was as it should be, or the field disturbed
};

}  // namespace tetap::checks
