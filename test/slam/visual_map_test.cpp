// SPDX-License-Identifier: Apache-2.0
// Visual SLAM: laws of the map in the window's state, and a batch solution in double as its judge.
#include "tetap/slam/visual_map.hpp"
#include "slam/map_batch.hpp"
#include "slam/map_world.hpp"
#include "tetap/base/state_words.hpp"

#include <gtest/gtest.h>
#include <algorithm>
#include <cstdio>
#include <functional>
#include <memory>

namespace tetap {
namespace {

using Map = slam::VisualMap<slam::SpeedCore, 6, 40, 64>;
using Small = slam::VisualMap<slam::SpeedCore, 6, 40, 8>;
static_assert(sizeof(Map) <= 176 * 1024);

template <class Window>
void take_recognised(Window& window, std::vector<slam::ImageFeature> features, int units = 1'000'000) {
  ASSERT_TRUE(window.begin_recognised(features));
  while (window.busy()) window.work(units);
  ASSERT_TRUE(window.end_recognised(features));
}

/// A drive through a world; what was seen can be changed on its way.
template <class Window>
struct Trip {
  using Features = std::vector<slam::ImageFeature>;
  std::unique_ptr<Window> window;
  std::vector<slam::TrackRecord> records;
  std::vector<double> error_m;  ///< horizontal, at each image
  double nees = 0, beyond_s = 0;

