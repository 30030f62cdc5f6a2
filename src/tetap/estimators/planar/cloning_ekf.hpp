// SPDX-License-Identifier: Apache-2.0
// An extended Kalman filter of the planar pose that takes displacements between stamps (pose_clones.hpp).
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/estimators/planar/planar_ekf.hpp"
#include "tetap/estimators/planar/pose_clones.hpp"
#include "tetap/model/planar_increment.hpp"

namespace tetap::estimators {

struct CloningEkf : PlanarEkf {
  bool predict(const model::PlanarIncrement& increment) {
    const model::PlanarPose before = x;
    if (!PlanarEkf::predict(increment)) return false;
    clones.move(before, x);
    return true;
  }
  template <class Measurement, class Gate>
  auto update(const Measurement& z, const Gate& gate) {
    const model::PlanarPose before = x;
    const filter::Symmetric<float, 3> p_before = p;
    auto record = PlanarEkf::update(z, gate);
    if (record.verdict == filter::Verdict::kAccepted) clones.correct(before, p_before, x, p);
    return record;
  }
  /// A displacement from the clone of that number; false positives of the gate leave everything as it is.
  [[nodiscard]] filter::Innovation<float, 3> update_relative(const sensor::RelativePose& z, int from,
                                                             float gate_scale) {
    auto record = clones.update(z, from, x, p, gate_scale);
    if (!filter::well_conditioned(p)) {
      filter::restore(p);
      clones.forget();
    }
    return record;
  }

  static constexpr auto members(auto& self) { return base::members(base::base_of<PlanarEkf>(self), self.clones); }
  PoseClones clones;
};

}  // namespace tetap::estimators
