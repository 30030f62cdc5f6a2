// SPDX-License-Identifier: Apache-2.0
#include "sim_host/world/earth.hpp"

namespace tetap::sim {
namespace {

constexpr double kUnitsPerDegree = 5e8;

std::int64_t units(double angle_deg) {
  return static_cast<std::int64_t>(sim::floor(angle_deg * kUnitsPerDegree + 0.5));
}
double degrees(std::int64_t units) { return static_cast<double>(units) / kUnitsPerDegree; }

}  // namespace

Earth::Earth(const GeodeticOrigin& origin)
    : origin_{origin}, origin_e_m_{wgs84::geocentric(origin)}, r_en_{wgs84::axes(origin)} {
  earth_rate_n_radps_ = wgs84::kRate_radps * (r_en_.transposed() * Vector3{0, 0, 1});
}

GeodeticOrigin Earth::place(const Vector3& p_n_m) const { return wgs84::geodetic(geocentric_m(p_n_m)); }

GeodeticPoint Earth::geodetic(const Vector3& p_n_m) const {
  const GeodeticOrigin at = place(p_n_m);
  return {
      .latitude_2ndeg = units(at.latitude_deg), .longitude_2ndeg = units(at.longitude_deg), .height_m = at.height_m};
}

Vector3 Earth::point_m(const GeodeticOrigin& place) const {
  return r_en_.transposed() * (wgs84::geocentric(place) - origin_e_m_);
}

Vector3 Earth::enu_m(const GeodeticPoint& point) const {
  return point_m({degrees(point.latitude_2ndeg), degrees(point.longitude_2ndeg), point.height_m});
}

Matrix3 Earth::axes(const Vector3& p_n_m) const { return r_en_.transposed() * wgs84::axes(place(p_n_m)); }

Vector3 Earth::gravity_n_mps2(const Vector3& p_n_m) const {
  return r_en_.transposed() * wgs84::gravity(geocentric_m(p_n_m));
}

FrameChange::FrameChange(const Earth& from, const Earth& to) {
  const GeodeticOrigin &a = from.origin(), &b = to.origin();
  same_ = !(a.latitude_deg < b.latitude_deg || a.latitude_deg > b.latitude_deg || a.longitude_deg < b.longitude_deg ||
            a.longitude_deg > b.longitude_deg || a.height_m < b.height_m || a.height_m > b.height_m);
  if (same_) return;
  origin_m_ = to.point_m(a);
  turn_ = to.axes(origin_m_);
}

Vector3 FrameChange::attitude(const Vector3& attitude_rad) const {
  return same_ ? attitude_rad : sim::attitude(turn_ * rotation(attitude_rad));
}

GeodeticOrigin origin_with(const GeodeticOrigin& place, double east_m, double north_m) {
  GeodeticOrigin origin = place;
  // A fixed point: the axes of the guess differ from those of the answer less and less.
  for (int round = 0; round < 20; ++round) {
    const Vector3 seen = Earth{origin}.point_m(place);
    origin = Earth{origin}.place({seen[0] - east_m, seen[1] - north_m, 0});
    origin.height_m = place.height_m;
  }
  return origin;
}

GeodeticOrigin place_at(const GeodeticOrigin& origin, double east_m, double north_m) {
  GeodeticOrigin place = Earth{origin}.place({east_m, north_m, 0});
  // The point at the wanted height straight below or above is off by some metres: walk back along the axes.
  for (int round = 0; round < 20; ++round) {
    place.height_m = origin.height_m;
    const Vector3 seen = Earth{origin}.point_m(place);
    place = Earth{origin}.place({east_m, north_m, seen[2]});
  }
  place.height_m = origin.height_m;
  return place;
}

}  // namespace tetap::sim
