// SPDX-License-Identifier: Apache-2.0
#include "sim_host/world/faults.hpp"

#include "sim_host/world/math.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

namespace tetap::sim {
namespace {

constexpr std::array kTable{
    FaultInfo{Fault::kGnssJump, FallsOn::kGnss, "gnss_jump", 60, 10,
              "GNSS position is 100 m too far east, accuracy figure unchanged"},
    FaultInfo{Fault::kGnssRamp, FallsOn::kGnss, "gnss_ramp", 60, 30, "GNSS position walks off to the north at 1 m/s"},
    FaultInfo{Fault::kGnssOutage, FallsOn::kGnss, "gnss_outage", 60, 30, "no GNSS message at all"},
    FaultInfo{Fault::kGnssFrozen, FallsOn::kGnss, "gnss_frozen", 60, 15,
              "GNSS repeats its last position and velocity with fresh stamps"},
    FaultInfo{Fault::kGnssWrongHeight, FallsOn::kGnss, "gnss_wrong_height", 60, 30,
              "GNSS height is 47 m too high (geoid counted twice)"},
    FaultInfo{Fault::kSlipLeft, FallsOn::kWheels, "slip_left", 70, 4,
              "left wheel spins: its rim runs 1 m/s faster than it rolls"},
    FaultInfo{Fault::kSlipRight, FallsOn::kWheels, "slip_right", 70, 4,
              "right wheel spins: its rim runs 1 m/s faster than it rolls"},
    FaultInfo{Fault::kWheelStuck, FallsOn::kWheels, "wheel_stuck", 70, 5,
              "left wheel is blocked and dragged: its counter stands still"},
    FaultInfo{Fault::kEncoderDropout, FallsOn::kWheels, "encoder_dropout", 70, 10,
              "right encoder loses contact: counts of every other 100 ms are missing"},
    FaultInfo{Fault::kImuStuck, FallsOn::kImu, "imu_stuck", 60, 10, "IMU repeats its last sample with fresh stamps"},
    FaultInfo{Fault::kImuClipping, FallsOn::kImu, "imu_clipping", 60, 5,
              "vibration of 60 m/s^2 and 12 rad/s drives the IMU into its limits (counted in the clip fields)"},
    FaultInfo{Fault::kGyroBiasStep, FallsOn::kImu, "gyro_bias_step", 60, 40,
              "gyro bias about the vertical axis steps by 0.02 rad/s"},
    FaultInfo{Fault::kLandmarkWrongId, FallsOn::kLandmarks, "landmark_wrong_id", 60, 15,
              "sightings carry the id of another landmark (neighbours swapped)"},
    FaultInfo{Fault::kLandmarkOutlier, FallsOn::kLandmarks, "landmark_outlier", 60, 20,
              "half of the sightings are 2 to 6 m and up to 0.5 rad off"},
    FaultInfo{Fault::kStaleStamps, FallsOn::kAny, "stale_stamps", 60, 5,
              "stamps of all sensors are 400 ms older than their data"},
    FaultInfo{Fault::kFutureStamps, FallsOn::kAny, "future_stamps", 60, 5,
              "stamps of all sensors are 400 ms ahead of their data"},
    FaultInfo{Fault::kClockJump, FallsOn::kAny, "clock_jump", 60, 20,
              "the clock of the bus (stamps and sync) jumps 3 s ahead, and back at the end"},
    FaultInfo{Fault::kLostFrames, FallsOn::kAny, "lost_frames", 60, 20,
              "each frame is lost with a probability of 20 %"},
    FaultInfo{Fault::kKidnapped, FallsOn::kAny, "kidnapped", 20, 0,
              "rover is set down 8 m further along its course, unseen by wheels and IMU"},
    FaultInfo{Fault::kGnssFar, FallsOn::kGnss, "gnss_far", 60, 232,
              "no GNSS for 211 s, then 105 fixes 800 m too far west with an unchanged accuracy figure"},
    FaultInfo{Fault::kWheelSpin, FallsOn::kWheels, "wheel_spin", 70, 5,
              "right wheel spins on ice: its rim runs 2 m/s faster than it rolls"},
    FaultInfo{Fault::kVibration, FallsOn::kImu, "vibration", 60, 20,
              "a loose mount shakes the IMU with 20 m/s^2 and 1 rad/s at 97 Hz, within its ranges"},
    FaultInfo{Fault::kMagDisturbance, FallsOn::kMagnetometer, "mag_disturbance", 60, 20,
              "steel beside the way: 30 uT towards east on top"},
    FaultInfo{Fault::kMovingStart, FallsOn::kAny, "moving_start", 0, 30,
              "no sensor speaks; where it begins at 0, no start pose is told either: a start in motion"},
    FaultInfo{Fault::kLidarCovered, FallsOn::kLidar, "lidar_covered", 60, 10,
              "something covers the scanner: scans come, no beam returns"},
    FaultInfo{Fault::kLidarGlass, FallsOn::kLidar, "lidar_glass", 60, 20,
              "every wall is glass: beams are lost, or return from behind it"},
    FaultInfo{Fault::kLidarMirrored, FallsOn::kLidar, "lidar_mirrored", 60, 30,
              "scans are mirrored: left is right, as of a scanner upside down"},
    FaultInfo{Fault::kLidarTurned, FallsOn::kLidar, "lidar_turned", 60, 30,
              "the scanner has turned on its mount by 90 deg anticlockwise"},
    FaultInfo{Fault::kLidarLate, FallsOn::kLidar, "lidar_late", 60, 30,
              "scans are stamped 100 ms after their first beam"},
    FaultInfo{Fault::kLorry, FallsOn::kFeatures, "lorry", 60, 10,
              "an endless lorry passes 3 m ahead at 1.5 m/s and fills the image"},
    FaultInfo{Fault::kMovingFeatures, FallsOn::kFeatures, "moving_features", 60, 30,
              "30 % of the features are on a body that moves 6 m ahead at 1.5 m/s"},
    FaultInfo{Fault::kTracksSwapped, FallsOn::kFeatures, "tracks_swapped", 60, 20,
              "in every other image neighbours in the list have exchanged their tracks"},
    FaultInfo{Fault::kImagesLost, FallsOn::kFeatures, "images_lost", 60, 20,
              "half of the images do not come, and a frame is missing in half of the others"},
    FaultInfo{Fault::kImagesLate, FallsOn::kFeatures, "images_late", 60, 20, "images arrive 150 ms later"},
    FaultInfo{Fault::kImagesMirrored, FallsOn::kFeatures, "images_mirrored", 60, 30, "left is right in the image"},
    FaultInfo{Fault::kImagesTurned, FallsOn::kFeatures, "images_turned", 60, 30,
              "the image is turned by 90 deg clockwise about its principal point"},
    FaultInfo{Fault::kFocalLength, FallsOn::kFeatures, "focal_length", 60, 30,
              "the focal length is 20 % longer than it should be"},
    FaultInfo{Fault::kImageStamps, FallsOn::kFeatures, "image_stamps", 60, 30,
              "images are stamped 100 ms after their exposure"},
};

std::string names() {
  std::string all;
  for (const auto& row : kTable) (all += all.empty() ? "" : " ") += row.name;
  return all;
}

base::Micros micros(double seconds) { return {static_cast<std::int64_t>(sim::floor(seconds * 1e6 + 0.5))}; }

}  // namespace

std::span<const FaultInfo> fault_table() { return kTable; }

const FaultInfo& info(Fault fault) {
  return *std::find_if(kTable.begin(), kTable.end(), [fault](const FaultInfo& row) { return row.fault == fault; });
}

std::string fault_help() {
  std::string text;
  for (const auto& row : kTable) {
    std::array<char, 64> line{};
    std::snprintf(line.data(), line.size(), "  %-18.*s @%g+%g", static_cast<int>(row.name.size()), row.name.data(),
                  row.start_s, row.duration_s);
    std::string padded{line.data()};
    padded.resize(std::max<std::size_t>(padded.size(), 30), ' ');
    text += padded + "  " + std::string{row.what} + "\n";
  }
  return text;
}

FaultsParsed parse_faults(std::string_view text) {
  FaultsParsed parsed;
  while (!text.empty()) {
    const std::string_view one = text.substr(0, text.find(','));
    text.remove_prefix(std::min(text.size(), one.size() + 1));
    const auto complain = [&](const std::string& why) {
      return FaultsParsed{.settings = {}, .error = "fault '" + std::string{one} + "': " + why};
    };
    const auto at = one.find('@');
    const std::string_view name = one.substr(0, at);
    const auto row = std::find_if(kTable.begin(), kTable.end(), [name](const FaultInfo& r) { return r.name == name; });
    if (row == kTable.end()) return complain("unknown name; known are: " + names());
    FaultSetting setting{row->fault, micros(row->start_s), micros(row->duration_s)};
    if (at != std::string_view::npos) {
      const std::string_view when = one.substr(at + 1);
      const auto plus = when.find('+');
      const auto start = parse_seconds(when.substr(0, plus));
      if (!start) return complain("START is not a number of seconds; the form is NAME[@START[+DURATION]]");
      setting.start = *start;
      if (plus != std::string_view::npos) {
        const auto duration = parse_seconds(when.substr(plus + 1));
        if (!duration) return complain("DURATION is not a number of seconds; the form is NAME[@START[+DURATION]]");
        if (duration->us == 0 && row->duration_s > 0) return complain("a DURATION of 0 is no fault");
        setting.duration = *duration;
      }
    }
    parsed.settings.push_back(setting);
  }
  return parsed;
}

std::optional<base::Micros> parse_seconds(std::string_view text) {
  constexpr std::int64_t kMost_us = 1'000'000'000'000;
  std::int64_t us = 0, unit_us = 1'000'000;
  bool point = false, any = false;
  for (const char c : text) {
    if (c == '.' && !point) {
      point = true;
      continue;
    }
    if (c < '0' || c > '9') return std::nullopt;
    any = true;
    if (point)
      us += (c - '0') * (unit_us /= 10);  // below a microsecond: nothing
    else
      us = 10 * us + (c - '0') * unit_us;
    if (us > kMost_us) return std::nullopt;
  }
  return any ? std::optional(base::Micros{us}) : std::nullopt;
}

std::string seconds_text(base::Micros span) {
  const std::string fraction = std::to_string(1'000'000 + span.us % 1'000'000);
  return std::to_string(span.us / 1'000'000) + "." + fraction.substr(1);
}

std::string text_of(const FaultSetting& setting) {
  const std::string start = std::string(info(setting.fault).name) + "@" + seconds_text(setting.start);
  return setting.duration.us > 0 ? start + "+" + seconds_text(setting.duration) : start;
}

std::optional<base::Micros> Faults::since(Fault fault, base::Micros at) const {
  for (const auto& s : settings_)
    if (s.fault == fault && at >= s.start && at < s.start + s.duration) return at - s.start;
  return std::nullopt;
}

bool Faults::starts(Fault fault, base::Micros before, base::Micros now) const {
  return std::any_of(settings_.begin(), settings_.end(),
                     [=](const FaultSetting& s) { return s.fault == fault && s.start > before && s.start <= now; });
}

}  // namespace tetap::sim
