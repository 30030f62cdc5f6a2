// SPDX-License-Identifier: Apache-2.0
#include "sim_host/doctor/camera.hpp"

#include "tetap/bus/codec.hpp"
#include "tetap/bus/messages.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tetap::doctor {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kLongest_s = 0.35;  ///< between two images
constexpr double kKept_s = 2;        ///< span of the gyroscope that is kept
constexpr std::size_t kMost = 4096, kLeastFeatures = 8;
constexpr double kBesideView = 0.7;  ///< share of the robot's up along the view: beyond, it looks up or down
constexpr double kLeastTurns = 60;   ///< pairs of images
constexpr double kLeastCameraTurn_radps = 0.03;  ///< RMS of the turns
constexpr double kSharedTurn = 0.5;              ///< share of the camera's turns by the gyroscope's
constexpr double kCameraTurned_rad = 0.35;       ///< 20 deg
constexpr double kUpsideDown_rad = 2.6;          ///< 150 deg
constexpr double kLeast_mps = 0.3;
constexpr double kFocal = 0.1, kFocalSigmas = 3;  ///< as a share of the stated one
constexpr double kLate_s = 0.05;
constexpr double kLaterLikelier = 20;     ///< logarithm of the likelihood over that of no delay
constexpr double kStraight_radps = 0.05;  ///< the turn at which expansion is looked at
constexpr double kBesideMiddle = 0.05;    ///< distance from the middle row

Vector3 row_of(const std::array<float, 9>& m, std::size_t row) {
  return {static_cast<double>(m[3 * row]), static_cast<double>(m[3 * row + 1]), static_cast<double>(m[3 * row + 2])};
}
/// Motion of an image point far away, for a turn of the camera.
std::array<double, 2> motion(double x, double y, const Vector3& w) {
  return {x * y * w[0] - (1 + x * x) * w[1] + y * w[2], (1 + y * y) * w[0] - x * y * w[1] - x * w[2]};
}
/// Solves m w = b; nothing where m is near to singular.
std::optional<Vector3> solved(const Matrix3& m, const Vector3& b) {
  const Vector3 c0 = cross(m[1], m[2]), c1 = cross(m[2], m[0]), c2 = cross(m[0], m[1]);
  const double det = dot(m[0], c0), size = m[0][0] * m[1][1] * m[2][2];
  if (!(det > 1e-6 * size)) return std::nullopt;
  return scaled(1 / det, sum(scaled(b[0], c0), sum(scaled(b[1], c1), scaled(b[2], c2))));
}

}  // namespace

CameraDetector::CameraDetector(const RobotFacts& robot, const PathDetector& path) : robot_(robot), path_(path) {
  const param::CameraParameters& n = robot.parameters.camera;
  if (robot.name.empty() || !n.any() || !robot.up_s) return;
  up_s_ = *robot.up_s;
  // The rows of a rotation into the body are the body's axes.
  ahead_c_ = row_of(n.mounting_bc, 0);
  left_c_ = row_of(n.mounting_bc, 1);
  up_c_ = row_of(n.mounting_bc, 2);
  if (std::abs(up_c_[2]) > kBesideView) return;
  across_c_ = unit(cross({0, 0, 1}, up_c_));
  usable_ = true;
}

void CameraDetector::frame(const SeenFrame& seen) {
  if (!usable_) return;
  const auto bytes = bus::payload(seen.frame);
  const param::CameraParameters& n = robot_.parameters.camera;
  if (seen.offset == bus::InFeature::kOffset) {
    const auto one = bus::decode<bus::InFeature>(bytes);
    if (!one || one->inst != 0 || !std::isfinite(one->u) || !std::isfinite(one->v)) return;
    if (one->stamp_us != stamp_us_) now_.features.clear();
    stamp_us_ = one->stamp_us;
    if (now_.features.size() >= kMost) return;
    now_.features.push_back({one->track_id, static_cast<double>((one->u - n.cu_px) / n.fu_px),
                             static_cast<double>((one->v - n.cv_px) / n.fv_px)});
  } else if (seen.offset == bus::InImage::kOffset) {
    const auto one = bus::decode<bus::InImage>(bytes);
    if (!one || one->inst != 0) return;
    // The nearest time with these low bits: the bus's clock may lag behind by a tick.
    constexpr std::int64_t kHalfTurn = 1 << 19, kMask = 2 * kHalfTurn - 1;
    const std::int64_t age_us =
        ((seen.time.us - static_cast<std::int64_t>(one->stamp_us) + kHalfTurn) & kMask) - kHalfTurn;
    if (one->stamp_us == stamp_us_ && one->count == now_.features.size())
      end(static_cast<double>(seen.time.us - age_us - n.delay_us) * 1e-6);
    now_.features.clear();
  }
}

