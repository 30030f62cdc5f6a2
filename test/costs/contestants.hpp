// SPDX-License-Identifier: Apache-2.0
// Each filter as the cost table runs it: start() once on a new one, step() with what it can use of a step's
// measurements, estimate().
#pragma once

#include "costs/models.hpp"
#include "costs/sway.hpp"
#include "tetap/filter/attitude.hpp"
#include "tetap/filter/complementary.hpp"
#include "tetap/filter/grid.hpp"
#include "tetap/filter/iterated_ekf.hpp"
#include "tetap/filter/joseph.hpp"
#include "tetap/filter/kalman.hpp"
#include "tetap/filter/mahony.hpp"
#include "tetap/filter/particle.hpp"
#include "tetap/filter/particle_localisation.hpp"
#include "tetap/filter/particle_pose.hpp"
#include "tetap/filter/sequential.hpp"
#include "tetap/filter/square_root.hpp"
#include "tetap/filter/static_fusion.hpp"
#include "tetap/filter/structured_kalman.hpp"
#include "tetap/filter/ud.hpp"
#include "tetap/filter/ukf.hpp"
#include "tetap/filter/ukf_sqrt.hpp"
#include "tetap/model/constant_acceleration.hpp"
#include "tetap/model/constant_velocity.hpp"
#include "tetap/slam/ekf_slam.hpp"
#include "tetap/slam/fast_slam.hpp"
#include "tetap/slam/pose_graph.hpp"

namespace tetap::costs {

using filter::Symmetric;

template <class P>
void put(Estimate& out, const P& p) {
  for (int c = 0; c < out.dimension; ++c)
    for (int r = 0; r <= c; ++r)
      out.p[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)] =
          out.p[static_cast<std::size_t>(c)][static_cast<std::size_t>(r)] = p(r, c);
}
template <class Filter>
auto covariance_of(const Filter& filter) {
  if constexpr (requires { filter.covariance(); }) {
    return filter.covariance();
  } else {
    return filter.p;
  }
}
template <class Filter, int N>
void set_covariance(Filter& filter, const Symmetric<float, N>& p) {
  if constexpr (requires { filter.set_covariance(p); }) {
    filter.set_covariance(p);
  } else {
    filter.p = p;
  }
}

struct OfDrive {
  using Scenario = Drive;
  static constexpr int kLandmarks = 4, kSeeds = 50, kCounted = 64;
};

/// Linear: constant velocity (4 states) or acceleration (6) of the position, which a fix measures. The scenario turns
/// steadily, which neither model has; their process noise makes the NEES about 2.
template <template <filter::State> class Filter_, int N>
class Linear : public OfDrive {
 public:
  void start(const PlanePose& at) {
    filter_ = {};
    filter_.x.value(0) = at.x_m;
    filter_.x.value(kAxis) = at.y_m;
    Symmetric<float, N> p;
    for (int i = 0; i < N; ++i) p(i, i) = i % kAxis == 0 ? kStartSigma_m * kStartSigma_m : i % kAxis == 1 ? 1.0F : 0.1F;
    set_covariance<Filter, N>(filter_, p);
  }
  void step(const DriveInput& in) {
    static_cast<void>(filter_.predict(motion()));
    static_cast<void>(filter_.update(
        filter::DirectMeasurement<float, N, 0, kAxis>{
            .z = {in.fix[0].x_m, in.fix[0].y_m}, .variance = {kSigmaFix_m * kSigmaFix_m, kSigmaFix_m * kSigmaFix_m}},
        filter::chi_square_99(2)));
  }
  [[nodiscard]] Estimate estimate() const {
    Estimate out{.dimension = 2, .pose = {filter_.x.value(0), filter_.x.value(kAxis)}};
    const auto p = covariance_of(filter_);
    out.p[0] = {p(0, 0), p(0, kAxis), 0};
    out.p[1] = {p(0, kAxis), p(kAxis, kAxis), 0};
    return out;
  }

 private:
  using Filter = Filter_<filter::VectorState<float, N>>;
  static constexpr int kAxis = N / 2;
  static auto motion() {
    if constexpr (N == 6) {
      return model::ConstantAcceleration<float>{.dt_s = kStep_s, .increment_variance = 2e-3F};
    } else if constexpr (requires { Filter::kStructured; }) {
      return test::StructuredVelocity{.dt_s = kStep_s, .acceleration_variance = 0.8F};
    } else {
      return model::ConstantVelocity<float>{.dt_s = kStep_s, .acceleration_variance = 0.8F};
    }
  }
  Filter filter_;
};

