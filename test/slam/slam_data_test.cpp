// SPDX-License-Identifier: Apache-2.0
// EKF-SLAM and FastSLAM on MRCLAM, data set 7: identities known, map unknown, start given, one configuration for all
// robots. The trajectory is aligned by the rigid motion that fits the map's landmarks. The choice of the numbers, and
// the result of leaving one robot out, are in docs/explanation/ekf_slam.md.
#include "config/mrclam_fast.hpp"
#include "mrclam_slam.hpp"
#include "tetap/filter/ekf.hpp"
#include "tetap/model/range_bearing.hpp"
#include "tetap/slam/ekf_mapper.hpp"
#include "tetap/slam/fast_slam.hpp"

#include <gtest/gtest.h>
#include <cmath>
#include <functional>
#include <map>
#include <vector>

namespace tetap::slam {
namespace {

using test::d, test::f, test::figures_of, test::Figures, test::increment_of, test::Mrclam, test::Point,
    test::sighting_of, test::start_of, test::Track;

constexpr const param::Parameters& kSlam = robot::mrclam_slam::parameters;
constexpr const param::Parameters& kFast = robot::mrclam_fast::parameters;

using Mapper = EkfMapper<15>;
Mapper mapper_for(const Mrclam& run) {
  Mapper mapper;
  mapper.core.options.noise = test::noise_of(kSlam.landmark);
  mapper.core.options.correlation_m = kSlam.mapping.correlation_m;
  mapper.start(start_of(run), filter::Symmetric<float, 3>::diagonal({4e-4F, 4e-4F, 4e-4F}));
  return mapper;
}
Track ekf_track(const Mrclam& run, Mapper& mapper) {
  Track track;
  run.drive(
      run.end_s(),
      [&](const Mrclam::Command& command, double dt_s) {
        EXPECT_TRUE(mapper.predict(increment_of(command, dt_s, kSlam.wheels)));
      },
      [&](const std::vector<Mrclam::Sighting>& seen) {
        std::vector<Sighting> sightings;
        for (const auto& one : seen) sightings.push_back(sighting_of(one));
        mapper.update(sightings, static_cast<std::int64_t>(seen[0].t_s * 1e6));
      },
      [&](double t_s) {
        const auto& pose = mapper.core.pose();
        track.add(run, t_s, d(pose.x.minus({})), d(pose.y.minus({})), d(pose.yaw_rad), mapper.core.pose_covariance());
      });
  for (int k = 0; k < mapper.core.map().size(); ++k) {
    const MapLandmark& landmark = mapper.core.map()[k];
    track.map[landmark.id] = {d(landmark.place.x.minus({})), d(landmark.place.y.minus({}))};
  }
  return track;
}

class RecordedSlam : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = test::recorded_folder("mrclam/MRCLAM_Dataset7");
    if (folder_.empty()) GTEST_SKIP() << "no mrclam/MRCLAM_Dataset7 in $TETAP_DATA";
  }
  std::string folder_;
};

TEST_F(RecordedSlam, EkfMapsFiveRobotsWithOneConfiguration) {
  constexpr double kTrajectory[] = {0.36, 0.158, 0.20, 0.36, 0.18}, kMap[] = {0.07, 0.05, 0.10, 0.11, 0.085};
  for (int robot = 1; robot <= 5; ++robot) {
    const Mrclam run(folder_, robot);
    Mapper mapper = mapper_for(run);
    const Track track = ekf_track(run, mapper);
    const Figures figures = figures_of(track, run);
    std::printf("EKF-SLAM, robot %d: %.3f m, map %.3f m, NEES %.1f\n", robot, figures.trajectory_m, figures.map_m,
                figures.nees);
    EXPECT_EQ(track.map.size(), 15U);
    EXPECT_LE(figures.trajectory_m, kTrajectory[robot - 1]) << robot;
    EXPECT_LE(figures.map_m, kMap[robot - 1]) << robot;
    EXPECT_LE(figures.nees, 5) << robot;
    EXPECT_GT(figures.nees, 0.5) << robot;
  }
}

/// Position error of an EKF on a map that is given, aligned by nothing.
double localised_m(const Mrclam& run, const std::map<int, model::Landmark>& map, const model::PlanarPose& start,
                   const std::function<Point(Point)>& to_truth) {
  filter::Ekf<model::PlanarPose> ekf;
  ekf.x = start;
  ekf.p = filter::Symmetric<float, 3>::diagonal({4e-4F, 4e-4F, 4e-4F});
  const SightingNoise noise = test::noise_of(kSlam.landmark);
  double squares = 0;
  int looks = 0;
  run.drive(
      run.end_s(),
      [&](const Mrclam::Command& command, double dt_s) { ekf.predict(increment_of(command, dt_s, kSlam.wheels)); },
      [&](const std::vector<Mrclam::Sighting>& seen) {
        for (const auto& one : seen) {
          const Sighting corrected = sighting_of(one);
          static_cast<void>(
              ekf.update(model::RangeBearing{.range_m = corrected.range_m,
                                             .bearing_rad = corrected.bearing_rad,
                                             .sigma_range_m = base::sqrt(noise.range_variance(corrected.range_m)),
                                             .sigma_bearing_rad = noise.sigma_bearing_rad,
                                             .landmark = map.at(one.barcode),
                                             .mounting = {}},
                         13.8F));
        }
      },
      [&](double t_s) {
        Mrclam::Pose truth{};
        if (!run.truth_at(t_s, truth)) return;
        const Point at = to_truth({d(ekf.x.x.minus({})), d(ekf.x.y.minus({}))});
        squares += std::pow(at.x - truth.x_m, 2) + std::pow(at.y - truth.y_m, 2);
        ++looks;
      });
  return std::sqrt(squares / looks);
}

