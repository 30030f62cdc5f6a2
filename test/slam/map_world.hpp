// SPDX-License-Identifier: Apache-2.0
// A simulated round trip between posts that a camera recognises, and points that it merely follows. Its noise is that
// which the filter takes for given.
#pragma once

#include "slam/noisy_drive.hpp"
#include "tetap/slam/visual_map.hpp"

#include <optional>

namespace tetap::test {

struct MapWorldOptions {
  unsigned seed = 1;
  int laps = 3, posts = 24, followed = 30;
  double radius_m = 12, speed_mps = 3, step_s = 0.1, sigma_px = 1.2;
  double wrong_share = 0;  ///< recognitions that name another post
  double missed_share = 0.1;
  double start_yaw_rad = 0;
  slam::SpeedNoise noise;
  double sigma_mounting_rad = 0.003;
};

class MapWorld : public NoisyDrive {
 public:
  using Features = std::vector<slam::ImageFeature>;

  explicit MapWorld(const MapWorldOptions& options)
      : NoisyDrive({.seed = options.seed,
                    .step_s = options.step_s,
                    .sigma_px = options.sigma_px,
                    .start_yaw_rad = options.start_yaw_rad,
                    .noise = options.noise,
                    .sigma_mounting_rad = options.sigma_mounting_rad},
                   {.fu_px = 458, .fv_px = 458, .cu_px = 319.5F, .cv_px = 239.5F}, {0.2F, 0.0F, 0.3F}),
        o_(options) {
    for (int i = 0; i < o_.posts; ++i)
      posts.push_back(around((i + 0.5) * 2 * kPi_ / o_.posts, i % 2 == 0 ? -2 : 2, 0.4 + 0.3 * (i % 4)));
    for (int i = 0; i < 400; ++i) {
      const double angle = uniform(0, 2 * kPi_), out_m = uniform(-6, 8), z_m = uniform(0, 2);
      points_.push_back({around(angle, out_m, z_m)});
    }
    const double lap_s = 2 * kPi_ * o_.radius_m / o_.speed_mps;
    per_lap = static_cast<int>(std::lround(lap_s / o_.step_s));
    for (int k = 0; k <= o_.laps * per_lap; ++k) add_image(k);
  }

  std::vector<Eigen::Vector3d> posts;
  std::vector<Features> recognised;  ///< in each image; identities are those of the posts
  int per_lap = 0;

 private:
  static constexpr double kPi_ = 3.14159265358979;
  struct Point {
    Eigen::Vector3d at;
    int id = -1;  ///< none: not followed
  };
  /// Beside the way, which is a circle that begins at the origin, towards x.
  Eigen::Vector3d around(double angle, double out_m, double z_m) const {
    const double r = o_.radius_m + out_m;
    return start_r_ * Eigen::Vector3d(r * std::sin(angle), o_.radius_m - r * std::cos(angle), z_m);
  }
  void add_image(int k) {
    DriveImage image;
    image.time_s = 1.0 + k * o_.step_s;
    if (k == 0) {
      image.r_nb = start_r_;
    } else {
      move(drive_.images.back(), image, o_.speed_mps, {0, 0, o_.speed_mps / o_.radius_m});
    }
    follow(image);
    Features found;
    for (std::size_t i = 0; i < posts.size(); ++i) {
      const auto at = show(posts[i], image);
      if (!at || uniform(0, 1) < o_.missed_share) continue;
      const bool wrong = uniform(0, 1) < o_.wrong_share;
      const auto id = static_cast<std::uint16_t>(wrong ? static_cast<std::size_t>(uniform(0, o_.posts)) : i);
      found.push_back({id, at->u_quarter_px, at->v_quarter_px});
    }
    drive_.images.push_back(image);
    recognised.push_back(found);
  }
  void follow(DriveImage& image) {
    int followed = 0;
    for (Point& point : points_) {
      const auto at = show(point.at, image);
      if (!at || followed == o_.followed) {
        point.id = -1;
        continue;
      }
      ++followed;
      if (point.id < 0) point.id = static_cast<int>(next_id_++ % 4096);
      image.features.push_back({static_cast<std::uint16_t>(point.id), at->u_quarter_px, at->v_quarter_px});
    }
  }
  std::optional<slam::ImageFeature> show(const Eigen::Vector3d& at, const DriveImage& image) {
    const Eigen::Vector3d l =
        true_c_ * (image.r_nb.transpose() * (at - image.p_n_m) - in_double(drive_.mounting.lever_b_m));
    if (l(2) < 0.7 || l(2) > 15) return std::nullopt;
    const double u = 458 * l(0) / l(2) + 319.5 + normal() * o_.sigma_px;
    const double v = 458 * l(1) / l(2) + 239.5 + normal() * o_.sigma_px;
    if (u < 0 || u > 639 || v < 0 || v > 479) return std::nullopt;
    return slam::ImageFeature{0, static_cast<std::uint16_t>(std::lround(4 * u)),
                              static_cast<std::uint16_t>(std::lround(4 * v))};
  }

  MapWorldOptions o_;
  std::vector<Point> points_;
  unsigned next_id_ = 0;
};

}  // namespace tetap::test
