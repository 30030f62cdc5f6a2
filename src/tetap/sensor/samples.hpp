// SPDX-License-Identifier: Apache-2.0
// Measurements of sensors, in SI: the one form in which wired drivers, the bus and the simulated world hand data to
// estimators. Small structs, passed by value. Frames: b = body (x forward, y left, z up).
#pragma once

#include "tetap/base/float_bits.hpp"
#include "tetap/base/members.hpp"
#include "tetap/base/time.hpp"

#include <array>
#include <cstdint>

namespace tetap::sensor {

/// Increments over `interval`, so that a driver sampling faster can integrate coning and sculling.
struct ImuSample {
  std::array<float, 3> dangle_b_rad{};     ///< integrated angular rate
  std::array<float, 3> dvelocity_b_mps{};  ///< integrated specific force
  float temperature_degC = 0;              ///< NaN: not available
  std::uint16_t interval_us = 0;           ///< the span the increments cover; it ends at the stamp
  std::uint8_t clipped_gyro = 0;           ///< raw samples at full scale within the interval
  std::uint8_t clipped_accel = 0;
};

/// Free-running quadrature counters; only differences mean anything, and they wrap.
struct WheelCounts {
  std::uint16_t left = 0;
  std::uint16_t right = 0;
};

/// Ground speed of each wheel's contact point.
struct WheelSpeeds {
  float left_mps = 0;
  float right_mps = 0;
};

struct BodySpeed {
  float forward_mps = 0;
  float yaw_rate_radps = 0;  ///< NaN: not available
};

enum class GnssFix : std::uint8_t {
  kNone = 0,
  kTimeOnly = 1,
  k2d = 2,
  k3d = 3,
  kDifferential = 4,
  kRtkFloat = 5,
  kRtkFixed = 6
};

/// WGS84. Angles are integers of 2e-9 deg (0.2 mm), because a float would lose metres.
struct GnssPosition {
  std::int64_t latitude_2ndeg = 0;
  std::int64_t longitude_2ndeg = 0;
  float height_m = 0;          ///< above the ellipsoid; NaN: not available
  float horizontal_acc_m = 0;  ///< 1 sigma per axis, the receiver's own; NaN: not available
  float vertical_acc_m = 0;
  GnssFix fix = GnssFix::kNone;
  std::uint8_t satellites = 0;
};

/// In the local level frame n: east, north, up.
struct GnssVelocity {
  std::array<float, 3> v_n_mps{};
  float acc_mps = 0;  ///< 1 sigma per axis; NaN: not available
};

/// Magnetic flux density along the body's axes.
struct MagneticFlux {
  std::array<float, 3> flux_b_uT{};
};

struct AirPressure {
  float pressure_Pa = 0;
  float temperature_degC = 0;  ///< NaN: not available
};

/// Heading of a baseline on the body, from a receiver with two antennas for instance.
struct OutsideHeading {
  float yaw_rad = 0;
  float acc_rad = 0;  ///< 1 sigma; NaN: not available
};

/// A landmark or a target seen from the body: range, bearing (0 = ahead, counter-clockwise) or both; NaN: not measured.
struct LandmarkSighting {
  std::uint8_t landmark = 0;  ///< 0xFF: not identified
  float range_m = 0;
  float bearing_rad = 0;
  float range_rate_mps = base::kNan;  ///< radar only; positive: the distance grows
};

/// Displacement between two keyframes of a pose graph, in the integers of the bus. A factor of the covariance that is
/// nearly singular would not survive a float. Correlations are of x and y, x and yaw, y and yaw.
struct LoopClosure {
  static constexpr int kBits = 20;
  static constexpr std::int64_t kStepsPerMetre = 10'000,
                                kStepsPerRadian = 10'000;  ///< x, y, yaw, and sigmas of x, y
  static constexpr std::int64_t kSigmaStepsPerRadian = 100'000, kCorrelationSteps = 100'000;