/// Extended and unscented, on odometry and a sighting: 3 states, or 5 with odometry's errors.
template <template <filter::State> class Filter_, int N>
class Planar : public OfDrive {
 public:
  void start(const PlanePose& at) {
    filter_ = {};
    filter_.x.value(0) = at.x_m;
    filter_.x.value(1) = at.y_m;
    filter_.x.value(2) = at.yaw_rad;
    Symmetric<float, N> p;
    p(0, 0) = p(1, 1) = kStartSigma_m * kStartSigma_m;
    p(2, 2) = kStartSigmaYaw_rad * kStartSigmaYaw_rad;
    if constexpr (N == 5) p(3, 3) = 1e-4F, p(4, 4) = 1e-6F;
    set_covariance<Filter, N>(filter_, p);
  }
  void step(const DriveInput& in) {
    static_cast<void>(filter_.predict(motion(in)));
    const Place at = landmark_of(in);
    static_cast<void>(
        filter_.update(Sight<N>{{.range_m = in.range_m,
                                 .bearing_rad = in.bearing_rad,
                                 .variance = {kSigmaRange_m * kSigmaRange_m, kSigmaBearing_rad * kSigmaBearing_rad},
                                 .landmark_x_m = at.x_m,
                                 .landmark_y_m = at.y_m}},
                       filter::chi_square_99(2)));
  }
  [[nodiscard]] Estimate estimate() const {
    Estimate out{.pose = {filter_.x.value(0), filter_.x.value(1), filter_.x.value(2)}};
    put(out, covariance_of(filter_));
    return out;
  }

 private:
  using Filter = Filter_<filter::VectorState<float, N>>;
  static auto motion(const DriveInput& in) {
    if constexpr (N == 5) {
      return ScaledUnicycle{in.ds_m, in.dyaw_rad};
    } else if constexpr (requires { Filter::kStructured; }) {
      return test::StructuredUnicycle{{.ds_m = in.ds_m, .dyaw_rad = in.dyaw_rad, .variance = kVariance}};
    } else {
      return test::EulerUnicycle<float>{.ds_m = in.ds_m, .dyaw_rad = in.dyaw_rad, .variance = kVariance};
    }
  }
  static Place landmark_of(const DriveInput& in) { return kMap[static_cast<std::size_t>(in.landmark)]; }
  static constexpr std::array<Place, 4> kMap{
      {{16.3639610F, 16.3639610F}, {3.6360390F, 16.3639610F}, {3.6360390F, 3.6360390F}, {16.3639610F, 3.6360390F}}};
  Filter filter_;
};

template <filter::State S>
using DenseEkf = filter::Ekf<S>;
template <filter::State S>
struct Structured : filter::StructuredKalman<S> {
  static constexpr bool kStructured = true;
};
template <filter::State S>
using Iterated = filter::IteratedEkf<S>;
template <filter::State S>
using Unscented = filter::Ukf<S>;
template <filter::State S>
using UnscentedRoot = filter::UkfSqrt<S>;

/// Bootstrap filter: systematic resampling below half of the effective number, mean for read-out.
template <std::size_t N>
class ParticleFilter : public OfDrive {
 public:
  static constexpr int kCounted = 24, kSeeds = 20;
  void start(const PlanePose& at) {
    cloud_.fill(N, [&at](const filter::Draw& draw) {
      return filter::ParticlePose::at(at.x_m + kStartSigma_m * draw.normal(0), at.y_m + kStartSigma_m * draw.normal(1),
                                      at.yaw_rad + kStartSigmaYaw_rad * draw.normal(2));
    });
  }
  void step(const DriveInput& in) {
    static_cast<void>(cloud_.predict(filter::ParticleArc{
        .ds_m = in.ds_m, .dyaw_rad = in.dyaw_rad, .sigma_ds_m = kSigmaDs_m, .sigma_dyaw_rad = kSigmaDyaw_rad}));
    const Place at = landmark(in.landmark, kLandmarks);
    const auto seen =
        filter::ParticleSighting::at(at.x_m, at.y_m, in.range_m, in.bearing_rad, kSigmaRange_m, kSigmaBearing_rad);
    cloud_.weigh([&seen](const filter::ParticlePose& pose) { return -0.5F * seen.distance(pose); });
    mean_ = filter::mean_pose(cloud_);
    if (cloud_.effective() < 0.5F * static_cast<float>(N)) cloud_.resample(filter::Resampling::kSystematic, N);
  }
  [[nodiscard]] Estimate estimate() const {
    Estimate out{.pose = {mean_.x_m, mean_.y_m, mean_.yaw_rad()}};
    put(out, filter::pose_covariance(cloud_, mean_, [](const filter::ParticlePose&) { return true; }));
    return out;
  }

