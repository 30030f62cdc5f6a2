// SPDX-License-Identifier: Apache-2.0
// Laws of every measurement model of inertial navigation. The Jacobian equals central differences, a perfect
// measurement moves nothing, and 50 km from the origin both hold.
#include "support/numeric_jacobian.hpp"
#include "tetap/model/dual_heading.hpp"
#include "tetap/model/gnss_course.hpp"
#include "tetap/model/gnss_fix_3d.hpp"
#include "tetap/model/gnss_velocity_3d.hpp"
#include "tetap/model/height.hpp"
#include "tetap/model/magnetic_heading.hpp"
#include "tetap/model/wheel_speed.hpp"
#include "tetap/model/zero_rate.hpp"
#include "tetap/model/zero_velocity.hpp"
#include "tetap/nav/ins.hpp"
#include "true_body.hpp"

#include <gtest/gtest.h>
#include <Eigen/Geometry>
#include <cstring>
#include <vector>

namespace tetap {
namespace {

using nav::InsState;
using nav::Vector3;

std::vector<InsState> states() {
  std::vector<InsState> all;
  for (const nav::Euler& e :
       {nav::Euler{}, nav::Euler{1.5F, 0.2F, -0.1F}, nav::Euler{-3.1F, -0.6F, 0.5F}, nav::Euler{3.14F, 1.2F, 2.9F}}) {
    InsState x{.x = test::anchored(12.5), .y = test::anchored(-7.25), .z = test::anchored(3.5)};
    x.v_n_mps = {3, -2, 0.4F};
    x.q_nb = nav::from_euler(e);
    x.b_a_mps2 = {0.1F, 0.05F, -0.02F};
    x.b_g_radps = {0.01F, -0.02F, 0.03F};
    all.push_back(x);
  }
  return all;
}

const Vector3 kLever{0.4F, -0.2F, 0.9F};
const Vector3 kGyro{0.3F, -0.2F, 1.1F};

/// A model that sees exactly what the state says.
template <class Model>
struct Example;

template <>
struct Example<model::GnssFix3d> {
  static model::GnssFix3d at(const InsState& x) {
    model::GnssFix3d m{.sigma_horizontal_m = 1.5F, .sigma_vertical_m = 3, .antenna_b_m = kLever};
    m.x = x.x, m.y = x.y, m.z = x.z;
    const Vector3 lever = m.predict(x);
    nav::move(m.x, lever(0)), nav::move(m.y, lever(1)), nav::move(m.z, lever(2));
    return m;
  }
};
template <>
struct Example<model::GnssVelocity3d> {
  static model::GnssVelocity3d at(const InsState& x) {
    model::GnssVelocity3d m{
        .sigma_horizontal_mps = 0.1F, .sigma_vertical_mps = 0.2F, .antenna_b_m = kLever, .gyro_b_radps = kGyro};
    return m.v_n_mps = m.predict(x), m;
  }
};
/// Its constraint holds only for a body that moves the way it looks.
template <>
struct Example<model::WheelSpeed> {
  static model::WheelSpeed at(const InsState& x) {
    model::WheelSpeed m{.sigma_forward_mps = 0.02F,
                        .sigma_lateral_mps = 0.1F,
                        .sigma_vertical_mps = 0.1F,
                        .axle_b_m = kLever,
                        .gyro_b_radps = kGyro};
    return m.forward_mps = m.predict(x)(0), m;
  }
};
template <>
struct Example<model::NonHolonomic> {
  static model::NonHolonomic at(const InsState&) {
    return {.sigma_lateral_mps = 0.1F, .sigma_vertical_mps = 0.1F, .axle_b_m = kLever, .gyro_b_radps = kGyro};
  }
};
template <>
struct Example<model::ZeroVelocity> {
  static model::ZeroVelocity at(const InsState&) { return {.sigma_mps = 0.01F}; }
};
template <>
struct Example<model::ZeroRate> {
  static model::ZeroRate at(const InsState& x) {
    model::ZeroRate m{.sigma_radps = 1e-3F};
    return m.gyro_b_radps = m.predict(x), m;
  }
};
template <>
struct Example<model::DualHeading> {
  static model::DualHeading at(const InsState& x) {
    model::DualHeading m({0.3F, 0.8F, 0.1F}, 0.0F, 0.02F);
    m.q_nl = nav::exp_quaternion({0.016F, -0.01F, 0.6F});
    return m.angle_rad = m.predict(x)(0), m;
  }
};
template <>
struct Example<model::MagneticHeading> {
  static model::MagneticHeading at(const InsState& x) {
    const float declination = 0.05F;  // a field that dips by 60 degrees
    const Vector3 field_n{0.5F * base::sin(declination), 0.5F * base::cos(declination), -0.866F};
    return {x.q_nb.conjugate().rotate(field_n), declination, 0.05F};
  }
};
template <>
struct Example<model::GnssCourse> {
  static model::GnssCourse at(const InsState& x) {
    model::GnssCourse m(3.0F, 1.0F, 0.1F, 0.02F);
    return m.angle_rad = m.predict(x)(0), m;
  }
};
template <>
struct Example<model::Height> {
  static model::Height at(const InsState& x) { return {.z = x.z, .sigma_m = 0.5F}; }
};

template <class Model>
class InsMeasurementLaws : public testing::Test {};
using Models =
    testing::Types<model::GnssFix3d, model::GnssVelocity3d, model::WheelSpeed, model::NonHolonomic, model::ZeroVelocity,
                   model::ZeroRate, model::DualHeading, model::MagneticHeading, model::GnssCourse, model::Height>;
TYPED_TEST_SUITE(InsMeasurementLaws, Models);

TYPED_TEST(InsMeasurementLaws, JacobianEqualsCentralDifferences) {
  for (const InsState& x : states()) {
    const auto m = Example<TypeParam>::at(x);
    const auto h = m.jacobian(x);
    const auto numeric = test::numeric_measurement_jacobian(m, x, 0.01F);
    for (int r = 0; r < TypeParam::kDimension; ++r) {
      filter::Vector<float, 15> row = filter::Vector<float, 15>::Zero();
      for (std::size_t k = 0; k < TypeParam::kTouches.size(); ++k)
        row(TypeParam::kTouches[k]) = h(r, static_cast<int>(k));
      for (int c = 0; c < 15; ++c) EXPECT_NEAR(row(c), numeric(r, c), 2e-3F * (1 + std::abs(row(c)))) << r << ' ' << c;
    }
  }
}

TYPED_TEST(InsMeasurementLaws, APerfectMeasurementLeavesTheStateAndShrinksTheCovariance) {
  constexpr bool kAlwaysPerfect = !std::is_same_v<TypeParam, model::WheelSpeed> &&
                                  !std::is_same_v<TypeParam, model::NonHolonomic> &&
                                  !std::is_same_v<TypeParam, model::ZeroVelocity>;
  for (InsState x : states()) {
    if constexpr (!kAlwaysPerfect) {  // these say something of the motion itself: let it be so
      const Vector3 forward{2, 0, 0};
      const Vector3 swing = nav::cross(kGyro - x.b_g_radps, kLever);
      x.v_n_mps = std::is_same_v<TypeParam, model::ZeroVelocity> ? Vector3(0, 0, 0) : x.q_nb.rotate(forward - swing);
    }
    nav::Ins ins;
    ins.start(x, nav::Ins::Covariance::diagonal({1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1}));
    const auto innovation = ins.update(Example<TypeParam>::at(x), 9.0F);
    ASSERT_EQ(innovation.verdict, filter::Verdict::kAccepted);
    EXPECT_LT(innovation.nis, 1e-6F);
    EXPECT_LT(ins.x.minus(x).norm(), 1e-4F);
    EXPECT_TRUE(ins.p.positive_definite());
    float trace = 0;
    for (int i = 0; i < 15; ++i) trace += ins.p(i, i);
    EXPECT_LT(trace, 14.6F);
  }
}

using Vector15 = filter::Vector<float, 15>;
using Matrix15f = Eigen::Matrix<float, 15, 15>;

nav::Ins::Covariance correlated(test::Normal& normal) {
  Eigen::Matrix<double, 15, 15> a;
  for (int i = 0; i < 225; ++i) a(i / 15, i % 15) = normal();
  const Eigen::Matrix<double, 15, 15> full = 0.01 * a * a.transpose();
  return nav::Ins::Covariance::upper_of(full.cast<float>());
}

/// The state moved by dx, the covariance as it was updated. A heading from outside the body turns the errors of the
/// tilt with it, its own correction by half.
void expect_moved(const nav::Ins& ins, const InsState& from, const Vector15& dx, const nav::Ins::Covariance& updated,
                  bool from_outside, float scale) {
  Matrix15f turn = Matrix15f::Identity(), half = turn;
  const float up_rad = dx(8), size_rad = std::abs(up_rad);
  if (from_outside && size_rad > 5e-4F) {
    turn.block<2, 2>(6, 6) = Eigen::Rotation2Df(up_rad).matrix();
    if (size_rad < 0.05F) {
      Eigen::Matrix2f shears;
      shears << 1 - up_rad * up_rad, -up_rad, up_rad, 1;
      EXPECT_LT((turn.block<2, 2>(6, 6) - shears).norm(), up_rad * up_rad);
      turn.block<2, 2>(6, 6) = shears;
    }
    half(7, 6) = 0.5F * up_rad, half(6, 7) = -0.5F * up_rad;
  }
  EXPECT_LT((ins.x.minus(from) - half * dx).norm(), 1e-4F * (1 + dx.norm()));
  EXPECT_LT((ins.p.dense() - turn * updated.dense() * turn.transpose()).norm(), 1e-5F * scale);
}

/// The update made for many states against the one all filters share, from a covariance with every correlation.
TYPED_TEST(InsMeasurementLaws, IsFusedAsTheSharedUpdateDoesIt) {
  constexpr int kM = TypeParam::kDimension;
  constexpr bool kInBody = requires(TypeParam model) { model.moves; };
  test::Normal normal(11);
  for (const InsState& x : states()) {
    const nav::Ins::Covariance p = correlated(normal);
    auto m = Example<TypeParam>::at(x);
    for (const bool lever : {true, false}) {
      if constexpr (requires { m.antenna_b_m; }) {
        if (!lever) m.antenna_b_m.setZero();
      }
      nav::Ins::Covariance p_shared = p;
      const auto shared = filter::update<float, 15, kM, TypeParam::kTouches.size()>(
          p_shared, m.jacobian(x), TypeParam::kTouches, m.residual(m.predict(x)), m.noise(), 1e9F);
      nav::Ins ins;
      ins.start(x, p);
      const auto record = ins.update(m, 1e9F);
      ASSERT_EQ(record.verdict, filter::Verdict::kAccepted);
      EXPECT_NEAR(record.nis, shared.innovation.nis, 1e-4F * (1 + shared.innovation.nis));
      EXPECT_LT((record.s.dense() - shared.innovation.s.dense()).norm(), 1e-5F * shared.innovation.s.dense().norm());
      expect_moved(ins, x, shared.dx, p_shared, !kInBody && TypeParam::kTouches[0] < InsState::kAccelBias,
                   p.dense().norm());
    }
  }
}

TYPED_TEST(InsMeasurementLaws, FarFromTheOriginItSeesTheSame) {
  for (const InsState& x : states()) {
    const auto near = Example<TypeParam>::at(x);
    InsState far = x;
    for (base::Anchored* c : {&far.x, &far.y, &far.z}) c->anchor_um += 50'000'000'000;
    auto moved = near;
    if constexpr (requires { moved.x; }) moved.x.anchor_um += 50'000'000'000, moved.y.anchor_um += 50'000'000'000;
    if constexpr (requires { moved.z; }) moved.z.anchor_um += 50'000'000'000;
    EXPECT_EQ(moved.predict(far), near.predict(x));
    EXPECT_EQ(moved.jacobian(far), near.jacobian(x));
  }
}

TYPED_TEST(InsMeasurementLaws, NothingThatIsNotFiniteIsTakenAndNothingChangesThen) {
  for (const float bad : {base::kNan, base::kInfinity, -base::kInfinity, 3e38F, -3e38F}) {
    const InsState x = states()[1];
    auto bytes = Example<TypeParam>::at(x);
    // Every float of the model in turn.
    constexpr std::size_t kFloats = sizeof(bytes) / sizeof(float);
    for (std::size_t i = 0; i < kFloats; ++i) {
      auto m = Example<TypeParam>::at(x);
      std::memcpy(reinterpret_cast<char*>(&m) + i * sizeof(float), &bad, sizeof bad);
      if constexpr (requires { m.x.anchor_um; }) {
        if (i * sizeof(float) < 3 * sizeof(base::Anchored) && i % 4 != 2) continue;  // anchors are integers
      } else if constexpr (requires { m.z.anchor_um; }) {
        if (i * sizeof(float) < sizeof(base::Anchored) && i % 4 != 2) continue;
      }
      nav::Ins ins;
      ins.start(x, nav::Ins::Covariance::diagonal({1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1}));
      const auto before = ins.p.packed();
      const auto verdict = ins.update(m, 20.0F).verdict;
      EXPECT_TRUE(ins.x.finite()) << i << ' ' << bad;
      EXPECT_TRUE(ins.p.positive_definite()) << i << ' ' << bad;
      if (base::is_nan(bad)) {
        // Padding and flags of the model may be overwritten without effect.
        EXPECT_TRUE(verdict != filter::Verdict::kAccepted || m.predict(x) == bytes.predict(x)) << i;
      }
      if (verdict != filter::Verdict::kAccepted) {
        EXPECT_EQ(ins.p.packed(), before);
        EXPECT_TRUE(test::same(ins.x, x));
      }
    }
  }
}

TEST(MagneticHeading, NorthIsAheadOfABodyThatLooksNorthAndDeclinationTurnsItEast) {
  InsState x;
  x.q_nb = nav::from_euler({.yaw_rad = base::kHalfPi});
  EXPECT_NEAR(model::MagneticHeading({0.5F, 0, -0.8F}, 0.0F, 0.1F).residual(filter::Vector<float, 1>{base::kHalfPi})(0),
              0, 1e-6F);
  // Magnetic north 0.1 rad east of true north; the body looks to magnetic north: its yaw is 90 degrees less 0.1.
  nav::Ins ins;
  ins.start(x, nav::Ins::Covariance::diagonal({1, 1, 1, 1, 1, 1, 1e-8F, 1e-8F, 1, 1, 1, 1, 1, 1, 1}));
  static_cast<void>(ins.update(model::MagneticHeading({0.5F, 0, -0.8F}, 0.1F, 1e-3F), 1e9F));
  EXPECT_NEAR(nav::euler(ins.x.q_nb).yaw_rad, base::kHalfPi - 0.1F, 1e-4F);
}

TEST(GnssCourse, IsRefusedAtStandstillAndTurnedRoundInReverse) {
  nav::Ins ins;
  EXPECT_EQ(ins.update(model::GnssCourse(0.0F, 0.0F, 0.1F, 0.02F), 9.0F).verdict, filter::Verdict::kNotFinite);
  EXPECT_EQ(ins.update(model::GnssCourse(0.01F, -0.02F, 0.1F, 0.02F), 9.0F).verdict, filter::Verdict::kNotFinite);
  const auto back = ins.update(model::GnssCourse(-2.0F, 0.0F, 0.1F, 0.02F, true), 9.0F);
  EXPECT_NEAR(back.nu(0), 0.0F, 1e-6F);
  EXPECT_NEAR(model::GnssCourse(2.0F, 0.0F, 0.1F, 0.0F).sigma_rad, 0.05F, 1e-6F);
}

TEST(Direction, IsRefusedWhenTheVectorStandsUpright) {
  nav::Ins ins;
  ins.x.q_nb = nav::from_euler({.pitch_rad = base::kHalfPi});
  EXPECT_EQ(ins.update(model::DualHeading({1, 0, 0}, 0.3F, 0.1F), 9.0F).verdict, filter::Verdict::kNotFinite);
}

TEST(WheelSpeed, SeesTheAxleSwingRoundTheBody) {
  InsState x;  // turning left on the spot about the sensor: an axle half a metre behind it moves to the right
  const model::WheelSpeed m{.axle_b_m = {-0.5F, 0.2F, 0}, .gyro_b_radps = {0, 0, 2}};
  EXPECT_NEAR(m.predict(x)(0), -0.4F, 1e-6F);
  EXPECT_NEAR(m.predict(x)(1), -1.0F, 1e-6F);
}

}  // namespace
}  // namespace tetap