  std::uint16_t from = 0;  ///< keyframe whose frame the displacement is in
  std::uint16_t to = 0;
  std::int32_t x = 0;  ///< [0.1 mm]
  std::int32_t y = 0;
  std::int32_t yaw = 0;            ///< [0.1 mrad]
  std::uint64_t sigmas = 0;        ///< pack() of sigma x, y [0.1 mm] and yaw [0.01 mrad]
  std::uint64_t correlations = 0;  ///< pack() of the three correlations [1e-5]

  static constexpr auto members(auto& self) {
    return base::members(self.from, self.to, self.x, self.y, self.yaw, base::wide(self.sigmas),
                         base::wide(self.correlations));
  }

  [[nodiscard]] static constexpr std::uint64_t pack(std::int32_t a, std::int32_t b, std::int32_t c) {
    constexpr std::uint64_t kMask = (std::uint64_t{1} << kBits) - 1;
    const auto bits = [](std::int32_t raw) { return static_cast<std::uint64_t>(std::int64_t{raw}) & kMask; };
    return bits(a) | bits(b) << kBits | bits(c) << (2 * kBits);
  }
  [[nodiscard]] static constexpr std::int32_t unpack(std::uint64_t word, int i) {
    const auto left = static_cast<std::int64_t>(word << (64 - kBits * (i + 1)));
    return static_cast<std::int32_t>(left >> (64 - kBits));
  }
};

/// The body at the stamp as seen from the body `interval_us` before, found by a scan matcher, a camera or another
/// odometry; sigmas and correlations in the steps of the bus. Correlations are of x and y, x and yaw, y and yaw.
struct RelativePose {
  static constexpr float kStepsPerMetre = 2000, kStepsPerRadian = 5000, kCorrelationSteps = 4000;
  static constexpr std::uint16_t kFree = 0xFFFF;  ///< sigma of an axis of which nothing is known

  float x_m = 0;
  float y_m = 0;
  float yaw_rad = 0;
  std::uint32_t interval_us = 0;
  std::array<std::uint16_t, 3> sigma{};       ///< those of x, y [0.5 mm] and yaw [0.2 mrad]
  std::array<std::int16_t, 3> correlation{};  ///< [2.5e-4]

  [[nodiscard]] constexpr bool unknown(std::size_t axis) const { return sigma[axis] == kFree; }
  [[nodiscard]] constexpr float sigma_of(std::size_t axis) const {
    return static_cast<float>(sigma[axis]) / (axis == 2 ? kStepsPerRadian : kStepsPerMetre);
  }
  /// Variances of a motion beside which the prior weighs a thousandth; `free_m`: 1 sigma of a free axis.
  [[nodiscard]] constexpr std::array<float, 3> as_unknown_motion(float free_m) const {
    float place_m2 = x_m * x_m + y_m * y_m;
    for (std::size_t i = 0; i < 2; ++i) place_m2 += unknown(i) ? free_m * free_m : 1e3F * sigma_of(i) * sigma_of(i);
    return {place_m2, place_m2, 1.0F};
  }
  [[nodiscard]] constexpr float correlation_of(std::size_t pair) const {
    return static_cast<float>(correlation[pair]) / kCorrelationSteps;
  }
};

/// A planar scan whose ranges lie in a pool (sensor/scan_pool.hpp). Bearings of the scanner, counter-clockwise.
struct PlanarScan {
  std::uint32_t number = 0;  ///< count of the scans in the pool, from 1
  float first_rad = 0;       ///< bearing of the first beam
  float step_rad = 0;        ///< from one beam to the next
  std::uint16_t beams = 0;
  std::uint8_t sequence = 0;  ///< on the bus
};

/// An image of a camera, whose features lie in a place of the pool (sensor/image_pool.hpp).
struct CameraImage {
  static constexpr std::uint8_t kNoTracker = 7;
  static constexpr std::uint16_t kNoExposure = 0xFFF;
  static constexpr std::uint8_t kRecogniser = 3;  ///< instance of what a camera's front end recognises

  std::uint8_t place = 0;
  std::uint8_t number = 0;                  ///< low 4 bits of its number
  std::uint8_t features = 0;                ///< how many
  std::uint8_t tracker_state = kNoTracker;  ///< the front end's own word; it decides nothing
  std::uint16_t exposure_10us = kNoExposure;
};

}  // namespace tetap::sensor
