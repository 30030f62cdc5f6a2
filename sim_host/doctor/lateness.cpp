// SPDX-License-Identifier: Apache-2.0
#include "sim_host/doctor/lateness.hpp"

#include <algorithm>
#include <cmath>

namespace tetap::doctor {
namespace {

constexpr double kHistory_s = 3.5;
constexpr std::size_t kMostRolled = 2048;
constexpr double kHalf_s = 0.1;       ///< half of the span of a speed by wheels
constexpr double kMostAge_s = 0.3;    ///< age of a wheel sample: beyond, its arrival is taken
constexpr double kMostPause_s = 0.5;  ///< between two samples of the wheels
constexpr double kChange_mps = 1;     ///< a change of speed that shows a delay
constexpr int kLeastChanges = 2;
constexpr double kLeastSpeeds = 20;
constexpr double kLateFollows = 0.8;  ///< correlation of the two speeds at the delay that fits best
constexpr double kLeastLate_s = 0.07;
constexpr double kShareOfInterval = 0.05;  ///< later by that: a receiver's velocity may be a mean over its interval
constexpr double kSpoils_s = 0.3;  ///< later, and comparisons second by second hold other motion against the receiver
constexpr double kLikelier = 20;   ///< logarithm of the likelihood over that of no delay

}  // namespace

void LatenessDetector::sample(base::Micros time, const sensor::Sample& sample) {
  const double now_s = static_cast<double>(time.us) * 1e-6;
  receiver_ |= sample.sensor == sensor::Sensor::kGnssVelocity || sample.sensor == sensor::Sensor::kGnssPosition;
  if (sample.sensor == sensor::Sensor::kGnssVelocity && sample.instance == 0) {
    const auto& v = sample.payload.gnss_velocity.v_n_mps;
    const double speed = std::hypot(static_cast<double>(v[0]), static_cast<double>(v[1]));
    if (!first_s_) first_s_ = now_s;
    last_s_ = now_s;
    ++velocities_;
    if (std::isfinite(speed) && waiting_.size() < kMostRolled)
      waiting_.push_back({static_cast<double>(sample.stamp.us) * 1e-6, speed});
    return;
  }
  const bool wheels = sample.sensor == sensor::Sensor::kWheelCounts || sample.sensor == sensor::Sensor::kWheelSpeed ||
                      sample.sensor == sensor::Sensor::kBodySpeed;
  if (!wheels || sample.instance != 0) return;
  if (!rolled_.empty() && now_s < rolled_.back().time_s - kMostAge_s - kMostPause_s) rolled_.clear();
  // A speed may hold at its stamp, or be the mean since the one before: between the two it is a quarter early.
  const double stamp_s = static_cast<double>(sample.stamp.us) * 1e-6;
  double at_s = std::abs(stamp_s - now_s) < kMostAge_s ? stamp_s : now_s;
  if (sample.sensor != sensor::Sensor::kWheelCounts)
    at_s += std::min(kMostPause_s, std::max(0.0, at_s - stamped_s_)) / 4;
  stamped_s_ = stamp_s;
  if (!rolled_.empty() && at_s <= rolled_.back().time_s) return;
  rolled_.push_back({at_s, path_.rolled_m()});
  while (rolled_.size() > kMostRolled || rolled_.front().time_s < now_s - kHistory_s) rolled_.pop_front();
  while (!waiting_.empty() && waiting_.front().time_s + kAhead * kStep_s + kHalf_s <= now_s) {
    hold_against(waiting_.front());
    waiting_.pop_front();
  }
}

std::optional<double> LatenessDetector::way_m(double time_s) const {
  const auto after = std::lower_bound(rolled_.begin(), rolled_.end(), time_s,
                                      [](const Rolled& one, double t) { return one.time_s < t; });
  if (after == rolled_.begin() || after == rolled_.end()) return std::nullopt;
  const Rolled &a = *(after - 1), &b = *after;
  if (b.time_s - a.time_s > kMostPause_s || !(b.time_s > a.time_s)) return std::nullopt;
  return a.way_m + (time_s - a.time_s) / (b.time_s - a.time_s) * (b.way_m - a.way_m);
}

std::optional<double> LatenessDetector::wheels_mps(double time_s) const {
  const auto from = way_m(time_s - kHalf_s), to = way_m(time_s + kHalf_s);
  if (!from || !to) return std::nullopt;
  return std::abs(*to - *from) / (2 * kHalf_s);
}

void LatenessDetector::hold_against(const Speed& gnss) {
  std::array<double, kDelays> wheels{};
  for (std::size_t k = 0; k < kDelays; ++k) {
    const auto one = wheels_mps(gnss.time_s - kStep_s * (static_cast<double>(k) - kAhead));
    if (!one) return;
    wheels[k] = *one;
  }
  count_change(gnss.speed_mps);
  for (std::size_t k = 0; k < kDelays; ++k) speeds_[k].add({gnss.speed_mps, wheels[k]});
}

/// The level is the last extreme, at first the first speed; 1 m/s away from it on the other side is a change.
void LatenessDetector::count_change(double speed_mps) {
  if (!level_known_) {
    level_known_ = true;
    level_mps_ = speed_mps;
  }
  if (changes_ == 0) rising_ = speed_mps < level_mps_;  // the first change may go either way
  const double beyond = rising_ ? speed_mps - level_mps_ : level_mps_ - speed_mps;
  if (beyond > 0) {
    level_mps_ = speed_mps;
  } else if (-beyond >= kChange_mps) {
    ++changes_;
    rising_ = !rising_;
    level_mps_ = speed_mps;
  }
}

std::optional<std::string> LatenessDetector::untold() const {
  if (!receiver_ || tells()) return std::nullopt;
  return text(
      "whether the receiver is late: that takes a GNSS velocity and wheels over %d changes of speed by 1 m/s "
      "(%d seen, %.0f velocities)",
      kLeastChanges, changes_, speeds_[0].count());
}

bool LatenessDetector::tells() const { return changes_ >= kLeastChanges && speeds_[0].count() >= kLeastSpeeds; }

void LatenessDetector::finish(Findings& findings) {
  if (!tells()) return;
  std::array<double, kDelays> seen{}, left{};  // share of the variance of the speed by GNSS
  for (std::size_t k = 0; k < kDelays; ++k) {
    const Moments<2>& m = speeds_[k];
    const double follows = correlation(m.covariance(0, 1), m.covariance(0, 0), m.covariance(1, 1));
    seen[k] = follows > 0 ? 1 - follows * follows : 1;
  }
  // Wheels at 10 Hz and a receiver at 1 Hz make every other delay fit better: three places together do not.
  std::size_t best = 0;
  for (std::size_t k = 0; k < kDelays; ++k) {
    left[k] = 0.25 * (seen[k == 0 ? 0 : k - 1] + 2 * seen[k] + seen[std::min(k + 1, kDelays - 1)]);
    if (left[k] < left[best]) best = k;
  }
  if (best == 0 || best + 1 == kDelays || left[best] > 1 - kLateFollows * kLateFollows) return;
  const double bend = left[best - 1] - 2 * left[best] + left[best + 1];
  const double between = bend > 0 ? 0.5 * (left[best - 1] - left[best + 1]) / bend : 0;
  const double measured_s = kStep_s * (static_cast<double>(best) - kAhead + between);
  const double stated_us = path_.robot().parameters.gnss.delay_us;
  const double late_s = measured_s - 1e-6 * stated_us;  // beyond what the robot states
  const double likelier = 0.5 * speeds_[0].count() * std::log(left[kAhead] / std::max(left[best], 1e-9));
  const double interval_s = (last_s_ - first_s_.value_or(last_s_)) / std::max(1, velocities_ - 1);
  if (late_s < kLeastLate_s + kShareOfInterval * interval_s || likelier < kLikelier) return;
  findings.push_back(
      {.code = Code::kReceiverLate,
       .uses = kWheels | kGnssVelocity,
       .evidence =
           text("The GNSS velocity fits the wheels' speed %.0f ms before its stamp (correlation %.3f, %.3f at the "
                "stamp; %.0f samples, %d changes of speed by 1 m/s).",
                1e3 * measured_s, std::sqrt(1 - left[best]), std::sqrt(1 - left[kAhead]), speeds_[0].count(), changes_),
       .change =
           text("Stamp fixes and velocities with the time for which they hold, %.0f ms earlier, or set gnss.delay_us.",
                1e3 * late_s),
       .spoils = late_s > kSpoils_s ? Devices{kFixes | kGnssVelocity} : Devices{kNoDevice},
       .remedies = {{{.path = "gnss.delay_us", .values = {stated_us + 1e3 * std::round(1e3 * late_s)}}}}});
}

}  // namespace tetap::doctor
