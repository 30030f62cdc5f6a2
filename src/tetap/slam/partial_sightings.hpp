// SPDX-License-Identifier: Apache-2.0
// Landmarks seen by bearing alone or range alone, kept until three sightings from different places make a place of
// them. The motion between the sightings comes from odometry since then. Its covariance is the difference of one that
// accumulates (right-invariant errors of dead reckoning only add up).
#pragma once

#include "tetap/filter/symmetric.hpp"
#include "tetap/model/planar_increment.hpp"
#include "tetap/slam/sighting.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::slam {

class PartialSightings {
 public:
  static constexpr int kMost = 16;             ///< landmarks that wait; a further one takes the place of the oldest
  static constexpr float kLeastWay_m = 0.05F;  ///< between the first two views
  static constexpr float kGate = 10.828F;      ///< chi-square, one degree of freedom, 99.9 %
  /// A place is good enough when its sigma in any direction is below this share of its distance.
  static constexpr float kSharpness = 0.2F;

  /// Place of a landmark, from the robot's present pose, in b.
  struct Place {
    bool known = false;
    float x_b_m = 0, y_b_m = 0;
    Covariance2 covariance;
  };

  [[nodiscard]] int size() const { return size_; }
  void clear() {
    size_ = 0;
    path_ = {};
    p_ = {};
  }
  /// Odometry goes on.
  void move(const model::PlanarIncrement& increment) {
    if (size_ == 0) return;
    const auto step = increment.step(path_);
    path_ = step.x;
    const float x = path_.x.minus({}), y = path_.y.minus({});
    const auto& q = step.q;  // w_inv = T w with T = [1 0 y; 0 1 -x; 0 0 1]
    p_(0, 0) += q(0, 0) + 2.0F * y * q(0, 2) + y * y * q(2, 2);
    p_(0, 1) += q(0, 1) - x * q(0, 2) + y * q(1, 2) - x * y * q(2, 2);
    p_(1, 1) += q(1, 1) - 2.0F * x * q(1, 2) + x * x * q(2, 2);
    p_(0, 2) += q(0, 2) + y * q(2, 2);
    p_(1, 2) += q(1, 2) - x * q(2, 2);
    p_(2, 2) += q(2, 2);
  }
  /// One more sighting of a landmark with an identity. The place once it is known; the landmark is then taken out.
  [[nodiscard]] Place add(const Sighting& seen, const SightingNoise& noise, const model::PlanarMounting& mounting);

 private:
  static constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }
  struct View {
    Sighting seen;
    model::PlanarPose from;         ///< on the path of odometry
    filter::Symmetric<float, 3> p;  ///< covariance of the path until then
  };
  struct Waiting {
    std::uint16_t id = 0;
    std::uint16_t age = 0;
    int views = 0;
    std::array<View, 3> view{};
  };
  struct Point {
    float x_m = 0, y_m = 0;
  };

  [[nodiscard]] Waiting& waiting_for(std::uint16_t id);
  [[nodiscard]] Place place_of(const Waiting& waiting, const SightingNoise& noise,
                               const model::PlanarMounting& mounting) const;
  [[nodiscard]] bool first_guess(const Waiting& waiting, const SightingNoise& noise,
                                 const model::PlanarMounting& mounting, Point& guess) const;
  [[nodiscard]] bool solve(const Waiting& waiting, const SightingNoise& noise, const model::PlanarMounting& mounting,
                           Point& point, Covariance2& covariance) const;
  [[nodiscard]] Place in_body(const Point& point, const Covariance2& c) const;

  int size_ = 0;
  std::uint16_t begun_ = 0;
  model::PlanarPose path_;
  filter::Symmetric<float, 3> p_;
  std::array<Waiting, kMost> waiting_{};
};