 private:
  filter::Particles<filter::ParticlePose, N> cloud_{base::PhiloxKey{1, 2}};
  filter::ParticlePose mean_;
};

/// Monte Carlo localisation with its search for a lost track; up to N particles. The likelihood is not tempered here,
/// since errors of the scenario are independent.
template <std::size_t N>
class Localisation : public OfDrive {
 public:
  static constexpr int kCounted = 24, kSeeds = 20;
  void start(const PlanePose& at) {
    filter_.options.temper = 1.0F;
    filter_.options.bandwidth = 0.05F;
    filter_.options.least = N / 2;
    for (int k = 0; k < kLandmarks; ++k) {
      const Place place = landmark(k, kLandmarks);
      map_[static_cast<std::size_t>(k)] = {place.x_m, place.y_m};
    }
    filter_.start(N, filter::ParticlePose::at(at.x_m, at.y_m, at.yaw_rad), kStartSigma_m, kStartSigmaYaw_rad);
  }
  void step(const DriveInput& in) {
    static_cast<void>(filter_.predict(
        {.ds_m = in.ds_m, .dyaw_rad = in.dyaw_rad, .sigma_ds_m = kSigmaDs_m, .sigma_dyaw_rad = kSigmaDyaw_rad}));
    const std::array<filter::LandmarkSeen, 1> seen{{{.landmark = in.landmark,
                                                     .range_m = in.range_m,
                                                     .bearing_rad = in.bearing_rad,
                                                     .sigma_range_m = kSigmaRange_m,
                                                     .sigma_bearing_rad = kSigmaBearing_rad}}};
    static_cast<void>(filter_.update(seen, map_));
    const auto found = filter_.estimate();
    out_ = {.pose = {found.pose.x_m, found.pose.y_m, found.pose.yaw_rad()}};
    put(out_, found.p);
  }
  [[nodiscard]] Estimate estimate() const { return out_; }

 private:
  filter::ParticleLocalisation<N> filter_{base::PhiloxKey{1, 2}};
  std::array<filter::ParticleLandmark, 4> map_{};
  Estimate out_;
};

/// Poses on a grid over 20 x 20 m, mean for read-out. The variance is that of the cells' masses.
template <int kX, int kYaw>
class PoseGrid : public OfDrive {
 public:
  static constexpr int kCounted = 3, kSeeds = 4;
  void start(const PlanePose& at) {
    static_cast<void>(grid_.fill([&at](const filter::GridPose& pose) {
      const float dx = pose.x_m - at.x_m, dy = pose.y_m - at.y_m, turn = base::wrap_angle(pose.yaw_rad - at.yaw_rad);
      return base::exp(-0.5F * ((dx * dx + dy * dy) / (kCell_m * kCell_m) + turn * turn / (kTurn_rad * kTurn_rad)));
    }));
  }
  void step(const DriveInput& in) {
    static_cast<void>(grid_.begin({.forward_m = in.ds_m,
                                   .turn_rad = in.dyaw_rad,
                                   .variance_forward = kSigmaDs_m * kSigmaDs_m,
                                   .variance_turn = kSigmaDyaw_rad * kSigmaDyaw_rad},
                                  true));
    const Place at = landmark(in.landmark, kLandmarks);
    // A cell stands for all poses in it: their spread widens the noise.
    const float sigma_range = base::sqrt(kSigmaRange_m * kSigmaRange_m + kCell_m * kCell_m / 12.0F);
    const float sigma_bearing = base::sqrt(kSigmaBearing_rad * kSigmaBearing_rad + kTurn_rad * kTurn_rad / 12.0F);
    const auto seen =
        filter::ParticleSighting::at(at.x_m, at.y_m, in.range_m, in.bearing_rad, sigma_range, sigma_bearing);
    while (!grid_.done())
      grid_.work(1, [&seen](const filter::GridPose& pose) {
        return base::exp(-0.5F * seen.distance(filter::ParticlePose::at(pose.x_m, pose.y_m, pose.yaw_rad)));
      });
    mean_ = grid_.mean();
  }
  [[nodiscard]] Estimate estimate() const {
    Estimate out{.pose = {mean_.x_m, mean_.y_m, mean_.yaw_rad}};
    for (int yaw = 0; yaw < kYaw; ++yaw)
      for (int y = 0; y < kX; ++y)
        for (int x = 0; x < kX; ++x) {
          const filter::GridPose at = grid_.at(x, y, yaw);
          const std::array<float, 3> e{at.x_m - mean_.x_m, at.y_m - mean_.y_m,
                                       base::wrap_angle(at.yaw_rad - mean_.yaw_rad)};
          for (std::size_t r = 0; r < 3; ++r)
            for (std::size_t c = 0; c < 3; ++c) out.p[r][c] += grid_.mass(x, y, yaw) * e[r] * e[c];
        }
    // Within a cell the density is even.
    for (std::size_t d = 0; d < 3; ++d) out.p[d][d] += (d < 2 ? kCell_m * kCell_m : kTurn_rad * kTurn_rad) / 12.0F;
    return out;
  }

