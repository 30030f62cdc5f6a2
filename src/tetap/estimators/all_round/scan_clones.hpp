// SPDX-License-Identifier: Apache-2.0
// Scanner poses of two earlier stamps beside an inertial filter, with all covariances: keyframe and latest scan. What a
// match finds of the displacement between them corrects the present. Source: Roumeliotis & Burdick, "Stochastic
// cloning", ICRA 2002. The clones ride along as fault hypotheses do (trust/fault_bank.hpp): a column of covariances
// with the filter's errors moves by F, and every update passes.
//
// The scanner's yaw on its mount is one more error, the same for all scans.
#pragma once

#include "tetap/base/anchored.hpp"
#include "tetap/base/members.hpp"
#include "tetap/estimators/estimate.hpp"
#include "tetap/nav/ins.hpp"
#include "tetap/slam/planar_motion.hpp"
#include "tetap/trust/inertial_faults.hpp"

#include <array>
#include <cstddef>
#include <type_traits>

namespace tetap::estimators {

/// Displacement d as a match found it: a likelihood of exp(-1/2 e^T information e + e^T weighted), e = d - about.
/// Directions in which the walls hold nothing have no information.
struct DisplacementLikelihood {
  slam::Displacement<float> about;
  filter::Symmetric<float, 3> information;  ///< inverse of the covariance; axes of the first pose, m, rad
  std::array<float, 3> weighted{};
  /// That which leads from the prior to the posterior. None where a covariance has no inverse.
  [[nodiscard]] static DisplacementLikelihood between(const slam::UncertainDisplacement<float>& prior,
                                                      const slam::UncertainDisplacement<float>& posterior);
};

class ScanClones {
 public:
  static constexpr int kErrors = nav::InsState::kErrors;
  static constexpr float kMount_rad = 0.005F;  ///< 1 sigma of the yaw of a mount that was measured by hand
  using Step = slam::UncertainDisplacement<float>;

  ScanClones() { p_(kMount, kMount) = kMount_rad * kMount_rad; }

  /// The filter is another one now. The mount is the same.
  void forget();
  [[nodiscard]] bool has_keyframe() const { return keyframe_held_; }
  [[nodiscard]] bool has_scan() const { return scan_held_; }
  /// The scanner's pose of `later_s` after the state, whose covariance is up to date, is that of the latest scan.
  void take_scan(const nav::Ins& ins, float later_s, float yaw_rate_radps, const slam::Displacement<float>& mounting);
  /// The latest scan is the keyframe.
  void keep_scan();
  /// The scan as seen from the keyframe.
  [[nodiscard]] Step displacement() const;
  /// The yaw of the scanner on its mount, beyond the drawing.
  [[nodiscard]] float mount_rad() const { return mount_rad_; }
  [[nodiscard]] float mount_sigma_rad() const { return base::sqrt(p_(kMount, kMount)); }

  /// Changes nothing unless the verdict is kAccepted. The covariance of `ins` is up to date.
  [[nodiscard]] Innovation fuse(nav::Ins& ins, const DisplacementLikelihood& z, float gate_scale);

  /// The body turned by so much more than the filter has it since the keyframe, 1 sigma: an error of the gyroscope's
  /// bias. Nothing is taken out of a covariance.
  void widen_turn(nav::Ins& ins, float sigma_rad, float interval_s);

