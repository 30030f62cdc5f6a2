// SPDX-License-Identifier: Apache-2.0
#include "sim_host/doctor/force.hpp"

#include <cmath>
#include <numbers>

namespace tetap::doctor {
namespace {

constexpr double kGravity_mps2 = 9.80665;
constexpr int kLeastWindows = 5;
constexpr double kUnit = 1.25;         ///< a factor is recognised within that ratio
constexpr double kMostMean = 3;        ///< no robot feels more than that many g on average
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
}

void ForceDetector::finish(Findings& findings) {
  if (windows_ < kLeastWindows) return;
  const double mean = magnitude_sum_ / windows_, share = mean / kGravity_mps2;
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
  } else if (share > kMostMean) {
    const double increment = increment_sum_mps_ / samples_;
    findings.push_back({.code = Code::kRatesForIncrements,
                        .uses = kAccelerometer,
                        .evidence = text("A sample's velocity increment is %.2f m/s on average, where gravity alone "
                                         "gives %.3f m/s: a mean specific force of %.0f m/s2.",
                                         increment, increment / share, mean)});
  }
  judge_direction(findings);
}

void ForceDetector::judge_direction(Findings& findings) const {
  if (norm(force_sum_) < kOneDirection * magnitude_sum_) return;
  const Vector3 up = unit(force_sum_);
  if (!robot_.up_s && (!robot_.name.empty() || std::abs(up[2]) < kAlongAxis)) return;
  const double upward = robot_.up_s ? dot(*robot_.up_s, up) : up[2];
  if (upward > kTilt) return;
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
                  axes, body[0], body[1], body[2], std::acos(upward) * 180 / std::numbers::pi)});
    return;
  }
  findings.push_back(
      {.code = Code::kImuAxes,
       .uses = kMounting,
       .evidence = text("The mean specific force in %s axes is (%.1f, %.1f, %.1f) m/s2: %.0f deg from where up is "
                        "stated.",
                        axes, body[0], body[1], body[2], std::acos(upward) * 180 / std::numbers::pi)});
}

}  // namespace tetap::doctor
