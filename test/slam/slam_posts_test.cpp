// SPDX-License-Identifier: Apache-2.0
// EKF-SLAM on MRCLAM, data set 7, without identities. The 15 barcodes stand on 6 posts, whose barcodes are 0.2 m apart
// and cannot be told from each other: landmarks are scored by post.
#include "mrclam_slam.hpp"
#include "tetap/slam/ekf_mapper.hpp"

#include <gtest/gtest.h>
#include <algorithm>
#include <map>
#include <vector>

namespace tetap::slam {
namespace {

using test::d, test::f, test::Mrclam;

/// The run with posts for landmarks, at the mean place of their barcodes.
struct Posts {
  Mrclam run;
  std::map<int, int> post_of;  ///< by barcode
  explicit Posts(const Mrclam& barcodes) : run(barcodes) {
    std::map<int, std::array<double, 3>> sums;
    for (const auto& [barcode, place] : barcodes.landmarks) {
      for (const auto& [other, post] : post_of) {
        const auto& there = barcodes.landmarks.at(other);
        if (std::hypot(place[0] - there[0], place[1] - there[1]) < 0.5) post_of[barcode] = post;
      }
      if (post_of.count(barcode) == 0) post_of[barcode] = static_cast<int>(sums.size());
      auto& sum = sums[post_of[barcode]];
      sum[0] += place[0], sum[1] += place[1], sum[2] += 1;
    }
    run.landmarks.clear();
    for (const auto& [post, sum] : sums) run.landmarks[post] = {sum[0] / sum[2], sum[1] / sum[2]};
  }
};

struct Scored {
  test::Figures figures;
  double wrong = 0;   ///< share of the fused sightings that are of another post than most of their landmark's
  double silent = 0;  ///< share of the time beyond 3 sigma without an ambiguous sighting in the last 5 s
};
enum class Ids { kKnown, kWithheld };
using Mapper = EkfMapper<12>;

Scored map_posts(const Mrclam& barcodes, Ids ids) {
  const Posts posts(barcodes);
  Mapper mapper;
  mapper.core.options.noise = {.sigma_range_m = 0.05F, .sigma_range_per_m = 0.03F, .sigma_bearing_rad = 0.02F};
  mapper.core.options.correlation_m = 0.1F;
  mapper.options.method = AssociationMethod::kJoint;
  mapper.options.gate = 5;
  mapper.start(test::start_of(barcodes), filter::Symmetric<float, 3>::diagonal({4e-4F, 4e-4F, 4e-4F}));
  test::Track track;
  std::map<int, int> lives;  // of a landmark's number, which is given again after the landmark was removed
  std::map<std::array<int, 2>, std::map<int, int>> votes;
  double ambiguous_s = -1e9, silent = 0;
  barcodes.drive(
      barcodes.end_s(),
      [&](const Mrclam::Command& command, double dt_s) {
        EXPECT_TRUE(mapper.predict(test::increment_of(command, dt_s, robot::mrclam_slam::parameters.wheels)));
      },
      [&](const std::vector<Mrclam::Sighting>& seen) {
        std::vector<Sighting> sightings;
        for (const auto& one : seen) {
          sightings.push_back(test::sighting_of(one));
          sightings.back().id =
              ids == Ids::kKnown ? static_cast<std::uint16_t>(posts.post_of.at(one.barcode)) : Sighting::kNoId;
        }
        const auto records = mapper.update(sightings, static_cast<std::int64_t>(seen[0].t_s * 1e6));
        for (std::size_t i = 0; i < records.size(); ++i) {
          const SightingVerdict verdict = records[i].verdict;
          if (verdict == SightingVerdict::kAmbiguous) ambiguous_s = seen[i].t_s;
          if (verdict == SightingVerdict::kNewLandmark) ++lives[records[i].id];
          if (verdict == SightingVerdict::kNewLandmark || verdict == SightingVerdict::kAccepted)
            ++votes[{records[i].id, lives[records[i].id]}][posts.post_of.at(seen[i].barcode)];
        }
      },
      [&](double t_s) {
        const auto& pose = mapper.core.pose();
        const double before = track.nees;
        track.add(posts.run, t_s, d(pose.x.minus({})), d(pose.y.minus({})), d(pose.yaw_rad),
                  mapper.core.pose_covariance());
        if (track.nees - before > 14.16 && t_s - ambiguous_s > 5) silent += 1;  // chi-square of 3, 99.73 %
      });
  double fused = 0;
  Scored scored;
  std::map<std::array<int, 2>, int> most;
  for (const auto& [landmark, of_post] : votes) {
    const auto best =
        std::max_element(of_post.begin(), of_post.end(), [](auto& a, auto& b) { return a.second < b.second; });
    most[landmark] = best->first;
    for (const auto& [post, count] : of_post) fused += count, scored.wrong += post == best->first ? 0 : count;
  }
  std::map<int, int> hits;  // a post that has two landmarks is where the one with more sightings is
  for (int k = 0; k < mapper.core.map().size(); ++k) {
    const MapLandmark& landmark = mapper.core.map()[k];
    const int post = most[{landmark.id, lives[landmark.id]}];
    if (landmark.hits < 3 || landmark.hits <= hits[post]) continue;
    hits[post] = landmark.hits;
    track.map[post] = {d(landmark.place.x.minus({})), d(landmark.place.y.minus({}))};
  }
  scored.figures = test::figures_of(track, posts.run);
  scored.wrong /= fused, scored.silent = silent / track.looks;
  return scored;
}

TEST(RecordedPosts, MapsWithoutIdentities) {
  const std::string folder = test::recorded_folder("mrclam/MRCLAM_Dataset7");
  if (folder.empty()) GTEST_SKIP() << "no mrclam/MRCLAM_Dataset7 in $TETAP_DATA";
  for (int robot = 1; robot <= 5; ++robot) {
    const Mrclam run(folder, robot);
    const Scored known = map_posts(run, Ids::kKnown), withheld = map_posts(run, Ids::kWithheld);
    std::printf("posts, robot %d: %.3f m with identities, %.3f m without, %.1f %% wrong, %.1f %% silent, NEES %.1f\n",
                robot, known.figures.trajectory_m, withheld.figures.trajectory_m, 100 * withheld.wrong,
                100 * withheld.silent, withheld.figures.nees);
    EXPECT_EQ(known.wrong, 0) << robot;
    EXPECT_LE(withheld.silent, 0.01) << robot;
    // Robots 3 and 4: docs/validation/shortfalls.md.
    EXPECT_LT(withheld.wrong, robot == 4 ? 0.07 : 0.03) << robot;
    EXPECT_LE(withheld.figures.trajectory_m, (robot == 3 ? 1.25 : 1.15) * known.figures.trajectory_m) << robot;
    EXPECT_GT(withheld.figures.trajectory_m, 0.8 * known.figures.trajectory_m) << robot;
  }
}

}  // namespace
}  // namespace tetap::slam
