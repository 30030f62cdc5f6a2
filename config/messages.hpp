// SPDX-License-Identifier: Apache-2.0
// clang-format off
// Generated from config/tetap.dbc by tools/can/generate_messages: not to be edited. One struct per message or page; encode, decode and frame are in
// can/codec.hpp. Fields are in the units of their suffix; `_raw` counts steps of the k..Scale next to it.
#pragma once

#include "can/signal.hpp"

#include <cstdint>
#include <limits>

namespace tetap::can {

inline constexpr std::uint32_t kDefaultBase = 0x300;  ///< id base the DBC is written for
inline constexpr std::uint32_t kBlock = 0x40;  ///< ids of one node: offsets below this

enum class SyncKind : std::uint8_t { kTick = 0, kStep = 1, kClock = 2, kBegin = 3 };
enum class ResetWhat : std::uint8_t { kEstimators = 0, kCounters = 1, kLandmarkMap = 2 };
enum class GnssFix : std::uint8_t { kNone = 0, kTimeOnly = 1, kFix2D = 2, kFix3D = 3, kDifferential = 4, kRtkFloat = 5, kRtkFixed = 6, kNotAvailable = 15 };
enum class Mode : std::uint8_t { kBoot = 0, kWaitingForPose = 1, kAligning = 2, kNominal = 3, kDeadReckoning = 4, kDegraded = 5, kFault = 6, kWaitingForImu = 7, kLevelling = 8, kFindingHeading = 9 };
enum class ResetCause : std::uint8_t { kPowerOn = 0, kCommand = 1, kSetPose = 2, kTimeJump = 3, kNotFinite = 4, kNotPositive = 5, kPositionJump = 6, kHeadingWrong = 7, kDiverged = 8, kBarometerZero = 9, kMagneticField = 10 };
enum class Sensor : std::uint8_t { kImu = 0, kWheelCounts = 1, kWheelSpeed = 2, kBodySpeed = 3, kRangeBearing = 4, kGnssPosition = 5, kGnssVelocity = 6, kMagnetometer = 7, kBarometer = 8, kHeading = 9, kNotAvailable = 15 };
enum class Verdict : std::uint8_t { kAccepted = 0, kRejected = 1, kNotUsed = 2, kTooLate = 3, kUnknownLandmark = 4, kSingular = 5, kNotFinite = 6, kStale = 7 };
enum class SyncState : std::uint8_t { kOwnTimer = 0, kFollowing = 1, kHoldover = 2, kLockstep = 3 };
enum class OriginSource : std::uint8_t { kNone = 0, kConfigured = 1, kFirstFix = 2 };
enum class EstimatorKind : std::uint8_t { kNone = 0, kOdometry = 1, kEkf = 2, kKf = 3, kUkf = 4, kParticle = 5, kInertial = 6, kAttitude = 7 };
/// Bit numbers of Status_Faults.
enum class Fault : std::uint8_t { kInputStale = 0, kRejecting = 1, kIncomplete = 2, kTooLate = 3, kMalformed = 4, kCapacity = 5, kCommandRefused = 6, kRestarted = 7, kWheelSlip = 8, kImuClipped = 9, kVibration = 10, kSensorStuck = 11, kMagneticDisturbance = 12, kAttitudeDisagrees = 13 };

/// Time from the host. Tick: the node ticks at this time and falls back on its own timer when frames are missing for
/// 3 periods. Step: the same in lockstep, ticks come from these frames only. Clock: sets the node's clock, no tick.
/// Begin: the node goes to its power-on state and into lockstep, takes the time, does not tick, and answers with
/// Est_Version.
struct InSync {
  static constexpr std::uint8_t kOffset = 0x00, kSize = 8;
  static constexpr Signal kTime{.start = 0, .length = 48, .wraps = true};
  static constexpr Signal kCtr{.start = 48, .length = 8, .wraps = true};
  static constexpr Signal kKind{.start = 56, .length = 2};

  std::uint64_t time_us = 0;  ///< time of the tick, in the time base of all stamps; modulo 2^48
  std::uint8_t ctr = 0;  ///< counts sync frames; a gap is counted (Diag_SyncGap)
  SyncKind kind = SyncKind::kTick;  ///< what the node does with the time

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kTime>{}, m.time_us);
    visit(At<kCtr>{}, m.ctr);
    visit(At<kKind>{}, m.kind);
  }
  friend constexpr bool operator==(const InSync&, const InSync&) = default;
};

/// Command: start something afresh. CRC and counter protected; refused and counted when either is wrong.
struct CmdReset {
  static constexpr std::uint8_t kOffset = 0x02, kSize = 8;
  static constexpr bool kProtected = true;
  static constexpr Signal kCrc{.start = 0, .length = 8, .wraps = true};
  static constexpr Signal kCtr{.start = 8, .length = 4, .wraps = true};
  static constexpr Signal kWhat{.start = 12, .length = 4};

  std::uint8_t crc = 0;  ///< CRC-8 0x2F, init and final xor 0xFF, over the id offset and payload bytes 1 to 7
  std::uint8_t ctr = 0;  ///< counts the sender's frames of this message; modulo 2^4
  ResetWhat what = ResetWhat::kEstimators;  ///< what is reset

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kCrc>{}, m.crc);
    visit(At<kCtr>{}, m.ctr);
    visit(At<kWhat>{}, m.what);
  }
  friend constexpr bool operator==(const CmdReset&, const CmdReset&) = default;
};

/// Command: set the position, map frame (ENU metres from the origin). Applied together with the Cmd_SetYaw of the
/// same counter.
struct CmdSetPos {
  static constexpr std::uint8_t kOffset = 0x03, kSize = 8;
  static constexpr bool kProtected = true;
  static constexpr Signal kCrc{.start = 0, .length = 8, .wraps = true};
  static constexpr Signal kCtr{.start = 8, .length = 4, .wraps = true};
  static constexpr Signal kX{.start = 12, .length = 26, .is_signed = true, .has_gap = true};
  static constexpr double kXScale = 2e-3;  // m
  static constexpr std::int32_t kXNotAvailable = std::numeric_limits<std::int32_t>::min();
  static constexpr Signal kY{.start = 38, .length = 26, .is_signed = true, .has_gap = true};
  static constexpr double kYScale = 2e-3;  // m
  static constexpr std::int32_t kYNotAvailable = std::numeric_limits<std::int32_t>::min();

  std::uint8_t crc = 0;  ///< CRC-8 0x2F, init and final xor 0xFF, over the id offset and payload bytes 1 to 7
  std::uint8_t ctr = 0;  ///< counts the sender's frames of this message; modulo 2^4
  std::int32_t x_raw = 0;  ///< east; +-67108.862 m in steps of 0.002; kXNotAvailable
  std::int32_t y_raw = 0;  ///< north; +-67108.862 m in steps of 0.002; kYNotAvailable

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kCrc>{}, m.crc);
    visit(At<kCtr>{}, m.ctr);
    visit(At<kX>{}, m.x_raw);
    visit(At<kY>{}, m.y_raw);
  }
  friend constexpr bool operator==(const CmdSetPos&, const CmdSetPos&) = default;
};

/// Command: set the heading, and how well the pose is known. Applied together with the Cmd_SetPos of the same
/// counter.
struct CmdSetYaw {
  static constexpr std::uint8_t kOffset = 0x04, kSize = 8;
  static constexpr bool kProtected = true;
  static constexpr Signal kCrc{.start = 0, .length = 8, .wraps = true};
  static constexpr Signal kCtr{.start = 8, .length = 4, .wraps = true};
  static constexpr Signal kYaw{.start = 12, .length = 17, .is_signed = true, .has_gap = true, .per_unit = 20000};
  static constexpr Signal kStdPos{.start = 29, .length = 16, .has_gap = true, .per_unit = 1000};
  static constexpr Signal kStdYaw{.start = 45, .length = 15, .has_gap = true, .per_unit = 5000};

  std::uint8_t crc = 0;  ///< CRC-8 0x2F, init and final xor 0xFF, over the id offset and payload bytes 1 to 7
  std::uint8_t ctr = 0;  ///< counts the sender's frames of this message; modulo 2^4
  float yaw_rad = 0;  ///< heading of body x, 0 = east, counter-clockwise; +-3.27675 rad in steps of 0.00005; NaN: not available
  float std_pos_m = 0;  ///< 1-sigma of the position given, each axis; 0 to 65.534 m in steps of 0.001; NaN: not available
  float std_yaw_rad = 0;  ///< 1-sigma of the heading given; 0 to 6.5532 rad in steps of 0.0002; NaN: not available

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kCrc>{}, m.crc);
    visit(At<kCtr>{}, m.ctr);
    visit(At<kYaw>{}, m.yaw_rad);
    visit(At<kStdPos>{}, m.std_pos_m);
    visit(At<kStdYaw>{}, m.std_yaw_rad);
  }
};

/// A known landmark, map frame. An id that is there already is replaced; a full map refuses the entry and counts it.
struct InMapEntry {
  static constexpr std::uint8_t kOffset = 0x05, kSize = 8;
  static constexpr Signal kId{.start = 0, .length = 8, .has_gap = true};
  static constexpr std::uint8_t kIdNotAvailable = std::numeric_limits<std::uint8_t>::max();
  static constexpr Signal kX{.start = 8, .length = 28, .is_signed = true, .has_gap = true};
  static constexpr double kXScale = 1e-3;  // m
  static constexpr std::int32_t kXNotAvailable = std::numeric_limits<std::int32_t>::min();
  static constexpr Signal kY{.start = 36, .length = 28, .is_signed = true, .has_gap = true};
  static constexpr double kYScale = 1e-3;  // m
  static constexpr std::int32_t kYNotAvailable = std::numeric_limits<std::int32_t>::min();

  std::uint8_t id = 0;  ///< landmark; 0 to 254; kIdNotAvailable
  std::int32_t x_raw = 0;  ///< east; +-134217.727 m in steps of 0.001; kXNotAvailable
  std::int32_t y_raw = 0;  ///< north; +-134217.727 m in steps of 0.001; kYNotAvailable

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kId>{}, m.id);
    visit(At<kX>{}, m.x_raw);
    visit(At<kY>{}, m.y_raw);
  }
  friend constexpr bool operator==(const InMapEntry&, const InMapEntry&) = default;
};

/// Quadrature counters of the left and right wheel. Only differences mean anything.
struct InWheelCounts {
  static constexpr std::uint8_t kOffset = 0x06, kSize = 8;
  static constexpr Signal kStamp{.start = 0, .length = 20, .wraps = true};
  static constexpr Signal kSeq{.start = 20, .length = 4, .wraps = true};
  static constexpr Signal kInst{.start = 24, .length = 2};
  static constexpr Signal kLeft{.start = 26, .length = 16, .wraps = true};
  static constexpr Signal kRight{.start = 42, .length = 16, .wraps = true};

  std::uint32_t stamp_us = 0;  ///< low 20 bits of the microsecond of validity
  std::uint8_t seq = 0;  ///< sample counter of this sensor and instance; modulo 2^4
  std::uint8_t inst = 0;  ///< instance of this kind of sensor, from 0; 0 to 3
  std::uint16_t left = 0;  ///< encoder counts, positive forward
  std::uint16_t right = 0;  ///< encoder counts, positive forward

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kStamp>{}, m.stamp_us);
    visit(At<kSeq>{}, m.seq);
    visit(At<kInst>{}, m.inst);
    visit(At<kLeft>{}, m.left);
    visit(At<kRight>{}, m.right);
  }
  friend constexpr bool operator==(const InWheelCounts&, const InWheelCounts&) = default;
};

/// Ground speed of the left and right wheel's contact point.
struct InWheelSpeed {
  static constexpr std::uint8_t kOffset = 0x07, kSize = 8;
  static constexpr Signal kStamp{.start = 0, .length = 20, .wraps = true};
  static constexpr Signal kSeq{.start = 20, .length = 4, .wraps = true};
  static constexpr Signal kInst{.start = 24, .length = 2};
  static constexpr Signal kLeft{.start = 26, .length = 19, .is_signed = true, .has_gap = true, .per_unit = 10000};
  static constexpr Signal kRight{.start = 45, .length = 19, .is_signed = true, .has_gap = true, .per_unit = 10000};

