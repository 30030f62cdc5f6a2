// SPDX-License-Identifier: Apache-2.0
// The inertial filter with clones of its pose. The last file of its group (src/CMakeLists.txt): what the files of the
// inertial filter define is made here.
#include "tetap/estimators/all_round/scan_clones.hpp"
#include "tetap/estimators/inertial/inertial.hpp"

namespace tetap::estimators {

template class InertialWith<CloneWatch>;

}  // namespace tetap::estimators
