// SPDX-License-Identifier: Apache-2.0
#include "tetap/nav/so3.hpp"

#include "true_body.hpp"

#include <gtest/gtest.h>
#include <vector>

namespace tetap {
namespace {

using test::as_double;
using test::Vector3d;

/// Directions over the sphere, lengths from the subnormal to several turns.
std::vector<Vector3d> rotation_vectors() {
  std::vector<Vector3d> all{Vector3d::Zero()};
  test::Normal normal(1);
  for (const double length : {1e-40, 1e-12, 1e-7, 1e-4, 0.01, 0.19, 0.2, 0.21, 0.499999, 0.5, 0.500001, 1.0, 2.0, 3.0,
                              3.14, 3.1415, 3.2, 6.0, 40.0})
    for (int i = 0; i < 20; ++i) all.push_back(normal.vector().normalized() * length);
  return all;
}

double angle_between(const nav::Quaternion& a, const Eigen::Quaterniond& b) {
  return test::log_double(as_double(a).normalized() * b.conjugate()).norm();
}

TEST(So3, ExponentialIsTheRotationByItsAngle) {
  for (const Vector3d& phi : rotation_vectors()) {
    const nav::Vector3 in = phi.cast<float>();
    const nav::Quaternion q = nav::exp_quaternion(in);
    EXPECT_NEAR(static_cast<double>(q.norm2()), 1.0, 4e-7);
    const double length = phi.norm();
    EXPECT_LT(angle_between(q, test::exp_double(in.cast<double>())), 4e-7 * (1 + length)) << phi.transpose();
    if (length > 1e-30 && length < 0.4) {  // small angles keep their relative precision
      EXPECT_NEAR(as_double(q).vec().norm() / std::sin(length / 2), 1.0, 4e-7) << length;
    }
  }
}

TEST(So3, LogarithmUndoesTheExponential) {
  for (const Vector3d& phi : rotation_vectors()) {
    if (phi.norm() > 3.1416) continue;
    const nav::Vector3 in = phi.cast<float>();
    const Vector3d back = nav::log_quaternion(nav::exp_quaternion(in)).cast<double>();
    EXPECT_LT((back - in.cast<double>()).norm(), 1e-6 * phi.norm() + 1e-44) << phi.transpose();
  }
}

TEST(So3, LogarithmTakesTheShortWayAndDoesNotMindTheSign) {
  for (const Vector3d& phi : rotation_vectors()) {
    const nav::Quaternion q = nav::exp_quaternion(phi.cast<float>());
    const nav::Vector3 one = nav::log_quaternion(q);
    const nav::Vector3 other = nav::log_quaternion({-q.w, -q.x, -q.y, -q.z});
    EXPECT_LE(one.norm(), base::kPi * (1.0F + 1e-6F));
    if (one.norm() < 3.14F) {
      EXPECT_EQ(one, other);
    }
    EXPECT_LT(angle_between(q, test::exp_double(one.cast<double>())), 1e-6);
  }
}

TEST(So3, MatrixRotationAndProductAreThoseOfEigen) {
  test::Normal normal(2);
  for (int i = 0; i < 200; ++i) {
    const auto a = test::exp_double(normal.vector()), b = test::exp_double(normal.vector());
    const Vector3d v = normal.vector();
    const nav::Quaternion qa = test::as_float(a), qb = test::as_float(b);
    EXPECT_LT((qa.matrix().cast<double>() - a.toRotationMatrix()).norm(), 1e-6);
    EXPECT_LT((qa.rotate(v.cast<float>()).cast<double>() - a * v).norm(), 2e-6);
    EXPECT_LT((qa.rotated_x().cast<double>() - a * Vector3d::UnitX()).norm(), 1e-6);
    EXPECT_LT((qa.z_seen().cast<double>() - a.conjugate() * Vector3d::UnitZ()).norm(), 1e-6);
    EXPECT_LT(angle_between(qa * qb, a * b), 1e-6);
    EXPECT_LT(angle_between(qa * qa.conjugate(), Eigen::Quaterniond::Identity()), 1e-6);
    EXPECT_LT((nav::skew(v.cast<float>()) * nav::Vector3(1, 2, 3) - nav::cross(v.cast<float>(), {1, 2, 3})).norm(),
              1e-6F);
  }
}

TEST(So3, RenormalisingKeepsTheNormOverAMillionProducts) {
  nav::Quaternion q;
  const nav::Quaternion step = nav::exp_quaternion({0.011F, -0.007F, 0.02F});
  for (int i = 0; i < 1'000'000; ++i) {
    q = (q * step).renormalised();
    ASSERT_NEAR(q.norm2(), 1.0F, 1e-6F);
  }
}

TEST(So3, EulerAnglesComeBack) {
  for (const float yaw : {-3.1F, -1.0F, 0.0F, 0.5F, 3.0F})
    for (const float pitch : {-1.5F, -0.3F, 0.0F, 1.2F})
      for (const float roll : {-3.0F, -0.2F, 0.0F, 0.1F, 2.0F}) {
        const auto e = nav::euler(nav::from_euler({.yaw_rad = yaw, .pitch_rad = pitch, .roll_rad = roll}));
        EXPECT_NEAR(e.yaw_rad, yaw, 1e-5F);
        EXPECT_NEAR(e.pitch_rad, pitch, 1e-5F);
        EXPECT_NEAR(e.roll_rad, roll, 1e-5F);
      }
}

}  // namespace
}  // namespace tetap
