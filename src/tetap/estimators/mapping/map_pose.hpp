// SPDX-License-Identifier: Apache-2.0
// Poses of a graph as poses of the map, and back; covariances in another precision.
#pragma once

#include "tetap/model/planar_pose.hpp"
#include "tetap/slam/planar_motion.hpp"

#include <cstdint>

namespace tetap::estimators {

/// A place of the graph in the micrometres of the map: a unit of 2^-10 m is 15625 / 16 um.
template <class Scalar>
[[nodiscard]] base::Anchored anchored(const slam::Coordinate<Scalar>& c) {
  const std::int64_t sixteenths = std::int64_t{c.unit} * 15'625;
  const std::int64_t um = (sixteenths - (sixteenths < 0 ? 15 : 0)) / 16;
  return base::Anchored::from_um(um).plus(static_cast<float>(sixteenths - 16 * um) * 0.0625e-6F +
                                          static_cast<float>(c.rest_m));
}
template <class Scalar>
[[nodiscard]] slam::Coordinate<Scalar> coordinate(const base::Anchored& a) {
  const std::int64_t units = a.anchor_um * 16 / 15'625;
  const std::int64_t rest_sixteenths = a.anchor_um * 16 - units * 15'625;
  const slam::Coordinate<Scalar> whole{.unit = static_cast<std::int32_t>(units), .rest_m = 0};
  return whole.plus(static_cast<Scalar>(rest_sixteenths) * static_cast<Scalar>(0.0625e-6) +
                    static_cast<Scalar>(a.offset_m));
}
template <class Scalar>
[[nodiscard]] slam::GraphPose<Scalar> graph_pose(const model::PlanarPose& pose) {
  return {.x = coordinate<Scalar>(pose.x),
          .y = coordinate<Scalar>(pose.y),
          .yaw = slam::Heading<Scalar>::from_radians(static_cast<Scalar>(pose.yaw_rad))};
}
template <class Scalar>
[[nodiscard]] model::PlanarPose planar_pose(const slam::GraphPose<Scalar>& pose) {
  return {.x = anchored(pose.x), .y = anchored(pose.y), .yaw_rad = static_cast<float>(pose.yaw.radians())};
}
template <class To, class From>
[[nodiscard]] filter::Symmetric<To, 3> cast(const filter::Symmetric<From, 3>& from) {
  filter::Symmetric<To, 3> to;
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r <= c; ++r) to(r, c) = static_cast<To>(from(r, c));
  return to;
}
template <class Scalar>
[[nodiscard]] filter::Symmetric<Scalar, 3> sum_of(const filter::Symmetric<Scalar, 3>& a,
                                                  const filter::Symmetric<Scalar, 3>& b) {
  filter::Symmetric<Scalar, 3> sum = a;
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r <= c; ++r) sum(r, c) += b(r, c);
  return sum;
}

}  // namespace tetap::estimators
