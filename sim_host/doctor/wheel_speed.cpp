// SPDX-License-Identifier: Apache-2.0
#include "sim_host/doctor/wheel_speed.hpp"

#include <cmath>

namespace tetap::doctor {
namespace {

constexpr double kWheelSpeedSlow_mps = 0.5;  ///< below, the magnitude of a GNSS velocity is noise
constexpr double kWheelSpeedLeastWindows = 20;
constexpr double kWheelSpeedScale =
    1.15;  ///< wheels, tyres and slip are within some percent; a wrong radius is a tenth and more
constexpr double kWheelSpeedFollows = 0.9;  ///< cosine between the two speeds: outages and spinning wheels lower it

}  // namespace

void WheelSpeedDetector::window(const Window& w) {
  if (!w.wheels || !w.velocity_n_mps) return;
  const double gnss = std::hypot((*w.velocity_n_mps)[0], (*w.velocity_n_mps)[1]);
  if (gnss < kWheelSpeedSlow_mps) return;
  speeds_.add({0.5 * std::abs(w.wheels->sum_mps), gnss});
}

void WheelSpeedDetector::finish(Findings& findings) {
  if (robot_.name.empty() || speeds_.count() < kWheelSpeedLeastWindows || speeds_.product(0, 0) <= 0) return;
  const double cosine = correlation(speeds_.product(0, 1), speeds_.product(0, 0), speeds_.product(1, 1));
  const double ratio = std::sqrt(speeds_.product(1, 1) / speeds_.product(0, 0));
  if (cosine < kWheelSpeedFollows || (ratio < kWheelSpeedScale && ratio > 1 / kWheelSpeedScale)) return;
  findings.push_back({.code = Code::kWheelScale,
                      .uses = kWheels | kGnssVelocity,
                      .certainty = cosine,
                      .evidence = text("The robot drives %.2f times as fast by GNSS as by its wheels over %.0f s.",
                                       ratio, speeds_.count()),
                      .change = text("Multiply the radii of wheels.drive by %.3f or divide counts_per_turn by it "
                                     "(In_BodySpeed: wheels.speed_scale).",
                                     ratio)});
}

}  // namespace tetap::doctor
