// SPDX-License-Identifier: Apache-2.0
#include "sim_host/doctor/turn.hpp"

#include "sim_host/doctor/remedy.hpp"

#include "sim_host/doctor/gyro_unit.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tetap::doctor {
namespace {

constexpr double kTurnLeastWindows = 20;
constexpr double kTurnLeastTurn_radps = 0.03;  ///< RMS: less, and slip and a gyroscope's bias are as large
constexpr double kExplained = 0.35;  ///< share of the turn's variance: on a fast road slip makes half of the difference
constexpr double kAlone = 0.7;   ///< share of one wheel combination in the other's, where one alone explains the turn
constexpr double kStill = 1e-3;  ///< share of the other wheel's square: less, and the wheel stands still
constexpr double kSingular = 5e-4;          ///< determinant of the wheels: less, and the robot hardly turns
constexpr double kWhole = 0.8;              ///< share of the turn's square that the two wheels explain together
constexpr double kLeastDrift_radps = 0.05;  ///< yaw rate of unequal wheels: above a gyroscope's bias
constexpr double kUnequal = 0.03;    ///< half of the difference between the wheels: tyres are within some percent
constexpr double kBackwards = 0.5;   ///< share of the way: three quarters of it
constexpr double kReversed = 0.9;    ///< a wheel of 19 times the other's size; beyond 1 it counts backwards
constexpr double kRightWheel = 0.5;  ///< share of the other wheel's factor: that wheel is as stated

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
  ahead_ += w.wheels->sum_mps;
  either_way_ += std::abs(w.wheels->sum_mps);
  const Vector3& g = *w.turn_s_radps;
  whole_.add({g[0], g[1], g[2], *w.wheels->difference_mps, w.wheels->sum_mps});
  moments_.add({g[0], g[1], g[2], difference_.limited(*w.wheels->difference_mps), sum_.limited(w.wheels->sum_mps)});
}

std::optional<TurnRatio> TurnDetector::ratio() const {
  if (whole_.count() < kTurnLeastWindows) return std::nullopt;
  const std::array<double, 5> gyro{up_s_[0], up_s_[1], up_s_[2], 0, 0}, turn{0, 0, 0, 1 / scale_.track_m, 0};
  const double turn2 = whole_.covariance(turn, turn);
  if (turn2 < kTurnLeastTurn_radps * kTurnLeastTurn_radps) return std::nullopt;
  auto found = turn_ratio(whole_.covariance(gyro, gyro), whole_.covariance(gyro, turn), turn2, whole_.count(),
                          std::sqrt(kExplained));
  if (!found) return found;
  found->device = "the wheels";
  found->uses = kWheels;
  return found;
}

void TurnDetector::finish(Findings& findings) {
  if (moments_.count() < kTurnLeastWindows) return;
  const std::array<double, 5> gyro{up_s_[0], up_s_[1], up_s_[2], 0, 0}, difference{0, 0, 0, 1, 0}, total{0, 0, 0, 0, 1};
  const double gg = moments_.covariance(gyro, gyro), gd = moments_.covariance(gyro, difference),
               gs = moments_.covariance(gyro, total), dd = moments_.covariance(3, 3), ss = moments_.covariance(4, 4);
  judge_wheels(gg, correlation(gd, gg, dd), correlation(gs, gg, ss), findings);
  judge_unequal(findings);
  if (const auto turn = ratio(); turn && knows_size())
    name_gyro_unit(turn->value(), turn->device, kWheels, turn->seconds, findings);
}

