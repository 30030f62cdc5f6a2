// SPDX-License-Identifier: Apache-2.0
// Whatever changes the inertial filter's covariance beside steps and updates carries the signatures along. Judge: a
// plain filter whose P has the fault's variance from the start, as P + phi phi^T / a has it at every time.
#include "tetap/model/direction.hpp"
#include "tetap/model/gnss_velocity_3d.hpp"
#include "tetap/model/zero_rate.hpp"
#include "tetap/nav/ins.hpp"
#include "tetap/trust/inertial_faults.hpp"

#include <gtest/gtest.h>
#include <cmath>

namespace tetap {
namespace {

using nav::InsState;
using trust::InertialFaults;

constexpr std::size_t kAccelX = 3, kGyroZ = 2;

/// A turn at 3 m/s, a velocity, `act`, and as many steps more. `act(filter, faults)` changes either filter. Few steps
/// for a fault of the gyroscope: the wide P of the judge has to stay within float's condition.
template <class Act>
void expect_carried(std::size_t row, const Act& act) {
  const trust::FaultRow& fault = InertialFaults::kRows[row];
  const auto jumps = static_cast<std::size_t>(fault.jumps);
  std::array<float, InsState::kErrors> start{4,     4,     9,     0.1F,  0.1F,  0.1F,  1e-3F, 1e-3F,
                                             1e-2F, 1e-3F, 1e-3F, 1e-3F, 1e-5F, 1e-5F, 1e-5F};
  InsState at;
  at.q_nb = nav::exp_quaternion({0.1F, -0.2F, 0.7F});
  at.v_n_mps = {3, 1, 0};
  nav::Ins ins, wide;
  ASSERT_TRUE(ins.start(at, start));
  start[jumps] += fault.largest * fault.largest;
  ASSERT_TRUE(wide.start(at, start));
  trust::InertialBank bank;
  nav::NoFaults none;
  const int steps = row == kAccelX ? 50 : 5;
  const auto drive = [steps](nav::Ins& filter, auto& faults) {
    for (int k = 0; k < steps; ++k) {
      ASSERT_EQ(filter.predict(nav::ImuIncrement::constant({0, 0, 0.4F}, {1.5F, -0.4F, 9.9F}, {10'000})),
                nav::ImuVerdict::kAccepted);
      filter.predict_covariance(faults);
    }
    const model::GnssVelocity3d seen{
        .v_n_mps = filter.x.v_n_mps, .sigma_horizontal_mps = 0.2F, .sigma_vertical_mps = 0.4F};
    ASSERT_EQ(filter.update(seen, 100.0F, faults).verdict, filter::Verdict::kAccepted);
  };
  for (nav::Ins* filter : {&ins, &wide})
    filter->noise = {.gyro_radps_rthz = 1e-3F, .accel_mps2_rthz = 1e-2F, .motion_sigma = 0};
  drive(ins, bank), act(ins, bank), drive(ins, bank);
  drive(wide, none), act(wide, none), drive(wide, none);
  const auto& one = bank.signature(row);
  const float variance = one.variance();
  for (std::size_t i = 0; i < InsState::kErrors; ++i)
    for (std::size_t j = 0; j <= i; ++j) {
      const int r = static_cast<int>(i), c = static_cast<int>(j);
      const float sigmas = std::sqrt(wide.p(r, r) * wide.p(c, c));
      EXPECT_NEAR(ins.p(r, c) + one.phi[i] * one.phi[j] * variance, wide.p(r, c), 2e-2F * sigmas) << r << ' ' << c;
    }
}

TEST(carried_faults, over_steps_alone) {
  expect_carried(kAccelX, [](nav::Ins&, auto&) {});
  expect_carried(kGyroZ, [](nav::Ins&, auto&) {});
}
TEST(carried_faults, over_a_gap_without_imu) {
  expect_carried(kAccelX,
                 [](nav::Ins& filter, auto& faults) { filter.predict_without_imu({400'000}, 0.5F, 0.05F, faults); });
}
TEST(carried_faults, over_a_turn_that_wheels_show_in_a_gap) {
  expect_carried(kGyroZ, [](nav::Ins& filter, auto& faults) {
    filter.turn_without_imu(nav::exp_quaternion({0, 0, 0.3F}));
    filter.predict_without_imu({50'000}, 0.5F, 0.05F, faults);
  });
}
TEST(carried_faults, over_the_tilt_that_turns_with_a_corrected_heading) {
  for (const float off_rad : {0.02F, 0.2F})  // by two shears, and by a rotation
    expect_carried(kAccelX, [off_rad](nav::Ins& filter, auto& faults) {
      model::DirectionMeasurement heading{.sigma_rad = 0.02F};
      heading.angle_rad = heading.predict(filter.x)(0) + off_rad;
      ASSERT_EQ(filter.update(heading, 1e3F, faults).verdict, filter::Verdict::kAccepted);
    });
}
TEST(carried_faults, over_a_standstill_whose_noise_is_in_the_heading) {
  expect_carried(kGyroZ, [](nav::Ins& filter, auto& faults) {
    const model::ZeroRate rest{.gyro_b_radps = filter.x.b_g_radps, .sigma_radps = 0.03F};
    const auto record = filter.update_shared_noise(rest, 1e3F, {0, 0, 1e-8F}, {1e-9F, 1e-9F, 1e-9F}, faults);
    ASSERT_EQ(record.verdict, filter::Verdict::kAccepted);
  });
}
TEST(carried_faults, over_biases_that_forget) {
  expect_carried(kAccelX, [](nav::Ins& filter, auto&) {
    filter.noise.accel_bias_time_s = 2;
    filter.noise.gyro_bias_time_s = 2;
  });
}
TEST(carried_faults, over_a_covariance_that_grows) {
  expect_carried(kAccelX, [](nav::Ins& filter, auto&) {
    filter.inflate(InsState::kVelocity, 0.5F);
    filter.inflate_up(InsState::kAttitude, 0.05F);
    filter.inflate_along({1, 0, 0, 0.3F, 0.2F, 0, 0, 0, 0.1F});
    filter.recondition();
  });
}

}  // namespace
}  // namespace tetap
