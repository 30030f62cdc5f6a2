// SPDX-License-Identifier: Apache-2.0
// Puts the NMEA sentences of one time of day together into one report: GGA, RMC, VTG, GSA, GST and ZDA of any talker.
// A sentence with another time begins the next epoch; VTG and GSA have none and belong to the epoch they come in.
// NMEA 0183 v4.1, sec. 6.3; u-blox F9 HPG 1.32 interface description, sec. 2.7.
#pragma once

#include "base/trig.hpp"
#include "drivers/gnss/epoch_end.hpp"
#include "drivers/gnss/health.hpp"
#include "drivers/gnss/nmea/fields.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace tetap::drivers::gnss::nmea {

enum class Sentence : std::uint8_t { kGga, kRmc, kVtg, kGsa, kGst, kZda, kCount };
inline constexpr std::size_t kSentences = static_cast<std::size_t>(Sentence::kCount);
inline constexpr std::array<std::array<char, 3>, kSentences> kFormatters{
    {{'G', 'G', 'A'}, {'R', 'M', 'C'}, {'V', 'T', 'G'}, {'G', 'S', 'A'}, {'G', 'S', 'T'}, {'Z', 'D', 'A'}}};

/// "GPGGA", "GNRMC", ...; sentences of one maker begin with P and are not for us.
[[nodiscard]] constexpr std::optional<Sentence> sentence_of(Text address) {
  if (address.size() != 5 || address[0] == 'P') return {};
  for (std::size_t i = 0; i < kSentences; ++i) {
    const auto& f = kFormatters[i];
    if (address[2] == f[0] && address[3] == f[1] && address[4] == f[2]) return static_cast<Sentence>(i);
  }
  return {};
}

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
  /// What the sentences of an epoch said.
  struct Parts {
    std::optional<std::int64_t> gga_latitude, gga_longitude, rmc_latitude, rmc_longitude;
    std::optional<std::int32_t> quality, satellites, dimension;
    char rmc_status = '\0', rmc_mode = '\0';
    float altitude_m = base::kNan, separation_m = base::kNan;
    float speed_mps = base::kNan, course_rad = base::kNan, vtg_speed_mps = base::kNan, vtg_course_rad = base::kNan;
    float gga_hdop = base::kNan, pdop = base::kNan, hdop = base::kNan, vdop = base::kNan;
    float horizontal_acc_m = base::kNan, vertical_acc_m = base::kNan;
    bool stamped = false;
  };

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

  /// The date goes on over midnight until a sentence says it again.
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

  /// True: the sentence had a time.
  static constexpr bool parse(Sentence kind, Fields& f, Parts& p, Utc& t) {
    constexpr float kMpsPerKnot = 1852.0F / 3600.0F;
    constexpr float kRadPerDeg = 0.017453293F;
    switch (kind) {
      case Sentence::kGga: {
        p.quality = f.integer(6, 0, 9);
        // Without a fix the place is empty, the last one, or nonsense such as 8960.0000.
        if (p.quality.value_or(0) != 0) {
          p.gga_latitude = f.angle(2, 'N', 'S', 90);
          p.gga_longitude = f.angle(4, 'E', 'W', 180);
          p.altitude_m = f.milli(9);
          p.separation_m = f.milli(11);
        }
        p.satellites = f.integer(7, 0, 255);
        p.gga_hdop = f.milli(8);
        return f.time(1, t);
      }
      case Sentence::kRmc: {
        p.rmc_status = f.letter(2);
        if (p.rmc_status == 'A') {
          p.rmc_latitude = f.angle(3, 'N', 'S', 90);
          p.rmc_longitude = f.angle(5, 'E', 'W', 180);
          p.speed_mps = f.ten_micro(7) * kMpsPerKnot;
          p.course_rad = f.ten_micro(8) * kRadPerDeg;
        }
        if (const auto ddmmyy = f[9].size() == 6 ? f.integer(9, 0, 311'299) : std::nullopt) {
          const int yy = *ddmmyy % 100;
          f.date(*ddmmyy / 10'000, *ddmmyy / 100 % 100, yy + (yy < 80 ? 2000 : 1900), t);
        }
        p.rmc_mode = f.letter(12);
        return f.time(1, t);
      }
      case Sentence::kVtg:
        // Before NMEA 2.0 there were no letters after the numbers.
        if (f.letter(2) == 'T') {
          p.vtg_speed_mps = f.ten_micro(5) * kMpsPerKnot;
          p.vtg_course_rad = f.ten_micro(1) * kRadPerDeg;
        }
        return false;
      case Sentence::kGsa:
        p.dimension = f.integer(2, 0, 3);
        p.pdop = f.milli(15);
        p.hdop = f.milli(16);
        p.vdop = f.milli(17);
        return false;
      case Sentence::kGst: {
        const float lat = f.milli(6), lon = f.milli(7);
        p.horizontal_acc_m = base::sqrt(0.5F * (lat * lat + lon * lon));
        p.vertical_acc_m = f.milli(8);
        return f.time(1, t);
      }
      case Sentence::kZda: {
        const auto day = f.integer(2, 0, 31), month = f.integer(3, 0, 12), year = f.integer(4, 0, 9999);
        if (day && month && year) f.date(*day, *month, *year, t);
        return f.time(1, t);
      }
      case Sentence::kCount:
        break;
    }
    return false;
  }

  /// GGA field 6: 0 none, 2 differential, 4 RTK, 5 RTK float, 6 dead reckoning, 7 typed in, 8 simulator. The last three
  /// measure nothing; nor does a receiver that uses no satellite, nor what RMC marks with V, or with one of the letters
  /// of these.
  [[nodiscard]] constexpr app::GnssFix fix() const {
    using app::GnssFix;
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
    // RMC says what time it speaks of, VTG does not: it comes where it comes.
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
  Utc utc_{};  ///< of this epoch; its date goes on
  EpochEnd<kSentences> end_{};
  std::uint32_t seen_ = 0;
  bool open_ = false;
  bool done_ = false;
};

}  // namespace tetap::drivers::gnss::nmea
