// SPDX-License-Identifier: Apache-2.0
// A point from its directions in several views of known poses: Gauss-Newton on (x/z, y/z, 1/z) in the first view, where
// far points are as linear as near ones (Mourikis & Roumeliotis 2007, appendix; Civera, Davison, Montiel 2008).
#pragma once

#include "tetap/model/camera.hpp"

#include <span>

namespace tetap::slam {

/// A view as seen from the first one: a point a of the first camera is r a + d here.
struct RelativeView {
  nav::Matrix3 r = nav::Matrix3::Identity();
  nav::Vector3 d_m = nav::Vector3::Zero();
  model::ImagePoint seen;
};

enum class DepthFate : std::uint8_t {
  kSought,      ///< iterations are not over
  kFound,       ///< depth between the limits, its sigma below its value
  kBehind,      ///< the point left the space in front of a view
  kSingular,    ///< the views do not hold the point: no parallax
  kUncertain,   ///< sigma of the inverse depth is above its value
  kOutOfRange,  ///< nearer or farther than the limits
};

class InverseDepth {
 public:
  static constexpr int kIterations = 6;
  static constexpr float kNearest_m = 0.5F, kFarthest_m = 300.0F;

  /// From the direction in the first view, 20 m away.
  explicit InverseDepth(model::ImagePoint first = {}) : x_(first.x), y_(first.y) {}

  [[nodiscard]] DepthFate fate() const { return fate_; }
  [[nodiscard]] int iterations() const { return iteration_; }
  [[nodiscard]] float inverse_depth_per_m() const { return w_per_m_; }
  [[nodiscard]] float sigma_per_m() const { return sigma_per_m_; }
  /// The point in the first camera's axes. Meaningful when found.
  [[nodiscard]] nav::Vector3 point_m() const { return nav::Vector3{x_, y_, 1.0F} * (1.0F / w_per_m_); }

  /// One step of Gauss-Newton over all views. `sigma` is the noise of a direction, as a tangent.
  void iterate(std::span<const RelativeView> views, float sigma) {
    if (fate_ != DepthFate::kSought) return;
    ++iteration_;
    Normal n;
    for (const RelativeView& view : views)
      if (!n.add(view, x_, y_, w_per_m_)) return end(DepthFate::kBehind);
    // L D L^T of the normal equations; the last pivot is the information of the inverse depth.
    const float d0 = n.xx;
    if (!(d0 > 0.0F)) return end(DepthFate::kSingular);
    const float l1 = n.xy / d0, l2 = n.xw / d0, d1 = n.yy - l1 * n.xy;
    if (!(d1 > 0.0F)) return end(DepthFate::kSingular);
    const float m2 = (n.yw - l2 * n.xy) / d1, d2 = n.ww - l2 * n.xw - m2 * (n.yw - l2 * n.xy);
    if (!(d2 > kLeastShare * n.ww) || !(d2 < 1e30F)) return end(DepthFate::kSingular);
    const float by = n.by - l1 * n.bx, bw = n.bw - l2 * n.bx - m2 * by;
    // A first step from 20 m to a near point may go past the cameras: a step makes it three times nearer at most.
    const float most = 2.0F * base::max(w_per_m_, 0.05F), full = bw / d2, dw = full > most ? most : full;
    const float dy = by / d1 - m2 * dw, dx = n.bx / d0 - l1 * dy - l2 * dw;
    x_ += dx;
    y_ += dy;
    w_per_m_ += dw;
    sigma_per_m_ = sigma / base::sqrt(d2);
    const bool settled = iteration_ > 2 && base::abs(dw) < 1e-5F + 1e-3F * base::abs(w_per_m_);
    if (settled || iteration_ == kIterations) judge();
  }

 private:
  /// Smallest part of the inverse depth's information that float separates from the elimination's rounding.
  static constexpr float kLeastShare = 1e-6F;

  struct Normal {
    float xx = 0, xy = 0, yy = 0, xw = 0, yw = 0, ww = 0, bx = 0, by = 0, bw = 0;

    bool add(const RelativeView& view, float x, float y, float w) {
      const nav::Vector3 along = view.r * nav::Vector3{x, y, 1.0F};
      const model::Projection p(nav::Vector3(along + w * view.d_m));
      if (!p.seen) return false;
      const filter::Matrix<float, 2, 2> of_xy = p.h * view.r.leftCols<2>();
      const filter::Vector<float, 2> of_w = p.h * view.d_m, e{view.seen.x - p.at.x, view.seen.y - p.at.y};
      for (int i = 0; i < 2; ++i) {
        xx += of_xy(i, 0) * of_xy(i, 0);
        xy += of_xy(i, 0) * of_xy(i, 1);
        yy += of_xy(i, 1) * of_xy(i, 1);
        xw += of_xy(i, 0) * of_w(i);
        yw += of_xy(i, 1) * of_w(i);
        ww += of_w(i) * of_w(i);
        bx += of_xy(i, 0) * e(i);
        by += of_xy(i, 1) * e(i);
        bw += of_w(i) * e(i);
      }
      return true;
    }
  };

  void end(DepthFate fate) { fate_ = fate; }
  void judge() {
    if (!(sigma_per_m_ < w_per_m_)) return end(DepthFate::kUncertain);
    const bool inside = w_per_m_ > 1.0F / kFarthest_m && w_per_m_ < 1.0F / kNearest_m;
    end(inside ? DepthFate::kFound : DepthFate::kOutOfRange);
  }

  float x_, y_, w_per_m_ = 0.05F, sigma_per_m_ = 0;
  std::int32_t iteration_ = 0;
  DepthFate fate_ = DepthFate::kSought;
};

}  // namespace tetap::slam
