// SPDX-License-Identifier: Apache-2.0
// Everything of the library that is compiled, in one file: a program adds it to its own sources, and its own flags
// hold. Not part of this tree's own builds, which compile each group apart (src/CMakeLists.txt).
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"  // designated initialisers leave the rest to the defaults

#define TETAP_ESTIMATORS_TOGETHER

#include "tetap/estimators/all_round/all_round.cpp"
#include "tetap/estimators/all_round/scan_clones.cpp"
#include "tetap/estimators/all_round/with_clones.cpp"
#include "tetap/estimators/attitude.cpp"
#include "tetap/estimators/inertial/fuse_forward.cpp"
#include "tetap/estimators/inertial/fuse_gnss.cpp"
#include "tetap/estimators/inertial/fuse_heading.cpp"
#include "tetap/estimators/inertial/output.cpp"
#include "tetap/estimators/inertial/output_predictor.cpp"
#include "tetap/estimators/inertial/propagation.cpp"
#include "tetap/estimators/inertial/start.cpp"
#include "tetap/estimators/inertial/tick.cpp"
#include "tetap/estimators/inertial/with_watch.cpp"
#include "tetap/estimators/mapping/graph_mapper.cpp"
#include "tetap/estimators/mapping/planar_mapper.cpp"
#include "tetap/estimators/mapping/scan_localizer.cpp"
#include "tetap/estimators/mapping/scan_mapper.cpp"
#include "tetap/estimators/mapping/scan_odometry.cpp"
#include "tetap/estimators/planar/dead_reckoning.cpp"
#include "tetap/estimators/planar/pose_clones.cpp"
#include "tetap/estimators/planar/pose_filter.cpp"
#include "tetap/estimators/planar/pose_grid.cpp"
#include "tetap/estimators/planar/pose_particles.cpp"
#include "tetap/estimators/planar/position_fusion.cpp"
#include "tetap/estimators/target/target_tracker.cpp"
#include "tetap/estimators/visual/visual_odometry.cpp"

namespace tetap::estimators {

template class InertialWith<CloneWatch>;

}  // namespace tetap::estimators
