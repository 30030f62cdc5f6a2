// SPDX-License-Identifier: Apache-2.0
// Visual SLAM on another hand's world: MRPT's kf-slam_6D_demo, 600 steps in a room of 50 points with exact truth.
#include "support/recorded.hpp"
#include "tetap/slam/speed_core.hpp"
#include "tetap/slam/visual_map.hpp"

#include <gtest/gtest.h>
#include <Eigen/Dense>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <vector>

namespace tetap {
namespace {

using DemoMap = slam::VisualMap<slam::SpeedCore, 6, 40, 64>;

/// Noise as the log states it: .06 m and .0017 rad a step. An angle of .0017 rad is 2.7 px where it is 60 deg.
std::unique_ptr<DemoMap> demo_map() {
  return std::make_unique<DemoMap>(
      slam::VisualOptions{.camera = {.fu_px = 400, .fv_px = 400, .cu_px = 1000, .cv_px = 1000},
                          .mounting = {.q_cb = {0.5F, 0.5F, -0.5F, 0.5F}},
                          .sigma_px = 2.7F,
                          .sigma_mounting_rad = 1e-4F},
      slam::SpeedCore({.position_walk_m = 0.06F,
                       .angle_walk_rad = 0.0017F,
                       .sigma_scale = 0,
                       .sigma_direction_rad = 0,
                       .direction_walk_rad = 0}));
}

struct SixDofDemo : testing::Test {
  std::ifstream in;

  void SetUp() override {
    const std::string folder = test::recorded_folder("scans"), log = folder + "/kf-slam_6D_demo";
    if (folder.empty() || !std::filesystem::exists(log + ".rawlog"))
      GTEST_SKIP() << "scans/kf-slam_6D_demo.rawlog is not in $TETAP_DATA";
    const std::string out = testing::TempDir() + "tetap_kf_slam_demo";
    const std::string command = "'" TETAP_SOURCE "/test/slam/kf_slam_demo.py' '" + log + ".rawlog' '" + log +
                                "_ground_truth.txt' '" + log + "_ground_truth_robot_path.txt' '" + out + "'";
    ASSERT_EQ(std::system(command.c_str()), 0) << command;
    in.open(out);
  }
  Eigen::Vector3d vector() {
    Eigen::Vector3d v;
    in >> v(0) >> v(1) >> v(2);
    return v;
  }
};

TEST_F(SixDofDemo, PathAndPointsStayWithinThreeSigma) {
  nav::Quaternion q;
  in >> q.w >> q.x >> q.y >> q.z;
  const Eigen::Vector3d from = vector();
  int count = 0, steps = 0;
  in >> count >> steps;
  std::map<int, Eigen::Vector3d> truth;
  for (int id = 0; count > 0 && in >> id; --count) truth[id] = vector();
  const auto map = demo_map();
  map->start(q, 1e-3F, std::array<std::int64_t, 3>{}, 1e-3F);
  Eigen::Vector3d dead = from;  // by odometry alone
  Eigen::Quaterniond q_dead{static_cast<double>(q.w), static_cast<double>(q.x), static_cast<double>(q.y),
                            static_cast<double>(q.z)};
  const auto turned = [](const Eigen::Vector3d& by) {
    return Eigen::Quaterniond(Eigen::AngleAxisd(by.norm(), by.stableNormalized()));
  };
  double square = 0, dead_square = 0, nees = 0;
  int beyond = 0;
  for (int k = 0; k < steps; ++k) {
    const Eigen::Vector3d speed = vector(), rate = vector(), at = vector();
    int seen = 0;
    in >> seen;
    std::vector<slam::ImageFeature> image(static_cast<std::size_t>(seen)), none;
    for (slam::ImageFeature& one : image) in >> one.id >> one.u_quarter_px >> one.v_quarter_px;
    ASSERT_TRUE(in);
    if (k > 0) {
      ASSERT_TRUE(map->predict({.speed_b_mps = speed.cast<float>(), .rate_b_radps = rate.cast<float>(), .dt_s = 1.0F}));
      dead += q_dead * turned(0.5 * rate) * speed;
      q_dead = q_dead * turned(rate);
    }
    ASSERT_TRUE(map->begin_image(none) && map->end_image(none));
    ASSERT_TRUE(map->begin_recognised(image));
    while (map->busy()) map->work(1'000'000);
    ASSERT_TRUE(map->end_recognised(image));
    const Eigen::Vector3d p = map->pose().p_n_m.cast<double>();
    Eigen::Matrix<double, 3, 6> of_error;  // right-invariant: position less attitude times p
    of_error << 0, p(2), -p(1), 1, 0, 0, -p(2), 0, p(0), 0, 1, 0, p(1), -p(0), 0, 0, 0, 1;
    Eigen::Matrix<double, 6, 6> joint;
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j)
        joint(i, j) = static_cast<double>(map->covariance()(DemoMap::kCore + i, DemoMap::kCore + j));
    const Eigen::Matrix3d cov = of_error * joint * of_error.transpose();
    Eigen::Vector3d e = p + from - at;
    for (int i = 0; i < 3; ++i) e(i) += 1e-6 * static_cast<double>(map->origin_um()[static_cast<std::size_t>(i)]);
    nees += e.dot(cov.ldlt().solve(e)) / steps;
    beyond += (e.cwiseAbs().array() > 3 * cov.diagonal().cwiseSqrt().array()).any() ? 1 : 0;
    square += e.squaredNorm() / steps, dead_square += (dead - at).squaredNorm() / steps;
  }
  double worst = 0;
  for (int i = 0; i < map->map().size(); ++i) {
    const auto& point = map->map()[i];
    const Eigen::Vector3d e = point.at_n_m.cast<double>() + from - truth.at(point.id);
    for (int axis = 0; axis < 3; ++axis) {
      const int n = DemoMap::kFirstPoint + 3 * i + axis;
      const double shift = 1e-6 * static_cast<double>(map->origin_um()[static_cast<std::size_t>(axis)]);
      worst = std::max(worst, std::abs(e(axis) + shift) / std::sqrt(static_cast<double>(map->covariance()(n, n))));
    }
  }
  std::printf("path %.3f m, odometry %.3f m, NEES %.2f of 3, %d of %d steps beyond 3 sigma, %d points, %.2f sigma\n",
              std::sqrt(square), std::sqrt(dead_square), nees, beyond, steps, map->map().size(), worst);
  EXPECT_LT(std::sqrt(square), 0.2 * std::sqrt(dead_square));
  EXPECT_GT(nees, 0.3);
  EXPECT_LT(nees, 3.0);
  EXPECT_EQ(beyond, 0);
  EXPECT_GE(map->map().size(), 45);
  EXPECT_LT(worst, 3.0);
}

}  // namespace
}  // namespace tetap
