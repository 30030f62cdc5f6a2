// SPDX-License-Identifier: Apache-2.0
#include "sim_host/doctor/path.hpp"

#include "tetap/model/differential_drive.hpp"

#include <algorithm>
#include <cmath>

namespace tetap::doctor {
namespace {

constexpr double kPathChord_m = 12;      ///< a chord by the fixes at least ...
constexpr double kPathSigmas = 8;        ///< ... and so many of their sigma
constexpr double kPathMostChord_s = 60;  ///< a gyroscope's bias turns the path by a degree a minute and more
constexpr double kMostResidual = 1;      ///< bound of one pair: jumps of a receiver do not decide
constexpr double kLeastPairs = 6;
constexpr double kPathRight = 0.15;  ///< mean square of log ratio and angle left over with axes that fit
constexpr double kPathBetter = 0.5;  ///< share of the square that the stated axes leave
constexpr double kPathAsGood = 1.5;
constexpr std::size_t kLeastRatios = 8;
constexpr double kPathScale =
    1.15;                        ///< wheels, tyres and slip are within some percent; a wrong radius is a tenth and more
constexpr double kSpread = 1.5;  ///< between the quartiles of the chords' ratios: a factor is the same everywhere
constexpr double kNarrow = 1.3;  ///< between the quartiles: more, and a factor near 1 is not known to be 1
constexpr double kGap_s = 0.5;

}  // namespace

void PathDetector::sample(base::Micros time, const sensor::Sample& sample) {
  switch (sample.sensor) {
    case sensor::Sensor::kImu:
      if (sample.instance == robot_.imu) turn_by(time, sample.payload.imu);
      break;
    case sensor::Sensor::kWheelCounts:
    case sensor::Sensor::kWheelSpeed:
    case sensor::Sensor::kBodySpeed:
      if (sample.instance == 0) roll(time, sample);
      break;
    case sensor::Sensor::kGnssPosition: {
      const sensor::GnssPosition& fix = sample.payload.gnss_position;
      if (sample.instance != 0 || fix.fix < sensor::GnssFix::k2d) break;
      const double sigma_m = std::isfinite(fix.horizontal_acc_m) ? static_cast<double>(fix.horizontal_acc_m) : 2;
      end_chord(time, plane_.at(fix), sigma_m);
      break;
    }
    default:
      break;
  }
}

void PathDetector::turn_by(base::Micros, const sensor::ImuSample& imu) {
  const Vector3& up = windows_.up_s();
  if (up == Vector3{}) return;
  gyroscope_ = true;
  yaw_rad_ += dot(up, {static_cast<double>(imu.dangle_b_rad[0]), static_cast<double>(imu.dangle_b_rad[1]),
                       static_cast<double>(imu.dangle_b_rad[2])});
}

void PathDetector::roll(base::Micros time, const sensor::Sample& sample) {
  const double dt = wheels_at_ ? static_cast<double>((time - *wheels_at_).us) * 1e-6 : -1;
  wheels_at_ = time;
  const bool usable = dt >= 0 && dt < kGap_s;
  double way = 0, turn = 0;
  if (sample.sensor == sensor::Sensor::kWheelCounts) {
    const sensor::WheelCounts now = sample.payload.counts;
    if (counts_) {
      const double left = scale_.left_m * model::count_difference(now.left, counts_->left);
      const double right = scale_.right_m * model::count_difference(now.right, counts_->right);
      way = 0.5 * (left + right), turn = (right - left) / scale_.track_m;
    }
    counts_ = now;
  } else if (sample.sensor == sensor::Sensor::kWheelSpeed) {
    const double left = scale_.left_speed * static_cast<double>(sample.payload.wheel_speeds.left_mps);
    const double right = scale_.right_speed * static_cast<double>(sample.payload.wheel_speeds.right_mps);
    way = 0.5 * dt * (left + right), turn = dt * (right - left) / scale_.track_m;
  } else {
    way = dt * scale_.speed * static_cast<double>(sample.payload.body_speed.forward_mps);
    const double rate = scale_.yaw_rate * static_cast<double>(sample.payload.body_speed.yaw_rate_radps);
    turn = std::isfinite(rate) ? dt * rate : 0;
  }
  if (!usable) return;
  if (!gyroscope_) yaw_rad_ += turn;
  rolled_m_ += way;
  path_m_ += way * Complex{std::cos(yaw_rad_), std::sin(yaw_rad_)};
}

void PathDetector::end_chord(base::Micros time, const PlanePoint& here, double sigma_m) {
  const Complex at{here.east_m, here.north_m};
  const double since = began_ ? static_cast<double>((time - *began_).us) * 1e-6 : -1;
  if (!wheels_at_) return;
  if (!began_ || since < 0 || since > kPathMostChord_s) {
    fixes_before_.reset();
  } else {
    const Complex fixes = at - from_, path = path_m_ - path_from_;
    const double least = std::max(kPathChord_m, kPathSigmas * sigma_m);
    if (std::abs(fixes) < least) return;
    if (fixes_before_ && std::abs(path) > 0 && std::abs(*path_before_) > 0)
      add_pair(*fixes_before_, *path_before_, fixes, path);
    if (std::abs(path) > 0 && seen_++ % every_ == 0) {
      ratios_.push_back(static_cast<float>(std::abs(fixes) / std::abs(path)));
      if (ratios_.size() >= kRatios) {
        for (std::size_t i = 0; 2 * i < ratios_.size(); ++i) ratios_[i] = ratios_[2 * i];
        ratios_.resize(kRatios / 2);
        every_ *= 2;
      }
    }
    fixes_before_ = fixes;
    path_before_ = path;
  }
  began_ = time;
  from_ = at;
  path_from_ = path_m_;
}

void PathDetector::add_pair(Complex fixes_before, Complex path_before, Complex fixes, Complex path) {
  const double swap_e = std::cos(plane_.longitude_rad()), swap_n = 1 / std::max(0.05, std::cos(plane_.latitude_rad()));
  const auto swapped = [&](Complex z) { return Complex{swap_e * z.imag(), swap_n * z.real()}; };
  const Complex by_path = path / path_before;
  const auto left = [&](Complex now, Complex before) {
    const double residual = std::norm(std::log((now / before) / by_path));
    return std::min(residual, kMostResidual);
  };
  left_[0] += left(fixes, fixes_before);
  left_[1] += left(swapped(fixes), swapped(fixes_before));
  left_[2] += left(std::conj(fixes), std::conj(fixes_before));
  left_[3] += left(-std::conj(fixes), -std::conj(fixes_before));
  ++pairs_;
}

std::optional<bool> PathDetector::fixes_fit() const {
  if (pairs_ < kLeastPairs) return std::nullopt;
  const double as_sent = left_[0], other = *std::min_element(left_.begin() + 1, left_.end());
  if (std::min(as_sent, other) > kPathRight * pairs_) return std::nullopt;
  if (other <= kPathBetter * as_sent) return false;
  return as_sent <= kPathBetter * other ? std::optional(true) : std::nullopt;
}

void PathDetector::finish(Findings& findings) {
  if (fixes_fit() != false) return;
  const double best = *std::min_element(left_.begin(), left_.end());
  constexpr std::array kOf{Code::kLatLonSwapped, Code::kLatitudeSign, Code::kLongitudeSign};
  constexpr std::array kWords{"latitude and longitude swapped", "the latitude's sign changed",
                              "the longitude's sign changed"};
  for (std::size_t i = 0; i < kOf.size(); ++i) {
    if (left_[i + 1] > kPathAsGood * best) continue;
    findings.push_back(
        {.code = kOf[i],
         .uses = kFixes | kWheels | kGyroscope,
         .certainty = 0.9 - left_[i + 1] / pairs_,
         .evidence = text("Over %.0f pairs of chords the distance by the fixes fits the path of wheels%s to "
                          "%.2f (RMS of angle and ratio) with %s, to %.2f as sent.",
                          pairs_, gyroscope_ ? " and gyroscope" : "", std::sqrt(left_[i + 1] / pairs_), kWords[i],
                          std::sqrt(left_[0] / pairs_)),
         .change = {}});
  }
}

std::optional<SpeedRatio> PathDetector::scale() const {
  if (ratios_.size() < kLeastRatios || robot_.name.empty()) return std::nullopt;
  std::vector<float> sorted = ratios_;
  std::sort(sorted.begin(), sorted.end());
  const auto quartile = [&](std::size_t k) { return static_cast<double>(sorted[sorted.size() * k / 4]); };
  const double low = quartile(1), median = quartile(2), high = quartile(3);
  if (high > kSpread * low) return std::nullopt;
  // Between the quartiles the factor is not known: it is 1 where they enclose that.
  const bool shown = low > kPathScale || high < 1 / kPathScale;
  if (!shown && high > kNarrow * low) return std::nullopt;
  return SpeedRatio{.value = shown ? median : 1,
                    .certainty = 0.9,
                    .evidence = text("The fixes lie %.2f times as far apart as the path of the wheels is long (median "
                                     "of %zu chords; half of them from %.2f to %.2f).",
                                     median, seen_, low, high)};
}

}  // namespace tetap::doctor