void CameraDetector::end(double time_s) {
  now_.time_s = time_s;
  now_.rolled_m = path_.rolled_m();
  std::sort(now_.features.begin(), now_.features.end(),
            [](const Feature& a, const Feature& b) { return a.track < b.track; });
  const double dt_s = now_.time_s - before_.time_s;
  if (dt_s > 0 && dt_s < kLongest_s && moves_along()) {
    const auto flow = flows(before_, now_);
    if (const auto turn = turn_of(flow); turn && waiting_.size() < kMost) {
      waiting_.push_back({before_.time_s, now_.time_s, dot(*turn, up_c_), dot(*turn, across_c_)});
      expand(flow, *turn);
    }
  }
  std::swap(before_, now_);
}

bool CameraDetector::moves_along() {
  const double way_m = now_.rolled_m - before_.rolled_m;
  if (std::abs(way_m) < kLeast_mps * (now_.time_s - before_.time_s)) return false;
  const auto from = angle_rad(before_.time_s), to = angle_rad(now_.time_s);
  const double turn_rad = from && to ? *to - *from : 0;
  const double aside = turn_rad * static_cast<double>(robot_.parameters.camera.position_b_m[0]) / way_m;
  along_c_ = unit(sum(ahead_c_, scaled(aside, left_c_)));
  return true;
}

std::vector<CameraDetector::Flow> CameraDetector::flows(const Image& before, const Image& after) {
  std::vector<Flow> found;
  auto old = before.features.begin();
  const double dt_s = after.time_s - before.time_s;
  for (const Feature& one : after.features) {
    while (old != before.features.end() && old->track < one.track) ++old;
    if (old == before.features.end() || old->track != one.track) continue;
    found.push_back({(one.x + old->x) / 2, (one.y + old->y) / 2, (one.x - old->x) / dt_s, (one.y - old->y) / dt_s});
  }
  return found;
}

/// Least squares over the motions across the rays from the point of expansion, with weights by Cauchy.
std::optional<Vector3> CameraDetector::turn_of(const std::vector<Flow>& flow) const {
  if (flow.size() < kLeastFeatures) return std::nullopt;
  std::vector<double> off(flow.size(), 0), sizes;
  Vector3 turn{};
  for (int round = 0; round < 6; ++round) {
    sizes.assign(off.begin(), off.end());
    for (double& one : sizes) one = std::abs(one);
    std::nth_element(sizes.begin(), sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2), sizes.end());
    const double scale = 3 * sizes[sizes.size() / 2] + 1e-9;
    Matrix3 m{};
    Vector3 b{};
    for (std::size_t i = 0; i < flow.size(); ++i) {
      const Flow& f = flow[i];
      const double rx = f.x * along_c_[2] - along_c_[0], ry = f.y * along_c_[2] - along_c_[1];
      Vector3 q{};
      for (std::size_t k = 0; k < 3; ++k) {
        Vector3 axis{};
        axis[k] = 1;
        const auto [dx, dy] = motion(f.x, f.y, axis);
        q[k] = rx * dy - ry * dx;
      }
      const double across = rx * f.dy - ry * f.dx;
      const double weight = round == 0 ? 1 : 1 / (1 + off[i] * off[i] / (scale * scale));
      for (std::size_t k = 0; k < 3; ++k) m[k] = sum(m[k], scaled(weight * q[k], q));
      b = sum(b, scaled(weight * across, q));
    }
    const auto found = solved(m, b);
    if (!found) return std::nullopt;
    turn = *found;
    for (std::size_t i = 0; i < flow.size(); ++i) {
      const auto [dx, dy] = motion(flow[i].x, flow[i].y, turn);
      const double rx = flow[i].x * along_c_[2] - along_c_[0], ry = flow[i].y * along_c_[2] - along_c_[1];
      off[i] = rx * (flow[i].dy - dy) - ry * (flow[i].dx - dx);
    }
  }
  return turn;
}

/// Rates of expansion: what is near comes apart faster, and below the middle row of an upright image that is the
/// ground.
void CameraDetector::expand(const std::vector<Flow>& flow, const Vector3& turn_radps) {
  if (norm(turn_radps) > kStraight_radps) return;
  for (const Flow& f : flow) {
    const double square = f.x * f.x + f.y * f.y, rate = (f.x * f.dx + f.y * f.dy) / square;
    if (square > kBesideMiddle * kBesideMiddle && std::abs(f.y) > kBesideMiddle)
      (f.y > 0 ? lower_ : upper_).add({std::min(rate, 2.0)});
  }
}

void CameraDetector::sample(base::Micros, const sensor::Sample& sample) {
  if (!usable_ || sample.sensor != sensor::Sensor::kImu || sample.instance != robot_.imu) return;
  const auto& d = sample.payload.imu.dangle_b_rad;
  const double time_s = static_cast<double>(sample.stamp.us) * 1e-6;
  const double turn_rad = dot(up_s_, {static_cast<double>(d[0]), static_cast<double>(d[1]), static_cast<double>(d[2])});
  const bool gap = !angles_.empty() && (time_s <= angles_.back().time_s || time_s > angles_.back().time_s + kLongest_s);
  if (gap) angles_.clear(), waiting_.clear();
  angles_.push_back({time_s, (angles_.empty() ? 0 : angles_.back().rad) + turn_rad});
  while (angles_.size() > kMost || angles_.front().time_s < time_s - kKept_s) angles_.pop_front();
  hold_against();
}