  std::uint32_t stamp_us = 0;  ///< low 20 bits of the microsecond of validity
  std::uint8_t seq = 0;  ///< sample counter of this sensor and instance; modulo 2^4
  std::uint8_t inst = 0;  ///< instance of this kind of sensor, from 0; 0 to 3
  float left_mps = 0;  ///< positive forward; +-26.2143 m/s in steps of 0.0001; NaN: not available
  float right_mps = 0;  ///< positive forward; +-26.2143 m/s in steps of 0.0001; NaN: not available

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kStamp>{}, m.stamp_us);
    visit(At<kSeq>{}, m.seq);
    visit(At<kInst>{}, m.inst);
    visit(At<kLeft>{}, m.left_mps);
    visit(At<kRight>{}, m.right_mps);
  }
};

/// Speed of the body origin and rate of turn, as a base controller reports them.
struct InBodySpeed {
  static constexpr std::uint8_t kOffset = 0x08, kSize = 8;
  static constexpr Signal kStamp{.start = 0, .length = 20, .wraps = true};
  static constexpr Signal kSeq{.start = 20, .length = 4, .wraps = true};
  static constexpr Signal kInst{.start = 24, .length = 2};
  static constexpr Signal kForward{.start = 26, .length = 19, .is_signed = true, .has_gap = true, .per_unit = 10000};
  static constexpr Signal kYawRate{.start = 45, .length = 19, .is_signed = true, .has_gap = true, .per_unit = 20000};

  std::uint32_t stamp_us = 0;  ///< low 20 bits of the microsecond of validity
  std::uint8_t seq = 0;  ///< sample counter of this sensor and instance; modulo 2^4
  std::uint8_t inst = 0;  ///< instance of this kind of sensor, from 0; 0 to 3
  float forward_mps = 0;  ///< along body x, positive forward; +-26.2143 m/s in steps of 0.0001; NaN: not available
  float yaw_rate_radps = 0;  ///< about body z (up), positive counter-clockwise; +-13.10715 rad/s in steps of 0.00005; NaN: not available

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kStamp>{}, m.stamp_us);
    visit(At<kSeq>{}, m.seq);
    visit(At<kInst>{}, m.inst);
    visit(At<kForward>{}, m.forward_mps);
    visit(At<kYawRate>{}, m.yaw_rate_radps);
  }
};

/// A landmark seen from the body. Range not available: bearing only; bearing not available: range only.
struct InRangeBearing {
  static constexpr std::uint8_t kOffset = 0x09, kSize = 8;
  static constexpr Signal kStamp{.start = 0, .length = 20, .wraps = true};
  static constexpr Signal kSeq{.start = 20, .length = 4, .wraps = true};
  static constexpr Signal kInst{.start = 24, .length = 2};
  static constexpr Signal kId{.start = 26, .length = 8, .has_gap = true};
  static constexpr std::uint8_t kIdNotAvailable = std::numeric_limits<std::uint8_t>::max();
  static constexpr Signal kRange{.start = 34, .length = 16, .has_gap = true, .per_unit = 500};
  static constexpr Signal kBearing{.start = 50, .length = 14, .is_signed = true, .has_gap = true, .per_unit = 2500};

  std::uint32_t stamp_us = 0;  ///< low 20 bits of the microsecond of validity
  std::uint8_t seq = 0;  ///< sample counter of this sensor and instance; modulo 2^4
  std::uint8_t inst = 0;  ///< instance of this kind of sensor, from 0; 0 to 3
  std::uint8_t id = 0;  ///< landmark; not available: not identified; 0 to 254; kIdNotAvailable
  float range_m = 0;  ///< distance from the sensor; 0 to 131.068 m in steps of 0.002; NaN: not available
  float bearing_rad = 0;  ///< 0 = straight ahead, positive counter-clockwise; +-3.2764 rad in steps of 0.0004; NaN: not available

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kStamp>{}, m.stamp_us);
    visit(At<kSeq>{}, m.seq);
    visit(At<kInst>{}, m.inst);
    visit(At<kId>{}, m.id);
    visit(At<kRange>{}, m.range_m);
    visit(At<kBearing>{}, m.bearing_rad);
  }
};

/// GNSS position, first of the frames Lat, Lon, Alt, Acc that share one stamp, sequence and instance.
struct InGnssLat {
  static constexpr std::uint8_t kOffset = 0x0A, kSize = 8;
  static constexpr Signal kStamp{.start = 0, .length = 20, .wraps = true};
  static constexpr Signal kSeq{.start = 20, .length = 4, .wraps = true};
  static constexpr Signal kInst{.start = 24, .length = 2};
  static constexpr Signal kLat{.start = 26, .length = 37, .is_signed = true, .has_gap = true};
  static constexpr double kLatScale = 2e-9;  // deg
  static constexpr std::int64_t kLatNotAvailable = std::numeric_limits<std::int64_t>::min();

  std::uint32_t stamp_us = 0;  ///< low 20 bits of the microsecond of validity
  std::uint8_t seq = 0;  ///< sample counter of this sensor and instance; modulo 2^4
  std::uint8_t inst = 0;  ///< instance of this kind of sensor, from 0; 0 to 3
  std::int64_t lat_raw = 0;  ///< WGS84 latitude, positive north; +-137.43895347 deg in steps of 0.000000002; kLatNotAvailable

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kStamp>{}, m.stamp_us);
    visit(At<kSeq>{}, m.seq);
    visit(At<kInst>{}, m.inst);
    visit(At<kLat>{}, m.lat_raw);
  }
  friend constexpr bool operator==(const InGnssLat&, const InGnssLat&) = default;
};

/// GNSS position: longitude.
struct InGnssLon {
  static constexpr std::uint8_t kOffset = 0x0B, kSize = 8;
  static constexpr Signal kStamp{.start = 0, .length = 20, .wraps = true};
  static constexpr Signal kSeq{.start = 20, .length = 4, .wraps = true};
  static constexpr Signal kInst{.start = 24, .length = 2};
  static constexpr Signal kLon{.start = 26, .length = 38, .is_signed = true, .has_gap = true};
  static constexpr double kLonScale = 2e-9;  // deg
  static constexpr std::int64_t kLonNotAvailable = std::numeric_limits<std::int64_t>::min();

  std::uint32_t stamp_us = 0;  ///< low 20 bits of the microsecond of validity
  std::uint8_t seq = 0;  ///< sample counter of this sensor and instance; modulo 2^4
  std::uint8_t inst = 0;  ///< instance of this kind of sensor, from 0; 0 to 3
  std::int64_t lon_raw = 0;  ///< WGS84 longitude, positive east; +-274.877906942 deg in steps of 0.000000002; kLonNotAvailable

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kStamp>{}, m.stamp_us);
    visit(At<kSeq>{}, m.seq);
    visit(At<kInst>{}, m.inst);
    visit(At<kLon>{}, m.lon_raw);
  }
  friend constexpr bool operator==(const InGnssLon&, const InGnssLon&) = default;
};

/// GNSS position: height and kind of fix.
struct InGnssAlt {
  static constexpr std::uint8_t kOffset = 0x0C, kSize = 8;
  static constexpr Signal kStamp{.start = 0, .length = 20, .wraps = true};
  static constexpr Signal kSeq{.start = 20, .length = 4, .wraps = true};
  static constexpr Signal kInst{.start = 24, .length = 2};
  static constexpr Signal kHeight{.start = 26, .length = 24, .is_signed = true, .has_gap = true, .per_unit = 500};
  static constexpr Signal kFix{.start = 50, .length = 4};
  static constexpr Signal kNumSv{.start = 54, .length = 6, .has_gap = true};
  static constexpr std::uint8_t kNumSvNotAvailable = std::numeric_limits<std::uint8_t>::max();

  std::uint32_t stamp_us = 0;  ///< low 20 bits of the microsecond of validity
  std::uint8_t seq = 0;  ///< sample counter of this sensor and instance; modulo 2^4
  std::uint8_t inst = 0;  ///< instance of this kind of sensor, from 0; 0 to 3
  float height_m = 0;  ///< above the WGS84 ellipsoid (not the geoid), up; +-16777.214 m in steps of 0.002; NaN: not available
  GnssFix fix = GnssFix::kNone;  ///< kind of fix
  std::uint8_t num_sv = 0;  ///< satellites used; 0 to 62; kNumSvNotAvailable

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kStamp>{}, m.stamp_us);
    visit(At<kSeq>{}, m.seq);
    visit(At<kInst>{}, m.inst);
    visit(At<kHeight>{}, m.height_m);
    visit(At<kFix>{}, m.fix);
    visit(At<kNumSv>{}, m.num_sv);
  }
};

/// GNSS position: the receiver's own 1-sigma. Completes the position.
struct InGnssAcc {
  static constexpr std::uint8_t kOffset = 0x0D, kSize = 8;
  static constexpr Signal kStamp{.start = 0, .length = 20, .wraps = true};
  static constexpr Signal kSeq{.start = 20, .length = 4, .wraps = true};
  static constexpr Signal kInst{.start = 24, .length = 2};
  static constexpr Signal kHor{.start = 26, .length = 16, .has_gap = true, .per_unit = 200};
  static constexpr Signal kVer{.start = 42, .length = 16, .has_gap = true, .per_unit = 200};

  std::uint32_t stamp_us = 0;  ///< low 20 bits of the microsecond of validity
  std::uint8_t seq = 0;  ///< sample counter of this sensor and instance; modulo 2^4
  std::uint8_t inst = 0;  ///< instance of this kind of sensor, from 0; 0 to 3
  float hor_m = 0;  ///< horizontal, each axis; 0 to 327.67 m in steps of 0.005; NaN: not available
  float ver_m = 0;  ///< vertical; 0 to 327.67 m in steps of 0.005; NaN: not available

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kStamp>{}, m.stamp_us);
    visit(At<kSeq>{}, m.seq);
    visit(At<kInst>{}, m.inst);
    visit(At<kHor>{}, m.hor_m);
    visit(At<kVer>{}, m.ver_m);
  }
};

/// GNSS velocity, local level frame; with VelU of the same stamp, sequence and instance one velocity.
struct InGnssVelEN {
  static constexpr std::uint8_t kOffset = 0x0E, kSize = 8;
  static constexpr Signal kStamp{.start = 0, .length = 20, .wraps = true};
  static constexpr Signal kSeq{.start = 20, .length = 4, .wraps = true};
  static constexpr Signal kInst{.start = 24, .length = 2};
  static constexpr Signal kEast{.start = 26, .length = 19, .is_signed = true, .has_gap = true, .per_unit = 1000};
  static constexpr Signal kNorth{.start = 45, .length = 19, .is_signed = true, .has_gap = true, .per_unit = 1000};

  std::uint32_t stamp_us = 0;  ///< low 20 bits of the microsecond of validity
  std::uint8_t seq = 0;  ///< sample counter of this sensor and instance; modulo 2^4
  std::uint8_t inst = 0;  ///< instance of this kind of sensor, from 0; 0 to 3
  float east_mps = 0;  ///< towards east; +-262.143 m/s in steps of 0.001; NaN: not available
  float north_mps = 0;  ///< towards north; +-262.143 m/s in steps of 0.001; NaN: not available

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kStamp>{}, m.stamp_us);
    visit(At<kSeq>{}, m.seq);
    visit(At<kInst>{}, m.inst);
    visit(At<kEast>{}, m.east_mps);
    visit(At<kNorth>{}, m.north_mps);
  }
};

/// GNSS velocity: up, and the receiver's own 1-sigma. Completes the velocity.
struct InGnssVelU {
  static constexpr std::uint8_t kOffset = 0x0F, kSize = 8;
  static constexpr Signal kStamp{.start = 0, .length = 20, .wraps = true};
  static constexpr Signal kSeq{.start = 20, .length = 4, .wraps = true};
  static constexpr Signal kInst{.start = 24, .length = 2};
  static constexpr Signal kUp{.start = 26, .length = 19, .is_signed = true, .has_gap = true, .per_unit = 1000};
  static constexpr Signal kAcc{.start = 45, .length = 16, .has_gap = true, .per_unit = 1000};

