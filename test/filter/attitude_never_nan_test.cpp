// SPDX-License-Identifier: Apache-2.0
// The attitude filters stay finite with every gyroscope, accelerometer and magnetometer sample, report what they
// refuse, and find the attitude again. No part keeps a value that is not a number.
#include "support/never_nan.hpp"
#include "tetap/filter/attitude.hpp"
#include "tetap/filter/complementary.hpp"
#include "tetap/filter/mahony.hpp"

#include <gtest/gtest.h>
#include <cmath>

namespace tetap {
namespace {

using filter::Attitude;
using filter::AttitudeVerdict;
using filter::Mahony;
using filter::Quaternion;
using filter::Vector3;
using test::kHostile;

struct Input {
  Vector3 rate{0.0F, 0.0F, 0.0F}, force{0.0F, 0.0F, 9.81F}, field{0.0F, 17.0F, -46.0F};
  float dt_s = 0.01F, field_dt_s = 0.01F;
};
constexpr std::size_t kFields = 11;
float& field_of(Input& input, std::size_t i) {
  if (i < 3) return input.rate(static_cast<int>(i));
  if (i < 6) return input.force(static_cast<int>(i) - 3);
  if (i < 9) return input.field(static_cast<int>(i) - 6);
  return i == 9 ? input.dt_s : input.field_dt_s;
}

/// A body that turns to and fro about all axes, and what ideal sensors feel of it.
class Body {
 public:
  Input next() {
    t_s_ += 0.01F;
    const base::SinCos slow = base::sincos(1.3F * t_s_), fast = base::sincos(3.1F * t_s_);
    Input input;
    input.rate = {0.8F * slow.cos, 0.6F * fast.cos, 0.7F * slow.sin};
    truth_ = filter::turned(truth_, (0.5F * input.dt_s) * input.rate);
    const filter::Rows b(truth_.conjugate());
    input.force = b * input.force;
    input.field = b * input.field;
    return input;
  }
  /// Radians between the truth and an attitude.
  [[nodiscard]] float off(const Quaternion& q) const {
    const Quaternion d = truth_.conjugate() * q;
    return 2.0F * base::atan2(base::sqrt(d.x * d.x + d.y * d.y + d.z * d.z), base::abs(d.w));
  }

