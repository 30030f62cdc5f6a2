// SPDX-License-Identifier: Apache-2.0
// Differential drive whose radii and track are states: a filter learns their errors on line from whatever measures the
// pose (Larsen, Bak, Andersen, Ravn, "Location estimation for an autonomously guided vehicle using an augmented Kalman
// filter to autocalibrate the odometry", FUSION 1998). What no measurement shows keeps its variance.
#pragma once

#include "tetap/model/differential_drive.hpp"

namespace tetap::model {

/// Error state: (dx, dy, dyaw) in n, then the three relative errors, which are numbers without a unit.
struct CalibratedPose {
  using Scalar = float;
  static constexpr int kErrors = 6;

  PlanarPose pose;
  float left = 0;   ///< the left radius is (1 + left) times the configured one
  float right = 0;  ///< the same of the right radius
  float track = 0;  ///< the same of the track

  [[nodiscard]] CalibratedPose plus(const filter::Vector<float, 6>& dx) const {
    return {.pose = pose.plus(dx.head<3>()), .left = left + dx(3), .right = right + dx(4), .track = track + dx(5)};
  }
  [[nodiscard]] filter::Vector<float, 6> minus(const CalibratedPose& other) const {
    filter::Vector<float, 6> dx;
    dx << pose.minus(other.pose), left - other.left, right - other.right, track - other.track;
    return dx;
  }
  [[nodiscard]] bool finite() const { return pose.finite() && base::is_finite(left + right + track); }
};

/// Travel of both wheels by their configured radii, as a midpoint arc (Siegwart, Nourbakhsh, Scaramuzza 2011, eq. 5.7).
/// Steps are short: a turn of 0.1 rad shortens the chord by 0.04 %.
struct CalibratedDrive {
  DifferentialDrive drive;
  float left_m = 0;
  float right_m = 0;
  float walk_per_m = 0;  ///< variance by which each relative error wanders in a metre: tyres wear, loads move

  [[nodiscard]] CalibratedPose predict(const CalibratedPose& from) const {
    CalibratedPose next = from;
    next.pose = increment(from).predict(from.pose);
    return next;
  }
  [[nodiscard]] filter::Matrix<float, 6, 6> jacobian(const CalibratedPose& from) const {
    const PlanarIncrement moved = increment(from);
    const base::SinCos chord = base::sincos(from.pose.yaw_rad + 0.5F * moved.dyaw_rad);
    const float half_x_m = 0.5F * moved.ds_m * chord.cos, half_y_m = 0.5F * moved.ds_m * chord.sin;
    filter::Matrix<float, 6, 6> f = filter::Matrix<float, 6, 6>::Identity();
    f(0, 2) = -2.0F * half_y_m;
    f(1, 2) = 2.0F * half_x_m;
    const auto column = [&](int c, float ds, float dyaw) {  // d pose / d (ds, dyaw), times their slopes
      f(0, c) = chord.cos * ds - half_y_m * dyaw;
      f(1, c) = chord.sin * ds + half_x_m * dyaw;
      f(2, c) = dyaw;
    };
    const float per_track = 1.0F / (drive.track_m * (1.0F + from.track));
    column(3, 0.5F * left_m, -left_m * per_track);
    column(4, 0.5F * right_m, right_m * per_track);
    column(5, 0.0F, -moved.dyaw_rad / (1.0F + from.track));
    return f;
  }
  [[nodiscard]] filter::Symmetric<float, 6> noise(const CalibratedPose& from) const {
    const PlanarIncrement moved = increment(from);
    const filter::Symmetric<float, 3> of_pose = moved.noise(from.pose);
    filter::Symmetric<float, 6> q;
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r <= c; ++r) q(r, c) = of_pose(r, c);
    for (int c = 3; c < 6; ++c) q(c, c) = walk_per_m * base::abs(moved.ds_m);
    return q;
  }

 private:
  [[nodiscard]] PlanarIncrement increment(const CalibratedPose& from) const {
    DifferentialDrive now = drive;
    now.track_m *= 1.0F + from.track;
    return now.increment((1.0F + from.left) * left_m, (1.0F + from.right) * right_m, Arc::kMidpoint);
  }
};

/// A measurement of the pose, seen from the larger state: GnssPosition, PlanarPose's landmarks.
template <class Measurement>
struct OfCalibratedPose {
  static constexpr int kDimension = Measurement::kDimension;
  static constexpr auto kTouches = Measurement::kTouches;
  Measurement of_pose;

  [[nodiscard]] auto predict(const CalibratedPose& at) const { return of_pose.predict(at.pose); }
  [[nodiscard]] auto residual(const filter::Vector<float, kDimension>& z_hat) const { return of_pose.residual(z_hat); }
  [[nodiscard]] auto noise() const { return of_pose.noise(); }
  [[nodiscard]] auto jacobian(const CalibratedPose& at) const { return of_pose.jacobian(at.pose); }
};

}  // namespace tetap::model
