// SPDX-License-Identifier: Apache-2.0
// From the far end of the window to the present: a state carried over the IMU samples that the window holds. What is
// new is added; only when the far end itself was corrected is all of it carried anew, over a handful of cells.
#pragma once

#include "estimators/inertial/imu_cells.hpp"
#include "nav/strapdown.hpp"
#include "sensor/row_major.hpp"

#include <cstdint>
#include <limits>

namespace tetap::estimators {

inline nav::ImuIncrement mounted(const nav::ImuIncrement& s, const param::InertialParameters& n) {
  return {.dtheta_b_rad = sensor::times(n.mounting_bs, s.dtheta_b_rad),
          .dv_b_mps = sensor::times(n.mounting_bs, s.dv_b_mps),
          .dt = s.dt};
}

class OutputPredictor {
 public:
  /// What it is carried with. Wheels may know how it turns where the gyroscope is at full scale, or silent.
  struct With {
    const param::InertialParameters& parameters;
    const nav::Earth& earth;
    bool turn_known;
    float wheel_turn_radps;
  };
  struct Place {
    nav::InsState x;
    base::Micros reached;  ///< by the intervals of samples and of what was missing
    base::Micros last;     ///< stamp of the last sample that said something
    checks::Repeats repeats;
    nav::Vector3 rate_b_radps = nav::Vector3::Zero();  ///< as the gyroscope showed it last
    /// Of the way: where no acceleration was seen (samples are missing or clipped), and where no turn.
    float unseen_s = 0, unseen_turn_s = 0;
  };

  /// A sample is new in the window. True: it came late, and the state was carried on without it.
  [[nodiscard]] bool arrived(base::Micros stamp) {
    cells_.arrived(stamp);
    return stamp <= heard_;
  }
  /// What is in the window will be needed.
  template <class Window>
  void watch(const Window& window, const param::InertialParameters& n) {
    cells_.follow(window, n);
  }
  /// Anew, from the far end. Whether cells of it had to be looked at sample by sample.
  template <class Window>
  bool carry_from(const Place& far, const Window& window, const With& ctx);
  /// On, over what came since.
  template <class Window>
  void carry_on(const Window& window, const With& ctx);
  /// At a time after the last sample: it goes on straight, level as it was, but for its turn.
  [[nodiscard]] nav::InsState at(base::Micros t, const With& ctx) const {
    nav::InsState x = place_.x;
    const base::Micros gap = t - place_.reached;
    if (gap > kImuJitter) static_cast<void>(nav::strapdown(x, unseen(gap, ctx), ctx.earth));
    return x;
  }
  /// Makes that the present.
  void reach(base::Micros t, const With& ctx) { present_ = at(t, ctx); }
  [[nodiscard]] const nav::InsState& present() const { return present_; }
  void remember(const nav::InsState& last) { present_ = last; }
  [[nodiscard]] const Place& place() const { return place_; }
  /// Stamp of the last sample it has, whatever that said.
  [[nodiscard]] base::Micros heard() const { return heard_; }

  template <class Sink>
  void hash_state(Sink&& sink) const {
    place_.x.hash_state(sink);
    place_.repeats.hash_state(sink);
    sink(place_.reached.us);
    sink(place_.last.us);
    sink(heard_.us);
    for (int i = 0; i < 3; ++i) sink(place_.rate_b_radps(i));
    sink(place_.unseen_s);
    sink(place_.unseen_turn_s);
  }

 private:
  [[nodiscard]] nav::ImuIncrement unseen(base::Micros gap, const With& ctx) const;
  void fold(const With& ctx) {
    if (!gather_.empty())
      static_cast<void>(nav::strapdown(place_.x, mounted(gather_.take(), ctx.parameters), ctx.earth));
  }
  void hear(const sensor::Sample& sample, const With& ctx, const sensor::ImuSample*& newest);
  [[nodiscard]] static nav::Vector3 rate_of(const sensor::ImuSample& s, const param::InertialParameters& n) {
    return sensor::times(n.mounting_bs, shown_by(s).dtheta_b_rad) / base::seconds(base::Micros{s.interval_us});
  }

