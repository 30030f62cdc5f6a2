// SPDX-License-Identifier: Apache-2.0
#include "nav/preintegration.hpp"

#include "nav/imu_gather.hpp"
#include "true_body.hpp"

#include <gtest/gtest.h>
#include <vector>

namespace tetap {
namespace {

using nav::Earth;
using nav::ImuChunk;
using nav::ImuIncrement;
using nav::InsState;

std::vector<ImuIncrement> wild_samples(int count, unsigned seed) {
  test::Normal normal(seed);
  std::vector<ImuIncrement> all;
  for (int i = 0; i < count; ++i) {
    const auto dt_us = static_cast<std::int64_t>(4000 + 200 * (i % 11));
    all.push_back(ImuIncrement::constant((2.0 * normal.vector()).cast<float>(),
                                         (Eigen::Vector3d(0, 0, 9.8) + 3.0 * normal.vector()).cast<float>(), {dt_us}));
  }
  return all;
}

InsState begin() {
  InsState x{.x = test::anchored(50'000.2), .y = test::anchored(-17.0), .z = test::anchored(3.0)};
  x.v_n_mps = {4, -3, 0.5F};
  x.q_nb = nav::from_euler({.yaw_rad = 2, .pitch_rad = 0.2F, .roll_rad = -0.1F});
  x.b_a_mps2 = {0.05F, -0.1F, 0.02F};
  x.b_g_radps = {0.01F, -0.004F, 0.02F};
  return x;
}

void expect_near(const InsState& a, const InsState& b, float p_m, float v_mps, float angle_rad) {
  const auto d = a.minus(b);
  EXPECT_LT(d.head<3>().norm(), p_m);
  EXPECT_LT(d.segment<3>(3).norm(), v_mps);
  EXPECT_LT(d.segment<3>(6).norm(), angle_rad);
}

ImuChunk folded(const std::vector<ImuIncrement>& samples, std::size_t from, std::size_t to, const InsState& biases) {
  ImuChunk chunk = ImuChunk::with_biases_of(biases);
  for (std::size_t i = from; i < to; ++i) chunk.add(samples[i]);
  return chunk;
}

TEST(Preintegration, GivesWhatSampleBySampleStrapdownGives) {
  const auto samples = wild_samples(100, 3);  // half a second
  for (const bool rotating : {false, true}) {
    const Earth earth = Earth::at(nav::LocalFrame(static_cast<std::int64_t>(48 * 5e8), 0, 0.0F), rotating);
    InsState x = begin();
    for (const auto& sample : samples) nav::strapdown(x, sample, earth);
    const InsState by_chunk = folded(samples, 0, samples.size(), begin()).apply(begin(), earth);
    expect_near(by_chunk, x, 1e-5F, 2e-5F, 4e-6F);
  }
}

TEST(Preintegration, ChunksJoinAssociatively) {
  const auto samples = wild_samples(120, 4);
  const ImuChunk a = folded(samples, 0, 50, begin()), b = folded(samples, 50, 70, begin()),
                 c = folded(samples, 70, 120, begin());
  const ImuChunk left = a.then(b).then(c), right = a.then(b.then(c)), whole = folded(samples, 0, 120, begin());
  EXPECT_EQ(left.dt, right.dt);
  EXPECT_EQ(left.dt, whole.dt);
  const Earth earth;
  for (const ImuChunk& other : {right, whole}) {
    expect_near(left.apply(begin(), earth), other.apply(begin(), earth), 3e-6F, 1e-5F, 2e-6F);
    EXPECT_LT((left.r_dt - other.r_dt).norm(), 1e-6F);
  }
  // An empty chunk on either side changes nothing.
  const ImuChunk none = ImuChunk::with_biases_of(begin());
  expect_near(none.then(a).apply(begin(), earth), a.apply(begin(), earth), 1e-6F, 1e-6F, 1e-6F);
  expect_near(a.then(none).apply(begin(), earth), a.apply(begin(), earth), 1e-6F, 1e-6F, 1e-6F);
  expect_near(none.apply(begin(), earth), begin(), 1e-7F, 1e-7F, 1e-7F);
}

TEST(Preintegration, AFewChunksInTurnGiveTheCurrentState) {
  const auto samples = wild_samples(100, 8);
  const Earth earth;
  InsState x = begin(), chunked = begin();
  for (const auto& sample : samples) nav::strapdown(x, sample, earth);
  for (std::size_t k = 0; k < 5; ++k) chunked = folded(samples, 20 * k, 20 * (k + 1), begin()).apply(chunked, earth);
  expect_near(chunked, x, 3e-6F, 1e-5F, 2e-6F);
}

/// Two-speed: gathered spans into a chunk, against every sample into it.
TEST(Preintegration, GatheredSpansGiveWhatTheirSamplesGive) {
  const auto samples = wild_samples(100, 5);
  nav::ImuGather gather;
  ImuChunk fast = ImuChunk::with_biases_of(begin());
  int spans = 0;
  for (const auto& sample : samples) {
    gather.add(sample);
    if (!gather.full()) continue;
    fast.add(gather.take());
    EXPECT_TRUE(gather.empty());
    ++spans;
  }
  if (!gather.empty()) fast.add(gather.take());
  const ImuChunk whole = folded(samples, 0, samples.size(), begin());
  EXPECT_EQ(fast.dt, whole.dt);
  EXPECT_LT(spans, 20);                                                                 // of 100 samples
  expect_near(fast.apply(begin(), {}), whole.apply(begin(), {}), 5e-3F, 4e-4F, 1e-4F);  // half a second of tumbling
  // Without the cross terms it would not be: the plain sums of the same spans.
  ImuChunk plain = ImuChunk::with_biases_of(begin());
  for (std::size_t k = 0; k < samples.size(); k += 10) {
    ImuIncrement sum;
    for (std::size_t i = k; i < k + 10; ++i) {
      sum.dtheta_b_rad += samples[i].dtheta_b_rad;
      sum.dv_b_mps += samples[i].dv_b_mps;
      sum.dt += samples[i].dt;
    }
    plain.add(sum);
  }
  const auto off = plain.apply(begin(), {}).minus(whole.apply(begin(), {}));
  EXPECT_GT(off.segment<3>(3).norm(), 2e-3F);
  EXPECT_GT(off.segment<3>(6).norm(), 2e-4F);
}

TEST(Preintegration, ASpanIsFullAtItsTimeOrItsAngle) {
  const auto steps_until_full = [](float rate_radps) {
    nav::ImuGather gather;
    int steps = 0;
    while (!gather.full()) {
      gather.add(ImuIncrement::constant({0, 0, rate_radps}, {0, 0, 9.8F}, {1'000}));
      ++steps;
    }
    return steps;
  };
  EXPECT_EQ(steps_until_full(1), 50);
  EXPECT_EQ(steps_until_full(-30), 7);
  EXPECT_EQ(steps_until_full(300), 1);
}

/// A robot's motion, biases corrected after the chunk was made: what is left is of second order.
TEST(Preintegration, BiasesThatChangedSinceCountToFirstOrder) {
  std::vector<ImuIncrement> samples;
  for (int i = 0; i < 100; ++i)
    samples.push_back(ImuIncrement::constant({0.05F, -0.1F, 0.8F}, {0.7F, 1.5F, 9.8F}, {5'000}));
  const Earth earth;
  InsState later = begin();
  later.b_a_mps2 += nav::Vector3{0.02F, -0.03F, 0.01F};
  later.b_g_radps += nav::Vector3{-0.002F, 0.001F, 0.003F};
  InsState x = later;
  for (const auto& sample : samples) nav::strapdown(x, sample, earth);
  const ImuChunk chunk = folded(samples, 0, samples.size(), begin());
  ImuChunk uncorrected = chunk;
  uncorrected.b_a_mps2 = later.b_a_mps2;
  uncorrected.b_g_radps = later.b_g_radps;
  const auto error = [&](const ImuChunk& c) { return c.apply(later, earth).minus(x); };
  for (const int group : {0, 3, 6}) {
    const float without = error(uncorrected).segment<3>(group).norm(), with = error(chunk).segment<3>(group).norm();
    EXPECT_LT(with, 0.1F * without) << group;
  }
}

}  // namespace
}  // namespace tetap
