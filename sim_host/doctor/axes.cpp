// SPDX-License-Identifier: Apache-2.0
#include "sim_host/doctor/axes.hpp"

#include <cmath>

namespace tetap::doctor {
namespace {

constexpr double kFollows = 0.6;  ///< correlation of turn rates, or of force and acceleration
constexpr double kHalf = 0.5;     ///< a factor of -1 or 1 is nearer to it than to 0
constexpr double kSigmas = 5;     ///< motion colours the noise of gravity's direction
constexpr double kDown = -0.7;    ///< cosine: gravity points down in the stated axes
constexpr char kLetters[] = {'X', 'Y', 'Z'};

/// The axis of the sensor that lies nearest to a direction.
std::size_t nearest(const Vector3& direction) {
  std::size_t best = 0;
  for (std::size_t i = 1; i < 3; ++i)
    if (std::abs(direction[i]) > std::abs(direction[best])) best = i;
  return best;
}
bool surely(const std::optional<AxisFactor>& factor, double sign) {
  return factor && sign * factor->value > kHalf && std::abs(factor->value) > kSigmas * factor->sigma;
}

}  // namespace

void AxesDetector::Votes::add(double figure, double least, const char* device, Devices devices) {
  if (std::abs(figure) < least) return;
  ++(figure > 0 ? with : against);
  if (figure > 0) return;
  uses |= devices;
  words += (words.empty() ? "" : ", ") + text("%s (%.2f)", device, figure);
}

std::size_t AxesDetector::up_axis() const { return nearest(up_s_); }

void AxesDetector::window(const Window& w) {
  if (w.turn_s_radps) up_s_ = w.up_s;
  if (before_ && before_->force_s_mps2 && w.force_s_mps2 && w.start_s - before_->start_s < 1.5) {
    const double step_s = w.start_s - before_->start_s;
    gravity_.add(*before_->force_s_mps2, *w.force_s_mps2,
                 scaled(0.5 * step_s, sum(*before_->turn_s_radps, *w.turn_s_radps)));
  }
  before_ = w;
}

AxesDetector::Votes AxesDetector::votes(bool upside_down) const {
  Votes yaw;
  if (const auto wheels = by_.turn.ratio()) yaw.add(wheels->correlation, kFollows, wheels->device, wheels->uses);
  if (const auto course = by_.course.ratio()) yaw.add(course->correlation, kFollows, course->device, course->uses);
  const ForwardDetector::Agreement forward = by_.forward.agreement();
  // Without a mounting, up and left turn over together, and a mirrored accelerometer looks like a mirrored gyroscope:
  // the force then speaks for the gyroscope, or with another device against it.
  if (robot_.mounting || (!upside_down && (forward.left > 0 || yaw.against > 0)))
    yaw.add(forward.left, kFollows, "the sideways force in curves", kAccelerometer);
  return yaw;
}

void AxesDetector::push(Code code, std::size_t axis, int uses, const std::string& evidence, std::optional<Code> beside,
                        Findings& findings) const {
  const bool gyroscope = code == Code::kGyroSign;
  findings.push_back({.code = code,
                      .uses = static_cast<Devices>(uses),
                      .evidence = evidence,
                      .change = text("Negate %s%c of In_Imu%u%s in the sender.", gyroscope ? "Ang" : "Vel",
                                     kLetters[axis], static_cast<unsigned>(robot_.imu), gyroscope ? "Gyro" : "Accel"),
                      .beside = beside});
}

void AxesDetector::finish(Findings& findings) {
  if (up_s_ == Vector3{}) return;
  const auto upward = by_.force.upward();
  const bool upside_down = upward && *upward < kDown;
  const Votes yaw = votes(upside_down);
  if (upside_down) return judge_upside(yaw, *upward, findings);
  judge_yaw(yaw, findings);
  judge_force(yaw, findings);
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (axis != up_axis()) judge_level(axis, findings);
}

/// No turned IMU measures both level axes against the motion or the gyroscope: its axes stay right-handed.
std::string AxesDetector::all_reversed() const {
  const ForwardDetector::Agreement forward = by_.forward.agreement();
  if (robot_.mounting && forward.ahead < -kFollows && forward.left < -kFollows)
    return text(
        "the force ahead goes against the acceleration by %s (correlation %.2f) and the force to the left "
        "against the curves (%.2f)",
        forward.device, forward.ahead, forward.left);
  const std::size_t a = (up_axis() + 1) % 3, b = (up_axis() + 2) % 3;
  const auto both_against = [&](const auto& turn) { return surely(turn.factor(a), -1) && surely(turn.factor(b), -1); };
  if (both_against(gravity_)) return "gravity turns against the gyroscope about both level axes";
  return both_against(by_.field) ? "the magnetic field turns against the gyroscope about both level axes" : "";
}

/// A turned IMU turns with the other devices about the direction that it measures as up; a mirrored one against them.
void AxesDetector::judge_upside(const Votes& yaw, double upward, Findings& findings) const {
  const std::string down = text("The mean specific force points down (cosine %.2f to the stated up)", upward);
  if (const std::string reversed = yaw.against <= yaw.with ? all_reversed() : ""; !reversed.empty()) {
    const std::string evidence = down + ", and " + reversed + ": no turned IMU does both.";
    const auto imu = static_cast<unsigned>(robot_.imu);
    push(Code::kAccelSign, up_axis(), kNoDevice, evidence, std::nullopt, findings);
    findings.back().spoils = kAccelerometer | kMounting | kGyroscope;
    findings.back().change =
        text("Negate VelX, VelY and VelZ of In_Imu%uAccel in the sender: gravity is +9.81 upwards.", imu);
    push(Code::kGyroSign, up_axis(), kNoDevice,
         evidence + " The gyroscope's yaw rate is right about the reversed up alone.", std::nullopt, findings);
    findings.back().change = text("Negate AngX, AngY and AngZ of In_Imu%uGyro in the sender.", imu);
    return;
  }
  const bool no_votes = yaw.with + yaw.against == 0;
  if (no_votes && surely(by_.field.factor(up_axis()), 1))
    return push(Code::kAccelSign, up_axis(), kGyroscope,
                down + ", and yet the magnetic field turns with the gyroscope.", std::nullopt, findings);
  if (no_votes && !surely(by_.field.factor(up_axis()), -1))
    return push(Code::kAccelSign, up_axis(), kGyroscope,
                down + "; no device shows whether the gyroscope is turned, too.", Code::kImuUpsideDown, findings);
  // With all axes reversed the curves, taken about a reversed up, agree with the force to the left.
  const ForwardDetector::Agreement forward = by_.forward.agreement();
  const bool astern = -forward.ahead > kFollows;
  const bool curves = forward.left > kFollows;
  const bool all = robot_.mounting && (astern || (curves && forward.ahead < kHalf * kFollows));
  if (yaw.against <= yaw.with - (all && curves ? 1 : 0)) return;
  push(Code::kAccelSign, up_axis(), kGyroscope | yaw.uses,
       down + ", and yet these turn against an IMU that is upside down: " + yaw.words + ".", std::nullopt, findings);
  // Turns are taken about the direction that is measured as up.
  findings.back().spoils = kAccelerometer | kMounting | kGyroscope;
  if (!all) return;
  findings.back().evidence +=
      astern ? text(" The force ahead goes against the acceleration by %s (correlation %.2f).", forward.device,
                    forward.ahead)
             : text(" The force to the left goes with the curves about that direction (%.2f).", forward.left);
  findings.back().change = text("Negate VelX, VelY and VelZ of In_Imu%uAccel in the sender: gravity is +9.81 upwards.",
                                static_cast<unsigned>(robot_.imu));
}

void AxesDetector::judge_yaw(const Votes& yaw, Findings& findings) const {
  Votes all = yaw;
  if (const auto field = by_.field.factor(up_axis()); surely(field, 1) || surely(field, -1))
    all.add(field->value, kHalf, "the magnetic field", kNoDevice);
  if (all.against == 0 || all.against <= all.with || (all.with > 0 && all.against < 3)) return;
  std::optional<Code> beside;
  if (all.against == 1 && all.uses == kWheels) beside = Code::kWheelsSwapped;
  if (all.against == 1 && all.uses == kGnssVelocity) beside = Code::kVelocityAxes;
  if (all.against == 1 && all.uses == kFixes) beside = Code::kLongitudeSign;
  if (all.against == 1 && all.uses == kAccelerometer) beside = Code::kAccelSign;
  push(Code::kGyroSign, up_axis(), kGyroscope | all.uses, "The gyroscope's yaw rate goes against " + all.words + ".",
       beside, findings);
}

void AxesDetector::judge_force(const Votes& yaw, Findings& findings) const {
  if (!robot_.mounting) return;
  const ForwardDetector::Agreement forward = by_.forward.agreement();
  if (forward.aside) return;  // an IMU that is turned about up
  const int uses = kAccelerometer | kMounting | forward.uses;
  // Both against is an IMU that is turned by 180 degrees.
  if (forward.ahead < -kFollows && forward.left > 0)
    push(Code::kAccelSign, nearest((*robot_.mounting)[0]), uses,
         text("The force ahead goes against the acceleration by %s (correlation %.2f), the force to the left with the "
              "curves (%.2f).",
              forward.device, forward.ahead, forward.left),
         std::nullopt, findings);
  if (forward.left < -kFollows && forward.ahead > -kHalf * kFollows && yaw.against <= 1)
    push(Code::kAccelSign, nearest((*robot_.mounting)[1]), uses | kGyroscope,
         text("The force to the left goes against speed times turn rate by %s (correlation %.2f), the force ahead with "
              "the acceleration (%.2f).",
              forward.device, forward.left, forward.ahead),
         std::nullopt, findings);
}

/// Correlation of an axis of the accelerometer with the motion; 0 where nothing is known.
double AxesDetector::agreement(std::size_t axis) const {
  if (!robot_.mounting) return 0;
  const ForwardDetector::Agreement forward = by_.forward.agreement();
  if (nearest((*robot_.mounting)[0]) == axis) return forward.ahead;
  return nearest((*robot_.mounting)[1]) == axis ? forward.left : 0;
}

/// Roll and pitch: by the magnetic field, or by gravity, whose sideways axis is the accelerometer's other one.
void AxesDetector::judge_level(std::size_t axis, Findings& findings) const {
  const std::size_t other = 3 - axis - up_axis();
  const auto field = by_.field.factor(axis);
  if (surely(field, -1)) {
    if (surely(by_.field.factor(other), -1) || surely(by_.field.factor(up_axis()), -1)) return;  // a turned sensor
    return push(Code::kGyroSign, axis, kGyroscope | kMounting,
                text("The magnetic field turns by %.2f times the gyroscope about that axis (sigma %.2f).", field->value,
                     field->sigma),
                std::nullopt, findings);
  }
  const auto gravity = gravity_.factor(axis);
  if (!surely(gravity, -1)) return;
  const std::string evidence = text("Gravity turns by %.2f times the gyroscope about %c (sigma %.2f).", gravity->value,
                                    kLetters[axis], gravity->sigma);
  if (surely(field, 1))
    return push(Code::kAccelSign, other, kGyroscope, evidence + " The magnetic field turns with the gyroscope.",
                std::nullopt, findings);
  const double agrees = agreement(other);
  if (agrees < -kFollows) return;  // judge_force names it
  if (agrees > kFollows)
    return push(
        Code::kGyroSign, axis, kAccelerometer | kMounting,
        evidence + text(" The accelerometer's %c follows the motion (correlation %.2f).", kLetters[other], agrees),
        std::nullopt, findings);
  push(Code::kAccelSign, other, kGyroscope, evidence, Code::kGyroSign, findings);
  push(Code::kGyroSign, axis, kAccelerometer, evidence, Code::kAccelSign, findings);
}

}  // namespace tetap::doctor