  explicit Trip(const test::MapWorld& world, bool with_map = true, const std::function<void(Features&)>& change = {},
                const slam::SpeedNoise& noise = {}, int units = 1'000'000)
      : window(std::make_unique<Window>(world.options(), slam::SpeedCore(noise))) {
    const auto& images = world.drive().images;
    window->start(test::in_float(images[0].r_nb), 1e-3F, std::array<std::int64_t, 3>{}, 1e-3F);
    test::PathJudge<Window> judge;
    for (std::size_t k = 0; k < images.size(); ++k) {
      if (k > 0) {
        EXPECT_TRUE(window->predict({.speed_b_mps = images[k].speed_b_mps.cast<float>(),
                                     .rate_b_radps = images[k].rate_b_radps.cast<float>(),
                                     .dt_s = 0.1F}));
      }
      test::take_image(*window, images[k].features);
      if (with_map) {
        Features seen = world.recognised[k];
        if (change) change(seen);
        take_recognised(*window, seen, units);
        for (int i = 0; i < window->map_concluded(); ++i)
          records.push_back(window->map_records()[static_cast<std::size_t>(i)]);
      }
      judge.add(*window, images[k], 0.1);
      const auto place = [&](int i) {
        return 1e-6 * static_cast<double>(window->origin_um()[static_cast<std::size_t>(i)]) +
               static_cast<double>(window->pose().p_n_m(i));
      };
      error_m.push_back(std::hypot(place(0) - images[k].p_n_m(0), place(1) - images[k].p_n_m(1)));
    }
    nees = judge.result().nees;
    beyond_s = judge.result().beyond_s;
  }
  [[nodiscard]] int count(slam::TrackFate fate) const {
    return static_cast<int>(
        std::count_if(records.begin(), records.end(), [&](const auto& one) { return one.fate == fate; }));
  }
};

TEST(VisualMap, IsTheBatchSolutionOfTheSameSightings) {
  using Batch = test::MapBatch;
  constexpr int kUnused = 5;  // the image in which the tracks of the five before it become points
  for (const unsigned seed : {1U, 2U}) {
    Batch batch(seed);
    batch.solve(kUnused);
    const slam::SpeedNoise noise{.sigma_scale = 0};  // what is considered is no part of a batch solution
    Map map({.camera = {.fu_px = 458, .fv_px = 458, .cu_px = 319.5F, .cv_px = 239.5F},
             .mounting = {.q_cb = {0.5F, 0.5F, -0.5F, 0.5F}, .lever_b_m = Batch::lever().cast<float>()},
             .sigma_px = static_cast<float>(Batch::kSigma_px)},
            slam::SpeedCore(noise));
    map.start(nav::Quaternion{}, 0.01F, std::array<std::int64_t, 3>{}, 0.01F);
    for (int k = 0; k < Batch::kImages; ++k) {
      if (k > 0) {
        ASSERT_TRUE(map.predict(
            {.speed_b_mps = Batch::speed().cast<float>(), .rate_b_radps = Batch::rate().cast<float>(), .dt_s = 0.1F}));
      }
      test::take_image(map, {});
      std::vector<slam::ImageFeature> features;
      for (int post = 0; post < Batch::kPosts; ++post) {
        const Eigen::Vector2d at = batch.seen(k, post);
        features.push_back({static_cast<std::uint16_t>(post), static_cast<std::uint16_t>(std::lround(4 * at(0))),
                            static_cast<std::uint16_t>(std::lround(4 * at(1)))});
      }
      take_recognised(map, features);
      const auto expected = k < kUnused    ? slam::TrackFate::kPending
                            : k == kUnused ? slam::TrackFate::kKept
                                           : slam::TrackFate::kUsed;
      for (int i = 0; i < Batch::kPosts; ++i)
        ASSERT_EQ(map.map_records()[static_cast<std::size_t>(i)].fate, expected) << k;
    }
    const auto covariance = [&](int state) {
      Eigen::Matrix3d p;
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) p(i, j) = static_cast<double>(map.covariance()(state + i, state + j));
      return p;
    };
    const auto compare = [](const Eigen::Vector3d& found, const Eigen::Matrix3d& p, const Eigen::Vector3d& wanted,
                            const Eigen::Matrix3d& q, const char* what) {
      const double apart = std::sqrt((found - wanted).dot(q.ldlt().solve(found - wanted)));
      EXPECT_LT(apart, 0.5) << what << ": " << found.transpose() << " for " << wanted.transpose();
      // Eigenvalues of P against those of the judge, along the judge's axes.
      const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::Matrix3d> ratio(p, q);
      EXPECT_GT(ratio.eigenvalues().minCoeff(), 0.65) << what;
      EXPECT_LT(ratio.eigenvalues().maxCoeff(), 1.5) << what;
    };
    for (int post = 0; post < Batch::kPosts; ++post) {
      const int i = map.map().find(static_cast<std::uint16_t>(post));
      ASSERT_GE(i, 0);
      const auto place = [&](const Batch::Unknown& z) -> Eigen::VectorXd {
        return z.segment<3>(Batch::kPoints + 3 * post);
      };
      compare(test::in_double(map.map()[i].at_n_m), covariance(Map::kFirstPoint + 3 * i), place(batch.solution),
              batch.covariance_of(place), "post");
    }
    const auto place = [](const Batch::Unknown& z) -> Eigen::VectorXd { return Batch::pose(z, Batch::kImages - 1).p; };
    const auto pose = map.pose_covariance();
    Eigen::Matrix3d p;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) p(i, j) = static_cast<double>(pose(3 + i, 3 + j));
    compare(test::in_double(map.pose().p_n_m), p, place(batch.solution), batch.covariance_of(place), "place");
  }
}

std::vector<std::uint32_t> bits_of(const Map& map) {
  std::vector<std::uint32_t> words;
  const auto sink = [&](std::uint32_t word) { words.push_back(word); };
  base::each_word(map, sink);
  return words;
}

TEST(VisualMap, TheOrderOfFeaturesAndOfWorkLeavesEveryBit) {
  const test::MapWorld world({.laps = 1, .wrong_share = 0.1});
  const Trip<Map> plain(world);
  const Trip<Map> shuffled(
      world, true, [](auto& seen) { std::reverse(seen.begin(), seen.end()); }, {}, 700);
  EXPECT_GT(plain.window->map().size(), 15);
  EXPECT_EQ(bits_of(*plain.window), bits_of(*shuffled.window));
}

