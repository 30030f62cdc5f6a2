// SPDX-License-Identifier: Apache-2.0
#include "sim_host/doctor/fixes.hpp"

#include "sim_host/doctor/path.hpp"

#include <cmath>
#include <span>

namespace tetap::doctor {
namespace {

constexpr double kLeg_s = 8;  ///< long against the noise of fixes, short against their drift
constexpr double kLeastLeg_m = 4;
constexpr double kVelocityGap_s = 1.6;  ///< receivers give a velocity each second at least
constexpr double kLeastLegs = 5;
constexpr double kRight =
    0.3;  ///< share of the legs' square left over with axes that fit: noise of fixes over short legs
constexpr double kBetter = 0.4;        ///< share of the square that the stated axes leave
constexpr double kAsGood = 1.3;        ///< another map that leaves at most that much more is named, too
constexpr double kAlike = 0.85;        ///< cosine between two ways that differ by a factor
constexpr double kFixesFollows = 0.8;  ///< course and gyroscope of a vehicle that drives ahead
constexpr double kLeastClimb_m = 1.5;  ///< RMS of a leg's climb: fixes of height scatter by a metre
constexpr double kLeastClimbs = 10;

/// A map of the plane: rows are east and north.
struct Map {
  Code code;
  double ee, en, ne, nn;
  const char* words;
};

/// Share of the squared legs that is left when the distance by the fixes is mapped by `fix` and the velocity's by
/// `velocity`.
double left_over(const Moments<4>& m, const Map& fix, const Map& velocity) {
  const std::array<double, 4> east{fix.ee, fix.en, -velocity.ee, -velocity.en},
      north{fix.ne, fix.nn, -velocity.ne, -velocity.nn};
  double left = 0;
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < 4; ++j) left += (east[i] * east[j] + north[i] * north[j]) * m.product(i, j);
  return left / (m.product(2, 2) + m.product(3, 3));
}

}  // namespace

void VelocityDetector::sample(base::Micros time, const sensor::Sample& sample) {
  if (sample.instance != 0) return;
  if (sample.sensor == sensor::Sensor::kGnssVelocity) {
    const auto& v = sample.payload.gnss_velocity.v_n_mps;
    const Vector3 now{static_cast<double>(v[0]), static_cast<double>(v[1]),
                      std::isfinite(v[2]) ? static_cast<double>(v[2]) : 0};
    if (velocity_at_) {
      const double dt = static_cast<double>((time - *velocity_at_).us) * 1e-6;
      if (dt < 0 || dt > kVelocityGap_s)
        broken_ = true;
      else
        flown_m_ = sum(flown_m_, scaled(0.5 * dt, sum(velocity_, now)));
    }
    velocity_at_ = time;
    velocity_ = now;
  } else if (sample.sensor == sensor::Sensor::kGnssPosition &&
             sample.payload.gnss_position.fix >= sensor::GnssFix::k2d) {
    end_leg(time, plane_.at(sample.payload.gnss_position));
  }
}

void VelocityDetector::end_leg(base::Micros time, const PlanePoint& here) {
  const double since = began_ ? static_cast<double>((time - *began_).us) * 1e-6 : 0;
  if (began_ && since >= 0 && since < kLeg_s) return;
  if (began_ && !broken_ && since < 2 * kLeg_s && velocity_at_ && (time - *velocity_at_).us < 1'600'000) {
    const double east = here.east_m - from_.east_m, north = here.north_m - from_.north_m;
    const double length = std::max(std::hypot(east, north), std::hypot(flown_m_[0], flown_m_[1]));
    if (length > kLeastLeg_m) legs_.add({east / length, north / length, flown_m_[0] / length, flown_m_[1] / length});
    climbs_.add({here.up_m - from_.up_m, flown_m_[2]});
  }
  began_ = time;
  from_ = here;
  flown_m_ = {};
  broken_ = !velocity_at_;
}

