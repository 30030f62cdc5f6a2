// SPDX-License-Identifier: Apache-2.0
// The sensors: each sees the truth, adds its own errors and the faults that concern it, and gives a sensor:: sample.
// A fault never changes how many random numbers are drawn, so with and without it everything else is the same.
#pragma once

#include "sim_host/world/chance.hpp"
#include "sim_host/world/course.hpp"
#include "sim_host/world/earth.hpp"
#include "sim_host/world/faults.hpp"
#include "sim_host/world/motion.hpp"
#include "sim_host/world/numbers.hpp"
#include "tetap/sensor/samples.hpp"

#include <array>
#include <optional>
#include <vector>

namespace tetap::sim {

/// An ideal IMU would integrate the path's closed forms. Its specific force is f = a + 2 w x v - g, with the Earth's
/// rotation w and the gravity g of the place. Raw samples at 2 kHz are limited to full scale, and summed to increments
/// between two calls of sample().
class Imu {
 public:
  Imu(const ImuParameters& parameters, double wheel_radius_m, const Earth& earth, std::uint64_t seed);
  void sense(const Motion& motion, double speed_mps, base::Micros now, const Faults& faults);
  [[nodiscard]] sensor::ImuSample sample(base::Micros now, const Faults& faults);
  /// Input of a chip's own model: the last step in the sensor's axes with all errors but white noise and limits.
  struct Signals {
    Vector3 rate_radps{}, force_mps2{};
    double vibration_share = 0;  ///< speed over ImuParameters::vibration_speed_mps
  };
  [[nodiscard]] Signals signals() const;
  /// True biases at the last sample.
  [[nodiscard]] Vector3 gyro_bias_radps() const;
  [[nodiscard]] Vector3 accel_bias_mps2() const;

 private:
  using Processes = std::array<GaussMarkov, 3>;
  [[nodiscard]] Processes walks(double sigma);

  ImuParameters parameters_;
  double period_s_;
  double wheel_radius_m_;
  const Earth* earth_;
  Vector3 earth_rate_n_radps_;
  Vector3 gravity_n_mps2_;  ///< gravity of the place, looked up every 0.1 s
  int until_gravity_ = 0;
  Matrix3 body_to_sensor_, uncalibrated_;
  Chance noise_, vibration_;
  Vector3 gyro_bias_{}, accel_bias_{}, gyro_scale_{}, accel_scale_{};
  Processes gyro_walk_, accel_walk_;
  std::optional<Vector3> last_rate_radps_;
  Vector3 angle_{}, velocity_{};
  Vector3 rate_radps_{}, force_mps2_{};  ///< signals of the last step, without bias and noise
  double lug_phase_rad_ = 0;
  double speed_mps_ = 0;
  int clipped_gyro_ = 0, clipped_accel_ = 0;
  bool stepped_ = false;
  sensor::ImuSample last_;
};

/// Quadrature counters of both wheels, or speeds made from their differences.
class Wheels {
 public:
  Wheels(const WheelSensorNumbers& parameters, const VehicleParameters& vehicle, std::uint64_t seed);
  void sense(const Motion& motion, base::Micros now, const Faults& faults);
  [[nodiscard]] sensor::WheelCounts counts();
  [[nodiscard]] sensor::WheelSpeeds wheel_speeds();
  [[nodiscard]] sensor::BodySpeed body_speed();
  /// Angles of both shafts in counts, left and right, as of the last step.
  [[nodiscard]] std::array<double, 2> shafts() const {
    return {left_.travel_m / left_.metres_per_count, right_.travel_m / right_.metres_per_count};
  }

 private:
  struct Wheel {
    double metres_per_count = 0;  ///< with the true radius
    double drawn_per_count = 0;   ///< with the drawing's
    double travel_m = 0;          ///< way of the rim, with the sensor's noise
    double unread_m = 0;          ///< way after the last reading
    std::int64_t count = 0;
    std::int64_t read = 0;
    std::uint16_t offset = 0;  ///< counters free-run: nobody zeroes them
  };
  void read();

