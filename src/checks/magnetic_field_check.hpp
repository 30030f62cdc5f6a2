// SPDX-License-Identifier: Apache-2.0
// Which magnetic field is the Earth's: the one found first, of the strength that is configured where one is. A sample
// whose strength or dip is another's is disturbed, and left out; another field becomes the known one when it has stayed
// the same through a stretch of motion, which no magnet on the way does. And whether the magnetometer is believed.
#pragma once

#include "base/math.hpp"
#include "base/time.hpp"
#include "sensor/magnetic_field.hpp"

#include <cstdint>

namespace tetap::checks {

class MagneticFieldCheck {
 public:
  /// In the plane of the magnetic meridian.
  struct Field {
    float horizontal_uT = 0;
    float up_uT = 0;
  };

  /// How far the sample is from the known field: squared, in units of what is allowed; above 1 (or NaN): disturbed.
  [[gnu::noinline]] float step(const Field& f, bool moving, base::Micros stamp, const param::MagneticParameters& n) {
    const base::Micros since = stamp - last_;
    last_ = stamp;
    renewed_ = false;
    const float off = compare(f, moving && since <= kGap ? base::seconds(since) : 0.0F, n);
    if (!(off <= 1.0F) || since > kGap) since_ = stamp;
    return off;
  }

  /// Another field has been taken for the known one by the last step().
  [[nodiscard]] bool renewed() const { return renewed_; }

  /// Whether its headings are used. They stop to be when they have contradicted for `after` what better sensors say,
  /// and are again when they have agreed for as long.
  [[nodiscard]] bool believed() const { return !refused_; }
  /// It is heard, and may have led the heading astray.
  [[nodiscard]] bool misleads(base::Micros at) const { return refused_ && at - last_ <= kGap; }
  /// True: it has contradicted for that long, or agreed while it was not believed.
  [[nodiscard]] bool lasts(bool agrees, base::Micros stamp, base::Micros after) {
    if (agrees == believed()) since_ = stamp;
    return stamp - since_ >= after;
  }
  void believe(bool agrees, base::Micros stamp) { refused_ = !agrees, since_ = stamp; }

  template <class Sink>
  void hash_state(Sink&& sink) const {
    for (const Field& f : {field_, other_}) {
      sink(f.horizontal_uT);
      sink(f.up_uT);
    }
    sink(other_s_);
    sink(last_.us);
    sink(since_.us);
    sink(static_cast<std::uint32_t>((known_ ? 1U : 0U) | (refused_ ? 2U : 0U)));
  }

 private:
  static constexpr base::Micros kGap{1'000'000};

  float compare(const Field& f, float moved_s, const param::MagneticParameters& n) {
    if (!known_) {
      const float off = strength_apart(f, n);
      if (off <= 1.0F) field_ = other_ = f, known_ = true;
      return off;
    }
    const float off = apart(f, field_, n);
    if (off <= 1.0F) {
      other_s_ = 0;
      return off;
    }
    if (!(apart(f, other_, n) <= 1.0F && strength_apart(f, n) <= 1.0F)) {
      other_ = f;
      other_s_ = 0;
      return off;
    }
    constexpr float kShare = 0.02F;
    other_.horizontal_uT += kShare * (f.horizontal_uT - other_.horizontal_uT);
    other_.up_uT += kShare * (f.up_uT - other_.up_uT);
    other_s_ += moved_s;
    if (other_s_ < n.field_new_s) return off;
    field_ = other_;
    other_s_ = 0;
    renewed_ = true;
    return apart(f, field_, n);
  }
  /// Squared as well.
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

  Field field_, other_;
  float other_s_ = 0;
  bool known_ = false, refused_ = false, renewed_ = false;
  base::Micros last_, since_;
};

}  // namespace tetap::checks
