// SPDX-License-Identifier: Apache-2.0
#include "tetap/estimators/inertial/output_predictor.hpp"

#include <algorithm>
#include <limits>

namespace tetap::estimators {

/// Increments of an IMU that went on straight. A gap of a few samples does not end a turn.
nav::ImuIncrement OutputPredictor::unseen(base::Micros gap, const Inputs& in) const {
  const nav::InsState& x = place_.x;
  nav::Vector3 w_b = nav::Vector3::Zero();
  if (gap <= base::Micros{in.parameters.stale_us}) {
    w_b = place_.rate_b_radps - x.b_g_radps;
  } else if (in.turn_known) {
    w_b(2) = in.wheel_turn_radps;
  }
  const nav::Quaternion n_b = x.q_nb.conjugate();
  const nav::Vector3 f_b = n_b.rotate(in.earth.gravity_mps2 * in.earth.up_n) + nav::cross(w_b, n_b.rotate(x.v_n_mps));
  const float dt_s = base::seconds(gap);
  const nav::Vector3 dtheta = (x.b_g_radps + w_b) * dt_s;
  const nav::Vector3 dv = (x.b_a_mps2 + f_b) * dt_s;
  return {.dtheta_b_rad = dtheta, .dv_b_mps = dv + 0.5F * nav::cross(dtheta, dv), .dt = gap};
}

void OutputPredictor::bridge(base::Micros gap, const Inputs& in) {
  if (gap.us <= 0) return;
  static_cast<void>(nav::strapdown(place_.x, unseen(gap, in), in.earth));
  note_bridged(gap);
}

void OutputPredictor::note_bridged(base::Micros gap) {
  place_.reached += gap;
  place_.unseen_s += base::seconds(gap);
  place_.unseen_turn_s += base::seconds(gap);
}

/// Up to the end of the cell in two steps: by the sum of its samples, and without IMU over the time between them.
void OutputPredictor::add_with_holes(const ImuCell& cell, const Inputs& in) {
  gather_ = cell.gather;
  const nav::ImuIncrement& sum = gather_.sum();
  place_.rate_b_radps = sensor::times(in.parameters.mounting_bs, sum.dtheta_b_rad) / base::seconds(sum.dt);
  place_.reached += sum.dt;
  fold(in);
  bridge(cell.last() - place_.reached, in);
}

/// The holes that are left are one step at the end.
void OutputPredictor::bridge_rest(const Holes& holes, const Inputs& in) {
  if (holes.rest.us > 0) static_cast<void>(nav::strapdown(place_.x, unseen(holes.rest, in), in.earth));
}

void OutputPredictor::add(const Sample& sample, const Inputs& in, const ImuSample*& newest, Holes& holes) {
  const param::InertialParameters& n = in.parameters;
  const ImuSample& imu = sample.payload.imu;
  last_seen_ = sample.stamp;
  if (in.imu_distrusted) return;
  const nav::ImuIncrement increment = checks::increment_of(imu);
  const base::Micros gap = sample.stamp - increment.dt - place_.reached;
  const checks::ImuClass found = place_.classifier.classify(imu, increment, gap, in.turn_known, n);
  if (found < checks::ImuClass::kAfterGap) return;
  if (found == checks::ImuClass::kAfterGap) {
    if (holes.bridged < kMostHoles) {
      ++holes.bridged;
      fold(in);
      if (newest != nullptr) place_.rate_b_radps = rate_of(*newest, n);
      bridge(gap, in);
      ImuPlace(n).change_rate(place_.x, rate_of(imu, n) - place_.rate_b_radps);
    } else {
      holes.rest += gap;
      note_bridged(gap);
    }
  }
  if (imu.clipped_accel > 0 || imu.clipped_gyro > 0) place_.unseen_s += base::seconds(increment.dt);
  if (imu.clipped_gyro > 0) place_.unseen_turn_s += base::seconds(increment.dt);
  if (gather_.full()) fold(in);
  gather_.add(increment);
  place_.reached += increment.dt;
  place_.last = sample.stamp;
  newest = &imu;
}

void OutputPredictor::extend(const sensor::Window& window, const Inputs& in) {
  std::size_t i = window.size();
  while (i > 0 && window[i - 1].stamp > last_seen_) --i;
  const ImuSample* newest = nullptr;
  Holes holes;
  for (; i < window.size(); ++i)
    if (is_of(window[i], in.parameters)) add(window[i], in, newest, holes);
  fold(in);
  if (newest != nullptr) place_.rate_b_radps = rate_of(*newest, in.parameters);
  bridge_rest(holes, in);
  cells_.follow(window, in.parameters);
}

const ImuSample& OutputPredictor::newest_before(const sensor::Window& window, std::size_t i,
                                                const param::InertialParameters& n) {
  while (!is_of(window[i - 1], n)) --i;
  return window[i - 1].payload.imu;
}

void OutputPredictor::take_whole(const ImuCell& cell) {
  gather_ = cell.gather;
  place_.reached += gather_.sum().dt;
  place_.last = last_seen_ = cell.last();
}

bool OutputPredictor::rebuild(const Place& far, const sensor::Window& window, const Inputs& in) {
  const param::InertialParameters& n = in.parameters;
  place_ = far;
  cells_.follow(window, n);
  std::size_t i = 0, added = 0;  // one by one
  const ImuSample* newest = nullptr;
  Holes holes;
  const auto add_until = [&](base::Micros until) {
    for (; i < window.size(); ++i) {
      const Sample& sample = window[i];
      if (sample.stamp > until) return;
      if (!is_of(sample, n)) continue;
      add(sample, in, newest, holes);
      ++added;
    }
  };
  // Sample by sample the grid place that begins to leave; then cells; then samples without a cell.
  add_until(cells_.leaving_until());
  const bool fast = newest != nullptr && newest->interval_us < kFast_us;
  bool skipped = false, samplewise = false;
  std::size_t left = fast ? kSamplewiseFast : kSamplewise;  // of samples in cells that may be classified by themselves
  const auto catch_up = [&]() {
    if (!skipped) return;
    skipped = false;
    i = std::max(i, window.until(place_.last));
    newest = &newest_before(window, i, n);
    place_.classifier = checks::ImuClassifier::after(*newest);
  };
  for (std::size_t c = 0; c < cells_.size(); ++c) {
    const ImuCell& cell = cells_[c];
    fold(in);
    if (cell.plain() && cell.follows(place_.reached) && !in.imu_distrusted) {
      take_whole(cell);
      skipped = true;
    } else if ((fast || left == 0) && cell.has_holes(place_.reached) && !in.imu_distrusted) {
      add_with_holes(cell, in);
      place_.last = last_seen_ = cell.last();
      skipped = true;
    } else if (left == 0) {
      // Its samples may be anything: neither the rate nor the classifier is taken from them.
      catch_up();
      i = std::max(i, window.until(cell.last()));
      bridge(cell.last() - place_.reached, in);
      last_seen_ = cell.last();
    } else {
      catch_up();
      added = 0;
      add_until(cell.last());
      left -= added < left ? added : left;
      samplewise = true;
    }
  }
  fold(in);
  catch_up();
  add_until({std::numeric_limits<std::int64_t>::max()});
  fold(in);
  if (newest != nullptr) place_.rate_b_radps = rate_of(*newest, n);
  bridge_rest(holes, in);
  return samplewise;
}

}  // namespace tetap::estimators