inline PartialSightings::Waiting& PartialSightings::waiting_for(std::uint16_t id) {
  for (int k = 0; k < size_; ++k)
    if (waiting_[at(k)].id == id) return waiting_[at(k)];
  int place = 0;
  if (size_ < kMost) {
    place = size_++;
  } else {
    for (int k = 1; k < kMost; ++k)
      if (static_cast<std::int16_t>(waiting_[at(k)].age - waiting_[at(place)].age) < 0) place = k;
  }
  waiting_[at(place)] = {.id = id, .age = begun_++, .views = 0, .view = {}};
  return waiting_[at(place)];
}

inline PartialSightings::Place PartialSightings::add(const Sighting& seen, const SightingNoise& noise,
                                                     const model::PlanarMounting& mounting) {
  Waiting& waiting = waiting_for(seen.id);
  const View now{.seen = seen, .from = path_, .p = p_};
  if (waiting.views == 0) {
    waiting.view[0] = now;
    waiting.views = 1;
    return {};
  }
  const auto way_m = [&](const View& view) {
    return base::abs(view.from.x.minus(waiting.view[0].from.x)) + base::abs(view.from.y.minus(waiting.view[0].from.y));
  };
  if (waiting.views == 1) {  // views from one place add nothing: the second waits for motion
    waiting.view[1] = now;
    if (way_m(now) > kLeastWay_m) waiting.views = 2;
    return {};
  }
  waiting.view[2] = now;
  const Place place = place_of(waiting, noise, mounting);
  if (place.known) {
    waiting = waiting_[at(--size_)];
    if (size_ == 0) clear();
  } else if (way_m(now) > 2.0F * way_m(waiting.view[1])) {
    waiting.view[1] = now;  // the second stays about half the way to the third
  }
  return place;
}

inline PartialSightings::Place PartialSightings::place_of(const Waiting& waiting, const SightingNoise& noise,
                                                          const model::PlanarMounting& mounting) const {
  Point point;
  Covariance2 covariance;
  if (!first_guess(waiting, noise, mounting, point)) return {};
  if (!solve(waiting, noise, mounting, point, covariance)) return {};
  const float dx = point.x_m - path_.x.minus({}), dy = point.y_m - path_.y.minus({});
  const float most = kSharpness * kSharpness * (dx * dx + dy * dy);
  const float mean = 0.5F * (covariance.xx + covariance.yy), half = 0.5F * (covariance.xx - covariance.yy);
  if (!(mean + base::sqrt(half * half + covariance.xy * covariance.xy) < most)) return {};
  return in_body(point, covariance);
}

/// Crossing of the first and the last view's lines or circles; of two crossings the one that the second view prefers.
inline bool PartialSightings::first_guess(const Waiting& waiting, const SightingNoise& noise,
                                          const model::PlanarMounting& mounting, Point& guess) const {
  const View &a = waiting.view[0], &m = waiting.view[1], &b = waiting.view[2];
  const auto sensor = [&](const View& v) {
    const base::SinCos h = base::sincos(v.from.yaw_rad);
    return Point{v.from.x.minus({}) + h.cos * mounting.x_b_m - h.sin * mounting.y_b_m,
                 v.from.y.minus({}) + h.sin * mounting.x_b_m + h.cos * mounting.y_b_m};
  };
  const Point pa = sensor(a), pm = sensor(m), pb = sensor(b);
  const float dx = pb.x_m - pa.x_m, dy = pb.y_m - pa.y_m;
  if (a.seen.has_bearing()) {
    const base::SinCos u = base::sincos(a.from.yaw_rad + mounting.yaw_rad + a.seen.bearing_rad);
    const base::SinCos v = base::sincos(b.from.yaw_rad + mounting.yaw_rad + b.seen.bearing_rad);
    const float across = u.cos * v.sin - u.sin * v.cos;
    if (!(base::abs(across) > 1e-3F)) return false;
    const float along = (dx * v.sin - dy * v.cos) / across;
    guess = {pa.x_m + along * u.cos, pa.y_m + along * u.sin};
    return along > 0.0F && along < 1e3F;
  }
  const float d2 = dx * dx + dy * dy;
  if (!(d2 > 1e-4F)) return false;
  const float ra = a.seen.range_m, rb = b.seen.range_m;
  const float along = 0.5F * (1.0F + (ra * ra - rb * rb) / d2);
  const float height2 = ra * ra / d2 - along * along;
  const float height = height2 > 0.0F ? base::sqrt(height2) : 0.0F;
  const Point left{pa.x_m + along * dx - height * dy, pa.y_m + along * dy + height * dx};
  const Point right{pa.x_m + along * dx + height * dy, pa.y_m + along * dy - height * dx};
  const auto error = [&](const Point& p) {
    const float x = p.x_m - pm.x_m, y = p.y_m - pm.y_m;
    return base::abs(base::sqrt(x * x + y * y) - m.seen.range_m);
  };
  const float at_left = error(left), at_right = error(right);
  guess = at_left < at_right ? left : right;
  // Both fit where the views lie on a line: the third has to come from beside it.
  const float difference = at_left - at_right;
  return difference * difference > 9.0F * noise.range_variance(m.seen.range_m);
}