  // Interface of a hypothesis of nav::Ins.
  void predict(const nav::InsCovarianceStep<float>& step) {
    for (Column& one : column_) trust::InertialFaults::predict({}, one, step);
  }
  void turn_tilt(float up_rad) {
    const base::SinCos by = base::sincos(up_rad);
    for (Column& one : column_) {
      float &east = one[nav::InsState::kAttitude], &north = one[nav::InsState::kAttitude + 1];
      const float was = east;
      east = by.cos * was - by.sin * north;
      north = by.cos * north + by.sin * was;
    }
  }
  template <std::size_t M>
  class Pass {
   public:
    template <class Measurement, class Jacobian>
    Pass(ScanClones& clones, const Measurement&, const Jacobian& h)
        : clones_(clones),
          seen_{.h = entries(h),
                .touches = Measurement::kTouches.data(),
                .columns = Measurement::kTouches.size(),
                .shown = {}} {
      if constexpr (std::is_same_v<Jacobian, filter::IdentityJacobian>) seen_.columns = M;
    }
    template <class Vector>
    void innovation(const trust::Factor<M>& l, const Vector& y, const auto&) {
      seen_.l = l;
      for (std::size_t m = 0; m < M; ++m) seen_.y[m] = y(static_cast<int>(m));
    }
    template <class Gains>
    void gains(const Gains& g) {
      clones_.template pass_update<M>(seen_, g.value.data());
    }

   private:
    [[nodiscard]] static const float* entries(const filter::IdentityJacobian&) { return trust::kIdentity<M>.data(); }
    template <class Matrix>
    [[nodiscard]] static const float* entries(const Matrix& h) {
      return h.data();
    }
    ScanClones& clones_;
    trust::Seen<M> seen_;
  };
  template <class Measurement>
  [[nodiscard]] Pass<static_cast<std::size_t>(Measurement::kDimension)> pass(const Measurement& z, const auto& h) {
    return {*this, z, h};
  }

  static constexpr auto members(auto& self) {
    return base::members(base::in_turns(self.column_), base::in_turns(self.p_), self.keyframe_, self.scan_,
                         self.mount_rad_, self.keyframe_held_, self.scan_held_);
  }

 private:
  using Column = std::array<float, kErrors>;
  static constexpr int kKeyframe = 0, kScan = 3, kMount = 6, kAll = 7;
  static constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }

  struct Pose {
    base::Anchored x, y;
    float yaw_rad = 0;
  };
  /// Both poses and the mount move by a correction of their errors.
  void move(const std::array<float, kAll>& dx);

  template <std::size_t M>
  void pass_update(const trust::Seen<M>& z, const float* gains) {
    std::array<std::array<float, M>, kAll> w{};
    std::array<float, kAll> dx{};
    for (std::size_t i = 0; i < kAll; ++i) {
      Column& one = column_[i];
      for (std::size_t k = 0; k < z.columns; ++k)
        for (std::size_t m = 0; m < M; ++m) w[i][m] += z.h[k * M + m] * one[at(z.touches[k])];
      filter::whiten(z.l, w[i]);
      for (std::size_t m = 0; m < M; ++m) {
        dx[i] += w[i][m] * z.y[m];
        for (std::size_t n = 0; n < kErrors; ++n) one[n] -= gains[n * M + m] * w[i][m];
      }
    }
    for (int c = 0; c < kAll; ++c)
      for (int r = 0; r <= c; ++r)
        for (std::size_t m = 0; m < M; ++m) p_(r, c) -= w[at(r)][m] * w[at(c)][m];
    move(dx);
  }

  /// Covariances of the filter's errors with those of x, y, yaw of the keyframe, of the scan, and of the mount.
  std::array<Column, kAll> column_{};
  filter::Symmetric<float, kAll> p_;
  Pose keyframe_, scan_;
  float mount_rad_ = 0;
  bool keyframe_held_ = false, scan_held_ = false;
};

/// Clones in place of hypotheses of faults, for an inertial filter that takes scans.
class CloneWatch {
 public:
  static constexpr bool kWatches = true;
  [[nodiscard]] ScanClones& bank() { return clones_; }
  [[nodiscard]] const ScanClones& bank() const { return clones_; }
  void begin() { clones_.forget(); }
  static void judge(float) {}
  static void publish(const nav::Ins::Covariance&) {}
  [[nodiscard]] static const nav::Ins::Covariance& published_p(const nav::Ins::Covariance& p) { return p; }
  static constexpr auto members(auto& self) { return base::members(self.clones_); }

 private:
  ScanClones clones_;
};

}  // namespace tetap::estimators
