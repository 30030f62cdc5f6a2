// SPDX-License-Identifier: Apache-2.0
// Laws of the particle filter: its numbers, its weights, its resampling, and the linear case, in which the Kalman
// filter is exact.
#include "tetap/filter/particle.hpp"
#include "tetap/filter/particle_number.hpp"

#include <gtest/gtest.h>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

namespace tetap::filter {
namespace {

constexpr base::PhiloxKey kKey{7, 11};

TEST(ParticleNoise, IsStandardNormal) {
  constexpr std::uint32_t kDraws = 1U << 18;
  std::vector<double> x;
  for (std::uint32_t i = 0; i < kDraws / 2; ++i)
    for (const float value : normals_of<2>(kKey, 3, i)) x.push_back(static_cast<double>(value));
  double mean = 0, second = 0, fourth = 0, tail = 0, beyond = 0;
  for (const double v : x) mean += v, second += v * v, fourth += v * v * v * v, tail += std::abs(v) > 3.4426 ? 1 : 0;
  const double n = kDraws;
  EXPECT_NEAR(mean / n, 0, 4 / std::sqrt(n));
  EXPECT_NEAR(second / n, 1, 4 * std::sqrt(2 / n));
  EXPECT_NEAR(fourth / n, 3, 4 * std::sqrt(96 / n));
  const double expected = n * std::erfc(3.4426 / std::sqrt(2.0));
  EXPECT_NEAR(tail, expected, 4 * std::sqrt(expected));
  for (const double v : x) beyond += std::abs(v) > 3.4426 ? (std::abs(v) - 3.4426) / tail : 0;
  const double inverse_mills = std::exp(-0.5 * 3.4426 * 3.4426) / std::sqrt(2 * M_PI) / (0.5 * expected / n);
  EXPECT_NEAR(beyond, inverse_mills - 3.4426, 4 * 0.26 / std::sqrt(tail));
  std::sort(x.begin(), x.end());
  double distance = 0;  // Kolmogorov-Smirnov; exceeded by chance in one of a thousand samples
  for (std::size_t i = 0; i < x.size(); ++i)
    distance =
        std::max(distance, std::abs(0.5 * std::erfc(-x[i] / std::sqrt(2.0)) - (static_cast<double>(i) + 0.5) / n));
  EXPECT_LT(distance, 1.95 / std::sqrt(n));
}

TEST(ParticleNoise, HasAnotherNumberForEveryKeyEpochAndParticle) {
  const auto one = normals_of<2>(kKey, 5, 40);
  EXPECT_EQ(one, (normals_of<2>(kKey, 5, 40)));
  EXPECT_NE(one, (normals_of<2>(kKey, 5, 41)));
  EXPECT_NE(one, (normals_of<2>(kKey, 6, 40)));
  EXPECT_NE(one, (normals_of<2>({7, 12}, 5, 40)));
  EXPECT_NE(draw_of(kKey, 5, 40, DrawFor::kStart).words, draw_of(kKey, 5, 40, DrawFor::kInjection).words);
}

/// A walk on the line.
struct Walk {
  static constexpr int kNormals = 2;
  float step = 0, sigma = 1;
  [[nodiscard]] bool valid() const { return base::abs(step) < 1e6F && sigma >= 0.0F && sigma < 1e6F; }
  [[nodiscard]] float sample(const float& x, const std::array<float, 2>& normal) const {
    return x + step + sigma * normal[0];
  }
};

TEST(Particles, MoveByTheNumbersOfTheirPlace) {
  static Particles<float, 101> cloud(kKey);
  cloud.fill(101, [](const Draw&) { return 0.0F; });
  ASSERT_TRUE(cloud.predict(Walk{}));
  for (std::uint32_t i = 0; i < 101; ++i) EXPECT_EQ(cloud[i], normals_of<2>(kKey, cloud.epoch(), i)[0]);
}

// --- Resampling

constexpr Resampling kSchemes[] = {Resampling::kSystematic, Resampling::kStratified, Resampling::kResidual,
                                   Resampling::kMultinomial};
const std::vector<std::uint32_t> kWeights{90'000, 1'000, 524'288, 0, 33'333, 250'000, 7, 400'001, 65'536, 120'000};

struct Copies {
  std::vector<double> mean, variance;
  double least_excess = 0, most_excess = 0;  ///< copies less their expectation
};
Copies sample_copies(Resampling scheme, std::uint32_t wanted, int runs) {
  const std::size_t n = kWeights.size();
  const std::uint32_t sum = sum_of_weights(kWeights);
  Copies result{std::vector<double>(n), std::vector<double>(n)};
  base::Random random(static_cast<std::uint64_t>(scheme) + 1);
  for (int run = 0; run < runs; ++run) {
    std::vector<std::uint32_t> weights = kWeights;
    std::vector<std::uint16_t> copies(n, 999);
    count_copies(scheme, weights, sum, wanted, random, copies);
    std::uint32_t total = 0;
    for (std::size_t i = 0; i < n; ++i) {
      total += copies[i];
      const double excess = copies[i] - static_cast<double>(wanted) * kWeights[i] / sum;
      result.mean[i] += excess / runs;
      result.variance[i] += excess * excess / runs;
      result.least_excess = std::min(result.least_excess, excess);
      result.most_excess = std::max(result.most_excess, excess);
    }
    EXPECT_EQ(total, wanted);
  }
  return result;
}

TEST(Resampling, ExpectsAsManyCopiesAsTheWeightSays) {
  constexpr int kRuns = 20'000;
  for (const Resampling scheme : kSchemes)
    for (const std::uint32_t wanted : {3U, 10U, 57U}) {
      const Copies copies = sample_copies(scheme, wanted, kRuns);
      for (std::size_t i = 0; i < kWeights.size(); ++i) {
        SCOPED_TRACE(testing::Message() << "scheme " << static_cast<int>(scheme) << " particle " << i);
        EXPECT_NEAR(copies.mean[i], 0, 5 * std::sqrt((copies.variance[i] + 1e-5) / kRuns) + 2e-5);
        if (kWeights[i] == 0) {
          EXPECT_EQ(copies.variance[i], 0);
        }
      }
    }
}

TEST(Resampling, KeepsTheBoundsOfItsScheme) {
  const Copies systematic = sample_copies(Resampling::kSystematic, 57, 5'000);
  EXPECT_GT(systematic.least_excess, -1);
  EXPECT_LT(systematic.most_excess, 1);
  const Copies stratified = sample_copies(Resampling::kStratified, 57, 5'000);
  EXPECT_GT(stratified.least_excess, -2);
  EXPECT_LT(stratified.most_excess, 2);
  EXPECT_GT(sample_copies(Resampling::kResidual, 57, 5'000).least_excess, -1);  // the whole part is sure
  EXPECT_LT(sample_copies(Resampling::kMultinomial, 57, 5'000).least_excess, -2);
}

TEST(Resampling, HasTheOrderOfVariancesOfDoucAndCappe) {
  std::map<Resampling, double> total;
  for (const Resampling scheme : kSchemes)
    for (const double v : sample_copies(scheme, 57, 10'000).variance) total[scheme] += v;
  EXPECT_LT(total[Resampling::kSystematic], total[Resampling::kStratified]);
  EXPECT_LT(total[Resampling::kStratified], total[Resampling::kMultinomial]);
  EXPECT_LT(total[Resampling::kResidual], total[Resampling::kMultinomial]);
  double multinomial = 0;  // N w (1 - w)
  const double sum = sum_of_weights(kWeights);
  for (const std::uint32_t w : kWeights) multinomial += 57 * w / sum * (1 - w / sum);
  EXPECT_NEAR(total[Resampling::kMultinomial], multinomial, 0.05 * multinomial);
}

TEST(Resampling, PlacesCopiesWhereTheDeadWere) {
  for (const std::size_t wanted : {4U, 7U, 12U}) {
    const std::vector<std::uint16_t> counted{0, 3, 0, 1, 0, 0, 0};
    std::vector<std::uint16_t> copies = counted;
    copies[6] = static_cast<std::uint16_t>(wanted - 4);
    const std::vector<std::uint16_t> expected = copies;
    std::vector<int> states{0, 1, 2, 3, 4, 5, 6};
    states.resize(std::max<std::size_t>(7, wanted));
    copies.resize(states.size());
    place_copies<int>(states, copies, wanted);
    EXPECT_EQ(states[1], 1);
    EXPECT_EQ(states[3], 3);
    for (int value = 0; value < 7; ++value)
      EXPECT_EQ(std::count(states.begin(), states.begin() + static_cast<std::ptrdiff_t>(wanted), value),
                expected[static_cast<std::size_t>(value)])
          << wanted << " wanted, state " << value;
  }
}

// --- Weights

using Cloud = Particles<float, 2000>;
double weight_sum(const Cloud& cloud) {
  double sum = 0;
  for (std::size_t i = 0; i < cloud.size(); ++i) sum += static_cast<double>(cloud.weight(i));
  return sum;
}

TEST(Particles, WeightsAreNormalisedLikelihoods) {
  static Cloud cloud(kKey);
  cloud.fill(100, [](const Draw& draw) { return draw.normal(0); });
  EXPECT_EQ(cloud.effective(), 100.0F);
  cloud.weigh([](float x) { return -50.0F * x * x - 3000.0F; });
  cloud.weigh([](float x) { return 50.0F * x * x - 0.5F * (x - 1.0F) * (x - 1.0F); });
  double sum = 0, squares = 0;
  for (std::size_t i = 0; i < 100; ++i) sum += std::exp(-0.5 * std::pow(static_cast<double>(cloud[i]) - 1, 2));
  for (std::size_t i = 0; i < 100; ++i) {
    const double expected = std::exp(-0.5 * std::pow(static_cast<double>(cloud[i]) - 1, 2)) / sum;
    EXPECT_NEAR(static_cast<double>(cloud.weight(i)), expected, 2e-5);
    squares += expected * expected;
  }
  EXPECT_NEAR(weight_sum(cloud), 1, 1e-5);
  EXPECT_NEAR(static_cast<double>(cloud.effective()), 1 / squares, 0.01 / squares);
  cloud.weigh([&](float x) { return base::bits(x) == base::bits(cloud[17]) ? 0.0F : -100.0F; });
  EXPECT_EQ(cloud.effective(), 1.0F);
  EXPECT_EQ(cloud.weight(17), 1.0F);
}

TEST(Particles, SumsHaveTheSameBitsInAnyOrder) {
  static Cloud forward(kKey), backward(kKey);
  forward.fill(999, [](const Draw& draw) { return draw.normal(0); });
  std::size_t next = 999;
  backward.fill(999, [&](const Draw&) { return forward[--next]; });
  for (Cloud* cloud : {&forward, &backward}) cloud->weigh([](float x) { return -0.7F * x * x; });
  EXPECT_EQ(forward.effective(), backward.effective());
  for (std::size_t i = 0; i < 999; ++i) EXPECT_EQ(forward.weight(i), backward.weight(998 - i));
}

TEST(Particles, NoLikelihoodMakesAWeightThatIsNoNumber) {
  const float hostile[] = {base::kNan, base::kInfinity, -base::kInfinity, std::numeric_limits<float>::max(),
                           -std::numeric_limits<float>::max()};
  static Cloud cloud;
  for (const float value : hostile)
    for (const bool all : {false, true}) {
      cloud = Cloud(kKey);
      cloud.fill(50, [](const Draw& draw) { return draw.normal(0); });
      for (int k = 0; k < 3; ++k) {
        cloud.weigh([&](float x) { return all || x > 0.0F ? value : -x * x; });
        EXPECT_NEAR(weight_sum(cloud), 1, 1e-4) << value << (all ? " for all" : " for some");
        EXPECT_GE(cloud.effective(), 0.99F);
      }
      cloud.resample(Resampling::kSystematic, 70);
      EXPECT_EQ(cloud.size(), 70U);
      for (const float x : cloud.states()) EXPECT_TRUE(base::is_finite(x));
    }
}

TEST(Particles, RefuseAMotionThatIsNotValid) {
  static Cloud cloud(kKey);
  cloud.fill(50, [](const Draw& draw) { return draw.normal(0); });
  const std::vector<float> before(cloud.states().begin(), cloud.states().end());
  for (const float bad : {base::kNan, base::kInfinity, -base::kInfinity, std::numeric_limits<float>::max()}) {
    EXPECT_FALSE(cloud.predict(Walk{.step = bad}));
    EXPECT_FALSE(cloud.predict(Walk{.sigma = bad}));
  }
  EXPECT_TRUE(std::equal(before.begin(), before.end(), cloud.states().begin()));
}

TEST(Particles, CapacityIsNeverExceeded) {
  static Particles<float, 64> cloud(kKey);
  for (const std::size_t count : {0U, 1U, 64U, 65U, 100'000U}) {
    cloud.fill(count, [](const Draw& draw) { return draw.normal(0); });
    EXPECT_EQ(cloud.size(), std::clamp<std::size_t>(count, 1, 64));
    cloud.weigh([](float x) { return x; });
    for (const Resampling scheme : kSchemes) {
      cloud.resample(scheme, count);
      EXPECT_EQ(cloud.size(), std::clamp<std::size_t>(count, 1, 64));
    }
  }
}

TEST(Particles, InjectTheirShare) {
  static Cloud cloud(kKey);
  cloud.fill(2000, [](const Draw&) { return 1.0F; });
  const std::size_t replaced = cloud.inject(0.2F, [](const Draw&) { return 2.0F; });
  EXPECT_EQ(std::count(cloud.states().begin(), cloud.states().end(), 2.0F), static_cast<std::ptrdiff_t>(replaced));
  EXPECT_NEAR(static_cast<double>(replaced), 400, 5 * std::sqrt(2000 * 0.2 * 0.8));
  EXPECT_EQ(cloud.inject(0.0F, [](const Draw&) { return 3.0F; }), 0U);
  EXPECT_EQ(cloud.inject(1.0F, [](const Draw&) { return 3.0F; }), 2000U);
}

TEST(Particles, ModeIsWhereMostWeightIs) {
  static Cloud cloud(kKey);
  cloud.fill(300,
             [](const Draw& draw) { return draw.uniform(1) < 0.4F ? 5.0F + 0.1F * draw.normal(0) : draw.normal(0); });
  const auto near = [](float a, float b) { return base::abs(a - b) < 0.3F; };
  EXPECT_NEAR(cloud[cloud.mode(40, near)], 5.0F, 0.4F);
  cloud.weigh([](float x) { return x > 3.0F ? -5.0F : 0.0F; });
  EXPECT_NEAR(cloud[cloud.mode(40, near)], 0.0F, 1.5F);
}

// --- The linear case: x+ = 0.9 x + w, w ~ N(0, 1); z = x + v, v ~ N(0, 0.25)

struct Autoregressive {
  static constexpr int kNormals = 1;
  [[nodiscard]] bool valid() const { return true; }
  [[nodiscard]] float sample(const float& x, const std::array<float, 1>& normal) const { return 0.9F * x + normal[0]; }
};
/// p(x+ | x, z), the proposal of least variance (Doucet, Godsill, Andrieu 2000, prop. 2).
struct Optimal {
  static constexpr int kNormals = 1;
  float z = 0;
  [[nodiscard]] bool valid() const { return true; }
  [[nodiscard]] Proposed<float> sample(const float& x, const std::array<float, 1>& normal) const {
    const float ahead = 0.9F * x, innovation = z - ahead;
    return {ahead + 0.8F * innovation + 0.4472136F * normal[0], -0.4F * innovation * innovation};
  }
};

TEST(Particles, AgreeWithTheKalmanFilterWhereThatIsExact) {
  static Cloud bootstrap(kKey), optimal({1, 2});
  for (Cloud* cloud : {&bootstrap, &optimal}) cloud->fill(2000, [](const Draw& draw) { return 2.0F * draw.normal(0); });
  base::Random random(4);
  double truth = 0, m = 0, p = 4, evidence = 0, exact = 0, effective[2] = {0, 0};
  const auto value = [](float x) { return x; };
  for (int k = 0; k < 60; ++k) {
    truth = 0.9 * truth + static_cast<double>(random.normal());
    const auto z = static_cast<float>(truth + 0.5 * static_cast<double>(random.normal()));
    m *= 0.9, p = 0.81 * p + 1;
    const double s = p + 0.25, innovation = static_cast<double>(z) - m;
    exact += -0.5 * innovation * innovation / s - 0.5 * std::log(s / 0.25);
    m += p / s * innovation, p *= 0.25 / s;
    bootstrap.predict(Autoregressive{});
    evidence += static_cast<double>(bootstrap.weigh([z](float x) { return -2.0F * (z - x) * (z - x); }));
    optimal.propose(Optimal{.z = z});
    Cloud* const clouds[] = {&bootstrap, &optimal};
    for (std::size_t i = 0; i < 2; ++i) {
      const double n = static_cast<double>(clouds[i]->effective());
      effective[i] += n / 60;
      const double mean = static_cast<double>(clouds[i]->mean(value));
      const double variance = static_cast<double>(
          clouds[i]->mean([mean](float x) { return (x - static_cast<float>(mean)) * (x - static_cast<float>(mean)); }));
      EXPECT_NEAR(mean, m, 6 * std::sqrt(p / n)) << k;
      EXPECT_NEAR(variance / p, 1, 8 * std::sqrt(2 / n)) << k;
      if (n < 1500) clouds[i]->resample(kSchemes[static_cast<std::size_t>(k) % 4], 2000);
    }
  }
  EXPECT_NEAR(evidence, exact, 1.5);
  EXPECT_GT(effective[1], 1.2 * effective[0]);  // least variance of the weights
}

// --- Number of particles

TEST(ParticleNumber, IsTheChiSquareQuantileOverTwiceTheError) {
  // 99 % quantiles of chi-square with 10, 50, 100 degrees (Abramowitz & Stegun, table 26.8).
  for (const auto& [degrees, quantile] : {std::pair{10, 23.209}, std::pair{50, 76.154}, std::pair{100, 135.807}})
    EXPECT_NEAR(static_cast<double>(particles_for(static_cast<std::size_t>(degrees) + 1, 0.01F, 2.3263F, 10, 100'000)),
                quantile / 0.02, 0.004 * quantile / 0.02);
}

TEST(ParticleNumber, StaysInsideItsLimits) {
  EXPECT_EQ(particles_for(0, 0.05F, 2.33F, 100, 1000), 100U);
  EXPECT_EQ(particles_for(1, 0.05F, 2.33F, 100, 1000), 100U);
  EXPECT_EQ(particles_for(5000, 0.05F, 2.33F, 100, 1000), 1000U);
  EXPECT_EQ(particles_for(50, 0.0F, 2.33F, 100, 1000), 1000U);
  EXPECT_EQ(particles_for(50, base::kNan, 2.33F, 100, 1000), 100U);
}

TEST(ParticleNumber, BinsAreCountedOnce) {
  BinSet<2048> bins;
  for (int round = 0; round < 3; ++round)
    for (std::int32_t x = -3; x < 3; ++x)
      for (std::int32_t yaw = 0; yaw < 8; ++yaw) bins.add(bins.bin(x, 2 * x, yaw));
  EXPECT_LE(bins.count(), 48U);
  EXPECT_GE(bins.count(), 45U);  // 48^2 / 4096 share a bit
  bins.clear();
  EXPECT_EQ(bins.count(), 0U);
}

}  // namespace
}  // namespace tetap::filter
