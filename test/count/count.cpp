// SPDX-License-Identifier: Apache-2.0
// The workloads whose instructions tools/proof/count_instructions counts and tools/budgets.json bounds. Inputs are
// arrays made beforehand; what is between the markers are calls of headers that the firmware is made of.
#include "board.hpp"
#include "config/rover.hpp"
#include "markers.hpp"
#include "recorded_world.hpp"
#include "tetap/base/random.hpp"
#include "tetap/filter/kalman.hpp"
#include "tetap/filter/structured_kalman.hpp"
#include "tetap/model/constant_velocity.hpp"
#include "tetap/model/gnss_fix_3d.hpp"
#include "tetap/model/gnss_velocity_3d.hpp"
#include "tetap/model/range_bearing.hpp"
#include "tetap/model/wheel_speed.hpp"
#include "tetap/nav/ins.hpp"
#include "tetap/node/node.hpp"

#include <array>

namespace {

using namespace tetap;
using count::opaque;
using count::Region;

constexpr std::size_t kSteps = 256;

/// Roughly normal, standard deviation 1: four uniform numbers of a linear congruential generator (Knuth, TAOCP 2,
/// sec. 3.3.4).
class Noise {
 public:
  float operator()() {
    float sum = -2.0F;
    for (int i = 0; i < 4; ++i) sum += uniform();
    return sum * 1.7320508F;
  }
  float uniform() {
    state_ = state_ * 1'664'525U + 1'013'904'223U;
    return static_cast<float>(static_cast<std::int32_t>(state_ >> 8)) * 0x1p-24F;
  }

