// SPDX-License-Identifier: Apache-2.0
// An extended Kalman filter of the planar pose that also sums up its increments: what moves along with it moves once
// for many of them.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/estimators/planar/planar_ekf.hpp"
#include "tetap/model/planar_increment.hpp"

namespace tetap::estimators {

struct SummingEkf : PlanarEkf {
  bool predict(const model::PlanarIncrement& increment) {
    travel.ds_m += increment.ds_m;
    travel.dyaw_rad += increment.dyaw_rad;
    travel.var_ds += increment.var_ds;
    travel.var_dyaw += increment.var_dyaw;
    return PlanarEkf::predict(increment);
  }
  static constexpr auto members(auto& self) { return base::members(base::base_of<PlanarEkf>(self), self.travel); }
  model::PlanarIncrement travel;  ///< sum since the owner set it back; the errors of length and turn are independent
};

}  // namespace tetap::estimators
