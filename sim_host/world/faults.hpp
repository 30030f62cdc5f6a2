// SPDX-License-Identifier: Apache-2.0
// Faults of the world, by name: `--fault NAME[@START[+DURATION]]`, seconds from the start of the run.
#pragma once

#include "tetap/base/time.hpp"

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace tetap::sim {

enum class Fault : std::uint8_t {
  kGnssJump,
  kGnssRamp,
  kGnssOutage,
  kGnssFrozen,
  kGnssWrongHeight,
  kSlipLeft,
  kSlipRight,
  kWheelStuck,
  kEncoderDropout,
  kImuStuck,
  kImuClipping,
  kGyroBiasStep,
  kLandmarkWrongId,
  kLandmarkOutlier,
  kStaleStamps,
  kFutureStamps,
  kClockJump,
  kLostFrames,
  kKidnapped,
  kGnssFar,
  kWheelSpin,
  kVibration,
  kMagDisturbance,
  kMovingStart,
  kLidarCovered,
  kLidarGlass,
  kLidarMirrored,
  kLidarTurned,
  kLidarLate,
  kLorry,
  kMovingFeatures,
  kTracksSwapped,
  kImagesLost,
  kImagesLate,
  kImagesMirrored,
  kImagesTurned,
  kFocalLength,
  kImageStamps,
};

/// The sensor a fault falls on: without it, the fault is none.
enum class FallsOn : std::uint8_t { kAny, kImu, kWheels, kGnss, kLandmarks, kMagnetometer, kLidar, kFeatures };

struct FaultInfo {
  Fault fault;
  FallsOn falls_on;
  std::string_view name;
  double start_s;     ///< unless the command line gives another time
  double duration_s;  ///< 0: an instant
  std::string_view what;
};

/// Magnitudes of the faults, where a description states one.
struct FaultNumbers {
  static constexpr double kJump_m = 100;                ///< to the east
  static constexpr double kRamp_mps = 1;                ///< to the north
  static constexpr double kHeight_m = 47;               ///< the geoid left out or counted twice
  static constexpr double kSpin_mps = 1;                ///< speed of the wheel's rim, on top of its rolling
  static constexpr std::int64_t kDropout_us = 100'000;  ///< contact lost for this long, then back for as long
  static constexpr double kClipVibration_mps2 = 60;
  static constexpr double kClipVibration_radps = 12;
  static constexpr double kGyroStep_radps = 0.02;
  static constexpr double kOutlierShare = 0.5;
  static constexpr double kOutlierRange_m[2] = {2, 6};
  static constexpr double kOutlierBearing_rad = 0.5;
  static constexpr std::int64_t kStale_us = 400'000;
  static constexpr std::int64_t kFuture_us = 400'000;
  static constexpr std::int64_t kClockJump_us = 3'000'000;
  static constexpr double kLossShare = 0.2;
  static constexpr double kKidnapped_m = 8;  ///< along the course
  static constexpr std::int64_t kFarSilent_us = 211'000'000;
  static constexpr int kFarFixes = 105;
  static constexpr double kFar_m = 800;        ///< to the west
  static constexpr double kFreeWheel_mps = 2;  ///< speed of the rim, on top of its rolling
  static constexpr double kShake_mps2 = 20;    ///< amplitude, within the ranges
  static constexpr double kShake_radps = 1;
  static constexpr double kIron_uT = 30;  ///< towards east: a steel door, a car
  static constexpr std::int64_t kScanLate_us = 100'000, kImageStamp_us = 100'000;  ///< stamps behind the truth
  static constexpr double kLidarTurned_rad = 1.5707963267948966;                   ///< anticlockwise
  static constexpr double kLorry_m = 3, kLorry_mps = 1.5;  ///< ahead of the camera; against it, to the right
  static constexpr double kMovingAhead_m = 6;              ///< likewise, of the body with a share of the features
  static constexpr double kMovingShare = 0.3;
  static constexpr double kFocalScale = 1.2;
  static constexpr std::int64_t kImageLate_us = 150'000;
};

[[nodiscard]] std::span<const FaultInfo> fault_table();
[[nodiscard]] const FaultInfo& info(Fault fault);
/// One line per fault, for --help.
[[nodiscard]] std::string fault_help();

struct FaultSetting {
  Fault fault;
  base::Micros start;
  base::Micros duration;
};

struct FaultsParsed {
  std::vector<FaultSetting> settings;
  std::string error;  ///< empty: all understood
};

/// `NAME[@START[+DURATION]]`, several separated by commas; an empty text is no fault.
[[nodiscard]] FaultsParsed parse_faults(std::string_view text);

/// Decimal seconds from 0 to 1e6, the whole of the text, down to the microsecond; empty for anything else.
[[nodiscard]] std::optional<base::Micros> parse_seconds(std::string_view text);
/// The same as `parse_seconds` reads it.
[[nodiscard]] std::string seconds_text(base::Micros span);

/// The same as `parse_faults` reads it.
[[nodiscard]] std::string text_of(const FaultSetting& setting);

/// The faults of a run; times count from its start.
class Faults {
 public:
  Faults() = default;
  explicit Faults(std::vector<FaultSetting> settings) : settings_{std::move(settings)} {}

  void add(const FaultSetting& setting) { settings_.push_back(setting); }
  /// Within [start, start + duration).
  [[nodiscard]] bool active(Fault fault, base::Micros at) const { return since(fault, at).has_value(); }
  /// Time since the fault began; empty while it is off.
  [[nodiscard]] std::optional<base::Micros> since(Fault fault, base::Micros at) const;
  /// True for exactly one of a sequence of adjoining intervals (before, now]: where the fault starts.
  [[nodiscard]] bool starts(Fault fault, base::Micros before, base::Micros now) const;

 private:
  std::vector<FaultSetting> settings_;
};

}  // namespace tetap::sim
