// SPDX-License-Identifier: Apache-2.0
// Poses of up to two earlier stamps beside the pose of now, with all covariances: what a displacement between stamps is
// compared with. Source: Roumeliotis & Burdick, "Stochastic cloning: a generalized framework for processing relative
// state measurements", ICRA 2002. The filter of the pose stays as it is: its updates reach the clones by regression on
// the pose, which is the same as one filter of all poses.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/base/time.hpp"
#include "tetap/filter/update.hpp"
#include "tetap/model/planar_pose.hpp"
#include "tetap/sensor/samples.hpp"

#include <array>
#include <cstddef>

namespace tetap::estimators {

class PoseClones {
 public:
  using Covariance = filter::Symmetric<float, 3>;
  static constexpr int kClones = 2, kNone = -1;
  /// Stamps so near are the same: senders round them.
  static constexpr base::Micros kSame{500};

  void forget() { stamp_.fill({}); }
  [[nodiscard]] bool any() const { return held(0) || held(1); }
  /// The clone of that stamp, or kNone.
  [[nodiscard]] int find(base::Micros stamp) const {
    for (int k = 0; k < kClones; ++k)
      if (held(k) && stamp - stamp_[at(k)] <= kSame && stamp_[at(k)] - stamp <= kSame) return k;
    return kNone;
  }
  /// The pose of now is kept, in the place of a clone other than `but`.
  void add(base::Micros stamp, const model::PlanarPose& x, const Covariance& p, int but);
  /// The pose went from one to the other by a motion with errors of its own.
  void move(const model::PlanarPose& from, const model::PlanarPose& to);
  /// A measurement of the pose changed it from x, p.
  void correct(const model::PlanarPose& x, const Covariance& p, const model::PlanarPose& new_x,
               const Covariance& new_p);

  /// Implements docs/explanation/equations.md (19).
  /// The displacement from clone `from` to the pose x, p, which change with the clones where the verdict is kAccepted.
  /// Axes without a sigma do not count in the gate, which is `gate_scale` times the 99 % quantile.
  [[nodiscard]] filter::Innovation<float, 3> update(const sensor::RelativePose& z, int from, model::PlanarPose& x,
                                                    Covariance& p, float gate_scale);

  static constexpr auto members(auto& self) {
    return base::members(self.x_, self.stamp_, base::in_turns(self.cross_), base::in_turns(self.p_));
  }

 private:
  static constexpr int kAll = 3 + 3 * kClones;
  static constexpr std::size_t at(int k) { return static_cast<std::size_t>(k); }
  [[nodiscard]] bool held(int k) const { return stamp_[at(k)].us != 0; }
  /// Covariance of error r of the pose of now with error c of the clones.
  [[nodiscard]] float cross(int r, int c) const { return cross_[at(3 * c + r)]; }
  [[nodiscard]] float& cross(int r, int c) { return cross_[at(3 * c + r)]; }

  std::array<model::PlanarPose, kClones> x_{};
  std::array<base::Micros, kClones> stamp_{};  ///< 0: none
  std::array<float, std::size_t{9} * kClones> cross_{};
  filter::Symmetric<float, 3 * kClones> p_;
};

}  // namespace tetap::estimators
