// SPDX-License-Identifier: Apache-2.0
#include "tetap/nav/imu_gather.hpp"

#include "tetap/nav/strapdown.hpp"
#include "true_body.hpp"

#include <gtest/gtest.h>
#include <vector>

namespace tetap {
namespace {

using nav::ImuIncrement;
using nav::InsState;

/// Half a second of tumbling.
std::vector<ImuIncrement> wild_samples() {
  test::Normal normal(5);
  std::vector<ImuIncrement> all;
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d rate = 2.0 * normal.vector();
    const Eigen::Vector3d force = Eigen::Vector3d(0, 0, 9.8) + 3.0 * normal.vector();
    all.push_back(ImuIncrement::constant(rate.cast<float>(), force.cast<float>(), {4000 + 200 * (i % 11)}));
  }
  return all;
}

InsState begin() {
  InsState x{.x = test::anchored(50'000.2), .y = test::anchored(-17.0), .z = test::anchored(3.0)};
  x.v_n_mps = {4, -3, 0.5F};
  x.q_nb = nav::from_euler({.yaw_rad = 2, .pitch_rad = 0.2F, .roll_rad = -0.1F});
  x.b_a_mps2 = {0.05F, -0.1F, 0.02F};
  x.b_g_radps = {0.01F, -0.004F, 0.02F};
  return x;
}

/// Two-speed: gathered spans of ten samples against every sample by itself.
TEST(ImuGather, SpansGiveWhatTheirSamplesGive) {
  const auto samples = wild_samples();
  InsState each = begin(), gathered = begin(), summed = begin();
  nav::ImuGather gather;
  ImuIncrement sum;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    nav::strapdown(each, samples[i], {});
    gather.add(samples[i]);
    sum.dtheta_b_rad += samples[i].dtheta_b_rad;
    sum.dv_b_mps += samples[i].dv_b_mps;
    sum.dt += samples[i].dt;
    if (i % 10 != 9) continue;
    EXPECT_EQ(gather.sum().dt, sum.dt);
    nav::strapdown(gathered, gather.take(), {});
    EXPECT_TRUE(gather.empty());
    nav::strapdown(summed, std::exchange(sum, {}), {});
  }
  const auto off = gathered.minus(each);
  EXPECT_LT(off.head<3>().norm(), 5e-3F);
  EXPECT_LT(off.segment<3>(3).norm(), 6e-4F);
  EXPECT_LT(off.segment<3>(6).norm(), 1e-4F);
  // Without the cross terms it would not be.
  const auto plain = summed.minus(each);
  EXPECT_GT(plain.segment<3>(3).norm(), 2e-3F);
  EXPECT_GT(plain.segment<3>(6).norm(), 2e-4F);
}

TEST(ImuGather, IsFullAtItsAngle) {
  const auto steps_until_full = [](float rate_radps) {
    nav::ImuGather gather;
    int steps = 0;
    while (!gather.full()) {
      gather.add(ImuIncrement::constant({0, 0, rate_radps}, {0, 0, 9.8F}, {1'000}));
      ++steps;
    }
    return steps;
  };
  EXPECT_EQ(steps_until_full(1), 200);
  EXPECT_EQ(steps_until_full(-30), 7);
  EXPECT_EQ(steps_until_full(300), 1);
}

}  // namespace
}  // namespace tetap
