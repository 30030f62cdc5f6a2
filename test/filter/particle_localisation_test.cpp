// SPDX-License-Identifier: Apache-2.0
// Particles as planar poses: motion and likelihood against other formulas, then localisation on recorded sets.
#include "tetap/filter/particle_localisation.hpp"
#include "support/mrclam.hpp"
#include "support/never_nan.hpp"
#include "tetap/filter/ekf.hpp"
#include "tetap/model/planar_increment.hpp"
#include "tetap/model/range_bearing.hpp"

#include <gtest/gtest.h>
#include <Eigen/Dense>
#include <cmath>

namespace tetap::filter {
namespace {

using Localisation = ParticleLocalisation<1000>;
constexpr auto kEvery = [](const ParticlePose&) { return true; };

TEST(ParticlePose, ArcEndsWhereThePlanarIncrementEnds) {
  for (float turn = -3.0F; turn < 3.1F; turn += 0.07F)
    for (const float yaw : {-2.5F, 0.3F, 1.7F}) {
      const ParticlePose to = ParticleArc{.ds_m = 0.8F, .dyaw_rad = turn}.sample(ParticlePose::at(1, 2, yaw), {0, 0});
      const model::PlanarPose from{.x = base::Anchored{}.plus(1), .y = base::Anchored{}.plus(2), .yaw_rad = yaw};
      const model::PlanarPose expected = model::PlanarIncrement{.ds_m = 0.8F, .dyaw_rad = turn}.predict(from);
      EXPECT_NEAR(to.x_m, expected.x.minus(base::Anchored{}), 1e-6F);
      EXPECT_NEAR(to.y_m, expected.y.minus(base::Anchored{}), 1e-6F);
      EXPECT_NEAR(base::wrap_angle(to.yaw_rad() - expected.yaw_rad), 0, 1e-6F);
    }
}

TEST(ParticlePose, HeadingKeepsItsLength) {
  ParticlePose pose;
  for (int k = 0; k < 100'000; ++k) pose = ParticleArc{.ds_m = 0.01F, .dyaw_rad = 0.13F}.sample(pose, {0, 0});
  EXPECT_NEAR(pose.cos_yaw * pose.cos_yaw + pose.sin_yaw * pose.sin_yaw, 1, 1e-6F);
}

TEST(ParticlePose, SightingIsNormalInRangeAndInSmallBearings) {
  for (float error_m = -1.0F; error_m < 1.1F; error_m += 0.25F)
    for (float error_rad = -3.1F; error_rad < 3.1F; error_rad += 0.05F) {
      const ParticlePose pose = ParticlePose::at(1, -2, 0.7F);
      const auto seen = ParticleSighting::at(1 + 5 * std::cos(2.0F), -2 + 5 * std::sin(2.0F), 5 + error_m,
                                             1.3F + error_rad, 0.3F, 0.05F);
      const double range = static_cast<double>(error_m) / 0.3;
      const double von_mises = 2 / 0.0025 * (1 - std::cos(static_cast<double>(error_rad)));
      EXPECT_NEAR(static_cast<double>(seen.distance(pose)), range * range + von_mises, 2e-3 + 1e-5 * von_mises);
    }
}

TEST(ParticlePose, KernelHasTheCovarianceOfItsRoot) {
  Symmetric<float, 3> p;
  p(0, 0) = 0.09F, p(1, 1) = 0.04F, p(2, 2) = 0.01F, p(0, 1) = 0.03F, p(0, 2) = -0.012F, p(1, 2) = 0.002F;
  static Particles<ParticlePose, 20'000> cloud({3, 4});
  cloud.fill(20'000, [](const Draw&) { return ParticlePose::at(3, 4, 3.1F); });
  ASSERT_TRUE(cloud.predict(ParticleKernel::of(p, 0.5F)));
  const ParticlePose mean = mean_pose(cloud);
  EXPECT_NEAR(mean.x_m, 3, 0.005F);
  EXPECT_NEAR(base::wrap_angle(mean.yaw_rad() - 3.1F), 0, 0.002F);
  const Symmetric<float, 3> sample = pose_covariance(cloud, mean, kEvery);
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r <= c; ++r)
      EXPECT_NEAR(sample(r, c), 0.25F * p(r, c), 0.25F * 0.05F * std::sqrt(p(r, r) * p(c, c))) << r << c;
}

TEST(ParticleLocalisation, RefusesWhatIsNoSighting) {
  static Localisation filter({1, 1});
  filter.start(200, ParticlePose::at(0, 0, 0), 0.1F, 0.1F);
  const ParticleLandmark map[] = {{3, 1}, {2, -2}};
  const LandmarkSeen good{
      .landmark = 0, .range_m = 3.2F, .bearing_rad = 0.3F, .sigma_range_m = 0.1F, .sigma_bearing_rad = 0.05F};
  ASSERT_TRUE(filter.update({&good, 1}, map));
  for (int field = 0; field < 4; ++field)
    for (const float value : test::kHostile) {
      LandmarkSeen bad = good;
      float* const fields[] = {&bad.range_m, &bad.bearing_rad, &bad.sigma_range_m, &bad.sigma_bearing_rad};
      *fields[field] = value;
      const bool fused = filter.update({&bad, 1}, map);
      if (!base::is_finite(value)) {
        EXPECT_FALSE(fused) << field << " = " << value;
      }
      const auto estimate = filter.estimate();
      EXPECT_TRUE(base::is_finite(estimate.pose.x_m + estimate.pose.y_m + estimate.pose.yaw_rad()));
      EXPECT_TRUE(estimate.p.bounded());
    }
  LandmarkSeen unknown = good;
  for (const std::int32_t landmark : {2, 100, -2}) {
    unknown.landmark = landmark;
    EXPECT_FALSE(filter.update({&unknown, 1}, map)) << landmark;
  }
  EXPECT_FALSE(filter.update({}, map));
}

// --- MRCLAM, data set 7. Numbers of the sensors as config/mrclam.hpp has them.

struct Figures {
  double rmse_m = 0, nees = 0, particles = 0, found_s = 999, late_rmse_m = 0;
};
enum class Start { kTruth, kWrong };

/// One run. Found: since when the error has stayed below half a metre for ten seconds.
Figures localise(const test::Mrclam& run, int robot, std::uint32_t seed, Start start, bool ids, double until_s) {
  static Localisation filter;
  filter = Localisation({seed, static_cast<std::uint32_t>(robot)});
  std::vector<ParticleLandmark> map;
  std::map<int, std::int32_t> index;
  for (const auto& [barcode, place] : run.landmarks) {
    index[barcode] = static_cast<std::int32_t>(map.size());
    map.push_back({static_cast<float>(place[0]), static_cast<float>(place[1])});
  }
  const auto pose_of = [&](double dx, double dy, double dyaw) {
    return ParticlePose::at(static_cast<float>(run.start().x_m + dx), static_cast<float>(run.start().y_m + dy),
                            static_cast<float>(run.start().yaw_rad + dyaw));
  };
  if (start == Start::kTruth) filter.start(500, pose_of(0, 0, 0), 0.02F, 0.02F);
  if (start == Start::kWrong) filter.start(1000, pose_of(2, 1, 1.5), 0.05F, 0.05F);
  double ds = 0, dyaw = 0, var_ds = 0, var_dyaw = 0, gathered_s = 0;
  const auto flush = [&] {
    static_cast<void>(filter.predict({.ds_m = static_cast<float>(ds),
                                      .dyaw_rad = static_cast<float>(dyaw),
                                      .sigma_ds_m = static_cast<float>(std::sqrt(var_ds)),
                                      .sigma_dyaw_rad = static_cast<float>(std::sqrt(var_dyaw))}));
    ds = dyaw = var_ds = var_dyaw = gathered_s = 0;
  };
  Figures figures;
  double since = -1, late = 0;
  int looks = 0, late_looks = 0;
  run.drive(
      run.start().t_s + until_s,
      [&](const test::Mrclam::Command& command, double dt_s) {
        ds += command.forward_mps * dt_s, dyaw += command.yaw_rate_radps * dt_s, var_ds += 0.002 * dt_s;
        var_dyaw += (0.0005 + 0.01 * std::abs(command.yaw_rate_radps) + 0.0005 * std::abs(command.forward_mps)) * dt_s;
        if ((gathered_s += dt_s) > 0.15) flush();
      },
      [&](const std::vector<test::Mrclam::Sighting>& seen) {
        flush();
        std::vector<LandmarkSeen> batch;
        for (const auto& one : seen)
          batch.push_back({.landmark = ids ? index[one.barcode] : LandmarkSeen::kAny,
                           .range_m = static_cast<float>(one.range_m),
                           .bearing_rad = static_cast<float>(one.bearing_rad),
                           .sigma_range_m = static_cast<float>(0.1 + 0.05 * one.range_m),
                           .sigma_bearing_rad = 0.02F});
        EXPECT_TRUE(filter.update(batch, map));
      },
      [&](double t_s) {
        flush();
        test::Mrclam::Pose truth{};
        if (!run.truth_at(t_s, truth)) return;
        const auto estimate = filter.estimate();
        const Eigen::Vector3d e(truth.x_m - static_cast<double>(estimate.pose.x_m),
                                truth.y_m - static_cast<double>(estimate.pose.y_m),
                                std::remainder(truth.yaw_rad - static_cast<double>(estimate.pose.yaw_rad()), 2 * M_PI));
        const Eigen::Matrix3d p = estimate.p.dense().cast<double>() + 1e-9 * Eigen::Matrix3d::Identity();
        const double square = e.head<2>().squaredNorm(), time_s = t_s - run.start().t_s;
        ++looks, figures.rmse_m += square, figures.nees += e.dot(p.ldlt().solve(e));
        figures.particles += static_cast<double>(filter.cloud.size());
        if (time_s > 140) late += square, ++late_looks;
        if (square > 0.25) since = -1;
        if (square <= 0.25 && since < 0) since = time_s;
        if (figures.found_s > 900 && since >= 0 && time_s - since >= 10) figures.found_s = since;
      });
  figures.rmse_m = std::sqrt(figures.rmse_m / looks), figures.nees /= looks, figures.particles /= looks;
  figures.late_rmse_m = late_looks > 0 ? std::sqrt(late / late_looks) : 0;
  return figures;
}

class Recorded : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = test::recorded_folder("mrclam/MRCLAM_Dataset7");
    if (folder_.empty()) GTEST_SKIP() << "no mrclam/MRCLAM_Dataset7 in $TETAP_DATA";
  }
  std::string folder_;
};

TEST_F(Recorded, TracksWithinTenPercentOfTheEkfAndIsConsistent) {
  constexpr double kEkf_m[] = {0.155, 0.152, 0.199, 0.211, 0.178};
  for (int robot = 1; robot <= 5; ++robot) {
    const test::Mrclam run(folder_, robot);
    const Figures f = localise(run, robot, 1, Start::kTruth, true, run.end_s() - run.start().t_s);
    std::printf("particles, robot %d: %.3f m, NEES %.1f, %.0f particles\n", robot, f.rmse_m, f.nees, f.particles);
    EXPECT_LT(f.rmse_m, 1.1 * kEkf_m[robot - 1]) << "robot " << robot;
    EXPECT_LT(f.nees, 10) << "robot " << robot;
    EXPECT_GT(f.nees, 1) << "robot " << robot;
    EXPECT_LT(f.particles, 550) << "robot " << robot;
  }
}

TEST_F(Recorded, NeedsNoIdentitiesOnRobotOne) {
  const test::Mrclam run(folder_, 1);
  const double until_s = run.end_s() - run.start().t_s;
  double with_m = 0, without_m = 0;  // one run scatters by 5 %
  for (const std::uint32_t seed : {1U, 2U, 3U, 4U}) {
    with_m += localise(run, 1, seed, Start::kTruth, true, until_s).rmse_m / 4;
    without_m += localise(run, 1, seed, Start::kTruth, false, until_s).rmse_m / 4;
  }
  std::printf("particles, robot 1: %.3f m with identities, %.3f m without\n", with_m, without_m);
  EXPECT_LE(without_m, 1.15 * with_m);
  EXPECT_GE(without_m, 0.95 * with_m);
}

TEST_F(Recorded, FindsTheRobotFromAWrongStart) {
  std::vector<double> found;
  for (int robot = 1; robot <= 5; ++robot) {
    const test::Mrclam run(folder_, robot);
    for (const std::uint32_t seed : {1U, 2U, 3U, 4U}) {
      const Figures f = localise(run, robot, seed, Start::kWrong, true, 75);
      std::printf("wrong start, robot %d seed %u: found after %.1f s\n", robot, seed, f.found_s);
      EXPECT_LE(f.found_s, 60) << "robot " << robot << " seed " << seed;
      found.push_back(f.found_s);
    }
  }
  std::sort(found.begin(), found.end());
  std::printf("wrong start: median %.2f s\n", 0.5 * (found[9] + found[10]));
  EXPECT_LE(0.5 * (found[9] + found[10]), 16);
}

TEST_F(Recorded, AnEkfWithTheSameWrongStartStaysWrong) {
  const test::Mrclam run(folder_, 5);
  Ekf<model::PlanarPose> ekf;
  ekf.x = {.x = base::Anchored{}.plus(static_cast<float>(run.start().x_m + 2)),
           .y = base::Anchored{}.plus(static_cast<float>(run.start().y_m + 1)),
           .yaw_rad = base::wrap_angle(static_cast<float>(run.start().yaw_rad + 1.5))};
  ekf.p = Symmetric<float, 3>::diagonal({0.0025F, 0.0025F, 0.0025F});
  double least_m = 1e9;
  run.drive(
      run.start().t_s + 60,
      [&](const test::Mrclam::Command& c, double dt_s) {
        ekf.predict(model::PlanarIncrement{
            .ds_m = static_cast<float>(c.forward_mps * dt_s),
            .dyaw_rad = static_cast<float>(c.yaw_rate_radps * dt_s),
            .var_ds = static_cast<float>(0.002 * dt_s),
            .var_dyaw = static_cast<float>((0.0005 + 0.01 * std::abs(c.yaw_rate_radps)) * dt_s)});
      },
      [&](const std::vector<test::Mrclam::Sighting>& seen) {
        for (const auto& one : seen) {
          const auto& place = run.landmarks.at(one.barcode);
          static_cast<void>(
              ekf.update(model::RangeBearing{.range_m = static_cast<float>(one.range_m),
                                             .bearing_rad = static_cast<float>(one.bearing_rad),
                                             .sigma_range_m = static_cast<float>(0.1 + 0.05 * one.range_m),
                                             .sigma_bearing_rad = 0.02F,
                                             .landmark = {.x = base::Anchored{}.plus(static_cast<float>(place[0])),
                                                          .y = base::Anchored{}.plus(static_cast<float>(place[1]))}},
                         13.8F));
        }
      },
      [&](double t_s) {
        test::Mrclam::Pose truth{};
        if (!run.truth_at(t_s, truth)) return;
        least_m = std::min(least_m, std::hypot(static_cast<double>(ekf.x.x.minus(base::Anchored{})) - truth.x_m,
                                               static_cast<double>(ekf.x.y.minus(base::Anchored{})) - truth.y_m));
      });
  EXPECT_GT(least_m, 0.5);
  EXPECT_LT(localise(run, 5, 1, Start::kWrong, true, 60).found_s, 60);
}

// --- Udacity's kidnapped vehicle: 42 landmarks without identities, 100 particles

TEST(Udacity, HundredParticlesKeepThreeCentimetres) {
  const std::string folder = test::recorded_folder("udacity_pf");
  if (folder.empty()) GTEST_SKIP() << "no udacity_pf in $TETAP_DATA";
  const auto controls = test::read_rows(folder + "/control_data.txt"), truth = test::read_rows(folder + "/gt_data.txt");
  const auto map = test::read_rows(folder + "/map_data.txt");
  const auto seen = test::read_rows(folder + "/observations_steps_1_1200.txt");
  static Particles<ParticlePose, 100> cloud({5, 6});
  const auto f = [](double v) { return static_cast<float>(v); };
  cloud.fill(100, [&](const Draw& draw) {
    return ParticlePose::at(f(truth[0][0]) + 0.3F * draw.normal(0), f(truth[0][1]) + 0.3F * draw.normal(1),
                            f(truth[0][2]) + 0.01F * draw.normal(2));
  });
  std::array<double, 3> error{};
  std::size_t next = 0;
  constexpr std::size_t kSteps = 1200;
  for (std::size_t k = 0; k < kSteps; ++k) {
    if (k > 0) {
      static_cast<void>(
          cloud.predict(ParticleArc{.ds_m = f(0.1 * controls[k - 1][0]), .dyaw_rad = f(0.1 * controls[k - 1][1])}));
      static_cast<void>(cloud.predict(ParticleKernel{{0.05F, 0, 0.05F, 0, 0, 0.0015F}}));
    }
    const std::size_t first = next;
    while (next < seen.size() && static_cast<std::size_t>(seen[next][0]) == k + 1) ++next;
    cloud.weigh([&](const ParticlePose& p) {
      float total = 0.0F;
      for (std::size_t i = first; i < next; ++i) {
        const float x = p.x_m + p.cos_yaw * f(seen[i][1]) - p.sin_yaw * f(seen[i][2]);
        const float y = p.y_m + p.sin_yaw * f(seen[i][1]) + p.cos_yaw * f(seen[i][2]);
        float least = 1e9F;
        for (const test::Row& m : map)
          least = std::min(least, (f(m[0]) - x) * (f(m[0]) - x) + (f(m[1]) - y) * (f(m[1]) - y));
        total += least;
      }
      return -total / (2.0F * 0.09F);
    });
    const ParticlePose pose = mean_pose(cloud);
    error[0] += std::abs(static_cast<double>(pose.x_m) - truth[k][0]) / kSteps;
    error[1] += std::abs(static_cast<double>(pose.y_m) - truth[k][1]) / kSteps;
    error[2] += std::abs(std::remainder(static_cast<double>(pose.yaw_rad()) - truth[k][2], 2 * M_PI)) / kSteps;
    cloud.resample(Resampling::kSystematic, 100);
  }
  std::printf("udacity, 100 particles: %.4f m %.4f m %.5f rad\n", error[0], error[1], error[2]);
  EXPECT_LE(error[0], 0.03);
  EXPECT_LE(error[1], 0.03);
  EXPECT_LE(error[2], 0.001);
}

}  // namespace
}  // namespace tetap::filter
