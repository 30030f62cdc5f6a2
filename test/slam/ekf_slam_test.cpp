// SPDX-License-Identifier: Apache-2.0
// Laws of EKF-SLAM, against a dense filter in double and against what no filter may gain.
#include "tetap/slam/ekf_slam.hpp"
#include "dense_slam.hpp"
#include "support/never_nan.hpp"
#include "tetap/filter/ekf.hpp"
#include "tetap/model/range_bearing.hpp"

#include <gtest/gtest.h>
#include <Eigen/Dense>
#include <algorithm>
#include <cstring>
#include <random>
#include <vector>

namespace tetap::slam {
namespace {

using Slam = EkfSlam<8>;
using Pairs = std::vector<Slam::Pair>;

float f(double v) { return static_cast<float>(v); }
std::size_t at(int i) { return static_cast<std::size_t>(i); }

model::PlanarPose pose(double x_m, double y_m, double yaw_rad) {
  return {.x = base::Anchored{}.plus(f(x_m)), .y = base::Anchored{}.plus(f(y_m)), .yaw_rad = f(yaw_rad)};
}
filter::Symmetric<float, 3> diagonal(double x, double y, double yaw) {
  return filter::Symmetric<float, 3>::diagonal({f(x * x), f(y * y), f(yaw * yaw)});
}
Sighting sighting(int id, double range_m, double bearing_rad) {
  return {.id = static_cast<std::uint16_t>(id), .range_m = f(range_m), .bearing_rad = f(bearing_rad)};
}
/// The NIS of one sighting of a landmark that is there.
float fuse(Slam& slam, const Sighting& seen) {
  const Slam::Pair pair{.sighting = 0, .landmark = slam.map().find(seen.id)};
  SightingRecord record;
  slam.fuse({&seen, 1}, {&pair, 1}, 0, {&record, 1});
  return record.nis;
}
Eigen::MatrixXd dense(const Slam& slam) {
  const int n = slam.covariance().size();
  Eigen::MatrixXd p(n, n);
  for (int r = 0; r < n; ++r)
    for (int c = 0; c < n; ++c) p(r, c) = static_cast<double>(slam.covariance()(r, c));
  return p;
}
double east(const base::Anchored& x) { return static_cast<double>(x.minus({})); }

/// A drive past landmarks with noise of the model's size, told to any filter.
struct Drive {
  std::mt19937 random;
  std::normal_distribution<double> normal;
  double x = 0, y = 0, yaw = 0;
  explicit Drive(unsigned seed) : random(seed) {}
  std::array<double, 2> step(double ds, double dyaw, double var_ds, double var_dyaw) {
    const double s = ds + std::sqrt(var_ds) * normal(random), w = dyaw + std::sqrt(var_dyaw) * normal(random);
    x += s * std::cos(yaw + w / 2), y += s * std::sin(yaw + w / 2), yaw += w;
    return {s, w};
  }
  std::array<double, 2> see(double lx, double ly) {
    return {std::hypot(lx - x, ly - y) + 0.1 * normal(random),
            std::remainder(std::atan2(ly - y, lx - x) - yaw + 0.02 * normal(random), 2 * M_PI)};
  }
};
constexpr double kPlaces[8][2] = {{4, 1}, {6, -2}, {3, 5}, {-1, 4}, {2, -3}, {7, 3}, {5, 6}, {0, 7}};

TEST(EkfSlam, EqualsTheDenseInvariantFilter) {
  Drive drive(1);
  test::DenseSlam reference(test::SlamForm::kInvariant, {0, 0, 0.3}, {0.1, 0.1, 0.1});
  drive.yaw = 0.3;
  Slam slam;
  slam.options.gate = 1e9F;
  slam.start(pose(0, 0, 0.3), diagonal(0.1, 0.1, 0.1));
  for (int k = 0; k < 200; ++k) {
    drive.step(0.1, 0.04, 1e-4, 1e-4);
    reference.predict(0.1, 0.04, 1e-4, 1e-4);
    ASSERT_TRUE(slam.predict({.ds_m = 0.1F, .dyaw_rad = 0.04F, .var_ds = 1e-4F, .var_dyaw = 1e-4F}));
    const int id = k % 8;
    const auto z = drive.see(kPlaces[id][0], kPlaces[id][1]);
    if (k < 8) {
      reference.add(id, z[0], z[1]);
      ASSERT_EQ(slam.add(sighting(id, z[0], z[1]), static_cast<std::uint16_t>(id), 0), id);
    } else {
      const double nis = reference.update(id, z[0], z[1]);
      EXPECT_NEAR(static_cast<double>(fuse(slam, sighting(id, z[0], z[1]))), nis, 1e-3 * (1 + nis)) << k;
    }
  }
  EXPECT_NEAR(east(slam.pose().x), reference.x(0), 1e-4);
  EXPECT_NEAR(east(slam.pose().y), reference.x(1), 1e-4);
  EXPECT_NEAR(std::remainder(static_cast<double>(slam.pose().yaw_rad) - reference.x(2), 2 * M_PI), 0, 1e-4);
  const Eigen::MatrixXd p = dense(slam);
  EXPECT_LT((p - reference.p).cwiseAbs().maxCoeff(), 2e-4 * reference.p.cwiseAbs().maxCoeff());
}

TEST(EkfSlam, StandingStillGivesNoHeading) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  constexpr double kSeen[3][2] = {{3, 1}, {4, -2}, {2, 3}};
  test::DenseSlam standard(test::SlamForm::kStandard, {0, 0, 0}, {0.1, 0.1, 0.1});
  Slam slam;
  slam.options.gate = 1e9F;
  slam.start(pose(0, 0, 0), diagonal(0.1, 0.1, 0.1));
  for (int k = 0; k < 1000; ++k)
    for (int id = 0; id < 3; ++id) {
      const double range = std::hypot(kSeen[id][0], kSeen[id][1]) + 0.1 * normal(random);
      const double bearing = std::atan2(kSeen[id][1], kSeen[id][0]) + 0.02 * normal(random);
      if (k == 0) {
        standard.add(id, range, bearing);
        ASSERT_EQ(slam.add(sighting(id, range, bearing), static_cast<std::uint16_t>(id), 0), id);
      } else {
        standard.update(id, range, bearing);
        fuse(slam, sighting(id, range, bearing));
      }
    }
  const auto p = slam.pose_covariance();
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(std::sqrt(static_cast<double>(p(i, i))), 0.1, 1e-3) << i;
  EXPECT_LT(std::sqrt(standard.p(2, 2)), 0.06);  // what the law is for: the standard form gains heading from nothing
}

TEST(EkfSlam, TurningTheWorldChangesNoNis) {
  Drive drive(5);
  std::array<Slam, 2> worlds;
  for (int w = 0; w < 2; ++w) {
    worlds[at(w)].options.gate = 1e9F;
    worlds[at(w)].start(w == 0 ? pose(0, 0, 0) : pose(20, -7, 1.1), diagonal(0.1, 0.1, 0.1));
  }
  double largest = 0;
  for (int k = 0; k < 400; ++k) {
    drive.step(0.1, 0.05, 1e-4, 1e-4);
    for (Slam& slam : worlds)
      ASSERT_TRUE(slam.predict({.ds_m = 0.1F, .dyaw_rad = 0.05F, .var_ds = 1e-4F, .var_dyaw = 1e-4F}));
    const int id = k % 8;
    const auto z = drive.see(kPlaces[id][0], kPlaces[id][1]);
    std::array<double, 2> nis{};
    for (int w = 0; w < 2; ++w) {
      if (k < 8) static_cast<void>(worlds[at(w)].add(sighting(id, z[0], z[1]), static_cast<std::uint16_t>(id), 0));
      if (k >= 8) nis[at(w)] = static_cast<double>(fuse(worlds[at(w)], sighting(id, z[0], z[1])));
    }
    largest = std::max(largest, std::abs(nis[0] - nis[1]) / (1 + nis[0]));
  }
  EXPECT_LT(largest, 2e-3);
}

/// Eight landmarks after a drive.
Slam driven(unsigned seed) {
  Drive drive(seed);
  Slam slam;
  slam.start(pose(0, 0, 0), diagonal(0.05, 0.05, 0.05));
  for (int k = 0; k < 100; ++k) {
    drive.step(0.1, 0.05, 1e-4, 1e-4);
    EXPECT_TRUE(slam.predict({.ds_m = 0.1F, .dyaw_rad = 0.05F, .var_ds = 1e-4F, .var_dyaw = 1e-4F}));
    const auto z = drive.see(kPlaces[k % 8][0], kPlaces[k % 8][1]);
    if (k < 8) {
      EXPECT_EQ(slam.add(sighting(k, z[0], z[1]), static_cast<std::uint16_t>(k), 0), k);
    } else {
      fuse(slam, sighting(k % 8, z[0], z[1]));
    }
  }
  return slam;
}
/// The sighting that the filter expects of landmark k.
Sighting expected(const Slam& slam, int k) {
  const model::RangeBearing model{.landmark = slam.map()[k].place, .mounting = {}};
  const auto z = model.predict(slam.pose());
  return {.id = slam.map()[k].id, .range_m = z(0), .bearing_rad = z(1)};
}
double largest_move(const Slam& a, const Slam& b) {
  double largest = std::max(std::abs(static_cast<double>(a.pose().x.minus(b.pose().x))),
                            std::abs(static_cast<double>(a.pose().y.minus(b.pose().y))));
  largest = std::max(largest, std::abs(static_cast<double>(a.pose().yaw_rad - b.pose().yaw_rad)));
  for (int k = 0; k < a.map().size(); ++k) {
    largest = std::max(largest, std::abs(static_cast<double>(a.map()[k].place.x.minus(b.map()[k].place.x))));
    largest = std::max(largest, std::abs(static_cast<double>(a.map()[k].place.y.minus(b.map()[k].place.y))));
  }
  return largest;
}

TEST(EkfSlam, APerfectSightingMovesNothing) {
  const Slam before = driven(2);
  for (int k = 0; k < 8; ++k) {
    Slam slam = before;
    fuse(slam, expected(before, k));
    EXPECT_EQ(slam.counts().fused, before.counts().fused + 1);
    EXPECT_LT(largest_move(slam, before), 1e-6) << k;
    EXPECT_LT(slam.landmark_covariance(k).xx, before.landmark_covariance(k).xx) << k;
  }
}

TEST(EkfSlam, OrderOfSightingsOfOneStampIsRounding) {
  const Slam before = driven(4);
  std::vector<Sighting> seen;
  for (int k = 0; k < 5; ++k) {
    seen.push_back(expected(before, k));
    seen.back().range_m += 0.05F * f(k - 2);
    seen.back().bearing_rad -= 0.01F * f(k - 1);
  }
  Pairs pairs{{0, 0}, {1, 1}, {2, 2}, {3, 3}, {4, 4}};
  std::array<SightingRecord, 5> records;
  Slam first = before;
  first.fuse(seen, pairs, 0, records);
  for (const SightingRecord& r : records) EXPECT_EQ(r.verdict, SightingVerdict::kAccepted);
  do {
    Slam slam = before;
    slam.fuse(seen, pairs, 0, records);
    EXPECT_LT(largest_move(slam, first), 2e-5);
    EXPECT_LT((dense(slam) - dense(first)).cwiseAbs().maxCoeff(), 1e-5 * dense(first).cwiseAbs().maxCoeff());
  } while (std::next_permutation(pairs.begin(), pairs.end(),
                                 [](const auto& a, const auto& b) { return a.sighting < b.sighting; }));
  EXPECT_GT(largest_move(first, before), 1e-3);
}

TEST(EkfSlam, RemovingWhatWasAddedLeavesEveryBit) {
  EkfSlam<9> slam;
  slam.start(pose(0, 0, 0), diagonal(0.1, 0.1, 0.1));
  for (int k = 0; k < 8; ++k) ASSERT_EQ(slam.add(sighting(k, 2 + k, 0.3 * k), static_cast<std::uint16_t>(k), 0), k);
  const auto before = slam.covariance();
  ASSERT_EQ(slam.add(sighting(8, 3, -1), 8, 0), 8);
  slam.remove(8);
  ASSERT_EQ(slam.covariance().size(), before.size());
  for (int c = 0; c < before.size(); ++c)
    for (int r = 0; r <= c; ++r) EXPECT_EQ(slam.covariance()(r, c), before(r, c));
}

TEST(EkfSlam, CertainLandmarksMakeItTheEkfOfAKnownMap) {
  Drive drive(7);
  Slam slam;
  slam.options.gate = 1e9F;
  slam.start(pose(0, 0, 0), {});
  filter::Ekf<model::PlanarPose> known;
  known.x = pose(0, 0, 0);
  known.p = {};
  for (int k = 0; k < 8; ++k)
    ASSERT_EQ(slam.add(f(kPlaces[k][0]), f(kPlaces[k][1]), {}, static_cast<std::uint16_t>(k), 0), k);
  for (int k = 0; k < 300; ++k) {
    drive.step(0.1, 0.04, 1e-4, 1e-4);
    const model::PlanarIncrement increment{.ds_m = 0.1F, .dyaw_rad = 0.04F, .var_ds = 1e-4F, .var_dyaw = 1e-4F};
    ASSERT_TRUE(slam.predict(increment));
    known.predict(increment);
    const int id = k % 8;
    const auto z = drive.see(kPlaces[id][0], kPlaces[id][1]);
    const auto record = known.update(model::RangeBearing{.range_m = f(z[0]),
                                                         .bearing_rad = f(z[1]),
                                                         .sigma_range_m = 0.1F,
                                                         .sigma_bearing_rad = 0.02F,
                                                         .landmark = {.x = base::Anchored{}.plus(f(kPlaces[id][0])),
                                                                      .y = base::Anchored{}.plus(f(kPlaces[id][1]))},
                                                         .mounting = {}},
                                     1e9F);
    static_cast<void>(record);
    fuse(slam, sighting(id, z[0], z[1]));
  }
  // The exponential map differs from a sum of corrections by their product: half the correction in yaw times the step.
  EXPECT_NEAR(east(slam.pose().x), east(known.x.x), 2e-3);
  EXPECT_NEAR(east(slam.pose().y), east(known.x.y), 2e-3);
  EXPECT_NEAR(slam.pose().yaw_rad, known.x.yaw_rad, 1e-3F);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(slam.pose_covariance()(i, i) / known.p(i, i), 1, 0.02) << i;
  for (int k = 0; k < 8; ++k) EXPECT_LT(std::abs(east(slam.map()[k].place.x) - kPlaces[k][0]), 1e-5);
}

TEST(EkfSlam, CovarianceStaysPositiveDefiniteAtRest) {
  std::mt19937 random(8);
  std::normal_distribution<double> normal;
  Slam slam = driven(8);
  std::vector<Sighting> ideal;
  for (int k = 0; k < 8; ++k) ideal.push_back(expected(slam, k));
  for (int k = 0; k < 20'000; ++k) {
    Sighting seen = ideal[at(k % 8)];
    seen.range_m += f(0.1 * normal(random));
    seen.bearing_rad += f(0.02 * normal(random));
    fuse(slam, seen);
    if (k % 1000 != 0) continue;
    const Eigen::MatrixXd p = dense(slam);
    const Eigen::VectorXd scale = p.diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd unit = scale.asDiagonal() * p * scale.asDiagonal();
    ASSERT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(unit).eigenvalues()(0), 0) << k;
  }
}