 private:
  Quaternion truth_;
  float t_s_ = 0.0F;
};

struct Answer {
  AttitudeVerdict verdict;
  bool field;
};
Answer feed(Attitude& filter, const Input& input) {
  const AttitudeVerdict verdict = filter.step(input.rate, input.force, input.dt_s);
  return {verdict, filter.magnetometer(input.field, input.field_dt_s)};
}
Answer feed(Mahony& filter, const Input& input) {
  return {filter.step(input.rate, input.force, input.field, input.dt_s) ? AttitudeVerdict::kAccepted
                                                                        : AttitudeVerdict::kRefused,
          true};
}

bool same(const Quaternion& a, const Quaternion& b) {
  return base::bits(a.w) == base::bits(b.w) && base::bits(a.x) == base::bits(b.x) &&
         base::bits(a.y) == base::bits(b.y) && base::bits(a.z) == base::bits(b.z);
}
template <class Filter>
void expect_sane(const Filter& filter) {
  EXPECT_NEAR(filter.q_nb().norm2(), 1.0F, 1e-3F);
  EXPECT_TRUE(filter.bias_b_radps().allFinite());
}

/// Each field of a sample broken with each hostile value, `times` samples long, after `before` good ones. Good ones for
/// `after` follow, in which the attitude has to be found again.
template <class Filter>
void break_every_field(int before, int times, int after, float most_off_rad) {
  for (std::size_t field = 0; field < kFields; ++field)
    for (const float value : kHostile) {
      SCOPED_TRACE(testing::Message() << "field " << field << " = " << value << " after " << before);
      Filter filter;
      Body body;
      for (int k = 0; k < before; ++k) static_cast<void>(feed(filter, body.next()));
      for (int k = 0; k < times; ++k) {
        Input input = body.next();
        field_of(input, field) = value;
        const Quaternion q = filter.q_nb();
        const Vector3 bias = filter.bias_b_radps();
        const Answer answer = feed(filter, input);
        if (!base::is_finite(value)) {
          const bool of_field = field >= 6 && field != 9;
          const bool endless = field == 10 && value > 0;  // since the last sample of the field: counts as a second
          if (!of_field) {
            EXPECT_EQ(answer.verdict, AttitudeVerdict::kRefused);
          }
          if (std::is_same_v<Filter, Attitude> && of_field && !endless) {
            EXPECT_FALSE(answer.field);
          }
        }
        if (answer.verdict == AttitudeVerdict::kRefused && (std::is_same_v<Filter, Mahony> || !answer.field)) {
          EXPECT_TRUE(same(filter.q_nb(), q));
          EXPECT_EQ(filter.bias_b_radps(), bias);
        }
        expect_sane(filter);
      }
      for (int k = 0; k < after; ++k) {
        static_cast<void>(feed(filter, body.next()));
        if (k % 50 == 0) expect_sane(filter);
      }
      EXPECT_LT(body.off(filter.q_nb()), most_off_rad);
      if constexpr (requires { filter.magnetometer_disturbed(); }) {
        EXPECT_TRUE(base::is_finite(filter.bias_sigma_radps()));
        EXPECT_FALSE(filter.magnetometer_disturbed());
      }
    }
}

TEST(NeverNan, AttitudeFromItsFirstSampleOn) { break_every_field<Attitude>(0, 20, 3000, 0.05F); }
TEST(NeverNan, AttitudeWhileItAverages) { break_every_field<Attitude>(50, 20, 3000, 0.05F); }
TEST(NeverNan, AttitudeWhenItIsSettled) { break_every_field<Attitude>(3000, 20, 3000, 0.05F); }
TEST(NeverNan, AttitudeOfALongDisturbance) { break_every_field<Attitude>(1000, 2000, 6000, 0.05F); }
TEST(NeverNan, MahonyFromItsFirstSampleOn) { break_every_field<Mahony>(0, 20, 3000, 0.1F); }
TEST(NeverNan, MahonyWhenItIsSettled) { break_every_field<Mahony>(2000, 20, 3000, 0.1F); }

/// Gyroscope alone: nothing to correct it, and 10^6 steps.
TEST(NeverNan, AMillionStepsWithoutAnythingSlow) {
  Attitude attitude;
  Mahony mahony;
  filter::ComplementaryAngle angle(1.0F);
  ASSERT_EQ(attitude.step(Vector3::Zero(), {0.0F, 0.0F, 9.81F}, 0.01F), AttitudeVerdict::kAccepted);
  ASSERT_TRUE(angle.step(0.0F, 0.0F, 0.01F));
  const Vector3 fall = Vector3::Zero(), rate{1.0F, -0.5F, 2.0F};
  for (int k = 0; k < 1'000'000; ++k) {
    ASSERT_EQ(attitude.step(rate, fall, 0.005F), AttitudeVerdict::kAccelerometerRefused);
    ASSERT_TRUE(mahony.step(rate, fall, 0.005F));
    ASSERT_FALSE(angle.step(2.0F, base::kNan, 0.005F));
  }
  expect_sane(attitude);
  expect_sane(mahony);
  EXPECT_TRUE(base::is_finite(angle.angle_rad()));
  EXPECT_TRUE(base::is_finite(attitude.bias_sigma_radps()));
}

TEST(NeverNan, EveryArgumentOfTheComplementaryAngle) {
  for (const float tau_s : kHostile)
    for (const float value : kHostile)
      for (int field = 0; field < 3; ++field) {
        filter::ComplementaryAngle angle(tau_s);
        ASSERT_TRUE(angle.step(0.0F, 0.3F, 0.01F));
        const bool taken = angle.step(field == 0 ? value : 1.0F, field == 1 ? value : 0.2F, field == 2 ? value : 0.01F);
        SCOPED_TRACE(testing::Message() << "tau " << tau_s << " field " << field << " = " << value);
        if (!base::is_finite(value)) {
          EXPECT_FALSE(taken);
        }
        EXPECT_LE(base::abs(angle.angle_rad()), base::kPi);
        for (int k = 0; k < 2000; ++k) ASSERT_TRUE(angle.step(0.0F, 0.2F, 0.01F));
        const bool follows = tau_s < 1.0F;  // with a longer memory, or none of the slow sensor, it need not
        EXPECT_LE(base::abs(angle.angle_rad()), base::kPi);
        if (follows || std::isnan(tau_s)) {
          EXPECT_NEAR(angle.angle_rad(), 0.2F, 1e-4F);
        }
      }
}

TEST(NeverNan, TheTwoPassesKeepNothingThatIsNoNumber) {
  for (const float value : kHostile)
    for (const bool of_weight : {true, false}) {
      filter::FirstOrderLowPass low;
      filter::FirstOrderHighPass high;
      float sum = 0.0F;
      for (int k = 0; k < 300; ++k) {
        const float x = k % 10 == 5 && !of_weight ? value : 1.0F;
        const float alpha = k % 10 == 5 && of_weight ? value : 0.8F;
        const float l = low.step(x, alpha), h = high.step(x, alpha);
        EXPECT_TRUE(base::is_finite(l) && base::is_finite(h)) << value << ' ' << k;
        sum = l + h;
      }
      EXPECT_TRUE(base::is_finite(sum));
      if (!base::is_finite(value)) {
        EXPECT_NEAR(sum, 1.0F, 1e-5F);
      }
    }
}

}  // namespace
}  // namespace tetap
