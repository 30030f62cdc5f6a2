// SPDX-License-Identifier: Apache-2.0
#include "sim_host/doctor/wheel_speed.hpp"

#include <cmath>

namespace tetap::doctor {
namespace {

constexpr double kWheelSpeedSlow_mps = 0.5;  ///< below, the magnitude of a GNSS velocity is noise
constexpr double kWheelSpeedLeastWindows = 20;
constexpr double kWheelSpeedFollows = 0.9;  ///< cosine between the two speeds: outages and spinning wheels lower it

}  // namespace

void WheelSpeedDetector::window(const Window& w) {
  if (!w.wheels || !w.velocity_n_mps) return;
  const double gnss = std::hypot((*w.velocity_n_mps)[0], (*w.velocity_n_mps)[1]);
  if (gnss < kWheelSpeedSlow_mps) return;
  speeds_.add({0.5 * std::abs(w.wheels->sum_mps), gnss});
}

std::optional<SpeedRatio> WheelSpeedDetector::ratio() const {
  if (robot_.name.empty() || speeds_.count() < kWheelSpeedLeastWindows || speeds_.product(0, 0) <= 0)
    return std::nullopt;
  const double cosine = correlation(speeds_.product(0, 1), speeds_.product(0, 0), speeds_.product(1, 1));
  if (cosine < kWheelSpeedFollows) return std::nullopt;
  const double ratio = std::sqrt(speeds_.product(1, 1) / speeds_.product(0, 0));
  return SpeedRatio{.value = ratio,
                    .certainty = cosine,
                    .evidence = text("The robot drives %.2f times as fast by GNSS as by its wheels over %.0f s.", ratio,
                                     speeds_.count())};
}

}  // namespace tetap::doctor