TEST(EkfSlam, SetPoseMovesRobotAndMapAsOne) {
  const Slam before = driven(9);
  Slam slam = before;
  const auto p = diagonal(0.4, 0.3, 0.2);
  slam.set_pose(pose(100, -50, 2.5), p);
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r <= c; ++r) EXPECT_NEAR(slam.pose_covariance()(r, c), p(r, c), 1e-6F);
  for (int k = 0; k < 8; ++k) {
    const Sighting was = expected(before, k), is = expected(slam, k);
    EXPECT_NEAR(is.range_m, was.range_m, 1e-4F) << k;
    EXPECT_NEAR(base::wrap_angle(is.bearing_rad - was.bearing_rad), 0, 1e-4F) << k;
    Sighting seen = was;
    seen.range_m += 0.2F;
    const SightingRecord old = before.compare(seen, k), now = slam.compare(seen, k);
    EXPECT_NEAR(now.nis, old.nis, 0.02F * (1 + old.nis)) << k;
    EXPECT_NEAR(now.s.xx, old.s.xx, 1e-4F);
    EXPECT_NEAR(now.s.yy, old.s.yy, 1e-4F);
  }
  EXPECT_GT(slam.landmark_covariance(0).xx, 0.1F);  // the new pose's uncertainty has reached the map
  const Eigen::VectorXd eigen = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(dense(slam)).eigenvalues();
  EXPECT_GT(eigen(0), -1e-5);
}

