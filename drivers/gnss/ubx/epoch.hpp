// SPDX-License-Identifier: Apache-2.0
// Puts the UBX navigation messages of one time of week together into one report. A current receiver sends NAV-PVT,
// NAV-COV and NAV-HPPOSLLH. An old one sends NAV-SOL, -POSLLH, -VELNED, -STATUS, -DOP, -TIMEUTC (sources in nav.hpp).
#pragma once

#include "drivers/gnss/epoch_end.hpp"
#include "drivers/gnss/health.hpp"
#include "drivers/gnss/ubx/nav.hpp"
#include "tetap/base/wgs84.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace tetap::drivers::gnss::ubx {

[[nodiscard]] constexpr std::uint32_t bit(Nav nav) { return 1U << static_cast<unsigned>(nav); }

class Epoch {
 public:
  template <class Sink>
  constexpr void on_nav(std::uint8_t id, std::span<const std::uint8_t> payload, Health& health, Sink& sink) {
    std::size_t kind = 0;
    while (kind < kNavKinds && kNavMessages[kind].id != id) ++kind;
    if (kind == kNavKinds) return health.add(Reason::kUnread);
    const auto nav = static_cast<Nav>(kind);
    if (payload.size() != kNavMessages[kind].length && !(nav == Nav::kPvt && payload.size() == kOldPvtLength)) {
      return health.add(Reason::kUbxLength);
    }
    const Fields f{payload};
    const std::uint32_t itow_ms = f.u4(kNavMessages[kind].itow_at);
    if (!open_ || itow_ms != report_.itow_ms) begin(itow_ms, sink);
    if (done_ && nav != Nav::kEndOfEpoch) health.add(Reason::kLate);
    seen_ |= 1U << kind;
    take(nav, f, health);
    if (end_.arrived(kind) || nav == Nav::kEndOfEpoch) finish(sink);
  }

  /// Hands on what there is: a new epoch began, or the input is at its end.
  template <class Sink>
  constexpr void finish(Sink& sink) {
    if (!open_ || done_) return;
    done_ = true;
    constexpr std::uint32_t kSolution = bit(Nav::kPvt) | bit(Nav::kPosLlh) | bit(Nav::kHpPosLlh) | bit(Nav::kSol) |
                                        bit(Nav::kPosEcef) | bit(Nav::kStatus);
    if ((seen_ & kSolution) == 0) return;
    if (!has(Nav::kPvt)) compose();
    sink(static_cast<const Report&>(report_));
  }

 private:
  [[nodiscard]] constexpr bool has(Nav nav) const { return (seen_ & bit(nav)) != 0; }

  template <class Sink>
  constexpr void begin(std::uint32_t itow_ms, Sink& sink) {
    finish(sink);
    end_.begin();
    report_ = {};
    report_.itow_ms = itow_ms;
    seen_ = 0;
    open_ = true;
    done_ = false;
    position_m_.reset();
    velocity_mps_.reset();
    from_sol_ = false;
    fine_ = false;
  }

