// SPDX-License-Identifier: Apache-2.0
// The camera projects as Eigen's rotations say, sees no point behind a wall, and follows a point as long as it says.
#include "sim_host/world/feature_camera.hpp"

#include "sim_host/world/floor_plan.hpp"
#include "test/sim/support.hpp"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <tuple>
#include <vector>

namespace tetap::sim {
namespace {

FeatureCameraNumbers exact() {
  FeatureCameraNumbers n{.rate_hz = 10};
  n.mount_sigma_rad = n.noise_px = n.wrong_probability = n.loss_probability = 0;
  return n;
}

struct Scene {
  explicit Scene(FeatureCameraNumbers numbers = exact(), Course of = lab_course(1), std::vector<FaultSetting> set = {},
                 PeopleNumbers people = {})
      : course{std::move(of)},
        plan{course, {.speed_mps = 1}},
        surroundings{course, plan, people, 1},
        camera{numbers, surroundings, 1},
        faults{std::move(set)} {}
  [[nodiscard]] Truth truth(base::Micros now) const {
    const PathPoint at = plan.path(plan.at(now).s_m);
    return {.x_m = at.x_m, .y_m = at.y_m, .yaw_rad = wrap(at.yaw_rad)};
  }
  /// f(time, image) of each image from 6 s on.
  template <class F>
  void drive(double seconds, F&& f) {
    for (base::Micros now = seconds_us(6); now < seconds_us(6 + seconds); now += base::Micros{100'000})
      if (const auto image = camera.sample(truth(now), now, faults)) f(now, *image);
  }
  /// Distance of a feature from that point of the map, in the image.
  [[nodiscard]] double off_px(const ImageFeature& f, std::size_t point, base::Micros now) const {
    const auto at = camera.project(surroundings.points()[point].at_m, truth(now));
    return at ? std::hypot(at->u_px - f.u * 0.25, at->v_px - f.v * 0.25) : 1e9;
  }
  [[nodiscard]] std::size_t nearest(const ImageFeature& f, base::Micros now) const {
    std::size_t best = 0;
    for (std::size_t i = 0; i < surroundings.points().size(); ++i)
      if (off_px(f, i, now) < off_px(f, best, now)) best = i;
    return best;
  }
  Course course;
  Plan plan;
  Surroundings surroundings;
  FeatureCamera camera;
  Faults faults;
};

TEST(FeatureCamera, projects_as_rotations_of_another_library_say) {
  FeatureCameraNumbers n = exact();
  n.x_b_m = 0.3, n.y_b_m = -0.1, n.z_b_m = 0.8;
  n.mounting_bc = {{0, -std::sin(0.2), std::cos(0.2), -1, 0, 0, 0, -std::cos(0.2), -std::sin(0.2)}};  // tilted down
  const Scene scene{n};
  const Truth truth{.x_m = 12, .y_m = 8, .z_m = 0.1, .roll_rad = 0.05, .pitch_rad = -0.08, .yaw_rad = 2.5};
  using Eigen::AngleAxisd, Eigen::Vector3d;
  const Eigen::Quaterniond q_nb =
      AngleAxisd(2.5, Vector3d::UnitZ()) * AngleAxisd(-0.08, Vector3d::UnitY()) * AngleAxisd(0.05, Vector3d::UnitX());
  // From the body's axes to the camera's: the tilt about y, then z ahead and x to the right.
  const Eigen::Quaterniond q_bc = AngleAxisd(0.2, Vector3d::UnitY()) *
                                  AngleAxisd(-std::numbers::pi / 2, Vector3d::UnitZ()) *
                                  AngleAxisd(-std::numbers::pi / 2, Vector3d::UnitX());
  const Vector3d eye = Vector3d{12, 8, 0.1} + q_nb * Vector3d{0.3, -0.1, 0.8};
  int in_sight = 0;
  for (const MapPoint& point : scene.surroundings.points()) {
    const Vector3d p = (q_nb * q_bc).inverse() * (Vector3d{point.at_m[0], point.at_m[1], point.at_m[2]} - eye);
    const double across = std::atan2(p.x(), p.z()), down = std::atan2(p.y(), p.z());
    const double u = 375.5 + 460 * std::tan(across), v = 239.5 + 460 * std::tan(down);
    const bool visible = p.z() >= 0.5 && p.z() <= 30 && u >= 0 && u <= 751 && v >= 0 && v <= 479;
    const auto at = scene.camera.project(point.at_m, truth);
    ASSERT_EQ(at.has_value(), visible);
    if (!at) continue;
    EXPECT_NEAR(at->u_px, u, 1e-9);
    EXPECT_NEAR(at->v_px, v, 1e-9);
    ++in_sight;
  }
  EXPECT_GT(in_sight, 100);
}

/// Whether a whole wall is between camera and point in plan: the ends of each line are on two sides of the other.
bool hidden(const Scene& scene, const Truth& t, std::size_t point) {
  const double ex = t.x_m + 0.2 * std::cos(t.yaw_rad), ey = t.y_m + 0.2 * std::sin(t.yaw_rad);
  const Vector3& p = scene.surroundings.points()[point].at_m;
  const auto left = [](double ax, double ay, double bx, double by, double cx, double cy) {
    return (bx - ax) * (cy - ay) - (by - ay) * (cx - ax) > 0;
  };
  const auto walls = scene.surroundings.walls();
  return std::any_of(walls.begin(), walls.end(), [&](const Wall& w) {
    if (w.high_m < 2.5 || w.surface == Surface::kGlass) return false;  // one may look over and through those
    const auto& [ax, ay, bx, by] = std::tie(w.from_x_m, w.from_y_m, w.to_x_m, w.to_y_m);
    return left(ex, ey, p[0], p[1], ax, ay) != left(ex, ey, p[0], p[1], bx, by) &&
           left(ax, ay, bx, by, ex, ey) != left(ax, ay, bx, by, p[0], p[1]);
  });
}

TEST(FeatureCamera, a_track_stays_on_one_point_in_sight_and_ends_within_its_life) {
  Scene scene;
  struct Seen {
    std::vector<std::size_t> points;  ///< points of the map that it may be
    base::Micros begun, latest;
  };
  std::map<std::uint16_t, Seen> tracks;
  std::size_t features = 0, images = 0;
  scene.drive(40, [&](base::Micros now, const FeatureCamera::Image& image) {
    std::set<std::uint16_t> ids;
    for (const ImageFeature& f : image.features) {
      EXPECT_TRUE(ids.insert(f.track).second);
      const auto [track, fresh] = tracks.try_emplace(f.track, Seen{{}, now, now});
      Seen& seen = track->second;
      if (fresh)
        for (std::size_t i = 0; i < scene.surroundings.points().size(); ++i) seen.points.push_back(i);
      else
        EXPECT_EQ((now - seen.latest).us, 100'000) << "without a gap";
      seen.latest = now;
      EXPECT_LE((now - seen.begun).us, 3'000'000);
      // Half a step of the bus in each axis, and no wall in between.
      std::erase_if(seen.points, [&](std::size_t point) {
        return scene.off_px(f, point, now) > 0.18 || hidden(scene, scene.truth(now), point);
      });
      EXPECT_FALSE(seen.points.empty()) << f.track;
    }
    features += image.features.size(), ++images;
  });
  EXPECT_EQ(images, 400U);
  EXPECT_GT(features, 33 * images);
  EXPECT_GT(tracks.size(), 40U * 40 / 3) << "no track outlives 3 s";
  EXPECT_LT(tracks.size(), 4'000U);
}

TEST(FeatureCamera, noise_wrong_matches_and_losses_are_as_stated) {
  FeatureCameraNumbers n = exact();
  n.noise_px = 1, n.wrong_probability = 0.05, n.loss_probability = 0.02;
  n.life_min_s = n.life_max_s = 1e4;
  Scene noisy{n, parked_course(100)}, clean{[&] {
                                              FeatureCameraNumbers same = n;
                                              same.noise_px = same.wrong_probability = 0;
                                              return same;
                                            }(),
                                            parked_course(100)};
  std::map<std::pair<std::int64_t, std::uint16_t>, ImageFeature> right;
  clean.drive(90, [&](base::Micros now, const auto& image) {
    for (const ImageFeature& f : image.features) right[{now.us, f.track}] = f;
  });
  std::vector<double> errors;
  std::set<std::uint16_t> tracks;
  double wrong = 0, all = 0;
  noisy.drive(90, [&](base::Micros now, const auto& image) {
    for (const ImageFeature& f : image.features) {
      tracks.insert(f.track);
      const ImageFeature& r = right.at({now.us, f.track});
      const double u = (f.u - r.u) * 0.25, v = (f.v - r.v) * 0.25;
      ++all;
      if (std::hypot(u, v) > 6)
        ++wrong;
      else
        errors.push_back(u), errors.push_back(v);
    }
  });
  ASSERT_GT(all, 20'000);
  const Statistics s = statistics(errors);
  EXPECT_NEAR(s.mean, 0, 0.03);
  EXPECT_NEAR(s.variance, 1, 0.06);
  EXPECT_NEAR(wrong / all, 0.05, 0.006) << "less those that fall near or outside";
  EXPECT_NEAR(static_cast<double>(tracks.size()) / all, 0.02, 0.003);
}

TEST(FeatureCamera, recognises_landmarks_by_their_ids_within_its_range) {
  FeatureCameraNumbers n = exact();
  n.recognise = true, n.miss_probability = 0, n.wrong_id_probability = 0.1;
  Scene scene{n, loop_course(100, 1, 63)};
  double wrong = 0, all = 0;
  scene.drive(60, [&](base::Micros now, const FeatureCamera::Image& image) {
    for (const ImageFeature& f : image.recognised) {
      ASSERT_GE(f.track, 1);
      ASSERT_LE(f.track, 63);
      wrong += scene.off_px(f, f.track - 1U, now) > 0.18 ? 1 : 0;
      ++all;
    }
  });
  EXPECT_GT(all, 1'000);
  EXPECT_NEAR(wrong / all, 0.1 * 62 / 63, 0.03);
}

TEST(FeatureCamera, people_are_followed_too_and_walk) {
  Scene scene{exact(), parked_course(100), {}, {.count = 40, .way_m = 20}};
  int moving = 0;
  scene.drive(10, [&](base::Micros now, const FeatureCamera::Image& image) {
    for (const ImageFeature& f : image.features) moving += scene.off_px(f, scene.nearest(f, now), now) > 0.2 ? 1 : 0;
  });
  EXPECT_GT(moving, 20);
}

/// Images of a faulty run and of one without, at the same times.
struct Both {
  std::map<std::int64_t, FeatureCamera::Image> right, wrong;
  explicit Both(Fault fault) {
    Scene a{}, b{exact(), lab_course(1), {{fault, {}, seconds_us(100)}}};
    a.drive(20, [&](base::Micros t, const auto& image) { right[t.us] = image; });
    b.drive(20, [&](base::Micros t, const auto& image) { wrong[t.us] = image; });
  }
};

TEST(FeatureCameraFaults, a_mirror_a_quarter_turn_and_a_longer_lens_move_every_feature_alike) {
  const auto check = [](Fault fault, auto&& formula) {
    const Both both{fault};
    int n = 0;
    for (const auto& [t, image] : both.wrong)
      for (const ImageFeature& f : image.features)
        for (const ImageFeature& r : both.right.at(t).features) {
          if (f.track != r.track) continue;
          const auto [u, v] = formula(r.u * 0.25 - 375.5, r.v * 0.25 - 239.5);
          EXPECT_NEAR(f.u * 0.25, 375.5 + u, 0.126);
          EXPECT_NEAR(f.v * 0.25, 239.5 + v, 0.126);
          ++n;
        }
    EXPECT_GT(n, 3'000);
  };
  check(Fault::kImagesMirrored, [](double u, double v) { return std::pair{-u, v}; });
  check(Fault::kImagesTurned, [](double u, double v) { return std::pair{-v, u}; });
  check(Fault::kFocalLength, [](double u, double v) { return std::pair{1.2 * u, 1.2 * v}; });
}

TEST(FeatureCameraFaults, swapped_tracks_lost_images_and_torn_ones_are_as_many_as_said) {
  const Both swapped{Fault::kTracksSwapped}, lost{Fault::kImagesLost};
  int images = 0;
  for (const auto& [t, image] : swapped.wrong) {
    int changed = 0;
    ASSERT_EQ(image.features.size(), swapped.right.at(t).features.size());
    for (std::size_t i = 0; i < image.features.size(); ++i)
      changed += image.features[i].track != swapped.right.at(t).features[i].track ? 1 : 0;
    EXPECT_TRUE(changed == 0 || changed == static_cast<int>(image.features.size() / 2 * 2)) << changed;
    images += changed > 0 ? 1 : 0;
  }
  EXPECT_EQ(images, 100);
  EXPECT_EQ(lost.wrong.size(), 100U);
  int torn = 0;
  for (const auto& [t, image] : lost.wrong) torn += image.torn ? 1 : 0;
  EXPECT_EQ(torn, 50);
}

TEST(FeatureCameraFaults, a_lorry_takes_all_features_and_a_moving_body_its_share) {
  for (const auto& [fault, share] : {std::pair{Fault::kLorry, 1.0}, {Fault::kMovingFeatures, 0.3}}) {
    Scene scene{exact(), lab_course(1), {{fault, seconds_us(8), seconds_us(5)}}};
    const bool all_of_it = fault == Fault::kLorry;
    double on_it = 0, all = 0, after = 0, apart = 0;
    std::map<std::uint16_t, double> column;
    scene.drive(12, [&](base::Micros now, const FeatureCamera::Image& image) {
      const bool on = now >= seconds_us(8) && now < seconds_us(13);
      for (const ImageFeature& f : image.features) {
        const bool moving = scene.off_px(f, scene.nearest(f, now), now) > 0.2;
        (on ? on_it : after) += moving ? 1 : 0;
        all += on ? 1 : 0;
        if (on && moving && column.contains(f.track) && now > seconds_us(8)) {
          const double depth_m = all_of_it ? 2.8 : 5.8;
          EXPECT_NEAR(f.u * 0.25 - column[f.track], 460 * 0.15 / depth_m, 0.3);
          ++apart;
        }
        if (moving) column[f.track] = f.u * 0.25;
      }
    });
    EXPECT_NEAR(on_it / all, share, 0.03);
    EXPECT_EQ(after, 0);
    EXPECT_GT(apart, 200);
  }
}

TEST(FeatureCameraFaults, late_images_arrive_later_and_wrong_stamps_are_a_tenth_of_a_second_off) {
  const auto images = [](std::vector<FaultSetting> faults) {
    World::Options options;
    options.course = lab_course(1);
    options.parameters.features.rate_hz = 10;
    options.parameters.lidar.rate_hz = 10;
    options.faults = std::move(faults);
    std::vector<Measurement> all = run(options, 5, seconds_us(10)), ends;
    for (const auto& m : all)
      if (std::holds_alternative<ImageEnd>(m.value) || std::holds_alternative<ScanHead>(m.value)) ends.push_back(m);
    std::stable_sort(ends.begin(), ends.end(),
                     [](const auto& a, const auto& b) { return a.value.index() < b.value.index(); });
    return ends;
  };
  const auto right = images({});
  const auto with = [&](Fault fault, bool scans, std::int64_t stamp_us, std::int64_t arrival_us) {
    const auto wrong = images({{fault, {}, seconds_us(20)}});
    ASSERT_GE(wrong.size(), right.size() - 2);
    for (std::size_t i = 0; i < std::min(right.size(), wrong.size()); ++i) {
      const bool hit = std::holds_alternative<ScanHead>(right[i].value) == scans;
      if (!hit || right[i].value.index() != wrong[i].value.index()) continue;
      EXPECT_EQ((wrong[i].stamp - right[i].stamp).us, stamp_us);
      EXPECT_EQ((wrong[i].arrival - right[i].arrival).us, arrival_us);
    }
  };
  with(Fault::kImagesLate, false, 0, 150'000);
  with(Fault::kImageStamps, false, 100'000, 0);
  with(Fault::kLidarLate, true, 100'000, 0);
}

TEST(FeatureCamera, an_image_ends_with_the_number_of_its_features_under_one_stamp) {
  World::Options options;
  options.course = lab_course(1);
  options.parameters.features.rate_hz = 10;
  int images = 0;
  std::vector<Measurement> open;
  for (const Measurement& m : run(options, 3, seconds_us(20))) {
    if (std::holds_alternative<ImageFeature>(m.value)) open.push_back(m);
    const auto* end = std::get_if<ImageEnd>(&m.value);
    if (end == nullptr) continue;
    EXPECT_EQ(end->count, open.size());
    for (const Measurement& one : open) {
      EXPECT_EQ(one.stamp, m.stamp);
      EXPECT_EQ(one.sequence, m.sequence);
      EXPECT_LT(one.arrival, m.arrival);
    }
    open.clear();
    ++images;
  }
  EXPECT_NEAR(images, 199, 1);
}

}  // namespace
}  // namespace tetap::sim
