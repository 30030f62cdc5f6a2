// SPDX-License-Identifier: Apache-2.0
#include "sim_host/doctor/turn_scale.hpp"

#include <cmath>

namespace tetap::doctor {
namespace {

constexpr double kTurnScaleScale = 1.15;   ///< below it slip, tyres and a receiver's noise are as large
constexpr double kTurnScaleFollows = 0.9;  ///< correlation: slip of a fast robot is in proportion to its turn, too
constexpr double kTurnScaleUnit = 20;      ///< more is a unit, which has its own code
constexpr double kShare = 0.05;            ///< lost samples make a turn smaller
constexpr double kTurnScaleSigmas = 8;     ///< error of the field's factor: a hard iron lasts

std::optional<TurnRatio> following(const std::optional<TurnRatio>& ratio) {
  return ratio && std::abs(ratio->correlation) > kTurnScaleFollows ? ratio : std::nullopt;
}
bool shown(const TurnRatio& ratio) {
  return (ratio.low > kTurnScaleScale || ratio.high < 1 / kTurnScaleScale) && ratio.value() < kTurnScaleUnit &&
         ratio.value() > 1 / kTurnScaleUnit;
}

}  // namespace

void TurnScaleDetector::window(const Window& w) {
  if (!w.turn_s_radps) return;
  share_sum_ += w.imu_share;
  ++windows_;
}

std::optional<TurnRatio> TurnScaleDetector::by_field() const {
  std::optional<TurnRatio> best;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto factor = by_.field.factor(axis);
    if (!factor || std::abs(factor->value) < 2 * kTurnScaleSigmas * factor->sigma) continue;
    const double size = std::abs(factor->value), error = kTurnScaleSigmas * factor->sigma;
    const TurnRatio ratio{.device = "the magnetic field",
                          .uses = kMounting,
                          .low = 1 / (size + error),
                          .high = 1 / (size - error),
                          .correlation = factor->value > 0 ? 1.0 : -1.0,
                          .seconds = windows_};
    if (!best || ratio.high / ratio.low < best->high / best->low) best = ratio;
  }
  return best;
}

void TurnScaleDetector::finish(Findings& findings) {
  if (windows_ < 1 || std::abs(share_sum_ / windows_ - 1) > kShare) return;
  const auto wheels = by_.turn.knows_size() ? following(by_.turn.ratio()) : std::nullopt;
  std::optional<TurnRatio> third;
  for (const auto& one : {following(by_.course.ratio()), by_field(), following(by_.forward.agreement().turn)})
    if (one && (!third || one->high / one->low < third->high / third->low)) third = one;
  if (!wheels || !shown(*wheels)) {
    if (third && shown(*third) && !wheels) name_gyroscope(*third, std::nullopt, findings);
    return;
  }
  const bool as_wheels =
      third && third->low < kTurnScaleScale * wheels->high && third->high * kTurnScaleScale > wheels->low;
  const bool as_stated = third && third->low < kTurnScaleScale && third->high > 1 / kTurnScaleScale;
  if (as_wheels && !as_stated) return name_gyroscope(*third, std::nullopt, findings);
  name_track(*wheels, as_stated && !as_wheels ? &*third : nullptr, findings);
  if (!as_stated || as_wheels) name_gyroscope(*wheels, Code::kTrackWidth, findings);
}

void TurnScaleDetector::name_gyroscope(const TurnRatio& ratio, std::optional<Code> beside, Findings& findings) const {
  findings.push_back(
      {.code = Code::kGyroScale,
       .uses = static_cast<Devices>(kGyroscope | kAccelerometer | ratio.uses),
       .evidence = text("The gyroscope turns %.2f times as fast as %s (between %.2f and %.2f, over %.0f s).",
                        ratio.value(), ratio.device, ratio.low, ratio.high, ratio.seconds),
       .change = text("Multiply the gyroscope's values by %.3f, or set the sensitivity that belongs to its full-scale "
                      "range.",
                      1 / ratio.value()),
       .beside = beside});
}

void TurnScaleDetector::name_track(const TurnRatio& ratio, const TurnRatio* third, Findings& findings) const {
  std::string agrees;
  if (third != nullptr) agrees = text(" %s turns as the gyroscope does (%.2f).", third->device, third->value());
  if (!agrees.empty()) agrees[1] = 'T';
  findings.push_back(
      {.code = Code::kTrackWidth,
       .uses = kGyroscope | kAccelerometer | kWheels,
       .evidence = text("The gyroscope turns %.2f times as fast as the wheels over the stated track (between %.2f and "
                        "%.2f, over %.0f s).",
                        ratio.value(), ratio.low, ratio.high, ratio.seconds) +
                   agrees,
       .change = text("Divide wheels.drive.track_m by %.3f (In_BodySpeed: multiply wheels.yaw_rate_scale by it).",
                      ratio.value()),
       .remedies = {by_.turn.track(ratio.value())}});
}

}  // namespace tetap::doctor
