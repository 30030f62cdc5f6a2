// SPDX-License-Identifier: Apache-2.0
// The parameters of a robot in one struct, passed by const reference. Types and sizes are template arguments;
// everything that can be tuned is here. Each member has a row in param/table.hpp: index, unit, limits, text. The
// table's CRC is in the version frame.
#pragma once

#include "tetap/base/time.hpp"
#include "tetap/filter/attitude_options.hpp"
#include "tetap/model/differential_drive.hpp"
#include "tetap/model/landmark.hpp"
#include "tetap/model/unicycle.hpp"

#include <array>
#include <cstdint>

namespace tetap::param {

/// Proof that a Begin or Step frame needs for the node to follow it instead of its own timer.
enum class Lockstep : std::int32_t {
  kAuthenticated,  ///< a tag (bus/authentication.hpp)
  kGuarded,        ///< a tag, or the checksum of an In_Guard frame before it
  kPlain,          ///< nothing
};

struct LoopParameters {
  std::int32_t period_us = 10'000;   ///< period of the tick, in sample time
  std::int32_t window_us = 200'000;  ///< how late a sample may come and still be fused at its own time
  std::int32_t ahead_us = 200'000;   ///< how far ahead of the tick a stamp may be and still wait
  float turn_radps2 = 0.5F;          ///< 1 sigma of what turns it faster or slower: a yaw rate is as old as its sample
  std::int32_t work_units = 1000;    ///< share of a job longer than a tick, in each tick
  Lockstep lockstep = Lockstep::kGuarded;
};

/// Relation of a speed sample to its stamp.
enum class Hold : std::int32_t {
  kForward,   ///< a command: holds from its stamp on
  kBackward,  ///< a measurement: the mean since the sample before
};

struct WheelParameters {
  model::DifferentialDrive drive{};
  model::UnicycleNoise noise{};  ///< for BodySpeed samples
  float wheel_speed_noise = 0;   ///< m^2/s per wheel: white noise of WheelSpeed samples, at standstill
  Hold hold = Hold::kBackward;
  std::int32_t delay_us = 0;  ///< from a BodySpeed sample's stamp to the motion it speaks of: a command's dead time
  float speed_scale = 1;      ///< true speed over stated speed, of BodySpeed samples
  float yaw_rate_scale = 1;
  float left_speed_scale = 1;  ///< the same of WheelSpeeds samples
  float right_speed_scale = 1;
  std::int32_t timeout_us = 500'000;  ///< without a sample for longer: assume standstill, grow the covariance fast
  float timeout_noise = 1.0F;         ///< m^2/s and rad^2/s then
  float most_mps = 50;                ///< fastest rim of a wheel; a faster step or speed is refused
};

/// The IMU's own errors as tools/calibrate/calibrate_robot finds them, in its own axes. Specific force = accel_matrix
/// (raw - accel_bias). Turn rate = raw - gyro_bias - slope (temperature - at); without a temperature the slope is not
/// used. Estimators publish the rest as a bias.
struct ImuParameters {
  std::array<float, 3> accel_bias_mps2{0, 0, 0};
  std::array<float, 9> accel_matrix{1, 0, 0, 0, 1, 0, 0, 0, 1};  ///< scale and misalignment, row by row
  std::array<float, 3> gyro_bias_radps{0, 0, 0};
  std::array<float, 3> gyro_bias_slope_radps_per_degC{0, 0, 0};
  float gyro_bias_at_degC = 25;
};

struct GyroParameters {
  std::int32_t use = 0;                ///< 0: yaw rate from the wheels, 1: from IMU instance 0
  std::array<float, 3> up_s{0, 0, 1};  ///< the body's z axis as a unit vector in sensor axes: row 3 of R_bs
  float noise = 0;                     ///< rad^2/s: angular random walk squared, plus vibration
  float bias_time_s = 20;              ///< time constant of the bias average at standstill
  float standstill_mps = 0.002F;       ///< wheels slower than this for one second mean standstill
};

struct LandmarkParameters {
  model::PlanarMounting mounting{};  ///< mounting of the sensor
  float sigma_range_m = 0.1F;
  float sigma_range_per_m = 0;  ///< grows with range
  float sigma_bearing_rad = 0.02F;
  float sigma_range_only_m = 0.1F;  ///< 1 sigma of a range without a bearing
  float gate_scale = 1;             ///< times the 99 % chi-square quantile
  std::int32_t depth = 0;           ///< 1: a stated range is the depth along the sensor's axis, range cos(bearing)
  float range_offset_m = 0;         ///< stated less true range, at the sensor
  float range_scale = 1;            ///< true over stated range, without the offset
};

/// A moving target, as a sensor at rest sees it.
struct TargetParameters {
  float sigma_position_m = 0.15F;        ///< lidar, per axis
  float sigma_range_m = 0.3F;            ///< radar
  float sigma_bearing_rad = 0.03F;       ///< radar
  float sigma_range_rate_mps = 0.3F;     ///< radar
  float acceleration_mps2 = 3;           ///< 1 sigma, constant between two measurements
  float yaw_acceleration_radps2 = 0.5F;  ///< the same of a target that turns
  float sigma_speed_mps = 10;            ///< at the beginning of a track; per axis, or along the yaw
  float sigma_yaw_rad = 1;
  float sigma_yaw_rate_radps = 0.3F;
  float gate_scale = 1;                 ///< times the 99 % chi-square quantile
  std::int32_t timeout_us = 2'000'000;  ///< a track without a measurement for so long is over
};

struct GnssParameters {
  float antenna_x_b_m = 0;
  float antenna_y_b_m = 0;
  float antenna_z_b_m = 0;
  std::int32_t delay_us = 0;  ///< from the measurement to its stamp
  float sigma_velocity_floor_mps = 0.1F;
  float sigma_floor_m = 0.5F;  ///< lower limit of the receiver's own accuracy
  float sigma_scale = 1;       ///< times the receiver's own accuracy
  float correlation_s = 0;     ///< how long the receiver's errors last; 0: a new one with every fix
  float gate_scale = 1;
  float align_distance_m = 8;  ///< travel by GNSS before a heading is derived from it
  /// Baseline of a receiver with two antennas: from the first to the second. Its heading is that of this line.
  std::array<float, 3> baseline_b_m{1, 0, 0};
  std::int32_t heading_stuck_samples = 50;  ///< repeated so often to the last bit, a heading is a stuck one; 0: never
  /// 0: the first of fixes that confirm each other is the origin. 1: as given here. 2: as given, until fixes that
  /// confirm each other lie beyond the map's range.
  std::int32_t origin_configured = 0;
  std::int64_t origin_latitude_2ndeg = 0;
  std::int64_t origin_longitude_2ndeg = 0;
  float origin_height_m = 0;
};

/// Inertial navigation: the sensor's data sheet, and how well the robot keeps to its wheels.
struct InertialParameters {
  std::int32_t imu = 0;  ///< instance of the IMU
  /// From the sensor's axes into the body's, row by row: x forward, y left, z up.
  std::array<float, 9> mounting_bs{1, 0, 0, 0, 1, 0, 0, 0, 1};
  std::array<float, 3> position_b_m{0, 0, 0};  ///< the IMU in the body
  float gyro_radps_rthz = 5e-5F;               ///< ICM-42688-P, DS-000347 table 1: 0.0028 deg/s/sqrt(Hz)
  float accel_mps2_rthz = 7e-4F;               ///< table 2: 70 ug/sqrt(Hz)
  float gyro_scale = 0.003F;                   ///< 1 sigma of its scale; table 1: initial tolerance 0.5 %
  float gyro_bias_radps2_rthz = 1e-5F;         ///< random walk of the bias
  float accel_bias_mps3_rthz = 2e-4F;
  float gyro_turn_on_radps = 0.01F;  ///< 1 sigma of the bias at start
  float accel_turn_on_mps2 = 0.2F;
  float start_tilt_rad = 0.05F;     ///< 1 sigma of levelling
  std::int32_t starts_forward = 0;  ///< 1: it never starts in reverse, so its course is its heading
  float level_s = 1;                ///< how long gravity is looked at
  std::int32_t earth_rate = 0;      ///< 1: a gyroscope good enough to feel the Earth turn, 15 deg/h
  float gap_mps2 = 3;               ///< acceleration while samples are missing
  float gap_radps = 1;
  float gap_wheels_radps = 0.1F;    ///< the same for turning, while wheels show how it turns
  std::int32_t stuck_samples = 10;  ///< repeated so often, a sample is one of a stuck sensor; 0: never
  float gyro_range_radps = 35;      ///< DS-000347 table 1: 2000 deg/s, which is 34.9
  float accel_range_mps2 = 160;     ///< table 2: 16 g, which is 156.9; the rest is for the calibration
  std::int32_t stale_us = 100'000;  ///< without a sample for longer: bridged
  float vibration_mps2 = 4;         ///< RMS up to which the noise densities hold; beyond, they grow with it
  float vibration_radps = 0.4F;     ///< likewise
  float calm_mps2 = 0.1F;           ///< RMS below which the robot may stand, where no wheels show it
  float calm_radps = 0.01F;
  float still_radps = 0.03F;    ///< turning slower than this, wheels still: standing
  float still_mps = 0.005F;     ///< 1 sigma of standing as wheels show it,
  float still_gnss_mps = 0.1F;  ///< the same for IMU and GNSS velocity
  float wheel_mps = 0.02F;      ///< 1 sigma of the wheels' speed at standstill
  float slip_share = 0.02F;     ///< growth of that with the speed
  float lateral_mps = 0.05F;    ///< how well it does not move sideways
  float vertical_mps = 0.05F;
  float axle_x_b_m = 0;                   ///< the axle that does not steer
  std::int32_t wheels_every_us = 15'000;  ///< wheels are fused no more often: at 100 Hz every second sample
  float wheel_gate_scale = 1;
  float slip_mps = 0.15F;  ///< off by more of it and 4 sigma, for long enough, a wheel is spinning; 0: not watched
  /// Period of the constraint "no motion sideways or up" while no wheel speed comes; 0: no constraint.
  std::int32_t constrain_every_us = 0;
};

/// The magnetometer: its calibration, and its limits of use. Field of the body = mounting * soft iron * (flux -
/// hard iron), the last two in the sensor's own axes.
struct MagneticParameters {
  std::int32_t use = 0;
  float declination_rad = 0;  ///< magnetic north from true north, eastward positive
  std::array<float, 3> hard_iron_uT{0, 0, 0};
  std::array<float, 9> soft_iron{1, 0, 0, 0, 1, 0, 0, 0, 1};    ///< row by row
  std::array<float, 9> mounting_bs{1, 0, 0, 0, 1, 0, 0, 0, 1};  ///< from the sensor's axes into the body's, row by row
  float sigma_rad = 0.1F;  ///< 1 sigma of a heading, all its errors together; the filter's heading gets no better by it
  float gate_scale = 1;
  float norm_uT = 0;        ///< strength of the field after calibration; 0: as found at the start
  float norm_share = 0.1F;  ///< off by more of it, the field is disturbed
  float dip_rad = 0.15F;    ///< the same for its angle below the horizon, from what was found at the start
  /// In motion for so long in a field that stays the same, but is not the one known: that is the known one then.
  float field_new_s = 20;
  std::int32_t stuck_samples = 50;  ///< in motion, repeated so often to the last bit, a field is a stuck one; 0: never
};

/// The barometer: its zero is found, and followed, where the height is known better by other means.
struct BaroParameters {
  std::int32_t use = 0;
  float sigma_m = 0.3F;       ///< 1 sigma of one height, white
  float drift_m_rts = 0.1F;   ///< drift of its zero by weather and warming up; m per root second
  float scale_share = 0.05F;  ///< share of a change of height: air that is not the standard atmosphere
  float gate_scale = 1;
  /// Repeated so often to the last bit (0.5 Pa on the bus), a pressure is a stuck one, where its noise is more than
  /// that; 0: never.
  std::int32_t stuck_samples = 0;
};

/// When two attitudes differ enough, for long enough, one of them is wrong. A curve that lasts tilts what only knows an
/// accelerometer: on the simulated road (5 m/s) by up to 0.1 rad.
struct DisagreementParameters {
  float tilt_rad = 0.15F;
  float heading_rad = 0.35F;
  std::int32_t after_us = 2'000'000;
};

/// The state at start; sigma_yaw_rad >= pi means the heading is not known.
struct StartParameters {
  std::int32_t known = 0;  ///< 0: wait for a set-pose command or, with GNSS, align
  float x_m = 0;
  float y_m = 0;
  float yaw_rad = 0;
  float sigma_position_m = 0.1F;
  float sigma_yaw_rad = 0.05F;
};

/// A sensor that was refused this long comes back by inflating the position's and heading's variance, once per period.
/// Not so GNSS position in the inertial filter: what it refuses becomes true only by persisting.
struct RecoveryParameters {
  std::int32_t after_us = 3'000'000;
  std::int32_t at_least = 10;  ///< rejections in a row
  float inflate_position_m = 1;
  float inflate_yaw_rad = 0.2F;
  std::int32_t persist_us = 60'000'000;  ///< refused fixes that agree for longer are a true jump
  std::int32_t persist_fixes = 120;      ///< number of such fixes, at least
  std::int32_t confirm_fixes = 5;        ///< fixes that agree before one decides where the filter is
  float frozen_m = 0.5F;                 ///< way with the same coordinates: the receiver repeats itself
};

/// Mappers: how the own map is made and sent.
struct MappingParameters {
  float correlation_m = 0;            ///< way over which errors of one landmark's sightings stay alike; 0: independent
  float separation_m = 0.8F;          ///< without identities: no new landmark nearer than this to another one
  std::int32_t association = 0;       ///< without identities: 0 nearest neighbour, 1 assignment, 2 joint compatibility
  std::int32_t confirming_hits = 3;   ///< a landmark of fewer sightings gives way when there is no room
  std::int32_t when_full = 0;         ///< 0: a new landmark is refused; 1: the landmark unseen for longest goes
  float resample_share = 0.5F;        ///< share of effective particles below which they are drawn anew
  std::int32_t seed = 1;              ///< key of the particles' noise
  std::int32_t publish_every = 10;    ///< ticks between landmarks or keyframes on the bus, one at a time; 0: never
  std::int32_t keyframes = 0;         ///< made by 0: the wheels, 1: closures from the last keyframe to the next id
  float keyframe_distance_m = 0.5F;   ///< way from which the wheels, or a scan, make a keyframe
  float keyframe_turn_rad = 0.5F;     ///< turn from which they do
  std::int32_t keyframe_time_ms = 0;  ///< time from which they do; 0: way and turn alone
};

/// A planar laser scanner: its place and heading on the body, and which ranges count.
struct LidarParameters {
  float x_b_m = 0;
  float y_b_m = 0;
  float yaw_rad = 0;
  float min_m = 0.1F;         ///< a shorter range is none: the robot itself
  float max_m = 30;           ///< a longer range is none; at most 32
  std::int32_t turn_us = 0;   ///< time of a full turn; 0: all beams are of one time
  std::int32_t delay_us = 0;  ///< time from the first beam to the stamp
};

/// Localisation by particles.
struct ParticleParameters {
  float temper = 0.35F;  ///< power of the likelihood; below 1 where errors of one landmark's sightings are alike
  float jitter = 0;      ///< m^2/s on both axes: motion that neither speed nor turn explains
};

/// A camera whose front end follows features: an ideal pinhole, z along the view, x right, y down.
struct CameraParameters {
  float fu_px = 0;  ///< focal lengths; 0: no camera, and this part is not in the CRC
  float fv_px = 0;
  float cu_px = 0;  ///< the pixel that the axis meets
  float cv_px = 0;
  /// From the camera's axes into the body's, row by row; a camera that looks ahead.
  std::array<float, 9> mounting_bc{0, 0, 1, -1, 0, 0, 0, -1, 0};
  std::array<float, 3> position_b_m{0, 0, 0};
  std::int32_t delay_us = 0;          ///< from the middle of the exposure to the stamp
  float sigma_px = 1.2F;              ///< a feature's noise, per axis; a track's errors are alike from image to image
  float sigma_mounting_rad = 0.003F;  ///< 1 sigma of the mounting, per axis
  float sigma_scale = 0.015F;         ///< 1 sigma of the speed's scale, which no image can show
  float sigma_direction_rad = 0.03F;  ///< 1 sigma of the speed's direction in the body, at the start
  float direction_walk = 0.01F;       ///< its drift; rad per square root of a second
  float sigma_tilt_rad = 0.05F;       ///< 1 sigma of roll and pitch at the start, where the robot is taken to be level