void TurnDetector::judge_unequal(Findings& findings) const {
  const std::array<double, 5> gyro{up_s_[0], up_s_[1], up_s_[2], 0, 0}, difference{0, 0, 0, 1, 0}, total{0, 0, 0, 0, 1};
  const double dd = whole_.product(3, 3), ss = whole_.product(4, 4), ds = whole_.product(3, 4);
  const double gd = whole_.product(gyro, difference), gs = whole_.product(gyro, total);
  const double determinant = dd * ss - ds * ds;
  const double left2 = (ss - 2 * ds + dd) / 4, right2 = (ss + 2 * ds + dd) / 4;
  if (std::min(left2, right2) < kStill * std::max(left2, right2)) return judge_still(right2 > left2, findings);
  if (!(determinant > kSingular * 4 * left2 * right2)) return;
  const double by_difference = (gd * ss - gs * ds) / determinant, by_sum = (gs * dd - gd * ds) / determinant;
  const double gg = whole_.product(gyro, gyro), explained = (by_difference * gd + by_sum * gs) / gg;
  const double unequal = by_sum / by_difference;
  if (explained < kWhole || by_difference <= 0 || std::abs(by_sum) * std::sqrt(ss) < kLeastDrift_radps) return;
  if (std::abs(unequal) < kUnequal || std::abs(unequal) > kReversed) return;
  // yaw rate = (right' - left') / track, where right' = (1 + u) right and left' = (1 - u) left but for a common factor
  const double right_over_left = (1 + unequal) / (1 - unequal);
  const double left = std::log((by_difference - by_sum) * scale_.track_m),
               right = std::log((by_difference + by_sum) * scale_.track_m);
  const param::Parameters& p = robot_.parameters;
  std::vector<Remedy> remedies{wheels_by(p, {}, right_over_left), wheels_by(p, 1 / right_over_left, {})};
  std::string change = text(
      "Multiply the right radius of wheels.drive by %.3f or the left one by %.3f; the speed by GNSS "
      "or a measured distance shows which (In_WheelSpeed: wheels.right_speed_scale).",
      right_over_left, 1 / right_over_left);
  if (scale_.known && std::abs(left) < kRightWheel * std::abs(right)) {
    remedies.pop_back();
    change = text("Multiply the right radius of wheels.drive by %.3f: the left wheel fits the stated track.",
                  right_over_left);
  }
  if (scale_.known && std::abs(right) < kRightWheel * std::abs(left)) {
    remedies.erase(remedies.begin());
    change = text("Multiply the left radius of wheels.drive by %.3f: the right wheel fits the stated track.",
                  1 / right_over_left);
  }
  if (robot_.name.empty()) remedies.clear();
  findings.push_back(
      {.code = Code::kWheelsUnequal,
       .uses = kGyroscope | kAccelerometer | kWheels,
       .certainty = explained,
       .evidence = text("The gyroscope turns by %.3f rad/s more than the wheels do, in proportion to their speed: a "
                        "right wheel %.3f times as large as stated, or a left one %.3f times (%.0f s, %.0f %% of the "
                        "turn explained).",
                        by_sum * std::sqrt(ss), right_over_left, 1 / right_over_left, whole_.count(), 100 * explained),
       .change = std::move(change),
       .remedies = std::move(remedies)});
}

Remedy TurnDetector::track(double factor) const {
  const param::WheelParameters& w = robot_.parameters.wheels;
  if (message_ == "In_BodySpeed")
    return {{.path = "wheels.yaw_rate_scale", .values = {five_digits(static_cast<double>(w.yaw_rate_scale) * factor)}}};
  return {{.path = "wheels.drive.track_m", .values = {five_digits(static_cast<double>(w.drive.track_m) / factor)}}};
}

void TurnDetector::judge_still(bool is_left, Findings& findings) const {
  if (message_ == "In_BodySpeed" && !scale_.known) return;  // the track is not known
  const char* wheel = is_left ? "left" : "right";
  findings.push_back(
      {.code = Code::kWheelsUnequal,
       .uses = kWheels,
       .evidence = text("The %s wheel stands still for %.0f s while the other one turns.", wheel, whole_.count()),
       .change = text("Check the plug, the channels and the sender of the %s wheel's encoder.", wheel)});
}

/// The wheels turn against the gyroscope. A robot that is driven drives ahead most of its way.
void TurnDetector::name_against(double by_difference, double gyro2, Findings& findings) const {
  const std::string factor = knows_size()
                                 ? text("by %.2f times", -std::sqrt(moments_.covariance(3, 3) / gyro2) / scale_.track_m)
                                 : std::string("against");
  const std::string turns = text("The wheels turn the robot %s the gyroscope's yaw rate over %.0f s (correlation %.2f)",
                                 factor.c_str(), moments_.count(), by_difference);
  const bool back = ahead_ < -kBackwards * either_way_;
  findings.push_back({.code = back ? Code::kWheelsReversed : Code::kWheelsSwapped,
                      .uses = kGyroscope | kAccelerometer | kWheels,
                      .certainty = -by_difference,
                      .evidence = back ? turns + text(", and drive it backwards for %.0f %% of its way.",
                                                      50 - 50 * ahead_ / either_way_)
                                       : turns + ".",
                      .change = {}});
  const bool body = message_ == "In_BodySpeed";
  if (back && body) findings.back().change = "Negate Forward and YawRate in the sender of In_BodySpeed.";
  if (back) return;
  findings.back().change = body ? "Negate YawRate in the sender of In_BodySpeed, or swap the wheels behind it."
                                : "Swap Left and Right in the sender of " + message_ + ", or the two plugs.";
}

void TurnDetector::judge_wheels(double gyro2, double by_difference, double by_sum, Findings& findings) const {
  if (gyro2 < kTurnLeastTurn_radps * kTurnLeastTurn_radps) return;
  const double difference2 = by_difference * by_difference, sum2 = by_sum * by_sum;
  const Devices uses = kGyroscope | kAccelerometer | kWheels;
  if (difference2 > kExplained && by_difference < 0 && sum2 < difference2) {
    name_against(by_difference, gyro2, findings);
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

}  // namespace tetap::doctor
