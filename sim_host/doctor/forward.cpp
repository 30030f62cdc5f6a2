// SPDX-License-Identifier: Apache-2.0
#include "sim_host/doctor/forward.hpp"

#include "sim_host/doctor/remedy.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

namespace tetap::doctor {
namespace {

constexpr double kForwardLeastWindows = 30;
constexpr double kLeast_mps2 = 0.1;  ///< RMS of the motion's acceleration: less drowns in slopes and vibration
constexpr double kSlow_mps = 1;      ///< below, the magnitude of a GNSS velocity is noise
constexpr double kFits = 0.25;       ///< share of the force's variance, by the placing that fits best
constexpr double kDegreesARadian = 180 / std::numbers::pi;
constexpr double kAhead = 0.6;        ///< correlation by which a force along the acceleration shows what is ahead
constexpr double kTurned_rad = 0.35;  ///< 20 deg: slopes and slip turn the force by less
constexpr double kAside_rad = 0.52;   ///< 30 deg from ahead and astern, where a reversed axis looks like a turn
constexpr double kTurnedSigmas = 6;   ///< windows overlap, and motion colours what is left

struct Placing {
  double forward_a, forward_q, left_a, left_q;
  const char* words;
};
/// Force forward and left for acceleration a and q = v w, of an IMU whose axes are mirrored.
constexpr Placing kMirrors[] = {
    {1, 0, 0, -1, "with left for right"},
    {-1, 0, 0, 1, "with forward for backward"},
    {0, 1, 1, 0, "with x and y exchanged"},
    {0, -1, -1, 0, "with x and y exchanged and reversed"},
};

/// Share of the force's variance that a placing explains with one positive factor.
double explained(const Moments<4>& m, const Placing& p) {
  const double force2 = m.covariance(0, 0) + m.covariance(1, 1);
  const double motion2 = m.covariance(2, 2) + m.covariance(3, 3);
  const double both = p.forward_a * m.covariance(0, 2) + p.forward_q * m.covariance(0, 3) +
                      p.left_a * m.covariance(1, 2) + p.left_q * m.covariance(1, 3);
  return both > 0 && force2 > 0 && motion2 > 0 ? both * both / (force2 * motion2) : 0;
}

/// Two level axes of the sensor, the second to the left of the first, and up.
Matrix3 level_axes(const Vector3& up) {
  const Vector3 along = std::abs(up[0]) < 0.7 ? Vector3{1, 0, 0} : Vector3{0, 1, 0};
  const Vector3 first = unit(sum(along, scaled(-dot(along, up), up)));
  return {first, cross(up, first), up};
}

/// The turn about up that brings the force nearest to the motion, and the shares of the force's variance that it and
/// the stated mounting explain.
struct Turned {
  double by_rad, fits, as_stated;
};

/// By the sums of a times force ahead and q times force left.
Turned turned(const Moments<4>& m) {
  const double along = m.covariance(0, 2) + m.covariance(1, 3), across = m.covariance(0, 3) - m.covariance(1, 2);
  const double squares = (m.covariance(0, 0) + m.covariance(1, 1)) * (m.covariance(2, 2) + m.covariance(3, 3));
  if (!(squares > 0)) return {0, 0, 0};
  return {std::atan2(across, along), (along * along + across * across) / squares,
          along > 0 ? along * along / squares : 0};
}

}  // namespace

void ForwardDetector::add(Source& source, std::optional<double> speed_mps, const Window& w) {
  if (source.speed_mps && speed_mps && before_ && before_->force_s_mps2 && w.force_s_mps2 && w.turn_s_radps &&
      w.start_s - before_->start_s < 1.5) {
    const Matrix3 axes = robot_.mounting ? *robot_.mounting : level_axes(w.up_s);
    const Vector3 force = rotated(axes, scaled(0.5, sum(*before_->force_s_mps2, *w.force_s_mps2)));
    const Vector3 turn = scaled(0.5, sum(*before_->turn_s_radps, *w.turn_s_radps));
    const double speed = 0.5 * (*source.speed_mps + *speed_mps);
    source.moments.add({force[0], force[1], (*speed_mps - *source.speed_mps) / (w.start_s - before_->start_s),
                        speed * dot(turn, w.up_s)});
  }
  source.speed_mps = speed_mps;
}

void ForwardDetector::window(const Window& w) {
  std::optional<double> wheels, gnss;
  if (w.wheels) wheels = 0.5 * w.wheels->sum_mps;
  if (w.velocity_n_mps) gnss = std::hypot((*w.velocity_n_mps)[0], (*w.velocity_n_mps)[1]);
  if (gnss && *gnss < kSlow_mps) gnss.reset();
  add(wheels_, wheels, w);
  add(gnss_, gnss, w);
  before_ = w;
}

ForwardDetector::Agreement ForwardDetector::agreement() const {
  const bool wheels = wheels_.moments.count() >= kForwardLeastWindows;
  const Moments<4>& m = wheels ? wheels_.moments : gnss_.moments;
  Agreement found{.device = wheels ? "the wheels" : "GNSS", .uses = wheels ? kWheels : kGnssVelocity};
  if (m.count() < kForwardLeastWindows) return found;
  constexpr double kLeast2 = kLeast_mps2 * kLeast_mps2;
  if (!robot_.mounting) {
    if (m.covariance(2, 2) > kLeast2 && m.covariance(3, 3) > kLeast2) add_seen(m, found);
    return found;
  }
  if (m.covariance(2, 2) > kLeast2)
    found.ahead = correlation(m.covariance(0, 2), m.covariance(0, 0), m.covariance(2, 2));
  if (m.covariance(3, 3) < kLeast2) return found;
  const Turned best = turned(m);
  found.aside = std::abs(best.by_rad) > kAside_rad && std::abs(best.by_rad) < std::numbers::pi - kAside_rad &&
                best.fits > kFits && best.fits > std::max(explained(m, kMirrors[0]), explained(m, kMirrors[1]));
  found.left = correlation(m.covariance(1, 3), m.covariance(1, 1), m.covariance(3, 3));
  found.turn = turn_ratio(m.covariance(3, 3), m.covariance(1, 3), m.covariance(1, 1), m.count(), 0);
  if (!found.turn) return found;
  found.turn->device = "the sideways force in curves";
  found.turn->uses = static_cast<Devices>(kAccelerometer | kMounting | found.uses);
  return found;
}

void ForwardDetector::add_seen(const Moments<4>& m, Agreement& found) {
  const double first = m.covariance(0, 2), second = m.covariance(1, 2), size = std::hypot(first, second);
  if (!(size > 0)) return;
  const std::array<double, 4> forward{first / size, second / size, 0, 0}, left{-second / size, first / size, 0, 0};
  const std::array<double, 4> acceleration{0, 0, 1, 0}, curve{0, 0, 0, 1};
  const double ahead =
      correlation(m.covariance(forward, acceleration), m.covariance(forward, forward), m.covariance(2, 2));
  if (ahead < kAhead) return;
  found.ahead = ahead;
  found.left = correlation(m.covariance(left, curve), m.covariance(left, left), m.covariance(3, 3));
}

void ForwardDetector::finish(Findings& findings) {
  if (!robot_.mounting) return;
  if (judge_backwards(findings)) return;
  if (wheels_.moments.count() >= kForwardLeastWindows)
    judge(wheels_, "the wheels", kWheels, findings);
  else if (gnss_.moments.count() >= kForwardLeastWindows)
    judge(gnss_, "GNSS", kGnssVelocity, findings);
}

/// The force against the wheels' speed as on an IMU turned by 180 deg, against the speed by GNSS as stated: a robot
/// that is driven drives ahead most of its way, so the wheels are wrong.
bool ForwardDetector::judge_backwards(Findings& findings) const {
  if (std::min(wheels_.moments.count(), gnss_.moments.count()) < kForwardLeastWindows) return false;
  const Turned wheels = turned(wheels_.moments), gnss = turned(gnss_.moments);
  if (std::min(wheels.fits, gnss.fits) < kFits) return false;
  if (std::abs(gnss.by_rad) > kTurned_rad || std::abs(wheels.by_rad) < std::numbers::pi - kTurned_rad) return false;
  findings.push_back(
      {.code = Code::kWheelsReversed,
       .uses = kGyroscope | kAccelerometer | kMounting | kGnssVelocity,
       .certainty = wheels.fits,
       .evidence =
           text("The horizontal force follows acceleration and curves by GNSS as stated (%.0f %% of its variance "
                "over %.0f s), and by the wheels as if they drove backwards (%.0f %%).",
                100 * gnss.fits, gnss_.moments.count(), 100 * wheels.fits),
       .change = {}});
  return true;
}

void ForwardDetector::judge(const Source& source, const char* name, Devices device, Findings& findings) const {
  const Moments<4>& m = source.moments;
  if (m.covariance(2, 2) + m.covariance(3, 3) < kLeast_mps2 * kLeast_mps2) return;
  const Turned best = turned(m);
  const Placing* mirror = &kMirrors[0];
  for (const Placing& one : kMirrors)
    if (explained(m, one) > explained(m, *mirror)) mirror = &one;
  const bool mirrored = explained(m, *mirror) > best.fits;
  const double fits = mirrored ? explained(m, *mirror) : best.fits;
  const double sigma_rad = std::sqrt(std::max(0.0, 1 / best.fits - 1) / (2 * m.count()));
  if (fits < kFits || (!mirrored && std::abs(best.by_rad) < std::max(kTurned_rad, kTurnedSigmas * sigma_rad))) return;
  const std::string placed =
      mirrored ? mirror->words : text("turned by %.0f deg about up", best.by_rad * kDegreesARadian);
  findings.push_back({.code = Code::kImuAxes,
                      .uses = static_cast<Devices>(kGyroscope | kAccelerometer | kMounting | device),
                      .certainty = fits,
                      .evidence = text("The horizontal force follows acceleration and curves by %s as an IMU %s "
                                       "(%.0f %% of its variance over %.0f s; as stated: %.0f %%).",
                                       name, placed.c_str(), 100 * fits, m.count(), 100 * best.as_stated),
                      .change = {}});
  if (mirrored) return;
  // Without a velocity by GNSS, wheels that count backwards look the same.
  if (device == kWheels && std::abs(best.by_rad) > std::numbers::pi - kTurned_rad &&
      gnss_.moments.count() < kForwardLeastWindows) {
    findings.push_back({.code = Code::kWheelsReversed,
                        .uses = kGyroscope | kAccelerometer | kMounting,
                        .certainty = fits,
                        .evidence = findings.back().evidence + " Wheels that count backwards look the same.",
                        .change = {},
                        .beside = Code::kImuAxes});
    std::swap(findings.back(), findings[findings.size() - 2]);
  }
  const double c = std::cos(best.by_rad), s = std::sin(best.by_rad);
  const Matrix3& rows = *robot_.mounting;
  const Vector3 x = sum(scaled(c, rows[0]), scaled(-s, rows[1])), y = sum(scaled(s, rows[0]), scaled(c, rows[1]));
  findings.back().change = text(
      "Set inertial.mounting_bs = %.4f %.4f %.4f %.4f %.4f %.4f %.4f %.4f %.4f, or turn the "
      "sensor; tools/calibrate/calibrate_robot finds it more finely.",
      x[0], x[1], x[2], y[0], y[1], y[2], rows[2][0], rows[2][1], rows[2][2]);
  findings.back().remedies = {mounting({x, y, rows[2]})};
}

}  // namespace tetap::doctor
