// SPDX-License-Identifier: Apache-2.0
// OpenCV's cv::KalmanFilter in float, as an extended filter in the way its users do it. F and H are set at each step,
// and the predicted state is replaced by f(x). The measurement is handed over as H x + nu.
#include "bench/contestant.hpp"

#include <cmath>
#include <opencv2/video/tracking.hpp>

namespace tetap::bench {
namespace {

Outcome outcome_of(const cv::KalmanFilter& kf) {
  Outcome out;
  for (int r = 0; r < kf.statePost.rows; ++r) out.x.push_back(static_cast<double>(kf.statePost.at<float>(r)));
  for (int r = 0; r < kf.statePost.rows; ++r)
    for (int c = 0; c < kf.statePost.rows; ++c) out.p.push_back(static_cast<double>(kf.errorCovPost.at<float>(r, c)));
  return out;
}

class Kalman final : public Filter<KalmanInput> {
 public:
  Kalman() : kf_(4, 2, 0, CV_32F) {
    constexpr float dt = KalmanInput::kDt_s, q = KalmanInput::kAccelerationVariance;
    cv::setNumThreads(1);
    cv::setIdentity(kf_.transitionMatrix);
    kf_.processNoiseCov.setTo(0);
    kf_.measurementMatrix.setTo(0);
    for (int i = 0; i < 4; i += 2) {
      kf_.transitionMatrix.at<float>(i, i + 1) = dt;
      kf_.processNoiseCov.at<float>(i, i) = q * dt * dt * dt * dt / 4;
      kf_.processNoiseCov.at<float>(i, i + 1) = kf_.processNoiseCov.at<float>(i + 1, i) = q * dt * dt * dt / 2;
      kf_.processNoiseCov.at<float>(i + 1, i + 1) = q * dt * dt;
      kf_.measurementMatrix.at<float>(i / 2, i) = 1;
    }
    cv::setIdentity(kf_.measurementNoiseCov, cv::Scalar(static_cast<double>(KalmanInput::kVariance)));
  }
  void start() override {
    kf_.statePost.setTo(0);
    cv::setIdentity(kf_.errorCovPost, cv::Scalar(static_cast<double>(KalmanInput::kStartVariance)));
  }
  void run(std::span<const KalmanInput> inputs) override {
    for (const KalmanInput& in : inputs) {
      kf_.predict();
      z_.at<float>(0) = in.x_m;
      z_.at<float>(1) = in.y_m;
      kf_.correct(z_);
    }
  }
  [[nodiscard]] Outcome outcome() const override { return outcome_of(kf_); }

 private:
  cv::KalmanFilter kf_;
  cv::Mat z_ = cv::Mat(2, 1, CV_32F);
};

class Ekf final : public Filter<EkfInput> {
 public:
  Ekf() : kf_(3, 2, 0, CV_32F) {
    cv::setNumThreads(1);
    kf_.processNoiseCov.setTo(0);
    kf_.measurementNoiseCov.setTo(0);
    for (int i = 0; i < 3; ++i) kf_.processNoiseCov.at<float>(i, i) = EkfInput::kQ[static_cast<std::size_t>(i)];
    for (int i = 0; i < 2; ++i) kf_.measurementNoiseCov.at<float>(i, i) = EkfInput::kR[static_cast<std::size_t>(i)];
  }
  void start() override {
    kf_.statePost.setTo(0);
    kf_.errorCovPost.setTo(0);
    for (int i = 0; i < 3; ++i)
      kf_.errorCovPost.at<float>(i, i) = EkfInput::kStartVariance[static_cast<std::size_t>(i)];
    cv::setIdentity(kf_.transitionMatrix);
  }
  void run(std::span<const EkfInput> inputs) override {
    for (const EkfInput& in : inputs) {
      const float x = kf_.statePost.at<float>(0), y = kf_.statePost.at<float>(1), yaw = kf_.statePost.at<float>(2);
      const float s = std::sin(yaw), c = std::cos(yaw);
      kf_.transitionMatrix.at<float>(0, 2) = -in.ds_m * s;
      kf_.transitionMatrix.at<float>(1, 2) = in.ds_m * c;
      kf_.predict();
      const float px = x + in.ds_m * c, py = y + in.ds_m * s, pyaw = yaw + in.dyaw_rad;
      kf_.statePre.at<float>(0) = px;
      kf_.statePre.at<float>(1) = py;
      kf_.statePre.at<float>(2) = pyaw;
      const float dx = EkfInput::kLandmarkX_m - px, dy = EkfInput::kLandmarkY_m - py;
      const float range2 = dx * dx + dy * dy, range = std::sqrt(range2);
      auto& h = kf_.measurementMatrix;
      h.at<float>(0, 0) = -dx / range;
      h.at<float>(0, 1) = -dy / range;
      h.at<float>(0, 2) = 0;
      h.at<float>(1, 0) = dy / range2;
      h.at<float>(1, 1) = -dx / range2;
      h.at<float>(1, 2) = -1;
      for (int m = 0; m < 2; ++m)
        z_.at<float>(m) = h.at<float>(m, 0) * px + h.at<float>(m, 1) * py + h.at<float>(m, 2) * pyaw;
      z_.at<float>(0) += in.range_m - range;
      z_.at<float>(1) += in.bearing_rad - (std::atan2(dy, dx) - pyaw);
      kf_.correct(z_);
    }
  }
  [[nodiscard]] Outcome outcome() const override { return outcome_of(kf_); }

 private:
  cv::KalmanFilter kf_;
  cv::Mat z_ = cv::Mat(2, 1, CV_32F);
};

}  // namespace

std::unique_ptr<Filter<KalmanInput>> opencv_kalman() { return std::make_unique<Kalman>(); }
std::unique_ptr<Filter<EkfInput>> opencv_ekf() { return std::make_unique<Ekf>(); }

}  // namespace tetap::bench
