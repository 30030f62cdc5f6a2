// SPDX-License-Identifier: Apache-2.0
// The inertial filter with a row's signature against a dense filter in double of 16 states: the 15 errors and the
// fault.
#include "tetap/trust/inertial_faults.hpp"

#include "tetap/nav/ins.hpp"

#include <gtest/gtest.h>
#include <Eigen/Dense>
#include <cmath>

namespace tetap {
namespace {

using nav::InsState;
using trust::InertialFaults;
constexpr int kErrors = InsState::kErrors, kF = kErrors;
using Dense = Eigen::Matrix<double, kErrors + 1, kErrors + 1>;

Eigen::Matrix3d crossed(const Eigen::Vector3d& v) {
  return Eigen::Matrix3d{{0, -v(2), v(1)}, {v(2), 0, -v(0)}, {-v(1), v(0), 0}};
}

/// A drive whose measurements are what the filter expects: both covariances move, and no state is corrected.
class BothFilters {
 public:
  explicit BothFilters(std::size_t row) : row_(row), like_(InertialFaults::kRows[row]) {
    const std::array<float, kErrors> start{4,     4,     9,     0.1F,  0.1F,  0.1F,  1e-4F, 1e-4F,
                                           1e-2F, 1e-3F, 1e-3F, 1e-3F, 1e-5F, 1e-5F, 1e-5F};
    InsState at;
    at.q_nb = nav::exp_quaternion({0.1F, -0.2F, 0.7F});
    ins_.noise = {.gyro_radps_rthz = 1e-3F, .accel_mps2_rthz = 1e-2F, .motion_sigma = 0};
    ins_.start(at, start);
    for (int i = 0; i < kErrors; ++i) dense_(i, i) = static_cast<double>(start[static_cast<std::size_t>(i)]);
    const double s2 = static_cast<double>(like_.largest) * static_cast<double>(like_.largest);
    dense_(kF, kF) = s2;
    if (like_.jumps < 0) return;
    dense_(like_.jumps, like_.jumps) += s2;
    dense_(like_.jumps, kF) = dense_(kF, like_.jumps) = s2;
  }
  void predict() {
    const double dt_s = 0.01;
    const Eigen::Matrix3d r_dt = ins_.x.q_nb.matrix().cast<double>() * dt_s;
    const nav::Vector3 f_b_mps2{1.5F, -0.4F, 9.9F};
    ASSERT_EQ(ins_.predict(nav::ImuIncrement::constant(nav::Vector3::Zero(), f_b_mps2, {10'000})),
              nav::ImuVerdict::kAccepted);
    ins_.predict_covariance(bank_);
    Dense f = Dense::Identity();
    f.block<3, 3>(0, 3) = dt_s * Eigen::Matrix3d::Identity();
    f.block<3, 3>(3, 6) = -crossed(r_dt * f_b_mps2.cast<double>());
    f.block<3, 3>(3, 9) = f.block<3, 3>(6, 12) = -r_dt;
    dense_ = (f * dense_ * f.transpose()).eval();
    const auto grow = [&](int first, float density) {
      for (int i = 0; i < 3; ++i)
        dense_(first + i, first + i) += static_cast<double>(density) * static_cast<double>(density) * dt_s;
    };
    grow(3, ins_.noise.accel_mps2_rthz), grow(6, ins_.noise.gyro_radps_rthz);
    grow(9, ins_.noise.accel_bias_mps3_rthz), grow(12, ins_.noise.gyro_bias_radps2_rthz);
  }
  template <class Model>
  void fuse(const Model& model, std::size_t first_row) {
    constexpr int kM = Model::kDimension;
    using Jacobian = Eigen::Matrix<double, kM, kErrors + 1>;
    Jacobian h = Jacobian::Zero();
    const auto own = model.jacobian(ins_.x);
    for (std::size_t k = 0; k < Model::kTouches.size(); ++k)
      for (int m = 0; m < kM; ++m) h(m, Model::kTouches[k]) = static_cast<double>(own(m, static_cast<int>(k)));
    if (row_ >= first_row && row_ < first_row + (first_row >= InertialFaults::kForward ? 1 : 3))
      h(static_cast<int>(row_ - first_row), kF) = 1;
    const Eigen::Vector<double, kM> noise = model.noise().template cast<double>();
    ASSERT_EQ(ins_.update(model, 100.0F, bank_).verdict, filter::Verdict::kAccepted);
    using Square = Eigen::Matrix<double, kM, kM>;
    const Square s = h * dense_ * h.transpose() + Square(noise.asDiagonal());
    dense_ -= (dense_ * h.transpose() * s.inverse() * h * dense_).eval();
  }
  void drive(int steps) {
    const nav::Vector3 lever_b_m{0.2F, -0.1F, 0.4F};
    for (int k = 1; k <= steps; ++k) {
      predict();
      const InsState& x = ins_.x;
      model::GnssFix3d fix{
          .x = x.x, .y = x.y, .z = x.z, .sigma_horizontal_m = 0.8F, .sigma_vertical_m = 1.5F, .antenna_b_m = lever_b_m};
      const nav::Vector3 lever_n_m = x.q_nb.rotate(lever_b_m);
      nav::move(fix.x, lever_n_m(0)), nav::move(fix.y, lever_n_m(1)), nav::move(fix.z, lever_n_m(2));
      if (k % 20 == 0) fuse(fix, InertialFaults::kFix);
      if (k % 10 == 0)
        fuse(model::GnssVelocity3d{.v_n_mps = x.v_n_mps,
                                   .sigma_horizontal_mps = 0.2F,
                                   .sigma_vertical_mps = 0.4F,
                                   .antenna_b_m = lever_b_m},
             InertialFaults::kVelocity);
      const nav::Vector3 v_b = x.q_nb.conjugate().rotate(x.v_n_mps);
      if (k % 7 == 0)
        fuse(model::WheelSpeed{.forward_mps = v_b(0),
                               .sigma_forward_mps = 0.1F,
                               .sigma_lateral_mps = 2,
                               .sigma_vertical_mps = 2,
                               .moves = false},
             InertialFaults::kForward);
      model::DirectionMeasurement heading{.sigma_rad = 0.1F};
      heading.angle_rad = heading.predict(x)(0);
      if (k % 30 == 0) fuse(heading, InertialFaults::kHeading);
    }
  }
  void expect_same(double share) const {
    const auto& one = bank_.signature(row_);
    const double variance = static_cast<double>(one.variance()), fault = std::sqrt(dense_(kF, kF));
    EXPECT_NEAR(variance, fault * fault, share * fault * fault);
    EXPECT_EQ(ins_.conditioned(), 0U) << "the filter's own repairs are apart";
    EXPECT_LT(fault, 0.7 * static_cast<double>(like_.largest)) << "the drive shows the fault";
    for (int i = 0; i < kErrors; ++i) {
      const double phi = static_cast<double>(one.phi[static_cast<std::size_t>(i)]), sigma = std::sqrt(dense_(i, i));
      EXPECT_NEAR(phi * variance, dense_(i, kF), share * sigma * fault) << i;
      for (int j = 0; j <= i; ++j) {
        const double other = static_cast<double>(one.phi[static_cast<std::size_t>(j)]);
        EXPECT_NEAR(static_cast<double>(ins_.p(i, j)) + phi * other * variance, dense_(i, j),
                    share * sigma * std::sqrt(dense_(j, j)));
      }
    }
  }

 private:
  std::size_t row_;
  trust::FaultRow like_;
  nav::Ins ins_;
  trust::InertialBank bank_;
  Dense dense_ = Dense::Zero();
};

TEST(inertial_faults, every_row_is_the_filter_that_has_its_fault_as_a_state) {
  for (std::size_t row = 0; row < InertialFaults::kRows.size(); ++row) {
    SCOPED_TRACE(row);
    BothFilters both(row);
    both.drive(300);
    both.expect_same(4e-3);
  }
}

TEST(inertial_faults, tilt_turns_with_a_corrected_heading) {
  trust::InertialBank bank;
  for (int k = 0; k < 10; ++k)
    bank.predict(nav::InsCovarianceStep<float>{.dt_s = 0.1F, .r_dt = 0.1F * nav::Matrix3::Identity()});
  constexpr std::size_t kTilt = InsState::kAttitude;
  EXPECT_NEAR(bank.signature(0).phi[kTilt], -1.0F, 1e-6F);
  bank.turn_tilt(0.3F);
  EXPECT_NEAR(bank.signature(0).phi[kTilt], -std::cos(0.3F), 1e-6F);
  EXPECT_NEAR(bank.signature(0).phi[kTilt + 1], -std::sin(0.3F), 1e-6F);
  EXPECT_EQ(bank.signature(0).phi[InsState::kGyroBias], 1.0F);
}

}  // namespace
}  // namespace tetap
