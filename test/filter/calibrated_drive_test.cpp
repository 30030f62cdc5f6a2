// SPDX-License-Identifier: Apache-2.0
// Radii and track learnt on line: a radius that is 1 % off is found with GNSS in 200 m, and what no measurement shows
// keeps its variance. The truth is integrated in double from the true wheels.
#include "tetap/model/calibrated_drive.hpp"
#include "support/consistency.hpp"
#include "support/numeric_jacobian.hpp"
#include "tetap/filter/ekf.hpp"
#include "tetap/model/gnss_position.hpp"

#include <gtest/gtest.h>
#include <Eigen/Cholesky>
#include <cmath>
#include <random>

namespace tetap::model {
namespace {

using Ekf = filter::Ekf<CalibratedPose>;
using Fix = OfCalibratedPose<GnssPosition>;
static_assert(filter::LinearisedMotion<CalibratedDrive, CalibratedPose> &&
              filter::LinearisedModel<Fix, CalibratedPose>);

constexpr double kTrack_m = 0.5, kSlip_m = 1e-5, kFix_m = 0.5, kStep_m = 0.05;
constexpr float kPrior = 0.02F, kStart_m = 0.3F, kStartYaw_rad = 0.1F;

/// True radii and track over the configured ones, less 1.
struct Wheels {
  double left = 0, right = 0, track = 0;
};

class Drive {
 public:
  Drive(const Wheels& wheels, unsigned seed) : wheels_(wheels), random_(seed) {
    ekf.x.pose.x = ekf.x.pose.x.plus(static_cast<float>(normal(static_cast<double>(kStart_m))));
    ekf.x.pose.y = ekf.x.pose.y.plus(static_cast<float>(normal(static_cast<double>(kStart_m))));
    ekf.x.pose.yaw_rad = static_cast<float>(normal(static_cast<double>(kStartYaw_rad)));
    ekf.p =
        filter::Symmetric<float, 6>::diagonal({kStart_m * kStart_m, kStart_m * kStart_m, kStartYaw_rad * kStartYaw_rad,
                                               kPrior * kPrior, kPrior * kPrior, kPrior * kPrior});
  }
  /// One way of 5 cm with so much turn a metre; a fix after every fourth, where there are any.
  void step(double turn_radpm, bool fixes) {
    const double ds = kStep_m, dyaw = turn_radpm * ds, half = 0.5 * kTrack_m * (1 + wheels_.track) * dyaw;
    x_m_ += ds * std::cos(yaw_rad_ + dyaw / 2), y_m_ += ds * std::sin(yaw_rad_ + dyaw / 2), yaw_rad_ += dyaw;
    const auto seen = [&](double way_m, double scale) {
      return static_cast<float>((way_m + normal(std::sqrt(kSlip_m * std::abs(way_m)))) / (1 + scale));
    };
    EXPECT_TRUE(ekf.predict(CalibratedDrive{.drive = {.left_radius_m = 0.1F,
                                                      .right_radius_m = 0.1F,
                                                      .track_m = static_cast<float>(kTrack_m),
                                                      .noise_left = static_cast<float>(kSlip_m),
                                                      .noise_right = static_cast<float>(kSlip_m)},
                                            .left_m = seen(ds - half, wheels_.left),
                                            .right_m = seen(ds + half, wheels_.right)}));
    if (fixes && ++steps_ % 4 == 0) fix();
  }
  void fix() {
    Fix seen{{.sigma_m = static_cast<float>(kFix_m)}};
    seen.of_pose.x = seen.of_pose.x.plus(static_cast<float>(x_m_ + normal(kFix_m)));
    seen.of_pose.y = seen.of_pose.y.plus(static_cast<float>(y_m_ + normal(kFix_m)));
    static_cast<void>(ekf.update(seen, 1e9F));
  }
  /// Errors of left, right and track.
  [[nodiscard]] Eigen::Vector3d errors() const {
    return {static_cast<double>(ekf.x.left) - wheels_.left, static_cast<double>(ekf.x.right) - wheels_.right,
            static_cast<double>(ekf.x.track) - wheels_.track};
  }
  [[nodiscard]] Eigen::Matrix3d covariance() const { return ekf.p.dense().block<3, 3>(3, 3).cast<double>(); }
  [[nodiscard]] double sigma(int i) const { return std::sqrt(static_cast<double>(ekf.p(3 + i, 3 + i))); }