  std::uint32_t stamp_us = 0;  ///< low 20 bits of the microsecond of validity
  std::uint8_t seq = 0;  ///< sample counter of this sensor and instance; modulo 2^4
  std::uint8_t inst = 0;  ///< instance of this kind of sensor, from 0; 0 to 3
  float up_mps = 0;  ///< towards up; +-262.143 m/s in steps of 0.001; NaN: not available
  float acc_mps = 0;  ///< 1-sigma, each axis; 0 to 65.534 m/s in steps of 0.001; NaN: not available

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kStamp>{}, m.stamp_us);
    visit(At<kSeq>{}, m.seq);
    visit(At<kInst>{}, m.inst);
    visit(At<kUp>{}, m.up_mps);
    visit(At<kAcc>{}, m.acc_mps);
  }
};

/// IMU: rotation increments about the body axes (x forward, y left, z up) over Interval of the Time frame. Instances
/// 0 to 3, ids 3 apart.
struct ImuGyro {
  static constexpr std::uint8_t kOffset = 0x10, kSize = 8;
  static constexpr std::uint8_t kStride = 3, kCount = 4;
  static constexpr Signal kAngX{.start = 0, .length = 20, .is_signed = true, .has_gap = true, .per_unit = 1000000};
  static constexpr Signal kAngY{.start = 20, .length = 20, .is_signed = true, .has_gap = true, .per_unit = 1000000};
  static constexpr Signal kAngZ{.start = 40, .length = 20, .is_signed = true, .has_gap = true, .per_unit = 1000000};
  static constexpr Signal kSeq{.start = 60, .length = 4, .wraps = true};

  float ang_x_rad = 0;  ///< rotation about body x over the interval, right-handed (roll rate integrated); +-0.524287 rad in steps of 0.000001; NaN: not available
  float ang_y_rad = 0;  ///< rotation about body y over the interval, right-handed (pitch rate integrated); +-0.524287 rad in steps of 0.000001; NaN: not available
  float ang_z_rad = 0;  ///< rotation about body z over the interval, right-handed (yaw rate integrated, positive counter-clockwise); +-0.524287 rad in steps of 0.000001; NaN: not available
  std::uint8_t seq = 0;  ///< sample counter, the same in Gyro, Accel and Time of one sample; modulo 2^4

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kAngX>{}, m.ang_x_rad);
    visit(At<kAngY>{}, m.ang_y_rad);
    visit(At<kAngZ>{}, m.ang_z_rad);
    visit(At<kSeq>{}, m.seq);
  }
};

/// IMU: velocity increments (integrated specific force) along the body axes over Interval of the Time frame.
/// Instances 0 to 3, ids 3 apart.
struct ImuAccel {
  static constexpr std::uint8_t kOffset = 0x11, kSize = 8;
  static constexpr std::uint8_t kStride = 3, kCount = 4;
  static constexpr Signal kVelX{.start = 0, .length = 20, .is_signed = true, .has_gap = true, .per_unit = 100000};
  static constexpr Signal kVelY{.start = 20, .length = 20, .is_signed = true, .has_gap = true, .per_unit = 100000};
  static constexpr Signal kVelZ{.start = 40, .length = 20, .is_signed = true, .has_gap = true, .per_unit = 100000};
  static constexpr Signal kSeq{.start = 60, .length = 4, .wraps = true};

  float vel_x_mps = 0;  ///< specific force along body x over the interval (forward); +-5.24287 m/s in steps of 0.00001; NaN: not available
  float vel_y_mps = 0;  ///< specific force along body y over the interval (left); +-5.24287 m/s in steps of 0.00001; NaN: not available
  float vel_z_mps = 0;  ///< specific force along body z over the interval (up: at rest +9.8 m/s per second); +-5.24287 m/s in steps of 0.00001; NaN: not available
  std::uint8_t seq = 0;  ///< sample counter, the same in Gyro, Accel and Time of one sample; modulo 2^4

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kVelX>{}, m.vel_x_mps);
    visit(At<kVelY>{}, m.vel_y_mps);
    visit(At<kVelZ>{}, m.vel_z_mps);
    visit(At<kSeq>{}, m.seq);
  }
};

/// IMU: validity time, span, clipping and temperature; completes the sample of the same sequence. Instances 0 to 3,
/// ids 3 apart.
struct ImuTime {
  static constexpr std::uint8_t kOffset = 0x12, kSize = 8;
  static constexpr std::uint8_t kStride = 3, kCount = 4;
  static constexpr Signal kStamp{.start = 0, .length = 20, .wraps = true};
  static constexpr Signal kInterval{.start = 20, .length = 16};
  static constexpr Signal kClipGyro{.start = 36, .length = 4};
  static constexpr Signal kClipAccel{.start = 40, .length = 4};
  static constexpr Signal kTemp{.start = 44, .length = 12, .is_signed = true, .has_gap = true, .per_unit = 20};
  static constexpr Signal kSeq{.start = 60, .length = 4, .wraps = true};

  std::uint32_t stamp_us = 0;  ///< low 20 bits of the microsecond at which the interval ends
  std::uint16_t interval_us = 0;  ///< span the increments cover; 0 to 65535
  std::uint8_t clip_gyro = 0;  ///< raw gyro samples at full scale within the interval; 0 to 15
  std::uint8_t clip_accel = 0;  ///< raw accelerometer samples at full scale within the interval; 0 to 15
  float temp_degC = 0;  ///< die temperature; +-102.35 degC in steps of 0.05; NaN: not available
  std::uint8_t seq = 0;  ///< sample counter, the same in Gyro, Accel and Time of one sample; modulo 2^4

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kStamp>{}, m.stamp_us);
    visit(At<kInterval>{}, m.interval_us);
    visit(At<kClipGyro>{}, m.clip_gyro);
    visit(At<kClipAccel>{}, m.clip_accel);
    visit(At<kTemp>{}, m.temp_degC);
    visit(At<kSeq>{}, m.seq);
  }
};

/// Magnetic flux density, sensor axes turned into the body by the mounting.
struct InMag {
  static constexpr std::uint8_t kOffset = 0x1C, kSize = 8;
  static constexpr Signal kStamp{.start = 0, .length = 20, .wraps = true};
  static constexpr Signal kSeq{.start = 20, .length = 4, .wraps = true};
  static constexpr Signal kInst{.start = 24, .length = 2};
  static constexpr Signal kFluxX{.start = 26, .length = 12, .is_signed = true, .has_gap = true, .per_unit = 10};
  static constexpr Signal kFluxY{.start = 38, .length = 12, .is_signed = true, .has_gap = true, .per_unit = 10};
  static constexpr Signal kFluxZ{.start = 50, .length = 12, .is_signed = true, .has_gap = true, .per_unit = 10};

  std::uint32_t stamp_us = 0;  ///< low 20 bits of the microsecond of validity
  std::uint8_t seq = 0;  ///< sample counter of this sensor and instance; modulo 2^4
  std::uint8_t inst = 0;  ///< instance of this kind of sensor, from 0; 0 to 3
  float flux_x_uT = 0;  ///< along body x; +-204.7 uT in steps of 0.1; NaN: not available
  float flux_y_uT = 0;  ///< along body y; +-204.7 uT in steps of 0.1; NaN: not available
  float flux_z_uT = 0;  ///< along body z; +-204.7 uT in steps of 0.1; NaN: not available

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kStamp>{}, m.stamp_us);
    visit(At<kSeq>{}, m.seq);
    visit(At<kInst>{}, m.inst);
    visit(At<kFluxX>{}, m.flux_x_uT);
    visit(At<kFluxY>{}, m.flux_y_uT);
    visit(At<kFluxZ>{}, m.flux_z_uT);
  }
};

/// Air pressure.
struct InBaro {
  static constexpr std::uint8_t kOffset = 0x1D, kSize = 8;
  static constexpr Signal kStamp{.start = 0, .length = 20, .wraps = true};
  static constexpr Signal kSeq{.start = 20, .length = 4, .wraps = true};
  static constexpr Signal kInst{.start = 24, .length = 2};
  static constexpr Signal kPressure{.start = 26, .length = 18, .has_gap = true, .per_unit = 2};
  static constexpr Signal kTemp{.start = 44, .length = 12, .is_signed = true, .has_gap = true, .per_unit = 20};

  std::uint32_t stamp_us = 0;  ///< low 20 bits of the microsecond of validity
  std::uint8_t seq = 0;  ///< sample counter of this sensor and instance; modulo 2^4
  std::uint8_t inst = 0;  ///< instance of this kind of sensor, from 0; 0 to 3
  float pressure_Pa = 0;  ///< static pressure; 0 to 131071 Pa in steps of 0.5; NaN: not available
  float temp_degC = 0;  ///< of the sensor; +-102.35 degC in steps of 0.05; NaN: not available

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kStamp>{}, m.stamp_us);
    visit(At<kSeq>{}, m.seq);
    visit(At<kInst>{}, m.inst);
    visit(At<kPressure>{}, m.pressure_Pa);
    visit(At<kTemp>{}, m.temp_degC);
  }
};

/// Heading from outside, of two GNSS antennas for instance; the configuration says how the baseline lies on the body.
struct InHeading {
  static constexpr std::uint8_t kOffset = 0x1E, kSize = 8;
  static constexpr Signal kStamp{.start = 0, .length = 20, .wraps = true};
  static constexpr Signal kSeq{.start = 20, .length = 4, .wraps = true};
  static constexpr Signal kInst{.start = 24, .length = 2};
  static constexpr Signal kAngle{.start = 26, .length = 17, .is_signed = true, .has_gap = true, .per_unit = 20000};
  static constexpr Signal kAcc{.start = 43, .length = 14, .has_gap = true, .per_unit = 5000};

  std::uint32_t stamp_us = 0;  ///< low 20 bits of the microsecond of validity
  std::uint8_t seq = 0;  ///< sample counter of this sensor and instance; modulo 2^4
  std::uint8_t inst = 0;  ///< instance of this kind of sensor, from 0; 0 to 3
  float angle_rad = 0;  ///< of the baseline, map frame: 0 = east, counter-clockwise; +-3.27675 rad in steps of 0.00005; NaN: not available
  float acc_rad = 0;  ///< 1-sigma; 0 to 3.2764 rad in steps of 0.0002; NaN: not available

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kStamp>{}, m.stamp_us);
    visit(At<kSeq>{}, m.seq);
    visit(At<kInst>{}, m.inst);
    visit(At<kAngle>{}, m.angle_rad);
    visit(At<kAcc>{}, m.acc_rad);
  }
};

/// First frame of each epoch: the time all its estimates are valid at, and what had been consumed by then.
struct EstEpoch {
  static constexpr std::uint8_t kOffset = 0x20, kSize = 8;
  static constexpr Signal kTime{.start = 0, .length = 48, .wraps = true};
  static constexpr Signal kInCrc{.start = 48, .length = 16, .wraps = true};

  std::uint64_t time_us = 0;  ///< time of validity, in the time base of all stamps; modulo 2^48
  std::uint16_t in_crc = 0;  ///< low half of the running CRC-32 over all input frames consumed

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kTime>{}, m.time_us);
    visit(At<kInCrc>{}, m.in_crc);
  }
  friend constexpr bool operator==(const EstEpoch&, const EstEpoch&) = default;
};

/// Last frame of each epoch: equal on two nodes means bit-identical estimates.
struct EstStateCrc {
  static constexpr std::uint8_t kOffset = 0x21, kSize = 8;
  static constexpr Signal kCrc{.start = 0, .length = 32, .wraps = true};
  static constexpr Signal kInCount{.start = 32, .length = 16, .wraps = true};
  static constexpr Signal kEpoch{.start = 48, .length = 8, .wraps = true};
  static constexpr Signal kFrames{.start = 56, .length = 8, .wraps = true};

  std::uint32_t crc = 0;  ///< CRC-32 (IEEE) over the raw bits of every estimator's state and covariance
  std::uint16_t in_count = 0;  ///< input frames consumed since start, sync frames not counted
  std::uint8_t epoch = 0;  ///< low bits of the epoch
  std::uint8_t frames = 0;  ///< frames sent in this epoch, this one included

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kCrc>{}, m.crc);
    visit(At<kInCount>{}, m.in_count);
    visit(At<kEpoch>{}, m.epoch);
    visit(At<kFrames>{}, m.frames);
  }
  friend constexpr bool operator==(const EstStateCrc&, const EstStateCrc&) = default;
};

