// SPDX-License-Identifier: Apache-2.0
// Orocos BFL's extended Kalman filter, in double as the library has it.
#include <bfl/filter/extendedkalmanfilter.h>
#include <bfl/model/analyticmeasurementmodel_gaussianuncertainty.h>
#include <bfl/model/analyticsystemmodel_gaussianuncertainty.h>
#include <bfl/model/linearanalyticmeasurementmodel_gaussianuncertainty.h>
#include <bfl/model/linearanalyticsystemmodel_gaussianuncertainty.h>
#include <bfl/pdf/analyticconditionalgaussian_additivenoise.h>
#include <bfl/pdf/linearanalyticconditionalgaussian.h>
#include <cmath>

#include "bench/contestant.hpp"

namespace tetap::bench {
namespace {

using MatrixWrapper::ColumnVector;
using MatrixWrapper::Matrix;
using MatrixWrapper::SymmetricMatrix;

template <class Numbers>
BFL::Gaussian normal(int n, const Numbers& variance) {
  ColumnVector mean(n);
  SymmetricMatrix covariance(n);
  mean = 0.0;
  covariance = 0.0;
  for (int i = 0; i < n; ++i) covariance(i + 1, i + 1) = static_cast<double>(variance[static_cast<std::size_t>(i)]);
  return {mean, covariance};
}

Outcome outcome_of(BFL::ExtendedKalmanFilter& filter, int n) {
  Outcome out;
  const auto* const posterior = filter.PostGet();
  const ColumnVector x = posterior->ExpectedValueGet();
  const SymmetricMatrix p = posterior->CovarianceGet();
  for (int r = 1; r <= n; ++r) out.x.push_back(x(r));
  for (int r = 1; r <= n; ++r)
    for (int c = 1; c <= n; ++c) out.p.push_back(p(r, c));
  return out;
}

class Kalman final : public Filter<KalmanInput> {
 public:
  void start() override { filter_ = std::make_unique<BFL::ExtendedKalmanFilter>(&prior_); }
  void run(std::span<const KalmanInput> inputs) override {
    ColumnVector z(2);
    for (const KalmanInput& in : inputs) {
      z(1) = static_cast<double>(in.x_m);
      z(2) = static_cast<double>(in.y_m);
      filter_->Update(&motion_, &measurement_, z);
    }
  }
  [[nodiscard]] Outcome outcome() const override { return outcome_of(*filter_, 4); }

