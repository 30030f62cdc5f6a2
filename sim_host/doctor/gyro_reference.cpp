// SPDX-License-Identifier: Apache-2.0
#include "sim_host/doctor/gyro_reference.hpp"

#include "sim_host/doctor/gyro_unit.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tetap::doctor {
namespace {

constexpr double kGyroReferenceSlow_mps = 2;  ///< below, the course of a velocity with 0.1 m/s of noise is loose
constexpr double kMostTurn_rad = 1;           ///< in a second: more may be a wrap
constexpr double kMostChordTurn_rad = 2;  ///< more may be a wrap; a course is noisy, and a lower limit cuts it alone
constexpr double kGyroReferenceLeastWindows = 15;
constexpr double kLeastTurn_radps = 0.02;         ///< RMS of the course's rate
constexpr double kGyroReferenceFollows = 0.7;     ///< correlation: the course of noisy fixes keeps that much
constexpr double kChord_m = 6, kChordSigmas = 4;  ///< fixes one after the other share most of their error
constexpr double kMostChord_s = 20;
constexpr int kLeastFieldWindows = 20;
constexpr double kFieldFits = 0.25;  ///< share of the squares left over by another unit: the field's noise keeps some

double wrapped(double rad) { return rad - 2 * std::numbers::pi * std::round(rad / (2 * std::numbers::pi)); }

}  // namespace

void CourseDetector::sample(base::Micros time, const sensor::Sample& sample) {
  if (sensor::is_imu(sample, imu_)) {
    const auto& angle = sample.payload.imu.dangle_b_rad;
    turned_rad_ =
        sum(turned_rad_, {static_cast<double>(angle[0]), static_cast<double>(angle[1]), static_cast<double>(angle[2])});
  } else if (sample.sensor == sensor::Sensor::kGnssPosition && sample.instance == 0 &&
             sample.payload.gnss_position.fix >= sensor::GnssFix::k2d) {
    const sensor::GnssPosition& fix = sample.payload.gnss_position;
    const double sigma_m = std::isfinite(fix.horizontal_acc_m) ? static_cast<double>(fix.horizontal_acc_m) : 2;
    end_chord(static_cast<double>(time.us) * 1e-6, plane_.at(fix), sigma_m);
  }
}

void CourseDetector::end_chord(double time_s, const PlanePoint& here, double sigma_m) {
  const double east = here.east_m - from_.east_m, north = here.north_m - from_.north_m;
  const double since_s = began_s_ ? time_s - *began_s_ : -1;
  if (began_s_ && since_s >= 0 && since_s < kMostChord_s) {
    if (std::hypot(east, north) < std::max(kChord_m, kChordSigmas * sigma_m)) return;
    const Chord now{.course_rad = std::atan2(north, east),
                    .middle_s = time_s - 0.5 * since_s,
                    .middle_turned_rad = scaled(0.5, sum(turned_rad_, turned_from_rad_))};
    const double turn = chord_ ? wrapped(now.course_rad - chord_->course_rad) : 0;
    if (chord_ && std::abs(turn) < kMostChordTurn_rad) {
      const double step_s = now.middle_s - chord_->middle_s, per_s = 1 / step_s;
      const Vector3 rate = scaled(per_s, sum(now.middle_turned_rad, scaled(-1, chord_->middle_turned_rad)));
      by_fixes_.add({rate[0], rate[1], rate[2], per_s * turn});
      by_fixes_s_ += step_s;
    }
    chord_ = now;
  } else {
    chord_.reset();
  }
  began_s_ = time_s;
  from_ = here;
  turned_from_rad_ = turned_rad_;
}

void CourseDetector::window(const Window& w) {
  if (before_ && before_->velocity_n_mps && w.velocity_n_mps && before_->turn_s_radps && w.turn_s_radps) {
    const Vector3 &a = *before_->velocity_n_mps, &b = *w.velocity_n_mps;
    const double step_s = w.start_s - before_->start_s;
    const double turn = wrapped(std::atan2(b[1], b[0]) - std::atan2(a[1], a[0]));
    if (std::hypot(a[0], a[1]) > kGyroReferenceSlow_mps && std::hypot(b[0], b[1]) > kGyroReferenceSlow_mps &&
        step_s < 1.5 && std::abs(turn) < kMostTurn_rad) {
      const Vector3 rate = scaled(0.5, sum(*before_->turn_s_radps, *w.turn_s_radps));
      by_velocity_.add({rate[0], rate[1], rate[2], turn / step_s});
    }
  }
  if (w.turn_s_radps) up_s_ = w.up_s;
  before_ = w;
}

