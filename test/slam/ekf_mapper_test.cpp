// SPDX-License-Identifier: Apache-2.0
// EKF-SLAM in a simulated world: consistency over laps, sightings without identity, clutter, sightings of one kind
// alone, full maps.
#include "tetap/slam/ekf_mapper.hpp"
#include "landmark_world.hpp"
#include "support/never_nan.hpp"

#include <gtest/gtest.h>
#include <algorithm>
#include <map>
#include <vector>

namespace tetap::slam {
namespace {

using Mapper = EkfMapper<48>;
using World = test::LandmarkWorld;

double metres(const base::Anchored& x) { return static_cast<double>(x.minus({})); }
Mapper started(const World& world) {
  Mapper mapper;
  mapper.core.options.noise = {.sigma_range_m = static_cast<float>(world.sigma_range_m),
                               .sigma_bearing_rad = static_cast<float>(world.sigma_bearing_rad)};
  mapper.start({}, filter::Symmetric<float, 3>::diagonal({1e-6F, 1e-6F, 1e-6F}));
  return mapper;
}

struct Figures {
  double pose_nees = 0, landmark_nees = 0, wrong = 0, fused = 0, missed = 0, spurious = 0, ambiguous = 0;
};
enum class Ids { kKnown, kWithheld };

/// Landmarks of the map against those of the world: the one that most of its sightings came from.
void compare_maps(const Mapper& mapper, const World& world, std::map<int, std::map<int, int>>& votes, Figures& f) {
  std::vector<bool> found(world.landmarks.size(), false);
  int confirmed = 0;
  for (int k = 0; k < mapper.core.map().size(); ++k) {
    const MapLandmark& landmark = mapper.core.map()[k];
    if (landmark.hits < 3) continue;
    const auto& from = votes[landmark.id];
    const auto most = std::max_element(from.begin(), from.end(), [](auto& a, auto& b) { return a.second < b.second; });
    if (most == from.end() || most->first < 0 || found[static_cast<std::size_t>(most->first)]) {
      f.spurious += 1;
      continue;
    }
    found[static_cast<std::size_t>(most->first)] = true;
    const auto& place = world.landmarks[static_cast<std::size_t>(most->first)];
    const double ex = place[0] - metres(landmark.place.x), ey = place[1] - metres(landmark.place.y);
    const Covariance2 p = mapper.core.landmark_covariance(k);
    const auto d = [](float v) { return static_cast<double>(v); };
    f.landmark_nees +=
        (ex * ex * d(p.yy) - 2 * ex * ey * d(p.xy) + ey * ey * d(p.xx)) / (d(p.xx) * d(p.yy) - d(p.xy) * d(p.xy));
    ++confirmed;
  }
  f.landmark_nees /= confirmed;
  f.missed = static_cast<double>(std::count(found.begin(), found.end(), false));
}

Figures run(World& world, Mapper& mapper, int laps, Ids ids) {
  Figures f;
  std::map<int, std::map<int, int>> votes;
  int looks = 0;
  for (int k = 0; k < laps * World::kStepsOfALap; ++k) {
    EXPECT_TRUE(mapper.predict(world.drive()));
    if (k % 5 == 0) {
      const auto seen = world.look();
      std::vector<Sighting> sightings;
      for (const World::Seen& one : seen) {
        sightings.push_back(one.sighting);
        if (ids == Ids::kKnown) sightings.back().id = static_cast<std::uint16_t>(one.landmark);
      }
      const auto records = mapper.update(sightings, k * 100'000);
      for (std::size_t i = 0; i < records.size(); ++i) {
        if (records[i].verdict == SightingVerdict::kAccepted || records[i].verdict == SightingVerdict::kNewLandmark)
          ++votes[records[i].id][seen[i].landmark];
        f.fused += records[i].verdict == SightingVerdict::kAccepted ? 1 : 0;
        f.ambiguous += records[i].verdict == SightingVerdict::kAmbiguous ? 1 : 0;
      }
    }
    if (k % 10 == 9) {
      const auto& pose = mapper.core.pose();
      f.pose_nees += test::nees_of({world.x_m - metres(pose.x), world.y_m - metres(pose.y),
                                    std::remainder(world.yaw_rad - static_cast<double>(pose.yaw_rad), 2 * M_PI)},
                                   mapper.core.pose_covariance());
      ++looks;
    }
  }
  f.pose_nees /= looks;
  for (auto& [id, from] : votes) {
    int all = 0, most = 0;
    for (const auto& [landmark, count] : from) all += count, most = std::max(most, count);
    f.wrong += all - most;
  }
  compare_maps(mapper, world, votes, f);
  return f;
}

Figures mean_of(int seeds, int laps, Ids ids, double clutter, const EkfMapperOptions& options) {
  Figures mean;
  for (int seed = 1; seed <= seeds; ++seed) {
    World world(static_cast<unsigned>(seed));
    world.clutter = clutter;
    Mapper mapper = started(world);
    mapper.options = options;
    const Figures f = run(world, mapper, laps, ids);
    mean.pose_nees += f.pose_nees / seeds, mean.landmark_nees += f.landmark_nees / seeds;
    mean.wrong += f.wrong / seeds, mean.fused += f.fused / seeds, mean.missed += f.missed / seeds;
    mean.spurious += f.spurious / seeds, mean.ambiguous += f.ambiguous / seeds;
  }
  std::printf(
      "%d laps, %d seeds: pose NEES %.2f, landmark NEES %.2f, wrong %.1f of %.0f, missed %.1f, spurious %.1f, "
      "ambiguous %.1f\n",
      laps, seeds, mean.pose_nees, mean.landmark_nees, mean.wrong, mean.fused, mean.missed, mean.spurious,
      mean.ambiguous);
  return mean;
}

TEST(EkfMapper, IsConsistentOverOneLap) {
  const Figures f = mean_of(30, 1, Ids::kKnown, 0, {});
  EXPECT_GT(f.pose_nees, 2.6);
  EXPECT_LT(f.pose_nees, 3.7);
  EXPECT_GT(f.landmark_nees, 1.7);
  EXPECT_LT(f.landmark_nees, 2.4);
}

TEST(EkfMapper, StaysNearConsistencyOverThreeLaps) {
  const Figures f = mean_of(20, 3, Ids::kKnown, 0, {});
  EXPECT_GT(f.pose_nees, 2.6);
  EXPECT_LT(f.pose_nees, 3.6);
  EXPECT_GT(f.landmark_nees, 1.7);
  EXPECT_LT(f.landmark_nees, 2.5);
}

TEST(EkfMapper, FindsItsWayWithoutIdentities) {
  for (const AssociationMethod method :
       {AssociationMethod::kNearest, AssociationMethod::kAssignment, AssociationMethod::kJoint}) {
    const Figures f = mean_of(10, 2, Ids::kWithheld, 0, {.method = method});
    EXPECT_LT(f.wrong, 0.02 * f.fused);
    EXPECT_LE(f.missed, 1);
    EXPECT_LE(f.spurious, 1);
    EXPECT_LT(f.pose_nees, 5.5);
    EXPECT_GT(f.pose_nees, 2);
  }
}

TEST(EkfMapper, ClutterDoesNotStay) {
  const Figures f = mean_of(10, 2, Ids::kWithheld, 0.2, {.method = AssociationMethod::kJoint});
  EXPECT_LT(f.wrong, 0.04 * f.fused);
  EXPECT_LE(f.missed, 2);
  EXPECT_LE(f.spurious, 2);
  EXPECT_LT(f.pose_nees, 6);
}

/// Pairs of landmarks 0.6 m apart, seen together by a robot that is unsure of its place. One-to-one assignment keeps
/// them apart, nearest neighbours may take one for both.
double confused(AssociationMethod method) {
  double wrong = 0;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    Mapper mapper;
    mapper.options.method = method;
    mapper.options.margin = 0;
    mapper.core.options.noise = {.sigma_range_m = 0.05F, .sigma_bearing_rad = 0.01F};
    mapper.start({}, {});
    static_cast<void>(mapper.core.add(4, 0.3F, {1e-4F, 0, 1e-4F}, 0, 0));
    static_cast<void>(mapper.core.add(4, -0.3F, {1e-4F, 0, 1e-4F}, 1, 0));
    const double slip = 0.25 * normal(random);  // sideways
    mapper.set_pose({}, filter::Symmetric<float, 3>::diagonal({1e-4F, 1e-4F, 1e-6F}));
    EXPECT_TRUE(mapper.predict({.var_dyaw = 0.0036F}));
    const double turned = slip / 4;
    std::vector<Sighting> seen;
    for (const double y : {0.3, -0.3}) {
      Sighting s;
      s.range_m = static_cast<float>(std::hypot(4, y) + 0.05 * normal(random));
      s.bearing_rad = static_cast<float>(std::atan2(y, 4) - turned + 0.01 * normal(random));
      seen.push_back(s);
    }
    const auto records = mapper.update(seen, 1);
    for (std::size_t i = 0; i < 2; ++i)
      if (records[i].verdict == SightingVerdict::kAccepted && records[i].id != i) wrong += 1;
  }
  return wrong;
}
TEST(EkfMapper, AssignmentKeepsApartWhatNearestNeighboursConfuse) {
  const double nearest = confused(AssociationMethod::kNearest), assigned = confused(AssociationMethod::kAssignment),
               joint = confused(AssociationMethod::kJoint);
  std::printf("wrong of 400: nearest %.0f, assignment %.0f, joint %.0f\n", nearest, assigned, joint);
  EXPECT_GT(nearest, 20);
  EXPECT_LT(assigned, 0.6 * nearest);
  EXPECT_LT(joint, 0.6 * nearest);
}

TEST(EkfMapper, OrderOfArrivalChangesNoBit) {
  World world(3);
  Mapper mapper = started(world);
  for (int k = 0; k < 300; ++k) {
    ASSERT_TRUE(mapper.predict(world.drive()));
    std::vector<Sighting> seen;
    for (const auto& one : world.look()) seen.push_back(one.sighting);
    if (k % 5 != 0) continue;
    Mapper other = mapper;
    mapper.update(seen, k);
    std::reverse(seen.begin(), seen.end());
    other.update(seen, k);
    ASSERT_EQ(other.core.map().size(), mapper.core.map().size());
    EXPECT_EQ(base::bits(other.core.pose().x.offset_m), base::bits(mapper.core.pose().x.offset_m));
    EXPECT_EQ(base::bits(other.core.pose().yaw_rad), base::bits(mapper.core.pose().yaw_rad));
    for (int c = 0; c < mapper.core.covariance().size(); ++c)
      for (int r = 0; r <= c; ++r)
        EXPECT_EQ(base::bits(other.core.covariance()(r, c)), base::bits(mapper.core.covariance()(r, c)));
  }
  EXPECT_GT(mapper.core.map().size(), 5);
}

/// Drives past one landmark that gives its bearing alone, or its range alone.
void expect_place_from(bool bearing) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    World world(seed, 1);
    world.landmarks[0] = {3, 3};
    world.reach_m = 10;
    world.walk_m2ps = 1e-4, world.turn_rad2ps = 1e-4, world.sigma_range_m = 0.03;
    Mapper mapper = started(world);
    int pending = 0, begun = 0;
    for (int k = 0; k < 60; ++k) {
      ASSERT_TRUE(mapper.predict(world.drive()));
      auto seen = world.look();
      if (k % 4 != 0 || seen.empty()) continue;
      Sighting s = seen[0].sighting;
      s.id = 9;
      (bearing ? s.range_m : s.bearing_rad) = base::kNan;
      const auto records = mapper.update({&s, 1}, k);
      pending += records[0].verdict == SightingVerdict::kPending ? 1 : 0;
      begun += records[0].verdict == SightingVerdict::kNewLandmark ? 1 : 0;
    }
    EXPECT_GE(pending, 2) << seed;
    ASSERT_EQ(begun, 1) << seed;
    ASSERT_EQ(mapper.core.map().size(), 1) << seed;
    const auto& place = mapper.core.map()[0].place;
    const Covariance2 p = mapper.core.landmark_covariance(0);
    const double sigma = std::sqrt(static_cast<double>(p.xx + p.yy));
    EXPECT_LT(std::hypot(metres(place.x) - 3, metres(place.y) - 3), 4 * sigma) << seed;
    EXPECT_LT(sigma, 1) << seed;
  }
}
TEST(EkfMapper, PlacesALandmarkFromBearingsAlone) { expect_place_from(true); }
TEST(EkfMapper, PlacesALandmarkFromRangesAlone) { expect_place_from(false); }

