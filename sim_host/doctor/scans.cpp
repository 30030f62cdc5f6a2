// SPDX-License-Identifier: Apache-2.0
#include "sim_host/doctor/scans.hpp"

#include "tetap/model/differential_drive.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace tetap::doctor {
namespace {

constexpr double kScanApart_s = 0.25, kScanMostApart_s = 0.8;  ///< between two scans that are matched
constexpr double kScanWait_s = 0.15;                           ///< for the wheels' samples about the later scan
constexpr double kScanMostResidual_m = 0.06;
constexpr double kScanMostSigma_rad = 0.02, kScanMostSigma_m = 0.05;
constexpr double kScanLeastPairs = 30;
constexpr double kScanLeastTurn_rad = 0.015;  ///< RMS of the turn between two scans
constexpr double kScanFollows = 0.7;          ///< correlation of the turns
constexpr double kScanCourseSlow_mps = 1;     ///< below, the course of a velocity with 0.1 m/s of noise is loose
constexpr double kScanCourseLeastWindows = 30, kScanCourseLeastTurn_radps = 0.05;
constexpr double kStraight_rad = 0.03;  ///< turn between two scans while the robot drives straight ahead
constexpr double kStraight_m = 0.04;    ///< least way
constexpr int kLeastStraights = 15;
constexpr double kSameDirection = 0.8;     ///< length of the sum over the sum of the lengths
constexpr double kScanTurned_rad = 0.26;   ///< 15 deg: a mount is nearer to its stated angle
constexpr double kScanReversed_rad = 2.6;  ///< 150 deg
constexpr double kScanLeastLate_s = 0.05;
constexpr double kScanLikelier = 20;  ///< logarithm of the likelihood over that of no delay
constexpr double kDegree = 180 / std::numbers::pi;

}  // namespace

slam::ScanMatchOptions ScanDetector::options() {
  slam::ScanMatchOptions options;
  options.sigma_m = 0.03F;
  options.least_share = 0.4F;
  return options;
}

bool ScanDetector::Fit::follows() const { return std::abs(correlation) > kScanFollows; }

void ScanDetector::scan_frame(const SeenFrame& seen) {
  struct Out {
    ScanDetector& detector;
    void sample(const sensor::Sample& sample) { detector.scan(sample); }
  } out{*this};
  assembly_.on_frame(static_cast<std::uint8_t>(seen.offset), seen.frame, 0, seen.time, counters_, out);
}

void ScanDetector::scan(const sensor::Sample& sample) {
  if (sample.instance != 0) return;
  const sensor::PlanarScan& scan = sample.payload.scan;
  const param::LidarParameters& n = robot_.parameters.lidar;
  // Beams of one turn hold at its middle.
  const double to_middle_s =
      0.5e-6 * n.turn_us * scan.beams * std::abs(static_cast<double>(scan.step_rad)) / (2 * std::numbers::pi);
  const double now_s = static_cast<double>(sample.stamp.us - n.delay_us) * 1e-6 + to_middle_s;
  const double since_s = now_s - keyframe_s_;
  if (keyframe_.count() > 0 && since_s >= 0 && since_s < kScanApart_s) return;
  const slam::ScanGeometry geometry{.beams = scan.beams,
                                    .first_rad = scan.first_rad,
                                    .step_rad = scan.step_rad,
                                    .sweep_s = 0,
                                    .min_m = n.min_m,
                                    .max_m = n.max_m};
  slam::ScanMatch<sensor::Scans::kMostBeams, 1>::Motion prior{};
  for (int i = 0; i < 3; ++i) prior.covariance(i, i) = 0.25F;
  if (!match_.begin(geometry, {}, prior)) return;
  const auto ranges = assembly_.pool().ranges(scan);
  while (match_.busy()) match_.work(1'000'000, ranges, keyframe_);
  const slam::ScanMatchResult& found = match_.result();
  const auto sigma = [&found](int i) { return std::sqrt(static_cast<double>(found.pose.covariance(i, i))); };
  if (found.matched() && since_s > 0 && since_s < kScanMostApart_s && waiting_.size() < 64 &&
      static_cast<double>(found.residual_m) < kScanMostResidual_m && sigma(2) < kScanMostSigma_rad) {
    const auto& d = found.pose.mean;
    waiting_.push_back({.from_s = keyframe_s_,
                        .to_s = now_s,
                        .moved_m = {static_cast<double>(d.x_m), static_cast<double>(d.y_m)},
                        .turn_rad = static_cast<double>(d.yaw.radians()),
                        .placed = std::max(sigma(0), sigma(1)) < kScanMostSigma_m});
  }
  keyframe_.clear();
  keyframe_.add(match_.scan(), {});
  keyframe_s_ = now_s;
}

