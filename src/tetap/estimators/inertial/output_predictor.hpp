// SPDX-License-Identifier: Apache-2.0
// Output predictor: the state at the horizon carried to the present over the window's IMU samples. New samples are
// added; only after a correction at the horizon is all of the window carried anew, over a handful of cells. The delayed
// horizon and its output predictor are those of Khosravian, Trumpf, Mahony & Hamel 2015, and of PX4's EKF2.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/estimators/imu_place.hpp"
#include "tetap/estimators/inertial/imu_cells.hpp"
#include "tetap/estimators/inertial/imu_input.hpp"
#include "tetap/estimators/inertial/rebuild_schedule.hpp"
#include "tetap/nav/strapdown.hpp"
#include "tetap/sensor/window.hpp"

#include <cstdint>

namespace tetap::estimators {

class OutputPredictor {
 public:
  /// Surroundings of a prediction. Wheels may show the turn where the gyroscope is at full scale, or silent.
  struct Inputs {
    const param::InertialParameters& parameters;
    const nav::Earth& earth;
    bool turn_known;
    float wheel_turn_radps;
    bool imu_distrusted = false;  ///< an axis is stuck: samples are left out
  };
  struct Place {
    nav::InsState x;       ///< place and velocity are those of the IMU
    base::Micros reached;  ///< sum of the intervals of samples and gaps
    base::Micros last;     ///< stamp of the last sample that was neither invalid nor stuck
    checks::ImuClassifier classifier;
    nav::Vector3 rate_b_radps = nav::Vector3::Zero();  ///< the gyroscope's last rate, with its bias
    float unseen_s = 0;                                ///< time without acceleration: samples are missing or clipped
    float unseen_turn_s = 0;                           ///< time without turn rate
  };

  /// A sample is new in the window. True: it came late, and is not in the present yet.
  bool note_arrival(base::Micros stamp) {
    cells_.arrived(stamp);
    const bool late = stamp <= last_seen_;
    if (late) schedule_.note_correction();
    return late;
  }
  /// The filter's state is not what the present was predicted from.
  void note_correction() { schedule_.note_correction(); }
  [[nodiscard]] RebuildSchedule& schedule() { return schedule_; }
  [[nodiscard]] const RebuildSchedule& schedule() const { return schedule_; }
  /// Before the filter runs: keeps the cells of the window.
  void follow(const sensor::Window& window, const param::InertialParameters& n) { cells_.follow(window, n); }
  /// Rebuilds the present from the horizon. True: samples of some cell had to be classified one by one.
  bool rebuild(const Place& far, const sensor::Window& window, const Inputs& in);
  /// Adds the samples that came since.
  void extend(const sensor::Window& window, const Inputs& in);
  /// State at a time after the last sample: the velocity stays what it is in the body, but for the turn.
  [[nodiscard]] nav::InsState at(base::Micros t, const Inputs& in) const {
    nav::InsState x = place_.x;
    const base::Micros gap = t - place_.reached;
    if (checks::ImuClassifier::is_gap(gap)) static_cast<void>(nav::strapdown(x, unseen(gap, in), in.earth));
    ImuPlace(in.parameters).to_origin(x, place_.rate_b_radps - x.b_g_radps);
    return x;
  }
  /// The estimate's time.
  [[nodiscard]] base::Micros time() const { return time_; }
  void begin_tick(base::Micros t) { time_ = t; }
  /// Makes the state at the estimate's time the present.
  void publish(const Inputs& in, bool unusable) {
    present_ = at(time_, in);
    without_imu_ = unusable || checks::older(place_.last, time_, base::Micros{in.parameters.stale_us});
  }
  /// The present is without IMU: no valid sample within the time-out.
  [[nodiscard]] bool without_imu() const { return without_imu_; }
  [[nodiscard]] const nav::InsState& present() const { return present_; }
  void set_present(const nav::InsState& last) { present_ = last; }
  [[nodiscard]] const Place& place() const { return place_; }
  /// Stamp of the last sample in the prediction, of whatever class.
  [[nodiscard]] base::Micros last_seen() const { return last_seen_; }

  static constexpr auto members(auto& self) {
    return base::members(self.place_, base::in_turns(self.present_), self.last_seen_, self.cells_,
                         base::in_turns(self.gather_), self.schedule_, self.time_, self.without_imu_);
  }

 private:
  /// Samples of cells that a rebuild classifies one by one; cells beyond are bridged as if their samples were missing.
  /// A window of 200 ms of an IMU of 200 Hz has no more.
  static constexpr std::size_t kSamplewise = 40, kSamplewiseFast = 8;
  /// An IMU with shorter intervals has too many samples in a cell for a step at each lost one.
  static constexpr std::uint16_t kFast_us = 3'500;

  /// Holes between samples that are worked one by one: a step for each of the first, one step for all others.
  struct Holes {
    int bridged = 0;
    base::Micros rest;
  };
  static constexpr int kMostHoles = 12;

  void bridge(base::Micros gap, const Inputs& in);
  void note_bridged(base::Micros gap);
  void bridge_rest(const Holes& holes, const Inputs& in);
  void add_with_holes(const ImuCell& cell, const Inputs& in);
  void take_whole(const ImuCell& cell);
  /// The window's last sample of the IMU before index i; there is one.
  [[nodiscard]] static const ImuSample& newest_before(const sensor::Window& window, std::size_t i,
                                                      const param::InertialParameters& n);
  [[nodiscard]] nav::ImuIncrement unseen(base::Micros gap, const Inputs& in) const;
  void fold(const Inputs& in) {
    if (!gather_.empty()) static_cast<void>(nav::strapdown(place_.x, mounted(gather_.take(), in.parameters), in.earth));
  }
  void add(const Sample& sample, const Inputs& in, const ImuSample*& newest, Holes& holes);
  [[nodiscard]] static nav::Vector3 rate_of(const ImuSample& s, const param::InertialParameters& n) {
    return sensor::times(n.mounting_bs, checks::increment_of(s).dtheta_b_rad) /
           base::seconds(base::Micros{s.interval_us});
  }

  Place place_;
  nav::InsState present_;
  base::Micros last_seen_;  ///< stamp of the last sample in the prediction
  ImuCells cells_;
  nav::ImuGather gather_;  ///< samples that x does not have yet; empty between calls
  RebuildSchedule schedule_;
  base::Micros time_;         ///< time of the estimate
  bool without_imu_ = false;  ///< the present is without IMU
};

}  // namespace tetap::estimators
