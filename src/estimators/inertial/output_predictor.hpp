// SPDX-License-Identifier: Apache-2.0
// Output predictor: the state at the horizon carried to the present over the window's IMU samples. New samples are
// added; only after a correction at the horizon is all of the window carried anew, over a handful of cells. The delayed
// horizon and its output predictor are those of Khosravian, Trumpf, Mahony & Hamel 2015, and of PX4's EKF2.
#pragma once

#include "estimators/inertial/imu_cells.hpp"
#include "estimators/inertial/imu_input.hpp"
#include "estimators/inertial/rebuild_schedule.hpp"
#include "nav/strapdown.hpp"

#include <cstdint>
#include <limits>

namespace tetap::estimators {

class OutputPredictor {
 public:
  /// Surroundings of a prediction. Wheels may show the turn where the gyroscope is at full scale, or silent.
  struct Inputs {
    const param::InertialParameters& parameters;
    const nav::Earth& earth;
    bool turn_known;
    float wheel_turn_radps;
  };
  struct Place {
    nav::InsState x;
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
  template <class Window>
  void follow(const Window& window, const param::InertialParameters& n) {
    cells_.follow(window, n);
  }
  /// Rebuilds the present from the horizon. True: samples of some cell had to be classified one by one.
  template <class Window>
  bool rebuild(const Place& far, const Window& window, const Inputs& in);
  /// Adds the samples that came since.
  template <class Window>
  void extend(const Window& window, const Inputs& in);
  /// State at a time after the last sample: the velocity stays what it is in the body, but for the turn.
  [[nodiscard]] nav::InsState at(base::Micros t, const Inputs& in) const {
    nav::InsState x = place_.x;
    const base::Micros gap = t - place_.reached;
    if (checks::ImuClassifier::is_gap(gap)) static_cast<void>(nav::strapdown(x, unseen(gap, in), in.earth));
    return x;
  }
  /// The estimate's time.
  [[nodiscard]] base::Micros time() const { return time_; }
  void begin_tick(base::Micros t) { time_ = t; }
  /// Makes the state at the estimate's time the present.
  void publish(const Inputs& in, bool saturated) {
    present_ = at(time_, in);
    without_imu_ = saturated || checks::older(place_.last, time_, base::Micros{in.parameters.stale_us});
  }
  /// The present is without IMU: no valid sample within the time-out.
  [[nodiscard]] bool without_imu() const { return without_imu_; }
  [[nodiscard]] const nav::InsState& present() const { return present_; }
  void remember(const nav::InsState& last) { present_ = last; }
  [[nodiscard]] const Place& place() const { return place_; }
  /// Stamp of the last sample in the prediction, of whatever class.
  [[nodiscard]] base::Micros last_seen() const { return last_seen_; }

  template <class Sink>
  void hash_state(Sink&& sink) const {
    place_.x.hash_state(sink);
    place_.classifier.hash_state(sink);
    sink(place_.reached.us);
    sink(place_.last.us);
    sink(last_seen_.us);
    for (int i = 0; i < 3; ++i) sink(place_.rate_b_radps(i));
    sink(place_.unseen_s);
    sink(place_.unseen_turn_s);
    schedule_.hash_state(sink);
  }