  constexpr void take(Nav nav, const Fields& f, Health& health) {
    switch (nav) {
      case Nav::kPvt:
        return pvt(f, health);
      case Nav::kCov:
        return cov(f, health);
      case Nav::kSol:
        return sol(f);
      case Nav::kHpPosLlh:
        return hp_pos_llh(f, health);
      case Nav::kDop:
        report_.pdop = f.su2(6, kCenti);
        report_.vdop = f.su2(10, kCenti);
        report_.hdop = f.su2(12, kCenti);
        return;
      case Nav::kTimeUtc: {
        const bool resolved = (f.u1(19) & 0x04) != 0;
        if (!has(Nav::kPvt) && !set_utc(f, 12, resolved, resolved, f.i4(8), report_.utc)) health.add(Reason::kBadTime);
        return;
      }
      case Nav::kTimeGps:
        if ((f.u1(11) & 0x07) == 0x07 && !report_.utc.time_valid) {
          report_.utc = utc_of_gps(f.i2(8), f.u4(0), static_cast<std::int8_t>(f.u1(10)));
          report_.utc.nano += in_range(f.i4(4), 500'000) ? f.i4(4) : 0;
        }
        return;
      default:
        if (!has(Nav::kPvt)) old(nav, f, health);
    }
  }

  constexpr void pvt(const Fields& f, Health& health) {
    Report& r = report_;
    const std::uint8_t valid = f.u1(11), flags = f.u1(21);
    if (!set_utc(f, 4, (valid & 1) != 0, (valid & 2) != 0, f.i4(16), r.utc)) health.add(Reason::kBadTime);
    r.fix = fix_of(f.u1(20), (flags & 1) != 0, (flags & 2) != 0, flags >> 6);
    r.satellites = f.u1(23);
    if (!fine_) pvt_position(f, health);
    set_velocity(f.si4(48, kMilli), f.si4(52, kMilli), f.si4(56, kMilli), health);
    r.speed_mps = f.si4(60, kMilli);
    r.course_rad = f.si4(64, k1e5degPerRad);
    r.speed_acc_mps = f.su4(68, kMilli);
    r.course_acc_rad = f.su4(72, k1e5degPerRad);
    r.pdop = f.su2(76, kCenti);
  }

  constexpr void pvt_position(const Fields& f, Health& health) {
    Report& r = report_;
    // flags3, bit 0: latitude, longitude and heights are not valid.
    r.has_position = (f.u2(78) & 1) == 0 && f.u1(20) >= 1 && f.u1(20) <= 4;
    if (r.has_position && !set_angles(f.i4(28), f.i4(24), r)) refuse_position(health);
    if (r.has_position) {
      r.height_m = f.si4(32, kMilli);
      r.height_msl_m = f.si4(36, kMilli);
    }
    r.horizontal_acc_m = f.su4(40, kMilli);
    r.vertical_acc_m = f.su4(44, kMilli);
  }

  /// The place to 0.1 mm; it takes precedence over the other messages of its epoch. One that is not valid (flags, bit
  /// 0) leaves the place of the others.
  constexpr void hp_pos_llh(const Fields& f, Health& health) {
    if (f.u1(0) != 0) return health.add(Reason::kUbxVersion);
    if ((f.u1(3) & 1) != 0) return health.add(Reason::kNoFix);
    constexpr int kAngle = 99, kHeight = 9;
    const bool parts = fine_part(f.i1(24), kAngle) && fine_part(f.i1(25), kAngle) && fine_part(f.i1(26), kHeight) &&
                       fine_part(f.i1(27), kHeight);
    Report& r = report_;
    if (!parts || !set_angles_ndeg(std::int64_t{f.i4(12)} * 100 + f.i1(25), std::int64_t{f.i4(8)} * 100 + f.i1(24), r))
      return health.add(Reason::kOutOfRange);
    const auto height_m = [&](std::size_t at, std::size_t part) {
      return static_cast<float>(static_cast<double>(std::int64_t{f.i4(at)} * 10 + f.i1(part)) / 10'000.0);
    };
    r.height_m = height_m(16, 26);
    r.height_msl_m = height_m(20, 27);
    r.horizontal_acc_m = f.su4(28, kTenthMilli);
    r.vertical_acc_m = f.su4(32, kTenthMilli);
    fine_ = true;
  }

  constexpr void cov(const Fields& f, Health& health) {
    if (f.u1(4) != 0) return health.add(Reason::kUbxVersion);
    if (f.u1(5) != 0) report_.position_cov_m2 = covariance_enu(f, 16);
    if (f.u1(6) != 0) report_.velocity_cov_m2ps2 = covariance_enu(f, 40);
  }

  /// Position and velocity of NAV-SOL are Earth-centred; better messages of the same epoch take precedence.
  constexpr void sol(const Fields& f) {
    if (has(Nav::kPvt)) return;
    report_.fix = fix_of(f.u1(10), (f.u1(11) & 1) != 0, (f.u1(11) & 2) != 0, 0);
    report_.satellites = f.u1(47);
    report_.pdop = f.su2(44, kCenti);
    if (!has(Nav::kPosLlh) && f.u1(10) >= 1 && f.u1(10) <= 4) {
      position_m_ = centi3(f, 12);
      velocity_mps_ = centi3(f, 28);
      report_.speed_acc_mps = f.su4(40, kCenti);
    }
    position_acc_m_ = f.su4(24, kCenti);
    from_sol_ = true;
  }

  constexpr void old(Nav nav, const Fields& f, Health& health) {
    Report& r = report_;
    if (nav == Nav::kPosLlh) {
      if (fine_) return;
      if (!set_angles(f.i4(8), f.i4(4), r)) return refuse_position(health);
      r.height_m = f.si4(12, kMilli);
      r.height_msl_m = f.si4(16, kMilli);
      r.horizontal_acc_m = f.su4(20, kMilli);
      r.vertical_acc_m = f.su4(24, kMilli);
    } else if (nav == Nav::kVelNed) {
      set_velocity(f.si4(4, kCenti), f.si4(8, kCenti), f.si4(12, kCenti), health);
      r.speed_mps = f.su4(20, kCenti);
      r.course_rad = f.si4(24, k1e5degPerRad);
      r.speed_acc_mps = f.su4(28, kCenti);
      r.course_acc_rad = f.su4(32, k1e5degPerRad);
    } else if (nav == Nav::kStatus && !from_sol_) {
      // fixStat, bit 1: flags2 has the carrier solution in bits 7 and 6; older receivers leave both 0.
      const std::uint8_t carrier = (f.u1(6) & 2) != 0 ? f.u1(7) >> 6 : 0;
      r.fix = fix_of(f.u1(4), (f.u1(5) & 1) != 0, (f.u1(5) & 2) != 0, carrier);
    } else if (nav == Nav::kPosEcef && !from_sol_) {
      position_m_ = centi3(f, 4);
      position_acc_m_ = f.su4(16, kCenti);
    } else if (nav == Nav::kVelEcef && !from_sol_) {
      velocity_mps_ = centi3(f, 4);
      r.speed_acc_mps = f.su4(16, kCenti);
    }
  }

  /// Fills fields from Earth-centred coordinates, where no message carried them directly.
  constexpr void compose() {
    Report& r = report_;
    if (!position_m_.has_value()) return;
    const auto at = base::geodetic_of(*position_m_);
    if (!at.has_value()) return;
    if (!has(Nav::kPosLlh) && !fine_) {
      r.latitude_2ndeg = at->latitude_2ndeg;
      r.longitude_2ndeg = at->longitude_2ndeg;
      r.has_position = true;
      r.height_m = static_cast<float>(at->height_m);
      // pAcc covers three dimensions; its division between them is not known.
      r.horizontal_acc_m = r.vertical_acc_m = position_acc_m_;
    }
    if (!has(Nav::kVelNed) && velocity_mps_.has_value()) {
      const base::Enu v = base::Level(at->latitude_2ndeg, at->longitude_2ndeg).to_enu(*velocity_mps_);
      r.v_n_mps = {static_cast<float>(v.east), static_cast<float>(v.north), static_cast<float>(v.up)};
      r.speed_mps = base::sqrt(r.v_n_mps[0] * r.v_n_mps[0] + r.v_n_mps[1] * r.v_n_mps[1]);
      r.course_rad = base::atan2(r.v_n_mps[0], r.v_n_mps[1]);
    }
  }

  constexpr void set_velocity(float north, float east, float down, Health& health) {
    constexpr float kFastest_mps = 1000.0F;  // receivers stop at 500 m/s
    if (base::max(base::max(base::abs(north), base::abs(east)), base::abs(down)) > kFastest_mps) {
      return health.add(Reason::kOutOfRange);
    }
    set_velocity_ned(north, east, down, report_);
  }

  constexpr void refuse_position(Health& health) {
    report_.has_position = false;
    health.add(Reason::kOutOfRange);
  }

  static constexpr bool in_range(std::int32_t x, std::int32_t limit) { return x >= -limit && x <= limit; }
  static constexpr base::Ecef centi3(const Fields& f, std::size_t at) {
    return {f.i4(at) * 0.01, f.i4(at + 4) * 0.01, f.i4(at + 8) * 0.01};
  }

  Report report_{};
  EpochEnd<kNavKinds> end_{};
  std::optional<base::Ecef> position_m_, velocity_mps_;
  float position_acc_m_ = base::kNan;
  std::uint32_t seen_ = 0;
  bool open_ = false;
  bool done_ = false;
  bool from_sol_ = false;
  bool fine_ = false;  ///< the place is that of NAV-HPPOSLLH
};

}  // namespace tetap::drivers::gnss::ubx
