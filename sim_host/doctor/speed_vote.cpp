// SPDX-License-Identifier: Apache-2.0
#include "sim_host/doctor/speed_vote.hpp"

#include "sim_host/doctor/remedy.hpp"

#include <array>
#include <cmath>
#include <string>

namespace tetap::doctor {
namespace {

constexpr double kUnitFactor = 1.3;  ///< between two data of one receiver: a unit is more, their noise is less
constexpr double kAgrees = 0.5;      ///< share of the larger disagreement: two devices agree, and the third is wrong
constexpr double kUnitWithin = 1.1;  ///< a unit is recognised within that ratio

struct UnitFactor {
  double factor;  ///< value sent over the right one
  const char* words;
};
constexpr std::array kOfVelocity{
    UnitFactor{1 / 0.514444, "knots"}, UnitFactor{3.6, "km/h"}, UnitFactor{1 / 0.44704, "miles an hour"},
    UnitFactor{1 / 0.3048, "ft/s"},    UnitFactor{100, "cm/s"}, UnitFactor{0.514444, "m/s divided by those of a knot"}};
constexpr std::array kOfFixes{UnitFactor{0.6, "ddmm.mmmm divided by 100"},
                              UnitFactor{1 / 0.6, "decimals of a degree taken for minutes"}};

std::string named(double factor, const auto& units) {
  for (const UnitFactor& unit : units)
    if (std::abs(std::log(factor / unit.factor)) < std::log(kUnitWithin)) return text(" That is %s.", unit.words);
  return {};
}

/// The comparisons that were made, one after the other.
std::string words(const std::array<SpeedRatio, 3>& ratios) {
  std::string all;
  for (const SpeedRatio& one : ratios)
    if (!one.evidence.empty()) all += (all.empty() ? "" : " ") + one.evidence;
  return all;
}

Finding of_velocity(double factor, Devices uses, const std::string& evidence) {
  return {.code = Code::kVelocityUnit,
          .uses = uses,
          .evidence = evidence + named(factor, kOfVelocity),
          .change = text("Multiply In_GnssVelEN and In_GnssVelU by %.4g in the sender: they are in m/s.", 1 / factor)};
}
Finding of_fixes(double factor, Devices uses, const std::string& evidence) {
  return {.code = Code::kFixUnit, .uses = uses, .evidence = evidence + named(factor, kOfFixes), .change = {}};
}
Finding of_wheels(const SpeedRatio& ratio, Devices uses, const RobotFacts& robot) {
  return {.code = Code::kWheelScale,
          .uses = uses,
          .certainty = ratio.certainty,
          .evidence = ratio.evidence,
          .change = text("Multiply the radii of wheels.drive by %.3f or divide counts_per_turn by it "
                         "(In_BodySpeed: wheels.speed_scale).",
                         ratio.value),
          .remedies = {wheels_by(robot.parameters, ratio.value, ratio.value)}};
}

}  // namespace

void SpeedVoteDetector::finish(Findings& findings) {
  auto velocity = by_.velocity_by_wheels.ratio(), fixes = by_.fixes_by_wheels.scale();
  auto receiver = by_.fixes_by_velocity.ratio();
  const RobotFacts& robot = by_.velocity_by_wheels.robot();
  // Two ratios of three devices give the third.
  if (!receiver && velocity && fixes)
    receiver = SpeedRatio{.value = fixes->value / velocity->value, .certainty = velocity->certainty, .evidence = {}};
  if (!receiver || !off(*receiver, kUnitFactor)) {
    if (velocity && off(*velocity)) findings.push_back(of_wheels(*velocity, kWheels | kGnssVelocity, robot));
    if (!fixes || !off(*fixes)) return;
    findings.push_back(of_wheels(*fixes, kFixes | kWheels | kGyroscope, robot));
    if (velocity || receiver || named(fixes->value, kOfFixes).empty()) return;
    findings.back().beside = Code::kFixUnit;  // of two devices either may be wrong
    findings.push_back(of_fixes(fixes->value, kFixes | kWheels, fixes->evidence));
    return;
  }
  if (!velocity && !fixes) return name_either(*receiver, findings);
  if (!velocity)
    velocity = SpeedRatio{.value = fixes->value / receiver->value, .certainty = fixes->certainty, .evidence = {}};
  if (!fixes)
    fixes = SpeedRatio{.value = velocity->value * receiver->value, .certainty = velocity->certainty, .evidence = {}};
  const std::string evidence = words({*receiver, *velocity, *fixes});
  constexpr Devices kUses = kFixes | kGnssVelocity | kWheels;
  const double velocity_off = std::abs(std::log(velocity->value)), fixes_off = std::abs(std::log(fixes->value));
  if (fixes_off < kAgrees * velocity_off)
    findings.push_back(of_velocity(velocity->value, kUses, evidence));
  else if (velocity_off < kAgrees * fixes_off)
    findings.push_back(of_fixes(fixes->value, kUses, evidence));
}

/// Two devices: a unit of one of them, or nobody knows which.
void SpeedVoteDetector::name_either(const SpeedRatio& receiver, Findings& findings) {
  constexpr Devices kUses = kFixes | kGnssVelocity;
  const double as_velocity = 1 / receiver.value;
  const bool place = !named(receiver.value, kOfFixes).empty(), speed = !named(as_velocity, kOfVelocity).empty();
  if (speed || !place) findings.push_back(of_velocity(as_velocity, kUses, receiver.evidence));
  if (place || !speed) findings.push_back(of_fixes(receiver.value, kUses, receiver.evidence));
  if (speed == place) findings.back().beside = Code::kVelocityUnit;
}

}  // namespace tetap::doctor
