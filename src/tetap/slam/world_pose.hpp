// SPDX-License-Identifier: Apache-2.0
// A pose whose error is on the world's side: R = Exp(theta) R^, p = Exp(theta) p^ + rho, the right-invariant error of
// SE(3) (Barrau & Bonnabel 2017). A turn and a shift of the whole world then are one constant direction of error in
// each pose, whatever the estimate is.
#pragma once

#include "tetap/nav/so3.hpp"

namespace tetap::slam {

/// A pose in the world's axes, and six errors of it: theta (rad), then rho (m).
struct WorldPose {
  static constexpr int kErrors = 6;
  nav::Quaternion q_nb;
  nav::Vector3 p_n_m = nav::Vector3::Zero();

  void correct(const float* error) {
    const nav::Quaternion turn = nav::exp_quaternion({error[0], error[1], error[2]});
    q_nb = (turn * q_nb).renormalised();
    p_n_m = turn.rotate(p_n_m) + nav::Vector3{error[3], error[4], error[5]};
  }
};

}  // namespace tetap::slam