/// Health of the node in one frame, of its primary estimator. CRC and counter protected.
struct EstStatus {
  static constexpr std::uint8_t kOffset = 0x22, kSize = 8;
  static constexpr bool kProtected = true;
  static constexpr Signal kCrc{.start = 0, .length = 8, .wraps = true};
  static constexpr Signal kCtr{.start = 8, .length = 4, .wraps = true};
  static constexpr Signal kMode{.start = 12, .length = 4};
  static constexpr Signal kPosValid{.start = 16, .length = 1};
  static constexpr Signal kHdgValid{.start = 17, .length = 1};
  static constexpr Signal kVelValid{.start = 18, .length = 1};
  static constexpr Signal kOrigin{.start = 19, .length = 1};
  static constexpr Signal kUsed{.start = 20, .length = 12, .wraps = true};
  static constexpr Signal kFaults{.start = 32, .length = 16, .wraps = true};
  static constexpr Signal kResetCtr{.start = 48, .length = 8, .wraps = true};
  static constexpr Signal kResetCause{.start = 56, .length = 4};

  std::uint8_t crc = 0;  ///< CRC-8 0x2F, init and final xor 0xFF, over the id offset and payload bytes 1 to 7
  std::uint8_t ctr = 0;  ///< counts the sender's frames of this message; modulo 2^4
  Mode mode = Mode::kBoot;  ///< what the node is doing
  bool pos_valid = false;  ///< 1: position is bound to the map; how well is in the 1-sigma
  bool hdg_valid = false;  ///< 1: heading is bound to the map; how well is in the 1-sigma
  bool vel_valid = false;  ///< 1: speed and yaw rate are estimated from live measurements
  bool origin = false;  ///< 1: the origin of the map frame is known, see Est_Origin
  std::uint16_t used = 0;  ///< sensors with a measurement accepted within the last second, bit = Sensor; modulo 2^12
  std::uint16_t faults = 0;  ///< troubles of the last second, bit = Fault: 0 InputStale (nothing says how fast it goes), 1 Rejecting (a gate refuses a sensor), 2 Incomplete (a frame of a sample is lost), 3 TooLate (older than the window), 4 Malformed (frame or value that cannot be), 5 Capacity (a queue, map or window was full; Est_Diag says which), 6 CommandRefused, 7 Restarted (by itself), 8 WheelSlip (a wheel spins or is stuck), 9 ImuClipped (beyond its range), 10 Vibration (more than its noise is meant for), 11 SensorStuck (shows the same again and again), 12 MagneticDisturbance, 13 AttitudeDisagrees (attitude filter and primary estimator)
  std::uint8_t reset_ctr = 0;  ///< resets of the estimators since start
  ResetCause reset_cause = ResetCause::kPowerOn;  ///< cause of the last reset

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kCrc>{}, m.crc);
    visit(At<kCtr>{}, m.ctr);
    visit(At<kMode>{}, m.mode);
    visit(At<kPosValid>{}, m.pos_valid);
    visit(At<kHdgValid>{}, m.hdg_valid);
    visit(At<kVelValid>{}, m.vel_valid);
    visit(At<kOrigin>{}, m.origin);
    visit(At<kUsed>{}, m.used);
    visit(At<kFaults>{}, m.faults);
    visit(At<kResetCtr>{}, m.reset_ctr);
    visit(At<kResetCause>{}, m.reset_cause);
  }
  friend constexpr bool operator==(const EstStatus&, const EstStatus&) = default;
};

/// One measurement's innovation: what was tested, how it came out and why. Rejected ones first when there are more
/// than the rate allows.
struct EstInnov {
  static constexpr std::uint8_t kOffset = 0x23, kSize = 8;
  static constexpr Signal kEstimator{.start = 0, .length = 2};
  static constexpr Signal kSensor{.start = 2, .length = 4};
  static constexpr Signal kInst{.start = 6, .length = 2};
  static constexpr Signal kVerdict{.start = 8, .length = 3};
  static constexpr Signal kDof{.start = 11, .length = 3};
  static constexpr Signal kAge{.start = 14, .length = 10, .has_gap = true};
  static constexpr Signal kNis{.start = 24, .length = 16, .has_gap = true, .per_unit = 100};
  static constexpr Signal kRatio{.start = 40, .length = 12, .has_gap = true, .per_unit = 100};
  static constexpr Signal kId{.start = 52, .length = 8, .has_gap = true};
  static constexpr std::uint8_t kIdNotAvailable = std::numeric_limits<std::uint8_t>::max();
  static constexpr Signal kEpoch{.start = 60, .length = 4, .wraps = true};

  std::uint8_t estimator = 0;  ///< instance k of Est<k>; 0 to 3
  Sensor sensor = Sensor::kImu;  ///< kind of sensor
  std::uint8_t inst = 0;  ///< instance of this kind of sensor; 0 to 3
  Verdict verdict = Verdict::kAccepted;  ///< what was done with the measurement
  std::uint8_t dof = 0;  ///< degrees of freedom of the gate; 0 to 7
  float age_ms = 0;  ///< from validity of the measurement to this epoch; 0 to 1022 ms in steps of 1; NaN: not available
  float nis = 0;  ///< normalised innovation squared; 0 to 655.34 in steps of 0.01; NaN: not available
  float ratio = 0;  ///< NIS over its gate; above 1: rejected; 0 to 40.94 in steps of 0.01; NaN: not available
  std::uint8_t id = 0;  ///< landmark, for sensors that see one; 0 to 254; kIdNotAvailable
  std::uint8_t epoch = 0;  ///< low bits of the epoch, the same in all frames of one epoch

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kEstimator>{}, m.estimator);
    visit(At<kSensor>{}, m.sensor);
    visit(At<kInst>{}, m.inst);
    visit(At<kVerdict>{}, m.verdict);
    visit(At<kDof>{}, m.dof);
    visit(At<kAge>{}, m.age_ms);
    visit(At<kNis>{}, m.nis);
    visit(At<kRatio>{}, m.ratio);
    visit(At<kId>{}, m.id);
    visit(At<kEpoch>{}, m.epoch);
  }
};

/// One sensor as one estimator sees it; the sensors take turns.
struct EstSensorStat {
  static constexpr std::uint8_t kOffset = 0x24, kSize = 8;
  static constexpr Signal kSensor{.start = 0, .length = 4};
  static constexpr Signal kInst{.start = 4, .length = 2};
  static constexpr Signal kEstimator{.start = 6, .length = 2};
  static constexpr Signal kAccepted{.start = 8, .length = 16, .wraps = true};
  static constexpr Signal kRejected{.start = 24, .length = 12, .wraps = true};
  static constexpr Signal kNisMean{.start = 36, .length = 12, .has_gap = true, .per_unit = 100};
  static constexpr Signal kAge{.start = 48, .length = 12, .has_gap = true, .per_unit = 100};
  static constexpr Signal kEpoch{.start = 60, .length = 4, .wraps = true};

  Sensor sensor = Sensor::kImu;  ///< kind of sensor
  std::uint8_t inst = 0;  ///< instance of this kind of sensor; 0 to 3
  std::uint8_t estimator = 0;  ///< instance k of Est<k>; 0 to 3
  std::uint16_t accepted = 0;  ///< measurements accepted since start
  std::uint16_t rejected = 0;  ///< measurements rejected by the gate since start; modulo 2^12
  float nis_mean = 0;  ///< mean NIS per degree of freedom, consistent: 1; 0 to 40.94 in steps of 0.01; NaN: not available
  float age_s = 0;  ///< since the last accepted measurement; 0 to 40.94 s in steps of 0.01; NaN: not available
  std::uint8_t epoch = 0;  ///< low bits of the epoch, the same in all frames of one epoch

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kSensor>{}, m.sensor);
    visit(At<kInst>{}, m.inst);
    visit(At<kEstimator>{}, m.estimator);
    visit(At<kAccepted>{}, m.accepted);
    visit(At<kRejected>{}, m.rejected);
    visit(At<kNisMean>{}, m.nis_mean);
    visit(At<kAge>{}, m.age_s);
    visit(At<kEpoch>{}, m.epoch);
  }
};

/// Diagnostics of the node, one page per frame. Counters wrap. Pages 2, 3, 4, 6 and 7 follow from the frames alone:
/// the same in every replay. Page 0.
struct EstDiagLoop {
  static constexpr std::uint8_t kOffset = 0x25, kSize = 8;
  static constexpr Signal kMux{.start = 0, .length = 4};
  static constexpr std::uint8_t kPage = 0;
  static constexpr Signal kLoopMax{.start = 8, .length = 24};
  static constexpr Signal kLoopMean{.start = 32, .length = 16};
  static constexpr Signal kSync{.start = 48, .length = 4};
  static constexpr Signal kTxHigh{.start = 52, .length = 12};

  std::uint32_t loop_max_us = 0;  ///< longest tick since start; 0 to 16777215
  std::uint16_t loop_mean_us = 0;  ///< running mean of the duration of a tick; 0 to 65535
  SyncState sync = SyncState::kOwnTimer;  ///< where ticks come from
  std::uint16_t tx_high = 0;  ///< most frames that waited in the controller's transmit queue at once, since start; 0 to 4095

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kLoopMax>{}, m.loop_max_us);
    visit(At<kLoopMean>{}, m.loop_mean_us);
    visit(At<kSync>{}, m.sync);
    visit(At<kTxHigh>{}, m.tx_high);
  }
  friend constexpr bool operator==(const EstDiagLoop&, const EstDiagLoop&) = default;
};

/// Diagnostics of the node, one page per frame. Counters wrap. Pages 2, 3, 4, 6 and 7 follow from the frames alone:
/// the same in every replay. Page 1.
struct EstDiagTicks {
  static constexpr std::uint8_t kOffset = 0x25, kSize = 8;
  static constexpr Signal kMux{.start = 0, .length = 4};
  static constexpr std::uint8_t kPage = 1;
  static constexpr Signal kTicksLate{.start = 8, .length = 16, .wraps = true};
  static constexpr Signal kSyncLost{.start = 24, .length = 16, .wraps = true};
  static constexpr Signal kSyncBack{.start = 40, .length = 16, .wraps = true};

  std::uint16_t ticks_late = 0;  ///< ticks that took longer than their period or could not begin in it, since start
  std::uint16_t sync_lost = 0;  ///< times sync frames were missing for 3 periods, since start
  std::uint16_t sync_back = 0;  ///< sync frames whose time was not ahead of the last tick, since start

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kTicksLate>{}, m.ticks_late);
    visit(At<kSyncLost>{}, m.sync_lost);
    visit(At<kSyncBack>{}, m.sync_back);
  }
  friend constexpr bool operator==(const EstDiagTicks&, const EstDiagTicks&) = default;
};

/// Diagnostics of the node, one page per frame. Counters wrap. Pages 2, 3, 4, 6 and 7 follow from the frames alone:
/// the same in every replay. Page 2.
struct EstDiagQueues {
  static constexpr std::uint8_t kOffset = 0x25, kSize = 8;
  static constexpr Signal kMux{.start = 0, .length = 4};
  static constexpr std::uint8_t kPage = 2;
  static constexpr Signal kTimelineHigh{.start = 8, .length = 16};
  static constexpr Signal kEventsHigh{.start = 24, .length = 16};
  static constexpr Signal kEventsDropped{.start = 40, .length = 16, .wraps = true};

  std::uint16_t timeline_high = 0;  ///< most samples waiting in the timeline at once; 0 to 65535
  std::uint16_t events_high = 0;  ///< most innovation events waiting at once; 0 to 65535
  std::uint16_t events_dropped = 0;  ///< innovation events dropped because the queue was full, since start

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kTimelineHigh>{}, m.timeline_high);
    visit(At<kEventsHigh>{}, m.events_high);
    visit(At<kEventsDropped>{}, m.events_dropped);
  }
  friend constexpr bool operator==(const EstDiagQueues&, const EstDiagQueues&) = default;
};

/// Diagnostics of the node, one page per frame. Counters wrap. Pages 2, 3, 4, 6 and 7 follow from the frames alone:
/// the same in every replay. Page 3.
struct EstDiagOrder {
  static constexpr std::uint8_t kOffset = 0x25, kSize = 8;
  static constexpr Signal kMux{.start = 0, .length = 4};
  static constexpr std::uint8_t kPage = 3;
  static constexpr Signal kTooLate{.start = 8, .length = 16, .wraps = true};
  static constexpr Signal kTooEarly{.start = 24, .length = 16, .wraps = true};
  static constexpr Signal kDuplicate{.start = 40, .length = 16, .wraps = true};