TEST(EkfSlam, CapacityIsDefined) {
  EkfSlam<1> one;
  one.start(pose(0, 0, 0), diagonal(0.1, 0.1, 0.1));
  ASSERT_EQ(one.add(sighting(3, 2, 0), 3, 10), 0);
  ASSERT_EQ(one.add(sighting(4, 2, 1), 4, 20), 0);  // an unconfirmed landmark gives way
  EXPECT_EQ(one.map()[0].id, 4);
  for (int k = 0; k < 2; ++k) {
    const Sighting seen = sighting(4, 2, 1);
    const EkfSlam<1>::Pair pair{0, 0};
    SightingRecord record;
    one.fuse({&seen, 1}, {&pair, 1}, 30, {&record, 1});
  }
  const auto p = one.covariance();
  EXPECT_EQ(one.add(sighting(5, 2, -1), 5, 40), EkfSlam<1>::Map::kNone);  // a confirmed one does not
  EXPECT_EQ(one.counts().no_room, 1U);
  for (int c = 0; c < 5; ++c)
    for (int r = 0; r <= c; ++r) EXPECT_EQ(one.covariance()(r, c), p(r, c));
  one.options.when_full = WhenFull::kReplaceOldest;
  EXPECT_EQ(one.add(sighting(5, 2, -1), 5, 40), 0);
  EXPECT_EQ(one.map()[0].id, 5);
}