  WheelSensorNumbers parameters_;
  double nominal_track_m_;
  Chance chance_;
  Wheel left_, right_;
  double speed_scale_ = 1;
};

class Gnss {
 public:
  struct Reading {
    std::optional<sensor::GnssPosition> position;
    std::optional<sensor::GnssVelocity> velocity;
  };
  Gnss(const GnssParameters& parameters, const Earth& earth, std::uint64_t seed);
  [[nodiscard]] Reading sample(const Truth& truth, base::Micros now, const Faults& faults);

 private:
  void advance_errors(base::Micros now);

  GnssParameters parameters_;
  const Earth* earth_;
  double period_s_;
  Chance noise_, outage_chance_, glitch_chance_, accuracy_chance_;
  std::array<GaussMarkov, 3> correlated_;
  GaussMarkov accuracy_;
  base::Micros outage_until_;
  int glitch_fixes_ = 0;
  int far_fixes_ = 0;  ///< fixes since the fault's silence ended
  std::array<double, 2> glitch_m_{};
  Reading last_;
};

/// The Earth's field as the body's axes see it, and the iron near by.
class Magnetometer {
 public:
  Magnetometer(const MagnetometerNumbers& parameters, const Earth& earth, std::uint64_t seed);
  [[nodiscard]] sensor::MagneticFlux sample(const Truth& truth, base::Micros now, const Faults& faults);

 private:
  MagnetometerNumbers parameters_;
  const Earth* earth_;
  Vector3 field_uT_;  ///< east, north, up of the place
  Matrix3 body_to_sensor_, uncalibrated_;
  Chance noise_;
  Vector3 hard_iron_uT_{}, scale_{};
  std::array<GaussMarkov, 3> local_;
};

/// Static pressure: the standard atmosphere (ISO 2533) at the body's height, and how far weather and sensor are off it.
class Barometer {
 public:
  Barometer(const BarometerNumbers& parameters, const Earth& earth, std::uint64_t seed);
  [[nodiscard]] sensor::AirPressure sample(const Truth& truth);

 private:
  BarometerNumbers parameters_;
  const Earth* earth_;
  Chance noise_;
  double offset_Pa_;
  GaussMarkov drift_;
};

/// Range and bearing to landmarks, and to what passes for one: clutter and moving obstacles.
class Camera {
 public:
  static constexpr std::uint8_t kNoLandmark = 0xFF;
  struct Seen {
    sensor::LandmarkSighting sighting;
    std::uint8_t landmark = kNoLandmark;  ///< truly seen; kNoLandmark: clutter or a moving obstacle
  };
  Camera(const CameraNumbers& parameters, std::vector<Landmark> landmarks, std::uint64_t seed);
  [[nodiscard]] std::vector<Seen> sample(const Truth& truth, base::Micros now, const Faults& faults);
  /// The surveyor's map: positions with an error of a few centimetres.
  [[nodiscard]] const std::vector<Landmark>& map() const { return map_; }

 private:
  /// An obstacle goes from `x_m`, `y_m` along `along` and back.
  struct Mover {
    double x_m, y_m;
    Direction along;
    double phase_m;  ///< way behind it at the start
  };
  struct Line {
    double range_m, bearing_rad;
    bool visible;
  };
  struct Place {
    double x_m, y_m, yaw_rad;  ///< place of the mount, heading of the body
  };
  [[nodiscard]] Line line_from(const Place& eye, double x_m, double y_m) const;
  void place_movers(Chance& chance);
  void add_movers(const Place& eye, base::Micros now, std::vector<Seen>& seen);
  void add_clutter(std::vector<Seen>& seen);
  [[nodiscard]] static sensor::LandmarkSighting nameless(double range_m, double bearing_rad);

  CameraNumbers parameters_;
  std::vector<Landmark> landmarks_;
  std::vector<Landmark> map_;
  std::vector<Mover> movers_;
  Chance noise_, wrong_, outlier_, clutter_, mover_noise_;
};

}  // namespace tetap::sim