 private:
  [[nodiscard]] nav::ImuIncrement unseen(base::Micros gap, const Inputs& in) const;
  void fold(const Inputs& in) {
    if (!gather_.empty()) static_cast<void>(nav::strapdown(place_.x, mounted(gather_.take(), in.parameters), in.earth));
  }
  void add(const Sample& sample, const Inputs& in, const ImuSample*& newest);
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

/// Increments of an IMU that went on straight. A gap of a few samples does not end a turn.
inline nav::ImuIncrement OutputPredictor::unseen(base::Micros gap, const Inputs& in) const {
  const nav::InsState& x = place_.x;
  nav::Vector3 w_b = nav::Vector3::Zero();
  if (gap <= base::Micros{in.parameters.stale_us}) {
    w_b = place_.rate_b_radps - x.b_g_radps;
  } else if (in.turn_known) {
    w_b(2) = in.wheel_turn_radps;
  }
  const nav::Quaternion n_b = x.q_nb.conjugate();
  const nav::Vector3 f_b = n_b.rotate({0.0F, 0.0F, in.earth.gravity_mps2}) + nav::cross(w_b, n_b.rotate(x.v_n_mps));
  const float dt_s = base::seconds(gap);
  const nav::Vector3 dtheta = (x.b_g_radps + w_b) * dt_s;
  const nav::Vector3 dv = (x.b_a_mps2 + f_b) * dt_s;
  return {.dtheta_b_rad = dtheta, .dv_b_mps = dv + 0.5F * nav::cross(dtheta, dv), .dt = gap};
}

inline void OutputPredictor::add(const Sample& sample, const Inputs& in, const ImuSample*& newest) {
  const param::InertialParameters& n = in.parameters;
  const ImuSample& imu = sample.payload.imu;
  last_seen_ = sample.stamp;
  const nav::ImuIncrement increment = checks::increment_of(imu);
  const base::Micros gap = sample.stamp - increment.dt - place_.reached;
  const checks::ImuClass found = place_.classifier.classify(imu, increment, gap, in.turn_known, n.stuck_samples);
  if (found < checks::ImuClass::kAfterGap) return;
  if (found == checks::ImuClass::kAfterGap) {
    fold(in);
    if (newest != nullptr) place_.rate_b_radps = rate_of(*newest, n);
    static_cast<void>(nav::strapdown(place_.x, unseen(gap, in), in.earth));
    place_.reached += gap;
    place_.unseen_s += base::seconds(gap);
    place_.unseen_turn_s += base::seconds(gap);
  }
  if (imu.clipped_accel > 0 || imu.clipped_gyro > 0) place_.unseen_s += base::seconds(increment.dt);
  if (imu.clipped_gyro > 0) place_.unseen_turn_s += base::seconds(increment.dt);
  if (gather_.full()) fold(in);
  gather_.add(increment);
  place_.reached += increment.dt;
  place_.last = sample.stamp;
  newest = &imu;
}

template <class Window>
void OutputPredictor::extend(const Window& window, const Inputs& in) {
  std::size_t i = window.size();
  while (i > 0 && window[i - 1].stamp > last_seen_) --i;
  const ImuSample* newest = nullptr;
  for (; i < window.size(); ++i)
    if (is_of(window[i], in.parameters)) add(window[i], in, newest);
  fold(in);
  if (newest != nullptr) place_.rate_b_radps = rate_of(*newest, in.parameters);
  cells_.follow(window, in.parameters);
}

template <class Window>
bool OutputPredictor::rebuild(const Place& far, const Window& window, const Inputs& in) {
  const param::InertialParameters& n = in.parameters;
  place_ = far;
  cells_.follow(window, n);
  std::size_t i = 0;
  const ImuSample* newest = nullptr;
  const auto add_until = [&](base::Micros until) {
    for (; i < window.size(); ++i) {
      const Sample& sample = window[i];
      if (sample.stamp > until) return;
      if (is_of(sample, n)) add(sample, in, newest);
    }
  };
  // First, sample by sample, the grid place that begins to leave; then cells, but for those with a sample that has to
  // be classified by itself; then samples without a cell.
  add_until(cells_.leaving_until());
  bool skipped = false;
  bool one_by_one = false;
  const auto catch_up = [&]() {
    if (!skipped) return;
    skipped = false;
    while (i < window.size() && window[i].stamp <= place_.last) ++i;
    std::size_t at = i;
    while (!is_of(window[at - 1], n)) --at;
    newest = &window[at - 1].payload.imu;
    place_.classifier = checks::ImuClassifier::after(*newest);
  };
  for (std::size_t c = 0; c < cells_.size(); ++c) {
    const ImuCell& cell = cells_[c];
    fold(in);
    if (cell.plain() && cell.follows(place_.reached)) {
      gather_ = cell.gather;
      place_.reached += gather_.sum().dt;
      place_.last = last_seen_ = cell.last();
      skipped = true;
    } else {
      catch_up();
      add_until(cell.last());
      one_by_one = true;
    }
  }
  fold(in);
  catch_up();
  add_until({std::numeric_limits<std::int64_t>::max()});
  fold(in);
  if (newest != nullptr) place_.rate_b_radps = rate_of(*newest, n);
  return one_by_one;
}

}  // namespace tetap::estimators