  Place place_;
  nav::InsState present_;
  base::Micros heard_;
  ImuCells cells_;
  nav::ImuGather gather_;  ///< of samples that x does not have yet; empty between calls
};

/// What an IMU would have shown that went on straight. A gap of a few samples does not end a turn.
inline nav::ImuIncrement OutputPredictor::unseen(base::Micros gap, const With& ctx) const {
  const nav::InsState& x = place_.x;
  nav::Vector3 w_b = nav::Vector3::Zero();
  if (gap <= base::Micros{ctx.parameters.stale_us}) {
    w_b = place_.rate_b_radps - x.b_g_radps;
  } else if (ctx.turn_known) {
    w_b(2) = ctx.wheel_turn_radps;
  }
  const nav::Quaternion n_b = x.q_nb.conjugate();
  const nav::Vector3 f_b = n_b.rotate({0.0F, 0.0F, ctx.earth.gravity_mps2}) + nav::cross(w_b, n_b.rotate(x.v_n_mps));
  const float dt_s = base::seconds(gap);
  const nav::Vector3 dtheta = (x.b_g_radps + w_b) * dt_s;
  const nav::Vector3 dv = (x.b_a_mps2 + f_b) * dt_s;
  return {.dtheta_b_rad = dtheta, .dv_b_mps = dv + 0.5F * nav::cross(dtheta, dv), .dt = gap};
}

inline void OutputPredictor::hear(const sensor::Sample& sample, const With& ctx, const sensor::ImuSample*& newest) {
  const param::InertialParameters& n = ctx.parameters;
  const sensor::ImuSample& imu = sample.payload.imu;
  heard_ = sample.stamp;
  const nav::ImuIncrement increment = shown_by(imu);
  if (increment.check() != nav::ImuVerdict::kAccepted) return;
  if (place_.repeats.hear(imu, n.stuck_samples)) return;
  if (imu.clipped_gyro > 0 && ctx.turn_known) return;
  const base::Micros gap = sample.stamp - increment.dt - place_.reached;
  if (overlaps(gap, increment.dt)) return;
  if (gap > kImuJitter) {
    fold(ctx);
    if (newest != nullptr) place_.rate_b_radps = rate_of(*newest, n);
    static_cast<void>(nav::strapdown(place_.x, unseen(gap, ctx), ctx.earth));
    place_.reached += gap;
    place_.unseen_s += base::seconds(gap);
    place_.unseen_turn_s += base::seconds(gap);
  }
  if (imu.clipped_accel > 0 || imu.clipped_gyro > 0) place_.unseen_s += base::seconds(increment.dt);
  if (imu.clipped_gyro > 0) place_.unseen_turn_s += base::seconds(increment.dt);
  if (gather_.full()) fold(ctx);
  gather_.add(increment);
  place_.reached += increment.dt;
  place_.last = sample.stamp;
  newest = &imu;
}

template <class Window>
void OutputPredictor::carry_on(const Window& window, const With& ctx) {
  std::size_t i = window.size();
  while (i > 0 && window[i - 1].stamp > heard_) --i;
  const sensor::ImuSample* newest = nullptr;
  for (; i < window.size(); ++i)
    if (is_of(window[i], ctx.parameters)) hear(window[i], ctx, newest);
  fold(ctx);
  if (newest != nullptr) place_.rate_b_radps = rate_of(*newest, ctx.parameters);
  cells_.follow(window, ctx.parameters);
}

template <class Window>
bool OutputPredictor::carry_from(const Place& far, const Window& window, const With& ctx) {
  const param::InertialParameters& n = ctx.parameters;
  place_ = far;
  cells_.follow(window, n);
  std::size_t i = 0;
  const sensor::ImuSample* newest = nullptr;
  const auto hear_until = [&](base::Micros until) {
    for (; i < window.size(); ++i) {
      const sensor::Sample& sample = window[i];
      if (sample.stamp > until) return;
      if (is_of(sample, n)) hear(sample, ctx, newest);
    }
  };
  // The place on the grid that begins to leave sample by sample; then cells, but for those in which one has to be
  // looked at by itself; then what there was no cell for.
  hear_until(cells_.leaving_until());
  bool skipped = false;
  bool one_by_one = false;
  const auto look_back = [&]() {
    if (!skipped) return;
    skipped = false;
    while (i < window.size() && window[i].stamp <= place_.last) ++i;
    std::size_t at = i;
    while (!is_of(window[at - 1], n)) --at;
    newest = &window[at - 1].payload.imu;
    place_.repeats = checks::Repeats::after(*newest);
  };
  for (std::size_t c = 0; c < cells_.size(); ++c) {
    const ImuCell& cell = cells_[c];
    fold(ctx);
    if (cell.plain() && cell.follows(place_.reached)) {
      gather_ = cell.gather;
      place_.reached += gather_.sum().dt;
      place_.last = heard_ = cell.last();
      skipped = true;
    } else {
      look_back();
      hear_until(cell.last());
      one_by_one = true;
    }
  }
  fold(ctx);
  look_back();
  hear_until({std::numeric_limits<std::int64_t>::max()});
  fold(ctx);
  if (newest != nullptr) place_.rate_b_radps = rate_of(*newest, n);
  return one_by_one;
}

}  // namespace tetap::estimators
