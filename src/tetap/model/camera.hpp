// SPDX-License-Identifier: Apache-2.0
// An ideal pinhole camera (Hartley & Zisserman 2004, sec. 6.1): axes z along the view, x right, y down. Pixels are free
// of distortion; the side that makes them removes it.
#pragma once

#include "tetap/nav/so3.hpp"

#include <cstdint>

namespace tetap::model {

/// A direction in the camera's axes: (x/z, y/z).
struct ImagePoint {
  float x = 0, y = 0;
};

/// A feature of an image, as the bus has it: pixels in quarters.
struct ImageFeature {
  std::uint16_t id = 0, u_quarter_px = 0, v_quarter_px = 0;
};

/// Focal lengths and the point that the axis meets, in pixels.
struct PinholeCamera {
  float fu_px = 0, fv_px = 0, cu_px = 0, cv_px = 0;

  [[nodiscard]] bool valid() const {
    return base::is_finite(fu_px) && base::is_finite(fv_px) && fu_px > 1.0F && fv_px > 1.0F && base::is_finite(cu_px) &&
           base::is_finite(cv_px);
  }
  /// Direction of a pixel in quarters, as the bus has it.
  [[nodiscard]] ImagePoint direction(std::uint16_t u_quarter_px, std::uint16_t v_quarter_px) const {
    return {(0.25F * static_cast<float>(u_quarter_px) - cu_px) / fu_px,
            (0.25F * static_cast<float>(v_quarter_px) - cv_px) / fv_px};
  }
};

/// Where the camera sits in the body.
struct CameraMounting {
  nav::Quaternion q_cb;                           ///< rotates b into the camera's axes
  nav::Vector3 lever_b_m = nav::Vector3::Zero();  ///< the camera in b

  [[nodiscard]] nav::Vector3 to_camera(const nav::Vector3& point_b_m) const {
    return q_cb.rotate(point_b_m - lever_b_m);
  }
};

/// A point of the camera's axes as it is seen, with the derivative of the direction with respect to the point.
struct Projection {
  static constexpr float kNearest_m = 0.05F;
  ImagePoint at;
  filter::Matrix<float, 2, 3> h = filter::Matrix<float, 2, 3>::Zero();
  bool seen = false;  ///< the point is in front of the camera

  explicit Projection(const nav::Vector3& point_c_m) {
    if (!(point_c_m(2) > kNearest_m)) return;
    const float inverse = 1.0F / point_c_m(2);
    at = {point_c_m(0) * inverse, point_c_m(1) * inverse};
    h << inverse, 0.0F, -at.x * inverse, 0.0F, inverse, -at.y * inverse;
    seen = true;
  }
};

}  // namespace tetap::model