TEST(EkfSlam, FullThenSetPoseThenResetInOneTick) {
  Slam slam = driven(11);
  ASSERT_TRUE(slam.map().full());
  slam.set_pose(pose(1, 2, 3), diagonal(0.1, 0.1, 0.1));
  slam.reset_map();
  EXPECT_EQ(slam.map().size(), 0);
  EXPECT_EQ(slam.covariance().size(), 3);
  EXPECT_NEAR(slam.pose_covariance()(2, 2), 0.01F, 1e-6F);
  for (int k = 0; k < 8; ++k) ASSERT_EQ(slam.add(sighting(k, 2 + k, 0.1 * k), static_cast<std::uint16_t>(k), 0), k);
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(dense(slam)).eigenvalues()(0), 0);
}

TEST(EkfSlam, AnOutlierIsNamedAndChangesNothing) {
  const Slam before = driven(12);
  Slam slam = before;
  Sighting far = expected(before, 2);
  far.range_m += 5.0F;
  fuse(slam, far);
  EXPECT_EQ(slam.counts().rejected, before.counts().rejected + 1);
  EXPECT_EQ(largest_move(slam, before), 0);
  // Possible by itself while the heading is unknown, impossible beside a sighting that settles the heading.
  slam.set_pose(slam.pose(), diagonal(0.1, 0.1, 0.1));
  ASSERT_TRUE(slam.predict({.var_dyaw = 0.09F}));
  std::array<Sighting, 2> seen{expected(slam, 0), expected(slam, 1)};
  seen[1].bearing_rad += 0.5F;
  const std::array<Slam::Pair, 2> pairs{{{0, 0}, {1, 1}}};
  std::array<SightingRecord, 2> records;
  slam.fuse(seen, pairs, 0, records);
  EXPECT_EQ(records[0].verdict, SightingVerdict::kAccepted);
  EXPECT_EQ(records[1].verdict, SightingVerdict::kOutlier);
  EXPECT_LT(records[1].nis, slam.options.gate);
}

