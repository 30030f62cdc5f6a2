// SPDX-License-Identifier: Apache-2.0
// The attitude filter (filter/attitude.hpp) in the firmware: gyroscope, accelerometer and, on a robot that has one,
// magnetometer. It uses nothing else, so that its answer can judge an estimator with more inputs. The filter is
// delayed, because its state is large. The present is the far end of the window, turned on by the gyroscope's samples
// in it.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/checks/imu_classifier.hpp"
#include "tetap/estimators/context.hpp"
#include "tetap/estimators/estimate.hpp"
#include "tetap/estimators/gyro_turn.hpp"
#include "tetap/filter/attitude.hpp"
#include "tetap/sensor/magnetic_field.hpp"
#include "tetap/sensor/sample.hpp"
#include "tetap/sensor/window.hpp"

#include <cstdint>

namespace tetap::estimators {

class Attitude {
 public:
  static constexpr sensor::EstimatorKind kKind = sensor::EstimatorKind::kAttitude;
  static constexpr bool kDelayed = true;

  void restart(base::Micros t, const Context& ctx) {
    filter::AttitudeOptions options = ctx.parameters.attitude;
    options.declination_rad = ctx.parameters.magnetic.declination_rad;
    filter_ = filter::Attitude(options);
    ahead_ = {};
    far_turn_ = turn_ = {};
    anew_ = true;
    rate_b_radps_ = last_rate_b_radps_ = filter::Vector3::Zero();
    now_ = time_ = last_imu_ = field_time_ = t;
    far_ = seen_ = {};
  }
  /// A pose from outside is not taken: this attitude stays independent of the other estimators' inputs.
  void set_pose(base::Micros, const SetPose&, const Context&) {}

  Innovation fuse(const sensor::ImuSample& sample, base::Micros stamp, const Context& ctx);
  Innovation fuse(const sensor::MagneticFlux& sample, base::Micros stamp, const Context& ctx);

  /// A sample is new in the window.
  void arrived(const sensor::Sample& sample, const Context& ctx);
  void advance(base::Micros t, const Context& ctx, const sensor::Window& window);

  [[nodiscard]] AttitudeEstimate attitude(const Context&) const {
    return {.q_nb = q_nb(),
            .valid = filter_.started() && now_ - last_imu_ < kSilent,
            .heading_valid = filter_.heading_known(),
            .field_disturbed = filter_.magnetometer_disturbed()};
  }
  /// Heading and yaw rate: this filter has no place.
  [[nodiscard]] Estimate estimate(const Context& ctx) const;
  [[nodiscard]] sensor::Mode mode(const Context& ctx) const {
    if (!filter_.started() || now_ - last_imu_ >= kSilent) return sensor::Mode::kWaitingForImu;
    if (ctx.parameters.magnetic.use != 0 && !filter_.heading_known()) return sensor::Mode::kFindingHeading;
    const bool disturbed = filter_.magnetometer_disturbed() || filter_.accelerometer_disturbed();
    return disturbed ? sensor::Mode::kDegraded : sensor::Mode::kNominal;
  }
  static constexpr auto members(auto& self) {
    return base::members(self.filter_, self.ahead_, base::in_turns(self.far_turn_), self.turn_, self.rate_b_radps_,
                         self.last_rate_b_radps_, self.now_, self.time_, self.last_imu_,
                         base::in_turns(self.field_time_), self.far_, self.seen_, self.anew_);
  }

 private:
  static constexpr base::Micros kSilent{500'000};
  /// The filter's longest step: the gyroscope is taken to have shown the same throughout.
  static constexpr base::Micros kBridged{200'000};

  void follow(const sensor::Window& window, const Context& ctx);
  [[nodiscard]] filter::Quaternion q_nb() const { return (filter_.q_nb() * ahead_).renormalised(); }

  filter::Attitude filter_;                                      ///< at the far end of the window
  filter::Quaternion ahead_;                                     ///< the turn from there to the present, in body axes
  GyroTurn far_turn_, turn_;                                     ///< up to the far end, and up to the present
  filter::Vector3 rate_b_radps_ = filter::Vector3::Zero();       ///< at the far end, as the gyroscope shows it
  filter::Vector3 last_rate_b_radps_ = filter::Vector3::Zero();  ///< at the present
  base::Micros now_;
  base::Micros time_;      ///< stamp of the last IMU sample in the filter
  base::Micros last_imu_;  ///< stamp of the last IMU sample in the window
  base::Micros field_time_;
  base::Micros far_, seen_;  ///< stamps of the last samples in far_turn_ and in turn_
  bool anew_ = true;         ///< turn_ is not what the window's samples give
};

}  // namespace tetap::estimators
