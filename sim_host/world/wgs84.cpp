// SPDX-License-Identifier: Apache-2.0
#include "sim_host/world/wgs84.hpp"

namespace tetap::sim::wgs84 {

namespace {

constexpr double kB_m = kA_m * (1 - kF);
constexpr double kFocus2_m2 = kA_m * kA_m * kE2;  ///< linear eccentricity, squared

constexpr double degrees(double angle_rad) { return angle_rad * (180 / kPi); }

/// Latitude and longitude as cosines and sines.
struct Normal {
  Direction latitude, longitude;
};
Normal normal(const GeodeticOrigin& place) {
  return {direction(radians(place.latitude_deg)), direction(radians(place.longitude_deg))};
}

/// q and q' of the ellipsoid through u, over powers of t = E/u: q / t^3 and q' / t^2. Closed forms cancel.
struct Legendre {
  double q, q_prime;
};
constexpr Legendre legendre(double t2) {
  constexpr int kTerms = 12;  // t2 is below 0.0068
  Legendre sum{};
  double power = 1;
  for (int n = 1; n <= kTerms; ++n, power *= -t2) {
    const double odd = (2 * n + 1.0) * (2 * n + 3.0);
    sum.q += 2 * n * power / odd;
    sum.q_prime += 6 * power / odd;
  }
  return sum;
}

}  // namespace

Vector3 geocentric(const GeodeticOrigin& place) {
  const auto [latitude, longitude] = normal(place);
  const double across_m = kA_m / sim::sqrt(1 - kE2 * latitude.sin * latitude.sin);
  const double ring_m = (across_m + place.height_m) * latitude.cos;
  return {ring_m * longitude.cos, ring_m * longitude.sin, ((1 - kE2) * across_m + place.height_m) * latitude.sin};
}

GeodeticOrigin geodetic(const Vector3& p_e_m) {
  const double ring_m = sim::sqrt(p_e_m[0] * p_e_m[0] + p_e_m[1] * p_e_m[1]), z_m = p_e_m[2];
  // Reduced latitude, then the latitude it gives: each round gains five digits.
  double north = z_m * kA_m, out = ring_m * kB_m;
  Direction latitude;
  for (int round = 0; round < 3; ++round) {
    const double length = sim::sqrt(north * north + out * out), s = north / length, c = out / length;
    const double n = z_m + kE2 / (1 - kE2) * kB_m * s * s * s, o = ring_m - kE2 * kA_m * c * c * c;
    const double whole = sim::sqrt(n * n + o * o);
    latitude = {.cos = o / whole, .sin = n / whole};
    north = (1 - kF) * n;
    out = o;
  }
  const double flat_m = kA_m * sim::sqrt(1 - kE2 * latitude.sin * latitude.sin);
  return {.latitude_deg = degrees(sim::atan2(latitude.sin, latitude.cos)),
          .longitude_deg = degrees(sim::atan2(p_e_m[1], p_e_m[0])),
          .height_m = ring_m * latitude.cos + z_m * latitude.sin - flat_m};
}

Matrix3 axes(const GeodeticOrigin& place) {
  const auto [p, l] = normal(place);
  return {{-l.sin, -p.sin * l.cos, p.cos * l.cos, l.cos, -p.sin * l.sin, p.cos * l.sin, 0, p.cos, p.sin}};
}

Vector3 gravity(const Vector3& p_e_m) {
  const double ring2 = p_e_m[0] * p_e_m[0] + p_e_m[1] * p_e_m[1], z2 = p_e_m[2] * p_e_m[2];
  const double over = ring2 + z2 - kFocus2_m2;
  // The confocal ellipsoid through the point: its half axes u and v, and the reduced latitude.
  const double u2 = 0.5 * (over + sim::sqrt(over * over + 4 * kFocus2_m2 * z2)), v2 = u2 + kFocus2_m2;
  const double u = sim::sqrt(u2), v = sim::sqrt(v2), s = p_e_m[2] / u, c = sim::sqrt(ring2) / v;
  const double w = sim::sqrt((u2 + kFocus2_m2 * s * s) / v2);
  const Legendre here = legendre(kFocus2_m2 / u2), surface = legendre(kFocus2_m2 / (kB_m * kB_m));
  const double turn2 = kRate_radps * kRate_radps;
  // (b/u)^3 is the ratio of the powers that both q leave out; of q' and q0 one power of E stays, which E takes.
  const double form = turn2 * kA_m * kA_m * kB_m * kB_m * kB_m / surface.q;
  const double along_u =
      -(kGm_m3ps2 / v2 + form / (u2 * v2) * here.q_prime * (0.5 * s * s - 1.0 / 6)) / w + turn2 * u * c * c / w;
  const double along_beta = (form / (u2 * u * v) * here.q - turn2 * v) * s * c / w;
  const double out = (along_u * u * c / v - along_beta * s) / w, north = (along_u * s + along_beta * u * c / v) / w;
  const double ring_m = sim::sqrt(ring2), share = ring_m > 0 ? out / ring_m : 0;
  return {share * p_e_m[0], share * p_e_m[1], north};
}

}  // namespace tetap::sim::wgs84
