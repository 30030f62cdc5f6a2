// SPDX-License-Identifier: Apache-2.0
// Running worlds and looking at what comes out, for the tests of sim_host/world.
#pragma once

#include "sim_host/world/world.hpp"

#include <bit>
#include <cstdint>
#include <vector>

namespace tetap::sim {

/// FNV-1a over every field of a measurement, floats by their bits.
class Hash {
 public:
  void add(std::uint64_t value) {
    for (int i = 0; i < 8; ++i) hash_ = (hash_ ^ ((value >> (8 * i)) & 0xFF)) * 0x100000001B3U;
  }
  void add(float value) { add(std::uint64_t{std::bit_cast<std::uint32_t>(value)}); }
  void add(double value) { add(std::bit_cast<std::uint64_t>(value)); }
  void add(const Measurement& m) {
    add(static_cast<std::uint64_t>(m.stamp.us));
    add(static_cast<std::uint64_t>(m.arrival.us));
    add(std::uint64_t{m.instance} | std::uint64_t{m.sequence} << 8 | std::uint64_t{m.lost_parts} << 16 |
        m.value.index() << 24);
    std::visit([this](const auto& v) { fields(v); }, m.value);
  }
  void add(const Truth& t) {
    for (const double x : {t.x_m, t.y_m, t.z_m, t.roll_rad, t.pitch_rad, t.yaw_rad, t.speed_mps, t.yaw_rate_radps})
      add(x);
  }
  [[nodiscard]] std::uint64_t value() const { return hash_; }

 private:
  void fields(const sensor::ImuSample& s) {
    add(std::uint64_t{s.interval_us});
    for (const float x : s.dangle_b_rad) add(x);
    for (const float x : s.dvelocity_b_mps) add(x);
    add(s.temperature_degC);
    add(std::uint64_t{s.clipped_gyro} | std::uint64_t{s.clipped_accel} << 8);
  }
  void fields(const sensor::WheelCounts& s) { add(std::uint64_t{s.left} | std::uint64_t{s.right} << 16); }
  void fields(const sensor::WheelSpeeds& s) { add(s.left_mps), add(s.right_mps); }
  void fields(const sensor::BodySpeed& s) { add(s.forward_mps), add(s.yaw_rate_radps); }
  void fields(const sensor::GnssPosition& s) {
    add(static_cast<std::uint64_t>(s.latitude_2ndeg));
    add(static_cast<std::uint64_t>(s.longitude_2ndeg));
    for (const float x : {s.height_m, s.horizontal_acc_m, s.vertical_acc_m}) add(x);
    add(static_cast<std::uint64_t>(s.fix) | std::uint64_t{s.satellites} << 8);
  }
  void fields(const sensor::GnssVelocity& s) {
    for (const float x : s.v_n_mps) add(x);
    add(s.acc_mps);
  }
  void fields(const sensor::MagneticFlux& s) {
    for (const float x : s.flux_b_uT) add(x);
  }
  void fields(const sensor::AirPressure& s) { add(s.pressure_Pa), add(s.temperature_degC); }
  void fields(const sensor::LoopClosure& s) {
    add(std::uint64_t{s.from} | std::uint64_t{s.to} << 16);
    for (const std::int32_t x : {s.x, s.y, s.yaw}) add(static_cast<std::uint64_t>(std::int64_t{x}));
    add(s.sigmas), add(s.correlations);
  }
  void fields(const sensor::LandmarkSighting& s) { add(std::uint64_t{s.landmark}), add(s.range_m), add(s.bearing_rad); }
  void fields(const ScanHead& s) {
    add(std::uint64_t{s.count}), add(static_cast<std::uint64_t>(std::int64_t{s.first})),
        add(static_cast<std::uint64_t>(std::int64_t{s.step}));
  }
  void fields(const ScanBlock& s) {
    add(std::uint64_t{s.block});
    for (const std::uint16_t range : s.ranges) add(std::uint64_t{range});
  }
  void fields(const ImageFeature& s) {
    add(std::uint64_t{s.track} | std::uint64_t{s.u} << 16 | std::uint64_t{s.v} << 32);
  }
  void fields(const ImageEnd& s) {
    add(std::uint64_t{s.count} | std::uint64_t{s.exposure_10us} << 16 | std::uint64_t{s.tracking} << 32);
  }

  std::uint64_t hash_ = 0xCBF29CE484222325U;
};

/// Everything that arrives within `length`, asked for every `every`.
inline std::vector<Measurement> run(const World::Options& options, std::uint64_t seed, base::Micros length,
                                    base::Micros every = {10'000}) {
  World world{options, seed};
  std::vector<Measurement> all;
  const base::Micros end = world.start() + length;
  for (base::Micros t = world.start(); t < end; t += every) world.advance_to(t, all);
  world.advance_to(end, all);
  return all;
}

inline std::uint64_t hash(const std::vector<Measurement>& all) {
  Hash h;
  for (const auto& m : all) h.add(m);
  return h.value();
}

inline bool same(const Measurement& a, const Measurement& b) { return hash({a}) == hash({b}); }

/// No noise, no slip, no wander, a start as planned: what is left is geometry.
inline Parameters perfect() {
  Parameters n = matched(Parameters{});
  n.vehicle.driver_wander_m = n.vehicle.start_m = n.vehicle.start_rad = 0;
  n.imu.gyro_noise = 0;
  n.imu.accel_noise = {};
  n.wheels.noise_m = 0;
  n.gnss.white_m = n.gnss.velocity_mps = 0;
  n.camera.sigma_range_m = n.camera.sigma_bearing_rad = n.camera.miss_probability = 0;
  return n;
}

/// Stands still for that long.
inline Course parked_course(double seconds) {
  return {.waypoints = {{.x_m = 0, .y_m = 0, .stop_s = seconds}, {.x_m = 1, .y_m = 0, .stop_s = 1}},
          .landmarks = {{1, 5, 0}, {2, 6, 4}, {3, 0, 5}, {4, 11, -9}, {5, -5, 0}}};
}

inline constexpr base::Micros seconds_us(double s) { return {static_cast<std::int64_t>(s * 1e6 + 0.5)}; }

struct Statistics {
  double mean = 0;
  double variance = 0;
};

inline Statistics statistics(const std::vector<double>& values) {
  Statistics s;
  for (const double v : values) s.mean += v;
  s.mean /= static_cast<double>(values.size());
  for (const double v : values) s.variance += (v - s.mean) * (v - s.mean);
  s.variance /= static_cast<double>(values.size() - 1);
  return s;
}

/// Autocorrelation at a lag, of a series whose mean is zero by construction.
inline double correlation(const std::vector<double>& values, std::size_t lag) {
  double product = 0;
  double square = 0;
  for (std::size_t i = 0; i + lag < values.size(); ++i)
    product += values[i] * values[i + lag], square += values[i] * values[i];
  return product / square;
}

}  // namespace tetap::sim
