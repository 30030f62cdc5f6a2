// SPDX-License-Identifier: Apache-2.0
#include "sim_host/doctor/dead_axis.hpp"

#include <bit>
#include <cmath>
#include <cstdint>

namespace tetap::doctor {
namespace {

constexpr double kLeast_s = 10;       ///< a filter in the sensor or a coarse resolution repeats values for less
constexpr double kLeastOthers = 200;  ///< samples in which another axis moved meanwhile
constexpr double kNeeded = 0.7;       ///< cosine: a planar robot takes the gyroscope's axis that points up alone
constexpr std::array<char, 3> kDeadAxisLetters{'X', 'Y', 'Z'};
constexpr float kMostAngle_rad = 0.524F, kMostVelocity_mps = 5.24F;  ///< In_Imu0Gyro, In_Imu0Accel: the largest value

}  // namespace

void DeadAxisDetector::add(Axes& axes, const std::array<float, 3>& values, float most, double time_s) {
  std::array<bool, 3> moved{};
  for (std::size_t i = 0; i < 3; ++i)
    moved[i] = std::bit_cast<std::uint32_t>(values[i]) != std::bit_cast<std::uint32_t>(axes[i].value) ||
               std::abs(values[i]) >= most;
  for (std::size_t i = 0; i < 3; ++i) {
    Axis& axis = axes[i];
    axis.value = values[i];
    if (moved[i]) {
      axis.since_s = time_s;
      axis.others = 0;
      continue;
    }
    if (moved[(i + 1) % 3] || moved[(i + 2) % 3]) ++axis.others;
    if (axis.others <= axis.most_others) continue;
    axis.most_others = axis.others;
    axis.longest_s = time_s - axis.since_s;
  }
}

void DeadAxisDetector::sample(base::Micros time, const sensor::Sample& sample) {
  if (!sensor::is_imu(sample, robot_.imu)) return;
  const double time_s = static_cast<double>(time.us) * 1e-6;
  if (!begun_)
    for (std::size_t i = 0; i < 3; ++i) gyroscope_[i].since_s = accelerometer_[i].since_s = time_s;
  begun_ = true;
  add(gyroscope_, sample.payload.imu.dangle_b_rad, kMostAngle_rad, time_s);
  add(accelerometer_, sample.payload.imu.dvelocity_b_mps, kMostVelocity_mps, time_s);
}

bool DeadAxisDetector::needed(std::size_t axis, Device device) const {
  if (robot_.name.empty() || robot_.mounting) return true;
  return device == kGyroscope && robot_.up_s && std::abs((*robot_.up_s)[axis]) > kNeeded;
}

void DeadAxisDetector::judge(const Axes& axes, const char* message, const char* signal, Device device,
                             Findings& findings) const {
  for (std::size_t i = 0; i < 3; ++i) {
    const Axis& axis = axes[i];
    if (axis.most_others < kLeastOthers || axis.longest_s < kLeast_s || !needed(i, device)) continue;
    findings.push_back({.code = Code::kDeadAxis,
                        .evidence = text("%s%c of %s kept one value for %.0f s, in which the other axes moved in %.0f "
                                         "samples.",
                                         signal, kDeadAxisLetters[i], message, axis.longest_s, axis.most_others),
                        .change = {},
                        .spoils = static_cast<Devices>(device | kMounting)});
  }
}

void DeadAxisDetector::finish(Findings& findings) {
  const auto imu = static_cast<unsigned>(robot_.imu);
  judge(gyroscope_, text("In_Imu%uGyro", imu).c_str(), "Ang", kGyroscope, findings);
  judge(accelerometer_, text("In_Imu%uAccel", imu).c_str(), "Vel", kAccelerometer, findings);
}

}  // namespace tetap::doctor