 private:
  using Cells = filter::Grid<kX, kX, kYaw>;
  static constexpr float kCell_m = 20.0F / static_cast<float>(kX);
  static constexpr float kTurn_rad = 6.28318531F / static_cast<float>(kYaw);
  Cells grid_{0.0F, 0.0F, kCell_m};
  filter::GridPose mean_;
};

enum class Rule { kInverseVariance, kIntersection, kSplit };
/// Two fixes of one moment made into one, without memory. The third dimension is a height of 0 with the same noise.
template <Rule kRule, int N>
class Fusion : public OfDrive {
 public:
  void start(const PlanePose&) {}
  void step(const DriveInput& in) {
    std::array<filter::Estimate<float, N>, 2> both;
    for (std::size_t i = 0; i < 2; ++i) {
      both[i].x(0) = in.fix[i].x_m;
      both[i].x(1) = in.fix[i].y_m;
      for (int d = 0; d < N; ++d) both[i].p(d, d) = kSigmaFix_m * kSigmaFix_m;
    }
    both[1].p(0, 0) = kSigmaFixX_m * kSigmaFixX_m;
    both[1].p(1, 1) = kSigmaFixY_m * kSigmaFixY_m;
    if constexpr (kRule == Rule::kInverseVariance) {
      fused_ = filter::inverse_variance<float, N>(both).estimate;
    } else if constexpr (kRule == Rule::kIntersection) {
      fused_ = filter::covariance_intersection<float, N>(both[0], both[1]).estimate;
    } else {
      const auto split = [](const filter::Estimate<float, N>& whole) {
        filter::SplitEstimate<float, N> e{.x = whole.x};
        for (int d = 0; d < N; ++d) e.correlated(d, d) = e.independent(d, d) = 0.5F * whole.p(d, d);
        return e;
      };
      const auto found = filter::split_covariance_intersection<float, N>(split(both[0]), split(both[1])).estimate;
      fused_ = {.x = found.x, .p = found.total()};
    }
  }
  [[nodiscard]] Estimate estimate() const {
    Estimate out{.dimension = 2, .pose = {fused_.x(0), fused_.x(1)}};
    put(out, fused_.p);
    return out;
  }

 private:
  filter::Estimate<float, N> fused_;
};

/// Odometry and sighting of a step, for mappers.
[[nodiscard]] constexpr model::PlanarIncrement increment_of(const DriveInput& in) {
  return {.ds_m = in.ds_m,
          .dyaw_rad = in.dyaw_rad,
          .var_ds = kSigmaDs_m * kSigmaDs_m,
          .var_dyaw = kSigmaDyaw_rad * kSigmaDyaw_rad};
}
[[nodiscard]] constexpr slam::Sighting sighting_of(const DriveInput& in) {
  return {.id = static_cast<std::uint16_t>(in.landmark), .range_m = in.range_m, .bearing_rad = in.bearing_rad};
}

