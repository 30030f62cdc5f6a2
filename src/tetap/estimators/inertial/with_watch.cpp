// SPDX-License-Identifier: Apache-2.0
// Inertial navigation: both kinds of it. The last file of its group (src/CMakeLists.txt), by its name: what the others
// define is made here.
#include "tetap/estimators/inertial/inertial.hpp"

namespace tetap::estimators {

template class InertialWith<NoWatch>;
template class InertialWith<FaultWatch>;

}  // namespace tetap::estimators