TEST(VisualMap, NamesOfPointsHaveNoEffect) {
  const test::MapWorld world({.laps = 1});
  const Trip<Map> plain(world);
  const Trip<Map> renamed(world, true, [](auto& seen) {
    for (auto& one : seen) one.id = static_cast<std::uint16_t>(3 * one.id + 1000);
  });
  EXPECT_EQ(plain.error_m, renamed.error_m);
  ASSERT_GT(plain.window->map().size(), 0);
  EXPECT_EQ(3 * plain.window->map()[0].id + 1000, renamed.window->map()[0].id);
}

TEST(VisualMap, ATurnOfTheWorldTurnsTheEstimate) {
  constexpr double kTurn_rad = 2.1;
  const test::MapWorld world({}), turned({.start_yaw_rad = kTurn_rad});
  const Trip<Map> a(world), b(turned);
  ASSERT_EQ(a.records.size(), b.records.size());
  for (std::size_t i = 0; i < a.records.size(); ++i) EXPECT_EQ(a.records[i].fate, b.records[i].fate) << i;
  EXPECT_NEAR(a.error_m.back(), b.error_m.back(), 0.02);
  EXPECT_NEAR(a.nees, b.nees, 0.2);
}

/// A map made in a lap, and what the next image would recognise.
struct Mapped {
  test::MapWorld world{{.laps = 1, .missed_share = 0}};
  Trip<Map> trip{world};
  Map& map = *trip.window;
  Trip<Map>::Features next = world.recognised.back();
  Mapped() { take_recognised(map, {}); }  // tracks that wait are used
  [[nodiscard]] float variance(int state) const { return map.covariance()(state, state); }
};

TEST(VisualMap, AWrongIdentityIsRefusedAndChangesNothing) {
  Mapped m;
  ASSERT_GE(m.next.size(), 3U);
  const auto before = m.map.covariance();
  const slam::WorldPose pose = m.map.pose();
  int gated = 0;
  for (int other = 0; other < m.map.map().size(); ++other) {  // the first post is taken for each other one
    const std::uint16_t id = m.map.map()[other].id;
    if (id == m.next[0].id) continue;
    take_recognised(m.map, {{id, m.next[0].u_quarter_px, m.next[0].v_quarter_px}});
    ASSERT_EQ(m.map.map_records()[0].fate, slam::TrackFate::kGated) << id;
    gated += m.map.map_records()[0].nis > 9.2F ? 1 : 0;
  }
  EXPECT_GE(gated, 5);
  for (std::size_t i = 0; i < before.words(); ++i) ASSERT_EQ(before.word(i), m.map.covariance().word(i));
  EXPECT_EQ(pose.p_n_m, m.map.pose().p_n_m);
}

TEST(VisualMap, ALostRobotBelievesNoSightingThatStandsAlone) {
  Mapped m;
  ASSERT_TRUE(m.map.predict({.dt_s = 0.1F, .var_way_m2 = 0.5F}));
  take_recognised(m.map, {m.next[0]});
  EXPECT_EQ(m.map.map_records()[0].fate, slam::TrackFate::kAlone);
  const float before = m.variance(Map::kCore + 3);
  take_recognised(m.map, m.next);
  EXPECT_EQ(m.map.map_records()[0].fate, slam::TrackFate::kUsed);
  EXPECT_LT(m.variance(Map::kCore + 3), 0.1F * before);
}

TEST(VisualMap, WithoutSightingsNoSigmaFalls) {
  Mapped m;
  test::take_image(m.map, {});  // so are the camera's
  const int points = m.map.map().size();
  std::vector<float> of_points;
  for (int i = 0; i < 3 * points; ++i) of_points.push_back(m.variance(Map::kFirstPoint + i));
  for (int k = 0; k < 50; ++k) {
    const auto before = m.map.pose_covariance();
    ASSERT_TRUE(m.map.predict({.speed_b_mps = {1, 0, 0}, .rate_b_radps = {0, 0, 0.1F}, .dt_s = 0.1F}));
    test::take_image(m.map, {});
    take_recognised(m.map, {});
    for (int i = 0; i < 6; ++i) EXPECT_GE(m.map.pose_covariance()(i, i), 0.999F * before(i, i)) << i;
  }
  for (int i = 0; i < 3 * points; ++i)
    EXPECT_EQ(m.variance(Map::kFirstPoint + i), of_points[static_cast<std::size_t>(i)]) << "a point does not move";
}

