// SPDX-License-Identifier: Apache-2.0
// The flash image of a robot whose estimator and sensors are a Netduino Plus 2, which QEMU knows.
#include "hal/board/netduinoplus2/board.hpp"
#include "hal/board/wired_node.hpp"

int main() { tetap::hal::run_wired_node<tetap::hal::netduinoplus2::Board>(); }
