// SPDX-License-Identifier: Apache-2.0
// The numbers of the attitude filter. Defaults are those published with VQF (Laidig & Seel 2023, Information Fusion 91,
// "VQF: Highly accurate IMU orientation estimation with bias estimation and magnetic disturbance rejection", table 1)
// where that filter has the same parameter; each of the rest names its source.
#pragma once

namespace tetap::filter {

struct AttitudeOptions {
  static constexpr float kDegree = 0.0174532925F;

  // Inclination.
  float tau_inclination_s = 3.0F;
  /// A reading at the end of the sensor's range is not a measurement: 16 g less 2 %.
  float accelerometer_limit_mps2 = 153.0F;
  /// Limit of the levelling's turn rate, for inclination_hold_s at most. Motion that averages out and gyroscope bias
  /// turn the low-passed vertical more slowly.
  float inclination_limit_radps = 3.0F * kDegree;
  /// Tilt between the two verticals beyond which levelling stops altogether, for inclination_hold_s at most.
  float inclination_reject_rad = 3.0F * kDegree;
  float inclination_hold_s = 10.0F;
  /// A gyroscope at the end of its range (2000 degrees/s less 2 %) has lost the attitude: the mean over the slow
  /// sensors begins anew, as if it were this old.
  float gyroscope_limit_radps = 34.2F;
  float relevel_s = 0.2F;

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
  float tau_field_s = 0.05F;
  float tau_reference_s = 20.0F;
  float field_norm_share = 0.1F;  ///< share of the reference's strength beyond which a field is disturbed
  float field_dip_rad = 10.0F * kDegree;
  float field_undisturbed_s = 0.5F;                 ///< for so long inside both, to be undisturbed again
  float field_first_s = 5.0F, field_new_s = 20.0F;  ///< in motion, until another field becomes the reference
  float field_motion_radps = 20.0F * kDegree;
  float field_reject_s = 60.0F;       ///< a disturbance of longer is followed, at 1/field_reject_factor of the gain
  float field_provisional_s = 10.0F;  ///< the same against a reference that no motion has confirmed
  float field_reject_factor = 2.0F;
};

}  // namespace tetap::filter
