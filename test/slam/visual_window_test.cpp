// SPDX-License-Identifier: Apache-2.0
// The laws of the visual window, in a simulated world whose noise is the filter's.
#include "tetap/slam/visual_window.hpp"
#include "slam/visual_world.hpp"
#include "tetap/base/state_words.hpp"

#include <gtest/gtest.h>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>

namespace tetap {
namespace {

using Window = slam::VisualWindow<slam::SpeedCore, 6, 40>;
using Small = slam::VisualWindow<slam::SpeedCore, 4, 20>;
static_assert(sizeof(Window) <= 16 * 1024);
static_assert(sizeof(Small) <= 8 * 1024);

constexpr slam::SpeedNoise kNone{
    .position_walk_m = 0, .angle_walk_rad = 0, .sigma_scale = 0, .sigma_direction_rad = 0, .direction_walk_rad = 0};

std::vector<std::uint32_t> bits_of(const Window& window) {
  std::vector<std::uint32_t> words;
  const auto sink = [&](std::uint32_t word) { words.push_back(word); };
  base::each_word(window, sink);
  return words;
}
/// Drives through a world and collects what each track came to.
struct Ride {
  std::unique_ptr<Window> window;
  std::vector<slam::TrackRecord> records;

  Ride(const test::VisualWorld& world, const slam::VisualOptions& options, const slam::SpeedNoise& noise = {})
      : window(std::make_unique<Window>(options, slam::SpeedCore(noise))) {
    const auto& images = world.drive().images;
    const auto um = [&](int i) { return std::llround(images[0].p_n_m(i) * 1e6); };
    window->start(test::in_float(images[0].r_nb), 1e-3F, {um(0), um(1), um(2)}, 1e-3F);
    for (std::size_t k = 0; k < images.size(); ++k) {
      if (k > 0) predict(images[k]);
      test::take_image(*window, images[k].features);
      for (const auto& record : window->records())
        if (record.fate != slam::TrackFate::kPending) records.push_back(record);
    }
  }
  void predict(const test::DriveImage& image) {
    EXPECT_TRUE(window->predict({.speed_b_mps = image.speed_b_mps.cast<float>(),
                                 .rate_b_radps = image.rate_b_radps.cast<float>(),
                                 .dt_s = 0.1F}));
  }
  [[nodiscard]] float variance(int state) const { return window->covariance()(state, state); }
};
void expect_same_nis(const Ride& a, const Ride& b) {
  ASSERT_EQ(a.records.size(), b.records.size());
  ASSERT_GT(a.records.size(), 100U);
  for (std::size_t i = 0; i < a.records.size(); ++i) {
    EXPECT_EQ(a.records[i].fate, b.records[i].fate) << i;
    EXPECT_NEAR(a.records[i].nis, b.records[i].nis, 0.01F + 0.01F * a.records[i].nis) << i;
  }
}

TEST(SpeedCore, CovarianceMovesByTheNumericDerivative) {
  constexpr float kStep = 1e-2F;
  const slam::BodyMotion motion{.speed_b_mps = {9.0F, 0.3F, -0.2F}, .rate_b_radps = {0.1F, -0.2F, 0.4F}, .dt_s = 0.1F};
  slam::SpeedCore start(kNone);
  start.start(nav::from_euler({0.4F, 0.1F, -0.2F}));
  start.shift({3.0F, -2.0F, 1.0F});
  filter::BigCovariance<float, 9> p;
  for (int e = 0; e < 9; ++e) {
    if (e == slam::SpeedCore::kConsidered) continue;  // its value is never moved
    filter::BigCovariance<float, 9>::States unit{};
    unit[static_cast<std::size_t>(e)] = 1.0F;
    const auto moved = [&](float by) {
      slam::SpeedCore core = start;
      std::array<float, 9> error{};
      error[static_cast<std::size_t>(e)] = by;
      core.correct(error.data());
      p.begin(unit);
      core.predict(motion, p, 0);
      return core;
    };
    const slam::SpeedCore high = moved(kStep), low = moved(-kStep), middle = moved(0.0F);
    const Eigen::Matrix3d r = test::in_double(middle.pose().q_nb);
    const auto error_of = [&](const slam::SpeedCore& core) {
      const Eigen::Vector3d theta = test::rotation_vector(test::in_double(core.pose().q_nb) * r.transpose());
      const Eigen::Vector3d rho =
          test::in_double(core.pose().p_n_m) - test::rotation(theta) * test::in_double(middle.pose().p_n_m);
      return std::pair(theta, rho);
    };
    const auto [theta_high, rho_high] = error_of(high);
    const auto [theta_low, rho_low] = error_of(low);
    const double width = 2 * static_cast<double>(kStep);
    for (int i = 0; i < 3; ++i) {  // P of one unit error is F e e^T F^T, and (F e)_e = 1
      EXPECT_NEAR(static_cast<double>(p(e, i)), (theta_high(i) - theta_low(i)) / width, 1e-3) << e;
      EXPECT_NEAR(static_cast<double>(p(e, 3 + i)), (rho_high(i) - rho_low(i)) / width, 2e-3) << e;
    }
  }
}

TEST(VisualWindow, ImagesOfTheSamePointsTeachNothingAboutYawAndPlace) {
  // At rest there is no parallax; on a sway there is, and still nothing ties the whole to the world.
  for (const double sway_m : {1e-9, 1.0}) {
    test::VisualWorldOptions o{.images = 1000, .sway_m = sway_m, .noise = kNone, .sigma_mounting_rad = 0};
    const test::VisualWorld world(o);
    const Ride ride(world, world.options(), kNone);
    for (int i = 0; i < 6; ++i) EXPECT_NEAR(ride.variance(Window::kCore + i), 1e-6F, 1e-8F) << i << ", " << sway_m;
    EXPECT_NEAR(ride.window->pose().q_nb.z, 0.0F, 1e-4F);
    if (sway_m > 0.5) {
      EXPECT_GT(ride.window->counters().used, 300U);
    }
  }
}

TEST(VisualWindow, AWorldTurnedAndMovedGivesTheSameNis) {
  const test::VisualWorld here({.images = 120});
  const test::VisualWorld there({.images = 120, .start_yaw_rad = 2.2, .start_n_m = {40'000, -70'000, 300}});
  expect_same_nis(Ride(here, here.options()), Ride(there, there.options()));
}

TEST(VisualWindow, AnOriginThatFollowsChangesNothing) {
  const test::VisualWorld world({.images = 120});
  auto near = world.options(), far = world.options();
  near.far_m = 2.0F;
  far.far_m = 900.0F;
  const Ride a(world, near), b(world, far);
  expect_same_nis(a, b);
  EXPECT_GT(a.window->counters().origin_moves, 30U);
  EXPECT_EQ(b.window->counters().origin_moves, 0U);
  for (int i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const auto place = [&](const Ride& ride) {
      return static_cast<double>(ride.window->origin_um()[k]) * 1e-6 +
             static_cast<double>(ride.window->pose().p_n_m(i));
    };
    EXPECT_NEAR(place(a), place(b), 1e-2) << "over 110 m in float";
    const auto sigma = [&](const Ride& ride) { return base::sqrt(ride.window->pose_covariance()(3 + i, 3 + i)); };
    EXPECT_NEAR(sigma(a) / sigma(b), 1.0F, 5e-3F);
  }
}

TEST(VisualWindow, APerfectTrackMovesNothing) {
  test::VisualWorldOptions o{.images = 60, .sigma_px = 1e-9, .noise = kNone, .sigma_mounting_rad = 0};
  const test::VisualWorld world(o);
  auto options = world.options();
  options.sigma_px = 1.5F;
  options.sigma_mounting_rad = 0.003F;
  const Ride ride(world, options, {});
  const auto& end = world.drive().images.back();
  const Eigen::Vector3d p = test::in_double(ride.window->pose().p_n_m) +
                            Eigen::Vector3d(1e-6 * static_cast<double>(ride.window->origin_um()[0]),
                                            1e-6 * static_cast<double>(ride.window->origin_um()[1]),
                                            1e-6 * static_cast<double>(ride.window->origin_um()[2]));
  EXPECT_GT(ride.window->counters().used, 80U);
  EXPECT_EQ(ride.window->counters().gated, 0U);
  EXPECT_LT((p - end.p_n_m).norm(), 0.03) << "quarter pixels over 45 m";
  for (const auto& record : ride.records) EXPECT_LT(record.nis, 0.2F);
}

TEST(VisualWindow, TheScaleOfAPathIsNeverLearntFromImages) {
  // Exact images of a path whose speeds are worth little. Images carry the scale from window to window
  // and add no information to it: what is known of a distance in the window is at most what all speeds gave.
  test::VisualWorldOptions o{.images = 40, .sigma_px = 1e-9, .noise = kNone, .sigma_mounting_rad = 0};
  const test::VisualWorld world(o);
  slam::SpeedNoise blind = kNone;
  blind.position_walk_m = 3.0F;
  blind.sigma_scale = 0.2F;
  auto options = world.options();
  options.sigma_px = 1.5F;
  const Ride ride(world, options, blind);
  EXPECT_GT(ride.window->counters().used, 40U);
  EXPECT_FLOAT_EQ(ride.variance(Window::kCore + slam::SpeedCore::kConsidered), 0.04F) << "it keeps its variance";
  // The distance from the oldest camera's place in the window to the newest: its error is rho + theta x place, along.
  const auto& images = world.drive().images;
  const std::size_t now = images.size() - 1, old = now - (Window::kClones - 1);
  const Eigen::Vector3d origin = Eigen::Vector3d(static_cast<double>(ride.window->origin_um()[0]),
                                                 static_cast<double>(ride.window->origin_um()[1]),
                                                 static_cast<double>(ride.window->origin_um()[2])) *
                                 1e-6;
  const auto place_of = [&](std::size_t k) -> Eigen::Vector3d {
    return images[k].p_n_m + images[k].r_nb * test::in_double(world.drive().mounting.lever_b_m) - origin;
  };
  const double distance_m = (place_of(now) - place_of(old)).norm();
  const Eigen::Vector3d along = (place_of(now) - place_of(old)) / distance_m;
  Eigen::VectorXd h = Eigen::VectorXd::Zero(Window::kStates);
  for (const auto& [k, sign] : {std::pair(now, 1.0), std::pair(old, -1.0)}) {
    const auto state = static_cast<Eigen::Index>(Window::kFirstClone + 6 * static_cast<int>(k % Window::kClones));
    h.segment<3>(state) = sign * place_of(k).cross(along);
    h.segment<3>(state + 3) = sign * along;
  }
  double variance = 0, of_speeds = 0;
  for (int r = 0; r < Window::kStates; ++r)
    for (int c = 0; c < Window::kStates; ++c)
      variance += h(r) * h(c) * static_cast<double>(ride.window->covariance()(r, c));
  for (std::size_t k = 1; k < images.size(); ++k)
    of_speeds += (images[k].p_n_m - images[k - 1].p_n_m).squaredNorm() / (9 * 0.1);
  EXPECT_GT(variance / (distance_m * distance_m), 1 / (1.3 * of_speeds));
}

TEST(VisualWindow, OrderOfFeaturesAndDealingOfWorkLeaveTheBits) {
  const test::VisualWorld world({.images = 60});
  const Ride plain(world, world.options());
  for (const int units : {1, 77, 4000}) {
    Window window(world.options());
    const auto& images = world.drive().images;
    window.start(test::in_float(images[0].r_nb), 1e-3F, {}, 1e-3F);
    for (std::size_t k = 0; k < images.size(); ++k) {
      const slam::BodyMotion motion{.speed_b_mps = images[k].speed_b_mps.cast<float>(),
                                    .rate_b_radps = images[k].rate_b_radps.cast<float>(),
                                    .dt_s = 0.1F};
      if (k > 0) {
        ASSERT_TRUE(window.predict(motion));
      }
      auto features = images[k].features;
      std::reverse(features.begin(), features.end());
      ASSERT_TRUE(window.begin_image(features));
      EXPECT_FALSE(window.predict(motion)) << "the state rests while a job runs";
      EXPECT_FALSE(window.begin_image(features));
      if (window.busy()) {
        EXPECT_FALSE(window.end_image(features));
      }
      for (int call = 0; window.busy(); ++call) {
        ASSERT_LT(call, 100'000) << "a job ends";
        window.work(units);
      }
      ASSERT_TRUE(window.end_image(features));
    }
    EXPECT_EQ(bits_of(window), bits_of(*plain.window)) << units;
  }
}

TEST(VisualWindow, ATrackBeyondTheGateChangesNothing) {
  const test::VisualWorld world({.images = 30});
  const Ride ride(world, world.options());
  Window& window = *ride.window;
  auto torn = world.drive().images.back().features;
  for (auto& feature : torn) feature.v_quarter_px = static_cast<std::uint16_t>(feature.v_quarter_px ^ 64);
  test::take_image(window, torn);
  const slam::VisualCounters before = window.counters();
  const slam::WorldPose pose = window.pose();
  const float variance = ride.variance(Window::kCore + 3);
  test::take_image(window, {});  // every track ends, its last sighting being 16 pixels off
  EXPECT_EQ(window.counters().used, before.used);
  EXPECT_EQ(window.counters().gated, before.gated + 2);
  EXPECT_EQ(base::bits(window.pose().q_nb.x), base::bits(pose.q_nb.x));
  EXPECT_EQ(base::bits(window.pose().p_n_m(1)), base::bits(pose.p_n_m(1)));
  EXPECT_EQ(base::bits(ride.variance(Window::kCore + 3)), base::bits(variance));
}

TEST(VisualWindow, WhatIsNoNumberIsRefusedAndCounted) {
  const test::VisualWorld world({.images = 2});
  Window window(world.options());
  window.start({}, 1e-3F, {}, 1e-3F);
  EXPECT_FALSE(window.predict({.speed_b_mps = {base::kNan, 0, 0}, .dt_s = 0.1F}));
  EXPECT_FALSE(window.predict({.dt_s = -0.1F}));
  EXPECT_FALSE(window.end_image({})) << "none was begun";
  EXPECT_EQ(window.counters().refused, 3U);
}

/// ANEES of the pose over seeds, with the filter's noise off by factors.
double anees(int seeds, float of_pixels, float of_motion) {
  double sum = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    const test::VisualWorld world({.seed = static_cast<unsigned>(seed)});
    auto options = world.options();
    options.sigma_px *= of_pixels;
    slam::SpeedNoise noise;
    noise.position_walk_m *= of_motion;
    noise.angle_walk_rad *= of_motion;
    const auto window = std::make_unique<Window>(options, slam::SpeedCore(noise));
    sum += test::run_drive(*window, world.drive(), 0, world.drive().images.size() - 1).nees / seeds;
  }
  return sum;
}

TEST(VisualWorld, SigmasAreHonestInAMatchedWorldAndOnlyThere) {
  const char* const asked = std::getenv("TETAP_SEEDS");
  const int seeds = asked != nullptr ? std::atoi(asked) : 12;
  const double matched = anees(seeds, 1, 1), pixels = anees(seeds, 1 / 3.0F, 1), motion = anees(seeds, 1, 1 / 3.0F);
  std::printf("ANEES of 6 over %d seeds: matched %.2f, R a third %.2f, Q a third %.2f\n", seeds, matched, pixels,
              motion);
  EXPECT_GT(matched, 4.8);
  EXPECT_LT(matched, 7.2);
  EXPECT_GT(pixels, 7.2);
  EXPECT_GT(motion, 7.2);
}

}  // namespace
}  // namespace tetap
