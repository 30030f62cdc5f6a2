// SPDX-License-Identifier: Apache-2.0
// A filter that tracks a wrong pose: the robot was carried off, and nothing measured it. Sightings of known landmarks
// that the filter refuses look for another pose, the rival. Both judge every further sighting, and the sequential
// likelihood ratio (Wald 1945, Annals of Mathematical Statistics 16(2)) decides. An error of the camera or of one
// identity must not move the filter, so a rival has to explain every sighting, of several landmarks, over some time.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/base/members.hpp"
#include "tetap/checks/persistence.hpp"
#include "tetap/estimators/planar/correlated_fix.hpp"
#include "tetap/estimators/planar/landmark_alignment.hpp"
#include "tetap/estimators/planar/planar_ekf.hpp"
#include "tetap/filter/update.hpp"
#include "tetap/model/gnss_position.hpp"
#include "tetap/model/planar_increment.hpp"

#include <array>
#include <cstdint>

namespace tetap::estimators {

class Relocalisation {
 public:
  using Covariance = filter::Symmetric<float, 3>;

  [[nodiscard]] bool searches() const { return searches_; }
  void reset() { *this = {}; }

  /// The rival's motion since the last note() is the filter's: dead reckoning alone changed the pose since.
  void move(const model::PlanarPose& pose, const Covariance& p);
  /// The filter's pose from which the next move() counts.
  void note(const model::PlanarPose& pose, const Covariance& p) {
    noted_.x = pose;
    noted_.p = p;
  }

  /// The filter's covariance grew by so much that is no error of the way.
  void ignore(const std::array<float, 3>& variance) {
    if (searches_) noted_.p.add_diagonal(variance);
  }

  /// A sighting at the noted pose, and the filter's own judgement of it. `begins`: the filter refuses for long. True:
  /// the rival is to replace the filter.
  [[nodiscard]] bool add(const model::RangeBearing& seen, std::uint8_t id, base::Micros stamp,
                         const filter::Innovation<float, 2>& judged, bool begins);
  /// A fix: a rival that contradicts it is none. `correlation_s` as of update_by_fix().
  void add(const model::GnssPosition& fix, base::Micros stamp, float gate, float correlation_s);

  [[nodiscard]] const PlanarEkf& rival() const { return rival_; }
  /// Stamp of the last fix that has a part in the rival's pose; 0: none.
  [[nodiscard]] base::Micros last_fused_fix() const { return fixed_ ? last_fix_ : base::Micros{}; }

  /// Beside the last fix nothing while there is no search.
  static constexpr auto members(auto& self) {
    return base::members(base::in_turns(self.rival_), base::in_turns(self.noted_), base::in_turns(self.landmarks_),
                         self.evidence_, self.way_m_, self.since_, self.last_fix_, self.agreed_, self.accepted_,
                         self.searches_, self.fixed_);
  }

 private:
  static constexpr std::uint8_t kNobody = 0xFF;

  /// Twice the negative logarithm of the likelihood, but for a constant. One sighting in twenty may be of anything
  /// (Thrun, Burgard, Fox 2005, sec. 6.3.1): even over ten metres and the whole circle.
  static float cost(const filter::Innovation<float, 2>& judged) {
    constexpr float kOutlier = 10.6F;
    const float determinant = judged.s(0, 0) * judged.s(1, 1) - judged.s(0, 1) * judged.s(0, 1);
    if (!(determinant > 0.0F)) return kOutlier;
    const float inlier = judged.nis + base::log(determinant);
    return inlier < kOutlier ? inlier : kOutlier;
  }
  void search_anew() {
    landmarks_.reset();
    agreed_.fill(kNobody);
    evidence_ = 0;
    fixed_ = false;
  }
  /// The rival takes the sighting, and its evidence grows by how much better it fits than the filter.
  [[nodiscard]] bool explains(const model::RangeBearing& seen, const filter::Innovation<float, 2>& judged);
  void place(const model::RangeBearing& seen, std::uint8_t id, base::Micros stamp);
  void agree(std::uint8_t id) {
    for (std::uint8_t& known : agreed_) {
      if (known == kNobody) known = id;
      if (known == id) return;
    }
  }
  /// Two landmarks whose identities are exchanged fit a rival, too: they take twice as long.
  [[nodiscard]] bool proven(base::Micros stamp) const {
    constexpr float kMillionToOne = 13.8F, kLeast_m = 2;
    constexpr base::Micros kLeast{5'000'000}, kFixLasts{10'000'000};
    const bool three = agreed_[2] != kNobody, two = agreed_[1] != kNobody;
    const base::Micros least{three ? kLeast.us : 2 * kLeast.us};
    const bool barred = checks::recent(last_fix_, stamp, kFixLasts) && !fixed_;
    return evidence_ > kMillionToOne && two && stamp - since_ >= least && way_m_ >= kLeast_m && !barred;
  }

