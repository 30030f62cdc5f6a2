// SPDX-License-Identifier: Apache-2.0
// Wheels that turn the body otherwise than its gyroscope are refuted within ten seconds of driving a curve. Wheels that
// skid, slip or drift are not. Truth is the drive's own speed and turn.
#include "tetap/checks/wheel_turn.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <utility>

namespace tetap::checks {
namespace {

constexpr double kTrackWidth_m = 0.5;

struct Rims {
  double left_mps, right_mps;
};
using Wiring = std::function<Rims(Rims)>;

/// Seconds of driving until the wheels are refuted; `limit_s` when they never are. The course goes straight and turns
/// left and right by up to `turn_radps`; wheels count whole steps of 0.3 mm, the gyroscope has a bias.
double refuted_after_s(const Wiring& wired, double speed_mps, double turn_radps, double skid, double limit_s = 60) {
  WheelTurn check;
  const param::DisagreementParameters n;
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  constexpr double kDt = 0.02, kStep_m = 0.0003;
  double left = 0, right = 0, counted_left = 0, counted_right = 0;
  for (int k = 1; k * kDt < limit_s; ++k) {
    const double turn = turn_radps * std::sin(2 * std::numbers::pi * k * kDt / 8);
    const double wheels = skid * turn + 0.02 * normal(random);
    const Rims rims = wired({speed_mps - 0.5 * kTrackWidth_m * wheels, speed_mps + 0.5 * kTrackWidth_m * wheels});
    left += rims.left_mps * kDt, right += rims.right_mps * kDt;
    const double now_left = std::floor(left / kStep_m), now_right = std::floor(right / kStep_m);
    const double shown = ((now_right - counted_right) - (now_left - counted_left)) * kStep_m / kDt / kTrackWidth_m;
    counted_left = now_left, counted_right = now_right;
    check.update(static_cast<float>(shown), static_cast<float>(turn + 0.01 + 0.005 * normal(random)), {20'000 * k}, n);
    if (check.refuted()) return k * kDt;
  }
  return limit_s;
}

TEST(WheelTurn, WheelsThatAreWiredWronglyAreRefutedWithinTenSecondsOfDriving) {
  const std::pair<const char*, Wiring> wirings[] = {{"swapped",
                                                     [](Rims r) {
                                                       return Rims{r.right_mps, r.left_mps};
                                                     }},
                                                    {"left reversed",
                                                     [](Rims r) {
                                                       return Rims{-r.left_mps, r.right_mps};
                                                     }},
                                                    {"right reversed",
                                                     [](Rims r) {
                                                       return Rims{r.left_mps, -r.right_mps};
                                                     }},
                                                    {"both reversed",
                                                     [](Rims r) {
                                                       return Rims{-r.left_mps, -r.right_mps};
                                                     }},
                                                    {"tenfold", [](Rims r) {
                                                       return Rims{10 * r.left_mps, 10 * r.right_mps};
                                                     }}};
  for (const auto& [name, wired] : wirings)
    for (const double speed : {0.3, 1.0, 4.0})
      for (const double turn : {0.3, 0.8})
        EXPECT_LT(refuted_after_s(wired, speed, turn, 1), 10) << name << speed << turn;
}

TEST(WheelTurn, WheelsThatSkidOrStandAreNoWorseThanNone) {
  const Wiring right = [](Rims r) { return r; };
  for (const double speed : {0.0, 0.3, 1.0, 4.0})
    for (const double turn : {0.0, 0.3, 0.8})
      for (const double skid : {0.0, 0.3, 1.0, 1.5, 1.875})
        EXPECT_EQ(refuted_after_s(right, speed, turn, skid), 60) << speed << ' ' << turn << ' ' << skid;
}

TEST(WheelTurn, ATurnThatAgreesClearsTheWheels) {
  WheelTurn check;
  const param::DisagreementParameters n;
  std::int64_t us = 0;
  const auto drive = [&](double seconds, float wheels_radps) {
    for (int k = 0; k * 0.02 < seconds; ++k) check.update(wheels_radps, 0.5F, {us += 20'000}, n);
  };
  drive(3, -0.5F);
  EXPECT_TRUE(check.refuted());
  drive(5, 0.45F);
  EXPECT_FALSE(check.refuted());
}

}  // namespace
}  // namespace tetap::checks