 private:
  std::uint32_t state_ = 1;
};

/// Constant velocity, 4 states, 2 measured: one prediction and one gated update.
void constant_velocity() {
  static std::array<filter::Vector<float, 2>, kSteps> z;
  Noise noise;
  for (std::size_t k = 0; k < kSteps; ++k) {
    const float t_s = 0.1F * static_cast<float>(k);
    z[k] = {t_s + 0.5F * noise(), 0.5F * t_s + 0.5F * noise()};
  }
  filter::Kalman<float, 4> kf;
  kf.p = filter::Symmetric<float, 4>::diagonal({10, 10, 10, 10});
  for (const auto& position : z) {
    const Region<struct w1_kf_conditioned> region;
    kf.predict(model::ConstantVelocity<float>{.dt_s = 0.1F, .acceleration_variance = 0.1F});
    static_cast<void>(kf.update(filter::DirectMeasurement<float, 4, 0, 2>{.z = position, .variance = {0.25F, 0.25F}},
                                filter::chi_square_99(2)));
  }
  opaque(kf);
}

/// Unicycle and range-bearing to one landmark: one prediction and one gated update; then the update alone.
void planar() {
  struct Input {
    float yaw_rate_radps, range_m, bearing_rad;
  };
  static std::array<Input, kSteps> inputs;
  const model::UnicycleNoise process{.speed = 0.01F, .yaw_rate = 0.001F};
  const model::Landmark landmark{.x = base::Anchored{}.plus(60.0F), .y = base::Anchored{}.plus(20.0F)};
  Noise noise;
  model::PlanarPose truth;
  for (std::size_t k = 0; k < kSteps; ++k) {
    const float rate = 0.3F * base::cos(0.05F * static_cast<float>(k));
    truth =
        model::Unicycle{.forward_mps = 1.0F, .yaw_rate_radps = rate, .noise = process}.increment(0.1F).predict(truth);
    const model::Sight sight(truth, landmark, {});
    inputs[k] = {.yaw_rate_radps = rate,
                 .range_m = sight.range_m() + 0.1F * noise(),
                 .bearing_rad = sight.bearing_rad(truth, {}) + 0.02F * noise()};
  }
  const auto seen = [&](const Input& input) {
    return model::RangeBearing{.range_m = input.range_m,
                               .bearing_rad = input.bearing_rad,
                               .sigma_range_m = 0.1F,
                               .sigma_bearing_rad = 0.02F,
                               .landmark = landmark};
  };
  filter::StructuredKalman<model::PlanarPose, filter::Guard::kConditioned> ekf;
  ekf.p = filter::Symmetric<float, 3>::diagonal({0.1F, 0.1F, 0.05F});
  for (const Input& input : inputs) {
    const Region<struct w2_ekf> region;
    ekf.predict(
        model::Unicycle{.forward_mps = 1.0F, .yaw_rate_radps = input.yaw_rate_radps, .noise = process}.increment(0.1F));
    static_cast<void>(ekf.update(seen(input), filter::chi_square_99(2)));
  }
  opaque(ekf);
  ekf = {};
  ekf.p = filter::Symmetric<float, 3>::diagonal({0.1F, 0.1F, 0.05F});
  for (const Input& input : inputs) {
    ekf.predict(
        model::Unicycle{.forward_mps = 1.0F, .yaw_rate_radps = input.yaw_rate_radps, .noise = process}.increment(0.1F));
    const model::RangeBearing measurement = seen(input);
    const Region<struct fuse_range_bearing> region;
    static_cast<void>(ekf.update(measurement, filter::chi_square_99(2)));
  }
  opaque(ekf);
}

/// Odometry: counts and a gyroscope, as the rover has them.
void dead_reckoning() {
  static std::array<sensor::WheelCounts, kSteps> counts;
  static std::array<sensor::ImuSample, kSteps> imu;
  Noise noise;
  sensor::WheelCounts now;
  for (std::size_t k = 0; k < kSteps; ++k) {
    now.left = static_cast<std::uint16_t>(now.left + 32 + static_cast<std::int32_t>(4.0F * noise.uniform()));
    now.right = static_cast<std::uint16_t>(now.right + 33 + static_cast<std::int32_t>(4.0F * noise.uniform()));
    counts[k] = now;
    imu[k] = {.dangle_b_rad = {0.0F, 0.0F, 0.003F + 1e-4F * noise()}, .interval_us = 10'000};
  }
  param::Parameters by_wheels = robot::rover::parameters;
  by_wheels.gyro.use = 0;
  estimators::DeadReckoning motion;
  motion.start({1'000'000}, {}, 0.1F, 0.05F);
  for (std::size_t k = 0; k < kSteps; ++k) {
    const Region<struct dead_reckoning_counts> region;
    motion.fuse(counts[k], {1'010'000 + 10'000 * static_cast<std::int64_t>(k)}, by_wheels);
  }
  opaque(motion);
  motion = {};
  motion.start({1'000'000}, {}, 0.1F, 0.05F);
  for (std::size_t k = 0; k < kSteps; ++k) {
    const base::Micros stamp{1'010'000 + 10'000 * static_cast<std::int64_t>(k)};
    motion.fuse(counts[k], stamp, robot::rover::parameters);
    const Region<struct dead_reckoning_gyro> region;
    motion.fuse(imu[k], stamp + base::Micros{5'000}, robot::rover::parameters);
  }
  opaque(motion);
}

/// Inertial navigation at 100 Hz: strapdown, covariance, three velocities and three positions every step, each three
/// with its joint gate. The rover speeds up, brakes and turns. The parts one by one follow, with a lever arm.
void inertial() {
  struct Input {
    nav::ImuIncrement imu;
    model::GnssVelocity3d velocity;
    model::GnssFix3d fix;
  };
  static std::array<Input, kSteps> inputs;
  Noise noise;
  nav::InsState truth;
  const nav::Earth earth;
  const auto noisy = [&noise](float sigma) { return nav::Vector3{sigma * noise(), sigma * noise(), sigma * noise()}; };
  for (std::size_t k = 0; k < kSteps; ++k) {
    const float t_s = 0.01F * static_cast<float>(k);
    const nav::Vector3 w_b_radps{0.0F, 0.0F, 0.5F * base::sin(2.0F * t_s)};
    const nav::Vector3 f_b_mps2{base::cos(t_s), w_b_radps(2) * truth.v_n_mps.norm(), earth.gravity_mps2};
    const base::Micros dt{10'000};
    nav::strapdown(truth, nav::ImuIncrement::constant(w_b_radps, f_b_mps2, dt), earth);
    Input& input = inputs[k];
    input.imu = nav::ImuIncrement::constant(w_b_radps + noisy(0.015F), f_b_mps2 + noisy(0.35F), dt);
    input.velocity = {.v_n_mps = truth.v_n_mps + noisy(0.3F), .sigma_horizontal_mps = 0.3F, .sigma_vertical_mps = 0.3F};
    const nav::Vector3 error_m = noisy(0.5F);
    input.fix = {.x = truth.x.plus(error_m(0)),
                 .y = truth.y.plus(error_m(1)),
                 .z = truth.z.plus(error_m(2)),
                 .sigma_horizontal_m = 0.5F,
                 .sigma_vertical_m = 0.5F};
  }
  const auto begin = [] {
    nav::Ins ins;
    ins.noise = {.gyro_radps_rthz = 0.0015F, .accel_mps2_rthz = 0.035F};
    ins.start({}, nav::Ins::Covariance::diagonal(
                      {1, 1, 1, 0.1F, 0.1F, 0.1F, 0.01F, 0.01F, 0.1F, 0.01F, 0.01F, 0.01F, 1e-5F, 1e-5F, 1e-5F}));
    return ins;
  };
  const float gate = filter::chi_square_99(3);
  static nav::Ins ins;
  ins = begin();
  for (const Input& input : inputs) {
    const Region<struct w5_ins> region;
    static_cast<void>(ins.predict(input.imu));
    ins.predict_covariance();
    static_cast<void>(ins.update(input.velocity, gate));
    static_cast<void>(ins.update(input.fix, gate));
  }
  opaque(ins);
  ins = begin();
  for (Input& input : inputs) {
    input.fix.antenna_b_m = input.velocity.antenna_b_m = {0.3F, -0.1F, 0.8F};
    input.velocity.gyro_b_radps = {0.0F, 0.01F, 0.3F};
    {
      const Region<struct ins_strapdown> region;
      static_cast<void>(ins.predict(input.imu));
    }
    {
      const Region<struct ins_covariance> region;
      ins.predict_covariance();
    }
    {
      const Region<struct ins_velocity> region;
      static_cast<void>(ins.update(input.velocity, 1e9F));
    }
    {
      const Region<struct ins_fix> region;
      static_cast<void>(ins.update(input.fix, 1e9F));
    }
    {
      const Region<struct ins_wheels> region;
      static_cast<void>(ins.update(model::WheelSpeed{.forward_mps = 1.0F,
                                                     .sigma_forward_mps = 0.1F,
                                                     .sigma_lateral_mps = 0.1F,
                                                     .sigma_vertical_mps = 0.1F,
                                                     .axle_b_m = {-0.2F, 0.0F, 0.0F},
                                                     .gyro_b_radps = input.velocity.gyro_b_radps},
                                   1e9F));
    }
  }
  opaque(ins);
}

/// One call each, arguments as filters have them.
void functions() {
  static std::array<float, kSteps> angle, first, second;
  Noise noise;
  for (std::size_t k = 0; k < kSteps; ++k) {
    angle[k] = 100.0F * noise();
    first[k] = 10.0F * noise();
    second[k] = 10.0F * noise();
  }
  for (std::size_t k = 0; k < kSteps; ++k) {
    float x = angle[k], y = first[k], z = second[k];
    {
      const Region<struct sincos> region;
      base::SinCos both = base::sincos(x);
      opaque(both);
    }
    {
      const Region<struct atan2> region;
      float result = base::atan2(y, z);
      opaque(result);
    }
    {
      const Region<struct exp> region;
      float result = base::exp(y);
      opaque(result);
    }
    float positive = base::abs(y) + 1e-6F;
    opaque(positive);
    {
      const Region<struct log> region;
      float result = base::log(positive);
      opaque(result);
    }
    base::PhiloxCounter counter{static_cast<std::uint32_t>(k), 0, 1, 2};
    base::PhiloxKey key{3, 4};
    opaque(counter);
    opaque(key);
    {
      const Region<struct philox> region;
      counter = base::philox(counter, key);
      opaque(counter);
    }
  }
}

/// The rover's node on 20 s of the simulated world: the tick, one input frame, and both together.
void whole_node() {
  static node::Node<robot::rover::Estimators> node{robot::rover::parameters, {}};
  const std::uint32_t can_base = robot::rover::parameters.can_base;
  node.power_on({bits::kRecordedBegin_us});
  base::CanFrame last;
  const bits::RecordedFrame* next = bits::kRecordedFrames;
  for (const bits::RecordedTick& tick : bits::kRecordedTicks) {
    static std::array<base::CanFrame, bits::kRecordedMostFrames> inputs;
    for (std::uint32_t i = 0; i < tick.frames; ++i) inputs[i] = (next++)->frame(can_base);
    const Region<struct node_epoch> epoch;
    for (std::uint32_t i = 0; i < tick.frames; ++i) {
      const Region<struct node_frame> region;
      node.on_frame(inputs[i]);
    }
    const Region<struct node_tick> region;
    node.tick({tick.time_us}, {}, [&](const base::CanFrame& frame) { last = frame; });
  }
  opaque(last);
}

}  // namespace

int main() {
  static Board board;
  count::calibrate();
  constant_velocity();
  planar();
  inertial();
  dead_reckoning();
  functions();
  whole_node();
  board.print("count: done\n");
  count::finish();
  return 0;
}
