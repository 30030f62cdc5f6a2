// SPDX-License-Identifier: Apache-2.0
// Predicted odometry errors against simulated wheels.
#include "tetap/model/odometry_error.hpp"

#include <gtest/gtest.h>
#include <cmath>
#include <random>

namespace tetap::model {
namespace {

constexpr int kRuns = 8'000, kSteps = 100;
constexpr double kTrack_m = 0.5;

struct Sample {
  double p[3][3] = {};
};

/// Drives straight and reckons with the errors of the sources: sample covariance of reckoned less true pose.
Sample simulate(const OdometryErrorSources& sources, double distance_m) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  Sample sample;
  const double slip = std::sqrt(static_cast<double>(sources.slip_m) * distance_m / kSteps);
  const auto step = static_cast<double>(sources.encoder_step_m);
  for (int run = 0; run < kRuns; ++run) {
    double x = 0, y = 0, yaw = static_cast<double>(sources.sigma_heading_rad) * normal(random);
    const double unlike = static_cast<double>(sources.wheel_difference) * normal(random);
    double travelled[2] = {}, counted[2] = {};
    const double phase[2] = {uniform(random), uniform(random)};
    const double stretch = step > 0 ? 1 + 0.02 * uniform(random) : 1;  // so that the end falls anywhere in a step
    for (int k = 0; k < kSteps; ++k) {
      double path[2];
      for (int wheel = 0; wheel < 2; ++wheel) {
        const double true_path = distance_m * stretch / kSteps;
        double reckoned = true_path * (1 + (wheel == 0 ? -0.5 : 0.5) * unlike) + slip * normal(random);
        if (step > 0) {
          const double before = counted[wheel];
          travelled[wheel] += reckoned;
          counted[wheel] = step * std::floor(travelled[wheel] / step + phase[wheel]);
          reckoned = counted[wheel] - before;
        }
        path[wheel] = reckoned;
      }
      const double ds = 0.5 * (path[0] + path[1]), turn = (path[1] - path[0]) / kTrack_m;
      x += ds * std::cos(yaw + turn / 2), y += ds * std::sin(yaw + turn / 2), yaw += turn;
    }
    const double e[3] = {x - distance_m * stretch, y, yaw};
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) sample.p[i][j] += e[i] * e[j] / kRuns;
  }
  return sample;
}

void expect_predicted(const OdometryErrorSources& sources, double distance_m) {
  const Sample sample = simulate(sources, distance_m);
  const filter::Symmetric<float, 3> p = sources.after_straight(static_cast<float>(distance_m));
  for (int i = 0; i < 3; ++i)
    for (int j = i; j < 3; ++j) {
      const double scale = std::sqrt(static_cast<double>(p(i, i)) * static_cast<double>(p(j, j)));
      EXPECT_NEAR(sample.p[i][j], static_cast<double>(p(i, j)), 0.05 * scale + 1e-5) << i << j << " at " << distance_m;
    }
}

TEST(OdometryError, SlipGrowsWithThePath) {
  for (const double d : {2.0, 8.0}) expect_predicted({.track_m = 0.5F, .slip_m = 1e-5F}, d);
}
TEST(OdometryError, UnlikeWheelsTurnInProportionToThePath) {
  const OdometryErrorSources sources{.track_m = 0.5F, .wheel_difference = 0.002F};
  for (const double d : {2.0, 8.0}) expect_predicted(sources, d);
  EXPECT_FLOAT_EQ(sources.wheel_difference_heading_rad(8), 4 * sources.wheel_difference_heading_rad(2));
}
TEST(OdometryError, InitialHeadingSwingsThePath) {
  for (const double d : {2.0, 8.0}) expect_predicted({.track_m = 0.5F, .sigma_heading_rad = 0.01F}, d);
}
TEST(OdometryError, EncoderStepsDoNotAddUp) {
  EXPECT_NEAR(encoder_step_m(0.05F, 512), 6.1359e-4F, 1e-7F);
  const OdometryErrorSources sources{.track_m = 0.5F, .encoder_step_m = 0.004F};
  for (const double d : {2.0, 8.0}) {
    const Sample sample = simulate(sources, d);
    const auto p = sources.after_straight(static_cast<float>(d));
    EXPECT_NEAR(sample.p[0][0] / static_cast<double>(p(0, 0)), 1, 0.05);
    EXPECT_NEAR(sample.p[2][2] / static_cast<double>(p(2, 2)), 1, 0.05);
  }
}
TEST(OdometryError, SourcesAdd) {
  expect_predicted({.track_m = 0.5F, .slip_m = 1e-5F, .wheel_difference = 0.002F, .sigma_heading_rad = 0.01F}, 5.0);
}

}  // namespace
}  // namespace tetap::model
