// SPDX-License-Identifier: Apache-2.0
// A planar scan as points with the normals of the lines on which they lie. Points are integers of 1 mm, so that a
// keyframe is small and the search for the nearest point is exact.
#pragma once

#include "tetap/base/math.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::slam {

/// Beams of a scanner in its own frame: x forward, y left. A step below zero is a scanner that turns clockwise.
struct ScanGeometry {
  int beams = 0;
  float first_rad = 0.0F;  ///< bearing of the first beam
  float step_rad = 0.0F;   ///< to the next one; not 0
  float sweep_s = 0.0F;    ///< from the first beam to the last
  float min_m = 0.05F;     ///< a shorter range is none
  float max_m = 30.0F;     ///< a longer range is none; at most 32 m
};

/// Motion of the scanner during a scan, in its own frame.
struct ScanMotion {
  float forward_mps = 0.0F, left_mps = 0.0F, yaw_rate_radps = 0.0F;
};

/// A point in 1 mm, and its unit normal in 2^-14, towards the scanner; 0, 0: none.
struct ScanPoint {
  static constexpr std::int16_t kNone = INT16_MIN;
  static constexpr float kNormal = 0x1p-14F;

  std::int16_t x_mm = kNone, y_mm = kNone;
  std::int16_t nx = 0, ny = 0;

  [[nodiscard]] constexpr bool known() const { return x_mm != kNone; }
  [[nodiscard]] constexpr bool has_normal() const { return nx != 0 || ny != 0; }
};

/// The nearest integer; |value| below 2^31.
[[nodiscard]] constexpr std::int32_t nearest(float value) {
  return static_cast<std::int32_t>(value < 0.0F ? value - 0.5F : value + 0.5F);
}

/// Points of a scan as seen at its middle: the frame is that of the scanner half a sweep after the first beam.
template <int kBeams>
struct Scan {
  static_assert(kBeams >= 3 && kBeams <= 1024);
  static constexpr float kRange_m = 0.005F;  ///< step of the ranges on the bus

  std::array<ScanPoint, kBeams> point{};
  float first_rad = 0.0F;  ///< bearing of the first point, the turn of the scanner included
  float step_rad = 1.0F;   ///< likewise, to the next one
  int beams = 0;
  int known = 0;  ///< points
  bool round = false;

  /// No point yet. False when the geometry has too few beams or too many, no step,
  /// a limit that is none, or when the scanner turns by half of its field during the scan.
  [[nodiscard]] bool begin(const ScanGeometry& geometry, const ScanMotion& motion) {
    beams = known = 0;
    if (geometry.beams < 3 || geometry.beams > kBeams || !(base::abs(geometry.step_rad) > 1e-4F)) return false;
    const auto last = static_cast<float>(geometry.beams - 1);
    if (!(geometry.sweep_s >= 0.0F && geometry.min_m >= 0.0F && geometry.max_m >= geometry.min_m)) return false;
    if (!(base::abs(motion.yaw_rate_radps) * geometry.sweep_s < 0.5F * base::abs(geometry.step_rad) * last))
      return false;
    beams = geometry.beams;
    beam_s_ = geometry.sweep_s / last;
    motion_ = motion;
    step_rad = geometry.step_rad + motion.yaw_rate_radps * beam_s_;
    first_rad = geometry.first_rad - 0.5F * motion.yaw_rate_radps * geometry.sweep_s;
    if (!(base::abs(first_rad) <= base::kPi)) first_rad = base::wrap_angle(first_rad);  // -pi stays, for the mirror
    beams_per_rad_ = 1.0F / step_rad;
    turn_beams_ = 2.0F * base::kPi / base::abs(step_rad);
    least_beam_ = -0.5F * (turn_beams_ - static_cast<float>(beams)) - 0.5F;
    round = base::abs(geometry.step_rad) * (last + 1.5F) >= 2.0F * base::kPi;
    least_ = nearest(geometry.min_m / kRange_m);
    most_ = nearest(base::min(geometry.max_m, 32.0F) / kRange_m);
    return true;
  }
  /// Implements docs/explanation/scan_matching.md (1).
  /// Point i from its range in steps of 5 mm, 0 for none. The scanner moves on an arc of constant rate; the rest of
  /// the third order in the angle of half a sweep is left out.
  void place(int i, std::uint16_t range) {
    ScanPoint& p = point[static_cast<std::size_t>(i)];
    p = {};
    if (range == 0 || range < least_ || range > most_) return;
    const auto index = static_cast<float>(i);
    const base::SinCos beam = base::sincos(first_rad + index * step_rad);
    const float range_m = static_cast<float>(range) * kRange_m;
    const float t = (index - 0.5F * static_cast<float>(beams - 1)) * beam_s_;
    const float half_turn = 0.5F * motion_.yaw_rate_radps * t;
    const float x = range_m * beam.cos + t * (motion_.forward_mps - half_turn * motion_.left_mps);
    const float y = range_m * beam.sin + t * (motion_.left_mps + half_turn * motion_.forward_mps);
    if (!(base::abs(x) < 32.7F && base::abs(y) < 32.7F)) return;
    p.x_mm = static_cast<std::int16_t>(nearest(1000.0F * x));
    p.y_mm = static_cast<std::int16_t>(nearest(1000.0F * y));
    ++known;
  }
  /// Number of the beam towards a place (m, in the scan's frame), perhaps outside of the scan; within a third of a
  /// degree.
  [[nodiscard]] int beam_towards(float x_m, float y_m) const {
    float angle = coarse_bearing(x_m, y_m) - first_rad;
    if (angle > base::kPi) angle -= 2.0F * base::kPi;
    if (angle < -base::kPi) angle += 2.0F * base::kPi;
    const float beam = angle * beams_per_rad_;
    return nearest(beam < least_beam_ ? beam + turn_beams_ : beam);
  }
  /// Beam k, counted round where the scan is a full turn; -1 outside.
  [[nodiscard]] int wrapped(int k) const {
    if (k >= 0 && k < beams) return k;
    if (!round) return -1;
    const int back = k < 0 ? k + beams : k - beams;
    return back >= 0 && back < beams ? back : -1;
  }

 private:
  /// atan2(y, x) within 5 mrad, for where a search begins: the exact one costs eight times as much.
  [[nodiscard]] static float coarse_bearing(float x, float y) {
    const float ax = base::abs(x), ay = base::abs(y);
    const bool steep = ay > ax;
    const float high = steep ? ay : ax, q = high > 0.0F ? (steep ? ax : ay) / high : 0.0F;
    const float angle = q * (0.97239F - 0.19195F * q * q);
    const float upper = steep ? base::kHalfPi - angle : angle;
    const float left = x < 0.0F ? base::kPi - upper : upper;
    return y < 0.0F ? -left : left;
  }

  ScanMotion motion_{};
  float beam_s_ = 0.0F;
  float beams_per_rad_ = 1.0F, turn_beams_ = 1.0F;
  float least_beam_ = 0.0F;  ///< a beam below is nearer to the last one, round the back
  std::int32_t least_ = 0, most_ = 0;
};

}  // namespace tetap::slam
