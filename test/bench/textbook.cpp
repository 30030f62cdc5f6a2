// SPDX-License-Identifier: Apache-2.0
// The steps as a textbook prints them (Thrun, Burgard, Fox 2005, tables 3.1 and 3.3), in fixed-size Eigen with its own
// vectorisation and the C library's trigonometry.
#include "bench/contestant.hpp"

#include <Eigen/Dense>
#include <cmath>

namespace tetap::bench {
namespace {

template <int N>
Outcome outcome_of(const Eigen::Matrix<float, N, 1>& x, const Eigen::Matrix<float, N, N>& p) {
  Outcome out;
  for (int r = 0; r < N; ++r) out.x.push_back(static_cast<double>(x(r)));
  for (int r = 0; r < N; ++r)
    for (int c = 0; c < N; ++c) out.p.push_back(static_cast<double>(p(r, c)));
  return out;
}

class Kalman final : public Filter<KalmanInput> {
 public:
  Kalman() {
    constexpr float dt = KalmanInput::kDt_s, q = KalmanInput::kAccelerationVariance;
    f_.setIdentity();
    q_.setZero();
    h_.setZero();
    for (int i = 0; i < 4; i += 2) {
      f_(i, i + 1) = dt;
      q_(i, i) = q * dt * dt * dt * dt / 4;
      q_(i, i + 1) = q_(i + 1, i) = q * dt * dt * dt / 2;
      q_(i + 1, i + 1) = q * dt * dt;
      h_(i / 2, i) = 1;
    }
    r_ = Eigen::Matrix2f::Identity() * KalmanInput::kVariance;
  }
  void start() override {
    x_.setZero();
    p_ = Eigen::Matrix4f::Identity() * KalmanInput::kStartVariance;
  }
  void run(std::span<const KalmanInput> inputs) override {
    for (const KalmanInput& in : inputs) {
      x_ = f_ * x_;
      p_ = f_ * p_ * f_.transpose() + q_;
      const Eigen::Matrix2f s = h_ * p_ * h_.transpose() + r_;
      const Eigen::Matrix<float, 4, 2> k = p_ * h_.transpose() * s.inverse();
      x_ += k * (Eigen::Vector2f(in.x_m, in.y_m) - h_ * x_);
      p_ = ((Eigen::Matrix4f::Identity() - k * h_) * p_).eval();
    }
  }
  [[nodiscard]] Outcome outcome() const override { return outcome_of<4>(x_, p_); }

 private:
  Eigen::Vector4f x_;
  Eigen::Matrix4f p_, f_, q_;
  Eigen::Matrix<float, 2, 4> h_;
  Eigen::Matrix2f r_;
};

class Ekf final : public Filter<EkfInput> {
 public:
  void start() override {
    x_.setZero();
    p_ = Eigen::Vector3f(EkfInput::kStartVariance.data()).asDiagonal();
  }
  void run(std::span<const EkfInput> inputs) override {
    const Eigen::Matrix3f q = Eigen::Vector3f(EkfInput::kQ.data()).asDiagonal();
    const Eigen::Matrix2f r = Eigen::Vector2f(EkfInput::kR.data()).asDiagonal();
    for (const EkfInput& in : inputs) {
      const float s = std::sin(x_(2)), c = std::cos(x_(2));
      Eigen::Matrix3f f = Eigen::Matrix3f::Identity();
      f(0, 2) = -in.ds_m * s;
      f(1, 2) = in.ds_m * c;
      x_ += Eigen::Vector3f(in.ds_m * c, in.ds_m * s, in.dyaw_rad);
      p_ = f * p_ * f.transpose() + q;
      const float dx = EkfInput::kLandmarkX_m - x_(0), dy = EkfInput::kLandmarkY_m - x_(1);
      const float range2 = dx * dx + dy * dy, range = std::sqrt(range2);
      Eigen::Matrix<float, 2, 3> h;
      h << -dx / range, -dy / range, 0, dy / range2, -dx / range2, -1;
      const Eigen::Vector2f nu(in.range_m - range, in.bearing_rad - (std::atan2(dy, dx) - x_(2)));
      const Eigen::Matrix2f innovation = h * p_ * h.transpose() + r;
      const Eigen::Matrix<float, 3, 2> k = p_ * h.transpose() * innovation.inverse();
      x_ += k * nu;
      p_ = ((Eigen::Matrix3f::Identity() - k * h) * p_).eval();
    }
  }
  [[nodiscard]] Outcome outcome() const override { return outcome_of<3>(x_, p_); }

 private:
  Eigen::Vector3f x_;
  Eigen::Matrix3f p_;
};

}  // namespace

std::unique_ptr<Filter<KalmanInput>> textbook_kalman() { return std::make_unique<Kalman>(); }
std::unique_ptr<Filter<EkfInput>> textbook_ekf() { return std::make_unique<Ekf>(); }

}  // namespace tetap::bench