double CourseDetector::correlation_of(const Moments<4>& moments) const {
  if (moments.count() < kGyroReferenceLeastWindows || moments.covariance(3, 3) < kLeastTurn_radps * kLeastTurn_radps)
    return 0;
  const std::array<double, 4> gyro{up_s_[0], up_s_[1], up_s_[2], 0}, course{0, 0, 0, 1};
  return correlation(moments.covariance(gyro, course), moments.covariance(gyro, gyro), moments.covariance(3, 3));
}

std::optional<TurnRatio> CourseDetector::ratio() const {
  const bool velocity = by_velocity_.count() >= kGyroReferenceLeastWindows;
  const Moments<4>& moments = velocity ? by_velocity_ : by_fixes_;
  if (moments.count() < kGyroReferenceLeastWindows || moments.covariance(3, 3) < kLeastTurn_radps * kLeastTurn_radps)
    return std::nullopt;
  const std::array<double, 4> gyro{up_s_[0], up_s_[1], up_s_[2], 0}, course{0, 0, 0, 1};
  auto found = turn_ratio(moments.covariance(gyro, gyro), moments.covariance(gyro, course), moments.covariance(3, 3),
                          moments.count(), kGyroReferenceFollows);
  if (!found) return found;
  if (!velocity) found->seconds = by_fixes_s_;
  found->device = velocity ? "the course of the GNSS velocity" : "the course of the fixes";
  found->uses = velocity ? kGnssVelocity : kFixes;
  return found;
}

void CourseDetector::finish(Findings& findings) {
  const bool velocity = by_velocity_.count() >= kGyroReferenceLeastWindows;
  const Moments<4>& moments = velocity ? by_velocity_ : by_fixes_;
  if (std::abs(correlation_of(moments)) < kGyroReferenceFollows) return;
  const std::array<double, 4> gyro{up_s_[0], up_s_[1], up_s_[2], 0};
  name_gyro_unit(std::sqrt(moments.covariance(gyro, gyro) / moments.covariance(3, 3)),
                 velocity ? "the course of the GNSS velocity" : "the course of the fixes",
                 velocity ? kGnssVelocity : kFixes, velocity ? moments.count() : by_fixes_s_, findings);
}

Vector3 FieldDetector::field_b_uT(const Vector3& flux_s_uT) const {
  const auto& magnetic = robot_.parameters.magnetic;
  Vector3 flux = flux_s_uT;
  for (std::size_t i = 0; i < 3; ++i) flux[i] -= static_cast<double>(magnetic.hard_iron_uT[i]);
  Matrix3 rows{};
  for (std::size_t i = 0; i < 9; ++i) rows[i / 3][i % 3] = static_cast<double>(magnetic.mounting_bs[i]);
  return rotated(rows, flux);
}

void FieldDetector::window(const Window& w) {
  if (before_ && before_->flux_s_uT && w.flux_s_uT && before_->turn_s_radps && w.turn_s_radps && robot_.mounting &&
      w.start_s - before_->start_s < 1.5) {
    const Vector3 was = field_b_uT(*before_->flux_s_uT), is = field_b_uT(*w.flux_s_uT);
    const Vector3 turn_s = scaled(0.5 * (w.start_s - before_->start_s), sum(*before_->turn_s_radps, *w.turn_s_radps));
    const Vector3 turn = rotated(*robot_.mounting, turn_s);
    turns_.add(rotated(transposed(*robot_.mounting), was), rotated(transposed(*robot_.mounting), is), turn_s);
    const auto left2 = [&](double factor) {
      const Vector3 left = sum(is, scaled(-1, turned(scaled(-factor, turn), was)));
      return dot(left, left);
    };
    constexpr double kDegree = std::numbers::pi / 180;
    const Vector3 change = sum(is, scaled(-1, was));
    still2_ += dot(change, change);
    left2_[0] += left2(1), left2_[1] += left2(kDegree), left2_[2] += left2(1 / kDegree);
    ++windows_;
  }
  before_ = w;
}

void FieldDetector::finish(Findings& findings) {
  if (windows_ < kLeastFieldWindows) return;
  for (const std::size_t i : {1U, 2U}) {
    if (left2_[i] > kFieldFits * left2_[0] || left2_[i] > kFieldFits * still2_) continue;
    name_gyro_unit(i == 1 ? 180 / std::numbers::pi : std::numbers::pi / 180, "the magnetic field", kNoDevice, windows_,
                   findings);
  }
}

}  // namespace tetap::doctor