void VelocityDetector::finish(Findings& findings) {
  judge_up(findings);
  if (legs_.count() < kLeastLegs) return;
  const double swap_e = std::cos(plane_.longitude_rad()), swap_n = 1 / std::max(0.05, std::cos(plane_.latitude_rad()));
  const Map same{Code::kVelocityAxes, 1, 0, 0, 1, "as sent"};
  const std::array<Map, 3> of_fixes{Map{Code::kLatLonSwapped, 0, swap_e, swap_n, 0, "latitude and longitude swapped"},
                                    Map{Code::kLatitudeSign, 1, 0, 0, -1, "the latitude's sign changed"},
                                    Map{Code::kLongitudeSign, -1, 0, 0, 1, "the longitude's sign changed"}};
  const std::array<Map, 5> of_velocity{Map{Code::kVelocityAxes, 0, 1, 1, 0, "East and North swapped"},
                                       Map{Code::kVelocityAxes, 1, 0, 0, -1, "North reversed"},
                                       Map{Code::kVelocityAxes, -1, 0, 0, 1, "East reversed"},
                                       Map{Code::kVelocityAxes, -1, 0, 0, -1, "East and North reversed"},
                                       Map{Code::kVelocityAxes, 0, 1, -1, 0, "East and North turned by 90 deg"}};
  const double stated = left_over(legs_, same, same);
  double best = stated;
  for (const Map& map : of_fixes) best = std::min(best, left_over(legs_, map, same));
  for (const Map& map : of_velocity) best = std::min(best, left_over(legs_, same, map));
  if (best > kRight || best > kBetter * stated) return;
  // A mirrored course turns against the gyroscope; where course and gyroscope agree, the fixes are mirrored.
  const double turn = course_.correlation_with_course();
  const auto name = [&](const Map& map, double left, bool fits_turn) {
    if (left > kAsGood * best + 0.02) return;
    const bool known = std::abs(turn) > kFixesFollows;
    if (known && !fits_turn) return;
    findings.push_back(
        {.code = map.code,
         .uses = kFixes | kGnssVelocity,
         .certainty = 1 - left,
         .evidence =
             text("Over %.0f legs of 8 s the distance by the fixes fits the integral of GNSS velocity to %.0f %% with "
                  "%s, to %.0f %% as sent%s.",
                  legs_.count(), 100 * std::sqrt(left), map.words, 100 * std::sqrt(stated),
                  !known     ? ""
                  : turn > 0 ? "; the gyroscope turns as the velocity's course does"
                             : "; the gyroscope turns against the velocity's course"),
         .change = {}});
  };
  // The path of the wheels is a third device.
  const std::optional<bool> fixes_fit = path_.fixes_fit();
  for (const Map& map : of_fixes)
    if (fixes_fit != true) name(map, left_over(legs_, map, same), turn > 0);
  for (const Map& map : of_velocity)
    if (fixes_fit != false) name(map, left_over(legs_, same, map), turn < 0 || map.ee * map.nn - map.en * map.ne > 0);
}

std::optional<SpeedRatio> VelocityDetector::ratio() const {
  if (legs_.count() < kLeastLegs) return std::nullopt;
  const double fixes2 = legs_.product(0, 0) + legs_.product(1, 1),
               velocity2 = legs_.product(2, 2) + legs_.product(3, 3);
  const double cosine = correlation(legs_.product(0, 2) + legs_.product(1, 3), fixes2, velocity2);
  if (!(cosine > kAlike)) return std::nullopt;
  const double ratio = std::sqrt(fixes2 / velocity2);
  return SpeedRatio{
      .value = ratio,
      .certainty = cosine,
      .evidence = text("The distance by the fixes is %.2f times the integral of the GNSS velocity over %.0f "
                       "legs of 8 s.",
                       ratio, legs_.count())};
}

void VelocityDetector::judge_up(Findings& findings) const {
  if (climbs_.count() < kLeastClimbs || climbs_.covariance(0, 0) < kLeastClimb_m * kLeastClimb_m ||
      climbs_.covariance(1, 1) < kLeastClimb_m * kLeastClimb_m)
    return;
  const double follows = correlation(climbs_.covariance(0, 1), climbs_.covariance(0, 0), climbs_.covariance(1, 1));
  if (follows > -kFixesFollows) return;
  findings.push_back(
      {.code = Code::kVelocityAxes,
       .uses = kFixes | kGnssVelocity,
       .certainty = -follows,
       .evidence = text("The heights of the fixes go against Up of In_GnssVelU: correlation %.2f over %.0f "
                        "legs of 8 s.",
                        follows, climbs_.count()),
       .change = "Send upward as positive in In_GnssVelU."});
}

}  // namespace tetap::doctor
