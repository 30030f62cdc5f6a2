// SPDX-License-Identifier: Apache-2.0
// The attitude filters' workloads: a body that tumbles at 100 Hz, so that nothing is at rest and every branch of the
// steady filter is taken; the start of a filter is over before the counting begins.
#include "filter/attitude.hpp"
#include "filter/complementary.hpp"
#include "filter/mahony.hpp"
#include "markers.hpp"

#if defined(TETAP_BOARD_ZYNQMP_R5)
#include "hal/port/zynqmp_r5/board.hpp"
using Board = tetap::hal::zynqmp_r5::Board;
#else
#include "hal/port/mps2/board.hpp"
using Board = tetap::hal::mps2::Board;
#endif

#include <array>

namespace {

using namespace tetap;
using count::opaque;
using count::Region;

constexpr std::size_t kSamples = 256;
constexpr float kStep_s = 0.01F;

struct Sample {
  filter::Vector3 rate, force, field;
};

/// What ideal sensors feel of a rotation whose axis wanders, less than a revolution per second, and of a jolting hand.
std::array<Sample, kSamples>& tumbling() {
  static std::array<Sample, kSamples> samples;
  filter::Quaternion q;
  for (std::size_t k = 0; k < kSamples; ++k) {
    const float t_s = kStep_s * static_cast<float>(k);
    const base::SinCos slow = base::sincos(1.3F * t_s), fast = base::sincos(5.1F * t_s);
    const filter::Vector3 rate{2.0F * slow.sin, 1.5F * slow.cos, 1.0F + 0.5F * fast.sin};
    q = filter::turned(q, (0.5F * kStep_s) * rate);
    const filter::Rows b(q.conjugate());
    samples[k] = {.rate = rate,
                  .force = b * filter::Vector3{3.0F * fast.cos, 2.0F * fast.sin, 9.81F + fast.cos},
                  .field = b * filter::Vector3{0.0F, 17.0F, -46.0F}};
  }
  return samples;
}

void complementary_one_axis(const std::array<Sample, kSamples>& samples) {
  filter::ComplementaryAngle roll(1.0F);
  for (const Sample& s : samples) {
    float measured_rad = base::atan2(s.force(1), s.force(2));
    opaque(measured_rad);
    const Region<struct complementary_angle> region;
    static_cast<void>(roll.step(s.rate(0), measured_rad, kStep_s));
  }
  opaque(roll);
}

void mahony(const std::array<Sample, kSamples>& samples) {
  filter::Mahony six;
  for (const Sample& s : samples) {
    const Region<struct w4_ahrs6> region;
    six.step(s.rate, s.force, kStep_s);
  }
  opaque(six);
  filter::Mahony nine;
  for (const Sample& s : samples) {
    const Region<struct w4_ahrs9> region;
    nine.step(s.rate, s.force, s.field, kStep_s);
  }
  opaque(nine);
}

void attitude(const std::array<Sample, kSamples>& samples) {
  static filter::Attitude six, nine;
  const auto warm_up = [&samples](filter::Attitude& filter, bool magnetometer) {
    for (int round = 0; round < 6; ++round)
      for (const Sample& s : samples) {
        static_cast<void>(filter.step(s.rate, s.force, kStep_s));
        if (magnetometer) filter.magnetometer(s.field, kStep_s);
      }
  };
  warm_up(six, false);
  for (const Sample& s : samples) {
    const Region<struct ahrs6> region;
    static_cast<void>(six.step(s.rate, s.force, kStep_s));
  }
  opaque(six);
  warm_up(nine, true);
  filter::Quaternion q_nb;
  for (const Sample& s : samples) {
    const Region<struct ahrs9> region;
    static_cast<void>(nine.step(s.rate, s.force, kStep_s));
    nine.magnetometer(s.field, kStep_s);
    q_nb = nine.q_nb();
    opaque(q_nb);
  }
  opaque(nine);
  // Whatever goes wrong: a long push sideways, a field that is not the Earth's, a start and a gyroscope that clips.
  filter::Attitude upset;
  int sample = 0;
  for (int round = 0; round < 12; ++round)
    for (const Sample& s : samples) {
      const bool pushed = round >= 3 && round < 7, clipped = round == 9 && sample % 16 == 0;
      filter::Vector3 rate = s.rate, force = s.force, field = s.field;
      if (pushed) force(0) += 12.0F;
      if (clipped) rate(1) = 35.0F;
      if (round >= 5) field *= 1.0F + 0.2F * static_cast<float>(sample / 300 % 3);
      opaque(rate);
      opaque(force);
      opaque(field);
      ++sample;
      const Region<struct ahrs9_upset> region;
      static_cast<void>(upset.step(rate, force, kStep_s));
      upset.magnetometer(field, kStep_s);
      q_nb = upset.q_nb();
      opaque(q_nb);
    }
  opaque(upset);
  // At rest the bias comes from the gyroscope itself.
  for (int k = 0; k < 400; ++k) static_cast<void>(nine.step(filter::Vector3::Zero(), {0.0F, 0.0F, 9.81F}, kStep_s));
  for (std::size_t k = 0; k < kSamples; ++k) {
    filter::Vector3 rate{0.001F, 0.002F, -0.001F}, force{0.01F, -0.02F, 9.81F}, field{3.0F, 17.0F, -46.0F};
    opaque(rate);
    opaque(force);
    opaque(field);
    const Region<struct ahrs9_rest> region;
    static_cast<void>(nine.step(rate, force, kStep_s));
    nine.magnetometer(field, kStep_s);
    q_nb = nine.q_nb();
    opaque(q_nb);
  }
  opaque(nine);
}

}  // namespace

int main() {
  static Board board;
  count::calibrate();
  const std::array<Sample, kSamples>& samples = tumbling();
  complementary_one_axis(samples);
  mahony(samples);
  attitude(samples);
  board.print("count: done\n");
  count::finish();
  return 0;
}
