// SPDX-License-Identifier: Apache-2.0
// The simulated world: a vehicle on a course, seen by its sensors. The same options and seed give the same
// measurements, bit for bit, on every host; the truth leaves only by truth(), for judges.
#pragma once

#include "sim_host/world/course.hpp"
#include "sim_host/world/earth.hpp"
#include "sim_host/world/faults.hpp"
#include "sim_host/world/feature_camera.hpp"
#include "sim_host/world/lidar.hpp"
#include "sim_host/world/measurement.hpp"
#include "sim_host/world/numbers.hpp"
#include "sim_host/world/scan_matcher.hpp"
#include "sim_host/world/sensors.hpp"
#include "sim_host/world/surroundings.hpp"
#include "sim_host/world/vehicle.hpp"
#include "tetap/base/time.hpp"

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace tetap::sim {

/// A start command's knowledge: where the vehicle was put, and how well.
struct StartPose {
  double x_m = 0, y_m = 0, yaw_rad = 0;
  double sigma_m = 0, sigma_yaw_rad = 0;
};

/// A sighting is of a landmark, or of Camera::kNoLandmark.
struct TrueSighting {
  base::Micros stamp;
  std::uint8_t landmark = Camera::kNoLandmark;
};

/// Position, velocity and attitude in the axes of another local frame.
[[nodiscard]] Truth in_frame(Truth truth, const FrameChange& change);

class World {
 public:
  struct Options {
    bool mismatched = true;  ///< false: only errors that filters model, see matched()
    bool inertial = false;   ///< not mismatched, too: what an inertial filter models, see matched_inertial()
    bool as_given = false;   ///< `parameters` hold as they are, whatever the two above are
    bool latency = true;     ///< false: everything arrives at its stamp
    bool map_given = true;   ///< false: the robot makes its own map of the landmarks
    Parameters parameters;
    Course course = default_course();
    CourseLimits limits;
    /// The map's origin: truth, start pose and landmarks are in its frame.
    GeodeticOrigin origin{.latitude_deg = 48.2627, .longitude_deg = 11.6683, .height_m = 520};
    std::optional<GeodeticOrigin> place;  ///< origin of the course, level there; none: the map's
    bool surveyed = true;  ///< false: the map begins at the first fix, so a start is known as well as that
    std::vector<FaultSetting> faults;
    base::Micros start{1'000'000};  ///< time of the bus when the run starts
    int substeps = 1;               ///< integration steps per 0.5 ms
  };

  /// Why there is no such world: a rate that does not divide 2000 Hz, a course that cannot be driven; empty: there is.
  [[nodiscard]] static std::string refusal(const Options& options);
  /// Ends the program where the options are refused.
  World(const Options& options, std::uint64_t seed);

  /// Lets the world run until `t`; appends what has arrived by then, in the order of arrival. Never runs backwards.
  void advance_to(base::Micros t, std::vector<Measurement>& arrived);

  /// Adds a fault, whose start counts from that of the run; a start that is past does not come again.
  void inject(const FaultSetting& fault) { faults_.add(fault); }
  /// A fault from the next step on; its setting gives the same run again when it is there from the start.
  FaultSetting inject(Fault fault, base::Micros duration) {
    const FaultSetting setting{fault, now_ + Vehicle::kStep, duration};
    inject(setting);
    return setting;
  }

  /// Times of the world: start() until start() + duration(). Truth is as of the last advance_to, on the grid of 0.5 ms,
  /// in the frame of the map.
  [[nodiscard]] Truth truth() const;
  [[nodiscard]] base::Micros start() const { return start_; }
  [[nodiscard]] base::Micros duration() const { return plan_->duration(); }
  /// By how much the clock of the bus is off now (fault clock_jump): what sync frames add to the world's time.
  [[nodiscard]] base::Micros clock_offset() const { return clock_offset_at(now_); }

  /// Signals of sensors that a board samples by itself, as of the last step.
  [[nodiscard]] Imu::Signals imu_signals() const { return imu_.signals(); }
  [[nodiscard]] std::array<double, 2> wheel_shafts() const { return wheels_.shafts(); }

  /// Start pose that a filter may be given.
  [[nodiscard]] StartPose start_pose() const;
  [[nodiscard]] std::span<const Landmark> map() const { return map_; }
  [[nodiscard]] bool map_given() const { return map_given_; }
  /// All sightings so far, in the order in which they were made, without those that were taken.
  [[nodiscard]] std::span<const TrueSighting> sightings() const { return sightings_; }
  [[nodiscard]] std::vector<TrueSighting> take_sightings() { return std::exchange(sightings_, {}); }
  [[nodiscard]] const GeodeticOrigin& origin() const { return origin_; }
  [[nodiscard]] const Parameters& parameters() const { return parameters_; }
  [[nodiscard]] const Faults& faults() const { return faults_; }
  [[nodiscard]] const Plan& plan() const { return *plan_; }
  /// Map that scanner and camera see, in the frame of the course; null where there is neither.
  [[nodiscard]] const Surroundings* surroundings() const { return surroundings_.get(); }

 private:
  struct Pending {
    Measurement measurement;
    std::uint64_t order;  ///< number of the measurement as made: the order among arrivals of one instant
  };
  static Parameters effective(const Options& options);
  [[nodiscard]] base::Micros clock_offset_at(base::Micros since_start) const;
  /// In the frame of the course, which sensors see.
  [[nodiscard]] Truth truth_here() const;
  void step();
  void kidnap();
  void emit(Value value, std::uint8_t sequence, base::Micros stamp_late, base::Micros latency,
            std::uint8_t instance = 0, bool torn = false);
  void emit(const Lidar::Scan& scan);
  void emit(const FeatureCamera::Image& image, std::uint8_t sequence, base::Micros latency);

  Parameters parameters_;
  base::Micros start_;
  Faults faults_;
  GeodeticOrigin origin_;
  bool surveyed_, map_given_;
  // Behind pointers, because sensors and vehicle point at them and a World may move.
  std::unique_ptr<const Plan> plan_;
  std::unique_ptr<const Earth> earth_;  ///< local frame of the course
  FrameChange to_map_;
  Vehicle vehicle_;
  Imu imu_;
  Wheels wheels_;
  Gnss gnss_;
  Camera camera_;
  std::vector<Landmark> map_;
  std::vector<TrueSighting> sightings_;
  Magnetometer magnetometer_;
  Barometer barometer_;
  ScanMatcher scan_matcher_;
  std::unique_ptr<const Surroundings> surroundings_;
  std::optional<Lidar> lidar_;
  std::optional<FeatureCamera> features_;
  Chance imu_latency_, wheel_latency_, gnss_latency_, camera_latency_, magnetometer_latency_, barometer_latency_,
      scan_matcher_latency_, lidar_latency_, features_latency_, loss_;
  base::Micros now_;  ///< time after the start
  std::uint8_t imu_sequence_ = 0, wheel_sequence_ = 0, position_sequence_ = 0, velocity_sequence_ = 0,
               sighting_sequence_ = 0, magnetometer_sequence_ = 0, barometer_sequence_ = 0, closure_sequence_ = 0,
               scan_sequence_ = 0, image_sequence_ = 0;
  std::uint64_t made_ = 0;
  std::vector<Pending> pending_;
};

/// Whether the sensor that the fault falls on is there.
[[nodiscard]] bool can_act(Fault fault, const World::Options& options);

}  // namespace tetap::sim
