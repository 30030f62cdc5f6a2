// SPDX-License-Identifier: Apache-2.0
#include "sim_host/doctor/force.hpp"

#include "sim_host/doctor/remedy.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tetap::doctor {
namespace {

constexpr double kGravity_mps2 = 9.80665;
constexpr int kLeastWindows = 5;
constexpr double kUnit = 1.1;          ///< a factor is recognised within that ratio: a range wrong by 8 is no unit
constexpr double kRate_mps = 4;        ///< mean increment: a rate of gravity alone, or one cut off at 5.24 m/s
constexpr double kMostMean = 3;        ///< no robot feels more than that many g on average
constexpr double kScale = 1.08;        ///< biases of accelerometers reach 5 % of gravity
constexpr double kBin = 0.01;          ///< width of a bin of the logarithm
constexpr double kShareError = 0.05;   ///< lost samples: less than the scale that is named
constexpr double kOneDirection = 0.7;  ///< share of the magnitude: less, and the sensor was turned over in the log
constexpr double kTilt = 0.7;          ///< cosine of 45 degrees: no mounting is stated worse, no ground is steeper
constexpr double kAlongAxis = 0.9;     ///< without a robot, an IMU that lies flat is taken to be meant so

bool near(double value, double expected) { return value > expected / kUnit && value < expected * kUnit; }

}  // namespace

void ForceDetector::sample(base::Micros, const sensor::Sample& sample) {
  if (!sensor::is_imu(sample, robot_.imu)) return;
  const auto& dv = sample.payload.imu.dvelocity_b_mps;
  increment_sum_mps_ += norm({static_cast<double>(dv[0]), static_cast<double>(dv[1]), static_cast<double>(dv[2])});
  ++samples_;
}

void ForceDetector::window(const Window& w) {
  if (!w.force_s_mps2) return;
  ++windows_;
  magnitude_sum_ += norm(*w.force_s_mps2);
  force_sum_ = sum(force_sum_, *w.force_s_mps2);
  if (std::abs(w.imu_share - 1) > kShareError) return;
  const double bin = std::log(norm(*w.force_s_mps2) / kGravity_mps2) / kBin + kBins / 2.0;
  ++magnitudes_[static_cast<std::size_t>(std::clamp(bin, 0.0, kBins - 1.0))];
  ++whole_windows_;
}

void ForceDetector::finish(Findings& findings) {
  if (windows_ < kLeastWindows) return;
  const double mean = magnitude_sum_ / windows_, share = mean / kGravity_mps2;
  const double increment = increment_sum_mps_ / samples_;
  if (near(share, 1 / kGravity_mps2)) {
    findings.push_back(
        {.code = Code::kGForMps2,
         .uses = kAccelerometer,
         .evidence = text("The mean specific force is %.3f m/s2 over %d s, gravity is 9.81 m/s2.", mean, windows_)});
  } else if (near(share, kGravity_mps2)) {
    findings.push_back(
        {.code = Code::kGForMps2,
         .uses = kAccelerometer,
         .evidence = text("The mean specific force is %.1f m/s2 over %d s, gravity is 9.81 m/s2: a factor "
                          "of 9.8 too much.",
                          mean, windows_),
         .change = "Multiply the accelerometer's values by 9.80665 once only."});
  } else if (share > kMostMean && increment > kRate_mps) {
    findings.push_back({.code = Code::kRatesForIncrements,
                        .uses = kAccelerometer,
                        .evidence = text("A sample's velocity increment is %.2f m/s on average, where gravity alone "
                                         "gives %.3f m/s: a mean specific force of %.0f m/s2.",
                                         increment, increment / share, mean)});
  } else {
    judge_scale(findings);
  }
  judge_direction(findings);
}

void ForceDetector::judge_scale(Findings& findings) const {
  if (whole_windows_ < kLeastWindows) return;
  std::uint32_t below = 0;
  std::size_t middle = 0;
  while ((below += magnitudes_[middle]) * 2 < whole_windows_) ++middle;
  const double share = std::exp((static_cast<double>(middle) + 0.5 - kBins / 2.0) * kBin);
  if (share < kScale && share > 1 / kScale) return;
  findings.push_back(
      {.code = Code::kAccelScale,
       .uses = kAccelerometer,
       .evidence = text("The median of the specific force is %.2f m/s2 over %u s, gravity is 9.81 m/s2.",
                        share * kGravity_mps2, whole_windows_),
       .change = text("Multiply the accelerometer's values by %.3f, or set the sensitivity that belongs to its "
                      "full-scale range.",
                      1 / share)});
}

std::optional<double> ForceDetector::upward() const {
  if (windows_ < kLeastWindows || norm(force_sum_) < kOneDirection * magnitude_sum_) return std::nullopt;
  const Vector3 up = unit(force_sum_);
  if (!robot_.up_s && (!robot_.name.empty() || std::abs(up[2]) < kAlongAxis)) return std::nullopt;
  return robot_.up_s ? dot(*robot_.up_s, up) : up[2];
}

/// An IMU is turned over about its forward axis or about its left one; gravity is the same for both.
std::vector<Remedy> ForceDetector::upright() const {
  if (robot_.mounting) {
    const auto& [x, y, z] = *robot_.mounting;
    const Vector3 down = scaled(-1, z);
    return {mounting({x, scaled(-1, y), down}), mounting({scaled(-1, x), y, down})};
  }
  if (!robot_.up_s) return {};
  const Vector3 up = *robot_.up_s;
  return {{{.path = "gyro.up_s", .values = {-up[0], -up[1], -up[2]}}}};
}

void ForceDetector::judge_direction(Findings& findings) const {
  const auto stated = upward();
  if (!stated || *stated > kTilt) return;
  const double upward = *stated;
  const Vector3 mean = scaled(1.0 / windows_, force_sum_);
  const Vector3 body = robot_.mounting ? rotated(*robot_.mounting, mean) : mean;
  const char* axes = robot_.mounting ? "the robot's" : "the sensor's";
  if (upward < -kTilt) {
    findings.push_back(
        {.code = Code::kImuUpsideDown,
         .uses = kMounting,
         .evidence =
             text("The mean specific force in %s axes is (%.1f, %.1f, %.1f) m/s2: it points down, %.0f deg from "
                  "where up is stated.",
                  axes, body[0], body[1], body[2], std::acos(upward) * 180 / std::numbers::pi),
         .remedies = upright()});
    return;
  }
  findings.push_back(
      {.code = Code::kImuAxes,
       .uses = kMounting,
       .evidence = text("The mean specific force in %s axes is (%.1f, %.1f, %.1f) m/s2: %.0f deg from where up is "
                        "stated.",
                        axes, body[0], body[1], body[2], std::acos(upward) * 180 / std::numbers::pi),
       .remedies =
           robot_.mounting ? std::vector<Remedy>{levelled(*robot_.mounting, unit(mean))} : std::vector<Remedy>{}});
}

}  // namespace tetap::doctor
