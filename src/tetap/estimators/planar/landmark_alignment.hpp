// SPDX-License-Identifier: Apache-2.0
// Pose from known landmarks: while the pose is unknown, dead reckoning runs in a frame of its own. Two landmarks fix
// the turn and the shift of that frame, seen in one look or with dead reckoning between. The two are points of a rigid
// transformation (Umeyama 1991, IEEE PAMI 13(4), for n = 2). One landmark does not fix them, from however many places
// it is seen: the frame may still turn about it.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/base/members.hpp"
#include "tetap/estimators/context.hpp"
#include "tetap/filter/update.hpp"
#include "tetap/model/range_bearing.hpp"

#include <cstdint>

namespace tetap::estimators {

class LandmarkAlignment {
 public:
  enum class Outcome : std::uint8_t {
    kFirst,        ///< the sighting begins a search; the caller makes the pose of now certain in its own frame
    kWaits,        ///< the sighting and the first one fix no pose yet
    kContradicts,  ///< the two landmarks are not as far apart as on the map; the sighting begins a search
    kCandidate,    ///< the two fix a pose, which another sighting has to confirm
  };
  struct Result {
    Outcome outcome;
    SetPose pose;             ///< candidate
    float nis = 0, gate = 0;  ///< misfit of the distance, squared, over its variance
  };

  [[nodiscard]] bool searches() const { return stage_ != Stage::kIdle; }
  /// A candidate waits for a sighting that confirms it.
  [[nodiscard]] bool has_candidate() const { return stage_ == Stage::kCandidate; }
  /// The sighting is news to the candidate: of another look, or of a third landmark.
  [[nodiscard]] bool is_third(std::uint8_t id, base::Micros stamp) const {
    return stamp > candidate_at_ || (id != first_id_ && id != second_id_);
  }
  void reset() { *this = {}; }

  /// A sighting, the pose in the frame of its own, and that pose's covariance since the first sighting.
  [[nodiscard]] Result add(const model::RangeBearing& seen, std::uint8_t id, base::Micros stamp,
                           const model::PlanarPose& pose, const filter::Symmetric<float, 3>& drift);

  static constexpr auto members(auto& self) {
    return base::members(self.stage_, self.first_id_, self.second_id_, self.first_, self.first_x_, self.first_y_,
                         self.first_m2_, self.candidate_at_);
  }

 private:
  enum class Stage : std::uint8_t { kIdle, kFirst, kCandidate };
  struct Point {
    float x_m = 0, y_m = 0;
  };

  /// Variance of the seen place, on its worse axis at least.
  static float variance_m2(const model::RangeBearing& seen) {
    const float across_m = seen.range_m * seen.sigma_bearing_rad;
    return seen.sigma_range_m * seen.sigma_range_m + across_m * across_m;
  }
  /// Place of the landmark in the body.
  static Point in_body(const model::RangeBearing& seen) {
    const base::SinCos look = base::sincos(seen.bearing_rad + seen.mounting.yaw_rad);
    return {seen.mounting.x_b_m + seen.range_m * look.cos, seen.mounting.y_b_m + seen.range_m * look.sin};
  }
  static Point turned(const Point& p, float yaw_rad) {
    const base::SinCos by = base::sincos(yaw_rad);
    return {by.cos * p.x_m - by.sin * p.y_m, by.sin * p.x_m + by.cos * p.y_m};
  }
  Result begin(const model::RangeBearing& seen, std::uint8_t id, const model::PlanarPose& pose);

  Stage stage_ = Stage::kIdle;
  std::uint8_t first_id_ = 0, second_id_ = 0;
  model::Landmark first_;             ///< first landmark on the map
  base::Anchored first_x_, first_y_;  ///< the same where it was seen, in the frame of its own
  float first_m2_ = 0;                ///< variance of that place
  base::Micros candidate_at_;         ///< stamp of the sighting that made the candidate
};

inline LandmarkAlignment::Result LandmarkAlignment::begin(const model::RangeBearing& seen, std::uint8_t id,
                                                          const model::PlanarPose& pose) {
  const Point from_pose = turned(in_body(seen), pose.yaw_rad);
  *this = {};
  stage_ = Stage::kFirst;
  first_id_ = id;
  first_ = seen.landmark;
  first_x_ = pose.x.plus(from_pose.x_m);
  first_y_ = pose.y.plus(from_pose.y_m);
  first_m2_ = variance_m2(seen);
  return {.outcome = Outcome::kFirst, .pose = {}};
}

inline LandmarkAlignment::Result LandmarkAlignment::add(const model::RangeBearing& seen, std::uint8_t id,
                                                        base::Micros stamp, const model::PlanarPose& pose,
                                                        const filter::Symmetric<float, 3>& drift) {
  if (stage_ != Stage::kFirst || id == first_id_) return begin(seen, id, pose);
  const Point second = in_body(seen);
  const Point first = turned({first_x_.minus(pose.x), first_y_.minus(pose.y)}, -pose.yaw_rad);
  const float swing_m2 = (first.x_m * first.x_m + first.y_m * first.y_m) * drift(2, 2);
  const float drift_m2 = drift(0, 0) + drift(1, 1) + swing_m2, second_m2 = variance_m2(seen);
  const float both_m2 = first_m2_ + second_m2 + drift_m2;
  const float east_m = seen.landmark.x.minus(first_.x), north_m = seen.landmark.y.minus(first_.y);
  const float dx_m = second.x_m - first.x_m, dy_m = second.y_m - first.y_m;
  const float apart2_m2 = east_m * east_m + north_m * north_m;
  constexpr float kPower = 16;  // four sigma: the turn is then known to a quarter of a radian
  if (!(apart2_m2 > kPower * both_m2)) {
    if (drift_m2 > first_m2_ + second_m2) return begin(seen, id, pose);
    return {.outcome = Outcome::kWaits, .pose = {}};
  }
  const float misfit_m = base::sqrt(apart2_m2) - base::sqrt(dx_m * dx_m + dy_m * dy_m);
  const float nis = misfit_m * misfit_m / both_m2, gate = filter::chi_square_99(1);
  if (nis > gate) {
    Result result = begin(seen, id, pose);
    result.outcome = Outcome::kContradicts;
    result.nis = nis;
    result.gate = gate;
    return result;
  }
  const float yaw_rad = base::wrap_angle(base::atan2(north_m, east_m) - base::atan2(dy_m, dx_m));
  const float var_yaw = both_m2 / apart2_m2;
  const Point away = turned(second, yaw_rad);
  const float var_m2 = second_m2 + (second.x_m * second.x_m + second.y_m * second.y_m) * var_yaw;
  stage_ = Stage::kCandidate;
  second_id_ = id;
  candidate_at_ = stamp;
  return {
      .outcome = Outcome::kCandidate,
      .pose = {.pose = {.x = seen.landmark.x.plus(-away.x_m), .y = seen.landmark.y.plus(-away.y_m), .yaw_rad = yaw_rad},
               .sigma_position_m = base::sqrt(var_m2),
               .sigma_yaw_rad = base::sqrt(var_yaw)},
      .nis = nis,
      .gate = gate};
}

}  // namespace tetap::estimators
