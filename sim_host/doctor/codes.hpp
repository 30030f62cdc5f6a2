// SPDX-License-Identifier: Apache-2.0
// The mistakes that the doctor names: one row a code. docs/reference/diagnoses.md is made from this table.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace tetap::doctor {

enum class Code : std::uint8_t {
  kMessageMissing,
  kTwoSenders,
  kStampsInMs,
  kStampsInS,
  kTwoClocks,
  kNoInSync,
  kReceiverLate,
  kDeadAxis,
  kRatesForIncrements,
  kGForMps2,
  kDegForRad,
  kWheelsReversed,
  kAccelSign,
  kGyroSign,
  kAccelScale,
  kWheelsSwapped,
  kWheelReversed,
  kImuUpsideDown,
  kImuAxes,
  kLatLonSwapped,
  kLatitudeSign,
  kLongitudeSign,
  kVelocityAxes,
  kFixUnit,
  kVelocityUnit,
  kWheelsUnequal,
  kWheelScale,
  kGyroScale,
  kTrackWidth,
  kAntennaArm,
  kScanMirrored,
  kScanTurned,
  kScanLate,
  kOriginFar,
  kCameraTurned,
  kCameraMirrored,
  kFocalLength,
  kImageStamps,
};

/// Devices whose data a mistake spoils; a comparison with a spoilt device gives no second finding.
enum Device : std::uint8_t {
  kNoDevice = 0,
  kGyroscope = 1,
  kAccelerometer = 2,
  kMounting = 4,
  kWheels = 8,
  kFixes = 16,
  kGnssVelocity = 32,
  kScanner = 64,
};
using Devices = std::uint8_t;

struct CodeRow {
  Code code;
  std::string_view name;      ///< as in doctor.json
  std::string_view cause;     ///< in plain words
  std::string_view evidence;  ///< the comparison that shows it
  std::string_view change;    ///< remedy
  Devices spoils;
};

