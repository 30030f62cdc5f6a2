// SPDX-License-Identifier: Apache-2.0
// Start and handlers of the Netduino Plus 2.
#include "hal/board/netduinoplus2/board.hpp"

namespace tetap::hal {
namespace started = netduinoplus2;
}

#include "hal/chip/arm/cortex_m4_startup.hpp"