std::optional<double> CameraDetector::angle_rad(double time_s) const {
  const auto after = std::lower_bound(angles_.begin(), angles_.end(), time_s,
                                      [](const Angle& one, double t) { return one.time_s < t; });
  if (after == angles_.end() || after == angles_.begin()) return std::nullopt;
  const Angle& a = *(after - 1);
  return a.rad + (after->rad - a.rad) * (time_s - a.time_s) / (after->time_s - a.time_s);
}

void CameraDetector::hold_against() {
  while (!waiting_.empty() && waiting_.front().to_s + kAhead * kStep_s < angles_.back().time_s) {
    const Turn one = waiting_.front();
    waiting_.pop_front();
    for (std::size_t i = 0; i < kDelays; ++i) {
      const double delay_s = (static_cast<double>(i) - kAhead) * kStep_s;
      const auto from = angle_rad(one.from_s - delay_s), to = angle_rad(one.to_s - delay_s);
      if (from && to) turns_[i].add({one.up_radps, one.across_radps, (*to - *from) / (one.to_s - one.from_s)});
    }
  }
}

CameraDetector::Best CameraDetector::best() const {
  const auto explained = [](const Moments<3>& m) {
    const double size = m.covariance(2, 2) * (m.covariance(0, 0) + m.covariance(1, 1));
    const double up = m.covariance(0, 2), across = m.covariance(1, 2);
    return size > 0 ? (up * up + across * across) / size : 0;
  };
  Best best{.stated = explained(turns_[kAhead])};
  std::size_t at = 0;
  for (std::size_t i = 0; i < kDelays; ++i)
    if (explained(turns_[i]) > explained(turns_[at])) at = i;
  best.moments = &turns_[at];
  best.explained = explained(turns_[at]);
  best.delay_s = (static_cast<double>(at) - kAhead) * kStep_s;
  if (at > 0 && at + 1 < kDelays) {
    const double before = explained(turns_[at - 1]), after = explained(turns_[at + 1]);
    const double bend = before - 2 * best.explained + after;
    if (bend < 0) best.delay_s += kStep_s * (before - after) / (2 * bend);
  }
  return best;
}

void CameraDetector::finish(Findings& findings) {
  const Best found = best();
  const Moments<3>& m = *found.moments;
  if (m.count() < kLeastTurns || m.covariance(2, 2) < kLeastCameraTurn_radps * kLeastCameraTurn_radps) return;
  if (found.explained < kSharedTurn) return;
  const double up = m.covariance(0, 2) / m.covariance(2, 2), across = m.covariance(1, 2) / m.covariance(2, 2);
  const double by_rad = std::atan2(across, up), scale = std::hypot(up, across);
  const double degrees = by_rad * 180 / kPi;
  const auto add = [&](Code code, std::string evidence) {
    findings.push_back({.code = code,
                        .uses = kGyroscope,
                        .certainty = found.explained,
                        .evidence = std::move(evidence),
                        .change = {}});
  };
  const double share = 100 * found.explained, pairs = m.count();
  const double sigma = std::sqrt((1 - found.explained) / (found.explained * pairs));  // of the scale
  const bool upright = lower_.mean(0) >= upper_.mean(0);
  if (std::abs(by_rad) > kUpsideDown_rad && upright) {
    add(Code::kCameraMirrored,
        text("By the images the robot turns %.2f times as by the gyroscope (%.0f %% of the turns' variance, %.0f pairs "
             "of images), and what is near is in their lower half.",
             -scale, share, pairs));
  } else if (std::abs(by_rad) > kCameraTurned_rad) {
    add(Code::kCameraTurned,
        text(
            "By the images the robot turns about an axis that is %.0f deg from its up (%.0f %% of the turns' variance, "
            "%.0f pairs of images).",
            degrees, share, pairs));
  } else if (std::abs(scale - 1) > std::max(kFocal, kFocalSigmas * sigma)) {
    add(Code::kFocalLength,
        text("By the images the robot turns %.3f times as by the gyroscope (%.0f %% of the turns' variance, %.0f pairs "
             "of images): the focal length is %.0f px where %.0f px is stated.",
             scale, share, pairs, scale * static_cast<double>(robot_.parameters.camera.fu_px),
             static_cast<double>(robot_.parameters.camera.fu_px)));
  }
  const double likelier = 0.5 * pairs * std::log((1 - found.stated) / std::max(1e-6, 1 - found.explained));
  if (std::abs(found.delay_s) > kLate_s && likelier > kLaterLikelier)
    add(Code::kImageStamps, text("The turns by the images fit those by the gyroscope %.0f ms before the stamps (%.0f "
                                 "%% of their variance; at "
                                 "the stamps %.0f %%).",
                                 1000 * found.delay_s, share, 100 * found.stated));
}

}  // namespace tetap::doctor