/// In the order in which causes are ranked: an early one explains the traces that it leaves in later comparisons.
inline constexpr std::array kCodes{
    CodeRow{Code::kMessageMissing, "message_missing", "One message of a sample never comes, or its parts never match.",
            "The log has messages of a sample, and next to no whole sample.",
            "Send every message of the sample, with one Seq and, for GNSS, one Stamp.",
            kGyroscope | kAccelerometer | kFixes | kGnssVelocity},
    CodeRow{Code::kTwoSenders, "two_senders", "Two senders use one CAN identifier.",
            "Two counters of Seq run through the frames of one identifier and instance.",
            "Stop one sender, or give the second device another Inst.",
            kGyroscope | kAccelerometer | kWheels | kFixes | kGnssVelocity},
    CodeRow{Code::kStampsInMs, "stamps_in_ms", "Stamp or Interval counts milliseconds.",
            "The difference of stamps against the time of arrival.", "Send Stamp and Interval in microseconds.", 0},
    CodeRow{Code::kStampsInS, "stamps_in_s", "Stamp or Interval counts seconds, or stands still.",
            "The difference of stamps against the time of arrival.", "Send Stamp and Interval in microseconds.", 0},
    CodeRow{Code::kTwoClocks, "two_clocks", "The stamps of a device come from another clock.",
            "The age of its samples on arrival, by offset and by drift.",
            "Stamp by the clock that In_Sync distributes.", 0},
    CodeRow{Code::kNoInSync, "no_in_sync", "No In_Sync ties the stamps to a time.",
            "The age of all samples on arrival, in a log without In_Sync.",
            "Send In_Sync from the clock that stamps the samples.", 0},
    CodeRow{Code::kReceiverLate, "receiver_late", "The receiver's data are older than their stamps.",
            "The GNSS velocity against the wheels' speed before the stamp, where the speed changes.",
            "Stamp fixes and velocities with the time for which they hold.", 0},
    CodeRow{Code::kDeadAxis, "dead_axis", "One axis of the IMU is dead.",
            "The axis keeps one value while the other axes move.",
            "Check the sensor's register map and the sender's packing of that axis; a broken sensor is replaced.", 0},
    CodeRow{Code::kRatesForIncrements, "rates_for_increments", "The IMU's frames carry rates in place of increments.",
            "The mean specific force against gravity.",
            "Multiply turn rate and specific force by the interval before they are sent.",
            kGyroscope | kAccelerometer | kMounting},
    CodeRow{Code::kGForMps2, "g_for_mps2", "The specific force is in g.", "The mean specific force against gravity.",
            "Multiply the accelerometer's values by 9.80665.", kAccelerometer},
    CodeRow{Code::kDegForRad, "deg_for_rad", "The turn rate is in degrees.",
            "The gyroscope against wheels, course or magnetic field.", "Multiply the gyroscope's values by pi/180.",
            kGyroscope},
    CodeRow{Code::kWheelsReversed, "wheels_reversed", "Both wheels count backwards.",
            "The turn by the wheels against the gyroscope, and motion ahead against motion astern.",
            "Negate both wheels in the sender, or swap channels A and B of both encoders.", kWheels},
    CodeRow{Code::kAccelSign, "accel_sign", "An axis of the accelerometer, or all of them, has the wrong sign.",
            "Gravity, acceleration and curves by the accelerometer against the turns and speeds of other devices.",
            "Negate that axis of In_Imu0Accel in the sender.", kAccelerometer | kMounting},
    CodeRow{Code::kGyroSign, "gyro_sign", "An axis of the gyroscope, or all of them, has the wrong sign.",
            "The gyroscope against wheels, course, magnetic field and accelerometer.",
            "Negate that axis of In_Imu0Gyro in the sender.", kGyroscope | kMounting},
    CodeRow{Code::kAccelScale, "accel_scale", "The accelerometer's scale is wrong.",
            "The median of the specific force against gravity.",
            "Set the sensitivity that belongs to the accelerometer's full-scale range.", kAccelerometer},
    CodeRow{Code::kWheelsSwapped, "wheels_swapped", "Left and right wheel are swapped.",
            "The turn by the wheels against the gyroscope.", "Swap Left and Right in the sender, or the two plugs.",
            kWheels},
    CodeRow{Code::kWheelReversed, "wheel_reversed", "A wheel counts backwards.",
            "The turn by the gyroscope against the sum and the difference of the wheels.",
            "Negate that wheel in the sender, or swap the encoder's channels A and B.", kWheels},
    CodeRow{Code::kImuUpsideDown, "imu_upside_down", "The IMU is upside down.",
            "The mean specific force in the robot's axes.",
            "Turn the sensor, or set the rows of inertial.mounting_bs (planar robots: gyro.up_s). Axes forward, right, "
            "down (FRD, NED) look the same: negate Y and Z of gyroscope and accelerometer.",
            kMounting},
    CodeRow{Code::kImuAxes, "imu_axes", "The IMU's axes are not those that the robot states.",
            "The direction of gravity, and forces against acceleration and curves.",
            "Set inertial.mounting_bs (planar robots: gyro.up_s); tools/calibrate/calibrate_robot finds it.",
            kMounting},
    CodeRow{Code::kLatLonSwapped, "lat_lon_swapped", "Latitude and longitude are swapped.",
            "The path by the fixes against GNSS velocity, wheels and the robot's origin.",
            "Swap Lat of In_GnssLat and Lon of In_GnssLon in the sender.", kFixes},
    CodeRow{Code::kLatitudeSign, "latitude_sign", "The latitude has the wrong sign.",
            "The path by the fixes against GNSS velocity, wheels and the robot's origin.",
            "Send north as positive in In_GnssLat.", kFixes},
    CodeRow{Code::kLongitudeSign, "longitude_sign", "The longitude has the wrong sign.",
            "The path by the fixes against GNSS velocity, wheels and the robot's origin.",
            "Send east as positive in In_GnssLon.", kFixes},
    CodeRow{
        Code::kVelocityAxes, "velocity_axes", "The axes of the GNSS velocity are swapped or reversed.",
        "The integral of the velocity against the path by the fixes.",
        "Send East and North of In_GnssVelEN and Up of In_GnssVelU in these axes. A receiver in NED gives north first, "
        "and down for up.",
        kGnssVelocity},
    CodeRow{Code::kFixUnit, "fix_unit", "Degrees of the fixes are written in another form.",
            "The distance by the fixes against the GNSS velocity and the wheels, which agree.",
            "Send degrees with decimals: ddmm.mmmm is dd + mm.mmmm / 60.", kFixes},
    CodeRow{Code::kVelocityUnit, "velocity_unit", "The GNSS velocity is in another unit.",
            "The GNSS velocity against the distance by the fixes and the wheels, which agree.",
            "Send In_GnssVelEN and In_GnssVelU in m/s.", kGnssVelocity},
    CodeRow{Code::kWheelsUnequal, "wheels_unequal", "One wheel's radius or counts per turn is wrong.",
            "The turn by the gyroscope while the wheels drive ahead.",
            "Correct that wheel's radius of wheels.drive, or its counts in the sender.", kWheels},
    CodeRow{Code::kWheelScale, "wheel_scale", "The wheels' radius or counts per turn is wrong.",
            "The speed of the wheels against GNSS.",
            "Correct wheels.drive radii or counts_per_turn (In_BodySpeed: wheels.speed_scale).", kWheels},
    CodeRow{Code::kGyroScale, "gyro_scale", "The gyroscope's scale is wrong.",
            "The gyroscope against wheels, course or magnetic field.",
            "Set the sensitivity that belongs to the gyroscope's full-scale range.", kGyroscope},
    CodeRow{Code::kTrackWidth, "track_width", "The track width is wrong.",
            "The turn by the wheels against the gyroscope, and the gyroscope against other devices.",
            "Correct wheels.drive.track_m (In_BodySpeed: wheels.yaw_rate_scale).", kWheels},
    CodeRow{Code::kAntennaArm, "antenna_arm", "The antenna is not where the robot states it.",
            "The speed by GNSS in turns against the speed and the turn by wheels and gyroscope.",
            "Measure gnss.antenna_x_b_m and gnss.antenna_y_b_m from the body's origin.", 0},
    CodeRow{Code::kScanMirrored, "scan_mirrored",
            "Scans are mirrored: the scanner is upside down, or counts the wrong way.",
            "The turn between scans against wheels and gyroscope.",
            "Negate First and Step of In_ScanHead in the sender: most scanners turn clockwise, seen from above.",
            kScanner},
    CodeRow{Code::kScanTurned, "scan_turned", "The scanner is turned on its mount.",
            "The direction of the motion between scans while the wheels drive straight ahead.",
            "Set lidar.yaw_rad to the angle of the mount.", kScanner},
    CodeRow{Code::kScanLate, "scan_late", "Scans are older than their stamps.",
            "The turn between scans against wheels or gyroscope before the stamps.",
            "Stamp In_ScanHead with the time of the first beam, or set lidar.delay_us.", 0},
    CodeRow{Code::kOriginFar, "origin_far", "The robot's configured origin is far away.",
            "The distance of the fixes from gnss.origin.",
            "Set the origin of the site, or gnss.origin_configured = 0: the first fixes are the origin.", 0},
    CodeRow{Code::kCameraTurned, "camera_turned", "The camera is turned about its view.",
            "The turns by the images against the gyroscope, where the robot turns on its way.",
            "Turn the camera or its image, or set camera.mounting_bc.", 0},
    CodeRow{Code::kCameraMirrored, "camera_mirrored", "The camera's images are mirrored.",
            "The turns by the images against the gyroscope, and the half of the image that shows what is near.",
            "Switch off the mirror in the camera's driver, or send the width less U.", 0},
    CodeRow{Code::kFocalLength, "focal_length", "The camera's focal length is wrong.",
            "The turns by the images against the gyroscope.",
            "Set camera.fu_px and camera.fv_px for the size of image that is sent.", 0},
    CodeRow{Code::kImageStamps, "image_stamps", "The images are older than their stamps, or younger.",
            "The turns by the images against the gyroscope before and after the stamp.",
            "Stamp an image with the middle of its exposure, or set camera.delay_us.", 0},
};

[[nodiscard]] constexpr const CodeRow& row(Code code) { return kCodes[static_cast<std::size_t>(code)]; }

static_assert([] {
  for (std::size_t i = 0; i < kCodes.size(); ++i)
    if (kCodes[i].code != static_cast<Code>(i)) return false;
  return true;
}());

}  // namespace tetap::doctor