 private:
  static BFL::LinearAnalyticConditionalGaussian motion() {
    const double dt = static_cast<double>(KalmanInput::kDt_s),
                 q = static_cast<double>(KalmanInput::kAccelerationVariance);
    Matrix f(4, 4);
    f = 0.0;
    for (int i = 1; i <= 4; ++i) f(i, i) = 1;
    f(1, 2) = f(3, 4) = dt;
    ColumnVector mean(4);
    mean = 0.0;
    SymmetricMatrix noise(4);
    noise = 0.0;
    for (int i = 1; i < 4; i += 2) {
      noise(i, i) = q * dt * dt * dt * dt / 4;
      noise(i, i + 1) = noise(i + 1, i) = q * dt * dt * dt / 2;
      noise(i + 1, i + 1) = q * dt * dt;
    }
    return {std::vector<Matrix>(1, f), BFL::Gaussian(mean, noise)};
  }
  static BFL::LinearAnalyticConditionalGaussian sight() {
    Matrix h(2, 4);
    h = 0.0;
    h(1, 1) = h(2, 3) = 1;
    return {h, normal(2, std::array<float, 2>{KalmanInput::kVariance, KalmanInput::kVariance})};
  }
  BFL::LinearAnalyticConditionalGaussian motion_pdf_ = motion(), sight_pdf_ = sight();
  BFL::LinearAnalyticSystemModelGaussianUncertainty motion_{&motion_pdf_};
  BFL::LinearAnalyticMeasurementModelGaussianUncertainty measurement_{&sight_pdf_};
  BFL::Gaussian prior_ = normal(4, std::array<float, 4>{KalmanInput::kStartVariance, KalmanInput::kStartVariance,
                                                        KalmanInput::kStartVariance, KalmanInput::kStartVariance});
  std::unique_ptr<BFL::ExtendedKalmanFilter> filter_;
};

/// Conditional arguments: state, input (ds, dyaw).
class Unicycle final : public BFL::AnalyticConditionalGaussianAdditiveNoise {
 public:
  Unicycle() : AnalyticConditionalGaussianAdditiveNoise(normal(3, EkfInput::kQ), 2) {}
  ColumnVector ExpectedValueGet() const override {
    ColumnVector x = ConditionalArgumentGet(0);
    const ColumnVector u = ConditionalArgumentGet(1);
    const double yaw = x(3);
    x(1) += u(1) * std::cos(yaw);
    x(2) += u(1) * std::sin(yaw);
    x(3) += u(2);
    return x;
  }
  Matrix dfGet(unsigned int) const override {
    const ColumnVector x = ConditionalArgumentGet(0), u = ConditionalArgumentGet(1);
    Matrix f(3, 3);
    f = 0.0;
    f(1, 1) = f(2, 2) = f(3, 3) = 1;
    f(1, 3) = -u(1) * std::sin(x(3));
    f(2, 3) = u(1) * std::cos(x(3));
    return f;
  }
};

class Sight final : public BFL::AnalyticConditionalGaussianAdditiveNoise {
 public:
  Sight() : AnalyticConditionalGaussianAdditiveNoise(normal(2, EkfInput::kR), 1) {}
  ColumnVector ExpectedValueGet() const override {
    const ColumnVector x = ConditionalArgumentGet(0);
    const double dx = kX - x(1), dy = kY - x(2);
    ColumnVector z(2);
    z(1) = std::sqrt(dx * dx + dy * dy);
    z(2) = std::atan2(dy, dx) - x(3);
    return z;
  }
  Matrix dfGet(unsigned int) const override {
    const ColumnVector x = ConditionalArgumentGet(0);
    const double dx = kX - x(1), dy = kY - x(2), range2 = dx * dx + dy * dy, range = std::sqrt(range2);
    Matrix h(2, 3);
    h(1, 1) = -dx / range;
    h(1, 2) = -dy / range;
    h(1, 3) = 0;
    h(2, 1) = dy / range2;
    h(2, 2) = -dx / range2;
    h(2, 3) = -1;
    return h;
  }

 private:
  static constexpr double kX = EkfInput::kLandmarkX_m, kY = EkfInput::kLandmarkY_m;
};

class Ekf final : public Filter<EkfInput> {
 public:
  void start() override { filter_ = std::make_unique<BFL::ExtendedKalmanFilter>(&prior_); }
  void run(std::span<const EkfInput> inputs) override {
    ColumnVector u(2), z(2);
    for (const EkfInput& in : inputs) {
      u(1) = static_cast<double>(in.ds_m);
      u(2) = static_cast<double>(in.dyaw_rad);
      z(1) = static_cast<double>(in.range_m);
      z(2) = static_cast<double>(in.bearing_rad);
      filter_->Update(&motion_, u, &measurement_, z);
    }
  }
  [[nodiscard]] Outcome outcome() const override { return outcome_of(*filter_, 3); }

 private:
  Unicycle motion_pdf_;
  Sight sight_pdf_;
  BFL::AnalyticSystemModelGaussianUncertainty motion_{&motion_pdf_};
  BFL::AnalyticMeasurementModelGaussianUncertainty measurement_{&sight_pdf_};
  BFL::Gaussian prior_ = normal(3, EkfInput::kStartVariance);
  std::unique_ptr<BFL::ExtendedKalmanFilter> filter_;
};

}  // namespace

std::unique_ptr<Filter<KalmanInput>> bfl_kalman() { return std::make_unique<Kalman>(); }
std::unique_ptr<Filter<EkfInput>> bfl_ekf() { return std::make_unique<Ekf>(); }

}  // namespace tetap::bench