void ScanDetector::sample(base::Micros, const sensor::Sample& sample) {
  const double time_s = static_cast<double>(sample.stamp.us) * 1e-6;
  if (sample.sensor == sensor::Sensor::kImu && sample.instance == robot_.imu && windows_.up_s() != Vector3{}) {
    const auto& turned = sample.payload.imu.dangle_b_rad;
    gyroscope_.add(time_s, {0, dot(windows_.up_s(), {static_cast<double>(turned[0]), static_cast<double>(turned[1]),
                                                     static_cast<double>(turned[2])})});
  }
  const bool wheels = sample.sensor == sensor::Sensor::kWheelCounts || sample.sensor == sensor::Sensor::kWheelSpeed ||
                      sample.sensor == sensor::Sensor::kBodySpeed;
  if (!wheels || sample.instance != 0) return;
  roll(time_s, sample);
  for (; !waiting_.empty() && waiting_.front().to_s + kScanWait_s < time_s; waiting_.pop_front())
    hold(waiting_.front());
}

void ScanDetector::window(const Window& w) {
  if (before_ && before_->velocity_n_mps && w.velocity_n_mps && before_->wheels && w.wheels &&
      before_->wheels->difference_mps && w.wheels->difference_mps && w.start_s - before_->start_s < 1.5) {
    const Vector3 &a = *before_->velocity_n_mps, &b = *w.velocity_n_mps;
    const double turn = std::atan2(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1]);
    const double wheels = 0.5 * (*before_->wheels->difference_mps + *w.wheels->difference_mps) / scale_.track_m;
    if (std::min(std::hypot(a[0], a[1]), std::hypot(b[0], b[1])) > kScanCourseSlow_mps)
      course_.add({wheels, turn / (w.start_s - before_->start_s)});
  }
  before_ = w;
}

void ScanDetector::roll(double time_s, const sensor::Sample& sample) {
  const double dt = time_s - wheels_s_;
  wheels_s_ = time_s;
  Moved::Step step;
  if (sample.sensor == sensor::Sensor::kWheelCounts) {
    const sensor::WheelCounts now = sample.payload.counts;
    const sensor::WheelCounts before = std::exchange(counts_, now).value_or(now);
    const double left = scale_.left_m * model::count_difference(now.left, before.left);
    const double right = scale_.right_m * model::count_difference(now.right, before.right);
    step = {0.5 * (left + right), (right - left) / scale_.track_m};
  } else if (sample.sensor == sensor::Sensor::kWheelSpeed) {
    const double left = scale_.left_speed * static_cast<double>(sample.payload.wheel_speeds.left_mps);
    const double right = scale_.right_speed * static_cast<double>(sample.payload.wheel_speeds.right_mps);
    step = {0.5 * dt * (left + right), dt * (right - left) / scale_.track_m};
  } else {
    const double rate = scale_.yaw_rate * static_cast<double>(sample.payload.body_speed.yaw_rate_radps);
    step = {dt * scale_.speed * static_cast<double>(sample.payload.body_speed.forward_mps),
            std::isfinite(rate) ? dt * rate : 0};
  }
  wheels_.add(time_s, step);
}

