// SPDX-License-Identifier: Apache-2.0
// Estimates with their uncertainty, and a record of every measurement that an estimator was offered.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/base/time.hpp"
#include "tetap/checks/imu_health.hpp"
#include "tetap/filter/quaternion.hpp"
#include "tetap/filter/update.hpp"
#include "tetap/model/planar_pose.hpp"
#include "tetap/nav/ins_covariance_entry.hpp"
#include "tetap/nav/ins_state.hpp"
#include "tetap/nav/local_level.hpp"
#include "tetap/sensor/source_state.hpp"
#include "tetap/sensor/vocabulary.hpp"

#include <array>
#include <cstdint>

namespace tetap::estimators {

struct Estimate {
  base::Micros time;
  model::PlanarPose pose;
  filter::Symmetric<float, 3> p;  ///< covariance of (x, y, yaw): m, m, rad
  float forward_mps = 0;
  float yaw_rate_radps = 0;
  bool position_valid = false;
  bool heading_valid = false;
  bool velocity_valid = false;
};

/// 1 sigma of what could be anything: of a place, and of a heading (pi / sqrt(3): even over the circle).
inline constexpr float kUnknown_m = 1000, kUnknown_rad = 1.8138F;

/// Variance of the motion, made when somebody asks.
struct MotionVariance {
  float forward_m2ps2 = base::kNan;     ///< variance of Estimate::forward_mps; NaN: not known
  float yaw_rate_rad2ps2 = base::kNan;  ///< variance of Estimate::yaw_rate_radps; NaN: not known
};

/// An estimator's own step that nothing measured: it found itself wrong, and went where its sensors had been for
/// long.
struct Jump {
  float east_m = 0;
  float north_m = 0;
  float up_m = 0;
  float yaw_rad = 0;
  sensor::ResetCause cause = sensor::ResetCause::kPositionJump;
  std::uint8_t count = 0;  ///< number of such steps since the start
};

/// State and last failed check of each source, by the kind of sensor.
class SourceStates {
 public:
  struct Entry {
    sensor::SourceState state = sensor::SourceState::kStopped;
    sensor::Check failed = sensor::Check::kNone;
  };
  /// Without an effect for a kind of sensor that has no place.
  void set(sensor::Sensor of, const Entry& entry) {
    if (index(of) < kKinds) entries_[index(of)] = entry;
  }
  [[nodiscard]] Entry of(sensor::Sensor kind) const { return index(kind) < kKinds ? entries_[index(kind)] : Entry{}; }

 private:
  static constexpr std::size_t kKinds = 10;
  static constexpr std::size_t index(sensor::Sensor kind) { return static_cast<std::size_t>(kind); }
  std::array<Entry, kKinds> entries_{};
};

/// Output of an inertial estimator beyond the pose: the state at the present and the covariance at the far end of its
/// window. A step carries an entry of the covariance to the present.
struct InertialEstimate {
  nav::InsState state;
  const filter::Symmetric<float, nav::InsState::kErrors>& p;  ///< the estimator's own: as long as nothing changes it
  nav::InsCovarianceStep<float> ahead;                        ///< from the time of p to the present
  bool valid = false;
  Jump jump;
  checks::ImuHealthReport imu;
  SourceStates::Entry gnss_height;  ///< beside SourceStates: a height comes with the kind of its fix

  /// Covariance of errors kI and kJ (nav::InsState), at the present.
  template <int kI, int kJ = kI>
  [[nodiscard]] float covariance() const {
    return nav::predicted_covariance<kI, kJ>(p, ahead);
  }
  /// Three errors that belong together (position, velocity, ...): 1 sigma of each, and their correlations.
  struct Block {
    std::array<float, 3> sigma;
    float corr_01, corr_02, corr_12;
  };
  /// Block of errors first, first + 1 and first + 2, at the present.
  [[nodiscard]] Block block(int first) const {
    const filter::Symmetric<float, 3> c = nav::predicted_block(p, ahead, first);
    const std::array<float, 3> s{base::sqrt(c(0, 0)), base::sqrt(c(1, 1)), base::sqrt(c(2, 2))};
    return {.sigma = s,
            .corr_01 = c(0, 1) / (s[0] * s[1]),
            .corr_02 = c(0, 2) / (s[0] * s[2]),
            .corr_12 = c(1, 2) / (s[1] * s[2])};
  }
};

/// Output of an attitude estimator: the attitude at the present, and which parts of it are valid.
struct AttitudeEstimate {
  filter::Quaternion q_nb;
  bool valid = false;            ///< tilt, at least
  bool heading_valid = false;    ///< false: the heading is free and drifts
  bool field_disturbed = false;  ///< the magnetometer is not followed
};

[[nodiscard]] inline AttitudeEstimate attitude_of(const nav::InsState& x, bool valid) {
  const nav::Quaternion& q = x.q_nb;
  return {.q_nb = {q.w, q.x, q.y, q.z}, .valid = valid, .heading_valid = valid};
}

/// An attitude that knows the level plane of the place and its north, in the map.
[[nodiscard]] inline AttitudeEstimate in_map(const AttitudeEstimate& e, const nav::LocalLevel& place) {
  const filter::Quaternion q{place.q_nl.w, place.q_nl.x, place.q_nl.y, place.q_nl.z};
  AttitudeEstimate turned = e;
  turned.q_nb = (q * e.q_nb).renormalised();
  return turned;
}

/// One measurement (or input) and what became of it. dof 0: an input that is integrated, not compared.
struct Innovation {
  sensor::Verdict verdict = sensor::Verdict::kNotUsed;
  std::uint8_t dof = 0;
  float nis = 0;
  float gate = 0;
  std::uint8_t landmark = 0xFF;
  sensor::Check failed = sensor::Check::kNone;  ///< test that refused the measurement
  float statistic = 0;                          ///< statistic of that test, where it is not the innovation gate
  float limit = 0;                              ///< limit of that statistic
};

/// Record of an input that is integrated. A refused one was beyond what the sensor can measure.
[[nodiscard]] inline Innovation input_record(sensor::Verdict verdict) {
  return {.verdict = verdict,
          .failed = verdict == sensor::Verdict::kRejected ? sensor::Check::kValue : sensor::Check::kNone};
}

/// Record of a sample that fuse() took with the verdict Pending: its fate, once that is known.
struct LateRecord {
  base::Micros stamp;
  sensor::Sensor sensor = sensor::Sensor::kNotAvailable;
  std::uint8_t instance = 0;
  Innovation innovation;
};

/// The filter's record in the bus's words.
template <int M>
[[nodiscard]] Innovation record(const filter::Innovation<float, M>& from, std::uint8_t landmark = 0xFF) {
  constexpr sensor::Verdict kWord[] = {sensor::Verdict::kAccepted, sensor::Verdict::kRejected,
                                       sensor::Verdict::kSingular, sensor::Verdict::kNotFinite};
  constexpr sensor::Check kFailed[] = {sensor::Check::kNone, sensor::Check::kGate, sensor::Check::kValue,
                                       sensor::Check::kValue};
  const auto verdict = static_cast<std::size_t>(from.verdict);
  return {.verdict = kWord[verdict],
          .dof = M,
          .nis = from.nis,
          .gate = from.gate,
          .landmark = landmark,
          .failed = kFailed[verdict]};
}

}  // namespace tetap::estimators
