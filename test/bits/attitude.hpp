// SPDX-License-Identifier: Apache-2.0
// The attitude filters on made-up motion, rest, pushes, magnets, clipped and broken samples; raw bits hashed per step.
#pragma once

#include "filters.hpp"
#include "tetap/base/selfcheck.hpp"
#include "tetap/filter/attitude.hpp"
#include "tetap/filter/complementary.hpp"
#include "tetap/filter/mahony.hpp"

#include <cstdint>

namespace tetap::bits {

inline void hash_quaternion(base::WordHash& hash, const filter::Quaternion& q) {
  hash(q.w);
  hash(q.x);
  hash(q.y);
  hash(q.z);
}
[[nodiscard]] inline filter::Vector3 around(Chance& chance, const filter::Vector3& mean, float sigma) {
  const std::array<float, 3> noise{chance.noise(sigma), chance.noise(sigma), chance.noise(sigma)};
  return {mean(0) + noise[0], mean(1) + noise[1], mean(2) + noise[2]};
}

[[nodiscard]] inline std::uint32_t attitude(std::uint32_t steps) {
  base::WordHash hash;
  Chance chance{.random = base::Random{1, 6}};
  filter::Attitude complementary;
  filter::Mahony mahony;
  filter::ComplementaryAngle heading(5.0F);
  filter::Quaternion truth;
  filter::Vector3 rate = filter::Vector3::Zero();
  filter::Vector3 push = filter::Vector3::Zero();
  float magnet = 1.0F;
  for (std::uint32_t k = 0; k < steps; ++k) {
    const float dt_s = 0.01F + 0.005F * chance.spread();
    if (chance.one_in(5'000)) complementary = filter::Attitude{};
    if (chance.one_in(200)) rate = around(chance, filter::Vector3::Zero(), chance.one_in(3) ? 0.0F : 1.0F);
    if (chance.one_in(100)) push = around(chance, filter::Vector3::Zero(), chance.one_in(2) ? 0.0F : 1.0F);
    if (chance.one_in(300)) magnet = chance.one_in(3) ? 1.0F : 1.0F + 0.5F * chance.spread();
    truth = filter::turned(truth, (0.5F * dt_s) * rate);
    const filter::Rows b(truth.conjugate());
    filter::Vector3 w = around(chance, rate, 0.001F);
    const filter::Vector3 f = around(chance, b * (filter::Vector3{0.0F, 0.0F, 9.81F} + push), 0.03F);
    const filter::Vector3 m = around(chance, b * filter::Vector3{3.0F, 17.0F * magnet, -46.0F}, 0.3F);
    if (chance.one_in(500)) w(0) = chance.one_in(2) ? 40.0F : base::kNan;
    hash(static_cast<std::uint32_t>(complementary.step(w, f, dt_s)));
    hash(static_cast<std::uint32_t>(complementary.magnetometer(m, dt_s)));
    mahony.step(w, f, m, dt_s);
    const bool accepted = heading.step(w(2), base::atan2(m(0), m(1)), dt_s);
    hash(static_cast<std::uint32_t>(accepted));
    hash_quaternion(hash, complementary.q_nb());
    hash_vector<3>(hash, complementary.bias_b_radps());
    hash(complementary.bias_sigma_radps());
    hash_quaternion(hash, mahony.q_nb());
    hash_vector<3>(hash, mahony.bias_b_radps());
    hash(heading.angle_rad());
  }
  return hash.value();
}

}  // namespace tetap::bits
