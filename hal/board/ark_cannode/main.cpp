// SPDX-License-Identifier: Apache-2.0
// The flash image of a robot whose estimator and sensors are an ARK CANnode.
#include "hal/board/ark_cannode/board.hpp"
#include "hal/board/wired_node.hpp"

int main() { tetap::hal::run_wired_node<tetap::hal::ark_cannode::Board>(); }