  std::uint16_t too_late = 0;  ///< samples older than the timeline reaches back, since start
  std::uint16_t too_early = 0;  ///< samples stamped further ahead than allowed, since start
  std::uint16_t duplicate = 0;  ///< samples or frames received twice, since start

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kTooLate>{}, m.too_late);
    visit(At<kTooEarly>{}, m.too_early);
    visit(At<kDuplicate>{}, m.duplicate);
  }
  friend constexpr bool operator==(const EstDiagOrder&, const EstDiagOrder&) = default;
};

/// Diagnostics of the node, one page per frame. Counters wrap. Pages 2, 3, 4, 6 and 7 follow from the frames alone:
/// the same in every replay. Page 4.
struct EstDiagFrames {
  static constexpr std::uint8_t kOffset = 0x25, kSize = 8;
  static constexpr Signal kMux{.start = 0, .length = 4};
  static constexpr std::uint8_t kPage = 4;
  static constexpr Signal kIncomplete{.start = 8, .length = 16, .wraps = true};
  static constexpr Signal kMalformed{.start = 24, .length = 16, .wraps = true};
  static constexpr Signal kOutOfRange{.start = 40, .length = 16, .wraps = true};

  std::uint16_t incomplete = 0;  ///< multi-frame samples of which a part never came, since start
  std::uint16_t malformed = 0;  ///< frames of a known id with wrong length or content, since start
  std::uint16_t out_of_range = 0;  ///< samples with values not available or out of range, since start

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kIncomplete>{}, m.incomplete);
    visit(At<kMalformed>{}, m.malformed);
    visit(At<kOutOfRange>{}, m.out_of_range);
  }
  friend constexpr bool operator==(const EstDiagFrames&, const EstDiagFrames&) = default;
};

/// Diagnostics of the node, one page per frame. Counters wrap. Pages 2, 3, 4, 6 and 7 follow from the frames alone:
/// the same in every replay. Page 5.
struct EstDiagBus {
  static constexpr std::uint8_t kOffset = 0x25, kSize = 8;
  static constexpr Signal kMux{.start = 0, .length = 4};
  static constexpr std::uint8_t kPage = 5;
  static constexpr Signal kRxOverflow{.start = 8, .length = 16, .wraps = true};
  static constexpr Signal kTxFull{.start = 24, .length = 16, .wraps = true};
  static constexpr Signal kBusOff{.start = 40, .length = 16, .wraps = true};

  std::uint16_t rx_overflow = 0;  ///< frames the controller or socket lost on reception, since start
  std::uint16_t tx_full = 0;  ///< frames refused for transmission, since start
  std::uint16_t bus_off = 0;  ///< times the controller left the bus, since start

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kRxOverflow>{}, m.rx_overflow);
    visit(At<kTxFull>{}, m.tx_full);
    visit(At<kBusOff>{}, m.bus_off);
  }
  friend constexpr bool operator==(const EstDiagBus&, const EstDiagBus&) = default;
};

/// Diagnostics of the node, one page per frame. Counters wrap. Pages 2, 3, 4, 6 and 7 follow from the frames alone:
/// the same in every replay. Page 6.
struct EstDiagRefused {
  static constexpr std::uint8_t kOffset = 0x25, kSize = 8;
  static constexpr Signal kMux{.start = 0, .length = 4};
  static constexpr std::uint8_t kPage = 6;
  static constexpr Signal kNotUsed{.start = 8, .length = 16, .wraps = true};
  static constexpr Signal kNoTime{.start = 24, .length = 16, .wraps = true};
  static constexpr Signal kCmdRefused{.start = 40, .length = 16, .wraps = true};

  std::uint16_t not_used = 0;  ///< samples no estimator of this node uses, since start
  std::uint16_t no_time = 0;  ///< samples before the node knew the time, since start
  std::uint16_t cmd_refused = 0;  ///< commands with wrong CRC, counter or content, since start

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kNotUsed>{}, m.not_used);
    visit(At<kNoTime>{}, m.no_time);
    visit(At<kCmdRefused>{}, m.cmd_refused);
  }
  friend constexpr bool operator==(const EstDiagRefused&, const EstDiagRefused&) = default;
};

/// Diagnostics of the node, one page per frame. Counters wrap. Pages 2, 3, 4, 6 and 7 follow from the frames alone:
/// the same in every replay. Page 7.
struct EstDiagCapacity {
  static constexpr std::uint8_t kOffset = 0x25, kSize = 8;
  static constexpr Signal kMux{.start = 0, .length = 4};
  static constexpr std::uint8_t kPage = 7;
  static constexpr Signal kMapFull{.start = 8, .length = 16, .wraps = true};
  static constexpr Signal kTimelineFull{.start = 24, .length = 16, .wraps = true};
  static constexpr Signal kWindowShort{.start = 40, .length = 16, .wraps = true};

  std::uint16_t map_full = 0;  ///< map entries refused because the map was full, since start
  std::uint16_t timeline_full = 0;  ///< samples dropped because the timeline was full, since start
  std::uint16_t window_short = 0;  ///< samples that left the window before their time because the timeline was full, since start

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kMapFull>{}, m.map_full);
    visit(At<kTimelineFull>{}, m.timeline_full);
    visit(At<kWindowShort>{}, m.window_short);
  }
  friend constexpr bool operator==(const EstDiagCapacity&, const EstDiagCapacity&) = default;
};

/// Diagnostics of the node, one page per frame. Counters wrap. Pages 2, 3, 4, 6 and 7 follow from the frames alone:
/// the same in every replay. Page 8.
struct EstDiagSync {
  static constexpr std::uint8_t kOffset = 0x25, kSize = 8;
  static constexpr Signal kMux{.start = 0, .length = 4};
  static constexpr std::uint8_t kPage = 8;
  static constexpr Signal kSyncJump{.start = 8, .length = 16, .wraps = true};
  static constexpr Signal kSyncGap{.start = 24, .length = 16, .wraps = true};
  static constexpr Signal kSyncBad{.start = 40, .length = 16, .wraps = true};

  std::uint16_t sync_jump = 0;  ///< sync frames too far ahead of the last tick, since start
  std::uint16_t sync_gap = 0;  ///< sync frames that by their counter (modulo 256) were sent and never came, since start; a sender that starts anew without Begin looks like a gap
  std::uint16_t sync_bad = 0;  ///< sync frames of wrong length, since start

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kSyncJump>{}, m.sync_jump);
    visit(At<kSyncGap>{}, m.sync_gap);
    visit(At<kSyncBad>{}, m.sync_bad);
  }
  friend constexpr bool operator==(const EstDiagSync&, const EstDiagSync&) = default;
};

/// What runs on the node.
struct EstVersion {
  static constexpr std::uint8_t kOffset = 0x26, kSize = 8;
  static constexpr Signal kGit{.start = 0, .length = 32, .wraps = true};
  static constexpr Signal kConfig{.start = 32, .length = 32, .wraps = true};

  std::uint32_t git = 0;  ///< first 8 hexadecimal digits of the git commit
  std::uint32_t config = 0;  ///< CRC-32 of the configuration

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kGit>{}, m.git);
    visit(At<kConfig>{}, m.config);
  }
  friend constexpr bool operator==(const EstVersion&, const EstVersion&) = default;
};

/// Origin of the map frame (ENU), one coordinate per page. Page 0.
struct EstOriginLat {
  static constexpr std::uint8_t kOffset = 0x27, kSize = 8;
  static constexpr Signal kMux{.start = 0, .length = 2};
  static constexpr std::uint8_t kPage = 0;
  static constexpr Signal kSource{.start = 2, .length = 2};
  static constexpr Signal kLat{.start = 4, .length = 37, .is_signed = true, .has_gap = true};
  static constexpr double kLatScale = 2e-9;  // deg
  static constexpr std::int64_t kLatNotAvailable = std::numeric_limits<std::int64_t>::min();

  OriginSource source = OriginSource::kNone;  ///< where the origin comes from
  std::int64_t lat_raw = 0;  ///< WGS84 latitude, positive north; +-137.43895347 deg in steps of 0.000000002; kLatNotAvailable

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kSource>{}, m.source);
    visit(At<kLat>{}, m.lat_raw);
  }
  friend constexpr bool operator==(const EstOriginLat&, const EstOriginLat&) = default;
};

/// Origin of the map frame (ENU), one coordinate per page. Page 1.
struct EstOriginLon {
  static constexpr std::uint8_t kOffset = 0x27, kSize = 8;
  static constexpr Signal kMux{.start = 0, .length = 2};
  static constexpr std::uint8_t kPage = 1;
  static constexpr Signal kSource{.start = 2, .length = 2};
  static constexpr Signal kLon{.start = 4, .length = 38, .is_signed = true, .has_gap = true};
  static constexpr double kLonScale = 2e-9;  // deg
  static constexpr std::int64_t kLonNotAvailable = std::numeric_limits<std::int64_t>::min();

  OriginSource source = OriginSource::kNone;  ///< where the origin comes from
  std::int64_t lon_raw = 0;  ///< WGS84 longitude, positive east; +-274.877906942 deg in steps of 0.000000002; kLonNotAvailable

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kSource>{}, m.source);
    visit(At<kLon>{}, m.lon_raw);
  }
  friend constexpr bool operator==(const EstOriginLon&, const EstOriginLon&) = default;
};

/// Origin of the map frame (ENU), one coordinate per page. Page 2.
struct EstOriginHeight {
  static constexpr std::uint8_t kOffset = 0x27, kSize = 8;
  static constexpr Signal kMux{.start = 0, .length = 2};
  static constexpr std::uint8_t kPage = 2;
  static constexpr Signal kSource{.start = 2, .length = 2};
  static constexpr Signal kHeight{.start = 4, .length = 24, .is_signed = true, .has_gap = true, .per_unit = 500};

  OriginSource source = OriginSource::kNone;  ///< where the origin comes from
  float height_m = 0;  ///< above the WGS84 ellipsoid (not the geoid), up; +-16777.214 m in steps of 0.002; NaN: not available

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kSource>{}, m.source);
    visit(At<kHeight>{}, m.height_m);
  }
};

/// Estimator: position of the body origin, map frame (ENU: x east, y north). Instances 0 to 3, ids 6 apart.
struct EstPos {
  static constexpr std::uint8_t kOffset = 0x28, kSize = 8;
  static constexpr std::uint8_t kStride = 6, kCount = 4;
  static constexpr Signal kX{.start = 0, .length = 28, .is_signed = true, .has_gap = true};
  static constexpr double kXScale = 1e-3;  // m
  static constexpr std::int32_t kXNotAvailable = std::numeric_limits<std::int32_t>::min();
  static constexpr Signal kY{.start = 28, .length = 28, .is_signed = true, .has_gap = true};
  static constexpr double kYScale = 1e-3;  // m
  static constexpr std::int32_t kYNotAvailable = std::numeric_limits<std::int32_t>::min();
  static constexpr Signal kEpoch{.start = 56, .length = 4, .wraps = true};
  static constexpr Signal kKind{.start = 60, .length = 4};

  std::int32_t x_raw = 0;  ///< position east of the origin, map frame; +-134217.727 m in steps of 0.001; kXNotAvailable
  std::int32_t y_raw = 0;  ///< position north of the origin, map frame; +-134217.727 m in steps of 0.001; kYNotAvailable
  std::uint8_t epoch = 0;  ///< low bits of the epoch, the same in all frames of one epoch
  EstimatorKind kind = EstimatorKind::kNone;  ///< which estimator this instance is

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kX>{}, m.x_raw);
    visit(At<kY>{}, m.y_raw);
    visit(At<kEpoch>{}, m.epoch);
    visit(At<kKind>{}, m.kind);
  }
  friend constexpr bool operator==(const EstPos&, const EstPos&) = default;
};

/// Estimator: heading and motion of the body, with what of it is valid. Instances 0 to 3, ids 6 apart.
struct EstMotion {
  static constexpr std::uint8_t kOffset = 0x29, kSize = 8;
  static constexpr std::uint8_t kStride = 6, kCount = 4;
  static constexpr Signal kYaw{.start = 0, .length = 16, .is_signed = true, .has_gap = true, .per_unit = 10000};
  static constexpr Signal kSpeed{.start = 16, .length = 16, .is_signed = true, .has_gap = true, .per_unit = 1000};
  static constexpr Signal kYawRate{.start = 32, .length = 16, .is_signed = true, .has_gap = true, .per_unit = 2000};
  static constexpr Signal kEpoch{.start = 48, .length = 4, .wraps = true};
  static constexpr Signal kPosValid{.start = 52, .length = 1};
  static constexpr Signal kHdgValid{.start = 53, .length = 1};
  static constexpr Signal kVelValid{.start = 54, .length = 1};

