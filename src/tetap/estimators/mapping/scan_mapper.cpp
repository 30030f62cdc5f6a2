// SPDX-License-Identifier: Apache-2.0
#include "tetap/estimators/mapping/scan_mapper.hpp"

#include "tetap/base/reinitialise.hpp"
#include "tetap/estimators/mapping/map_pose.hpp"
#include "tetap/estimators/scanner.hpp"

namespace tetap::estimators {

template <int kBeams, int kFrames, class Graph, int kKept, int kScans>
void ScanMapper<kBeams, kFrames, Graph, kKept, kScans>::restart(base::Micros t, const Context& ctx) {
  odometer_.restart(t, ctx);
  mapper_.restart(t, ctx);
  base::reinitialise(closures_);
  digest_.restart();
}

template <int kBeams, int kFrames, class Graph, int kKept, int kScans>
void ScanMapper<kBeams, kFrames, Graph, kKept, kScans>::set_pose(base::Micros t, const SetPose& given,
                                                                 const Context& ctx) {
  // The latest keyframe is as far behind the robot as it was.
  const slam::Displacement<float> back =
      slam::GraphPose<float>{}.minus(slam::GraphPose<float>{}.plus(odometer_.since_keyframe(t, ctx)));
  SetPose keyframe = given;
  if (!(given.sigma_yaw_rad < 3.14F))
    keyframe.pose.yaw_rad = planar_pose(mapper_.step_pose()).yaw_rad - back.yaw.radians();
  keyframe.pose = planar_pose(graph_pose<float>(keyframe.pose).plus(back));
  mapper_.set_pose(t, keyframe, ctx);
  follow_graph();
}

template <int kBeams, int kFrames, class Graph, int kKept, int kScans>
void ScanMapper<kBeams, kFrames, Graph, kKept, kScans>::reset_own_map() {
  mapper_.reset_own_map();
  closures_.reset();
}

template <int kBeams, int kFrames, class Graph, int kKept, int kScans>
void ScanMapper<kBeams, kFrames, Graph, kKept, kScans>::advance(base::Micros t, const Context& ctx,
                                                                const sensor::Window& window) {
  odometer_.advance(t, ctx, window);
  mapper_.advance(t);
  digest_.scan(Closures::elements(), 1, [this](std::size_t i, auto& sink) { closures_.hash_element(i, sink); });
}

template <int kBeams, int kFrames, class Graph, int kKept, int kScans>
Innovation ScanMapper<kBeams, kFrames, Graph, kKept, kScans>::fuse(const sensor::PlanarScan& scan, base::Micros stamp,
                                                                   std::uint8_t instance, const Context& ctx) {
  const Innovation innovation = odometer_.fuse(scan, stamp, instance, ctx);
  if (innovation.verdict == sensor::Verdict::kPending)
    closures_.hold(scan_geometry(scan, ctx.parameters.lidar), ctx.scans->ranges(scan), odometer_.scanner_motion());
  return innovation;
}

template <int kBeams, int kFrames, class Graph, int kKept, int kScans>
void ScanMapper<kBeams, kFrames, Graph, kKept, kScans>::work(std::uint32_t units, const Context& ctx) {
  if (odometer_.busy()) {
    odometer_.work(units, ctx);
    if (!odometer_.take_new_keyframe()) return;
    if (!mapper_.step(closures_.widened(odometer_.keyframe_step()), odometer_.keyframe_stamp())) return;
    closures_.add(mapper_.keyframes(), odometer_.keyframe_scan(), scanner_mounting(ctx.parameters.lidar));
  } else if (!mapper_.idle()) {
    mapper_.work(kGraphUnits * units, ctx);
  } else {
    closures_.work(static_cast<int>(units), mapper_.keyframes());
  }
  follow_graph();
}

template <int kBeams, int kFrames, class Graph, int kKept, int kScans>
void ScanMapper<kBeams, kFrames, Graph, kKept, kScans>::abort_job() {
  odometer_.abort_job();
  mapper_.abort_job();
  closures_.cancel();
}

template <int kBeams, int kFrames, class Graph, int kKept, int kScans>
void ScanMapper<kBeams, kFrames, Graph, kKept, kScans>::follow_graph() {
  odometer_.move_keyframe(mapper_.step_pose(), mapper_.covariance());
}

template class ScanMapper<361, 4, Graph192, 181, 192>;

}  // namespace tetap::estimators
