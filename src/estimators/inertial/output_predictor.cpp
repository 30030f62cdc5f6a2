// SPDX-License-Identifier: Apache-2.0
#include "estimators/inertial/output_predictor.hpp"

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

void OutputPredictor::add(const Sample& sample, const Inputs& in, const ImuSample*& newest) {
  const param::InertialParameters& n = in.parameters;
  const ImuSample& imu = sample.payload.imu;
  last_seen_ = sample.stamp;
  if (in.imu_distrusted) return;
  const nav::ImuIncrement increment = checks::increment_of(imu);
  const base::Micros gap = sample.stamp - increment.dt - place_.reached;
  const checks::ImuClass found = place_.classifier.classify(imu, increment, gap, in.turn_known, n);
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

void OutputPredictor::extend(const sensor::Window& window, const Inputs& in) {
  std::size_t i = window.size();
  while (i > 0 && window[i - 1].stamp > last_seen_) --i;
  const ImuSample* newest = nullptr;
  for (; i < window.size(); ++i)
    if (is_of(window[i], in.parameters)) add(window[i], in, newest);
  fold(in);
  if (newest != nullptr) place_.rate_b_radps = rate_of(*newest, in.parameters);
  cells_.follow(window, in.parameters);
}

bool OutputPredictor::rebuild(const Place& far, const sensor::Window& window, const Inputs& in) {
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
  bool samplewise = false;
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
    if (cell.plain() && cell.follows(place_.reached) && !in.imu_distrusted) {
      gather_ = cell.gather;
      place_.reached += gather_.sum().dt;
      place_.last = last_seen_ = cell.last();
      skipped = true;
    } else {
      catch_up();
      add_until(cell.last());
      samplewise = true;
    }
  }
  fold(in);
  catch_up();
  add_until({std::numeric_limits<std::int64_t>::max()});
  fold(in);
  if (newest != nullptr) place_.rate_b_radps = rate_of(*newest, n);
  return samplewise;
}

}  // namespace tetap::estimators
