// SPDX-License-Identifier: Apache-2.0
// Instructions of filters on two small textbook workloads, with inputs made beforehand. W1 is constant velocity in the
// plane with a position. W2 and W3 are a unicycle of one Euler step with range and bearing to a landmark at (60, 20).
#include "board.hpp"
#include "markers.hpp"
#include "support/structured_models.hpp"
#include "tetap/base/random.hpp"
#include "tetap/filter/kalman.hpp"
#include "tetap/filter/structured_kalman.hpp"
#include "tetap/filter/ukf.hpp"
#include "tetap/filter/ukf_sqrt.hpp"

#include <array>

namespace {

using namespace tetap;
using count::opaque;
using count::Region;

constexpr std::size_t kSteps = 256;
using Pose = filter::VectorState<float, 3>;

struct PlanarInput {
  test::EulerUnicycle<float> motion;
  test::EulerSight<float> sight;
};

/// 1 m/s, a yaw rate of 0.3 cos(0.05 k) rad/s, steps of 0.1 s.
std::array<PlanarInput, kSteps>& planar_inputs() {
  static std::array<PlanarInput, kSteps> inputs;
  base::Random random(1);
  Pose truth;
  for (std::size_t k = 0; k < kSteps; ++k) {
    PlanarInput& input = inputs[k];
    input.motion = {
        .ds_m = 0.1F, .dyaw_rad = 0.03F * base::cos(0.05F * static_cast<float>(k)), .variance = {1e-3F, 1e-3F, 1e-4F}};
    truth = input.motion.predict(truth);
    const filter::Vector<float, 2> z = input.sight.predict(truth);
    input.sight.range_m = z(0) + 0.1F * random.normal();
    input.sight.bearing_rad = z(1) + 0.02F * random.normal();
    input.sight.variance = {0.01F, 4e-4F};
  }
  return inputs;
}

void unscented(std::array<PlanarInput, kSteps>& inputs) {
  filter::Ukf<Pose> ukf;
  ukf.p = filter::Symmetric<float, 3>::diagonal({0.1F, 0.1F, 0.05F});
  for (const PlanarInput& input : inputs) {
    const Region<struct w3_ukf> region;
    ukf.predict(input.motion);
    static_cast<void>(ukf.update(input.sight, filter::chi_square_99(2)));
  }
  opaque(ukf);
  filter::UkfSqrt<Pose> root;
  root.set_covariance(filter::Symmetric<float, 3>::diagonal({0.1F, 0.1F, 0.05F}));
  for (const PlanarInput& input : inputs) {
    const Region<struct w3_ukf_sqrt> region;
    root.predict(input.motion);
    static_cast<void>(root.update(input.sight, filter::chi_square_99(2)));
  }
  opaque(root);
}

template <class Name, filter::Guard kGuard, class Gate>
void constant_velocity(const std::array<filter::Vector<float, 2>, kSteps>& z, const Gate& gate) {
  filter::StructuredKalman<filter::VectorState<float, 4>, kGuard> kf;
  kf.p = filter::Symmetric<float, 4>::diagonal({10, 10, 10, 10});
  for (const auto& position : z) {
    const Region<Name> region;
    kf.predict(test::StructuredVelocity{.dt_s = 0.1F, .acceleration_variance = 0.1F});
    kf.update(filter::DirectMeasurement<float, 4, 0, 2>{.z = position, .variance = {0.25F, 0.25F}}, gate);
  }
  opaque(kf);
}

/// Nothing asked for; a gate; a gate and guards.
void linear() {
  static std::array<filter::Vector<float, 2>, kSteps> z;
  base::Random random(2);
  for (std::size_t k = 0; k < kSteps; ++k) {
    const float t_s = 0.1F * static_cast<float>(k);
    z[k] = {t_s + 0.5F * random.normal(), 0.5F * t_s + 0.5F * random.normal()};
  }
  constant_velocity<struct w1_kf_plain, filter::Guard::kNone>(z, filter::NoGate{});
  constant_velocity<struct w1_kf_gate, filter::Guard::kNone>(z, filter::chi_square_99(2));
  constant_velocity<struct w1_kf, filter::Guard::kVariances>(z, filter::chi_square_99(2));
}

void extended(const std::array<PlanarInput, kSteps>& inputs) {
  filter::StructuredKalman<Pose, filter::Guard::kNone> ekf;
  ekf.p = filter::Symmetric<float, 3>::diagonal({0.1F, 0.1F, 0.05F});
  for (const PlanarInput& input : inputs) {
    const Region<struct w2_textbook> region;
    ekf.predict(test::StructuredUnicycle{input.motion});
    ekf.update(test::StructuredSight{input.sight}, filter::NoGate{});
  }
  opaque(ekf);
}

}  // namespace

int main() {
  static Board board;
  count::calibrate();
  std::array<PlanarInput, kSteps>& inputs = planar_inputs();
  linear();
  extended(inputs);
  unscented(inputs);
  board.print("count: done\n");
  count::finish();
  return 0;
}