TEST(EkfSlam, RepeatedSightingsFromOnePlaceCountOnce) {
  Slam slam = driven(13);
  slam.options.correlation_m = 0.1F;
  Slam moving = slam;
  const Sighting seen = expected(slam, 0);
  fuse(slam, seen);
  fuse(moving, seen);
  const float once = slam.compare(seen, 0).s.xx;
  for (int k = 0; k < 20; ++k) fuse(slam, seen);
  const float noise = slam.options.noise.range_variance(seen.range_m);
  EXPECT_GT(slam.compare(seen, 0).s.xx - noise, 0.6F * (once - noise));
  moving.options.correlation_m = 0;
  for (int k = 0; k < 20; ++k) fuse(moving, seen);
  EXPECT_LT(moving.compare(seen, 0).s.xx - noise, 0.4F * (once - noise));
}

TEST(EkfSlam, HostileIncrementsAndSightingsLeaveNumbers) {
  for (const float bad : test::kHostile) {
    Slam slam = driven(14);
    const model::PlanarIncrement increments[] = {{.ds_m = bad}, {.dyaw_rad = bad}, {.var_ds = bad}, {.var_dyaw = bad}};
    for (const auto& increment : increments) static_cast<void>(slam.predict(increment));
    Sighting seen = expected(slam, 1);
    seen.range_m = bad;
    if (seen.valid()) fuse(slam, seen);
    seen = expected(slam, 1);
    seen.bearing_rad = bad;
    if (seen.valid()) fuse(slam, seen);
    EXPECT_TRUE(slam.pose().finite()) << bad;
    EXPECT_TRUE(slam.pose_covariance().bounded()) << bad;
    EXPECT_TRUE(dense(slam).allFinite()) << bad;
  }
}

// 30 landmarks belong into an image of 64 kB of data.
static_assert(sizeof(EkfSlam<30>) < 16 * 1024);

}  // namespace
}  // namespace tetap::slam
