// SPDX-License-Identifier: Apache-2.0
// In a world that is exactly what the filter models, NEES and NIS must lie in their two-sided 95 % intervals: too good
// is a failure too.
#include "support/consistency.hpp"
#include "tetap/filter/ekf.hpp"
#include "tetap/model/constant_velocity.hpp"
#include "tetap/model/range_bearing.hpp"
#include "tetap/model/unicycle.hpp"

#include <gtest/gtest.h>
#include <Eigen/Dense>
#include <random>

namespace tetap {
namespace {

constexpr int kRuns = 200;
constexpr int kSteps = 100;

/// Share of the steps whose average over the runs lies inside the interval: 95 % are expected, and 90 to 99 % demanded,
/// because neighbouring steps are not independent.
struct Share {
  int inside = 0, all = 0;
  void add(bool is) { inside += is ? 1 : 0, ++all; }
  [[nodiscard]] double value() const { return static_cast<double>(inside) / all; }
};

TEST(Consistency, ConstantVelocityKalman) {
  std::mt19937 random(10);
  std::normal_distribution<double> normal;
  std::vector<double> nees(kSteps), nis(kSteps);
  const model::ConstantVelocity<float> motion{.dt_s = 0.1F, .acceleration_variance = 0.5F};
  for (int run = 0; run < kRuns; ++run) {
    filter::Ekf<model::ConstantVelocity<float>::State> kf;
    kf.p = filter::Symmetric<float, 4>::diagonal({4, 1, 4, 1});
    Eigen::Vector4d truth(2 * normal(random), normal(random), 2 * normal(random), normal(random));
    for (int k = 0; k < kSteps; ++k) {
      for (int axis = 0; axis < 4; axis += 2) {
        const double a = std::sqrt(0.5) * normal(random);
        truth(axis) += 0.1 * truth(axis + 1) + 0.005 * a;
        truth(axis + 1) += 0.1 * a;
      }
      kf.predict(motion);
      const filter::DirectMeasurement<float, 4, 0, 2> z{.z = {static_cast<float>(truth(0) + 0.5 * normal(random)),
                                                              static_cast<float>(truth(2) + 0.5 * normal(random))},
                                                        .variance = {0.25F, 0.25F}};
      nis[static_cast<std::size_t>(k)] += static_cast<double>(kf.update(z, 1e9F).nis) / kRuns;
      const Eigen::Vector4d e = kf.x.value.cast<double>() - truth;
      nees[static_cast<std::size_t>(k)] += e.dot(kf.p.dense().cast<double>().inverse() * e) / kRuns;
    }
  }
  Share nees_in, nis_in;
  for (std::size_t k = 0; k < kSteps; ++k) {
    nees_in.add(test::mean_interval_95(4, kRuns).has(nees[k]));
    nis_in.add(test::mean_interval_95(2, kRuns).has(nis[k]));
  }
  EXPECT_GT(nees_in.value(), 0.88);
  EXPECT_GT(nis_in.value(), 0.88);
}

TEST(Consistency, PlanarEkfWithRangeAndBearing) {
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  std::vector<double> nees(kSteps), nis(kSteps);
  const model::Landmark marks[] = {{base::Anchored{}.plus(6), base::Anchored{}.plus(2)},
                                   {base::Anchored{}.plus(-3), base::Anchored{}.plus(4)}};
  const model::UnicycleNoise noise{.speed = 0.01F, .yaw_rate = 0.005F};
  for (int run = 0; run < kRuns; ++run) {
    filter::Ekf<model::PlanarPose> ekf;
    ekf.p = filter::Symmetric<float, 3>::diagonal({0.04F, 0.04F, 0.01F});
    double x = 0.2 * normal(random), y = 0.2 * normal(random), yaw = 0.1 * normal(random);
    for (int k = 0; k < kSteps; ++k) {
      const model::Unicycle command{.forward_mps = 0.8F, .yaw_rate_radps = 0.3F, .noise = noise};
      const auto increment = command.increment(0.1F);
      const double ds = static_cast<double>(increment.ds_m) + std::sqrt(0.001) * normal(random);
      const double dyaw = static_cast<double>(increment.dyaw_rad) + std::sqrt(0.0005) * normal(random);
      const double h = dyaw / 2, chord = std::abs(h) < 1e-9 ? 1 : std::sin(h) / h;
      x += ds * chord * std::cos(yaw + h);
      y += ds * chord * std::sin(yaw + h);
      yaw += dyaw;
      ekf.predict(increment);
      const model::Landmark& mark = marks[k % 2];
      const double dx = static_cast<double>(mark.x.minus(base::Anchored{})) - x,
                   dy = static_cast<double>(mark.y.minus(base::Anchored{})) - y;
      const model::RangeBearing z{
          .range_m = static_cast<float>(std::hypot(dx, dy) + 0.1 * normal(random)),
          .bearing_rad = static_cast<float>(std::remainder(std::atan2(dy, dx) - yaw + 0.03 * normal(random), 2 * M_PI)),
          .sigma_range_m = 0.1F,
          .sigma_bearing_rad = 0.03F,
          .landmark = mark};
      nis[static_cast<std::size_t>(k)] += static_cast<double>(ekf.update(z, 1e9F).nis) / kRuns;
      const Eigen::Vector3d e(static_cast<double>(ekf.x.x.minus(base::Anchored{})) - x,
                              static_cast<double>(ekf.x.y.minus(base::Anchored{})) - y,
                              std::remainder(static_cast<double>(ekf.x.yaw_rad) - yaw, 2 * M_PI));
      nees[static_cast<std::size_t>(k)] += e.dot(ekf.p.dense().cast<double>().inverse() * e) / kRuns;
    }
  }
  Share nees_in, nis_in;
  for (std::size_t k = 0; k < kSteps; ++k) {
    nees_in.add(test::mean_interval_95(3, kRuns).has(nees[k]));
    nis_in.add(test::mean_interval_95(2, kRuns).has(nis[k]));
  }
  EXPECT_GT(nees_in.value(), 0.88);
  EXPECT_GT(nis_in.value(), 0.88);
}

}  // namespace
}  // namespace tetap