void ScanDetector::hold(const Pair& pair) {
  for (const Reference by : {kByWheels, kByGyroscope}) {
    std::array<double, kDelays> turn{};
    bool known = true;
    for (std::size_t k = 0; k < kDelays && known; ++k) {
      const double late_s = kStep_s * (static_cast<double>(k) - kAhead);
      const auto step = (by == kByWheels ? wheels_ : gyroscope_).between(pair.from_s - late_s, pair.to_s - late_s);
      known = step.has_value();
      if (known) turn[k] = step->turn_rad;
    }
    for (std::size_t k = 0; k < kDelays && known; ++k) turns_[by][k].add({pair.turn_rad, turn[k]});
  }
  const auto rolled = wheels_.between(pair.from_s, pair.to_s);
  if (!rolled || !pair.placed || std::abs(rolled->way_m) < kStraight_m || std::abs(pair.turn_rad) > kStraight_rad ||
      std::abs(pair.moved_m) < kStraight_m)
    return;
  ahead_m_ += rolled->way_m > 0 ? pair.moved_m : -pair.moved_m;
  straight_m_ += std::abs(pair.moved_m);
  ++straights_;
}

std::optional<ScanDetector::Fit> ScanDetector::fit(Reference reference) const {
  const Turns& turns = turns_[reference];
  const double pairs = turns[0].count();
  if (pairs < kScanLeastPairs || turns[kAhead].covariance(1, 1) < kScanLeastTurn_rad * kScanLeastTurn_rad)
    return std::nullopt;
  std::array<double, kDelays> follows{}, left{};
  std::size_t best = 0;
  for (std::size_t k = 0; k < kDelays; ++k) {
    follows[k] = correlation(turns[k].covariance(0, 1), turns[k].covariance(0, 0), turns[k].covariance(1, 1));
    left[k] = 1 - follows[k] * follows[k];
    if (left[k] < left[best]) best = k;
  }
  Fit fit{.correlation = follows[best], .at_stamp = follows[kAhead], .pairs = pairs};
  fit.likelier = 0.5 * pairs * std::log(left[kAhead] / std::max(left[best], 1e-9));
  double between = 0;
  if (best > 0 && best + 1 < kDelays) {
    const double bend = left[best - 1] - 2 * left[best] + left[best + 1];
    if (bend > 0) between = 0.5 * (left[best - 1] - left[best + 1]) / bend;
  }
  fit.late_s = kStep_s * (static_cast<double>(best) - kAhead + between);
  return fit;
}

double ScanDetector::direction_rad(bool mirrored) const {
  if (straights_ < kLeastStraights || std::abs(ahead_m_) < kSameDirection * straight_m_ || robot_.name.empty())
    return 0;
  const std::complex<double> seen = mirrored ? std::conj(ahead_m_) : ahead_m_;
  return std::arg(seen * std::polar(1.0, static_cast<double>(robot_.parameters.lidar.yaw_rad)));
}

void ScanDetector::finish(Findings& findings) {
  const auto wheels = fit(kByWheels), gyroscope = fit(kByGyroscope);
  const auto sign = [](const std::optional<Fit>& by) {
    return !by || !by->follows() ? 0 : by->correlation > 0 ? 1 : -1;
  };
  const int votes = sign(wheels) + sign(gyroscope);
  const std::optional<Code> of_wheels = votes < 0 ? judge_sense(wheels, gyroscope, findings) : std::nullopt;
  if (of_wheels != Code::kWheelsReversed) judge_direction(votes < 0 && !of_wheels, findings);
  if (gyroscope && gyroscope->follows())
    judge_delay(gyroscope, "gyroscope's", kGyroscope, findings);
  else
    judge_delay(wheels, "wheels'", kWheels, findings);
}

double ScanDetector::wheels_by_course() const {
  constexpr double kLeast2 = kScanCourseLeastTurn_radps * kScanCourseLeastTurn_radps;
  if (course_.count() < kScanCourseLeastWindows || course_.covariance(1, 1) < kLeast2) return 0;
  return correlation(course_.covariance(0, 1), course_.covariance(0, 0), course_.covariance(1, 1));
}

