// SPDX-License-Identifier: Apache-2.0
// Joins the NMEA sentences of one time of day in one report: GGA, GNS, RMC, VTG, GSA, GST and ZDA of any talker. A
// sentence with another time begins the next epoch. A second one of the same talker and kind does too: some receivers
// cut the fraction of the second off. VTG and GSA have no time and belong to the epoch they come in. NMEA 0183 v4.1,
// sec. 6.3; u-blox F9 HPG 1.32 interface description, sec. 2.7.
#pragma once

#include "drivers/gnss/epoch_end.hpp"
#include "drivers/gnss/health.hpp"
#include "drivers/gnss/nmea/sentences.hpp"
#include "tetap/base/crc.hpp"
#include "tetap/base/trig.hpp"

#include <array>
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
    if (!kind) return health.add(Reason::kUnread);
    // Nothing is taken from a sentence of which one field is wrong.
    Parts parts = parts_;
    Utc stamp{};
    const bool timed = parse(*kind, f, parts, stamp);
    if (!f.ok()) return health.add(Reason::kNmeaField);
    if (!timed && !is_timed(*kind) && !open_) return health.add(Reason::kNoEpoch);
    const Text address = f[0].first(2);
    const std::uint32_t sum = checksum(text);
    if (timed && sum == previous_sum_) return health.add(Reason::kRepeated);
    if (timed) previous_sum_ = sum;
    if (is_timed(*kind) && (!open_ || starts_epoch(*kind, timed, stamp, address))) {
      begin(timed && parts_.stamped && is_now(stamp), sums_[index(*kind)] != sum, health, sink);
      parts = {};
      parse(*kind, f, parts, stamp);
      if (timed) set_time(stamp);
    } else if (done_) {
      health.add(Reason::kLate);  // the end of the next epochs is learned from it all the same
    }
    if (timed) parts.stamped = true;
    if (stamp.date_valid) set_date(stamp);
    parts_ = parts;
    identify(*kind, address, sum);
    if (end_.arrived(index(*kind)) && !contradicted()) finish(health, sink);
  }

  /// Hands on the epoch: a new one began, or the input is at its end.
  template <class Sink>
  constexpr void finish(Health& health, Sink& sink) {
    if (!open_ || done_) return;
    done_ = true;
    if (!has(Sentence::kGga) && !has(Sentence::kGns) && !has(Sentence::kRmc)) return;
    if (parts_.gsa_unused > 0) health.add(Reason::kGsaMode, parts_.gsa_unused);
    if (same_time_ && repeats()) return health.add(Reason::kRepeated);
    if (same_time_) uncertain_ = kUncertainEpochs;
    if (uncertain_ > 0) health.add(Reason::kUncertainTime);
    sink(report());
  }

 private:
  using Sums = std::array<std::uint32_t, kSentences>;
  static constexpr std::uint8_t kUncertainEpochs = 16;  ///< ours: with new times, until the times are trusted again

  static constexpr std::size_t index(Sentence s) { return static_cast<std::size_t>(s); }
  static constexpr std::uint32_t bit(Sentence s) { return 1U << static_cast<unsigned>(s); }
  [[nodiscard]] static constexpr std::uint32_t checksum(Text text) {
    base::Crc32 crc;
    crc.add(text);
    return crc.value();
  }
  [[nodiscard]] constexpr bool has(Sentence s) const { return (seen_ & bit(s)) != 0; }
  static constexpr bool is_timed(Sentence s) { return s != Sentence::kVtg && s != Sentence::kGsa; }

  [[nodiscard]] constexpr bool is_now(const Utc& t) const {
    return t.hour == utc_.hour && t.minute == utc_.minute && t.second == utc_.second && t.nano == utc_.nano;
  }

  [[nodiscard]] constexpr bool starts_epoch(Sentence kind, bool timed, const Utc& t, Text talker) const {
    if (!timed) return has(kind);  // before the first fix the time is empty: the same sentence again is the next epoch
    if (!parts_.stamped) return has(kind);
    if (!is_now(t)) return true;
    const auto& first = talkers_[index(kind)];
    return has(kind) && first[0] == talker[0] && first[1] == talker[1];
  }

  /// The first talker of a kind marks its repetition; the sum stands for every sentence of the kind.
  constexpr void identify(Sentence kind, Text talker, std::uint32_t sum) {
    const std::size_t i = index(kind);
    if (!has(kind)) {
      talkers_[i] = {talker[0], talker[1]};
      sums_[i] = sum;
    } else {
      sums_[i] = sums_[i] * 31 + sum;
    }
    seen_ |= bit(kind);
  }

  /// No sentence that the epoch before did not have, too.
  [[nodiscard]] constexpr bool repeats() const {
    for (std::size_t i = 0; i < kSentences; ++i)
      if (sums_[i] != 0 && sums_[i] != sums_before_[i]) return false;
    return true;
  }

  /// Every GSA so far denies the fix of the other sentences: one of a further constellation may still come.
  [[nodiscard]] constexpr bool contradicted() const {
    return parts_.dimension && *parts_.dimension <= 1 && solution() > Solution::kNotMeasured;
  }

  template <class Sink>
  constexpr void begin(bool same_time, bool differs, Health& health, Sink& sink) {
    if (same_time && differs) uncertain_ = kUncertainEpochs;
    if (!same_time && uncertain_ > 0) --uncertain_;
    finish(health, sink);
    end_.begin();
    same_time_ = same_time;
    sums_before_ = sums_;
    sums_ = {};
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

  /// The better of GGA and GNS: an older receiver leaves GGA without a fix where GPS alone has none. RMC alone is an
  /// autonomous solution; its status and mode can deny the others'.
  [[nodiscard]] constexpr Solution solution() const {
    const Parts& p = parts_;
    const bool known = p.quality || p.gns_solution || p.rmc_status != '\0';
    if (!known || (p.rmc_status != '\0' && p.rmc_status != 'A')) return Solution::kNone;
    const Solution rmc = solution_of_mode(p.rmc_mode).value_or(Solution::kAutonomous);
    if (rmc <= Solution::kNotMeasured) return rmc;
    if (!p.quality && !p.gns_solution) return Solution::kAutonomous;
    const Solution gga = p.quality ? kQualities[static_cast<std::size_t>(*p.quality)] : Solution::kNone;
    const Solution gns = p.gns_solution.value_or(Solution::kNone);
    return gga > gns ? gga : gns;
  }

  /// A receiver that uses no satellite measures nothing, and neither does one whose every GSA has mode 1.
  [[nodiscard]] constexpr sensor::GnssFix fix() const {
    using sensor::GnssFix;
    const Parts& p = parts_;
    const Solution s = solution();
    if (s <= Solution::kNotMeasured ||
        (p.satellites.value_or(0) == 0 && p.gns_satellites.value_or(0) == 0 && (p.satellites || p.gns_satellites))) {
      return GnssFix::kNone;
    }
    if (p.dimension && *p.dimension == 1) return GnssFix::kNone;
    if (s == Solution::kRtkFixed) return GnssFix::kRtkFixed;
    if (s == Solution::kRtkFloat) return GnssFix::kRtkFloat;
    const bool level = base::is_nan(p.altitude_m) && base::is_nan(p.gns_altitude_m);
    if (p.dimension ? *p.dimension == 2 : level) return GnssFix::k2d;
    return s == Solution::kDifferential ? GnssFix::kDifferential : GnssFix::k3d;
  }

  [[nodiscard]] constexpr Report report() const {
    const Parts& p = parts_;
    Report r{.protocol = Protocol::kNmea, .fix = fix(), .utc = utc_};
    r.time_uncertain = uncertain_ > 0;
    place(r);
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
    const float hdop = base::is_nan(p.gga_hdop) ? p.gns_hdop : p.gga_hdop;
    r.hdop = base::is_nan(p.hdop) ? hdop : p.hdop;
    r.vdop = p.vdop;
    return r;
  }

  /// GGA's place and height, else those of GNS, else the place of RMC, which has no height.
  constexpr void place(Report& r) const {
    const Parts& p = parts_;
    const bool gga = p.gga_latitude && p.gga_longitude, gns = p.gns_latitude && p.gns_longitude;
    const bool rmc = p.rmc_latitude && p.rmc_longitude;
    r.has_position = gga || gns || rmc;
    if (r.has_position) {
      r.latitude_2ndeg = gga ? *p.gga_latitude : gns ? *p.gns_latitude : *p.rmc_latitude;
      r.longitude_2ndeg = gga ? *p.gga_longitude : gns ? *p.gns_longitude : *p.rmc_longitude;
    }
    const bool by_gns = !gga && gns;
    r.height_msl_m = by_gns ? p.gns_altitude_m : p.altitude_m;
    r.height_m = r.height_msl_m + (by_gns ? p.gns_separation_m : p.separation_m);
    const auto satellites = by_gns || !p.satellites ? p.gns_satellites : p.satellites;
    r.satellites = static_cast<std::uint8_t>(satellites.value_or(0));
  }

  Parts parts_{};
  Utc utc_{};  ///< time of this epoch; the date is kept for the next
  EpochEnd<kSentences> end_{};
  Sums sums_{}, sums_before_{};                                    ///< CRC-32 of the sentences, by kind
  std::array<std::array<std::uint8_t, 2>, kSentences> talkers_{};  ///< talker of the first sentence of each kind
  std::uint32_t previous_sum_ = 0;                                 ///< CRC-32 of the last sentence with a time
  std::uint32_t seen_ = 0;
  std::uint8_t uncertain_ = 0;  ///< epochs whose time is still doubtful; 0: times are trusted
  bool same_time_ = false;      ///< this epoch has the time of the one before
  bool open_ = false;
  bool done_ = false;
};

}  // namespace tetap::drivers::gnss::nmea