TEST(EkfMapper, SaysWhenASightingFitsTwoLandmarks) {
  Mapper mapper;
  mapper.start({}, {});
  static_cast<void>(mapper.core.add(4, 0.2F, {1e-3F, 0, 1e-3F}, 0, 0));
  static_cast<void>(mapper.core.add(4, -0.2F, {1e-3F, 0, 1e-3F}, 1, 0));
  Sighting between;
  between.range_m = 4;
  between.bearing_rad = 0;
  const auto p = mapper.core.covariance();
  const auto records = mapper.update({&between, 1}, 1);
  EXPECT_EQ(records[0].verdict, SightingVerdict::kAmbiguous);
  EXPECT_EQ(mapper.counts().ambiguous, 1U);
  EXPECT_EQ(mapper.core.map().size(), 2);
  EXPECT_EQ(mapper.core.covariance()(0, 0), p(0, 0));
}

TEST(EkfMapper, ForgetsWhatWasSeenOnce) {
  Mapper mapper;
  mapper.start({}, {});
  Sighting once;
  once.range_m = 3, once.bearing_rad = 1;
  EXPECT_EQ(mapper.update({&once, 1}, 0)[0].verdict, SightingVerdict::kNewLandmark);
  EXPECT_EQ(mapper.core.map().size(), 1);
  mapper.update({}, mapper.options.expiry_us - 1);
  EXPECT_EQ(mapper.core.map().size(), 1);
  mapper.update({}, mapper.options.expiry_us);
  EXPECT_EQ(mapper.core.map().size(), 0);
  EXPECT_EQ(mapper.counts().forgotten, 1U);
}

