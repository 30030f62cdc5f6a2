// SPDX-License-Identifier: Apache-2.0
// The DBC's words for enum values and messages, for CSV files and error messages. Judge: the tests read them from
// config/tetap.dbc.
#pragma once

#include "tetap/bus/messages.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace tetap::sim {

/// The name of a code; "?" for one that has none.
template <std::size_t kCount, class Code>
[[nodiscard]] constexpr std::string_view named(const std::array<std::string_view, kCount>& names, Code code) {
  const auto i = static_cast<std::size_t>(code);
  return i < kCount ? names[i] : "?";
}

[[nodiscard]] constexpr std::string_view name(sensor::Sensor value) {
  constexpr std::array<std::string_view, 14> kNames{
      "Imu",          "WheelCounts", "WheelSpeed", "BodySpeed", "RangeBearing", "GnssPosition", "GnssVelocity",
      "Magnetometer", "Barometer",   "Heading",    "Closure",   "Feature",      "Scan",         "RelativePose"};
  return value == sensor::Sensor::kNotAvailable ? "NotAvailable" : named(kNames, value);
}
[[nodiscard]] constexpr std::string_view name(sensor::Verdict value) {
  constexpr std::array<std::string_view, 13> kNames{
      "Accepted", "Rejected",    "NotUsed",   "TooLate", "UnknownLandmark", "Singular", "NotFinite",
      "Stale",    "NewLandmark", "Ambiguous", "NoRoom",  "Pending",         "Outlier"};
  return named(kNames, value);
}
[[nodiscard]] constexpr std::string_view name(sensor::Mode value) {
  constexpr std::array<std::string_view, 10> kNames{"Boot",          "WaitingForPose", "Aligning", "Nominal",
                                                    "DeadReckoning", "Degraded",       "Fault",    "WaitingForImu",
                                                    "Levelling",     "FindingHeading"};
  return named(kNames, value);
}
[[nodiscard]] constexpr std::string_view name(sensor::ResetCause value) {
  constexpr std::array<std::string_view, 12> kNames{"PowerOn",   "Command",       "SetPose",       "TimeJump",
                                                    "NotFinite", "NotPositive",   "PositionJump",  "HeadingWrong",
                                                    "Diverged",  "BarometerZero", "MagneticField", "NewOrigin"};
  return named(kNames, value);
}
[[nodiscard]] constexpr std::string_view name(sensor::EstimatorKind value) {
  constexpr std::array<std::string_view, 15> kNames{"None",     "Odometry",  "Ekf",      "Kf",     "Ukf",
                                                    "Particle", "Inertial",  "Attitude", "Grid",   "EkfSlam",
                                                    "FastSlam", "PoseGraph", "Msckf",    "Fusion", "ScanOdometry"};
  return named(kNames, value);
}

[[nodiscard]] constexpr std::string_view name(bus::GraphStatus value) {
  constexpr std::array<std::string_view, 5> kNames{"None", "Converged", "NotConverged", "Singular", "NoRoom"};
  return named(kNames, value);
}
[[nodiscard]] constexpr std::string_view name(bus::FaultRow value) {
  constexpr std::array<std::string_view, 14> kNames{
      "ImuGyroX",  "ImuGyroY", "ImuGyroZ",    "ImuAccelX",    "ImuAccelY", "ImuAccelZ",    "GnssEast",
      "GnssNorth", "GnssUp",   "GnssVelEast", "GnssVelNorth", "GnssVelUp", "SpeedForward", "Heading"};
  return value == bus::FaultRow::kNone ? "None" : named(kNames, value);
}
/// As a text prints it.
[[nodiscard]] constexpr std::string_view unit(bus::FaultUnit value) {
  constexpr std::array<std::string_view, 5> kUnits{"rad/s", "m/s2", "m", "m/s", "rad"};
  const auto i = static_cast<std::size_t>(value);
  return i < kUnits.size() ? kUnits[i] : "";
}
[[nodiscard]] constexpr std::string_view name(sensor::SourceState value) {
  constexpr std::array<std::string_view, 5> kNames{"Stopped", "Confirming", "Fusing", "Rejecting", "Distrusted"};
  return named(kNames, value);
}
[[nodiscard]] constexpr std::string_view name(sensor::Check value) {
  constexpr std::array<std::string_view, 12> kNames{"None",  "Value",   "Gate", "Drift",       "Frozen", "Stuck",
                                                    "Field", "Heading", "Slip", "Unconfirmed", "Trust",  "Time"};
  return named(kNames, value);
}

[[nodiscard]] constexpr std::string_view name(bus::LandmarkState value) {
  constexpr std::array<std::string_view, 3> kNames{"Tentative", "Kept", "Frozen"};
  return named(kNames, value);
}

/// Name of a frame that the node sends, by its place in the node's block.
[[nodiscard]] inline std::string message_name(std::uint32_t offset) {
  constexpr std::array<std::string_view, 8> kCommon{"Est_Epoch",      "Est_StateCrc", "Est_Status",  "Est_Innov",
                                                    "Est_SensorStat", "Est_Diag",     "Est_Version", "Est_Origin"};
  if (offset >= bus::EstEpoch::kOffset && offset < bus::EstEpoch::kOffset + kCommon.size())
    return std::string(kCommon[offset - bus::EstEpoch::kOffset]);
  if (offset >= bus::EstPos::kOffset && offset < bus::EstPos::kOffset + bus::EstPos::kStride * bus::EstPos::kCount) {
    const std::uint32_t within = (offset - bus::EstPos::kOffset) % bus::EstPos::kStride;
    const std::string prefix = "Est" + std::to_string((offset - bus::EstPos::kOffset) / bus::EstPos::kStride) + "_";
    if (within == 0) return prefix + "Pos";
    if (within == bus::EstMotion::kOffset - bus::EstPos::kOffset) return prefix + "Motion";
    if (within == bus::EstAtt::kOffset - bus::EstPos::kOffset) return prefix + "Att";
    if (within == bus::EstVel::kOffset - bus::EstPos::kOffset) return prefix + "Vel";
    if (within == bus::EstStateHeight::kOffset - bus::EstPos::kOffset) return prefix + "State";
    if (within == bus::EstStdPose::kOffset - bus::EstPos::kOffset) return prefix + "Std";
  }
  if (offset == bus::EstLandmark::kOffset) return "Est_Landmark";
  if (offset == bus::EstLandmarkStd::kOffset) return "Est_LandmarkStd";
  if (offset == bus::EstKeyframe::kOffset) return "Est_Keyframe";
  if (offset == bus::EstKeyframePose::kOffset) return "Est_KeyframePose";
  if (offset == bus::EstGraph::kOffset) return "Est_Graph";
  return "offset " + std::to_string(offset);
}

}  // namespace tetap::sim