/// Least squares over the three views, by Gauss-Newton. False when they contradict each other. Implements
/// docs/explanation/ekf_slam.md (13).
inline bool PartialSightings::solve(const Waiting& waiting, const SightingNoise& noise,
                                    const model::PlanarMounting& mounting, Point& point,
                                    Covariance2& covariance) const {
  for (int iteration = 0; iteration < 6; ++iteration) {
    float hxx = 0, hxy = 0, hyy = 0, gx = 0, gy = 0, chi2 = 0;
    for (const View& view : waiting.view) {
      const model::Landmark landmark{.x = base::Anchored{}.plus(point.x_m), .y = base::Anchored{}.plus(point.y_m)};
      const SightLine line(view.from, landmark, mounting, view.seen, noise);
      const std::size_t row = view.seen.has_range() ? 0 : 1;
      const auto& h = line.h[row];
      // The view's pose beside the present one: additive errors of the invariant difference of covariances.
      const float x = view.from.x.minus({}), y = view.from.y.minus({});
      const std::array<float, 3> to{h[0], h[1], h[2] - y * h[0] + x * h[1]};
      float variance = line.r[row];
      for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r) variance += to[at(r)] * to[at(c)] * (p_(r, c) - view.p(r, c));
      const float weight = 1.0F / variance;
      hxx += weight * h[3] * h[3];
      hxy += weight * h[3] * h[4];
      hyy += weight * h[4] * h[4];
      gx += weight * h[3] * line.nu[row];
      gy += weight * h[4] * line.nu[row];
      chi2 += weight * line.nu[row] * line.nu[row];
    }
    const float det = hxx * hyy - hxy * hxy;
    if (!(det > 1e-6F * hxx * hyy) || !(chi2 < 1e6F)) return false;
    covariance = {.xx = hyy / det, .xy = -hxy / det, .yy = hxx / det};
    if (iteration == 5) return chi2 <= kGate;
    point.x_m += covariance.xx * gx + covariance.xy * gy;
    point.y_m += covariance.xy * gx + covariance.yy * gy;
  }
  return false;
}

inline PartialSightings::Place PartialSightings::in_body(const Point& point, const Covariance2& c) const {
  const base::SinCos h = base::sincos(path_.yaw_rad);
  const float dx = point.x_m - path_.x.minus({}), dy = point.y_m - path_.y.minus({});
  return {.known = true,
          .x_b_m = h.cos * dx + h.sin * dy,
          .y_b_m = h.cos * dy - h.sin * dx,
          .covariance = {.xx = h.cos * h.cos * c.xx + 2.0F * h.cos * h.sin * c.xy + h.sin * h.sin * c.yy,
                         .xy = h.cos * h.sin * (c.yy - c.xx) + (h.cos * h.cos - h.sin * h.sin) * c.xy,
                         .yy = h.sin * h.sin * c.xx - 2.0F * h.cos * h.sin * c.xy + h.cos * h.cos * c.yy}};
}

}  // namespace tetap::slam
