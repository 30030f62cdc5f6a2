// SPDX-License-Identifier: Apache-2.0
// The latest keyframes of a scanner: the scans against which a new one is matched.
#pragma once

#include "tetap/slam/planar_motion.hpp"
#include "tetap/slam/scan.hpp"

namespace tetap::slam {

struct ScanKeyframeOptions {
  float distance_m = 0.3F;  ///< a keyframe is due after so much way
  float turn_rad = 0.3F;    ///< or so much turn
};

/// Whether a displacement is farther than that.
[[nodiscard]] inline bool beyond(const Displacement<float>& d, const ScanKeyframeOptions& n) {
  return d.x_m * d.x_m + d.y_m * d.y_m > n.distance_m * n.distance_m || base::abs(d.yaw.radians()) > n.turn_rad;
}

/// A ring of kFrames scans and their poses in one frame.
template <int kBeams, int kFrames>
class ScanKeyframes {
  static_assert(kFrames >= 1);

 public:
  using Pose = GraphPose<float>;

  explicit ScanKeyframes(const ScanKeyframeOptions& options = {}) : options_(options) {}

  void set_options(const ScanKeyframeOptions& options) { options_ = options; }
  void clear() { count_ = 0; }
  [[nodiscard]] int count() const { return count_; }
  /// Keyframe k, 0 being the newest; k < count().
  [[nodiscard]] const Scan<kBeams>& scan(int k) const { return scan_[slot(k)]; }
  [[nodiscard]] const Pose& pose(int k) const { return pose_[slot(k)]; }
  /// Whether a scan that lies there from the newest keyframe becomes one.
  [[nodiscard]] bool due(const Displacement<float>& d) const { return count_ == 0 || beyond(d, options_); }
  /// The oldest one gives way.
  void add(const Scan<kBeams>& scan, const Pose& pose) {
    newest_ = (newest_ + 1) % kFrames;
    scan_[static_cast<std::size_t>(newest_)] = scan;
    pose_[static_cast<std::size_t>(newest_)] = pose;
    if (count_ < kFrames) ++count_;
  }
  /// All keyframes as one body, which is at `to` instead of at `from`; nothing changes where these are equal.
  void move(const Pose& from, const Pose& to) {
    const Displacement<float> d = to.minus(from);
    const bool same = d.yaw.turn == 0 && !(base::abs(d.x_m) + base::abs(d.y_m) > 0.0F);
    for (int k = 0; k < count_ && !same; ++k) pose_[slot(k)] = to.plus(pose_[slot(k)].minus(from));
  }

 private:
  [[nodiscard]] std::size_t slot(int k) const { return static_cast<std::size_t>((newest_ - k + kFrames) % kFrames); }

  ScanKeyframeOptions options_;
  int newest_ = kFrames - 1, count_ = 0;
  std::array<Scan<kBeams>, kFrames> scan_{};
  std::array<Pose, kFrames> pose_{};
};

}  // namespace tetap::slam