  float yaw_rad = 0;  ///< heading of body x in the map frame, 0 = east, counter-clockwise, -pi to pi; +-3.2767 rad in steps of 0.0001; NaN: not available
  float speed_mps = 0;  ///< forward speed of the body origin, negative backwards; +-32.767 m/s in steps of 0.001; NaN: not available
  float yaw_rate_radps = 0;  ///< positive counter-clockwise; +-16.3835 rad/s in steps of 0.0005; NaN: not available
  std::uint8_t epoch = 0;  ///< low bits of the epoch, the same in all frames of one epoch
  bool pos_valid = false;  ///< 1: position is bound to the map; how well is in the 1-sigma
  bool hdg_valid = false;  ///< 1: heading is bound to the map; how well is in the 1-sigma
  bool vel_valid = false;  ///< 1: speed and yaw rate are estimated from live measurements

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kYaw>{}, m.yaw_rad);
    visit(At<kSpeed>{}, m.speed_mps);
    visit(At<kYawRate>{}, m.yaw_rate_radps);
    visit(At<kEpoch>{}, m.epoch);
    visit(At<kPosValid>{}, m.pos_valid);
    visit(At<kHdgValid>{}, m.hdg_valid);
    visit(At<kVelValid>{}, m.vel_valid);
  }
};

/// Estimator: attitude as a unit quaternion that turns body axes into the map frame. Instances 0 to 3, ids 6 apart.
struct EstAtt {
  static constexpr std::uint8_t kOffset = 0x2A, kSize = 8;
  static constexpr std::uint8_t kStride = 6, kCount = 4;
  static constexpr Signal kW{.start = 0, .length = 15, .is_signed = true, .has_gap = true, .per_unit = 16000};
  static constexpr Signal kX{.start = 15, .length = 15, .is_signed = true, .has_gap = true, .per_unit = 16000};
  static constexpr Signal kY{.start = 30, .length = 15, .is_signed = true, .has_gap = true, .per_unit = 16000};
  static constexpr Signal kZ{.start = 45, .length = 15, .is_signed = true, .has_gap = true, .per_unit = 16000};
  static constexpr Signal kEpoch{.start = 60, .length = 4, .wraps = true};

  float w = 0;  ///< real part; +-1.0239375 in steps of 0.0000625; NaN: not available
  float x = 0;  ///< imaginary part, x; +-1.0239375 in steps of 0.0000625; NaN: not available
  float y = 0;  ///< imaginary part, y; +-1.0239375 in steps of 0.0000625; NaN: not available
  float z = 0;  ///< imaginary part, z; +-1.0239375 in steps of 0.0000625; NaN: not available
  std::uint8_t epoch = 0;  ///< low bits of the epoch, the same in all frames of one epoch

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kW>{}, m.w);
    visit(At<kX>{}, m.x);
    visit(At<kY>{}, m.y);
    visit(At<kZ>{}, m.z);
    visit(At<kEpoch>{}, m.epoch);
  }
};

/// Estimator: velocity of the body origin, map frame. Instances 0 to 3, ids 6 apart.
struct EstVel {
  static constexpr std::uint8_t kOffset = 0x2B, kSize = 8;
  static constexpr std::uint8_t kStride = 6, kCount = 4;
  static constexpr Signal kEast{.start = 0, .length = 19, .is_signed = true, .has_gap = true, .per_unit = 2000};
  static constexpr Signal kNorth{.start = 19, .length = 19, .is_signed = true, .has_gap = true, .per_unit = 2000};
  static constexpr Signal kUp{.start = 38, .length = 19, .is_signed = true, .has_gap = true, .per_unit = 2000};
  static constexpr Signal kEpoch{.start = 57, .length = 4, .wraps = true};

  float east_mps = 0;  ///< towards east; +-131.0715 m/s in steps of 0.0005; NaN: not available
  float north_mps = 0;  ///< towards north; +-131.0715 m/s in steps of 0.0005; NaN: not available
  float up_mps = 0;  ///< towards up; +-131.0715 m/s in steps of 0.0005; NaN: not available
  std::uint8_t epoch = 0;  ///< low bits of the epoch, the same in all frames of one epoch

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kEast>{}, m.east_mps);
    visit(At<kNorth>{}, m.north_mps);
    visit(At<kUp>{}, m.up_mps);
    visit(At<kEpoch>{}, m.epoch);
  }
};

/// Estimator: 1-sigma and correlations, one page per frame. Instances 0 to 3, ids 6 apart. Page 0.
struct EstStdPose {
  static constexpr std::uint8_t kOffset = 0x2C, kSize = 8;
  static constexpr std::uint8_t kStride = 6, kCount = 4;
  static constexpr Signal kMux{.start = 0, .length = 1};
  static constexpr std::uint8_t kPage = 0;
  static constexpr Signal kEpoch{.start = 1, .length = 4, .wraps = true};
  static constexpr Signal kStdX{.start = 5, .length = 16, .has_gap = true, .per_unit = 2000};
  static constexpr Signal kStdY{.start = 21, .length = 16, .has_gap = true, .per_unit = 2000};
  static constexpr Signal kStdYaw{.start = 37, .length = 15, .has_gap = true, .per_unit = 10000};
  static constexpr Signal kCorrXY{.start = 52, .length = 12, .is_signed = true, .has_gap = true, .per_unit = 2000};

  std::uint8_t epoch = 0;  ///< low bits of the epoch, the same in all frames of one epoch
  float std_x_m = 0;  ///< 1-sigma of X; 0 to 32.767 m in steps of 0.0005; NaN: not available
  float std_y_m = 0;  ///< 1-sigma of Y; 0 to 32.767 m in steps of 0.0005; NaN: not available
  float std_yaw_rad = 0;  ///< 1-sigma of Yaw; 0 to 3.2766 rad in steps of 0.0001; NaN: not available
  float corr_xy = 0;  ///< correlation of X and Y; +-1.0235 in steps of 0.0005; NaN: not available

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kEpoch>{}, m.epoch);
    visit(At<kStdX>{}, m.std_x_m);
    visit(At<kStdY>{}, m.std_y_m);
    visit(At<kStdYaw>{}, m.std_yaw_rad);
    visit(At<kCorrXY>{}, m.corr_xy);
  }
};

/// Estimator: 1-sigma and correlations, one page per frame. Instances 0 to 3, ids 6 apart. Page 1.
struct EstStdMore {
  static constexpr std::uint8_t kOffset = 0x2C, kSize = 8;
  static constexpr std::uint8_t kStride = 6, kCount = 4;
  static constexpr Signal kMux{.start = 0, .length = 1};
  static constexpr std::uint8_t kPage = 1;
  static constexpr Signal kEpoch{.start = 1, .length = 4, .wraps = true};
  static constexpr Signal kCorrXYaw{.start = 6, .length = 12, .is_signed = true, .has_gap = true, .per_unit = 2000};
  static constexpr Signal kCorrYYaw{.start = 18, .length = 12, .is_signed = true, .has_gap = true, .per_unit = 2000};
  static constexpr Signal kStdSpeed{.start = 30, .length = 16, .has_gap = true, .per_unit = 5000};
  static constexpr Signal kStdYawRate{.start = 46, .length = 16, .has_gap = true, .per_unit = 5000};

  std::uint8_t epoch = 0;  ///< low bits of the epoch, the same in all frames of one epoch
  float corr_x_yaw = 0;  ///< correlation of X and Yaw; +-1.0235 in steps of 0.0005; NaN: not available
  float corr_y_yaw = 0;  ///< correlation of Y and Yaw; +-1.0235 in steps of 0.0005; NaN: not available
  float std_speed_mps = 0;  ///< 1-sigma of Speed; 0 to 13.1068 m/s in steps of 0.0002; NaN: not available
  float std_yaw_rate_radps = 0;  ///< 1-sigma of YawRate; 0 to 13.1068 rad/s in steps of 0.0002; NaN: not available

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kEpoch>{}, m.epoch);
    visit(At<kCorrXYaw>{}, m.corr_x_yaw);
    visit(At<kCorrYYaw>{}, m.corr_y_yaw);
    visit(At<kStdSpeed>{}, m.std_speed_mps);
    visit(At<kStdYawRate>{}, m.std_yaw_rate_radps);
  }
};

/// Estimator: what only an inertial estimator has, one page per frame. A covariance is said whole in one epoch: P_ij
/// = CorrIJ StdI StdJ; each page comes once in nine turns. Instances 0 to 3, ids 6 apart. Page 0.
struct EstStateHeight {
  static constexpr std::uint8_t kOffset = 0x2D, kSize = 8;
  static constexpr std::uint8_t kStride = 6, kCount = 4;
  static constexpr Signal kMux{.start = 0, .length = 4};
  static constexpr std::uint8_t kPage = 0;
  static constexpr Signal kEpoch{.start = 4, .length = 4, .wraps = true};
  static constexpr Signal kHeight{.start = 8, .length = 24, .is_signed = true, .has_gap = true, .per_unit = 500};
  static constexpr Signal kStdHeight{.start = 32, .length = 16, .has_gap = true, .per_unit = 2000};
  static constexpr Signal kJumpZ{.start = 48, .length = 16, .is_signed = true, .has_gap = true, .per_unit = 20};

  std::uint8_t epoch = 0;  ///< low bits of the epoch, the same in all frames of one epoch
  float height_m = 0;  ///< above the origin; +-16777.214 m in steps of 0.002; NaN: not available
  float std_height_m = 0;  ///< 1-sigma of Height; 0 to 32.767 m in steps of 0.0005; NaN: not available
  float jump_z_m = 0;  ///< last reset: step of the height; +-1638.35 m in steps of 0.05; NaN: not available

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kEpoch>{}, m.epoch);
    visit(At<kHeight>{}, m.height_m);
    visit(At<kStdHeight>{}, m.std_height_m);
    visit(At<kJumpZ>{}, m.jump_z_m);
  }
};

/// Estimator: what only an inertial estimator has, one page per frame. A covariance is said whole in one epoch: P_ij
/// = CorrIJ StdI StdJ; each page comes once in nine turns. Instances 0 to 3, ids 6 apart. Page 1.
struct EstStateAccBias {
  static constexpr std::uint8_t kOffset = 0x2D, kSize = 8;
  static constexpr std::uint8_t kStride = 6, kCount = 4;
  static constexpr Signal kMux{.start = 0, .length = 4};
  static constexpr std::uint8_t kPage = 1;
  static constexpr Signal kEpoch{.start = 4, .length = 4, .wraps = true};
  static constexpr Signal kAccBiasX{.start = 8, .length = 18, .is_signed = true, .has_gap = true, .per_unit = 20000};
  static constexpr Signal kAccBiasY{.start = 26, .length = 18, .is_signed = true, .has_gap = true, .per_unit = 20000};
  static constexpr Signal kAccBiasZ{.start = 44, .length = 18, .is_signed = true, .has_gap = true, .per_unit = 20000};

  std::uint8_t epoch = 0;  ///< low bits of the epoch, the same in all frames of one epoch
  float acc_bias_x_mps2 = 0;  ///< accelerometer bias along body x; +-6.55355 m/s2 in steps of 0.00005; NaN: not available
  float acc_bias_y_mps2 = 0;  ///< accelerometer bias along body y; +-6.55355 m/s2 in steps of 0.00005; NaN: not available
  float acc_bias_z_mps2 = 0;  ///< accelerometer bias along body z; +-6.55355 m/s2 in steps of 0.00005; NaN: not available

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kEpoch>{}, m.epoch);
    visit(At<kAccBiasX>{}, m.acc_bias_x_mps2);
    visit(At<kAccBiasY>{}, m.acc_bias_y_mps2);
    visit(At<kAccBiasZ>{}, m.acc_bias_z_mps2);
  }
};

