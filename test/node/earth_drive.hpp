// SPDX-License-Identifier: Apache-2.0
// A robot drives on the Earth of GeographicLib, which shares nothing with src/tetap/nav. Its way is given in the
// tangent frame of its start. Its sensors show what the ellipsoid, its normal gravity and the level axes of the place
// make of it.
#pragma once

#include "tetap/sensor/samples.hpp"

#include <GeographicLib/LocalCartesian.hpp>
#include <GeographicLib/NormalGravity.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

namespace tetap::test {

/// WGS84, degrees and metres.
struct GeoPlace {
  double latitude_deg = 0, longitude_deg = 0, height_m = 0;
};

using Three = std::array<double, 3>;

/// Tangent frame (east, north, up) of a place.
class TangentFrame {
 public:
  explicit TangentFrame(const GeoPlace& at) : map_(at.latitude_deg, at.longitude_deg, at.height_m) {}

  [[nodiscard]] GeoPlace geodetic(const Three& enu_m) const {
    GeoPlace place;
    map_.Reverse(enu_m[0], enu_m[1], enu_m[2], place.latitude_deg, place.longitude_deg, place.height_m);
    return place;
  }
  [[nodiscard]] Three enu_m(const GeoPlace& at) const {
    Three p{};
    map_.Forward(at.latitude_deg, at.longitude_deg, at.height_m, p[0], p[1], p[2]);
    return p;
  }
  /// Row by row: rotates the level axes of a place into those of this frame.
  [[nodiscard]] std::vector<double> axes(const GeoPlace& at) const {
    std::vector<double> m(9);
    double x = 0, y = 0, z = 0;
    map_.Forward(at.latitude_deg, at.longitude_deg, at.height_m, x, y, z, m);
    return m;
  }
  /// A vector of this frame along the level axes of a place.
  [[nodiscard]] Three to_level(const GeoPlace& at, const Three& v) const {
    const std::vector<double> m = axes(at);
    return {m[0] * v[0] + m[3] * v[1] + m[6] * v[2], m[1] * v[0] + m[4] * v[1] + m[7] * v[2],
            m[2] * v[0] + m[5] * v[1] + m[8] * v[2]};
  }
  [[nodiscard]] Three from_level(const GeoPlace& at, const Three& v) const {
    const std::vector<double> m = axes(at);
    return {m[0] * v[0] + m[1] * v[1] + m[2] * v[2], m[3] * v[0] + m[4] * v[1] + m[5] * v[2],
            m[6] * v[0] + m[7] * v[1] + m[8] * v[2]};
  }

 private:
  GeographicLib::LocalCartesian map_;
};

[[nodiscard]] inline std::int64_t steps_2ndeg(double degrees) { return std::llround(degrees / 2e-9); }

class EarthDrive {
 public:
  struct Options {
    GeoPlace start;
    double course_rad = 0.3;  ///< heading at the start, in the start's level axes
    double fastest_mps = 5;
    double curve_rad = 0.4;  ///< how far the heading swings to both sides
    std::int64_t begin_us = 1'000'000;
    double noise = 0;  ///< times the noise of a rover's sensors
    unsigned seed = 1;
    bool wheels = true, gnss_velocity = true, climb_rate = true, compass = false, antennas = false, barometer = false;
    std::int64_t gnss_every_us = 200'000;
    double turns_back_s = 1e9;  ///< the robot stops, and reverses as fast from then on
  };
  static constexpr double kRadius_m = 0.1, kTrack_m = 0.5, kCounts = 20'000, kSigmaFix_m = 0.5,
                          kSigmaVelocity_mps = 0.05;
  static constexpr double kDeclination_rad = 0.07, kDip_rad = 1.1;
  static constexpr std::int64_t kStep_us = 10'000;

  explicit EarthDrive(const Options& options)
      : options_(options),
        frame_(options.start),
        random_(options.seed),
        us(options.begin_us),
        yaw_rad(options.course_rad) {}

  /// One step; sink(payload, stamp_us) is given what the sensors show at its end.
  template <class Sink>
  void step(Sink&& sink) {
    constexpr double dt = 1e-6 * kStep_us;
    const double begin_yaw = yaw_rad, begin_mps = speed_mps, t = 1e-6 * static_cast<double>(us - options_.begin_us);
    us += kStep_us;
    speed_mps = speed(t + dt);
    yaw_rad = options_.course_rad + options_.curve_rad * std::sin(0.3 * (t + dt)) * ramp(t + dt);
    const Three v0 = ahead(begin_mps, begin_yaw), v1 = ahead(speed_mps, yaw_rad);
    const Three vm =
        ahead(speed(t + 0.5 * dt),
              options_.course_rad + options_.curve_rad * std::sin(0.3 * (t + 0.5 * dt)) * ramp(t + 0.5 * dt));
    for (std::size_t i = 0; i < 3; ++i) place_m[i] += dt / 6 * (v0[i] + 4 * vm[i] + v1[i]);
    const double way_m = dt / 6 * (begin_mps + 4 * speed(t + 0.5 * dt) + speed_mps);
    velocity_mps = v1;
    place = frame_.geodetic(place_m);
    sink(imu(v0, begin_yaw, dt), us);
    if (options_.wheels) sink(counts(way_m, yaw_rad - begin_yaw), us);
    if (options_.compass) sink(compass(), us);
    if (options_.barometer) sink(barometer(), us);
    if ((us - options_.begin_us) % options_.gnss_every_us != 0) return;
    sink(fix(), us);
    if (options_.gnss_velocity) sink(velocity(), us);
    if (options_.antennas) sink(antennas(), us);
  }

