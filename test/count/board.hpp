// SPDX-License-Identifier: Apache-2.0
// The board that a counting image is built for.
#pragma once

#if defined(TETAP_BOARD_ZYNQMP_R5)
#include "hal/board/zynqmp_r5/board.hpp"
using Board = tetap::hal::zynqmp_r5::Board;
#else
#include "hal/board/mps2/board.hpp"
using Board = tetap::hal::mps2::Board;
#endif
