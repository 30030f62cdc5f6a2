// SPDX-License-Identifier: Apache-2.0
// FastSLAM: parts against the Kalman filter, both versions in a simulated world, repeatability, full and hostile.
#include "tetap/slam/fast_slam.hpp"
#include "landmark_world.hpp"
#include "support/never_nan.hpp"

#include <gtest/gtest.h>
#include <cmath>
#include <vector>

namespace tetap::slam {
namespace {

using World = test::LandmarkWorld;
double d(float v) { return static_cast<double>(v); }

TEST(FastSlam, SharedMotionIsTheMotionOfEachParticle) {
  SharedMotion shared;
  for (const PlanarOffset start : {PlanarOffset{}, PlanarOffset{.x_m = 3, .y_m = -2, .yaw_rad = 2.4F}}) {
    shared = {};
    model::PlanarPose pose{
        .x = base::Anchored{}.plus(start.x_m), .y = base::Anchored{}.plus(start.y_m), .yaw_rad = start.yaw_rad};
    filter::Symmetric<float, 3> p;
    for (int k = 0; k < 50; ++k) {
      const model::PlanarIncrement step{.ds_m = 0.1F, .dyaw_rad = 0.03F, .var_ds = 1e-3F, .var_dyaw = 1e-3F};
      ASSERT_TRUE(shared.add(step));
      const auto own = step.step(pose);
      p = filter::propagate(p, own.f, own.q);
      pose = own.x;
    }
    const PosePosterior posterior = shared.from(start);
    EXPECT_NEAR(posterior.mean.x_m, pose.x.minus({}), 1e-5);
    EXPECT_NEAR(posterior.mean.y_m, pose.y.minus({}), 1e-5);
    EXPECT_NEAR(base::wrap_angle(posterior.mean.yaw_rad - pose.yaw_rad), 0, 1e-5);
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r <= c; ++r) EXPECT_NEAR(posterior.p(r, c), p(r, c), 1e-4F) << r << c;
  }
}

TEST(FastSlam, ALandmarksUpdateIsTheAverageOfEqualSightings) {
  const SightingNoise noise{.sigma_range_m = 0.1F, .sigma_bearing_rad = 0.02F};
  const PlanarOffset pose{.x_m = 1, .y_m = 2, .yaw_rad = 0.5F};
  const Sighting seen{.id = 1, .range_m = 4, .bearing_rad = -0.3F};
  FastSlamLandmark landmark = FastSlamLandmark::seen_from(pose, seen, noise);
  const Covariance2 once = landmark.p;
  EXPECT_NEAR(landmark.x_m, 1 + 4 * std::cos(0.2), 1e-5);
  EXPECT_NEAR(landmark.y_m, 2 + 4 * std::sin(0.2), 1e-5);
  EXPECT_NEAR(once.xx + once.yy, 0.01 + 16 * 0.0004, 1e-6);
  for (int k = 1; k < 10; ++k) {
    const float likelihood = landmark.update(pose, seen, noise, 13.8F);
    // -log sqrt det S of a perfect sighting, S = R (k + 1)/k: a prior of k sightings beside the noise of one.
    EXPECT_NEAR(d(likelihood), -std::log(0.1 * 0.02 * (k + 1.0) / k), 1e-3) << k;
    EXPECT_NEAR(d(landmark.p.xx), d(once.xx) / (k + 1), 1e-5) << k;
    EXPECT_NEAR(d(landmark.p.yy), d(once.yy) / (k + 1), 1e-5) << k;
  }
  const FastSlamLandmark before = landmark;
  const float outlier = landmark.update(pose, {.id = 1, .range_m = 9, .bearing_rad = -0.3F}, noise, 13.8F);
  EXPECT_EQ(landmark.x_m, before.x_m);
  EXPECT_EQ(landmark.p.xx, before.p.xx);
  EXPECT_LT(outlier, -0.5F * 13.8F - std::log(0.1F * 0.02F * 1.1F) + 0.1F);
}

TEST(FastSlam, DrawsHaveTheProposalsMoments) {
  PosePosterior posterior{.mean = {.x_m = 1, .y_m = -2, .yaw_rad = 3}, .p = {}};
  posterior.p(0, 0) = 0.09F, posterior.p(1, 1) = 0.04F, posterior.p(2, 2) = 0.01F;
  posterior.p(0, 1) = 0.03F, posterior.p(0, 2) = -0.012F, posterior.p(1, 2) = 0.002F;
  constexpr int kDraws = 20'000;
  std::array<std::array<double, 3>, 3> second{};
  std::array<double, 3> first{};
  for (int k = 0; k < kDraws; ++k) {
    const PlanarOffset drawn = posterior.sample(filter::normals_of<3>({1, 2}, 3, static_cast<std::uint32_t>(k)));
    const std::array<double, 3> e{d(drawn.x_m) - 1, d(drawn.y_m) + 2, std::remainder(d(drawn.yaw_rad) - 3, 2 * M_PI)};
    for (std::size_t r = 0; r < 3; ++r) {
      first[r] += e[r] / kDraws;
      for (std::size_t c = 0; c < 3; ++c) second[r][c] += e[r] * e[c] / kDraws;
    }
  }
  for (std::size_t r = 0; r < 3; ++r) {
    EXPECT_NEAR(first[r], 0, 0.01);
    for (std::size_t c = 0; c < 3; ++c) {
      const int i = static_cast<int>(r), j = static_cast<int>(c);
      EXPECT_NEAR(second[r][c], d(posterior.p(i, j)), 0.05 * std::sqrt(d(posterior.p(i, i)) * d(posterior.p(j, j))));
    }
  }
}

struct Figures {
  double rmse_m = 0, nees = 0, map_m = 0;
};
template <int kVersion>
Figures run(unsigned seed) {
  static FastSlam<100, 30, kVersion> slam;
  slam = FastSlam<100, 30, kVersion>({seed, 5});
  World world(seed);
  slam.options.noise = {.sigma_range_m = 0.1F, .sigma_bearing_rad = 0.02F};
  slam.start({}, 1e-3F, 1e-3F);
  Figures f;
  int looks = 0;
  for (int k = 0; k < World::kStepsOfALap; ++k) {
    EXPECT_TRUE(slam.predict(world.drive()));
    if (k % 5 == 0) {
      std::vector<Sighting> seen;
      for (const auto& one : world.look()) {
        seen.push_back(one.sighting);
        seen.back().id = static_cast<std::uint16_t>(one.landmark);
      }
      EXPECT_EQ(slam.update(seen), static_cast<int>(seen.size()));
    }
    if (k % 10 != 9) continue;
    const auto estimate = slam.estimate();
    const std::array<double, 3> e{world.x_m - d(estimate.pose.x_m), world.y_m - d(estimate.pose.y_m),
                                  std::remainder(world.yaw_rad - d(estimate.pose.yaw_rad), 2 * M_PI)};
    f.rmse_m += e[0] * e[0] + e[1] * e[1];
    f.nees += test::nees_of(e, estimate.p);
    ++looks;
  }
  f.rmse_m = std::sqrt(f.rmse_m / looks), f.nees /= looks;
  for (int k = 0; k < slam.landmarks(); ++k) {
    const auto& place = world.landmarks[slam.id(k)];
    const auto& landmark = slam.best().landmarks[static_cast<std::size_t>(k)];
    f.map_m += std::hypot(d(landmark.x_m) - place[0], d(landmark.y_m) - place[1]) / slam.landmarks();
  }
  return f;
}
template <int kVersion>
Figures mean_of(int seeds) {
  Figures mean;
  for (int seed = 1; seed <= seeds; ++seed) {
    const Figures f = run<kVersion>(static_cast<unsigned>(seed));
    mean.rmse_m += f.rmse_m / seeds, mean.nees += f.nees / seeds, mean.map_m += f.map_m / seeds;
  }
  std::printf("FastSLAM %d, one lap: %.3f m, map %.3f m, NEES %.1f\n", kVersion, mean.rmse_m, mean.map_m, mean.nees);
  return mean;
}

TEST(FastSlam, BothVersionsMapALap) {
  const Figures one = mean_of<1>(10), two = mean_of<2>(10);
  EXPECT_LT(one.rmse_m, 1.0);
  EXPECT_LT(two.rmse_m, 0.8);
  EXPECT_LT(two.rmse_m, 1.1 * one.rmse_m);
  EXPECT_LT(two.nees, 0.7 * one.nees);
  EXPECT_GT(two.nees, 3);  // not consistent, and the page about it says by how much
  EXPECT_LT(two.nees, 200);
}

TEST(FastSlam, KeyAndInputsMakeEveryBit) {
  static FastSlam<50, 30> first, second;
  first = FastSlam<50, 30>({4, 4}), second = first;
  World world(6);
  first.start({}, 0.01F, 0.01F);
  second.start({}, 0.01F, 0.01F);
  for (int k = 0; k < 300; ++k) {
    const auto step = world.drive();
    ASSERT_TRUE(first.predict(step));
    ASSERT_TRUE(second.predict(step));
    if (k % 5 != 0) continue;
    std::vector<Sighting> seen;
    for (const auto& one : world.look()) {
      seen.push_back(one.sighting);
      seen.back().id = static_cast<std::uint16_t>(one.landmark);
    }
    first.update(seen);
    second.update(seen);
  }
  EXPECT_GT(first.counts().resampled, 0U);
  EXPECT_EQ(first.counts().resampled, second.counts().resampled);
  EXPECT_EQ(base::bits(first.estimate().pose.x_m), base::bits(second.estimate().pose.x_m));
  EXPECT_EQ(base::bits(first.estimate().p(2, 2)), base::bits(second.estimate().p(2, 2)));
}

TEST(FastSlam, FullHostileAndReset) {
  static FastSlam<20, 2> slam({1, 1});
  slam.start({}, 0.1F, 0.1F);
  const std::array<Sighting, 3> seen{{{.id = 1, .range_m = 2, .bearing_rad = 0},
                                      {.id = 2, .range_m = 2, .bearing_rad = 1},
                                      {.id = 3, .range_m = 2, .bearing_rad = -1}}};
  EXPECT_EQ(slam.update(seen), 2);
  EXPECT_EQ(slam.landmarks(), 2);
  EXPECT_EQ(slam.counts().no_room, 1U);
  for (const float bad : test::kHostile) {
    static_cast<void>(slam.predict({.ds_m = bad}));
    static_cast<void>(slam.predict({.dyaw_rad = bad}));
    static_cast<void>(slam.predict({.var_ds = bad}));
    static_cast<void>(slam.predict({.var_dyaw = bad}));
    for (const Sighting& one : {Sighting{.id = 1, .range_m = bad, .bearing_rad = 0.0F},
                                Sighting{.id = 1, .range_m = 2.0F, .bearing_rad = bad}})
      slam.update({&one, 1});
    const auto estimate = slam.estimate();
    EXPECT_TRUE(base::is_finite(estimate.pose.x_m + estimate.pose.y_m + estimate.pose.yaw_rad)) << bad;
    EXPECT_TRUE(estimate.p.bounded()) << bad;
  }
  slam.reset_map();
  EXPECT_EQ(slam.landmarks(), 0);
  EXPECT_EQ(slam.update({&seen[2], 1}), 1);
  EXPECT_EQ(slam.id(0), 3);
}

// 100 particles with 15 landmarks belong into an image of 64 kB of data.
static_assert(sizeof(FastSlam<100, 15, 2>) < 40 * 1024);

}  // namespace
}  // namespace tetap::slam
