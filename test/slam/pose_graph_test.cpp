// SPDX-License-Identifier: Apache-2.0
#include "tetap/slam/pose_graph.hpp"
#include "slam/graphs.hpp"

#include <gtest/gtest.h>
#include <limits>
#include <memory>

namespace tetap {
namespace {

using test::rotation;
using Graph = slam::PoseGraph<float, 64, 200, 900>;
using Motion = Graph::Motion;

Motion motion(float x, float y, float yaw, float sigma = 0.1F) {
  Motion m;
  m.mean = {x, y, slam::Heading<float>::from_radians(yaw)};
  m.covariance = filter::Symmetric<float, 3>::diagonal({sigma * sigma, sigma * sigma, 0.01F * sigma * sigma});
  return m;
}
void run(Graph& graph, int units = 1'000'000) {
  ASSERT_TRUE(graph.begin());
  for (int call = 0; graph.busy(); ++call) {
    ASSERT_LT(call, 2'000'000) << "a job ends";
    graph.work(units);
  }
}

/// A square that is driven `laps` times with noisy odometry; true closures to the lap before.
struct Square {
  std::vector<Eigen::Vector3d> truth{{0, 0, 0}};
  std::vector<test::G2oEdge> odometry, closures;

  Square(int poses, unsigned seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    const Eigen::Vector3d sigma(0.05, 0.05, 0.02);
    const Eigen::Matrix3d information = sigma.cwiseProduct(sigma).cwiseInverse().asDiagonal();
    const auto seen = [&](int a, int b) {
      const Eigen::Vector3d &from = truth[static_cast<std::size_t>(a)], &to = truth[static_cast<std::size_t>(b)];
      Eigen::Vector3d z;
      z << rotation(-from(2)) * (to - from).head<2>(), to(2) - from(2);
      // The noise is in the frame of `to` as measured: g2o's, for R_z^T turns the error there.
      const Eigen::Vector2d turned = rotation(z(2)) * Eigen::Vector2d(normal(random), normal(random)) * 0.05;
      z += Eigen::Vector3d(turned(0), turned(1), 0.02 * normal(random));
      return test::G2oEdge{a, b, z, information};
    };
    for (int i = 1; i < poses; ++i) {
      const Eigen::Vector3d& last = truth.back();
      const Eigen::Vector2d step = rotation(last(2)) * Eigen::Vector2d(1, 0);
      truth.emplace_back(last(0) + step(0), last(1) + step(1), last(2) + (i % 5 == 0 ? M_PI / 2 : 0));
      odometry.push_back(seen(i - 1, i));
      if (i >= 20) closures.push_back(seen(i - 20, i));
    }
  }
  void fill(Graph& graph) const {
    for (const auto& edge : odometry) ASSERT_TRUE(graph.append(test::motion_of<float>(edge)));
    for (const auto& edge : closures) ASSERT_TRUE(graph.close(edge.from, edge.to, test::motion_of<float>(edge)));
  }
};

TEST(PlanarMotion, CompositionHasTheCovarianceOfManyDraws) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  const test::G2oEdge a{0, 1, {1.0, 0.5, 0.7}, Eigen::Vector3d(400, 900, 2500).asDiagonal()};
  const test::G2oEdge b{1, 2, {2.0, -0.3, -0.4}, Eigen::Vector3d(900, 100, 1600).asDiagonal()};
  const auto sum = slam::compose(test::motion_of<double>(a), test::motion_of<double>(b));
  const auto back = slam::inverse(test::motion_of<double>(a));
  Eigen::Matrix3d drawn = Eigen::Matrix3d::Zero(), drawn_back = Eigen::Matrix3d::Zero();
  constexpr int kDraws = 200'000;
  const auto draw = [&](const test::G2oEdge& e) {
    const Eigen::Matrix3d l = test::g2o_covariance(e).llt().matrixL();
    return Eigen::Vector3d(e.z + l * Eigen::Vector3d(normal(random), normal(random), normal(random)));
  };
  for (int k = 0; k < kDraws; ++k) {
    const Eigen::Vector3d p = draw(a), q = draw(b);
    Eigen::Vector3d end, inverse;
    end << p.head<2>() + rotation(p(2)) * q.head<2>(), p(2) + q(2);
    inverse << -(rotation(-p(2)) * p.head<2>()), -p(2);
    const Eigen::Vector3d e = end - Eigen::Vector3d(sum.mean.x_m, sum.mean.y_m, sum.mean.yaw.radians());
    const Eigen::Vector3d f = inverse - Eigen::Vector3d(back.mean.x_m, back.mean.y_m, back.mean.yaw.radians());
    drawn += e * e.transpose() / kDraws;
    drawn_back += f * f.transpose() / kDraws;
  }
  EXPECT_LT((sum.covariance.dense() - drawn).norm(), 0.02 * drawn.norm());
  EXPECT_LT((back.covariance.dense() - drawn_back).norm(), 0.02 * drawn_back.norm());
}

TEST(PlanarMotion, HeadingWrapsByItselfAndKeepsItsDigits) {
  const auto near_pi = slam::Heading<float>::from_radians(3.1F);
  EXPECT_NEAR((near_pi + near_pi).radians(), 6.2F - 2.0F * base::kPi, 2e-6F);
  EXPECT_EQ((near_pi + near_pi - near_pi).turn, near_pi.turn);
  EXPECT_NEAR(slam::Heading<double>::from_radians(-7.0).radians(), -7.0 + 2 * M_PI, 1e-12);
  EXPECT_EQ(slam::Heading<float>::from_radians(std::numeric_limits<float>::quiet_NaN()).turn, 0);
}

TEST(PlanarMotion, ACoordinateFarAwayKeepsMicrometres) {
  slam::Coordinate<float> x{.unit = 1'000'000'000, .rest_m = 0};
  const auto origin = x;
  for (int i = 0; i < 1000; ++i) x = x.plus(1e-5F);
  EXPECT_NEAR(x.minus(origin), 0.01F, 1e-7F);
  EXPECT_EQ(x.plus(std::numeric_limits<float>::infinity()).minus(x), 0.0F);
}

TEST(PoseGraph, EqualsDenseGaussNewtonInDouble) {
  const Square square(48, 7);
  Graph graph({.robust = false});
  square.fill(graph);
  run(graph);
  ASSERT_EQ(graph.status(), slam::GraphStatus::kConverged);
  // The judge: dense normal equations with numeric Jacobians of g2o's error, from the truth.
  std::vector<test::G2oEdge> edges = square.odometry;
  edges.insert(edges.end(), square.closures.begin(), square.closures.end());
  std::vector<Eigen::Vector3d> x = square.truth;
  const auto residual = [](const test::G2oEdge& e, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    const Eigen::Vector2d t = rotation(-e.z(2)) * (rotation(-a(2)) * (b - a).head<2>() - e.z.head<2>());
    return Eigen::Vector3d(t(0), t(1), std::remainder(b(2) - a(2) - e.z(2), 2 * M_PI));
  };
  const int n = static_cast<int>(x.size());
  Eigen::MatrixXd h;
  for (int iteration = 0; iteration < 10; ++iteration) {
    h = Eigen::MatrixXd::Zero(3 * n, 3 * n);
    Eigen::VectorXd g = Eigen::VectorXd::Zero(3 * n);
    h.topLeftCorner<3, 3>().setIdentity();
    for (const auto& e : edges) {
      Eigen::Matrix<double, 3, 6> j;
      Eigen::Vector3d poses[2] = {x[static_cast<std::size_t>(e.from)], x[static_cast<std::size_t>(e.to)]};
      const Eigen::Vector3d r = residual(e, poses[0], poses[1]);
      for (int c = 0; c < 6; ++c) {
        poses[c / 3](c % 3) += 1e-6;
        j.col(c) = residual(e, poses[0], poses[1]);
        poses[c / 3](c % 3) -= 2e-6;
        j.col(c) -= residual(e, poses[0], poses[1]);
        poses[c / 3](c % 3) += 1e-6;
      }
      j /= 2e-6;
      for (int p = 0; p < 2; ++p)
        for (int q = 0; q < 2; ++q)
          h.block<3, 3>(3 * (p == 0 ? e.from : e.to), 3 * (q == 0 ? e.from : e.to)) +=
              j.middleCols<3>(3 * p).transpose() * e.information * j.middleCols<3>(3 * q);
      for (int p = 0; p < 2; ++p)
        g.segment<3>(3 * (p == 0 ? e.from : e.to)) += j.middleCols<3>(3 * p).transpose() * e.information * r;
    }
    h.topRows<3>().setZero();
    h.leftCols<3>().setZero();
    h.topLeftCorner<3, 3>().setIdentity();
    g.head<3>().setZero();
    const Eigen::VectorXd d = h.ldlt().solve(-g);
    for (int i = 0; i < n; ++i) x[static_cast<std::size_t>(i)] += d.segment<3>(3 * i);
  }
  double chi2 = 0;
  for (const auto& e : edges)
    chi2 += test::g2o_chi2(e, x[static_cast<std::size_t>(e.from)], x[static_cast<std::size_t>(e.to)]);
  EXPECT_NEAR(static_cast<double>(graph.chi2()), chi2, 1e-4 * chi2);
  for (int i = 0; i < n; ++i) {
    const Eigen::Vector3d e = test::vector_of(graph.pose(i)) - x[static_cast<std::size_t>(i)];
    EXPECT_LT(e.head<2>().norm(), 1e-4) << i;
    EXPECT_LT(std::abs(std::remainder(e(2), 2 * M_PI)), 1e-4) << i;
  }
  const Eigen::Matrix3d expected = h.inverse().bottomRightCorner<3, 3>();
  const Eigen::Matrix3d got = graph.covariance_of_last().dense().cast<double>();
  EXPECT_LT((got - expected).norm(), 2e-3 * expected.norm());
}

TEST(PoseGraph, ResultIsTheSameHoweverWorkIsDealt) {
  const Square square(60, 2);
  const auto once = std::make_unique<Graph>(), often = std::make_unique<Graph>();
  square.fill(*once);
  square.fill(*often);
  run(*once);
  run(*often, 7);
  for (int i = 0; i < once->poses(); ++i) {
    EXPECT_EQ(once->pose(i).x.unit, often->pose(i).x.unit);
    EXPECT_EQ(base::bits(once->pose(i).x.rest_m), base::bits(often->pose(i).x.rest_m));
    EXPECT_EQ(base::bits(once->pose(i).y.rest_m), base::bits(often->pose(i).y.rest_m));
    EXPECT_EQ(once->pose(i).yaw.turn, often->pose(i).yaw.turn);
  }
}

TEST(PoseGraph, PosesThatComeDuringAJobAreCarriedAlong) {
  const Square square(60, 2);
  const auto graph = std::make_unique<Graph>();
  for (int i = 0; i < 50; ++i)
    ASSERT_TRUE(graph->append(test::motion_of<float>(square.odometry[static_cast<std::size_t>(i)])));
  for (const auto& edge : square.closures) {
    if (edge.to > 50) continue;
    ASSERT_TRUE(graph->close(edge.from, edge.to, test::motion_of<float>(edge)));
  }
  ASSERT_TRUE(graph->begin());
  EXPECT_FALSE(graph->begin()) << "one job at a time";
  graph->work(100);
  for (int i = 50; i < 59; ++i)
    ASSERT_TRUE(graph->append(test::motion_of<float>(square.odometry[static_cast<std::size_t>(i)])));
  const auto before = graph->pose(59).minus(graph->pose(50));
  while (graph->busy()) graph->work(1000);
  EXPECT_EQ(graph->status(), slam::GraphStatus::kConverged);
  const auto after = graph->pose(59).minus(graph->pose(50));
  EXPECT_NEAR(before.x_m, after.x_m, 1e-5F);
  EXPECT_NEAR(before.y_m, after.y_m, 1e-5F);
  EXPECT_NEAR((before.yaw - after.yaw).radians(), 0.0F, 1e-6F);
}

TEST(PoseGraph, AClosureWithItsOwnOdometryMovesNothing) {
  const auto graph = std::make_unique<Graph>();
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(graph->append(motion(1.0F, 0.1F, 0.3F)));
  std::vector<Eigen::Vector3d> before;
  for (int i = 0; i <= 10; ++i) before.push_back(test::vector_of(graph->pose(i)));
  const auto z = graph->pose(9).minus(graph->pose(2));
  ASSERT_TRUE(graph->close(2, 9, motion(z.x_m, z.y_m, z.yaw.radians())));
  run(*graph);
  EXPECT_LT(graph->chi2(), 1e-6F);
  for (int i = 0; i <= 10; ++i)
    EXPECT_LT((test::vector_of(graph->pose(i)) - before[static_cast<std::size_t>(i)]).norm(), 2e-5);
}

TEST(PoseGraph, BadInputIsRefusedAndChangesNothing) {
  const auto graph = std::make_unique<Graph>();
  ASSERT_TRUE(graph->append(motion(1, 0, 0)));
  ASSERT_TRUE(graph->append(motion(1, 0, 0)));
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
  for (const float bad : {nan, infinity, -infinity, 1e20F}) {
    for (int field = 0; field < 4; ++field) {
      Motion m = motion(1, 0, 0);
      (field == 0 ? m.mean.x_m : field == 1 ? m.mean.y_m : m.covariance(field - 2, 2)) = bad;
      EXPECT_FALSE(graph->append(m)) << bad << field;
      EXPECT_FALSE(graph->close(0, 2, m)) << bad << field;
    }
  }
  Motion flat = motion(1, 0, 0);
  flat.covariance(0, 1) = 1.0F;
  EXPECT_FALSE(graph->append(flat)) << "not positive definite";
  EXPECT_FALSE(graph->close(0, 3, motion(1, 0, 0)));
  EXPECT_FALSE(graph->close(-1, 1, motion(1, 0, 0)));
  EXPECT_FALSE(graph->close(1, 1, motion(1, 0, 0)));
  EXPECT_EQ(graph->poses(), 3);
  EXPECT_EQ(graph->edges(), 2);
}

TEST(PoseGraph, NoRoomForTheJobIsReportedAndLosesNothing) {
  using Small = slam::PoseGraph<float, 40, 800, 200>;
  const auto graph = std::make_unique<Small>();
  for (int i = 1; i < 40; ++i) ASSERT_TRUE(graph->append(motion(1, 0, 0.2F)));
  EXPECT_FALSE(graph->append(motion(1, 0, 0))) << "40 poses are there";
  for (int i = 0; i < 40; ++i)
    for (int j = i + 2; j < 40; ++j)
      if (!graph->close(i, j, motion(0, 0, 0))) break;
  const auto before = test::vector_of(graph->pose(39));
  ASSERT_TRUE(graph->begin());
  while (graph->busy()) graph->work(1000);
  EXPECT_EQ(graph->status(), slam::GraphStatus::kNoRoom);
  EXPECT_EQ(test::vector_of(graph->pose(39)), before);
}

TEST(PoseGraph, AGraphThatDoesNotConvergeSaysSo) {
  // Rings of closures that contradict each other by half a turn, and two iterations: no minimum is near.
  const auto graph = std::make_unique<Graph>(slam::GraphOptions{.robust = false, .iterations = 2});
  for (int i = 1; i < 40; ++i) ASSERT_TRUE(graph->append(motion(1, 0, 0.3F, 1.0F)));
  for (int i = 0; i + 7 < 40; i += 3)
    ASSERT_TRUE(graph->close(i, i + 7, motion(i % 2 == 0 ? 5.0F : -5.0F, 3.0F, i % 2 == 0 ? 3.0F : -2.0F, 0.01F)));
  std::vector<Eigen::Vector3d> before;
  for (int i = 0; i < 40; ++i) before.push_back(test::vector_of(graph->pose(i)));
  run(*graph);
  EXPECT_EQ(graph->status(), slam::GraphStatus::kNotConverged);
  for (int i = 0; i < 40; ++i)
    EXPECT_EQ(test::vector_of(graph->pose(i)), before[static_cast<std::size_t>(i)]) << "poses are left as they were";
}

TEST(PoseGraph, OneFalseClosureAmongTrueOnesIsLeftOut) {
  const Square square(60, 5);
  const auto clean = std::make_unique<Graph>(), dirty = std::make_unique<Graph>();
  square.fill(*clean);
  square.fill(*dirty);
  ASSERT_TRUE(dirty->close(3, 31, motion(0.2F, 0.1F, 0.0F, 0.05F)));
  run(*clean);
  run(*dirty);
  EXPECT_EQ(dirty->left_out() - clean->left_out(), 1);
  for (int i = 0; i < 60; ++i)
    EXPECT_LT((test::vector_of(dirty->pose(i)) - test::vector_of(clean->pose(i))).head<2>().norm(), 1e-3) << i;
}

TEST(PoseGraph, ComposingAPoseAwayKeepsTheOthersWhereTheyBelong) {
  const Square square(60, 9);
  const auto all = std::make_unique<Graph>(), thin = std::make_unique<Graph>();
  square.fill(*all);
  square.fill(*thin);
  EXPECT_FALSE(thin->compose_away(0));
  EXPECT_FALSE(thin->compose_away(59));
  ASSERT_TRUE(thin->compose_away(30));
  ASSERT_TRUE(thin->compose_away(10));
  EXPECT_EQ(thin->poses(), 58);
  run(*all);
  run(*thin);
  EXPECT_EQ(thin->status(), slam::GraphStatus::kConverged);
  for (int i = 0; i < 58; ++i) {
    const int was = i < 10 ? i : i < 29 ? i + 1 : i + 2;
    EXPECT_LT((test::vector_of(thin->pose(i)) - test::vector_of(all->pose(was))).head<2>().norm(), 0.06) << i;
  }
}

}  // namespace
}  // namespace tetap
