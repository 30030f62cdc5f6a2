// SPDX-License-Identifier: Apache-2.0
// Data that lie in the image beside the board: the record that a fault handler leaves for the next start.
#pragma once

#include "hal/chip/arm/stored_fault.hpp"

namespace tetap::hal::ark_cannode {

extern StoredFault stored_fault;

}  // namespace tetap::hal::ark_cannode
