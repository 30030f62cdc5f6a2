// SPDX-License-Identifier: Apache-2.0
// Inertial navigation by IMU, wheels, GNSS and a planar laser scanner in one filter. A scan that lies far enough from
// the keyframe is matched with it, as a job in units of work. What the match finds of the displacement corrects the
// filter by clones of its pose at both stamps. The scan is the next keyframe: without a receiver the error grows with
// each keyframe, not with each scan.
//
// The filter is that of inertial.hpp to the bit where no scan comes.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/base/state_digest.hpp"
#include "tetap/estimators/all_round/scan_clones.hpp"
#include "tetap/estimators/inertial/inertial.hpp"
#include "tetap/estimators/own_map.hpp"
#include "tetap/slam/scan_match.hpp"

#include <cstdint>

namespace tetap::estimators {

class AllRound : public InertialWith<CloneWatch> {
  using Inertial = InertialWith<CloneWatch>;
  static constexpr int kBeams = 361, kFrames = 1;
  /// Gate over that of 99 %. In the yard a good match has a third of the NIS expected: an error of the gyroscope shows
  /// early.
  static constexpr float kGateScale = 0.6F;
  using Match = slam::ScanMatch<kBeams, kFrames>;

 public:
  static constexpr int kMostBeams = kBeams;

  void restart(base::Micros t, const Context& ctx);
  void advance(base::Micros t, const Context& ctx, const sensor::Window& window) {
    Inertial::advance(t, ctx, window);
    now_ = t;
  }

  using Inertial::fuse;
  Innovation fuse(const sensor::WheelCounts& counts, base::Micros stamp, const Context& ctx) {
    const Innovation innovation = Inertial::fuse(counts, stamp, ctx);
    note_wheels(stamp);
    return innovation;
  }
  Innovation fuse(const sensor::WheelSpeeds& speeds, base::Micros stamp, const Context& ctx) {
    const Innovation innovation = Inertial::fuse(speeds, stamp, ctx);
    note_wheels(stamp);
    return innovation;
  }
  /// Not used: the keyframe is near. Pending: the record comes when the match has ended.
  Innovation fuse(const sensor::PlanarScan& scan, base::Micros stamp, std::uint8_t instance, const Context& ctx);
  /// A scan waits for the job of the one before it.
  [[nodiscard]] bool defers(const sensor::Sample& sample, const Context& ctx) {
    return sample.sensor == sensor::Sensor::kScan ? match_.busy() : Inertial::defers(sample, ctx);
  }
  void work(std::uint32_t units, const Context& ctx);
  void abort_job();
  template <class Sink>
  void late_records(Sink&& sink) {
    if (recorded_) sink(record_);
    recorded_ = false;
  }
  static void close_batch(const Context&) {}
  /// The IMU is distrusted for a while after wheels and scanner contradicted its turn.
  [[nodiscard]] SourceStates sources(const Context& ctx) const;
  [[nodiscard]] ScanMatchReport scan_match() const { return report_; }
  [[nodiscard]] const slam::ScanMatchCounters& counters() const { return match_.counters(); }
  [[nodiscard]] const ScanClones& clones() const { return watch_.bank(); }

  /// The keyframe's points and the job are not hashed: the digest stands for them, by what each match found.
  static constexpr auto members(auto& self) {
    return base::members(base::base_of<Inertial>(self), base::unhashed(self.match_), base::unhashed(self.keyframes_),
                         base::unhashed(self.prior_), base::unhashed(self.scan_), base::unhashed(self.record_),
                         base::unhashed(self.report_), self.now_, self.recorded_, self.keyframe_at_, self.wheels_at_,
                         self.contradicted_at_, self.wheels_turn_rad_, self.scan_turn_rad_, self.digest_);
  }

 private:
  void conclude(const Context& ctx);
  void make_keyframe();
  void note_wheels(base::Micros stamp);
  /// A refused match is a good one, and wheels do not vouch for the filter's turn.
  [[nodiscard]] bool gyroscope_lies(const slam::ScanMatchResult& result) const;
  [[nodiscard]] slam::ScanMotion scanner_motion(const param::LidarParameters& n) const;
  /// The way or turn is so many times as far as a keyframe's, or a keyframe is due by its age.
  [[nodiscard]] bool keyframe_due(const slam::Displacement<float>& d, base::Micros stamp, float times,
                                  const Context& ctx) const;
  void record(const Innovation& innovation) {
    record_.innovation = innovation;
    recorded_ = true;
  }

  Match match_{{.coarse_half_rad = 0.2F}};
  typename Match::Keyframes keyframes_;
  ScanClones::Step prior_;  ///< pose of the scan that is matched, as seen from the keyframe
  sensor::PlanarScan scan_;
  LateRecord record_;
  ScanMatchReport report_;
  base::Micros now_;
  bool recorded_ = false;
  base::Micros keyframe_at_, wheels_at_;  ///< stamps of the keyframe and of the last sample of wheels
  base::Micros contradicted_at_;          ///< stamp of the last scan that contradicted the gyroscope; 0: none
  float wheels_turn_rad_ = 0;             ///< turn by the wheels since the keyframe
  float scan_turn_rad_ = 0;               ///< the same up to the latest scan
  base::StateDigest digest_;
};

}  // namespace tetap::estimators