TEST_F(RecordedSlam, ItsMapIsTheNextRobotsKnownMap) {
  for (int robot = 2; robot <= 5; ++robot) {
    const Mrclam run(folder_, robot);
    Mapper mapper = mapper_for(run);
    static_cast<void>(ekf_track(run, mapper));
    std::map<int, model::Landmark> given, own;
    double dot = 0, cross = 0;
    Point from{}, to{};
    for (int k = 0; k < 15; ++k) {
      const MapLandmark& landmark = mapper.core.map()[k];
      const auto& place = run.landmarks.at(landmark.id);
      own[landmark.id] = landmark.place;
      given[landmark.id] = {.x = base::Anchored{}.plus(f(place[0])), .y = base::Anchored{}.plus(f(place[1]))};
      from.x += d(landmark.place.x.minus({})) / 15, from.y += d(landmark.place.y.minus({})) / 15;
      to.x += place[0] / 15, to.y += place[1] / 15;
    }
    for (const auto& [id, landmark] : own) {
      const double ex = d(landmark.x.minus({})) - from.x, ey = d(landmark.y.minus({})) - from.y;
      const double tx = run.landmarks.at(id)[0] - to.x, ty = run.landmarks.at(id)[1] - to.y;
      dot += ex * tx + ey * ty, cross += ex * ty - ey * tx;
    }
    const double turn = std::atan2(cross, dot), c = std::cos(turn), s = std::sin(turn);
    const double dx = run.start().x_m - to.x, dy = run.start().y_m - to.y;  // the start in the map's frame
    const model::PlanarPose start{.x = base::Anchored{}.plus(f(from.x + c * dx + s * dy)),
                                  .y = base::Anchored{}.plus(f(from.y - s * dx + c * dy)),
                                  .yaw_rad = base::wrap_angle(f(run.start().yaw_rad - turn))};
    const double on_given_m = localised_m(run, given, start_of(run), [](Point p) { return p; });
    const double on_own_m = localised_m(run, own, start, [&](Point p) {
      const double ex = p.x - from.x, ey = p.y - from.y;
      return Point{to.x + c * ex - s * ey, to.y + s * ex + c * ey};
    });
    std::printf("robot %d localised: %.3f m on the given map, %.3f m on its own\n", robot, on_given_m, on_own_m);
    EXPECT_LE(on_own_m, 1.1 * on_given_m) << robot;
    EXPECT_GT(on_own_m, 0.5 * on_given_m) << robot;
  }
}

Figures fast_figures(const Mrclam& run, std::uint32_t seed) {
  static FastSlam<100, 15> slam;
  slam = FastSlam<100, 15>({seed, 7});
  slam.options.noise = test::noise_of(kFast.landmark);
  slam.options.correlation_m = kFast.mapping.correlation_m;
  slam.options.resample_below = kFast.mapping.resample_share;
  slam.start({.x_m = f(run.start().x_m), .y_m = f(run.start().y_m), .yaw_rad = f(run.start().yaw_rad)}, 0.02F, 0.02F);
  Track track;
  run.drive(
      run.end_s(),
      [&](const Mrclam::Command& command, double dt_s) {
        EXPECT_TRUE(slam.predict(increment_of(command, dt_s, kFast.wheels)));
      },
      [&](const std::vector<Mrclam::Sighting>& seen) {
        std::vector<Sighting> sightings;
        for (const auto& one : seen) sightings.push_back(sighting_of(one));
        slam.update(sightings);
      },
      [&](double t_s) {
        auto estimate = slam.estimate();
        estimate.p.add_diagonal({1e-8F, 1e-8F, 1e-8F});
        track.add(run, t_s, d(estimate.pose.x_m), d(estimate.pose.y_m), d(estimate.pose.yaw_rad), estimate.p);
      });
  for (int k = 0; k < slam.landmarks(); ++k) {
    const auto& landmark = slam.best().landmarks[static_cast<std::size_t>(k)];
    track.map[slam.id(k)] = {d(landmark.x_m), d(landmark.y_m)};
  }
  return figures_of(track, run);
}

TEST_F(RecordedSlam, FastSlamMapsFiveRobotsWithAHundredParticles) {
  constexpr double kTrajectory[] = {0.30, 0.19, 0.23, 0.42, 0.20};
  for (int robot = 1; robot <= 5; ++robot) {
    const Mrclam run(folder_, robot);
    double mean = 0, worst = 0, nees = 0;
    for (std::uint32_t seed = 1; seed <= 8; ++seed) {
      const Figures figures = fast_figures(run, seed);
      mean += figures.trajectory_m / 8, nees += figures.nees / 8;
      worst = std::max(worst, figures.trajectory_m);
    }
    std::printf("FastSLAM 2, robot %d: mean %.3f m, worst %.3f m, NEES %.0f\n", robot, mean, worst, nees);
    EXPECT_LE(mean, kTrajectory[robot - 1]) << robot;
    EXPECT_LE(worst, 2 * mean) << robot;
    EXPECT_GT(nees, 5) << robot;  // the page about FastSLAM says that it is not consistent
  }
}

}  // namespace
}  // namespace tetap::slam