/// Estimator: what only an inertial estimator has, one page per frame. A covariance is said whole in one epoch: P_ij
/// = CorrIJ StdI StdJ; each page comes once in nine turns. Instances 0 to 3, ids 6 apart. Page 2.
struct EstStateGyroBias {
  static constexpr std::uint8_t kOffset = 0x2D, kSize = 8;
  static constexpr std::uint8_t kStride = 6, kCount = 4;
  static constexpr Signal kMux{.start = 0, .length = 4};
  static constexpr std::uint8_t kPage = 2;
  static constexpr Signal kEpoch{.start = 4, .length = 4, .wraps = true};
  static constexpr Signal kGyroBiasX{.start = 8, .length = 18, .is_signed = true, .has_gap = true, .per_unit = 400000};
  static constexpr Signal kGyroBiasY{.start = 26, .length = 18, .is_signed = true, .has_gap = true, .per_unit = 400000};
  static constexpr Signal kGyroBiasZ{.start = 44, .length = 18, .is_signed = true, .has_gap = true, .per_unit = 400000};

  std::uint8_t epoch = 0;  ///< low bits of the epoch, the same in all frames of one epoch
  float gyro_bias_x_radps = 0;  ///< gyroscope bias along body x; +-0.3276775 rad/s in steps of 0.0000025; NaN: not available
  float gyro_bias_y_radps = 0;  ///< gyroscope bias along body y; +-0.3276775 rad/s in steps of 0.0000025; NaN: not available
  float gyro_bias_z_radps = 0;  ///< gyroscope bias along body z; +-0.3276775 rad/s in steps of 0.0000025; NaN: not available

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kEpoch>{}, m.epoch);
    visit(At<kGyroBiasX>{}, m.gyro_bias_x_radps);
    visit(At<kGyroBiasY>{}, m.gyro_bias_y_radps);
    visit(At<kGyroBiasZ>{}, m.gyro_bias_z_radps);
  }
};

/// Estimator: what only an inertial estimator has, one page per frame. A covariance is said whole in one epoch: P_ij
/// = CorrIJ StdI StdJ; each page comes once in nine turns. Instances 0 to 3, ids 6 apart. Page 3.
struct EstStateStdVel {
  static constexpr std::uint8_t kOffset = 0x2D, kSize = 8;
  static constexpr std::uint8_t kStride = 6, kCount = 4;
  static constexpr Signal kMux{.start = 0, .length = 4};
  static constexpr std::uint8_t kPage = 3;
  static constexpr Signal kEpoch{.start = 4, .length = 4, .wraps = true};
  static constexpr Signal kStdVelEast{.start = 8, .length = 18, .has_gap = true, .per_unit = 20000};
  static constexpr Signal kStdVelNorth{.start = 26, .length = 18, .has_gap = true, .per_unit = 20000};
  static constexpr Signal kStdVelUp{.start = 44, .length = 18, .has_gap = true, .per_unit = 20000};

  std::uint8_t epoch = 0;  ///< low bits of the epoch, the same in all frames of one epoch
  float std_vel_east_mps = 0;  ///< 1-sigma of the velocity towards east; 0 to 13.1071 m/s in steps of 0.00005; NaN: not available
  float std_vel_north_mps = 0;  ///< 1-sigma of the velocity towards north; 0 to 13.1071 m/s in steps of 0.00005; NaN: not available
  float std_vel_up_mps = 0;  ///< 1-sigma of the velocity towards up; 0 to 13.1071 m/s in steps of 0.00005; NaN: not available

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kEpoch>{}, m.epoch);
    visit(At<kStdVelEast>{}, m.std_vel_east_mps);
    visit(At<kStdVelNorth>{}, m.std_vel_north_mps);
    visit(At<kStdVelUp>{}, m.std_vel_up_mps);
  }
};

/// Estimator: what only an inertial estimator has, one page per frame. A covariance is said whole in one epoch: P_ij
/// = CorrIJ StdI StdJ; each page comes once in nine turns. Instances 0 to 3, ids 6 apart. Page 4.
struct EstStateStdTilt {
  static constexpr std::uint8_t kOffset = 0x2D, kSize = 8;
  static constexpr std::uint8_t kStride = 6, kCount = 4;
  static constexpr Signal kMux{.start = 0, .length = 4};
  static constexpr std::uint8_t kPage = 4;
  static constexpr Signal kEpoch{.start = 4, .length = 4, .wraps = true};
  static constexpr Signal kStdTiltEast{.start = 8, .length = 20, .has_gap = true, .per_unit = 500000};
  static constexpr Signal kStdTiltNorth{.start = 28, .length = 20, .has_gap = true, .per_unit = 500000};

  std::uint8_t epoch = 0;  ///< low bits of the epoch, the same in all frames of one epoch
  float std_tilt_east_rad = 0;  ///< 1-sigma of the turn about the axis that points east; 0 to 2.097148 rad in steps of 0.000002; NaN: not available
  float std_tilt_north_rad = 0;  ///< 1-sigma of the turn about the axis that points north; 0 to 2.097148 rad in steps of 0.000002; NaN: not available

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kEpoch>{}, m.epoch);
    visit(At<kStdTiltEast>{}, m.std_tilt_east_rad);
    visit(At<kStdTiltNorth>{}, m.std_tilt_north_rad);
  }
};

/// Estimator: what only an inertial estimator has, one page per frame. A covariance is said whole in one epoch: P_ij
/// = CorrIJ StdI StdJ; each page comes once in nine turns. Instances 0 to 3, ids 6 apart. Page 5.
struct EstStateStdAccBias {
  static constexpr std::uint8_t kOffset = 0x2D, kSize = 8;
  static constexpr std::uint8_t kStride = 6, kCount = 4;
  static constexpr Signal kMux{.start = 0, .length = 4};
  static constexpr std::uint8_t kPage = 5;
  static constexpr Signal kEpoch{.start = 4, .length = 4, .wraps = true};
  static constexpr Signal kStdAccBiasX{.start = 8, .length = 18, .has_gap = true, .per_unit = 100000};
  static constexpr Signal kStdAccBiasY{.start = 26, .length = 18, .has_gap = true, .per_unit = 100000};
  static constexpr Signal kStdAccBiasZ{.start = 44, .length = 18, .has_gap = true, .per_unit = 100000};

  std::uint8_t epoch = 0;  ///< low bits of the epoch, the same in all frames of one epoch
  float std_acc_bias_x_mps2 = 0;  ///< 1-sigma of the accelerometer bias along body x; 0 to 2.62142 m/s2 in steps of 0.00001; NaN: not available
  float std_acc_bias_y_mps2 = 0;  ///< 1-sigma of the accelerometer bias along body y; 0 to 2.62142 m/s2 in steps of 0.00001; NaN: not available
  float std_acc_bias_z_mps2 = 0;  ///< 1-sigma of the accelerometer bias along body z; 0 to 2.62142 m/s2 in steps of 0.00001; NaN: not available

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kEpoch>{}, m.epoch);
    visit(At<kStdAccBiasX>{}, m.std_acc_bias_x_mps2);
    visit(At<kStdAccBiasY>{}, m.std_acc_bias_y_mps2);
    visit(At<kStdAccBiasZ>{}, m.std_acc_bias_z_mps2);
  }
};

/// Estimator: what only an inertial estimator has, one page per frame. A covariance is said whole in one epoch: P_ij
/// = CorrIJ StdI StdJ; each page comes once in nine turns. Instances 0 to 3, ids 6 apart. Page 6.
struct EstStateStdGyroBias {
  static constexpr std::uint8_t kOffset = 0x2D, kSize = 8;
  static constexpr std::uint8_t kStride = 6, kCount = 4;
  static constexpr Signal kMux{.start = 0, .length = 4};
  static constexpr std::uint8_t kPage = 6;
  static constexpr Signal kEpoch{.start = 4, .length = 4, .wraps = true};
  static constexpr Signal kStdGyroBiasX{.start = 8, .length = 18, .has_gap = true, .per_unit = 2000000};
  static constexpr Signal kStdGyroBiasY{.start = 26, .length = 18, .has_gap = true, .per_unit = 2000000};
  static constexpr Signal kStdGyroBiasZ{.start = 44, .length = 18, .has_gap = true, .per_unit = 2000000};

  std::uint8_t epoch = 0;  ///< low bits of the epoch, the same in all frames of one epoch
  float std_gyro_bias_x_radps = 0;  ///< 1-sigma of the gyroscope bias along body x; 0 to 0.131071 rad/s in steps of 0.0000005; NaN: not available
  float std_gyro_bias_y_radps = 0;  ///< 1-sigma of the gyroscope bias along body y; 0 to 0.131071 rad/s in steps of 0.0000005; NaN: not available
  float std_gyro_bias_z_radps = 0;  ///< 1-sigma of the gyroscope bias along body z; 0 to 0.131071 rad/s in steps of 0.0000005; NaN: not available

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kEpoch>{}, m.epoch);
    visit(At<kStdGyroBiasX>{}, m.std_gyro_bias_x_radps);
    visit(At<kStdGyroBiasY>{}, m.std_gyro_bias_y_radps);
    visit(At<kStdGyroBiasZ>{}, m.std_gyro_bias_z_radps);
  }
};

/// Estimator: what only an inertial estimator has, one page per frame. A covariance is said whole in one epoch: P_ij
/// = CorrIJ StdI StdJ; each page comes once in nine turns. Instances 0 to 3, ids 6 apart. Page 7.
struct EstStateJump {
  static constexpr std::uint8_t kOffset = 0x2D, kSize = 8;
  static constexpr std::uint8_t kStride = 6, kCount = 4;
  static constexpr Signal kMux{.start = 0, .length = 4};
  static constexpr std::uint8_t kPage = 7;
  static constexpr Signal kEpoch{.start = 4, .length = 4, .wraps = true};
  static constexpr Signal kJumpX{.start = 8, .length = 18, .is_signed = true, .has_gap = true, .per_unit = 100};
  static constexpr Signal kJumpY{.start = 26, .length = 18, .is_signed = true, .has_gap = true, .per_unit = 100};
  static constexpr Signal kJumpYaw{.start = 44, .length = 14, .is_signed = true, .has_gap = true, .per_unit = 2000};

  std::uint8_t epoch = 0;  ///< low bits of the epoch, the same in all frames of one epoch
  float jump_x_m = 0;  ///< last reset: step of the position towards east; +-1310.71 m in steps of 0.01; NaN: not available
  float jump_y_m = 0;  ///< last reset: step of the position towards north; +-1310.71 m in steps of 0.01; NaN: not available
  float jump_yaw_rad = 0;  ///< last reset: step of the heading; +-4.0955 rad in steps of 0.0005; NaN: not available

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kEpoch>{}, m.epoch);
    visit(At<kJumpX>{}, m.jump_x_m);
    visit(At<kJumpY>{}, m.jump_y_m);
    visit(At<kJumpYaw>{}, m.jump_yaw_rad);
  }
};

/// Estimator: what only an inertial estimator has, one page per frame. A covariance is said whole in one epoch: P_ij
/// = CorrIJ StdI StdJ; each page comes once in nine turns. Instances 0 to 3, ids 6 apart. Page 8.
struct EstStateDisagreement {
  static constexpr std::uint8_t kOffset = 0x2D, kSize = 8;
  static constexpr std::uint8_t kStride = 6, kCount = 4;
  static constexpr Signal kMux{.start = 0, .length = 4};
  static constexpr std::uint8_t kPage = 8;
  static constexpr Signal kEpoch{.start = 4, .length = 4, .wraps = true};
  static constexpr Signal kDisagreeTilt{.start = 8, .length = 16, .has_gap = true, .per_unit = 10000};
  static constexpr Signal kDisagreeYaw{.start = 24, .length = 17, .is_signed = true, .has_gap = true, .per_unit = 20000};

  std::uint8_t epoch = 0;  ///< low bits of the epoch, the same in all frames of one epoch
  float disagree_tilt_rad = 0;  ///< angle between this estimator's up and that of the primary one; 0 to 6.5534 rad in steps of 0.0001; NaN: not available
  float disagree_yaw_rad = 0;  ///< heading of this estimator minus that of the primary one; +-3.27675 rad in steps of 0.00005; NaN: not available

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kEpoch>{}, m.epoch);
    visit(At<kDisagreeTilt>{}, m.disagree_tilt_rad);
    visit(At<kDisagreeYaw>{}, m.disagree_yaw_rad);
  }
};

