// SPDX-License-Identifier: Apache-2.0
// Origin of the map: configured, or the first of fixes that confirm each other. An origin that is only proposed, or
// that fixes gave, may be replaced. A run of fixes that began beyond the map's range does so when it outweighs the
// fixes that the map held. docs/explanation/frames.md.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/checks/startup_fix_check.hpp"
#include "tetap/estimators/map_frame.hpp"
#include "tetap/param/parameters.hpp"
#include "tetap/sensor/samples.hpp"

#include <algorithm>
#include <cstdint>
#include <utility>

namespace tetap::node {

class MapOrigin {
 public:
  void power_on(estimators::MapFrame& map_frame, const param::GnssParameters& g) {
    *this = {};
    map_frame.frame = {};
    map_frame.origin = sensor::OriginSource::kNone;
    if (g.origin_configured == 0) return;
    map_frame.frame = nav::LocalFrame(g.origin_latitude_2ndeg, g.origin_longitude_2ndeg, g.origin_height_m);
    map_frame.origin = sensor::OriginSource::kConfigured;
  }
  /// A fix before anybody uses it. Another origin may become the map's, or a first one where it had none.
  [[gnu::cold]] void update(const sensor::GnssPosition& fix, base::Micros stamp, estimators::MapFrame& map_frame,
                            const param::Parameters& n) {
    if (fix.fix < sensor::GnssFix::k2d) return;
    run_.update(fix, stamp, kMostFixes);
    const bool known = map_frame.origin != sensor::OriginSource::kNone;
    const bool outside = known && !estimators::within_range(map_frame.frame, fix);
    if (run_.fixes() == 1) {
      first_ = fix;
      began_ = stamp;
      began_outside_ = outside;
    }
    if (known && !outside) note_inside(stamp);
    outside_ = outside && run_.fixes() >= n.recovery.confirm_fixes;
    if (outside_) outside_at_ = stamp;
    if (known ? !replaces(stamp, map_frame, n) : run_.fixes() < n.recovery.confirm_fixes) return;
    map_frame.frame = nav::LocalFrame(first_.latitude_2ndeg, first_.longitude_2ndeg,
                                      base::is_finite(first_.height_m) ? first_.height_m : 0.0F);
    map_frame.origin = sensor::OriginSource::kFirstFix;
    replaced_ = replaced_ || known;
    outside_ = began_outside_ = false;
    inside_ = run_.fixes();
    first_inside_ = began_;
    last_inside_ = stamp;
  }
  /// Another origin took the place of one that was in use; asking clears it.
  [[nodiscard]] bool take_replaced() { return std::exchange(replaced_, false); }
  /// Fixes that confirm each other lie beyond the map's range.
  [[nodiscard]] bool fixes_outside(base::Micros now) const {
    return outside_ && now - outside_at_ < base::Micros{3'000'000};
  }

  static constexpr auto members(auto& self) {
    return base::members(self.run_, self.first_, self.began_, self.first_inside_, self.last_inside_, self.outside_at_,
                         self.inside_, self.began_outside_, self.outside_, self.replaced_);
  }

 private:
  static constexpr std::int32_t kMostFixes = 1'000'000;

  void note_inside(base::Micros stamp) {
    if (inside_ == 0) first_inside_ = stamp;
    if (inside_ < kMostFixes) ++inside_;
    last_inside_ = stamp;
  }
  /// More fixes over a longer time than the map held; never more is asked than makes refused fixes a true jump. A run
  /// that began inside drove out: its origin is right.
  [[nodiscard]] bool replaces(base::Micros stamp, const estimators::MapFrame& map_frame,
                              const param::Parameters& n) const {
    const bool given =
        map_frame.origin == sensor::OriginSource::kConfigured && n.gnss.origin_configured == kConfiguredForGood;
    if (given || !outside_ || !began_outside_) return false;
    const std::int32_t fixes = std::min(inside_, n.recovery.persist_fixes);
    const base::Micros held{
        std::min((last_inside_ - first_inside_).us, static_cast<std::int64_t>(n.recovery.persist_us))};
    return run_.fixes() > fixes && stamp - began_ > held;
  }

  static constexpr std::int32_t kConfiguredForGood = 1;

  checks::StartupFixCheck run_;              ///< fixes that follow each other no faster than anything drives
  sensor::GnssPosition first_;               ///< first fix of the run
  base::Micros began_;                       ///< stamp of that fix
  base::Micros first_inside_, last_inside_;  ///< stamps of the first and the last fix in the map's range
  base::Micros outside_at_;                  ///< stamp of the last fix beyond, in a confirmed run
  std::int32_t inside_ = 0;                  ///< fixes in the map's range
  bool began_outside_ = false;               ///< the run's first fix was beyond the range
  bool outside_ = false;                     ///< the last fix was beyond the range, in a confirmed run
  bool replaced_ = false;
};

}  // namespace tetap::node
