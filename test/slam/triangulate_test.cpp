// SPDX-License-Identifier: Apache-2.0
#include "tetap/slam/triangulate.hpp"
#include "slam/triangulation_table.hpp"
#include "tetap/slam/point_sighting.hpp"

#include <gtest/gtest.h>
#include <Eigen/Dense>
#include <limits>
#include <vector>

namespace tetap {
namespace {

using slam::DepthFate;

constexpr float kSigma = 0.002F;

/// Views along a way sideways, without turns, of a point of the first camera.
std::vector<slam::RelativeView> views_of(const nav::Vector3& point, float step_m, int count = 6) {
  std::vector<slam::RelativeView> views;
  for (int k = 0; k < count; ++k) {
    slam::RelativeView view;
    view.d_m = {-step_m * static_cast<float>(k), 0.0F, 0.0F};
    const nav::Vector3 seen = point + view.d_m;
    view.seen = {seen(0) / seen(2), seen(1) / seen(2)};
    views.push_back(view);
  }
  return views;
}
slam::InverseDepth solved(const std::vector<slam::RelativeView>& views, float sigma = kSigma) {
  slam::InverseDepth depth(views.front().seen);
  for (int i = 0; i < 2 * slam::InverseDepth::kIterations; ++i) depth.iterate(views, sigma);
  return depth;
}

TEST(Triangulation, FindsWhatSciPyFinds) {
  for (const auto& one : test::kTriangulationCases) {
    std::vector<slam::RelativeView> views;
    std::vector<Eigen::Matrix3d> turn;
    const Eigen::Map<const Eigen::Vector3d> first(one.place_m[0]), point(one.point_m);
    for (int k = 0; k < 6; ++k) {
      const Eigen::Quaterniond q(one.q_cn[k][0], one.q_cn[k][1], one.q_cn[k][2], one.q_cn[k][3]);
      turn.push_back(q.toRotationMatrix());
      const Eigen::Map<const Eigen::Vector3d> place(one.place_m[k]);
      slam::RelativeView view;
      view.r = (turn.back() * turn.front().transpose()).cast<float>();
      view.d_m = (turn.back() * (first - place)).cast<float>();
      view.seen = {static_cast<float>(one.seen[k][0]), static_cast<float>(one.seen[k][1])};
      views.push_back(view);
    }
    const slam::InverseDepth depth = solved(views);
    ASSERT_EQ(depth.fate(), DepthFate::kFound);
    const Eigen::Vector3d found = turn.front().transpose() * depth.point_m().cast<double>() + first;
    EXPECT_NEAR((found - point).norm(), 0, 0.02 * one.sigma_z_m);
    // The sigma of the depth, to first order: sigma(1/z) z^2. The axes differ by the turn of the first view.
    const double z = (turn.front() * (point - first))(2);
    EXPECT_NEAR(static_cast<double>(depth.sigma_per_m()) * z * z / one.sigma_z_m, 1, 0.05);
  }
}

TEST(Triangulation, AnExactPointIsFoundExactly) {
  for (const float z : {0.8F, 5.0F, 60.0F, 200.0F}) {
    const nav::Vector3 point{0.2F * z, -0.1F * z, z};
    const slam::InverseDepth depth = solved(views_of(point, 0.1F * z));
    ASSERT_EQ(depth.fate(), DepthFate::kFound) << z;
    EXPECT_LT((depth.point_m() - point).norm(), 1e-4F * z);
    EXPECT_LE(depth.iterations(), slam::InverseDepth::kIterations);
  }
}

TEST(Triangulation, WhatHasNoDepthIsRefusedWithItsReason) {
  EXPECT_EQ(solved(views_of({1, 1, 20}, 0.0F)).fate(), DepthFate::kSingular) << "no parallax";
  EXPECT_EQ(solved(views_of({1, 1, 100}, 0.02F)).fate(), DepthFate::kUncertain) << "0.1 m at 100 m, 0.1 degrees";
  EXPECT_EQ(solved(views_of({40, 40, 400}, 5.0F), 1e-4F).fate(), DepthFate::kOutOfRange);
  auto views = views_of({0, 0, 5}, 0.5F);
  for (auto& view : views) view.d_m(2) = -30.0F;
  EXPECT_EQ(solved(views).fate(), DepthFate::kBehind);
  views = views_of({0, 0, 5}, 0.5F);
  views[3].seen.x = std::numeric_limits<float>::quiet_NaN();
  EXPECT_NE(solved(views).fate(), DepthFate::kFound) << "no number";
}

TEST(PointSighting, RowsAreNumericDerivatives) {
  const model::CameraMounting camera{.q_cb = nav::from_euler({0.1F, -1.4F, 0.3F}), .lever_b_m = {1.0F, 0.2F, 0.7F}};
  const slam::WorldPose pose{.q_nb = nav::from_euler({0.7F, 0.1F, -0.2F}), .p_n_m = {4.0F, -3.0F, 1.0F}};
  const nav::Vector3 of_camera{1.5F, -2.0F, 9.0F};
  const nav::Vector3 point =
      pose.p_n_m + pose.q_nb.rotate(camera.lever_b_m + camera.q_cb.conjugate().rotate(of_camera));
  const slam::PointSighting sighting(pose, camera, point);
  EXPECT_NEAR(sighting.at.at.x, 1.5F / 9.0F, 1e-5F);
  EXPECT_NEAR(sighting.at.at.y, -2.0F / 9.0F, 1e-5F);
  constexpr float kStep = 2e-3F;
  const auto moved = [&](int state, float by) {
    model::CameraMounting c = camera;
    slam::WorldPose p = pose;
    nav::Vector3 f = point;
    std::array<float, 6> error{};
    if (state < 3) {
      nav::Vector3 turn = nav::Vector3::Zero();
      turn(state) = by;
      c.q_cb = nav::exp_quaternion(turn) * c.q_cb;
    } else if (state < 9) {
      error[static_cast<std::size_t>(state - 3)] = by;
      p.correct(error.data());
    } else {
      f(state - 9) += by;
    }
    return slam::PointSighting(p, c, f).at.at;
  };
  for (int state = 0; state < 12; ++state) {
    const auto s = static_cast<std::size_t>(state);
    const model::ImagePoint high = moved(state, kStep), low = moved(state, -kStep);
    for (std::size_t i = 0; i < 2; ++i) {
      const float analytic = state < 9 ? sighting.h[i][s] : sighting.of_point[i][s - 9];
      const float numeric = (i == 0 ? high.x - low.x : high.y - low.y) / (2 * kStep);
      EXPECT_NEAR(analytic, numeric, 1e-3F * (1.0F + base::abs(numeric))) << state << "," << i;
    }
  }
}

TEST(PinholeCamera, AxesAndQuarterPixels) {
  const model::PinholeCamera camera{.fu_px = 700, .fv_px = 500, .cu_px = 600, .cv_px = 200};
  EXPECT_TRUE(camera.valid());
  const model::ImagePoint right_low = camera.direction(4 * 950, 4 * 300);
  EXPECT_FLOAT_EQ(right_low.x, 0.5F) << "x right";
  EXPECT_FLOAT_EQ(right_low.y, 0.2F) << "y down";
  EXPECT_FALSE((model::PinholeCamera{.fu_px = 0, .fv_px = 500, .cu_px = 600, .cv_px = 200}.valid()));
  EXPECT_FALSE(model::Projection({0, 0, -5}).seen);
  const model::Projection ahead(nav::Vector3{1.0F, 2.0F, 4.0F});
  EXPECT_FLOAT_EQ(ahead.at.x, 0.25F);
  EXPECT_FLOAT_EQ(ahead.at.y, 0.5F);
}

}  // namespace
}  // namespace tetap