  Ekf ekf;

 private:
  double normal(double sigma) { return std::normal_distribution<double>(0, sigma)(random_); }
  Wheels wheels_;
  std::mt19937 random_;
  double x_m_ = 0, y_m_ = 0, yaw_rad_ = 0;
  int steps_ = 0;
};

/// A yard: straight for 20 m, then half a turn to either side on 10 m.
double yard_radpm(double way_m) {
  const double lap_m = std::fmod(way_m, 60.0);
  if (lap_m < 20 || (lap_m >= 30 && lap_m < 50)) return 0;
  return lap_m < 30 ? M_PI / 10 : -M_PI / 10;
}

TEST(CalibratedDrive, JacobianEqualsCentralDifferences) {
  CalibratedPose at{.pose = {.yaw_rad = 0.7F}, .left = 0.01F, .right = -0.02F, .track = 0.03F};
  const CalibratedDrive drive{
      .drive = {.left_radius_m = 0.1F, .right_radius_m = 0.1F, .track_m = 0.5F}, .left_m = 2.0F, .right_m = 2.3F};
  const auto numeric = test::numeric_motion_jacobian(drive, at, 1e-2F);
  EXPECT_LT((drive.jacobian(at) - numeric).cwiseAbs().maxCoeff(), 3e-3F);
}

TEST(CalibratedDrive, FindsOnePercentOfARadiusInTwoHundredMetres) {
  constexpr int kSeeds = 60;
  double nees = 0, mean_left = 0, mean_sigma = 0;
  int beyond = 0;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    Drive drive({.left = 0.01}, seed);
    for (int k = 0; k < 4000; ++k) drive.step(yard_radpm(kStep_m * k), true);
    const Eigen::Vector3d e = drive.errors();
    nees += e.dot(drive.covariance().ldlt().solve(e)) / kSeeds;
    for (int i = 0; i < 2; ++i) {
      beyond += std::abs(e(i)) > 3 * drive.sigma(i) ? 1 : 0;
      EXPECT_LT(3 * drive.sigma(i), 0.01) << "a 1 % error stands out";
      EXPECT_GT(drive.sigma(i), 1e-4);
    }
    mean_left += static_cast<double>(drive.ekf.x.left) / kSeeds;
    mean_sigma += drive.sigma(0) / kSeeds;
  }
  EXPECT_NEAR(mean_left, 0.01, 3 * mean_sigma / std::sqrt(static_cast<double>(kSeeds)));
  EXPECT_LE(beyond, 2);  // of 120, 0.3 are expected
  const test::Interval interval = test::mean_interval_95(3, kSeeds);
  EXPECT_GT(nees, 0.9 * interval.low);
  EXPECT_LT(nees, 1.1 * interval.high);
}

TEST(CalibratedDrive, LearnsNothingAtRestOrWithoutFixes) {
  Drive rest({.left = 0.01}, 1), blind({.left = 0.01}, 2);
  for (int k = 0; k < 1000; ++k) rest.fix();
  for (int k = 0; k < 4000; ++k) blind.step(yard_radpm(kStep_m * k), false);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(rest.sigma(i), static_cast<double>(kPrior), 1e-6);
    EXPECT_NEAR(blind.sigma(i), static_cast<double>(kPrior), 1e-4);
    EXPECT_NEAR(blind.errors()(i), i == 0 ? -0.01 : 0.0, 1e-6);
  }
}

TEST(CalibratedDrive, AStraightWayShowsTheRadiiAndNotTheTrack) {
  Drive drive({.left = 0.01, .right = 0.01, .track = 0.01}, 3);
  for (int k = 0; k < 4000; ++k) drive.step(0, true);
  EXPECT_LT(drive.sigma(0), 0.003);
  EXPECT_LT(drive.sigma(1), 0.003);
  EXPECT_GT(drive.sigma(2), 0.95 * static_cast<double>(kPrior));
  for (int k = 0; k < 4000; ++k) drive.step(yard_radpm(20 + kStep_m * k), true);
  EXPECT_LT(drive.sigma(2), 0.5 * static_cast<double>(kPrior)) << "turns show it";
  EXPECT_LT(std::abs(drive.errors()(2)), 3 * drive.sigma(2));
}

}  // namespace
}  // namespace tetap::model
