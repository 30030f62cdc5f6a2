// SPDX-License-Identifier: Apache-2.0
// Numbers of the attitude filter. Defaults are those published with VQF where that filter has the same parameter.
// Source: Laidig & Seel 2023, Information Fusion 91, "VQF: Highly accurate IMU orientation estimation with bias
// estimation and magnetic disturbance rejection", table 1. tools/report/choose_attitude chose the others by leaving out
// one trial.
#pragma once

namespace tetap::filter {

struct AttitudeOptions {
  static constexpr float kDegree = 0.0174532925F;

  // Inclination.
  float tau_inclination_s = 3.0F;
  /// The low-passed vertical moves by motion that averages out and by gyroscope bias. A faster correction than this is
  /// neither, and is limited to it.
  float inclination_limit_radps = 3.0F * kDegree;
  /// An error beyond this is not corrected at all, for the hold time.
  float inclination_reject_rad = 3.0F * kDegree;
  float inclination_hold_s = 10.0F;
  /// 1 sigma of the settled vertical. A turn of this size that the gyroscope missed halves both time constants.
  float inclination_sigma_rad = 3.0F * kDegree;

  // Gyroscope bias.
  float bias_start_sigma_radps = 0.5F * kDegree;
  float bias_walk_radps = 0.1F * kDegree;  ///< drift of the bias in bias_walk_s
  float bias_walk_s = 100.0F;
  float bias_limit_radps = 2.0F * kDegree;
  float bias_motion_sigma_radps = 0.1F * kDegree;  ///< reached in steady state by motion alone, by rest alone
  float bias_rest_sigma_radps = 0.03F * kDegree;
  /// Weight of a sensor in motion for its bias about the vertical: a leak to what is observed.
  float bias_vertical_weight = 1e-4F;

  // Rest.
  float rest_after_s = 1.5F;
  float tau_rest_s = 0.5F;
  float rest_rate_radps = 2.0F * kDegree;
  float rest_acceleration_mps2 = 0.5F;

  // Heading.
  float tau_heading_s = 9.0F;
  float declination_rad = 0.0F;  ///< magnetic north from true north, eastward positive
  /// Deviation from the reference, as a share of the horizontal field, that quarters the weight of a sample.
  float field_deviation_share = 0.15F;
  float field_turn_rad = 2.0F;  ///< turn in which the reference forgets the older field
};

/// Full scale of the sensors on each axis. A reading above kRangeShare of it may be clipped.
struct SensorRange {
  static constexpr float kRangeShare = 0.98F;  ///< the rest is scale error and calibration
  float gyroscope_radps = 34.9F;               ///< 2000 degrees/s
  float accelerometer_mps2 = 156.9F;           ///< 16 g
};

}  // namespace tetap::filter
