// SPDX-License-Identifier: Apache-2.0
// Axes of the level plane of a place, along the axes of the map (the level plane of the origin). An ellipsoid is a
// quadric: its normal is linear in the place, so no angle is needed. docs/explanation/frames.md.
#pragma once

#include "tetap/base/anchored.hpp"
#include "tetap/base/members.hpp"
#include "tetap/base/wgs84.hpp"
#include "tetap/nav/so3.hpp"

namespace tetap::nav {

/// The level surface through the origin, by its principal radii (Torge & Mueller 2012, sec. 4.1.3). The normal at a
/// place d is along up + across d + along (axis . d) axis.
struct Curvature {
  float across_per_m = 0;  ///< 1 / (N + h)
  float along_per_m = 0;   ///< (1 / (M + h) - 1 / (N + h)) / cos^2 of the latitude
  float axis_north = 1;    ///< Earth's axis: cosine of the origin's latitude
  float axis_up = 0;       ///< sine of the latitude

  static constexpr auto members(auto& self) {
    return base::members(self.across_per_m, self.along_per_m, self.axis_north, self.axis_up);
  }

  constexpr Curvature() = default;
  constexpr Curvature(const base::Level& origin, double height_m)
      : axis_north(static_cast<float>(origin.latitude.cos)), axis_up(static_cast<float>(origin.latitude.sin)) {
    const double w2 = 1.0 - base::kEccentricity2 * origin.latitude.sin * origin.latitude.sin;
    const double w = base::sqrt(w2);
    const double across_m = base::kSemiMajor_m / w + height_m;
    const double along_m = base::kSemiMajor_m * (1.0 - base::kEccentricity2) / (w2 * w) + height_m;
    across_per_m = static_cast<float>(1.0 / across_m);
    along_per_m = static_cast<float>(base::kSemiMajor_m * base::kEccentricity2 / (w2 * w * along_m * across_m));
  }
};

namespace detail {

/// Metres from the origin, to 16 mm: 3e-9 rad.
[[nodiscard]] inline Vector3 coarse(const base::Anchored& x, const base::Anchored& y, const base::Anchored& z) {
  const auto metres = [](const base::Anchored& a) {
    return static_cast<float>(static_cast<std::int32_t>(a.anchor_um >> 14)) * 0.016384F + a.offset_m;
  };
  return {metres(x), metres(y), metres(z)};
}
/// Turn of the normal from the origin to d: what is added to (0, 0, 1).
[[nodiscard]] inline Vector3 bend(const Curvature& c, const Vector3& d) {
  const float on_axis = c.along_per_m * (c.axis_north * d(1) + c.axis_up * d(2));
  return {c.across_per_m * d(0), c.across_per_m * d(1) + on_axis * c.axis_north,
          c.across_per_m * d(2) + on_axis * c.axis_up};
}

}  // namespace detail

/// The origin's level surface lies so far below the plane of the map at a place: 785 m at 100 km.
[[nodiscard]] inline float level_drop_m(const Curvature& c, const base::Anchored& x, const base::Anchored& y,
                                        const base::Anchored& z) {
  const Vector3 d = detail::coarse(x, y, z);
  return 0.5F * detail::bend(c, d).dot(d);
}

/// Axes of the level plane of a place: docs/explanation/equations.md (17). Exact on the level surface of the origin;
/// 5e-10 rad off per metre above it.
struct LocalLevel {
  Quaternion q_nl;  ///< rotates the level axes of the place (l) into the map's
  Vector3 up_n{0.0F, 0.0F, 1.0F};
  float height_m = 0;  ///< above the level surface of the origin

  LocalLevel() = default;
  static constexpr auto members(auto& self) { return base::members(self.q_nl, self.up_n, self.height_m); }
  /// Within a kilometre of a pole, where no direction is east, the map's east stands for it.
  LocalLevel(const Curvature& c, const base::Anchored& x, const base::Anchored& y, const base::Anchored& z) {
    const Vector3 d = detail::coarse(x, y, z), bend = detail::bend(c, d);
    height_m = d(2) + 0.5F * bend.dot(d);
    up_n = Vector3{bend(0), bend(1), 1.0F + bend(2)};
    up_n = up_n / base::sqrt(up_n.squaredNorm());
    const Vector3 eastward{c.axis_north + (c.axis_north * bend(2) - c.axis_up * bend(1)), c.axis_up * bend(0),
                           -c.axis_north * bend(0)};
    constexpr float kPole = 1.5e-4F;
    Vector3 east_n{1.0F, 0.0F, 0.0F};
    if (eastward.squaredNorm() > kPole * kPole) east_n = eastward / base::sqrt(eastward.squaredNorm());
    turn(east_n, cross(up_n, east_n));
  }

  [[nodiscard]] Vector3 to_map(const Vector3& v_l) const { return q_nl.rotate(v_l); }
  [[nodiscard]] Vector3 from_map(const Vector3& v_n) const { return q_nl.conjugate().rotate(v_n); }
  /// Turn of the place's east against the map's: a heading at the place plus this is the heading in the map.
  [[nodiscard]] float convergence_rad() const {
    const Vector3 east_n = q_nl.rotated_x();
    return base::atan2(east_n(1), east_n(0));
  }

 private:
  /// Quaternion of the axes (Shepperd 1978, J. Guidance and Control 1(3)): they lean by less than they turn.
  void turn(const Vector3& east_n, const Vector3& north_n) {
    const float w4 = 1.0F + (east_n(0) + north_n(1)) + up_n(2), z4 = 1.0F - (east_n(0) + north_n(1)) + up_n(2);
    const bool small = w4 >= z4;
    const float most = 0.5F * base::sqrt(small ? w4 : z4), share = 0.25F / most;
    const float turned = share * (east_n(1) - north_n(0));
    q_nl = small ? Quaternion{most, share * (north_n(2) - up_n(1)), share * (up_n(0) - east_n(2)), turned}
                 : Quaternion{turned, share * (up_n(0) + east_n(2)), share * (north_n(2) + up_n(1)), most};
  }
};

}  // namespace tetap::nav