  [[nodiscard]] constexpr bool any() const { return fu_px > 0; }
};

/// Ticks between frames; 0 = never.
struct PublishParameters {
  std::int32_t pose_every = 1;  ///< estimate 1: position and motion
  std::int32_t std_every = 5;
  std::int32_t side_every = 10;  ///< every other estimate, all of its frames
  std::int32_t status_every = 10;
  std::int32_t statistics_every = 13;   ///< one sensor at a time
  std::int32_t diagnostics_every = 12;  ///< one page at a time
  std::int32_t identity_every = 25;     ///< version and origin, one frame at a time
  std::int32_t attitude_every = 5;      ///< attitude and velocity of an inertial estimate
  std::int32_t state_every = 10;        ///< one page of the rest of it at a time; a multiple of both
  std::int32_t event_every = 2;         ///< at most one innovation per so many ticks
};

/// Access to the commands: reset, set pose, map entries.
enum class CommandAccess : std::int32_t { kOpen, kAuthenticated, kNone };

/// Defence against other senders on the bus; guard and kAuthenticated need a robot that names them
/// (node/bus_protection.hpp).
struct BusParameters {
  CommandAccess commands = CommandAccess::kOpen;
  std::int32_t guard = 0;                        ///< 1: samples and map entries are used with their guard frame only
  std::array<std::uint32_t, 4> key{0, 0, 0, 0};  ///< key of the tags; all zero: none. Not in the parameters' CRC
};

/// Axis of a chip: x, y, z, then the same backwards.
enum class ChipAxis : std::int32_t { kX, kY, kZ, kMinusX, kMinusY, kMinusZ };

/// Sensors wired to the node's own board. A robot without any is fed by the bus alone, and this part is not in its CRC.
struct WiredParameters {
  std::int32_t imu = 0;  ///< 0: none, 1: ICM-42688-P; its samples are those of instance inertial.imu
  /// Axes of the chip that point along the axes of the robot's IMU samples: quarter turns of its place on the board.
  ChipAxis imu_x = ChipAxis::kX;
  ChipAxis imu_y = ChipAxis::kY;
  ChipAxis imu_z = ChipAxis::kZ;
  std::int32_t imu_rate_hz = 1'000;         ///< rate of the chip's own samples
  std::int32_t imu_readings = 10;           ///< chip's samples in one increment, coning and sculling included
  std::int32_t encoders = 0;                ///< 0: none, 1: a quadrature pair, left and right
  std::int32_t encoders_every_us = 10'000;  ///< period of a sample of both counts
  std::int32_t left_inverted = 0;           ///< 1: the left counter counts down when the robot drives forward
  std::int32_t right_inverted = 0;          ///< 1: the right one does
  float encoder_most_per_s = 200'000;       ///< counts per second beyond which a change is a jump
  std::int32_t gnss = 0;                    ///< 0: none, 1: a receiver read as it is, 2: a u-blox one, configured
  std::int32_t gnss_baud = 115'200;         ///< baud rate that a configured receiver is set to
  std::int32_t gnss_period_ms = 200;        ///< period of a configured receiver's fixes
  /// Time from a measurement to the last byte of its message, of the least delayed one. ArduPilot
  /// (AP_GPS_UBLOX::get_lag) has 120 ms as the mean of flight logs with u-blox 7 and 8.
  std::int32_t gnss_latency_us = 100'000;
  std::int32_t lidar = 0;  ///< 0: none, 1: an LD19, on the line of a receiver that is not there

  [[nodiscard]] constexpr bool any() const { return imu != 0 || encoders != 0 || gnss != 0 || lidar != 0; }
};

struct Parameters {
  std::uint32_t can_base = 0x300;
  LoopParameters loop{};
  WheelParameters wheels{};
  ImuParameters imu{};  ///< calibration of the IMU that is used: inertial.imu
  GyroParameters gyro{};
  LandmarkParameters landmark{};
  TargetParameters target{};
  GnssParameters gnss{};
  InertialParameters inertial{};
  MagneticParameters magnetic{};
  BaroParameters baro{};
  filter::AttitudeOptions attitude{};  ///< declination is the magnetometer's
  DisagreementParameters disagreement{};
  StartParameters start{};
  RecoveryParameters recovery{};
  PublishParameters publish{};
  BusParameters bus{};
  WiredParameters wired{};
  MappingParameters mapping{};
  ParticleParameters particles{};
  LidarParameters lidar{};
  CameraParameters camera{};
};

}  // namespace tetap::param
