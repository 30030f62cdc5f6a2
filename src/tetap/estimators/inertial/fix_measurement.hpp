// SPDX-License-Identifier: Apache-2.0
// A fix against the filter: innovation and its normalised square, of the whole fix and of its horizontal part alone.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/filter/update.hpp"
#include "tetap/model/gnss_fix_3d.hpp"
#include "tetap/nav/ins.hpp"
#include "tetap/param/parameters.hpp"

#include <array>

namespace tetap::estimators {

struct FixStatistics {
  float joint_nis = base::kNan;        ///< 3 degrees of freedom
  float horizontal_nis = base::kNan;   ///< 2 degrees of freedom
  std::array<float, 2> expected_m2{};  ///< variances to east and north of where the filter expects the antenna
};

/// Covariance of where the filter expects the antenna, lower half. H is (1 A) over position and attitude, A v = v x
/// lever.
[[nodiscard]] inline nav::Matrix3 antenna_covariance(const nav::Ins::Covariance& p, const nav::Vector3& lever_n_m) {
  constexpr int kTilt = model::GnssFix3d::kTouches[3];
  const auto tilt_with = [&p](int c) { return nav::Vector3(p(kTilt, c), p(kTilt + 1, c), p(kTilt + 2, c)); };
  std::array<nav::Vector3, 3> rows;  // of A P over attitude, then of A times its transpose
  for (int c = 0; c < 3; ++c) {
    const nav::Vector3 column = nav::cross(tilt_with(kTilt + c), lever_n_m);
    for (int i = 0; i < 3; ++i) rows[static_cast<std::size_t>(i)](c) = column(i);
  }
  nav::Matrix3 s;
  for (int i = 0; i < 3; ++i) {
    const nav::Vector3 own = nav::cross(rows[static_cast<std::size_t>(i)], lever_n_m);
    for (int j = 0; j <= i; ++j) s(i, j) = p(i, j) + own(j);
  }
  for (int c = 0; c < 3; ++c) {
    const nav::Vector3 seen = nav::cross(tilt_with(c), lever_n_m);  // row, with the position's column c
    for (int i = 0; i < 3; ++i) {
      if (i >= c) s(i, c) += seen(i);
      if (i <= c) s(c, i) += seen(i);
    }
  }
  return s;
}

/// S = H P H^T + R = L L^T, y = L^-1 nu: with up last, the horizontal part's NIS is on the way to the joint one.
[[gnu::noinline]] inline FixStatistics fix_statistics(const nav::Ins::Covariance& p, const nav::Vector3& lever_n_m,
                                                      const nav::Vector3& nu, const nav::Vector3& r) {
  const nav::Matrix3 s = antenna_covariance(p, lever_n_m);
  nav::Matrix3 l;
  nav::Vector3 y;
  FixStatistics result{.expected_m2 = {s(0, 0), s(1, 1)}};
  float sum = 0;
  for (int i = 0; i < 3; ++i) {
    y(i) = nu(i);
    for (int j = 0; j <= i; ++j) {
      float rest = i == j ? s(i, i) + r(i) : s(i, j);
      for (int k = 0; k < j; ++k) rest -= l(i, k) * l(j, k);
      if (j < i) {
        l(i, j) = rest / l(j, j);
        y(i) -= l(i, j) * y(j);
      } else {
        if (!(rest > 0.0F)) return {};
        l(i, i) = base::sqrt(rest);
        y(i) /= l(i, i);
      }
    }
    sum += y(i) * y(i);
    if (i == 1) result.horizontal_nis = sum;
  }
  result.joint_nis = sum;
  return result;
}

/// A fix at the time of the last IMU sample, with its test statistics.
struct FixMeasurement {
  static constexpr float kNoHeight_m = 1e3F;  ///< sigma of a height that is not there
  /// A fix decides where the filter is when the filter's variance is so many times that of the fix.
  static constexpr float kDecides = 4.0F;

  nav::Vector3 nu = nav::Vector3::Zero();  ///< innovation: east, north, up
  nav::Vector3 r = nav::Vector3::Zero();   ///< variances of the fix
  FixStatistics statistics;
};

[[nodiscard]] inline float fix_gate(const param::GnssParameters& n, int dof) {
  return n.gate_scale * filter::chi_square_99(dof);
}

}  // namespace tetap::estimators
