// SPDX-License-Identifier: Apache-2.0
// Imperfections of the world: every magnitude with its source. The defaults are the mismatched world, with effects no
// planar filter models; matched() keeps only what a filter models exactly, for consistency tests.
//
// [ICM] TDK DS-000347 v1.7 (ICM-42688-P): sec. 3.1 table 1 (gyroscope), sec. 3.2 table 2 (accelerometer).
// [F9P] u-blox UBX-17051259 (ZED-F9P data sheet): sec. 1.2 (performance): 1.0 m CEP with SBAS, 0.05 m/s velocity.
// [BF]  Borenstein, Feng, "Measurement and correction of systematic odometry errors in mobile robots", IEEE T-RA 12(6),
// 1996. [own] our choice, stated so that a report can name it.
#pragma once

#include "sim_host/world/rotation.hpp"
#include "sim_host/world/sight_numbers.hpp"
#include "tetap/base/time.hpp"

#include <array>
#include <cstdint>

namespace tetap::sim {

inline constexpr double kG0 = 9.80665;  ///< standard gravity [m/s^2], the "g" of data sheets

enum class VehicleKind : std::uint8_t { kDifferentialDrive, kCar, kMulticopter };

struct VehicleParameters {
  VehicleKind kind = VehicleKind::kDifferentialDrive;
  double wheel_radius_m = 0.10;      ///< mean of both, as in the robot's papers; what a filter is given
  double track_m = 0.50;             ///< likewise
  double drawn_difference = 0;       ///< (left - right) / mean of the radii, likewise
  double axle_x_b_m = 0;             ///< the axle that does not steer, ahead of the IMU
  double turning_radius_m = 0;       ///< smallest of a car; 0: turns on the spot
  double acceleration_lag_s = 0.10;  ///< motor current and load [own]
  double yaw_lag_s = 0.12;
  double steer_beside_per_m2 = 1.5;  ///< curvature per metre beside the line [own]
  double steer_heading_per_m = 2.5;  ///< curvature per radian off its direction
  double steer_most_m = 0.5;         ///< further beside the line it steers no harder
  double slip_yaw = 0;   ///< 1 sigma of the share by which a skidding vehicle's wheels turn further than the body
  double rotor_mps = 2;  ///< rotors of a multicopter, as a speed of the vibration figures
  double radius_difference =
      0.005;  ///< (left - right) / mean: unequal wheels [BF: the larger of the two dominant errors]
  double track_error =
      0.01;  ///< true over nominal, minus 1: contact points are not those of the drawing [BF: the other one]
  double slip_per_mps2 = 0.010;        ///< longitudinal slip for an acceleration of 1 m/s^2 [own]
  double slip_curve_per_mps2 = 0.006;  ///< both wheels turn further than they roll, per lateral acceleration [own]
  double slip_random = 0.010;          ///< 1 sigma per wheel at full load, Gauss-Markov [own]
  double slip_random_tau_s = 1.0;
  double side_slip_s = 0.010;         ///< drift to the outside of a curve: v_y = -side_slip * v * yaw rate [own]
  double roll_rad_per_mps2 = 0.012;   ///< body leans to the outside: 0.7 deg at 1 m/s^2 [own]
  double pitch_rad_per_mps2 = 0.010;  ///< squat on acceleration [own]
  double ground_rad = 0.004;          ///< roll and pitch by uneven ground, 1 sigma while moving [own]
  double ground_tau_s = 0.4;
  double driver_wander_m = 0.08;  ///< lateral, Gauss-Markov: no two runs drive the same line [own]
  double driver_wander_tau_s = 6;
  double jitter_mps =
      0;  ///< trembling of the body sideways and up, at rest too; white for sensors (see matched_inertial())
  double jitter_ahead_mps = 0;
  double jitter_tau_s = 0.002;
  double start_m = 0.05;  ///< 1 sigma per axis of where the rover really stands at the start [own]
  double start_rad = 0.02;
};

struct ImuParameters {
  int rate_hz = 100;  ///< 0: no IMU; a divisor of 2000
  std::array<double, 3> accel_noise = {65e-6 * kG0, 65e-6 * kG0,
                                       70e-6 * kG0};  ///< m/s^2/sqrt(Hz) [ICM: 65 x, y; 70 z ug/sqrt(Hz)]
  double gyro_noise = radians(0.0028);                ///< rad/s/sqrt(Hz) [ICM: 0.0028 deg/s/sqrt(Hz)]
  double gyro_turn_on_radps =
      radians(0.1);                  ///< 1 sigma; [ICM] states +-0.5 deg/s on a board, here after a bench calibration
  double accel_turn_on_mps2 = 0.05;  ///< 1 sigma; [ICM] states +-20 mg, likewise
  double gyro_walk_radps = radians(10.0 / 3600);  ///< in-run bias, Gauss-Markov 1 sigma [own: not in the data sheet]
  double accel_walk_mps2 = 0.001;
  double walk_tau_s = 300;
  double scale = 0.003;            ///< accelerometer: 1 sigma per axis [ICM: +-0.5 % initial tolerance]
  double gyro_scale = 0.003;       ///< likewise
  double vibration_speed_mps = 2;  ///< at which the next figures are stated; they grow with the speed
  double vibration_mps2 = 1.5;     ///< amplitude from tyre lugs [own]
  double vibration_radps = 0.03;
  int lugs = 17;                           ///< per turn of the wheel: 54 Hz at 2 m/s
  double vibration_noise = 0.02;           ///< m/s^2/sqrt(Hz), broadband [own]
  double vibration_gyro_noise = 0;         ///< rad/s/sqrt(Hz), likewise
  double gyro_range_radps = radians(500);  ///< full scale as configured
  double accel_range_mps2 = 4 * kG0;
  bool earth_rotation = true;
  double temperature_degC = 31;
  Matrix3 mounting_bs;  ///< from the sensor's axes into the body's
  Vector3 position_b_m{};
  /// Errors that a calibration of the robot has found, in the sensor's axes: it shows matrix^-1 y + bias for y.
  Matrix3 accel_matrix;
  Vector3 accel_bias_mps2{};
  Vector3 gyro_bias_radps{};
  base::Micros phase{9'000};  ///< offset of its samples within the period: no two clocks tick together [own]
  base::Micros latency_min{300}, latency_max{700};
};

enum class WheelOutput : std::uint8_t { kCounts, kWheelSpeeds, kBodySpeed };

struct WheelSensorNumbers {
  int rate_hz = 100;  ///< 0: none; a divisor of 2000
  WheelOutput output = WheelOutput::kCounts;
  double counts_per_turn = 2000;  ///< 500 lines, four edges: 0.31 mm of travel
  double noise_m = 0;             ///< k: variance of the measured travel per metre; the filters' own error model
  double noise_share = 0;         ///< 1 sigma of each reading's travel, as a share of it
  double speed_noise_mps = 0;     ///< white noise of a body speed, 1 sigma
  double speed_scale = 0;         ///< likewise: 1 sigma of its scale, drawn once
  bool yaw_rate = true;           ///< false: a speedometer, without a turn
  std::array<double, 2> stated_scale{1,
                                     1};  ///< stated over true speed: of the left and right wheel, or of speed and turn
  base::Micros stamp_late_max{100};       ///< stamped by software up to this much after the counters were latched [own]
  base::Micros phase{8'500};
  base::Micros latency_min{300}, latency_max{900};
};

struct GnssParameters {
  int rate_hz = 5;               ///< 0: none
  double white_m = 0.30;         ///< per horizontal axis; with the next line 0.85 m = 1.0 m CEP [F9P]
  double correlated_m = 0.80;    ///< Gauss-Markov
  double correlated_tau_s = 60;  ///< multipath and atmosphere [own; minutes in the literature]
  double vertical_factor = 1.6;  ///< height error over horizontal [own: usual geometry]
  double velocity_mps = 0.05;    ///< white, per axis [F9P]
  double velocity_vertical_factor = 1;
  double accuracy_error = 0.2;  ///< 1 sigma of the receiver's own accuracy figure against the truth, slow [own]
  double accuracy_scale = 1;    ///< accuracy figure over the true 1 sigma, in the mean
  std::array<double, 3> antenna_b_m{0, 0, 0.4};
  double outage_every_s = 90;  ///< mean time between outages; 0: none [own]
  double outage_min_s = 2, outage_max_s = 8;
  double glitch_probability = 0.004;  ///< per fix: multipath jump that the accuracy figure does not show [own]
  double glitch_min_m = 4, glitch_max_m = 15;
  int glitch_fixes_max = 4;              ///< a glitch lasts 1 to so many fixes
  base::Micros quiet_start{20'000'000};  ///< no outage or glitch before, so that a first fix is a fix
  base::Micros phase{104'000};
  base::Micros latency_min{80'000}, latency_max{120'000};
};

/// The Earth's field is that of the default origin, rounded, as the IGRF has it (48.6 uT, 64.2 deg down, 4 deg east).
/// It is in the axes of whatever place.
struct MagnetometerNumbers {
  int rate_hz = 0;  ///< 0: none
  double field_uT = 48.6;
  double dip_rad = radians(64.2);
  double declination_rad = radians(4.0);
  double noise_uT = 0.3;      ///< white, per axis [own: usual for a small AMR sensor]
  double hard_iron_uT = 0.8;  ///< 1 sigma per axis: what a calibration leaves [own]
  double scale = 0.01;        ///< 1 sigma per axis: soft iron left over [own]
  double local_uT = 1.0;      ///< 1 sigma per axis: iron in the ground, passed at walking speed [own]
  double local_tau_s = 5;
  Matrix3 mounting_bs;  ///< from the sensor's axes into the body's
  Matrix3 soft_iron;    ///< as a calibration of the robot has found it: it shows soft iron^-1 y + hard iron for y
  Vector3 found_hard_iron_uT{};
  base::Micros phase{11'500};
  base::Micros latency_min{500}, latency_max{2'000};
};

struct BarometerNumbers {
  int rate_hz = 0;         ///< 0: none
  double noise_Pa = 2;     ///< white: 17 cm [own: usual for a small sensor without filter]
  double turn_on_Pa = 50;  ///< 1 sigma of its absolute error [own: likewise]
  double drift_Pa = 30;    ///< weather and warming up, Gauss-Markov 1 sigma [own]
  double drift_tau_s = 1800;
  double temperature_degC = 24;
  base::Micros phase{57'000};
  base::Micros latency_min{5'000}, latency_max{15'000};
};

struct CameraNumbers {
  int rate_hz = 5;  ///< 0: none
  double range_max_m = 12;
  double field_of_view_rad = radians(120);
  double sigma_range_m = 0.10;
  double sigma_range_per_m = 0.01;  ///< grows with range
  double sigma_bearing_rad = 0.015;
  double scale_error = 0.005;      ///< range error by focal length [own]
  double mount_error_rad = 0.004;  ///< yaw of the mount against the filter's parameter [own]
  double miss_probability = 0.15;
  double wrong_id_probability = 0.005;
  bool identities = true;                    ///< false: a sighting names no landmark
  double clutter = 0;                        ///< false sightings a look, on average, anywhere in the field of view
  int movers = 0;                            ///< obstacles that move among the landmarks and look like them
  double mover_mps = 0.5;                    ///< speed of each, to and fro on a straight line [own]
  double mover_way_m = 6;                    ///< length of that line
  double survey_m = 0.015;                   ///< 1 sigma per axis of the landmark map
  double x_b_m = 0, y_b_m = 0, yaw_rad = 0;  ///< place of its mounting
  base::Micros phase{33'500};
  base::Micros latency_min{20'000}, latency_max{60'000};
};

/// A laser scanner whose scans are matched with the last keyframe's and with those of earlier ones nearby.
struct ScanMatcherNumbers {
  int rate_hz = 0;                              ///< 0: none
  double keyframe_m = 0.5, keyframe_rad = 0.3;  ///< way or turn after which a keyframe is due
  double reach_m = 2, reach_rad = radians(45);  ///< an earlier keyframe within both is recognised [own]
  int apart = 20;                               ///< keyframes that lie between the two of a loop, at least
  double sigma_m = 0.02, sigma_rad = 0.005;     ///< white, per displacement and axis [own]
  base::Micros phase{45'500};
  base::Micros latency_min{20'000}, latency_max{20'000};  ///< its displacements come in their order
};

struct Parameters {
  VehicleParameters vehicle;
  ImuParameters imu;
  WheelSensorNumbers wheels;
  GnssParameters gnss;
  CameraNumbers camera;
  MagnetometerNumbers magnetometer;
  BarometerNumbers barometer;
  ScanMatcherNumbers scan_matcher;
  PeopleNumbers people;
  LidarNumbers lidar;
  FeatureCameraNumbers features;
};

/// Only white noise of the stated sigma and encoder noise k |ds|: nothing a filter does not model. Accuracy figures are
/// exact, and every sensor samples at an instant of the wheels', so that nothing is interpolated.
[[nodiscard]] inline Parameters matched(Parameters n) {
  n.vehicle.radius_difference = n.vehicle.track_error = n.vehicle.slip_per_mps2 = n.vehicle.slip_curve_per_mps2 =
      n.vehicle.slip_random = 0;
  n.vehicle.side_slip_s = n.vehicle.roll_rad_per_mps2 = n.vehicle.pitch_rad_per_mps2 = n.vehicle.ground_rad = 0;
  n.imu.gyro_turn_on_radps = n.imu.accel_turn_on_mps2 = n.imu.gyro_walk_radps = n.imu.accel_walk_mps2 = n.imu.scale =
      n.imu.gyro_scale = 0;
  n.imu.vibration_mps2 = n.imu.vibration_radps = n.imu.vibration_noise = n.imu.vibration_gyro_noise = 0;
  n.imu.earth_rotation = false;
  n.wheels.counts_per_turn = 20000;  // so that quantisation (31 um) stays far below the noise of one sample
  n.wheels.noise_m = 2e-5;
  n.wheels.stamp_late_max = {};
  n.imu.phase = n.wheels.phase = {8'500};
  n.gnss.phase = {108'500};
  n.camera.phase = {38'500};
  n.gnss.white_m = 0.85;
  n.gnss.correlated_m = n.gnss.accuracy_error = n.gnss.outage_every_s = n.gnss.glitch_probability = 0;
  n.gnss.antenna_b_m = {};
  n.camera.sigma_range_per_m = n.camera.scale_error = n.camera.mount_error_rad = 0;
  n.camera.wrong_id_probability = n.camera.survey_m = 0;
  n.magnetometer.hard_iron_uT = n.magnetometer.scale = n.magnetometer.local_uT = 0;
  n.magnetometer.phase = {18'500};
  n.barometer.drift_Pa = 0;
  n.barometer.phase = {58'500};
  n.lidar = matched(n.lidar);
  n.features = matched(n.features);
  return n;
}

/// The world that an inertial filter models exactly: matched() with three additions. Biases wander at random. A
/// Gauss-Markov process much slower than the run gives such biases: its first draw is the turn-on bias, and it drives
/// 2 sigma^2 / tau. Wheels have an error that is a share of their travel. The body trembles, at rest as well. Sideways
/// and up it trembles as much as a filter takes for the noise of the non-holonomic constraint. Ahead it trembles as
/// much as a filter takes for that of the wheels.
[[nodiscard]] inline Parameters matched_inertial(Parameters n) {
  const ImuParameters imu = n.imu;
  const double gnss_m = sim::sqrt(n.gnss.white_m * n.gnss.white_m + n.gnss.correlated_m * n.gnss.correlated_m);
  n = matched(n);
  n.gnss.white_m = gnss_m;
  n.imu.gyro_walk_radps = imu.gyro_turn_on_radps;
  n.imu.accel_walk_mps2 = imu.accel_turn_on_mps2;
  n.imu.walk_tau_s = 1e5;
  n.imu.accel_range_mps2 = 16 * kG0;  // the jitter is steep
  n.imu.accel_noise = {imu.accel_noise[2], imu.accel_noise[2], imu.accel_noise[2]};
  n.vehicle.jitter_mps = 0.005;
  n.vehicle.jitter_ahead_mps = 0.001;
  n.gnss.velocity_vertical_factor = 1.5;
  // On the node's ticks and at once: what the body does between a sample and the tick is in no filter's covariance.
  n.imu.phase = n.wheels.phase = {};
  n.imu.latency_min = n.imu.latency_max = n.wheels.latency_min = n.wheels.latency_max = {};
  n.gnss.phase = {100'000};
  return n;
}

/// Errors of GNSS positions of so much in all, per horizontal axis, with the same share of white noise.
[[nodiscard]] inline GnssParameters with_error(GnssParameters n, double sigma_m) {
  const double by = sigma_m / sim::sqrt(n.white_m * n.white_m + n.correlated_m * n.correlated_m);
  n.white_m *= by;
  n.correlated_m *= by;
  return n;
}

/// Everything arrives at the instant it was true.
[[nodiscard]] inline Parameters without_latency(Parameters n) {
  n.imu.latency_min = n.imu.latency_max = n.wheels.latency_min = n.wheels.latency_max = {};
  n.gnss.latency_min = n.gnss.latency_max = n.camera.latency_min = n.camera.latency_max = {};
  n.magnetometer.latency_min = n.magnetometer.latency_max = {};
  n.barometer.latency_min = n.barometer.latency_max = {};
  n.lidar.latency_min = n.lidar.latency_max = n.features.latency_min = n.features.latency_max = {};
  n.lidar.frame = n.features.frame = {};
  return n;
}

}  // namespace tetap::sim