/// Landmarks unknown at the start, identities known, one sighting a step.
template <int kMap>
class EkfMapper : public OfDrive {
 public:
  static constexpr int kLandmarks = kMap, kCounted = 2 * kMap, kSeeds = 20;
  void start(const PlanePose& at) {
    slam_.options.noise = {.sigma_range_m = kSigmaRange_m, .sigma_bearing_rad = kSigmaBearing_rad};
    model::PlanarPose pose;
    pose.x = pose.x.plus(at.x_m);
    pose.y = pose.y.plus(at.y_m);
    pose.yaw_rad = at.yaw_rad;
    slam_.start(pose, Symmetric<float, 3>::diagonal({kStartSigma_m * kStartSigma_m, kStartSigma_m * kStartSigma_m,
                                                     kStartSigmaYaw_rad * kStartSigmaYaw_rad}));
  }
  void step(const DriveInput& in) {
    static_cast<void>(slam_.predict(increment_of(in)));
    const std::array<slam::Sighting, 1> seen{sighting_of(in)};
    int known = -1;
    for (int k = 0; k < slam_.map().size(); ++k)
      if (slam_.map()[k].id == in.landmark) known = k;
    if (known < 0) {
      static_cast<void>(slam_.add(seen[0], seen[0].id, 0));
      return;
    }
    const std::array<typename Slam::Pair, 1> pair{{{.sighting = 0, .landmark = known}}};
    std::array<slam::SightingRecord, 1> record;
    slam_.fuse(seen, pair, 0, record);
  }
  [[nodiscard]] Estimate estimate() const {
    Estimate out{.pose = {slam_.pose().x.minus({}), slam_.pose().y.minus({}), slam_.pose().yaw_rad}};
    put(out, slam_.pose_covariance());
    return out;
  }

 private:
  using Slam = slam::EkfSlam<kMap, 1>;
  Slam slam_;
};

template <int kParticles>
class FastMapper : public OfDrive {
 public:
  static constexpr int kLandmarks = 10, kCounted = 24, kSeeds = 20;
  void start(const PlanePose& at) {
    slam_.options.noise = {.sigma_range_m = kSigmaRange_m, .sigma_bearing_rad = kSigmaBearing_rad};
    slam_.start({at.x_m, at.y_m, at.yaw_rad}, kStartSigma_m, kStartSigmaYaw_rad);
  }
  void step(const DriveInput& in) {
    static_cast<void>(slam_.predict(increment_of(in)));
    const std::array<slam::Sighting, 1> seen{sighting_of(in)};
    static_cast<void>(slam_.update(seen));
    const auto found = slam_.estimate();
    out_ = {.pose = {found.pose.x_m, found.pose.y_m, found.pose.yaw_rad}};
    put(out_, found.p);
  }
  [[nodiscard]] Estimate estimate() const { return out_; }

 private:
  slam::FastSlam<kParticles, kLandmarks> slam_{base::PhiloxKey{1, 2}};
  Estimate out_;
};

