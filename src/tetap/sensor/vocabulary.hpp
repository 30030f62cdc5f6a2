// SPDX-License-Identifier: Apache-2.0
// Words that estimators, checks and the bus share: sensors, verdicts, modes, faults. The bus sends the numbers as they
// stand here; the generated messages are held against them when they are compiled.
#pragma once

#include <cstdint>

namespace tetap::sensor {

/// Kinds of input, in the order in which samples of one stamp are fused.
enum class Sensor : std::uint8_t {
  kImu = 0,
  kWheelCounts = 1,
  kWheelSpeed = 2,
  kBodySpeed = 3,
  kRangeBearing = 4,
  kGnssPosition = 5,
  kGnssVelocity = 6,
  kMagnetometer = 7,
  kBarometer = 8,
  kHeading = 9,
  kClosure = 10,
  kFeature = 11,  ///< an image: all features of one moment
  kScan = 12,
  kRelativePose = 13,
  kNotAvailable = 15,
};

/// Fate of one measurement.
enum class Verdict : std::uint8_t {
  kAccepted = 0,
  kRejected = 1,  ///< the measurement failed a gate or a check
  kNotUsed = 2,
  kTooLate = 3,          ///< the stamp lies before the fusion window
  kUnknownLandmark = 4,  ///< the map has no landmark of this id
  kSingular = 5,         ///< the innovation covariance has no factor
  kNotFinite = 6,
  kStale = 7,        ///< the sensor repeats itself
  kNewLandmark = 8,  ///< the sighting began a landmark of the own map
  kAmbiguous = 9,    ///< more than one landmark, or neither a known nor surely a new one
  kNoRoom = 10,      ///< a new landmark, and the own map is full
  kPending = 11,     ///< kept until more measurements decide
  kOutlier = 12,     ///< possible by itself, not beside the others of its stamp
};

/// State of an estimator as a whole.
enum class Mode : std::uint8_t {
  kBoot = 0,
  kWaitingForPose = 1,
  kAligning = 2,
  kNominal = 3,
  kDeadReckoning = 4,
  kDegraded = 5,
  kFault = 6,
  kWaitingForImu = 7,
  kLevelling = 8,
  kFindingHeading = 9,
};

/// Cause of the last restart or step of an estimate.
enum class ResetCause : std::uint8_t {
  kPowerOn = 0,
  kCommand = 1,
  kSetPose = 2,
  kTimeJump = 3,
  kNotFinite = 4,
  kNotPositive = 5,
  kPositionJump = 6,
  kHeadingWrong = 7,
  kDiverged = 8,
  kBarometerZero = 9,
  kMagneticField = 10,
  kNewOrigin = 11,
};

/// Source of the map's origin.
enum class OriginSource : std::uint8_t { kNone = 0, kConfigured = 1, kFirstFix = 2 };

enum class EstimatorKind : std::uint8_t {
  kNone = 0,
  kOdometry = 1,
  kEkf = 2,
  kKf = 3,
  kUkf = 4,
  kParticle = 5,
  kInertial = 6,
  kAttitude = 7,
  kGrid = 8,
  kEkfSlam = 9,
  kFastSlam = 10,
  kPoseGraph = 11,
  kMsckf = 12,
  kFusion = 13,
  kScanOdometry = 14,
};

/// Bit numbers of the status' fault field.
enum class Fault : std::uint8_t {
  kInputStale = 0,
  kRejecting = 1,
  kIncomplete = 2,
  kTooLate = 3,
  kMalformed = 4,
  kCapacity = 5,
  kCommandRefused = 6,
  kRestarted = 7,
  kWheelSlip = 8,
  kImuClipped = 9,
  kVibration = 10,
  kSensorStuck = 11,
  kMagneticDisturbance = 12,
  kAttitudeDisagrees = 13,
  kOriginOutOfRange = 14,
  kIdConflict = 15,
};

}  // namespace tetap::sensor