  [[nodiscard]] const TangentFrame& frame() const { return frame_; }
  /// Position [m] and heading in the map of an origin.
  struct InMap {
    Three enu_m{};
    double yaw_rad = 0;
  };
  [[nodiscard]] InMap in(const TangentFrame& map) const {
    const Three ahead_map = map.from_level(options_.start, {std::cos(yaw_rad), std::sin(yaw_rad), 0});
    return {map.enu_m(place), std::atan2(ahead_map[1], ahead_map[0])};
  }
  [[nodiscard]] sensor::GnssPosition fix_at(const GeoPlace& at) const {
    return {.latitude_2ndeg = steps_2ndeg(at.latitude_deg),
            .longitude_2ndeg = steps_2ndeg(at.longitude_deg),
            .height_m = static_cast<float>(at.height_m),
            .horizontal_acc_m = static_cast<float>(kSigmaFix_m),
            .vertical_acc_m = static_cast<float>(1.5 * kSigmaFix_m),
            .fix = sensor::GnssFix::k3d,
            .satellites = 12};
  }

 private:
  Options options_;
  TangentFrame frame_;
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  double left_ = 0, right_ = 0;

  static double ramp(double t) { return t < 4 ? 0 : t > 9 ? 1 : 0.5 - 0.5 * std::cos((t - 4) / 5 * M_PI); }
  [[nodiscard]] double speed(double t) const {
    return options_.fastest_mps * (ramp(t) - 2 * ramp(t - options_.turns_back_s));
  }
  static Three ahead(double mps, double yaw) { return {mps * std::cos(yaw), mps * std::sin(yaw), 0}; }
  double shake(double sigma) { return options_.noise * sigma * normal_(random_); }

  static Three add(const Three& a, const Three& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
  /// Noise of a receiver, in the start's frame turned as the course is: a run that is turned has the same noise turned.
  Three shaken(double sigma) {
    const double along = shake(sigma), left = shake(sigma), up = shake(1.5 * sigma);
    const double c = std::cos(options_.course_rad), s = std::sin(options_.course_rad);
    return {c * along - s * left, s * along + c * left, up};
  }

  /// Gravity is felt along the plumb line of the place.
  sensor::ImuSample imu(const Three& v0, double begin_yaw, double dt) {
    double north_mps2 = 0, up_mps2 = 0;
    GeographicLib::NormalGravity::WGS84().Gravity(place.latitude_deg, place.height_m, north_mps2, up_mps2);
    const Three gravity = frame_.from_level(place, {0, north_mps2, up_mps2});
    Three push{};
    for (std::size_t i = 0; i < 3; ++i) push[i] = velocity_mps[i] - v0[i] - gravity[i] * dt;
    const double c = std::cos(begin_yaw), s = std::sin(begin_yaw);
    return {.dangle_b_rad = {single(shake(2e-5)), single(shake(2e-5)), single(yaw_rad - begin_yaw + shake(2e-5))},
            .dvelocity_b_mps = {single(c * push[0] + s * push[1] + shake(1e-3)),
                                single(c * push[1] - s * push[0] + shake(1e-3)), single(push[2] + shake(1e-3))},
            .temperature_degC = 25,
            .interval_us = kStep_us};
  }
  sensor::WheelCounts counts(double way_m, double turn_rad) {
    constexpr double kPerMetre = kCounts / (2 * M_PI * kRadius_m);
    left_ += (way_m - 0.5 * kTrack_m * turn_rad) * kPerMetre;
    right_ += (way_m + 0.5 * kTrack_m * turn_rad) * kPerMetre;
    return {static_cast<std::uint16_t>(std::llround(left_)), static_cast<std::uint16_t>(std::llround(right_))};
  }
  sensor::GnssPosition fix() { return fix_at(frame_.geodetic(add(place_m, shaken(kSigmaFix_m)))); }
  sensor::GnssVelocity velocity() {
    const Three v = frame_.to_level(place, add(velocity_mps, shaken(kSigmaVelocity_mps)));
    const float none = std::nanf("");
    return {.v_n_mps = {single(v[0]), single(v[1]), options_.climb_rate ? single(v[2]) : none},
            .acc_mps = static_cast<float>(kSigmaVelocity_mps)};
  }
  /// A field of 48 uT that dips, along the level axes of the place.
  sensor::MagneticFlux compass() {
    const double level_uT = 48 * std::cos(kDip_rad);
    const Three field = frame_.from_level(place, {level_uT * std::sin(kDeclination_rad),
                                                  level_uT * std::cos(kDeclination_rad), -48 * std::sin(kDip_rad)});
    const double c = std::cos(yaw_rad), s = std::sin(yaw_rad);
    return {.flux_b_uT = {single(c * field[0] + s * field[1] + 1e-3 * normal_(random_)),
                          single(c * field[1] - s * field[0] + 1e-3 * normal_(random_)),
                          single(field[2] + 1e-3 * normal_(random_))}};
  }
  sensor::AirPressure barometer() {
    const double pa = 101'325 * std::pow(1 - 2.25577e-5 * place.height_m, 5.25588);
    return {.pressure_Pa = single(pa + 0.5 * normal_(random_)), .temperature_degC = 15};
  }
  sensor::OutsideHeading antennas() {
    const Three line = frame_.to_level(place, {std::cos(yaw_rad), std::sin(yaw_rad), 0});
    return {.yaw_rad = single(std::atan2(line[1], line[0]) + 1e-4 * normal_(random_)), .acc_rad = 0.005F};
  }
  static float single(double x) { return static_cast<float>(x); }

 public:
  std::int64_t us;
  double yaw_rad, speed_mps = 0;  ///< heading in the start's level axes
  Three place_m{};                ///< in the start's frame
  Three velocity_mps{};
  GeoPlace place;
};

}  // namespace tetap::test