/// kPoses key poses at equal steps after the start, a closure to the pose one round ago, all optimised at the last
/// step. Its estimate is that of the last pose.
template <int kPoses>
class GraphMapper : public OfDrive {
 public:
  static constexpr int kCounted = kSteps, kSeeds = 20;
  void start(const PlanePose& at) {
    graph_.clear();
    start_ = at;
    since_ = {};
    step_ = 0;
  }
  void step(const DriveInput& in) {
    const model::PlanarIncrement one = increment_of(in);
    Motion moved{};
    moved.mean = {one.ds_m, 0.0F, slam::Heading<float>::from_radians(one.dyaw_rad)};
    // A straight step has no error across but the turn's, which the next step carries.
    moved.covariance = Symmetric<float, 3>::diagonal({one.var_ds, 1e-8F, one.var_dyaw});
    since_ = slam::compose(since_, moved);
    if (++step_ % kEvery != 0) return;
    static_cast<void>(graph_.append(since_));
    since_ = {};
    if (in.has_loop) {
      Motion loop{};
      loop.mean = {in.loop.x_m, in.loop.y_m, slam::Heading<float>::from_radians(in.loop.yaw_rad)};
      loop.covariance = Symmetric<float, 3>::diagonal(
          {kSigmaLoop_m * kSigmaLoop_m, kSigmaLoop_m * kSigmaLoop_m, kSigmaLoopYaw_rad * kSigmaLoopYaw_rad});
      static_cast<void>(graph_.close(graph_.poses() - 1 - kRound / kEvery, graph_.poses() - 1, loop));
    }
    if (step_ != kSteps) return;
    static_cast<void>(graph_.begin());
    while (graph_.busy()) graph_.work(100'000);
  }
  [[nodiscard]] Estimate estimate() const {
    const auto& last = graph_.pose(graph_.poses() - 1);
    const auto& first = graph_.pose(0);
    const PlanePose relative{last.x.minus(first.x), last.y.minus(first.y), (last.yaw - first.yaw).radians()};
    const base::SinCos turn = base::sincos(start_.yaw_rad);
    Estimate out{.pose = {start_.x_m + turn.cos * relative.x_m - turn.sin * relative.y_m,
                          start_.y_m + turn.sin * relative.x_m + turn.cos * relative.y_m,
                          base::wrap_angle(start_.yaw_rad + relative.yaw_rad)}};
    // The start's own error, seen from the last pose, and that of the graph.
    const float dx = out.pose.x_m - start_.x_m, dy = out.pose.y_m - start_.y_m;
    const float position = kStartSigma_m * kStartSigma_m, heading = kStartSigmaYaw_rad * kStartSigmaYaw_rad;
    Symmetric<float, 3> p = Symmetric<float, 3>::diagonal({position, position, heading});
    filter::Matrix<float, 3, 3> carry = filter::Matrix<float, 3, 3>::Identity();
    carry(0, 2) = -dy;
    carry(1, 2) = dx;
    filter::Matrix<float, 3, 3> rotate = filter::Matrix<float, 3, 3>::Identity();
    rotate(0, 0) = rotate(1, 1) = turn.cos;
    rotate(0, 1) = -turn.sin;
    rotate(1, 0) = turn.sin;
    put(out,
        filter::propagate(p, carry, filter::propagate(graph_.covariance_of_last(), rotate, Symmetric<float, 3>{})));
    return out;
  }

 private:
  using Graph = slam::PoseGraph<float, kPoses + 1, 2 * kPoses, 8 * kPoses>;
  using Motion = slam::UncertainDisplacement<float>;
  static constexpr int kEvery = kSteps / kPoses;
  Graph graph_{slam::GraphOptions{.robust = false}};
  PlanePose start_;
  Motion since_{};
  int step_ = 0;
};

struct OfSway {
  using Scenario = Sway;
  static constexpr int kLandmarks = 0, kSeeds = 20, kCounted = 256;
};

/// One axis, from the gyroscope and the direction of the specific force.
class OneAxis : public OfSway {
 public:
  void start() { filter_ = filter::ComplementaryAngle(1.0F); }
  void step(const SwayInput& in) {
    static_cast<void>(
        filter_.step(in.rate_b_radps(0), base::atan2(in.force_b_mps2(1), in.force_b_mps2(2)), kSwayStep_s));
  }
  [[nodiscard]] filter::Vector3 up_b() const {
    const base::SinCos roll = base::sincos(filter_.angle_rad());
    return {0.0F, roll.sin, roll.cos};
  }

 private:
  filter::ComplementaryAngle filter_{1.0F};
};

template <class Filter, int kAxes>
class Orientation : public OfSway {
 public:
  void start() { filter_ = Filter(); }
  void step(const SwayInput& in) {
    if constexpr (requires { filter_.magnetometer(in.field_b_ut, kSwayStep_s); }) {
      static_cast<void>(filter_.step(in.rate_b_radps, in.force_b_mps2, kSwayStep_s));
      if constexpr (kAxes == 9) static_cast<void>(filter_.magnetometer(in.field_b_ut, kSwayStep_s));
    } else if constexpr (kAxes == 9) {
      static_cast<void>(filter_.step(in.rate_b_radps, in.force_b_mps2, in.field_b_ut, kSwayStep_s));
    } else {
      static_cast<void>(filter_.step(in.rate_b_radps, in.force_b_mps2, kSwayStep_s));
    }
  }
  [[nodiscard]] filter::Vector3 up_b() const {
    const filter::Quaternion q = filter_.q_nb();
    return {2.0F * (q.x * q.z - q.w * q.y), 2.0F * (q.w * q.x + q.y * q.z),
            q.w * q.w - q.x * q.x - q.y * q.y + q.z * q.z};
  }

 private:
  Filter filter_;
};

}  // namespace tetap::costs