TEST(EkfMapper, RefusesWhatIsNoSightingAndCountsTheSurplus) {
  EkfMapper<4, 3> mapper;
  mapper.start({}, {});
  for (const float bad : test::kHostile)
    for (const int field : {0, 1}) {
      Sighting seen;
      seen.id = 1, seen.range_m = 2, seen.bearing_rad = 0.5F;
      (field == 0 ? seen.range_m : seen.bearing_rad) = bad;
      const auto records = mapper.update({&seen, 1}, 0);
      if (!seen.valid()) {
        EXPECT_EQ(records[0].verdict, SightingVerdict::kNotFinite);
      }
      EXPECT_TRUE(mapper.core.pose().finite());
      EXPECT_TRUE(mapper.core.pose_covariance().bounded());
    }
  std::array<Sighting, 5> many;
  for (std::size_t i = 0; i < many.size(); ++i)
    many[i] = {.id = static_cast<std::uint16_t>(10 + i), .range_m = 2, .bearing_rad = 1};
  EXPECT_EQ(mapper.update(many, 1).size(), 3U);
  EXPECT_EQ(mapper.counts().surplus, 2U);
}

TEST(EkfMapper, TwoSightingsOfANewLandmarkInOneStampMakeOne) {
  Mapper mapper;
  mapper.start({}, {});
  const std::array<Sighting, 2> twice{
      {{.id = 7, .range_m = 2, .bearing_rad = 0.1F}, {.id = 7, .range_m = 2.1F, .bearing_rad = 0.1F}}};
  const auto records = mapper.update(twice, 1);
  EXPECT_EQ(records[0].verdict, SightingVerdict::kNewLandmark);
  EXPECT_EQ(records[1].verdict, SightingVerdict::kPending);
  EXPECT_EQ(mapper.core.map().size(), 1);
}