/// Estimator: what only an inertial estimator has, one page per frame. A covariance is said whole in one epoch: P_ij
/// = CorrIJ StdI StdJ; each page comes once in nine turns. Instances 0 to 3, ids 6 apart. Page 9.
struct EstStateImuHealth {
  static constexpr std::uint8_t kOffset = 0x2D, kSize = 8;
  static constexpr std::uint8_t kStride = 6, kCount = 4;
  static constexpr Signal kMux{.start = 0, .length = 4};
  static constexpr std::uint8_t kPage = 9;
  static constexpr Signal kEpoch{.start = 4, .length = 4, .wraps = true};
  static constexpr Signal kVibAccel{.start = 8, .length = 16, .has_gap = true, .per_unit = 500};
  static constexpr Signal kVibGyro{.start = 24, .length = 16, .has_gap = true, .per_unit = 5000};
  static constexpr Signal kClipped{.start = 40, .length = 16, .wraps = true};

  std::uint8_t epoch = 0;  ///< low bits of the epoch, the same in all frames of one epoch
  float vib_accel_mps2 = 0;  ///< RMS of the specific force above 10 Hz or so; 0 to 131.068 m/s2 in steps of 0.002; NaN: not available
  float vib_gyro_radps = 0;  ///< RMS of the turn rate above 10 Hz or so; 0 to 13.1068 rad/s in steps of 0.0002; NaN: not available
  std::uint16_t clipped = 0;  ///< IMU samples with a clipped axis

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kEpoch>{}, m.epoch);
    visit(At<kVibAccel>{}, m.vib_accel_mps2);
    visit(At<kVibGyro>{}, m.vib_gyro_radps);
    visit(At<kClipped>{}, m.clipped);
  }
};

/// Estimator: what only an inertial estimator has, one page per frame. A covariance is said whole in one epoch: P_ij
/// = CorrIJ StdI StdJ; each page comes once in nine turns. Instances 0 to 3, ids 6 apart. Page 10.
struct EstStateCorrPos {
  static constexpr std::uint8_t kOffset = 0x2D, kSize = 8;
  static constexpr std::uint8_t kStride = 6, kCount = 4;
  static constexpr Signal kMux{.start = 0, .length = 4};
  static constexpr std::uint8_t kPage = 10;
  static constexpr Signal kEpoch{.start = 4, .length = 4, .wraps = true};
  static constexpr Signal kCorrXZ{.start = 8, .length = 16, .is_signed = true, .has_gap = true, .per_unit = 20000};
  static constexpr Signal kCorrYZ{.start = 24, .length = 16, .is_signed = true, .has_gap = true, .per_unit = 20000};

  std::uint8_t epoch = 0;  ///< low bits of the epoch, the same in all frames of one epoch
  float corr_xz = 0;  ///< correlation of X and Height; +-1.63835 in steps of 0.00005; NaN: not available
  float corr_yz = 0;  ///< correlation of Y and Height; +-1.63835 in steps of 0.00005; NaN: not available

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kEpoch>{}, m.epoch);
    visit(At<kCorrXZ>{}, m.corr_xz);
    visit(At<kCorrYZ>{}, m.corr_yz);
  }
};

/// Estimator: what only an inertial estimator has, one page per frame. A covariance is said whole in one epoch: P_ij
/// = CorrIJ StdI StdJ; each page comes once in nine turns. Instances 0 to 3, ids 6 apart. Page 11.
struct EstStateCorrVel {
  static constexpr std::uint8_t kOffset = 0x2D, kSize = 8;
  static constexpr std::uint8_t kStride = 6, kCount = 4;
  static constexpr Signal kMux{.start = 0, .length = 4};
  static constexpr std::uint8_t kPage = 11;
  static constexpr Signal kEpoch{.start = 4, .length = 4, .wraps = true};
  static constexpr Signal kCorrVelEN{.start = 8, .length = 16, .is_signed = true, .has_gap = true, .per_unit = 20000};
  static constexpr Signal kCorrVelEU{.start = 24, .length = 16, .is_signed = true, .has_gap = true, .per_unit = 20000};
  static constexpr Signal kCorrVelNU{.start = 40, .length = 16, .is_signed = true, .has_gap = true, .per_unit = 20000};

  std::uint8_t epoch = 0;  ///< low bits of the epoch, the same in all frames of one epoch
  float corr_vel_en = 0;  ///< correlation of the velocities towards east and north; +-1.63835 in steps of 0.00005; NaN: not available
  float corr_vel_eu = 0;  ///< correlation of the velocities towards east and up; +-1.63835 in steps of 0.00005; NaN: not available
  float corr_vel_nu = 0;  ///< correlation of the velocities towards north and up; +-1.63835 in steps of 0.00005; NaN: not available

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kEpoch>{}, m.epoch);
    visit(At<kCorrVelEN>{}, m.corr_vel_en);
    visit(At<kCorrVelEU>{}, m.corr_vel_eu);
    visit(At<kCorrVelNU>{}, m.corr_vel_nu);
  }
};

/// Estimator: what only an inertial estimator has, one page per frame. A covariance is said whole in one epoch: P_ij
/// = CorrIJ StdI StdJ; each page comes once in nine turns. Instances 0 to 3, ids 6 apart. Page 12.
struct EstStateCorrTilt {
  static constexpr std::uint8_t kOffset = 0x2D, kSize = 8;
  static constexpr std::uint8_t kStride = 6, kCount = 4;
  static constexpr Signal kMux{.start = 0, .length = 4};
  static constexpr std::uint8_t kPage = 12;
  static constexpr Signal kEpoch{.start = 4, .length = 4, .wraps = true};
  static constexpr Signal kCorrTiltEN{.start = 8, .length = 16, .is_signed = true, .has_gap = true, .per_unit = 20000};
  static constexpr Signal kCorrTiltEYaw{.start = 24, .length = 16, .is_signed = true, .has_gap = true, .per_unit = 20000};
  static constexpr Signal kCorrTiltNYaw{.start = 40, .length = 16, .is_signed = true, .has_gap = true, .per_unit = 20000};

  std::uint8_t epoch = 0;  ///< low bits of the epoch, the same in all frames of one epoch
  float corr_tilt_en = 0;  ///< correlation of the turns about the axes that point east and north; +-1.63835 in steps of 0.00005; NaN: not available
  float corr_tilt_e_yaw = 0;  ///< correlation of the turn about the axis that points east and the heading; +-1.63835 in steps of 0.00005; NaN: not available
  float corr_tilt_n_yaw = 0;  ///< correlation of the turn about the axis that points north and the heading; +-1.63835 in steps of 0.00005; NaN: not available

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kEpoch>{}, m.epoch);
    visit(At<kCorrTiltEN>{}, m.corr_tilt_en);
    visit(At<kCorrTiltEYaw>{}, m.corr_tilt_e_yaw);
    visit(At<kCorrTiltNYaw>{}, m.corr_tilt_n_yaw);
  }
};

/// Estimator: what only an inertial estimator has, one page per frame. A covariance is said whole in one epoch: P_ij
/// = CorrIJ StdI StdJ; each page comes once in nine turns. Instances 0 to 3, ids 6 apart. Page 13.
struct EstStateCorrAccBias {
  static constexpr std::uint8_t kOffset = 0x2D, kSize = 8;
  static constexpr std::uint8_t kStride = 6, kCount = 4;
  static constexpr Signal kMux{.start = 0, .length = 4};
  static constexpr std::uint8_t kPage = 13;
  static constexpr Signal kEpoch{.start = 4, .length = 4, .wraps = true};
  static constexpr Signal kCorrAccBiasXY{.start = 8, .length = 16, .is_signed = true, .has_gap = true, .per_unit = 20000};
  static constexpr Signal kCorrAccBiasXZ{.start = 24, .length = 16, .is_signed = true, .has_gap = true, .per_unit = 20000};
  static constexpr Signal kCorrAccBiasYZ{.start = 40, .length = 16, .is_signed = true, .has_gap = true, .per_unit = 20000};

  std::uint8_t epoch = 0;  ///< low bits of the epoch, the same in all frames of one epoch
  float corr_acc_bias_xy = 0;  ///< correlation of the accelerometer biases along body x and y; +-1.63835 in steps of 0.00005; NaN: not available
  float corr_acc_bias_xz = 0;  ///< correlation of the accelerometer biases along body x and z; +-1.63835 in steps of 0.00005; NaN: not available
  float corr_acc_bias_yz = 0;  ///< correlation of the accelerometer biases along body y and z; +-1.63835 in steps of 0.00005; NaN: not available

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kEpoch>{}, m.epoch);
    visit(At<kCorrAccBiasXY>{}, m.corr_acc_bias_xy);
    visit(At<kCorrAccBiasXZ>{}, m.corr_acc_bias_xz);
    visit(At<kCorrAccBiasYZ>{}, m.corr_acc_bias_yz);
  }
};

/// Estimator: what only an inertial estimator has, one page per frame. A covariance is said whole in one epoch: P_ij
/// = CorrIJ StdI StdJ; each page comes once in nine turns. Instances 0 to 3, ids 6 apart. Page 14.
struct EstStateCorrGyroBias {
  static constexpr std::uint8_t kOffset = 0x2D, kSize = 8;
  static constexpr std::uint8_t kStride = 6, kCount = 4;
  static constexpr Signal kMux{.start = 0, .length = 4};
  static constexpr std::uint8_t kPage = 14;
  static constexpr Signal kEpoch{.start = 4, .length = 4, .wraps = true};
  static constexpr Signal kCorrGyroBiasXY{.start = 8, .length = 16, .is_signed = true, .has_gap = true, .per_unit = 20000};
  static constexpr Signal kCorrGyroBiasXZ{.start = 24, .length = 16, .is_signed = true, .has_gap = true, .per_unit = 20000};
  static constexpr Signal kCorrGyroBiasYZ{.start = 40, .length = 16, .is_signed = true, .has_gap = true, .per_unit = 20000};

  std::uint8_t epoch = 0;  ///< low bits of the epoch, the same in all frames of one epoch
  float corr_gyro_bias_xy = 0;  ///< correlation of the gyroscope biases along body x and y; +-1.63835 in steps of 0.00005; NaN: not available
  float corr_gyro_bias_xz = 0;  ///< correlation of the gyroscope biases along body x and z; +-1.63835 in steps of 0.00005; NaN: not available
  float corr_gyro_bias_yz = 0;  ///< correlation of the gyroscope biases along body y and z; +-1.63835 in steps of 0.00005; NaN: not available

  template <class Self, class Visit>
  static constexpr void each(Self& m, Visit&& visit) {
    visit(At<kEpoch>{}, m.epoch);
    visit(At<kCorrGyroBiasXY>{}, m.corr_gyro_bias_xy);
    visit(At<kCorrGyroBiasXZ>{}, m.corr_gyro_bias_xz);
    visit(At<kCorrGyroBiasYZ>{}, m.corr_gyro_bias_yz);
  }
};

/// Every message struct as a template argument list, for code that treats them all alike.
template <template <class...> class List>
using AllMessages = List<
    InSync,
    CmdReset,
    CmdSetPos,
    CmdSetYaw,
    InMapEntry,
    InWheelCounts,
    InWheelSpeed,
    InBodySpeed,
    InRangeBearing,
    InGnssLat,
    InGnssLon,
    InGnssAlt,
    InGnssAcc,
    InGnssVelEN,
    InGnssVelU,
    ImuGyro,
    ImuAccel,
    ImuTime,
    InMag,
    InBaro,
    InHeading,
    EstEpoch,
    EstStateCrc,
    EstStatus,
    EstInnov,
    EstSensorStat,
    EstDiagLoop,
    EstDiagTicks,
    EstDiagQueues,
    EstDiagOrder,
    EstDiagFrames,
    EstDiagBus,
    EstDiagRefused,
    EstDiagCapacity,
    EstDiagSync,
    EstVersion,
    EstOriginLat,
    EstOriginLon,
    EstOriginHeight,
    EstPos,
    EstMotion,
    EstAtt,
    EstVel,
    EstStdPose,
    EstStdMore,
    EstStateHeight,
    EstStateAccBias,
    EstStateGyroBias,
    EstStateStdVel,
    EstStateStdTilt,
    EstStateStdAccBias,
    EstStateStdGyroBias,
    EstStateJump,
    EstStateDisagreement,
    EstStateImuHealth,
    EstStateCorrPos,
    EstStateCorrVel,
    EstStateCorrTilt,
    EstStateCorrAccBias,
    EstStateCorrGyroBias>;

}  // namespace tetap::can
