// SPDX-License-Identifier: Apache-2.0
// Puts the NMEA sentences of one time of day together into one report: GGA, RMC, VTG, GSA, GST and ZDA of any talker.
// A sentence with another time begins the next epoch; VTG and GSA have none and belong to the epoch they come in.
// NMEA 0183 v4.1, sec. 6.3; u-blox F9 HPG 1.32 interface description, sec. 2.7.
#pragma once

#include "base/trig.hpp"
#include "drivers/gnss/epoch_end.hpp"
#include "drivers/gnss/health.hpp"
#include "drivers/gnss/nmea/sentences.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>

namespace tetap::drivers::gnss::nmea {

class Epoch {
 public:
  template <class Sink>
  constexpr void on_sentence(Text text, Health& health, Sink& sink) {
    Fields f(text);
    const auto kind = sentence_of(f[0]);
    if (!kind) return;
    // Nothing is taken from a sentence of which one field is wrong.
    Parts parts = parts_;
    Utc stamp{};
    const bool timed = parse(*kind, f, parts, stamp);
    if (!f.ok()) return health.add(Reason::kNmeaField);
    if (!timed && !is_timed(*kind) && !open_) return health.add(Reason::kNoEpoch);
    if (is_timed(*kind) && (!open_ || starts_epoch(*kind, timed, stamp))) {
      begin(sink);
      parts = {};
      parse(*kind, f, parts, stamp);
      if (timed) set_time(stamp);
    }
    if (timed) parts.stamped = true;
    if (stamp.date_valid) set_date(stamp);
    parts_ = parts;
    seen_ |= 1U << static_cast<unsigned>(*kind);
    if (end_.arrived(static_cast<std::size_t>(*kind))) finish(sink);
  }

  /// Hands on what there is: a new epoch began, or the input is at its end.
  template <class Sink>
  constexpr void finish(Sink& sink) {
    if (!open_ || done_) return;
    done_ = true;
    if (has(Sentence::kGga) || has(Sentence::kRmc)) sink(report());
  }

 private:
  static constexpr std::uint32_t bit(Sentence s) { return 1U << static_cast<unsigned>(s); }
  [[nodiscard]] constexpr bool has(Sentence s) const { return (seen_ & bit(s)) != 0; }
  static constexpr bool is_timed(Sentence s) { return s != Sentence::kVtg && s != Sentence::kGsa; }

  [[nodiscard]] constexpr bool starts_epoch(Sentence kind, bool timed, const Utc& t) const {
    if (!timed) return has(kind);  // before the first fix the time is empty: the same sentence again is the next epoch
    if (!parts_.stamped) return has(kind);
    return t.hour != utc_.hour || t.minute != utc_.minute || t.second != utc_.second || t.nano != utc_.nano;
  }

  template <class Sink>
  constexpr void begin(Sink& sink) {
    finish(sink);
    end_.begin();
    parts_ = {};
    seen_ = 0;
    open_ = true;
    done_ = false;
    utc_.time_valid = false;
  }

  /// The date goes on over midnight until a sentence carries the next date.
  constexpr void set_time(const Utc& t) {
    if (utc_.date_valid && t.hour < 12 && utc_.hour >= 12) to_next_day(utc_);
    utc_.hour = t.hour;
    utc_.minute = t.minute;
    utc_.second = t.second;
    utc_.nano = t.nano;
    utc_.time_valid = true;
  }
  constexpr void set_date(const Utc& t) {
    utc_.year = t.year;
    utc_.month = t.month;
    utc_.day = t.day;
    utc_.date_valid = true;
  }

  /// GGA field 6: 0 none, 2 differential, 4 RTK, 5 RTK float, 6 dead reckoning, 7 typed in, 8 simulator. The last three
  /// measure nothing; nor does a receiver that uses no satellite, nor what RMC marks with V, or with one of the letters
  /// of these.
  [[nodiscard]] constexpr sensor::GnssFix fix() const {
    using sensor::GnssFix;
    const Parts& p = parts_;
    const bool known = p.quality || p.rmc_status != '\0';
    if (!known || (p.rmc_status != '\0' && p.rmc_status != 'A')) return GnssFix::kNone;
    if (p.rmc_mode == 'N' || p.rmc_mode == 'E' || p.rmc_mode == 'M' || p.rmc_mode == 'S') return GnssFix::kNone;
    const int quality = p.quality.value_or(1);
    if (quality == 0 || quality >= 6 || p.satellites == 0) return GnssFix::kNone;
    if (p.dimension && *p.dimension == 1) return GnssFix::kNone;
    if (quality == 4) return GnssFix::kRtkFixed;
    if (quality == 5) return GnssFix::kRtkFloat;
    if (p.dimension ? *p.dimension == 2 : base::is_nan(p.altitude_m)) return GnssFix::k2d;
    return quality == 2 ? GnssFix::kDifferential : GnssFix::k3d;
  }

  [[nodiscard]] constexpr Report report() const {
    const Parts& p = parts_;
    Report r{.protocol = Protocol::kNmea, .fix = fix(), .utc = utc_};
    r.satellites = static_cast<std::uint8_t>(p.satellites.value_or(0));
    const bool gga = p.gga_latitude && p.gga_longitude, rmc = p.rmc_latitude && p.rmc_longitude;
    if (gga || rmc) {
      r.latitude_2ndeg = gga ? *p.gga_latitude : *p.rmc_latitude;
      r.longitude_2ndeg = gga ? *p.gga_longitude : *p.rmc_longitude;
      r.has_position = true;
    }
    r.height_msl_m = p.altitude_m;
    r.height_m = p.altitude_m + p.separation_m;
    r.horizontal_acc_m = p.horizontal_acc_m;
    r.vertical_acc_m = p.vertical_acc_m;
    // RMC carries its time of validity and VTG none: VTG belongs to the epoch in which it arrives.
    const bool rmc_speed = !base::is_nan(p.speed_mps);
    r.speed_mps = rmc_speed ? p.speed_mps : p.vtg_speed_mps;
    r.course_rad = rmc_speed ? p.course_rad : p.vtg_course_rad;
    // At standstill receivers leave the course empty; a velocity of zero has none.
    if (!base::is_nan(r.speed_mps) && !(r.speed_mps > 0)) {
      r.v_n_mps = {0, 0, base::kNan};
    } else if (!base::is_nan(r.speed_mps) && !base::is_nan(r.course_rad)) {
      const auto course = base::sincos(r.course_rad);
      r.v_n_mps = {r.speed_mps * course.sin, r.speed_mps * course.cos, base::kNan};
    }
    r.pdop = p.pdop;
    r.hdop = base::is_nan(p.hdop) ? p.gga_hdop : p.hdop;
    r.vdop = p.vdop;
    return r;
  }

  Parts parts_{};
  Utc utc_{};  ///< time of this epoch; the date is kept for the next
  EpochEnd<kSentences> end_{};
  std::uint32_t seen_ = 0;
  bool open_ = false;
  bool done_ = false;
};

}  // namespace tetap::drivers::gnss::nmea
