// SPDX-License-Identifier: Apache-2.0
// The common scenario of the cost table. A robot drives rounds of some 4 m radius for 51.2 s among landmarks on a ring,
// ten steps a second. Every step gives odometry, one landmark's range and bearing, and two position fixes. From the
// second round on it gives the pose one round ago as seen from now, too. A filter takes those that it can use. Errors
// are normal, white and independent, with the sigmas below; the same on every machine, from a seed.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/base/random.hpp"

#include <array>
#include <cstdint>

namespace tetap::costs {

inline constexpr int kSteps = 512, kRound = 256;
inline constexpr float kStep_s = 0.1F;
inline constexpr float kSigmaDs_m = 0.02F, kSigmaDyaw_rad = 0.01F;
inline constexpr float kSigmaRange_m = 0.2F, kSigmaBearing_rad = 0.05F, kSigmaFix_m = 0.3F;
/// The second fix is sharper in y and wider in x.
inline constexpr float kSigmaFixX_m = 0.5F, kSigmaFixY_m = 0.2F;
inline constexpr float kSigmaLoop_m = 0.05F, kSigmaLoopYaw_rad = 0.02F;
inline constexpr float kStartSigma_m = 0.1F, kStartSigmaYaw_rad = 0.05F;  ///< error of the start

struct PlanePose {
  float x_m = 0, y_m = 0, yaw_rad = 0;

  /// A straight step and the turn after it.
  [[nodiscard]] PlanePose moved(float ds_m, float dyaw_rad) const {
    const base::SinCos heading = base::sincos(yaw_rad);
    return {x_m + ds_m * heading.cos, y_m + ds_m * heading.sin, base::wrap_angle(yaw_rad + dyaw_rad)};
  }
  /// `other` in the frame of this pose.
  [[nodiscard]] PlanePose to(const PlanePose& other) const {
    const base::SinCos heading = base::sincos(yaw_rad);
    const float dx = other.x_m - x_m, dy = other.y_m - y_m;
    return {heading.cos * dx + heading.sin * dy, heading.cos * dy - heading.sin * dx,
            base::wrap_angle(other.yaw_rad - yaw_rad)};
  }
};
inline constexpr PlanePose kStart{.x_m = 10.0F, .y_m = 6.0F, .yaw_rad = 0.0F};

struct Place {
  float x_m = 0, y_m = 0;
};
/// Landmark k of `count`, on a ring of 9 m about (10, 10).
inline Place landmark(int k, int count) {
  const base::SinCos at = base::sincos(6.28318531F * (static_cast<float>(k) + 0.5F) / static_cast<float>(count));
  return {10.0F + 9.0F * at.cos, 10.0F + 9.0F * at.sin};
}

struct DriveInput {
  float ds_m = 0, dyaw_rad = 0;  ///< odometry
  int landmark = 0;              ///< the one that is seen
  float range_m = 0, bearing_rad = 0;
  std::array<Place, 2> fix{};
  bool has_loop = false;
  PlanePose loop;  ///< the robot now, in the frame of where it was kRound steps ago
};

/// Truth and measurements, step by step.
class Drive {
 public:
  using Input = DriveInput;

  explicit Drive(std::uint32_t seed, int landmarks) : random_(seed), landmarks_(landmarks) {}

  [[nodiscard]] const PlanePose& truth() const { return truth_; }
  /// The start that a filter is given: the true one with an error of its sigmas.
  [[nodiscard]] PlanePose start() {
    const float x_m = noise(kStartSigma_m), y_m = noise(kStartSigma_m), yaw_rad = noise(kStartSigmaYaw_rad);
    return {kStart.x_m + x_m, kStart.y_m + y_m, kStart.yaw_rad + yaw_rad};
  }
  Input next() {
    past_[static_cast<std::size_t>(step_ % kRound)] = truth_;
    const float t_s = kStep_s * static_cast<float>(step_);
    const float ds_m = 0.1F * (1.0F + 0.3F * base::sin(0.49087385F * t_s));
    const float dyaw_rad = 0.0245436926F * (1.0F + 0.5F * base::sin(0.98174770F * t_s));
    truth_ = truth_.moved(ds_m, dyaw_rad);
    ++step_;
    Input in;
    in.ds_m = ds_m + noise(kSigmaDs_m);
    in.dyaw_rad = dyaw_rad + noise(kSigmaDyaw_rad);
    in.landmark = (7 * step_) % landmarks_;
    const Place seen = costs::landmark(in.landmark, landmarks_);
    const float dx = seen.x_m - truth_.x_m, dy = seen.y_m - truth_.y_m;
    in.range_m = base::sqrt(dx * dx + dy * dy) + noise(kSigmaRange_m);
    in.bearing_rad = base::wrap_angle(base::atan2(dy, dx) - truth_.yaw_rad + noise(kSigmaBearing_rad));
    in.fix[0].x_m = truth_.x_m + noise(kSigmaFix_m);
    in.fix[0].y_m = truth_.y_m + noise(kSigmaFix_m);
    in.fix[1].x_m = truth_.x_m + noise(kSigmaFixX_m);
    in.fix[1].y_m = truth_.y_m + noise(kSigmaFixY_m);
    in.has_loop = step_ >= kRound;
    if (in.has_loop) {
      in.loop = past_[static_cast<std::size_t>(step_ % kRound)].to(truth_);
      in.loop.x_m += noise(kSigmaLoop_m);
      in.loop.y_m += noise(kSigmaLoop_m);
      in.loop.yaw_rad += noise(kSigmaLoopYaw_rad);
    }
    return in;
  }

 private:
  float noise(float sigma) { return sigma * random_.normal(); }
  base::Random random_;
  int landmarks_;
  int step_ = 0;
  PlanePose truth_ = kStart;
  std::array<PlanePose, kRound> past_{};
};

/// Result of a filter: a planar position, or a pose, with its covariance in (x, y, yaw).
struct Estimate {
  int dimension = 3;  ///< 2: position alone
  PlanePose pose;
  std::array<std::array<float, 3>, 3> p{};
};

}  // namespace tetap::costs