TEST(VisualMap, AFullMapRefusesAndGoesOn) {
  const test::MapWorld world({.laps = 1});
  const Trip<Small> trip(world);
  EXPECT_EQ(trip.window->map().size(), 8);
  EXPECT_GT(trip.count(slam::TrackFate::kNoRoom), 0);
  EXPECT_EQ(static_cast<std::uint32_t>(trip.count(slam::TrackFate::kNoRoom)), trip.window->map_counters().no_room);
  EXPECT_LT(trip.beyond_s, 2.0);
}

TEST(VisualMap, APointThatIsElsewhereIsForgotten) {
  Mapped m;
  ASSERT_GE(m.next.size(), 3U);
  const std::uint16_t id = m.next[0].id;
  const int points = m.map.map().size();
  ASSERT_GE(m.map.map().find(id), 0);
  m.next[0].v_quarter_px = static_cast<std::uint16_t>(m.next[0].v_quarter_px ^ 256);  // 64 px off
  for (int image = 1; image <= 15; ++image) {
    EXPECT_GE(m.map.map().find(id), 0) << image;
    take_recognised(m.map, m.next);
  }
  EXPECT_EQ(m.map.map().find(id), -1);
  EXPECT_EQ(m.map.map().size(), points - 1);
  EXPECT_EQ(m.map.map_counters().forgotten, 1U);
}

TEST(VisualMap, LapsOnTheMapDoNotGrowAndSigmasAreHonest) {
  // A tenth of the recognitions names another post. Beside them the same laps without the map.
  constexpr unsigned kSeeds = 4;
  std::array<double, 3> with_m2{}, without_m2{};
  double nees = 0, nees_without = 0, beyond_s = 0;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    const test::MapWorld world({.seed = seed, .wrong_share = 0.1});
    const Trip<Map> with(world), without(world, false);
    const auto& counts = with.window->map_counters();
    std::printf("seed %u: map %d, used %u gated %u alone %u forgotten %u; nees %.2f %.2f beyond %.1f %.1f s\n", seed,
                with.window->map().size(), counts.sightings, counts.gated, counts.alone, counts.forgotten, with.nees,
                without.nees, with.beyond_s, without.beyond_s);
    for (std::size_t lap = 0; lap < 3; ++lap) {
      const std::size_t k = (lap + 1) * static_cast<std::size_t>(world.per_lap);
      with_m2[lap] += with.error_m[k] * with.error_m[k];
      without_m2[lap] += without.error_m[k] * without.error_m[k];
    }
    nees += with.nees / kSeeds;
    nees_without += without.nees / kSeeds;
    beyond_s = std::max(beyond_s, with.beyond_s);
  }
  std::printf("after laps 1 and 3: %.3f %.3f m, without the map %.3f %.3f m; ANEES of 6: %.2f, %.2f\n",
              std::sqrt(with_m2[0] / kSeeds), std::sqrt(with_m2[2] / kSeeds), std::sqrt(without_m2[0] / kSeeds),
              std::sqrt(without_m2[2] / kSeeds), nees, nees_without);
  EXPECT_LT(std::sqrt(with_m2[2] / with_m2[0]), 1.3);
  EXPECT_LT(std::sqrt(with_m2[2] / without_m2[2]), 0.5);
  EXPECT_GT(nees, 3.0);
  EXPECT_LT(nees, 9.0);
  EXPECT_GT(nees_without, 3.0);
  EXPECT_LT(nees_without, 9.0);
  EXPECT_LT(beyond_s, 6.5);
}

}  // namespace
}  // namespace tetap
