// SPDX-License-Identifier: Apache-2.0
// The Earth of the world: places, axes and gravity in local frames.
#pragma once

#include "sim_host/world/wgs84.hpp"

#include <cstdint>

namespace tetap::sim {

/// Form on the bus: angles in 2e-9 deg.
struct GeodeticPoint {
  std::int64_t latitude_2ndeg = 0;
  std::int64_t longitude_2ndeg = 0;
  double height_m = 0;
};

/// A local Cartesian frame n, fixed to the Earth: east, north, up of its origin.
class Earth {
 public:
  explicit Earth(const GeodeticOrigin& origin);

  [[nodiscard]] const GeodeticOrigin& origin() const { return origin_; }

  /// The place of a point `p_n_m`.
  [[nodiscard]] GeodeticOrigin place(const Vector3& p_n_m) const;
  /// The same in the units of the bus, rounded.
  [[nodiscard]] GeodeticPoint geodetic(const Vector3& p_n_m) const;
  [[nodiscard]] Vector3 point_m(const GeodeticOrigin& place) const;
  [[nodiscard]] Vector3 enu_m(const GeodeticPoint& point) const;
  /// Rotation from east, north, up of the point `p_n_m` into n.
  [[nodiscard]] Matrix3 axes(const Vector3& p_n_m) const;
  /// Normal gravity at the point, in n: attraction and centrifugal force.
  [[nodiscard]] Vector3 gravity_n_mps2(const Vector3& p_n_m) const;
  /// Its magnitude at the origin.
  [[nodiscard]] double gravity_mps2() const { return -gravity_n_mps2({})[2]; }
  /// Rotation of the Earth, in n.
  [[nodiscard]] Vector3 earth_rate_n_radps() const { return earth_rate_n_radps_; }

 private:
  [[nodiscard]] Vector3 geocentric_m(const Vector3& p_n_m) const { return origin_e_m_ + r_en_ * p_n_m; }

  GeodeticOrigin origin_;
  Vector3 origin_e_m_;
  Matrix3 r_en_;
  Vector3 earth_rate_n_radps_{};
};

/// The rigid motion that takes coordinates of one local frame to those of another.
class FrameChange {
 public:
  FrameChange(const Earth& from, const Earth& to);
  [[nodiscard]] Vector3 point(const Vector3& p_m) const { return origin_m_ + turn_ * p_m; }
  [[nodiscard]] Vector3 vector(const Vector3& v) const { return turn_ * v; }
  [[nodiscard]] Vector3 attitude(const Vector3& attitude_rad) const;

 private:
  bool same_;  ///< the two origins agree, bit by bit: attitudes stay as they are
  Vector3 origin_m_{};
  Matrix3 turn_;
};

/// The origin from which `place` lies so far to the east and north along the axes of that origin, at the height of
/// `place`.
[[nodiscard]] GeodeticOrigin origin_with(const GeodeticOrigin& place, double east_m, double north_m);
/// The place so far to the east and north along the axes of `origin`, at the height of `origin`.
[[nodiscard]] GeodeticOrigin place_at(const GeodeticOrigin& origin, double east_m, double north_m);

}  // namespace tetap::sim
