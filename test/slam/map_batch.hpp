// SPDX-License-Identifier: Apache-2.0
// A short drive past two posts and its batch solution: least squares in double over all noises at once, with numeric
// derivatives and formulas of its own. No linearisation point of it is that of a filter.
#pragma once

#include "slam/visual_drive.hpp"

#include <random>

namespace tetap::test {

class MapBatch {
 public:
  static constexpr int kImages = 21, kPosts = 2;
  static constexpr double kStep_s = 0.1, kSigma_px = 0.5, kFocal_px = 458;
  static constexpr double kAttitude_rad = 0.01, kPlace_m = 0.01, kMounting_rad = 0.003, kDirection_rad = 0.03;
  static constexpr double kWayWalk = 0.0316, kTurnWalk = 0.00316, kDirectionWalk = 0.01;
  static constexpr int kStart = 11, kPerStep = 8, kPoints = kStart + kPerStep * (kImages - 1);
  static constexpr int kUnknown = kPoints + 3 * kPosts;
  using Unknown = Eigen::VectorXd;

  struct State {
    Eigen::Matrix3d r = Eigen::Matrix3d::Identity();
    Eigen::Vector3d p = Eigen::Vector3d::Zero();
  };

  explicit MapBatch(unsigned seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    Unknown truth = Unknown::Zero(kUnknown);
    for (int i = 0; i < kPoints; ++i) truth(i) = normal(random) * sigma_of(i);
    truth.tail(3 * kPosts) << 7, 1.5, 0.8, 6, -1.2, 0.4;
    for (int k = 0; k < kImages; ++k)
      for (int post = 0; post < kPosts; ++post) {
        const Eigen::Vector2d at = pixel(truth, k, post);
        // In the quarters of a pixel of the bus.
        for (int i = 0; i < 2; ++i) seen_[k][post](i) = std::round(4 * (at(i) + normal(random) * kSigma_px)) / 4;
      }
  }

  [[nodiscard]] Eigen::Vector2d seen(int image, int post) const { return seen_[image][post]; }
  [[nodiscard]] static Eigen::Vector3d speed() { return {2, 0, 0}; }
  [[nodiscard]] static Eigen::Vector3d rate() { return {0.02, -0.03, 0.05}; }
  [[nodiscard]] static Eigen::Vector3d lever() { return {0.2, 0, 0.3}; }

  /// Pose of an image.
  [[nodiscard]] static State pose(const Unknown& z, int image) {
    State s;
    s.r = rotation(z.segment<3>(0));
    s.p = z.segment<3>(3);
    Eigen::Vector2d direction = z.segment<2>(9);
    for (int k = 1; k <= image; ++k) {
      const int at = kStart + kPerStep * (k - 1);
      const Eigen::Vector3d v(speed()(0), speed()(0) * direction(0), speed()(0) * direction(1));
      s.p += s.r * rotation(rate() * kStep_s / 2) * v * kStep_s + z.segment<3>(at + 3);
      s.r = rotation(z.segment<3>(at)) * s.r * rotation(rate() * kStep_s);
      direction += z.segment<2>(at + 6);
    }
    return s;
  }
  /// The solution of all sightings but those of image `unused`.
  void solve(int unused) {
    solution = start();
    for (int i = 0; i < 8; ++i) {
      const Eigen::MatrixXd j = derivative([&](const Unknown& z) { return residuals(z, unused); }, solution);
      information_ = j.transpose() * j;
      solution -= information_.ldlt().solve(j.transpose() * residuals(solution, unused));
    }
    covariance_ = information_.ldlt().solve(Eigen::MatrixXd::Identity(kUnknown, kUnknown));
  }
  /// Covariance of anything that follows from the unknowns.
  template <class Function>
  [[nodiscard]] Eigen::MatrixXd covariance_of(const Function& f) const {
    const Eigen::MatrixXd j = derivative(f, solution);
    return j * covariance_ * j.transpose();
  }

  Unknown solution;

 private:
  static double sigma_of(int i) {
    if (i < 3) return kAttitude_rad;
    if (i < 6) return kPlace_m;
    if (i < 9) return kMounting_rad;
    if (i < kStart) return kDirection_rad;
    const int k = (i - kStart) % kPerStep;
    return std::sqrt(kStep_s) * (k < 3 ? kTurnWalk : k < 6 ? kWayWalk : kDirectionWalk);
  }
  static Unknown start() {
    Unknown z = Unknown::Zero(kUnknown);
    z.tail(3 * kPosts) << 8, 1.7, 0.9, 7, -1.4, 0.5;
    return z;
  }
  static Eigen::Vector2d pixel(const Unknown& z, int image, int post) {
    Eigen::Matrix3d c;
    c << 0, -1, 0, 0, 0, -1, 1, 0, 0;
    const State s = pose(z, image);
    const Eigen::Vector3d l =
        rotation(z.segment<3>(6)) * c * (s.r.transpose() * (z.segment<3>(kPoints + 3 * post) - s.p) - lever());
    return {kFocal_px * l(0) / l(2) + 319.5, kFocal_px * l(1) / l(2) + 239.5};
  }
  [[nodiscard]] Eigen::VectorXd residuals(const Unknown& z, int unused) const {
    Eigen::VectorXd r(kPoints + 2 * kPosts * (kImages - 1));
    for (int i = 0; i < kPoints; ++i) r(i) = z(i) / sigma_of(i);
    int at = kPoints;
    for (int k = 0; k < kImages; ++k)
      for (int post = 0; post < kPosts && k != unused; ++post, at += 2)
        r.segment<2>(at) = (pixel(z, k, post) - seen_[k][post]) / kSigma_px;
    return r;
  }
  template <class Function>
  static Eigen::MatrixXd derivative(const Function& f, const Unknown& z) {
    constexpr double kStep = 1e-6;
    Eigen::MatrixXd j(f(z).size(), z.size());
    for (int i = 0; i < z.size(); ++i) {
      Unknown low = z, high = z;
      low(i) -= kStep, high(i) += kStep;
      j.col(i) = (f(high) - f(low)) / (2 * kStep);
    }
    return j;
  }

  Eigen::Vector2d seen_[kImages][kPosts];
  Eigen::MatrixXd information_, covariance_;
};

}  // namespace tetap::test