  PlanarEkf rival_;              ///< in a frame of its own until two landmarks place it
  PlanarEkf noted_;              ///< the filter's pose and covariance at its last measurement
  LandmarkAlignment landmarks_;  ///< the two landmarks that place the rival
  float evidence_ = 0;           ///< logarithm of the likelihood ratio, rival over filter
  float way_m_ = 0;              ///< way since the rival was placed
  base::Micros since_;           ///< stamp at which the rival was placed
  base::Micros last_fix_;        ///< stamp of the last fix that was offered; 0: none
  std::array<std::uint8_t, 3> agreed_{kNobody, kNobody, kNobody};  ///< landmarks that the rival explained since
  std::uint8_t accepted_ = 0;                                      ///< sightings in a row that the filter accepted
  bool searches_ = false;
  bool fixed_ = false;  ///< a fix agreed with the rival
};

inline void Relocalisation::move(const model::PlanarPose& pose, const Covariance& p) {
  if (!searches_) return;
  const float dx_m = pose.x.minus(noted_.x.x), dy_m = pose.y.minus(noted_.x.y);
  const Covariance moved = filter::turned(noted_.p, model::YawSwing{{-dy_m, dx_m}});
  // The growth of the filter's covariance is the error of the way, turned into the rival's frame.
  const base::SinCos by = base::sincos(rival_.x.yaw_rad - noted_.x.yaw_rad);
  const float xx = p(0, 0) - moved(0, 0), xy = p(0, 1) - moved(0, 1), yy = p(1, 1) - moved(1, 1);
  const float x_yaw = p(0, 2) - moved(0, 2), y_yaw = p(1, 2) - moved(1, 2);
  const float way_x_m = by.cos * dx_m - by.sin * dy_m, way_y_m = by.sin * dx_m + by.cos * dy_m;
  Covariance next = filter::turned(rival_.p, model::YawSwing{{-way_y_m, way_x_m}});
  next(0, 0) += by.cos * by.cos * xx - 2 * by.cos * by.sin * xy + by.sin * by.sin * yy;
  next(0, 1) += by.cos * by.sin * (xx - yy) + (by.cos * by.cos - by.sin * by.sin) * xy;
  next(1, 1) += by.sin * by.sin * xx + 2 * by.cos * by.sin * xy + by.cos * by.cos * yy;
  next(0, 2) += by.cos * x_yaw - by.sin * y_yaw;
  next(1, 2) += by.sin * x_yaw + by.cos * y_yaw;
  next(2, 2) += p(2, 2) - moved(2, 2);
  way_m_ += base::sqrt(dx_m * dx_m + dy_m * dy_m);
  rival_.x = rival_.x.plus({way_x_m, way_y_m, pose.yaw_rad - noted_.x.yaw_rad});
  if (next.positive_definite()) rival_.p = next;
}

inline bool Relocalisation::add(const model::RangeBearing& seen, std::uint8_t id, base::Micros stamp,
                                const filter::Innovation<float, 2>& judged, bool begins) {
  constexpr std::uint8_t kFound = 8;
  if (judged.verdict > filter::Verdict::kRejected) return false;  // the filter could not judge it
  const bool refused = judged.verdict == filter::Verdict::kRejected;
  if (refused)
    accepted_ = 0;
  else if (accepted_ < kFound)
    ++accepted_;
  if (!searches_) {
    if (!begins) return false;
    searches_ = true;
    search_anew();
    rival_ = noted_;
  } else if (accepted_ >= kFound) {
    searches_ = false;
    return false;
  }
  if (landmarks_.has_candidate()) {
    if (!landmarks_.is_third(id, stamp)) return false;
    if (explains(seen, judged)) {
      agree(id);
      return refused && proven(stamp);
    }
    search_anew();
  }
  place(seen, id, stamp);
  return false;
}

[[gnu::noinline]] inline bool Relocalisation::explains(const model::RangeBearing& seen,
                                                       const filter::Innovation<float, 2>& judged) {
  const filter::Innovation<float, 2> by_rival = rival_.update(seen, judged.gate);
  if (by_rival.verdict != filter::Verdict::kAccepted) return false;
  evidence_ += 0.5F * (cost(judged) - cost(by_rival));
  return true;
}

[[gnu::noinline]] inline void Relocalisation::place(const model::RangeBearing& seen, std::uint8_t id,
                                                    base::Micros stamp) {
  const LandmarkAlignment::Result found = landmarks_.add(seen, id, stamp, rival_.x, rival_.p);
  using Outcome = LandmarkAlignment::Outcome;
  constexpr float kNone_m2 = 0.25e-6F, kNone_rad2 = 1e-8F;
  if (found.outcome == Outcome::kFirst || found.outcome == Outcome::kContradicts)
    rival_.p = Covariance::diagonal({kNone_m2, kNone_m2, kNone_rad2});
  if (found.outcome != Outcome::kCandidate) return;
  const float place_m2 = found.pose.sigma_position_m * found.pose.sigma_position_m;
  rival_.x = found.pose.pose;
  rival_.p = Covariance::diagonal({place_m2, place_m2, found.pose.sigma_yaw_rad * found.pose.sigma_yaw_rad});
  since_ = stamp;
  way_m_ = 0;
}

inline void Relocalisation::add(const model::GnssPosition& fix, base::Micros stamp, float gate, float correlation_s) {
  const float since_s = fixed_ ? base::seconds(stamp - last_fix_) : base::kInfinity;
  last_fix_ = stamp;
  if (!searches_ || !landmarks_.has_candidate()) return;
  fixed_ = update_by_fix(rival_, fix, gate, since_s, correlation_s).verdict == filter::Verdict::kAccepted;
  if (!fixed_) search_anew();
}

}  // namespace tetap::estimators
