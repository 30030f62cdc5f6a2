// SPDX-License-Identifier: Apache-2.0
// The inertial filter with clones of its pose. Its own files are compiled here once more, apart from the filters
// without clones: seen together, functions that they share would no longer be inlined there.
#include "tetap/estimators/all_round/scan_clones.hpp"
#ifndef TETAP_ESTIMATORS_TOGETHER  // tetap/estimators.cpp has these files already
// NOLINTBEGIN(bugprone-suspicious-include)
#include "tetap/estimators/inertial/fuse_forward.cpp"
#include "tetap/estimators/inertial/fuse_gnss.cpp"
#include "tetap/estimators/inertial/fuse_heading.cpp"
#include "tetap/estimators/inertial/output.cpp"
#include "tetap/estimators/inertial/propagation.cpp"
#include "tetap/estimators/inertial/start.cpp"
#include "tetap/estimators/inertial/tick.cpp"
// NOLINTEND(bugprone-suspicious-include)

namespace tetap::estimators {

template class InertialWith<CloneWatch>;

}  // namespace tetap::estimators
#endif
