// SPDX-License-Identifier: Apache-2.0
// The attitude filters' workloads. A body tumbles at 100 Hz, so nothing is at rest and every branch of the steady
// filter is taken. A filter's start is over before the counting begins.
#include "board.hpp"
#include "markers.hpp"
#include "tetap/filter/attitude.hpp"
#include "tetap/filter/complementary.hpp"
#include "tetap/filter/mahony.hpp"

namespace {

using namespace tetap;
using count::opaque;
using count::Region;

constexpr int kSamples = 256, kWarmUp = 1500;
constexpr float kStep_s = 0.01F;

struct Sample {
  filter::Vector3 rate, force, field;
};

/// Readings of ideal sensors in a rotation whose axis wanders, less than a revolution per second, and of a jolting
/// hand.
class Body {
 public:
  Sample next() {
    t_s_ += kStep_s;
    const base::SinCos slow = base::sincos(1.3F * t_s_), fast = base::sincos(5.1F * t_s_);
    const filter::Vector3 rate{2.0F * slow.sin, 1.5F * slow.cos, 1.0F + 0.5F * fast.sin};
    q_ = filter::turned(q_, (0.5F * kStep_s) * rate);
    const filter::Rows b(q_.conjugate());
    return {.rate = rate,
            .force = b * filter::Vector3{fast.cos, fast.sin, 9.81F + fast.cos},
            .field = b * filter::Vector3{0.0F, 17.0F, -46.0F}};
  }

 private:
  filter::Quaternion q_;
  float t_s_ = 0.0F;
};

void complementary_one_axis() {
  Body body;
  filter::ComplementaryAngle roll(1.0F);
  for (int k = 0; k < kSamples; ++k) {
    const Sample s = body.next();
    float measured_rad = base::atan2(s.force(1), s.force(2));
    opaque(measured_rad);
    const Region<struct complementary_angle> region;
    static_cast<void>(roll.step(s.rate(0), measured_rad, kStep_s));
  }
  opaque(roll);
}

void mahony() {
  Body body;
  filter::Mahony six;
  for (int k = 0; k < kSamples; ++k) {
    const Sample s = body.next();
    const Region<struct w4_ahrs6> region;
    six.step(s.rate, s.force, kStep_s);
  }
  opaque(six);
  filter::Mahony nine;
  for (int k = 0; k < kSamples; ++k) {
    const Sample s = body.next();
    const Region<struct w4_ahrs9> region;
    nine.step(s.rate, s.force, s.field, kStep_s);
  }
  opaque(nine);
}

void attitude() {
  Body body;
  static filter::Attitude six, nine;
  for (int k = 0; k < kWarmUp; ++k) {
    const Sample s = body.next();
    static_cast<void>(six.step(s.rate, s.force, kStep_s));
    static_cast<void>(nine.step(s.rate, s.force, kStep_s));
    nine.magnetometer(s.field, kStep_s);
  }
  filter::Quaternion q_nb;
  for (int k = 0; k < kSamples; ++k) {
    const Sample s = body.next();
    {
      const Region<struct ahrs6> region;
      static_cast<void>(six.step(s.rate, s.force, kStep_s));
      q_nb = six.q_nb();
      opaque(q_nb);
    }
    const Region<struct ahrs9> region;
    static_cast<void>(nine.step(s.rate, s.force, kStep_s));
    nine.magnetometer(s.field, kStep_s);
    q_nb = nine.q_nb();
    opaque(q_nb);
  }
  opaque(six);
  opaque(nine);
  // Whatever goes wrong: a long push sideways, a field that is not the Earth's, a start and a gyroscope that clips.
  filter::Attitude upset;
  for (int k = 0; k < 3000; ++k) {
    const Sample s = body.next();
    const bool pushed = k >= 800 && k < 1800, clipped = k >= 2300 && k < 2500 && k % 16 == 0;
    filter::Vector3 rate = s.rate, force = s.force, field = s.field;
    if (pushed) force(0) += 12.0F;
    if (clipped) rate(1) = 35.0F;
    if (k >= 1300) field *= 1.0F + 0.2F * static_cast<float>(k / 300 % 3);
    opaque(rate);
    opaque(force);
    opaque(field);
    const Region<struct ahrs9_upset> region;
    static_cast<void>(upset.step(rate, force, kStep_s));
    upset.magnetometer(field, kStep_s);
    q_nb = upset.q_nb();
    opaque(q_nb);
  }
  opaque(upset);
  // At rest the bias comes from the gyroscope itself.
  filter::Attitude resting;
  for (int k = 0; k < kWarmUp; ++k) {
    static_cast<void>(resting.step({0.001F, 0.002F, -0.001F}, {0.01F, -0.02F, 9.81F}, kStep_s));
    resting.magnetometer({3.0F, 17.0F, -46.0F}, kStep_s);
  }
  for (int k = 0; k < kSamples; ++k) {
    filter::Vector3 rate{0.001F, 0.002F, -0.001F}, force{0.01F, -0.02F, 9.81F}, field{3.0F, 17.0F, -46.0F};
    opaque(rate);
    opaque(force);
    opaque(field);
    const Region<struct ahrs9_rest> region;
    static_cast<void>(resting.step(rate, force, kStep_s));
    resting.magnetometer(field, kStep_s);
    q_nb = resting.q_nb();
    opaque(q_nb);
  }
  opaque(resting);
}

}  // namespace

int main() {
  static Board board;
  count::calibrate();
  complementary_one_axis();
  mahony();
  attitude();
  board.print("count: done\n");
  count::finish();
  return 0;
}
