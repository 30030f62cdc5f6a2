// SPDX-License-Identifier: Apache-2.0
// Start and handlers of the ARK CANnode.
#include "hal/board/ark_cannode/board.hpp"

namespace tetap::hal {
namespace started = ark_cannode;
}

#include "hal/chip/arm/cortex_m4_startup.hpp"
