// SPDX-License-Identifier: Apache-2.0
// Start and handlers of the Nucleo-G474RE.
#include "hal/board/nucleo_g474re/board.hpp"

namespace tetap::hal {
namespace started = nucleo_g474re;
}

#include "hal/chip/arm/cortex_m4_startup.hpp"
