// SPDX-License-Identifier: Apache-2.0
// The flash image of a robot whose estimator and sensors are a Nucleo-G474RE.
#include "hal/board/nucleo_g474re/board.hpp"
#include "hal/board/wired_node.hpp"

int main() { tetap::hal::run_wired_node<tetap::hal::nucleo_g474re::Board>(); }