TEST(EkfMapper, TwoNamelessSightingsOfOnePlaceBeginOneLandmark) {
  Mapper mapper;
  mapper.start({}, {});
  const std::array<Sighting, 2> twice{{{.range_m = 2, .bearing_rad = 0.1F}, {.range_m = 2.1F, .bearing_rad = 0.1F}}};
  const auto records = mapper.update(twice, 1);
  EXPECT_EQ(records[0].verdict, SightingVerdict::kNewLandmark);
  EXPECT_EQ(records[1].verdict, SightingVerdict::kAmbiguous);
  EXPECT_EQ(mapper.core.map().size(), 1);
}

TEST(EkfMapper, AFullMapRefusesAndGoesOn) {
  World world(2);
  EkfMapper<8> mapper;
  mapper.core.options.noise = {.sigma_range_m = 0.1F, .sigma_bearing_rad = 0.02F};
  mapper.start({}, filter::Symmetric<float, 3>::diagonal({1e-6F, 1e-6F, 1e-6F}));
  int refused = 0;
  for (int k = 0; k < 3 * World::kStepsOfALap; ++k) {
    ASSERT_TRUE(mapper.predict(world.drive()));
    if (k % 5 != 0) continue;
    std::vector<Sighting> seen;
    for (const auto& one : world.look()) {
      seen.push_back(one.sighting);
      seen.back().id = static_cast<std::uint16_t>(one.landmark);
    }
    for (const auto& record : mapper.update(seen, k)) refused += record.verdict == SightingVerdict::kNoRoom ? 1 : 0;
    if (k == 1000) mapper.set_pose(mapper.core.pose(), mapper.core.pose_covariance());
  }
  EXPECT_TRUE(mapper.core.map().full());
  EXPECT_GT(refused, 100);
  EXPECT_EQ(mapper.core.counts().no_room, static_cast<std::uint32_t>(refused));
  // On a course that comes by its landmarks every lap the error stays bounded.
  EXPECT_LT(std::hypot(world.x_m - metres(mapper.core.pose().x), world.y_m - metres(mapper.core.pose().y)), 5);
}

static_assert(sizeof(EkfMapper<30>) < 48 * 1024);

}  // namespace
}  // namespace tetap::slam