std::optional<Code> ScanDetector::judge_sense(const std::optional<Fit>& wheels, const std::optional<Fit>& gyroscope,
                                              Findings& findings) const {
  std::string words;
  Devices uses = kNoDevice;
  const auto add = [&](const std::optional<Fit>& by, const char* device, Devices of) {
    if (!by || !by->follows()) return;
    words += text("%s the %s (correlation %.2f over %.0f pairs of scans)", words.empty() ? "" : " and", device,
                  by->correlation, by->pairs);
    uses |= of;
  };
  add(wheels, "wheels", kWheels);
  add(gyroscope, "gyroscope", kGyroscope);
  // Without a third device wheels that turn the other way look the same.
  std::optional<Code> beside;
  const double course = wheels_by_course();
  const bool wheels_wrong = uses == kWheels && course < -kScanFollows;
  const bool back = std::abs(direction_rad(!wheels_wrong)) > kScanReversed_rad;
  if (uses == kWheels) beside = back ? Code::kWheelsReversed : Code::kWheelsSwapped;
  std::string evidence = "The robot turns by its scans against" + words + ".";
  if (beside && std::abs(course) > kScanFollows) {
    evidence += course > 0 ? text(" The course by GNSS turns with the wheels (%.2f).", course)
                           : text(" The course by GNSS turns against the wheels (%.2f).", course);
    if (wheels_wrong) {
      findings.push_back({.code = *beside,
                          .uses = kScanner | kGnssVelocity,
                          .certainty = -course,
                          .evidence = evidence,
                          .change = {}});
      return beside;
    }
    beside.reset();
  }
  findings.push_back({.code = Code::kScanMirrored, .uses = uses, .evidence = evidence, .change = {}, .beside = beside});
  if (back)
    findings.back().change =
        text("Negate First and Step of In_ScanHead and set lidar.yaw_rad to %.2f.", std::numbers::pi);
  if (beside)
    findings.push_back({.code = *beside,
                        .uses = kScanner,
                        .certainty = 0.5,
                        .evidence = evidence,
                        .change = {},
                        .beside = Code::kScanMirrored});
  return std::nullopt;
}

void ScanDetector::judge_direction(bool mirrored, Findings& findings) const {
  const double off_rad = direction_rad(mirrored);
  if (std::abs(off_rad) < kScanTurned_rad || (mirrored && std::abs(off_rad) > kScanReversed_rad)) return;
  const double yaw_rad =
      std::remainder(static_cast<double>(robot_.parameters.lidar.yaw_rad) - off_rad, 2 * std::numbers::pi);
  findings.push_back(
      {.code = Code::kScanTurned,
       .uses = kWheels,
       .evidence =
           text("While the wheels drive straight ahead, the scans move at %.0f deg to the left (%d pairs, %.1f m).",
                kDegree * off_rad, straights_, straight_m_),
       .change = text("Set lidar.yaw_rad to %.2f (%.0f deg), or turn the scanner.", yaw_rad, kDegree * yaw_rad)});
}

void ScanDetector::judge_delay(const std::optional<Fit>& by, const char* device, Devices uses,
                               Findings& findings) const {
  if (!by || !by->follows() || by->late_s < kScanLeastLate_s || by->likelier < kScanLikelier || robot_.name.empty())
    return;
  findings.push_back(
      {.code = Code::kScanLate,
       .uses = uses,
       .evidence = text("The turn between scans fits the %s %.0f ms before their stamps (correlation %.3f, %.3f at the "
                        "stamps; %.0f pairs).",
                        device, 1e3 * by->late_s, std::abs(by->correlation), std::abs(by->at_stamp), by->pairs),
       .change = text("Stamp In_ScanHead with the time of the first beam, or add %.0f to lidar.delay_us.",
                      1e6 * by->late_s)});
}

}  // namespace tetap::doctor
