// SPDX-License-Identifier: Apache-2.0
#include "sim_host/doctor/turn.hpp"

#include "sim_host/doctor/gyro_unit.hpp"

#include <algorithm>
#include <cmath>

namespace tetap::doctor {
namespace {

constexpr double kLeastWindows = 20;
constexpr double kLeastTurn_radps = 0.03;  ///< RMS: less, and slip and a gyroscope's bias are as large
constexpr double kExplained = 0.35;  ///< share of the turn's variance: on a fast road slip makes half of the difference
constexpr double kAlone = 0.7;  ///< share of one wheel combination in the other's, where one alone explains the turn

}  // namespace

void TurnDetector::sample(base::Micros, const sensor::Sample& sample) {
  if (sample.sensor == sensor::Sensor::kWheelCounts) message_ = "In_WheelCounts";
  if (sample.sensor == sensor::Sensor::kWheelSpeed) message_ = "In_WheelSpeed";
  if (sample.sensor == sensor::Sensor::kBodySpeed) message_ = "In_BodySpeed";
}

double TurnDetector::Limit::limited(double value) {
  constexpr double kRms = 3;
  squares_ += value * value;
  ++count_;
  const double most = kRms * std::sqrt(squares_ / count_);
  return std::clamp(value, -most, most);
}

void TurnDetector::window(const Window& w) {
  if (w.turn_s_radps) up_s_ = w.up_s;
  if (!w.turn_s_radps || !w.wheels || !w.wheels->difference_mps) return;
  const Vector3& g = *w.turn_s_radps;
  moments_.add({g[0], g[1], g[2], difference_.limited(*w.wheels->difference_mps), sum_.limited(w.wheels->sum_mps)});
}

void TurnDetector::finish(Findings& findings) {
  if (moments_.count() < kLeastWindows) return;
  const std::array<double, 5> gyro{up_s_[0], up_s_[1], up_s_[2], 0, 0}, difference{0, 0, 0, 1, 0}, total{0, 0, 0, 0, 1};
  const double gg = moments_.covariance(gyro, gyro), gd = moments_.covariance(gyro, difference),
               gs = moments_.covariance(gyro, total), dd = moments_.covariance(3, 3), ss = moments_.covariance(4, 4);
  const double by_difference = correlation(gd, gg, dd), by_sum = correlation(gs, gg, ss);
  judge_wheels(gg, by_difference, by_sum, findings);
  const bool follows = by_difference * by_difference > kExplained;
  const double turn_radps = std::sqrt(dd) / scale_.track_m;
  if (follows && turn_radps > kLeastTurn_radps && (scale_.known || message_ == "In_BodySpeed"))
    judge_gyroscope(std::sqrt(gg) / turn_radps, findings);
}

void TurnDetector::judge_wheels(double gyro2, double by_difference, double by_sum, Findings& findings) const {
  if (gyro2 < kLeastTurn_radps * kLeastTurn_radps) return;
  const double difference2 = by_difference * by_difference, sum2 = by_sum * by_sum;
  const Devices uses = kGyroscope | kAccelerometer | kWheels;
  if (difference2 > kExplained && by_difference < 0 && sum2 < difference2) {
    const std::string factor = scale_.known || message_ == "In_BodySpeed"
                                   ? text("%.2f times", -std::sqrt(moments_.covariance(3, 3) / gyro2) / scale_.track_m)
                                   : std::string("against");
    findings.push_back({.code = Code::kWheelsSwapped,
                        .uses = uses,
                        .certainty = -by_difference,
                        .evidence = text("The wheels turn the robot by %s the gyroscope's yaw rate over %.0f s "
                                         "(correlation %.2f).",
                                         factor.c_str(), moments_.count(), by_difference),
                        .change = message_ == "In_BodySpeed"
                                      ? "Negate YawRate in the sender of In_BodySpeed, or swap the wheels behind it."
                                      : "Swap Left and Right in the sender of " + message_ + ", or the two plugs."});
  } else if (sum2 > kExplained && difference2 < kAlone * sum2) {
    const char* wheel = by_sum > 0 ? "left" : "right";
    findings.push_back(
        {.code = Code::kWheelReversed,
         .uses = uses,
         .certainty = std::abs(by_sum),
         .evidence = text("The yaw rate of the gyroscope follows the sum of the wheels (correlation %.2f over %.0f s), "
                          "not their difference (%.2f): the %s wheel counts backwards.",
                          by_sum, moments_.count(), by_difference, wheel),
         .change = text("Negate the %s wheel in the sender of %s, or swap channels A and B of its encoder.", wheel,
                        message_.c_str())});
  }
}

void TurnDetector::judge_gyroscope(double ratio, Findings& findings) const {
  name_gyro_unit(ratio, "the wheels", kWheels, moments_.count(), findings);
}

}  // namespace tetap::doctor
